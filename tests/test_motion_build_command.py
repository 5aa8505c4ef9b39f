"""`contextdb motion build`: saves a database for each section, computes only what changed, and tells what it passed over."""

from __future__ import annotations

import contextlib
import errno
import io
import json
import os
import re
import shutil
from dataclasses import replace
from pathlib import Path
from unittest import mock

import pytest
from running import Result, run

from contextdb.cli import main
from contextdb.commands import watched_work
from contextdb.commands.motion_build_command import MotionProject
from contextdb.commands.motion_check_command import check_path
from contextdb.files.tensors import read_tensors
from contextdb.motion import inputs_of, make_clip, open_poses, write_bvh
from contextdb.motion.storage import building
from contextdb.motion.storage.pose_files import STORED_POSES
from contextdb.motion.storage.stored import open_database

TOML = """
[tables.locomotion]
[features.loco]
rate = 30.0
mirror = [["Left*", "Right*"]]
channels = [{ type = "position", bone = "LeftFoot" }, { type = "trajectory", what = "position", at = [0.33, 1.0] }]
[databases.jog]
table = "locomotion"
clips = "clips/*.bvh"
features = "loco"
[databases.tired]
clips = "clips/*_tired.bvh"
features = "loco"
mirror = true
"""
WRITTEN_BEFORE = Path(__file__).parent / "written_before"
JOG, TIRED = "game/jog.motion.safetensors", "game/tired.motion.safetensors"


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a project in game/."""
    (tmp_path / "game" / "clips").mkdir(parents=True)
    (tmp_path / "game" / "contextdb.toml").write_text(TOML, encoding="utf-8")
    (tmp_path / "game" / "locomotion.csv").write_text("Asset\nwalk\njog\nswim\nwalk\n", encoding="utf-8")
    for name in ("walk", "jog", "jog_tired"):
        write_bvh(make_clip(name).clip, tmp_path / "game" / "clips" / f"{name}.bvh", digits=3)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def build(*arguments: str) -> Result:
    result = run("motion", "build", *arguments)
    assert result.code == 0, result.err
    return result


def refused(*arguments: str) -> str:
    result = run("motion", "build", *arguments)
    assert (result.code, result.out) == (2, "")
    return result.err.removeprefix("contextdb: ").rstrip("\n")


def saved(folder: Path) -> list[str]:
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*.motion.safetensors"))


def megabytes(path: str) -> str:
    return f"{Path(path).stat().st_size / 1e6:.1f}"


# ---- what it writes and prints


def test_a_database_of_an_older_layout_is_replaced_with_a_word(here: Path):
    shutil.copy(WRITTEN_BEFORE / "walk.database.safetensors", here / JOG)
    result = build("game")
    said = f"{JOG} was of layout 1 and is replaced by one of layout 2. Since layout 2 costs are divided"
    assert [said in line for line in result.err.splitlines() if "layout" in line] == [True]
    assert open_database(JOG).n_frames > 0
    assert "layout" not in build("game").err


def test_every_database_is_saved_beside_its_toml_and_told_in_a_table(here: Path):
    result = build("game")
    assert saved(here) == [JOG, TIRED]
    jog, tired = open_database(JOG, verify=True), open_database(TIRED, verify=True)
    assert (jog.assets, tired.assets) == (("jog", "walk"), ("jog_tired", "jog_tired"))
    assert [line.split() for line in result.lines] == [
        ["database", "assets", "clips", "frames", "features", "MB", "computed", "cached", "file"],
        ["jog", "3", "2", f"{jog.n_frames:,}", "7", megabytes(JOG), "2", "0", JOG],
        ["tired", "1", f"{tired.n_frames:,}", "7", megabytes(TIRED), "1", "0", TIRED],
    ]
    assert len({line.rindex(" ") for line in result.lines}) == 1


def test_the_json_document_has_the_same_facts(here: Path):
    build("game")
    (here / "game" / "clips" / "walk.bvh").write_bytes((here / "game" / "clips" / "jog_tired.bvh").read_bytes())
    document = build("game", "--json").json
    assert document["format"] == 1
    jog, tired = document["databases"]
    frames = jog.pop("frames")
    assert jog == {
        "database": "jog",
        "file": JOG,
        "bytes": Path(JOG).stat().st_size,
        "table": "locomotion",
        "assets": 3,
        "clips": 2,
        "ranges": 2,
        "features": 7,
        "computed": ["walk"],
        "cached": ["jog"],
        "doubts": [],
    }
    assert frames == open_database(JOG).n_frames
    assert (tired["table"], tired["assets"], tired["clips"], tired["ranges"]) == (None, None, 1, 2)


def test_a_second_build_computes_nothing_and_writes_the_same_bytes(here: Path):
    build("game")
    before = Path(JOG).read_bytes()
    again = build("game/contextdb.toml")
    assert [line.split()[-3:-1] for line in again.lines[1:]] == [["0", "2"], ["0", "1"]]
    assert Path(JOG).read_bytes() == before


def test_watching_builds_again_with_the_clip_that_was_saved_alone(here: Path, monkeypatch: pytest.MonkeyPatch):
    time_s = [0.0]

    def sleep(seconds: float) -> None:
        time_s[0] += seconds
        if time_s[0] == seconds:
            write_bvh(make_clip("run").clip, Path("game/clips/walk.bvh"))
        if time_s[0] > 5.0:
            raise KeyboardInterrupt

    monkeypatch.setattr(watched_work, "sleep", sleep)
    monkeypatch.setattr(watched_work, "clock", lambda: time_s[0])
    told = [json.loads(line) for line in build("game", "--json", "--watch").out.splitlines()]
    assert [{clip for each in document["databases"] for clip in each["computed"]} for document in told][1:] == [{"walk"}]


def test_what_is_saved_is_up_to_date(here: Path):
    build("game")
    project = MotionProject.load("game")
    opened = building.open_or_build(project.config, project.folder, project.assets)
    assert not opened["jog"].layout.blocks.flags.owndata


@pytest.mark.parametrize("out", ["build", "build/deep/er"])
def test_databases_are_saved_into_another_folder(here: Path, out: str):
    build("game", "--out", out)
    assert saved(here) == [f"{out}/jog.motion.safetensors", f"{out}/tired.motion.safetensors"]


def test_one_database_alone_is_the_one_that_all_would_give(here: Path):
    build("game")
    whole = Path(TIRED).read_bytes()
    result = build("game", "--database", "tired", "--out", "alone")
    assert (saved(here / "alone"), len(result.lines)) == (["tired.motion.safetensors"], 2)
    assert (here / "alone" / "tired.motion.safetensors").read_bytes() == whole


def test_without_the_cache_everything_is_computed_and_nothing_kept(here: Path):
    for _ in range(2):
        result = build("game", "--no-cache")
        assert [line.split()[-3:-1] for line in result.lines[1:]] == [["2", "0"], ["1", "0"]]
    assert not (here / "game" / ".contextdb-cache").exists()


def test_a_database_of_any_name_stays_in_the_folder(here: Path):
    toml = TOML.replace("[databases.jog]", '[databases."../j o:g"]')
    (here / "game" / "contextdb.toml").write_text(toml, encoding="utf-8")
    build("game", "--out", "out")
    assert saved(here) == ["out/..%2Fj o%3Ag.motion.safetensors", "out/tired.motion.safetensors"]


# ---- what it tells on standard error


def test_assets_without_a_clip_and_clips_without_a_row_are_told(here: Path):
    write_bvh(make_clip("run").clip, here / "game" / "clips" / "run.bvh")
    assert build("game").err.splitlines() == [
        'contextdb: warning: [tables.locomotion] no database has a clip of 1 asset: "swim"',
        'contextdb: warning: no table has a row for 1 clip: "run"',
    ]


def test_nothing_is_told_when_all_assets_have_clips_and_all_clips_are_held(here: Path):
    (here / "game" / "locomotion.csv").write_text("Asset\nwalk\njog\njog_tired\n", encoding="utf-8")
    toml = TOML.replace("mirror = true", 'table = "locomotion"')
    (here / "game" / "contextdb.toml").write_text(toml, encoding="utf-8")
    assert "mirror" not in build("game").err


def test_markup_that_does_nothing_is_told(here: Path):
    (here / "game" / "marks.csv").write_text("asset,tag,from,to\njog_tierd,DoNotChoose,0,1\n", encoding="utf-8")
    (here / "game" / "contextdb.toml").write_text(TOML + 'markup = "marks.csv"\n', encoding="utf-8")
    last = build("game").err.splitlines()[-1]
    assert last.startswith('contextdb: warning: game/marks.csv, line 2, column "asset": no database holds the asset "jog_tierd".')
    assert last.endswith('Did you mean "jog_tired"?')


class Terminal(io.StringIO):
    """A standard error that is a terminal."""

    def isatty(self) -> bool:
        return True


def test_a_terminal_sees_a_bar_and_a_file_does_not(here: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("TERM", "xterm")
    assert "building" not in build("game", "--no-cache").err
    terminal = Terminal()
    with contextlib.redirect_stderr(terminal), contextlib.redirect_stdout(io.StringIO()):
        assert main(["motion", "build", "game", "--no-cache"]) == 0
    assert "building" in terminal.getvalue()
    assert "3/3" in terminal.getvalue()


def test_a_search_that_must_build_first_shows_the_same_bar(here: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("TERM", "xterm")
    terminal = Terminal()
    with contextlib.redirect_stderr(terminal), contextlib.redirect_stdout(io.StringIO()):
        assert main(["motion", "search", "game", "jog", "--query", "jog@0.5"]) == 0
    assert "building" in terminal.getvalue()


def test_an_interrupted_build_says_so_and_keeps_what_was_done(here: Path):
    real = building.extract

    def stop(file, cache):
        if file.asset == "walk":
            raise KeyboardInterrupt
        return real(file, cache)

    with mock.patch.object(building, "extract", stop):
        result = run("motion", "build", "game")
    assert (result.code, result.out) == (130, "")
    assert result.err.endswith("contextdb: interrupted\n")
    assert saved(here) == []
    assert build("game").lines[1].split()[-3:-1] == ["1", "1"]


# ---- what is refused


def test_a_project_without_databases_is_refused(here: Path):
    (here / "game" / "contextdb.toml").write_text("[tables.locomotion]\n", encoding="utf-8")
    assert refused("game") == (
        "game/contextdb.toml: no motion database is declared. "
        'Accepted: a section such as [databases.jog] with features and clips = "clips/*.bvh".'
    )


def test_an_unknown_database_is_refused_with_the_nearest(here: Path):
    assert refused("game", "--database", "tierd") == (
        'game/contextdb.toml: there is no [databases.tierd]. Accepted: "jog", "tired". Did you mean "tired"?'
    )
    assert saved(here) == []


def test_broken_clips_are_told_together_and_nothing_is_saved(here: Path):
    for name in ("a_tired", "b_tired"):
        (here / "game" / "clips" / f"{name}.bvh").write_text("HIERARCHY", encoding="utf-8")
    told = refused("game").splitlines()
    assert [line.partition(",")[0] for line in told] == ["game/clips/a_tired.bvh", "contextdb: game/clips/b_tired.bvh"]
    assert saved(here) == []


def test_faults_of_the_settings_are_told_together(here: Path):
    toml = TOML.replace("mirror = true", 'mirror = "yes"').replace('features = "loco"\nmirror', 'features = "lco"\nmirror')
    (here / "game" / "contextdb.toml").write_text(toml, encoding="utf-8")
    told = refused("game").splitlines()
    assert len(told) == 2
    assert 'Did you mean features = "loco"?' in told[0]
    assert "Did you mean mirror = true?" in told[1]


def test_two_databases_never_go_to_one_file_on_any_disk(here: Path):
    toml = TOML.replace("[databases.tired]", "[databases.JOG]")
    (here / "game" / "contextdb.toml").write_text(toml, encoding="utf-8")
    assert refused("game") == (
        "game/JOG.motion.safetensors: two databases would be written to one file, on a disk that ignores case. "
        'Accepted: another name for "jog", "JOG".'
    )


def test_no_such_project_and_no_such_folder_are_told(here: Path):
    assert refused("gmae") == (
        'gmae: there is no such folder. Accepted: a folder of tables, or its contextdb.toml. Did you mean "game"?'
    )
    (here / "file").write_text("", encoding="utf-8")
    assert refused("game", "--out", "file") == "file: the folder cannot be made: it is a file. Accepted: a folder."


def test_what_the_disk_refuses_is_told(here: Path):
    with mock.patch("os.fsync", side_effect=OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))):
        assert refused("game").startswith(f"{JOG}: the disk is full.")
    assert saved(here) == []


def test_a_rig_whose_sides_differ_is_told_with_bones_and_metres_cached_or_not(here: Path):
    assert "mirror" not in build("game").err
    clip = make_clip("jog_tired").clip
    offsets = clip.skeleton.offsets.copy()
    offsets[clip.skeleton.index("LeftLeg")] += [0.0, -3.0, 0.0]
    uneven = replace(clip, skeleton=replace(clip.skeleton, offsets=offsets))
    write_bvh(uneven, here / "game" / "clips" / "jog_tired.bvh", digits=3)
    expected = 'contextdb: warning: [databases.tired] mirror: the two sides of the rig differ in 1 clip, most in "jog_tired": '
    expected += '"LeftLeg" by 0.030 m, "RightLeg" by 0.030 m. '
    for _ in range(2):
        err = build("game").err
        assert expected in err
        assert "a rig with equal sides, mirror = false, or" in err
    (told,) = [each for each in check_path("game").findings if each.rule == "uneven-sides"]
    assert (told.level, told.file) == ("warning", str(Path("game") / "contextdb.toml"))
    assert "mirror = false" in told.message


# ---- faults stop what needs them


OTHER = """
[features.other]
rate = 30.0
channels = [{ type = "position", bone = "Hips" }]
[databases.others]
clips = "others/*.bvh"
features = "other"
[databases.broken]
clips = "broken/*.bvh"
features = "other"
[selectors.free]
order = [{ database = "others" }]
"""


@pytest.fixture
def two_kinds(here: Path) -> Path:
    """Databases of a second schema, one of them with a clip that cannot be read."""
    game = here / "game"
    (game / "contextdb.toml").write_text(TOML + OTHER, encoding="utf-8")
    for folder in ("others", "broken"):
        (game / folder).mkdir()
        write_bvh(make_clip("walk").clip, game / folder / f"{folder}_walk.bvh", digits=3)
    (game / "broken" / "bad.bvh").write_text("no clip", encoding="utf-8")
    return game


def test_a_broken_clip_stops_a_build_and_with_keep_going_only_itself(two_kinds: Path):
    assert "bad.bvh" in refused("game")
    result = run("motion", "build", "game", "--keep-going", "--json")
    assert result.code == 1
    assert "left out: game/broken/bad.bvh, line 1" in result.err.replace(os.sep, "/")
    assert {row["database"]: row["clips"] for row in result.json["databases"]} == {"jog": 2, "tired": 1, "others": 1, "broken": 1}
    assert len(result.json["left_out"]) == 1
    (two_kinds / "broken" / "bad.bvh").unlink()
    assert run("motion", "build", "game", "--keep-going").code == 0


def test_with_keep_going_a_database_without_a_good_clip_leaves_its_file_as_it_was(two_kinds: Path):
    run("motion", "build", "game", "--keep-going")
    before = (two_kinds / "broken.motion.safetensors").read_bytes()
    (two_kinds / "broken" / "broken_walk.bvh").write_text("", encoding="utf-8")
    result = run("motion", "build", "game", "--keep-going")
    assert (result.code, "broken" in result.out) == (1, False)
    assert (two_kinds / "broken.motion.safetensors").read_bytes() == before


@pytest.mark.parametrize("is_saved", [False, True])
def test_a_broken_database_stops_no_search_of_another(two_kinds: Path, is_saved: bool):
    if is_saved:
        run("motion", "build", "game", "--keep-going")
    of_other_features = run("motion", "search", "game", "jog", "--query", "walk@0.5")
    assert (of_other_features.code, of_other_features.err) == (0, "")
    of_the_same = run("motion", "search", "game", "others", "--query", "others_walk@0.5")
    assert of_the_same.code == 0
    assert "warning: left out: " in of_the_same.err
    assert run("motion", "select", "game", "free", "--query", "others_walk@0.5").code == 0
    needed = run("motion", "search", "game", "broken", "--query", "broken_walk@0.5")
    assert needed.code == 2
    assert "bad.bvh" in needed.err


def test_a_doubtful_clip_is_told_as_a_warning_and_built(here: Path):
    toml = here / "game" / "contextdb.toml"
    toml.write_text(TOML.replace('features = "loco"\nmirror', 'features = "loco"\nmetres_per_unit = 1.0\nmirror'), encoding="utf-8")
    result = build("game", "--json")
    assert "warning: [databases.tired] game/clips/jog_tired.bvh: the body is" in result.err.replace(os.sep, "/")
    assert "Try metres_per_unit = 0.01 (centimetres)." in result.err
    [doubt] = result.json["databases"][1]["doubts"]
    assert (doubt["rule"], doubt["asset"], doubt["frame"]) == ("odd-size", "jog_tired", None)


# ---- poses


def test_with_poses_a_bank_is_saved_beside_each_database_and_opened_where_it_is_up_to_date(here: Path):
    build("game", "--poses", "--database", "tired")
    bank = open_poses("game/tired.poses.safetensors", verify=True)
    database = open_database(TIRED)
    assert (bank.assets, bank.n_frames) == (database.assets, database.n_frames)
    assert inputs_of(TIRED) == read_tensors(Path("game/tired.poses.safetensors"), STORED_POSES)[1]["inputs"]
    assert not Path("game/jog.poses.safetensors").exists()


def test_poses_of_all_clips_cannot_be_had_where_faulty_ones_are_left_out():
    assert "one of the two" in refused("game", "--poses", "--keep-going")


STRAIGHT = """
[features.loco]
rate = 30.0
channels = [
  { type = "position", bone = "LeftFoot" },
  { type = "trajectory", what = "direction", at = [0.5, 1.0] },
]
[databases.all]
clips = "*.bvh"
features = "loco"
[databases.walk]
clips = "walk.bvh"
features = "loco"
"""


def test_a_channel_that_hardly_varies_is_told_once_with_its_spread_and_the_floor_that_is_its_scale(tmp_path: Path):
    (tmp_path / "contextdb.toml").write_text(STRAIGHT, encoding="utf-8")
    for name in ("walk", "jog"):
        write_bvh(make_clip(name).clip, tmp_path / f"{name}.bvh", digits=3)
    result = run("motion", "build", str(tmp_path))
    assert result.code == 0
    (told,) = [line for line in result.err.splitlines() if "[features.loco]" in line]
    assert open_database(tmp_path / "all.motion.safetensors").normalisation.scale[-1] == 0.2
    assert re.search(
        r'"trajectory direction at 0\.5 1 s" varies by 0\.0\d+ of a unit vector in all clips: the scale is 0\.2, as', told
    )
    assert told.endswith("a smaller scale would make it most of every cost. Clips that vary more, or weight = 0, change that.")
