"""One table open in an editor: its sheet, its file, its journal and its lock. An edge: this reads and writes the disk.

Others may write the file, or contextdb.toml, while it is open. `poll` says so; `merge_from_disk` and `take` bring what they did
into the sheet as one step, and `reload_schema` reads contextdb.toml again. Unsaved edits stay, and a journal keeps them.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from contextdb.disk import Was, needing, path_in_quotes, read_bytes, real_path, write_atomic
from contextdb.disk.folder_lock import sweep
from contextdb.disk.own_files import NOT_OURS
from contextdb.disk.together import NewFile, write_together
from contextdb.edits.diffing import diff
from contextdb.edits.history import History
from contextdb.edits.notes import Notes
from contextdb.edits.schema_file import schema_change
from contextdb.edits.variant_rows import contracted, expanded
from contextdb.errors import ContextDBError, Fault, FileError, Place, plural
from contextdb.files.texts import new_source
from contextdb.tables.merging.merging import Merge, merge
from contextdb.tables.project import SCHEMA_FILE, load_table, schema_for
from contextdb.tables.saving import require_related
from contextdb.tables.table import Table

from .journal import Journal, finish_save, journal_path, recover, salt_of, set_aside
from .lock import Holder, Lock
from .schemas import under_schema, with_settings
from .sheet import Done, Sheet
from .teams import Teams
from .visible_columns import read_columns, write_columns
from .watched import Seen, State, Watched, digest_of

MERGE_NAME = "Merge changes on disk"


@dataclass(frozen=True, slots=True)
class OnDisk:
    """What others did since the last look. False when nothing."""

    table: State = "same"
    """The table's file."""
    schema: State = "same"
    """The contextdb.toml that holds for it."""
    taken_by: Holder | None = None
    """Another machine that has taken the table over: nothing is saved here any more."""
    is_free: bool = False
    """The editor that had the table has ended, so that it can be opened again for editing."""
    has_left: bool = False
    """It has ended, and left edits that are not saved: who opens the table again gets them."""
    held_by: Holder | None = None
    """Another editor than before has the table open."""

    def __bool__(self) -> bool:
        return self != OnDisk()


