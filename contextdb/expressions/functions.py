"""What an expression can compute with: the operators and the functions, what each takes and what each gives.

`many` does the work for arrays; the core's programs do it for one double, and give the same bits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from contextdb.cells.intervals import wrap_angles
from contextdb.expressions import arithmetic

Gives = Literal["whole if whole", "whole", "number", "angle"]
"""The kind of result; "whole if whole": an int when every argument is one."""


@dataclass(frozen=True)
class Function:
    """A function of numbers."""

    form: str
    """As people write it: "clamp(x, low, high)"."""
    many: Callable[..., Any]
    least: int
    most: int | None
    """How many arguments; None: any number from `least` on."""
    gives: Gives
    keeps_unit: bool
    """Whether arguments and result share one unit."""
    exponent: int | None = None
    """Of a power."""


def _operator(sign: str, many: Callable[..., Any], gives: Gives, keeps_unit: bool) -> Function:
    return Function(f"a {sign} b", many, 2, 2, gives, keeps_unit)


OPERATORS = {
    "+": _operator("+", np.add, "whole if whole", True),
    "-": _operator("-", np.subtract, "whole if whole", True),
    "*": _operator("*", np.multiply, "whole if whole", False),
    "/": _operator("/", np.divide, "number", False),
    "//": _operator("//", np.floor_divide, "whole", False),
    "%": _operator("%", np.remainder, "whole if whole", True),
}
NEGATIVE = Function("-x", np.negative, 1, 1, "whole if whole", True)
MOST_POWER = 64

FUNCTIONS = {
    "abs": Function("abs(x)", np.abs, 1, 1, "whole if whole", True),
    "min": Function("min(a, b, ...)", arithmetic.lowest, 2, None, "whole if whole", True),
    "max": Function("max(a, b, ...)", arithmetic.highest, 2, None, "whole if whole", True),
    "clamp": Function("clamp(x, low, high)", arithmetic.clamped, 3, 3, "whole if whole", True),
    "hypot": Function("hypot(x, y)", arithmetic.lengths, 2, 2, "number", True),
    "sqrt": Function("sqrt(x)", np.sqrt, 1, 1, "number", False),
    "floor": Function("floor(x)", np.floor, 1, 1, "whole", True),
    "ceil": Function("ceil(x)", np.ceil, 1, 1, "whole", True),
    "round": Function("round(x)", np.rint, 1, 1, "whole", True),
    "atan2": Function("atan2(y, x)", arithmetic.headings, 2, 2, "angle", False),
    "wrap_angle": Function("wrap_angle(degrees)", wrap_angles, 1, 1, "angle", False),
}


def power_of(exponent: int) -> Function:
    """The function x ** exponent, for a whole exponent from 0 to MOST_POWER."""
    return Function("x ** n", arithmetic.powered(exponent), 1, 1, "whole if whole", False, exponent)
