"""The answers of many contexts: what a batch, contexts that were asked one by one, and those with actors have in common.

N contexts, W words a mask. Masks are worked out in blocks, so that counts and hits never need them all at once.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice, pairwise
from operator import and_, or_, xor
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Rows, Words, read_only
from contextdb.cells.arguments import require_place
from contextdb.cells.notebook import MOST_COLUMNS, MOST_ROWS, as_html, one_line
from contextdb.cells.sequences import Made
from contextdb.columns import Framed
from contextdb.columns import polars as pl
from contextdb.compiled.answered_table import SaidRows
from contextdb.compiled.batch_columns import CostsOfPairs
from contextdb.compiled.data import CompiledData
from contextdb.compiled.matches import Join, Matches, layered_penalties, minus, rows_frame
from contextdb.compiled.unchanging import Unchanging
from contextdb.core import list_rows
from contextdb.errors import ContextError, Fault, Place, WrongType, plural

BLOCK = 2048
"""Contexts whose masks are worked out together."""
MOST_PAIRS = 2**18
"""Pairs of a context and a row whose costs are worked out together."""


class ManyMatches(Framed, Unchanging, Made[Matches]):
    """The valid rows of many contexts: a sequence of `Matches`, each as `query` gives it, with or without actors. Results are
    computed on first use and kept; arrays are read-only. As with `Matches`, `&`, `|`, `-` and `^` join the answers for as many
    contexts, each with its own; `&` and `-` also take what `only` takes.
    """

    compiled: CompiledData

    if not TYPE_CHECKING:  # a type checker takes every name for one that exists where it sees this

        def __getattr__(self, name: str) -> object:
            problem = f"ManyMatches has no attribute {name!r}"
            if name == "indices":
                problem += ": use rows and starts, or many[i].indices"
            elif hasattr(Matches, name) and not name.startswith("_"):
                problem += f": each of its answers has it, many[i].{name}"
            raise AttributeError(problem, name=name, obj=self)

    @property
    @abstractmethod
    def mirrored(self) -> ManyMatches:
        """The valid rows of the same contexts with mirrored facts; see `Matches.mirrored`. The same object where no fact of the
        table changes in a mirror."""

    @abstractmethod
    def _answer(self, context: int) -> Matches:
        """The answer of a context by its number, from 0."""

    @abstractmethod
    def _masks(self, start: int, stop: int) -> Words:
        """The rows of some contexts as bits."""

    @property
    def is_widening(self) -> bool:
        """Whether `widened` of an answer may be another one: whether a condition of the table has a hysteresis."""
        return bool(self.compiled.widening)

    @property
    def n_rows(self) -> int:
        """The number of rows of the table, valid or not."""
        return self.compiled.n_rows

    @property
    def table_assets(self) -> Sequence[str]:
        """The assets of all rows of the table, valid or not, without paths; the same object as in each of the answers."""
        return self.compiled.answering.leaves

    @property
    def counts(self) -> Rows:
        """How many rows are valid in each context: int64 [N]."""
        return self._counts_and_hits[0]

    @property
    def hits(self) -> Rows:
        """In how many contexts each row is valid: int64 [n_rows]."""
        return self._counts_and_hits[1]

    @cached_property
    def mask(self) -> Words:
        """The rows of each context as bits: uint64 [N, W]."""
        return read_only(self._masks(0, len(self)))

    @property
    def always(self) -> Words:
        """The rows that hold all values of set-valued facts: uint64 [N, W]."""
        return self.mask

    @property
    def codes(self) -> NDArray[np.int32]:
        """The codes of every context, the class of each fact: int32 [N, P]; see `contextdb.compiled.codes`."""
        raise ContextError(Fault("these answers have no codes.", "an answer of query_many with one value for each fact"))

    @property
    def penalties(self) -> NDArray[np.float64]:
        """What each row's soft cells cost in each context: float64 [N, n_rows]; see `Matches.penalties`. Not kept."""
        totals = np.zeros((len(self), self.n_rows))
        if self.compiled.is_soft:
            costs, rows = self._costs_of_pairs(), np.arange(self.n_rows)
            block = max(1, MOST_PAIRS // max(1, self.n_rows))
            for start in range(0, len(self), block):
                contexts = np.arange(start, min(start + block, len(self)))
                own = costs(np.repeat(contexts, len(rows)), np.tile(rows, len(contexts))).sum(axis=0)
                totals[contexts] = own.reshape(len(contexts), len(rows))
        return read_only(totals)

    def _costs_of_pairs(self) -> CostsOfPairs:
        """What tells what soft cells cost in some rows of some contexts, which ascend; of a table with soft cells."""

        def costs(contexts: Rows, rows: Rows) -> NDArray[np.float64]:
            totals = np.empty((self.compiled.n_depths, len(rows)))
            for context in np.unique(contexts).tolist():
                start, stop = np.searchsorted(contexts, [context, context + 1])
                totals[:, start:stop] = layered_penalties(self[context])[:, rows[start:stop]]
            return totals

        return costs

    @cached_property
    def rows(self) -> Rows:
        """The row numbers of all contexts, one context after the other: int64 [M]. Those of context i are
        `rows[starts[i] : starts[i + 1]]`."""
        parts = [rows_of(self._masks(start, min(start + BLOCK, len(self)))) for start in range(0, len(self), BLOCK)]
        return read_only(np.concatenate([np.empty(0, np.int64), *parts]))

    @cached_property
    def starts(self) -> Rows:
        """Where the rows of each context begin in `rows`, and where the last end: int64 [N + 1]."""
        return read_only(np.append(0, np.cumsum(self.counts)))

    @property
    def assets(self) -> list[str]:
        """The assets of the valid rows of all contexts, in the order of `rows`."""
        assets = self.compiled.assets
        return [assets[row] for row in self.rows.tolist()]

    def outputs(self, name: str) -> NDArray[Any]:
        """An output of the valid rows of all contexts, in the order of `rows`. Types are, and it raises,
        as in `Matches.outputs`."""
        return self.compiled.outputs.of_matches(self.rows, name)

    def lists(self) -> list[Rows]:
        """The row numbers of each context: a list of int64 arrays, parts of `rows`."""
        rows, starts = self.rows, self.starts.tolist()
        return [rows[begin:end] for begin, end in pairwise(starts)]

    def to_polars(self) -> pl.DataFrame:
        """The valid rows of all contexts as a DataFrame: the `context`, from 0, `row`, `asset`, and a column for each output."""
        return rows_frame({"context": np.repeat(np.arange(len(self)), self.counts)}, self.compiled.answering, self.rows)

    def only(self, rows: SaidRows | NDArray[np.bool_] | Matches | ManyMatches) -> ManyMatches:
        """The same answers without the rows that are not among some: for all contexts alike, as `Matches.only` takes them, or for
        each context, bool [N, n_rows] or as many answers. Raises ContextError as `Matches.only` does, and for flags or answers for
        another number of contexts."""
        return FewerMatches(self, self._masks_said(rows))

    def _masks_said(self, rows: SaidRows | NDArray[np.bool_] | Matches | ManyMatches) -> Words:
        """Some rows, for all contexts or for each: uint64 [1 or N, W]."""
        if isinstance(rows, ManyMatches):
            return self._beside(rows).mask
        if isinstance(rows, np.ndarray) and rows.dtype == np.bool_ and rows.ndim == 2:
            if rows.shape != (len(self), self.n_rows):
                problem = (
                    f"there are flags of shape {rows.shape}, for {plural(len(self), 'context')} of {plural(self.n_rows, 'row')}."
                )
                raise ContextError(Fault(problem, f"one bool for each row of each context: ({len(self)}, {self.n_rows})"))
            return read_only(bitmask.pack(rows.astype(np.bool_, copy=False)))
        return bitmask.from_int(self.compiled.answering.bits_of(rows), self.n_rows)[None]

    def __and__(self, other: SaidRows | NDArray[np.bool_] | Matches | ManyMatches) -> ManyMatches:
        return self._joined(other, and_) if isinstance(other, ManyMatches) else self.only(other)

    __rand__ = __and__
    __array_ufunc__ = None

    def __sub__(self, other: SaidRows | NDArray[np.bool_] | Matches | ManyMatches) -> ManyMatches:
        return self._joined(other, minus) if isinstance(other, ManyMatches) else FewerMatches(self, ~self._masks_said(other))

    def __or__(self, other: ManyMatches) -> ManyMatches:
        return self._joined(other, or_)

    def __xor__(self, other: ManyMatches) -> ManyMatches:
        return self._joined(other, xor)

    def _joined(self, other: object, join: Join) -> ManyMatches:
        if not isinstance(other, ManyMatches):
            problem = f"the answers for many contexts cannot be joined with {type(other).__name__}."
            raise WrongType(Fault(problem, "as many answers of the same table"))
        return JoinedMatches(self, self._beside(other), join)

    def _beside(self, other: ManyMatches) -> ManyMatches:
        """Other answers, which must be of the same table and for as many contexts."""
        self.compiled.answering.require(other.compiled.answering)
        if len(other) != len(self):
            problem = f"there are answers for {plural(len(other), 'context')}, and for {len(self):,}."
            raise ContextError(Fault(problem, "an answer for each context"))
        return other

    def _at(self, context: int) -> Matches:
        return self._answer(require_place(context, len(self), "context"))

    def __iter__(self) -> Iterator[Matches]:
        return (self._answer(context) for context in range(len(self)))

    def _repr_html_(self) -> str:
        """A notebook's table of the first contexts, each with its valid rows."""
        assets = (", ".join(self._answer(context)[:MOST_COLUMNS]) for context in range(len(self)))
        rows = ((context, count, named) for context, (count, named) in enumerate(zip(self.counts.tolist(), assets, strict=True)))
        return as_html(repr(self), ("context", "rows", "assets"), islice(rows, MOST_ROWS), len(self))

    def __repr__(self) -> str:
        return one_line("ManyMatches", self.compiled.name, f"{plural(len(self), 'context')} x {plural(self.n_rows, 'row')}")

    @cached_property
    def _counts_and_hits(self) -> tuple[Rows, Rows]:
        counts = np.zeros(len(self), np.int64)
        hits = np.zeros(self.n_rows, np.int64)
        for start in range(0, len(self), self._block):
            masks = self._masks(start, min(start + self._block, len(self)))
            counts[start : start + len(masks)] = bitmask.count(masks)
            hits += np.bincount(bitmask.places(masks)[1], minlength=self.n_rows)
        return read_only(counts), read_only(hits)

    @property
    def _block(self) -> int:
        return BLOCK


@dataclass(frozen=True, eq=False, repr=False)
class ListedMatches(ManyMatches):
    """The answers of contexts that were asked one by one: with actors, or with facts that are sets."""

    compiled: CompiledData
    answers: Sequence[Matches]

    @cached_property
    def mirrored(self) -> ManyMatches:
        """The valid rows of the same contexts with the facts of contexts and actors as a mirror shows them."""
        return ListedMatches(self.compiled, tuple(m.mirrored for m in self.answers)) if self.compiled.mirroring else self

    @cached_property
    def always(self) -> Words:
        return read_only(self._stacked([m.always for m in self.answers]))

    def __len__(self) -> int:
        return len(self.answers)

    def _answer(self, context: int) -> Matches:
        return self.answers[context]

    def _masks(self, start: int, stop: int) -> Words:
        return self._stacked([m.mask for m in self.answers[start:stop]])

    def _stacked(self, masks: Sequence[Words]) -> Words:
        return np.array(masks, np.uint64).reshape(len(masks), len(self.compiled.enabled))


@dataclass(frozen=True, eq=False, repr=False)
class FewerMatches(ManyMatches):
    """Answers without the rows that are not among some."""

    whole: ManyMatches
    others: Words
    """The rows to keep, for all contexts or for each: uint64 [1 or N, W]."""

    @property
    def compiled(self) -> CompiledData:  # type: ignore[override]
        return self.whole.compiled

    @cached_property
    def mirrored(self) -> ManyMatches:
        return FewerMatches(self.whole.mirrored, self.others) if self.compiled.mirroring else self

    @cached_property
    def always(self) -> Words:
        return read_only(self.whole.always & self.others)

    def __len__(self) -> int:
        return len(self.whole)

    def _costs_of_pairs(self) -> CostsOfPairs:
        return self.whole._costs_of_pairs()

    def __iter__(self) -> Iterator[Matches]:
        bits = [bitmask.to_int(mask) for mask in self.others]
        return (one._limited_to(bits[i if len(bits) > 1 else 0]) for i, one in enumerate(self.whole))

    def _answer(self, context: int) -> Matches:
        return self.whole[context]._limited_to(bitmask.to_int(self.others[context if len(self.others) > 1 else 0]))

    def _masks(self, start: int, stop: int) -> Words:
        return self.whole._masks(start, stop) & (self.others[start:stop] if len(self.others) > 1 else self.others)


@dataclass(frozen=True, eq=False, repr=False)
class JoinedMatches(ManyMatches):
    """The answers of two for the same contexts, each with its own, joined as sets of rows."""

    first: ManyMatches
    second: ManyMatches
    join: Join

    @property
    def compiled(self) -> CompiledData:  # type: ignore[override]
        return self.first.compiled

    @cached_property
    def mirrored(self) -> ManyMatches:
        return JoinedMatches(self.first.mirrored, self.second.mirrored, self.join) if self.compiled.mirroring else self

    @cached_property
    def always(self) -> Words:
        one, other = self.first.always, self.second.always
        return read_only(self.mask & (one & other if self.join is and_ else one | other))

    def __len__(self) -> int:
        return len(self.first)

    def __iter__(self) -> Iterator[Matches]:
        return (one._joined(other, self.join) for one, other in zip(self.first, self.second, strict=True))

    def _answer(self, context: int) -> Matches:
        return self.first[context]._joined(self.second[context], self.join)

    def _masks(self, start: int, stop: int) -> Words:
        masks: Words = self.join(self.first._masks(start, stop), self.second._masks(start, stop))
        return masks


def rows_of(masks: Words) -> Rows:
    """The rows that masks uint64 [N, W] hold, one mask after the other."""
    rows = np.empty(int(bitmask.count(masks).sum()), np.int64)
    list_rows(np.ascontiguousarray(masks), rows)
    return rows


def one_by_one(
    compiled: CompiledData, columns: Mapping[str, Any], n_contexts: int, answer: Callable[[int, Mapping[str, object]], Matches]
) -> ListedMatches:
    """Ask every context by its number and facts; raises ContextError as that does, with the number of the context."""
    answers = []
    for context in range(n_contexts):
        try:
            answers.append(answer(context, {name: values[context] for name, values in columns.items()}))
        except ContextError as error:
            raise ContextError(*(f.at(Place(row=context, column=f.place.column)) for f in error.faults)) from None
    return ListedMatches(compiled, tuple(answers))
