"""The types of conditions, one entry each: all that a type decides by itself.

A type belongs to a family, by the set that its cells hold:

    numbers    int number angle date    spans of doubles; the types differ in how a number is spelt, wrapped and rounded
    values     bool enum text           some values out of a list, or (where the list is open) all but some
    tags       tags                     what a set of tags must have and must not have

Code asks a condition's type for a property (`domain.type.is_whole`), never for its name. What only one package needs to know of a
type, such as its name in C, is a table by name in that package; `tests/test_kinds.py` checks that each has an entry for each type.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from decimal import Decimal
from enum import Enum
from numbers import Real
from typing import Any

import numpy as np

from contextdb.cells import dates, intervals
from contextdb.cells.intervals import EVERYTHING, Span, Spans
from contextdb.cells.words import NUMBER_TEXT, format_number


class Family(Enum):
    """What the cells of a type hold."""

    NUMBERS = "numbers"
    VALUES = "values"
    TAGS = "tags"


@dataclass(frozen=True, slots=True)
class Spelling:
    """How the numbers of a type are written: in cells, in facts, in contextdb.toml."""

    number: str
    """A pattern of one number, without groups."""
    read: Callable[[str], float]
    """The number that a matching text is; ValueError where it is none after all."""
    write: Callable[[float], str]
    step: str = NUMBER_TEXT
    """A pattern of a tolerance: how far two numbers are apart."""
    mends: tuple[tuple[str, str], ...] = ()
    """Patterns of what people write instead, and what they mean."""


DECIMALS = Spelling(NUMBER_TEXT, float, format_number)


def _as_they_are(spans: Spans) -> Spans:
    return spans


def _from_number(value: object) -> float | None:
    if type(value) is float:
        return value + 0.0 if value == value else None
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if not isinstance(value, (Real, Decimal, np.integer, np.floating, np.bool_)) or isinstance(value, np.timedelta64):
        raise TypeError
    try:
        number = float(value) + 0.0
    except (OverflowError, ValueError):
        raise ValueError("a number that a double can hold") from None
    return None if math.isnan(number) else number


def _is_number_column(dtype: Any) -> bool:
    return bool(dtype.is_numeric() and not dtype.is_decimal())


def _is_date_column(dtype: Any) -> bool:
    return str(dtype) in ("Date", "Float64")


def _as_date(day: float) -> object:
    return dates.date_of(day)


def _as_int(value: float) -> object:
    return int(value) if math.isfinite(value) else value


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Kind:
    """One type of condition."""

    name: str
    family: Family
    cells: str
    """What a cell may say, for messages."""
    facts: str
    """What a fact may be, for messages."""
    words: str
    """What the type is, in a few words, for a list to choose from."""
    noun: str
    """One fact, with its article."""
    value: str
    """What a part of an expression gives, for messages."""
    unbounded: str
    """Why keys of contextdb.toml that other types have are wrong here."""
    dtype: str
    """The polars type of a column of facts, by its name: polars is loaded where a column needs it."""
    result: str = ""
    """How an expression gives a fact, for messages; "" where any of its values is one."""
    python: type | None = None
    """The Python type of which every value is a fact as it is; None where values are checked or changed."""
    from_python: Callable[[object], float | None] = _from_number
    """The number that a fact in Python is, None for what means a missing one; TypeError for no fact, ValueError with why."""
    is_column: Callable[[Any], bool] = _is_number_column
    """Whether a polars type is that of a column of plain facts, for numbers."""
    annotation: str = "str"
    """The Python type of a fact, as a stub says it."""
    csharp: str = "double"
    """The same in C#."""
    unreal: tuple[str, str] = ("double", "0.0")
    """The type of a fact and its first value in Unreal."""
    synonyms: tuple[str, ...] = ()
    """What people call the type."""

    spelling: Spelling = DECIMALS
    is_bounded: bool = False
    """Whether `min` and `max` may be declared."""
    bound: str = "a number, such as -1.5"
    """What they may be, for messages."""
    is_circular: bool = False
    """Whether numbers are degrees on the circle."""
    is_whole: bool = False
    """Whether only whole numbers are facts."""
    is_negated: bool = False
    """Whether a mirror may change the sign."""
    limits: Span = EVERYTHING[0]
    """The least and the greatest number that can be a fact."""
    fitted: Callable[[Spans], Spans] = _as_they_are
    """Spans without the numbers that are no facts of the type."""
    exact: Callable[[Any], float] | None = None
    """The number of a usual fact, for the fast way to it; raises for any other. None: the double that any number means."""
    given: Callable[[float], object] = float
    """A number that is a fact as Python code has it."""
    has_unit: bool = False
    """Whether a declared unit says what the numbers count."""
    unit: str = ""
    """The unit of all its numbers."""

    has_values: bool = False
    """Whether `values` may be declared."""
    needs_values: bool = False
    """Whether `values` must be declared."""
    is_open: bool = False
    """Whether values may be facts that neither a cell nor contextdb.toml names."""
    fixed: tuple[bool | str, ...] | None = None
    """The values, where they are always the same."""

    is_numeric: bool = field(init=False)
    """Whether cells are spans of numbers."""
    is_decimal: bool = field(init=False)
    """Whether cells write decimal numbers."""
    is_spelt: bool = field(init=False)
    """Whether its numbers are written as texts of their own."""
    is_tags: bool = field(init=False)
    """Whether a fact is a set of tags."""
    is_truth: bool = field(init=False)
    """Whether a fact is True or False."""
    is_named: bool = field(init=False)
    """Whether a fact is one name out of some."""
    is_swapped: bool = field(init=False)
    """Whether names may change places in a mirror."""

    def __post_init__(self) -> None:
        is_numeric, is_tags, is_truth = self.family is Family.NUMBERS, self.family is Family.TAGS, self.fixed == (False, True)
        is_named = self.family is Family.VALUES and not is_truth
        claims = {"is_numeric": is_numeric, "is_tags": is_tags, "is_truth": is_truth, "is_named": is_named}
        claims |= {"is_decimal": is_numeric and self.spelling is DECIMALS, "is_spelt": is_numeric and self.spelling is not DECIMALS}
        for name, value in (claims | {"is_swapped": is_named or is_tags}).items():  # fields, which reading a fact needs
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return f"<type {self.name}>"

    def __reduce__(self) -> tuple[Callable[[str], Kind], tuple[str]]:
        """What is pickled: the name."""
        return kind_named, (self.name,)


