"""`contextdb motion build`: saves a database for each section, computes only what changed, and tells what it passed over."""

import contextlib
import errno
import io
import json
import os
import re
from dataclasses import replace
from pathlib import Path
from unittest import mock

import pytest
from made_once import make_clip
from running import Result, run

from contextdb.cli import main
from contextdb.commands import motion_build_command
from contextdb.commands.motion_build_command import MotionProject
from contextdb.commands.motion_check_command import check_path
from contextdb.files.tensors import read_tensors
from contextdb.motion import write_bvh
from contextdb.motion.storage import building, extracting
from contextdb.motion.storage.pose_files import STORED_POSES, open_poses
from contextdb.motion.storage.stored import inputs_of, open_database

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


# ---- what it writes and prints


def test_watching_builds_again_with_the_clip_that_was_saved_alone(here: Path, monkeypatch: pytest.MonkeyPatch):
    time_s = [0.0]

    def sleep(seconds: float) -> None:
        time_s[0] += seconds
        if time_s[0] == seconds:
            write_bvh(make_clip("run").clip, Path("game/clips/walk.bvh"))
        if time_s[0] > 5.0:
            raise KeyboardInterrupt

    monkeypatch.setattr(motion_build_command, "sleep", sleep)
    monkeypatch.setattr(motion_build_command, "clock", lambda: time_s[0])
    told = [json.loads(line) for line in build("game", "--json", "--watch").out.splitlines()]
    assert [{clip for each in document["databases"] for clip in each["computed"]} for document in told][1:] == [{"walk"}]


def test_what_is_saved_is_up_to_date(here: Path):
    build("game")
    project = MotionProject.load("game")
    opened = building.open_or_build(project.config, project.folder, project.assets)
    assert not opened["jog"].layout.blocks.flags.owndata


def test_one_database_alone_is_the_one_that_all_would_give(here: Path):
    build("game")
    whole = Path(TIRED).read_bytes()
    result = build("game", "--database", "tired", "--out", "alone")
    assert (saved(here / "alone"), len(result.lines)) == (["tired.motion.safetensors"], 2)
    assert (here / "alone" / "tired.motion.safetensors").read_bytes() == whole


# ---- what it tells on standard error


def test_nothing_is_told_when_all_assets_have_clips_and_all_clips_are_held(here: Path):
    (here / "game" / "locomotion.csv").write_text("Asset\nwalk\njog\njog_tired\n", encoding="utf-8")
    toml = TOML.replace("mirror = true", 'table = "locomotion"')
    (here / "game" / "contextdb.toml").write_text(toml, encoding="utf-8")
    assert "mirror" not in build("game").err


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
    real = extracting.extract

    def stop(file, cache):
        if file.asset == "walk":
            raise KeyboardInterrupt
        return real(file, cache)

    with mock.patch.object(extracting, "extract", stop):
        result = run("motion", "build", "game")
    assert (result.code, result.out) == (130, "")
    assert result.err.endswith("contextdb: interrupted\n")
    assert saved(here) == []
    assert build("game").lines[1].split()[-3:-1] == ["1", "1"]


# ---- what is refused


def test_broken_clips_are_told_together_and_nothing_is_saved(here: Path):
    for name in ("a_tired", "b_tired"):
        (here / "game" / "clips" / f"{name}.bvh").write_text("HIERARCHY", encoding="utf-8")
    told = refused("game").splitlines()
    assert [line.partition(",")[0] for line in told] == ["game/clips/a_tired.bvh", "contextdb: game/clips/b_tired.bvh"]
    assert saved(here) == []


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


def test_with_keep_going_a_database_without_a_good_clip_leaves_its_file_as_it_was(two_kinds: Path):
    run("motion", "build", "game", "--keep-going")
    before = (two_kinds / "broken.motion.safetensors").read_bytes()
    (two_kinds / "broken" / "broken_walk.bvh").write_text("", encoding="utf-8")
    result = run("motion", "build", "game", "--keep-going")
    assert (result.code, "broken" in result.out) == (1, False)
    assert (two_kinds / "broken.motion.safetensors").read_bytes() == before


# ---- poses


def test_with_poses_a_bank_is_saved_beside_each_database_and_opened_where_it_is_up_to_date(here: Path):
    build("game", "--poses", "--database", "tired")
    bank = open_poses("game/tired.poses.safetensors", verify=True)
    database = open_database(TIRED)
    assert (bank.assets, bank.n_frames) == (database.assets, database.n_frames)
    assert inputs_of(TIRED) == read_tensors(Path("game/tired.poses.safetensors"), STORED_POSES)[1]["inputs"]
    assert not Path("game/jog.poses.safetensors").exists()


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
