"""What the markup says of each frame, in the form that a search uses.

N frames, R ranges, T tags, K kinds. Frames about which the markup says the same are of one kind, and there are few kinds: what a
tag filter lets pass is decided kind by kind, so that a new filter costs nothing that grows with the frames.

A frame's flags say what stands in the way of *choosing* it; the frame that plays now may always play on, unless it is excluded.

Source: the tags DoNotChoose and NextNaturalOnly and the include and exclude masks of EA's talk; soft categories, match range and
warp range of Remedy's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntFlag

import numpy as np
from numpy.typing import NDArray

from contextdb.errors import Fault, QueryError, in_quotes, nearest, some
from contextdb.motion.arguments import Flags
from contextdb.motion.left_out import LeftOut
from contextdb.motion.quaternions import Floats


class Mark(IntFlag):
    """What the markup says of a frame, beside its tags."""

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


@dataclass(frozen=True)
class TagFilter:
    """Which tags the frames of a search must, must not or should have.

    Attributes
    ----------
    include : tuple of str
        A frame has at least one of these. Empty: no matter.
    every : tuple of str
        A frame has all of these.
    exclude : tuple of str
        A frame has none of these.
    prefer : mapping of str to float
        Soft categories: a frame without the tag costs so much more.
    avoid : mapping of str to float
        A frame with the tag costs so much more.

    Notes
    -----
    A tag covers those below it: `Move` covers `Move.Run`.
    """

    include: tuple[str, ...] = ()
    every: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    prefer: Mapping[str, float] = field(default_factory=dict)
    avoid: Mapping[str, float] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Every tag that the filter names, once."""
        return tuple(dict.fromkeys((*self.include, *self.every, *self.exclude, *self.prefer, *self.avoid)))


ANY_TAGS = TagFilter()


@dataclass(frozen=True, eq=False)
class Marks:
    """The markup of a database's frames.

    Attributes
    ----------
    tags : tuple of str, length T
        All tags that the markup knows, also those that no frame of this database has.
    kinds : uint16 or int32 array, shape (N,)
        The kind of each frame.
    kind_tags : bool array, shape (K, T)
    kind_marks : uint8 array, shape (K,)
        `Mark` flags.
    kind_biases : float64 array, shape (K,)
        Cost modifiers: added to the cost.
    kind_root_weights : float64 array, shape (K,)
        How much of the movement comes from the animation: 1 all of it, 0 none (then the game's own model moves the body).
    looping : bool array, shape (R,)
        Whether the range goes on at its start when it ends.
    warps : float64 array, shape (R, 2, 2)
        For position and rotation, from and to in seconds since the range's start: where a match node may warp. NaN: anywhere.
    """

    tags: tuple[str, ...]
    kinds: NDArray[np.integer]
    kind_tags: Flags
    kind_marks: NDArray[np.uint8]
    kind_biases: Floats
    kind_root_weights: Floats
    looping: Flags
    warps: Floats

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
        )

    @property
    def n_kinds(self) -> int:
        """How many kinds of frames there are."""
        return len(self.kind_marks)

    def left_out(self, tags: TagFilter = ANY_TAGS, *, in_match_range: bool = False) -> NDArray[np.uint8]:
        """Why frames of each kind may not be chosen, as `LeftOut`: uint8 [K]."""
        found = np.zeros(self.n_kinds, np.uint8)
        if in_match_range:
            found[(self.kind_marks & Mark.MATCH_RANGE) == 0] = LeftOut.MATCH_RANGE
        found[~self._pass(tags)] = LeftOut.TAGS
        for mark, why in _REASONS:
            found[(self.kind_marks & mark) != 0] = why
        return found

    def playable(self) -> Flags:
        """Whether a frame of each kind may play on: bool [K]."""
        return np.asarray((self.kind_marks & Mark.EXCLUDED) == 0)

    def tag_biases(self, tags: TagFilter = ANY_TAGS) -> Floats:
        """What the soft categories of a filter add to the cost of frames of each kind: float64 [K]."""
        added = np.zeros(self.n_kinds)
        for tag, cost in tags.prefer.items():
            added[~self._has(tag)] += cost
        for tag, cost in tags.avoid.items():
            added[self._has(tag)] += cost
        return added

    def _pass(self, tags: TagFilter) -> Flags:
        passes = np.ones(self.n_kinds, np.bool_)
        if tags.include:
            passes &= np.any([self._has(tag) for tag in tags.include], axis=0)
        for tag in tags.every:
            passes &= self._has(tag)
        for tag in tags.exclude:
            passes &= ~self._has(tag)
        return passes

    def _has(self, tag: str) -> Flags:
        """Which kinds have a tag or one below it: bool [K]."""
        at = [i for i, known in enumerate(self.tags) if covers(tag, known)]
        if not at:
            near = nearest(tag, self.tags)
            accepted = some(self.tags) or "none: the markup knows no tags"
            raise QueryError(Fault(f"there is no tag {in_quotes(tag)}.", accepted, in_quotes(near) if near else ""))
        return np.asarray(self.kind_tags[:, at].any(axis=1))


_REASONS = (
    (Mark.CLIP_END, LeftOut.CLIP_END),
    (Mark.PAST_ENTRY, LeftOut.NEXT_NATURAL),
    (Mark.DO_NOT_CHOOSE, LeftOut.DO_NOT_CHOOSE),
    (Mark.EXCLUDED, LeftOut.EXCLUDED),
)
"""From the weakest to the strongest: the strongest is told."""


def covers(tag: str, other: str) -> bool:
    """Whether a tag is another or stands above it: `Move` covers `Move.Run`."""
    return other == tag or other.startswith(f"{tag}.")


def tags_of(names: Sequence[str] | TagFilter) -> TagFilter:
    """A filter from one, or from a list of tags of which a frame has at least one."""
    return names if isinstance(names, TagFilter) else TagFilter(include=tuple(names))
