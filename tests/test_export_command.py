"""`contextdb export`: the suffix says the format, a file that is there stays, standard output gets the bytes alone."""

from __future__ import annotations

import io
import json
from pathlib import Path

import openpyxl
import pytest
from running import run

from contextdb import cli

CSV = b'Asset Name,speed\r\njog,"20, 9.99"\r\nrun,5..3\r\n'


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with the table game/jog.csv."""
    (tmp_path / "game").mkdir()
    (tmp_path / "game" / "contextdb.toml").write_text('[conditions.speed]\ntype = "number"\n', encoding="utf-8")
    (tmp_path / "game" / "jog.csv").write_bytes(CSV)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(cli.COMMANDS, "export", "")
    return tmp_path


def test_the_suffix_says_the_format_and_the_path_is_printed():
    result = run("export", "game/jog.csv", "out.json")
    assert (result.code, result.lines) == (0, ["out.json"])
    assert result.err.startswith("jog: 2 rows as JSON, a list of objects, ")
    assert json.loads(Path("out.json").read_bytes())[0] == {"Asset Name": "jog", "speed": "20, 9.99"}


def test_rows_that_the_format_leaves_out_are_not_counted_as_written():
    rows = "".join(f"never {i},5..3\r\n" for i in range(30))
    Path("game/jog.csv").write_bytes(CSV + rows.encode())
    result = run("export", "game/jog.csv", "out.dmn")
    assert result.err.splitlines()[-1].startswith("jog: 1 of 32 rows as a DMN decision table, ")
    assert Path("out.dmn").read_text(encoding="utf-8").count("<rule>") == 1


def test_every_format_is_written():
    for suffix in ("csv", "tsv", "xlsx", "parquet", "json", "jsonl"):
        assert run("export", "game/jog.csv", f"out.{suffix}").code == 0
    assert Path("out.csv").read_bytes() == CSV
    assert openpyxl.load_workbook(io.BytesIO(Path("out.xlsx").read_bytes())).sheetnames == ["jog", "contextdb"]


def test_standard_output_gets_the_bytes_and_nothing_else():
    result = run("export", "game/jog.csv", "-", "--as", "tsv")
    assert (result.code, result.out, result.err) == (0, "Asset Name\tspeed\njog\t20, 9.99\nrun\t5..3\n", "")


def test_a_file_that_is_there_is_not_written_over_unless_forced():
    Path("out.csv").write_text("mine", encoding="utf-8")
    result = run("export", "game/jog.csv", "out.csv")
    assert (result.code, Path("out.csv").read_text(encoding="utf-8")) == (2, "mine")
    assert "the file already exists" in result.err
    assert run("export", "game/jog.csv", "out.csv", "--force").code == 0
    assert Path("out.csv").read_bytes() == CSV


def test_what_is_lost_is_told():
    result = run("export", "game/jog.csv", "-", "--as", "unreal-csv")
    assert result.out == '---,speed\r\n"jog","20, 9.99"\r\n"run","5..3"\r\n'
    Path("game/jog.csv").write_text("Asset Name,speed,Role.x\njog,1,A\n", encoding="utf-8")
    assert 'jog: column "Role.x": is called "Role__x" in Unreal.' in run("export", "game/jog.csv", "-", "--as", "unreal-csv").err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("game/jog.csv", "out.xslx"), 'Did you mean ".xlsx"?'),
        (("game/jog.csv", "out"), "the name has no suffix"),
        (("game/jog.csv", "-"), "standard output has no suffix"),
        (("game/jgo.csv", "out.csv"), 'Did you mean "game/jog.csv"?'),
        (("game/jog.csv", "no/out.csv"), '/no". Accepted: an existing folder.'),
        (("game/jog.csv", "out.ods"), "is of no known format"),
        (("game/jog.csv", "out.csv", "--as", "exel"), "there is no"),
    ],
)
def test_bad_use_is_told_with_a_mend(arguments: tuple[str, ...], said: str):
    result = run("export", *arguments)
    assert (result.code, result.out) == (2, "")
    assert said in result.err.replace("'", '"')


FORMULAS = "Asset Name,note,speed,tags\n=cmd|' /C calc'!A0,@SUM(1),-5,+InAir\n+1,-2..3,+7,-\n'=a,\"\trun\",5,Any\n"


def test_cells_that_a_spreadsheet_may_run_are_named_and_kept():
    Path("game/f.csv").write_text(FORMULAS, encoding="utf-8")
    for suffix in ("csv", "tsv"):
        result = run("export", "game/f.csv", f"f.{suffix}")
        said = (
            'f: 5 cells may run as a formula in a spreadsheet, first "=cmd|\' /C calc\'!A0" in "Asset Name"; --formulas quote puts'
        )
        assert said in result.err
    assert Path("f.csv").read_text(encoding="utf-8") == FORMULAS
    assert "formula" not in run("export", "game/f.csv", "k.csv", "--formulas", "keep").err
    assert "formula" not in run("export", "game/f.csv", "f.json").err
    assert "formula" not in run("export", "game/jog.csv", "jog.tsv").err


def test_formulas_get_an_apostrophe_when_asked_and_every_other_byte_stays():
    Path("game/f.csv").write_text(FORMULAS, encoding="utf-8")
    assert run("export", "game/f.csv", "f.csv", "--formulas", "quote").code == 0
    lines = Path("f.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "Asset Name,note,speed,tags"
    assert lines[1] == "'=cmd|' /C calc'!A0,'@SUM(1),-5,'+InAir"
    assert lines[2] == "+1,'-2..3,+7,-"
    assert lines[3] == "'=a,\"'\trun\",5,Any"
    assert run("export", "game/f.csv", "-", "--as", "tsv", "--formulas", "quote").out.splitlines()[2] == "+1\t'-2..3\t+7\t-"
