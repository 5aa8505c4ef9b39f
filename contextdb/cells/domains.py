"""The values that a fact of a condition can have.

A domain is a type and, where they are declared, its values or its bounds:

    bool     False, True
    int      whole numbers                    minimum, maximum
    number   IEEE doubles                     minimum, maximum
    angle    degrees on the circle, [-180, 180)
    date     whole days since 1970-01-01      minimum, maximum
    enum     one of `values`
    text     any text: an enum whose values are not declared
    tags     a set of tags out of `values`; a tag covers what is under it: Move covers Move.Run
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from contextdb.cells.intervals import CIRCLE, Span
from contextdb.cells.kinds import KINDS, Kind


@dataclass(frozen=True, slots=True)
class Domain:
    """All values of a condition. `values` is None where they are not declared."""

    kind: str
    """The name of the type."""
    values: tuple[str, ...] | None = None
    minimum: float = -math.inf
    maximum: float = math.inf
    known: frozenset[str] = field(init=False, repr=False, compare=False)
    """The declared values, to look up in."""
    type: Kind = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "known", frozenset(self.values or ()))
        object.__setattr__(self, "type", KINDS[self.kind])

    @property
    def ends(self) -> Span:
        """The least and the greatest number."""
        return CIRCLE if self.type.is_circular else (self.minimum, self.maximum)

    @property
    def everything(self) -> tuple[bool | str, ...] | None:
        """All values, where they are a list."""
        return self.type.fixed or self.values


BOOL = Domain("bool")
INT = Domain("int")
NUMBER = Domain("number")
ANGLE = Domain("angle")
DATE = Domain("date")
TEXT = Domain("text")
TAGS = Domain("tags")
