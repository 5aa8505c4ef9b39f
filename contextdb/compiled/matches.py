"""The rows that match a context: a set of rows, told as numbers, assets or bits."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from functools import partial
from operator import and_, or_, xor
from typing import Any, Protocol, Self, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Flags, Words, read_only
from contextdb.cells.arguments import require_place
from contextdb.cells.notebook import as_html, one_line
from contextdb.columns import Framed, frame_of
from contextdb.columns import polars as pl
from contextdb.compiled.answered_table import AnsweredTable, SaidRows, bits_said
from contextdb.core import Answer
from contextdb.errors import ContextError, Fault, WrongType, plural

Bits = TypeVar("Bits", int, Words)
Join = Callable[[Any, Any], Any]
"""How two answers are joined: a function of their rows, as integers or as masks."""


class Answering(AnsweredTable):
    """A table as it is asked, which makes its answers."""

    __slots__ = ()

    def require_own(self, answer: Matches) -> None:
        """Raise ContextError unless an answer is one of this table in this version."""
        if answer._table is not self:
            self.require(answer._table)

    def answer(self, bits: int, always: int, stages: Stages = ()) -> Matches:
        """An answer of this table from its rows as integers, and who plays what in them."""
        if stages:
            return stages[0][1].answer(bits, always, stages, self)
        return Matches(bits, self) if always == bits else SetMatches(bits, self, always)

    def bits_of(self, rows: SaidRows | Matches) -> int:
        """Some rows as bits: those of an answer of this table, or as `Matches.only` takes them."""
        if isinstance(rows, Matches):
            self.require_own(rows)
            return rows.bits
        return bits_said(rows, len(self.assets), self.bits_of_assets)

    def __copy__(self) -> Answering:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Answering:
        return self

    def __reduce__(self) -> tuple[type[Answering], tuple[object, ...]]:
        """What is pickled: not the table, which `ask_mirrored` and `asked_of` would bring along."""
        return Answering, (self.assets, self.leaves, self.name, self.version, None, self.is_mirroring, self.outputs)


class Staged(Protocol):
    """Who plays what in an answer to a query with actors; see `contextdb.compiled.casting`."""

    def answer(self, bits: int, always: int, stages: Stages, table: Answering) -> Matches:
        """An answer of some rows, with the castings of several."""


Stages = tuple[tuple[int, Staged], ...]
"""For some rows, as bits, who plays what in them; the first that has a row counts."""


class Matches(Framed, Answer):
    """The valid rows for one context. True when there is at least one; its length is their number. It is a sequence of their
    assets: iteration gives them, `in` takes one, `m[0]` is the first. `rows` has their numbers.

    Answers of one version of one table are combined as sets of rows are: `&`, `|`, `-`, `^`. What belongs to a row, its casting and
    what its soft cells cost, is then that of the first of the two answers that holds the row. Answers in a mirror are combined in
    the same way. `&` and `-` also take what `only` takes.

    Attributes
    ----------
    rows, indices : int64 array
        Row numbers, ascending, from 0. This and all other arrays of an answer are read-only.
    assets : list of str
        The assets of those rows; of a row in a table inside the table with its path, "hit_mid_air/dive/MidAir_Dive".
    leaves : list of str
        The assets without paths, as motion databases name them.
    mask : uint64 array, shape (W,)
        Bit r % 64 of word r // 64 is row r.
    always : uint64 array, shape (W,)
        The rows that accept *all* values of facts given as sets; the same as `mask` without such facts.
    """

    __slots__ = ("_mirrored", "_penalties", "_widened")

    _table: Answering

    _mirrored: Matches | dict[str, object] | Callable[[], Matches]
    """Set for tables with conditions whose facts change in a mirror: the answer there, the facts to ask with, or what asks."""
    _widened: Matches | Callable[[], Matches]
    """Set for tables with conditions with a hysteresis: the answer with widened facts, or what asks for it."""
    _penalties: Callable[[], NDArray[np.float64]]
    """Set for tables with soft cells only: a plain answer has nothing to pay for."""

    __array_ufunc__ = None  # else numpy would combine an array of flags with row numbers, one by one

    @property
    def n_rows(self) -> int:
        """The number of rows of the table, valid or not."""
        return len(self._table.row_numbers)

    @property
    def assets(self) -> list[str]:
        """The assets of the valid rows."""
        assets = self._table.assets
        return [assets[r] for r in self.indices.tolist()]

    @property
    def leaves(self) -> list[str]:
        """The assets of the valid rows, without the paths of tables inside tables."""
        leaves = self._table.leaves
        return [leaves[r] for r in self.indices.tolist()]

    @property
    def plays(self) -> NDArray[np.float64] | None:
        """How each row of the table plays, by its reserved outputs, and last what plays without a row: float64 [n_rows + 1, 8], see
        `contextdb.cells.row_play`; None where the table has no such output."""
        return self._table.outputs.plays

    def outputs(self, name: str) -> NDArray[Any]:
        """An output of the valid rows, in the order of `indices`, read-only: bool, int64 or float64 [count], for `numbers` float64
        [count, size], for enum and text an array of str.

        Raises
        ------
        NoSuchOutput
            The table has no such output.
        """
        return self._table.outputs.of_matches(self.indices, name)

    @property
    def mask(self) -> Words:
        """The rows as bits: uint64 [W]."""
        return bitmask.from_int(self.bits, self.n_rows)

    @property
    def always(self) -> Words:
        """The rows that hold all values of set-valued facts: uint64 [W]."""
        return self.mask

    @property
    def flags(self) -> Flags:
        """Whether each row of the table is valid: bool [n_rows]."""
        return read_only(bitmask.unpack(self.mask, self.n_rows))

    @property
    def table_assets(self) -> Sequence[str]:
        """The assets of all rows of the table, valid or not, without paths: the names of clips. The same object in every answer of
        a compiled table."""
        return self._table.leaves

    @property
    def has_penalties(self) -> bool:
        """Whether the table has soft cells."""
        return hasattr(self, "_penalties")

    @property
    def penalties(self) -> NDArray[np.float64]:
        """What each row's soft cells cost in a search with this context: float64 [n_rows]; see `CompiledTable.penalties`."""
        return read_only(layered_penalties(self).sum(axis=0) if self.has_penalties else np.zeros(self.n_rows))

    @property
    def mirrored(self) -> Matches:
        """The answer to the same query with mirrored facts: the rows whose assets may be played mirrored.

        Computed on first use, with the facts as they were. The same object where no fact of the table changes in a mirror. Raises
        ContextError where a derived fact or a rule cannot be computed with mirrored facts, or the answer was asked by codes, which
        keep no facts.
        """
        if not self._table.is_mirroring:
            return self
        known = getattr(self, "_mirrored", None)
        if known is None:
            problem = "this answer was computed without facts, so there are none to mirror."
            raise ContextError(Fault(problem, "an answer of query, query_many or live"))
        if isinstance(known, dict):
            assert self._table.ask_mirrored is not None, "what was pickled has its answer"
            known = self._mirrored = self._table.ask_mirrored(known)
        elif not isinstance(known, Matches):
            known = self._mirrored = known()
        return known

    @property
    def widened(self) -> Matches:
        """The answer to the same query with widened facts: the rows that stay valid where they play already, by the `hysteresis` of
        conditions.

        Computed on first use, with the facts as they were. The same object where no condition of the table has a hysteresis, and
        for an answer asked by codes, which keep no facts. Raises ContextError where a derived fact or a rule cannot be computed.
        """
        known = getattr(self, "_widened", self)
        if not isinstance(known, Matches):
            known = self._widened = known()
        return known

    @property
    def is_widening(self) -> bool:
        """Whether `widened` may be another answer: whether a condition of the table has a hysteresis."""
        return hasattr(self, "_widened")

    def casting(self, row: int) -> Mapping[str, Mapping[str, Any]]:
        """Who fills which role in a valid row, as {role: actor}; for an answer to a query with actors. Raises ContextError where
        the query had no actors, or the row is not valid."""
        raise ContextError(Fault("this query had no actors, so nobody is cast.", "query(facts, actors={...})"))

    def castings(self, row: int) -> Sequence[Mapping[str, Mapping[str, Any]]]:
        """All castings of a valid row, best first; for an answer to a query with actors. Raises what `casting` raises."""
        return [self.casting(row)]

    @property
    def rows(self) -> NDArray[np.int64]:
        """The numbers of the valid rows, as `indices`."""
        return self.indices

    def to_polars(self) -> pl.DataFrame:
        """The valid rows as a DataFrame: `row`, `asset`, and a column for each output of the table."""
        return rows_frame({}, self._table, self.rows)

    def __iter__(self) -> Iterator[str]:
        return iter(self.assets)

    def __contains__(self, asset: object) -> bool:
        """Whether a row of an asset is valid; an asset in a table inside the table with its path, or without."""
        return isinstance(asset, str) and (asset in self.assets or asset in self.leaves)

    @overload
    def __getitem__(self, place: int) -> str: ...

    @overload
    def __getitem__(self, place: slice) -> list[str]: ...

    def __getitem__(self, place: int | slice) -> str | list[str]:
        """The asset of one valid row by its place among them, or those of a slice; NoSuchPlace, also an IndexError, where none
        is."""
        if isinstance(place, slice):
            return self.assets[place]
        return self.assets[require_place(place, len(self), "valid row")]

    def only(self, rows: SaidRows | Matches) -> Self:
        """The same answer without the rows that are not among some rows.

        Parameters
        ----------
        rows : bool array, row numbers, assets, or Matches
            A flag for each row of the table, bool [n_rows]; row numbers; assets, with paths or without; or the rows of another
            answer, whatever that was asked with. The answer in a mirror loses the same rows.

        Raises
        ------
        ContextError
            There are not as many flags as rows; an asset that the table does not have, with the nearest; an answer of another table
            or version.
        NoSuchPlace, WrongType
            A row that the table does not have; rows are said in another way.
        """
        return self._limited_to(self._table.bits_of(rows))

    def _limited_to(self, bits: int) -> Self:
        """The same answer without the rows that are not among some, given as bits."""
        answer = copy(self)
        answer._keep(bits)
        if self._table.is_mirroring:
            answer._mirrored = lambda: self.mirrored._limited_to(bits)
        if self.is_widening:
            answer._widened = lambda: self.widened._limited_to(bits)
        return answer

    def _keep(self, bits: int) -> None:
        self.bits &= bits

    @property
    def _always_bits(self) -> int:
        """The rows that hold all values of set-valued facts, as one integer."""
        return self.bits

    def __and__(self, other: SaidRows | Matches) -> Matches:
        return self._joined(other, and_) if isinstance(other, Matches) else self.only(other)

    __rand__ = __and__

    def __sub__(self, other: SaidRows | Matches) -> Matches:
        return self._joined(other, minus) if isinstance(other, Matches) else self._limited_to(~self._table.bits_of(other))

    def __or__(self, other: Matches) -> Matches:
        return self._joined(other, or_)

    def __xor__(self, other: Matches) -> Matches:
        return self._joined(other, xor)

    @property
    def _stages(self) -> Stages:
        """Who plays what in it; nothing for an answer without actors."""
        return ()

    def _joined(self, other: object, join: Join) -> Matches:
        """The answer of the rows that two answers of one table give together."""
        if not isinstance(other, Matches):
            raise WrongType(Fault(f"an answer cannot be joined with {type(other).__name__}.", "an answer of the same table"))
        self._table.require_own(other)
        bits = join(self.bits, other.bits)
        every = self._always_bits & other._always_bits if join is and_ else self._always_bits | other._always_bits
        tellers = (self,) if join is minus else (self, other)
        stages = tuple((rows & m.bits, stage) for m in tellers for rows, stage in m._stages)
        answer = self._table.answer(bits, every & bits, stages)
        if costs := [m for m in tellers if m.has_penalties]:
            answer._penalties = costs[0]._penalties if len(costs) == 1 or join is and_ else lambda: _costs_of_both(*costs)
        if self._table.is_mirroring:
            answer._mirrored = lambda: self.mirrored._joined(other.mirrored, join)
        if self.is_widening:
            answer._widened = lambda: self.widened._joined(other if join is minus else other.widened, join)
        return answer

    def __copy__(self) -> Self:
        copied: Self = object.__new__(type(self))
        copied._set(_state(self))
        return copied

    def __getstate__(self) -> dict[str, Any]:
        """What is pickled: what soft cells cost as numbers, the answer in a mirror itself, and not what can be worked out again."""
        state = _state(self)
        if state.pop("_mirrored", None) is not None and (seen := self._mirrored_or_none()) is not None:
            state["_mirrored"] = seen
        if state.pop("_widened", None) is not None and (wide := self._widened_or_none()) is not None:
            state["_widened"] = wide
        return state | {"_penalties": partial(_known, layered_penalties(self))} if self.has_penalties else state

    def _mirrored_or_none(self) -> Matches | None:
        """The answer in a mirror, which knows this one as its own; None where it cannot be had."""
        try:
            seen = self.mirrored
        except ContextError:
            return None
        if not isinstance(getattr(seen, "_mirrored", None), Matches):
            seen._mirrored = self
        return seen

    def _widened_or_none(self) -> Matches | None:
        """The answer with widened facts; None where it cannot be had."""
        try:
            return self.widened
        except ContextError:
            return None

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._set(state)

    def _set(self, state: dict[str, Any]) -> None:
        Answer.__init__(self, state.pop("bits"), state.pop("_table"))
        for name, value in state.items():
            setattr(self, name, value)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Matches):
            return NotImplemented
        return (self.bits, self.n_rows) == (other.bits, other.n_rows)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return one_line("Matches", self._table.name, f"{len(self):,} of {plural(self.n_rows, 'row')}")

    def _repr_html_(self) -> str:
        return as_html(repr(self), ("row", "asset"), zip(self.rows.tolist(), self.assets, strict=True))


