"""A running game can be watched: `contextdb.link("game")` publishes what it asks and picks, `contextdb live` shows it.

    game            taps (what is asked and picked) ─► ring ─► the link's thread: moments ─► lines ─► a local socket
    contextdb live  hearing ─► lines, and its own version of the tables for the why
    recordings      recorded: the same lines in a file, as contexts

docs/live.md tells the format of the lines. Nothing here listens on a network address.
"""

from __future__ import annotations

from contextdb.telemetry.link.game import Link, link

__all__ = ["Link", "link"]
