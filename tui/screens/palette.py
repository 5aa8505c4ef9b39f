"""The palette of commands, and that of themes: Textual's, in the frame of a dialog."""

from __future__ import annotations

from collections.abc import Sequence

from textual.command import CommandPalette, ProviderSource
from textual.filter import LineFilter

from ..contrast import without


class Palette(CommandPalette):
    """A list to search, with a title and its keys; what lies behind stays dim."""

    def __init__(self, title: str, providers: ProviderSource | None = None) -> None:
        super().__init__(providers, placeholder="type to filter", id="--command-palette")
        self._frame_title = title

    def on_mount(self) -> None:
        box = self.query_one("#--container")
        box.border_title, box.border_subtitle = self._frame_title, "↑↓ choose · Enter OK · Esc cancel"

    def get_line_filters(self) -> Sequence[LineFilter]:
        """What lies behind stays dim."""
        return without(super().get_line_filters())
