"""What is different about edits of a variant: its first rows are those of its base, which stay where they are and what they are.

Such a row is deleted by saying so in the column of `remove`. New rows are behind them.
"""

from __future__ import annotations

from contextdb.edits import edits
from contextdb.errors import Fault, TableError, in_quotes
from contextdb.tables.changes import Edit
from contextdb.tables.variants import WholeTable

from .displayed_table import DisplayedTable


def asset_fault(sheet: DisplayedTable, row: int, text: str) -> Fault | None:
    """Why the asset cell of a row of the view cannot have a text: it is by its asset that a row belongs to one of the base."""
    whole = sheet.query.whole
    if whole is None or not len(_of_base(whole, [int(sheet.view.rows[row])])) or text == sheet.text(row, sheet.asset_at):
        return None
    problem = f"the row is that of {in_quotes(_base(sheet))} with this asset."
    return Fault(problem, "the same asset", "to delete the row here, and to add a new one")


def deletion(sheet: DisplayedTable) -> Edit:
    """The edit that deletes the selected rows; those of the base are marked as taken out. Raises TableError where no column says
    so."""
    rows, whole = sheet.selected_rows, sheet.query.whole
    inherited = [] if whole is None else _of_base(whole, rows)
    if not inherited:
        return edits.delete_rows(sheet.table, rows)
    column = sheet.table.settings.remove
    if column is None:
        problem = f"the row is that of {in_quotes(_base(sheet))}, and no column takes rows out."
        mend = f'remove = "COLUMN" in [tables.{sheet.table.settings.name}], and a column of this name'
        raise TableError(Fault(problem, "a new row of this table", mend))
    marked = edits.set_cells(sheet.table, [(row, column, "True") for row in inherited], "Take rows out")
    own = [row for row in rows if row not in inherited]
    more = edits.delete_rows(marked.apply(sheet.table), own).changes if own else ()
    return Edit(marked.name, (*marked.changes, *more))


def require_own_order(sheet: DisplayedTable) -> None:
    """Raise TableError where the order of the rows is that of a base."""
    if sheet.query.whole is not None:
        problem = f"the rows are in the order of {in_quotes(_base(sheet))}."
        raise TableError(Fault(problem, "that order", "to move them there"))


def _of_base(whole: WholeTable, rows: list[int]) -> list[int]:
    return [row for row in rows if whole.base_rows[row] >= 0]


def _base(sheet: DisplayedTable) -> str:
    return sheet.table.settings.base or ""
