"""`contextdb export`: the suffix says the format, a file that is there stays, standard output gets the bytes alone."""

import io
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


def test_every_format_is_written():
    for suffix in ("csv", "tsv", "xlsx", "parquet", "json", "jsonl"):
        assert run("export", "game/jog.csv", f"out.{suffix}").code == 0
    assert Path("out.csv").read_bytes() == CSV
    assert openpyxl.load_workbook(io.BytesIO(Path("out.xlsx").read_bytes())).sheetnames == ["jog", "contextdb"]


FORMULAS = "Asset Name,note,speed,tags\n=cmd|' /C calc'!A0,@SUM(1),-5,+InAir\n+1,-2..3,+7,-\n'=a,\"\trun\",5,Any\n"


def test_formulas_get_an_apostrophe_when_asked_and_every_other_byte_stays():
    Path("game/f.csv").write_text(FORMULAS, encoding="utf-8")
    assert run("export", "game/f.csv", "f.csv", "--formulas", "quote").code == 0
    lines = Path("f.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "Asset Name,note,speed,tags"
    assert lines[1] == "'=cmd|' /C calc'!A0,'@SUM(1),-5,'+InAir"
    assert lines[2] == "+1,'-2..3,+7,-"
    assert lines[3] == "'=a,\"'\trun\",5,Any"
    assert run("export", "game/f.csv", "-", "--as", "tsv", "--formulas", "quote").out.splitlines()[2] == "+1\t'-2..3\t+7\t-"
