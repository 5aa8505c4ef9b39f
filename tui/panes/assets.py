"""The tab of the assets: the line of the cell, the grid, find and filter. It opens the cell editors and answers the grid."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container, Vertical
from textual.geometry import Size

from contextdb.cells.words import MARK
from contextdb.columns import TextColumn
from contextdb.edits.notes import COLOURS, Notes
from contextdb.errors import ContextDBError, Fault, plural
from contextdb.tables.data import known_conditions

from ..clipboard import Clipboard
from ..messages import Edited, Notice, RenameWanted
from ..model.column_values import selection_summary
from ..model.find import PatternError, Search
from ..model.rule_builder import RuleBuilder
from ..model.selection import Block
from ..model.sheet import READS_ONLY, Done, Sheet
from ..model.table_answer import Offered, fact_fault
from ..screens.ask import AskDialog, ChooseDialog
from ..widgets.bar import Bar, CellLine, Item
from ..widgets.cell_editor import CellEditor
from ..widgets.find_bar import FilterBar, FindBar
from ..widgets.grid import Grid
from ..widgets.live_line import LiveLine, LiveState
from .sheet_view import SheetView
from .why import WhyPane

MOST_KNOWN = 10_000
"""So many of a column's texts are offered to complete from."""


@dataclass(frozen=True, slots=True)
class _Place:
    """The cell, or the fact, that an editor was opened for: the cursor stays there until the editor is closed."""

    column: int = 0
    is_fact: bool = False
    is_new: bool = False
    """It is in the empty row below the last one."""


