"""The test row follows a game: a link in this process and in another, a recording, and games that end, stop and flood."""

import asyncio
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from terminal import press, said, screen_text, with_editor
from textual.widgets import Static

import contextdb as cdb
from contextdb.cells.facts import Context
from contextdb.cells.words import format_number
from contextdb.cli import main
from contextdb.telemetry.link.hearing import Wanted
from tui.model.listening import Listening
from tui.model.moments import LiveTrack, Moment, open_session
from tui.model.query_row import QueryRow
from tui.screens.contexts import ContextsDialog
from tui.screens.live import LiveDialog

SCHEMA = """[conditions.speed]
type = "number"
min = 0.0
max = 9.0
[conditions.gait]
type = "enum"
values = ["Idle", "Walk", "Half Way"]
[conditions.tags]
type = "tags"
values = ["Wet", "Very Wet"]
"""
CELLS = "Asset,speed,gait,tags\nidle,0..1,Idle,Any\nwalk,0.5..3,Any,Any\nrun,2..,Any,-Wet\n"
LIMIT_S = 30.0
Asks = Callable[..., Any]


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A table, and a folder for running games of this test alone: with a short path, as sockets need one."""
    base = Path(tempfile.mkdtemp(prefix="cdb"))
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(base))
    (tmp_path / "contextdb.toml").write_text(SCHEMA)
    (tmp_path / "jog.csv").write_text(CELLS)
    yield tmp_path / "jog.csv"
    shutil.rmtree(base, ignore_errors=True)


async def until(pilot: Any, is_so: Callable[[], object]) -> None:
    """Wait until something is so."""
    end = time.monotonic() + LIMIT_S
    while not is_so():
        assert time.monotonic() < end, "it did not come to be so"
        await asyncio.sleep(0.01)
    await pilot.pause()


async def follow(app: Any, pilot: Any, ask: Callable[[], object], at: int = 0) -> None:
    """Open the list of games, wait for the character, and follow it."""
    await press(pilot, "alt+u")
    dialog = app.screen
    assert isinstance(dialog, LiveDialog)

    def is_there() -> bool:
        ask()
        dialog.show()
        return len(dialog._lines) > at

    await until(pilot, is_there)
    await press(pilot, *["down"] * at, "enter")
    await until(pilot, lambda: (ask() and False) or app.main.following.moment is not None)


def shows(app: Any, **facts: str) -> bool:
    app.main.following.tick()
    return {name: app.main.session.sheet.query.texts.get(name) for name in facts} == facts


def test_the_test_row_follows_a_game_and_marks_its_pick(path):
    compiled = cdb.load(path).compile()

    def ask(speed: float = 2.5) -> None:
        compiled.pick(compiled.query({"speed": speed, "gait": "Walk", "tags": []}), 1, last="walk")

    async def script(app, pilot):
        with cdb.link("game") as link:
            link.watch(compiled, "player")
            await follow(app, pilot, ask)
            following = app.main.following
            await until(pilot, lambda: ask() or shows(app, speed="2.5", gait="Walk", tags='""'))
            await until(pilot, lambda: following.tick() or following.moment.pick is not None)
            first = screen_text(app), app.main.session.sheet.query.bits
            await until(pilot, lambda: ask(0.75) or shows(app, speed="0.75"))
            return first, (screen_text(app), app.main.session.sheet.query.bits), app.main.assets.grid._painter.flashing

    (first, bits), (second, bits_after), _ = with_editor(path, script, (100, 24))
    assert "game · player" in first
    assert "the game plays run" in first
    assert "▶" in first
    assert "≠" not in first
    assert "version" not in first
    assert (bits, bits_after) == (0b110, 0b010)
    assert "test row: game · player" in first
    assert "· 2 valid" in first.splitlines()[1]
    assert "· 1 valid" in second.splitlines()[1]


def test_numbers_of_a_game_have_three_digits_as_it_goes_on_and_are_asked_whole(path):
    compiled = cdb.load(path).compile()

    def speed_of(screen: str) -> str:
        return next(line for line in screen.splitlines() if line.lstrip().startswith("?")).split("│")[1].strip()

    async def script(app, pilot):
        with cdb.link("game") as link:
            link.watch(compiled, "player")
            seen = []
            ask = lambda speed=0.54167881132: compiled.query({"speed": speed, "gait": "Walk", "tags": []})  # noqa: E731
            await follow(app, pilot, ask)
            for speed in (0.54167881132, 1.2140326691628, 1.2246467991473532e-16):
                await until(pilot, lambda speed=speed: (ask(speed) and False) or shows(app, speed=format_number(speed)))
                seen.append((speed_of(screen_text(app)), app.main.session.sheet.query.facts["speed"]))
            return seen

    seen = with_editor(path, script, (100, 24))
    assert [text for text, _ in seen] == ["0.542", "1.21", "0"]
    assert [fact for _, fact in seen] == [0.54167881132, 1.2140326691628, 1.2246467991473532e-16]


def test_an_edit_that_is_not_saved_is_answered_beside_the_game(path):
    compiled = cdb.load(path).compile()

    def ask() -> None:
        compiled.query({"speed": 2.5, "gait": "Walk", "tags": []})

    async def script(app, pilot):
        with cdb.link("game") as link:
            link.watch(compiled, "player")
            await follow(app, pilot, ask)
            sheet = app.main.session.sheet
            sheet.go_to(1, "speed")
            assert sheet.type_text("0.5..2") is None
            app.main.show()
            wanted = sheet.table.compile().version
            following = app.main.following
            await until(pilot, lambda: following.tick() or following._own_version.of(sheet.table) == wanted)
            following.tick()
            await pilot.pause()
            return screen_text(app), sheet.query.bits

    screen, bits = with_editor(path, script, (120, 24))
    assert bits == 0b100
    assert "≠ the game: 2 rows valid there, here 1 fewer" in screen
    assert "the game has another version" in screen


def test_pause_step_back_go_on_and_keep(path):
    compiled = cdb.load(path).compile()

    async def script(app, pilot):
        with cdb.link("game") as link:
            link.watch(compiled, "player")
            await follow(app, pilot, lambda: compiled.query({"speed": 1.0, "gait": "Walk", "tags": []}))
            for speed in ("2.0", "3.0"):
                await until(
                    pilot,
                    lambda speed=speed: (
                        compiled.query({"speed": float(speed), "gait": "Walk", "tags": []}) and shows(app, speed=speed[0])
                    ),
                )
            following, seen = app.main.following, []
            await press(pilot, "shift+f7")
            held = following.at
            while shows(app, speed="3"):
                await press(pilot, "f7")
            seen.append(app.main.session.sheet.query.texts["speed"])
            assert following.at < held
            compiled.query({"speed": 7.0, "gait": "Walk", "tags": []})
            await press(pilot, "shift+f8")
            await press(pilot, *"slow", "enter")
            seen.append(said(app))
            seen.append(screen_text(app))
            await press(pilot, "shift+f7")
            await until(pilot, lambda: compiled.query({"speed": 7.0, "gait": "Walk", "tags": []}) and shows(app, speed="7"))
            return seen

    speed, kept, screen = with_editor(path, script, (100, 24))
    assert speed == "2"
    assert "slow is saved" in kept
    assert "❚❚" in screen
    assert "s ago" in screen
    assert "slow" in path.with_name("jog.cases.csv").read_text()


def test_a_typed_fact_holds_the_game(path):
    compiled = cdb.load(path).compile()

    def ask() -> None:
        compiled.query({"speed": 1.0, "gait": "Walk", "tags": []})

    async def script(app, pilot):
        with cdb.link("game") as link:
            link.watch(compiled, "player")
            await follow(app, pilot, ask)
            app.main.session.sheet.set_fact("gait", "Idle")
            app.main.following.tick()
            ask()
            app.main.following.tick()
            await pilot.pause()
            held = app.main.session.sheet.query.texts["gait"], screen_text(app)
            await press(pilot, "shift+f7")
            await until(pilot, lambda: ask() or shows(app, gait="Walk"))
            return held

    gait, screen = with_editor(path, script, (100, 24))
    assert gait == "Idle"
    assert "held: facts were typed" in screen


def test_a_game_that_ends_leaves_its_last_moment(path):
    compiled = cdb.load(path).compile()

    async def script(app, pilot):
        link = cdb.link("game")
        link.watch(compiled, "player")
        await follow(app, pilot, lambda: compiled.query({"speed": 1.0, "gait": "Walk", "tags": []}))
        listening = app.main.following.followed.listening
        link.close()
        await until(pilot, lambda: listening.is_over)
        app.main.following.tick()
        await pilot.pause()
        ended = screen_text(app)
        await press(pilot, "alt+8")
        app.main.following.stop()
        await pilot.pause()
        return ended, screen_text(app), app.main.session.sheet.query.texts["speed"]

    ended, stopped, speed = with_editor(path, script, (100, 24))
    assert "the game has ended" in ended
    assert "■ game · player" in ended
    assert "■ game · player" not in stopped
    assert speed == "1"


def test_a_cell_that_begins_to_fail_flashes_once(path):
    async def script(app, pilot):
        grid, assets = app.main.assets.grid, app.main.assets
        assets.follow({"speed": "2.5"}, {}, None, "x")
        await pilot.pause()
        assets.follow({"speed": "0.2"}, {}, None, "x")
        flashing = grid._painter.flashing
        await until(pilot, lambda: not grid._painter.flashing)
        assets.follow({"speed": "0.2"}, {}, None, "x")
        return flashing, grid._painter.flashing

    flashing, later = with_editor(path, script)
    assert flashing == {(1, 1), (2, 1)}
    assert not later


GAME = """
import sys, time
import contextdb as cdb
compiled = cdb.load(sys.argv[1]).compile()
with cdb.link("other") as link:
    link.watch(compiled, "npc\\x1b[31m 7")
    print("ready", flush=True)
    for i in range(10**9):
        compiled.query({"speed": i % 80 / 10, "gait": "Half Way", "tags": ["Very Wet"]})
        time.sleep(float(sys.argv[2]))
