"""The rows that match a context: a set of rows, told as numbers, assets or bits."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Flags, Rows, Words
from contextdb.errors import ContextError, Fault

_INT64 = np.dtype(np.int64)

FEW = 48
"""Up to this many rows are read off the integer bit by bit; beyond, unpacking all bits at once is faster."""


class Answering:
    """What the answers of one table share: its assets, with their paths and without, and 0 … n_rows - 1 to cut row numbers from."""

    __slots__ = ("assets", "leaves", "row_numbers")

    def __init__(self, assets: Sequence[str], leaves: Sequence[str] | None = None) -> None:
        self.assets = assets
        self.leaves = assets if leaves is None else leaves
        self.row_numbers: Rows = np.arange(len(assets), dtype=np.int64)
        self.row_numbers.flags.writeable = False


class Matches:
    """The valid rows for one context. True when there is at least one; its length is their number.

    Attributes
    ----------
    indices : int64 array
        Row numbers, ascending, from 0. Not to be written to.
    assets : list of str
        The assets of those rows; of a row in a table inside the table with its path, "hit_mid_air/dive/MidAir_Dive".
    leaves : list of str
        The assets without paths, as a motion database names them.
    mask : uint64 array, shape (W,)
        Bit r % 64 of word r // 64 is row r.
    always : uint64 array, shape (W,)
        The rows that hold *all* values of the facts that were given as sets; the same as `mask` when none was.
    """

    __slots__ = ("_penalties", "_rows", "_table", "bits")

    _penalties: Callable[[], NDArray[np.float64]]
    """Set for tables with soft cells only: a plain answer has nothing to pay for."""

    def __init__(self, bits: int, table: Answering) -> None:
        self.bits = bits
        """The rows as one Python integer, row r as bit r."""
        self._table = table
        self._rows: Rows | None = None

    @property
    def n_rows(self) -> int:
        """How many rows the table has, valid or not."""
        return len(self._table.row_numbers)

    @property
    def indices(self) -> Rows:
        """Row numbers, ascending: int64 [count]."""
        rows = self._rows
        if rows is None:
            rows = self._rows = rows_of(self.bits, self._table.row_numbers)
        return rows

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
        return bitmask.unpack(self.mask, self.n_rows)

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
        return self._penalties() if self.has_penalties else np.zeros(self.n_rows)

    def with_penalties(self, penalties: Callable[[], NDArray[np.float64]]) -> Matches:
        """The same answer of a table with soft cells; what they cost is worked out when it is asked for."""
        self._penalties = penalties
        return self

    def casting(self, row: int) -> Mapping[str, Mapping[str, Any]]:
        """Who plays which role in a valid row, as {role: actor}; for an answer to a query with actors."""
        raise ContextError(Fault("this question was asked without actors, so nobody is cast.", "query(facts, actors={...})"))

    def castings(self, row: int) -> Sequence[Mapping[str, Mapping[str, Any]]]:
        """All castings of a valid row, best first; for an answer to a query with actors."""
        return [self.casting(row)]

    def __len__(self) -> int:
        return self.bits.bit_count()

    def __bool__(self) -> bool:
        return self.bits != 0

    def __iter__(self) -> Iterator[int]:
        return iter(self.indices.tolist())

    def __contains__(self, row: int) -> bool:
        return 0 <= row < self.n_rows and bool(self.bits >> int(row) & 1)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Matches):
            return NotImplemented
        return (self.bits, self.n_rows) == (other.bits, other.n_rows)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<Matches: {len(self)} of {self.n_rows} rows>"


class SetMatches(Matches):
    """The answer to a context with set-valued facts: the rows that may match, and those that always match."""

    __slots__ = ("_always",)

    def __init__(self, bits: int, table: Answering, always: int) -> None:
        super().__init__(bits, table)
        self._always = always

    @property
    def always(self) -> Words:
        """The rows that hold all values of set-valued facts: uint64 [W]."""
        return bitmask.from_int(self._always, self.n_rows)


def rows_of(bits: int, numbers: Rows) -> Rows:
    """The rows of an integer mask: int64 [count]. One row, the usual answer, is a view of `numbers` and costs no array."""
    top = bits.bit_length() - 1
    if top < 0:
        return numbers[:0]
    rest = bits ^ (1 << top)
    if not rest:
        return numbers[top : top + 1]
    found = [top]
    while rest:
        if len(found) == FEW:
            return bitmask.rows(bitmask.from_int(bits, len(numbers)))
        top = rest.bit_length() - 1
        found.append(top)
        rest ^= 1 << top
    found.reverse()
    return np.array(found, _INT64)
