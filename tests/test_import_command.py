"""`contextdb import`: what it decides is printed, what it writes is a table of the project, and bad input is told in words."""

from __future__ import annotations

import io
import os
import sys
from pathlib import Path

import openpyxl
import pytest
from openpyxl.worksheet.worksheet import Worksheet
from running import Result, run

from contextdb import cli
from contextdb.commands import import_command
from contextdb.tables.project import Project

TOML = '# ours\n[conditions.speed]\ntype = "number"\nunit = "m/s"\n'


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a project in game/ and a file moves.csv of another program."""
    (tmp_path / "game").mkdir()
    (tmp_path / "game" / "contextdb.toml").write_text(TOML, encoding="utf-8")
    (tmp_path / "moves.csv").write_text("Name;Speed;sped;pos\njog;2,5..4;1;CB\nrun;>4;2;CB FS\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(cli.COMMANDS, "import", "")
    return tmp_path


def refused(*arguments: str) -> str:
    result = run("import", *arguments)
    assert (result.code, result.out) == (2, "")
    return result.err


def test_standard_input_is_read_when_asked(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"Name\tspeed\r\njog\t5\r\n")))
    result: Result = run("import", "-", "game/pasted.csv", "--as", "tsv")
    assert result.lines[0] == "standard input (tab-separated text, as on the clipboard) became game/pasted.csv: 1 row."


def test_our_own_csv_is_copied_byte_for_byte():
    raw = b'\xef\xbb\xbfAsset Name,"speed"\r\n\r\n"jog","1..2"\r\nrun,5'
    Path("own.csv").write_bytes(raw)
    assert run("import", "own.csv", "game/own.csv").code == 0
    assert Path("game/own.csv").read_bytes() == raw


def test_a_large_import_says_what_it_is_at_also_where_no_terminal_is(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(import_command, "LARGE_BYTES", 10)
    monkeypatch.setattr(import_command, "LARGE_COLUMNS", 4)
    lines = run("import", "moves.csv", "game/moves.csv").err.splitlines()
    said = [line for line in lines if line.endswith("…")]
    assert said == [
        "moves.csv: reading 0 MB …",
        "moves.csv: 2 rows of 4 columns read; finding the type of each column …",
        "moves.csv: writing game/moves.csv …",
    ]


@pytest.mark.parametrize("where", ["read", "propose", "importing.plan_import"])
def test_an_import_that_is_interrupted_ends_with_130_and_writes_nothing(where: str, here: Path, monkeypatch: pytest.MonkeyPatch):
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(f"contextdb.commands.import_command.{where}", interrupted)
    assert run("import", "moves.csv", "game/moves.csv").code == 130
    assert [p.name for p in (here / "game").iterdir()] == ["contextdb.toml"]
    assert (here / "game" / "contextdb.toml").read_text(encoding="utf-8") == TOML


def workbook(path: Path, *rows: list[str]) -> None:
    book = openpyxl.Workbook()
    sheet = book.active
    assert isinstance(sheet, Worksheet)
    for row in rows:
        sheet.append(row)
    book.save(path)


def test_numbers_with_a_comma_in_a_workbook_are_told_by_column_and_become_decimals_when_asked(here: Path):
    workbook(here / "m.xlsx", ["Clip", "Speed", "name"], ["jog", "0,5", "1,5"], ["run", "1,8", "x"], ["hop", "0,5", "y"])
    result = run("import", "m.xlsx", "game/m.csv")
    assert (
        'm.xlsx: column "Speed": 3 cells with a comma, "0,5" in rows 1, 3, "1,8" in row 2, read as centre and tolerance, 0 ± 5; '
        "--decimal comma reads 0.5."
    ) in result.err
    assert '"name": ' not in result.err
    again = run("import", "m.xlsx", "game/m.csv", "--force", "--decimal", "comma")
    assert "read as centre and tolerance" not in again.err
    assert 'column "Speed": decimal commas became points: "0,5" is 0.5 in rows 1, 3, "1,8" is 1.8 in row 2.' in again.err
    assert Project.load(here / "game")["m"].text_column("speed").to_list() == ["0.5", "1.8", "0.5"]


def test_the_next_file_of_that_name_is_imported_as_the_last_one_when_asked(here: Path):
    rows = (["Clip", "Speed", "Level min", "Level max"], ["jog", "0,5", "1", "2"], ["run", "1,8", "2", "3"])
    workbook(here / "moves_W12.xlsx", *rows)
    workbook(here / "moves_W13.xlsx", *rows, ["hop", "2,5", "3", "4"])
    assert "nothing was chosen for" in refused("moves_W12.xlsx", "game/m.csv", "--again")
    assert run("import", "moves_W12.xlsx", "game/m.csv", "--sheet", "A1:D2", "--decimal", "comma", "--map", "Level max=").code == 0
    assert run("import", "moves_W13.xlsx", "game/m.csv", "--force", "--again").code == 0
    table = Project.load(here / "game")["m"]
    assert [(c.name, c.to_list()) for c in table.columns] == [
        ("Clip", ["jog", "run", "hop"]),
        ("speed", ["0.5", "1.8", "2.5"]),
        ("Level min", ["1", "2", "3"]),
    ]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes as POSIX has them")
def test_no_import_waits_for_the_reader_of_a_pipe_in_the_place_of_a_table(here: Path):
    os.mkfifo(here / "game" / "moves.csv")
    assert "game/moves.csv: this is not a regular file." in refused("moves.csv", "game/moves.csv", "--force")
