"""What all dialogs share: a titled box in the middle, its keys at the foot, Escape to leave.

A dialog is given what it shows, and gives back what was decided, or None. It changes nothing itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar, Generic, TypeVar

from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.content import Content
from textual.filter import LineFilter
from textual.screen import ModalScreen, Screen
from textual.widgets import Static

from ..contrast import without

Answer = TypeVar("Answer")


def take_height(screen: Screen[Any]) -> None:
    """Give a screen the class of its height before its parts are made: later on, Textual would style each part anew."""
    height = screen.app.size.height
    reached = [name for least, name in sorted(screen.app.VERTICAL_BREAKPOINTS or ()) if height >= least]
    screen.add_class(*reached[-1:], update=False)


def buttons(parts: Sequence[tuple[str, str]]) -> Content:
    """What can be done, to click: actions of the screen with their labels, which look like the buttons of a form."""
    return Content(" ").join(Content.from_markup(f"[@click=screen.{action}] $label [/]", label=label) for action, label in parts)


class Dialog(ModalScreen[Answer | None], Generic[Answer]):
    """A box over the sheet. Children say `title_text`, `keys_text` and `compose_body`."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "cancel", "Cancel", show=False)]

    DEFAULT_CSS = """
    Dialog {
        align: center middle;
        background: $background 60%;
        & Static { link-background: $panel; link-style: bold; }
        & Static { link-background-hover: $primary 40%; link-style-hover: bold underline; }
        & > #dialog {
            width: 76; max-width: 96%; height: auto; max-height: 92%;
            background: $surface; border: round $primary; border-title-color: $text; border-title-style: bold;
            border-subtitle-color: $text-muted; padding: 1 2;
        }
        &.-broad > #dialog { width: 70%; min-width: 76; }
        &.-wide > #dialog { width: 90%; min-width: 76; height: 90%; }
        & > #dialog > #dialog-body { height: auto; max-height: 100%; }
        &.-wide > #dialog > #dialog-body { height: 1fr; }
    }
    """

    title_text = ""
    """Stands in the upper border."""
    keys_text = "Esc cancel"
    """Which keys do what, in the lower border."""

    def compose(self) -> ComposeResult:
        take_height(self)
        with Vertical(id="dialog") as box, Vertical(id="dialog-body"):
            yield from self.compose_body()
        box.border_title = self.title_text
        box.border_subtitle = self.keys_text

    def ask(self, app: App[Any], then: Callable[[Answer], object]) -> None:
        """Show the box, and go on with its answer; it may be left without one."""

        def left(answer: Answer | None) -> None:
            if answer is not None:
                then(answer)

        app.push_screen(self, left)

    def compose_body(self) -> ComposeResult:
        """What is in the box."""
        yield Static()

    def get_line_filters(self) -> Sequence[LineFilter]:
        """What lies behind stays dim."""
        return without(super().get_line_filters())

    def action_cancel(self) -> None:
        """Leave without an answer."""
        self.dismiss(None)
