"""Recorded moments in the Coverage tab: the numbers of the command line, rows that were never used, and a key to the moment."""

import asyncio
import json
import time
from pathlib import Path
from threading import Event

import pytest
from terminal import press, said, screen_text, with_editor

import contextdb as cdb
from contextdb.tables.table import Table
from contextdb.telemetry import observe
from tui.model.game_answer import GameAnswer
from tui.model.moments import Moment
from tui.model.played_run import PlayedRun
from tui.model.query_row import QueryRow

TOML = """[conditions.speed]
type = "number"
min = 0.0
max = 9.0
[conditions.gait]
type = "enum"
values = ["Walk", "Run"]
"""
CELLS = "Asset,speed,gait\nslow,0..3,Walk\nfast,5..9,Run\nnever,4..4.5,Walk\n"
MOMENTS = [(1.0, "Walk"), (2.0, "Walk"), (6.0, "Run"), (3.5, "Walk"), (3.75, "Walk"), (8.0, "Walk")]
LIMIT_S = 30.0


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text(TOML)
    (tmp_path / "t.csv").write_text(CELLS)
    (tmp_path / "play.csv").write_text("speed,gait\n" + "\n".join(f"{speed},{gait}" for speed, gait in MOMENTS) + "\n")
    return tmp_path / "t.csv"


async def until(pilot, is_so):
    end = time.monotonic() + LIMIT_S
    while not is_so():
        assert time.monotonic() < end, "it did not come to be so"
        await asyncio.sleep(0.01)
    await pilot.pause()


async def read(app, pilot, name="play*.csv"):
    await press(pilot, "alt+4", "o")
    await press(pilot, *name, "enter")
    pane = app.main._pane("coverage")
    await until(pilot, lambda: not pane.played.reading)
    return pane


def test_the_numbers_are_those_of_the_command_line_and_t_loads_the_moment(path):
    async def script(app, pilot):
        pane = await read(app, pilot)
        screen, found = screen_text(app), pane.played.result
        await press(pilot, "7")
        unused = screen_text(app)
        await press(pilot, "6", "t")
        await until(pilot, lambda: app.main.tab == "assets")
        return screen, unused, found, app.main.session.sheet.query.texts, app.main.assets.grid.test_name

    screen, unused, found, texts, name = with_editor(path, script, (120, 30))
    expected = observe(cdb.load(path), path.with_name("play.csv"))
    assert found.observed.to_json() == expected.to_json()
    assert "50.00 % of 6 recorded moments have a valid row" in screen
    assert "never" in unused
    assert list(found.unused) == list(expected.never_used) == [2]
    number = int(name.split()[1])
    assert (float(texts["speed"]), texts["gait"]) == MOMENTS[number - 1]
    assert cdb.load(path).compile().query({"speed": float(texts["speed"]), "gait": texts["gait"]}).indices.tolist() == []


def test_enter_goes_to_a_row_that_was_never_used(path):
    async def script(app, pilot):
        await read(app, pilot)
        await press(pilot, "7", "enter")
        return app.main.tab, app.main.session.sheet.cursor[0]

    assert with_editor(path, script, (100, 30)) == ("assets", 2)


@pytest.mark.parametrize("name", ["none.csv", "t\x07.jsonl"])
def test_a_file_that_is_not_there_is_said(path, name):
    async def script(app, pilot):
        pane = await read(app, pilot, name.replace("\x07", "x"))
        return screen_text(app), pane.played.result

    screen, result = with_editor(path, script, (120, 30))
    assert "✗" in screen
    assert result is None


