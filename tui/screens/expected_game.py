"""A game that is followed as soon as it asks the table on the screen: `contextdb edit TABLES --follow GAME`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from textual.timer import Timer

from contextdb.errors import ContextDBError
from contextdb.telemetry.link.doors import doors
from contextdb.telemetry.link.hearing import Wanted

from ..model.listening import Listening
from .following import Followed

LOOK_EVERY_S = 0.5


class ExpectedGame:
    """Looks for a game now and then, and hands over its first character that asks a table."""

    def __init__(self, game: str, table: str, begin: Callable[[Followed], None]) -> None:
        self.game, self.table, self._begin = game, table, begin
        self._listening: Listening | None = None
        self.timer: Timer | None = None

    def look(self) -> None:
        """Once more; after the game was handed over, no more."""
        if self._listening is None or self._listening.is_over:
            path = _door(self.game)
            self._listening = None if path is None else Listening(self.game, path, Wanted(tables=(self.table,)))
        keys = [] if self._listening is None else [key for key in self._listening.tracks.copy() if key[1] == self.table]
        if keys and self._listening is not None:
            if self.timer is not None:
                self.timer.stop()
            self._begin(Followed(min(keys, key=lambda key: key[0] or ""), self._listening))


def _door(game: str) -> Path | None:
    """Where a running game can be listened to."""
    try:
        return dict(doors()).get(game)
    except (OSError, ContextDBError):
        return None
