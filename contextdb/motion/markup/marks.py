"""What the markup says of each frame, in the form that a search uses.

N frames, R ranges, T tags, K kinds. Frames about which the markup says the same are of one kind, and there are few kinds: what a
tag filter lets pass is decided kind by kind, so that a new filter costs nothing that grows with the frames; what the last filters
let pass is cached.

A frame's flags say what is in the way of *choosing* it; the frame that plays now may always play on, unless it is excluded.

Source: the tags DoNotChoose and NextNaturalOnly and the include and exclude masks of EA's talk; soft categories, match range and
warp range of Remedy's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields
from enum import IntFlag
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.bitmask import read_only
from contextdb.core import filter_kinds
from contextdb.errors import QueryError, no_such, some
from contextdb.motion.arguments import Flags, frame_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.markup.reserved import ReservedTag
from contextdb.motion.markup.tag_filter import ANY_TAGS, TagFilter, covers, tags_of

__all__ = ["ANY_TAGS", "Mark", "Marks", "TagFilter", "covers", "tags_of"]


KEPT_FILTERS = 64
"""The answers to so many filters are cached; a game asks with a few, again and again."""


class Mark(IntFlag):
    """What the markup says of a frame, next to its tags."""

    EXCLUDED = 1
    """Never chosen, and never played on to."""
    DO_NOT_CHOOSE = 2
    """Cannot be entered; may play on."""
    PAST_ENTRY = 4
    """In a NextNaturalOnly span, behind its entry zone: reached only by playing on."""
    NEXT_NATURAL = 8
    """In a NextNaturalOnly span, its entry zone too: while it plays, no other frame of its own range may be chosen."""
    CLIP_END = 16
    """So near the end of its range that entering it is pointless; may play on."""
    MATCH_RANGE = 32
    """A match node may start here. Every frame of a range without a declared match range has it."""


@dataclass(frozen=True, eq=False)
class Marks:
    """The markup of a database's frames. Make it with `of`; its arrays are read-only."""

    tags: tuple[str, ...]
    """All tags that the markup knows, also those that no frame of this database has."""
    kinds: NDArray[np.integer]
    """The kind of each frame: int32 [N]."""
    kind_tags: Flags
    """Bool [K, T]."""
    kind_marks: NDArray[np.uint8]
    """`Mark` flags: uint8 [K]."""
    kind_biases: Floats
    """Cost modifiers: added to the cost. Float64 [K]."""
    kind_root_weights: Floats
    """How much of the movement comes from the animation: 1 all of it, 0 none (then the game's own model moves the body). Float64
    [K]."""
    looping: Flags
    """Whether the range continues at its start when it ends: bool [R]."""
    warps: Floats
    """For position and rotation, from and to in seconds since the range's start: where a match node may warp. NaN: anywhere.
    Float64 [R, 2, 2]."""
    touches: NDArray[np.uint8]
    """Where the markup has a foot come down: 1 the left, 2 the right, 3 both. Uint8 [N]."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, field.name, read_only(value.view()))

    @classmethod
    def none(cls, n_frames: int, n_ranges: int) -> Marks:
        """No markup: every frame may be chosen."""
        return cls(
            (),
            np.zeros(n_frames, np.uint16),
            np.zeros((1, 0), np.bool_),
            np.array([Mark.MATCH_RANGE], np.uint8),
            np.zeros(1),
            np.ones(1),
            np.zeros(n_ranges, np.bool_),
            np.full((n_ranges, 2, 2), np.nan),
            np.zeros(n_frames, np.uint8),
        )

    @property
    def n_kinds(self) -> int:
        return len(self.kind_marks)

    # ---- what a search asks, kind by kind

    def left_out(self, tags: TagFilter | Sequence[str] = ANY_TAGS, *, in_match_range: bool = False) -> NDArray[np.uint8]:
        """Why frames of each kind may not be chosen, as `LeftOut`: uint8 [K], read-only.

        Raises
        ------
        QueryError
            The filter names a tag that the markup does not know; with the nearest that it does. So in `tag_biases`.
        """
        return self._left_out(tags_of(tags), in_match_range)

    def playable(self) -> Flags:
        """Whether a frame of each kind may play on: bool [K], read-only."""
        return self._playable

    def tag_biases(self, tags: TagFilter | Sequence[str] = ANY_TAGS) -> Floats:
        """What the soft categories of a filter add to the cost of frames of each kind: float64 [K], read-only."""
        return self._tag_biases(tags_of(tags))

    @cached_property
    def _left_out(self) -> Callable[[TagFilter, bool], NDArray[np.uint8]]:
        known, marks = _Tags(self.tags, self.kind_tags), self.kind_marks
        return lru_cache(KEPT_FILTERS)(lambda tags, in_match_range: read_only(_left_out(known, marks, tags, in_match_range)))

    @cached_property
    def _tag_biases(self) -> Callable[[TagFilter], Floats]:
        known = _Tags(self.tags, self.kind_tags)
        return lru_cache(KEPT_FILTERS)(lambda tags: read_only(known.filtered(tags)[1]))

    @cached_property
    def _moves_all(self) -> bool:
        return bool((self.kind_root_weights == 1.0).all())

    @cached_property
    def _playable(self) -> Flags:
        return read_only(np.asarray((self.kind_marks & Mark.EXCLUDED) == 0))

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}  # without the cached answers

    # ---- the markup of a frame

    def mark_of(self, frame: int) -> Mark:
        """The flags of a frame."""
        return Mark(int(self.kind_marks[self._kind_of(frame)]))

    def kinds_with(self, tag: str) -> Flags:
        """Whether frames of each kind have a plain tag, in any case, or one below it: bool [K]."""
        at = [i for i, own in enumerate(self.tags) if covers(tag.casefold(), own.casefold())]
        return np.asarray(self.kind_tags[:, at].any(axis=1))

    def tags_of(self, frame: int) -> tuple[str, ...]:
        """The plain tags of a frame, sorted."""
        return tuple(self.tags[i] for i in np.flatnonzero(self.kind_tags[self._kind_of(frame)]).tolist())

    def bias(self, frame: int) -> float:
        """The cost modifiers of a frame, added up."""
        return float(self.kind_biases[self._kind_of(frame)])

    def root_weight(self, frame: int) -> float:
        """How much of the movement comes from the animation in a frame, from 0 to 1."""
        return 1.0 if self._moves_all else float(self.kind_root_weights[self._kind_of(frame)])

    def events(self, frame: int) -> tuple[str, ...]:
        """All markup of a frame, in the words of a markup file: plain tags, then reserved ones, as "CostModifier 0.5".

        Beside them stand "ClipEnd" for a frame too near the end, and "NextNaturalOnly entry" for one in an entry zone.
        """
        kind = self._kind_of(frame)
        mark, bias, weight = int(self.kind_marks[kind]), self.kind_biases[kind], self.kind_root_weights[kind]
        texts = [text for bit, text in _MARK_TEXTS if mark & bit]
        if mark & Mark.NEXT_NATURAL:
            texts.append(str(ReservedTag.NEXT_NATURAL_ONLY) if mark & Mark.PAST_ENTRY else f"{ReservedTag.NEXT_NATURAL_ONLY} entry")
        if bias:
            texts.append(f"{ReservedTag.COST_MODIFIER} {bias:g}")
        if weight != 1.0:
            texts.append(f"{ReservedTag.ROOT_MOTION_WEIGHT} {weight:g}")
        return (*self.tags_of(frame), *texts)

    def begin(self, tag: str) -> Flags:
        """The frames, but for the first of a database, at which spans of a plain tag or of one below it begin: bool [N].

        Raises QueryError for one that the markup does not know, with the nearest."""
        has = _Tags(self.tags, self.kind_tags).has(tag)[self.kinds]
        return np.asarray(np.diff(has, prepend=True) & has)

    def _kind_of(self, frame: int) -> int:
        return int(self.kinds[frame_of(frame, len(self.kinds), "frame")])


_MARK_TEXTS = (
    (Mark.EXCLUDED, str(ReservedTag.EXCLUDED)),
    (Mark.DO_NOT_CHOOSE, str(ReservedTag.DO_NOT_CHOOSE)),
    (Mark.CLIP_END, "ClipEnd"),
)
_REASONS = (
    (Mark.CLIP_END, LeftOut.CLIP_END),
    (Mark.PAST_ENTRY, LeftOut.NEXT_NATURAL),
    (Mark.DO_NOT_CHOOSE, LeftOut.DO_NOT_CHOOSE),
    (Mark.EXCLUDED, LeftOut.EXCLUDED),
)
"""From the weakest to the strongest: the strongest is reported."""


@dataclass(frozen=True, slots=True)
class _Tags:
    """The tags of each kind: their names, and bool [K, T]."""

    names: tuple[str, ...]
    flags: Flags

    def has(self, tag: str) -> Flags:
        """Which kinds have a tag or one below it: bool [K]."""
        return self.filtered(TagFilter(tag))[0]

    def filtered(self, tags: TagFilter) -> tuple[Flags, Floats]:
        """Which kinds a filter lets pass, and what it adds to the cost of frames of each: bool and float64 [K]."""
        passes, added = np.empty(len(self.flags), np.bool_), np.empty(len(self.flags))
        soft = [
            part for costs in (tags.prefer, tags.avoid) for part in (_texts(t for t, _ in costs), np.array([c for _, c in costs]))
        ]
        hard = map(_texts, (tags.include, tags.every, tags.exclude))
        if not filter_kinds(_texts(self.names), np.ascontiguousarray(self.flags), *hard, *soft, passes, added):
            tag = next(tag for tag in tags.names if not any(covers(tag, known) for known in self.names))
            accepted = some(self.names) or "none: the markup has no tags"
            raise QueryError(no_such("tag", tag, self.names, accepted))
        return passes, added


def _texts(texts: Iterable[str]) -> bytes:
    return b"".join(text.encode("utf-8", "surrogatepass") + b"\0" for text in texts)


def _left_out(known: _Tags, marks: NDArray[np.uint8], tags: TagFilter, in_match_range: bool) -> NDArray[np.uint8]:
    reasons = np.zeros(len(marks), np.uint8)
    if in_match_range:
        reasons[(marks & Mark.MATCH_RANGE) == 0] = LeftOut.MATCH_RANGE
    reasons[~known.filtered(tags)[0]] = LeftOut.TAGS
    for mark, why in _REASONS:
        reasons[(marks & mark) != 0] = why
    return reasons
