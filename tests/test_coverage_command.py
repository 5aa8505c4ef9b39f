"""`contextdb coverage`: its JSON contract, its exit codes for every bar, its baseline, and what it says of bad use."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from running import ROOT, Result, run

from contextdb import cli
from contextdb.files.reports import sealed, with_marks
from contextdb.report.coverage_heat import NOTHING_COVERED
from contextdb.report.render_json import as_json

TOML = """
[conditions.speed]
type = "number"
min = 0
max = 10

[conditions.gait]
type = "enum"
values = ["Walk", "Run"]
"""
JOG = "Asset,speed,gait\nwalk,0..4,Walk\nrun,4..10,Run\n"
"""Covers 0.2 + 0.3 of the contexts."""


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setitem(cli.COMMANDS, "coverage", "which contexts have no asset")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tables").mkdir()
    write(JOG)
    (tmp_path / "tables/contextdb.toml").write_text(TOML, encoding="utf-8")
    return tmp_path


def write(rows: str, name: str = "jog") -> None:
    Path(f"tables/{name}.csv").write_text(rows, encoding="utf-8")


def baseline(file: str = "before.json") -> None:
    assert run("coverage", "tables", "--format", "json", "-o", file).code == 0


def folded(text: str) -> str:
    return " ".join(text.split())


def test_the_same_tables_give_the_same_bytes():
    first = run("coverage", "tables", "--json", "--work", "0", "--samples", "1000")
    assert first.out == run("coverage", "tables", "--json", "--work", "0", "--samples", "1000").out


def test_an_estimate_is_held_to_the_bar_by_its_lower_bound():
    rows = "".join(f"a{i},{i / 50}..{i / 50 + 0.1:.3f},{'Walk' if i % 2 else 'Run'}\n" for i in range(300))
    write("Asset,speed,gait\n" + rows)
    plain = run("coverage", "tables", "--json").json["tables"][0]["covered"]
    guess = run("coverage", "tables", "--json", "--work", "0", "--samples", "50").json["tables"][0]["covered"]
    assert plain["method"] == "exact"
    assert guess["lower"] <= plain["value"] <= guess["upper"]
    bar = str(100 * (guess["lower"] + guess["upper"]) / 2)
    options = ("coverage", "tables", "--fail-under", bar)
    assert run(*options, "--work", "0", "--samples", "50").code == (1 if guess["lower"] < guess["upper"] else 0)


SPACES = {
    "max": (("max = 10", "max = 5"), JOG, '"speed": max 10, now 5'),
    "value": (('"Walk", "Run"', '"Walk"'), "Asset,speed,gait\nwalk,0..4,Walk\n", '"gait": the values are without Run'),
    "type": (('type = "number"', 'type = "int"'), JOG, '"speed": type number, now int'),
    "column": (("", ""), "Asset,speed\nwalk,0..4\nrun,4..10\n", '"gait" is no condition any more (it was enum Walk, Run)'),
    "column and declaration": (
        ('[conditions.gait]\ntype = "enum"\nvalues = ["Walk", "Run"]\n', ""),
        "Asset,speed\nwalk,0..4\nrun,4..10\n",
        '"gait" is no condition any more (it was enum Walk, Run)',
    ),
    "new column": (("", ""), "Asset,speed,gait,wet\nwalk,0..4,Walk,Any\nrun,4..10,Run,True\n", '"wet" is a new condition (bool)'),
    "output": (
        ("[conditions.gait]", '[tables.jog]\noutputs = ["gait"]\n[conditions.gone]'),
        JOG,
        '"gait" is no condition any more (it was enum Walk, Run)',
    ),
    "assume": (
        ("[conditions.gait]", '[tables.jog]\nassume = ["speed <= 4"]\n[conditions.gait]'),
        JOG,
        'assume now has "speed <= 4"',
    ),
    "policy": (
        ("[conditions.gait]", '[tables.jog]\npolicy = "first"\n[conditions.gait]'),
        JOG,
        "the policy was collect, now first",
    ),
    "no bounds": (("max = 10", ""), JOG, '"speed": max 10, now none'),
    "no toml": ((None, ""), JOG, '"speed": min 0, now none'),
}


@pytest.mark.parametrize("name", SPACES)
def test_shares_of_two_different_spaces_are_not_compared_unless_that_is_accepted(name: str):
    (old, new), rows, words = SPACES[name]
    baseline()
    Path("tables/contextdb.toml").write_text(TOML.replace(old, new) if old is not None else "", encoding="utf-8")
    write(rows)
    result = run("coverage", "tables", "--baseline", "before.json", "--max-drop", "100")
    assert result.code == 1
    assert words in folded(result.out)
    assert "closed" not in result.out
    assert "Where that is intended: --redefined=jog." in folded(result.out)
    assert run("coverage", "tables", "--baseline", "before.json", "--redefined", "jog").code == 0


def test_an_assumption_taken_away_and_a_rewritten_derived_fact_are_named():
    derived = '[conditions.brisk]\ntype = "bool"\nexpr = "speed > 3"\n[tables.jog]\nassume = ["not brisk or gait == \'Run\'"]\n'
    Path("tables/contextdb.toml").write_text(TOML + derived, encoding="utf-8")
    baseline()
    Path("tables/contextdb.toml").write_text(TOML + derived.replace("> 3", "> 9"), encoding="utf-8")
    result = run("coverage", "tables", "--baseline", "before.json")
    assert (result.code, '"brisk": computed as speed > 3, now speed > 9' in folded(result.out)) == (1, True)
    Path("tables/contextdb.toml").write_text(TOML + derived.partition("[tables")[0], encoding="utf-8")
    result = run("coverage", "tables", "--baseline", "before.json")
    assert (result.code, "assume no longer has " in folded(result.out)) == (1, True)


def test_the_bounds_that_cells_give_to_a_number_without_any_are_part_of_the_space():
    Path("tables/contextdb.toml").write_text(TOML.replace("min = 0\nmax = 10\n", ""), encoding="utf-8")
    baseline()
    write("Asset,speed,gait\nwalk,0..4,Walk\n")
    result = run("coverage", "tables", "--baseline", "before.json")
    assert (result.code, '"speed" is not fully declared, and counts otherwise' in folded(result.out)) == (1, True)


def test_the_order_of_values_and_of_rows_is_no_other_space():
    baseline()
    Path("tables/contextdb.toml").write_text(TOML.replace('"Walk", "Run"', '"Run", "Walk"'), encoding="utf-8")
    write("Asset,gait,speed\nrun,Run,4..10\nwalk,Walk,0..4\n")
    assert run("coverage", "tables", "--baseline", "before.json").code == 0


@pytest.mark.parametrize("is_accepted", [False, True])
@pytest.mark.parametrize("format_name", ["text", "json", "github", "junit", "sarif", "markdown", "html"])
def test_every_format_names_the_change_of_the_space_and_the_new_table(format_name: str, is_accepted: bool):
    baseline()
    Path("tables/contextdb.toml").write_text(TOML.replace("max = 10", "max = 5"), encoding="utf-8")
    write(JOG, "dash")
    options = ("--redefined", "jog", "--new", "dash") if is_accepted else ()
    result = run("coverage", "tables", "--baseline", "before.json", "--format", format_name, *options)
    assert result.code == (0 if is_accepted else 1)
    plain = folded(re.sub(r"\\|&quot;|&#34;", '"', result.out)).replace('""', '"')
    assert 'speed": max 10, now 5' in plain
    assert 'dash" is not in the baseline' in plain


CASES = "Case,speed,gait,Expected\none,1,Walk,walk\ntwo,9,Run,+run\nthree,9,Walk,(none)\nlook,2,Walk,\n"


@pytest.mark.parametrize(
    ("cases", "words"),
    [
        (None, "0 saved contexts, before 3"),
        (CASES.replace("two,9,Run,+run\n", ""), "2 saved contexts, before 3"),
        (CASES.replace("+run", ""), "2 saved contexts, before 3"),
        (CASES.replace("+run", "-nobody"), "2 saved contexts, before 3"),
        (CASES.replace("two,9,Run,+run", "two,1,Walk,walk"), "2 saved contexts, before 3"),
        (CASES.replace("Walk,walk", "Walk,+walk"), "1 that expect exactly their assets, before 2"),
        (CASES.replace("two,9,Run,+run", "two,9.5,Walk,-walk"), "1 rows reached, before 2"),
    ],
)
def test_saved_contexts_that_expect_less_fail_unless_that_is_accepted(cases: str | None, words: str):
    Path("tables/jog.cases.csv").write_text(CASES, encoding="utf-8")
    baseline()
    assert run("coverage", "tables", "--baseline", "before.json").code == 0
    if cases is None:
        Path("tables/jog.cases.csv").unlink()
    else:
        Path("tables/jog.cases.csv").write_text(cases, encoding="utf-8")
    result = run("coverage", "tables", "--baseline", "before.json")
    assert result.code == 1
    assert words in folded(result.out)
    assert run("coverage", "tables", "--baseline", "before.json", "--fewer-cases", "jog").code == 0


def test_a_row_that_is_deleted_need_not_be_reached_any_more():
    write(JOG + "run2,4..10,Run\n")
    Path("tables/jog.cases.csv").write_text(CASES, encoding="utf-8")
    baseline()
    write(JOG)
    assert run("coverage", "tables", "--baseline", "before.json").code == 0


def test_the_saved_contexts_of_a_table_inside_another_count_too():
    write("Asset,gait\n@jog,Any\n", "wrap")
    Path("tables/jog.cases.csv").write_text(CASES, encoding="utf-8")
    baseline()
    Path("tables/jog.cases.csv").unlink()
    result = run("coverage", "tables", "--baseline", "before.json", "--json")
    assert (result.code, [gate["name"] for gate in result.json["gates"]]) == (1, ["fewer-cases"])


@pytest.mark.parametrize("format_name", ["json", "github", "junit", "sarif", "markdown", "html"])
def test_every_format_tells_a_table_that_is_gone(format_name: str):
    write(JOG, "run")
    baseline()
    Path("tables/run.csv").unlink()
    result = run("coverage", "tables", "--baseline", "before.json", "--format", format_name)
    assert result.code == 1
    assert "run" in result.out
    assert "of the baseline no longer exists" in result.out


def altered_baseline(change: Callable[[dict[str, Any]], object], is_sealed: bool = True) -> None:
    """Write the baseline with a change, and with the digest that belongs to it, as nobody should."""
    document = json.loads(Path("before.json").read_text(encoding="utf-8"))
    change(document)
    text = sealed(as_json(with_marks(document))) if is_sealed else json.dumps(document)
    Path("before.json").write_text(text, encoding="utf-8")


def test_an_altered_baseline_is_refused_and_one_without_a_digest_too():
    baseline()
    altered_baseline(lambda document: document["tables"][0]["covered"].update(lower=0.1), is_sealed=False)
    result = run("coverage", "tables", "--baseline", "before.json")
    assert (result.code, "its contents do not match its digest" in result.err) == (2, True)
    altered_baseline(lambda document: document.pop("digest"), is_sealed=False)
    result = run("coverage", "tables", "--baseline", "before.json")
    assert (result.code, "it has no digest" in result.err) == (2, True)
    altered_baseline(lambda document: document.pop("writer"), is_sealed=False)
    result = run("coverage", "tables", "--baseline", "before.json")
    assert (result.code, "neither the writer nor the digest" in result.err) == (2, True)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda document: document.update(tables=[]), "it has no tables, so nothing would be compared"),
        (lambda document: document["tables"][0].pop("space"), "'space' is missing. Accepted:"),
        (lambda document: document["tables"][0].update(space={}), '"space" of a table is not what was written'),
        (lambda document: document.pop("cases"), "'cases' is missing. Accepted:"),
    ],
)
def test_a_baseline_that_cannot_hold_the_gate_is_refused_with_the_mend(change: Callable[[dict[str, Any]], object], said: str):
    baseline()
    altered_baseline(change)
    result = run("coverage", "tables", "--baseline", "before.json")
    assert (result.code, said in result.err, "Try to write it again." in result.err) == (2, True, True)


def test_a_report_opens_with_what_to_do_first_a_gap_that_players_meet_before_one_that_is_large(tmp_path: Path):
    (tmp_path / "contextdb.toml").write_text('[conditions.speed]\ntype = "number"\nmin = 0\nmax = 10\n')
    (tmp_path / "jog.csv").write_text("Asset,speed\njog,1..4\n")
    (tmp_path / "play.csv").write_text("speed\n0.5\n2\n3\n")
    table = str(tmp_path / "jog.csv")
    first = run("coverage", table).lines[1]
    assert first.startswith("To do first: decide whether speed: [0..1) | (4..10] can happen.")
    second = " ".join(run("coverage", table, "--telemetry", str(tmp_path / "play.csv")).lines[1:3])  # of 80 columns
    assert second.startswith("To do first: a row for speed: [0..1) | (4..10]; 33.33 % of the recorded moments have none.")
    (tmp_path / "jog.csv").write_text("Asset,speed\njog,Any\n")
    assert run("coverage", table).lines[1] == "Nothing to do: every context has a valid row."


@pytest.mark.parametrize("table", ["locomotion", "hit_mid_air", "contested_catch"])
@pytest.mark.parametrize("format_name", ["text", "markdown"])
def test_the_report_of_a_sample_table_is_the_golden_one(table: str, format_name: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(ROOT)
    monkeypatch.setenv("COLUMNS", "100")
    result: Result = run("coverage", f"tables/{table}.csv", "--format", format_name, "--fail-under", "10")
    golden = ROOT / "tests" / "golden" / f"coverage_{table}.{'txt' if format_name == 'text' else 'md'}"
    assert result.out == golden.read_text(encoding="utf-8")
    assert max(map(len, result.lines)) <= 100 or format_name == "markdown"


def test_the_json_of_the_sample_tables_is_what_the_page_holds(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(ROOT)
    document = json.loads(run("coverage", "tables", "--json").out)
    assert [t["table"] for t in document["tables"]] == ["hit_mid_air", "contested_catch", "locomotion"]
    page = run("coverage", "tables", "--format", "html").out
    assert all(f">{t['table']}</h2>" in page for t in document["tables"])
    squares = re.findall(r'aria-label="([^"]+)">([^<]+)</button>', page)
    assert squares
    assert all(said.startswith(seen) for said, seen in squares), "a square is named otherwise than it shows"


def test_a_page_cuts_no_name_of_its_maps_and_shows_no_map_that_is_0_everywhere(here: Path):
    write("Asset,air,landed\nfall,True,True\n")
    page = run("coverage", "tables", "--format", "html").out
    assert NOTHING_COVERED in page
    assert 'class="heat"' not in page
    write("Asset,air,landed\nfall,True,True\nwalk,False,False\n")
    page = run("coverage", "tables", "--format", "html").out
    assert 'class="heat"' in page
    assert "ellipsis" not in page


def test_the_report_is_the_same_to_the_byte_on_one_core_and_on_four(here: Path):
    rows = [f"clip{i},{i % 7}..{i % 7 + 2},{'Walk' if i % 3 else 'Any'}" for i in range(60)]
    write("\n".join(["Asset,speed,gait", *rows, ""]))
    moments = [f"{i / 40},{'Run' if i % 2 else 'Walk'}" for i in range(400)]
    Path("moments.csv").write_text("\n".join(["speed,gait", *moments, ""]), encoding="utf-8")
    command = [sys.executable, "-m", "contextdb", "coverage", "tables", "--telemetry", "moments.csv", "--format", "json"]
    reports = []
    for cores in ("1", "4"):
        threads = {"POLARS_MAX_THREADS": cores, "PYTHONPATH": str(ROOT)}
        reports.append(subprocess.run(command, env=os.environ | threads, stdout=subprocess.PIPE, check=True).stdout)
    assert json.loads(reports[0])["tables"][0]["telemetry"]["rows"] == 400
    assert reports[0] == reports[1]


@pytest.fixture
def ruled(tmp_path: Path) -> Path:
    """A table of two conditions and rules, one of which no box of cells can tell."""
    conditions = '[conditions.speed]\ntype = "number"\nmin = 0\nmax = 10\n[conditions.air]\ntype = "bool"\n'
    more = '[conditions.gait]\ntype = "enum"\nvalues = ["Walk", "Run"]\n[tables.jog]\nwhen = "When"\n'
    (tmp_path / "contextdb.toml").write_text(conditions + more)
    rows = 'Asset,speed,air,When\nfar,6..,Any,"air or gait == ""Run"""\n' + "fast,3..5,False,not air or speed < 2\nslow,..1,True,\n"
    (tmp_path / "jog.csv").write_text(rows)
    return tmp_path / "jog.csv"


def test_where_gaps_name_rules_the_list_says_that_it_is_by_volume(ruled: Path):
    recorded = ruled.with_name("recorded.csv")
    recorded.write_text("speed,air,gait\n2,False,Walk\n2,False,Walk\n9,False,Walk\n2,True,Walk\n")
    found = run("coverage", ruled, "--telemetry", str(recorded))
    gaps = run("coverage", ruled, "--telemetry", str(recorded), "--json").json["tables"][0]["gaps"]["items"]
    moments = [gap["telemetry"] or 0.0 for gap in gaps]
    assert moments != sorted(moments, reverse=True)
    assert "; the largest first\n" in found.out
