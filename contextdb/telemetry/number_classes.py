"""The class of a number among a column's bounds, without bisection where the bounds lie well apart.

The line is cut into equal cells, so many that no two bounds share one. A number's cell says how many bounds are below its cell, and
one comparison says the rest: exact, because which cell a number is in never falls as the number grows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
MOST_CELLS = 1 << 13


@dataclass(frozen=True, eq=False)
class NumberClasses:
    """Bounds float64 [K - 1], ascending: class k holds the x with bounds[k - 1] <= x < bounds[k], and class K stands for NaN.

    `before` int32 [cells]: how many bounds lie in earlier cells; it is empty where bisection is needed. `ended` are the bounds and
    a NaN, for numbers that all of them are below.
    """

    bounds: Doubles
    ended: Doubles
    low: float
    scale: float
    before: NDArray[np.int32]

    @classmethod
    def of(cls, bounds: Doubles) -> NumberClasses:
        """Find the fewest cells that keep the bounds apart."""
        ended = np.append(bounds, np.nan)
        n_cells = 64
        while len(bounds) > 1 and n_cells <= MOST_CELLS:
            with np.errstate(over="ignore"):
                scale = (n_cells - 1) / (bounds[-1] - bounds[0])
            cells = cells_of(bounds, bounds[0], scale, n_cells)
            if scale > 0.0 and np.isfinite(scale) and (np.diff(cells) > 0).all():
                before = np.searchsorted(cells, np.arange(n_cells)).astype(np.int32)
                return cls(bounds, ended, float(bounds[0]), float(scale), before)
            n_cells *= 2
        return cls(bounds, ended, 0.0, 0.0, np.zeros(0, np.int32))


def cells_of(numbers: Doubles, low: float, scale: float, n_cells: int) -> NDArray[np.int32]:
    """The cell of each number, as the kernel finds it; those beyond the ends are in the first and the last."""
    with np.errstate(all="ignore"):
        found: NDArray[np.int32] = np.minimum(np.maximum((numbers - low) * scale, 0.0), n_cells - 1.0).astype(np.int32)
    return found
