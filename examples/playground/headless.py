"""The game without a window, as fast as it can: for tests, recordings and pictures."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from contextdb import motion
from examples.playground.game import Game
from examples.playground.stick import REST, StickFile

RATE = 60.0
LONGEST = 216_000
"""Decisions of an hour: more are not recorded."""


def played(game: Game, seconds: float, stick: StickFile | None = None, rate: float = RATE) -> Iterator[Game]:
    """Play so long, and give the game after each frame."""
    for frame in range(1, round(seconds * rate) + 1):
        game.update(1.0 / rate, REST if stick is None else stick.at(frame / rate))
        yield game


def run(games: Iterable[Game], poses: Path | None = None, record: Path | None = None, picture: Path | None = None) -> None:
    """Play to the end, and write what is asked for: all poses of the player, the session, a picture of the last moment."""
    shown: list[motion.Pose] = []
    for game in games:
        if not shown:
            game.player.keep(LONGEST)
        shown.append(game.player.pose)
    if poses is not None:
        motion.write_poses(shown, next(iter(game.player.stock.banks.values())), poses, RATE)
    if record is not None:
        game.player.trace.save(record, timings=False)
    if picture is not None:
        from examples.playground.window import Window

        Window(game, is_offscreen=True).write_picture(picture)
