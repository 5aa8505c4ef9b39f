"""The values that a fact of a condition can have.

A domain is a kind and, where they are declared, its values or its bounds:

    bool     False, True
    int      whole numbers                    minimum, maximum
    number   IEEE doubles                     minimum, maximum
    angle    degrees on the circle, [-180, 180)
    enum     one of `values`
    text     any text: an enum whose values are not declared
    tags     a set of tags out of `values`; a tag covers what is under it: Move covers Move.Run
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, get_args

Kind = Literal["bool", "int", "number", "angle", "enum", "text", "tags"]
KINDS: tuple[Kind, ...] = get_args(Kind)
NUMERIC: tuple[Kind, ...] = ("int", "number", "angle")


@dataclass(frozen=True, slots=True)
class Domain:
    """All values of a condition. `values` is None where they are not declared."""

    kind: Kind
    values: tuple[str, ...] | None = None
    minimum: float = -math.inf
    maximum: float = math.inf
    known: frozenset[str] = field(init=False, repr=False, compare=False)
    """The declared values, to look up in."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "known", frozenset(self.values or ()))


BOOL = Domain("bool")
INT = Domain("int")
NUMBER = Domain("number")
ANGLE = Domain("angle")
TEXT = Domain("text")
TAGS = Domain("tags")


def wrap_angle(degrees: float) -> float:
    """The same angle in [-180, 180), exactly: both steps lose no bit."""
    rest = math.fmod(degrees, 360.0)
    if rest >= 180.0:
        return rest - 360.0
    return rest + 360.0 if rest < -180.0 else rest + 0.0
