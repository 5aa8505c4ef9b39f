"""Every error, worded so that the reader can fix it.

An error carries one or more faults. A fault gives the place (a `Place`), what was found, what is accepted and the nearest
correction, in that order. One error reports all faults of a file together. In brackets: the built-in error that it is as well.

    ContextDBError
    ├── CellError       a cell whose text does not follow the grammar (ValueError)
    ├── SchemaError     contextdb.toml has an invalid setting (ValueError)
    ├── TableError      a table file that cannot be read, or rows that cannot be compiled (ValueError)
    │   ├── NoSuchTable     a name that no table has (KeyError)
    │   └── NoSuchRow       a row that a table to be changed does not have; a NoSuchPlace too (IndexError)
    ├── FileError       the disk refuses: missing, not permitted, full, changed under us (OSError)
    ├── ContextError    facts that a query cannot use, or an invalid argument (ValueError)
    │   ├── NoSuchFact      a fact that does not exist (KeyError)
    │   ├── NoSuchOutput    an output that a table does not have (KeyError)
    │   ├── NoSuchPlace     a row, or a place in an answer, that does not exist (IndexError)
    │   └── WrongType       an argument of a type that is not accepted (TypeError)
    ├── PolicyError     a table breaks its own policy
    ├── ArtefactError   a compiled file that is truncated, altered or from another version (ValueError)
    └── MotionError     clips, features and searches (ValueError); these three are public in contextdb.motion
        ├── ClipError   a clip that cannot be read
        └── QueryError  a motion query that cannot be searched with
"""

from __future__ import annotations

import difflib
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

SHOWN_CHARACTERS = 60


def row_name(row: int) -> str:
    """A row (from 0, as Python counts) in a text that people read: "row 1" is the first, as in the editor."""
    return f"row {row + 1}"


@dataclass(frozen=True, slots=True)
class Place:
    """Where a fault is: a file with a line (from 1), or a table's row (from 0, from 1 in the text of it) and column."""

    file: str | None = None
    line: int | None = None
    column: str | None = None
    row: int | None = None

    def __str__(self) -> str:
        parts = [self.file] if self.file else []
        if self.line is not None:
            parts.append(f"line {self.line}")
        elif self.row is not None:
            parts.append(row_name(self.row))
        if self.column is not None:
            parts.append(f'column "{safe_text(self.column)}"')
        return ", ".join(parts)


@dataclass(frozen=True, slots=True)
class Fault:
    """One problem in the input: its place, what was found, what is accepted, and the nearest correction.

    `mend` is what was probably meant, or what to do: "to save it as UTF-8".
    """

    found: str
    accepted: str = ""
    mend: str = ""
    place: Place = Place()
    rule: str = "unreadable"

    @property
    def message(self) -> str:
        """The fault without its place, on one line."""
        parts = [self.found]
        if self.accepted:
            parts.append(f"Accepted: {self.accepted}.")
        if self.mend:
            parts.append(f"Try {self.mend}." if self.mend.startswith("to ") else f"Did you mean {self.mend}?")
        return " ".join(parts)

    def __str__(self) -> str:
        place = str(self.place)
        return f"{place}: {self.message}" if place else self.message

    def at(self, place: Place) -> Fault:
        """The same fault, placed. Raises nothing."""
        return replace(self, place=place)


class ContextDBError(Exception):
    """An input that contextdb refuses, with every fault."""

    def __init__(self, *faults: Fault | str) -> None:
        self.faults: tuple[Fault, ...] = tuple(Fault(f) if isinstance(f, str) else f for f in faults)
        super().__init__("\n".join(str(f) for f in self.faults))

    def __str__(self) -> str:
        return "\n".join(str(f) for f in self.faults)  # a KeyError would show its repr

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), self.faults


class CellError(ContextDBError, ValueError):
    """A cell whose text does not follow the grammar of its type."""


class SchemaError(ContextDBError, ValueError):
    """contextdb.toml, or a schema given in Python, has an invalid setting."""


class TableError(ContextDBError, ValueError):
    """A table file that cannot be read, or rows that cannot be compiled."""


class NoSuchTable(TableError, KeyError):
    """A name that no table of a project has."""


class FileError(ContextDBError, OSError):
    """The file system refuses: a file is missing, not permitted, or the disk is full.

    `filename` and `strerror` are the place and the text of the first fault; `errno` is the number of the system where it refused.
    """

    def __init__(self, *faults: Fault | str, errno: int | None = None) -> None:
        super().__init__(*faults)
        self.errno = errno
        if self.faults:
            self.filename, self.strerror = self.faults[0].place.file, self.faults[0].message

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), self.faults, {"errno": self.errno}


