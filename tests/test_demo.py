"""`contextdb demo`: what it prints is shown by the documents; here is what it keeps."""

from __future__ import annotations

from running import run

from contextdb.commands.demo_command import sample_folder
from contextdb.motion import RECIPES, Markup, load_bvh
from contextdb.project import Project


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
    assert "this is there already" in answer.err
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_the_sample_markup_fits_the_made_clips(tmp_path):
    run("demo", "--keep", str(tmp_path / "game"))
    clips = [load_bvh(path) for path in sorted(tmp_path.glob("game/clips/*.bvh"))]
    markup = Markup.load(tmp_path / "game" / "clips" / "marks.csv")
    assert markup.faults_for([clip.name for clip in clips], {clip.name: clip.duration_s for clip in clips}, rate=30.0) == []
