"""Outputs: typed columns of data for the game, which exclude no row.

    bool     True  False             as in the cells of a condition
    int      12                      a whole number of 64 bits
    number   0.25                    a double, never NaN
    enum     Fire                    one of the declared values
    text     Get down!               any text, as it is
    numbers  0 1.5 0                 so many numbers as `size` says, with spaces or commas between

An empty cell means the default; without one it is a fault, but for text, which is then "". What there is where no row gives a value
is `Output.nothing`. Nothing here knows a file or a table.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from contextdb.cells.domains import BOOL, NUMBER
from contextdb.cells.mends import candidates
from contextdb.cells.words import NUMBER_TEXT, format_number, says_any, truth_of
from contextdb.errors import CellError, Fault, in_quotes, nearest, plural, some

OutputValue = bool | int | float | str | tuple[float, ...]

SLOT_COLUMNS = ("Mandatory_Slots", "Optional_Slots")
"""The outputs that say which roles a row fills."""

OUTPUT_TYPES = ("bool", "int", "number", "enum", "text", "numbers")
NUMERIC = ("int", "number", "numbers")
"""The types that have `min` and `max`."""
NAMED = ("enum", "text")
"""The types whose values are texts."""

MOST_NUMBERS = 64
"""The greatest `size`."""

_WHOLE = re.compile(r"[+-]?\d+")
_NUMBER = re.compile(NUMBER_TEXT)
_LEAST, _MOST = -(2**63), 2**63 - 1


@dataclass(frozen=True, slots=True)
class Output:
    """What is declared of an output: its type and, for some types, bounds, values or a size. Without a declaration it is a text."""

    name: str
    kind: str = "text"
    default: OutputValue | None = None
    """The value of an empty cell; None: an empty cell is a fault, but for a text."""
    minimum: float = -math.inf
    maximum: float = math.inf
    values: tuple[str, ...] = ()
    """Of an enum, in order."""
    size: int = 1
    """How many numbers a cell of `numbers` has."""
    unit: str = ""
    description: str = ""
    nothing: OutputValue = field(init=False, compare=False, repr=False)
    """The value where no cell gives one: the default, else False, 0, NaN, "" or NaNs."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "nothing", self._absent if self.default is None else self.default)

    @property
    def is_text(self) -> bool:
        """Whether its values are texts."""
        return self.kind in NAMED

    @property
    def is_plain(self) -> bool:
        """Whether it is as it would be without a declaration."""
        return self == Output(self.name)

    @property
    def needs_cell(self) -> bool:
        """Whether an empty cell is a fault."""
        return self.default is None and self.kind != "text"

    @property
    def accepted(self) -> str:
        """What a cell may say, for messages."""
        return some(self.values) if self.kind == "enum" else _ACCEPTED[self.kind].format(size=self.size) + self._bounds

    @property
    def choices(self) -> tuple[str, ...]:
        """The texts of all values, where they are a list."""
        return ("True", "False") if self.kind == "bool" else self.values

    def array(self, values: list[OutputValue]) -> np.ndarray[Any, np.dtype[Any]]:
        """Some values as numpy has them: bool, int64, float64, float64 [n, size] or, for texts, objects."""
        if self.kind == "numbers":
            return np.array(values, np.float64).reshape(-1, self.size)
        return np.array(values, _DTYPES[self.kind])

    def read(self, text: str, wants_mend: bool = True) -> OutputValue:
        """The value that a cell gives.

        Raises
        ------
        CellError
            With what was found, what is accepted and, where one is near, a text that would be read.
        """
        if not text.strip():
            if self.needs_cell:
                raise CellError(
                    Fault(
                        "the cell is empty, and the output has no default.",
                        self.accepted,
                        _FILL,
                        rule="missing-output",
                    )
                )
            return self.nothing
        try:
            value = _READERS[self.kind](text, self)
        except ValueError as error:
            why = f": {error}." if str(error) else "."
            found = f"cannot read {in_quotes(text)} as {self._noun}{why}"
            if self.kind == "enum":
                found = f"{in_quotes(text.strip())} is not a declared value."
            raise CellError(Fault(found, self.accepted, self._mend(text) if wants_mend else "", rule="unreadable-output")) from None
        if not self._is_inside(value):
            found = f"{in_quotes(text.strip())} is outside the declared bounds."
            raise CellError(Fault(found, self.accepted, in_quotes(self.written(self._clipped(value))), rule="output-out-of-bounds"))
        return value

    def fault(self, text: str) -> Fault | None:
        """What is wrong with the text of a cell; None where it can be read."""
        try:
            self.read(text)
        except CellError as error:
            return error.faults[0]
        return None

    def reads(self, text: str) -> bool:
        """Whether a text, not an empty one, is a value."""
        try:
            return bool(text.strip()) and self._is_inside(_READERS[self.kind](text, self))
        except ValueError:
            return False

    def taken(self, value: object) -> OutputValue:
        """The value that Python or TOML gives, such as a default.

        Raises
        ------
        ValueError
            It is no value of the output; with why.
        """
        found = _TAKERS[self.kind](value, self)
        if not self._is_inside(found):
            raise ValueError("this is outside the declared bounds")
        return found

    def written(self, value: OutputValue) -> str:
        """The text of a cell that gives a value."""
        if isinstance(value, tuple):
            return " ".join(map(format_number, value))
        return format_number(value) if isinstance(value, float) else str(value)

    @property
    def _absent(self) -> OutputValue:
        return (math.nan,) * self.size if self.kind == "numbers" else _ABSENT[self.kind]

    @property
    def _noun(self) -> str:
        return f"{plural(self.size, 'number')}" if self.kind == "numbers" else _NOUNS[self.kind]

    @property
    def _bounds(self) -> str:
        low, high = self.minimum, self.maximum
        if math.isinf(low) and math.isinf(high):
            return ""
        written = [format_number(end) for end in (low, high)]
        return (
            f", from {written[0]} up"
            if math.isinf(high)
            else f", up to {written[1]}"
            if math.isinf(low)
            else f", {'..'.join(written)}"
        )

    def _is_inside(self, value: OutputValue) -> bool:
        if self.kind not in NUMERIC:
            return True
        return all(self.minimum <= number <= self.maximum for number in _numbers(value))

    def _clipped(self, value: OutputValue) -> OutputValue:
        clipped = tuple(min(max(number, self.minimum), self.maximum) for number in _numbers(value))
        return clipped if self.kind == "numbers" else int(clipped[0]) if self.kind == "int" else clipped[0]

    def _mend(self, text: str) -> str:
        """The nearest text that reads, quoted for a message, or nothing."""
        if says_any(text) and not self.needs_cell:
            return _LEAVE_EMPTY
        short = text[:1000].strip()
        return next((in_quotes(near) for near in _near(short, self) if near != short and self.reads(near)), "")


