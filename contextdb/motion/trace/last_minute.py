"""The last minute of a running game as a session: rows come one by one, and those that are older are forgotten."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from contextdb.errors import ContextDBError
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.trace.rows import Row, columns, decision_of
from contextdb.motion.trace.session import Trace, missing
from contextdb.motion.trace.session_file import frame_of_rows

KEPT_S = 60.0
MOST_ROWS = 7200
"""So many rows are stored at most: a minute at 120 a second."""


class LastMinute(Trace):
    """A session that grows at its end and is forgotten at its start; `databases` are those that whoever watches has, by name."""

    def __init__(self, databases: Mapping[str, MotionDatabase]) -> None:
        super().__init__(databases=databases)
        self.own = dict(databases)
        self._own_about = self.about
        self.about = {}
        self.missing = "the game has not said yet which databases it searches."
        self._new: list[Row] = []
        self._last_tick = -1

    def made_with(self, settings: Mapping[str, Mapping[str, Any]]) -> None:
        """Learn the digests of the game's databases; `missing` says why some cannot be asked, "" when all can."""
        self.about = {name: dict(each) for name, each in settings.items()}
        self.missing = self.use(self.own).replace("the session was recorded with", "the game has")
        self.about = {name: self._own_about[name] if name in self._databases else each for name, each in self.about.items()}
        self.missing = self.missing or missing(self.about, self.own, self._databases)

    def take(self, text: str) -> bool:
        """Take the row of a decision as it was sent; False for what is none. A game that begins again begins another minute."""
        try:
            row = json.loads(text)
            if set(row) != set(columns()):
                return False
            tick = decision_of(row).tick
            frame_of_rows([row])
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError, OverflowError, ContextDBError):
            return False
        except Exception as error:  # what polars makes of numbers that fit no column
            if type(error).__module__.partition(".")[0] not in ("polars", "builtins"):
                raise
            return False
        if tick <= self._last_tick:
            self._new, self._loaded = [], None
        self._last_tick = tick
        self._new.append(row)
        return True

    def settle(self) -> None:
        """Put what was taken behind what is there, and forget what is older than a minute."""
        import polars as pl

        if not self._new:
            return
        new, self._new = frame_of_rows(self._new), []
        whole = new if self._loaded is None else pl.concat([self._loaded, new])
        before = len(whole)
        self._loaded = whole.filter(pl.col("time_s") >= whole["time_s"][-1] - KEPT_S).tail(MOST_ROWS)
        self.n_forgotten += before - len(self._loaded)
