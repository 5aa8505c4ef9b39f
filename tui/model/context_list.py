"""The contexts of a file, and where one is in them: saved cases with what is expected of them, or recorded telemetry.

A list belongs to a table: facts are those of its conditions, and what is expected is judged by it, again after each edit. Recorded
contexts stay in their file until they are looked at. An edge: this reads and writes files of contexts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np
import polars as pl
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.cells.conditions import Condition
from contextdb.checks.cases import (
    EXPECTED,
    NONE,
    NOTE,
    Case,
    Verdict,
    delete_case,
    judge,
    keep_case,
    read_cases,
    read_expected,
    rename_case,
)
from contextdb.compiled.data import CompiledData
from contextdb.disk import CASES_SUFFIX
from contextdb.errors import CellError, ContextDBError, ContextError, Fault, Place, TableError, some
from contextdb.tables.compiling import compile_table
from contextdb.tables.other_files import cases_path
from contextdb.tables.readable import unreadable_rows
from contextdb.tables.table import Table
from contextdb.telemetry.recordings import Recording, fact_text, open_recording

from .wanted import wanted_by

BLOCK = 256
"""Rows of a recording that are read in one go."""

KEPT_BLOCKS = 64
"""Blocks that stay in memory: a page of rows of a search's matches may lie in as many."""


class Rows(Protocol):
    """Contexts in an order."""

    path: Path

    def __len__(self) -> int: ...

    def name(self, i: int) -> str: ...

    def facts(self, i: int, conditions: Mapping[str, Condition]) -> dict[str, str]:
        """The facts of a context as texts, without those that are missing."""
        ...

    def search(self, text: str) -> Iterator[NDArray[np.int64]]:
        """The contexts in which every word stands; a part at a time."""
        ...


class SavedRows:
    """The cases of a file."""

    def __init__(self, path: Path, cases: list[Case] | None = None) -> None:
        self.path = path
        self.cases = read_cases(path) if cases is None else cases

    def __len__(self) -> int:
        return len(self.cases)

    def name(self, i: int) -> str:
        return self.cases[i].name

    def facts(self, i: int, conditions: Mapping[str, Condition]) -> dict[str, str]:
        facts = self.cases[i].facts
        return {name: facts[name] for name in conditions if name in facts}

    def search(self, text: str) -> Iterator[NDArray[np.int64]]:
        """The cases in which every word stands."""
        words = text.casefold().split()
        lines = map(_line, self.cases)
        yield np.array([i for i, line in enumerate(lines) if all(word in line for word in words)], np.int64)


