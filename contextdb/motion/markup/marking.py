"""From spans of markup in seconds to the kinds of frames that a search uses.

Ranges are cut where a span begins or ends; frames between two cuts are of one kind. The work grows with ranges and spans, not with
frames. Nothing here knows features or costs.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contextdb.cells.arguments import as_number
from contextdb.errors import Fault, MotionError
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.markup.marks import Mark, Marks
from contextdb.motion.markup.markup import Markup
from contextdb.motion.markup.reserved import CONTACTS, MOST_SECONDS, ReservedTag
from contextdb.motion.markup.span_faults import TOLERANCE_S, Span
from contextdb.motion.ranges import check_ranges

MOST_RATE = 1e5

_MARKS: dict[str, int] = {
    ReservedTag.DO_NOT_CHOOSE: int(Mark.DO_NOT_CHOOSE),
    ReservedTag.EXCLUDED: int(Mark.EXCLUDED),
    ReservedTag.MATCH_RANGE: int(Mark.MATCH_RANGE),
    ReservedTag.NEXT_NATURAL_ONLY: int(Mark.NEXT_NATURAL),
}
_WARPS = (ReservedTag.WARP_POSITION, ReservedTag.WARP_ROTATION)

Cut = tuple[int, int, int]
"""Frames [first, stop) of a range, and their kind."""


@dataclass(frozen=True, slots=True)
class _Stretch:
    """Frames [first, stop) of a range, and one thing that is said of them: flags, or what a span says else."""

    first: int
    stop: int
    marks: int = 0
    span: Span | None = None


@dataclass(frozen=True, slots=True)
class _Effect:
    """All markup of a frame."""

    marks: int = int(Mark.MATCH_RANGE)
    tags: frozenset[str] = frozenset()
    bias: float = 0.0
    root_weight: float = 1.0


@dataclass(frozen=True, slots=True)
class _Asset:
    """What holds for every range of an asset."""

    spans: tuple[Span, ...]
    looping: bool
    has_match_range: bool


def marks_of(
    markup: Markup | None,
    assets: Sequence[str],
    starts: ArrayLike,
    stops: ArrayLike,
    rate: float,
    end_s: float = 0.0,
    *,
    n_frames: int | None = None,
) -> Marks:
    """The markup of some ranges, or of none but for their ends; each range is that of one asset, frames `starts[i]` up to, not
    including, `stops[i]`, and they do not overlap. Frame i of a range is at i / rate seconds, in a mirrored one too.

    Kind 0 is that of which there is no markup, also between ranges, in as many frames as the database has; the others follow in
    the order in which they are met. Frames less than `end_s` before the last one of a range cannot be entered, unless the range
    loops; its first frame always can: a shorter clip could never play otherwise.

    A span holds the frames from `from` to `to`, both within, to a millionth of a second. Cost modifiers add up. Of root motion
    weights, and of warps, one that names the asset is stronger than one with a pattern. A warp ends with its range; one that
    starts after the end has no effect.

    Raises MotionError for ranges that do not fit, a wrong rate or end, or patterns that fit one asset and contradict each other.
    """
    per_second = _number(rate, "the rate", "frames a second, more than 0", 1.0 / MOST_SECONDS, MOST_RATE)
    end = _number(end_s, "end_s", "seconds, 0 or more", 0.0, MOST_SECONDS)
    ends = np.asarray(stops)
    total = int(ends.max(initial=0)) if n_frames is None and ends.dtype.kind in "iu" else n_frames or 0
    first, last, names = check_ranges(starts, stops, assets, total)
    known = Markup() if markup is None else markup
    about = _about(known, names)
    kinds = {_Effect(): 0}
    of_frame = np.zeros(total, np.int32)
    times = (np.arange(int((last - first).max(initial=0))) / per_second).tolist()
    cuts: dict[tuple[str, int], list[Cut]] = {}
    for name, start, length in zip(names, first.tolist(), (last - first).tolist(), strict=True):
        if (name, length) not in cuts:
            stretches = [*_stretches(about[name], times, length), *_clip_end(about[name], times, length, end)]
            cuts[name, length] = _cut(about[name], stretches, length, kinds)
        for a, b, kind in cuts[name, length]:
            of_frame[start + a : start + b] = kind
    looping = np.array([about[name].looping for name in names], np.bool_)
    touches = np.zeros(total, np.uint8)
    for name, start, length in zip(names, first.tolist(), (last - first).tolist(), strict=True):
        for span in about[name].spans:
            at = bisect_left(times, span.from_s - TOLERANCE_S, 0, length)
            if span.tag in CONTACTS and 0 < at < length:
                touches[start + at] |= 1 << CONTACTS.index(ReservedTag(span.tag))
    return _marks(known.tags, of_frame, list(kinds), looping, _warps(about, names, last - first, per_second), touches)


def _number(value: object, what: str, accepted: str, least: float, most: float) -> float:
    number = as_number(value)
    if number is None or not least <= number <= most:
        raise MotionError(Fault(f"{what} is {value!r}.", accepted))
    return number


def _about(markup: Markup, names: Iterable[str]) -> dict[str, _Asset]:
    """What the markup says of each asset, or a MotionError where its patterns contradict each other."""
    distinct = list(dict.fromkeys(names))
    faults = [fault for name in distinct for fault in markup.conflicts_of(name)]
    if faults:
        raise MotionError(*faults)
    return {name: _asset(markup.spans_of(name)) for name in distinct}


def _asset(spans: tuple[Span, ...]) -> _Asset:
    tags = {span.tag for span in spans}
    return _Asset(spans, ReservedTag.LOOPING in tags, ReservedTag.MATCH_RANGE in tags)


# ---- the frames of spans


def _stretches(about: _Asset, times: list[float], length: int) -> Iterator[_Stretch]:
    for span in about.spans:
        first = bisect_left(times, span.from_s - TOLERANCE_S, 0, length)
        stop = bisect_right(times, span.to_s + TOLERANCE_S, 0, length)
        if first >= stop or span.tag in _NOT_OF_FRAMES:
            continue
        marks = _MARKS.get(span.tag, 0)
        yield _Stretch(first, stop, marks, None if marks else span)
        if marks == Mark.NEXT_NATURAL:
            entry = bisect_right(times, span.from_s + (span.value or 0.0) + TOLERANCE_S, 0, length)
            yield _Stretch(max(entry, first + 1), stop, int(Mark.PAST_ENTRY))  # a zone between two frames still has an entry


_NOT_OF_FRAMES = (ReservedTag.LOOPING, *CONTACTS, *_WARPS)


def _clip_end(about: _Asset, times: list[float], length: int, end_s: float) -> Iterator[_Stretch]:
    """The frames less than `end_s` before the last one, but never the first of the range."""
    if about.looping or length < 2:
        return
    first = bisect_right(times, times[length - 1] - end_s + TOLERANCE_S, 0, length)
    yield _Stretch(max(1, first), length, int(Mark.CLIP_END))


def _cut(about: _Asset, stretches: Sequence[_Stretch], length: int, kinds: dict[_Effect, int]) -> list[Cut]:
    """The kinds of a range's frames; a kind that is met for the first time gets the next number."""
    opening, closing = defaultdict[int, list[int]](list), defaultdict[int, list[int]](list)
    for i, stretch in enumerate(stretches):
        if stretch.first < stretch.stop:
            opening[stretch.first].append(i)
            closing[stretch.stop].append(i)
    open_now: dict[int, _Stretch] = {}
    cuts = []
    for first, stop in pairwise(sorted({0, length, *opening, *closing})):
        for i in closing.get(first, ()):
            del open_now[i]
        open_now.update((i, stretches[i]) for i in opening.get(first, ()))
        effect = _effect_of(open_now.values(), about.has_match_range)
        cuts.append((first, stop, kinds.setdefault(effect, len(kinds))))
    return cuts


