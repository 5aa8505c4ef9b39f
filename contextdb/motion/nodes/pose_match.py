"""Pose matching: at which time to start an animation so that it continues from the pose the body is in.

The pose is that of a few bones, feet and hips as a rule, their positions weighed more than their velocities: it finds the phase of
an animation. With hands, it lets a left swing follow a right one without anybody setting up a sequence. The search is that of
`MotionDatabase`; this makes the schema for it and says which part of which clip counts:

    the whole of a looping clip      it does not matter where it starts
    the entrance of a scripted one   `within`, or a match range in the markup
    the best of several clips        `assets`

Source: "Pose Matching", on transitions without sync markers: position and velocity differences of feet and hips, the positions
prioritised.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from contextdb.cells.arguments import as_number, require_kind, require_many, require_text
from contextdb.errors import Fault, MotionError, QueryError, in_quotes, mend_for, some
from contextdb.motion.answers import Answer, is_answer
from contextdb.motion.arguments import Valid
from contextdb.motion.clips.foot_bones import feet_of
from contextdb.motion.clips.mirror import Pairs
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton, sided_pairs
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.markup.span_faults import TOLERANCE_S
from contextdb.motion.markup.tag_filter import TagFilter
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filtering import Penalties
from contextdb.motion.search.hit import Hit

HAND_WORDS = ("hand", "wrist")

Span = tuple[float, float]
"""From and to, in seconds since an asset's start, both within; `to` may be infinite."""


def pose_schema(
    skeleton: Skeleton,
    bones: Sequence[str] | None = None,
    *,
    hands: bool = False,
    position_weight: float = 1.0,
    velocity_weight: float = 0.5,
    rate: float = 30.0,
    name: str = "pose",
    mirror: Pairs = (),
) -> FeatureSchema:
    """A schema that compares poses: where some bones are and how fast they move.

    A metre counts the same for every bone, and so does a metre a second.

    Parameters
    ----------
    skeleton : Skeleton
    bones : sequence of str, optional
        Default: feet and hips, found by the skeleton's names and joints.
    hands : bool
        Whether the hands count too, as in a fight.
    position_weight, velocity_weight : float
        Of each bone. The positions should weigh more.
    rate : float
        Frames a second.
    name : str
    mirror : tuple of (left, right)
        As in `FeatureSchema`, for clips that shall be there mirrored too.

    Raises
    ------
    MotionError
        A bone that the skeleton lacks, with the nearest that it has, or feet or hands that are not found by their names.
    SchemaError
        A weight or a rate that is out of range, or a bone named twice.
    """
    require_kind(skeleton, Skeleton, "skeleton", "a Skeleton")
    named = _texts(bones, "bones") if bones is not None else [*feet_of(skeleton), skeleton.names[skeleton.hips]]
    named += hands_of(skeleton) if hands else ()
    faults = [skeleton.missing_bone(bone) for bone in named if bone not in skeleton]
    if faults:
        raise MotionError(*faults)
    channels = [
        {"type": kind, "bone": bone, "weight": weight, "group": kind}
        for kind, weight in (("position", position_weight), ("velocity", velocity_weight))
        for bone in named
    ]
    given = {"mirror": [list(pair) for pair in mirror]} if mirror else {}
    return FeatureSchema.from_dict(name, {"rate": rate, "channels": channels, **given})


def hands_of(skeleton: Skeleton) -> tuple[str, str]:
    """The sided bones nearest the root, left first, whose names hold "hand" or "wrist"; a MotionError when there are none."""
    pairs = [pair for word in HAND_WORDS for pair in sided_pairs(skeleton.names) if word in pair[0].rpartition(":")[2].casefold()]
    if not pairs:
        raise MotionError(Fault("no pair of bones is named like hands.", f"bones=[…], of {some(skeleton.names)}"))
    return min(pairs, key=lambda pair: int(skeleton.depths[skeleton.index(pair[0])]))


