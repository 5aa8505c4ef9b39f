"""What a value of contextdb.toml may be: in words, as a check, what a wrong one was likely meant to be, and as Python has it."""

from __future__ import annotations

import datetime
import json
import numbers
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath, PureWindowsPath
from typing import Any

from contextdb.cells.arguments import as_number, text_of
from contextdb.disk import patterns_of
from contextdb.errors import SHOWN_CHARACTERS, Fault, in_quotes, nearest, safe_text, some

Mapped = Mapping[str, object]

MOST = 1e30
"""A bound so far away is none to speak of."""
MOST_WORDS = 12
"""So many words are all listed in a message; of more, some."""
FLAG_WORDS = {**dict.fromkeys(("true", "yes", "on", "1"), True), **dict.fromkeys(("false", "no", "off", "0"), False)}


def nothing(value: object) -> None:
    """Nothing is wrong with a value, or nothing else was meant by it."""
    return None


def as_it_is(value: Any) -> Any:
    return value


@dataclass(frozen=True)
class Shape:
    """What a key accepts. `wrong` says what is wrong with a value, or None; `meant` is the value that was likely meant, or None;
    `read` makes of an accepted value what Python has."""

    accepted: str
    wrong: Callable[[object], str | None]
    meant: Callable[[object], object] = nothing
    read: Callable[[Any], Any] = as_it_is
    bounds: str = ""
    """Of a number: `accepted` without its example."""
    words: tuple[str, ...] = ()
    """All that is accepted, where that is a list of words."""

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
        mend = "" if meant is None else key_value(key, meant, most)
        return Fault(f"{about} {key_value(key, value, most)}: {wrong}.".lstrip(), self.accepted, mend)


def key_value(key: str, value: object, most: int = SHOWN_CHARACTERS) -> str:
    """A key with its value as TOML writes it, cut to so many characters."""
    return safe_text(f"{key} = {as_toml(value)}", most)


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


def wrong_name(value: object) -> str | None:
    """What is wrong with a name: of a condition, a table, a column, a value."""
    if not isinstance(value, str) or not value.strip():
        return wrong_text(value) or "this is empty"
    return None if value == value.strip() else "a space is before or after it"


def meant_text(value: object) -> object:
    """The text that a text or a number was likely meant as; None for other values."""
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        return None
    return text_of(value).strip()


def meant_number(value: object) -> object:
    """The value that a text was likely meant as; None where it reads as none."""
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

    return Shape(some(words, MOST_WORDS) or f"the name of a {noun}; there is none", wrong, meant, words=tuple(words))


def between(
    unit: str, least: float = -MOST, most: float = MOST, such_as: float | None = None, note: str = "", *, is_whole: bool = False
) -> Shape:
    """A finite number of a unit, from `least` to `most`; `note` says what a number of it means."""

    def wrong(value: object) -> str | None:
        number = as_number(value)
        if number is None:
            return f"this is {_no_number(value)}"
        if is_whole and not number.is_integer():
            return "this is not whole"
        return None if least <= number <= most else "this is out of range"

    bounds = unit + _range(least, most)
    example = "" if such_as is None else f", such as {such_as:g}"
    note = f"; {note}" if note else ""
    return Shape(
        bounds + example + note, wrong, lambda value: plain_numbers(meant_number(value)), int if is_whole else float, bounds + note
    )


def _range(least: float, most: float) -> str:
    if most < MOST:
        return f" from {least:g} to {most:{',.0f' if most >= 10_000 else 'g'}}"
    return f" of {least:g} or more" if least > -MOST else ""


def numbers_within(unit: str, most: float, such_as: str) -> Shape:
    """A list of different numbers of a unit, none farther from 0 than `most`; one number alone is a list of one."""

    def wrong(value: object) -> str | None:
        listed = _listed(value)
        if not listed:
            return "the list is empty"
        known = [as_number(item) for item in listed]
        if None in known:
            item = listed[known.index(None)]
            return f"{safe_text(as_toml(item))} is {_no_number(item)}"
        is_wrong = any(abs(number) > most for number in known if number is not None) or len(set(known)) < len(known)
        return "a number is out of range or appears twice" if is_wrong else None

    accepted = f"{unit}, at most {most:g} away"
    return Shape(f"{accepted}, such as {such_as}", wrong, read=lambda value: tuple(map(float, _listed(value))), bounds=accepted)