def _effect_of(stretches: Iterable[_Stretch], has_match_range: bool) -> _Effect:
    marks = 0 if has_match_range else int(Mark.MATCH_RANGE)
    tags, costs, weights = [], [], []
    for stretch in stretches:
        marks |= stretch.marks
        span = stretch.span
        if span is None:
            continue
        if span.tag == ReservedTag.COST_MODIFIER:
            costs.append(span.value or 0.0)
        elif span.tag == ReservedTag.ROOT_MOTION_WEIGHT:
            weights.append(span)
        else:
            tags.append(span.tag)
    return _Effect(marks, frozenset(tags), math.fsum(costs), _strongest_weight(weights))


def _strongest_weight(spans: Sequence[Span]) -> float:
    """The weight of the span that names its asset, and of several the one that begins last: it begins where the others end."""
    if not spans:
        return 1.0
    strongest = max(spans, key=lambda span: (not span.is_pattern, span.from_s))
    return 1.0 if strongest.value is None else strongest.value


# ---- arrays


def _warps(about: dict[str, _Asset], names: Sequence[str], lengths: Ints, rate: float) -> Floats:
    warps = np.full((len(names), 2, 2), np.nan)
    for i, (name, length) in enumerate(zip(names, lengths.tolist(), strict=True)):
        last_s = (length - 1) / rate
        for at, tag in enumerate(_WARPS):
            spans = [span for span in about[name].spans if span.tag == tag]
            span = min(spans, key=lambda span: span.is_pattern, default=None)
            if span is not None and span.from_s <= last_s + TOLERANCE_S:
                warps[i, at] = min(span.from_s, last_s), min(span.to_s, last_s)
    return warps


def _marks(
    tags: tuple[str, ...],
    of_frame: NDArray[np.int32],
    kinds: Sequence[_Effect],
    looping: NDArray[np.bool_],
    warps: Floats,
    touches: NDArray[np.uint8],
) -> Marks:
    place = {tag: i for i, tag in enumerate(tags)}
    kind_tags = np.zeros((len(kinds), len(tags)), np.bool_)
    for kind, effect in enumerate(kinds):
        kind_tags[kind, [place[tag] for tag in effect.tags]] = True
    return Marks(
        tags,
        of_frame.astype(np.uint16) if len(kinds) <= 1 << 16 else of_frame,
        kind_tags,
        np.array([effect.marks for effect in kinds], np.uint8),
        np.array([effect.bias for effect in kinds]),
        np.array([effect.root_weight for effect in kinds]),
        looping,
        warps,
        touches,
    )
