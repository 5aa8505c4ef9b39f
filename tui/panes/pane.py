"""What all tabs share."""

from __future__ import annotations

from textual.widget import Widget


class Pane(Widget):
    """What is behind a tab."""

    def show(self) -> None:
        """Show the sheet as it is now: called when the tab is gone to, and after every edit while it is seen."""
        raise NotImplementedError

    def take_focus(self) -> None:
        """Give the keys to the part of the tab that mostly has them."""
        self.focus()
