"""What an expression can compute with: the operators and the functions, what each takes and what each gives.

`one` and `many` do the work, for a double and for arrays, and give the same bits: see `contextdb.expressions.arithmetic`.
"""

from __future__ import annotations

import operator
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
    """A function of numbers. `many` takes arrays where `one` takes numbers."""

    form: str
    """As people write it: "clamp(x, low, high)"."""
    one: Callable[..., float]
    many: Callable[..., Any]
    least: int
    most: int | None
    """How many arguments; None: any number from `least` on."""
    gives: Gives
    keeps_unit: bool
    """Whether arguments and result share one unit."""
    exponent: int | None = None
    """Of a power."""


def _operator(sign: str, one: Callable[..., Any], many: Callable[..., Any], gives: Gives, keeps_unit: bool) -> Function:
    return Function(f"a {sign} b", one, many, 2, 2, gives, keeps_unit)


OPERATORS = {
    "+": _operator("+", operator.add, np.add, "whole if whole", True),
    "-": _operator("-", operator.sub, np.subtract, "whole if whole", True),
    "*": _operator("*", operator.mul, np.multiply, "whole if whole", False),
    "/": _operator("/", arithmetic.divided, np.divide, "number", False),
    "//": _operator("//", arithmetic.floor_divided, np.floor_divide, "whole", False),
    "%": _operator("%", arithmetic.remainder, np.remainder, "whole if whole", True),
}
NEGATIVE = Function("-x", operator.neg, np.negative, 1, 1, "whole if whole", True)
MOST_POWER = 64

FUNCTIONS = {
    "abs": Function("abs(x)", abs, np.abs, 1, 1, "whole if whole", True),
    "min": Function("min(a, b, ...)", arithmetic.lowest, arithmetic.all_lowest, 2, None, "whole if whole", True),
    "max": Function("max(a, b, ...)", arithmetic.highest, arithmetic.all_highest, 2, None, "whole if whole", True),
    "clamp": Function("clamp(x, low, high)", arithmetic.clamped, arithmetic.all_clamped, 3, 3, "whole if whole", True),
    "hypot": Function("hypot(x, y)", arithmetic.length, arithmetic.lengths, 2, 2, "number", True),
    "sqrt": Function("sqrt(x)", arithmetic.rooted, np.sqrt, 1, 1, "number", False),
    "floor": Function("floor(x)", arithmetic.floored, np.floor, 1, 1, "whole", True),
    "ceil": Function("ceil(x)", arithmetic.ceiled, np.ceil, 1, 1, "whole", True),
    "round": Function("round(x)", arithmetic.rounded, np.rint, 1, 1, "whole", True),
    "atan2": Function("atan2(y, x)", arithmetic.heading, arithmetic.headings, 2, 2, "angle", False),
    "wrap_angle": Function("wrap_angle(degrees)", arithmetic.wrapped, wrap_angles, 1, 1, "angle", False),
}


def power_of(exponent: int) -> Function:
    """The function x ** exponent, for a whole exponent from 0 to MOST_POWER."""
    power = arithmetic.powered(exponent)
    return Function("x ** n", power, power, 1, 1, "whole if whole", False, exponent)
