"""Some rows of a table as a caller says them, read into bits: flags, row numbers or assets."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.cells.arguments import require_many, require_row
from contextdb.errors import ContextError, Fault, WrongType, plural

SaidRows = NDArray[np.bool_] | NDArray[np.integer] | Iterable[int] | Iterable[bool] | Iterable[str] | str
"""One bool for each row, row numbers, or assets with their paths or without."""

ACCEPTED = "one bool for each row, row numbers, assets, or an answer of this table"


def bits_said(said: object, n_rows: int, of_assets: Callable[[Sequence[str]], int]) -> int:
    """The rows that are said, as bits; `of_assets` gives those of assets. Raises WrongType or ContextError where they are said in
    none of these ways, or there are not as many flags as rows; NoSuchPlace where the table has no row of that number."""
    if isinstance(said, np.ndarray):
        if said.dtype == np.bool_:
            return bits_of_flags(said, n_rows)
        if said.ndim != 1:
            raise ContextError(Fault(f"rows has shape {said.shape}.", ACCEPTED))
        said = said.tolist()
    items = [said] if isinstance(said, str) else list(require_many(said, "rows", ACCEPTED))
    if items and all(isinstance(item, (bool, np.bool_)) for item in items):
        return bits_of_flags(np.array(items, np.bool_), n_rows)
    names = [item for item in items if isinstance(item, str)]
    bits = of_assets(names) if names else 0
    return bits | _bits_of_numbers([item for item in items if not isinstance(item, str)], n_rows)


def bits_of_flags(flags: NDArray[np.bool_], n_rows: int) -> int:
    """The rows of a flag for each row, as bits; raises ContextError for another number of flags."""
    if flags.shape != (n_rows,):
        found = f"there are flags of shape {flags.shape}, and {plural(n_rows, 'row')}."
        raise ContextError(Fault(found, f"one bool for each row of the table: ({n_rows},)"))
    return bitmask.to_int(bitmask.pack(flags))


def _bits_of_numbers(numbers: Sequence[object], n_rows: int) -> int:
    flags = np.zeros(n_rows, np.bool_)
    for number in numbers:
        if isinstance(number, (bool, np.bool_)):
            raise WrongType(Fault("rows holds flags beside row numbers or assets.", ACCEPTED))
        flags[require_row(number, n_rows)] = True
    return bitmask.to_int(bitmask.pack(flags)) if numbers else 0
