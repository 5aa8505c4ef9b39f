"""The Problems tab: what `contextdb check` finds in the table as it is, and what is wrong with the test row.

Enter goes to the cell. What is wrong with cells is there at once, what is wrong with rows a little later.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.content import Content
from textual.message import Message
from textual.widgets import Static
from textual.worker import get_current_worker

from contextdb.covering import Cancelled
from contextdb.errors import Fault
from contextdb.findings import LEVELS, Finding, Level
from contextdb.tables.table import Table

from ..doing import SLOW, do
from ..messages import GoToCell, Notice
from ..model.coverage_run import is_quick
from ..model.problems import WORDS, Problem, Problems, cell_findings, is_checked_at_once, row_findings
from ..model.sheet import Sheet
from ..widgets.choice_line import ChoiceLine
from ..widgets.line_list import LineList, ListCell, ListColumn
from .pane import Pane
from .rows_below import IN_TABLE, RowsBelow

FILTERS: tuple[Level | None, ...] = (None, *LEVELS)
NAMES = ("All", "Errors", "Warnings", "Information")


class ProblemList(LineList):
    """The problems."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "choose", "Go to the cell")]


class ProblemsPane(Pane):
    """What is wrong with the table."""

    BINDINGS: ClassVar[list[BindingType]] = [
        *(Binding(str(at + 1), f"filter({at})", name, show=False) for at, name in enumerate(NAMES)),
        Binding("left_square_bracket", "turn(-1)", "Level before", show=False),
        Binding("right_square_bracket", "turn(1)", "Next level"),
        Binding("r", "check", "Recheck"),
        Binding("g", "group", "Group"),
        Binding("m", "mend", "Mend all like this"),
    ]
    DEFAULT_CSS = """
    ProblemsPane {
        layout: vertical; height: 1fr; background: $surface;
        & > #problems-summary { height: 1; padding: 0 2; text-style: bold; }
        & > ChoiceLine { margin: 1 0 0 0; }
        & > LineList { height: 1fr; }
        & > #problems-detail {
            height: auto; max-height: 45%; border-top: solid $panel; scrollbar-gutter: stable; scrollbar-size-vertical: 1;
        }
        & #problems-detail-text { padding: 0 2; min-height: 3; height: auto; }
    }
    """

    @dataclass
    class Checked(Message):
        """So much is known of a table; sent from another thread."""

        table: Table
        findings: list[Finding]
        is_all: bool

    def __init__(self, sheet: Sheet, *, id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self.sheet = sheet
        self.problems = Problems()
        self.level: Level | None = None
        self.is_grouped = False
        """One line for all problems of a kind in a column."""
        self._of: tuple[Table, dict[str, Fault]] | None = None
        """The table and the faults of the test row that the problems are of."""
        self._findings: list[Finding] = []
        """What is known of that table."""
        self.is_all = False
        """Whether its rows were looked at too."""

    def compose(self) -> ComposeResult:
        yield Static(id="problems-summary", markup=False)
        yield ChoiceLine(NAMES, id="problems-levels")
        columns = [
            ListColumn("Level", 11),
            ListColumn("Row", 8, 0, True),
            ListColumn("Asset", 10, 2, is_name=True),
            ListColumn("Column", 9, 1, is_name=True),
        ]
        yield ProblemList([*columns, ListColumn("What is wrong", 20, 5)], empty="Nothing.", id="problems")
        with VerticalScroll(id="problems-detail"):
            yield Static(id="problems-detail-text", markup=False)
        yield RowsBelow(id="problems-rows")

    def on_mount(self) -> None:
        self.show()

    def show(self) -> None:
        """Bring the list up to date; a table that did not change is not checked again."""
        table, facts = self.sheet.table, dict(self.sheet.query.faults)
        if self._of is not None and self._of[0] is table and self._of[1] == facts:
            return
        is_same = self._of is not None and self._of[0] is table
        self._of = table, facts
        if is_same:  # only the test row is another one
            self._fill()
            return
        self._findings, self.is_all = [], False
        if is_checked_at_once(table):
            self._findings = cell_findings(table)
        if is_quick(table):
            self._findings, self.is_all = [*self._findings, *row_findings(table)], True
        self._fill()
        if not self.is_all:
            self.run_worker(lambda: self._check(table, list(self._findings)), thread=True, exclusive=True, group="check")

    def _check(self, table: Table, findings: list[Finding]) -> None:
        if not is_checked_at_once(table):
            findings = cell_findings(table)
            self.post_message(self.Checked(table, findings, False))
        worker = get_current_worker()
        try:
            rows = row_findings(table, lambda: worker.is_cancelled)
        except Cancelled:  # the table was changed, or the editor is left
            return
        self.post_message(self.Checked(table, [*findings, *rows], True))

    @on(Checked)
    def _checked(self, event: Checked) -> None:
        event.stop()
        if self._of is not None and event.table is self._of[0]:
            self._findings, self.is_all = event.findings, event.is_all
            self._fill()

    def _fill(self) -> None:
        assert self._of is not None
        self.problems = Problems.of(self._findings, self._of[1])
        self._show_all()

    def _show_all(self) -> None:
        parts = [self.problems.summary] if self.is_all or self.problems.items else []
        parts += [] if self.is_all else ["Looking at the rows …" if self._findings else "Checking …"]
        self.query_one("#problems-summary", Static).update(" ".join(parts))
        self._show_lines(keep=True)

    def _show_lines(self, keep: bool = False) -> None:
        counts, lines = self.problems.counts, self.lines
        numbers = [len(self.problems.items), *counts.values()]
        labels = [f"{at + 1} {name} {_count(numbers[at], self.is_all)}" for at, name in enumerate(NAMES)]
        self.query_one(ChoiceLine).show(labels, FILTERS.index(self.level))
        list_widget = self.query_one(LineList)
        list_widget.say_empty("Nothing." if self.is_all else "Still checking …")
        list_widget.show(len(lines), lambda at: _line(lines[at]), list_widget.index if keep else 0)

    @property
    def lines(self) -> Sequence[Problem]:
        """The problems that the filter lets through."""
        return self.problems.grouped(self.level) if self.is_grouped else self.problems.of_level(self.level)

    def take_focus(self) -> None:
        self.query_one(LineList).focus()

    # ---- what can be done

    def action_filter(self, at: int) -> None:
        self.level = FILTERS[at]
        self._show_lines()

    def action_turn(self, step: int) -> None:
        self.action_filter((FILTERS.index(self.level) + step) % len(FILTERS))

    def action_group(self) -> None:
        """One line for each kind of problem in a column, or a line for each problem."""
        self.is_grouped = not self.is_grouped
        self._show_lines()

    def action_mend(self) -> None:
        """Mend every cell of the problem's column that cannot be read and is near to a text that can."""
        lines, at = self.lines, self.query_one(LineList).index
        problem = lines[at] if 0 <= at < len(lines) else None
        names = [column.name for column in self.sheet.table.columns]
        if problem is None or problem.row is None or problem.column not in names or problem.is_of_test_row:
            self.post_message(Notice("Only cells that cannot be read are mended here.", "warning"))
            return
        self.sheet.go(self.sheet.cursor[0], names.index(problem.column))
        do(self, self.sheet, self.sheet.mend_all, SLOW * self.sheet.n_unread)

    def action_check(self) -> None:
        self._of = None
        self.show()

    @on(ChoiceLine.Picked)
    def _picked(self, event: ChoiceLine.Picked) -> None:
        event.stop()
        self.action_filter(event.index)
        self.take_focus()

    @on(LineList.Moved)
    def _moved(self, event: LineList.Moved) -> None:
        event.stop()
        lines = self.lines
        problem = lines[event.index] if 0 <= event.index < len(lines) else None
        self.query_one("#problems-detail-text", Static).update(Content(problem.text if problem is not None else ""))
        self.query_one("#problems-detail").scroll_home(animate=False)
        self._show_rows(problem)

    def _show_rows(self, problem: Problem | None) -> None:
        """The row of a problem among those that cause it, or else among its neighbours."""
        below, table = self.query_one(RowsBelow), self.sheet.table
        if problem is not None and problem.is_of_cases:
            below.show_none()
            return
        tones = {(p.row, p.column): p.level for p in self.problems.items if p.row is not None and p.column is not None}
        row = problem.row if problem is not None and problem.row is not None else None
        column = problem.column if problem is not None else None
        if problem is not None and row is not None and problem.by:
            rows = [one for one in (row, *problem.by) if one < table.n_rows]
            below.show_compared(table, rows, tones, column)
        else:
            below.show_rows(table, IN_TABLE, range(table.n_rows), tones, min(row or 0, table.n_rows - 1), column)

    @on(LineList.Chosen)
    def _chosen(self, event: LineList.Chosen) -> None:
        event.stop()
        problem = self.lines[event.index]
        if problem.row is not None and problem.row < self.sheet.table.n_rows:
            self.post_message(GoToCell(problem.row, problem.column))
        elif problem.is_of_test_row:
            self.post_message(Notice(f'Correct the fact "{problem.column}" in the test row, at the bottom of the grid.'))
        elif problem.is_of_cases:
            self.post_message(Notice("That is about a saved context: F9 lists them."))
        else:
            self.post_message(Notice("That is about the whole table, not about a cell."))


def _count(n: int, is_all: bool) -> str:
    """How many there are; while they are still looked for, how many at least."""
    return f"{n:,}" if is_all else f"{n:,}+" if n else "…"


def _line(problem: Problem) -> Sequence[ListCell]:
    return [(WORDS[problem.level], problem.level), problem.place, problem.asset, problem.column or "", problem.message]