class SetMatches(Matches):
    """The answer to a context with set-valued facts: the rows that may match, and those that always match."""

    __slots__ = ("_always",)

    def __init__(self, bits: int, table: Answering, always: int) -> None:
        super().__init__(bits, table)
        self._always = always

    @property
    def always(self) -> Words:
        return bitmask.from_int(self._always, self.n_rows)

    @property
    def _always_bits(self) -> int:
        return self._always

    def _keep(self, bits: int) -> None:
        super()._keep(bits)
        self._always &= bits


def answering_of(answer: Matches) -> Answering:
    return answer._table


def with_mirrored(answer: Matches, source: dict[str, object] | Callable[[], Matches]) -> Matches:
    """The same answer, of a table with conditions whose facts change in a mirror: with its facts, kept, or with what asks."""
    answer._mirrored = source
    return answer


def with_widened(answer: Matches, ask: Callable[[], Matches]) -> Matches:
    """The same answer, of a table with conditions with a hysteresis, with what asks with widened facts."""
    answer._widened = ask
    return answer


def with_penalties(answer: Matches, penalties: Callable[[], NDArray[np.float64]]) -> Matches:
    """The same answer of a table with soft cells; what they cost at each depth is worked out when it is asked for."""
    answer._penalties = penalties
    return answer