class RecordedRows:
    """The rows of a recording."""

    def __init__(self, recording: Recording) -> None:
        self.path = recording.path
        self.recording = recording
        self._blocks: dict[int, pl.DataFrame] = {}

    def __len__(self) -> int:
        return self.recording.n_rows

    def name(self, i: int) -> str:
        """A row is called by its number, from 1."""
        return f"row {i + 1:,}"

    def facts(self, i: int, conditions: Mapping[str, Condition]) -> dict[str, str]:
        if not self.recording.facts:
            return {}
        values = zip(self.recording.facts, self._block(i // BLOCK).row(i % BLOCK), strict=True)
        texts = {name: fact_text(value, conditions[name]) for name, value in values if name in conditions}
        return {name: texts[name] for name in conditions if texts.get(name, "").strip()}

    def search(self, text: str) -> Iterator[NDArray[np.int64]]:
        """The rows in which every word stands."""
        return self.recording.search(text)

    def _block(self, block: int) -> pl.DataFrame:
        if block not in self._blocks:
            while len(self._blocks) >= KEPT_BLOCKS:
                del self._blocks[next(iter(self._blocks))]
            self._blocks[block] = self.recording.read(block * BLOCK, min((block + 1) * BLOCK, len(self)))
        return self._blocks[block]


class ContextList:
    """Contexts with a current one. Between openings of files and the first step none is current: `at` is None."""

    def __init__(self, table: Table, rows: Rows) -> None:
        self.rows = rows
        self.at: int | None = None
        self.show(table)

    @classmethod
    def beside(cls, table: Table) -> ContextList:
        """The cases of a table; none where there is no file of them yet. Raises TableError or FileError where the file of cases
        cannot be read."""
        return cls(table, SavedRows(cases_file(table)))

    @classmethod
    def empty(cls, table: Table) -> ContextList:
        """No contexts; those of a table whose file of cases cannot be read."""
        return cls(table, SavedRows(cases_file(table), []))

    @classmethod
    def open(cls, path: Path, table: Table) -> ContextList:
        """The contexts of a file: cases (`*.cases.csv`) or a recording (`.csv`, `.parquet`, `.jsonl`). Raises TableError or
        FileError where it cannot be read, or has no fact that the table asks for."""
        if path.name.lower().endswith(CASES_SUFFIX):
            return cls(table, SavedRows(path))
        names = list(wanted_by(table).given)
        recording = open_recording(path, names, table.name)
        if not recording.facts:
            raise TableError(Fault("no column is a fact of the table.", some(names), place=Place(str(path))))
        return cls(table, RecordedRows(recording))

    def show(self, table: Table) -> None:
        """Stand on this table from now on; what is expected is judged again."""
        self.table = table
        self.conditions = wanted_by(table).given
        """The conditions whose facts are stored: those that a person may give, computed ones not among them."""
        self._verdicts: dict[int, Verdict] = {}
        self._compiled: tuple[CompiledData, int] | None = None
        """The table compiled, and its rows whose cells can all be read."""

    # ---- where one is

    def __len__(self) -> int:
        return len(self.rows)

    def go(self, i: int) -> bool:
        """Make a context the current one; gives whether there is such a one."""
        if not 0 <= i < len(self):
            return False
        self.at = i
        return True

    def next(self) -> bool:
        """The next context, first the first; gives whether there is one."""
        return self.go(0 if self.at is None else self.at + 1)

    def previous(self) -> bool:
        """The context before, first the last; gives whether there is one."""
        return self.go(len(self) - 1 if self.at is None else self.at - 1)

    @property
    def texts(self) -> dict[str, str]:
        """The facts of the current context as the test row takes them; none when there is no current one."""
        return {} if self.at is None else self.facts(self.at)

    @property
    def title(self) -> str:
        """The current context and its place: "walk_left (3 of 12)"."""
        return "" if self.at is None else f"{self.rows.name(self.at)} ({self.at + 1:,} of {len(self):,})"

    def facts(self, i: int) -> dict[str, str]:
        return self.rows.facts(i, self.conditions)

    # ---- what is expected

    @property
    def cases(self) -> list[Case]:
        """The cases, where the file holds such."""
        return self.rows.cases if isinstance(self.rows, SavedRows) else []

    @property
    def own_cases(self) -> list[Case]:
        """The cases among which a context is saved: those of this file, or of the table's own where this is a recording."""
        return self.cases if isinstance(self.rows, SavedRows) else SavedRows(cases_file(self.table)).cases

    def verdict(self, i: int) -> Verdict | None:
        """What comes out of a case now; None for a recorded context."""
        if not self.cases:
            return None
        if i not in self._verdicts:
            try:
                self._verdicts[i] = judge(self.compiled[0], self.cases[i], self.compiled[1])
            except TableError as error:  # a table inside it cannot be used
                self._verdicts[i] = Verdict(faults=tuple(error.faults))
        return self._verdicts[i]

    @property
    def n_failing(self) -> int:
        """How many cases do not hold now."""
        return sum(verdict is not None and verdict.holds is False for verdict in map(self.verdict, range(len(self.cases))))

    @property
    def compiled(self) -> tuple[CompiledData, int]:
        """The table compiled, with those inside it, and its rows whose cells can all be read. Raises TableError where a table
        inside it cannot be used."""
        if self._compiled is None:
            flat = self.table.flat()
            readable = readable_rows(self.table) if flat is self.table else (1 << flat.n_rows) - 1
            self._compiled = compile_table(flat), readable
        return self._compiled

    @property
    def assets(self) -> Sequence[str]:
        """The assets of the table and of those inside it; none where one of these cannot be used."""
        try:
            return self.compiled[0].assets
        except TableError:
            return ()

    def valid_assets(self, facts: Mapping[str, str]) -> list[str]:
        """The assets that are valid now, each once, in the order of the table. Raises ContextError or TableError where a fact
        cannot be read, or a table inside this one cannot be used."""
        compiled, readable = self.compiled
        known = {name: text for name, text in facts.items() if name in self.conditions}
        verdict = judge(compiled, Case("", known, NONE), readable)
        if verdict.faults:
            raise ContextError(*verdict.faults)
        valid = set(verdict.extra)
        return [asset for asset in dict.fromkeys(compiled.assets) if asset in valid]

    def n_valid(self, i: int) -> int | None:
        """How many rows are valid for a context; None where it, or a table inside, cannot be read."""
        try:
            compiled, readable = self.compiled
            facts = {name: text for name, text in self.facts(i).items() if name in self.conditions}
            verdict = judge(compiled, Case("", facts, NONE), readable)
        except ContextDBError:
            return None
        return None if verdict.faults else verdict.n_valid

    # ---- changes of the file of cases

    def keep(self, name: str, facts: Mapping[str, str], expected: str, note: str = "") -> None:
        """Save a context, in the place of the one of its name: in the file of cases that this is, else in the table's own.

        In a file of cases it is the current one then; a recording stays where it is. Raises TableError, FileError, CellError or
        ContextError where the name is empty, what is expected cannot be read, or the file cannot be written.
        """
        if not name.strip():
            raise TableError(Fault("the context has no name.", "a name, so that messages can say which one fails"))
        read_expected(expected)
        own = self.rows if isinstance(self.rows, SavedRows) else SavedRows(cases_file(self.table))
        old = next((case for case in own.cases if case.name == name), Case(name, {}))
        foreign = {fact: text for fact, text in old.facts.items() if fact not in self.conditions}
        given = {fact: text for fact, text in facts.items() if fact in self.conditions and text.strip()}
        keep_case(own.path, replace(old, facts=foreign | given, expected=expected, note=note or old.note))
        if own is self.rows:
            self._reload()
            self.at = next((i for i, case in enumerate(self.cases) if case.name == name), None)

    def rename(self, i: int, name: str) -> None:
        """Give a case another name; raises TableError and FileError as `rename_case` does."""
        if not name.strip():
            raise TableError(Fault("the context has no name.", "a name, so that messages can say which one fails"))
        rename_case(self.rows.path, self.cases[i], name)
        self._reload()

    def delete(self, i: int) -> None:
        """Take a case out of the file; raises TableError and FileError as `delete_case` does."""
        delete_case(self.rows.path, self.cases[i])
        at = self.at
        self._reload()
        self.at = None if at is None or at == i else at - (at > i)

    def _reload(self) -> None:
        self.rows = SavedRows(self.rows.path)
        self._verdicts.clear()


def cases_file(table: Table) -> Path:
    """Where the cases of a table stand."""
    return cases_path(table.path or Path(f"{table.name}.csv"))


def expectation_fault(text: str) -> Fault | None:
    """What is wrong with a text that says what is expected."""
    try:
        read_expected(text)
    except (CellError, ContextError) as error:
        return error.faults[0]
    return None


def readable_rows(table: Table) -> int:
    """The rows whose cells can all be read, as bits."""
    return bitmask.to_int(bitmask.pack(~unreadable_rows(table)))


def summary(facts: Mapping[str, str]) -> str:
    """Facts on one line: "gait=Walk speed=1.3"."""
    return "  ".join(f"{name}={text}" for name, text in facts.items())


def _line(case: Case) -> str:
    texts = {EXPECTED: case.expected, NOTE: case.note, **case.facts}
    return " ".join([case.name, *(f"{name}={text}" for name, text in texts.items())]).casefold()
