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
from contextdb.edits.renaming_assets import asset_renaming
from contextdb.edits.renaming_values import value_renaming
from contextdb.errors import ContextDBError, FileError
from contextdb.expressions.tokens import names_in
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


FAMILY = {
    "studio/contextdb.toml": '[conditions.speed]\ntype = "number"\nmin = 0\nmax = 9\n[conditions.gait]\ntype = "enum"\n'
    'values = ["slow", "quick"]\n[conditions.fast]\ntype = "bool"\nexpr = "speed > 5"\n[tables.human]\nwhen = "Rule"\n'
    'expected = "seen.csv"\n[tables.orc]\nbase = "human"\nremove = "Gone"\n[tables.boss]\nbase = "orc"\n'
    "[contracts.walks]\ntable = \"orc\"\nnone = \"asset == 'walk' or asset == 'wal'\"\n",
    "studio/human.csv": "Asset,speed,gait,Rule\nwalk,..4,slow,speed < 3\nrun,4..,quick,\nwalk,..1,,gait == 'slow'\n",
    "studio/orc.csv": "Asset,Gone,speed,Rule\nwalk,,..3,\nwalk,True,,\nstomp,,5..,speed > 6\n",
    "studio/boss.csv": "Asset,gait\nrun,slow\nwalk,quick\n",
    "studio/seen.csv": "what,speed,gait\nslow ones,..2,slow\n",
    "game/contextdb.toml": '[project]\nextends = "../studio/contextdb.toml"\n[conditions.calm]\ntype = "bool"\n'
    'expr = "speed < 1 and gait == \'slow\'"\n[tables.moves]\nassume = ["speed < 9"]\n',
    "game/moves.csv": "Asset,speed,gait,calm\nidle,..1,slow,\nrun,1..,,False\n",
    "far/contextdb.toml": '[project]\nextends = "../game/contextdb.toml"\n',
    "far/all.csv": "Asset,speed\nany,2..\n",
    "other/contextdb.toml": '[project]\nextends = "../studio/contextdb.toml"\n[conditions.speed]\ntype = "number"\n',
    "other/own.csv": "Asset,speed,gait\nwalk,1,slow\n",
    "loose/contextdb.toml": '[conditions.speed]\ntype = "number"\n',
    "loose/own.csv": "Asset,speed\nwalk,1\n",
}


def family(folder: Path) -> Path:
    (folder / ".git").mkdir()
    for name, text in FAMILY.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    return folder


def family_now(folder: Path) -> dict[str, str]:
    return {name: (folder / name).read_text() for name in FAMILY}


def answers(folder: Path, names: dict[str, str]) -> dict[str, list[list[str]]]:
    """What every table of every project answers, with the new names of facts, values and assets read as the old ones."""
    lists = {}
    for project in ("studio", "game", "far", "other", "loose"):
        tables = Project.load(folder / project)
        for table in tables.values():
            compiled = table.compile()
            of = {names.get(name, name): name for name in compiled.asked}
            values = (
                dict(zip(("slow", "quick"), table.schema.conditions[of["gait"]].domain.values, strict=True)) if "gait" in of else {}
            )
            lists[f"{project}/{table.name}"] = [
                [names.get(asset, asset) for asset in compiled.query(dict(facts), unknown="any").assets]
                for speed in (0.5, 2.5, 3.5, 5.5, 8.0)
                for gait in ("slow", "quick")
                if (facts := {of[n]: v for n, v in {"speed": speed, "gait": values.get(gait)}.items() if n in of}) is not None
            ]
    return lists


@pytest.mark.parametrize(
    ("table", "rename", "old", "new"),
    [
        ("human", renaming, "speed", "v"),
        ("boss", renaming, "gait", "Hero.gait"),
        ("human", asset_renaming, "walk", "stroll"),
        ("boss", asset_renaming, "stomp", "crush"),
        ("human", lambda table, old, new: value_renaming(table, "gait", old, new), "slow", "very slow"),
    ],
)
def test_a_rename_carries_variants_and_the_projects_that_extend_this_one(tmp_path: Path, table, rename, old, new):
    before = answers(family(tmp_path), {})
    change = rename(load(tmp_path / "studio" / f"{table}.csv"), old, new)
    change.write()
    assert answers(tmp_path, {new: old}) == before
    assert not [
        f
        for p in ("studio", "game", "far", "other")
        for t in Project.load(tmp_path / p).values()
        for f in check(t)
        if f.level == "error"
    ]
    changed = {name for name, text in family_now(tmp_path).items() if text != FAMILY[name]}
    assert {str(file.path.relative_to(tmp_path)) for file in change.files} == changed
    assert not changed & {"loose/own.csv", "loose/contextdb.toml", "other/contextdb.toml"}
    change.reversed.write()
    assert family_now(tmp_path) == FAMILY


def test_only_here_is_the_table_with_its_variants(tmp_path: Path):
    studio = family(tmp_path) / "studio"
    asset_renaming(load(studio / "human.csv"), "walk", "stroll", only_here=True).write()
    renaming(load(studio / "human.csv"), "speed", "pace", only_here=True).write()
    for name in ("human", "orc", "boss"):
        assert "walk" not in (text := (studio / f"{name}.csv").read_text()), name
        assert "speed" not in text
    assert load(studio / "human.csv").schema.contracts["walks"].none == "asset == 'stroll' or asset == 'wal'"
    assert (tmp_path / "game" / "moves.csv").read_text() == FAMILY["game/moves.csv"]


@pytest.mark.parametrize(
    ("table", "rename", "old", "new", "words"),
    [
        ("boss", asset_renaming, "walk", "stroll", "of which boss is a variant"),
        ("orc", renaming, "speed", "pace", "of which orc is a variant"),
        ("human", asset_renaming, "walk", "stomp", "already: the two would be one"),
        ("boss", asset_renaming, "stomp", "run", "already: the two would be one"),
    ],
)
@pytest.mark.parametrize("only_here", [True, False])
def test_a_name_that_would_part_a_variant_from_its_base_is_refused(tmp_path: Path, table, rename, old, new, words, only_here):
    file = family(tmp_path) / "studio" / f"{table}.csv"
    if only_here or "already" in words:
        with pytest.raises(ContextDBError, match=words):
            rename(load(file), old, new, only_here)
    assert family_now(tmp_path) == FAMILY


def test_a_condition_that_a_project_declares_already_stops_a_rename_above_it(tmp_path: Path):
    with pytest.raises(ContextDBError, match=r"game.contextdb\.toml: the condition \"calm\" is declared already"):
        renaming(load(family(tmp_path) / "studio" / "human.csv"), "speed", "calm")
    with pytest.raises(ContextDBError, match=r"not declared in this file"):
        renaming(load(tmp_path / "game" / "moves.csv"), "speed", "pace")
    assert len(uses_of(load(tmp_path / "studio" / "human.csv"), "speed").projects) == 2
