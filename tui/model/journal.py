"""Unsaved edits stored next to the table, so that they come back after a crash or a kill.

They are in the folder `.contextdb-journal` next to the table, which ignores itself in git by a .gitignore of its own. A journal
is lines of a check sum, a space and JSON. The first names the file and the digest of the bytes that the edits were made for:

    {"format": 1, "file": "hit_mid_air.csv", "digest": "…"}
    {"do": {"name": …, "changes": […]}}      an edit was made
    {"go": 3}                                undo or redo, to where 3 edits lie behind
    {"saving": "…", "schema": {…}}           the file is about to become the bytes of this digest, and then, where "schema" is
                                             given, the contextdb.toml of the table the "text" there; "was" is its digest before

A line is handed to the system as its edit happens, so a kill loses at most the edit in progress. It is not forced onto the disk: a
power failure may lose the last seconds. A line that is cut, altered or no object ends the journal.

A journal may come from a stranger, so it names no path: what it brings back is this table and the contextdb.toml that holds for it.

Beside a journal stands a second link to the file that its edits were made for. Where the file was replaced after a crash, by a pull
say, the edits come back on the file as it was, and are then merged with what is on the disk.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from contextdb.disk import read_bytes, write_atomic
from contextdb.disk.own_files import (
    append_own,
    cut_own,
    has_own,
    link_own,
    make_own_folder,
    move_own,
    read_own,
    read_second_name,
    remove_own,
    remove_second_name,
    write_own,
)
from contextdb.edits.edits import edit_between
from contextdb.edits.history import History, Step
from contextdb.edits.schema_file import SchemaChange, schema_path
from contextdb.edits.variant_rows import expanded, known_base
from contextdb.errors import ContextDBError, Fault, FileError, Place, plural
from contextdb.files.journal_lines import FORMAT, Record, line_of, n_lost, read_records
from contextdb.files.texts import texts_of
from contextdb.tables.changes import Edit
from contextdb.tables.project import schema_of
from contextdb.tables.table import Table

from .lock import FOLDER
from .watched import digest_of


def journal_path(table: Path) -> Path:
    """The journal of a table's file."""
    return table.parent / FOLDER / f"{table.name}.journal"


def base_path(table: Path) -> Path:
    """The link to the file that the edits of a journal were made for."""
    return table.parent / FOLDER / f"{table.name}.base"


