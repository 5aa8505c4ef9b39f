"""`contextdb diff`: what changed between two tables, in words, as Markdown and as JSON, with an exit code for scripts."""

from __future__ import annotations

from pathlib import Path

import pytest
from running import Result, run

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


def test_a_difference_is_told_by_columns_rows_and_cells():
    result = run("diff", "a.csv", "b.csv", "--no-effects")
    assert (result.code, result.err) == (1, "")
    assert result.lines == [
        "b.csv: 1 row added, 1 row renamed, 1 row moved, 1 column added, 1 column moved, 2 cells changed, "
        "1 cell written differently",
        "",
        "columns",
        "  + new",
        "  > hit, from column 3 to 2",
        "",
        "rows",
        "  + land, line 6",
        "  ~ jump → hop",
        "  > run, from line 3 to line 2",
        "",
        "cells",
        "  run",
        "    hit    Any   →  True",
        "    speed  5..9  →  5..8",
        "",
        "written differently",
        "  dive",
        "    speed  20, 9.99  →  20.00, 9.990",
    ]


def test_the_same_table_differs_in_nothing():
    result = run("diff", "a.csv", "a.csv")
    assert (result.code, result.out) == (0, "a.csv: no difference\n")


def test_line_ends_and_quotes_are_no_difference(here):
    (here / "c.csv").write_bytes(BEFORE.replace("\n", "\r\n").replace("run,", '"run",').encode())
    assert run("diff", "a.csv", "c.csv").code == 0


def test_json_is_one_document_with_its_format():
    result = run("diff", "a.csv", "b.csv", "--json")
    assert (result.code, result.json["format"], result.json["same"]) == (1, 1, False)
    assert result.json["rows"]["renamed"] == [{"row": 2, "before": "jump", "after": "hop"}]
    assert result.json["columns"]["added"] == ["new"]
    assert [c["meaning"] for c in result.json["cells"]] == [True, True, False]
    assert run("diff", "a.csv", "a.csv", "--format", "json").json["same"] is True


def test_markdown_shows_texts_as_they_are(here):
    (here / "c.csv").write_text(BEFORE.replace("5..9", "`5`|<b>"), encoding="utf-8")
    result = run("diff", "a.csv", "c.csv", "--format", "markdown")
    assert result.code == 1
    assert result.lines[0] == "### c.csv"
    assert "| run | speed | 5..9 | \\`5\\`\\|\\<b\\> |" in result.lines


def test_markdown_tells_rows_and_columns_in_words():
    lines = run("diff", "a.csv", "b.csv", "--format", "markdown").lines
    assert lines[4:9] == [
        "- column added: new",
        "- column moved: hit, from column 3 to 2",
        "- row added: land, line 6",
        "- row renamed: jump → hop",
        "- row moved: run, from line 3 to line 2",
    ]
    assert "| dive | speed | 20, 9.99 | 20.00, 9.990 (means the same) |" in lines


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


def refused(*arguments: str) -> Result:
    result = run("diff", *arguments)
    assert (result.code, result.out) == (2, "")
    return result


def test_what_cannot_be_read_exits_with_2(here):
    assert "no such table" in refused("a.csv", "missing.csv").err
    (here / "c.csv").write_text("<<<<<<< ours\nA\n", encoding="utf-8")
    assert "unresolved git conflict" in refused("a.csv", "c.csv").err
    assert "required" in refused("a.csv").err


# ---- what a change does


def test_what_a_change_does_stands_below_it(here):
    (here / "c.csv").write_text(BEFORE.replace("jump,Any,False\n", ""), encoding="utf-8")
    lines = run("diff", "a.csv", "c.csv").lines
    told = lines[lines.index("what it does") :]
    assert told[2] == "  jump loses 50.00 %"
    assert told[3] == "    50.00 %  hit: False"
    assert "  gaps opened" in told
    assert "what it does" not in run("diff", "a.csv", "c.csv", "--no-effects").out


def test_what_a_change_does_stands_in_the_json_and_the_markdown(here):
    (here / "c.csv").write_text(BEFORE.replace("jump,Any,False\n", ""), encoding="utf-8")
    found = run("diff", "a.csv", "c.csv", "--json").json["effects"]
    assert [(one["asset"], one["after"]) for one in found["assets"]] == [("jump", 0.0)]
    assert found["gaps"]["complete"] is True
    assert "- jump loses 50.00 %" in run("diff", "a.csv", "c.csv", "--format", "markdown").lines


def test_a_change_of_writing_only_does_nothing(here):
    (here / "c.csv").write_text(BEFORE.replace("9.99", "9.990"), encoding="utf-8")
    result = run("diff", "a.csv", "c.csv", "--json")
    assert (result.code, result.json["effects"]) == (1, None)


def test_what_cannot_be_told_is_said_with_its_place(here):
    (here / "contextdb.toml").write_text('[conditions.speed]\ntype = "number"\n', encoding="utf-8")
    (here / "c.csv").write_text(BEFORE.replace("5..9", "fast"), encoding="utf-8")
    result = run("diff", "a.csv", "c.csv")
    assert result.code == 1
    assert "That cannot be determined: c.csv, line 3" in result.out
