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
from contextdb.motion.search.filters import NO_SKIPS, Filter


class ManyFilters(NamedTuple):
    """The filters of many searches.

    Attributes
    ----------
    shared : Filter
        Its kinds, frames, biases of frames and continuing bias are those of all.
    ranges : bool array, shape (1, R) or (Q, R)
        One for all, or one for each.
    range_biases : float64 array, shape (1, R) or (Q, R)
    currents : int64 array, shape (Q,)
    skips : tuple of tuples of Skip, of length Q, or empty where nobody skips anything
    """

    shared: Filter
    ranges: Flags
    range_biases: Floats
    currents: Ints
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

    @classmethod
    def alone(cls, chosen: Filter) -> ManyFilters:
        skips = (chosen.skips,) if chosen.skips else ()
        return cls(chosen, chosen.ranges[None], chosen.range_biases[None], np.array([chosen.current]), skips)

    @property
    def least_of_ranges(self) -> Floats:
        """The least of each row of `range_biases`."""
        return np.asarray(self.range_biases.min(axis=1, initial=np.inf))

    @property
    def skip_spans(self) -> tuple[Ints, Ints]:
        """All skips as spans, int64 [S, 2], and where those of each search begin and end among them, int64 [Q + 1]."""
        if not self.skips:
            return NO_SKIPS, np.zeros(len(self.currents) + 1, np.int64)
        spans = [(skip.start, skip.stop) for skips in self.skips for skip in skips]
        return np.array(spans, np.int64), np.cumsum([0, *map(len, self.skips)])

    def one(self, i: int) -> Filter:
        biases = self.range_biases[i if len(self.range_biases) > 1 else 0]
        return self.shared._replace(
            ranges=self.ranges[i if len(self.ranges) > 1 else 0],
            is_whole=False,
            range_biases=biases,
            least_of_ranges=float(biases.min(initial=np.inf)),
            current=int(self.currents[i]),
            skips=self.skips[i] if self.skips else (),
        )


def together(filters: Sequence[Filter]) -> Iterable[list[int]]:
    """The numbers of filters that differ in their ranges, current frames and skips alone, so that they can be searched at once."""
    found: dict[tuple[int, ...], list[int]] = {}
    for i, each in enumerate(filters):
        found.setdefault((id(each.kinds), id(each.frames), id(each.frame_biases)), []).append(i)
    return found.values()
