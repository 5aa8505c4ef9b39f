"""What a key of contextdb.toml accepts, the faults of those that hold something else, and the values of the others.

A `Shape` is of one key. A `Section` reads keys by their shapes: a value that cannot be used becomes None and leaves a fault behind,
so that the caller reads on, and raises once at the end with every fault.
"""

from __future__ import annotations

import json
import numbers
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from contextdb.cells.arguments import as_number
from contextdb.errors import SHOWN_CHARACTERS, Fault, Place, in_quotes, nearest, shown, some
from contextdb.files.toml_text import as_toml, plain_numbers, what

Mapped = Mapping[str, object]

MOST_WORDS = 12
"""So many words are all listed in a message; of more, some."""
FLAG_WORDS = {**dict.fromkeys(("true", "yes", "on", "1"), True), **dict.fromkeys(("false", "no", "off", "0"), False)}


def nothing(value: object) -> None:
    """Nothing is wrong with a value, or nothing else was meant by it."""
    return None


@dataclass(frozen=True)
class Shape:
    """What a key accepts. `wrong` says what is wrong with a value, or None; `meant` is the value that was likely meant, or None."""

    accepted: str
    wrong: Callable[[object], str | None]
    meant: Callable[[object], object] = nothing

    def mend(self, value: object) -> object:
        """What was likely meant, if that is accepted."""
        meant = self.meant(value)
        return None if meant is None or self.wrong(meant) else meant

    def fault(self, about: str, key: str, value: object, most: int = SHOWN_CHARACTERS) -> Fault | None:
        """What is wrong with a key's value; `about` says what has the key, and at most so many characters of a value are shown."""
        wrong = self.wrong(value)
        if wrong is None:
            return None
        meant = self.mend(value)
        mend = "" if meant is None else said_of(key, meant, most)
        return Fault(f"{about} {said_of(key, value, most)}: {wrong}.".lstrip(), self.accepted, mend)


def said_of(key: str, value: object, most: int = SHOWN_CHARACTERS) -> str:
    return shown(f"{key} = {as_toml(value)}", most)


def near_key(key: str, keys: Iterable[str], synonyms: Mapping[str, str]) -> str | None:
    """The key that was likely meant."""
    known = list(keys)
    synonym = key if key in known else synonyms.get(str(key).casefold())
    return synonym if synonym in known else nearest(str(key), known)


def no_key(about: str, key: str, keys: Iterable[str], near: str | None, noun: str = "key") -> Fault:
    """The fault of a key that there is not."""
    known = list(keys)
    return Fault(f"{about} has no {noun} {in_quotes(str(key))}.", some(known, len(known)), in_quotes(near) if near else "")


# ---- shapes


def wrong_text(value: object) -> str | None:
    """What is wrong with a text, which may be empty."""
    return None if isinstance(value, str) else f"this is {what(value)}, not text"


def meant_number(value: object) -> object:
    try:
        return json.loads(value) if isinstance(value, str) else None
    except (ValueError, RecursionError):
        return None


def filled(accepted: str) -> Shape:
    """Text that is not empty."""
    return Shape(accepted, _wrong_filled)


def one_of(words: Sequence[str], noun: str, synonyms: Mapping[str, str] | None = None) -> Shape:
    """One of some words; of the names of a project when `noun` says what they name."""

    def wrong(value: object) -> str | None:
        return _wrong_filled(value) or (None if value in words else f"there is no such {noun}")

    def meant(value: object) -> object:
        return (synonyms or {}).get(value.strip().casefold()) or nearest(value, words) if isinstance(value, str) else None

    return Shape(some(words, MOST_WORDS) or f"the name of a {noun}; there is none", wrong, meant)


def between(accepted: str, least: float, most: float, *, is_whole: bool = False) -> Shape:
    """A finite number from `least` to `most`."""

    def wrong(value: object) -> str | None:
        number = as_number(value)
        if number is None:
            return f"this is {_no_number(value)}"
        if is_whole and not number.is_integer():
            return "this is not whole"
        return None if least <= number <= most else "this is out of range"

    return Shape(accepted, wrong, lambda value: plain_numbers(meant_number(value)))


