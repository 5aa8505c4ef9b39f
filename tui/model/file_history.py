"""Undo and redo of a table whose file others write too: the present may come to stand on other bytes, or under another schema."""

from __future__ import annotations

from collections.abc import Callable

from contextdb.history import History
from contextdb.table import Table


class FileHistory(History):
    """A history that goes on when the file, or contextdb.toml, was changed by somebody else."""

    def based_on(self, table: Table, is_saved: bool) -> None:
        """The present texts stand on another source now, as in `table`; `is_saved` when the file holds just them."""
        self.saved(table)
        if not is_saved:
            self._saved = None

    def renewed(self, change: Callable[[Table], Table]) -> None:
        """Put every table that is kept, past ones too, under another schema."""
        kept = {position: change(table) for position, table in self._kept.items()}
        self._kept, self.table = kept, kept[self.position]
