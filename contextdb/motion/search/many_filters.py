"""What many searches may choose from: what each has of its own in arrays, and what they share once.

Q searches, N frames, R ranges, S skips.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from contextdb.motion.arguments import Flags
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.markup.left_out import Skip
from contextdb.motion.search.filters import Filter


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