_FILL = "to fill in the cell, or to declare a default in contextdb.toml"
_LEAVE_EMPTY = "to leave the cell empty, which means the default"

_ACCEPTED = {
    "bool": '"True" or "False"',
    "int": "a whole number, such as 3",
    "number": "a number, such as 0.5",
    "text": "any text",
    "numbers": "{size} numbers with spaces or commas between",
}
_NOUNS = {"bool": "a bool", "int": "an int", "number": "a number", "enum": "a value", "text": "a text"}
_DTYPES: dict[str, Any] = {"bool": np.bool_, "int": np.int64, "number": np.float64, "enum": object, "text": object}
_ABSENT: dict[str, OutputValue] = {"bool": False, "int": 0, "number": math.nan, "enum": "", "text": ""}


def _numbers(value: Any) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,)


# ---- texts


def _read_bool(text: str, output: Output) -> bool:
    value = truth_of(text)
    if value is None:
        raise ValueError
    return value


def _read_int(text: str, output: Output) -> int:
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


def _read_number(text: str, output: Output) -> float:
    text = text.strip()
    if not _NUMBER.fullmatch(text):
        raise ValueError
    value = float(text)
    if math.isinf(value) and "inf" not in text.casefold():
        raise ValueError("this is too large for a number")
    return value + 0.0


