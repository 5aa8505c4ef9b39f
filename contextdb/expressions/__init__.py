"""Expressions over conditions: derived facts and assumptions.

    not (IsInMidAirAnim and IsInCatchAnim)          speed > 3 and gait in ["Walk", "Run"]
    speed - target_speed                            hypot(vx, vz) if is_moving else 0
    wrap_angle(heading - target_heading)            "InAir" in Defender.Tags

    values        facts by name (odd names in backquotes), numbers, texts in quotes, True, False
    operators     or   and   not   == != < <= > >= in not in   + -   * / // %   -x   **      loose to tight, as in Python
    choice        A if CONDITION else B
    functions     abs min max clamp hypot sqrt floor ceil round atan2 wrap_angle      angles in degrees

All numbers are IEEE doubles, ints too, exact up to 2**53. An exponent is a whole number from 0 to 64. Where an angle is compared
for equality both sides are wrapped; in an order it lies from -180 to 180, and half a turn counts as either, as in a cell.
After `in` stands a list of constants, a fact of type tags (a tag covers what is under it), or a cell: `heading in "170..-170"`.

Missing: a fact that is absent, None or NaN is missing, and so is what is not finite: `1 / x` where x is 0, a root below 0, an
overflow. Missing spreads through arithmetic and comparison; `and` and `or` know their answer without it where one part decides
(`False and missing` is False); a choice is missing where its condition is. An infinite fact is compared as it is.

One context and a frame of millions give the same answers to the last bit. Text is never run: it is read into a tree by hand, at
most 4,000 characters and 64 levels.
"""

from contextdb.expressions.assume import Assumptions, assumption_faults, constant_truth, read_assumptions
from contextdb.expressions.boxes import Box
from contextdb.expressions.derived import Derivation, derivation_faults, derive
from contextdb.expressions.expression import Expression, read_expression
from contextdb.expressions.tokens import ExpressionError, ExpressionFault, names_in, with_names

__all__ = ["Assumptions", "Box", "Derivation", "Expression", "ExpressionError", "ExpressionFault", "assumption_faults"]
__all__ += ["constant_truth", "derivation_faults", "derive", "names_in", "read_assumptions", "read_expression", "with_names"]
