"""What type a column of another program has most likely, from its cells and its name, and why."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from contextdb.cells import Cell, TagSet, ValueSet, parse_cell, reads
from contextdb.columns import TextColumn
from contextdb.conditions import READABLE_SHARE
from contextdb.domains import ANGLE, BOOL, INT, NUMBER, TAGS, TEXT, Domain
from contextdb.errors import CellError, plural
from contextdb.exchange.reading import listed
from contextdb.shapes import wrong_name

MOST_ENUM_VALUES = 40
"""A column with more different names than this is a text: nobody wants to keep such a list."""
FEW_ROWS = 10
"""Of so few rows nobody can tell whether their names are all there are."""
MOST_EXAMINED = 2_000
"""Distinct texts that are looked at; a column with more is judged by its commonest."""

_ANY_WORDS = frozenset(("", "-", "any"))
_ANGLE_NAME = re.compile(r"angle|direction|heading|bearing|yaw|rotation|degrees|(?:^|_)(?:dir|deg|rot)(?:_|$)", re.IGNORECASE)
_FRACTION = re.compile(r"\d\.\d|(?<!\.)\.\d|\de-?\d", re.IGNORECASE)


@dataclass(frozen=True)
class Proposal:
    """A type for a column: what `[conditions.NAME]` would say, and why. None: the cells are no condition's."""

    declared: Mapping[str, object] | None
    why: str
    n_unreadable: int = 0
    """Rows whose cell cannot be read as this type."""


@dataclass(frozen=True)
class _Said:
    """The texts of a column that say something, the commonest first, and how many rows hold each."""

    texts: Sequence[str]
    counts: Sequence[int]
    n_rows: int

    @classmethod
    def by(cls, column: TextColumn) -> _Said:
        counts = np.bincount(column.codes, minlength=len(column.texts)).tolist()
        said = [(t, n) for t, n in zip(column.texts, counts, strict=True) if n and t.strip().casefold() not in _ANY_WORDS]
        said.sort(key=lambda item: -item[1])
        return cls([t for t, _ in said], [n for _, n in said], sum(n for _, n in said))

    def n_unread(self, domain: Domain) -> int:
        """How many rows cannot be read as a domain; of very many texts only the commonest are tried."""
        pairs = zip(self.texts[:MOST_EXAMINED], self.counts, strict=False)
        return sum(n for text, n in pairs if not reads(text, domain))

    @property
    def is_numeric(self) -> bool:
        """Whether half of the rows read as numbers and the others have digits: numbers with slips among them, as in "2; 5"."""
        texts = self.texts[:MOST_EXAMINED]
        has_digits = all(any(map(str.isdigit, text)) for text in texts)
        return has_digits and 2 * self.n_unread(NUMBER) <= self.n_rows

    def mostly(self, domain: Domain) -> bool:
        """Whether nearly all rows read as a domain; stops at the row that decides."""
        may_fail = (1 - READABLE_SHARE) * self.n_rows
        for text, n in zip(self.texts[:MOST_EXAMINED], self.counts, strict=False):
            may_fail -= 0 if reads(text, domain) else n
            if may_fail < 0:
                return False
        return True


def propose_type(column: TextColumn) -> Proposal:
    """The type that a column's cells most likely have."""
    said = _Said.by(column)
    if not said.texts:
        return Proposal({"type": "text"}, "no cell says anything but Any")
    if {t.strip() for t in said.texts} <= {"0", "1"}:
        return Proposal({"type": "int"}, "the cells are 0 and 1; bool, if they mean False and True")
    if said.mostly(BOOL):
        return _with_unread({"type": "bool"}, f"{plural(said.n_rows, 'cell')} of True and False", said, BOOL)
    if said.mostly(NUMBER) or said.is_numeric:
        return _number(column.name, said)
    if said.mostly(TAGS):
        return _with_unread(_tags(said), "every word has a + or a - before it", said, TAGS)
    return _names(said)


def _with_unread(declared: Mapping[str, object], why: str, said: _Said, domain: Domain) -> Proposal:
    n_unread = said.n_unread(domain)
    return Proposal(declared, f"{why}; {plural(n_unread, 'cell')} cannot be read so" if n_unread else why, n_unread)