class Journal:
    """The journal of one table, written as edits happen. It is a `tui.model.sheet.Recorder`.

    When the disk refuses, editing continues without a journal, and `problem` says why.
    """

    def __init__(self, table: Path, digest: str, recovered: History | None = None, salt: str = "") -> None:
        self.path = journal_path(table)
        self.problem: Fault | None = None
        self._table = table
        self._digest = digest
        self._salt = salt
        self._first = 0
        """The position of the history that the journal starts from."""
        self._least = 0
        """The first position of the journal that is a state of the history: 1 after a merge, which starts from the disk."""
        self._is_straight = True
        """Whether the journal holds the edits of the history from there on; no longer once a step went back past a save."""
        self._position = recovered.position if recovered else 0
        self._n_edits = len(recovered.names) if recovered else 0
        """How many edits a reader of the journal knows, those taken back too."""
        self._is_begun = self._n_edits > 0
        self._is_broken = False
        """Whether an edit could not be written: those after it would be made again without it."""

    def did(self, edit: Edit) -> None:
        """Write an edit that was made."""
        self._position += 1
        self._n_edits = self._position
        self._write({"do": edit.to_json()})

    def went(self, before: Table, history: History, step: Step) -> None:
        """Write that the history went to where it is; as an edit where a reader could not follow."""
        position = history.position - self._first
        if self._is_straight and self._least <= position <= self._n_edits:
            self._position = position
            self._write({"go": position})
            return
        self._is_straight = False
        came_from = np.arange(before.n_rows) if step.came_from is None else step.came_from
        self._write({"do": edit_between(before, history.table, came_from, step.name).to_json()})

    def saving(self, raw: bytes, schema: SchemaChange | None = None) -> int:
        """Write that the file is about to have these bytes, and then contextdb.toml those; gives how many bytes that takes."""
        if self._is_begun:
            record: dict[str, object] = {"saving": digest_of(raw)}
            if schema is not None:
                was = digest_of(read_bytes(schema.path)) if schema.path.exists() else None
                record["schema"] = {"was": was, "text": schema.raw.decode()}
            self._write(record)
            return len(line_of(record))
        return 0

    def saved(self, raw: bytes, position: int) -> None:
        """The file has these bytes, at this position of the history: begin again with the next edit."""
        self._digest, self._first, self._is_straight = digest_of(raw), position, True
        self._position = self._n_edits = self._least = 0
        self._is_broken = False
        self.discard()
        self.keep_base()

    def rebased(self, raw: bytes, unsaved: Edit, position: int) -> None:
        """The file has these bytes, which somebody else wrote, and `unsaved` leads from them to this position of the history."""
        if not unsaved.changes or not self._is_begun:
            self.saved(raw, position)
        if not unsaved.changes:
            return
        self._digest, self._first, self._is_straight = digest_of(raw), position - 1, True
        self._position = self._n_edits = self._least = 1
        self._is_broken = False
        with self._disk_problems():
            self._begin(line_of({"do": unsaved.to_json()}))
        self.keep_base()

    def keep_base(self) -> None:
        """Keep the file as it is now beside the journal, whoever may replace it. It was just read or written: it has the digest."""
        base = base_path(self._table)
        with suppress(OSError, ContextDBError):  # a disk without links: the edits then come back on the same bytes only
            make_own_folder(base.parent)
            link_own(self._table, base)

    def discard(self) -> None:
        """Take the journal away: nothing is unsaved, or nobody wants it."""
        self._is_begun = False
        for remove, path in ((remove_own, self.path), (remove_second_name, base_path(self._table))):
            with suppress(OSError):  # also FileError: what is not ours stays
                remove(path)

    def _write(self, record: Record) -> None:
        if self._is_broken:
            return
        with self._disk_problems():
            if not self._is_begun:
                self._begin()
            append_own(self.path, line_of(record))

    def _begin(self, first: bytes = b"") -> None:
        make_own_folder(self.path.parent)
        head = line_of({"format": FORMAT, "file": self._table.name, "digest": self._digest + self._salt})
        write_own(self.path, head + first)
        self._is_begun = True

    @contextmanager
    def _disk_problems(self) -> Iterator[None]:
        """Editing continues when the disk refuses; `problem` says so."""
        try:
            yield
        except (OSError, ContextDBError) as error:
            self._is_broken = True
            why = str(error) if isinstance(error, ContextDBError) else error.strerror
            self.problem = Fault(f"unsaved edits are not stored: {why}.", mend="to save often", place=Place(str(self.path)))


def salt_of(table: Table) -> str:
    """What edits of a variant were made for besides its file: the rows of its base; "" for another table."""
    base = known_base(table)
    return "" if base is None else "+" + digest_of("\0".join(base.assets).encode("utf-8", "surrogatepass"))


def set_aside(table: Path) -> Path:
    """Move a journal that cannot be read back out of the way of the next one, for a person to look at; gives where it is."""
    path = journal_path(table)
    aside = path.with_name(f"{table.name}.unread.journal")
    with suppress(OSError):
        move_own(path, aside)
    return aside


# ---- after a crash


@dataclass(frozen=True)
class Recovery:
    """What a journal brings back."""

    history: History
    """The table with the unsaved edits made, and undo for them."""
    n_edits: int
    problem: Fault | None = None
    """Why edits could not be brought back, or not all of them."""
    base: Table | None = None
    """The table that the edits were made for, where the file on the disk is another by now: the two are then to be merged."""


