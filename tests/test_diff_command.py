"""`contextdb diff`: what changed between two tables, in words, as Markdown and as JSON, with an exit code for scripts."""

from pathlib import Path

import pytest
from running import run

from contextdb import cli
from contextdb.tables.project import load

BEFORE = 'Asset,speed,hit\nwalk,0..5,True\nrun,5..9,Any\njump,Any,False\ndive,"20, 9.99",True\n'
AFTER = 'Asset,hit,speed,new\nrun,True,5..8,x\nwalk,True,0..5,\nhop,False,Any,\ndive,True,"20.00, 9.990",\nland,,,\n'


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setitem(cli.COMMANDS, "diff", "what changed between two versions of a table")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.csv").write_text(BEFORE, encoding="utf-8")
    (tmp_path / "b.csv").write_text(AFTER, encoding="utf-8")
    return tmp_path


def test_line_ends_and_quotes_are_no_difference(here):
    (here / "c.csv").write_bytes(BEFORE.replace("\n", "\r\n").replace("run,", '"run",').encode())
    assert run("diff", "a.csv", "c.csv").code == 0


def test_many_differences_are_cut_unless_all_are_asked_for(here):
    rows = [f"a{i},{i}" for i in range(100)]
    (here / "x.csv").write_text("\n".join(["A,x", *rows]), encoding="utf-8")
    (here / "y.csv").write_text("\n".join(["A,x", *(f"{row}5" for row in rows)]), encoding="utf-8")
    result = run("diff", "x.csv", "y.csv", "--no-effects")
    assert result.lines[-1] == "  … and 60 more; --all shows every one"
    assert len(run("diff", "x.csv", "y.csv", "--all", "--no-effects").lines) == 203


def test_markdown_of_many_differences_fits_into_a_comment(here):
    rows = [f"anim_{i},{i}" for i in range(3000)]
    (here / "x.csv").write_text("\n".join(["A,x", *rows]), encoding="utf-8")
    (here / "y.csv").write_text(
        "\n".join(["A,x", *(f"{row}5" for row in rows), *(f"n{i},1" for i in range(3000))]), encoding="utf-8"
    )
    short, long = (run("diff", "x.csv", "y.csv", "--format", "markdown", *more) for more in ((), ("--all",)))
    assert len(short.out.encode()) < 65_000
    assert "more; `contextdb diff --all` shows every one." in short.out
    assert len(long.lines) > 6000


def test_escape_codes_in_cells_do_not_reach_the_terminal(here):
    (here / "c.csv").write_text(BEFORE.replace("5..9", "\x1b[31m"), encoding="utf-8")
    assert "\x1b" not in run("diff", "a.csv", "c.csv").out


def test_a_renamed_file_type_is_compared_by_its_texts(here):
    load("a.csv").save("a.parquet")
    assert run("diff", "a.csv", "a.parquet").code == 0


def test_a_page_of_a_change_says_first_what_to_look_at_and_holds_every_cell(tmp_path: Path):
    for name, cell in (("old", "0..5"), ("new", "0..2")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "contextdb.toml").write_text('[conditions.speed]\ntype = "number"\nmin = 0\nmax = 5\n')
        (tmp_path / name / "jog.csv").write_text(f"Asset,speed\n<b>jog</b>,{cell}\n")
    page = tmp_path / "diff.html"
    files = [str(tmp_path / name / "jog.csv") for name in ("old", "new")]
    assert run("diff", *files, "--format", "html", "-o", str(page)).code == 1
    text = page.read_text(encoding="utf-8")
    assert "Look first at 1 gap that it opens" in text
    assert "<td>0..5</td>" in text
    assert "<b>jog" not in text
