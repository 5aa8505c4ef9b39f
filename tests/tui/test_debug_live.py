"""The debugger of a running game: what a link tells in full is what a recorder keeps, and the screen follows it."""

import json
import random
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from terminal import alone, drive, press, screen_text
from test_debug_parts import recording_of
from test_motion_measure_command import here, made
from textual.pilot import Pilot

import contextdb as cdb
from contextdb.motion import Controller, MotionConfig, Trace
from contextdb.motion.trace.rows import row_of
from contextdb.tables.project import Project
from tui.debug.app import DebugApp
from tui.debug.game import Live
from tui.debug.recording import Recording
from tui.debug.screen import DebugScreen
from tui.debug.waiting import WaitingScreen

sys.path.append(str(Path(__file__).parent.parent / "telemetry"))
from links import meeting, until

__all__ = ["here", "made", "meeting"]
"""Fixtures of other files."""

LARGE = (160, 48)


class Game:
    """A game that plays a recorded session again, with a link."""

    def __init__(self, folder: Path) -> None:
        self.recorded: Recording = recording_of(folder)
        project = Project.load(folder / "game")
        config = MotionConfig.from_dict(project.schema.motion, tables=project.tables)
        self.controller: Controller = config.controller("player", self.recorded.databases, rng=random.Random(0))
        self.link = cdb.link("game")
        self.link.watch(self.controller, "player")
        self.at = 0

    def play(self, n: int) -> None:
        """So many updates."""
        for decision in self.recorded.trace[self.at : self.at + n]:
            assert decision.inputs is not None
            assert decision.query is not None
            self.controller.update(decision.inputs.dt_s, decision.query, context=decision.context)
        self.at += n


@pytest.fixture
def game(here: Path, meeting: Path) -> Iterator[Game]:
    one = Game(here)
    yield one
    one.link.close()


@pytest.fixture
def live(game: Game, meeting: Path, here: Path) -> Iterator[Live]:
    one = Live("game", meeting / "game.sock", None, str(here / "game"), game.recorded.databases, clock=lambda: 0.0)
    until(lambda: game.link.is_heard and game.link._feed.wants_filters)
    yield one
    one.close()


def heard(live: Live, n: int) -> None:
    """Wait until so many updates have come."""
    until(lambda: (live.take() and False) or (live.recording is not None and len(live.recording) >= n))


def test_what_is_heard_is_what_a_recorder_keeps_and_is_asked_again_bit_for_bit(game: Game, live: Live):
    own = Trace()
    game.controller.recorder = own
    game.play(40)
    heard(live, 40)
    assert live.recording is not None
    assert live.recording.missing == ""
    assert [row_of(each, lambda *_: ()) for each in live.trace] == [row_of(each, lambda *_: ()) for each in own]
    for decision, asked in zip(live.trace, live.recording.reasked, strict=True):
        assert asked.choice == decision.choice
    assert live.name == "game · player"


def test_only_a_minute_is_kept_and_a_game_that_begins_again_begins_another(game: Game, live: Live):
    game.play(2)
    heard(live, 2)
    far = dict(zip(("tick", "time_s"), (5, 100.0), strict=True))
    rows = [live.trace._row(i) for i in range(2)]
    assert live.trace.take(json.dumps({**rows[1], **far}))
    live.trace.settle()
    assert [each.tick for each in live.trace] == [5]
    assert live.trace.take(json.dumps(rows[0]))
    live.trace.settle()
    assert [each.tick for each in live.trace] == [0]


@pytest.mark.parametrize("text", ["", "[]", "{", '{"tick": 1}', "null", '"x"', "[" * 100_000])
def test_what_is_no_row_is_refused(game: Game, live: Live, text: str):
    assert not live.trace.take(text)
    assert len(live.trace) == 0


def test_a_game_with_other_databases_is_said_and_its_timeline_works(game: Game, live: Live):
    game.play(3)
    until(lambda: live.listening.databases)
    told = {name: {**each, "digest": "other"} for name, each in live.listening.databases["player"].items()}
    live.trace.made_with(told)
    assert "another than the one that the game has" in live.trace.missing


def test_nobody_who_only_looks_makes_decisions_cost_more(game: Game, meeting: Path):
    from contextdb.telemetry.link.hearing import hear

    with hear(meeting / "game.sock"):
        until(lambda: game.link.is_heard)
        assert game.controller._n_candidates == 0
    until(lambda: not game.link.is_heard)
    assert game.controller._n_candidates == 0


def test_the_screen_follows_is_held_and_goes_back_to_now(game: Game, live: Live):
    async def script(pilot: Pilot[Any]) -> None:
        app = pilot.app
        assert isinstance(app.screen, WaitingScreen)
        game.play(20)
        while live.recording is None:
            await pilot.pause(0.01)
            app.screen.look() if isinstance(app.screen, WaitingScreen) else None
        waiting = app.screen
        game.play(2)
        if isinstance(waiting, WaitingScreen):
            waiting.look()  # which takes no more
        await pilot.pause()
        screen = app.screen
        assert isinstance(screen, DebugScreen)
        game.play(18)
        while len(screen.recording) < 40:
            screen.follow()
        assert screen.index == 39
        assert "● now" in screen_text(app)
        await press(pilot, "left")
        game.play(5)
        while len(screen.recording) < 45:
            screen.follow()
        assert screen.index == 38
        assert "ago, End: now" in screen_text(app)
        await press(pilot, "end")
        assert screen.index == 44
        game.link.close()
        until(lambda: live.listening.is_over)
        screen.follow()
        assert "the game has ended" in screen_text(app)
        await press(pilot, "left_square_bracket")
        assert screen.index < 44

    with alone(Path.cwd()):
        drive(DebugApp(live, measures=False), script, LARGE)
