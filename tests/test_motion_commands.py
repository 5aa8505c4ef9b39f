"""`contextdb motion search | select | run | replay` on a project of made clips; every argument wrongly too."""

import itertools
import json
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
from motion_project import MARKS, STICK, TABLE, session_folder, work_in_copy
from running import Result, run

from contextdb.commands.motion_command import COMMANDS
from contextdb.commands.motion_stage import read_tags
from contextdb.motion import (
    MotionConfig,
    TagFilter,
    load_bvh,
    open_or_build,
    poses_of,
    query_from,
    steady_path,
)
from contextdb.motion.trace.session import Trace
from contextdb.motion.trace.what_if import run_again
from contextdb.tables.project import Project

WALK = ("gait=Walk", "speed=1.2", "style=tired")


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a project in game/, its features computed, and a recorded session."""
    return work_in_copy(session_folder(), tmp_path, monkeypatch)


def motion(*arguments: str, code: int = 0) -> Result:
    result = run("motion", *arguments)
    assert result.code == code, result.err
    return result


def refused(*arguments: str) -> str:
    """The message of a command that is refused."""
    result = motion(*arguments, code=2)
    assert result.out == ""
    assert "Traceback" not in result.err
    return result.err


def rows_of(result: Result) -> list[list[str]]:
    """The rows of candidates that a command printed."""
    lines = result.lines
    header = next(i for i, line in enumerate(lines) if line.startswith("rank"))
    stop = next((i for i, line in enumerate(lines) if i > header and not line), len(lines))
    return [line.split() for line in lines[header + 1 : stop]]


# ---- the group


@pytest.mark.parametrize("arguments", [["--help"], ["-h"], ["help"]])
def test_the_group_lists_its_commands(arguments: list[str]):
    result = motion(*arguments)
    named = result.lines[result.lines.index("commands:") + 1 :]
    assert [line.split()[0] for line in named if line[2:3].strip()] == list(COMMANDS)
    assert run("motion") == Result(2, "", result.out)
    assert run("help", "motion") == result


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("width", [60, 100])
def test_each_command_has_a_help_that_fits_with_examples(command: str, width: int, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("COLUMNS", str(width))
    result = motion(command, "--help")
    assert result == run("help", "motion", command) == run("motion", "help", command)
    assert result.out.startswith(f"usage: contextdb motion {command} ")
    examples = [line for line in result.lines if line.startswith("  contextdb ")]
    assert len(examples) >= 2
    assert [line for line in result.lines if len(line) > width and line not in examples] == []


# ---- search


def test_a_search_prints_the_frames_that_the_database_finds():
    result = motion("search", "game", "all", *WALK, "--query", "walk_tired@1.0", "--speed", "1.2", "--turn", "15", "--k", "4")
    project = Project.load("game")
    config = MotionConfig.from_dict(project.schema.motion, tables=project.tables)
    database = open_or_build(config, "game", {"moves": project["moves"].assets})["all"]
    pose = load_bvh("game/clips/walk_tired.bvh")
    query = query_from(config.features["loco"], pose, 30, steady_path(1.2, 15.0))
    valid = project["moves"].compile().query({"gait": "Walk", "speed": 1.2, "style": "tired"})
    expected = database.candidates(query, 4, valid)
    assert [(row[1], int(row[3].replace(",", ""))) for row in rows_of(result)] == [(row.asset, row.frame) for row in expected]
    assert [float(row[4]) for row in rows_of(result)] == pytest.approx([row.cost for row in expected], abs=1e-3)
    assert result.lines[0] == "2 of 5 rows valid in moves"
    n_frames = database.n_frames - sum(expected.counts.values())
    assert result.lines[1] == f"{n_frames} of {database.n_frames:,} frames of all may play"
    assert result.err == ""


def test_a_saved_database_gives_the_same_answer_as_one_that_is_built():
    arguments = ("search", "game", "all", "--query", "walk@1", "--speed", "2")
    built = motion(*arguments)
    motion("build", "game")
    assert motion(*arguments) == built


def test_a_search_as_json_has_every_cost_and_reason():
    arguments = (*WALK, "--query", "walk@0.2", "--speed", "1.2", "--k", "300")
    document = motion("search", "game", "all", *arguments, "--left-out", "--json").json
    assert document["format"] == 1
    assert document["database"] == "all"
    assert document["context"] == {"gait": "Walk", "speed": 1.2, "style": "tired"}
    for row in document["rows"]:
        assert row["cost"] == pytest.approx(sum(row["channels"].values()) + sum(row["biases"].values()))
    rank, barred = next(each for each in enumerate(document["rows"], 1) if each[1]["left_out"])
    assert (barred["rank"], barred["asset"], barred["left_out"]) == (rank, "walk", "DoNotChoose")
    assert barred["events"] == ["Move.Walk", "DoNotChoose"]
    assert document["left_out"]["DoNotChoose"] == 16
    assert document["left_out"]["asset not valid"] > 0


def test_soft_cells_are_in_the_cost():
    arguments = ("gait=Run", "speed=2", "--query", "jog@1", "--json", "--k", "1")
    soft, plain = (motion("search", "game", "all", *arguments, f"style={style}").json["rows"][0] for style in ("tired", "normal"))
    assert soft["biases"]["penalty"] == 0.75
    assert "penalty" not in plain["biases"]
    assert soft["cost"] == pytest.approx(plain["cost"] + 0.75)


@pytest.mark.parametrize(
    ("tags", "assets"), [("Move", {"walk", "walk_tired", "jog"}), ("Move -Move.Walk", {"jog"}), ("+Move.Run", {"jog"})]
)
def test_tags_filter_frames(tags: str, assets: set[str]):
    rows = rows_of(motion("search", "game", "all", "--query", "walk@1", "--tags", tags, "--k", "2000"))
    assert {row[1] for row in rows} == assets


def test_tags_are_read_in_every_form():
    assert read_tags("A +B -C D~2.5 -E~1") == TagFilter("A", "B", "C", prefer={"D": 2.5}, avoid={"E": 1.0})


# ---- select


def test_else_the_lowest_cost_wins_and_both_are_told():
    document = motion("select", "game", "moves", "--query", "jog@1", "--json", "--k", "2").json
    assert document["format"] == 1
    assert (document["choice"]["database"], document["choice"]["reason"]) == ("all", "lowest cost")
    assert [search["status"] for search in document["choice"]["searches"]] == ["beaten", "winner"]
    assert [(found["database"], len(found["rows"])) for found in document["candidates"]] == [("tired", 2), ("all", 2)]
    assert document["playing"]["asset"] == "jog"
    assert document["cost"] == document["candidates"][1]["rows"][0]["cost"]


# ---- run


def test_a_run_follows_the_stick_and_only_valid_assets_play():
    trace = Trace.load("session.parquet")
    assert len(trace) == 151
    assert (trace[0].time_s, trace[-1].time_s) == (0.0, pytest.approx(5.0))
    at = {round(decision.time_s, 2): decision for decision in trace.brief()}
    assert at[0.5].playing.asset == "idle"
    assert at[2.0].playing.asset in ("walk", "walk_tired")
    assert at[3.5].playing.asset == "jog"
    assert at[4.9].playing.asset == "walk_tired"
    assert at[3.5].context == {"gait": "Run", "speed": 2.0, "style": "normal"}
    assert trace.about["all"]["rate"] == 30.0


def test_the_same_files_give_the_same_session():
    result = motion("run", "game", "player", "stick.csv", "--out", "again.parquet")
    assert Path("again.parquet").read_bytes() == Path("session.parquet").read_bytes()
    assert result.lines == [motion("replay", "again.parquet").lines[0]]
    document = motion("run", "game", "player", "stick.csv", "--out", "again.parquet", "--json").json
    assert document == {"format": 1, "file": "again.parquet", "updates": 151, "bytes": Path("again.parquet").stat().st_size}


def test_fewer_updates_and_no_candidates_are_recorded_when_asked_for():
    motion("run", "game", "player", "stick.csv", "--out", "few.parquet", "--rate", "10", "--k", "0")
    trace = Trace.load("few.parquet")
    assert len(trace) == 51
    assert not any(decision.candidates for decision in trace)


def test_a_stick_over_the_ground_steers_a_body_that_follows_it():
    Path("ground.csv").write_text("time_s,x_mps,z_mps,facing_deg\n0,0,1.3,\n2,1.3,0,\n4,0,0,90\n", encoding="utf-8")
    motion("run", "game", "player", "ground.csv", "--out", "ground.parquet")
    trace = Trace.load("ground.parquet")
    assert {decision.context for decision in trace.brief()} == {None}
    assert all(decision.playing is not None for decision in trace.brief())
    path = trace[75].query[6:10]  # where the body will be, to its left and ahead, at 0.33 and 1 s
    assert path[2] > 0.1  # it was asked to turn to the left


def test_contexts_may_come_from_parquet(here: Path):
    import polars as pl

    pl.read_csv(here / "stick.csv").write_parquet(here / "stick.parquet")
    motion("run", "game", "player", "stick.parquet", "--out", "again.parquet")
    assert Path("again.parquet").read_bytes() == Path("session.parquet").read_bytes()


def test_a_run_writes_the_poses_of_its_decisions_as_arrays_and_as_bvh(here: Path):
    motion("run", "game", "player", "stick.csv", "--out", "new.parquet", "--poses", "new.npz")
    motion("run", "game", "player", "stick.csv", "--out", "new.parquet", "--poses", "new.bvh")
    decisions = list(Trace.load("new.parquet"))
    with np.load(here / "new.npz") as poses:
        assert poses["asset"].tolist() == [decision.playing.asset for decision in decisions]
        assert poses["jumped"].tolist() == [decision.action == "jumps" for decision in decisions]
        assert not (poses["forced"] & ~poses["jumped"]).any()
        assert poses["positions"].shape == (len(decisions), len(poses["bones"]), 3)
        assert poses["rate"] == 30.0
        shown = poses_of(load_bvh(here / "new.bvh")).positions
        np.testing.assert_allclose(shown, poses["positions"], atol=1e-5)


def test_a_run_writes_its_poses_as_gltf(here: Path):
    pygltflib = pytest.importorskip("pygltflib", reason="needs the extra gltf")
    motion("run", "game", "player", "stick.csv", "--out", "new.parquet", "--poses", "new.glb")
    gltf = pygltflib.GLTF2().load(str(here / "new.glb"))
    assert gltf.accessors[gltf.animations[0].samplers[0].input].count == len(Trace.load("new.parquet"))


def test_without_the_library_a_run_to_gltf_is_refused_before_it_begins(here: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "pygltflib", None)
    told = refused("run", "game", "player", "stick.csv", "--out", "new.parquet", "--poses", "new.glb")
    assert 'pip install "contextdb[gltf]"' in told
    assert not (here / "new.parquet").exists()


def test_the_same_run_writes_the_same_poses(here: Path):
    for name in ("one", "two"):
        motion("run", "game", "player", "stick.csv", "--out", "new.parquet", "--poses", f"{name}.npz")
    assert (here / "one.npz").read_bytes() == (here / "two.npz").read_bytes()


def test_the_output_of_the_controller_says_how_poses_are_made(here: Path):
    toml = here / "game" / "contextdb.toml"
    toml.write_text(toml.read_text(encoding="utf-8") + '\n[output.player]\nroot = "code"\n', encoding="utf-8")
    (here / "ahead.csv").write_text(
        "time_s,speed_mps,turn_dps,gait,speed,style\n0,1.2,0,Walk,1.2,normal\n2,1.2,0,Walk,1.2,normal\n", encoding="utf-8"
    )
    motion("run", "game", "player", "ahead.csv", "--out", "new.parquet", "--poses", "new.npz")
    with np.load(here / "new.npz") as poses:
        np.testing.assert_allclose(poses["root"][:, 1], 1.2 * np.arange(61) / 30.0, atol=1e-9)
    bodies = [decision.body for decision in Trace.load("new.parquet")]
    np.testing.assert_allclose(bodies, [(0.0, 0.04 * i, 0.0) for i in range(61)], atol=1e-9)


def test_the_character_s_own_facts_are_computed_where_the_file_gives_none(here: Path):
    (here / "own.csv").write_text(
        "time_s,x_mps,z_mps,gait,speed,style\n0,0,1.3,Walk,,normal\n1,0,1.3,Walk,0.75,normal\n2,0,1.3,Walk,,normal\n",
        encoding="utf-8",
    )
    motion("run", "game", "player", "own.csv", "--out", "own.parquet")
    speeds = [decision.context["speed"] for decision in Trace.load("own.parquet").brief()]
    assert speeds[0] == 0.0
    assert speeds[:30] == sorted(speeds[:30])
    assert speeds[30:60] == [0.75] * 30
    assert speeds[60] == pytest.approx(1.3, abs=0.01)
    whole = (here / "own.csv").read_text(encoding="utf-8").replace(",speed", "").replace(",,", ",").replace("0.75,", "")
    (here / "own.csv").write_text(whole, encoding="utf-8")
    motion("run", "game", "player", "own.csv", "--out", "without.parquet")
    assert Trace.load("without.parquet")[20].context["speed"] == speeds[20]


def test_a_table_that_asks_for_the_character_s_own_facts_alone_filters_without_facts_in_the_file(here: Path):
    (here / "game" / "moves.csv").write_text("Asset,speed\nidle,0..0.3\njog,>0.3\n", encoding="utf-8")
    (here / "own.csv").write_text("time_s,speed_mps\n0,0\n1,1.3\n2,1.3\n", encoding="utf-8")
    motion("run", "game", "player", "own.csv", "--out", "own.parquet")
    played = [decision.playing.asset for decision in Trace.load("own.parquet").brief()]
    assert (played[10], played[40]) == ("idle", "jog")


def test_a_session_is_the_same_with_and_without_its_poses(here: Path):
    motion("run", "game", "player", "stick.csv", "--out", "new.parquet", "--poses", "new.npz")
    assert (here / "new.parquet").read_bytes() == (here / "session.parquet").read_bytes()


# ---- probe


KEYS = {
    "file", "seconds", "jumps_per_s", "forced_jumps", "jump_cm", "skate_cm_s", "skate_raw_cm_s", "accel_p99", "accel_raw_p99",
    "path_rms_m", "heading_rms_deg", "reach_s", "stay_s", "frames_used_share", "assets_never_used",
}  # fmt: skip
"""What `motion measure --json` has of each session."""


def test_a_probe_chooses_contexts_and_speeds_and_measures_each_drive(here: Path):
    result = motion("probe", "game", "player", "--drive", "straight", "--drive", "stops", "--json", "--out", "probed")
    sessions = result.json["sessions"]
    assert result.json["format"] == 1
    assert {session["facts"]["style"] for session in sessions} == {"normal", "tired"}
    assert {session["drive"] for session in sessions} == {"straight", "starts and stops"}
    assert all(session.keys() >= KEYS for session in sessions)
    for session in sessions:
        trace = Trace.load(session["file"])
        assert trace[-1].time_s == pytest.approx(session["seconds"], abs=0.05)
        assert {decision.context["style"] for decision in trace.brief()} == {session["facts"]["style"]}
        if session["drive"] == "straight":
            assert session["path_rms_m"] < 0.15
    assert "drives style=normal at" in result.err
    assert "gait=Idle while the stick asks for about 0.0" in result.err


def test_a_probe_exits_with_1_where_a_drive_is_over_a_bar():
    drive = ("probe", "game", "player", "--drive", "straight", "--speed", "1.2")
    assert motion(*drive, "--max-skate", "1000", "--max-jumps", "30").lines[-1] == "2 drives"
    result = motion(*drive, "--max-jumps", "0", code=1)
    assert "style=normal straight at 1.2 m/s: jumps a second: " in result.err
    assert ", more than 0.00." in result.err


# ---- replay


def test_a_replay_as_json_has_every_decision():
    document = motion("replay", "session.parquet", "--json").json
    assert (document["format"], len(document["decisions"])) == (1, 151)
    assert {"tick", "time_s", "action", "why", "playing", "cost", "continuing_cost"} <= document["decisions"][0].keys()
    named = motion("replay", "session.parquet", "--json", "--name", "JOG").json["decisions"]
    assert {decision["playing"]["asset"] for decision in named} == {"jog"}
    one = motion("replay", "session.parquet", "--json", "--at", "0").json
    assert one["candidates"][0]["rows"][0]["rank"] == 1
    assert len(one["query"]) == 11


# ---- why was mine not chosen


def test_replay_works_the_costs_of_any_asset_out_again(here, monkeypatch):
    (here / "stick.csv").write_text("time_s,speed_mps\n0,1.3\n0.5,1.3\n", encoding="utf-8")
    assert run("motion", "run", "game", "player", "stick.csv", "--out", "s.parquet", "--k", "1").code == 0
    first = run("motion", "replay", "s.parquet", "--at", "0", "--name", "jog", "--json").json
    assert first["not_asked"] is None
    assert {row["asset"] for row in first["asked"]} == {asset for asset in first_assets("game") if "jog" in asset}
    assert all(row["cost"] is not None and row["rank"] >= 1 and row["channels"] for row in first["asked"])
    shown = run("motion", "replay", "s.parquet", "--at", "0", "--name", "jog").out
    assert 'the best frames of assets whose name contains "jog" (summary)' in shown
    unknown = run("motion", "replay", "s.parquet", "--at", "0", "--name", "jgo")
    assert (unknown.code, 'Did you mean "jog"?' in unknown.err) == (2, True)
    (here / "game").rename(here / "moved")
    gone = run("motion", "replay", "s.parquet", "--at", "0", "--name", "jog").out
    assert "its project is no longer at" in gone
    assert run("motion", "replay", "s.parquet", "--at", "0", "--name", "jog", "--project", "moved").out == shown
    assert "no such folder" in run("motion", "replay", "s.parquet", "--at", "0", "--name", "jog", "--project", "nowhere").err


def first_assets(folder: str) -> set[str]:
    """The clips of a project."""
    return {path.stem for path in Path(folder).glob("**/*.bvh")}


# ---- a session asked again


def at_jump() -> str:
    """The tick at which jog starts."""
    return next(
        line.split()[0] for line in motion("replay", "session.parquet").lines if " jog " in line and line.split()[0].isdigit()
    )


def test_why_not_says_the_cell_and_the_change_that_wins():
    tick = at_jump()
    result = motion("replay", "session.parquet", "--at", tick, "--why", "walk_tired")
    assert result.lines[0].startswith(f"tick {tick} at ")
    assert "table: row 3 of moves: style is normal, the cell says tired" in result.lines
    assert {"why not", "what would have to change"} <= set(result.lines)
    document = motion("replay", "session.parquet", "--at", tick, "--why", "walk_tired", "--json").json
    why_not = document["why_not"]
    assert list(why_not) == ["asset", "frame", "rank", "cost", "winner_cost", "reasons", "changes"]
    assert all(list(change) == ["kind", "what", "to", "wins"] for change in why_not["changes"])
    assert any(change["wins"] for change in why_not["changes"])
    assert (document["tick"], why_not["asset"]) == (int(tick), "walk_tired")
    assert why_not["cost"] > why_not["winner_cost"]
    chosen = motion("replay", "session.parquet", "--at", tick, "--why", "jog", "--json").json["why_not"]
    assert (chosen["reasons"], chosen["changes"], chosen["rank"]) == ([], [], 1)


def test_a_proposed_cell_written_into_the_table_makes_what_was_said_true(here: Path):
    (here / "stick.csv").write_text("time_s,speed_mps,gait,speed,style\n0,1.3,Walk,1.2,normal\n1,1.3,Walk,1.2,normal\n", "utf-8")
    motion("run", "game", "player", "stick.csv", "--out", "s.parquet")
    told = motion("replay", "s.parquet", "--at", "0", "--why", "walk_tired", "--json").json["why_not"]
    change = next(change for change in told["changes"] if change["kind"] == "cell")
    assert change["what"] == "row 3 of moves: style"
    project = Project.load("game")
    table = project["moves"].with_cell(2, "style", change["to"])
    asked = Trace.load("s.parquet").reasked(project, tables={"moves": table})
    assert (asked[0].choice.hit.asset == "walk_tired") == change["wins"]
    (here / "game" / "moves.csv").write_text(
        TABLE.replace("walk_tired,Walk,0.3..2,tired", f"walk_tired,Walk,0.3..2,{change['to']}")
    )
    motion("run", "game", "player", "stick.csv", "--out", "t.parquet")
    assert (Trace.load("t.parquet")[0].choice.hit.asset == "walk_tired") == change["wins"]


def test_the_figures_of_a_session_are_those_of_its_decisions():
    document = motion("replay", "session.parquet", "--stats", "--json").json
    stats, decisions = document["stats"], list(Trace.load("session.parquet"))
    jumps = [decision for decision in decisions if decision.action == "jumps"]
    assert (stats["updates"], stats["jumps"], stats["searches"]) == (151, len(jumps), sum(d.searched for d in decisions))
    assert stats["forced_jumps"] == sum(decision.continuing_cost is None for decision in jumps)
    assert stats["jumps_per_s"] == pytest.approx(len(jumps) / 5.0)
    assert sum(stats["causes"].values()) == stats["searches"]
    used = {decision.playing.asset for decision in decisions}
    assert set(stats["assets_never_used"]) == {"idle", "walk", "walk_tired", "jog"} - used
    assert motion("replay", "session.parquet", "--stats").lines[0].startswith("5.00 s: 151 updates")


def test_what_if_counts_the_searches_that_choose_otherwise():
    heavy = motion(
        "replay", "session.parquet", "--what-if", "LeftFoot position=50", "--what-if", "continuing=-0.25", "--json"
    ).json["what_if"]
    trace = Trace.load("session.parquet")
    assert heavy["searches"] == sum(decision.searched for decision in trace)
    assert heavy["other_frames"] >= len(heavy["other_assets"])
    assert set(heavy["before"]) == set(heavy["after"]) >= {"jumps_per_s", "forced_jumps", "stay_s", "frames_used_share"}
    same = motion("replay", "session.parquet", "--what-if", "LeftFoot position=1", "--json").json["what_if"]
    assert (same["other_frames"], same["before"]) == (0, same["after"])
    lines = motion("replay", "session.parquet", "--what-if", "threshold tired=0").lines
    assert lines[0].startswith(f"of {heavy['searches']} recorded searches, ")


def test_what_if_of_another_table_runs_the_session_again_with_its_answers():
    project, trace = Project.load("game"), Trace.load("session.parquet")
    slower = project["moves"].with_cell(3, "speed", "9")
    told = trace.what_if(project, tables={"moves": slower})
    assert {each.was for each in told.other_assets} == {"jog"}
    again = run_again(trace.reasked(project, tables={"moves": slower}))
    assert "jog" not in {decision.playing.asset for decision in again}
    assert "jog" in {decision.playing.asset for decision in run_again(trace.reasked(project))}


def test_a_project_with_other_markup_or_clips_is_asked_by_the_names_of_assets(here: Path):
    tick = int(at_jump())
    trace = Trace.load("session.parquet")
    assert not any(each.is_changed for each in trace.reasked(Project.load("game")))
    marks = here / "game" / "clips" / "marks.csv"
    marks.write_text(f"{MARKS}jog,DoNotChoose,,,\n", encoding="utf-8")
    marked = trace.reasked(Project.load("game"))
    assert marked.changed == {"all"}
    assert marked[tick].choice.hit.asset != "jog"
    assert marked.why_not(tick, "jog").reasons[0] == "markup: DoNotChoose"
    assert not marked[0].is_changed
    marks.write_text(MARKS, encoding="utf-8")
    (here / "game" / "clips" / "idle.bvh").unlink()
    fewer = trace.reasked(Project.load("game"))
    assert "all" in fewer.changed
    assert fewer[0].decision.choice.hit.asset == "idle"
    assert fewer[0].choice.hit.asset != "idle"
    assert len(run_again(fewer)) == 151


def test_a_diff_says_where_two_sessions_part(here: Path):
    assert motion("replay", "session.parquet", "--diff", "session.parquet").lines[0] == "both play the same in all 151 updates"
    (here / "other.csv").write_text(STICK.replace("12.5,2.5,20,Run,2,normal", "12.5,1.2,0,Walk,1.2,normal"), encoding="utf-8")
    motion("run", "game", "player", "other.csv", "--out", "other.parquet")
    diff = motion("replay", "session.parquet", "--diff", "other.parquet", "--json").json["diff"]
    first, second = Trace.load("session.parquet"), Trace.load("other.parquet")
    parts = next(i for i, (a, b) in enumerate(zip(first, second, strict=True)) if a.playing != b.playing)
    assert diff["parting"]["tick"] == parts
    assert diff["other_frames"] == sum(a.playing != b.playing for a, b in zip(first, second, strict=True))
    assert motion("replay", "session.parquet", "--diff", "other.parquet").lines[0].startswith(f"they part at tick {parts}, ")


def test_a_chrome_trace_has_slices_counters_and_instants(here: Path):
    motion("replay", "session.parquet", "--trace", "session.json")
    events = json.loads((here / "session.json").read_text(encoding="utf-8"))["traceEvents"]
    decisions = list(Trace.load("session.parquet"))
    slices = [event for event in events if event["ph"] == "X" and event["cat"] == "plays"]
    assert sum(event["dur"] for event in slices) == round(decisions[-1].time_s * 1e6)
    assert all(one["ts"] + one["dur"] == other["ts"] for one, other in itertools.pairwise(slices))
    instants = [event["args"]["tick"] for event in events if event["ph"] == "i"]
    assert instants == [decision.tick for decision in decisions if decision.action in ("starts", "jumps")]
    counters = [event["args"]["cost"] for event in events if event["ph"] == "C"]
    assert counters == [decision.cost for decision in decisions if decision.cost is not None]


class LoggedStream:
    """Stands for a stream of rerun-sdk, and keeps what it is told."""

    kept: ClassVar[list[tuple[float, str, object]]] = []

    def __init__(self, *names: str, **options: str) -> None:
        self.time_s = 0.0
        self.kept.clear()

    def binary_stream(self) -> SimpleNamespace:
        return SimpleNamespace(read=lambda: b"RRF2")

    def set_time(self, timeline: str, *, duration: float) -> None:
        self.time_s = duration

    def log(self, path: str, what: object, *, static: bool = False) -> None:
        self.kept.append((self.time_s, path, what))

    def flush(self) -> None:
        pass


def test_a_recording_for_rerun_has_a_skeleton_a_moment_and_a_line_a_change(here: Path, monkeypatch: pytest.MonkeyPatch):
    levels = SimpleNamespace(WARN="WARN", INFO="INFO")
    parts = {name: lambda what, **options: what for name in ("LineStrips3D", "Points3D", "Scalars", "TextLog")}
    axes = SimpleNamespace(RIGHT_HAND_Y_UP="y up")
    fake = SimpleNamespace(RecordingStream=LoggedStream, TextLogLevel=levels, ViewCoordinates=axes, **parts)
    monkeypatch.setitem(sys.modules, "rerun", fake)
    motion("replay", "session.parquet", "--rrd", "session.rrd")
    assert (here / "session.rrd").read_bytes() == b"RRF2"
    decisions, kept = list(Trace.load("session.parquet")), LoggedStream.kept
    strips = [(time_s, what) for time_s, path, what in kept if path == "character/skeleton"]
    assert [time_s for time_s, _ in strips] == [decision.time_s for decision in decisions]
    assert all(np.shape(what) == (18, 2, 3) for _, what in strips)
    told = [(time_s, what) for time_s, path, what in kept if path == "plays"]
    changes = [each for each in decisions if each.action in ("starts", "jumps")]
    assert [time_s for time_s, _ in told] == [each.time_s for each in changes]
    assert all(each.playing is not None and each.playing.asset in str(what) for each, (_, what) in zip(changes, told, strict=True))


def test_rerun_itself_writes_a_recording(here: Path):
    pytest.importorskip("rerun", reason="needs the extra rerun")
    motion("replay", "session.parquet", "--rrd", "session.rrd")
    assert (here / "session.rrd").read_bytes()[:3] == b"RRF"


def test_without_rerun_its_extra_is_named(here: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert 'pip install "contextdb[rerun]"' in refused("replay", "session.parquet", "--rrd", "session.rrd")


def test_without_its_databases_a_session_says_what_is_missing(here: Path):
    whole = motion("replay", "session.parquet", "--at", "0").out
    (here / "game").rename(here / "moved")
    gone = motion("replay", "session.parquet", "--at", "0").out
    assert "no candidates are listed: its project is no longer at" in gone
    assert "top candidates" not in gone
    assert motion("replay", "session.parquet", "--at", "0", "--project", "moved").out == whole
    for asked in (["--at", "0", "--why", "jog"], ["--what-if", "continuing=-1"]):
        assert "the session cannot be searched again: its project is no longer at" in refused("replay", "session.parquet", *asked)
    toml = (here / "moved" / "contextdb.toml").read_text(encoding="utf-8")
    heavier = toml.replace('{ type = "velocity", bone = "Hips" }', '{ type = "velocity", bone = "Hips", weight = 3.0 }')
    (here / "moved" / "contextdb.toml").write_text(heavier, encoding="utf-8")
    assert (
        "is another than the one that the session was recorded with"
        in motion("replay", "session.parquet", "--at", "0", "--project", "moved").out
    )
    changed = Trace.load("session.parquet").reasked(Project.load("moved"))
    assert changed.changed == {"tired", "all"}
    assert any(each.is_changed for each in changed)


# ---- weights learned from choices


def test_learned_weights_are_written_once_and_nothing_else_changes(here: Path):
    assert "there is no choice in session.choices.csv" in refused("learn", "session.parquet")
    assert "there is no such file" in refused("learn", "nothing.parquet")
    searched = [each for each in Trace.load("session.parquet").brief() if each.choice is not None]
    choices = here / "session.choices.csv"
    choices.write_text(f"tick,asset,choice\n{searched[0].tick},jgo,+\n1000000,jog,-\n", "utf-8")
    assert 'line 2: no database has an asset "jgo"' in refused("learn", "session.parquet")
    choices.write_text("tick,asset,choice\n30,walk_tired,maybe\n", "utf-8")
    assert 'line 2, column "choice": "maybe" is not a choice.' in refused("learn", "session.parquet")
    chosen = searched[0].choice.hit.asset
    choices.write_text(f"tick,asset,choice\n{searched[0].tick},{chosen},+\n", "utf-8")
    assert "no other weights follow more of them" in motion("learn", "session.parquet").out
    choices.write_text("tick,asset,choice\n120,walk_tired,+\n", "utf-8")
    schema = here / "game" / "contextdb.toml"
    was = schema.read_text("utf-8")
    proposed = motion("learn", "session.parquet", "--json", code=1)
    assert schema.read_text("utf-8") == was
    document = proposed.json
    assert {"format", "choices", "pairs", "held_out", "unusable", "better"} <= document.keys()
    assert (document["now"]["searches"], document["after"]["searches"], document["written"]) == (0, 1, False)
    assert {"file", "searches", "other_assets", "before", "after"} <= document["sessions"][0].keys()
    assert "120    4.00  walk  walk_tired" in motion("learn", "session.parquet", "--write").out
    motion("build", "game")
    after = Project.load("game").schema.motion["features"]["loco"]["channels"]
    assert [each["weight"] for each in after] == [each["learned"] for each in document["weights"]]
    assert schema.read_text("utf-8").count("\n") == was.count("\n")
    assert "no other weights follow more of them: with the present ones 1 of 1" in motion("learn", "session.parquet").out


# ---- what forces jumps


def test_measure_names_the_columns_that_replay_names_for_each_forced_jump():
    expected: dict[tuple[str, ...], list[float]] = {}
    for decision in Trace.load("session.parquet").brief():
        if decision.action == "jumps" and decision.continuing_cost is None:
            why = motion("replay", "session.parquet", "--at", str(decision.tick), "--why", decision.before.asset, "--json").json
            reasons = [each.split(": ")[2] for each in why["why_not"]["reasons"] if each.startswith("table: ")]
            if reasons:
                expected.setdefault(tuple(each.split(" is ")[0] for each in reasons), []).append(decision.cost)
    assert len(expected) > 1
    session = motion("measure", "session.parquet", "--json").json["sessions"][0]
    named = {tuple(each["columns"]): (each["jumps"], each["cost"]) for each in session["forced_by"]}
    assert named == {columns: (len(costs), pytest.approx(max(costs))) for columns, costs in expected.items()}
    of, (columns, costs) = session["forced_jumps"], max(expected.items(), key=lambda each: len(each[1]))
    sentence = f"forced by {' and '.join(columns)}: {len(costs)} of {of} forced jumps, at a cost of up to {max(costs):.3g}"
    assert sentence in " ".join(motion("measure", "session.parquet").out.split())
    probed = motion("probe", "game", "player", "--drive", "stops", "--speed", "1", "--json").json["sessions"]
    assert all("forced_by" in each for each in probed)
