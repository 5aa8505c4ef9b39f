"""What is seen of a table in the grid, and in which order: filter, sort, columns that are hidden, folded or frozen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from textual import on

from ..doing import SLOW, do
from ..messages import Notice, ValueRenameWanted
from ..model.problems import findings_at_once
from ..model.sheet import Done, Sheet
from ..model.views import CellTest, Filter, Sort
from ..model.visible_columns import prefix_of
from ..screens.ask import AskDialog
from ..widgets.find_bar import FilterBar, SheetBar
from ..widgets.grid import Grid
from .pane import Pane


class SheetView(Pane):
    """A pane with a sheet in a grid, and a filter bar."""

    def __init__(self, sheet: Sheet, id: str) -> None:  # noqa: A002
        super().__init__(id=id)
        self.sheet = sheet
        self._typed_test: CellTest | None = None
        """The test of the filter that is being typed, which the next letter changes."""

    @property
    def grid(self) -> Grid:
        return self.query_one(Grid)

    def _try(self, verb: Callable[[], Done], n_cells: int = 0, then: Callable[[], None] = lambda: None) -> None:
        """Do something to the sheet that looks at so many cells; where it cannot be done, say why."""
        do(self, self.sheet, verb, n_cells, then)

    def action_filter_same(self) -> None:
        """Only rows whose cell in this column has the text under the cursor."""
        row, column = self.sheet.cursor
        if len(self.sheet.view):
            name, text = self.sheet.table.columns[column].name, self.sheet.text(row, column)
            others = tuple(pair for pair in self.sheet.filter.cells if pair[0] != name)
            self._show_filtered(replace(self.sheet.filter, cells=(*others, (name, frozenset([text])))))

    def action_values(self) -> None:
        """What the cursor's column holds, and what to do with it."""
        from ..screens.column_values import ValuesAnswer, ValuesDialog

        column = self.sheet.selection.column

        def decided(answer: ValuesAnswer) -> None:
            if answer.act == "mend":
                self._try(lambda: self.sheet.mend_all(answer.texts), SLOW * len(answer.texts))
            elif answer.act in ("only", "without"):
                self._show_only(column, answer.texts, is_without=answer.act == "without")
            else:
                self._ask_value(answer.act == "rename", answer.texts)

        ValuesDialog(self.sheet, column).ask(self.app, decided)

    def _show_only(self, column: int, texts: Sequence[str], is_without: bool) -> None:
        name, wanted = self.sheet.table.columns[column].name, self.sheet.filter
        if is_without:
            tests = tuple(CellTest(name, "!=", text) for text in texts)
            self._show_filtered(replace(wanted, tests=tuple(dict.fromkeys((*wanted.tests, *tests)))))
        else:
            others = tuple(pair for pair in wanted.cells if pair[0] != name)
            self._show_filtered(replace(wanted, cells=(*others, (name, frozenset(texts)))))

    def _ask_value(self, is_rename: bool, texts: Sequence[str]) -> None:
        """Ask for another name of a value, or for the text that replaces some."""
        old = texts[0]
        what = (
            f"Another name for the value {old}, in every cell and where it is declared"
            if is_rename
            else "The text to write instead"
        )

        def named(text: str) -> None:
            if text == old:
                return
            if is_rename:
                name = self.sheet.table.columns[self.sheet.selection.column].name
                self.post_message(ValueRenameWanted(name, old, text.strip()))
            else:
                self._try(lambda: self.sheet.replace_value(texts, text))

        AskDialog("Rename the value" if is_rename else "Replace everywhere", what, old, lambda _: "").ask(self.app, named)

    def action_hide_columns(self) -> None:
        self.sheet.hide_columns()
        self._show_columns("Alt+J shows all columns, and brings hidden ones back.")

    def action_show_columns(self) -> None:
        self.sheet.show_columns(replace(self.sheet.visible_columns, hidden=frozenset(), folded=frozenset()))
        self._show_columns("Every column is shown.")

    def action_fold(self) -> None:
        """Fold the columns with the prefix of the cursor's to one, or open them again."""
        name = self.sheet.table.columns[self.sheet.selection.column].name
        prefix = prefix_of(name)
        if prefix is None:
            self.post_message(
                Notice(f"{name} has no prefix: columns such as Defender.DepthChart are grouped by theirs.", "warning")
            )
            return
        self.sheet.show_columns(self.sheet.visible_columns.folded_at(name))
        is_folded = prefix in self.sheet.visible_columns.folded
        self._show_columns(f"The columns of {prefix} are {'folded' if is_folded else 'open again'}.")

    def action_freeze(self) -> None:
        """Let the columns up to the cursor's never scroll; only the assets where that is so already."""
        name, now = self.sheet.table.columns[self.sheet.selection.column].name, self.sheet.visible_columns
        frozen = None if now.frozen == name else name
        self.sheet.show_columns(replace(now, frozen=frozen))
        self._show_columns(f"The columns up to {frozen} do not scroll." if frozen else "Only the assets do not scroll.")

    def action_columns(self) -> None:
        """All columns in a list: go to one, hide, fold, freeze."""
        from ..screens.columns import ColumnsAnswer, ColumnsDialog

        def decided(answer: ColumnsAnswer | None) -> None:
            if answer is None:
                return
            self.sheet.show_columns(answer.columns)
            if answer.column is not None:
                self.go_to_column(answer.column)
            self._show_columns("")
            if answer.wants_sheet:
                self.call_later(self.run_action, "screen.column_sheet")

        ColumnsDialog(self.sheet).ask(self.app, decided)

    def go_to_column(self, name: str) -> None:
        """Put the cursor on a column, which is displayed if it was hidden."""
        names = [c.name for c in self.sheet.table.columns]
        self.sheet.show_columns(self.sheet.visible_columns.revealed(name))
        self.grid.is_in_test_row = False
        self.grid.changed()
        self.grid.moving(lambda: self.sheet.go(self.sheet.cursor[0], names.index(name)))

    def _show_columns(self, message: str) -> None:
        self.show()
        self.grid.post_message(Grid.Moved())
        self.post_message(Notice(message))

    def action_unfilter(self, at: int = -1) -> None:
        """Take one part off the filter; the last one unless another is named."""
        parts = self.sheet.filter.parts
        if not parts:
            self.post_message(Notice("Every row is shown."))
        elif -len(parts) <= at < len(parts):
            self.query_one(FilterBar).clear_text()
            self._show_filtered(parts[at][1])

    def action_sort_then(self) -> None:
        """Sort rows that are alike by the cursor's column, too."""
        name, keys = self.sheet.table.columns[self.sheet.selection.column].name, self.sheet.sort.keys if self.sheet.sort else ()
        before = next((key for key in keys if key.column == name), None)
        others = [key for key in keys if key.column != name]
        if before is None or not before.is_descending:
            others.append(Sort(name, before is not None))
        self.sheet.set_sort(Sort.by(others))
        self.show()
        self.grid.post_message(Grid.Moved())

    def action_show_all(self) -> None:
        self.query_one(FilterBar).clear()
        self._show_filtered(Filter())

    @on(FilterBar.Wanted)
    def _filter(self, event: FilterBar.Wanted) -> None:
        event.stop()
        if event.has_findings:
            self.sheet.set_findings(findings_at_once(self.sheet.table))
        name = self.sheet.table.columns[self.sheet.selection.column].name
        test = CellTest.read(name, event.text) if event.in_column else None
        columns = ((name, event.text),) if event.in_column and event.text and test is None else ()
        text = "" if event.in_column else event.text
        now = self.sheet.filter
        tests = now.tests if test is None else (*(one for one in now.tests if one is not self._typed_test), test)
        if test is None and self._typed_test is not None:
            tests = tuple(one for one in tests if one is not self._typed_test)
        self._typed_test = test
        self._show_filtered(Filter(text, columns, now.cells, tests, event.is_valid, event.has_findings))

    def _show_filtered(self, wanted: Filter) -> None:
        self.sheet.set_filter(wanted)
        self.show()
        self.grid.post_message(Grid.Moved())

    @on(SheetBar.Closed)
    def _bar_closed(self) -> None:
        if self._typed_test is not None:  # it stays, and the next one is another
            self._typed_test = None
            self.query_one(FilterBar).clear_text()
        self.grid.focus()

    def action_sort_file(self) -> None:
        """Put the file's rows in the order that is displayed."""
        sort = self.sheet.sort
        if sort is None:
            name = self.sheet.table.columns[self.sheet.selection.column].name
            sort = Sort(name)

        def sorted_file() -> Done:
            done = self.sheet.sort_file(sort)
            self.sheet.set_sort(None)
            return done

        self._try(sorted_file)
