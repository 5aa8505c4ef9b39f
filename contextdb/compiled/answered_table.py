"""What the answers of one table share, and the numbers of their rows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Rows, read_only
from contextdb.cells.arguments import require_many, require_row
from contextdb.compiled.outputs import NO_OUTPUTS, Outputs
from contextdb.core import Shared
from contextdb.errors import ContextError, Fault, WrongType, in_quotes, mend_for, plural, some

_OWN_ANSWER = "an answer of this compiled table"
_ASK_AGAIN = "to query this table again: query(facts)"


def _as_rows(octets: bytes) -> Rows:
    return np.frombuffer(octets, np.int64)


class AnsweredTable(Shared):
    """What the answers of one table share: its assets, with their paths and without, and 0 … n_rows - 1 to cut row numbers from.

    Two are of the same table where name and `version` are equal; the version is worked out where two have to be compared.
    """

    __slots__ = (
        "_of_asset", "_version", "ask_mirrored", "asked_of", "assets", "is_mirroring", "leaves", "name", "outputs",
    )  # fmt: skip

    def __init__(
        self,
        assets: Sequence[str],
        leaves: Sequence[str] | None = None,
        name: str = "",
        version: str | Callable[[], str] = "",
        ask_mirrored: Callable[[Mapping[str, object]], Any] | None = None,
        is_mirroring: bool = False,
        outputs: Outputs = NO_OUTPUTS,
        asked_of: object = None,
    ) -> None:
        super().__init__(read_only(np.arange(len(assets), dtype=np.int64)), _as_rows)
        self.assets = assets
        self.ask_mirrored = ask_mirrored
        """Asks with the facts as a mirror shows them; None for a table in which no fact changes there, and where it was pickled."""
        self.is_mirroring = is_mirroring or ask_mirrored is not None
        """Whether facts of the table change in a mirror."""
        self.asked_of = asked_of
        """The compiled table, for a picker; None where it was pickled."""
        self.leaves = assets if leaves is None else leaves
        self.name = name
        self.outputs = outputs
        self._version = version
        self._of_asset: dict[str, int] = {}
        """The rows of each asset, with its path and without; read when they are first asked for."""

    @property
    def version(self) -> str:
        """What the table says, as a digest."""
        if not isinstance(self._version, str):
            self._version = self._version()
        return self._version

    def require(self, other: AnsweredTable) -> None:
        """Raise ContextError unless an answer of `other` is one of this table in this version."""
        if other is self or (self.name == other.name and self.version == other.version):
            return
        own, its = (f"{in_quotes(a.name)} ({plural(len(a.assets), 'row')}" for a in (self, other))
        if self.name == other.name:
            versions = f"version {other.version[:8]}), this is version {self.version[:8]} ({plural(len(self.assets), 'row')})"
            raise ContextError(Fault(f"the answer is of another version of {its}, {versions}.", _OWN_ANSWER, _ASK_AGAIN))
        raise ContextError(Fault(f"the answer is of the table {its}), not of {own}).", _OWN_ANSWER, _ASK_AGAIN))

    def bits_of_assets(self, names: Sequence[str]) -> int:
        """The rows of some assets, with their paths or without; raises ContextError for one that the table does not have."""
        if not self._of_asset:
            self._of_asset = self._rows_by_asset()
        bits = 0
        if unknown := set(names) - self._of_asset.keys():
            raise self.no_asset(min(unknown))
        for name in names:
            bits |= self._of_asset[name]
        return bits

    def _rows_by_asset(self) -> dict[str, int]:
        numbers: dict[str, list[int]] = {}
        for row, names in enumerate(zip(self.assets, self.leaves, strict=True)):
            for name in dict.fromkeys(names):
                numbers.setdefault(name, []).append(row)
        return {name: bitmask.int_of(rows) for name, rows in numbers.items()}

    def no_asset(self, asset: str) -> ContextError:
        """The error for an asset that no row has, with the nearest that one has."""
        known = dict.fromkeys((*self.assets, *self.leaves))
        problem = f"the table {in_quotes(self.name)} has no asset {in_quotes(asset)}."
        return ContextError(Fault(problem, some(known) or "none: the table has no rows", mend_for(asset, known)))


# ---- rows as a caller says them, read into bits


SaidRows = NDArray[np.bool_] | NDArray[np.integer] | Iterable[int] | Iterable[bool] | Iterable[str] | str
"""One bool for each row, row numbers, or assets with their paths or without."""

ACCEPTED = "one bool for each row, row numbers, assets, or an answer of this table"


def bits_said(rows: object, n_rows: int, of_assets: Callable[[Sequence[str]], int]) -> int:
    """The rows that are said, as bits; `of_assets` gives those of assets. Raises WrongType or ContextError where they are said in
    none of these ways, or there are not as many flags as rows; NoSuchPlace where the table has no row of that number."""
    if isinstance(rows, np.ndarray):
        if rows.dtype == np.bool_:
            return bits_of_flags(rows, n_rows)
        if rows.ndim != 1:
            raise ContextError(Fault(f"rows has shape {rows.shape}.", ACCEPTED))
        rows = rows.tolist()
    items = [rows] if isinstance(rows, str) else list(require_many(rows, "rows", ACCEPTED))
    if items and all(isinstance(item, (bool, np.bool_)) for item in items):
        return bits_of_flags(np.array(items, np.bool_), n_rows)
    names = [item for item in items if isinstance(item, str)]
    bits = of_assets(names) if names else 0
    return bits | _bits_of_numbers([item for item in items if not isinstance(item, str)], n_rows)


def bits_of_flags(flags: NDArray[np.bool_], n_rows: int) -> int:
    """The rows of a flag for each row, as bits; raises ContextError for another number of flags."""
    if flags.shape != (n_rows,):
        problem = f"there are flags of shape {flags.shape}, and {plural(n_rows, 'row')}."
        raise ContextError(Fault(problem, f"one bool for each row of the table: ({n_rows},)"))
    return bitmask.to_int(bitmask.pack(flags))


def _bits_of_numbers(numbers: Sequence[object], n_rows: int) -> int:
    flags = np.zeros(n_rows, np.bool_)
    for number in numbers:
        if isinstance(number, (bool, np.bool_)):
            raise WrongType(Fault("rows holds flags beside row numbers or assets.", ACCEPTED))
        flags[require_row(number, n_rows)] = True
    return bitmask.to_int(bitmask.pack(flags)) if numbers else 0