def numbers_within(accepted: str, most: float) -> Shape:
    """A list of different numbers, none farther from 0 than `most`; one number alone is a list of one."""

    def wrong(value: object) -> str | None:
        listed = _listed(value)
        if not listed:
            return "the list is empty"
        known = [as_number(item) for item in listed]
        if None in known:
            item = listed[known.index(None)]
            return f"{shown(as_toml(item))} is {_no_number(item)}"
        is_wrong = any(abs(number) > most for number in known if number is not None) or len(set(known)) < len(known)
        return "a number is out of range or appears twice" if is_wrong else None

    return Shape(accepted, wrong)


def _wrong_filled(value: object) -> str | None:
    return wrong_text(value) or (None if str(value).strip() else "this is empty")


def _listed(value: object) -> Sequence[object]:
    return value if isinstance(value, (list, tuple)) else [value]


def _no_number(value: object) -> str:
    """What a value is that `as_number` does not take."""
    is_number = isinstance(value, numbers.Real) and not isinstance(value, bool)
    return "not a finite number" if is_number else f"{what(value)}, not a number"


FLAG = Shape(
    "true or false",
    lambda value: None if isinstance(value, bool) else f"this is {what(value)}, neither true nor false",
    lambda value: FLAG_WORDS.get(str(value).strip().casefold()),
)

# ---- reading


class Section:
    """One section, or one table inside it, being read."""

    def __init__(self, where: str, part: Mapped, keys: Sequence[str], faults: list[Fault], file: str | None = None) -> None:
        self.where = where
        self.part = part
        self.faults = faults
        self.file = file
        self._keep(*(no_key(where, key, keys, nearest(str(key), keys)) for key in part if key not in keys))

    def inside(self, where: str, part: Mapped, keys: Sequence[str]) -> Section:
        """A table inside it, which is named by `where`."""
        return Section(f"{self.where} {where}", part, keys, self.faults, self.file)

    def _keep(self, *faults: Fault) -> None:
        self.faults.extend(fault.at(Place(self.file)) for fault in faults)

    def add(self, found: str, accepted: str = "", mend: str = "") -> None:
        self._keep(Fault(found, accepted, mend))

    def wrong(self, key: str, why: str, accepted: str, mend: str = "") -> None:
        """Keep a fault of a key's value."""
        self.add(f"{self.where} {said_of(key, self.part.get(key))}: {why}.", accepted, mend)

    def has(self, key: str, accepted: str) -> bool:
        """Whether a key that must be there is there."""
        if key not in self.part:
            self.add(f"{self.where} has no {in_quotes(key)}.", accepted)
        return key in self.part

    def read(self, key: str, shape: Shape) -> Any:
        """The value of a key, or None."""
        value = self.part.get(key)
        fault = shape.fault(self.where, key, value)
        if fault is None:
            return value
        self._keep(fault)
        return None

    def number(self, key: str, accepted: str, least: float, most: float) -> float | None:
        return as_number(self.read(key, between(accepted, least, most)))

    def whole(self, key: str, accepted: str, least: int, most: int) -> int | None:
        number = self.read(key, between(accepted, least, most, is_whole=True))
        return None if number is None else int(number)

    def numbers(self, key: str, accepted: str, most: float) -> tuple[float, ...] | None:
        """A list of different numbers, none farther from 0 than `most`; one number alone is a list of one."""
        value = self.read(key, numbers_within(accepted, most))
        return None if value is None else tuple(float(each) for each in _listed(value))  # type: ignore[arg-type]

    def text(self, key: str, accepted: str) -> str | None:
        """Text that is not empty."""
        text: str | None = self.read(key, filled(accepted))
        return text

    def one_of(self, key: str, words: Sequence[str], noun: str, synonyms: Mapping[str, str] | None = None) -> str | None:
        """One of some words; of the names of a project when `noun` says what they name."""
        word: str | None = self.read(key, one_of(words, noun, synonyms))
        return word

    def flag(self, key: str) -> bool | None:
        flag: bool | None = self.read(key, FLAG)
        return flag