def layered_penalties(answer: Matches) -> NDArray[np.float64]:
    """What the soft cells of each depth of tables inside tables cost: float64 [D, n_rows]; see `Matches.penalties`."""
    return read_only(answer._penalties() if answer.has_penalties else np.zeros((1, answer.n_rows)))


def rows_frame(first: Mapping[str, NDArray[Any]], table: Answering, rows: NDArray[np.int64]) -> pl.DataFrame:
    """Some rows of a table as a DataFrame: some columns, then `row`, `asset`, and its outputs. An output of one of these names is
    left out."""
    columns: dict[str, object] = {**first, "row": rows, "asset": [table.assets[row] for row in rows.tolist()]}
    outputs = {name: table.outputs.of_matches(rows, name) for name in table.outputs.names if name not in columns}
    texts = {name: values.tolist() for name, values in outputs.items() if values.dtype == object}
    return frame_of(columns | outputs | texts, ["asset", *texts])


def minus(rows: Bits, others: Bits) -> Bits:
    """The rows that are not among others."""
    return rows & ~others


def _costs_of_both(first: Matches, second: Matches) -> NDArray[np.float64]:
    """What the soft cells of each row cost in the first answer, and of those that only the second holds in that."""
    return np.where(second.flags & ~first.flags, layered_penalties(second), layered_penalties(first))


def _state(matches: Matches) -> dict[str, Any]:
    own: dict[str, Any] = (object.__getstate__(matches) or (None, {}))[1]  # type: ignore[index]
    return own | {"bits": matches.bits, "_table": matches._table}


def _known(costs: NDArray[np.float64]) -> NDArray[np.float64]:
    return costs
