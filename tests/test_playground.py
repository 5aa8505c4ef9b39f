"""examples/playground: it plays without a window, no row is wrong, a save changes it at once, and it can be looked at."""

import importlib
import math
import shutil
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import unquote, urlparse

import numpy as np
import play
import pytest
from strategies import IS_FULL

from contextdb import motion
from contextdb.errors import FileError
from examples.playground import world
from examples.playground.__main__ import RATE, main, played, project_of_clips, run
from examples.playground.game import Game
from examples.playground.guide import AGAIN, BACK, GAP, NAMELESS, WALK, Guide
from examples.playground.stick import REST, Stick, Sticks, read_sticks

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "docs"))
png_files = importlib.import_module("png_files")
SECONDS = 60.0 if IS_FULL else 6.0
BARS = {"jumps_per_s": 2.0, "skate_cm_s": 6.0, "path_rms_m": 0.1, "heading_rms_deg": 20.0, "accel_p99": 80.0}
"""What `motion measure` may say of walking, turning, running and strafing."""


@pytest.fixture(scope="module")
def tables(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return play.copied(tmp_path_factory.mktemp("playground") / "tables")


@pytest.fixture
def game(tables: Path) -> Iterator[Game]:
    with play.opened(tables) as game:
        yield game


def put(game: Game, x: float, z: float, heading: float = 0.0) -> None:
    body = game.player.character.body
    game.player.character.body = replace(body, position=(x, z), velocity=(0.0, 0.0), heading=heading)


def push(game: Game, seconds: float, stick: Stick) -> None:
    for _ in range(round(seconds * RATE)):
        game.update(1.0 / RATE, stick)


def turned(sticks: Sticks, seconds: float) -> Sticks:
    """The same again and again, there and back."""
    length_s = 9.0
    back = [(from_s, replace(each, x=-each.x, z=-each.z, camera=each.camera + math.pi)) for from_s, each in sticks]
    times = range(math.ceil(seconds / length_s))
    return [(i * length_s + from_s, each) for i in times for from_s, each in (back if i % 2 else sticks)]


def test_a_session_keeps_the_bars_of_motion_measure_and_no_row_is_wrong(game: Game, tmp_path: Path):
    stick = turned(play.stick(tmp_path), SECONDS)
    run(game, play.checked(game, SECONDS, stick), tmp_path / "poses.npz", tmp_path / "session.parquet")
    banks = {name: game.player.stock.banks[name] for name in ("moves", "tired")}
    session = motion.Trace.load(tmp_path / "session.parquet")
    measures = motion.measure(session, banks, databases=game.player.character.controller.selector.databases)
    assert measures.seconds == pytest.approx(SECONDS, abs=0.1)
    told = {name: getattr(measures, name) for name in BARS}
    assert all(told[name] is not None and told[name] <= bar for name, bar in BARS.items()), told
    with np.load(tmp_path / "poses.npz") as poses:
        assert len(poses["positions"]) == round(SECONDS * RATE)


def test_a_save_every_second_changes_what_may_play_at_once_and_no_row_is_wrong(tmp_path: Path):
    tables = play.copied(tmp_path / "tables")
    moves = tables / "moves.csv"
    first = moves.read_text()
    second = first.replace("walk,Walk,0.9..1.7,-40..40,Any,False", "walk,Walk,0.9..1.1,-40..40,Any,False").replace(
        "walk_fast,Walk,1.5..", "walk_fast,Walk,1.1.."
    )
    assert second != first
    seen = []
    seconds = SECONDS / 2.0
    with play.opened(tables) as game:
        for frame, _ in enumerate(play.checked(game, seconds, turned(play.stick(tmp_path), seconds))):
            if frame % round(RATE) == round(RATE) - 1:
                seen.append(game.watch.snapshot().number)
                moves.write_text(second if len(seen) % 2 else first)
    assert seen == list(range(1, round(seconds) + 1))


def test_what_cannot_be_read_is_said_and_the_game_plays_on(tmp_path: Path):
    tables = play.copied(tmp_path / "tables")
    with play.opened(tables) as game:
        moves = tables / "moves.csv"
        good = moves.read_text()
        moves.write_text(good.replace("idle,Idle", "idle,Idel"))
        push(game, 0.5, REST)
        assert game.player.playing == "idle"
        assert any(line.startswith("not loaded: moves.csv, ") and "Idel" in line for line in game.state)
        moves.write_text(good)
        push(game, 0.5, REST)
        assert not any(line.startswith("not loaded") for line in game.state), "undoing the slip clears the message"


@pytest.mark.parametrize(
    ("name", "was", "becomes"),
    [
        ("contextdb.toml", '"Walk", "Run"', '"Walk"'),
        ("vaults.csv", "speed,wall", "pace,wall"),
        ("catches.csv", "Asset,", "Clip,"),
    ],
)
def test_tables_that_do_not_fit_the_game_end_no_game(tmp_path: Path, name: str, was: str, becomes: str):
    file = play.copied(tmp_path / "tables") / name
    with play.opened(file.parent) as game:
        file.write_text(file.read_text().replace(was, becomes))
        put(game, -3.0, 1.0)
        push(game, 1.5, Stick(0.0, 1.0, run=True))
        assert game.player.playing
        assert game.trouble


def test_who_runs_at_the_wall_vaults_it_when_the_gate_opens(game: Game):
    put(game, -3.0, -2.0)
    heights = []
    for _ in range(300):
        game.update(1.0 / RATE, Stick(0.0, 1.0, run=True))
        x, z, _ = game.player.pose.root
        if world.WALL.holds(x, z):
            assert game.player.playing == "vault_run"
            heights.append(game.player.pose.positions[:, 1].min())
    assert game.player.character.root.ahead_m > world.WALL.z[1]
    assert heights
    assert min(heights) > world.WALL.near_m


def test_who_only_stands_before_the_wall_stays_before_it(game: Game):
    put(game, -4.9, 4.6)
    push(game, 2.0, Stick(0.0, 1.0))
    assert game.player.character.root.ahead_m < world.WALL.z[0]


def test_the_gate_has_seen_nothing_once_nobody_goes_to_the_wall(game: Game):
    assert game.gate is not None
    put(game, -3.0, 1.0)
    push(game, 0.3, Stick(0.0, 1.0))
    assert game.gate.seen is not None
    push(game, 0.1, REST)
    assert game.gate.seen is None


def test_two_contest_the_ball_and_the_table_says_what_each_plays(game: Game):
    assert game.ball is not None
    x, z = game.ball.spot
    put(game, x, z - 1.4)
    for _ in range(400):
        game.update(1.0 / RATE, REST)
        if game.ball.holder is not None:
            break
    assert game.ball.holder is game.rival
    assert game.ball.said == "rival catches the ball: catch_contested; player misses it"
    push(game, game.ball.caught_s, REST)
    assert {actor.name: actor.playing for actor in game.actors} == {
        "player": "catch_contested.Other",
        "rival": "catch_contested.Catcher",
    }
    apart = motion.Target.seen_from(game.rival.character.root, *game.player.pose.root[:2])
    assert (apart.left_m, apart.ahead_m) == pytest.approx((0.0, 0.8), abs=0.1)


def test_the_ball_comes_to_the_hand_without_a_leap_and_no_foot_that_stands_slides(game: Game):
    assert game.ball is not None
    x, z = game.ball.spot
    put(game, x, z + 1.2)
    before: dict[int, Any] = {}
    ball, leaps, slides = game.ball.place, [], []
    while game.ball.holder is None or game.ball.since_s < 2.0:
        game.update(1.0 / RATE, REST)
        leaps.append(float(np.linalg.norm(game.ball.place - ball)))
        ball = game.ball.place
        player, rig = game.player, game.player.stock.banks["moves"]
        if player.playing == "catch_contested.Other":
            down = {
                rig.skeleton.names.index(foot.replace("Foot", "Toe")): on
                for foot, on in zip(rig.feet, player.pose.contacts, strict=True)
            }
            here = {foot: player.pose.positions[foot] for foot, on in down.items() if on}
            standing = [foot for foot in here if foot in before and here[foot][1] < 0.023]  # one that steps to rest is lifted
            slides += [float(np.linalg.norm((here[foot] - before[foot])[[0, 2]])) for foot in standing]
            before = here
    assert max(leaps) < 0.4
    assert len(slides) > 60
    assert max(slides) < 0.01


@pytest.mark.parametrize(("run", "clip"), [(False, "walk_about_left"), (True, "jog_about_left")])
def test_who_turns_back_plays_a_turn_about(game: Game, run: bool, clip: str):
    put(game, -10.0, -15.0)
    push(game, 2.0, Stick(0.0, 1.0, run=run))
    seen = []
    for _ in range(round(0.5 * RATE)):
        game.update(1.0 / RATE, Stick(0.0, -1.0, run=run))
        seen.append(game.player.playing)
    assert seen.count(clip) > 20


def test_who_turns_and_stops_stands_with_the_hips_over_the_feet(game: Game):
    push(game, 2.0, Stick(0.0, 1.0))
    push(game, 0.4, Stick(math.sin(2.1), math.cos(2.1)))
    push(game, 4.0, REST)
    pose, names = game.player.moved.pose, list(game.player.stock.banks["moves"].skeleton.names)
    left, right, hips = (pose.positions[names.index(name)][[0, 2]] for name in ("LeftFoot", "RightFoot", "Hips"))
    assert math.dist(hips, (left + right) / 2.0) < 0.06
    assert math.dist(left, right) < 0.35


def test_who_runs_too_long_is_tired_and_plays_tired_clips(game: Game):
    put(game, -10.0, -15.0)
    game.player.stamina = 0.06
    push(game, 2.5, Stick(0.2, 1.0, run=True))
    assert game.player.moved.facts["style"] == "tired"
    assert game.player.playing.endswith("_tired")


def test_feet_stand_on_the_ramp_and_on_the_steps(game: Game):
    put(game, 4.5, 4.0)
    game.rival.character.body = replace(game.rival.character.body, position=(-10.0, -10.0))
    foot = [game.player.stock.banks["moves"].skeleton.names.index(name) for name in ("LeftToe", "RightToe")]
    above = []
    for _ in range(round(6.0 * RATE)):
        game.update(1.0 / RATE, Stick(0.0, 1.0))
        places = game.player.pose.positions[foot]
        above.append(min(y - world.ground(x, z)[0] for x, y, z in places))
    assert game.player.character.root.ahead_m > world.STEPS[-1].z[1]
    assert np.percentile(np.abs(above), 90) < 0.08


def test_where_no_row_is_valid_the_screen_says_so_and_what_is_missing(game: Game):
    push(game, 0.2, Stick(0.0, -1.0, strafe=True))
    words = game.player.readout
    assert words.rows == []
    assert words.gap.startswith("walk_strafe: direction is 180")


def test_the_screen_says_what_plays_why_and_which_rows_are_valid(game: Game):
    push(game, 1.5, Stick(0.0, 1.0))
    words = game.player.readout
    assert words.title.startswith("walk")
    assert "walk at" in words.why
    assert ("  5  walk", True) in words.rows
    assert words.gap == ""
    assert "gait Walk" in words.facts
    assert game.state[0].startswith("stamina")


def test_the_first_minute_leads_to_a_row_that_was_missing_and_then_is_over(tmp_path: Path):
    tables = play.copied(tmp_path / "tables")
    back = Stick(0.0, -1.0, strafe=True)
    with play.opened(tables) as game:
        guide = Guide(game)
        steps: list[str] = []

        def act(seconds: float, stick: Stick) -> None:
            for _ in range(round(seconds * RATE)):
                game.update(1.0 / RATE, stick)
                guide.update(1.0 / RATE)
                if steps[-1:] != [guide.text]:
                    steps.append(guide.text)

        act(1.0, REST)
        act(2.0, Stick(0.0, 1.0))
        act(1.5, back)
        with (tables / "moves.csv").open("a") as file:
            file.write(",Walk,Any,Any,Any,True\n")
        act(1.0, REST)
        act(1.5, back)
        moves = tables / "moves.csv"
        moves.write_text(moves.read_text().replace("\n,Walk", "\nwalk_back,Walk"))
        act(1.0, REST)
        act(1.5, back)
        act(10.0, REST)
    assert steps[:6] == [WALK, BACK, GAP, AGAIN, NAMELESS, AGAIN]
    assert steps[6].startswith("walk_back plays")
    assert steps[7:] == [""]


def test_a_crowd_is_coloured_by_the_rows_that_it_plays_and_obeys_a_save(tmp_path: Path):
    tables = play.copied(tmp_path / "tables")
    with Game(tables, settle_s=0.0, stock=play.stock(), n_crowd=20) as game:
        assert game.throng is not None
        push(game, 3.0, REST)
        assert game.throng.names.total() == 20
        assert (game.throng.rows >= 0).all()
        assert len(game.throng.names) > 1
        assert any(line.startswith("20 figures, coloured by their row: ") for line in game.state)
        moves = tables / "moves.csv"
        moves.write_text(moves.read_text().replace("jog,Run,1.2..3.1", "jog,Run,1.2..3.0"))
        push(game, 1.0, REST)
        assert {id(character.tables) for character in game.throng.crowd} == {id(game.player.moves)}


def test_characters_do_not_walk_through_each_other(game: Game):
    game.rival.character.body = replace(game.rival.character.body, position=(0.0, 3.0))
    game.ball = None
    put(game, 0.0, 0.0)
    nearest = 9.0
    for _ in range(round(4.0 * RATE)):
        game.update(1.0 / RATE, Stick(0.02, 1.0))
        nearest = min(nearest, math.dist(game.player.character.body.position, game.rival.character.body.position))
    assert nearest > 0.55


@pytest.mark.parametrize(
    ("here", "there", "free"),
    [
        ((0.0, 0.0), (0.0, 0.05), True),
        ((-3.0, 5.4), (-3.0, 5.6), False),
        ((4.5, 1.9), (4.5, 2.1), True),
        ((2.9, 6.0), (3.1, 6.0), False),
        ((3.1, 6.0), (2.9, 6.0), True),
        ((4.5, 9.4), (4.5, 9.5), True),
        ((0.0, 17.9), (0.0, 18.1), False),
    ],
    ids=["flat", "wall", "ramp", "side of the ramp", "down from it", "step", "edge"],
)
def test_a_body_goes_where_it_may(here: tuple[float, float], there: tuple[float, float], free: bool):
    assert world.is_free(here, there) is free


def test_a_stick_that_is_pushed_sideways_asks_for_its_pace():
    assert Stick(1.0, 1.0).velocity() == pytest.approx((0.99, 0.99), abs=0.01)
    assert Stick(0.1, 0.0).velocity() == (0.0, 0.0)
    assert Stick(0.0, 1.0, run=True).velocity(tired=True)[1] < Stick(0.0, 1.0, run=True).velocity()[1]


def test_a_file_that_is_no_stick_is_refused(tmp_path: Path):
    (tmp_path / "stick.csv").write_text("time_s,x\n0,far\n")
    with pytest.raises(FileError, match=r"stick\.csv.*this is no stick"):
        read_sticks(tmp_path / "stick.csv")


def test_the_clips_of_a_folder_that_has_none_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert main(["--clips", str(tmp_path), "--headless", "1"]) == 2
    assert "there is no BVH clip. Accepted: a folder with files *.bvh" in capsys.readouterr().err


@pytest.mark.skipif(not IS_FULL, reason="EXAMPLES=full makes a project of other clips")
def test_any_folder_of_clips_plays(tmp_path: Path, tables: Path):
    with Game(project_of_clips(tables / "clips"), settle_s=0.0) as game:
        for _ in played(game, 4.0, play.stick(tmp_path)):
            assert game.player.playing
        assert game.ball is None
        assert math.hypot(*game.player.character.body.velocity) > 1.0


def test_a_picture_file_holds_the_picture(tmp_path: Path):
    picture = np.zeros((4, 6, 3), np.uint8)
    picture[:2], picture[2, 3:] = (240, 30, 30), (20, 200, 90)
    png_files.write_png(tmp_path / "a.png", np.repeat(np.repeat(picture, 20, 0), 20, 1), np.zeros((80, 120, 3), np.uint8))
    assert np.abs(png_files.read_png(tmp_path / "a.png")[::20, ::20].astype(int) - picture).max() < 8


@pytest.mark.skipif(not IS_FULL, reason="EXAMPLES=full draws a picture of the page again")
def test_the_pictures_of_the_page_show_what_is_drawn_now():
    pytest.importorskip("panda3d", reason="the extra `playground` is not installed")
    drawn = importlib.import_module("playground_pictures").moment("playground-gap").astype(int)
    kept = png_files.read_png(ROOT / "docs" / "pictures" / "playground-gap.png")
    assert np.abs(drawn - kept).mean() < 4.0, "run: make docs"


def test_the_game_is_small():
    files = (ROOT / "examples" / "playground").glob("*.py")
    assert sum(len(file.read_text("utf-8").splitlines()) for file in files) < 1800


def test_the_pages_name_what_there_is():
    page = (ROOT / "docs" / "playground.md").read_text(encoding="utf-8")
    for name in (
        "playground-turn",
        "playground-vault",
        "playground-ramp",
        "playground-contest",
        "playground-tired",
        "playground-gap",
    ):
        assert f"pictures/{name}.png" in page
        assert (ROOT / "docs" / "pictures" / f"{name}.png").stat().st_size < 200_000
    assert (ROOT / "docs" / "pictures" / "playground.png").stat().st_size < 3_500_000
    assert "docs/pictures/playground.png" in (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.fixture
def window(game: Game) -> Iterator[Any]:
    pytest.importorskip("panda3d", reason="the extra `playground` is not installed")
    from panda3d.core import ClockObject

    from examples.playground.window import Window

    window = Window(game, is_offscreen=True, size=(640, 360))
    yield window
    ClockObject.getGlobalClock().setMode(ClockObject.M_normal)
    window.base.taskMgr.remove("game")
    window.base.destroy()


def test_the_picture_shows_the_player_and_what_is_said_without_a_screen(window: Any):
    push(window.game, 0.3, REST)
    picture = importlib.import_module("playground_pictures").picture(window).astype(int)
    assert picture.shape == (360, 640, 3)
    red, blue = picture[..., 0], picture[..., 2]
    warm = np.argwhere(red - blue > 60)
    assert 1000 < len(warm) < 40_000
    assert abs(warm[:, 1].mean() - 320) < 120
    words = (picture[:120, :300].min(axis=2) > 200).mean()
    assert 0.002 < words < 0.3


def test_few_pictures_a_second_do_not_make_the_play_slow(window: Any):
    from panda3d.core import ClockObject

    clock = ClockObject.getGlobalClock()
    clock.setMode(ClockObject.M_non_real_time)
    clock.setDt(0.2)
    window.begin()
    window.base.taskMgr.step()
    before_s = window.game.time_s
    for _ in range(5):
        window.base.taskMgr.step()
    assert window.game.time_s - before_s == pytest.approx(1.0)


def test_where_the_pointer_comes_from_is_no_look(window: Any, monkeypatch: pytest.MonkeyPatch):
    places, looks = iter([(900, 20), (330, 180)]), []

    def pointer(_: int) -> SimpleNamespace:
        x, y = next(places)
        return SimpleNamespace(getX=lambda: x, getY=lambda: y)

    front = SimpleNamespace(getForeground=lambda: True)
    seen = SimpleNamespace(
        getProperties=lambda: front, getPointer=pointer, getXSize=lambda: 640, getYSize=lambda: 360, movePointer=lambda *_: True
    )
    window.is_offscreen = False
    monkeypatch.setattr(window.base, "win", seen)
    monkeypatch.setattr(window.scene, "look", lambda *turn: looks.append(turn))
    window._look(0.1)
    assert not looks
    window._look(0.1)
    assert len(looks) == 1
    monkeypatch.undo()


def test_a_crowd_is_drawn_in_many_colours(tables: Path):
    pytest.importorskip("panda3d", reason="the extra `playground` is not installed")
    from examples.playground.window import Window

    pictures = importlib.import_module("playground_pictures")
    with Game(tables, settle_s=0.0, stock=play.stock(), n_crowd=60) as game:
        window = Window(game, is_offscreen=True, size=(640, 360))
        try:
            push(game, 1.0, REST)
            crowded = pictures.picture(window).astype(int)
            window.scene.throng.node.hide()
            empty = pictures.picture(window).astype(int)
        finally:
            window.base.destroy()
    assert (np.abs(crowded - empty).max(axis=2) > 40).mean() > 0.01


def test_a_gamepad_steers_looks_round_and_runs(window: Any):
    pushed = {"left_y": 1.0, "right_trigger": 0.9, "right_x": 0.5}
    pad = SimpleNamespace(
        poll=lambda: None,
        findAxis=lambda axis: SimpleNamespace(value=pushed.get(axis.name, 0.0)),
        findButton=lambda name: SimpleNamespace(pressed=name == "lshoulder"),
    )
    window.gamepads = lambda: [pad]
    stick = window._stick()
    assert (stick.x, stick.z, stick.run, stick.strafe) == (pytest.approx(0.0), pytest.approx(1.0), True, True)
    window._look(0.1)
    assert window.scene.turn == pytest.approx(-7.0)
    turned = window._stick()
    assert math.degrees(math.atan2(turned.x, turned.z)) == pytest.approx(-7.0)


def test_keys_steer_and_the_f_keys_do_what_the_help_says(window: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    from panda3d.core import ClockObject

    shown: list[str] = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("webbrowser.open", shown.append)
    window.begin()
    base = window.base
    clock = ClockObject.getGlobalClock()
    clock.setMode(ClockObject.M_non_real_time)
    clock.setDt(1.0 / RATE)

    def step(times: int) -> None:
        for _ in range(times):
            base.taskMgr.step()

    assert "contextdb edit " in window.middle.getText()
    base.messenger.send("f4")
    base.messenger.send("w")
    step(60)
    assert not window.middle.getText()
    assert window.game.player.moved.facts["gait"] == "Walk"
    assert window.game.player.character.root.ahead_m > 0.3
    base.messenger.send("shift")
    base.messenger.send("f1")
    step(2)
    assert window.game.player.moved.facts["gait"] == "Run"
    assert "the page of the last minute" in window.middle.getText()
    for key in ("w-up", "shift-up", "f2", "f3", "f4"):
        base.messenger.send(key)
    step(2)
    assert window.is_slow
    assert window.game.player.moved.facts["gait"] == "Idle"
    assert len(motion.Trace.load(next(tmp_path.glob("playground-*.parquet")))) > 50
    window.paging.join(60)
    step(1)
    assert window.notice.startswith("Written: ")
    page = Path(unquote(urlparse(shown[0]).path))
    assert "walk" in page.read_text(encoding="utf-8")
    shutil.rmtree(page.parent)
