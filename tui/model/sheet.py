"""The sheet: a table as it is displayed, and the verbs that keys call.

Every edit is one step of the history and, where there is a recorder, given to it before the verb returns. Cells that are pasted or
replaced are taken as they are, and how many of them cannot be read is noted; a text that is typed must be readable.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from contextdb.bitmask import Rows
from contextdb.edits import edits
from contextdb.edits.history import History, Step
from contextdb.edits.renaming import uses_of
from contextdb.errors import Fault, TableError, in_quotes, plural, safe_text
from contextdb.tables.changes import Cells, Change, Edit
from contextdb.tables.table import Table

from .clipboard import format_tsv, parse_tsv, place_paste
from .column_values import mends_of, renamed_value, replaced
from .condition_form import undeclared
from .displayed_table import DisplayedTable
from .find import Search, find, next_hit, replace_all
from .long_work import in_turn, with_progress
from .selection import Block
from .series import continued, tells_step
from .variant_edits import asset_fault, deletion, require_own_order
from .views import Sort, sorted_rows

READS_ONLY = "Nothing is edited: the editor was started with --read-only."


class Recorder(Protocol):
    """What hears of every step, before the verb returns: the journal."""

    def did(self, edit: Edit) -> None:
        """An edit was made."""

    def went(self, before: Table, history: History, step: Step) -> None:
        """The history went from `before` to where it is now."""


@dataclass(frozen=True, slots=True)
class Done:
    """What a verb did: the name of the step, empty when nothing changed, and what a person should know of it."""

    name: str = ""
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    """What did not go as one would think."""


class Sheet(DisplayedTable):
    """A table being edited."""

    def __init__(self, table: Table, recorder: Recorder | None = None, history: History | None = None) -> None:
        super().__init__(table, history)
        self.recorder = recorder
        self.reads_only = False
        """Whether no edit is taken."""

    # ---- edits of cells

    def check(self, text: str) -> Fault | None:
        """What would be wrong with a text in the cell of the cursor."""
        if len(self.view) and self.selection.column == self.asset_at and (fault := asset_fault(self, self.cursor[0], text)):
            return fault
        return self.check_at(self.selection.column, text)

    def check_at(self, column: int, text: str) -> Fault | None:
        """What would be wrong with a text in a cell of a column."""
        name = self.table.columns[column].name
        is_asset = name == self.table.asset_column
        return (self.inner_fault(text) if is_asset else None) or edits.check_cell(self.table, name, text)

    def type_text(self, text: str) -> Fault | None:
        """Put a text into the cell of the cursor, unless it cannot be read: then what is wrong is given and nothing changes."""
        if not len(self.view):
            return Fault("the sheet shows no row.", "a row to type in", "to insert one")
        if fault := self.check(text):
            return fault
        row, column = self.cursor
        if not text.strip() or text != self.inherited(row, column):  # as it was: it follows the base further
            self._set([(row, column, text)])
        return None

    def fill(self, text: str) -> Done:
        """Put a text into every selected cell."""
        return self._set_each(text, "Fill")

    def clear(self) -> Done:
        """Empty every selected cell; an empty condition is Any."""
        return self._set_each("", "Clear")

    def fill_down(self) -> Done:
        """Copy the first selected row into the others; one row alone is filled from the one above it."""
        block = self.block
        source = block.top if block.shape[0] > 1 else block.top - 1
        if source < 0:
            return Done(notes=("There is no row above to fill from.",))
        cells = ((r, c, self.text(source, c)) for r, c in self._cells(block) if r != source)
        return self._set_in(block, cells, f"Fill down {self._size(block)}")

    def fill_right(self) -> Done:
        """Copy the first selected column into the others; one column alone is filled from the one before it."""
        block, columns = self.block, self.columns_of(self.block)
        before = self.columns_of(Block(0, 0, 0, block.left))
        sources = columns[:1] if len(columns) > 1 else before[-1:]
        if not sources:
            return Done(notes=("There is no column to the left to fill from.",))
        cells = ((r, c, self.text(r, sources[0])) for r, c in self._cells(block) if c != sources[0])
        return self._set_in(block, cells, f"Fill right {self._size(block)}")

    def fill_series(self) -> Done:
        """Go on with what the selected columns begin with: one text counts on by 1, two say the step. One cell alone goes on from
        the cell above it."""
        block = self.block
        top = block.top - 1 if block.shape[0] == 1 and block.top else block.top
        cells: list[tuple[int, int, str]] = []
        for column in self.columns_of(block):
            texts = [self.text(row, column) for row in range(top, block.bottom)]
            n_begun = 2 if len(texts) > 2 and tells_step(texts[0], texts[1]) else 1
            more = continued(texts[:n_begun], len(texts) - n_begun)
            cells += [(top + n_begun + at, column, text) for at, text in enumerate(more)]
        if not cells:
            return Done(notes=("Select the first cell and those below it that the series fills.",))
        return self._set_in(block, cells, f"Fill a series of {len(cells)}")

    def declare_value(self, text: str, is_new_row: bool = False) -> Done:
        """Put a text into the cell of the cursor, or into a new row, and declare the values in it that the condition lacks."""
        row, column = self.cursor
        name, condition = self.table.columns[column].name, self.condition(column)
        assert condition is not None, "only a condition has values"
        values = condition.condition.domain.values or ()
        new = undeclared(text, values)
        declared = edits.set_condition(self.table, name, values=[*values, *new])
        after = declared.apply(self.table)
        if fault := edits.check_cell(after, name, text):
            raise TableError(fault)
        if is_new_row:
            cell = edits.insert_rows(after, after.n_rows, [{name: text}])
        else:
            cell = edits.set_cells(after, [(int(self.view.rows[row]), name, text)])
        edit = Edit(f"Add {', '.join(map(safe_text, new))} to the values of {safe_text(name)}", (*declared.changes, *cell.changes))
        done = self._do(edit)
        if is_new_row:
            self._select_file_rows(self.table.n_rows - 1, 1)
        return done

    def copy(self) -> str:
        """The selected cells as tab-separated text, without hidden columns."""
        block = self.block
        rows, columns = self.view.rows[block.top : block.bottom], [self.table.columns[at] for at in self.columns_of(block)]
        texts = [[c.texts[code] for code in c.codes[rows].tolist()] for c in columns]
        return format_tsv(with_progress(zip(*texts, strict=True), len(rows)))

    def cut(self) -> tuple[str, Done]:
        """The selected cells as text; they are empty then."""
        text = self.copy()
        return text, self._set_each("", "Cut")

    def paste(self, text: str) -> Done:
        """Put tab-separated text over the selection; see `tui.model.clipboard.place_paste`. Rows past the last are added; hidden
        columns are passed over."""
        texts, block = parse_tsv(text), self.block
        if not texts:
            return Done(notes=("The clipboard is empty.",))
        columns = self.columns_of(Block(0, block.left, 0, self.shape[1]))
        selected = Block(block.top, 0, block.bottom, len(self.columns_of(block)))
        placed = place_paste(texts, selected, len(columns))
        n_new = max(placed.block.bottom - len(self.view), 0)
        table, n_before = self.table, self.table.n_rows
        rows = [*self.view.rows.tolist(), *range(n_before, n_before + n_new)]
        names = [table.columns[at].name for at in columns]
        cells = with_progress(placed.cells(), placed.block.n_cells)
        edit = edits.set_cells(table, ((rows[r], names[c], t) for r, c, t in cells), placed.name, n_new)
        left, right = columns[placed.block.left], columns[placed.block.right - 1]
        hidden = self.hidden_in(Block(placed.block.top, left, placed.block.bottom, right + 1))
        done = self._do(edit)
        self._select(self.selection.at(placed.block.top, left, self.shape))
        self._select(self.selection.at(placed.block.bottom - 1, right, self.shape, extend=True))
        cut = f"{plural(placed.n_columns_cut, 'column')} left out: the sheet ends here. Add columns and paste again."
        is_same = not done.name and not done.warnings
        notes = (f"{plural(n_new, 'row')} added.",) if n_new else ("What is pasted is there already.",) if is_same else ()
        return replace(done, notes=notes + _unchanged(hidden), warnings=((cut,) if placed.n_columns_cut else ()) + done.warnings)

    def type_below(self, text: str) -> Fault | None:
        """Put a text into a new row behind the last one, in the column of the cursor; what is wrong with it as in `type_text`."""
        if fault := self.check(text):
            return fault
        self.append_rows([{self.table.columns[self.selection.column].name: text}])
        return None

    def paste_below(self, text: str) -> Done:
        """Put tab-separated text into new rows behind the last one, from the column of the cursor on."""
        return self._paste_rows(text, self.append_rows)

    def insert_copied(self, text: str) -> Done:
        """Put tab-separated text into new rows above the selection, from the column of the cursor on."""
        return self._paste_rows(text, lambda rows: self.insert_rows(texts=rows))

    def fill_to(self, row: int, column: int) -> Done:
        """Fill from the selection down to a row, or right to a column, as the handle at its corner does: a series where the cells
        name assets or data, or two of them tell a step; else copies."""
        block = self.block
        if row >= block.bottom:
            self._select(self.selection.at(block.top, block.left, self.shape))
            self._select(self.selection.at(row, block.right - 1, self.shape, extend=True))
            cells: list[tuple[int, int, str]] = []
            for at in self.columns_of(block):
                texts = [self.text(r, at) for r in range(block.top, block.bottom)]
                is_step = len(texts) > 1 and tells_step(texts[-2], texts[-1])
                begun = texts[-2:] if is_step else texts[-1:]
                n_more = row + 1 - block.bottom
                is_series = is_step or (len(texts) == 1 and self.condition(at) is None)
                more = continued(begun, n_more) if is_series else [texts[i % len(texts)] for i in range(n_more)]
                cells += [(block.bottom + i, at, text) for i, text in enumerate(more)]
            return self._set_in(self.block, cells, f"Fill {len(cells)} down")
        if column >= block.right:
            self._select(self.selection.at(block.top, block.left, self.shape))
            self._select(self.selection.at(block.bottom - 1, column, self.shape, extend=True))
            sources, columns = self.columns_of(block), self.columns_of(Block(0, block.right, 0, column + 1))
            pairs = [(c, sources[at % len(sources)]) for at, c in enumerate(columns)]
            filled = [(r, c, self.text(r, source)) for r in range(block.top, block.bottom) for c, source in pairs]
            return self._set_in(self.block, filled, f"Fill {len(filled)} right")
        return Done()

    def move_rows_to(self, row: int) -> Done:
        """Move the selected rows to where a row of the view is; not in a sorted view, as `move_rows`."""
        self._require_unsorted()
        block, rows = self.block, self.selected_rows
        if block.top <= row < block.bottom:
            return Done()
        to = int(self.view.rows[row]) + (row >= block.bottom)
        return self._do(edits.move_rows(self.table, rows, to))

    def move_columns_to(self, column: int) -> Done:
        """Move the selected columns to where a column is."""
        block = self.block
        if block.left <= column < block.right:
            return Done()
        names = [c.name for c in self.table.columns[block.left : block.right]]  # hidden ones go with those next to them
        return self._do(edits.move_columns(self.table, names, column + (column >= block.right)))

    # ---- edits of rows

    def append_rows(self, texts: Sequence[Mapping[str, str]]) -> Done:
        """Insert rows behind the last one of the file; they are then selected, in the column of the cursor."""
        at = self.table.n_rows
        done = self._do(edits.insert_rows(self.table, at, list(texts)))
        self._select_file_rows(at, len(texts))
        return done

    def insert_rows(self, n_rows: int = 1, below: bool = False, texts: Sequence[Mapping[str, str]] = ()) -> Done:
        """Insert rows above the selection, or below it, empty ones or with texts; they are then selected."""
        chosen = self.selected_rows if self.query.whole is None else []  # new rows of a variant are behind those of its base
        at = (max(chosen) + 1 if below else min(chosen)) if chosen else self.table.n_rows
        rows = list(texts) or [{}] * n_rows
        done = self._do(edits.insert_rows(self.table, at, rows))
        self._select_file_rows(at, len(rows))
        return done

    def delete_rows(self) -> Done:
        row = self.block.top
        done = self._do(deletion(self))
        self._select(self.selection.at(row, self.selection.column, self.shape))
        return done

    def remove_duplicates(self) -> Done:
        """Delete each row that is in all columns as one above it."""
        codes = np.column_stack([self.table.enabled, *(column.codes for column in self.table.columns)])
        first = np.unique(codes, axis=0, return_index=True)[1]
        gone = np.setdiff1d(np.arange(self.table.n_rows), first).tolist()
        if not gone:
            return Done(notes=("No row is in all columns like another.",))
        return self._do(edits.delete_rows(self.table, gone))

    def duplicate_rows(self) -> Done:
        """Copy the selected rows to below them; the copies are then selected."""
        rows = self.selected_rows
        if (whole := self.query.whole) is not None:
            return self.append_rows([whole[row] for row in rows])
        done = self._do(edits.duplicate_rows(self.table, rows))
        self._select_file_rows(max(rows) + 1, len(rows))
        return done

    def move_rows(self, down: int) -> Done:
        """Move the selected rows past the next visible row: down 1 or up -1. Not in a sorted view: its order is not the file's."""
        self._require_unsorted()
        block, rows = self.block, self.selected_rows
        beside = block.top - 1 if down < 0 else block.bottom
        if not 0 <= beside < len(self.view):
            return Done()
        return self._do(edits.move_rows(self.table, rows, int(self.view.rows[beside]) + (down > 0)))

    def enable_rows(self, is_enabled: bool | None = None) -> Done:
        """Enable or disable the selected rows; None: the other of what the first is."""
        rows = self.selected_rows
        if is_enabled is None:
            is_enabled = bool(rows) and not self.table.enabled[rows[0]]
        return self._do(edits.enable_rows(self.table, rows, is_enabled))

    def sort_file(self, sort: Sort) -> Done:
        """Put the rows of the file itself in order."""
        require_own_order(self)
        way = ", descending" if sort.is_descending else ""
        name = f"Sort the file by {safe_text(sort.column)}{way}"
        return self._do(edits.reorder_rows(self.table, sorted_rows(self.table, sort), name))

    # ---- edits of columns

    def delete_columns(self) -> Done:
        """Delete the selected columns, without hidden ones."""
        return self._do(edits.delete_columns(self.table, self.selected_columns))

    def move_column(self, right: int) -> Done:
        """Move the cursor's column one place: right 1 or left -1."""
        at = self.selection.column
        if not 0 <= at + right < self.shape[1]:
            return Done()
        return self._do(edits.move_column(self.table, self.table.columns[at].name, at + right + (right > 0)))

    def rename_column(self, name: str) -> Done:
        """Give the cursor's column another name, as a step of this table alone; where others speak of the condition see
        `Workspace.rename`."""
        return self._rename(self.table.columns[self.selection.column].name, name)

    def _rename(self, column: str, name: str) -> Done:
        keeps = self.table.path is not None and bool(uses_of(self.table, column).text)
        return self._do(edits.rename_column(self.table, column, name, keep_declared=keeps))

    # ---- find and replace

    def find(self, search: Search, is_backwards: bool = False) -> int:
        """Go to the next matching cell; gives how many there are."""
        hits = find(self.table, search, self.view.rows, [c.name for c in self.table.columns])
        if (place := next_hit(hits, self.cursor, is_backwards)) is not None:
            self.visible_columns = self.visible_columns.revealed(self.table.columns[place[1]].name)
            self.go(*place)
        return int(hits.sum())

    def count(self, search: Search) -> int:
        """How many displayed cells match. Raises PatternError where the pattern cannot be read."""
        return int(find(self.table, search, self.view.rows, [c.name for c in self.table.columns]).sum())

    def replace_here(self, search: Search, replacement: str) -> Done:
        """Replace in the cursor's cell, and go to the next match."""
        rows = self.view.rows[self.selection.row : self.selection.row + 1]
        done = self._replace(search, replacement, rows, [self.table.columns[self.selection.column].name])
        self.find(search)
        return done

    def replace_all(self, search: Search, replacement: str, in_selection: bool = False) -> Done:
        """Replace in every visible cell, or every selected one, as one step."""
        block = self.block if in_selection else Block(0, 0, *self.shape)
        names, hidden = [self.table.columns[at].name for at in self.columns_of(block)], self.hidden_in(block)
        done = self._replace(search, replacement, self.view.rows[block.top : block.bottom], names)
        return replace(done, notes=done.notes + _unchanged(hidden))

    def _replace(self, search: Search, replacement: str, rows: Rows, columns: Sequence[str]) -> Done:
        edit = replace_all(self.table, search, replacement, rows, columns)
        if not edit.changes:
            return Done(notes=(f"{in_quotes(search.text)} is not found.",))
        return self._do(edit)

    # ---- a column as a whole

    def mend_all(self, texts: Iterable[str] | None = None) -> Done:
        """Mend every cell of the cursor's column that cannot be read and has a near text that can, or only those of some texts."""
        column = self.selection.column
        mends = mends_of(self, column, texts)
        if not mends:
            return Done(notes=("No cell of this column has a text that cannot be read and is near to one that can.",))
        return self._do(replaced(self.table, self.table.columns[column].name, mends, "Mend"))

    def replace_value(self, old: Iterable[str], new: str) -> Done:
        """Put a text in place of others in every cell of the cursor's column."""
        name = self.table.columns[self.selection.column].name
        if fault := self.check(new):
            raise TableError(fault)
        return self._do(replaced(self.table, name, dict.fromkeys(old, new), f"Replace by {safe_text(new)}"))

    def rename_value(self, old: str, new: str, keeps_old: bool = False) -> Done:
        """Rename a value of the cursor's column in all its cells, and where it is declared, as one step of this table; where others
        speak of the value see `Workspace.rename_value`."""
        return self._do(renamed_value(self, self.selection.column, old, new, keeps_old))

    # ---- history

    def undo(self) -> Done:
        return self._went(self.history.undo, "Undo")

    def redo(self) -> Done:
        """Make the step again that was taken back last."""
        return self._went(self.history.redo, "Redo")

    def go_to_step(self, position: int) -> Done:
        """Go to the state after so many steps."""
        verb = "Undo" if position < self.history.position else "Redo"
        return self._went(lambda: self.history.go(position), verb) if position != self.history.position else Done()

    def apply(self, edit: Edit) -> Done:
        """Make any other edit: a gap filled, a merge."""
        return self._do(edit)

    # ---- parts

    def _require_unsorted(self) -> None:
        require_own_order(self)
        if self.view.is_sorted:
            raise TableError(
                Fault("the rows are shown sorted.", "the order of the file", "to show them as in the file: Alt+S, again")
            )

    def _went(self, step_of: Callable[[], Step | None], verb: str) -> Done:
        before = self.table
        step = step_of()
        if step is None:
            return Done(notes=(f"There is nothing to {verb.lower()}.",))
        if self.recorder is not None:
            self.recorder.went(before, self.history, step)
        self._follow(before, step)
        return Done(f"{verb}: {step.name}")

    def _do(self, edit: Edit) -> Done:
        return in_turn(lambda: self._made(edit))

    def _made(self, edit: Edit) -> Done:
        if self.reads_only:
            return Done(warnings=(READS_ONLY,))
        before, position = self.table, self.history.position
        step = self.history.do(edit)
        if self.history.position == position:
            return Done()
        if self.recorder is not None:
            self.recorder.did(edit)
        self._follow(before, step)
        return Done(edit.name, warnings=self._unreadable(edit.changes))

    def _paste_rows(self, text: str, add: Callable[[list[dict[str, str]]], Done]) -> Done:
        texts, columns = parse_tsv(text), self.columns_of(Block(0, self.selection.column, 0, self.shape[1]))
        if not texts:
            return Done(notes=("The clipboard is empty.",))
        names = [self.table.columns[at].name for at in columns]
        done = add([dict(zip(names, row, strict=False)) for row in texts])
        n_cut = max(max(map(len, texts)) - len(names), 0)
        cut = f"{plural(n_cut, 'column')} left out: the sheet ends here. Add columns and paste again."
        return replace(done, warnings=((cut,) if n_cut else ()) + done.warnings)

    def _set_each(self, text: str, verb: str) -> Done:
        return self._set_in(self.block, ((r, c, text) for r, c in self._cells(self.block)), f"{verb} {self._size(self.block)}")

    def _set_in(self, block: Block, cells: Iterable[tuple[int, int, str]], name: str) -> Done:
        """Set cells of a block, and say what is hidden in it and stays."""
        hidden = self.hidden_in(block)
        done = self._set(cells, name)
        return replace(done, notes=done.notes + _unchanged(hidden))

    def _set(self, cells: Iterable[tuple[int, int, str]], name: str = "") -> Done:
        rows, names = self.view.rows, [c.name for c in self.table.columns]
        cells = with_progress(cells, len(cells) if isinstance(cells, list) else self.block.n_cells)
        return self._do(edits.set_cells(self.table, ((int(rows[r]), names[c], text) for r, c, text in cells), name))

    def _cells(self, block: Block) -> Iterable[tuple[int, int]]:
        columns = self.columns_of(block)
        return ((r, c) for r in range(block.top, block.bottom) for c in columns)

    def _size(self, block: Block) -> str:
        return f"{block.shape[0]} × {len(self.columns_of(block))}"

    def _unreadable(self, changes: Iterable[Change]) -> tuple[str, ...]:
        """How many of the cells just set cannot be read."""
        columns = {c.condition.name: c for c in self.table.conditions}
        n_wrong = 0
        for change in changes:
            for name, texts in change.texts.items() if isinstance(change, Cells) else ():
                if name in columns and columns[name].faults:
                    codes = columns[name].texts.codes[list(texts)]
                    n_wrong += int(np.isin(codes, list(columns[name].faults)).sum())
        return (f"{plural(n_wrong, 'cell')} cannot be read.",) if n_wrong else ()

    def _select_file_rows(self, at: int, n_rows: int) -> None:
        top, bottom = self.view.place(at), self.view.place(at + n_rows - 1)
        column = self.selection.column
        self._select(self.selection.at(top or 0, column, self.shape))
        self._select(self.selection.at(bottom or 0, column, self.shape, extend=True))


def _unchanged(hidden: str) -> tuple[str, ...]:
    return (f"Unchanged: {hidden}.",) if hidden else ()
