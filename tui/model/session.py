"""One table open in an editor: its sheet, its file, its journal and its lock. An edge: this reads and writes the disk."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from contextdb.disk import read_bytes
from contextdb.errors import Fault, FileError, Place
from contextdb.parquet import ParquetSource, rewritten_parquet
from contextdb.rewrite import rewritten
from contextdb.source import Source
from contextdb.table import Table, load
from tui.model.journal import Holder, Journal, Lock, digest_of, recover
from tui.model.sheet import Sheet


class Session:
    """A table from when it is opened until it is closed."""

    def __init__(self, path: str | Path) -> None:
        """Open a table, with the unsaved edits of an editor that was killed.

        Raises
        ------
        FileError, SchemaError, TableError
            The file cannot be read at all; cells that cannot be read are no hindrance.
        """
        table = load(path, strict=False)
        assert table.path is not None
        assert table.source is not None
        self.path: Path = table.path
        self.lock = Lock(self.path)
        self.holder: Holder | None = self.lock.acquire()
        """The other editor that has the table open. Then nothing is brought back, and no journal is kept."""
        found = recover(table) if self.holder is None else None
        self.n_recovered = found.n_edits if found else 0
        """How many unsaved edits were brought back."""
        self.problem: Fault | None = found.problem if found else None
        """Why unsaved edits could not be brought back, or not all of them."""
        self._digest = digest_of(table.source.raw)
        history = found.history if found and found.n_edits else None
        self.journal = Journal(self.path, self._digest, history)
        self.sheet = Sheet(table, self.journal if self.holder is None else None, history)

    @property
    def is_changed_on_disk(self) -> bool:
        """Whether somebody else has written the file, or taken it away, since it was read or saved here."""
        try:
            return digest_of(read_bytes(self.path)) != self._digest
        except FileError:
            return True

    def save(self, path: str | Path | None = None, overwrite: bool = False) -> None:
        """Write the table to its file, or to another one, which is then its file.

        Raises
        ------
        FileError
            The disk refuses, or (unless `overwrite`) the file has been changed by somebody else. The old file is then whole.
        TableError
            A text that such a file cannot hold.
        """
        target = self.path if path is None else Path(path)
        if target == self.path and not overwrite and self.path.exists() and self.is_changed_on_disk:
            found = "the file has been changed since it was read."
            raise FileError(Fault(found, "the file as it was read", "to reload it, or to save over it", Place(str(target))))
        table = self.sheet.table
        if target == self.path and self.holder is None:
            self.journal.saving(bytes_for(table, target))
        saved = table.save(target)
        assert saved.source is not None
        self.sheet.saved(saved)
        self._moved_to(target)
        self._digest = digest_of(saved.source.raw)
        self.journal.saved(saved.source.raw, self.sheet.history.position)

    def close(self, keep_journal: bool = False) -> None:
        """Let go of the table. Unsaved edits are gone then, unless the journal is kept for the next time."""
        if not keep_journal and self.holder is None:
            self.journal.discard()
        self.lock.release()

    def _moved_to(self, target: Path) -> None:
        if target == self.path:
            return
        self.close()
        self.path, self.lock = target, Lock(target)
        self.holder = self.lock.acquire()
        self.journal = Journal(target, self._digest)
        self.sheet.recorder = self.journal if self.holder is None else None


def bytes_for(table: Table, path: Path) -> bytes:
    """The bytes that `Table.save` writes."""
    fresh = np.full(table.n_rows, -1)
    write: Callable[..., Source | ParquetSource] = rewritten if path.suffix.lower() == ".csv" else rewritten_parquet
    kind = Source if path.suffix.lower() == ".csv" else ParquetSource
    is_same = isinstance(table.source, kind)
    return write(table.columns, table.source if is_same else None, table.origin if is_same else fresh).raw
