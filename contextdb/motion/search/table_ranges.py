"""From the rows of a table to the ranges of a database: which range plays the asset of which row.

R ranges, Q answers, W words a mask (see `contextdb.bitmask`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from contextdb import bitmask
from contextdb.bitmask import Words
from contextdb.motion.answers import Answer, Answers, are_answers, is_answer
from contextdb.motion.arguments import Flags
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints


@dataclass(frozen=True, eq=False)
class TableRanges:
    """The pairs of a table's rows and the ranges of their assets, in the order of ranges."""

    assets: Sequence[str]
    """The assets of the table's rows."""
    n_ranges: int
    """R; ranges without a row are in no pair."""
    rows: Ints
    ranges: Ints
    """`rows`, `ranges`: int64 [pairs]."""
    firsts: Ints
    """The first pair of each range that is in any."""

    @classmethod
    def of(cls, assets: Sequence[str], ranges_of_asset: Mapping[str, Sequence[int]], n_ranges: int) -> TableRanges:
        """The pairs of a table with these assets."""
        pairs = sorted((i, row) for row, asset in enumerate(assets) for i in ranges_of_asset.get(asset, ()))
        ranges, rows = np.array(pairs, np.int64).reshape(-1, 2).T.copy()
        return cls(assets, n_ranges, rows, ranges, np.unique(ranges, return_index=True)[1])

    def valid(self, answer: Answer) -> tuple[Flags, Floats | None]:
        """The ranges of an answer's rows, bool [R], and what each costs beside, float64 [R], None where nothing does; of several
        valid rows of one asset, the cheapest counts."""
        flags = np.zeros(self.n_ranges, np.bool_)
        is_valid = answer.flags[self.rows]
        flags[self.ranges[is_valid]] = True
        if not answer.has_penalties:
            return flags, None
        least = np.full(self.n_ranges, np.inf)
        np.minimum.at(least, self.ranges[is_valid], answer.penalties[self.rows[is_valid]])
        return flags, least

    def valid_of_many(self, masks: Words) -> Flags:
        """The ranges of the rows of many answers, uint64 [Q, W]: bool [Q, R]."""
        valid = np.zeros((len(masks), self.n_ranges), np.bool_)
        if not len(self.rows):
            return valid
        own = np.take(bitmask.unpack(masks, len(self.assets)), self.rows, axis=1)
        if len(self.firsts) < len(self.rows):
            own = np.logical_or.reduceat(own, self.firsts, axis=1)
        valid[:, self.ranges[self.firsts]] = own
        return valid

    def least_of_each(self, costs: Floats) -> Floats:
        """What each range costs when rows cost as much, float64 [Q, n_rows]: that of the cheapest row of its asset, inf for a range
        without a row: float64 [Q, R]."""
        least = np.full((len(costs), self.n_ranges), np.inf)
        if len(self.rows) and len(costs):
            least[:, self.ranges[self.firsts]] = np.minimum.reduceat(costs[:, self.rows], self.firsts, axis=1)
        return least


def masks_of(answers: Sequence[Any] | Answers) -> tuple[Sequence[str], Words] | None:
    """The assets of a table's rows and the rows of many answers as bits, uint64 [Q, W]; None where they are answers of several
    tables, or some cost something beside."""
    if not len(answers) or not is_answer(answers[0]):
        return None
    assets = answers[0].table_assets
    if are_answers(answers):
        return None if answers[0].has_penalties else (assets, answers.mask)
    each_one = [answers[i] for i in range(len(answers))]
    if any(not is_answer(each) or each.table_assets is not assets or each.has_penalties for each in each_one):
        return None
    return assets, np.array([each.mask for each in each_one], np.uint64).reshape(len(answers), -1)
