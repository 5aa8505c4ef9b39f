"""Turn what a caller of a search gives (matches or flags, tags, biases) into a `Filter`, and keep what calls have in common.

N frames, R ranges, K kinds. A game asks thousands of times with the same tables and the same few tag filters: which rows of a table
belong to which range, and what a filter says of each kind of frame, is worked out once.

R ranges, Q answers, W words a mask (see `contextdb.bitmask`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, TypedDict, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contextdb import bitmask
from contextdb.bitmask import Words
from contextdb.cells.arguments import require_many_of
from contextdb.errors import Fault, QueryError, plural
from contextdb.motion import arguments
from contextdb.motion.answers import Answer, Answers, are_answers, is_answer
from contextdb.motion.arguments import Currents, Flags, Valid, ValidForMany, ValidRanges
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.markup.left_out import LeftOut, Skip
from contextdb.motion.markup.marks import ANY_TAGS, Marks, TagFilter
from contextdb.motion.search.filters import NO_FLAGS, Biases, Filter, Kinds, ManyFilters

Tags = TagFilter | ArrayLike
Penalties = Mapping[str, float] | NDArray[np.floating]

NO_SKIP: tuple[Skip, ...] = ()
MOST_FILTERS, MOST_TABLES = 64, 16
"""So many answers of tag filters and tables are cached; past that all are forgotten."""


class SearchOptions(TypedDict, total=False):
    """The parameters of a search next to the query and the valid assets; see `MotionDatabase.search`."""

    tags: Tags | None
    current: int | None
    bias: ArrayLike | None
    skip: Sequence[Skip]
    in_match_range: bool
    penalties: Penalties | None


class FilterMaker:
    """Makes the filters of one database."""

    def __init__(self, n_frames: int, assets: Sequence[str], mirrored: Flags, marks: Marks, biases: Biases) -> None:
        self.n_frames, self.assets, self.mirrored, self.marks, self.biases = n_frames, assets, mirrored, marks, biases
        self._has_mirrored = bool(mirrored.any())
        self._all_ranges: Flags = np.ones(len(assets), np.bool_)
        self._range_biases: Floats = np.where(marks.looping, biases.base + biases.looping, biases.base)
        self._kinds: dict[tuple[TagFilter, bool], Kinds] = {}
        self._tables: dict[int, TableRanges] = {}

    def make(
        self,
        valid: Valid | None = None,
        tags: Tags | None = None,
        current: int | None = None,
        bias: ArrayLike | None = None,
        skip: Sequence[Skip] = (),
        in_match_range: bool = False,
        penalties: Penalties | None = None,
    ) -> Filter:
        """The filter for one search; see `MotionDatabase.search` for what is given."""
        ranges, range_biases = self._ranges(valid)
        if penalties is not None:
            range_biases = range_biases + self.range_penalties(penalties)
        is_filter = tags is None or isinstance(tags, TagFilter)
        return Filter(
            ranges,
            ranges is self._all_ranges,
            range_biases,
            self._kinds_of(tags or ANY_TAGS if is_filter else ANY_TAGS, in_match_range),  # type: ignore[arg-type]
            NO_FLAGS if is_filter else arguments.flags_of(tags, self.n_frames, "tags", "frame"),
            arguments.bias_of(bias, self.n_frames),
            () if skip is NO_SKIP else tuple(require_many_of(skip, Skip, "skip", "a list of Skip")),
            arguments.current_of(current, self.n_frames),
            self.biases.continuing,
        )

    def ranges_of(self, valid: Valid | None) -> Flags:
        """Which ranges may play, where nothing else is given: bool [R]."""
        return self._ranges(valid)[0]

    def make_many(self, n: int, valid: ValidForMany | None, current: Currents | None, tags: Tags | None) -> ManyFilters:
        """The filters of n searches; see `MotionDatabase.search_many` for what is given."""
        ranges, biases = self.ranges_of_many(valid, n)
        return ManyFilters(
            self.make(None, tags),
            ranges,
            self._range_biases[None] if biases is None else biases,
            arguments.currents_of(current, n, self.n_frames),
        )

    def valid_of_each(self, valid: ValidForMany | None, n: int) -> list[ValidRanges]:
        """What the masks of n searches mean, read once, to be given to searches as `valid`."""
        ranges, biases = self.ranges_of_many(valid, n)
        all_biases = [self._range_biases] * n if biases is None else biases
        wide = _widened_of_each(valid)
        return [
            ValidRanges(ranges[i if len(ranges) > 1 else 0], all_biases[i if len(all_biases) > 1 else 0], wide and partial(wide, i))
            for i in range(n)
        ]

    def ranges_of_many(self, valid: ValidForMany | None, n: int) -> tuple[Flags, Floats | None]:
        """Which ranges may play in each of n searches, bool [n, R], and the biases of ranges, float64 [n, R], None where they are
        those of the database; or [1, R], the same for all."""
        n_ranges = len(self.assets)
        if not arguments.is_one_for_each(valid):
            ranges, biases = self._ranges(cast("Valid | None", valid))
            return ranges[None], None if biases is self._range_biases else biases[None]
        each = cast("Sequence[Valid | None]", valid)
        if len(each) != n:
            raise QueryError(Fault(f"{plural(len(each), 'mask')} for {n} queries.", "one for all, or one for each query"))
        if isinstance(each, np.ndarray):
            return arguments.flags_of(each, (n, n_ranges), "valid", "range"), None
        if (of_table := self._of_answers(each)) is not None:
            return of_table, None
        masks = list(each)
        known = {id(mask): self._ranges(mask) for mask in masks}
        all_biases = [known[id(mask)][1] for mask in masks]
        are_plain = all(biases is self._range_biases for biases in all_biases)
        flags = np.array([known[id(mask)][0] for mask in masks], np.bool_).reshape(n, n_ranges)
        return flags, None if are_plain else np.array(all_biases).reshape(n, n_ranges)

    def _of_answers(self, answers: Sequence[Any]) -> Flags | None:
        """The ranges of many answers of one table at once; None where they are not, or have costs of their own."""
        if (masks := masks_of(answers)) is None:
            return None
        flags = self._table_ranges(masks[0]).valid_of_many(masks[1])
        if self._has_mirrored:
            seen = answers.mirrored if are_answers(answers) else [each.mirrored for each in answers]
            if (in_mirror := masks_of(seen)) is None:
                return None
            flags = np.where(self.mirrored, self._table_ranges(in_mirror[0]).valid_of_many(in_mirror[1]), flags)
        return flags

    def _ranges(self, valid: Valid | None) -> tuple[Flags, Floats]:
        """Which ranges may play, bool [R], and the biases of ranges, float64 [R]."""
        if valid is None:
            return self._all_ranges, self._range_biases
        if isinstance(valid, ValidRanges):
            return valid.flags, valid.biases
        if type(valid) is np.ndarray and valid.dtype == np.bool_ and valid.shape == self._all_ranges.shape:
            return np.ascontiguousarray(valid), self._range_biases
        if not is_answer(valid):
            return arguments.flags_of(valid, len(self.assets), "valid", "range"), self._range_biases
        flags, costs = self._of_answer(valid)
        if self._has_mirrored and (in_mirror := valid.mirrored) is not valid:
            mirrored_flags, mirrored_costs = self._of_answer(in_mirror)
            flags = np.where(self.mirrored, mirrored_flags, flags)
            if costs is not None and mirrored_costs is not None:
                costs = np.where(self.mirrored, mirrored_costs, costs)
        return flags, self._range_biases if costs is None else self._range_biases + np.where(flags, costs, 0.0)

    def _of_answer(self, answer: Answer) -> tuple[Flags, Floats | None]:
        """The ranges of the valid assets of a table's answer, and what each costs beside, None where nothing does; of several valid
        rows of one asset, the cheapest counts."""
        return self._table_ranges(answer.table_assets).valid(answer)

    def _table_ranges(self, table_assets: Sequence[str]) -> TableRanges:
        """Which ranges play the assets of a table's rows."""
        known = self._tables.get(id(table_assets))
        if known is None or known.assets is not table_assets:
            known = TableRanges.of(table_assets, self._ranges_of_asset, len(self.assets))
            if len(self._tables) >= MOST_TABLES:
                self._tables.clear()
            self._tables[id(table_assets)] = known
        return known

    def range_penalties(self, penalties: Penalties) -> Floats:
        if isinstance(penalties, Mapping):
            costs = np.zeros(len(self.assets))
            for asset, penalty in penalties.items():
                costs[self._ranges_of_asset.get(asset, [])] = penalty
        else:
            costs = arguments.numbers_of(penalties, "the penalties")
        if costs.shape != self._all_ranges.shape or np.isnan(costs).any() or np.isneginf(costs).any():
            ranges = plural(len(self.assets), "range")
            accepted = f"a number for each of {ranges}, or for some assets; positive infinity forbids one"
            raise QueryError(Fault(f"the penalties have shape {costs.shape}, or one is not a number.", accepted))
        return costs

    def _kinds_of(self, tags: TagFilter, in_match_range: bool) -> Kinds:
        known = self._kinds.get((tags, in_match_range))
        if known is None:
            left_out = self.marks.left_out(tags, in_match_range=in_match_range)
            biases = self.marks.kind_biases + self.marks.tag_biases(tags)
            if len(self._kinds) >= MOST_FILTERS:
                self._kinds.clear()
            known = Kinds(left_out == LeftOut.NO, biases, self.marks.playable(), left_out)
            self._kinds[tags, in_match_range] = known
        return known

    @cached_property
    def _ranges_of_asset(self) -> dict[str, list[int]]:
        ranges: dict[str, list[int]] = {}
        for i, asset in enumerate(self.assets):
            ranges.setdefault(asset, []).append(i)
        return ranges


def _widened_of_each(valid: ValidForMany | None) -> Callable[[int], Valid | None] | None:
    """What gives the answer for what plays already, of one of many; None where masks are no answers, or nothing widens them."""
    if valid is None or isinstance(valid, np.ndarray):
        return None
    if not arguments.is_one_for_each(valid):
        one = cast("Valid", valid)
        return (lambda i: arguments.widened_of(one)) if _widens(one) else None
    answers = cast("Sequence[Any]", valid)
    if are_answers(answers):
        return (lambda i: arguments.widened_of(answers[i])) if answers.is_widening else None
    return (lambda i: arguments.widened_of(answers[i])) if any(map(_widens, answers)) else None


def _widens(valid: object) -> bool:
    """Whether an answer, or many of one table, may be another one for what plays already."""
    if isinstance(valid, ValidRanges):
        return valid.widened is not None
    return is_answer(valid) and valid.is_widening


# ---- from the rows of a table to the ranges of a database: which range plays the asset of which row


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
