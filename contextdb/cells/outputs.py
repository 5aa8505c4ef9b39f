"""Outputs: typed columns of data for the game, which exclude no row.

    bool     True  False             as in the cells of a condition
    int      12                      a whole number of 64 bits
    number   0.25                    a double, never NaN
    enum     Fire                    one of the declared values
    text     Get down!               any text, as it is
    numbers  0 1.5 0                 so many numbers as `size` says, with spaces or commas between

An empty cell means the default; without one it is a fault, but for text, which is then "". What there is where no row gives a value
is `Output.nothing`. Outputs with a reserved name say how a row plays, see `contextdb.cells.row_play`. Nothing here knows a file or
a table.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from contextdb.cells.output_types import OUTPUT_TYPES, OutputType, OutputValue
from contextdb.cells.row_play import ACCEPTED as PLAY_ACCEPTED
from contextdb.cells.row_play import play_choices, read_play
from contextdb.cells.words import format_number, says_any
from contextdb.errors import CellError, Fault, in_quotes, nearest, plural, some

SLOT_COLUMNS = ("Mandatory_Slots", "Optional_Slots")
"""The outputs that say which roles a row fills."""


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
    def type(self) -> OutputType:
        """What all outputs of its type have in common."""
        return OUTPUT_TYPES[self.kind]

    @property
    def is_plain(self) -> bool:
        """Whether it is as it would be without a declaration."""
        return self == Output(self.name)

    @property
    def is_reserved(self) -> bool:
        """Whether it says how the row's animation plays."""
        return self.name in PLAY_ACCEPTED

    @property
    def is_free(self) -> bool:
        """Whether any text is a value."""
        return self.type.is_free and not self.is_reserved

    @property
    def needs_cell(self) -> bool:
        """Whether an empty cell is a fault."""
        return self.default is None and not self.type.is_free

    @property
    def accepted(self) -> str:
        """What a cell may say, for messages."""
        if self.is_reserved:
            return PLAY_ACCEPTED[self.name]
        return some(self.values) if self.type.has_values else self.type.accepted.format(size=self.size) + self._bounds

    @property
    def choices(self) -> tuple[str, ...]:
        """The texts of all values, where they are a list."""
        return self.type.choices or self.values or play_choices(self.name)

    def array(self, values: list[OutputValue]) -> np.ndarray[Any, np.dtype[Any]]:
        """Some values as numpy has them: bool, int64, float64, float64 [n, size] or, for texts, objects."""
        array = np.array(values, self.type.dtype)
        return array.reshape(-1, self.size) if self.type.has_size else array

    def read(self, text: str, wants_mend: bool = True) -> OutputValue:
        """The value that a cell gives. Raises CellError with what was found, what is accepted and, where one is near, a text that
        would be read."""
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
            value = self._value(text)
        except ValueError as error:
            why = f": {error}." if str(error) else "."
            wrong = f"cannot read {in_quotes(text)} as {self._noun}{why}"
            if self.type.has_values:
                wrong = f"{in_quotes(text.strip())} is not a declared value."
            raise CellError(Fault(wrong, self.accepted, self._mend(text) if wants_mend else "", rule="unreadable-output")) from None
        if not self._is_inside(value):
            wrong = f"{in_quotes(text.strip())} is outside the declared bounds."
            raise CellError(Fault(wrong, self.accepted, in_quotes(self.written(self._clipped(value))), rule="output-out-of-bounds"))
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
            return bool(text.strip()) and self._is_inside(self._value(text))
        except ValueError:
            return False

    def taken(self, value: object) -> OutputValue:
        """The value that Python or TOML gives, such as a default. Raises ValueError where it is no value of the output;
        with why."""
        taken = self.type.take(value, self)
        if self.is_reserved:
            read_play(self.name, self.written(taken))
        if not self._is_inside(taken):
            raise ValueError("this is outside the declared bounds")
        return taken

    def written(self, value: OutputValue) -> str:
        """The text of a cell that gives a value."""
        if isinstance(value, tuple):
            return " ".join(map(format_number, value))
        return format_number(value) if isinstance(value, float) else str(value)

    def _value(self, text: str) -> OutputValue:
        """The value of a text; ValueError, with why or without a word, where it is none."""
        value = self.type.read(text, self)
        if self.is_reserved:
            read_play(self.name, self.written(value))
        return value

    @property
    def _absent(self) -> OutputValue:
        return _numbers(self.type.absent) * self.size if self.type.has_size else self.type.absent

    @property
    def _noun(self) -> str:
        if self.is_reserved:
            return self.name
        return plural(self.size, "number") if self.type.has_size else self.type.noun

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
        if not self.type.is_numeric:
            return True
        return all(self.minimum <= number <= self.maximum for number in _numbers(value))

    def _clipped(self, value: OutputValue) -> OutputValue:
        clipped = tuple(min(max(number, self.minimum), self.maximum) for number in _numbers(value))
        return clipped if self.type.has_size else int(clipped[0]) if self.type.is_whole else clipped[0]

    def _mend(self, text: str) -> str:
        """The nearest text that reads, quoted for a message, or nothing."""
        if says_any(text) and not self.needs_cell:
            return _LEAVE_EMPTY
        short = text[:1000].strip()
        if self.is_reserved and (near_word := nearest(short.casefold(), play_choices(self.name))):
            return in_quotes(near_word)
        return next((in_quotes(near) for near in self.type.near(short, self) if near != short and self.reads(near)), "")


_FILL = "to fill in the cell, or to declare a default in contextdb.toml"
_LEAVE_EMPTY = "to leave the cell empty, which means the default"


def _numbers(value: Any) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,)
