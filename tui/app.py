"""The application: a workspace of tables, one screen for each that is open, themes and keys."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any, ClassVar, cast

from textual.app import App, SystemCommand
from textual.binding import BindingType
from textual.color import Color
from textual.command import CommandPalette
from textual.filter import LineFilter
from textual.message import Message
from textual.screen import Screen
from textual.theme import BUILTIN_THEMES, ThemeProvider

from contextdb.errors import ContextDBError
from contextdb.tables.merging.conflicts import Side
from contextdb.tables.merging.merging import Merge
from contextdb.tables.table import Table

from .commands import BY_ID, COMMANDS, bindings, key_names
from .contrast import READABLE
from .editor import Editor
from .editor_settings import EditorSettings
from .messages import GoToCell
from .model.conflicted import conflicts_in, sides_in, write_decided
from .model.importing import Import
from .model.session import Session
from .model.workspace import Workspace
from .screens.begin import Begin
from .screens.conflicts import ConflictsDialog
from .screens.leaving import HeldDialog, LeavingDialog
from .screens.main import MainScreen
from .screens.palette import KEY_WIDTH, Commands, Palette
from .themes import DARK, THEMES

MOST_USED = 6
LOW, TALL = 14, 30
"""On a screen of fewer lines than the first the details give way to the rows. On one of as many as the second a dialog with a list
is no higher than its lines."""


class EditorApp(Editor):
    """The terminal editor."""

    TITLE = "contextdb"
    ENABLE_COMMAND_PALETTE = True
    BINDINGS: ClassVar[list[BindingType]] = bindings([BY_ID["palette"]])
    CSS: ClassVar[str] = """
    CommandPalette SearchIcon { display: none; }
    CommandPalette > Vertical, CommandPalette:dark > Vertical {
        width: 76; max-width: 96%; height: auto; max-height: 86%; margin-top: 2; padding: 0 1; visibility: visible;
        background: $surface; border: round $primary;
        border-title-color: $text; border-title-style: bold; border-subtitle-color: $text-muted;
    }
    CommandPalette #--input, CommandPalette #--input.--list-visible { border: none; height: 1; }
    CommandPalette CommandInput, CommandPalette CommandInput:focus { border: none; height: 1; padding: 0; background: $surface; }
    CommandPalette #--results { overlay: none; background: $surface; margin: 1 0 0 0; }
    CommandPalette CommandList, CommandPalette CommandList:focus { border: none; background: $surface; max-height: 60vh; }
    OptionList { min-width: 8; }
    OptionList:ansi > .option-list--option-highlighted { background: ansi_blue; color: ansi_bright_white; }
    CommandPalette:ansi > .command-palette--help-text { color: ansi_default; text-style: none; }
    Button.-textual-compact {
        width: auto; min-width: 0; padding: 0; margin: 0 1 0 0; background: $panel; text-style: bold;
        &:focus, &:hover { background: $primary 40%; text-style: bold underline; }
        &:ansi:focus, &:ansi:hover { background: ansi_blue; color: ansi_bright_white; }
    }
    SheetBar Button.-textual-compact { background: $surface; }
    Dialog OptionList, Dialog OptionList:focus { background: $surface; }
    .-low {
        & StatusLine, & #coverage-bar { display: none; }
        & #coverage-detail, & #problems-detail { max-height: 0; border-top: none; }
        & #coverage-state, & #priorities-context { max-height: 1; }
        & #coverage-sections, & #problems-levels { margin: 0; }
        & #dialog { width: 100%; max-width: 100%; height: auto; max-height: 100%; padding: 0 1; }
        & #dialog-body { overflow-y: auto; }
    }
    """
    VERTICAL_BREAKPOINTS = [(0, "-low"), (LOW, "-high"), (TALL, "-tall")]  # noqa: RUF012 - Textual declares it so

    def __init__(
        self,
        workspace: Workspace,
        settings: EditorSettings | None = None,
        theme: str = "",
        at: GoToCell | None = None,
        follow: str = "",
    ) -> None:
        super().__init__()
        self._at = at
        """The cell that is gone to first."""
        self._follow = follow
        """The game that is followed as soon as it asks the first table."""
        self._debugger: Any = None
        """The debugger, once it was requested: a `tui.debug.inside.Inside`."""
        self.workspace = workspace
        self.settings = settings or EditorSettings()
        for one in THEMES:
            self.register_theme(one)
        self.theme = theme or self.settings.theme or DARK
        self.set_keymap(dict(self.settings.keys))
        self._used: list[str] = []
        """The commands that were run by the palette, the last one last."""
        self._outer: list[str] = []
        """The tables whose rows were gone into, and not come back from."""

    @staticmethod
    def theme_names() -> list[str]:
        return sorted([*(theme.name for theme in THEMES), *BUILTIN_THEMES])

    def get_css_variables(self) -> dict[str, str]:
        """The colours of the theme; fields and buttons stand out from the page in those, too, that have one colour for both."""
        variables = super().get_css_variables()
        if variables["panel"] == variables["surface"] and not variables["panel"].startswith(("ansi", "transparent")):
            variables["panel"] = Color.parse(variables["surface"]).blend(Color.parse(variables["foreground"]), 0.12).hex
        return variables

    def get_line_filters(self) -> Sequence[LineFilter]:
        """What is done to all that is painted: every text can be read."""
        return [*super().get_line_filters(), READABLE]

    def action_command_palette(self) -> None:
        if not CommandPalette.is_open(cast(App[object], self)):
            self.push_screen(Palette("Commands", [Commands]))

    def likely_commands(self) -> dict[str, int]:
        """The places of the commands that come first in the palette: those used last, then those for where the cursor is."""
        group = self.main.likely_group if self._has_table else "File"
        labels = [BY_ID[name].label for name in reversed(self._used)]
        labels += [command.label for command in COMMANDS if command.group == group and command.is_listed]
        return {label: place for place, label in enumerate(dict.fromkeys(labels))}

    def on_resize(self) -> None:
        """In a browser, what the letters leave of the window has the colour of the keys' line. Each window that opens resizes."""
        panel = self.get_css_variables()["panel"]
        if self.is_web and self._driver is not None and panel.startswith("#"):
            self._driver.write(f"\x1b]11;{panel[:7]}\x07")

    def search_themes(self) -> None:
        self.push_screen(Palette("Theme", [ThemeProvider]))

    def on_mount(self) -> None:
        self.theme_changed_signal.subscribe(self, lambda _: self.on_resize())
        if self.workspace.beginning is not None:
            Begin(self, self.workspace, self.workspace.beginning).ask()
        else:
            self.open_table(self.workspace.first)
            if self._at is not None:
                self.main.call_after_refresh(self.main.go_to_cell, self._at)
            if self._follow:
                self.main.call_after_refresh(self.main.expect_game, self._follow)

    # ---- the debugger

    def on_debug_wanted(self, message: Message) -> None:
        """Show the debugger of a session, or of a running game once it has decided something."""
        from .debug.inside import Inside  # loads the motion search

        self._debugger = self._debugger or Inside(self)
        self._debugger.show(message)

    def on_row_wanted(self, message: Message) -> None:
        """Leave the debugger for a row of a table."""
        left: tuple[str, GoToCell] | None = self._debugger.leave(message, self.workspace.files)
        if left is None:
            return
        name, place = left
        if name != self.main.table_name:
            self.open_table(name)
        self.call_later(lambda: self.main.call_after_refresh(self.main.go_to_cell, place))

    # ---- tables

    @property
    def main(self) -> MainScreen:
        """The screen of the table that is seen."""
        return next(screen for screen in reversed(self.screen_stack) if isinstance(screen, MainScreen))

    def say_renamed(self, text: str) -> None:
        """Say on the screen that is displayed now that a condition was renamed, also after its next change."""
        self.main.renamed = text

    def go_to_cell(self, place: GoToCell) -> None:
        """Go to a cell of the table that was just opened, once it is seen."""
        self.main.call_after_refresh(self.main.go_to_cell, place)

    def begun_with(self, answer: Import) -> None:
        """Put rows into the table that was just opened, once it is seen."""
        self.main.call_after_refresh(self.main.take_import, answer)

    def open_table(self, name: str) -> None:
        """Show a table; one with a conflict between marks asks first which side holds."""
        try:
            session = self.workspace.session(name)
        except ContextDBError as error:
            merged = conflicts_in(self.workspace.files[name])
            if merged is None:
                self._refused(str(error))
            else:
                self._decide(name, merged)
            return
        self._show_table(name, session)

    def go_into(self, name: str, outer: str, facts: Mapping[str, str]) -> None:
        """Show the table that a row of another refers to, at its first row that is valid for these facts."""
        try:
            sheet = self.workspace.session(name).sheet
        except ContextDBError as error:
            self._refused(str(error))
            return
        if facts:
            sheet.query.load(facts)
            valid = sheet.query.valid
            if valid.any():
                sheet.go_to(int(valid.argmax()))
        self._outer.append(outer)
        self.open_table(name)
        self.main.came_from = outer

    def go_back(self) -> bool:
        """Show the table again from which this one was gone into; False where there is none."""
        if not self._outer:
            return False
        self.open_table(self._outer.pop())
        return True

    def _show_table(self, name: str, session: Session) -> None:
        self.workspace.know_others(name)
        screen = MainScreen(self.workspace, name)
        if self._has_table:
            self.switch_screen(screen)
        else:
            self.push_screen(screen)
        if session.holder is not None:
            self.push_screen(HeldDialog(name, session.holder), lambda answer: self._held(name, answer))

    def _held(self, name: str, answer: str | None) -> None:
        if answer == "take-over":
            self.workspace.reopen(name, takes_over=True)
            self.open_table(name)

    def _decide(self, name: str, merged: Merge[Table]) -> None:
        path = self.workspace.files[name]

        def decided(sides: Mapping[int, Side] | None) -> None:
            if sides is None:
                self._refused(f"{path.name} holds a merge conflict, so it is not opened.")
                return
            write_decided(path, merged.resolved(sides))
            self.open_table(name)
            self.say_renamed(f"{path.name} is written without marks. git add {path.name} tells git that it is solved.")

        self.push_screen(ConflictsDialog(merged.conflicts, path.name, sides_in(path)), decided)

    def _refused(self, text: str) -> None:
        if self._has_table:
            self.main.say(text, "error")
        else:
            self.exit(return_code=2, message=text)

    def get_system_commands(self, screen: Screen[object]) -> Iterable[SystemCommand]:
        for command in COMMANDS if self._has_table else ():
            if command.is_listed and command.id != "palette":
                keys = key_names(self.settings.keys.get(command.id, command.keys))
                about = f"{keys[0] if keys else '':<{KEY_WIDTH}} {command.about}"
                yield SystemCommand(command.label, about, partial(self._run, command.id))
        yield SystemCommand("Theme", "Other colours.", self.action_change_theme)
        yield SystemCommand("Screenshot", "Keep a picture of the screen as SVG.", self.deliver_screenshot)

    @property
    def _has_table(self) -> bool:
        return any(isinstance(one, MainScreen) for one in self.screen_stack)

    def _run(self, name: str) -> None:
        self._used = [*(one for one in self._used if one != name), name][-MOST_USED:]
        self.call_later(self.main.run_command, name)

    async def action_quit(self) -> None:
        """Quit; asks about unsaved edits."""
        unsaved = self.workspace.unsaved
        if unsaved:
            self.push_screen(LeavingDialog(unsaved), self._leave_with)
        else:
            self._leave()

    def _leave_with(self, answer: str | None) -> None:
        if answer == "save" and not self._save_all():
            return
        if answer is not None:
            self._leave()

    def _save_all(self) -> bool:
        for name in self.workspace.unsaved:
            try:
                self.workspace.session(name).save()
            except ContextDBError as error:
                self.main.say(f"{name} is not saved: {error}", "error")
                return False
        return True

    def _leave(self) -> None:
        self.workspace.close()
        self.exit()
