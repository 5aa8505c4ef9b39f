"""The grid: a sheet in a terminal, with the keys and the mouse of a spreadsheet.

It shows a `Sheet` and calls its verbs; what a key does is said in `tui.commands`. Cells are not edited here: `EditWanted` asks the
screen to open an editor over a cell.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import ClassVar, Self

from textual import events
from textual.binding import Binding, BindingType
from textual.geometry import Region
from textual.message import Message

from contextdb.errors import TableError

from ..commands import BY_ID, GRID, JUMPS, bindings
from ..doing import CELL, SLOW, do
from ..messages import Edited, Notice
from ..model.clipboard import PasteDoubt, Texts, asks_how_to_read, parse_tsv, paste_doubt
from ..model.selection import Block, Selection
from ..model.sheet import Done, Sheet
from ..model.tab_run import TabRun
from ..model.views import Sort
from .grid_view import GridView
from .pointer import Pointer


class Grid(GridView, can_focus=True):
    """A spreadsheet."""

    BINDINGS: ClassVar[list[BindingType]] = [
        *bindings(GRID),
        Binding("tab", "tab(1)", show=False),
        Binding("shift+tab", "tab(-1)", show=False),
    ]

    asks_of_pastes: ClassVar[bool] = True
    """Whether who shows it asks about what is pasted, where that could mean something else."""

    @dataclass
    class EditWanted(Message):
        """Open an editor over the cell of the cursor."""

        text: str
        """What is in it at first."""
        is_typing: bool = False
        """It was begun by typing: the text is what was typed."""
        opens_list: bool = False

    @dataclass
    class Moved(Message):
        """The cursor or the selection is elsewhere."""

    @dataclass
    class FactChanged(Message):
        """A fact of the test row was changed."""

    @dataclass
    class OpenWanted(Message):
        """Go into the table that a row refers to."""

        row: int
        """The row of the file, from 0."""

    @dataclass
    class RenameUndoWanted(Message):
        """There is no step of the table: take back a rename that was written to files, or make it again."""

        is_redo: bool

    @dataclass
    class CopyWanted(Message):
        """Put a text on the clipboard."""

        text: str
        is_told: bool = True
        """Nothing else says what was done."""

    @dataclass
    class MenuWanted(Message):
        """Show what can be done with what is under the mouse."""

        of_column: bool

    @dataclass
    class ImportWanted(Message):
        """Ask how to read a text that was pasted into an empty table."""

        text: str

    @dataclass
    class PasteDoubted(Message):
        """Ask what is meant by a text before it is pasted."""

        doubt: PasteDoubt
        paste: Callable[[str, bool], None]
        """Pastes a text; True: nothing is asked any more."""

    @dataclass
    class PasteWanted(Message):
        """Paste what the clipboard holds."""

    def __init__(self, sheet: Sheet) -> None:
        super().__init__(sheet)
        self.test_name = ""
        """Where the context of the test row comes from."""
        self.run = TabRun()
        self.again: Callable[[], None] | None = None
        """Makes the last edit again, with what is selected then."""
        self._copied: Texts = []
        """The cells that were copied here last."""
        self._pointer = Pointer(self)

    def post_message(self, message: Message) -> bool:
        """Post a message as the grid's own, also when the pane has it do so: Textual ends a message at the parent that made it."""
        return super().post_message(message.set_sender(self) if isinstance(message, TOLD) else message)

    def focus(self, scroll_visible: bool = True) -> Self:
        """Take the keys at once: later, as Textual does, they could be taken from a cell that is opened meanwhile."""
        self.screen.set_focus(self, scroll_visible)
        return self

    # ---- moving

    def moving(self, move: Callable[[], None], in_new_row: bool = False) -> None:
        """Make a move and paint the lines that it touches; one within the empty row stays there, every other leaves it."""
        self.goes_to_new_row = in_new_row
        before = self.sheet.block
        move()
        self.show_cursor()
        after, look = self.sheet.block, self.look
        if (before.left, before.right) != (after.left, after.right):
            self.refresh(Region(0, 0, look.layout.width, look.n_headers))
        top, bottom = min(before.top, after.top), max(before.bottom, after.bottom)
        self.refresh(Region(0, look.n_headers + top - look.top, look.layout.width, bottom - top + 1))
        self.post_message(self.Moved())

    def _select(self, change: Callable[[Selection], Selection]) -> None:
        self.moving(lambda: self.sheet.select(lambda selection, _: change(selection)))

    def action_move(self, down: int, right: int, extend: bool) -> None:
        if self.is_in_test_row and down:
            if down > 0:
                self._go_into_rows()
            return
        if down < 0 and not extend and self.has_test_row and not self.is_in_new_row and self.sheet.selection.row == 0:
            self.is_in_test_row = True
            return
        is_last = self.sheet.selection.row >= len(self.sheet.view) - 1
        if down > 0 and is_last and not extend and self._go_below():
            return
        if self.is_in_new_row:
            self.moving(lambda: self.sheet.move(0, right), in_new_row=not down)
            return
        if self.is_in_test_row and self._move_fields(right):
            return
        self.moving(lambda: self.sheet.move(down, right, extend and not self.is_in_test_row))

    def action_tab(self, by: int) -> None:
        """Tab, and Shift+Tab: through the selected cells where there are several, else on by one."""
        if self.sheet.block.n_cells > 1 and not self.is_in_test_row:
            self.moving(lambda: self.sheet.move_on(0, by))
            return
        self.run.tab(*self.sheet.cursor, by)
        self.action_move(0, by, False)

    def _go_below(self) -> bool:
        """From the last row to the empty one; gives whether there is one to go to."""
        if self.has_new_row and not self.is_in_new_row:
            self.moving(lambda: self.sheet.move(0, 0), in_new_row=True)
        return self.has_new_row

    def _go_into_rows(self) -> None:
        """From the test row to the first row that is seen below it."""
        column, top = min(self.field, self.sheet.shape[1] - 1), self.look.top
        self.is_in_test_row = False
        if len(self.sheet.view):
            self.moving(lambda: self.sheet.go(top, column))

    def _move_fields(self, right: int) -> bool:
        """Move the cursor of the test row among the facts behind the last column, or onto the first of them; gives whether it
        did."""
        n_columns = self.sheet.shape[1]
        to = self.field + right
        if to < n_columns and self.field < n_columns:
            return False
        self.moving(lambda: self.go_to_field(max(min(to, n_columns + len(self.sheet.extra) - 1), 0)))
        self.refresh()
        return True

    def action_edge(self, down: int, right: int, extend: bool) -> None:
        if not self.is_in_test_row and len(self.sheet.view) and not (self.is_in_new_row and right):
            self.moving(lambda: self.sheet.move_to_edge(down, right, extend))
        elif right:
            self.action_jump("home" if right < 0 else "end", False)

    def action_jump(self, jump: str, extend: bool) -> None:
        """Home, End, with Ctrl too. Home and End stay in the empty row."""
        if self.is_in_test_row:
            self.go_to_field(self.sheet.shape[1] + len(self.sheet.extra) - 1 if jump in ("end", "last") else 0)
        stays = self.is_in_new_row and jump in ("home", "end")
        is_extended = extend and not stays
        self.moving(lambda: self.sheet.select(lambda s, shape: JUMPS[jump](s, shape, is_extended)), in_new_row=stays)
        if jump in ("home", "first"):  # the frozen columns are seen wherever one is: the others come back too
            self.scroll_to(0, self.look.top, animate=False, force=True, immediate=True)

    def action_page(self, pages: int, extend: bool) -> None:
        """Page Up and Page Down: what is seen moves on by a page, and the cursor with it."""
        if self.is_in_test_row:
            return
        look = self.look
        by = pages * max(look.n_body - 1, 1)

        def move() -> None:
            self.scroll_to(look.left, max(0, min(look.top + by, self.max_scroll_y)), animate=False, force=True, immediate=True)
            self.sheet.move(by, 0, extend)

        self.moving(move)

    def action_next_failing(self, is_backwards: bool) -> None:
        """To the next cell that fails for the test row, or cannot be read where that is empty."""
        self.is_in_test_row = False
        place = self.sheet.next_failing(is_backwards)
        if place is None:
            what = "No cell that is shown cannot be read" if self.sheet.query.is_empty else "No cell that is shown fails"
            self.post_message(Notice(f"{what}."))
        else:
            self.moving(lambda: self.sheet.go(*place))

    def action_select_rows(self) -> None:
        self._select(lambda s: s.rows(self.sheet.shape))

    def action_select_columns(self) -> None:
        self._select(lambda s: s.columns(self.sheet.shape))

    def action_select_all(self) -> None:
        self._select(Selection.everything)

    def action_test_row(self) -> None:
        """To the test row and back."""
        self.is_in_test_row = self.has_test_row and not self.is_in_test_row

    def action_leave(self) -> None:
        """Out of the test row, or back to one cell."""
        if self.is_in_test_row:
            self.is_in_test_row = False
        else:
            self.moving(lambda: self.sheet.go(*self.sheet.cursor))

    def watch_goes_to_new_row(self) -> None:
        if self.is_mounted:
            self.refresh()

    def watch_is_in_test_row(self) -> None:
        if self.is_mounted:
            self.goes_to_new_row = False
            if not self.is_in_test_row:
                self._extra = None
            elif not self._is_condition():
                self._first_condition()
            self.show_cursor()
            self.refresh()
            self.post_message(self.Moved())

    def _is_condition(self) -> bool:
        return self.sheet.fact_of(self.field) is not None

    def _first_condition(self) -> None:
        """To the first fact that a person may type."""
        fields = range(self.sheet.shape[1] + len(self.sheet.extra))
        facts = {at: fact.name for at in fields if (fact := self.sheet.fact_of(at)) is not None}
        if facts:
            typed = [at for at, name in facts.items() if not self.sheet.query.is_computed(name)]
            self.go_to_field(next(iter([*typed, *facts])))

    # ---- editing

    def action_verb(self, name: str) -> None:
        """Call the verb of a command; what cannot be done is said."""
        verb = BY_ID[name].verb
        assert verb is not None
        self.again = partial(self.action_verb, name)
        if self.is_in_test_row and BY_ID[name].group in ("Edit", "Rows"):
            self.post_message(Notice("The cursor is in the test row. F6 goes back to the table.", "warning"))
        elif self.is_in_new_row and BY_ID[name].group in ("Edit", "Rows"):
            self._say_new_row()
        else:
            n_cells = self.sheet.block.n_cells if BY_ID[name].group in ("Edit", "Rows") else 0
            self._do(lambda: verb(self.sheet), self.sheet.n_unread * SLOW if name == "mend-all" else n_cells)

    def _say_new_row(self) -> None:
        self.post_message(
            Notice("The cursor is below the last row. Type or paste there to make a new row; Up goes back.", "warning")
        )

    def _do(self, verb: Callable[[], Done], n_cells: int = 0, then: Callable[[], None] = lambda: None) -> None:
        do(self, self.sheet, verb, n_cells, then)

    def action_repeat(self) -> None:
        """Make the last edit again, with what is selected now."""
        if self.again is None:
            self.post_message(Notice("There is no edit to repeat yet.", "warning"))
        else:
            self.again()

    def fill(self, text: str) -> None:
        """Put a text that was typed before into every selected cell, as it would be typed there."""
        if self.is_in_test_row:
            self.set_fact(text)
            return
        sheet, is_below = self.sheet, self.is_in_new_row

        def fill() -> Done:
            columns = [sheet.cursor[1]] if is_below else sheet.columns_of(sheet.block)
            fault = next(filter(None, (sheet.check_at(column, text) for column in columns)), None)
            fault = fault or (sheet.type_below(text) if is_below else None)
            if fault is not None:
                raise TableError(fault)
            return Done(sheet.history.undo_name or "") if is_below else sheet.fill(text)

        self._do(fill, sheet.block.n_cells)

    def action_insert_rows(self, below: bool) -> None:
        """As many rows as are selected."""
        self.again = partial(self.action_insert_rows, below)
        n_rows = max(self.sheet.block.shape[0], 1) if len(self.sheet.view) and not self.is_in_new_row else 1
        self.is_in_test_row = self.goes_to_new_row = False  # what is typed next is meant for the new row
        self._do(lambda: self.sheet.insert_rows(n_rows, below))

    def action_undo(self, is_redo: bool) -> None:
        """Undo, or redo: in the test row a fact, else a step of the table."""
        if not self.is_in_test_row:
            history = self.sheet.history
            if (history.redo_name if is_redo else history.undo_name) is None:
                self.post_message(self.RenameUndoWanted(is_redo))
            else:
                self._do(self.sheet.redo if is_redo else self.sheet.undo)
            return
        verb = "redo" if is_redo else "undo"
        name = self.sheet.undo_fact(is_redo)
        if name is not None:
            self.post_message(self.FactChanged())
        text = f"{verb.capitalize()}: {name}." if name else f"There is no fact to {verb}. F6 goes back to the table, and its steps."
        self.post_message(Notice(text))

    def action_edit(self) -> None:
        self._want_edit(self.cell_text())

    def action_edit_empty(self) -> None:
        """Begin the one cell again, empty. Old terminals send Ctrl+H as Backspace: it must not clear what is selected."""
        self._want_edit("", is_typing=True)

    def action_choose(self) -> None:
        self._want_edit(self.cell_text(), opens_list=True)

    def cell_text(self) -> str:
        """The text under the cursor: of a cell, or of a fact of the test row."""
        row, column = self.sheet.cursor
        if self.is_in_test_row:
            fact = self.sheet.fact_of(self.field)
            return "" if fact is None else self.sheet.query.text(fact.name)
        if self.is_in_new_row:
            return ""
        return (self.sheet.text(row, column) or self.sheet.inherited(row, column)) if len(self.sheet.view) else ""

    def _want_edit(self, text: str, is_typing: bool = False, opens_list: bool = False) -> None:
        if self.is_in_test_row and not self._is_condition():
            more = " Facts without a column are at the right: End goes there." if self.sheet.extra else ""
            self.post_message(Notice(f"Only conditions have a fact to test with.{more}", "warning"))
        elif self.is_in_test_row and (why := self._why_computed()):
            self.post_message(Notice(why, "warning"))
        elif not self.is_in_test_row and not len(self.sheet.view) and not self.has_new_row:
            self.post_message(Notice("There is no row here. Ctrl+N makes one.", "warning"))
        else:
            self.show_cursor()
            self.post_message(self.EditWanted(text, is_typing, opens_list))

    def action_open_row(self) -> None:
        """Go into the table that the row of the cursor refers to."""
        if len(self.sheet.view):
            self.post_message(self.OpenWanted(self.sheet.row_number(self.sheet.cursor[0]) - 1))

    def action_clear(self) -> None:
        self.again = self.action_clear
        if self.is_in_test_row:
            self.set_fact("")
        elif self.is_in_new_row:
            self._say_new_row()
        else:
            self._do(self.sheet.clear, self.sheet.block.n_cells)

    def set_fact(self, text: str) -> None:
        """Write the fact under the cursor; one that is computed says why it cannot be written."""
        fact = self.sheet.fact_of(self.field)
        if why := self._why_computed():
            self.post_message(Notice(why, "warning"))
        elif fact is not None:
            self.sheet.set_fact(fact.name, text)
            self.post_message(self.FactChanged())

    def _why_computed(self) -> str:
        fact = self.sheet.fact_of(self.field)
        return "" if fact is None else self.sheet.query.wanted.why_computed(fact.name)

    def action_copy(self) -> None:
        if self.is_in_new_row:
            self._say_new_row()
            return
        if self.is_in_test_row:
            self.post_message(self.CopyWanted(self.cell_text()))
            return
        sheet, copied = self.sheet, list[str]()

        def copy() -> Done:
            copied.append(sheet.copy())
            return Done()

        def hand_over() -> None:
            for text in copied:  # none where it was stopped
                self._copied = parse_tsv(text)
                self.post_message(self.CopyWanted(text))

        self._do(copy, sheet.block.n_cells, hand_over)

    def action_cut(self) -> None:
        self.again = self.action_cut
        if self.is_in_test_row:
            self.action_copy()
            self.set_fact("")
            return
        if self.is_in_new_row:
            self._say_new_row()
            return

        def cut() -> Done:
            text, done = self.sheet.cut()
            self._copied = parse_tsv(text)
            self.post_message(self.CopyWanted(text, is_told=False))
            return done

        self._do(cut, self.sheet.block.n_cells)

    def action_paste(self) -> None:
        self.post_message(self.PasteWanted())

    def paste(self, text: str, is_clear: bool = False) -> None:
        """Put a text of the clipboard over the selection, or into the fact of the test row. `is_clear`: nothing is asked."""
        self.again = partial(self.paste, text, is_clear)
        if is_fact := self.is_in_test_row:
            text = text.splitlines()[0].split("\t")[0] if text.strip() else ""
        if not is_fact and asks_how_to_read(text, self.sheet.table):
            self.post_message(self.ImportWanted(text))
        elif not is_clear and self._asks(text, self.paste):
            pass
        elif is_fact:
            self.set_fact(text.strip("\n"))
        else:
            is_below, sheet = self.is_in_new_row, self.sheet
            self.goes_to_new_row = False
            verb = sheet.paste_below if is_below else sheet.paste
            self._do(lambda: verb(text), max(len(text) // CELL, sheet.block.n_cells), self.forget_widths)

    def insert_copied(self, text: str, is_clear: bool = False) -> None:
        """Put a text of the clipboard into new rows above the cursor's. `is_clear` as in `paste`."""
        self.again = partial(self.insert_copied, text, is_clear)
        if is_clear or not self._asks(text, self.insert_copied):
            self.is_in_test_row = self.goes_to_new_row = False
            self._do(lambda: self.sheet.insert_copied(text), len(text) // CELL, self.forget_widths)

    def _asks(self, text: str, paste: Callable[[str, bool], None]) -> bool:
        """Whether a text could mean something else, so that it is asked what to paste; never of one that was copied here."""
        if not self.asks_of_pastes or parse_tsv(text) == self._copied:
            return False
        sheet, is_fact = self.sheet, self.is_in_test_row and paste == self.paste
        left = sheet.cursor[1] if paste == self.insert_copied else sheet.block.left
        columns = [self.field] if is_fact else sheet.columns_of(Block(0, left, 0, sheet.shape[1]))
        doubt = paste_doubt(text, [sheet.fact_of(column) for column in columns])
        if doubt is not None:
            self.post_message(self.PasteDoubted(doubt, paste))
        return doubt is not None

    def on_paste(self, event: events.Paste) -> None:
        event.stop()
        self.paste(event.text)

    def on_key(self, event: events.Key) -> None:
        """A character begins a cell again."""
        if event.is_printable and event.character:
            event.stop()
            event.prevent_default()
            self._want_edit(event.character, is_typing=True)

    def action_sort(self) -> None:
        """By the cursor's column: ascending, descending, as in the file."""
        self.sort_by(self.sheet.selection.column)

    def sort_by(self, column: int) -> None:
        """The next of the three ways of sorting by a column."""
        name, sort = self.sheet.table.columns[column].name, self.sheet.sort
        if sort is None or sort.column != name:
            self.sheet.set_sort(Sort(name))
        else:
            self.sheet.set_sort(None if sort.is_descending else Sort(name, True))
        self.changed()
        self.post_message(self.Moved())

    # ---- mouse

    def on_mouse_down(self, event: events.MouseDown) -> None:
        if event.button == 1:
            event.stop()
            self._pointer.press(event)
        elif event.button == 3:
            event.stop()
            self.post_message(self.MenuWanted(self._pointer.point(event)))

    def on_mouse_move(self, event: events.MouseMove) -> None:
        self._pointer.move(event)

    def on_mouse_up(self, event: events.MouseUp) -> None:
        self._pointer.release(event)

    def put_down(self, what: str, row: int, column: int) -> None:
        """Move the selected rows or columns to a place, or fill up to it."""
        sheet = self.sheet
        verbs: dict[str, Callable[[], Done]] = {
            "move rows": lambda: sheet.move_rows_to(row),
            "move columns": lambda: sheet.move_columns_to(column),
            "fill": lambda: sheet.fill_to(row, column),
        }
        block = sheet.block
        n_filled = max((row + 1 - block.top) * block.shape[1], (column + 1 - block.left) * block.shape[0])
        self._do(verbs[what], n_filled if what == "fill" else 0)

    def on_click(self, event: events.Click) -> None:
        if event.chain == 2:
            self._pointer.click_twice(event)


TOLD = (Edited, Notice, Grid.Moved, Grid.FactChanged)
"""What the grid tells the screen."""