def _read_enum(text: str, output: Output) -> str:
    text = text.strip()
    bare = text[1:-1].replace('""', '"') if len(text) > 1 and text[0] == text[-1] == '"' else text
    for value in (text, bare):
        if value in output.values:
            return value
    raise ValueError


def _read_text(text: str, output: Output) -> str:
    return text


def _read_numbers(text: str, output: Output) -> tuple[float, ...]:
    words = re.split(r"\s*,\s*|\s+", text.strip())
    if len(words) != output.size:
        raise ValueError(f"this has {plural(len(words), 'part')}")
    return tuple(_read_number(word, output) for word in words)


_READERS: dict[str, Callable[[str, Output], OutputValue]] = {
    "bool": _read_bool,
    "int": _read_int,
    "number": _read_number,
    "enum": _read_enum,
    "text": _read_text,
    "numbers": _read_numbers,
}


def _near(text: str, output: Output) -> Iterator[str]:
    """Texts near to one that cannot be read, the likeliest first."""
    if output.kind == "enum":
        yield nearest(text.strip("\"' "), output.values) or ""
    elif output.kind == "bool":
        yield from candidates(text, BOOL)
    elif output.kind == "numbers":
        plain = re.sub(r"[A-Za-z_]+\s*[=:]|[\[\](){}<>\"']", " ", text)
        for near in (plain, re.sub(r"[;|/]", " ", plain), re.sub(r"[;|/]", " ", plain.replace(",", "."))):
            yield " ".join(near.split())
    else:
        yield text.replace(",", ".")
        yield from candidates(text, NUMBER)
        if output.kind == "int" and _NUMBER.fullmatch(text) and math.isfinite(float(text)):
            yield str(round(float(text)))


# ---- values of Python and TOML


def _take_bool(value: object, output: Output) -> bool:
    if not isinstance(value, (bool, np.bool_)):
        raise ValueError("this is not true or false")
    return bool(value)


def _take_int(value: object, output: Output) -> int:
    number = _take_number(value, output)
    if isinstance(value, (int, np.integer)):
        return _fitting(int(value))
    if not number.is_integer():
        raise ValueError("this is not a whole number")
    return _fitting(int(number))


def _take_number(value: object, output: Output) -> float:
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise ValueError("this is not a number")
    try:
        number = float(value)
    except OverflowError:
        raise ValueError("this is too large for a number") from None
    if math.isnan(number):
        raise ValueError("NaN is not a value")
    return number + 0.0


def _take_enum(value: object, output: Output) -> str:
    text = _take_text(value, output)
    if text not in output.values:
        near = nearest(text, output.values)
        hint = f"; {in_quotes(near)} is" if near else ""
        raise ValueError(f"this is not one of the values{hint}")
    return text


def _take_text(value: object, output: Output) -> str:
    if not isinstance(value, str):
        raise ValueError("this is not a text")
    return value


def _take_numbers(value: object, output: Output) -> tuple[float, ...]:
    if not isinstance(value, (list, tuple, np.ndarray)):
        raise ValueError("this is not a list of numbers")
    if len(value) != output.size:
        raise ValueError(f"this has {plural(len(value), 'number')}, not {output.size}")
    return tuple(_take_number(number, output) for number in value)


_TAKERS: dict[str, Callable[[object, Output], OutputValue]] = {
    "bool": _take_bool,
    "int": _take_int,
    "number": _take_number,
    "enum": _take_enum,
    "text": _take_text,
    "numbers": _take_numbers,
}
