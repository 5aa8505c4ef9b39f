"""How the animation of a row plays: what reserved outputs say of it. An empty cell leaves it to the settings.

    blend_s     0.3                        seconds until a jump to it is hidden; 0 is a cut
    start_s     0.5                        it is entered at this second of its clip
    play_rate   1.1   0.9..1.2             how fast it plays, or within which limits it follows the wanted speed
    mirror      as asked  always  never    whether its mirrored clip plays
    loop        True  False                whether it begins again at its end, in place of the mark Looping
    root        code  animation  mixed  path   what moves the body, as `root` of [output.NAME]
    until       natural  any               whether it plays on to its end when its row is no longer valid

Numbers are kept in rows of `N_PLAY` doubles, NaN where nothing is said, as the core reads them (`contextdb/core/row_play.h`); of a
word its place among those that are accepted. Nothing here knows a table or a clip.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import Any, Literal, Self

from contextdb.cells.words import NUMBER_TEXT, format_number, truth_of

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
