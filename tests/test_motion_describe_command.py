"""`contextdb motion describe` writes a table that checks, builds and drives; fills one that is there; tells where clips differ."""

import csv
import os
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_once import make_clip
from running import Result, run
from strategies import some

from contextdb.motion import write_bvh
from contextdb.motion.made.game import make_joint_clip

NAMES = ("idle", "walk", "walk_turn_left_90", "walk_turn_right_90", "jog", "start_walk", "stop_walk")
COLUMNS = ["Asset Name", "gait", "speed", "direction", "turn", "style", "duration_s", "start", "end"]
MOCAP = Path(os.environ.get("CONTEXTDB_MOCAP", Path(__file__).parents[2] / "shared" / "data" / "mocap"))


@pytest.fixture
def game(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "game" / "clips").mkdir(parents=True)
    for name in NAMES:
        put(tmp_path / "game", name)
    monkeypatch.chdir(tmp_path)
    return tmp_path / "game"


def put(game: Path, recipe: str, name: str = "") -> None:
    write_bvh(make_clip(recipe).clip, game / "clips" / f"{name or recipe}.bvh", digits=4)


def describe(*arguments: str, code: int = 0) -> Result:
    result = run("motion", "describe", *arguments)
    assert result.code == code, result.out + result.err
    return result


def rows(file: Path) -> list[list[str]]:
    with file.open(encoding="utf-8", newline="") as text:
        return list(csv.reader(text))


# ---- a new table


def test_the_same_clips_give_the_same_bytes(game: Path):
    assert describe("game/clips").out == describe("game/clips").out
    assert describe("game/clips", "--json").out == describe("game/clips", "--json").out


def test_clips_of_which_none_stands_are_told_so(game: Path):
    assert "no clip stands" not in describe("game/clips").err
    (game / "clips" / "idle.bvh").unlink()
    assert "no clip stands: whoever stops marches on the spot. Expected: a clip with the gait Idle." in describe("game/clips").err


def test_a_document_has_cells_and_measures(game: Path):
    document = describe("game/clips", "--json").json
    assert document["format"] == 1
    walk = next(clip for clip in document["clips"] if clip["asset"] == "walk")
    assert list(walk["cells"]) == COLUMNS[1:]
    assert walk["facts"]["speed_mps"]["middle"] == pytest.approx(1.3, abs=0.02)
    assert document["differences"] == document["left_out"] == []


def test_a_written_table_checks_builds_and_drives(game: Path):
    assert "7 rows written to game/moves.csv" in describe("game/clips", "--out", "game/moves.csv").out
    assert rows(game / "moves.csv")[0] == COLUMNS
    assert run("check", "game", "--fail-on", "warning").code == 0
    assert run("motion", "check", "game").code == 0
    assert run("motion", "build", "game").code == 0
    probed = run("motion", "probe", "game", "player", "--drive", "straight", "--speed", "1.3", "--json")
    assert probed.code == 0, probed.err
    (session,) = probed.json["sessions"]
    assert session["path_rms_m"] < 0.2
    assert session["frames_used_share"] > 0.0


def test_soft_columns_exclude_no_clip_and_cost(game: Path):
    describe("game/clips", "--out", "game/moves.csv")
    hard = rows(game / "moves.csv")
    told = describe("game", "--into", "game/moves.csv", "--soft", "turn", code=1).out
    assert "start_walk, turn: the cell is -55..55, it would be -55..55 ~0.5/30" in told
    assert rows(game / "moves.csv") == hard
    describe("game", "--into", "game/moves.csv", "--soft", "turn", "--update")
    soft = rows(game / "moves.csv")
    at = COLUMNS.index("turn")
    assert [row[at] for row in soft[1:]] == [row[at] if row[at] == "Any" else f"{row[at]} ~0.5/30" for row in hard[1:]]
    assert [row[:at] + row[at + 1 :] for row in soft] == [row[:at] + row[at + 1 :] for row in hard]
    assert "0 cells filled" in describe("game", "--into", "game/moves.csv", "--soft", "turn").out
    described = csv.reader(describe("game/clips", "--soft", "turn").lines)
    assert [row[at] for row in described] == [row[at] for row in soft]
    asked = run(
        "query", "game/moves.csv", "gait=Walk", "speed=1.3", "direction=0", "turn=70", "style=normal", "--json", "--unknown", "any"
    )
    assert "start_walk" in [match["asset"] for match in asked.json["matches"]], asked.json


