"""Files beside the tables that are no tables break no command, and a declared table is always a table."""

from pathlib import Path

import pytest
from running import run

from contextdb.motion import Trace
from contextdb.tables.project import Project

TOML = """
[conditions.gait]
type = "bool"
[conditions.speed]
type = "number"
"""
STICK = "time_s,speed_mps,gait,speed\n0,1.1,1.1,0\n1,1.2,1.3,x\n"
OTHERS = {
    "stick.csv": (STICK, "recorded moments"),
    "walked.csv": ("time_s,x_mps,z_mps,gait\n0,0,1,x\n", "recorded moments"),
    "log.csv": ("Tick,gait\n1,x\n2,y\n", "recorded moments"),
    "marks.csv": ("asset,tag,from,to,value\nwalk,Fast,0,1,\n", "markup"),
    "asked.csv": ("Case,Expected,gait,speed\nat rest,walk,x,0\n", "saved contexts"),
    "contexts.csv": ("gait,speed\nx,1\n", "contexts"),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text(TOML, encoding="utf-8")
    (tmp_path / "moves.csv").write_text("Asset,gait,speed\nwalk,True,1..2\n", encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("name", OTHERS)
def test_what_looks_like_something_else_is_told_once_and_breaks_no_command(folder: Path, name: str):
    text, form = OTHERS[name]
    (folder / name).write_text(text, encoding="utf-8")
    assert list(Project.load(folder).tables) == ["moves"]
    for command in (["coverage", folder], ["compile", folder], ["query", folder / "moves.csv", "gait=True", "speed=1.5"]):
        assert run(*map(str, command)).code == 0
    result = run("check", str(folder), "--json")
    [told] = [f for f in result.json["findings"] if f["rule"] == "not-a-table"]
    assert (result.code, told["level"], told["file"]) == (0, "info", str(folder / name))
    assert f"looks like {form}" in told["message"]
    assert f'[tables.{Path(name).stem}] file = "{name}"' in told["message"]


def test_a_recorded_session_is_no_table(folder: Path):
    Trace().save(folder / "session.parquet")
    assert list(Project.load(folder).tables) == ["moves"]


@pytest.mark.parametrize("name", OTHERS)
def test_a_declared_table_is_always_a_table(folder: Path, name: str):
    text, _ = OTHERS[name]
    (folder / name).write_text(text, encoding="utf-8")
    (folder / "contextdb.toml").write_text(f'{TOML}[tables.{Path(name).stem}]\nfile = "{name}"\n', encoding="utf-8")
    found = run("check", str(folder), "--json").json["findings"]
    assert "not-a-table" not in {f["rule"] for f in found}
    assert Path(name).stem in Project.load(folder, strict=False).tables


@pytest.mark.parametrize(
    "text",
    [
        "Asset,gait,speed\nrun,x,y\n",
        "time,gait\nwalk_slow,x\n",
        "speed,asset,gait\n1,walk,x\n",
        "gait\nx\n",
        "Asset,tag,from\nwalk,a,x\n",
        "",
    ],
)
def test_a_table_with_faults_is_never_hidden(folder: Path, text: str):
    (folder / "new.csv").write_text(text, encoding="utf-8")
    found = run("check", str(folder), "--json").json["findings"]
    is_told = "new.csv" in {Path(f["file"]).name for f in found if f["file"]}
    assert is_told or "new" in Project.load(folder, strict=False).tables
    assert "not-a-table" not in {f["rule"] for f in found}


def test_a_file_that_a_command_names_is_read_as_a_table(folder: Path):
    (folder / "stick.csv").write_text(STICK, encoding="utf-8")
    assert "unreadable-cell" in {f["rule"] for f in run("check", str(folder / "stick.csv"), "--json").json["findings"]}
