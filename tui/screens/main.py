"""The screen of a table: tabs, tools, what the tab shows, a line that says what was done, and the keys."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import ClassVar, Protocol

from textual import on
from textual.binding import BindingType

from contextdb.cells.words import says_any
from contextdb.disk import write_atomic
from contextdb.edits.schema_file import schema_path
from contextdb.errors import in_quotes, plural
from contextdb.tables.changes import Edit
from contextdb.tables.table import Table

from ..commands import ASSETS, BY_ID, SCREEN, bindings, key_names
from ..messages import Edited, FillGap, GoToCell, RenameWanted, ValueRenameWanted
from ..model.importing import Import
from ..model.new_table import make_table, name_fault
from ..panes.why import WIDE
from ..widgets.grid import Grid
from .ask import AskDialog, ChooseDialog
from .disk_care import LOOK_EVERY_S
from .export_table import Export
from .following import Followed
from .table_files import TableFiles
from .table_screen import TableScreen


class Answer(Protocol):
    """What a dialog about columns gives back."""

    def edit(self, table: Table) -> Edit:
        """The edit that was decided."""


CELL_MENU = (
    "edit", "copy", "cut", "paste", "fill-down", "fill-series", "clear", "note", "insert-row", "insert-below",
    "insert-copied", "duplicate", "delete-rows", "enable", "colour-rows", "filter-same", "values", "rename-asset", "nearest",
)  # fmt: skip
COLUMN_MENU = (
    "values", "autofill", "sort", "sort-then", "hide-columns", "fold", "freeze", "columns", "column-sheet", "mend-all",
    "rename-column", "rename-role", "add-column", "column-left", "column-right", "delete-columns",
)  # fmt: skip
"""What the right button of the mouse offers."""


class MainScreen(TableScreen):
    """One table of the workspace, with its tabs."""

    BINDINGS: ClassVar[list[BindingType]] = bindings([*SCREEN, *ASSETS])

    def on_mount(self) -> None:
        self.assets.take_focus()
        self.set_interval(LOOK_EVERY_S, self._look)
        self._opened()

    def _look(self) -> None:
        """Take in what others wrote; not while a cell is edited, which could become another one."""
        if self.assets.editor is None:
            self.care.look()

    # ---- tables and files

    def action_tables(self) -> None:
        """Choose a table of the folder."""
        self.workspace.look_again()
        names = list(self.workspace.files)
        lines = [f"{name}{' *' if name in self.workspace.unsaved else ''}" for name in names]

        def chosen(at: int) -> None:
            if names[at] != self.table_name:
                self.app.open_table(names[at])

        ChooseDialog("Tables", lines, names.index(self.table_name)).ask(self.app, chosen)

    @on(Grid.OpenWanted)
    def _open_row(self, event: Grid.OpenWanted) -> None:
        """Go into the table that a row refers to, with the facts of the test row."""
        query = self.session.sheet.query
        inside = query.inside(event.row)
        if inside is None:
            self.say("This row refers to no other table. To change that, write @ and a table's name in its asset cell.")
        elif inside.table not in self.workspace.files:
            self.say(f"There is no table {in_quotes(inside.table)} to open.", "error")
        else:
            self.app.go_into(inside.table, self.table_name, {} if query.is_empty else dict(query.texts))

    def action_back(self) -> None:
        """Go back to the row that refers to this table."""
        if not self.app.go_back():
            self.say("You did not come here from a row. Press Alt+O on a row that refers to a table to open it.")

    def action_new_table(self) -> None:
        """Ask for a name and a blueprint, and make a table."""
        workspace = self.workspace

        def named(name: str) -> None:
            if self.session.sheet.table.schema.blueprints:
                self._choose_blueprint(name)
            else:
                self.try_to(lambda: self._make_table(name.strip(), ()))

        question = "The name of the table and its file"
        check = partial(name_fault, workspace.folder, taken=workspace.files)
        AskDialog("New table", question, "", check).ask(self.app, named)

    def _choose_blueprint(self, name: str) -> None:
        blueprints = self.session.sheet.table.schema.blueprints
        lines = ["only the assets", *(f"{one}: {', '.join(names)}" for one, names in blueprints.items())]

        def chosen(at: int) -> None:
            conditions = [(), *blueprints.values()][at]
            self.try_to(lambda: self._make_table(name.strip(), conditions))

        ChooseDialog("With the columns of a blueprint", lines).ask(self.app, chosen)

    def _make_table(self, name: str, conditions: Sequence[str]) -> None:
        make_table(self.workspace.folder, name, conditions)
        self.workspace.look_again()
        self.app.open_table(name)

    def action_rename_table(self) -> None:
        TableFiles(self).rename()

    def action_duplicate_table(self) -> None:
        """Copy the table, and go to the copy."""
        TableFiles(self).duplicate()

    def action_delete_table(self) -> None:
        """Delete the table after a question."""
        TableFiles(self).delete()

    def action_save(self) -> None:
        """Write the table to its file, and what changes to contextdb.toml."""
        self.try_to(lambda: self.care.save(then=self._saved))

    def _saved(self) -> None:
        n_unreadable = len(self.session.sheet.table.faults)
        note = f" {plural(n_unreadable, 'cell')} cannot be read: see Problems." if n_unreadable else ""
        self.show()
        self.say(f"Saved {self.session.path.name}.{note}", "warning" if note else "information")

    def action_save_as(self) -> None:
        """Ask for a name, write the table to a file of it, and go on with that one."""
        workspace = self.workspace

        def named(name: str) -> None:
            suffix = self.session.path.suffix
            self.try_to(lambda: workspace.save_as(self.table_name, name.strip(), suffix))
            if name.strip() in workspace.files:
                self.app.open_table(name.strip())

        check = partial(name_fault, workspace.folder, taken=workspace.files)
        AskDialog("Save as", "The name of the other table and its file", "", check).ask(self.app, named)

    def action_import(self) -> None:
        """Bring rows in from another file."""
        self._import()

    def _import(self, text: str | None = None) -> None:
        from .import_table import ImportDialog

        ImportDialog(self.session.sheet.table, self.workspace.folder, text).ask(self.app, self.take_import)

    def take_import(self, answer: Import) -> None:
        """Put the rows of another file into the table, and fit the columns to them."""
        is_short = len(answer.notes) < 2
        if answer.with_marks is not None:
            self.assets.mark(answer.with_marks, "")
        self.apply(answer.edit, answer.notes if is_short else (f"{len(answer.notes)} remarks.",))
        self.assets.grid.forget_widths()
        if not is_short:
            from .remarks import RemarksDialog

            self.app.push_screen(RemarksDialog(answer.edit.name, answer.notes))

    @on(Grid.MenuWanted)
    def _menu(self, event: Grid.MenuWanted) -> None:
        """What can be done with a column, or with cells."""
        names = COLUMN_MENU if event.of_column else CELL_MENU
        keys = {name: key_names(self.app.settings.keys.get(name, BY_ID[name].keys)) for name in names}
        lines = [f"{BY_ID[name].label:<18}{keys[name][0] if keys[name] else ''}" for name in names]

        sheet = self.session.sheet
        title = sheet.table.columns[sheet.selection.column].name if event.of_column else "Cells"
        ChooseDialog(title, lines).ask(self.app, lambda at: self.call_later(self.run_command, names[at]))

    @on(Grid.ImportWanted)
    def _import_text(self, event: Grid.ImportWanted) -> None:
        """Ask how to read a table that was pasted into an empty one."""
        self._import(text=event.text)

    def action_export(self) -> None:
        """Write the table for another program."""
        from .export_table import ExportDialog

        ExportDialog(self.session.sheet.table, self.workspace.folder, self.session.sheet.marks).ask(
            self.app, lambda answer: self.try_to(lambda: self._export(answer))
        )

    def _export(self, answer: Export) -> None:
        write_atomic(answer.path, answer.raw)
        self.say(" ".join([f"Wrote {answer.path.name}.", *answer.notes]), "warning" if answer.notes else "information")

    # ---- columns

    def action_add_column(self) -> None:
        """Add a declared condition, those of a blueprint, or a new column."""
        from .add_column import AddColumn

        sheet = self.session.sheet
        AddColumn(sheet.table, sheet.selection.column).ask(self.app, self._answered)

    def action_autofill(self) -> None:
        """Show what the clips give to the table, and fill it."""
        from .autofill import AutofillDialog  # loads what reads clips

        table = self.session.sheet.table

        AutofillDialog(table, schema_path(table).parent).ask(
            self.app, lambda answer: self.try_to(lambda: self.edited(Edited(answer.fill(self.session.sheet))))
        )

    def action_column_sheet(self) -> None:
        """Change what contextdb.toml says of all columns, in a sheet; as one step."""
        from .column_sheet import ColumnSheetDialog

        sheet = self.session.sheet

        ColumnSheetDialog(sheet.table, sheet.selection.column, self.clipboard).ask(self.app, self.apply)

    @on(RenameWanted)
    def _rename(self, event: RenameWanted) -> None:
        self.renames.column(event)

    @on(ValueRenameWanted)
    def _rename_value(self, event: ValueRenameWanted) -> None:
        self.renames.value(event)

    @on(Grid.RenameUndoWanted)
    def _undo_rename(self, event: Grid.RenameUndoWanted) -> None:
        self.renames.undo(event.is_redo)

    def action_rename_role(self) -> None:
        """Give the role of the cursor's column another name."""
        self.renames.role()

    def action_rename_asset(self) -> None:
        """Give the asset of the cursor's row another name."""
        self.renames.asset()

    def action_blueprints(self) -> None:
        """Insert the conditions of a blueprint, or keep the selected ones as one."""
        from .blueprints import Blueprints

        sheet = self.session.sheet
        Blueprints(sheet.table, sheet.selected_columns, sheet.selection.column).ask(self.app, self._answered)

    def _answered(self, answer: Answer) -> None:
        """Make the edit; the cursor goes to the column that is new, so that the next one comes behind it."""
        sheet = self.session.sheet
        before = {column.name for column in sheet.table.columns}
        self.try_to(lambda: self.apply(answer.edit(sheet.table)))
        new = [column.name for column in sheet.table.columns if column.name not in before]
        if new:
            self.assets.go_to_column(new[-1])

    def action_find_everywhere(self) -> None:
        """Find a text in all tables of the folder, and go to one of its places."""
        from .find_everywhere import FindEverywhere, FoundCell

        def chosen(answer: FoundCell) -> None:
            self.app.open_table(answer.table)
            self.app.go_to_cell(GoToCell(answer.row, answer.column))

        FindEverywhere(self.workspace, self.table_name).ask(self.app, chosen)

    # ---- the test row

    def action_contexts(self) -> None:
        self.try_to(self.test_row.contexts)

    def action_step(self, by: int) -> None:
        """Load the next context, or the one before."""
        if self.following.followed is not None:
            self.following.step(by)
        else:
            self.try_to(lambda: self.test_row.step(by))

    def expect_game(self, game: str) -> None:
        """Follow a game as soon as it asks this table."""
        from .expected_game import LOOK_EVERY_S, ExpectedGame

        expected = ExpectedGame(game, self.table_name, self.following.start)
        expected.timer = self.set_interval(LOOK_EVERY_S, expected.look)

    def action_changes(self) -> None:
        """Which moments play something else since the last save; Enter loads one into the test row."""
        from .changes import ChangesDialog

        session = self.session
        ChangesDialog(session.saved_table, session.sheet.table, self.workspace.folder).ask(self.app, self.post_message)

    def action_live(self) -> None:
        """Let the test row follow a game, or a recording."""
        from .live import LiveDialog

        def chosen(answer: Followed) -> None:
            self._switch_to("assets")
            self.following.start(answer)

        LiveDialog(self.table_name, self.workspace.folder).ask(self.app, chosen)

    def action_live_pause(self) -> None:
        """Hold the moment of the game, or go on."""
        self.following.pause()

    def action_live_by(self, by: int) -> None:
        """Go back a second of the game, or ahead."""
        self.following.seconds(by)

    def action_live_keep(self) -> None:
        """Save the moment of the game as a context."""
        self.try_to(self.following.keep)

    def action_live_stop(self) -> None:
        """Let go of the game."""
        self.following.stop()

    def action_actors(self) -> None:
        self.try_to(self.test_row.actors)

    def action_next_picks(self) -> None:
        """What would be picked in turn for the test row."""
        self.try_to(self.test_row.picks)

    def action_why(self) -> None:
        """Why the row of the cursor is not valid: beside the table where there is room, else as `action_nearest`."""
        pane = self.assets.why_pane
        if self.tab == "assets" and (pane.is_open or self.size.width >= WIDE):
            pane.turn(self.session.sheet)
        else:
            self.action_nearest()

    def action_nearest(self) -> None:
        """The row of the cursor cell by cell, and which rows are nearest, in a dialog."""
        self.test_row.why()

    def action_git_history(self) -> None:
        """What git knows of the cell and the row of the cursor."""
        from .row_history import RowHistoryDialog

        sheet = self.session.sheet
        if not len(sheet.view) or self.assets.grid.is_in_new_row or self.assets.grid.is_in_test_row:
            self.say("Git knows of rows of the table: go to one.")
            return
        row, column = int(sheet.view.rows[sheet.cursor[0]]), sheet.table.columns[sheet.cursor[1]].name
        self.app.push_screen(RowHistoryDialog(sheet.table, row, column))

    def action_refresh(self) -> None:
        """Take in what changed on the disk; sort and filter again."""
        self.say("Refreshed.")
        self.try_to(self.workspace.look_again)
        self.care.look()
        self._look_for_sessions()
        if self._clips is not None:
            self._clips.forget()
        self.assets.refresh_view()
        self.show()

    # ---- what panes ask for

    @on(FillGap)
    def _fill_gap(self, event: FillGap) -> None:
        sheet = self.session.sheet
        if event.below is not None and event.below < sheet.table.n_rows:
            self.go_to_cell(GoToCell(event.below, sheet.table.asset_column))
        spellings = {c.condition.name: [text for text in c.texts.texts if says_any(text)] for c in sheet.table.conditions}
        others = {name: max(texts, key=len, default="") for name, texts in spellings.items()}  # "Any" as the column writes it
        done = sheet.insert_rows(below=True, texts=[others | dict(event.cells)])
        self.edited(Edited(done))
        self.go_to_cell(GoToCell(sheet.row_number(sheet.cursor[0]) - 1, sheet.table.asset_column))
        self.say("A new row fills the gap: enter its asset.")