_NUMBER_CELLS = '"20, 9{rest}" (centre, tolerance), "10..30", "<=5", "0..5 | 10..15", "Any"'

_ALL = (
    Kind(
        "bool",
        Family.VALUES,
        cells='"True", "False", "Any"',
        facts="True or False",
        words="True or False",
        noun="a bool",
        value="True or False",
        result="True or False: a comparison such as speed > 0",
        unbounded="a bool is True or False",
        dtype="Boolean",
        python=bool,
        annotation="bool",
        csharp="bool",
        unreal=("bool", "false"),
        synonyms=("boolean", "flag", "logical", "truth"),
        is_negated=True,
        fixed=(False, True),
    ),
    Kind(
        "int",
        Family.NUMBERS,
        cells=_NUMBER_CELLS.format(rest=""),
        facts="a whole number",
        words="whole numbers",
        noun="an int",
        value="a number",
        result="a whole number: round(x), floor(x) or ceil(x)",
        unbounded="a number is declared by min and max",
        dtype="Float64",
        annotation="int",
        csharp="long",
        unreal=("int64", "0"),
        synonyms=("integer", "long", "int32", "int64", "whole", "count"),
        is_bounded=True,
        is_whole=True,
        is_negated=True,
        fitted=intervals.whole,
        exact=operator.index,
        given=_as_int,
        has_unit=True,
    ),
    Kind(
        "number",
        Family.NUMBERS,
        cells=_NUMBER_CELLS.format(rest=".99"),
        facts="a number",
        words="any number",
        noun="a number",
        value="a number",
        unbounded="a number is declared by min and max",
        dtype="Float64",
        python=float,
        annotation="float",
        synonyms=("float", "double", "real", "decimal", "numeric", "float32", "float64", "range"),
        is_bounded=True,
        is_negated=True,
        has_unit=True,
    ),
    Kind(
        "angle",
        Family.NUMBERS,
        cells='"20, 9.99" (centre, tolerance), "10..30", "170..-170" (through 180), "Any"',
        facts="a finite number of degrees",
        words="degrees, on the circle",
        noun="an angle",
        value="an angle",
        unbounded="an angle wraps around, so it has no ends and no list",
        dtype="Float64",
        annotation="float",
        synonyms=("degrees", "degree", "deg", "direction", "heading", "rotation", "yaw"),
        is_circular=True,
        is_negated=True,
        unit="degrees",
    ),
    Kind(
        "date",
        Family.NUMBERS,
        cells='"2026-01-01..2026-03-31", "2026-01-31, 7" (7 days around), "<=2026-03-31", "not 2026-12-24", "Any"',
        facts='a date: datetime.date, or text such as "2026-01-31"',
        words="days, such as 2026-01-31",
        noun="a date",
        value="a date",
        result='date("2026-01-31"), or a whole number of days since 1970-01-01',
        unbounded="a date is declared by min and max",
        dtype="Date",
        annotation="datetime.date",
        csharp="DateTime",
        unreal=("FString", ""),
        synonyms=("day", "datetime", "calendar"),
        spelling=Spelling(dates.DATE_TEXT, dates.read_date, dates.write_date, mends=dates.MENDS),
        from_python=dates.day_from_python,
        is_column=_is_date_column,
        is_bounded=True,
        bound='a date, such as "2026-01-31"',
        is_whole=True,
        limits=dates.LIMITS,
        fitted=dates.days_within,
        exact=dates.exact_day,
        given=_as_date,
    ),
    Kind(
        "enum",
        Family.VALUES,
        cells='one or more declared values with spaces between, for all others not before them, "Any"',
        facts="one of its declared values",
        words="one of the names below",
        noun="an enum",
        value="a value of an enum",
        result="one of its declared values in quotes",
        unbounded="names have no order",
        dtype="String",
        synonyms=("choice", "option", "category", "categorical", "enumeration", "list"),
        has_values=True,
        needs_values=True,
    ),
    Kind(
        "text",
        Family.VALUES,
        cells='one or more words with spaces between, others in double quotes, "Any"',
        facts="a text",
        words="any name",
        noun="a text",
        value="a text",
        unbounded="a text can be anything",
        dtype="String",
        python=str,
        csharp="string",
        unreal=("FString", ""),
        synonyms=("string", "str", "name"),
        is_open=True,
    ),
    Kind(
        "tags",
        Family.TAGS,
        cells='"+InAir -Stunned" (has, has not), "Any"',
        facts="a set of tags",
        words="a set of tags",
        noun="tags",
        value="a set of tags",
        unbounded="tags have no order",
        dtype="List(String)",
        csharp="IList<string>",
        unreal=("TArray<FString>", ""),
        synonyms=("tag", "set", "labels", "gameplaytags", "tagset"),
        has_values=True,
    ),
)

KINDS: dict[str, Kind] = {kind.name: kind for kind in _ALL}
"""All types by name, in the order in which they are shown."""

assert all(re.compile(kind.spelling.number).groups == 0 for kind in KINDS.values()), "the grammar numbers its own groups"


def names_where(is_meant: Callable[[Kind], bool]) -> tuple[str, ...]:
    return tuple(name for name, kind in KINDS.items() if is_meant(kind))


def kind_named(name: str) -> Kind:
    return KINDS[name]
