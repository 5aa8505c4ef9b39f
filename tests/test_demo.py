"""`contextdb demo`: what it prints is shown by the documents; here is what it keeps."""

import errno
import re
import sys
from pathlib import Path

import pytest
from running import run

from contextdb.commands.demo_command import (
    CATCH,
    DOWN_M,
    N_STEPS,
    RISE_M,
    SLOPE_M,
    STAIRS_M,
    _next,
    cast_lines,
    ground,
    players,
    sample_folder,
)
from contextdb.motion import Markup, load_bvh
from contextdb.motion.made.recipes import RECIPES
from contextdb.tables.project import Project


def test_the_folder_it_keeps_is_a_project_with_clips_and_their_markup(tmp_path):
    folder = tmp_path / "new" / "game"
    assert run("demo", "--keep", str(folder)).code == 0
    assert Project.load(folder).tables.keys() == Project.load(sample_folder()).tables.keys()
    assert {path.stem for path in folder.glob("clips/*.bvh")} == set(RECIPES)
    assert run("check", str(folder), "--fail-on", "error").code == 0


def test_it_never_writes_into_a_folder_that_is_there(tmp_path):
    (tmp_path / "mine.txt").write_text("mine", encoding="utf-8")
    answer = run("demo", "--keep", str(tmp_path))
    assert (answer.code, answer.out) == (2, "")
    assert "this already exists" in answer.err
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_a_disk_that_is_full_is_told_of_the_folder_to_keep_and_nothing_stays(tmp_path, monkeypatch):
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", "somewhere")

    monkeypatch.setattr("shutil.copyfile", full)
    done = run("demo", "--keep", tmp_path / "kept")
    assert done.code == 2
    assert done.err.startswith(f"contextdb: {tmp_path / 'kept'}: the disk is full.")
    assert list(tmp_path.iterdir()) == []


def test_the_sample_markup_fits_the_made_clips(tmp_path):
    run("demo", "--keep", str(tmp_path / "game"))
    clips = [load_bvh(path) for path in sorted(tmp_path.glob("game/clips/*.bvh"))]
    markup = Markup.load(tmp_path / "game" / "clips" / "marks.csv")
    assert markup.faults_for([clip.name for clip in clips], {clip.name: clip.duration_s for clip in clips}, rate=30.0) == []


def test_of_two_teams_it_casts_the_nearest_who_fits_and_says_of_everybody_near_why_he_does_not():
    everybody = players()
    assert sorted(str(p["team"]) for p in everybody) == ["away"] * 11 + ["home"] * 11
    assert len({p["id"] for p in everybody}) == 22
    compiled = Project.load(sample_folder())["contested_catch"].compile()
    fitting = [
        p for p in everybody if compiled.query({**CATCH, **{f"Defender.{f}": p.get(f) for f in p}}, unknown="never").assets
    ]  # without actors: each player's facts as plain facts
    told = list(cast_lines(compiled))
    cast = [line for line in told if "Defender is" in line]
    assert [line.partition(": Defender is ")[2] for line in cast] == [min(fitting, key=lambda p: p["distance"])["name"]]
    reasons = told[told.index("   Why nobody else who is near:") + 1 : -1]
    near = [p for p in everybody if p["distance"] < 3]
    assert sorted(line.partition(" of ")[2].partition(",")[0] for line in reasons) == sorted(
        str(p["name"]) for p in near if p not in fitting
    )


def test_it_plays_a_steered_character_and_writes_its_poses(tmp_path):
    out = run("demo", "--keep", str(tmp_path / "game"), "--html", str(tmp_path / "world.html")).out
    clip = load_bvh(tmp_path / "game" / "player.bvh")
    assert (clip.n_frames, clip.skeleton.n_joints) == (330, 19)
    assert "11 s, 330 poses of 19 joints: player.bvh" in out
    assert re.search(r"\d\.\d jumps a second; feet that are down slide \d+\.\d cm/s, in the clips \d\.\d; 0\.\d\d m from", out)
    page = (tmp_path / "world.html").read_text(encoding="utf-8")
    assert page.startswith("<!DOCTYPE html>")
    (slid, apart), *_ = re.findall(r"60 s over 8 steps.*feet slide (\d+\.\d) cm/s.* (\d\.\d\d) m from the path", out)
    assert float(slid) < 4.0
    assert float(apart) < 0.1


def test_a_page_that_cannot_be_written_is_refused_before_the_tour(tmp_path):
    answer = run("demo", "--html", str(tmp_path / "world.txt"))
    assert (answer.code, answer.out) == (2, "")


def test_the_world_has_stairs_a_landing_and_a_slope_down():
    on_a_step, height = ground(0.0, STAIRS_M + 0.1), ground(0.0, SLOPE_M - 0.1)
    assert on_a_step == (RISE_M, (0.0, 1.0, 0.0))
    assert height[0] == pytest.approx(N_STEPS * RISE_M)
    assert ground(0.0, DOWN_M + 1.0)[0] == 0.0


def test_it_prints_the_cast_between_the_first_answer_and_the_search():
    out = run("demo").out
    assert out.index("3. A ball in the air") < out.index("Defender is Marsh") < out.index("4. Clips") < out.index("7. The same")


@pytest.mark.skipif(sys.platform == "win32", reason="a script has another name there")
def test_it_ends_with_a_command_that_is_where_it_says(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    script = tmp_path / "bin" / "contextdb"
    script.parent.mkdir()
    script.touch(0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.executable", str(tmp_path / "bin" / "python"))
    monkeypatch.setenv("PATH", str(script.parent))
    assert _next("game") == 'Next: "contextdb edit game" opens the tables.'
    monkeypatch.setenv("PATH", "")
    assert _next("game") == f'Next: "{Path("bin", "contextdb")} edit game" opens the tables.'
    script.unlink()
    assert _next(None).startswith(f'Next: "{Path("bin", "python")} -m contextdb demo --keep FOLDER" writes these tables')
