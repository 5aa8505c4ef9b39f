"""The palette of commands, and that of themes: Textual's, in the frame of a dialog."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

from textual.app import SystemCommand
from textual.command import CommandPalette, DiscoveryHit, Hit, Hits, Provider, ProviderSource
from textual.filter import LineFilter

from ..commands import COMMANDS
from ..contrast import without
from ..model.finding import Findable
from ..words import WORDS

if TYPE_CHECKING:
    from ..app import EditorApp

_IDS = {command.label: command.id for command in COMMANDS if command.is_listed}
KEY_WIDTH = 11
"""Of the keys in front of the sentence about a command."""


class Commands(Provider):
    """The commands of the app: by their names, other names and what they do; without a query those used last, then what fits."""

    async def discover(self) -> Hits:
        """All of them, the likeliest first."""
        app = cast("EditorApp", self.app)
        first = app.likely_commands()
        commands = sorted(app.get_system_commands(self.screen), key=lambda one: (first.get(one.title, len(first)), one.title))
        for command in commands:
            yield DiscoveryHit(command.title, command.callback, help=command.help)

    async def search(self, query: str) -> Hits:
        """Those that fit; those that Textual's looser search finds come last."""
        matcher = self.matcher(query)
        for command in self.app.get_system_commands(self.screen):
            rank, loose = findable(command).rank(query), matcher.match(command.title)
            if rank or loose > 0:
                yield Hit(rank or loose / 1000, matcher.highlight(command.title), command.callback, help=command.help)


def findable(command: SystemCommand) -> Findable:
    """A command as it is found."""
    others = WORDS.get(_IDS.get(command.title, command.title.lower()), "")
    return Findable(command.title, [one.strip() for one in others.split(",") if one], command.help[KEY_WIDTH:])


class Palette(CommandPalette):
    """A list to search, with a title and its keys; what lies behind stays dim."""

    def __init__(self, title: str, providers: ProviderSource | None = None) -> None:
        super().__init__(providers, placeholder="type to filter", id="--command-palette")
        self._frame_title = title

    def on_mount(self) -> None:
        box = self.query_one("#--container")
        box.border_title, box.border_subtitle = self._frame_title, "↑↓ choose · Enter OK · Esc cancel"

    def get_line_filters(self) -> Sequence[LineFilter]:
        return without(super().get_line_filters())