def test_conditions_that_are_declared_stay(game: Path):
    toml = '[conditions.speed]\ntype = "number"\nmax = 50.0 # ours\n'
    (game / "contextdb.toml").write_text(toml, encoding="utf-8")
    describe("game/clips", "--out", "game/moves.csv")
    assert (game / "contextdb.toml").read_text(encoding="utf-8").startswith(toml)


def test_a_file_that_is_no_clip_is_left_out_and_told(game: Path):
    (game / "clips" / "bad.bvh").write_text("no clip", encoding="utf-8")
    result = describe("game/clips", code=1)
    assert "left out: game/clips/bad.bvh" in result.err
    assert len(result.lines) == len(NAMES) + 1


def test_clips_in_metres_are_taken_for_such(game: Path):
    for name in NAMES:
        clip = make_clip(name).clip
        scaled = replace(clip.skeleton, offsets=clip.skeleton.offsets * 0.01)
        values = clip.values.copy()
        values[:, :3] *= 0.01
        write_bvh(replace(clip, skeleton=scaled, values=values), game / "clips" / f"{name}.bvh")
    result = describe("game/clips", "--json")
    assert "a unit of 1 m (metres) is taken" in result.err
    speeds = {clip["asset"]: clip["facts"]["speed_mps"]["middle"] for clip in result.json["clips"]}
    assert speeds["walk"] == pytest.approx(1.3, abs=0.02)


def test_clips_in_metres_and_in_centimetres_in_one_folder_are_each_taken_for_what_they_are(game: Path):
    clip = make_clip("jog").clip
    values = clip.values.copy()
    values[:, :3] *= 0.01
    skeleton = replace(clip.skeleton, offsets=clip.skeleton.offsets * 0.01)
    write_bvh(replace(clip, skeleton=skeleton, values=values), game / "clips" / "a_jog.bvh")
    result = describe("game/clips", "--json")
    assert "a_jog and its rig (1 clip)" in result.err
    speeds = {clip["asset"]: clip["facts"]["speed_mps"]["middle"] for clip in result.json["clips"]}
    assert speeds["walk"] == pytest.approx(1.3, abs=0.02)
    assert speeds["a_jog"] == pytest.approx(2.5, abs=0.1)


def test_clips_in_which_another_axis_points_up_are_taken_for_such(game: Path):
    for name in NAMES:
        clip = make_clip(name).clip
        around = np.roll(clip.values[:, :3], 1, axis=1)  # z up: x, y, z of the clip become y, z, x
        skeleton = replace(clip.skeleton, offsets=np.roll(clip.skeleton.offsets, 1, axis=1))
        write_bvh(
            replace(clip, skeleton=skeleton, values=np.hstack((around, 0.0 * clip.values[:, 3:]))), game / "clips" / f"{name}.bvh"
        )
    result = describe("game/clips", "--out", "game/moves.csv")
    assert "would lie if y pointed up: z is taken to point up. --up says otherwise." in result.err
    assert "the body lies" not in result.err
    assert 'up = "z"' in (game / "contextdb.toml").read_text()
    assert "the body lies" in describe("game/clips", "--up", "y").err


def test_bodies_that_lie_are_told_with_the_axis_that_may_point_up(game: Path):
    clip = make_clip("walk").clip
    around = np.roll(clip.values[:, :3], 1, axis=1)  # z up: x, y, z of the clip become y, z, x
    skeleton = replace(clip.skeleton, offsets=np.roll(clip.skeleton.offsets, 1, axis=1))
    write_bvh(replace(clip, skeleton=skeleton, values=np.hstack((around, 0.0 * clip.values[:, 3:]))), game / "clips" / "walk.bvh")
    assert "walk: the body lies: it reaches" in describe("game/clips").err
    assert 'Try up = "z"' in describe("game/clips").err


# ---- a table that is there


def test_a_clip_whose_name_begins_with_an_at_sign_is_an_asset_and_no_table(game: Path):
    put(game, "walk", "@walk")
    describe("game/clips", "--out", "game/moves.csv")
    assert '"@walk"' in [row[0] for row in rows(game / "moves.csv")]
    assert run("check", "game").code == 0
    assert "0 cells filled, 0 rows added" in describe("game", "--into", "game/moves.csv").out