class ContextError(ContextDBError, ValueError):
    """Facts that a query cannot use: missing, unknown, of the wrong type, or outside the domain."""


class NoSuchFact(ContextError, KeyError):
    """A fact that a live context does not have: the table has no such condition, or the fact is not set."""


class NoSuchOutput(ContextError, KeyError):
    """An output that a table does not have."""


class NoSuchPlace(ContextError, IndexError):
    """A row that a table does not have, or a place that an answer does not have."""


class NoSuchRow(TableError, NoSuchPlace):
    """A row that a table does not have of which another is to be made."""


class WrongType(ContextError, TypeError):
    """An argument of a type that a function does not accept."""


class PolicyError(ContextDBError):
    """A table breaks its own policy: two rows are valid at once although the policy is "unique"."""


class ArtefactError(ContextDBError, ValueError):
    """A compiled file that is truncated, altered, or written by another version."""


class MotionError(ContextDBError, ValueError):
    """Clips, features or a search that cannot be used."""


class ClipError(MotionError):
    """A motion clip that cannot be read."""


class QueryError(MotionError):
    """A motion query that cannot be searched with."""


def safe_text(text: str, most: int = SHOWN_CHARACTERS) -> str:
    """Text as a message shows it: control characters escaped, the middle of a long text left out.

    An accent that stands after its letter as a character of its own is escaped too, so that "e\u0301" is told from "é".
    """
    short = text if len(text) <= most else f"{text[: most - 20]} … ({len(text):,} characters)"
    if short.isascii() and short.isprintable():
        return short
    before = ("", *short)
    loose = [False] * len(short) if unicodedata.is_normalized("NFC", short) else list(map(_is_loose, before, short))
    return "".join(
        c.encode("unicode_escape").decode("ascii") if is_loose or not c.isprintable() else c
        for c, is_loose in zip(short, loose, strict=True)
    )


def _is_loose(before: str, character: str) -> bool:
    """Whether a character is an accent of the one before it, or part of it, or would be another one when composed."""
    return bool(unicodedata.combining(character)) or not unicodedata.is_normalized("NFC", before + character)


def in_quotes(text: str, most: int = SHOWN_CHARACTERS) -> str:
    """Text in quotes for a message: in double ones, or in single ones where it has double ones itself."""
    mark = "'" if '"' in text else '"'
    return f"{mark}{safe_text(text, most)}{mark}"


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known name most like `word`, in spelling and apart from its case, or None when none is near."""
    known_as: dict[str, str] = {}
    for name in known:
        known_as.setdefault(folded(name), name)
    matches = difflib.get_close_matches(folded(word)[:200], known_as, n=1, cutoff=0.6)
    return known_as[matches[0]] if matches else None


def mend_for(word: str, known: Iterable[str]) -> str:
    """The known name most like `word`, in quotes, as a fault suggests it; "" when none is near."""
    near = nearest(word, known)
    return in_quotes(near) if near else ""


def no_such(
    what: str, name: object, known: Iterable[str], accepted: str = "", place: Place = Place(), rule: str = "unreadable"
) -> Fault:
    """The fault of a name that there is not, with the names that there are, unless `accepted` says more, and the nearest one."""
    names = list(known)
    return Fault(f"there is no {what} {in_quotes(str(name))}.", accepted or some(names), mend_for(str(name), names), place, rule)


def folded(name: str) -> str:
    """A name apart from its case, and from whether an accented letter is one character or two."""
    return unicodedata.normalize("NFC", name).casefold()


def some(names: Iterable[str], most: int = 6) -> str:
    """The first few names, quoted, and how many more there are."""
    listed = list(names)
    head = ", ".join(f'"{safe_text(n)}"' for n in listed[:most])
    return head if len(listed) <= most else f"{head} and {len(listed) - most} more"


def joined(texts: Sequence[str], most: int, between: str = ", ") -> str:
    """The first texts in one, and how many more there are."""
    return between.join(texts[:most]) + (f" and {len(texts) - most:,} more" if len(texts) > most else "")


def plural(count: int, noun: str) -> str:
    """ "1 row", "2 rows": a count with its noun."""
    return f"{count:,} {noun}" if count == 1 else f"{count:,} {noun}s"