def _number(name: str, said: _Said) -> Proposal:
    texts = [text for text in said.texts[:MOST_EXAMINED] if reads(text, NUMBER)]
    backwards = next((t for t in texts if _runs_backwards(t)), None)
    is_angle = _ANGLE_NAME.search(name) is not None or backwards is not None
    if is_angle and all(reads(text, ANGLE) and _is_within_turn(text) for text in texts):
        why = f'"{backwards}" runs through 180' if backwards else "the name tells of an angle, and no number is above 360"
        return _with_unread({"type": "angle"}, why, said, ANGLE)
    if not any(_FRACTION.search(text) for text in texts):
        return _with_unread({"type": "int"}, "all numbers are whole", said, INT)
    fraction = next(text for text in texts if _FRACTION.search(text))
    return _with_unread({"type": "number"}, f'numbers with fractions, such as "{fraction}"', said, NUMBER)


def _runs_backwards(text: str) -> bool:
    """Whether an interval ends below where it starts, as only one on the circle does."""
    found = re.fullmatch(r"\s*[\[(]?\s*(-?[\d.]+?)\s*\.\.\s*(-?[\d.]+)\s*[\])]?\s*", text)
    try:
        return found is not None and float(found[1]) > float(found[2])
    except ValueError:
        return False


def _is_within_turn(text: str) -> bool:
    return all(abs(float(number)) <= 360 for number in re.findall(r"\d+(?:\.\d+)?", text))


def _tags(said: _Said) -> dict[str, object]:
    found: dict[str, None] = {}
    for cell in _cells(said, TAGS):
        if isinstance(cell.accepts, TagSet):
            found |= dict.fromkeys(sorted(cell.accepts.needs | cell.accepts.bans))
    return {"type": "tags", "values": sorted(found)} if found and _can_be_declared(found) else {"type": "tags"}


def _can_be_declared(names: Iterable[str]) -> bool:
    """Whether contextdb.toml takes all of the names as values."""
    return not any(map(wrong_name, names))


def _names(said: _Said) -> Proposal:
    """An enum of the names there are, where those are few and come back; a text; or, of whole sentences, no condition at all."""
    if not said.mostly(TEXT):
        return Proposal(None, "the cells are no names, numbers or tags: data for the game, or a note")
    names: dict[str, None] = {}
    for cell in _cells(said, TEXT):
        if isinstance(cell.accepts, ValueSet):
            names |= dict.fromkeys(_in_order(cell.accepts))
    if len(names) <= MOST_ENUM_VALUES and _can_be_declared(names) and (len(names) < said.n_rows or said.n_rows < FEW_ROWS):
        why = f"{plural(len(names), 'name')} in {plural(said.n_rows, 'cell')}: {listed(list(names), 4)}"
        return _with_unread({"type": "enum", "values": list(names)}, why, said, Domain("enum", tuple(names)))
    if len(names) == said.n_rows:
        return Proposal(None, "every row has a name of its own: data for the game, or a note")
    return _with_unread({"type": "text"}, f"{plural(len(names), 'different name')}", said, TEXT)


def _in_order(accepts: ValueSet) -> list[str]:
    return sorted(str(value) for value in accepts.values)


def _cells(said: _Said, domain: Domain) -> list[Cell]:
    cells = []
    for text in said.texts[:MOST_EXAMINED]:
        try:
            cells.append(parse_cell(text, domain, wants_mend=False))
        except CellError:
            continue
    return cells


def names_of(column: TextColumn) -> list[str]:
    """The names in a column's cells that contextdb.toml takes as values, in order."""
    cells = _cells(_Said.by(column), TEXT)
    names = {name for cell in cells if isinstance(cell.accepts, ValueSet) for name in _in_order(cell.accepts)}
    return sorted(name for name in names if not wrong_name(name))


def n_unreadable(column: TextColumn, domain: Domain) -> tuple[int, str]:
    """How many rows of a column a domain cannot read, and the first such text."""
    counts = np.bincount(column.codes, minlength=len(column.texts)).tolist()
    wrong = [(text, n) for text, n in zip(column.texts, counts, strict=True) if n and not reads(text, domain)]
    return sum(n for _, n in wrong), wrong[0][0] if wrong else ""
