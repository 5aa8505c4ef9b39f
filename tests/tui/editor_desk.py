"""A small app with a cell editor in it, for the tests of the editor."""

from collections.abc import Callable
from typing import Any

from terminal import drive, screen_text
from textual.app import App, ComposeResult
from textual.geometry import Region
from textual.pilot import Pilot
from textual.widgets import Button, Static

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import ANGLE, BOOL, Domain
from contextdb.cells.facts import read_fact_text
from contextdb.edits import edits
from contextdb.errors import ContextError, Fault
from tui.widgets.cell_editor import CellEditor
from tui.widgets.editing.popup import Popup

HIT = Condition("hit", BOOL)
CHART = Condition("chart", Domain("enum", ("CB", "FS", "SS", "LB", "Half Back")))
STATE = Condition("state", Domain("tags", ("InAir", "Move.Run", "Stunned")))
SPEED = Condition("speed", Domain("number", None, 0.0, 7.0), "m/s")
STEPS = Condition("steps", Domain("int", None, 0.0, 10.0))
WAY = Condition("way", ANGLE, "degrees")
SIDE = Condition("side", Domain("text"))
CELL = Region(20, 10, 16, 1)


class Desk(App[None]):
    """Something to click elsewhere on, and an editor over it."""

    def __init__(self, condition: Condition | None, text: str, at: Region = CELL, kind: str = "", **more: Any) -> None:
        super().__init__()
        self.said: list[CellEditor.Outcome] = []
        self._more = {"check": checker(condition, more.get("is_fact", False)), "known": (), "on_done": self.said.append, **more}
        self._of = condition, kind or condition.domain.kind, text
        self.at = at

    def compose(self) -> ComposeResult:
        yield Static("the sheet")
        yield Button("elsewhere")

    async def on_mount(self) -> None:
        self.editor = CellEditor()
        self.editor.place(self.at, self.size)
        self.editor.open(*self._of, **self._more)
        await self.screen.mount(self.editor)

    def look(self) -> None:
        """Remember where everything stands: an app that has ended no longer knows."""
        popup = self.query_one(Popup)
        self.entry_at, self.popup_at = self.editor.region, popup.region if popup.display else None


def checker(condition: Condition | None, is_fact: bool) -> Callable[[str], Fault | None]:
    def check(text: str) -> Fault | None:
        if condition is None:
            return None
        if not is_fact:
            return edits.check_text(condition, text)
        try:
            read_fact_text(text, condition)
        except ContextError as error:
            return error.faults[0]
        return None

    return check


def press(desk: Desk, *keys: str, size: tuple[int, int] = (80, 24)) -> str:
    """Press keys; gives the screen."""

    async def script(pilot: Pilot[Any]) -> str:
        await pilot.press(*keys)
        await pilot.pause()
        desk.look()
        return screen_text(desk)

    return drive(desk, script, size)


def committed(desk: Desk) -> tuple[str, int, int, bool]:
    """The one message of a desk."""
    (message,) = desk.said
    assert isinstance(message, CellEditor.Committed)
    return message.text, message.down, message.right, message.is_fill


def taken(condition: Condition | None, text: str, *keys: str, **more: Any) -> str:
    """The text that is committed after keys."""
    desk = Desk(condition, text, **more)
    press(desk, *keys)
    return committed(desk)[0]


def line_at(screen: str, at: Region = CELL) -> str:
    return screen.splitlines()[at.y]
