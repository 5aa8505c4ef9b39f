"""`contextdb check`: findings in each format, and exit codes for CI."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import polars as pl
import pytest
from running import ROOT, Result, run

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


def found(path: str = "game", *more: str) -> list[tuple[str, str, str | None]]:
    """Level, rule and table of each finding."""
    return [(f["level"], f["rule"], f["table"]) for f in run("check", path, "--json", *more).json["findings"]]


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


@pytest.mark.parametrize("path", ["gane", "game/jgo.csv", "nothing/here", "game/contextdb.tml", "game/none/"])
def test_the_exit_code_is_2_when_there_is_no_such_path(path: str):
    result = run("check", path)
    assert (result.code, result.out) == (2, "")
    assert "there is no such" in result.err


def test_a_misspelt_path_is_named_with_the_nearest():
    assert run("check", "game/jgo.csv").err == (
        "contextdb: game/jgo.csv: there is no such table. "
        'Accepted: a file, a folder of one table, or the name of a table of the project. Did you mean "game/jog.csv"?\n'
    )


# ---- what is checked


@pytest.mark.parametrize("path", ["game", "game/", "game/contextdb.toml", "game/jog.csv", "./game/../game"])
def test_a_folder_its_schema_or_one_table_can_be_checked(path: str):
    assert run("check", path) == Result(0, "jog: 1 row, 1 condition, nothing found\n\n1 table checked: nothing found.\n", "")


def test_the_name_of_a_table_can_be_checked(here: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(here / "game")
    assert run("check", "jog").code == 0


def test_every_table_of_a_folder_is_checked(here: Path):
    write(here, "Asset,speed\nrun,fast\n")
    write(here, "Asset,speed\nrun,5..3\n", "stray.csv")
    pl.DataFrame({"Asset": ["a"], "speed": [99]}).write_parquet(here / "game" / "stray2.parquet")
    assert found() == [
        ("error", "unreadable-cell", "jog"),
        ("error", "empty-cell", "stray"),
        ("warning", "outside-domain", "stray2"),
    ]


def test_a_declared_table_whose_file_is_missing_is_an_error(here: Path):
    (here / "game" / "contextdb.toml").write_text(TOML, encoding="utf-8")
    result = run("check", "game", "--json")
    assert result.code == 1
    (finding,) = result.json["findings"]
    assert {k: finding[k] for k in ("rule", "level", "table", "file", "row", "line")} == {
        **{"rule": "no-such-path", "level": "error", "table": "gone", "file": "game/moved.csv"},
        **{"row": None, "line": None},
    }
    assert [table["table"] for table in result.json["tables"]] == ["jog"]


def test_files_that_are_no_tables_are_errors_and_the_others_are_checked_all_the_same(here: Path):
    write(here, b"PK\x03\x04" + bytes(100), "sheet.csv")
    write(here, b"\xff\xfeA\0", "wide.csv")
    write(here, "Asset,speed\nrun,1,2\n", "ragged.csv")
    assert found() == [("error", "unreadable", "ragged"), ("error", "unreadable", "sheet"), ("error", "unreadable", "wide")]
    assert [t["table"] for t in run("check", "game", "--json").json["tables"]] == ["jog"]


def test_two_files_of_one_name_are_an_error(here: Path):
    pl.DataFrame({"Asset": ["a"], "speed": [1]}).write_parquet(here / "game" / "jog.parquet")
    result = run("check", "game", "--json")
    assert result.code == 1
    (finding,) = result.json["findings"]
    assert finding["message"] == 'table "jog" is also defined in "game/jog.csv". Accepted: one file for each table.'
    assert finding["file"] == "game/jog.parquet"


@pytest.mark.parametrize(
    ("toml", "line", "message"),
    [
        (b'[conditions.speed]\ntype = "nmber"\n', 2, 'Did you mean type = "number"?'),
        (b'[conditions.speed]\ntype = "number"\nmni = 0\n', 3, 'Did you mean "min"?'),
        (b"[conditions.speed\n", 1, ""),
        (b'[project]\nname = "caf\xe9"\n', 2, "the file is not UTF-8"),
        (b'[conditions.speed]\ntype = "number"\nmin = "low"\n', 3, "this is text, not a number"),
    ],
)
@pytest.mark.parametrize("path", ["game", "game/jog.csv", "game/contextdb.toml"])
def test_a_schema_that_cannot_be_meant_is_an_error_with_its_line(here: Path, path: str, toml: bytes, line: int, message: str):
    (here / "game" / "contextdb.toml").write_bytes(toml)
    result = run("check", path, "--json")
    assert result.code == 1
    (finding,) = result.json["findings"]
    assert (finding["level"], finding["file"], finding["line"]) == ("error", "game/contextdb.toml", line)
    assert message in finding["message"]


def test_a_folder_without_tables_is_an_error(here: Path):
    (here / "empty").mkdir()
    assert found("empty") == [("error", "no-tables", None)]
    assert run("check", "empty").code == 1


def test_the_sample_tables_pass(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(ROOT)
    result = run("check", "tables", "--json")
    assert (result.code, result.err) == (0, "")
    assert {f["rule"] for f in result.json["findings"]} <= {"variety", "always-any"}


# ---- saved contexts


CASES = "Case,Expected,speed\nslow,run,1\nfast,run,9\nbroken,run,quick\n"


@pytest.mark.parametrize("path", ["game", "game/jog.csv", "game/jog.cases.csv", "./game/jog.cases.csv"])
def test_saved_contexts_are_checked_with_their_table(here: Path, path: str):
    write(here, CASES, "jog.cases.csv")
    result = run("check", path, "--json")
    assert result.code == 1
    places = [(f["rule"], f["level"], f["table"], f["file"], f["line"], f["column"]) for f in result.json["findings"]]
    assert [(*place[:3], Path(place[3]).as_posix(), *place[4:]) for place in places] == [
        ("case-failed", "error", "jog", "game/jog.cases.csv", 3, "Expected"),
        ("unreadable-case", "error", "jog", "game/jog.cases.csv", 4, "speed"),
    ]


def test_saved_contexts_that_hold_say_nothing(here: Path):
    write(here, "".join(CASES.splitlines(keepends=True)[:2]), "jog.cases.csv")
    assert run("check", "game").lines == ["jog: 1 row, 1 condition, nothing found", "", "1 table checked: nothing found."]


def test_saved_contexts_are_not_asked_of_a_table_that_cannot_be_read(here: Path):
    write(here, "Asset,speed\nrun,fast\n")
    write(here, CASES, "jog.cases.csv")
    assert found("game/jog.cases.csv") == [("error", "unreadable-cell", "jog")]


@pytest.mark.parametrize("path", ["game", "game/jgo.cases.csv"])
def test_saved_contexts_without_a_table_are_an_error(here: Path, path: str):
    write(here, CASES, "jgo.cases.csv")
    [finding] = run("check", path, "--json").json["findings"]
    assert (finding["rule"], finding["level"], finding["file"]) == ("unreadable-case", "error", "game/jgo.cases.csv")
    assert 'Accepted: "jgo.csv" or "jgo.parquet". Did you mean "jog.cases.csv"?' in finding["message"]


@pytest.mark.parametrize("path", ["game", "game/jog.csv", "game/jog.cases.csv"])
def test_a_file_of_cases_that_cannot_be_read_is_an_error(here: Path, path: str):
    write(here, "case,speed\nslow,1\n", "jog.cases.csv")
    [finding] = run("check", path, "--json").json["findings"]
    assert (finding["rule"], finding["table"], finding["line"]) == ("unreadable", "jog", 1)
    assert finding["message"].endswith('Try to rename "case".')


def test_notes_with_a_git_conflict_are_an_error_and_others_are_not(here: Path):
    notes = "Asset,Column,Note,Colour\nrun,speed,why?,\n"
    write(here, notes, "jog.notes.csv")
    assert found() == []
    write(here, f"{notes}<<<<<<< ours\nrun,,,red\n=======\nrun,,,blue\n>>>>>>> theirs\n", "jog.notes.csv")
    for path in ("game", "game/jog.csv"):
        assert found(path) == [("error", "unreadable", "jog")]
    (finding,) = run("check", "game", "--json").json["findings"]
    assert (Path(finding["file"]).name, finding["line"]) == ("jog.notes.csv", 3)


def test_a_file_of_cases_that_is_not_there_is_no_such_path():
    result = run("check", "game/jog.cases.csv")
    assert (result.code, result.out) == (2, "")


def test_saved_contexts_of_a_declared_table_lie_beside_its_file(here: Path):
    (here / "game" / "deep").mkdir()
    (here / "game" / "contextdb.toml").write_text(TOML.replace("moved.csv", "deep/moved.csv"), encoding="utf-8")
    write(here, CLEAN, "deep/moved.csv")
    write(here, CASES, "deep/moved.cases.csv")
    write(here, CASES, "deep/stray.cases.csv")
    assert found() == [
        ("error", "case-failed", "gone"),
        ("error", "unreadable-case", "gone"),
        ("error", "unreadable-case", None),
    ]


# ---- formats


BAD = "Asset,speed\nrun,5..3\nrun,fast\n"


def test_the_json_document_has_the_promised_fields(here: Path):
    write(here, BAD)
    document = run("check", "game", "--json").json
    assert document["format"] == 1
    assert document == run("check", "game", "--format", "json").json
    empty, twice, unreadable = document["findings"]
    assert {key: empty[key] for key in ("rule", "level", "row", "asset", "line", "column", "message", "by")} == {
        "rule": "empty-cell",
        "level": "error",
        "row": 0,
        "asset": "run",
        "line": 2,
        "column": "speed",
        "message": '"5..3" accepts no value at all, so the row never matches.',
        "by": [],
    }
    rules = {f["rule"]: f for f in (twice, unreadable)}
    assert rules["duplicate-asset"]["by"] == [0]
    assert rules["unreadable-cell"]["line"] == 3


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


def test_in_junit_those_findings_fail_that_make_the_command_fail(here: Path):
    write(here, LEVELS["warning"] or "")
    for options, n_failures in [([], "0"), (["--fail-on", "warning"], "1")]:
        suites = ElementTree.fromstring(run("check", "game", "--format", "junit", *options).out)
        assert suites.get("failures") == n_failures


@pytest.mark.parametrize("width", [50, 80, 160])
def test_text_is_wrapped_to_the_terminal(here: Path, monkeypatch: pytest.MonkeyPatch, width: int):
    monkeypatch.setenv("COLUMNS", str(width))
    write(here, "Asset,speed\n" + "".join(f"run{i},{i}..fast\n" for i in range(3)))
    lines = run("check", "game").lines
    assert max(map(len, lines)) <= width
    assert len(lines) >= 6


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