def listed(accepted: str, wrong_item: Callable[[object], str | None]) -> Shape:
    """A list that is not empty; `wrong_item` says what is wrong with what it holds."""

    def wrong(value: object) -> str | None:
        if not isinstance(value, (list, tuple)):
            return f"this is {what(value)}, not a list"
        messages = ((i, wrong_item(item)) for i, item in enumerate(value))
        return next(
            (f"entry {i + 1} is {safe_text(as_toml(value[i]))}: {why}" for i, why in messages if why),
            None if value else "the list is empty",
        )

    return Shape(accepted, wrong, read=tuple)


def any_table(accepted: str) -> Shape:
    """A table, whose keys are looked at elsewhere."""
    return Shape(accepted, lambda value: None if isinstance(value, Mapping) else f"this is {what(value)}, not a table", read=dict)


def file_below(a_file: str, kind: str, suffixes: Collection[str], such_as: str = "") -> Shape:
    """A file of a kind, or a pattern of files, in the folder of contextdb.toml or below it."""

    def wrong(value: object) -> str | None:
        if not isinstance(value, str) or wrong_name(value):
            return wrong_name(value)
        path = PureWindowsPath(value)
        if path.drive or path.root:
            return "it names a place on one machine"
        if ".." in path.parts:
            return "it leaves the folder of contextdb.toml"
        if "\\" in value:
            return 'folders are separated by "/" on every system'
        try:
            endings = {PureWindowsPath(plain).suffix.casefold() for plain in patterns_of(value)}
        except ValueError:
            return "it has too many choices in braces"
        return None if endings <= {*suffixes} else f"its ending is that of no {kind}"

    def meant(value: object) -> object:
        if not isinstance(value, str):
            return None
        path = PureWindowsPath(value.strip())
        if path.drive or path.root:
            return path.name
        inside = PurePosixPath(*(part for part in path.parts if part != ".."))
        return str(inside) if inside.suffix else f"{inside}{next(iter(suffixes))}" if inside.name else None

    return Shape(f"{a_file} in the folder of contextdb.toml or below it{such_as and ', such as '}{such_as}", wrong, meant)


def _wrong_filled(value: object) -> str | None:
    return wrong_text(value) or (None if str(value).strip() else "this is empty")


def _listed(value: object) -> Sequence[Any]:
    return value if isinstance(value, (list, tuple)) else [value]


def _no_number(value: object) -> str:
    """What a value is that `as_number` does not take."""
    is_number = isinstance(value, numbers.Real) and not isinstance(value, bool)
    return "not a finite number" if is_number else f"{what(value)}, not a number"


FLAG = Shape(
    "true or false",
    lambda value: None if isinstance(value, bool) else f"this is {what(value)}, neither true nor false",
    lambda value: FLAG_WORDS.get(text_of(value).strip().casefold()),
)


# ---- values as TOML writes them, in contextdb.toml and in messages; a message shortens a long one with `safe_text`


Path = tuple[str, ...]


def as_toml(value: object) -> str:
    """A value as TOML writes it, on one line."""
    if isinstance(value, Mapping):
        inner = ", ".join(f"{dotted((str(key),))} = {as_toml(item)}" for key, item in value.items())
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, (list, tuple)):
        inner = ", ".join(map(as_toml, value))
        return f"[ {inner} ]" if any(isinstance(item, Mapping) for item in value) else f"[{inner}]"
    if isinstance(value, (str, bool)):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return value.isoformat() if isinstance(value, (datetime.date, datetime.time)) else text_of(value)


def plain_numbers(value: object) -> object:
    """A value with its whole numbers as people write them: 0, not 0.0."""
    if isinstance(value, Mapping):
        return {key: plain_numbers(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain_numbers(item) for item in value]
    return int(value) if isinstance(value, float) and value.is_integer() and abs(value) < 2.0**53 else value


def dotted(path: Path) -> str:
    """A path as a header writes it: conditions."Defender.Tags"."""
    return ".".join(key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else as_toml(key) for key in path)


def what(value: object) -> str:
    """The type of a value, in a word for a message."""
    for types, word in ((str, "text"), (bool, "true or false"), (numbers.Real, "a number"), (Mapping, "a table")):
        if isinstance(value, types):
            return word
    return "a list" if isinstance(value, (list, tuple)) else "nothing" if value is None else f"a {type(value).__name__}"
