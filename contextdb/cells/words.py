"""The words that cells are made of: numbers, names, truth."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import lru_cache

NUMBER_TEXT = r"[+-]?(?:inf|(?:\d+(?:\.(?!\.)\d*)?|(?<!\.)\.\d+)(?:[eE][+-]?\d+)?)"

_ANY_WORDS = frozenset(("", "-", "any"))

MARK = "@"
"""What an asset cell begins with that refers to another table."""

_NAME = re.compile(r"[\w.:/\-]+")
_RESERVED = re.compile(rf"any|not|-|nan|{NUMBER_TEXT}", re.IGNORECASE)
_SLOT = re.compile(r'"((?:[^"]|"")*)"|[^\s,;|"]+')
_LONG = re.compile(r"-?\d+\.\d{4,}|-?\d(?:\.\d+)?e-\d+")
_ZERO = 1e-9
_TRUTH = {"true": True, "t": True, "yes": True, "1": True, "false": False, "f": False, "no": False, "0": False}


class InCells:
    """The base of what is a box of contexts, told by cells."""

    __slots__ = ()
    cells: Mapping[str, str]

    @property
    def text(self) -> str:
        """The cells on one line."""
        return cells_text(self.cells)


def cells_text(cells: Mapping[str, str]) -> str:
    """Cells on one line, each with the name of its condition."""
    return ", ".join(f"{name}: {cell}" for name, cell in cells.items()) or "every context"


def says_any(text: str) -> bool:
    """Whether a text says nothing: Any, in any case, a hyphen, or nothing at all."""
    return text.strip().casefold() in _ANY_WORDS


@lru_cache(maxsize=1 << 12)  # the cells of a column repeat its words
def is_name(text: str) -> bool:
    """Whether a value can be in a cell without quotes."""
    return bool(_NAME.fullmatch(text)) and not is_reserved(text)


def is_reserved(text: str) -> bool:
    """Whether a word reads like Any, not or a number, so that a value of this name needs quotes."""
    return bool(_RESERVED.fullmatch(text))


def quoted(text: str) -> str:
    """A value as a cell writes it: bare where it can be, else in double quotes."""
    return text if is_name(text) else '"' + text.replace('"', '""') + '"'


def format_number(value: float) -> str:
    """A double in the fewest digits that read back as the same double."""
    value += 0.0  # -0.0 is 0
    short = f"{value:.15g}"
    return short if float(short) == value and "e" not in short else repr(value).removesuffix(".0")


def three_digits(text: str) -> str:
    """A number of many decimals, as a game sends them, with three digits that count; any other text as it is."""
    if not _LONG.fullmatch(text):
        return text
    number = float(text)
    if abs(number) < _ZERO:
        return "0"
    places = max(2 - math.floor(math.log10(abs(number))), 0)
    short = f"{number:.{places}f}"
    return short.rstrip("0").rstrip(".") if "." in short else short


def truth_of(text: str) -> bool | None:
    """True or False as people write it, or None."""
    return _TRUTH.get(text.strip().casefold())


def slot_words(text: str) -> list[str]:
    """The words of one cell of slots: apart by spaces, commas, semicolons or bars; a name with spaces in double quotes."""
    return [m[1].replace('""', '"') if m[1] is not None else m[0] for m in _SLOT.finditer(text)]
