"""The Problems tab: what `check` finds in the table as it is, and what is wrong with the test row. Enter goes to the cell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.content import Content
from textual.message import Message
from textual.widgets import Static

from contextdb.errors import Fault
from contextdb.findings import LEVELS, Level
from contextdb.table import Table
from tui.messages import GoToCell, Told
from tui.model.problems import WORDS, Problem, Problems, is_checked_at_once
from tui.model.sheet import Sheet
from tui.panes.pane import Pane
from tui.widgets.choice_line import ChoiceLine
from tui.widgets.line_list import LineList, ListCell, ListColumn

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
        Binding("r", "check", "Check anew"),
    ]
    DEFAULT_CSS = """
    ProblemsPane {
        layout: vertical; height: 1fr; background: $surface;
        & > #problems-summary { height: 1; padding: 0 2; text-style: bold; }
        & > ChoiceLine { margin: 1 0 0 0; }
        & > LineList { height: 1fr; }
        & > #problems-detail { height: auto; max-height: 45%; border-top: solid $panel; }
        & #problems-detail-text { padding: 0 2; min-height: 3; height: auto; }
    }
    """

    @dataclass
    class Checked(Message):
        """A table was checked on another thread."""

        table: Table
        found: Problems

    def __init__(self, sheet: Sheet, *, id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self.sheet = sheet
        self.problems = Problems()
        self.level: Level | None = None
        self._of: tuple[Table, dict[str, Fault]] | None = None
        """The table and the faults of the test row that the problems are of."""

    def compose(self) -> ComposeResult:
        """The parts."""
        yield Static(id="problems-summary", markup=False)
        yield ChoiceLine(NAMES, id="problems-levels")
        columns = [ListColumn("Level", 11), ListColumn("Row", 8, 0, True), ListColumn("Asset", 10, 2), ListColumn("Column", 9, 1)]
        yield ProblemList([*columns, ListColumn("What is wrong", 20, 5)], empty="Nothing.", id="problems")
        with VerticalScroll(id="problems-detail"):
            yield Static(id="problems-detail-text", markup=False)

    def on_mount(self) -> None:
        """Check what there is."""
        self.show()

    def show(self) -> None:
        """Bring the list up to date; a table that did not change is not checked again."""
        table, facts = self.sheet.table, dict(self.sheet.query.faults)
        if self._of is not None and self._of[0] is table and self._of[1] == facts:
            return
        self._of = table, facts
        if is_checked_at_once(table):
            self._fill(Problems.of(table, facts))
        else:
            self.query_one("#problems-summary", Static).update("Checking …")
            self.run_worker(lambda: self._check(table, facts), thread=True, exclusive=True, group="check")

    def _check(self, table: Table, facts: Mapping[str, Fault]) -> None:
        self.post_message(self.Checked(table, Problems.of(table, facts)))

    @on(Checked)
    def _checked(self, event: Checked) -> None:
        event.stop()
        if self._of is not None and event.table is self._of[0]:
            self._fill(event.found)

    def _fill(self, problems: Problems) -> None:
        self.problems = problems
        self.query_one("#problems-summary", Static).update(problems.summary)
        self._show_lines(keep=True)

    def _show_lines(self, keep: bool = False) -> None:
        counts, lines = self.problems.counts, self.lines
        numbers = [len(self.problems.items), *counts.values()]
        labels = [f"{at + 1} {name} {numbers[at]:,}" for at, name in enumerate(NAMES)]
        self.query_one(ChoiceLine).show(labels, FILTERS.index(self.level))
        shown = self.query_one(LineList)
        shown.show(len(lines), lambda at: _line(lines[at]), shown.index if keep else 0)

    @property
    def lines(self) -> Sequence[Problem]:
        """The problems that the filter lets through."""
        return self.problems.of_level(self.level)

    def take_focus(self) -> None:
        """Give the keys to the list."""
        self.query_one(LineList).focus()

    # ---- what can be done

    def action_filter(self, at: int) -> None:
        """Show one level only."""
        self.level = FILTERS[at]
        self._show_lines()

    def action_turn(self, step: int) -> None:
        """Show the level beside."""
        self.action_filter((FILTERS.index(self.level) + step) % len(FILTERS))

    def action_check(self) -> None:
        """Check again."""
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
        text = lines[event.index].text if 0 <= event.index < len(lines) else ""
        self.query_one("#problems-detail-text", Static).update(Content(text))
        self.query_one("#problems-detail").scroll_home(animate=False)

    @on(LineList.Chosen)
    def _chosen(self, event: LineList.Chosen) -> None:
        event.stop()
        problem = self.lines[event.index]
        if problem.row is not None and problem.row < self.sheet.table.n_rows:
            self.post_message(GoToCell(problem.row, problem.column))
        elif problem.is_of_test_row:
            self.post_message(Told(f'Mend the fact "{problem.column}" in the test row, at the foot of the grid.'))
        else:
            self.post_message(Told("That is about the whole table, not about a cell."))


def _line(problem: Problem) -> Sequence[ListCell]:
    return [(WORDS[problem.level], problem.level), problem.place, problem.asset, problem.column or "", problem.message]
