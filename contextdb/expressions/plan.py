"""A checked expression: what is to be computed, with every name, word and type settled.

Values are numbers, truths, texts and sets of tags. A number is a double, NaN where it is missing; the others are None where they
are missing. Missing spreads through arithmetic and comparison; `and` and `or` know an answer without it where one part decides
(Kleene's three values); a conditional is missing where its condition is.
"""

from __future__ import annotations

from dataclasses import dataclass

from contextdb.cells.kinds import Kind
from contextdb.cells.sets import Cell
from contextdb.expressions.functions import Function


@dataclass(frozen=True, slots=True)
class Type:
    """What a part of an expression gives: a kind; the texts that it can give, where they are known; its unit, where known."""

    kind: Kind
    values: frozenset[str] | None = None
    unit: str | None = None

    @property
    def is_number(self) -> bool:
        return self.kind.is_numeric

    @property
    def is_text(self) -> bool:
        return self.kind.is_named


@dataclass(frozen=True)
class Const:
    """A number, text or truth."""

    value: float | str | bool


@dataclass(frozen=True)
class Given:
    """A fact, by the name of its condition."""

    name: str
    kind: Kind


@dataclass(frozen=True)
class Apply:
    """A function of numbers; its result is settled."""

    function: Function
    parts: tuple[Part, ...]


@dataclass(frozen=True, slots=True)
class Link:
    """One comparison of a chain. Texts and truths have the signs == and != only.

    `is_wrapped`: both are wrapped to [-180, 180) before (equality with an angle). `left_is_high`, `right_is_high`: the angle on
    that side counts as 180 where it is -180, as at the upper end of a cell's interval.
    """

    sign: str
    is_wrapped: bool = False
    left_is_high: bool = False
    right_is_high: bool = False


@dataclass(frozen=True)
class Compare:
    """A chain of comparisons, all of which must hold. `links` is one shorter than `parts`."""

    parts: tuple[Part, ...]
    links: tuple[Link, ...]


@dataclass(frozen=True)
class Held:
    """Whether a cell holds a value."""

    part: Part
    cell: Cell


@dataclass(frozen=True)
class Logic:
    """`and` or `or` over truths."""

    word: str
    parts: tuple[Part, ...]


@dataclass(frozen=True)
class Negation:
    """`not` of a truth."""

    part: Part


@dataclass(frozen=True)
class Select:
    """`then if condition else otherwise`."""

    condition: Part
    then: Part
    otherwise: Part


Part = Const | Given | Apply | Compare | Held | Logic | Negation | Select
