"""What stands on the screen until a running game has decided anything."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.screen import Screen
from textual.timer import Timer
from textual.widgets import Static

from .game import Live
from .key_line import DebugKeyLine

LOOK_S = 0.1


class WaitingScreen(Screen[None]):
    """Waits for the first decision; `then` is called with it there."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("q,escape", "leave", "Leave")]
    DEFAULT_CSS = """
    WaitingScreen { align: center middle; & > #waiting { width: auto; max-width: 90%; height: auto; } }
    """

    def __init__(self, live: Live, then: Callable[[], None], leave: Callable[[], None]) -> None:
        super().__init__()
        self.live, self._then, self._leave = live, then, leave
        self._timer: Timer | None = None

    def compose(self) -> ComposeResult:
        yield Static(id="waiting")
        yield DebugKeyLine()

    def on_mount(self) -> None:
        self._timer = self.set_interval(LOOK_S, self.look)
        self.look()

    def look(self) -> None:
        """Show the game's first decision once it is there."""
        if self._timer is not None and self.live.take():
            self._timer.stop()
            self._timer = None  # what comes from here on is for the screen of the game
            self._then()
        if self._timer is None:
            return
        notes = self.live.notes or "it has decided nothing yet"
        watched = "The game publishes the decisions of what it watches: link.watch(controller, who)."
        self.query_one("#waiting", Static).update(f"{self.live.name}: {notes}\n\n{watched}")

    def action_leave(self) -> None:
        self.live.close()
        self._leave()
