"""What all tabs share."""

from __future__ import annotations

from collections.abc import Sequence

from textual.containers import Vertical
from textual.widget import Widget

ROOMY = 26
"""In a tab of so many lines a list is as high as its lines, and the rows that it is about stand below it."""


class Shower(Vertical):
    """What plays clips; it is made when it is first opened, since it loads the motion search."""

    def follow(self, assets: Sequence[str]) -> None:
        """Play the clips of these, one after another."""
        raise NotImplementedError


class Pane(Widget):
    """What is behind a tab."""

    DEFAULT_CSS = """
    Pane.-roomy {
        & LineList, & HeatMap { height: auto; max-height: 50vh; }
        & ContentSwitcher { height: auto; }
        & RowsBelow.-filled { display: block; height: 1fr; max-height: 100%; }
        & #about { height: auto; max-height: 70vh; }
        & #coverage-detail, & #problems-detail { max-height: 10; }
    }
    """

    def show(self) -> None:
        """Show the sheet as it is now: called when the tab is gone to, and after every edit while it is seen."""
        raise NotImplementedError

    @property
    def assets_here(self) -> Sequence[str]:
        """The assets that the cursor is on, to be played in turn."""
        return ()

    def follow_clip(self) -> None:
        """Play the clips of what the cursor is on, where the animation is shown."""
        for shower in self.query(Shower):
            shower.follow(self.assets_here)

    def take_focus(self) -> None:
        """Give the keys to the part of the tab that mostly has them."""
        self.focus()

    def on_resize(self) -> None:
        self.set_class(self.size.height >= ROOMY, "-roomy")
