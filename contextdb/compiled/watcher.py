"""What a table, a live context and a controller have where a link watches them: see `contextdb.telemetry.link`.

The attribute `_watcher` is None as a rule. Whoever answers a question tests it, and calls it while its feed is open.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from contextdb.cells.facts import Context
from contextdb.compiled.matches import Matches

Offered = Mapping[str, Sequence[Mapping[str, object]]]
"""The actors of a question: for each role those who may play it."""


class Feed(Protocol):
    """Where a watcher puts what it learns."""

    is_open: bool
    """Whether somebody listens."""


class Watcher(Protocol):
    """Learns of questions and picks, in the thread that asks."""

    @property
    def feed(self) -> Feed: ...

    def answered(self, context: Context, answer: Matches, actors: Offered | None = None) -> None:
        """Learn of a question that was answered."""
        ...

    def picked(self, answer: Matches, row: int | None, asset: str | None) -> None:
        """Learn what was picked of an answer; no row where it is the fallback."""
        ...
