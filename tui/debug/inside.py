"""The debugger inside the editor: displayed for a session or a running game, and left for a row of a table."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from textual.app import App
from textual.message import Message

from contextdb.disk import real_path

from ..messages import GoToCell
from ..panes.motion import DebugWanted
from .game import Live
from .recording import Recording
from .screen import DebugScreen, RowWanted, Start
from .waiting import WaitingScreen


class Inside:
    """The debugger of an editor, which remembers where each session was left."""

    def __init__(self, app: App[Any]) -> None:
        self._app = app
        self._starts: dict[str, Start] = {}
        """Where sessions were left for a row of a table."""

    def show(self, message: Message) -> None:
        """Show the session of a `DebugWanted`, or a running game once it has decided something."""
        recording = cast(DebugWanted, message).recording
        if isinstance(recording, Recording):
            self._app.push_screen(DebugScreen(recording, start=self._starts.get(recording.file), is_inside=True))
        elif recording.recording is None:
            self._app.push_screen(WaitingScreen(recording, lambda: self._begun(recording), self._left_waiting))
        else:
            self._show_live(recording)

    def leave(self, message: Message, files: Mapping[str, Path]) -> tuple[str, GoToCell] | None:
        """Leave the debugger for the row of a `RowWanted`: its table and cell; None where the editor does not have the table."""
        wanted, screen = cast(RowWanted, message), self._app.screen
        if not isinstance(screen, DebugScreen):
            return None
        path = real_path(wanted.table)
        name = next((name for name, file in files.items() if real_path(file) == path), None)
        if name is None:
            screen.say(f"{wanted.table} is not a table of the editor.", is_error=True)
            return None
        self._starts[screen.recording.file] = wanted.start
        screen.action_quit()
        return name, GoToCell(wanted.row, wanted.column)

    def _left_waiting(self) -> None:
        self._app.pop_screen()

    def _begun(self, live: Live) -> None:
        self._app.pop_screen()
        self._show_live(live)

    def _show_live(self, live: Live) -> None:
        assert live.recording is not None, "was waited for"
        self._app.push_screen(DebugScreen(live.recording, live=live, is_inside=True), lambda _: live.close())