def test_a_clip_of_an_absurd_rate_is_left_out(game: Path):
    walk = game / "clips" / "walk.bvh"
    text = walk.read_text(encoding="utf-8")
    time = next(line for line in text.splitlines() if line.startswith("Frame Time:"))
    walk.write_text(text.replace(time, "Frame Time: 1e-300"), encoding="utf-8")
    assert "walk.bvh: the frame time is 1e-300 s" in describe("game/clips", code=1).err
    assert "left out" in run("motion", "prepare", "game/clips", "--only", "contacts").err


# ---- captured clips


@pytest.mark.skipif(not (MOCAP / "assets.csv").is_file(), reason="no captured clips: set CONTEXTDB_MOCAP to their folder")
def test_the_table_of_captured_clips_checks_and_drives(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "game" / "clips"
    folder.mkdir(parents=True)
    clips = some(sorted(MOCAP.rglob("*.bvh"), reverse=True), 20)
    for clip in clips:
        shutil.copy(clip, folder / clip.name)
    described = describe("game/clips", "--out", "game/moves.csv")
    assert "units of CMU" in described.err
    assert len(rows(tmp_path / "game" / "moves.csv")) == 1 + len(clips)
    assert run("check", "game", "--fail-on", "warning").code == 0
    assert run("motion", "check", "game", "--fail-on", "error").code == 0
    probed = run("motion", "probe", "game", "player", "--drive", "circle", "--drive", "straight", "--json")
    assert probed.code == 0, probed.err
    sessions = probed.json["sessions"]
    assert len(sessions) >= 10
    assert max(session["path_rms_m"] for session in sessions) < 0.2
    assert max(session["jumps_per_s"] for session in sessions) < 6.0


# ---- several databases


JOINT = """
[features.pose]
rate = 30.0
channels = [{ type = "velocity", bone = "Hips" }]
[databases.alone]
table = "alone"
clips = "clips/*.bvh"
features = "pose"
[databases.other]
table = "other"
clips = "more/*.bvh"
features = "pose"
[databases.greetings]
table = "greetings"
clips = "joint/*.bvh"
features = "pose"
roles = ["Host", "Guest"]
"""


@pytest.fixture
def meeting(game: Path) -> Path:
    for folder in ("more", "joint"):
        (game / folder).mkdir()
    write_bvh(make_clip("run").clip, game / "more" / "run.bvh")
    for role, clip in make_joint_clip("greet_walk").items():
        write_bvh(clip, game / "joint" / f"greet_walk.{role}.bvh")
    for table in ("alone", "other", "greetings"):
        (game / f"{table}.csv").write_text("Asset Name\n")
    (game / "contextdb.toml").write_text(JOINT)
    return game


def test_joint_clips_make_no_rows(meeting: Path):
    result = describe("game")
    assert sorted(line.split(",")[0] for line in result.lines[1:]) == sorted([*NAMES, "run"])
    assert result.err == ('contextdb: left out: the joint clips of "greetings": a row has no cell for what each actor does.\n')
    assert 'contextdb: "greetings" holds joint clips' in describe("game", "--into", "game/greetings.csv", code=2).err


def test_a_folder_of_joint_clips_gives_one_row_for_all_roles_and_a_database_with_them(game: Path):
    for name in ("greet_walk", "greet_run"):
        for role, clip in make_joint_clip(name).items():
            write_bvh(clip, game / "clips" / f"{name}.{role}.bvh", digits=3)
    put(game, "walk", "walk.v1")
    put(game, "jog", "walk.v2")
    told = describe("game/clips", "--out", "game/moves.csv").err
    assert "one row each for the joint clips" in told
    table = {row[0]: row[1:] for row in rows(game / "moves.csv")}
    assert sorted(set(table) - set(NAMES)) == ["Asset Name", "greet_run", "greet_walk", "walk.v1", "walk.v2"]
    assert table["greet_walk"][:5] == [""] * 5
    assert float(table["greet_walk"][5]) > 1.0
    assert 'roles = ["Guest", "Host"]' in (game / "contextdb.toml").read_text(encoding="utf-8")
    assert run("check", "game", "--fail-on", "warning").code == 0
    assert run("motion", "check", "game").code == 0
    assert run("motion", "build", "game").code == 0


def test_a_table_gets_rows_of_the_clips_of_its_own_databases(meeting: Path):
    describe("game", "--into", "game/other.csv")
    assert [row[0] for row in rows(meeting / "other.csv")[1:]] == ["run"]
