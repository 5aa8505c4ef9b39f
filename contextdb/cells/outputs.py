"""Outputs: typed columns of data for the game, which exclude no row.

    bool     True  False             as in the cells of a condition
    int      12                      a whole number of 64 bits
    number   0.25                    a double, never NaN
    enum     Fire                    one of the declared values
    text     Get down!               any text, as it is
    numbers  0 1.5 0                 so many numbers as `size` says, with spaces or commas between

An empty cell means the default; without one it is a fault, but for text, which is then "". What there is where no row gives a value
is `Output.nothing`. Outputs with a reserved name say how a row plays, see `contextdb.cells.outputs`. Nothing here knows a file or
a table.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import astuple, dataclass, field
from typing import Any, Literal, Self

import numpy as np

from contextdb.cells.output_types import OUTPUT_TYPES, OutputType, OutputValue
from contextdb.cells.words import NUMBER_TEXT, format_number, says_any, truth_of
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
        return self.name in ACCEPTED

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
            return ACCEPTED[self.name]
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


# ---- how the animation of a row plays: what reserved outputs say of it. An empty cell leaves it to the settings. blend_s 0.3
# seconds until a jump to it is hidden; 0 is a cut start_s 0.5 it is entered at this second of its clip play_rate 1.1 0.9..1.2
# how fast it plays, or within which limits it follows the wanted speed mirror as asked always never whether its mirrored clip
# plays loop True False whether it begins again at its end, in place of the mark Looping root code animation mixed path what
# moves the body, as `root` of [output.NAME] until natural any whether it plays on to its end when its row is no longer valid
# Numbers are kept in rows of `N_PLAY` doubles, NaN where nothing is said, as the core reads them
# (`contextdb/core/row_play.h`); of a word its place among those that are accepted. Nothing here knows a table or a clip

Mirror = Literal["as asked", "always", "never"]
Root = Literal["animation", "code", "mixed", "path"]
Until = Literal["natural", "any"]
MIRRORS: tuple[Mirror, ...] = ("as asked", "always", "never")
ROOTS: tuple[Root, ...] = ("animation", "code", "mixed", "path")
"""In the order of the core, see pose.h."""
UNTILS: tuple[Until, ...] = ("natural", "any")
LEAST_RATE, MOST_RATE = 0.1, 10.0
MOST_BLEND_S, MOST_START_S = 60.0, 1e6
N_PLAY = 8
BLEND, START, LEAST, MOST, MIRROR, LOOP, ROOT, UNTIL = range(N_PLAY)
"""The columns of a row of numbers."""


@dataclass(frozen=True, slots=True)
class RowPlay:
    """How a row plays. None: as the settings say."""

    blend_s: float | None = None
    start_s: float | None = None
    min_rate: float | None = None
    max_rate: float | None = None
    """`min_rate`, `max_rate`: both, or none."""
    mirror: Mirror | None = None
    loop: bool | None = None
    root: Root | None = None
    until: Until | None = None

    @classmethod
    def of(cls, numbers: Sequence[float]) -> Self | None:
        """That of a row of numbers; None where nothing is said."""
        values = [None if value != value else value for value in numbers]
        if values.count(None) == len(values):
            return None
        blend_s, start_s, min_rate, max_rate = values[:MIRROR]
        mirror, loop, root, until = (None if value is None else int(value) for value in values[MIRROR:])
        return cls(
            blend_s,
            start_s,
            min_rate,
            max_rate,
            None if mirror is None else MIRRORS[mirror],
            None if loop is None else bool(loop),
            None if root is None else ROOTS[root],
            None if until is None else UNTILS[until],
        )

    @property
    def rate(self) -> float:
        """How fast it plays where nothing asks for a speed: 1, or the nearest rate that it may have."""
        return 1.0 if self.min_rate is None or self.max_rate is None else min(max(1.0, self.min_rate), self.max_rate)

    @property
    def numbers(self) -> list[float]:
        """As the core has it."""
        words: dict[object, float] = {word: float(i) for words in (MIRRORS, ROOTS, UNTILS) for i, word in enumerate(words)}
        each: tuple[Any, ...] = astuple(self)
        return [math.nan if value is None else words[value] if isinstance(value, str) else float(value) for value in each]


def read_play(name: str, text: str) -> dict[int, float]:
    """What the cell of a reserved output says: the columns and their numbers, none for an empty one. ValueError, with why or
    without a word, for what it does not take."""
    text = text.strip()
    if not text:
        return {}
    if name == "play_rate":
        low, dots, high = text.partition("..")
        least, most = _number(low, LEAST_RATE, MOST_RATE), _number(high if dots else low, LEAST_RATE, MOST_RATE)
        if least > most:
            raise ValueError("it runs downwards")
        return {LEAST: least, MOST: most}
    if name in ("blend_s", "start_s"):
        return {BLEND: _number(text, 0.0, MOST_BLEND_S)} if name == "blend_s" else {START: _number(text, 0.0, MOST_START_S)}
    if name == "loop":
        loops = truth_of(text)
        if loops is None:
            raise ValueError
        return {LOOP: float(loops)}
    column, words = _WORDS[name]
    word = " ".join(text.casefold().split())
    if word not in words:
        raise ValueError
    return {column: float(words.index(word))}


def play_choices(name: str) -> tuple[str, ...]:
    """The texts that a reserved output takes, where they are few."""
    return _WORDS[name][1] if name in _WORDS else ("True", "False") if name == "loop" else ()


_WORDS: dict[str, tuple[int, tuple[str, ...]]] = {"mirror": (MIRROR, MIRRORS), "root": (ROOT, ROOTS), "until": (UNTIL, UNTILS)}
ACCEPTED = {
    "blend_s": f"seconds from 0 to {format_number(MOST_BLEND_S)}",
    "start_s": "a second of the clip, from 0 up",
    "play_rate": f"a number or a range within {format_number(LEAST_RATE)}..{format_number(MOST_RATE)}, such as 0.9..1.1",
    "mirror": "as asked, always or never",
    "loop": "True or False",
    "root": "code, animation, mixed or path",
    "until": "natural or any",
}
"""The reserved outputs, and what a cell of each may say, for messages."""
KINDS = {
    **dict.fromkeys(("blend_s", "start_s"), ("number", "int", "text")),
    "play_rate": ("number", "int", "text"),
    "loop": ("bool", "enum", "text"),
    **dict.fromkeys(_WORDS, ("enum", "text")),
}
"""The types that each may be declared with."""


def _number(text: str, least: float, most: float) -> float:
    text = text.strip()
    if not re.fullmatch(NUMBER_TEXT, text):
        raise ValueError
    value = float(text)
    if not least <= value <= most:
        raise ValueError(f"{format_number(value)} is not from {format_number(least)} to {format_number(most)}")
    return value