class Session:
    """A table from when it is opened until it is closed."""

    def __init__(self, path: str | Path, takes_over: bool = False, reads_only: bool = False) -> None:
        """Open a table, with the unsaved edits of an editor that was killed.

        `takes_over`: take the table from an editor on another machine, which a person says has ended. `reads_only`: the table is
        shown as it is in the file, whoever has it open, and no edit is taken. Raises FileError, SchemaError or TableError where the
        file cannot be read at all; cells that cannot be read are no hindrance.
        """
        table = expanded(load_table(Path(path), strict=False))
        assert table.path is not None
        self.path: Path = table.path
        self.lock = Lock(self.path)
        self.reads_only = reads_only
        self.holder: Holder | None = None if reads_only else self.lock.acquire(takes_over)
        """The other editor that has the table open. Until it has closed it nothing is saved here, and no journal is stored."""
        self._clear_leftovers()
        is_own = self.holder is None and not reads_only
        if is_own and finish_save(table):
            table = expanded(load_table(self.path, strict=False))
        recovery = recover(table) if is_own else None
        self.n_recovered = recovery.n_edits if recovery else 0
        """How many unsaved edits were brought back."""
        self.problem: Fault | None = (recovery.problem if recovery else None) or self.lock.problem
        """Why unsaved edits could not be brought back, or not all of them, or why the table is not locked."""
        self.saved_table = recovery.base if recovery and recovery.base else table
        """The table as it is in the file: what edits are compared with when they are saved."""
        self.teams: Teams | None = None
        """The actors for the roles of the test row, once they were requested."""
        self._history = recovery.history if recovery and recovery.n_edits else History(self.saved_table)
        self._watch_files()
        self.journal = Journal(self.path, self._digest, self._history if self.n_recovered else None, salt_of(table))
        if is_own:
            self._begin_journal()
        self.sheet = Sheet(self._history.table, self.journal if is_own else None, self._history)
        self.sheet.reads_only = reads_only
        self._stored_columns = read_columns(self.path)
        self.sheet.show_columns(self._stored_columns)
        self.sheet.marks = Notes.beside(self.path)

    # ---- what others do

    def poll(self) -> OnDisk:
        """What others did to the files; cheap enough for once a second. A file that is being written counts when it is done."""
        before = self.holder
        is_free = before is not None and self._is_free()
        has_left = is_free and journal_path(self.path).exists()
        held_by = self.holder if self.holder != before else None
        taken_by = self.lock.taken_by()
        if taken_by is not None:
            self.sheet.recorder = None  # the journal is the other's now
        return OnDisk(self._file.look(), self._schema_file.look(), taken_by, is_free and not has_left, has_left, held_by)

    @property
    def disk_stamp(self) -> Seen:
        """What `poll` saw of the file last: another one after each write."""
        return self._file.stamp

    @property
    def why_read_only(self) -> str:
        """Why nothing can be saved to the file, for a person; empty when it can."""
        if self.reads_only:
            return "the editor was started with --read-only"
        holder = self.holder or self.lock.taken_by()
        return f"{holder} has it open for editing" if holder is not None else _why_not_writable(self.path)

    @property
    def is_read_only(self) -> bool:
        """Whether nothing can be saved to the file."""
        return bool(self.why_read_only)

    def merge_from_disk(self) -> Merge[Table]:
        """Merge what is on the disk with the sheet. Without conflicts it is taken at once, as one step.

        With conflicts nothing has changed yet: decide them with `Merge.resolved`, and `take` the result. Raises FileError,
        SchemaError or TableError where what is on the disk is gone, no table, or another one.
        """
        if self._schema_file.state != "same":
            self.reload_schema()
        on_disk = expanded(load_table(self.path, strict=False))
        require_related(self.saved_table, on_disk, "to open it again, or to save over it")
        merged = merge(self.saved_table, self.sheet.table, on_disk)
        if not merged.conflicts:
            self.take(merged)
        return merged

    def take(self, merged: Merge[Table]) -> Done:
        """Make a merge of `merge_from_disk` the sheet's, as one step. What is not decided stays as in the sheet."""
        if merged.ours is not self.sheet.table:
            merged = merge(merged.base, self.sheet.table, merged.theirs, merged.decided)
        on_disk = merged.theirs
        assert on_disk.source is not None
        done = self.sheet.apply(merged.edit_of_ours(MERGE_NAME))
        unsaved = with_settings(merged.edit_of_theirs("Unsaved edits"), on_disk, self.sheet.table)
        now = unsaved.apply(on_disk)
        self._history.based_on(replace(self.sheet.table, source=now.source, origin=now.origin), is_saved=not unsaved.changes)
        self._show()
        self.saved_table = on_disk
        self._file.know(digest_of(on_disk.source.raw))
        if self.holder is None:
            self.journal.rebased(on_disk.source.raw, unsaved, self._history.position)
        return done

    def reload_schema(self) -> None:
        """Read contextdb.toml again. What was edited here of it stays; all other conditions and settings are as the file has them.
        Raises FileError or SchemaError where the file cannot be read, or says what this table cannot be: then nothing has changed.
        """
        folder, schema = schema_for(self.path)
        change = under_schema(self.saved_table, self.sheet.table, self.path, folder, schema)
        self.saved_table = change(self.saved_table)
        self._history.renewed(change)
        self._schema_file = _watched(folder / SCHEMA_FILE)
        self._show()

    def know(self, around: Mapping[str, Table]) -> None:
        """Know of other versions of the tables that rows refer to."""
        self._history.renewed(lambda table: replace(table, around=around))
        self._show()

    def schema_written(self) -> None:
        """contextdb.toml was written here: what is in it is known."""
        self._schema_file = _watched(self._schema_file.path)

    # ---- save and close

    def save(self, path: str | Path | None = None, overwrite: bool = False) -> None:
        """Write the table to its file, or to another one, which is then its file.

        What others wrote since is merged first (`overwrite`: written over). A file that is gone is made again. Raises FileError
        where the disk refuses, another editor has the table, or what others wrote disagrees with edits here (rule
        "merge-conflict"), see `merge_from_disk`: the old file is then whole. Raises TableError for a text that such a file cannot
        hold; SchemaError where what shall change in contextdb.toml disagrees with what others wrote: then nothing is written.
        """
        if self.reads_only:
            raise FileError(Fault(f"nothing is written: {self.why_read_only}.", "another way to start it"))
        target = self.path if path is None else Path(path)
        is_own = target == self.path
        if is_own:
            self._require_own()
        while (saved := self._written(target, is_own, overwrite)) is None:
            pass  # somebody wrote in this moment: once more, with what they wrote
        assert saved.source is not None
        self.sheet.saved(saved)
        self._moved_to(target)
        self.saved_table = self.sheet.table
        self._file.know(digest_of(saved.source.raw))
        self.journal.saved(saved.source.raw, self.sheet.history.position)

    def _written(self, target: Path, is_own: bool, overwrite: bool) -> Table | None:
        """The table as it now is in the file, with contextdb.toml; None where others wrote one of them meanwhile."""
        is_merged = is_own and not overwrite
        if is_merged:
            self._merge_first()
        was: Was = "any" if not is_merged else None if self._file.state == "gone" else self._raw
        table = self.sheet.table
        schema = schema_change(self.saved_table if is_own else None, replace(table, path=target))
        of_file, rows = contracted(table)
        source = new_source(target, of_file.columns, of_file.source, of_file.origin)
        n_bytes = len(source.raw) + (0 if schema is None else len(schema.raw))
        n_bytes += self.journal.saving(source.raw, schema) if is_own else 0
        with needing(n_bytes):
            if schema is None:
                is_written = write_atomic(target, source.raw, was)
            else:
                is_written = write_together(schema.path.parent, [NewFile(target, source.raw, was), schema.new_file])
        if is_written and schema is not None:
            self.schema_written()
        origin = np.full(table.n_rows, -1, np.int64)
        origin[rows] = np.arange(len(rows))
        return replace(table, path=target, source=source, origin=origin) if is_written else None

    def close(self, keep_journal: bool = False) -> None:
        """Let go of the table. Unsaved edits are gone then, unless the journal is stored for the next time."""
        if self.holder is None and not self.reads_only and self.lock.taken_by() is None:
            if self.sheet.visible_columns != self._stored_columns:
                write_columns(self.path, self.sheet.visible_columns)
            if not keep_journal:
                self.journal.discard()
        self.lock.release()

    # ---- parts

    @property
    def _raw(self) -> bytes:
        assert self.saved_table.source is not None
        return self.saved_table.source.raw

    @property
    def _digest(self) -> str:
        return digest_of(self._raw)

    def _begin_journal(self) -> None:
        if self.problem is not None and self.problem.rule != NOT_OURS:
            aside = set_aside(self.path)
            self.problem = replace(self.problem, mend=f"to look at the stored edits, in {path_in_quotes(aside)}")
            self._keep_unsaved()
        elif not self.n_recovered:
            self.journal.keep_base()

    def _keep_unsaved(self) -> None:
        table = self._history.table
        unsaved = with_settings(diff(self.saved_table, table).edit("Unsaved edits"), self.saved_table, table)
        self.journal.rebased(self._raw, unsaved, self._history.position)

    def _watch_files(self) -> None:
        self._file = Watched(self.path, self._digest)
        self._schema_file = _watched(_schema_path(self.path))

    def _show(self) -> None:
        self.sheet.query.show(self.sheet.table)
        self.sheet.version += 1

    def _clear_leftovers(self) -> None:
        if self.lock.is_held:
            for folder in (real_path(self.path).parent, self.lock.path.parent):
                sweep(folder)

    def _is_free(self) -> bool:
        """Whether nobody has the table open any more. Somebody who has it since is its holder from now on."""
        lock = Lock(self.path)
        holder, is_free = lock.acquire(), lock.is_held
        lock.release()
        if holder is not None and holder.pid:  # 0: it is just writing who it is
            self.holder = holder
        return is_free

    def _require_own(self) -> None:
        if self.holder is not None and self._is_free():
            self._take_over()
        holder = self.holder or self.lock.taken_by()
        if holder is not None:
            problem = f"{holder} has this table open, so it is not saved here."
            raise FileError(Fault(problem, "another file", "to save it under another name", Place(str(self.path)), "table-held"))

    def _take_over(self) -> None:
        """Have the table that another editor has closed, and keep a journal of the edits made meanwhile."""
        if journal_path(self.path).exists():
            problem = "the other editor has ended and left edits that are not saved."
            mend = "to save under another name; then open this table again"
            raise FileError(Fault(problem, "another file", mend, Place(str(self.path)), "table-held"))
        self.holder = self.lock.acquire()
        if self.holder is None:
            self._keep_unsaved()
            self.sheet.recorder = self.journal

    def _merge_first(self) -> None:
        if self._file.state != "changed":
            return
        place = Place(str(self.path))
        try:
            merged = self.merge_from_disk()
        except ContextDBError as error:
            problem = f"the file has been changed since it was read, and cannot be read any more: {error.faults[0].found}"
            mend = "to save under another name, or over it"
            raise FileError(Fault(problem, "a table", mend, place, "merge-conflict")) from None
        if merged.conflicts:
            problem = (
                f"the file has been changed since it was read, in {plural(len(merged.conflicts), 'place')} differently than here."
            )
            raise FileError(Fault(problem, mend="to decide which hold", place=place, rule="merge-conflict"))

    def _moved_to(self, target: Path) -> None:
        if target == self.path:
            return
        self.close()
        self.path, self.lock = target, Lock(target)
        self.holder = self.lock.acquire()
        self.saved_table = self.sheet.table
        self._watch_files()
        self.journal = Journal(target, self._digest)
        self.sheet.recorder = self.journal if self.holder is None else None


def _schema_path(table: Path) -> Path:
    """The contextdb.toml that holds for a table, or the one that would if it were made."""
    try:
        return schema_for(table)[0] / SCHEMA_FILE
    except ContextDBError:
        return table.parent / SCHEMA_FILE


def _watched(path: Path) -> Watched:
    """A file whose bytes are known as they are now."""
    try:
        return Watched(path, digest_of(read_bytes(path)))
    except FileError:
        return Watched(path, None)


def _why_not_writable(path: Path) -> str:
    """Why a save would be refused, for a person; empty when nothing speaks against it. Whether it works only a save shows."""
    target = real_path(path)
    folder = target.parent
    try:
        mode = target.stat().st_mode
    except OSError:
        mode = None
    if mode is not None and not (mode & (stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH) and os.access(target, os.W_OK)):
        return "the file is marked read-only"
    if folder.is_dir() and not os.access(folder, os.W_OK | os.X_OK):  # a save puts a new file into the folder
        return "its folder may not be written in"
    return ""
