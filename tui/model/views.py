"""Which rows are displayed and in what order: sort and filter as views, that never touch the file.

A view is the numbers of the file's rows, in the order displayed. Columns are sorted in the natural order of their type: numbers by
where they begin, then by where they end; enums as declared; texts without regard to case, numbers in them by value. Any comes
last, then what cannot be read, both ways round. The sort is stable.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Container, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Literal, TypeVar

import numpy as np
import polars as pl
from numpy.typing import NDArray

from contextdb.bitmask import Flags, Rows
from contextdb.cells.sets import Cell, NumberSet, TagSet, ValueSet
from contextdb.columns import TextColumn
from contextdb.tables.changes import CameFrom
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.table import Table

_DIGITS = 20
"""Numbers inside texts are compared by value up to so many digits."""


@dataclass(frozen=True, slots=True)
class Sort:
    """By which column the rows displayed stand."""

    column: str
    is_descending: bool = False
    then: Sort | None = None
    """By what rows are sorted that this column does not tell apart."""

    @property
    def keys(self) -> tuple[Sort, ...]:
        """This and what comes after it, the first one first."""
        return (replace(self, then=None), *(self.then.keys if self.then is not None else ()))

    @classmethod
    def by(cls, keys: Sequence[Sort]) -> Sort | None:
        """By some columns, the first one first; None for none."""
        return replace(keys[0], then=cls.by(keys[1:])) if keys else None


Compared = Literal["<", "<=", ">", ">=", "=", "!="]
COMPARED: tuple[Compared, ...] = ("<=", ">=", "!=", "<", ">", "=")


@dataclass(frozen=True, slots=True)
class CellTest:
    """What a cell must say to be displayed: it accepts a number below or above one, or it is a text, or it is not."""

    column: str
    how: Compared
    text: str

    @classmethod
    def read(cls, column: str, text: str) -> CellTest | None:
        """A test as a person types it: "<3", ">= 2", "=Walk", "!= Walk", "not Walk"; None for a text to be looked for."""
        stripped = text.strip()
        if stripped.casefold().startswith("not "):
            return cls(column, "!=", stripped[4:].strip())
        how = next((sign for sign in COMPARED if stripped.startswith(sign)), None)
        return None if how is None or not stripped[len(how) :].strip() else cls(column, how, stripped[len(how) :].strip())

    @property
    def label(self) -> str:
        """The test as its chip says it."""
        return f"{self.column} {'not' if self.how == '!=' else self.how} {self.text}"


@dataclass(frozen=True)
class Filter:
    """Which rows are displayed: all its parts must hold."""

    text: str = ""
    """Stands in some cell of the row, without regard to case."""
    columns: tuple[tuple[str, str], ...] = ()
    """For some columns a text that is in the cell, without regard to case."""
    cells: tuple[tuple[str, frozenset[str]], ...] = ()
    """For some columns the texts that the cell may be, exactly."""
    tests: tuple[CellTest, ...] = ()
    """What cells of some columns must say."""
    is_valid: bool = False
    """Only rows valid for the test context."""
    has_findings: bool = False
    """Only rows that `check` has something to say about."""

    @property
    def is_off(self) -> bool:
        """Whether every row is displayed."""
        return not (self.text or self.columns or self.cells or self.tests or self.is_valid or self.has_findings)

    def of_columns(self, names: Container[str]) -> Filter:
        """The filter without what it asks of columns that are gone."""
        tests = tuple(test for test in self.tests if test.column in names)
        return replace(self, columns=_without_others(self.columns, names), cells=_without_others(self.cells, names), tests=tests)

    @property
    def parts(self) -> list[tuple[str, Filter]]:
        """What it asks for, part by part in words, each with the filter that is left without that part."""
        parts = [(f'"{self.text}"', replace(self, text=""))] if self.text else []
        for at, (name, text) in enumerate(self.columns):
            parts.append((f'{name} has "{text}"', replace(self, columns=_without(self.columns, at))))
        for at, (name, texts) in enumerate(self.cells):
            values = " or ".join(sorted(text or "(empty)" for text in texts)[:3]) + (" or …" if len(texts) > 3 else "")
            parts.append((f"{name}: {values}", replace(self, cells=_without(self.cells, at))))
        for at, test in enumerate(self.tests):
            parts.append((test.label, replace(self, tests=_without(self.tests, at))))
        parts += [("valid", replace(self, is_valid=False))] if self.is_valid else []
        return parts + ([("with problems", replace(self, has_findings=False))] if self.has_findings else [])


Part = TypeVar("Part")


def _without_others(parts: tuple[tuple[str, Part], ...], names: Container[str]) -> tuple[tuple[str, Part], ...]:
    return tuple(part for part in parts if part[0] in names)


def _without(parts: tuple[Part, ...], at: int) -> tuple[Part, ...]:
    return (*parts[:at], *parts[at + 1 :])


@dataclass(frozen=True, eq=False)
class View:
    """The rows displayed: view row i is row `rows[i]` of the table, which has `n_rows`."""

    rows: Rows
    n_rows: int
    is_sorted: bool = False

    @classmethod
    def of(cls, table: Table, sort: Sort | None = None, flags: Flags | None = None) -> View:
        """A view of a table: sorted, and with the rows whose flag is set; all without flags."""
        order = np.arange(table.n_rows) if sort is None else sorted_rows(table, sort)
        return cls(order if flags is None else order[flags[order]], table.n_rows, sort is not None)

    def __len__(self) -> int:
        return len(self.rows)

    def place(self, row: int) -> int | None:
        """Where a row of the table is displayed; None when it is not."""
        at = int(self._places[row]) if 0 <= row < self.n_rows else -1
        return at if at >= 0 else None

    def after(self, came_from: CameFrom) -> View:
        """The view of a table whose rows changed. Visible rows stay visible, in the order of the file or, in a sorted view, where
        it was; new rows are behind the visible row that is before them in the file."""
        places = np.append(self._places, -1)[came_from]
        is_shown = (places >= 0) | (came_from < 0)
        if self.is_sorted:
            order = np.argsort(_filled_forward(places), kind="stable")
            return View(order[is_shown[order]], len(came_from), True)
        return View(np.flatnonzero(is_shown), len(came_from))

    @cached_property
    def _places(self) -> NDArray[np.int64]:
        places = np.full(self.n_rows, -1, np.int64)
        places[self.rows] = np.arange(len(self.rows))
        return places


def _filled_forward(places: NDArray[np.int64]) -> NDArray[np.int64]:
    """Each -1 as the last value before it that is none; -1 where there is none."""
    at = np.maximum.accumulate(np.where(places < 0, 0, np.arange(1, len(places) + 1)))
    return np.append(-1, places)[at]


def filtered_rows(table: Table, wanted: Filter, valid: Flags | None = None, findings: Flags | None = None) -> Flags | None:
    """Whether each row passes a filter: bool [n_rows]; None when all do. `valid` and `findings` are flags of rows."""
    if wanted.is_off:
        return None
    flags = np.ones(table.n_rows, np.bool_)
    if wanted.text:
        flags &= np.logical_or.reduce([_contains(c, wanted.text) for c in table.columns])
    for name, text in wanted.columns:
        flags &= _contains(table.text_column(name), text)
    for name, texts in wanted.cells:
        column = table.text_column(name)
        flags &= _of_codes(column, np.array([t in texts for t in column.texts], np.bool_))
    for test in wanted.tests:
        flags &= _passes(table, test)
    if wanted.is_valid and valid is not None:
        flags &= valid
    if wanted.has_findings and findings is not None:
        flags &= findings
    return flags


def _contains(column: TextColumn, text: str) -> Flags:
    word = text.casefold()
    return _of_codes(column, np.array([word in folded for folded in map(str.casefold, column.texts)], np.bool_))


def _passes(table: Table, test: CellTest) -> Flags:
    """Which rows pass a test. A cell passes a comparison when it accepts such a number and is not Any; other texts do not."""
    column = table.text_column(test.column)
    if test.how in ("=", "!="):
        word = test.text.casefold()
        is_text = _of_codes(column, np.array([folded.strip() == word for folded in map(str.casefold, column.texts)], np.bool_))
        return is_text if test.how == "=" else ~is_text
    bound = _number_in(test.text)
    if bound is None:
        return np.zeros(table.n_rows, np.bool_)
    condition = next((c for c in table.conditions if c.texts is column), None)
    ends = [_ends(text) for text in column.texts] if condition is None else [_accepted_ends(cell) for cell in condition.cells]
    compare = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}[test.how]
    low = test.how in ("<", "<=")
    return _of_codes(column, np.array([end is not None and compare(end[0 if low else 1], bound) for end in ends], np.bool_))


def _accepted_ends(cell: Cell) -> tuple[float, float] | None:
    accepts = cell.accepts
    return (accepts.spans[0][0], accepts.spans[-1][1]) if isinstance(accepts, NumberSet) and accepts.spans else None


def _ends(text: str) -> tuple[float, float] | None:
    number = _number_in(text)
    return None if number is None else (number, number)


def _number_in(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return None if math.isnan(number) else number


def _of_codes(column: TextColumn, flags: Flags) -> Flags:
    return flags[column.codes] if len(flags) else np.zeros(column.n_rows, np.bool_)


# ---- the natural order


def sorted_rows(table: Table, sort: Sort) -> Rows:
    """Every row in the natural order of a column, and of those that come after it: int64 [n_rows]."""
    if not table.n_rows:
        return np.arange(0)
    return np.asarray(np.lexsort([_order(table, key) for key in reversed(sort.keys)]), np.int64)


def _order(table: Table, sort: Sort) -> NDArray[np.int64]:
    """A number for each row by one column: lower ones come first."""
    ranks = _ranks(table, sort.column)
    order = -ranks.of_texts if sort.is_descending else ranks.of_texts
    order = order + ranks.is_last.astype(np.int64) * (2 * len(order) + 2)
    return np.asarray(order[table.text_column(sort.column).codes], np.int64)


@dataclass(frozen=True, eq=False)
class _Ranks:
    of_texts: NDArray[np.int64]
    """For each distinct text of the column its place in order."""
    is_last: NDArray[np.int8]
    """1 for Any and the empty text, 2 for what cannot be read."""


def _ranks(table: Table, name: str) -> _Ranks:
    column = table.text_column(name)
    for one in table.conditions:
        if one.texts is column:
            return _condition_ranks(one)
    is_last = np.array([not t.strip() for t in column.texts], np.int8)
    return _Ranks(_places_in_order([text_keys(column.texts)]), is_last)


def _condition_ranks(column: ConditionColumn) -> _Ranks:
    is_last = np.array([2 if i in column.faults else int(c.is_any) for i, c in enumerate(column.cells)], np.int8)
    domain = column.condition.domain
    if domain.type.is_numeric:
        ends = [c.accepts.spans for c in column.cells if isinstance(c.accepts, NumberSet)]
        keys = np.zeros((2, len(column.cells)))
        at = [i for i, c in enumerate(column.cells) if isinstance(c.accepts, NumberSet)]
        keys[0, at] = [spans[0][0] if spans else np.inf for spans in ends]
        keys[1, at] = [spans[-1][1] if spans else np.inf for spans in ends]
        return _Ranks(_places_in_order([keys[0], keys[1]]), is_last)
    if not (domain.type.is_open or domain.type.is_tags):
        values: tuple[bool | str, ...] = domain.everything or ()
        declared: dict[bool | str, int] = {v: i for i, v in enumerate(values)}
        tuples = [_declared_places(c.accepts, declared) for c in column.cells]
        order = {t: i for i, t in enumerate(sorted(set(tuples)))}
        return _Ranks(np.array([order[t] for t in tuples], np.int64), is_last)
    return _Ranks(_places_in_order([text_keys(column.texts.texts)]), is_last)


def _declared_places(accepts: NumberSet | ValueSet | TagSet | None, declared: dict[bool | str, int]) -> tuple[int, ...]:
    if not isinstance(accepts, ValueSet):
        return ()
    return tuple(sorted(i for v, i in declared.items() if accepts.holds(v)))


def _places_in_order(keys: list[NDArray[np.float64]] | list[NDArray[np.int64]]) -> NDArray[np.int64]:
    """The dense rank of each text by its keys, the first key first; equal keys have one rank."""
    n_texts = len(keys[0])
    order = np.lexsort(keys[::-1])
    differs = np.zeros(n_texts, np.bool_)
    for key in keys:
        differs[1:] |= key[order][1:] != key[order][:-1]
    places = np.empty(n_texts, np.int64)
    places[order] = np.cumsum(differs)
    return places


@lru_cache(maxsize=4)
def text_keys(texts: tuple[str, ...]) -> NDArray[np.int64]:
    """A number for each text, in their natural order: "walk_2" before "walk_10", whatever the case."""
    if not texts:
        return np.empty(0, np.int64)
    keys = pl.Series(texts, dtype=pl.String).str.strip_chars().str.to_lowercase()
    padded = keys.str.replace_all(r"([0-9]+)", "0" * _DIGITS + "$1").str.replace_all(rf"[0-9]*([0-9]{{{_DIGITS}}})", "$1")
    return padded.rank("dense").cast(pl.Int64).to_numpy()
