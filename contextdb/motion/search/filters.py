"""What one search may choose from, and what is added to the cost of each frame: everything but the query.

N frames, R ranges, K kinds of frames (see `contextdb.motion.markup.marks`). The search, the candidates and the reasons are all read
off one `Filter`, so that they cannot disagree.

    bias of a frame = its range's + its kind's + its own, and the continuing bias for the frame that would play on

A range's bias is the database's base and looping bias and what the table's soft cells cost; a kind's is what the markup says and
what the tag filter prefers; a frame's own is what the caller gives.

Q searches, N frames, R ranges, S skips.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.arguments import Flags
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.markup.left_out import LeftOut, Skip

NO_FLAGS: Flags = np.empty(0, np.bool_)


@dataclass(frozen=True, slots=True)
class Biases:
    """What is added to the cost of frames, whatever the query; negative favours them."""

    base: float = 0.0
    """For every frame of the database."""
    looping: float = 0.0
    """For frames of looping ranges."""
    continuing: float = 0.0
    """For the frame that would play on, so that a character does not jump for a trifle."""


NO_BIAS = Biases()


class Kinds(NamedTuple):
    """What a tag filter says of frames of each kind."""

    allowed: Flags
    """Whether they may be chosen: bool [K]."""
    biases: Floats
    """Float64 [K]."""
    playable: Flags
    """Whether they may play on: bool [K]."""
    left_out: NDArray[np.uint8]
    """Why they may not be chosen, as `LeftOut`: uint8 [K]."""


class Filter(NamedTuple):
    """One search's masks and biases."""

    ranges: Flags
    """The ranges whose asset is valid: bool [R]."""
    is_whole: bool
    """Whether that is all of them."""
    range_biases: Floats
    """Float64 [R]."""
    kinds: Kinds
    frames: Flags
    """The frames that the caller lets pass; empty: all. Bool [N] or [0]."""
    frame_biases: Floats
    """Float64 [N] or [0]."""
    skips: tuple[Skip, ...]
    current: int
    """The frame that would play on; -1 for none. It may be chosen whatever tags and skips say, if its asset is valid, it is not
    excluded, and it is among `frames`."""
    continuing: float
    """What is added to its cost alone."""

    @property
    def skip_spans(self) -> Ints | None:
        """The skips as spans: int64 [S, 2]; None where there are none."""
        return np.array([(skip.start, skip.stop) for skip in self.skips], np.int64) if self.skips else None

    def copied(self) -> Filter:
        """The same, of arrays that no caller changes later."""
        return self._replace(
            ranges=self.ranges.copy(),
            range_biases=self.range_biases.copy(),
            frames=self.frames.copy(),
            frame_biases=self.frame_biases.copy(),
        )

    def playing(self, ranges: Ints, kinds: NDArray[np.integer]) -> int:
        """The frame that plays on if it may, else -1; from the range (-1: none) and the kind of every frame."""
        at = self.current
        if at < 0 or ranges[at] < 0 or not self.ranges[ranges[at]] or not self.kinds.playable[kinds[at]]:
            return -1
        return at if not len(self.frames) or self.frames[at] else -1

    def why(self, ranges: Ints, kinds: NDArray[np.integer]) -> NDArray[np.uint8]:
        """Why each frame may not be chosen, as `LeftOut`: uint8 [N], from the range (-1: none) and the kind of every frame."""
        why = np.zeros(len(ranges), np.uint8)
        for skip in reversed(self.skips):
            why[max(0, skip.start) : max(0, skip.stop)] = skip.why
        if len(self.frames):
            why[~self.frames] = LeftOut.TAGS
        by_kind = self.kinds.left_out[kinds]
        why = np.where(by_kind != LeftOut.NO, by_kind, why)
        playing = self.playing(ranges, kinds)
        if playing >= 0:
            why[playing] = LeftOut.NO
        is_free = why == LeftOut.NO
        why[is_free & np.isposinf(self.biases(ranges, kinds))] = LeftOut.FORBIDDEN
        why[(ranges < 0) | ~self.ranges[ranges]] = LeftOut.NOT_VALID
        return np.asarray(why, np.uint8)

    def biases(self, ranges: Ints, kinds: NDArray[np.integer]) -> Floats:
        """What is added to the cost of each frame: float64 [N]; frames in no range are given some range's."""
        added = self.range_biases[ranges] + self.kinds.biases[kinds]
        if len(self.frame_biases):
            added = added + self.frame_biases
        playing = self.playing(ranges, kinds)
        if playing >= 0:
            added[playing] += self.continuing
        return np.asarray(added)


# ---- what many searches may choose from: what each has of its own in arrays, and what they share once


class ManyFilters(NamedTuple):
    """The filters of many searches."""

    shared: Filter
    """Its kinds, frames, biases of frames and continuing bias are those of all."""
    ranges: Flags
    """One for all, or one for each: bool [1, R] or [Q, R]."""
    range_biases: Floats
    """Float64 [1, R] or [Q, R]."""
    currents: Ints
    """Int64 [Q]."""
    skips: tuple[tuple[Skip, ...], ...] = ()

    @classmethod
    def of(cls, filters: Sequence[Filter]) -> ManyFilters:
        """At least one filter; all share what `together` compares."""
        are_equal = all(each.range_biases is filters[0].range_biases for each in filters)
        return cls(
            filters[0],
            np.array([each.ranges for each in filters]),
            np.array([each.range_biases for each in (filters[:1] if are_equal else filters)]),
            np.array([each.current for each in filters], np.int64),
            tuple(each.skips for each in filters) if any(each.skips for each in filters) else (),
        )

    @property
    def skip_spans(self) -> tuple[Ints, Ints] | tuple[None, None]:
        """All skips as spans, int64 [S, 2], and where those of each search begin and end among them, int64 [Q + 1]; None where
        nobody skips anything."""
        if not self.skips:
            return None, None
        spans = [(skip.start, skip.stop) for skips in self.skips for skip in skips]
        return np.array(spans, np.int64).reshape(-1, 2), np.cumsum([0, *map(len, self.skips)])


def together(filters: Sequence[Filter]) -> Iterable[list[int]]:
    """The numbers of filters that differ in their ranges, current frames and skips alone, so that they can be searched at once."""
    groups: dict[tuple[int, ...], list[int]] = {}
    for i, each in enumerate(filters):
        groups.setdefault((id(each.kinds), id(each.frames), id(each.frame_biases)), []).append(i)
    return groups.values()
