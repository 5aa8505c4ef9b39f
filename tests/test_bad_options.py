"""What is asked for and cannot be: each is refused with the place, what is accepted, and no traceback."""

from pathlib import Path

import pytest
from running import run

import contextdb as cdb
from contextdb.commands.motion_page import Played, parting_of
from contextdb.commands.motion_run_command import conditions_of
from contextdb.errors import ContextDBError
from contextdb.motion import Action, Decision, Trace
from contextdb.motion.selection.decision import Playing

TABLE = "Asset,speed\nwalk,0..2\nwalk,1..3\nrun,2..6\n"
TOML = '[conditions.speed]\ntype = "number"\nmin = 0\nmax = 9\n'


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "contextdb.toml").write_text(TOML, encoding="utf-8")
    for name in ("one", "two"):
        (tmp_path / f"{name}.csv").write_text(TABLE, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("coverage . --gap 1", '--gap and --explain are about one table, and there are 2. Accepted: one of "one", "two".'),
        ("coverage --html", 'there is no option "--html". Did you mean "--format html"?'),
        ("coverage one.csv --explain walk", 'the asset "walk" is in 2 rows. Accepted: one of the rows 1, 2.'),
        ("coverage one.csv --telemetry t.parquet --scheduler tcp://x", "--scheduler is the address of Dask's."),
        ("query one.csv speed=1 --prefer distance", "there are no actors to choose from."),
        ("motion describe . --metres-per-unit much", '"much" is not a unit. Accepted: metres, such as 0.01 for centimetres.'),
        ("motion run . player s.csv --out s.parquet --rate fast", '"fast" is not a rate.'),
        ("motion coverage . --near cheap", '"cheap" is not a cost. Accepted: a number from 0 up'),
        ("motion describe .", "there is no file of clips in this folder or below it."),
    ],
)
def test_what_cannot_be_asked_is_refused_in_a_sentence(command: str, said: str):
    result = run(*command.split())
    assert (result.code, result.out) == (2, "")
    assert said in result.err.replace("\n", " ")


def test_two_clips_of_one_name_in_a_folder_are_named_both(folder: Path):
    for name in ("a", "b"):
        (folder / name).mkdir()
        (folder / name / "walk.bvh").touch()
    result = run("motion", "describe", ".")
    assert result.code == 2
    assert 'two clips are named "walk": "a/walk.bvh" and "b/walk.bvh".' in result.err


def test_a_second_import_of_a_file_that_is_declared_already_says_so(folder: Path):
    assert run("import", "one.csv", "three.csv").code == 0
    result = run("import", "one.csv", "three.csv", "--dry-run")
    assert "contextdb.toml says all of it already." in result.out


def test_a_toml_conflict_is_not_decided_by_take(folder: Path):
    for name, most in (("base", 9), ("ours", 8), ("theirs", 7)):
        (folder / f"{name}.toml").write_text(TOML.replace("max = 9", f"max = {most}"), encoding="utf-8")
    result = run("merge", "base.toml", "ours.toml", "theirs.toml", "--path", "contextdb.toml", "--take", "ours")
    assert result.code == 2
    assert "--take decides conflicts of tables." in result.err


def test_a_merge_goes_on_without_a_toml_that_cannot_be_read(folder: Path):
    for name, speed in (("base", "0..2"), ("ours", "0..2"), ("theirs", "0..3")):
        (folder / f"{name}.tmp").write_text(TABLE.replace("0..2", speed), encoding="utf-8")
    (folder / "contextdb.toml").write_text(TOML + "<<<<<<< ours\n", encoding="utf-8")
    result = run("merge", "base.tmp", "ours.tmp", "theirs.tmp", "--path", "one.csv")
    assert result.code == 0, result.err
    assert "Merging without it." in result.err
    assert (folder / "ours.tmp").read_text("utf-8") == TABLE.replace("0..2", "0..3")


def test_a_condition_that_is_called_as_a_column_of_the_stick_is_refused():
    table = cdb.Table.from_columns({"Asset": ["walk"], "speed_mps": ["0..2"]}).compile()
    with pytest.raises(ContextDBError, match='the condition "speed_mps" has the name of a column of the stick'):
        conditions_of({"moves": table})


def test_bones_that_are_not_found_are_named_with_what_declares_them(folder: Path):
    lines = ["HIERARCHY", "ROOT Ball", "{", "OFFSET 0 0 0", "CHANNELS 3 Xposition Yposition Zposition"]
    lines += ["End Site", "{", "OFFSET 0 9 0", "}", "}", "MOTION", "Frames: 2", "Frame Time: 0.033", "0 90 0", "0 91 0", ""]
    (folder / "ball.bvh").write_text("\n".join(lines), encoding="utf-8")
    result = run("motion", "bones", "ball.bvh")
    assert result.code == 0, result.err
    assert result.lines[-1].startswith("no bone for: feet, toes, mirror pairs; [features.NAME] can declare")


def test_where_two_sessions_part_is_a_sentence():
    def played(name: str, *actions: Action) -> Played:
        trace = Trace()
        for tick, action in enumerate(actions):
            playing = Playing("loco", action.name.lower(), 0, 0, 0.0, False)
            trace.record(Decision(tick, tick / 30.0, action, "So.", False, playing, None))
        return Played(f"some/{name}.parquet", trace, ".", {})

    one, longer, other = played("a", Action.START), played("b", Action.START, Action.CONTINUE), played("c", Action.JUMP)
    assert parting_of([one]) == ""
    assert parting_of([one, one]) == "Both play the same."
    assert parting_of([one, longer]) == "Both play the same as long as both last."
    assert parting_of([one, other]).startswith("They part at 0.00 s: a.parquet plays start")
    assert parting_of([one, other]).endswith("Of 1 update, 1 play another asset.")
