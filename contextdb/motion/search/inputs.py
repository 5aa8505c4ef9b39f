"""What a motion database is made of, checked: the features of clips, or features as they are."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from contextdb.cells.arguments import require_kind, require_many, require_text
from contextdb.errors import Fault, MotionError, in_quotes
from contextdb.motion import arguments
from contextdb.motion.arguments import Flags
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.feet import NO_MARKS
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.features.extraction import ClipFeatures, clip_permutations
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.markup.markup import Markup
from contextdb.motion.search.layout import Features


def parts_of(
    clips: Iterable[Clip], schema: FeatureSchema, mirror: bool | Collection[str] = False, markup: Markup | None = None
) -> list[ClipFeatures]:
    """The features of each clip in all its permutations, and of those to be mirrored once more; the faults of all clips together.

    Clips that loop by the markup go on at their ends, and feet that it marks are down just then.
    """
    parts = []
    faults: list[Fault] = []
    seen: set[str] = set()
    for name in () if isinstance(mirror, bool) else require_many(mirror, "mirror", "True, False, or the names of clips"):
        require_text(name, "one of mirror")
    for clip in require_many(clips, "clips", "a list of Clip"):
        require_kind(clip, Clip, "one of clips", "a Clip")
        if clip.name in seen:
            faults.append(
                Fault(f"two clips are named {in_quotes(clip.name)}.", "a different name for each asset", rule="duplicate")
            )
        seen.add(clip.name)
        is_mirrored = mirror if isinstance(mirror, bool) else clip.name in mirror
        try:
            looping = markup is not None and markup.is_looping(clip.name)
            ways = (False, True) if is_mirrored else (False,)
            marks = NO_MARKS if markup is None else markup.contacts_of(clip.name)
            for way in ways:
                parts += clip_permutations(clip, schema, mirrored=way, looping=looping, contacts=marks)
        except MotionError as error:
            faults.extend(error.faults)
    if faults:
        raise MotionError(*faults)
    return parts


def as_features(features: ArrayLike) -> Features:
    """Features as they are given: float32, frames x features."""
    array = arguments.array_of(features, "the features", MotionError)
    if array.ndim != 2:
        raise MotionError(Fault(f"the features have shape {array.shape}.", "frames x features"))
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(array, np.float32)


def check_permutations(parts: Sequence[ClipFeatures], schema: FeatureSchema) -> None:
    """Refuse parts that are not all permutations of a clip, then all of the next."""
    n = len(schema.permutation_s)
    for first in range(0, len(parts), n):
        same = {(part.asset, part.mirrored, len(part.features)) for part in parts[first : first + n]}
        if len(same) > 1 or len(parts) - first < n:
            problem = f"the features of {in_quotes(parts[first].asset)} are not those of its {n} permutations."
            raise MotionError(Fault(problem, "all that `clip_permutations` gives of a clip, in order"))


def check_finite(features: Features, starts: Ints, stops: Ints, assets: Sequence[str]) -> None:
    """Refuse features that are not finite inside a range; what lies between ranges is never looked at."""
    is_wrong: Flags = np.logical_not(np.isfinite(features).all(axis=1))
    for i, (start, stop) in enumerate(zip(starts.tolist(), stops.tolist(), strict=True)):
        if is_wrong[start:stop].any():
            frame = start + int(np.argmax(is_wrong[start:stop]))
            feature = int(np.argmin(np.isfinite(features[frame])))
            problem = f"feature {feature} of frame {frame} is {features[frame, feature]} (range {i}, asset {in_quotes(assets[i])})."
            raise MotionError(Fault(problem, "finite numbers within every range"))
