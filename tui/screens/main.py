"""The screen of a table: tabs, tools, what the tab shows, a line that says what was done, and the keys."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import ClassVar, Protocol, TypeVar

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.reactive import Reactive
from textual.screen import Screen
from textual.widget import Widget
from textual.widgets import ContentSwitcher, Static

from contextdb.disk import write_atomic
from contextdb.edits.schema_file import schema_path
from contextdb.errors import ContextDBError, in_quotes, plural
from contextdb.tables.changes import Edit
from contextdb.tables.table import Table
from tui.clipboard import Clipboard
from tui.commands import ASSETS, BY_ID, SCREEN, bindings, key_names
from tui.editor import Editor
from tui.messages import Edited, FillGap, GoToCell, RenameWanted, SetContext, Told, ValueRenameWanted
from tui.model.coverage_run import CoverageRun
from tui.model.importing import Import
from tui.model.new_table import make_table, name_fault
from tui.model.session import Session
from tui.model.sessions import sessions_of
from tui.model.workspace import Workspace
from tui.panes.assets import AssetsPane
from tui.panes.options import OptionsPane
from tui.panes.pane import Pane
from tui.panes.problems import ProblemsPane
from tui.panes.why import WIDE
from tui.screens.ask import AskDialog, ChooseDialog
from tui.screens.asking import TestRow
from tui.screens.dialog import take_height
from tui.screens.disk_care import LOOK_EVERY_S, DiskCare
from tui.screens.export_table import Export
from tui.screens.following import Followed, Following
from tui.screens.renames import Renames
from tui.screens.steps import StepsDialog
from tui.widgets.bar import Bar, Item, StatusLine
from tui.widgets.grid import Grid
from tui.widgets.key_line import KeyLine

Chosen = TypeVar("Chosen")


class Answer(Protocol):
    """What a dialog about columns gives back."""

    def edit(self, table: Table) -> Edit:
        """The edit that was decided."""


TABS = ("assets", "options", "priorities", "coverage", "problems")
MOTION = "motion"
"""The tab that there is where the project declares motion databases and has a recorded session, and where it was gone to."""
CELL_MENU = (
    "edit", "copy", "cut", "paste", "fill-down", "fill-series", "clear", "note", "insert-row", "insert-below",
    "insert-copied", "duplicate", "delete-rows", "enable", "colour-rows", "filter-same", "values", "rename-asset", "nearest",
)  # fmt: skip
COLUMN_MENU = (
    "values", "autofill", "sort", "sort-then", "hide-columns", "fold", "freeze", "columns", "column-sheet", "mend-all",
    "rename-column", "rename-role", "add-column", "column-left", "column-right", "delete-columns",
)  # fmt: skip
"""What the right button of the mouse offers."""
WITH_TOOLS = 30
"""On a screen of fewer lines the tools give way to the rows; the palette, where all of them are too, stands behind the tabs."""
TOOLS = ("add-column", "blueprints", "import", "export", "refresh", "autofit", "history", "palette")


class MainScreen(Screen[None]):
    """One table of the workspace, with its tabs."""

    BINDINGS: ClassVar[list[BindingType]] = bindings([*SCREEN, *ASSETS])

    DEFAULT_CSS = """
    MainScreen {
        layout: vertical;
        & > ContentSwitcher { height: 1fr; & > * { height: 1fr; } }
        & > #said { height: auto; max-height: 4; padding: 0 1; background: $surface; display: none; }
        & > #said.-information { display: block; }
        & > #said.-warning { display: block; color: $text-warning; }
        & > #said.-error { display: block; color: $text-error; text-style: bold; }
    }
    """

    app: Editor
    focused: Reactive[Widget | None] = Reactive(None, repaint=False)
    """What has the keys. Of the screen itself nothing looks otherwise then: Textual would paint all of it again."""

    def __init__(self, workspace: Workspace, name: str) -> None:
        super().__init__()
        self.workspace = workspace
        self.table_name = name
        self.session: Session = workspace.session(name)
        self.coverage = CoverageRun()
        self.test_row = TestRow(self)
        self.following = Following(self)
        self.renames = Renames(self)
        self.came_from = ""
        """The table from a row of which this one was gone into."""
        self.renamed = ""
        """What is said of a rename, after which the table was opened again."""
        self._said = ("", "information")
        self._warned_at: tuple[int, int] | None = None
        """Where the cursor was when a warning of a verb was first seen: the next cell takes it away."""
        self._is_of_verb = False
        """What is said, not quietly, is of something that was done."""
        has_databases = bool(self.session.sheet.table.schema.motion.get("databases"))
        self._has_sessions = has_databases and bool(sessions_of(workspace.folder))
        self.care = DiskCare(self, self.session, self.say, self.show)
        self.clipboard = Clipboard(lambda text: self.app.copy_to_clipboard(text))

    @property
    def tab(self) -> str:
        """The tab that is seen."""
        return self.query_one("#panes", ContentSwitcher).current or "assets"

    @property
    def tabs(self) -> Sequence[str]:
        """The tabs that there are."""
        return (*TABS, MOTION) if self._has_sessions or self.tab == MOTION else TABS

    @property
    def assets(self) -> AssetsPane:
        """The tab of the grid."""
        return self.query_one(AssetsPane)

    def compose(self) -> ComposeResult:
        take_height(self)
        yield Bar(id="tabs")
        yield Bar([Item(name, BY_ID[name].label) for name in TOOLS], id="tools")
        with ContentSwitcher(initial="assets", id="panes"):
            yield AssetsPane(self.session.sheet, self.clipboard)
        yield Static(id="said")
        yield StatusLine()
        yield KeyLine()

    def on_mount(self) -> None:
        self.assets.take_focus()
        self.set_interval(LOOK_EVERY_S, self.care.look)
        self._opened()

    def on_resize(self) -> None:
        self._show_bars()

    def on_unmount(self) -> None:
        self.coverage.cancel()
        self.following.close()

    # ---- what is shown

    def show(self) -> None:
        """Show the table, and everything said of it, as it is now."""
        table = self.session.sheet.table
        self.coverage.follow(table)
        self.test_row.follow(table)
        self.assets.show()
        self._show_bars()
        if self.tab != "assets":
            self._pane(self.tab).show()

    def _show_bars(self) -> None:
        mark = " *" if self.session.sheet.is_modified else ""
        items = [Item("open", f"{self.table_name}{mark}", is_strong=True)]
        items += [Item(tab, BY_ID[tab].label, is_on=tab == self.tab) for tab in self.tabs]
        has_tools = self.size.height >= WITH_TOOLS
        self.query_one("#tools", Bar).display = has_tools
        items += [] if has_tools else [Item("palette", f"^P {BY_ID['palette'].label}")]
        self.query_one(KeyLine).leave_out(() if has_tools else ("app.command_palette",))
        table = self.session.sheet.table
        about = f"{plural(table.n_rows, 'row')} · {plural(len(table.columns), 'column')}"
        self.query_one("#tabs", Bar).show(items, about)
        self.query_one(StatusLine).show(right=self.assets.summary())

    def say(self, text: str, level: str = "information") -> None:
        """Say something in the line over the footer; nothing takes away what was said."""
        is_quiet = level == "information"
        self._is_of_verb = False
        status = self.query_one(StatusLine)
        is_short = is_quiet and status.has_room(text)
        status.show(text if is_short else "")
        if (text, level) == self._said:
            return
        self._said, said = (text, level), self.query_one("#said", Static)
        if not is_short:
            said.update(Text(text if is_quiet else f"! {text}"))
        if not is_short or said.display:
            said.set_classes("" if is_short else f"-{level}")

    @on(Told)
    def _told(self, event: Told) -> None:
        self.say(event.text, event.level)
        self._is_of_verb, self._warned_at = event.level != "information", None

    @on(Edited)
    def edited(self, event: Edited) -> None:
        """Show the sheet again, and say what was done."""
        done = event.done
        text = " ".join([f"{done.name}." if done.name else "", *done.notes, *done.warnings]).strip()
        self.say(text, "warning" if done.warnings else "information")
        self._is_of_verb, self._warned_at = bool(done.warnings), None
        self.show()

    @on(Grid.Moved)
    @on(Grid.FactChanged)
    def _moved(self) -> None:
        self._show_bars()
        cursor = self.session.sheet.cursor
        if self._is_of_verb and self._warned_at not in (None, cursor):
            self.say("")  # one has gone on
        self._warned_at = cursor

    @on(Bar.Pressed)
    async def _pressed(self, event: Bar.Pressed) -> None:
        await self.run_command(event.command)

    # ---- commands

    async def run_command(self, name: str) -> None:
        """Run a command of the palette or a bar, wherever its keys are."""
        command = BY_ID[name]
        if command.scope == "screen":
            await self.run_action(command.run)
            return
        self._switch_to("assets")
        await (self.assets.grid if command.scope == "grid" else self.assets).run_action(command.run)

    async def action_command(self, name: str) -> None:
        """A command of the assets' pane, from any tab."""
        await self.run_command(name)

    async def action_tab(self, name: str) -> None:
        """Go to a tab, which is made when it is first gone to."""
        if not self.query(f"#{name}"):
            with self.app.batch_update():
                await self.query_one("#panes", ContentSwitcher).mount(self._new_pane(name))
        self._switch_to(name)

    def _switch_to(self, name: str) -> None:
        if name != self.tab:
            self.say("")  # it was of the tab that is left
        self.query_one("#panes", ContentSwitcher).current = name
        self._show_bars()
        if name != "assets":
            self._pane(name).show()
        self._pane(name).take_focus()

    def _new_pane(self, name: str) -> Pane:
        sheet = self.session.sheet
        if name == "options":
            return OptionsPane(sheet, id=name)
        if name == "priorities":
            from tui.panes.priorities import PrioritiesPane  # with all of motion

            return PrioritiesPane(sheet, id=name)
        if name == MOTION:
            from tui.panes.motion import MotionPane  # loads the motion search

            return MotionPane(self.workspace.folder, id=name)
        return self._coverage_pane(name) if name == "coverage" else ProblemsPane(sheet, id=name)

    def _coverage_pane(self, name: str) -> Pane:
        from tui.panes.coverage import CoveragePane

        return CoveragePane(self.session.sheet, self.coverage, lambda: self.following.kept, self.workspace.folder, id=name)

    async def action_next_tab(self, by: int) -> None:
        """Go to the tab beside."""
        tabs = self.tabs
        await self.action_tab(tabs[(tabs.index(self.tab) + by) % len(tabs)])

    def action_help(self) -> None:
        from tui.screens.help import HelpDialog

        self.app.push_screen(HelpDialog(self.app.settings.keys))

    def action_history(self) -> None:
        """Choose a step to go to."""
        history = self.session.sheet.history

        def chosen(position: int | None) -> None:
            if position is not None:
                self.edited(Edited(self.session.sheet.go_to_step(position)))

        self.app.push_screen(StepsDialog(history.names, history.position), chosen)

    # ---- tables and files

    def action_tables(self) -> None:
        """Choose a table of the folder."""
        self.workspace.look_again()
        names = list(self.workspace.files)
        lines = [f"{name}{' *' if name in self.workspace.unsaved else ''}" for name in names]

        def chosen(at: int | None) -> None:
            if at is not None and names[at] != self.table_name:
                self.app.open_table(names[at])

        self.app.push_screen(ChooseDialog("Tables", lines, names.index(self.table_name)), chosen)

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

        def named(name: str | None) -> None:
            if name is not None:
                self._choose_blueprint(name)

        question = "The name of the table and its file"
        check = partial(name_fault, workspace.folder, taken=workspace.files)
        self.app.push_screen(AskDialog("New table", question, "", check), named)

    def _choose_blueprint(self, name: str) -> None:
        blueprints = self.session.sheet.table.schema.blueprints
        lines = ["only the assets", *(f"{one}: {', '.join(names)}" for one, names in blueprints.items())]

        def chosen(at: int | None) -> None:
            if at is not None:
                conditions = [(), *blueprints.values()][at]
                self.try_to(lambda: self._make_table(name.strip(), conditions))

        self.app.push_screen(ChooseDialog("With the columns of a blueprint", lines), chosen)

    def _make_table(self, name: str, conditions: Sequence[str]) -> None:
        make_table(self.workspace.folder, name, conditions)
        self.workspace.look_again()
        self.app.open_table(name)

    def action_save(self) -> None:
        """Write the table to its file, and what changes to contextdb.toml."""
        editor = self.assets.editor
        if editor is not None and editor.fault is not None:
            self.say("Finish the cell first: Enter accepts it, Esc leaves it as it was.", "warning")
            return
        self.try_to(lambda: self.care.save(then=self._saved))

    def _saved(self) -> None:
        n_unreadable = len(self.session.sheet.table.faults)
        note = f" {plural(n_unreadable, 'cell')} cannot be read: see Problems." if n_unreadable else ""
        self.show()
        self.say(f"Saved {self.session.path.name}.{note}", "warning" if note else "information")

    def action_save_as(self) -> None:
        """Ask for a name, write the table to a file of it, and go on with that one."""
        workspace = self.workspace

        def named(name: str | None) -> None:
            if name is not None:
                suffix = self.session.path.suffix
                self.try_to(lambda: workspace.save_as(self.table_name, name.strip(), suffix))
                if name.strip() in workspace.files:
                    self.app.open_table(name.strip())

        check = partial(name_fault, workspace.folder, taken=workspace.files)
        self.app.push_screen(AskDialog("Save as", "The name of the other table and its file", "", check), named)

    def action_import(self) -> None:
        """Bring rows in from another file."""
        self._import()

    def _import(self, text: str | None = None) -> None:
        from tui.screens.import_table import ImportDialog

        def chosen(answer: Import | None) -> None:
            if answer is not None:
                self.take_import(answer)

        self.app.push_screen(ImportDialog(self.session.sheet.table, self.workspace.folder, text), chosen)

    def take_import(self, answer: Import) -> None:
        """Put the rows of another file into the table, and fit the columns to them."""
        is_short = len(answer.notes) < 2
        self.apply(answer.edit, answer.notes if is_short else (f"{len(answer.notes)} remarks.",))
        self.assets.grid.forget_widths()
        if not is_short:
            from tui.screens.remarks import RemarksDialog

            self.app.push_screen(RemarksDialog(answer.edit.name, answer.notes))

    @on(Grid.MenuWanted)
    def _menu(self, event: Grid.MenuWanted) -> None:
        """What can be done with a column, or with cells."""
        names = COLUMN_MENU if event.of_column else CELL_MENU
        keys = {name: key_names(self.app.settings.keys.get(name, BY_ID[name].keys)) for name in names}
        lines = [f"{BY_ID[name].label:<18}{keys[name][0] if keys[name] else ''}" for name in names]

        def chosen(at: int | None) -> None:
            if at is not None:
                self.call_later(self.run_command, names[at])

        sheet = self.session.sheet
        title = sheet.table.columns[sheet.selection.column].name if event.of_column else "Cells"
        self.app.push_screen(ChooseDialog(title, lines), chosen)

    @on(Grid.ImportWanted)
    def _import_text(self, event: Grid.ImportWanted) -> None:
        """Ask how to read a table that was pasted into an empty one."""
        self._import(text=event.text)

    def action_export(self) -> None:
        """Write the table for another program."""
        from tui.screens.export_table import ExportDialog

        def chosen(answer: Export | None) -> None:
            if answer is not None:
                self.try_to(lambda: self._export(answer))

        self.app.push_screen(ExportDialog(self.session.sheet.table, self.workspace.folder), chosen)

    def _export(self, answer: Export) -> None:
        write_atomic(answer.path, answer.raw)
        self.say(" ".join([f"Wrote {answer.path.name}.", *answer.notes]), "warning" if answer.notes else "information")

    # ---- columns

    def action_add_column(self) -> None:
        """Add a declared condition, those of a blueprint, or a new column."""
        from tui.screens.add_column import AddColumn

        sheet = self.session.sheet
        self.app.push_screen(AddColumn(sheet.table, sheet.selection.column), self._answered)

    def action_autofill(self) -> None:
        """Show what the clips give to the table, and fill it."""
        from tui.screens.autofill import Autofill, AutofillDialog  # loads what reads clips

        table = self.session.sheet.table

        def decided(answer: Autofill | None) -> None:
            if answer is not None:
                self.try_to(lambda: self.edited(Edited(answer.fill(self.session.sheet))))

        self.app.push_screen(AutofillDialog(table, schema_path(table).parent), decided)

    def action_column_sheet(self) -> None:
        """Change what contextdb.toml says of all columns, in a sheet; as one step."""
        from tui.screens.column_sheet import ColumnSheetDialog

        sheet = self.session.sheet

        def decided(edit: Edit | None) -> None:
            if edit is not None:
                self.apply(edit)

        self.app.push_screen(ColumnSheetDialog(sheet.table, sheet.selection.column, self.clipboard), decided)

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
        from tui.screens.blueprints import Blueprints

        sheet = self.session.sheet
        self.app.push_screen(Blueprints(sheet.table, sheet.selected_columns, sheet.selection.column), self._answered)

    def _answered(self, answer: Answer | None) -> None:
        """Make the edit; the cursor goes to the column that is new, so that the next one comes behind it."""
        if answer is None:
            return
        sheet = self.session.sheet
        before = {column.name for column in sheet.table.columns}
        self.try_to(lambda: self.apply(answer.edit(sheet.table)))
        new = [column.name for column in sheet.table.columns if column.name not in before]
        if new:
            self.assets.go_to_column(new[-1])

    def apply(self, edit: Edit, notes: Sequence[str] = ()) -> None:
        """Make an edit, show it and say what was done; what cannot be done is said."""

        def made() -> None:
            done = self.session.sheet.apply(edit)
            self.edited(Edited(replace(done, warnings=(*done.warnings, *notes))))

        self.try_to(made)

    def action_find_everywhere(self) -> None:
        """Find a text in all tables of the folder, and go to one of its places."""
        from tui.screens.find_everywhere import FindEverywhere, FoundCell

        def chosen(answer: FoundCell | None) -> None:
            if answer is not None:
                self.app.open_table(answer.table)
                self.app.go_to_cell(GoToCell(answer.row, answer.column))

        self.app.push_screen(FindEverywhere(self.workspace, self.table_name), chosen)

    # ---- the test row

    def action_contexts(self) -> None:
        """Look through saved or recorded contexts."""
        self.try_to(self.test_row.contexts)

    def action_step(self, by: int) -> None:
        """Load the next context, or the one before."""
        if self.following.followed is not None:
            self.following.step(by)
        else:
            self.try_to(lambda: self.test_row.step(by))

    def action_live(self) -> None:
        """Let the test row follow a game, or a recording."""
        from tui.screens.live import LiveDialog

        def chosen(answer: Followed | None) -> None:
            if answer is not None:
                self._switch_to("assets")
                self.following.start(answer)

        self.app.push_screen(LiveDialog(self.table_name, self.workspace.folder), chosen)

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
        """Say who may play each role."""
        self.try_to(self.test_row.actors)

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

    def action_refresh(self) -> None:
        """Take in what changed on the disk; sort and filter again."""
        self.say("Refreshed.")
        self.try_to(self.workspace.look_again)
        self.care.look()
        self.assets.refresh_view()
        self.show()

    def _opened(self) -> None:
        session = self.session
        if session.n_recovered:
            self.say(f"{plural(session.n_recovered, 'unsaved edit')} restored from the last session.", "warning")
        elif session.problem is not None:
            self.say(str(session.problem), "warning")
        elif self.renamed:
            self.say(self.renamed)
        elif self.came_from:
            self.say(f"A row of {self.came_from} refers to this table. Alt+Q goes back.")
            self.assets.grid.test_name = self.came_from if not session.sheet.query.is_empty else ""
        elif why := session.why_read_only:
            self.say(f"This table is read-only: {why}.", "warning")
        self._show_bars()

    def try_to(self, verb: Callable[[], None]) -> None:
        """Do something; what cannot be done is said."""
        try:
            verb()
        except ContextDBError as error:
            self.say(str(error), "error")

    # ---- what panes ask for

    @on(GoToCell)
    def go_to_cell(self, event: GoToCell) -> None:
        """Show a cell in the grid."""
        self._switch_to("assets")
        self.assets.go_to(event.row, event.column)

    @on(FillGap)
    def _fill_gap(self, event: FillGap) -> None:
        sheet = self.session.sheet
        done = sheet.insert_rows(below=True, texts=[dict(event.cells)])
        self.edited(Edited(done))
        self.go_to_cell(GoToCell(sheet.row_number(sheet.cursor[0]) - 1, sheet.table.asset_column))
        self.say("A new row fills the gap: enter its asset.")

    @on(SetContext)
    def set_context(self, event: SetContext) -> None:
        """Make these the facts of the test row; a game is not followed any more."""
        self.following.stop()
        self._switch_to("assets")
        self.assets.set_context(dict(event.facts), event.name)

    def _pane(self, name: str) -> Pane:
        return self.query_one(f"#{name}", Pane)