def best_start(
    database: MotionDatabase,
    query: ArrayLike,
    assets: str | Collection[str] | Answer | None = None,
    *,
    within: Span | Mapping[str, Span] | None = None,
    tags: TagFilter | None = None,
    penalties: Penalties | None = None,
) -> Hit:
    """Find the frame at which an animation is most like the pose of the moment: where to start it.

    Parameters
    ----------
    database : MotionDatabase
        Built with a schema of poses, such as `pose_schema` makes.
    query : float array, shape (F,)
        The pose of the moment, in the schema's units; `query_from` makes it.
    assets : str, collection of str, or Matches, optional
        One clip, or those of which the best is chosen. Default: all.
    within : (from_s, to_s), or mapping of asset to such, optional
        Which part of the clips counts, such as the entrance of a scripted moment, in seconds since the start of each. One pair for
        all leaves looping clips alone: they may start anywhere. A mapping limits the assets that it names, looping or not.
        Whatever is given here, match ranges and other marks of the markup hold.
    tags, penalties
        As for `MotionDatabase.search`.

    Returns
    -------
    Hit
        `database.time_s(hit)` is the start time. False, with an infinite cost, when no frame may be started at.

    Raises
    ------
    QueryError
        An asset that the database lacks, with the nearest that it has, or a part that is none; or as from a search.
    """
    require_kind(database, MotionDatabase, "database", "a MotionDatabase")
    if assets is None or is_answer(assets):
        valid: Valid | None = assets
    else:
        names = [assets] if isinstance(assets, str) else list(require_many(assets, "assets", "names of assets"))
        _check_names(database, names)
        wanted = set(names)
        valid = np.array([asset in wanted for asset in database.assets], np.bool_)
    bias = None if within is None else _outside(database, within)
    return database.search(query, valid, tags, bias=bias, in_match_range=True, penalties=penalties)


def _texts(names: object, what: str) -> list[str]:
    return [require_text(name, f"one of {what}") for name in require_many(names, what, "a list of names")]


def _outside(database: MotionDatabase, within: Span | Mapping[str, Span]) -> Floats:
    """What forbids the frames that do not count: 0 or infinite, float64 [N]."""
    if database.schema is None:
        raise QueryError(Fault("frames cannot be selected by their time.", "a database built from clips, or within=None"))
    limits = np.array(list(_limits(database, within))).reshape(-1, 2)
    frames = database.layout.frames
    ranges = database.layout.frame_ranges[frames]
    times_s = (frames - database.starts[ranges]) / database.schema.rate
    is_inside = (times_s >= limits[ranges, 0] - TOLERANCE_S) & (times_s <= limits[ranges, 1] + TOLERANCE_S)
    biases = np.zeros(database.n_frames)
    biases[frames[~is_inside]] = np.inf
    return biases


def _limits(database: MotionDatabase, within: Span | Mapping[str, Span]) -> Iterator[Span]:
    """From and to of each range."""
    everywhere = (0.0, math.inf)
    if isinstance(within, Mapping):
        _check_names(database, list(within))
        spans = {asset: _span(span) for asset, span in within.items()}
        yield from (spans.get(asset, everywhere) for asset in database.assets)
    else:
        span = _span(within)
        yield from (everywhere if loops else span for loops in database.marks.looping.tolist())


def _span(span: object) -> Span:
    if isinstance(span, (list, tuple)) and len(span) == 2:
        from_s, to_s = as_number(span[0]), math.inf if span[1] == math.inf else as_number(span[1])
        if from_s is not None and to_s is not None and 0.0 <= from_s <= to_s:
            return from_s, to_s
    raise QueryError(Fault(f"within is {span!r}.", "(from, to) in seconds since the start, from 0 on, such as (0.0, 0.5)"))


def _check_names(database: MotionDatabase, names: list[str]) -> None:
    known = dict.fromkeys(database.assets)
    faults = []
    for name in names:
        if not isinstance(name, str) or name not in known:
            problem = f"the database has no asset {in_quotes(str(name))}."
            faults.append(Fault(problem, some(known) or "none: it is empty", mend_for(str(name), known)))
    if faults:
        raise QueryError(*faults)
