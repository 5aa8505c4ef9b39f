"""`contextdb check`: findings in each format, and exit codes for CI."""

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
from running import ROOT, run

import contextdb as cdb
from contextdb.report import formats

TOML = """
[conditions.speed]
type = "number"
min = 0
max = 10
[tables.jog]
[tables.gone]
file = "moved.csv"
"""
CLEAN = "Asset,speed\nrun,1..2\n"


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with the table `jog` in game/, as it should be."""
    (tmp_path / "game").mkdir()
    (tmp_path / "game" / "contextdb.toml").write_text(TOML.partition("[tables.gone]")[0], encoding="utf-8")
    (tmp_path / "game" / "jog.csv").write_text(CLEAN, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    return tmp_path


def write(here: Path, csv: str | bytes, name: str = "jog.csv") -> None:
    (here / "game" / name).write_bytes(csv if isinstance(csv, bytes) else csv.encode())


# ---- exit codes


LEVELS = {
    "error": "Asset,speed\nrun,5..3\n",
    "warning": "Asset,speed\nrun,1\nrun,2\n",
    "info": "Asset,speed\nrun,5..11\n",
    None: CLEAN,
}


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize(
    ("fail_on", "failing"), [(None, ["error"]), ("error", ["error"]), ("warning", ["error", "warning"]), ("none", [])]
)
@pytest.mark.parametrize("output_format", formats("check"))
def test_the_exit_code_is_1_for_findings_of_the_level_that_fails(
    here: Path, level: str | None, fail_on: str | None, failing: list[str], output_format: str
):
    write(here, LEVELS[level])
    options = ["--format", output_format, *([] if fail_on is None else ["--fail-on", fail_on])]
    result = run("check", "game", *options)
    assert (result.code, result.err) == (1 if level in failing else 0, "")


# ---- what is checked


def test_the_sample_tables_pass(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(ROOT)
    result = run("check", "tables", "--json")
    assert (result.code, result.err) == (0, "")
    assert {f["rule"] for f in result.json["findings"]} <= {"variety", "always-any"}


# ---- formats


BAD = "Asset,speed\nrun,5..3\nrun,fast\n"


def test_each_format_names_file_line_and_rule(here: Path):
    write(here, BAD)
    for output_format in formats("check"):
        out = run("check", "game", "--format", output_format).out
        assert "jog.csv" in out
        assert "empty-cell" in out
        assert "\x1b" not in out
    json.loads(run("check", "game", "--format", "sarif").out)
    ElementTree.fromstring(run("check", "game", "--format", "junit").out)
    assert run("check", "game", "--format", "github").lines[0].startswith("::error file=game/jog.csv,line=2,")


def test_every_finding_is_printed_on_demand(here: Path):
    write(here, "Asset,speed\n" + "".join(f"run{i},5..3\n" for i in range(200)))
    some, every = run("check", "game"), run("check", "game", "--all")
    assert len(some.lines) < 50
    assert "--all shows every one" in some.out
    assert sum("accepts no value" in line for line in every.lines) == 200


def test_names_from_a_file_cannot_move_the_cursor(here: Path):
    write(here, b'Asset,speed\n\x1b[2J\x1b[31mred,5..3\n\xe2\x80\xaeleft,5..3\n"two\nlines",5..3\n')
    for output_format in formats("check"):
        out = run("check", "game", "--format", output_format).out
        assert not set(out) & {"\x1b", "\x07", "\r"}
    text = run("check", "game").out
    assert "\u202e" not in text


CONTRACTS = """
[conditions.p]
type = "bool"
[tables.t]
[contracts.held]
table = "t"
when = "p"
some = "asset == 'a'"
[contracts.broken]
table = "t"
some = "asset == 'a'"
why = "There is always an a"
"""


@pytest.fixture
def promised(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text(CONTRACTS)
    (tmp_path / "t.csv").write_text("Asset,p\na,True\nb,False\n")
    return tmp_path


def test_a_broken_contract_fails_a_check_and_one_that_holds_is_listed(promised: Path):
    result = run("check", promised, "--format", "json")
    assert result.code == 1
    held, broken = json.loads(result.out)["contracts"]
    assert (held["name"], held["table"], held["holds"], held["share"], held["witness"]) == ("held", "t", True, [1.0, 1.0], None)
    assert (broken["holds"], broken["share"], broken["why"]) == (False, [0.5, 0.5], "There is always an a")
    assert broken["witness"] == {"cells": {"p": "False"}, "context": {"p": False}, "matches": [{"row": 1, "asset": "b"}]}


@pytest.mark.parametrize("form", ["text", "github", "junit", "sarif", "markdown"])
def test_every_format_shows_a_broken_contract(form: str, promised: Path):
    result = run("check", promised, "--format", form)
    assert result.code == 1
    assert "contracts.broken" in result.out.replace("\\", "")


def test_a_check_of_one_table_proves_its_contracts(promised: Path):
    assert "1 of 2 contracts proved." in run("check", promised / "t.csv").out


def test_a_contract_of_a_table_that_there_is_not_is_an_error(promised: Path):
    text = (promised / "contextdb.toml").read_text()
    (promised / "contextdb.toml").write_text(text.replace('[contracts.held]\ntable = "t"', '[contracts.held]\ntable = "tt"'))
    assert 'there is no table "tt"' in run("check", promised).out


def test_a_fault_of_a_table_is_reported_once_though_contracts_of_tables_made_of_it_cannot_be_proved(tmp_path: Path):
    tables = {"inner": "Asset,d\nx,tralse\n", "outer": "Asset,d\na,1..2\n@inner,Any\n", "child": "Asset,d\nz,1..2\n"}
    contracts = "".join(f"[contracts.{name}]\ntable = '{name}'\nat_most = 1\n" for name in tables)
    schema = f"[conditions.d]\ntype = 'angle'\n[tables.child]\nbase = 'inner'\n{contracts}"
    (tmp_path / "contextdb.toml").write_text(schema)
    for name, text in tables.items():
        (tmp_path / f"{name}.csv").write_text(text)
    findings = run("check", tmp_path, "--json").json["findings"]
    assert (
        sum("tralse" in finding["message"] for finding in findings) == 2
    )  # where it is, and why the base of "child" cannot be used
    assert [f["rule"] for f in findings if "[contracts." in f["message"]] == ["open-contract"] * 3


def test_a_save_from_python_and_a_rename_keep_contracts(promised: Path):
    table = cdb.Project.load(promised)["t"]
    table.with_cell(0, "p", "Any").save()
    assert (promised / "contextdb.toml").read_text() == CONTRACTS
    assert cdb.load(promised / "t.csv").schema.contracts.keys() == {"held", "broken"}


def test_proposed_contracts_hold_and_are_not_proposed_again(tmp_path: Path):
    toml = '[conditions.gait]\ntype = "enum"\nvalues = ["Walk", "Half Run"]\n[conditions.p]\ntype = "bool"\n[tables.t]\n'
    (tmp_path / "contextdb.toml").write_text(toml)
    (tmp_path / "t.csv").write_text('Asset,gait,p\na,Walk,Any\nb,"""Half Run""",True\n')
    proposed = run("check", tmp_path, "--propose")
    assert (proposed.code, proposed.lines) == (
        0,
        [
            "[contracts.t_gait_Walk_has_a_row]",
            'table = "t"',
            "when = \"gait == 'Walk'\"",
            "some = \"asset like '*'\"",
            "",
            "[contracts.t_one_at_a_time]",
            'table = "t"',
            "at_most = 1",
        ],
    )
    assert [p["holds"] for p in run("check", tmp_path, "--propose", "--json").json["proposed"]] == [True, True]
    (tmp_path / "contextdb.toml").write_text(toml + proposed.out)
    assert "2 of 2 contracts proved." in run("check", tmp_path).out
    assert run("check", tmp_path, "--propose").lines == ["# no contract holds that is likely meant"]
