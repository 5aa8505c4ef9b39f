"""What an editor shows of a table: its history, the view of it, what is selected, and the test row.

Places are (row, column) of the view, as in `tui.model.selection`; rows of the file are named so. A view is not sorted or filtered
again by an edit, so that a row does not jump away under the fingers: `refresh` does that. `tui.model.sheet` adds the edits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.outputs import Output
from contextdb.columns import TextColumn
from contextdb.edits import edits
from contextdb.edits.history import History, Step, where_now
from contextdb.edits.notes import Notes
from contextdb.errors import Fault, plural
from contextdb.findings import Finding
from contextdb.schema.settings import TableSettings
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.nesting.links import nesting_faults
from contextdb.tables.nesting.names import inner_name
from contextdb.tables.table import Table

from .alignment import indent_of, shared_end
from .clip_cells import ClipCells
from .doubts import DOUBTFUL, Doubts
from .fact_steps import FactSteps
from .query_row import QueryRow
from .selection import Block, Selection, Shape
from .table_answer import Offered
from .views import Filter, Sort, View, filtered_rows
from .visible_columns import VisibleColumns

SEEK_ROWS = 4096
"""So many rows are looked through at once for a cell that fails."""
NUMBER_JOBS = ("priority", "weight", "cooldown_s", "cooldown_turns")
"""Columns of these jobs hold numbers."""


@dataclass(frozen=True, slots=True)
class Header:
    """What the three lines over a column say."""

    name: str
    kind: str
    """The type of a condition; "asset", "output", "rule", or the job of a plain column, such as "priority", for the others."""
    unit: str = ""
    leaves: int | None = None
    """How many rows the fact of the test row alone leaves."""
    fault: Fault | None = None
    """What is wrong with that fact."""
    n_actors: int = 0
    """How many actors are offered for its role, whose facts are used instead."""
    is_extra: bool = False
    """It is no column of the table, but a fact that its rules, expressions or inner tables need."""
    how: str = ""
    """Of a fact that is computed: its expression."""


class DisplayedTable:
    """A table as it is displayed. `version` grows with whatever may change what is painted."""

    def __init__(self, table: Table, history: History | None = None) -> None:
        self.history = history or History(table)
        self.selection = Selection()
        self.query = QueryRow(self.table)
        self.fact_steps = FactSteps()
        self.sort: Sort | None = None
        self.filter = Filter()
        self.view = View.of(self.table)
        self.visible_columns = VisibleColumns()
        self.version = 0
        self.marks = Notes()
        """Notes on cells, and colours of rows."""
        self.clips = ClipCells()
        """What Autofill knows of the clips."""
        self.played: int | None = None
        """The row of the file that a game which is followed has picked."""
        self._doubts = Doubts()
        self._places: dict[str, tuple[TextColumn, int]] = {}
        """For columns of numbers how far they are indented, for the assets how long their shared end is, and of which texts."""
        self._conditions: tuple[Table | None, list[ConditionColumn | None]] = (None, [])
        self._domains: tuple[Table | None, Sequence[Domain]] = (None, ())
        """The table, and by column the condition that it is."""
        self._findings: NDArray[np.bool_] | None = None
        self._inner_faults: tuple[object, dict[str, Fault | None]] = (None, {})
        """The tables of the folder, and what is wrong with naming one in a row, by the text of the cell."""

    # ---- what is seen

    @property
    def table(self) -> Table:
        return self.history.table

    @property
    def shape(self) -> Shape:
        """Rows displayed, and columns."""
        return len(self.view), len(self.table.columns)

    @property
    def block(self) -> Block:
        return self.selection.block(self.shape)

    @property
    def cursor(self) -> tuple[int, int]:
        """The cell where typing goes."""
        return self.selection.row, self.selection.column

    @property
    def selected_rows(self) -> list[int]:
        """The rows of the file that are selected, in the order displayed."""
        return [int(r) for r in self.view.rows[self.block.top : self.block.bottom]]

    @property
    def selected_columns(self) -> list[str]:
        """The names of the columns that are selected, without hidden ones."""
        return [self.table.columns[at].name for at in self.columns_of(self.block)]

    def text(self, row: int, column: int) -> str:
        return self.table.columns[column][int(self.view.rows[row])]

    def inherited(self, row: int, column: int) -> str:
        """What a cell that says nothing has from the base of a variant; "" where it says something, or there is nothing."""
        own, texts = self.text(row, column), self.inherited_texts(column)
        return "" if own.strip() or texts is None else texts[int(self.view.rows[row])]

    def inherited_texts(self, column: int) -> TextColumn | None:
        """The texts of a column with those of the base where the sheet's are empty; None where nothing is inherited."""
        whole, name = self.query.whole, self.table.columns[column].name
        if whole is None or name == self.table.settings.remove:
            return None
        return next((texts for texts in whole.columns if texts.name == name), None)

    @property
    def enabled(self) -> NDArray[np.bool_]:
        """Whether each row may match: of a variant those of the base that it takes out may not."""
        return self.table.enabled if self.query.whole is None else self.query.whole.enabled

    def row_number(self, row: int) -> int:
        """The number next to a row: its place in the file, from 1."""
        return int(self.view.rows[row]) + 1

    def fault(self, row: int, column: int) -> Fault | None:
        texts = self.table.columns[column]
        condition = self.condition(column)
        if condition is not None:
            return condition.faults.get(int(texts.codes[int(self.view.rows[row])]))
        text = self.text(row, column)
        if (output := self.missing_output(column)) is not None and self.is_missing(int(self.view.rows[row]), column):
            return output.fault(text)
        return self.text_fault(column, text) or edits.check_cell(self.table, texts.name, text)

    def text_fault(self, column: int, text: str) -> Fault | None:
        """What is wrong with a text of a column that is not a condition: a table that is to be in a row, or what a column with
        another job cannot say."""
        name, table = self.table.columns[column].name, self.table
        if name == table.asset_column:
            return self.inner_fault(text)
        return edits.check_cell(table, name, text)

    def indent(self, column: int) -> int:
        """How far the points of the numbers of a column are from the left; 0 for a column of no numbers."""
        condition, texts = self.condition(column), self.table.columns[column]
        if condition is not None and condition.condition.domain.type.is_numeric:
            return self._place(texts, indent_of)
        jobs = {name for job, name in self.table.settings.jobs if job in NUMBER_JOBS}
        return self._place(texts, indent_of) if texts.name in jobs else 0

    @property
    def shared_end(self) -> int:
        """How long the end is that the names of all assets have in common."""
        return self._place(self.table.columns[self.asset_at], shared_end)

    def _place(self, texts: TextColumn, of: Callable[[TextColumn], int]) -> int:
        known = self._places.get(texts.name)
        if known is None or known[0] is not texts:
            known = self._places[texts.name] = texts, of(texts)
        return known[1]

    def missing_output(self, column: int) -> Output | None:
        """The output that a column is, if its cells may not be empty."""
        output = self.table.settings.output(self.table.columns[column].name)
        return output if output is not None and output.needs_cell else None

    def is_missing(self, file_row: int, column: int) -> bool:
        """Whether a cell of an output that may not be empty is; a row that refers to a table may leave it to that."""
        texts = self.table.columns
        return not texts[column][file_row].strip() and inner_name(texts[self.asset_at][file_row]) is None

    def inner_fault(self, text: str) -> Fault | None:
        """Why a table cannot be in a row whose asset cell has this text."""
        if inner_name(text) is None or self.table.around is None:
            return None
        if self._inner_faults[0] is not self.table.around:
            self._inner_faults = self.table.around, {}
        known = self._inner_faults[1]
        if text not in known:
            settings = TableSettings(self.table.name, asset=self.table.asset_column)
            column = TextColumn.of(self.table.asset_column, [text])
            probe = Table(self.table.name, settings, (column,), (), origin=np.array([-1]))
            known[text] = next(iter(nesting_faults(probe, self.table.around, self.table.name)), None)
        return known[text]

    @property
    def asset_at(self) -> int:
        """The column that names the assets."""
        name = self.table.asset_column
        return next(at for at, column in enumerate(self.table.columns) if column.name == name)

    def condition(self, column: int) -> ConditionColumn | None:
        """The condition that a column is; None for one of another kind."""
        if self._conditions[0] is not self.table:
            of = {id(c.texts): c for c in self.table.conditions}
            self._conditions = self.table, [of.get(id(texts)) for texts in self.table.columns]
        return self._conditions[1][column]

    @property
    def domains(self) -> Sequence[Domain]:
        """Those of the conditions: the same object as long as they are as they were."""
        if self._domains[0] is not self.table:
            now = tuple(column.condition.domain for column in self.table.conditions)
            self._domains = self.table, self._domains[1] if now == self._domains[1] else now
        return self._domains[1]

    @property
    def n_unread(self) -> int:
        """How many texts of the cursor's column cannot be read."""
        condition = self.condition(self.selection.column)
        return 0 if condition is None else len(condition.faults)

    @property
    def extra(self) -> tuple[Condition, ...]:
        """The facts that the test row has behind those of the columns: see `QueryRow.extra`."""
        return self.query.extra

    def fact_of(self, column: int) -> Condition | None:
        """The condition that a field of the test row is a fact of: a column's, or behind the last column one of `extra`."""
        n_columns = len(self.table.columns)
        if column >= n_columns:
            return self.extra[column - n_columns] if column - n_columns < len(self.extra) else None
        condition = self.condition(column)
        return None if condition is None else condition.condition

    def header(self, column: int) -> Header:
        """What stands over a column, or over a fact that is none."""
        condition = self.fact_of(column)
        if condition is not None:
            name = condition.name
            role = self.query.role_of(name)
            n_actors = len(self.query.actors[role]) if role is not None else 0
            fault = self.query.faults.get(name) if role is None else None
            is_extra, how = column >= len(self.table.columns), (condition.expr or "") if self.query.is_computed(name) else ""
            leaves = self.query.leaves(name)
            return Header(name, condition.domain.kind, condition.unit, leaves, fault, n_actors, is_extra, how)
        name = self.table.columns[column].name
        settings = self.table.settings
        jobs = {column: job for job, column in settings.jobs if job not in ("asset", "outputs")} | {settings.when: "rule"}
        return Header(name, "asset" if name == self.table.asset_column else jobs.get(name, "output"))

    def failing(self, top: int, bottom: int) -> NDArray[np.bool_]:
        """Which cells of the rows displayed from `top` up to `bottom` do not accept their fact: bool [rows, columns]."""
        rows = self.view.rows[top:bottom]
        fails = np.zeros((len(rows), self.shape[1]), np.bool_)
        places = {c.name: at for at, c in enumerate(self.table.columns)}
        fails[:, [places[c.condition.name] for c in self.table.conditions]] = self.query.failing(rows)
        if self.table.settings.when in places:
            fails[:, places[self.table.settings.when]] = self.query.excluded_by_rule(rows)
        return fails

    def next_failing(self, is_backwards: bool = False) -> tuple[int, int] | None:
        """The next cell, row by row and going round at the end, that does not accept its fact, or cannot be read where the test
        row is empty; None where there is none."""
        n_rows, n_columns = self.shape
        here = self.cursor[0] * n_columns + self.cursor[1]
        blocks = [(top, min(top + SEEK_ROWS, n_rows)) for top in range(0, n_rows, SEEK_ROWS)]
        first = self.cursor[0] // SEEK_ROWS
        ahead = [*blocks[first:], *blocks[: first + 1]] if not is_backwards else [*blocks[first::-1], *blocks[first:][::-1]]
        for at, (top, bottom) in enumerate(ahead):
            places = np.flatnonzero(self._wrong(top, bottom)) + top * n_columns
            if at == 0:
                places = places[places < here] if is_backwards else places[places > here]
            if len(places):
                place = int(places[-1] if is_backwards else places[0])
                return place // n_columns, place % n_columns
        return None

    def _wrong(self, top: int, bottom: int) -> NDArray[np.bool_]:
        if not self.query.is_empty:
            return self.failing(top, bottom)
        rows = self.view.rows[top:bottom]
        wrong = np.zeros((len(rows), self.shape[1]), np.bool_)
        for at, texts in enumerate(self.table.columns):
            condition = self.condition(at)
            if condition is not None and condition.faults:
                wrong[:, at] = np.isin(texts.codes[rows], list(condition.faults))
        return wrong

    def notes(self, row: int) -> dict[int, str]:
        """What is at the right of cells of a row of the file, by column: who is cast, how much of a table inside is valid."""
        notes: dict[int, str] = {}
        names = [c.name for c in self.table.columns]
        if (inside := self.query.inside(row)) is not None:
            notes[names.index(self.table.asset_column)] = inside.text
        for role, actor in self.query.casting(row).items():
            at = next((at for at, name in enumerate(names) if name.startswith(f"{role}.")), None)
            if at is not None:
                notes[at] = actor
        return notes

    def marked(self, row: int, column: int) -> str:
        """The note on a cell of a row of the file, what its clip says, and the colour of the row, in words."""
        asset, texts = self.table.columns[self.asset_at][row], self.table.columns[column]
        note, clip = self.marks.texts.get((asset, texts.name), ""), self.clips.mark_text(asset, texts.name, texts[row])
        colour = self.marks.colours.get(asset, "")
        parts = (self.doubt(row, column), f"note: {note}" if note else "", clip, f"marked {colour}" if colour else "")
        return " · ".join(filter(None, parts))

    def doubt(self, file_row: int, column: int) -> str:
        """What is odd about a cell that can be read; "" where nothing is."""
        condition = self.condition(column)
        if condition is not None:
            return self._doubts.of_cell(condition, file_row)
        texts = self.table.columns[column]
        return self._doubts.of_name(texts, file_row) if texts.name == self.table.asset_column else ""

    def clip_mark(self, row: int, column: int) -> str:
        """What stands before the text of a cell: that it is odd, or what its clip says; a space where there is nothing to say."""
        if self.doubt(int(self.view.rows[row]), column):
            return DOUBTFUL
        if not self.clips.cells:
            return " "
        return self.clips.mark(self.text(row, self.asset_at), self.table.columns[column].name, self.text(row, column)) or " "

    def row_summary(self, row: int) -> str:
        """Who is cast for a row of the file, whether it is picked, and how much is valid of the table that it is for."""
        parts = [f"{role}: {actor}" for role, actor in self.query.casting(row).items()]
        if (inside := self.query.inside(row)) is not None:
            fault = inside.fault.found.rstrip(".") if inside.fault is not None else ""
            parts.append(fault or f"▸ {inside.text}{'' if inside.n_valid is None else ' valid'} · Alt+O opens it")
        if not self.query.is_empty and self.query.bits >> row & 1:
            outcome = self.query.outcome
            tells = outcome.prefers_some or outcome.refusal is not None or self.query.undecided >> row & 1
            parts += filter(None, (self.query.doubt(row), self.query.standing(row) if tells else ""))
        return " · ".join(parts)

    def is_filled(self, row: int, column: int) -> bool:
        return bool(self.text(row, column).strip())

    # ---- which columns are seen

    @property
    def hidden(self) -> tuple[bool, ...]:
        names = [c.name for c in self.table.columns]
        return self.visible_columns.are_hidden(names, self.table.asset_column)

    def columns_of(self, block: Block) -> list[int]:
        """The columns of a block without hidden ones, which no edit of a selection changes."""
        hidden = self.hidden
        return [at for at in range(block.left, block.right) if not hidden[at]]

    def hidden_in(self, block: Block) -> str:
        """How many rows a filter hides in a block, and its hidden columns, in words; empty where there are none."""
        rows, n_columns = self.view.rows[block.top : block.bottom], sum(self.hidden[block.left : block.right])
        is_of_all = len(rows) == len(self.view) and self.selection.kind in ("columns", "all")
        n_rows = self.table.n_rows if is_of_all else int(rows[-1] - rows[0]) + 1 if len(rows) and not self.view.is_sorted else 0
        hidden = [plural(n, what) for n, what in ((n_rows - len(rows), "hidden row"), (n_columns, "hidden column")) if n > 0]
        return " and ".join(hidden)

    def show_columns(self, wanted: VisibleColumns) -> None:
        """Hide, fold and freeze columns; the cursor leaves a column that is hidden."""
        self.visible_columns = wanted
        self._select(self.selection)

    def hide_columns(self) -> None:
        """Hide the selected columns, but never that of the assets."""
        names = set(self.selected_columns) - {self.table.asset_column}
        self.show_columns(replace(self.visible_columns, hidden=self.visible_columns.hidden | names))

    # ---- where one is

    def go(self, row: int, column: int, extend: bool = False) -> None:
        self._select(self.selection.at(row, column, self.shape, extend))

    def go_to(self, file_row: int, column: str | None = None) -> None:
        """Put the cursor on a row of the file; a filter that hides it is removed."""
        if self.view.place(file_row) is None:
            self.set_filter(Filter())
        names = [c.name for c in self.table.columns]
        if column in names:
            self.visible_columns = self.visible_columns.revealed(column)
        self.go(self.view.place(file_row) or 0, names.index(column) if column in names else self.selection.column)

    def move(self, down: int, right: int, extend: bool = False) -> None:
        """Arrows and pages."""
        self._select(self.selection.moved(down, right, self.shape, extend))

    def move_to_edge(self, down: int, right: int, extend: bool = False) -> None:
        """Ctrl and arrows."""
        self._select(self.selection.to_edge(down, right, self.shape, self.is_filled, extend))

    def move_on(self, down: int, right: int) -> None:
        """Enter and Tab: to the next cell that is not hidden, among those that are selected where they are several."""
        next_one, block, hidden = self.selection.next_cell(down, right, self.shape), self.block, self.hidden
        while block.n_cells > 1 and hidden[next_one.column]:
            next_one = next_one.next_cell(down * block.shape[0], right, self.shape)
        self._select(next_one)

    def select(self, change: Callable[[Selection, Shape], Selection]) -> None:
        """Any other move of the selection: `sheet.select(Selection.end)`."""
        self._select(change(self.selection, self.shape))

    def _select(self, selection: Selection) -> None:
        self.selection = selection if self.visible_columns.is_plain else self._on_seen(selection)
        self.version += 1

    def _on_seen(self, selection: Selection) -> Selection:
        """A selection whose cursor, or the corner that moves, is on a column that is seen: the next one the way it went. Where the
        cursor's column is hidden, one cell is selected."""
        is_wide, place = selection.far != (selection.row, selection.column), (selection.row, selection.column)
        is_of_columns = selection.kind in ("columns", "all")
        if (is_wide or is_of_columns) and self.hidden[selection.column]:
            selection, is_wide, is_of_columns = Selection(*place, place, place), False, False
        column = selection.far[1] if is_wide else selection.column
        hidden = self.hidden
        if is_of_columns or column >= len(hidden) or not hidden[column]:
            return selection
        before = self.selection.far[1] if is_wide else self.selection.column
        ahead, behind = range(column + 1, len(hidden)), range(column - 1, -1, -1)
        ways = (behind, ahead) if column < before else (ahead, behind)
        seen = next((at for way in ways for at in way if not hidden[at]), column)
        far = (selection.far[0], seen)
        if is_wide:
            return replace(selection, far=far)
        return replace(selection, column=seen, anchor=(selection.anchor[0], seen), far=far)

    # ---- the view

    def set_sort(self, sort: Sort | None) -> None:
        """Show the rows sorted by a column, or in the order of the file."""
        self.sort = sort
        self.refresh()

    def set_filter(self, wanted: Filter) -> None:
        self.filter = wanted
        self.refresh()

    def set_findings(self, findings: Iterable[Finding]) -> None:
        """The findings of `check`, for the filter on it."""
        flags = np.zeros(self.table.n_rows, np.bool_)
        flags[[f.row for f in findings if f.row is not None and f.row < self.table.n_rows]] = True
        self._findings = flags

    def refresh(self) -> None:
        """Sort and filter again; the selection stays on its rows where they are still displayed."""
        rows, chosen = [self._file_row(place[0]) for place in self._corners()], self._chosen()
        valid = self.query.valid if self.filter.is_valid else None
        names = {c.name for c in self.table.columns}
        sort = Sort.by([key for key in self.sort.keys if key.column in names]) if self.sort else None
        self.filter = self.filter.of_columns(names)
        self.view = View.of(self.table, sort, filtered_rows(self.table, self.filter, valid, self._findings))
        self._place_selection(rows)
        if self.selection.kind in ("cells", "rows") and len(chosen) > 1 and not np.array_equal(chosen, self._chosen()):
            self.go(*self.cursor)  # other rows would be selected than those that were

    def _chosen(self) -> NDArray[np.int64]:
        """The rows of the file that are selected, in the order of the file."""
        return np.sort(self.view.rows[self.block.top : self.block.bottom])

    def set_fact(self, condition: str, text: str) -> Fault | None:
        """Write one fact of the test row; gives what is wrong with it. One that is computed cannot be written."""
        if why := self.query.wanted.why_computed(condition):
            return Fault(why, rule="wrong-fact")
        self._ask(f"the fact of {condition}", lambda: self.query.set(condition, text))
        return self.query.faults.get(condition)

    def ask(self, name: str, facts: Mapping[str, str] | None = None, actors: Offered | None = None) -> None:
        """Ask for other facts, of other actors, or both, as one step of the test row; None leaves them as they are."""

        def change() -> None:
            if actors is not None:
                self.query.offer(actors)
            if facts is not None:
                self.query.load(facts)

        self._ask(name, change)

    def follow(self, facts: Mapping[str, str], actors: Offered) -> None:
        """Ask what a running game asks. It is no step: the game asks many times a second."""
        self.version += 1
        self.query.follow(facts, actors)

    def _ask(self, name: str, change: Callable[[], object]) -> None:
        self.version += 1
        self.fact_steps.do(self.query, name, change)

    def undo_fact(self, is_redo: bool = False) -> str | None:
        """Take back the last change of the test row, or make it again; gives its name, None where there is none."""
        self.version += 1
        return self.fact_steps.redo(self.query) if is_redo else self.fact_steps.undo(self.query)

    # ---- after a step

    def saved(self, table: Table) -> None:
        """The table is on the disk; `table` is what `Table.save` gave back."""
        self.history.saved(table)
        self.query.show(self.table)
        self.version += 1

    @property
    def is_modified(self) -> bool:
        """Whether there is something to save."""
        return self.history.is_modified

    @property
    def path(self) -> Path | None:
        return self.table.path

    def _follow(self, before: Table, step: Step) -> None:
        """Bring view, selection and test row to the table as it is after a step."""
        self.version += 1
        self.query.show(self.table)
        self._follow_columns(before)
        if step.came_from is None:
            self._select(self.selection.within(self.shape))
            return
        now = where_now(step.came_from, before.n_rows)
        rows = [None if row is None else int(now[row]) for row in map(self._file_row, (p[0] for p in self._corners()))]
        self.view = self.view.after(step.came_from)
        if self._findings is not None:
            self._findings = np.append(self._findings, False)[step.came_from]
        self._place_selection(rows)

    def _follow_columns(self, before: Table) -> None:
        if [c.name for c in before.columns] == [c.name for c in self.table.columns]:
            return
        places = {c.name: at for at, c in enumerate(self.table.columns)}
        names = [c.name for c in before.columns]
        (row, column), anchor, far = (
            (place[0], places.get(names[place[1]], place[1]) if place[1] < len(names) else 0) for place in self._corners()
        )
        self.selection = replace(self.selection, row=row, column=column, anchor=anchor, far=far)

    def _corners(self) -> tuple[tuple[int, int], tuple[int, int], tuple[int, int]]:
        return self.cursor, self.selection.anchor, self.selection.far

    def _file_row(self, row: int) -> int | None:
        return int(self.view.rows[row]) if row < len(self.view) else None

    def _place_selection(self, rows: Sequence[int | None]) -> None:
        """Put the selection's corners on rows of the file; one that is not displayed stays where it is on the screen."""
        places = [
            old[0] if row is None or self.view.place(row) is None else self.view.place(row)
            for row, old in zip(rows, self._corners(), strict=True)
        ]
        (row, anchor, far), now = (p or 0 for p in places), self.selection
        moved = replace(now, row=row, anchor=(anchor, now.anchor[1]), far=(far, now.far[1]))
        self._select(moved.within(self.shape))