"""


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="no signals here")
def test_a_game_in_another_process_is_followed_stops_floods_and_is_killed(path):
    game = subprocess.Popen([sys.executable, "-c", GAME, str(path), "0.0001"], stdout=subprocess.PIPE, text=True)
    assert game.stdout is not None
    game.stdout.readline()

    async def script(app, pilot):
        await follow(app, pilot, lambda: None)
        following, seen = app.main.following, []
        await until(pilot, lambda: following.tick() or following.moment is not None)
        first = following.moment
        await until(pilot, lambda: following.tick() or following.moment is not first)
        seen.append(screen_text(app))
        seen.append(app.main.session.sheet.query.texts)
        os.kill(game.pid, signal.SIGSTOP)
        listening = following.followed.listening
        await press(pilot, "down")

        def is_said() -> bool:
            """What was on its way when the game stopped still comes, so that the clock is put back until nothing does."""
            listening._heard_at -= 10
            following.tick()
            return "no query for" in screen_text(app)

        await until(pilot, is_said)
        seen.append(screen_text(app))
        os.kill(game.pid, signal.SIGKILL)
        await until(pilot, lambda: listening.is_over)
        following.tick()
        await pilot.pause()
        return [*seen, screen_text(app)]

    try:
        running, texts, stopped, killed = with_editor(path, script, (120, 24))
    finally:
        game.kill()
        game.wait()
        game.stdout.close()
    assert "other · npc\\x1b[31m 7" in running
    assert texts["gait"] == "Half Way" or texts["gait"] == '"Half Way"'
    assert "no query for" in stopped
    assert "the game is gone" in killed


def test_a_program_that_sends_nonsense_is_said_to_be_gone(tmp_path):
    left, right = socket.socketpair()
    header = {"line": "header", "format": 1, "game": "g", "pid": 1, "tables": {}}
    listening: Listening | None = None
    try:
        right.sendall(json.dumps(header).encode() + b"\nnonsense\n")
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("contextdb.telemetry.link.hearing.connected", lambda path: left)
            listening = Listening("g", tmp_path / "g.sock", Wanted())
            listening.join(LIMIT_S)
        assert listening.is_over
        assert "cannot be read" in listening.trouble
    finally:
        right.close()


def test_a_recording_is_opened_played_and_scrubbed(path):
    compiled = cdb.load(path).compile()
    file = path.with_name("s.jsonl")
    with cdb.link("game", record=file) as link:
        link.watch(compiled, "player")
        for speed in (0.5, 1.5, 2.5, 3.5):
            compiled.query({"speed": speed, "gait": "Walk", "tags": []})

    async def script(app, pilot):
        await press(pilot, "alt+u", "f4")
        await press(pilot, *"s.jsonl", "enter")
        dialog = app.screen
        await until(pilot, lambda: dialog.show() or dialog._lines)
        await press(pilot, "enter")
        following = app.main.following
        await press(pilot, "shift+f7")
        following.step(-10)
        seen = [app.main.session.sheet.query.texts["speed"]]
        for _ in range(3):
            await press(pilot, "f8")
            seen.append(app.main.session.sheet.query.texts["speed"])
        await press(pilot, "alt+8")
        seen += [app.main.session.sheet.query.texts["speed"], screen_text(app)]
        await press(pilot, "alt+4", "l")
        pane = app.main._pane("coverage")
        await until(pilot, lambda: not pane.played.reading)
        return [pane.played.result.headline, *seen]

    headline, *speeds, screen = with_editor(path, script, (100, 24))
    assert headline.startswith("the recording s.jsonl · player: 100 % of 4 recorded moments")
    assert speeds == ["0.5", "1.5", "2.5", "3.5", "0.5"]
    assert "s.jsonl · player" in screen


def test_a_recording_that_is_none_is_refused_in_words(path):
    path.with_name("s.jsonl").write_text("no\n")

    async def script(app, pilot):
        await press(pilot, "alt+u", "f4")
        await press(pilot, *"s.jsonl", "enter")
        dialog = app.screen
        await until(pilot, lambda: dialog._problem)
        dialog.show()
        await pilot.pause()
        return screen_text(app)

    assert "✗ s.jsonl: the line cannot be read" in with_editor(path, script, (100, 24))


def test_a_track_forgets_what_is_older_than_a_minute():
    track = LiveTrack()
    for t in range(100):
        track.add(Moment(float(t), {}, 0, 0), 100)
    assert (track.first, track.stop) == (39, 100)
    assert track.moment(38) is None
    assert track.time(39) == 39.0


def test_a_last_line_that_is_not_whole_is_left_out(tmp_path):
    file = tmp_path / "r.jsonl"
    lines = [
        {"line": "header", "format": 1, "game": "g", "pid": 1, "tables": {"t": {"version": "v"}}},
        {"line": "ask", "t": 1.0, "who": None, "table": "t", "facts": {"a": 1}, "rows": "1", "valid": 1},
        {"line": "pick", "t": 1.0, "who": None, "table": "t", "pick": {"row": 0, "asset": "x"}},
    ]
    file.write_text("\n".join(map(json.dumps, lines)) + '\n{"line": "as')
    track = open_session(file).tracks[None, "t"]
    assert track.stop == 1
    assert track.moment(0).pick == (0, "x")
    assert track.moment(1) is None


names = st.text(st.characters(codec="utf-8", exclude_categories=("Cs",)), min_size=0, max_size=8)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.fixed_dictionaries(
            {},
            optional={
                "speed": st.one_of(st.floats(0.0, 9.0), st.integers(0, 9), st.none()),
                "gait": st.one_of(st.sampled_from(["Idle", "Walk", "Half Way"]), st.none()),
                "side": st.one_of(names, st.none()),
                "tags": st.one_of(st.lists(st.sampled_from(["Wet", "Very Wet"]), unique=True), st.none()),
            },
        ),
        max_size=6,
    )
)
def test_what_the_grid_marks_equals_a_query_with_the_facts_that_were_sent(moments):
    cells = {
        "Asset": ["a", "b", "c", "d"],
        "speed": ["0..1", "0.5..3", "Any", "2.."],
        "gait": ["Idle", "Any", '"Half Way" Walk', "Any"],
        "side": ["Any", "L", "Any", "x"],
        "tags": ["Any", "+Wet", "Any", "-Wet"],
    }
    schema: dict[str, dict[str, object]] = {
        "speed": {"type": "number"},
        "gait": {"type": "enum", "values": ["Idle", "Walk", "Half Way"]},
        "side": {"type": "text"},
        "tags": {"type": "tags", "values": ["Wet", "Very Wet"]},
    }
    table = cdb.Table.from_columns(cells, schema, name="t")
    compiled, query = table.compile(), QueryRow(table)
    for facts in moments:
        context: Context = {name: fact for name, fact in facts.items() if fact is not None}
        expected = compiled.query(context, unknown="any").indices.tolist()
        moment = Moment(0.0, facts, 0, 0)
        query.follow(moment.texts(query.wanted.given), {})
        assert not query.faults
        assert np.flatnonzero(query.valid).tolist() == expected


def test_the_command_line_and_the_grid_agree_on_a_streamed_moment(path, capsys):
    facts = {"speed": 2.5, "gait": "Half Way", "tags": ["Very Wet"]}
    table = cdb.load(path)
    query = QueryRow(table)
    texts = Moment(0.0, facts, 0, 0).texts(query.wanted.given)
    query.follow(texts, {})
    main(["query", str(path), *(f"{name}={text}" for name, text in texts.items())])
    printed = capsys.readouterr().out
    valid = [table.assets[row] for row in np.flatnonzero(query.valid)]
    assert valid == ["walk", "run"]
    assert all(asset in printed for asset in valid)
    assert "idle" not in printed.split("\n\n")[0]


def test_the_keys_reach_their_commands_without_a_game(path):
    async def script(app, pilot):
        seen = []
        for key in ("shift+f7", "shift+f8", "alt+8", "alt+9"):
            app.main.say("")
            await press(pilot, key)
            seen.append(said(app))
        await press(pilot, "f9")
        is_contexts = isinstance(app.screen, ContextsDialog)
        await press(pilot, "escape", "alt+u")
        return seen, is_contexts, str(app.screen.query_one("#live-state", Static).content)

    seen, is_contexts, state = with_editor(path, script)
    assert all("No game is followed" in text for text in seen)
    assert is_contexts
    assert "`contextdb play` starts one to try" in state