def recover(table: Table) -> Recovery | None:
    """Bring back the unsaved edits of a table as it was just loaded; None when there are none.

    A journal that was cut is cut at its last whole line, so that it can be gone on with.
    """
    if table.path is None or table.source is None:
        return None
    path, digest = journal_path(table.path), digest_of(table.source.raw)
    try:
        if not has_own(path):
            return None
        raw = read_own(path)
    except FileError as error:
        return Recovery(History(table), 0, error.faults[0])
    records, n_bytes = read_records(raw)
    if not any("do" in r for r in records):
        problem = _cut_off(path, raw, len(records), n_bytes) if n_bytes < len(raw) else None
        return Recovery(History(table), 0, problem) if problem else None
    if saved := [r for r in records if r.get("saving") == digest]:
        is_foreign = any(_is_foreign(left, table) for r in saved if (left := _left_of(r)) is not None)
        problem = Fault("it belongs to another contextdb.toml, which is not written.", place=Place(str(path)))
        # killed between the save and the end of the journal: all of it is in the file
        return Recovery(History(table), 0, problem) if is_foreign else None
    made_for = records[0].get("digest")
    base = table if made_for == digest + salt_of(table) else _base_of(table, made_for)
    if records[0].get("format") != FORMAT or base is None:
        n_edits = sum("do" in r for r in records)
        reason = f"the file has changed since {plural(n_edits, 'unsaved edit')} of it were stored, so they cannot be applied again."
        return Recovery(History(table), 0, Fault(reason, "the file as it was then", place=Place(str(path))))
    found_again = _replayed(History(base), records[1:], path)
    if n_bytes < len(raw):
        found_again = replace(found_again, problem=found_again.problem or _cut_off(path, raw, len(records), n_bytes))
    return found_again if base is table else replace(found_again, base=base)


def _cut_off(path: Path, raw: bytes, n_records: int, n_bytes: int) -> Fault | None:
    """Cut a journal at its last whole line; where more than an unfinished line goes, keep the journal as it was, and say so."""
    n_lines = n_lost(raw, n_bytes)
    with suppress(OSError):
        if n_lines:
            write_own(path.with_suffix(".damaged"), raw)
        cut_own(path, n_bytes)
    if not n_lines:
        return None
    problem = f"line {n_records + 1} was altered, so {plural(n_lines, 'edit')} from there on could not be made again."
    return Fault(problem, mend=f"to look into {path.with_suffix('.damaged').name}, which keeps them", place=Place(str(path)))


def finish_save(table: Table) -> bool:
    """Write the contextdb.toml of a save that was killed when only the table stood on the disk; gives whether there was one."""
    if table.path is None or table.source is None:
        return False
    digest, path = digest_of(table.source.raw), schema_path(table)
    with suppress(ContextDBError, FileNotFoundError):  # a journal that is not ours, or a text that is no contextdb.toml
        records, _ = read_records(read_own(journal_path(table.path)))
        for left in (_left_of(r) for r in records if r.get("saving") == digest):
            before = read_bytes(path) if os.path.lexists(path) else None
            if left is not None and not _is_foreign(left, table) and left.was == (None if before is None else digest_of(before)):
                schema_of(left.raw, path)
                return write_atomic(path, left.raw, before)
    return False


@dataclass(frozen=True)
class _Left:
    """A contextdb.toml that a save was still to write."""

    was: str | None
    raw: bytes
    path: object
    """What journals of an older form name; None in those of today."""


def _left_of(record: Record) -> _Left | None:
    match record.get("schema"):
        case {"was": str() | None as was, "text": str() as text, **rest}:
            with suppress(UnicodeEncodeError):
                return _Left(was, text.encode(), rest.get("path"))
    return None


def _is_foreign(left: _Left, table: Table) -> bool:
    """Whether it names another file than the contextdb.toml of the table."""
    return left.path is not None and left.path != os.path.realpath(schema_path(table))


def _base_of(table: Table, digest: object) -> Table | None:
    """The table as it was when the edits were made, from the link next to the journal; None where it is not that any more."""
    assert table.path is not None
    try:
        raw = read_second_name(base_path(table.path))
        if digest_of(raw) + salt_of(table) != digest:
            return None
        source, columns = texts_of(raw, str(table.path))
        base = Table.build(table.name, columns, table.schema, table.settings, table.path, source)
        return expanded(replace(base, around=table.around))
    except (ContextDBError, FileNotFoundError):
        return None


def _replayed(history: History, records: list[Record], path: Path) -> Recovery:
    for record in records:
        try:
            if "do" in record:
                history.do(Edit.from_json(record["do"]))
            elif "go" in record and 0 <= record["go"] <= len(history.names):
                history.go(record["go"])
        except (ContextDBError, KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
            problem = f"only {plural(history.position, 'unsaved edit')} could be made again: {error}"
            return Recovery(history, history.position, Fault(problem, place=Place(str(path))))
    return Recovery(history, history.position)
