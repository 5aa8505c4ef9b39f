"""`contextdb import`: what it decides is printed, what it writes is a table of the project, and bad input is told in words."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import pytest
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


def test_what_becomes_of_each_column_is_printed_with_the_reason():
    result = run("import", "moves.csv", "game/moves.csv")
    assert result.code == 0
    assert result.lines == [
        "moves.csv (CSV) became game/moves.csv: 2 rows.",
        "  column  becomes              why",
        "  Name    asset                the first column",
        '  Speed   condition speed      declared as "speed"',
        '  sped    new condition, int   whole numbers alone, as counts are; is "speed" meant? --map "sped=speed"',
        '  pos     new condition, enum  2 names in 2 cells: "CB", "CB FS"',
        'game/contextdb.toml declares 2 conditions ("sped", "pos") and the table "moves".',
    ]
    assert "semicolons between the fields" in result.err
    assert "decimal commas became points" in result.err
    said = 'moves.csv: column "pos": each text is one name, such as "CB FS"; --names words reads each word as a name.'
    assert said in result.err


def test_what_is_written_is_a_table_of_the_project():
    run("import", "moves.csv", "game/moves.csv")
    table = Project.load("game")["moves"]
    assert table.assets == ["jog", "run"]
    assert table.text_column("speed").to_list() == ["2.5..4", ">4"]
    assert table.compile().query({"speed": 3.0, "sped": 1, "pos": "CB"}).assets == ["jog"]
    assert Path("game/contextdb.toml").read_text(encoding="utf-8").startswith(TOML)


def test_a_dry_run_writes_nothing(here: Path):
    result = run("import", "moves.csv", "game/moves.csv", "--dry-run")
    assert "would become" in result.lines[0]
    assert "would declare" in result.lines[-1]
    assert [p.name for p in (here / "game").iterdir()] == ["contextdb.toml"]
    assert (here / "game" / "contextdb.toml").read_text(encoding="utf-8") == TOML


def test_a_column_is_left_out_and_another_takes_its_name():
    assert run("import", "moves.csv", "game/moves.csv", "--map", "Speed=", "--map", "sped=speed").code == 0
    assert [c.name for c in Project.load("game")["moves"].columns] == ["Name", "speed", "pos"]


def test_columns_are_renamed_and_typed_as_asked():
    result = run("import", "moves.csv", "game/moves.csv", "--map", "Name=Asset", "--type", "sped=output", "--type", "pos=text")
    assert result.code == 0, result.err
    table = Project.load("game")["moves"]
    assert [c.name for c in table.columns] == ["Asset", "speed", "sped", "pos"]
    assert table.condition("pos").condition.domain.kind == "text"
    assert table.settings.outputs == ("sped",)


def test_a_table_that_is_there_is_not_written_over_unless_forced():
    Path("game/moves.csv").write_text("A,speed\nx,1\n", encoding="utf-8")
    assert refused("moves.csv", "game/moves.csv").startswith("contextdb: game/moves.csv: the file already exists.")
    assert Path("game/moves.csv").read_text(encoding="utf-8") == "A,speed\nx,1\n"
    assert run("import", "moves.csv", "game/moves.csv", "--force").code == 0
    assert Project.load("game")["moves"].assets == ["jog", "run"]


def test_cells_that_cannot_be_read_are_told_and_kept():
    Path("bad.tsv").write_text("Name\tspeed\njog\t5;3\nrun\t6\n", encoding="utf-8")
    result = run("import", "bad.tsv", "game/bad.csv")
    assert result.code == 0
    assert result.lines[-2] == "1 cell cannot be read:"
    assert result.lines[-1].startswith('  speed, row 1: cannot read "5;3" as a number.')
    assert Project.load("game", strict=False)["bad"].text(0, "speed") == "5;3"


def test_standard_input_is_read_when_asked(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"Name\tspeed\r\njog\t5\r\n")))
    result: Result = run("import", "-", "game/pasted.csv", "--as", "tsv")
    assert result.lines[0] == "standard input (tab-separated text, as on the clipboard) became game/pasted.csv: 1 row."


def test_our_own_csv_is_copied_byte_for_byte():
    raw = b'\xef\xbb\xbfAsset Name,"speed"\r\n\r\n"jog","1..2"\r\nrun,5'
    Path("own.csv").write_bytes(raw)
    assert run("import", "own.csv", "game/own.csv").code == 0
    assert Path("game/own.csv").read_bytes() == raw


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("moves.csv", "game/moves.txt"), 'Did you mean "game/moves.csv"?'),
        (("moves.csv", "gaem/moves.csv"), 'there is no folder "gaem".'),
        (("move.csv", "game/m.csv"), 'Did you mean "moves.csv"?'),
        (("moves.csv", "game/m.csv", "--sheet", "x"), "has no sheets"),
        (("moves.csv", "game/m.csv", "--map", "pos"), '--map "pos" has no =.'),
        (("moves.csv", "game/m.csv", "--map", "posi=x"), 'Did you mean "pos"?'),
        (("moves.csv", "game/m.csv", "--type", "pos=nmber"), 'Did you mean "number"?'),
        (("moves.csv", "game/m.csv", "--type", "Speed=int"), 'contextdb.toml declares "Speed" already'),
        (("moves.csv", "game/m.csv", "--type", "po=int"), 'Did you mean "pos"?'),
        (("moves.csv", "game/m.csv", "--as", "xslx"), 'Did you mean "xlsx"?'),
        (("moves.csv", "game/m.csv", "--as", "xlsx"), "this is not a workbook"),
        (("moves.csv", "game/m.csv", "--encoding", "utf-9"), 'there is no encoding "utf-9"'),
        (("game", "game/m.csv"), "this is a folder."),
    ],
)
def test_bad_use_is_told_with_a_mend_and_writes_nothing(arguments: tuple[str, ...], said: str, here: Path):
    assert said in refused(*arguments)
    assert [p.name for p in (here / "game").iterdir()] == ["contextdb.toml"]


def test_a_contextdb_toml_that_cannot_be_read_stops_the_import():
    Path("game/contextdb.toml").write_text("[conditions.speed]\ntype = 5\n", encoding="utf-8")
    assert "game/contextdb.toml, line 2" in refused("moves.csv", "game/moves.csv")


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


def test_names_are_read_word_by_word_when_asked():
    result = run("import", "moves.csv", "game/moves.csv", "--names", "words")
    assert '  pos     new condition, enum  2 names in 2 cells: "CB", "FS"' in result.lines
    assert "each text is one name" not in result.err
    assert Project.load("game")["moves"].compile().query({"speed": 5.0, "sped": 2, "pos": "FS"}).assets == ["run"]


def test_a_table_of_another_project_keeps_its_cells(here: Path):
    (here / "other").mkdir()
    run("import", "moves.csv", "game/moves.csv", "--names", "words")
    result = run("import", "game/moves.csv", "other/moves.csv")
    assert result.code == 0, result.err
    assert Path("other/moves.csv").read_bytes() == Path("game/moves.csv").read_bytes()
    assert Project.load("other")["moves"].condition("pos").condition.domain.values == ("CB", "FS")


def test_a_foreign_file_that_only_lies_in_a_folder_of_tables_has_whole_names(here: Path):
    (here / "game" / "foreign.csv").write_text("Name,state\njog,Mid Air\n", encoding="utf-8")
    assert "each text is one name" in run("import", "game/foreign.csv", "game/t.csv").err
    (here / "broken").mkdir()
    (here / "broken" / "contextdb.toml").write_text("[", encoding="utf-8")
    (here / "broken" / "f.csv").write_text("Name,state\njog,Mid Air\n", encoding="utf-8")
    assert "each text is one name" in run("import", "broken/f.csv", "game/u.csv").err
