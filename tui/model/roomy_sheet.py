"""A small sheet in a dialog: its columns are fixed, and there is always an empty row to write the next one in."""

from __future__ import annotations

from contextdb.cells.conditions import Condition
from contextdb.errors import Fault
from contextdb.tables.table import Table

from .sheet import Done, Sheet


class RoomySheet(Sheet):
    """A sheet with room for one more row."""

    fixed = "The columns stay as they are here."
    no_enabling = "Delete the row instead."

    def __init__(self, table: Table) -> None:
        super().__init__(table)
        self._room: set[int] = set()
        """The steps that only added an empty row: they are taken back with the one before."""

    def of_column(self, column: int) -> Condition | None:
        """The condition that a column holds facts of; None for a text."""
        return None

    def known(self, column: int) -> list[str]:
        """The texts that a cell is completed to."""
        return sorted({text for text in self.table.columns[column].to_list() if text})

    def fault_of(self, column: int, text: str) -> Fault | None:
        """Why a text of a column cannot be taken in the row of the cursor."""
        return None

    def check(self, text: str) -> Fault | None:
        """What would be wrong with a text in the cell of the cursor."""
        return self.fault_of(self.selection.column, text) or super().check(text)

    def with_room(self) -> Done:
        """Add an empty row where the last one is none."""
        last = self.table.n_rows - 1
        if last >= 0 and not any(c[last].strip() for c in self.table.columns):
            return Done()
        selection = self.selection
        self.go(max(last, 0), 0)
        done = self.insert_rows(below=True)
        self.select(lambda _, shape: selection.within(shape))
        self._room = {step for step in self._room if step < self.history.position} | {self.history.position}
        return done

    def undo(self) -> Done:
        """Take back the last step that a person made."""
        if self.history.position in self._room:
            super().undo()
        return super().undo()

    def delete_columns(self) -> Done:
        """Nothing."""
        return Done(notes=(self.fixed,))

    def enable_rows(self, is_enabled: bool | None = None) -> Done:
        """Nothing."""
        return Done(notes=(self.no_enabling,))

    def move_column(self, right: int) -> Done:
        """Nothing, too."""
        return Done(notes=(self.fixed,))