def test_the_last_minute_of_a_game_is_read_too(path):
    moments = [Moment(i / 30, {"speed": speed, "gait": gait}, 0, 0) for i, (speed, gait) in enumerate(MOMENTS)]
    with_actors = Moment(9.0, {"speed": 1.0}, 0, 0, actors={"Defender": [{"id": 1}]})

    async def script(app, pilot):
        await press(pilot, "alt+4", "l")
        nobody = said(app)
        pane = app.main._pane("coverage")
        pane.live = lambda: ("the last minute of game · player", lambda: [*moments, with_actors])
        await press(pilot, "l")
        await until(pilot, lambda: not pane.played.reading)
        return nobody, screen_text(app), pane.played.result

    nobody, screen, result = with_editor(path, script, (120, 30))
    assert "No game and no recording is followed" in nobody
    assert "the last minute of game · player (1 moment with actors left out): 50.00 % of 6 recorded moments" in screen
    plain = observe(cdb.load(path), path.with_name("play.csv")).to_json()
    assert json.dumps(result.observed.to_json()["gaps"]) == json.dumps(plain["gaps"])


@pytest.fixture
def outer(path: Path) -> Table:
    """A table one of whose rows refers to another one."""
    path.write_text("Asset,speed,gait\nslow,0..3,Walk\n@inner,Any,Run\nnever,8.5..,Walk\n")
    path.with_name("inner.csv").write_text("Asset,speed\njog,3..5\nrun,5..9\n")
    return cdb.Project.load(path.parent)["t"]


def test_a_row_that_refers_to_a_table_is_used_where_a_row_inside_is(outer, path):
    run, done = PlayedRun(), Event()
    run.start(outer, str(path.with_name("play.csv")), "play", done.set)
    assert done.wait(LIMIT_S)
    assert run.problem == ""
    assert list(run.result.unused) == [2]
    assert run.result.observed.to_json() == observe(outer.flat(), path.with_name("play.csv")).to_json()


def test_moments_without_any_and_moments_with_actors_alone_are_told(outer):
    cast = Moment(0.0, {}, 0, 0, actors={"Defender": [{"id": 1}]})
    for moments, why in (([], "there was no query yet"), ([cast], "every query had actors")):
        run, done = PlayedRun(), Event()
        run.start_live(outer, lambda kept=moments: kept, "game", done.set)
        assert done.wait(LIMIT_S)
        assert why in run.problem
        run.close()


def test_the_answer_of_a_game_is_that_of_the_rows_inside_here(outer):
    facts = {"speed": 6.0, "gait": "Run"}
    answer = outer.compile().query(facts)
    query = QueryRow(outer)
    query.load({"speed": "6", "gait": "Run"})
    assert GameAnswer(Moment(0.0, facts, answer.bits, len(answer)), query, outer, outer).differs == ""
    other = GameAnswer(Moment(0.0, facts, 0, 0, pick=(0, None)), query, outer, outer)
    assert other.differs == "≠ the game: 0 rows valid there, here 1 more"
    assert other.summary.endswith("the game plays nothing")


def test_the_rows_of_a_game_are_compared_by_their_assets_after_an_edit(path):
    game_table = cdb.load(path)
    answer = game_table.compile().query({"speed": 2.0, "gait": "Walk"})
    moment = Moment(0.0, {}, answer.bits, len(answer))
    differs = {}
    for name, cells in {
        "inserted": CELLS.replace("slow", "new,8..9,Run\nslow"),
        "fills the gap": CELLS.replace("slow", "new,2,Walk\nslow"),
        "deleted": CELLS.replace("slow,0..3,Walk\n", ""),
        "twice": CELLS.replace("slow,0..3,Walk\n", "slow,8..9,Run\nslow,0..3,Walk\n"),
    }.items():
        path.write_text(cells)
        table = cdb.load(path)
        query = QueryRow(table)
        query.load({"speed": "2", "gait": "Walk"})
        differs[name] = GameAnswer(moment, query, table, game_table).differs
    assert differs == {
        "inserted": "",
        "fills the gap": "≠ the game: 1 row valid there, here 1 more",
        "deleted": "≠ the game: 1 row valid there, here 1 fewer",
        "twice": "≠ the game: 1 row valid there, here 1 more and 1 fewer",
    }
