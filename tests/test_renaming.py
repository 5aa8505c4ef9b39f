"""A condition gets another name in a whole project, or in one table of it: nothing is forked, and every answer stays."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from running import run

from contextdb.checks.cases import check_cases, read_cases
from contextdb.checks.run import check
from contextdb.edits.renaming import renaming, uses_of
from contextdb.errors import ContextDBError, FileError
from contextdb.expressions.names import names_in
from contextdb.tables.project import Project, load

TOML = """# a game
[conditions.speed]   # how fast
type = "number"
min = 0.0
unit = "m/s"         # metres

[conditions.target]
type = "number"
unit = "m/s"

[conditions.closing]
type = "number"
unit = "m/s"
expr = "speed - target"

[tables.a]
when = "Rule"
assume = ["speed < 9"]

[tables.b]
outputs = ["Note"]
assume = ["not (speed > 8)"]   # nobody

[blueprints.base]
conditions = ["speed", "target"]

[contracts.no_walk]
table = "a"
when = "speed > 5"      # and not walking
none = "asset like 'walk*'"
"""
FILES = {
    "contextdb.toml": TOML,
    "a.csv": "Asset,speed,closing,Rule\r\nrun,3..,>1,speed > 2 and target < 9\r\nwalk,..4,Any,Any\r\n",
    "b.csv": "Asset,speed,Note\njog,1..5,speed\n",
    "c.csv": "Asset,target\nstop,0\n",
    "a.cases.csv": "Case,Expected,speed,target\nfast,run,5,1\nslow,walk,1,1\n",
    "b.cases.csv": "Case,Expected,target\nany,jog,1\n",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write(tmp_path)


def write(folder: Path, **more: str) -> Path:
    for name, text in {**FILES, **more}.items():
        (folder / name).write_bytes(text.encode())
    return folder


def texts(folder: Path) -> dict[str, str]:
    return {path.name: path.read_bytes().decode() for path in sorted(folder.iterdir()) if path.is_file()}


def test_who_else_uses_a_condition_is_counted(folder: Path):
    uses = uses_of(load(folder / "a.csv"), "speed")
    assert uses.text == "1 table, 1 derived fact, 2 assumptions, 1 contract, 1 blueprint, 1 rule, 2 saved contexts"
    assert uses.is_elsewhere
    assert uses_of(load(folder / "a.csv"), "closing").text == ""
    assert uses_of(load(folder / "b.csv"), "Note").text == ""
    (folder / "d.csv").write_bytes(b"\xff")
    assert uses_of(load(folder / "a.csv"), "closing").tables == ("d",)


def test_everywhere_changes_all_that_names_the_condition_and_no_other_byte(folder: Path):
    renaming(load(folder / "a.csv"), "speed", "velocity").write()
    expected = {name: text.replace("speed", "velocity") for name, text in FILES.items()}
    expected["b.csv"] = FILES["b.csv"].replace("Asset,speed", "Asset,velocity")
    assert texts(folder) == dict(sorted(expected.items()))
    assert run("check", folder).code == 0


def test_only_here_leaves_all_others_as_they_are_and_declares_the_new_name_alike(folder: Path):
    renaming(load(folder / "a.csv"), "speed", "velocity", only_here=True).write()
    now = texts(folder)
    assert {name for name in FILES if now[name] != FILES[name]} == {"a.csv", "a.cases.csv", "contextdb.toml"}
    table = load(folder / "a.csv")
    old, new = table.schema.conditions["speed"], table.schema.conditions["velocity"]
    assert (old.domain, old.unit) == (new.domain, new.unit)
    assert table.settings.assume == ("velocity < 9",)
    assert table.schema.contracts["no_walk"].when == "velocity > 5"
    assert table.schema.tables["b"].assume == ("not (speed > 8)",)
    assert table.schema.conditions["closing"].expr == "speed - target"
    assert names_in(table.text(0, "Rule")) == ("velocity", "target")
    assert next(iter(read_cases(folder / "a.cases.csv"))).facts == {"velocity": "5", "target": "1"}
    assert run("check", folder).code == 0


def test_a_name_with_blanks_stands_in_backquotes_where_an_expression_names_it(folder: Path):
    renaming(load(folder / "a.csv"), "speed", "run speed").write()
    table = load(folder / "a.csv")
    assert table.text(0, "Rule") == "`run speed` > 2 and target < 9"
    assert table.schema.conditions["closing"].expr == "`run speed` - target"


def test_actors_that_are_kept_have_their_fact_under_the_new_name(tmp_path: Path):
    (tmp_path / "a.csv").write_text("Asset,Defender.near\nrun,True\n")
    (tmp_path / "a.cases.csv").write_text("Case,Expected,Defender.near\none,run,True\n")
    (tmp_path / "a.actors.json").write_text(
        '{"Defender": [{"name": "Ivy", "near": true}], "Receiver": [{"near": 1, "Defender.near": true}]}'
    )
    table = load(tmp_path / "a.csv")
    assert uses_of(table, "Defender.near").text == "1 saved context"
    renaming(table, "Defender.near", "Defender.close").write()
    actors = json.loads((tmp_path / "a.actors.json").read_text())
    assert actors == {"Defender": [{"name": "Ivy", "close": True}], "Receiver": [{"near": 1, "Defender.close": True}]}
    assert read_cases(tmp_path / "a.cases.csv")[0].facts == {"Defender.close": "True"}


@pytest.mark.parametrize("new", ["target", "Note", "Case"])
def test_a_name_that_is_taken_is_refused_and_nothing_is_written(folder: Path, new: str):
    with pytest.raises(ContextDBError):
        renaming(load(folder / "a.csv"), "speed", new)
    assert texts(folder) == dict(sorted(FILES.items()))


def test_a_file_that_changed_meanwhile_stops_the_rename_before_the_first_write(folder: Path):
    found = renaming(load(folder / "a.csv"), "speed", "velocity")
    (folder / "b.csv").write_bytes(b"Asset,speed,Note\njog,2..5,speed\n")
    before = texts(folder)
    with pytest.raises(FileError, match=r"b\.csv"):
        found.write()
    assert texts(folder) == before


def test_when_the_disk_refuses_a_file_those_before_it_are_put_back(folder: Path, monkeypatch: pytest.MonkeyPatch):
    from contextdb.edits import renaming as module
    from contextdb.errors import Fault

    found, real = renaming(load(folder / "a.csv"), "speed", "velocity"), module.write_atomic

    def refuse(path: Path, data: bytes) -> None:
        if path.name == "contextdb.toml":
            raise FileError(Fault("the disk is full."))
        real(path, data)

    monkeypatch.setattr(module, "write_atomic", refuse)
    with pytest.raises(FileError):
        found.write()
    assert texts(folder) == dict(sorted(FILES.items()))


@given(st.booleans(), st.sampled_from(["speed", "target"]), st.sampled_from(["velocity", "v 2", "Role.v", "in"]), st.data())
def test_a_renamed_condition_answers_as_before(only_here: bool, old: str, new: str, data: st.DataObject):
    facts = {name: data.draw(st.sampled_from([0.0, 2.5, 4.5, 8.5])) for name in ("speed", "target")}
    with tempfile.TemporaryDirectory() as name:
        folder = write(Path(name))
        before = {n: table.compile().query(facts, unknown="any").assets for n, table in Project.load(folder).tables.items()}
        renaming(load(folder / "a.csv"), old, new, only_here).write()
        now = Project.load(folder)
        both = {**facts, new: facts[old]}
        for n, table in now.tables.items():
            known = {fact: value for fact, value in both.items() if fact in table.compile().asked}
            assert table.compile().query(known, unknown="any").assets == before[n]
            assert not check_cases(table, read_cases(folder / f"{n}.cases.csv"))
        assert {f.level for f in check(now.tables["a"])} <= {"info", "warning"}
