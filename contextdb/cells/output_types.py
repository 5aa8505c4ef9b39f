"""The types of outputs, one entry each: what a cell may say, how it is read, what the game gets. Other code asks a type for a
property and never compares its name.

Nothing here knows a file, a table or the name of an output.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from contextdb.cells.domains import BOOL, NUMBER
from contextdb.cells.mends import candidates
from contextdb.cells.words import NUMBER_TEXT, truth_of
from contextdb.errors import in_quotes, nearest, plural

OutputValue = bool | int | float | str | tuple[float, ...]

MOST_NUMBERS = 64
"""The greatest `size`."""

_WHOLE = re.compile(r"[+-]?\d+")
_NUMBER = re.compile(NUMBER_TEXT)
_LEAST, _MOST = -(2**63), 2**63 - 1


class Declared(Protocol):
    """What a type asks of an output's declaration."""

    @property
    def values(self) -> tuple[str, ...]:
        """The values of an enum."""

    @property
    def size(self) -> int:
        """How many numbers a cell has."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class OutputType:
    """One type of output."""

    name: str
    noun: str
    """One value, with its article; "" where its size says it."""
    accepted: str
    """What a cell may say, for messages; "" where the declared values say it."""
    dtype: Any
    """The numpy type of a column of values."""
    absent: OutputValue
    """The value where neither a cell nor a default gives one; of one number, where a cell has several."""
    read: Callable[[str, Declared], OutputValue]
    """The value that the text of a cell gives; ValueError, with why or without a word."""
    take: Callable[[object, Declared], OutputValue]
    """The value that Python or TOML gives; ValueError with why."""
    near: Callable[[str, Declared], Iterator[str]]
    """Texts near to one that cannot be read, the likeliest first."""
    annotation: str
    """The Python type of a value, as a stub says it; "" where it is a Literal of the declared values, {} for one type a number."""
    c_type: str
    """The type of a value in C, with {name} for that of the output."""

    choices: tuple[str, ...] = ()
    """The texts of all values, where they are always the same."""
    is_text: bool = False
    is_free: bool = False
    """Whether any text is a value, an empty one too."""
    is_numeric: bool = False
    """Whether `min` and `max` may be declared."""
    is_whole: bool = False
    """Whether only whole numbers are values."""
    has_values: bool = False
    """Whether `values` must be declared."""
    has_size: bool = False
    """Whether `size` must be declared: a cell has several numbers."""

    def __repr__(self) -> str:
        return f"<output type {self.name}>"


def names_where(is_meant: Callable[[OutputType], bool]) -> tuple[str, ...]:
    return tuple(name for name, kind in OUTPUT_TYPES.items() if is_meant(kind))


# ---- texts


def _read_bool(text: str, output: Declared) -> bool:
    value = truth_of(text)
    if value is None:
        raise ValueError
    return value


def _read_int(text: str, output: Declared) -> int:
    if _WHOLE.fullmatch(text.strip()) and len(text) < 1000:
        value = int(text)
    else:
        number = _read_number(text, output)
        if not number.is_integer():
            raise ValueError("this is not a whole number")
        value = int(number)
    return _fitting(value)


def _fitting(value: int) -> int:
    if not _LEAST <= value <= _MOST:
        raise ValueError("64 bits do not hold it")
    return value


def _read_number(text: str, output: Declared) -> float:
    text = text.strip()
    if not _NUMBER.fullmatch(text):
        raise ValueError
    value = float(text)
    if math.isinf(value) and "inf" not in text.casefold():
        raise ValueError("this is too large for a number")
    return value + 0.0


def _read_enum(text: str, output: Declared) -> str:
    text = text.strip()
    bare = text[1:-1].replace('""', '"') if len(text) > 1 and text[0] == text[-1] == '"' else text
    for value in (text, bare):
        if value in output.values:
            return value
    raise ValueError


def _read_text(text: str, output: Declared) -> str:
    return text


def _read_numbers(text: str, output: Declared) -> tuple[float, ...]:
    words = re.split(r"\s*,\s*|\s+", text.strip())
    if len(words) != output.size:
        raise ValueError(f"this has {plural(len(words), 'part')}")
    return tuple(_read_number(word, output) for word in words)


# ---- texts near to one that cannot be read, the likeliest first


def _near_bool(text: str, output: Declared) -> Iterator[str]:
    return iter(candidates(text, BOOL))


def _near_int(text: str, output: Declared) -> Iterator[str]:
    yield from _near_number(text, output)
    if _NUMBER.fullmatch(text) and math.isfinite(float(text)):
        yield str(round(float(text)))


def _near_number(text: str, output: Declared) -> Iterator[str]:
    yield text.replace(",", ".")
    yield from candidates(text, NUMBER)


def _near_enum(text: str, output: Declared) -> Iterator[str]:
    yield nearest(text.strip("\"' "), output.values) or ""


def _near_text(text: str, output: Declared) -> Iterator[str]:
    return iter(())


def _near_numbers(text: str, output: Declared) -> Iterator[str]:
    plain = re.sub(r"[A-Za-z_]+\s*[=:]|[\[\](){}<>\"']", " ", text)
    for near in (plain, re.sub(r"[;|/]", " ", plain), re.sub(r"[;|/]", " ", plain.replace(",", "."))):
        yield " ".join(near.split())


# ---- values of Python and TOML


def _take_bool(value: object, output: Declared) -> bool:
    if not isinstance(value, (bool, np.bool_)):
        raise ValueError("this is not true or false")
    return bool(value)


def _take_int(value: object, output: Declared) -> int:
    number = _take_number(value, output)
    if isinstance(value, (int, np.integer)):
        return _fitting(int(value))
    if not number.is_integer():
        raise ValueError("this is not a whole number")
    return _fitting(int(number))


def _take_number(value: object, output: Declared) -> float:
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise ValueError("this is not a number")
    try:
        number = float(value)
    except OverflowError:
        raise ValueError("this is too large for a number") from None
    if math.isnan(number):
        raise ValueError("NaN is not a value")
    return number + 0.0


def _take_enum(value: object, output: Declared) -> str:
    text = _take_text(value, output)
    if text not in output.values:
        near = nearest(text, output.values)
        hint = f"; {in_quotes(near)} is" if near else ""
        raise ValueError(f"this is not one of the values{hint}")
    return text


def _take_text(value: object, output: Declared) -> str:
    if not isinstance(value, str):
        raise ValueError("this is not a text")
    return value


def _take_numbers(value: object, output: Declared) -> tuple[float, ...]:
    if not isinstance(value, (list, tuple, np.ndarray)):
        raise ValueError("this is not a list of numbers")
    if len(value) != output.size:
        raise ValueError(f"this has {plural(len(value), 'number')}, not {output.size}")
    return tuple(_take_number(number, output) for number in value)


# ---- the table


_ALL = (
    OutputType(
        "bool",
        "a bool",
        accepted='"True" or "False"',
        dtype=np.bool_,
        absent=False,
        read=_read_bool,
        take=_take_bool,
        near=_near_bool,
        annotation="bool",
        c_type="int ",
        choices=("True", "False"),
    ),
    OutputType(
        "int",
        "an int",
        accepted="a whole number, such as 3",
        dtype=np.int64,
        absent=0,
        read=_read_int,
        take=_take_int,
        near=_near_int,
        annotation="int",
        c_type="int64_t ",
        is_numeric=True,
        is_whole=True,
    ),
    OutputType(
        "number",
        "a number",
        accepted="a number, such as 0.5",
        dtype=np.float64,
        absent=math.nan,
        read=_read_number,
        take=_take_number,
        near=_near_number,
        annotation="float",
        c_type="double ",
        is_numeric=True,
    ),
    OutputType(
        "enum",
        "a value",
        accepted="",
        dtype=object,
        absent="",
        read=_read_enum,
        take=_take_enum,
        near=_near_enum,
        annotation="",
        c_type="{name}_value ",
        is_text=True,
        has_values=True,
    ),
    OutputType(
        "text",
        "a text",
        accepted="any text",
        dtype=object,
        absent="",
        read=_read_text,
        take=_take_text,
        near=_near_text,
        annotation="str",
        c_type="const char *",
        is_text=True,
        is_free=True,
    ),
    OutputType(
        "numbers",
        "",
        accepted="{size} numbers with spaces or commas between",
        dtype=np.float64,
        absent=math.nan,
        read=_read_numbers,
        take=_take_numbers,
        near=_near_numbers,
        annotation="tuple[{}]",
        c_type="const double *",
        is_numeric=True,
        has_size=True,
    ),
)

OUTPUT_TYPES: dict[str, OutputType] = {kind.name: kind for kind in _ALL}
"""All types by name, in the order in which they are shown."""
