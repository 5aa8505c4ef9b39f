"""The playground for tests: a copy of its tables with their clips, sticks, and an oracle of what may play."""

import atexit
import shutil
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import oracles

from contextdb import Project
from contextdb.motion import MotionProject, write_made_clips
from examples.playground.__main__ import TABLES, played
from examples.playground.game import Game
from examples.playground.stick import Sticks, read_sticks

STICK = """\
time_s,x,z,run,strafe,camera_deg
0,0,0,0,0,0
0.5,0,1,0,0,0
2,1,0,0,0,0
3.5,1,0,1,0,0
5,0,-1,1,0,0
7,-1,0,0,1,180
8.5,0,0,0,0,0
"""


ORACLE_EVERY = 10
"""Frames between two in which every cell is read."""


@cache
def clips() -> Path:
    """The clips, written once."""
    folder = Path(tempfile.mkdtemp(prefix="playground-clips-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    shutil.copytree(TABLES / "clips", folder, ignore=shutil.ignore_patterns("*.bvh"), dirs_exist_ok=True)
    write_made_clips(folder, of_game=True)
    return folder


@cache
def stock() -> MotionProject:
    """The frames and poses of all clips, read once: those of every copy are the same."""
    folder = clips().with_name(f"{clips().name}-tables")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return MotionProject.of(Project.load(copied(folder)))


def copied(folder: Path) -> Path:
    """A copy of the playground's tables and clips."""
    shutil.copytree(TABLES, folder, ignore=shutil.ignore_patterns("clips", ".contextdb-cache"), dirs_exist_ok=True)
    shutil.copytree(clips(), folder / "clips")
    return folder


def opened(folder: Path, link: str | None = None) -> Game:
    """The game with the tables of a folder, which are looked at without waiting for them to rest."""
    return Game(folder, link, settle_s=0.0, stock=stock())


def stick(folder: Path, text: str = STICK) -> Sticks:
    """A stick of a file."""
    path = folder / "stick.csv"
    path.write_text(text)
    return read_sticks(path)


def checked(game: Game, seconds: float, stick: Sticks) -> Iterator[Game]:
    """Play, and look in each frame whether what every character plays may play; now and then every cell is read anew."""
    for frame, each in enumerate(played(game, seconds, stick)):
        table = game.watch.project["moves"]
        for actor in game.actors:
            decision, facts = actor.moved.decision, actor.moved.facts
            assert decision.playing is not None
            if frame % ORACLE_EVERY == 0:
                assert actor.readout.valid.rows.tolist() == oracles.rows(table, facts)
            is_right = decision.playing.asset in actor.readout.valid.assets
            assert is_right or decision.held or not actor.readout.valid, (actor.name, decision.playing.asset, facts)
        yield each
