"""Why not this row, and which rows are nearest to valid in the test row's context: go to a cell, or mend it with one key."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.widgets import Static

from contextdb.errors import plural
from contextdb.tables.nesting.names import inner_name
from contextdb.tables.table import Table

from ..model.query_row import QueryRow
from ..model.why import NEEDED, CellWhy, RowWhy, State, nearest_rows, why_row
from ..model.window import MAY_BE, PICKED, VALID
from ..widgets.choice_line import ChoiceLine
from ..widgets.line_list import LineList, ListCell, ListColumn
from .dialog import Dialog, buttons

MOST_ROWS = 20
NARROW = 110
"""With fewer columns of the screen, fact and cell of the nearest rows are below the list only."""

STATES: dict[State, tuple[str, str]] = {
    "fails": ("✗ fails", "error"),
    "unreadable": ("! unread", "error"),
    "disabled": ("✗ disabled", "error"),
    "open": (f"{MAY_BE} open", "warning"),
    "holds": ("✓ holds", ""),
    "not given": ("· not given", "muted"),
}


@dataclass(frozen=True)
class CellAnswer:
    """What the dialog gives back: a cell to go to, and, when it is to be mended, its new text."""

    row: int
    """The row of the file, from 0."""
    column: str
    text: str | None = None


class NearestDialog(Dialog[CellAnswer]):
    """One row cell by cell, or the rows nearest to valid."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("tab,left,right", "turn", "This row / nearest rows"),
        Binding("m,f4", "mend", "Correct the cell"),
    ]
    DEFAULT_CSS = """
    NearestDialog {
        & > #dialog { width: 96%; max-width: 140; height: 92%; padding: 0 1; }
        & > #dialog > #dialog-body { height: 1fr; }
        & #nearest-choice { padding: 0 1; margin: 0 0 1 0; }
        & #nearest-state { height: auto; max-height: 3; padding: 0 1; text-style: bold; }
        & #nearest-lines { height: 1fr; margin: 1 0; }
        & #nearest-detail { height: auto; min-height: 2; max-height: 6; padding: 0 1; }
        & #nearest-keys { height: 1; margin: 1 0 0 0; padding: 0 1; }
    }
    """
    title_text = "Why"
    keys_text = "Tab turns the page · Esc close"

    def __init__(self, query: QueryRow, table: Table, row: int | None = None) -> None:
        """`row` is the row of the file that the cursor is in; None: there is none."""
        super().__init__()
        self.why = why_row(query, table, row) if row is not None and 0 <= row < table.n_rows else None
        self.nearest = nearest_rows(query, table, MOST_ROWS)
        self.n_valid, self.n_rows, self.asks_nothing = query.n_valid, table.n_rows, query.is_empty
        self.n_undecided = query.n_undecided
        self.faults = dict(query.faults)
        is_plain = self.why is None or (self.why.is_valid and self.why.is_picked and not self.why.doubt)
        self.is_nearest = self.why is None or (is_plain and bool(self.nearest))
        self.cells: list[CellWhy] = []
        self.names: dict[int, str] = {}
        self.firsts: set[int] = set()
        self.is_narrow = False

    def compose_body(self) -> ComposeResult:
        """Which page, what it says, its cells, the chosen cell in full."""
        yield ChoiceLine((), id="nearest-choice")
        yield Static(id="nearest-state")
        yield LineList([ListColumn("Condition", 12, 1)], empty="No row.", id="nearest-lines")
        yield Static(id="nearest-detail")
        yield Static(id="nearest-keys")

    def on_mount(self) -> None:
        self.lines.focus()
        self._show()

    @property
    def lines(self) -> LineList:
        return self.query_one(LineList)

    @property
    def chosen(self) -> CellWhy | None:
        """The cell that the cursor is on."""
        return self.cells[self.lines.index] if self.cells else None

    def _show(self) -> None:
        pages = ["This row"] * (self.why is not None) + [f"Nearest rows {len(self.nearest)}"]
        self.query_one(ChoiceLine).show(pages, len(pages) - 1 if self.is_nearest else 0)
        self.query_one("#nearest-state", Static).update(Content(self._state()))
        rows = self.nearest if self.is_nearest else [self.why] if self.why else []
        self.cells = [cell for why in rows for cell in why.cells]
        self.names = {why.row: why.asset for why in rows}
        self.firsts = {id(why.cells[0]) for why in rows if why.cells}
        self._lay_out()
        self.lines.empty = "Every row is valid." if self.n_valid == self.n_rows else "No row is there."
        self.lines.show(len(self.cells), lambda at: self._line(self.cells[at]))

    def _lay_out(self) -> None:
        """Columns for the page and the room that there is."""
        self.is_narrow = self.size.width < NARROW
        columns = [ListColumn(name, 10, 1) for name in ("Fact", "Cell", "Change to")]
        if not self.is_nearest:
            self.lines.columns = (ListColumn("", 11), ListColumn("Condition", 14, 2, is_name=True), *columns)
        else:
            columns = [ListColumn("Change to", 14)] if self.is_narrow else columns
            self.lines.columns = (
                ListColumn("Row", 5, 0, True),
                ListColumn("Asset", 16, 2, is_name=True),
                ListColumn("Condition", 12, 1, is_name=True),
                *columns,
            )
        self.lines.refresh()

    def on_resize(self) -> None:
        self._lay_out()

    def _line(self, cell: CellWhy) -> Sequence[ListCell]:
        tone = "muted" if cell.state in ("holds", "not given") else ""
        cells: list[ListCell] = [(cell.fact or "–", tone), (cell.cell or "Any", tone), (cell.mend or "", "info")]
        if not self.is_nearest:
            return [STATES[cell.state], (cell.column, tone), *cells]
        head: list[ListCell] = [str(cell.row + 1), (self.names[cell.row], "strong")] if id(cell) in self.firsts else ["", ""]
        return [*head, cell.column, *(cells[-1:] if self.is_narrow else cells)]

    def _state(self) -> str:
        unread = "".join(f"\n! The fact {name} cannot be read and is left out." for name in list(self.faults)[:2])
        if self.asks_nothing:
            return f"The test row is empty: every enabled row is valid.{unread}"
        if self.is_nearest or self.why is None:
            may_be = f", {self.n_undecided:,} may be" if self.n_undecided else ""
            return f"{self.n_valid - self.n_undecided:,} of {plural(self.n_rows, 'row')} valid{may_be}{unread}"
        return row_state(self.why) + unread

    @on(LineList.Moved)
    def _moved(self) -> None:
        cell = self.chosen
        row = f"Row {cell.row + 1:,}, {self.names[cell.row]}: " if cell and self.is_nearest else ""
        self.query_one("#nearest-detail", Static).update(Content(row + cell_state(cell) if cell else ""))
        named = [("go", "Enter Go to the cell")] * (cell is not None)
        named += [("mend", "M Correct the cell")] * (cell is not None and cell.mend is not None)
        self.query_one("#nearest-keys", Static).update(buttons(named))

    @on(LineList.Chosen)
    def action_go(self) -> None:
        if (cell := self.chosen) is not None:
            self.dismiss(CellAnswer(cell.row, cell.column))

    def action_mend(self) -> None:
        """Give back the cell with its mend."""
        cell = self.chosen
        if cell is not None and cell.mend is not None:
            self.dismiss(CellAnswer(cell.row, cell.column, cell.mend))

    def action_turn(self) -> None:
        if self.why is not None:
            self.is_nearest = not self.is_nearest
            self._show()

    @on(ChoiceLine.Picked)
    def _picked(self, event: ChoiceLine.Picked) -> None:
        if self.why is not None and self.is_nearest != (event.index == 1):
            self.action_turn()


