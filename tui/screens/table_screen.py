"""A screen of one table: tabs, tools, what the tab shows, and a line that says what was done. `tui.screens.main` has its verbs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from rich.text import Text
from textual import events, on
from textual.app import ComposeResult
from textual.reactive import Reactive
from textual.screen import Screen
from textual.widget import Widget
from textual.widgets import ContentSwitcher, Static

from contextdb.errors import ContextDBError, plural
from contextdb.tables.changes import Edit

from ..clipboard import Clipboard
from ..commands import BY_ID
from ..editor import Editor
from ..messages import Edited, GoToCell, Notice, SetContext
from ..model.coverage_run import CoverageRun
from ..model.session import Session
from ..model.sessions import sessions_of
from ..model.workspace import Workspace
from ..panes.assets import AssetsPane
from ..panes.options import OptionsPane
from ..panes.pane import Pane
from ..panes.problems import ProblemsPane
from ..widgets.bar import Bar, Item, StatusLine
from ..widgets.cell_editor import is_free_for
from ..widgets.grid import Grid
from ..widgets.key_line import KeyLine
from .ask import StepsDialog
from .asking import TestRow
from .dialog import take_height
from .disk_care import DiskCare
from .following import Following
from .renames import Renames

if TYPE_CHECKING:
    from ..panes.clip import Clips

CONTRACTS = "contracts"
"""The tab that gives way on a narrow screen where the project declares no contracts."""
TABS = ("assets", "options", "priorities", "coverage", "problems", CONTRACTS)
MOTION = "motion"
"""The tab that there is where the project declares motion databases and has a recorded session, and where it was gone to."""
WITH_SIDE = ("assets", "coverage")
"""The tabs with room for the animation."""
WITH_TOOLS = 30
"""On a screen of fewer lines the tools give way to the rows; the palette, where all of them are too, stands behind the tabs."""
TOOLS = ("add-column", "blueprints", "import", "export", "refresh", "autofit", "history", "palette")


class TableScreen(Screen[None]):
    """One table of the workspace, with its tabs."""

    DEFAULT_CSS = """
    TableScreen {
        layout: vertical;
        & > ContentSwitcher { height: 1fr; & > * { height: 1fr; } }
        & > #message { height: auto; max-height: 4; padding: 0 1; background: $surface; display: none; }
        & > #message.-information { display: block; }
        & > #message.-warning { display: block; color: $text-warning; }
        & > #message.-error { display: block; color: $text-error; text-style: bold; }
    }
    """

    BLANK = True
    """Its parts cover all of it: Textual would render its empty lines, too, for each paint."""
    app: Editor
    focused: Reactive[Widget | None] = Reactive(None, repaint=False)
    """What has the keys. Of the screen itself nothing looks otherwise then: Textual would paint all of it again."""

    def __init__(self, workspace: Workspace, name: str) -> None:
        super().__init__()
        self.workspace = workspace
        self.table_name = name
        self.session: Session = workspace.session(name)
        self._clips: Clips | None = None
        self.coverage = CoverageRun()
        self.test_row = TestRow(self)
        self.following = Following(self)
        self.renames = Renames(self)
        self.came_from = ""
        """The table from a row of which this one was gone into."""
        self.renamed = ""
        """The message about a rename, after which the table was opened again."""
        self._notice = ("", "information")
        self._warned_at: tuple[int, int] | None = None
        """Where the cursor was when a warning of a verb was first seen: the next cell takes it away."""
        self._is_of_verb = False
        """The messages, unless quiet, are of something that was done."""
        self._has_sessions = False
        self._look_for_sessions()
        self.care = DiskCare(self, self.session, self.say, self.show)
        self.clipboard = Clipboard(lambda text: self.app.copy_to_clipboard(text))

    def _look_for_sessions(self) -> None:
        has_databases = bool(self.session.sheet.table.schema.motion.get("databases"))
        self._has_sessions = has_databases and bool(sessions_of(self.workspace.folder))

    @property
    def tab(self) -> str:
        return self.query_one("#panes", ContentSwitcher).current or "assets"

    @property
    def tabs(self) -> Sequence[str]:
        return (*TABS, MOTION) if self._has_sessions or self.tab == MOTION else TABS

    @property
    def assets(self) -> AssetsPane:
        return self.query_one(AssetsPane)

    def compose(self) -> ComposeResult:
        take_height(self)
        yield Bar(id="tabs")
        yield Bar([Item(name, BY_ID[name].label) for name in TOOLS], id="tools")
        with ContentSwitcher(initial="assets", id="panes"):
            yield AssetsPane(self.session.sheet, self.clipboard)
        yield Static(id="message")
        yield StatusLine()
        yield KeyLine()

    def _forward_event(self, event: events.Event) -> None:
        if is_free_for(self, event):
            super()._forward_event(event)

    def on_resize(self) -> None:
        self._show_bars()
        self._show_clip()

    def on_unmount(self) -> None:
        self.coverage.cancel()
        self.following.close()

    # ---- display

    def show(self) -> None:
        """Show the table, and its messages, as it is now."""
        table = self.session.sheet.table
        self.coverage.follow(table)
        self.test_row.follow(table)
        self.assets.show()
        self._show_bars()
        if self.tab != "assets":
            self._pane(self.tab).show()

    def _show_bars(self) -> None:
        mark = " *" if self.session.sheet.is_modified else ""
        reads = " (read-only)" if self.session.is_read_only else ""
        items = [Item("open", f"{self.table_name}{mark}{reads}", is_strong=True)]
        items += [Item(tab, BY_ID[tab].label, is_on=tab == self.tab, is_spare=self._is_spare(tab)) for tab in self.tabs]
        has_tools = self.size.height >= WITH_TOOLS
        self.query_one("#tools", Bar).display = has_tools
        items += [] if has_tools else [Item("palette", f"^P {BY_ID['palette'].label}")]
        self.query_one(KeyLine).leave_out(() if has_tools else ("app.command_palette",))
        table = self.session.sheet.table
        about = f"{plural(table.n_rows, 'row')} · {plural(len(table.columns), 'column')}"
        self.query_one("#tabs", Bar).show(items, about)
        self.show_summary()

    def _is_spare(self, tab: str) -> bool:
        """Whether a tab gives way on a narrow screen."""
        return tab == CONTRACTS != self.tab and not self.session.sheet.table.schema.contracts

    def show_summary(self) -> None:
        """Say what plays, and how much of the table is valid, displayed and selected."""
        self.assets.show_answer()
        self.query_one(StatusLine).show(right=self.assets.summary())

    def say(self, text: str, level: str = "information") -> None:
        """Say something in the line over the footer; nothing takes a message away."""
        is_quiet = level == "information"
        self._is_of_verb = False
        status = self.query_one(StatusLine)
        is_short = is_quiet and status.has_room(text)
        status.show(text if is_short else "")
        if (text, level) == self._notice:
            return
        self._notice, line = (text, level), self.query_one("#message", Static)
        if not is_short:
            line.update(Text(text if is_quiet else f"! {text}"))
        if not is_short or line.display:
            line.set_classes("" if is_short else f"-{level}")

    @on(Notice)
    def _show_notice(self, event: Notice) -> None:
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
        self._show_clip()

    def _new_pane(self, name: str) -> Pane:
        sheet = self.session.sheet
        if name == "options":
            return OptionsPane(sheet, id=name)
        if name == "priorities":
            from ..panes.priorities import PrioritiesPane  # with all of motion

            return PrioritiesPane(sheet, id=name)
        if name == MOTION:
            from ..panes.motion import MotionPane  # loads the motion search

            return MotionPane(self.workspace.folder, id=name)
        if name == CONTRACTS:
            from ..panes.contracts import ContractsPane  # loads the prover

            return ContractsPane(sheet, id=name)
        return self._coverage_pane(name) if name == "coverage" else ProblemsPane(sheet, id=name)

    def _coverage_pane(self, name: str) -> Pane:
        from ..panes.coverage import CoveragePane

        return CoveragePane(
            self.session.sheet, self.coverage, lambda: self.following.followed_moments, self.workspace.folder, id=name
        )

    async def action_next_tab(self, by: int) -> None:
        """Go to the tab beside."""
        tabs = self.tabs
        await self.action_tab(tabs[(tabs.index(self.tab) + by) % len(tabs)])

    def action_clip(self) -> None:
        """Show the animation at the side of the table and of the gaps, or hide it."""
        from ..panes.clip import Clips  # loads the motion search

        self._clips = self._clips or Clips(lambda: self.session.sheet.table)
        self._clips.is_open = not self._clips.is_open
        if self.tab not in WITH_SIDE:
            self._switch_to("assets")
        else:
            self._show_clip()

    def _show_clip(self) -> None:
        """Make the animation of the tab that is seen, or hide it."""
        if self._clips is None or self.tab not in WITH_SIDE:
            return
        from ..panes.clip import ClipPane

        pane, side = self._pane(self.tab), self._pane(self.tab).query_one("#side")
        shower = next(iter(pane.query(ClipPane)), None)
        if shower is None and self._clips.is_open:
            side.mount(ClipPane(self._clips, lambda: pane.assets_here), before=0 if side.children else None)
        elif shower is not None:
            shower.turn()

    def action_help(self) -> None:
        from .help import HelpDialog

        self.app.push_screen(HelpDialog(self.app.settings.keys))

    def action_history(self) -> None:
        history = self.session.sheet.history

        StepsDialog(history.names, history.position).ask(
            self.app, lambda position: self.edited(Edited(self.session.sheet.go_to_step(position)))
        )

    def apply(self, edit: Edit, notes: Sequence[str] = ()) -> None:
        """Make an edit, show it and say what was done; what cannot be done is reported."""

        def made() -> None:
            done = self.session.sheet.apply(edit)
            self.edited(Edited(replace(done, warnings=(*done.warnings, *notes))))

        self.try_to(made)

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
        self.test_row.begin()
        self._show_bars()

    @property
    def likely_group(self) -> str:
        """The group of the commands that somebody likely wants here."""
        grid = self.assets.grid
        if self.tab != "assets" or grid.is_in_test_row:
            return "Test row" if grid.is_in_test_row else "Tabs"
        return "Columns" if self.session.sheet.block.shape[0] > 1 == self.session.sheet.block.shape[1] else "Edit"

    def try_to(self, verb: Callable[[], None]) -> None:
        """Do something; what cannot be done is reported."""
        try:
            verb()
        except ContextDBError as error:
            self.say(str(error), "error")

    @on(GoToCell)
    def go_to_cell(self, event: GoToCell) -> None:
        self._switch_to("assets")
        self.assets.go_to(event.row, event.column)

    @on(SetContext)
    def set_context(self, event: SetContext) -> None:
        """Make these the facts of the test row; a game is not followed any more."""
        self.following.stop()
        self._switch_to("assets")
        self.assets.set_context(dict(event.facts), event.name)

    def _pane(self, name: str) -> Pane:
        return self.query_one(f"#{name}", Pane)
