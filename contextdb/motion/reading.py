"""Read a section of contextdb.toml key by key, and keep every fault for one report.

A value that cannot be used becomes None and leaves a fault behind; the caller reads on, and raises once at the end.
"""

from __future__ import annotations

import json
import math
import numbers
from collections.abc import Mapping, Sequence

from contextdb.errors import Fault, Place, in_quotes, nearest, shown, some
from contextdb.files.toml_text import as_toml, what

Mapped = Mapping[str, object]

MOST_WORDS = 12
"""So many words are all listed in a message; of more, some."""


class Section:
    """One section, or one table inside it, being read."""

    def __init__(self, where: str, part: Mapped, keys: Sequence[str], faults: list[Fault], file: str | None = None) -> None:
        self.where = where
        self.part = part
        self.faults = faults
        self.file = file
        for key in part:
            if key not in keys:
                near = nearest(str(key), keys)
                self.add(f"{where} has no key {in_quotes(str(key))}.", some(keys, len(keys)), in_quotes(near) if near else "")

    def add(self, found: str, accepted: str = "", mend: str = "") -> None:
        """Keep a fault."""
        self.faults.append(Fault(found, accepted, mend, Place(self.file)))

    def wrong(self, key: str, why: str, accepted: str, mend: str = "") -> None:
        """Keep a fault of a key's value."""
        self.add(f"{self.where} {shown(f'{key} = {as_toml(self.part.get(key))}')}: {why}.", accepted, mend)

    def has(self, key: str, accepted: str) -> bool:
        """Whether a key that must be there is there."""
        if key in self.part:
            return True
        self.add(f"{self.where} has no {in_quotes(key)}.", accepted)
        return False

    def number(self, key: str, accepted: str, least: float, most: float) -> float | None:
        """A number from `least` to `most`."""
        value = self.part.get(key)
        number = as_number(value)
        if number is None:
            self.wrong(key, f"this is {_no_number(value)}", accepted, _meant_number(key, value))
        elif not least <= number <= most:
            self.wrong(key, "this is out of range", accepted)
        else:
            return number
        return None

    def numbers(self, key: str, accepted: str, most: float) -> tuple[float, ...] | None:
        """A list of different numbers, none farther from 0 than `most`; one number alone is a list of one."""
        value = self.part.get(key)
        listed = value if isinstance(value, (list, tuple)) else [value]
        found = [as_number(item) for item in listed]
        wrong = next((item for item, number in zip(listed, found, strict=True) if number is None), None)
        if not listed or None in found:
            why = "the list is empty" if not listed else f"{shown(as_toml(wrong))} is {_no_number(wrong)}"
            self.wrong(key, why, accepted)
            return None
        known = tuple(number for number in found if number is not None)
        if any(abs(number) > most for number in known) or len(set(known)) < len(known):
            self.wrong(key, "a number is out of range or appears twice", accepted)
            return None
        return known

    def text(self, key: str, accepted: str) -> str | None:
        """Text that is not empty."""
        value = self.part.get(key)
        if isinstance(value, str) and value.strip():
            return value
        self.wrong(key, "this is empty" if isinstance(value, str) else f"this is {what(value)}, not text", accepted)
        return None

    def one_of(self, key: str, words: Sequence[str], noun: str, synonyms: Mapping[str, str] | None = None) -> str | None:
        """One of some words; of the names of a project when `noun` says what they name."""
        accepted = some(words, MOST_WORDS) or f"the name of a {noun}; there is none"
        value = self.text(key, accepted)
        if value is None or value in words:
            return value
        near = (synonyms or {}).get(value.casefold()) or nearest(value, words)
        self.wrong(key, f"there is no such {noun}", accepted, f"{key} = {as_toml(near)}" if near else "")
        return None


def as_number(value: object) -> float | None:
    """A finite float, or None for anything else; True is not a number."""
    if type(value) is float:
        return value if math.isfinite(value) else None
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def _no_number(value: object) -> str:
    """What a value is that `as_number` does not take."""
    is_number = isinstance(value, numbers.Real) and not isinstance(value, bool)
    return "not a finite number" if is_number else f"{what(value)}, not a number"


def _meant_number(key: str, value: object) -> str:
    try:
        meant = as_number(json.loads(value)) if isinstance(value, str) else None
    except ValueError:
        return ""
    return "" if meant is None else f"{key} = {meant:g}"