def row_state(why: RowWhy) -> str:
    """A row in a sentence."""
    row = f"Row {why.row + 1:,}, {why.asset}"
    if why.is_valid:
        cast = ", ".join(dict.fromkeys(f"{c.column.partition('.')[0]} is {c.fact}" for c in why.cells if c.is_cast))
        sign = MAY_BE if why.doubt else PICKED if why.is_picked else VALID
        return f"{sign} {row}: {'; '.join(filter(None, (why.doubt or 'valid', why.standing, cast)))}"
    return f"✗ {row}: not valid because of {plural(why.n_wrong, 'cell')}"


def cell_state(cell: CellWhy) -> str:
    """A cell in a sentence."""
    text = f'"{cell.cell}"' if cell.cell else "Any"
    if cell.is_cast:
        return f"{cell.column.partition('.')[0]} is played by {cell.fact}; the cell says {text} and accepts it."
    if cell.cell == NEEDED:
        return f"{cell.column} is {cell.fact}."
    if inner_name(cell.cell) is not None:
        n_valid = f"{cell.fact} valid" if " of " in cell.fact else cell.fact
        return f"The row refers to the table {inner_name(cell.cell)}: {n_valid}. Alt+O in the grid opens it."
    if cell.state == "open" and not cell.is_of_rule:
        return f"{cell.column} is {cell.fact}; the cell says {text} and accepts a part of that."
    if cell.state == "open":
        return f"The row's own rule says {text}, and {f'needs {cell.fact}' if cell.fact else 'has no finite value here'}."
    if cell.state == "fails" and cell.is_of_rule:
        return f"The row's own rule says {text}, and that {f'is {cell.fact}' if cell.fact else 'does not hold'}."
    match cell.state:
        case "fails":
            mend = f'\n"{cell.mend}" would also accept it.' if cell.mend is not None else ""
            return f"{cell.column} is {cell.fact}; the cell says {text}.{mend}"
        case "unreadable":
            return f"{cell.column}: the cell {text} cannot be read, so the row is never valid."
        case "disabled":
            return f"The row is disabled: {cell.column} says {text}."
        case "holds":
            return f"{cell.column} is {cell.fact}; the cell says {text} and accepts it."
    if cell.fact:
        return f"{cell.column} is computed, and {cell.fact}; the cell says {text}."
    return f"{cell.column} is not given; the cell says {text}."
