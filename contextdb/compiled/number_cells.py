"""The class of a number among a column's bounds, without bisection where the bounds lie well apart.

The line is cut into equal cells, so many that no three bounds share one: a cell "2..3" has a bound at 2, "1..2" one just above. A
number's cell says how many bounds are below its cell, and two comparisons say the rest: exact, because which cell a number is in
never falls as the number grows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
MOST_CELLS = 1 << 13


NumberCells = tuple[Doubles, float, float, NDArray[np.int32]]
"""Bounds float64 [K - 1], ascending, and two NaN behind them; the first bound; how many cells a unit has; for each cell int32 how
many bounds lie in earlier ones. Class k holds the x with bounds[k - 1] <= x < bounds[k]."""


def number_cells(bounds: Doubles) -> NumberCells | None:
    """The fewest cells of which none has three bounds; None where bisection is needed."""
    n_cells = 64
    while len(bounds) > 1 and n_cells <= MOST_CELLS:
        with np.errstate(over="ignore"):
            scale = (n_cells - 1) / (bounds[-1] - bounds[0])
        cells = _cells_of(bounds, bounds[0], scale, n_cells)
        if scale > 0.0 and np.isfinite(scale) and (cells[2:] > cells[:-2]).all():
            before = np.searchsorted(cells, np.arange(n_cells)).astype(np.int32)
            return np.append(bounds, [np.nan, np.nan]), float(bounds[0]), float(scale), before
        n_cells *= 2
    return None


def _cells_of(numbers: Doubles, low: float, scale: float, n_cells: int) -> NDArray[np.int32]:
    """The cell of each number, as the core finds it; those beyond the ends are in the first and the last."""
    with np.errstate(all="ignore"):
        cells: NDArray[np.int32] = np.minimum(np.maximum((numbers - low) * scale, 0.0), n_cells - 1.0).astype(np.int32)
    return cells
