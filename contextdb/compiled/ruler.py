"""A ruler beside the bounds of a number column: most numbers find their mask at its marks, without a bisection.

The line is cut into equal stretches, about as many as there are bounds. A stretch knows the last bound up to its end and the mask
from there on; so a number of the stretch that is not below that bound has its mask. Any other is bisected. Bounds are
mostly round numbers, so lengths of 1, 2 and 5 times a power of ten are tried: there a bound is where a stretch begins.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FEWEST_BOUNDS = 32
"""With fewer a bisection takes no longer."""
MOST_STRETCHES = 2
"""At most so many for each bound."""
BISECTED = 0.1
"""A share of the line that may have to be bisected: a ruler with less is not cut finer."""


@dataclass(frozen=True)
class Ruler:
    """The number x is on stretch number `int(x * per_unit - start)`, of `len(lasts)`, where that is not negative."""

    per_unit: float
    start: float
    lasts: list[float]
    """For each stretch the last bound up to its end."""
    masks: list[Any]
    """For each stretch the mask of the numbers from that bound up to the next."""


def ruler_of(bounds: Sequence[float], masks: Sequence[Any]) -> Ruler | None:
    """The ruler from the second to the last but one bound, where `masks[k]` is for the numbers that k bounds are not above; None
    where a bisection is as fast."""
    inner = np.array(bounds[1:-1], np.float64)
    per_unit = _per_unit(inner) if len(inner) >= FEWEST_BOUNDS else None
    if per_unit is None:
        return None
    start = float(inner[0] * per_unit // 1.0)
    stretches = np.arange(inner[-1] * per_unit - start, dtype=np.float64)
    below = np.searchsorted((np.array(bounds) * per_unit - start) // 1.0, stretches, "right").tolist()
    return Ruler(per_unit, start, [bounds[n - 1] for n in below], [masks[n] for n in below])


def _per_unit(inner: NDArray[np.float64]) -> float | None:
    """How many stretches to a unit: the fewest with which few numbers have to be bisected."""
    span = float(inner[-1] - inner[0])
    power = math.floor(math.log10(len(inner) / span)) if span > 0.0 and math.isfinite(len(inner) / span) else None
    if power is None or abs(power) > 15:
        return None
    found: float | None = None
    for per_unit in (factor * 10.0**p for p in (power, power + 1) for factor in (1.0, 2.0, 5.0)):
        at = inner * per_unit
        stretch = at // 1.0
        n_stretches = stretch[-1] - stretch[0] + 1.0
        if n_stretches > MOST_STRETCHES * len(inner):
            break
        is_last = np.append(stretch[1:] != stretch[:-1], True)
        found = per_unit
        if float((at - stretch)[is_last].sum()) < BISECTED * n_stretches:
            break
    return found
