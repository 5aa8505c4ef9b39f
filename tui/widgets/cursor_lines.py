"""What lists that paint themselves share: lines under a head, one of them with the cursor, and the names of styles."""

from __future__ import annotations

import re
from typing import ClassVar

from textual import events
from textual.binding import Binding, BindingType
from textual.widget import Widget

UP_DOWN: list[BindingType] = [
    Binding("up", "move(-1)", "Up", show=False),
    Binding("down", "move(1)", "Down", show=False),
]
FAR = 10**9
FIRST_LAST: list[BindingType] = [
    Binding("home", f"move(-{FAR})", "First", show=False),
    Binding("end", f"move({FAR})", "Last", show=False),
]
"""For lists under a `ListFilter`."""
PAGES: list[BindingType] = [
    Binding("pageup", "page(-1)", "Page up", show=False),
    Binding("pagedown", "page(1)", "Page down", show=False),
]


def style_names(css: str) -> set[str]:
    """The names of the styles that CSS declares, such as `bars--head`."""
    return set(re.findall(r"\.([a-z][a-z-]*--[\w-]+)", css))


class CursorLines(Widget, can_focus=True):
    """Lines under a head; as many as fit are seen, the one of the cursor always."""

    ALLOW_SELECT = False
    BINDINGS: ClassVar[list[BindingType]] = UP_DOWN

    at = 0
    """The line of the cursor."""
    top = 0
    """The first line that is seen."""

    @property
    def n_lines(self) -> int:
        raise NotImplementedError

    def moved(self) -> None:
        """The cursor was put on a line."""

    def clicked(self, x: int) -> None:
        """The line of the cursor was clicked so far from the left."""

    def go(self, at: int) -> None:
        if self.n_lines:
            self.at = min(max(0, at), self.n_lines - 1)
            self.keep_in_sight()
            self.refresh()
            self.moved()

    def keep_in_sight(self) -> None:
        """Let the line of the cursor be seen."""
        self.top = min(max(self.top, self.at - self.room + 1), self.at)
        self.top = max(0, min(self.top, self.n_lines - self.room))

    @property
    def room(self) -> int:
        """How many lines are seen."""
        return max(1, self.size.height - 1)

    def action_move(self, by: int) -> None:
        self.go(self.at + by)

    def action_page(self, by: int) -> None:
        """As far as is seen."""
        self.go(self.at + by * max(1, self.room - 1))

    def on_resize(self) -> None:
        self.keep_in_sight()

    def on_click(self, event: events.Click) -> None:
        """Go to the line under the mouse."""
        place = event.get_content_offset(self)
        if place is not None and place.y >= 1 and self.top + place.y - 1 < self.n_lines:
            self.go(self.top + place.y - 1)
            self.clicked(place.x)
