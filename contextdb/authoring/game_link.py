"""The link of a game, which watches tables and controllers: what makes plain data of decisions is handed to it here."""

from __future__ import annotations

from pathlib import Path

from contextdb.telemetry.link.feed import Decisions
from contextdb.telemetry.link.game import Link, open_link

PER_SECOND = 30.0


def link(name: str = "game", *, record: str | Path | None = None, per_second: float = PER_SECOND) -> Link:
    """Let programs of the same user on this machine watch what the game asks and picks: see docs/live.md.

    Parameters
    ----------
    name : str
        What the game is called; where one of this name runs already, this one is called "game-2".
    record : path, optional
        A new file, *.jsonl, which takes every question from now on, whether or not anybody listens.
    per_second : float
        How often a second lines are sent: then of each character and table the newest.

    Raises
    ------
    ContextError
        It cannot be a name.
    FileError
        The file is there already or cannot be written; the folder in which games are met is not this user's alone.
    """
    return open_link(name, record, per_second, _decisions)


def _decisions() -> Decisions:
    from contextdb.motion.trace import published  # with the motion search: loaded where a game has controllers

    return published