class AssetsPane(SheetView):
    """A table as a spreadsheet, with the test row under its header."""

    DEFAULT_CSS = """
    AssetsPane {
        layout: vertical;
        & Grid { height: 1fr; } & #chips { display: none; } & #live { display: none; } & #over { height: 0; }
        & > #side { dock: right; width: auto; height: 1fr; }
    }
    """
    BLANK = True
    """Its parts cover all of it."""
    BINDINGS: ClassVar[list[BindingType]] = [Binding("f6", "back", "Back to the table", show=False)]

    def __init__(self, sheet: Sheet, clipboard: Clipboard) -> None:
        super().__init__(sheet, id="assets")
        self.clipboard = clipboard
        self._search = Search("")
        self._edited = _Place()

    def compose(self) -> ComposeResult:
        yield CellLine()
        with Vertical(id="side"):
            yield WhyPane()
        yield LiveLine()
        yield Bar(id="live")
        yield Bar(id="chips")
        yield Grid(self.sheet)
        yield FilterBar()
        yield FindBar()
        yield Container(id="over")  # of the editor: what it comes into is painted again, so that must not be the grid's

    def on_mount(self) -> None:
        self._show_cell()

    @property
    def why_pane(self) -> WhyPane:
        return self.query_one(WhyPane)

    @property
    def assets_here(self) -> Sequence[str]:
        """The asset of the row of the cursor; in the test row those that may be picked."""
        sheet, row = self.sheet, self.sheet.cursor[0]
        if self.grid.is_in_test_row:
            return () if sheet.query.is_empty else sheet.query.pickable
        is_a_row = len(sheet.view) and not self.grid.is_in_new_row
        return [sheet.text(row, sheet.asset_at) or sheet.inherited(row, sheet.asset_at)] if is_a_row else ()

    @property
    def editor(self) -> CellEditor | None:
        """The editor that is open over a cell."""
        return next((one for one in self.query(CellEditor) if one.is_open), None)

    def show(self) -> None:
        """Show the sheet as it is now."""
        chips = self.query_one("#chips", Bar)
        parts = self.sheet.filter.parts
        chips.display = bool(parts)
        chips.show([Item(f"unfilter({at})", f"{label} ✕") for at, (label, _) in enumerate(parts)])
        self.grid.changed()
        self._show_cell()

    def take_focus(self) -> None:
        """Give the keys to the grid, or to an editor that is open."""
        (self.editor or self.grid).focus()

    def go_to(self, row: int, column: str | None) -> None:
        self.grid.is_in_test_row = False
        self.sheet.go_to(row, column)
        self.show()
        self.grid.post_message(Grid.Moved())
        self.take_focus()

    def summary(self) -> str:
        """What the line at the foot says at its right: whose facts the test row has, filter, sort, selection."""
        sheet, block = self.sheet, self.sheet.block
        parts = [f"test row: {self.grid.test_name}"] if self.grid.test_name and not sheet.query.is_empty else []
        if len(sheet.view) < sheet.table.n_rows:
            parts.append(f"{len(sheet.view):,} of {plural(sheet.table.n_rows, 'row')} shown")
        if any(sheet.hidden):
            parts.append(f"{plural(sum(sheet.hidden), 'column')} hidden")
        if sheet.sort is not None:
            keys = (f"{key.column} {'▼' if key.is_descending else '▲'}" for key in sheet.sort.keys)
            parts.append(f"sorted by {', '.join(keys)}")
        if block.n_cells > 1:
            parts.append(f"{block.shape[0]:,} × {block.shape[1]:,} selected{selection_summary(sheet)}")
        return " · ".join(parts)

    def show_answer(self) -> None:
        """Say in the line over the grid what plays for the facts of the test row, and whether edits are unsaved."""
        query = self.sheet.query
        unsaved = " · unsaved" if self.sheet.is_modified else ""
        self.query_one(CellLine).answer("" if query.is_empty else f"{query.headline}{unsaved}", query.n_valid > 0)

    @on(Bar.Pressed)
    async def _chip_pressed(self, event: Bar.Pressed) -> None:
        event.stop()
        await self.run_action(event.command)

    # ---- the line of the cell

    @on(Grid.Moved)
    def _show_cell(self) -> None:
        self.why_pane.follow(self.sheet)
        self.follow_clip()
        self._show_place()

    def _show_place(self) -> None:
        sheet = self.sheet
        row, column = sheet.cursor
        column = self.grid.field
        header, condition = sheet.header(column), sheet.fact_of(column)
        name, about = header.name, condition.description if condition is not None else ""
        if self.grid.is_in_test_row:
            fault = sheet.query.faults.get(name)
            about = " · ".join(filter(None, (f"computed: {header.how}" if header.how else "", about)))
            self.query_one(CellLine).show(f"test row · {name}", self.grid.cell_text(), _short(fault), about)
        elif self.grid.is_in_new_row:
            self.query_one(CellLine).show(f"new row · {name}", "", "", about or "type or paste here to add rows")
        elif len(sheet.view):
            place = f"row {sheet.row_number(row)} · {name}"
            file_row = int(sheet.view.rows[row])
            message = " · ".join(filter(None, (sheet.marked(file_row, column), sheet.row_summary(file_row)))) or about
            inherited = sheet.inherited(row, column)
            message = f"from {sheet.table.settings.base}: typing overrides it" if inherited else message
            text = sheet.text(row, column) or inherited
            self.query_one(CellLine).show(place, text, _short(sheet.fault(row, column)), message)
        else:
            self.query_one(CellLine).show(name, "", "", about)

    # ---- the cell editor

    @on(Grid.EditWanted)
    def _open_editor(self, event: Grid.EditWanted) -> None:
        event.stop()
        if self.editor is not None:
            return
        if self.sheet.reads_only and not self.grid.is_in_test_row:
            self.post_message(Notice(READS_ONLY, "warning"))
            return
        column = self.grid.field
        self._edited = _Place(column, self.grid.is_in_test_row, self.grid.is_in_new_row)
        columns = self.sheet.table.columns
        over = self.query_one("#over")
        editor = next(iter(over.query(CellEditor)), None) or CellEditor()
        editor.place(self.grid.cell_region(), Size(self.screen.size.width, self.region.bottom))
        editor.open(
            self.sheet.fact_of(column),
            self.sheet.header(column).kind,
            event.text,
            check=self._check_fact if self._edited.is_fact else lambda text: self.sheet.check_at(column, text),
            on_done=self._edit_done,
            known=self._known(columns[column]) if column < len(columns) else [],
            is_fact=self._edited.is_fact,
            is_typing=event.is_typing,
            open_list=event.opens_list,
            rule=self._rule_builder(column),
        )
        if editor.parent is None:
            over.mount(editor)

    def _rule_builder(self, column: int) -> RuleBuilder | None:
        """What a rule may name, with the facts of the test row, where the cell is one."""
        if self._edited.is_fact or self.sheet.header(column).kind != "rule":
            return None
        return RuleBuilder(known_conditions(self.sheet.table), self.sheet.query.facts)

    def _known(self, texts: TextColumn) -> list[str]:
        """What a cell may be completed to: an asset first to the clips that no row names yet, an output to what it may say."""
        known = _by_frequency(texts)
        table = self.sheet.table
        if (output := table.settings.output(texts.name)) is not None:
            return list(dict.fromkeys([*output.choices, *known]))
        if texts.name != table.asset_column:
            return known
        known += [f"{MARK}{name}" for name in table.around or () if name != table.name and f"{MARK}{name}" not in known]
        if not table.schema.motion.get("databases"):
            return known
        from ..model.priorities import Priorities

        return [*Priorities(self.sheet).clips_without_row(), *known]

    def _check_fact(self, text: str) -> Fault | None:
        return fact_fault(text, self.sheet.fact_of(self._edited.column))

    def _edit_done(self, outcome: CellEditor.Outcome) -> None:
        if isinstance(outcome, CellEditor.Committed):
            self._commit(outcome)
            return
        self._close_editor()
        if isinstance(outcome, CellEditor.Declared):
            self._try(lambda: self.sheet.declare_value(outcome.text, self._edited.is_new))

    def _commit(self, outcome: CellEditor.Committed) -> None:
        """Take the text for the cell that was edited, and go on."""
        place = self._edited
        if place.is_fact:
            self.sheet.set_fact(self.sheet.header(place.column).name, outcome.text)
            self.grid.again = partial(self.grid.fill, outcome.text)
            self._close_editor()
            self.grid.post_message(Grid.FactChanged())
            if outcome.right:
                self.grid.action_move(0, outcome.right, False)
            return
        if not self._enter(outcome.text, outcome.is_fill):
            return
        if place.is_new:
            self.grid.goes_to_new_row = outcome.down > 0
        if not outcome.is_fill and not (place.is_new and not outcome.text.strip()):
            start, before = self._run_start(outcome), self.sheet.cursor[0]
            self.sheet.move_on(outcome.down, outcome.right)
            if start is not None:
                is_last = before == self.sheet.cursor[0] == len(self.sheet.view) - 1
                self.sheet.go(self.sheet.cursor[0], start)
                self.grid.goes_to_new_row = is_last or self.grid.goes_to_new_row
        self.grid.show_cursor()

    def _run_start(self, outcome: CellEditor.Committed) -> int | None:
        """The column that Enter goes back to after a run of Tabs in one row; None where there was no such run."""
        if self.sheet.block.n_cells > 1:
            return None
        if outcome.is_tab:
            self.grid.run.tab(*self.sheet.cursor)
            return None
        start = self.grid.run.enter(*self.sheet.cursor)
        return start if outcome.down == 1 else None

    def _enter(self, text: str, is_fill: bool) -> bool:
        """Put a text into the cell, or into all that are selected; one that is refused stays in the editor."""
        is_new = self._edited.is_new
        if is_new and not text.strip():
            self._close_editor()
            return True
        if is_fill and not is_new:
            done = self.sheet.fill(text)
        elif fault := self.sheet.type_below(text) if is_new else self.sheet.type_text(text):
            if self.editor is not None:
                self.editor.refuse(fault)
            return False
        else:
            done = Done(self.sheet.history.undo_name or "")
        self._close_editor()
        self.grid.again = partial(self.grid.fill, text)
        self.screen.post_message(Edited(done))
        return True

    def _close_editor(self) -> None:
        if self.editor is not None:
            self.editor.close()
        self.grid.focus()

    def on_resize(self) -> None:
        self.call_after_refresh(self._place_editor)

    def _place_editor(self) -> None:
        if self.editor is not None:
            self.editor.place(self.grid.cell_region(), Size(self.screen.size.width, self.region.bottom))

    # ---- the test row

    @on(Grid.FactChanged)
    def _fact_changed(self) -> None:
        self.grid.test_name = ""
        self.grid.refit()
        self.show()

    def action_clear_context(self) -> None:
        """Ask for nothing, of nobody."""
        self._ask_for("all facts", {}, {}, "")

    def set_context(self, facts: dict[str, str], name: str) -> None:
        """Make these the facts of the test row."""
        self._ask_for(f"the facts of {name}", facts, None, name)

    def _ask_for(self, step: str, facts: Mapping[str, str], actors: Offered | None, name: str) -> None:
        self.sheet.ask(step, facts, actors)
        self.refresh_valid()
        self.grid.test_name = name
        self.show()
        self.grid.post_message(Grid.Moved())

    # ---- a game that is followed

    def follow(self, facts: Mapping[str, str], actors: Offered, played: int | None, name: str) -> None:
        """Show what the table makes of a moment of a game, and which row the game picked."""
        sheet, is_other = self.sheet, bool(actors or self.sheet.query.actors or self.sheet.query.is_empty)
        sheet.played = played
        sheet.follow(facts, actors)
        self.grid.test_name = name
        if sheet.filter.is_valid and self.editor is None:  # the rows stay under a cell that is edited
            sheet.refresh()
        if is_other:
            self.grid.refit()
            self.grid.changed()
        else:
            self.grid.requested_again()
        self.why_pane.follow_soon(sheet)
        self._show_place()

    def show_live(self, state: LiveState | None, items: Sequence[Item] = ()) -> None:
        """Say how it stands with the game; None: none is followed."""
        line, tools = self.query_one(LiveLine), self.query_one("#live", Bar)
        if line.display != (state is not None):
            line.display = tools.display = state is not None
        if state is not None:
            line.show(state)
            tools.show(items)
        elif self.sheet.played is not None:
            self.sheet.played = None
            self.grid.changed()

    def refresh_valid(self) -> None:
        """Filter again where only valid rows are displayed, and make room for what is beside cells."""
        if self.sheet.filter.is_valid:
            self.sheet.refresh()
        self.grid.refit()

    # ---- clipboard

    @on(Grid.CopyWanted)
    def _copy(self, event: Grid.CopyWanted) -> None:
        event.stop()
        problem = self.clipboard.copy(event.text)
        if problem:
            self.post_message(Notice(problem, "warning"))
        elif event.is_told:
            sheet = self.sheet
            n_columns, hidden = len(sheet.columns_of(sheet.block)), sheet.hidden_in(sheet.block)
            self.post_message(Notice(f"Copied {sheet.block.shape[0]:,} × {n_columns:,}{f', without {hidden}' if hidden else ''}."))

    @on(Grid.PasteWanted)
    def _paste(self, event: Grid.PasteWanted) -> None:
        event.stop()
        self.grid.paste(self.clipboard.paste())

    @on(Grid.PasteDoubted)
    def _ask_of_paste(self, event: Grid.PasteDoubted) -> None:
        """Ask what is meant by commas, and paste that; nothing where it is not answered."""
        event.stop()
        doubt = event.doubt

        ChooseDialog(doubt.question, [label for label, _ in doubt.ways]).ask(
            self.app, lambda at: event.paste(doubt.ways[at][1], True)
        )

    async def action_insert_copied(self) -> None:
        """Put what was copied into new rows above the cursor's."""
        self.grid.insert_copied(self.clipboard.paste())

    # ---- find

    async def action_find(self) -> None:
        self.query_one(FilterBar).remove_class("-open")
        await self.query_one(FindBar).open()

    async def action_find_next(self, is_backwards: bool) -> None:
        """Go to the next hit."""
        if not self._search.text:
            await self.action_find()
        else:
            self._seek(FindBar.Sought(self._search, is_backwards))

    @on(FindBar.Sought)
    def _seek(self, event: FindBar.Sought) -> None:
        event.stop()
        self._search = event.search
        bar = self.query_one(FindBar)
        if not event.search.text:
            bar.say("")
            return
        try:
            if event.only_counts:
                n_found = self.sheet.count(event.search)
            else:
                n_found = self.sheet.find(event.search, event.is_backwards)
                self.grid.is_in_test_row = False
                self.show()
                self.grid.post_message(Grid.Moved())
        except PatternError as error:
            bar.say(error.faults[0].message)
            return
        bar.say(f"{n_found:,} found" if n_found else "not found")

    @on(FindBar.Replaced)
    def _replace(self, event: FindBar.Replaced) -> None:
        event.stop()
        sheet = self.sheet
        count = partial(self._seek, FindBar.Sought(event.search, only_counts=True))
        if event.is_all:
            n_cells = (sheet.block if event.in_selection else Block(0, 0, *sheet.shape)).n_cells
            self._try(lambda: sheet.replace_all(event.search, event.replacement, event.in_selection), n_cells, count)
        else:
            self._try(lambda: sheet.replace_here(event.search, event.replacement), then=count)

    # ---- filter, notes, colours

    async def action_filter(self) -> None:
        self.query_one(FindBar).remove_class("-open")
        await self.query_one(FilterBar).open()

    def action_note(self) -> None:
        """Ask for a note on the cell of the cursor."""
        sheet = self.sheet
        if not len(sheet.view):
            return
        row, column = sheet.cursor
        asset, name = sheet.text(row, sheet.asset_at), sheet.table.columns[column].name
        before = sheet.marks.texts.get((asset, name), "")

        def noted(text: str) -> None:
            if text.strip() != before:
                self.mark(lambda marks: marks.with_note(asset, name, text), "Note saved." if text.strip() else "Note removed.")

        question = f"A note on {name} of {asset}, for people; empty takes it away"
        AskDialog("Note", question, before, lambda _: "").ask(self.app, noted)

    def action_colour_rows(self) -> None:
        """Ask for a colour of the selected rows."""
        sheet = self.sheet
        assets = [sheet.table.columns[sheet.asset_at][row] for row in sheet.selected_rows]
        words = [*COLOURS, "none"]

        def chosen(at: int) -> None:
            colour = "" if words[at] == "none" else words[at]
            message = f"{plural(len(assets), 'row')} {f'marked {colour}' if colour else 'without a colour'}."
            self.mark(lambda marks: marks.with_colour(assets, colour), message)

        if assets:
            now = sheet.marks.colours.get(assets[0], "none")
            ChooseDialog("Colour of the rows", words, words.index(now)).ask(self.app, chosen)

    def mark(self, change: Callable[[Notes], Notes], message: str) -> None:
        """Change the notes as they are on the disk now, so that nobody else's are lost."""
        sheet = self.sheet
        if sheet.path is None:
            return
        try:
            marks = change(Notes.read(sheet.path))
            marks.write(sheet.path)
        except ContextDBError as error:
            self.post_message(Notice(str(error), "error"))
            return
        sheet.marks = marks
        self.show()
        if message:
            self.post_message(Notice(message))

    def action_go_to(self) -> None:
        """Ask for a row, by its number or its asset, or for a column."""
        question = "A row's number, or the beginning of the name of an asset or a column"
        dialog = AskDialog("Go to", question, "", self._check_place)
        dialog.ask(self.app, self._went)

    def _check_place(self, text: str) -> str:
        if text.strip().isdigit():
            n_rows = self.sheet.table.n_rows
            return "" if 1 <= int(text) <= n_rows else f"The table has {plural(n_rows, 'row')}."
        is_there = self._row_named(text) is not None or self._column_named(text) is not None
        return "" if is_there else "No asset and no column has such a name."

    def _column_named(self, text: str, is_whole: bool = False) -> str | None:
        """The column of a name, or else whose name begins so, or has it in it."""
        word, names = text.strip().casefold(), [c.name for c in self.sheet.table.columns]
        if is_whole or not word:
            return next((name for name in names if word and name.casefold() == word), None)
        begins = (name for name in names if name.casefold().startswith(word))
        return next(begins, next((name for name in names if word in name.casefold()), None))

    def _row_named(self, text: str) -> int | None:
        word = text.strip().casefold()
        names = [(name.casefold(), row) for row, name in enumerate(self.sheet.table.assets)]
        beginning = (row for name, row in names if word and name.startswith(word))
        return next(beginning, next((row for name, row in names if word and word in name), None))

    def _went(self, text: str) -> None:
        row = int(text) - 1 if text.strip().isdigit() else self._row_named(text)
        column = self._column_named(text, is_whole=True) or (self._column_named(text) if row is None else None)
        if column is not None:
            self.go_to_column(column)
        else:
            self.go_to(row or 0, None)

    def action_rename_column(self) -> None:
        """Ask for another name of the cursor's column."""
        name = self.sheet.table.columns[self.sheet.selection.column].name

        def renamed(text: str) -> None:
            if text != name:
                self.post_message(RenameWanted(name, text))

        AskDialog("Rename the column", f"Another name for {name}", name, self._check_name).ask(self.app, renamed)

    def _check_name(self, text: str) -> str:
        others = {c.name for c in self.sheet.table.columns} - {self.sheet.table.columns[self.sheet.selection.column].name}
        if not text.strip():
            return "A column needs a name."
        return "Another column has this name." if text in others else ""

    def action_autofit(self) -> None:
        """Make each column as wide as its texts."""
        self.grid.autofit()

    def refresh_view(self) -> None:
        self.sheet.refresh()
        self.show()


def _short(fault: Fault | None) -> str:
    if fault is None:
        return ""
    return f"{fault.message} Did you mean {fault.mend}?" if fault.mend else fault.message


def _by_frequency(column: TextColumn) -> list[str]:
    """The distinct texts of a column, most frequent first."""
    counts = np.bincount(column.codes, minlength=len(column.texts))
    order = np.argsort(-counts, kind="stable")[:MOST_KNOWN]
    return [column.texts[code] for code in order.tolist() if counts[code]]
