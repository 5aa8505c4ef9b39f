"""What is done with the test row: contexts to load and step through, actors for the roles, and why a row is not valid."""

from __future__ import annotations

from contextlib import suppress
from typing import Any, Protocol

from textual.app import App

from contextdb.edits.edits import set_cells
from contextdb.errors import ContextDBError
from contextdb.tables.changes import Edit
from contextdb.tables.table import Table

from ..clipboard import Clipboard
from ..messages import GoToCell, SetContext
from ..model.context_list import ContextList
from ..model.session import Session
from ..model.teams import Teams, roles_of
from ..panes.why import NO_FACTS
from .actors import ActorsDialog
from .contexts import ContextsDialog, Loaded
from .nearest import CellAnswer, NearestDialog


class Valid(Protocol):
    """What shows which assets are valid: the pane of assets."""

    def refresh_valid(self) -> None:
        """Show them anew."""


class Asking(Protocol):
    """What the test row needs of the screen that it stands on: `tui.screens.main.MainScreen`."""

    session: Session
    clipboard: Clipboard

    @property
    def app(self) -> App[Any]: ...

    @property
    def assets(self) -> Valid: ...

    def say(self, text: str, level: str = "information") -> None:
        """Say something in a line below."""

    def show(self) -> None:
        """Show what has changed."""

    def set_context(self, event: SetContext) -> None:
        """Fill the test row."""

    def go_to_cell(self, event: GoToCell) -> None:
        """Go to a cell."""

    def apply(self, edit: Edit) -> None:
        """Make an edit."""


class TestRow:
    """The test row of one screen."""

    def __init__(self, screen: Asking) -> None:
        self.screen, self.session = screen, screen.session
        self.list: ContextList | None = None
        """The contexts that F7 and F8 step through."""

    def follow(self, table: Table) -> None:
        """Stand on the table as it is now."""
        if self.list is not None:
            self.list.show(table)
        teams, query = self.session.teams, self.session.sheet.query
        if teams is not None and query.actors and teams.of(table) is not teams:
            query.offer(self._teams().offered)

    # ---- contexts

    def contexts(self) -> None:
        """Look through saved or recorded contexts."""

        def loaded(answer: Loaded) -> None:
            self.list = answer.contexts
            self._load()

        sheet = self.session.sheet
        ContextsDialog(sheet.table, sheet.query.texts, self.list, bool(sheet.query.actors)).ask(self.screen.app, loaded)

    def step(self, by: int) -> None:
        """Load the next context, or the one before; of the saved ones where none were looked at yet."""
        if self.list is None:
            self.list = ContextList.beside(self.session.sheet.table)
        if self.list.next() if by > 0 else self.list.previous():
            self._load()
        else:
            self.screen.say("There is no other context. F9 opens a file of contexts, or saves the test row.")

    def begin(self) -> None:
        """Load the first saved context into a test row that says nothing yet, where there is one that can be read."""
        if not self.session.sheet.query.is_empty:
            return
        with suppress(ContextDBError):
            self.list = ContextList.beside(self.session.sheet.table)
            if self.list.next():
                self._load()

    def _load(self) -> None:
        if self.list is not None:
            self.screen.set_context(SetContext(self.list.texts, self.list.title))

    # ---- actors

    def actors(self) -> None:
        """Say who may play each role."""
        sheet = self.session.sheet
        if not roles_of(sheet.table):
            self.screen.say("This table has no roles: a condition of one is named like Defender.DepthChart.")
            return

        def decided(teams: Teams) -> None:
            sheet.ask("the actors", actors=teams.offered)
            self.screen.assets.refresh_valid()
            self.screen.show()

        ActorsDialog(sheet.table, self._teams(), self.screen.clipboard).ask(self.screen.app, decided)

    def _teams(self) -> Teams:
        """The actors for the table as it is; at first those of the file next to it."""
        table, teams = self.session.sheet.table, self.session.teams
        self.session.teams = Teams.beside(table) if teams is None else teams.of(table)
        return self.session.teams

    # ---- what is picked, and why

    def picks(self) -> None:
        """The next picks, as a game would make them."""
        sheet = self.session.sheet
        if sheet.query.is_empty or sheet.query.answer is None:
            self.screen.say(NO_FACTS if sheet.query.is_empty else "The table cannot be asked: see Problems.")
            return
        from .next_picks import NextPicksDialog  # loads the picker

        dialog = NextPicksDialog(sheet.query.answer, sheet.table.asset_column)

        dialog.ask(self.screen.app, self.screen.go_to_cell)

    def why(self) -> None:
        """Why the row of the cursor is not valid, and which rows are nearest."""
        sheet = self.session.sheet
        if sheet.query.is_empty:
            self.screen.say(NO_FACTS)
            return
        row = int(sheet.view.rows[sheet.cursor[0]]) if len(sheet.view) else None
        NearestDialog(sheet.query, sheet.table, row).ask(self.screen.app, self._answered)

    def _answered(self, answer: CellAnswer) -> None:
        self.screen.go_to_cell(GoToCell(answer.row, answer.column))
        if answer.text is not None:
            self.screen.apply(set_cells(self.session.sheet.table, [(answer.row, answer.column, answer.text)]))
