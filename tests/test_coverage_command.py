"""`contextdb coverage`: its JSON contract, its exit codes for every bar, its baseline, and what it says of bad use."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from running import ROOT, Result, run

from contextdb import cli

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


def one_may_play() -> None:
    """Of several valid rows the first plays: those that others make needless are slips then."""
    with Path("tables/contextdb.toml").open("a", encoding="utf-8") as file:
        file.write('[tables.jog]\npolicy = "first"\n')


def baseline(file: str = "before.json") -> None:
    assert run("coverage", "tables", "--format", "json", "-o", file).code == 0


def folded(text: str) -> str:
    return " ".join(text.split())


def test_the_json_document_keeps_its_contract():
    result = run("coverage", "tables", "--format", "json")
    assert (result.code, result.err) == (0, "")
    assert result.json["format"] == 1
    (table,) = result.json["tables"]
    assert (table["table"], table["rows"], table["conditions"]) == ("jog", 2, 2)
    assert table["covered"]["method"] == "exact"
    assert table["covered"]["value"] == table["covered"]["lower"] == table["covered"]["upper"] == 0.5
    assert table["gaps"]["complete"] is True
    items = [(g["cells"], round(g["share"], 9), round(g["new_share"], 9)) for g in table["gaps"]["items"]]
    assert items == [({"speed": "(4..10]", "gait": "Walk"}, 0.3, 0.3), ({"speed": "[0..4)", "gait": "Run"}, 0.2, 0.2)]
    assert all(isinstance(g["id"], str) and g["id"] for g in table["gaps"]["items"])
    assert table["findings"] == []
    assert table["overlap"]["mean"] == 0.5
    assert [round(share, 9) for share in table["overlap"]["histogram"]] == [0.5, 0.5]
    assert (table["telemetry"], table["baseline"], table["gates"]) == (None, None, [])


def test_findings_have_the_fields_of_a_check():
    one_may_play()
    write(JOG + "jog,1..2,Walk\n")
    finding, never = run("coverage", "tables", "--json").json["tables"][0]["findings"]
    assert never["rule"] == "never-chosen"
    wanted = {"rule": "subsumed-row", "level": "warning", "row": 2, "asset": "jog", "line": 4, "column": None, "by": [0]}
    assert {key: finding[key] for key in wanted} == wanted
    assert finding["message"]


def test_rows_that_share_contexts_are_one_line_of_information_where_several_may_play():
    write(JOG + "jog,1..2,Walk\nstroll,0..1,Walk\nwalk,3..4,Walk\n")
    inner, group = run("coverage", "tables", "--json").json["tables"][0]["findings"][::-1]
    assert (group["rule"], group["level"], group["row"], group["by"]) == ("variety", "info", 0, [2, 3])
    assert (inner["rule"], inner["level"], inner["row"], inner["by"]) == ("subsumed-row", "warning", 4, [0])


def test_the_same_tables_give_the_same_bytes():
    first = run("coverage", "tables", "--json", "--work", "0", "--samples", "1000")
    assert first.out == run("coverage", "tables", "--json", "--work", "0", "--samples", "1000").out


@pytest.mark.parametrize("path", ["tables", "tables/contextdb.toml", "tables/jog.csv", "jog"])
def test_a_path_is_a_folder_a_file_or_the_name_of_a_table(path: str):
    assert [t["table"] for t in run("coverage", path, "--json").json["tables"]] == ["jog"]


@pytest.mark.parametrize(("bar", "code"), [("0", 0), ("49.99", 0), ("50", 0), ("50%", 0), ("50.0000001", 1), ("99", 1), ("100", 1)])
def test_the_exit_code_says_whether_the_bar_is_kept(bar: str, code: int):
    result = run("coverage", "tables", "--fail-under", bar)
    assert (result.code, result.err) == (code, "")


def test_a_covered_table_reaches_a_hundred_and_one_with_a_sliver_open_does_not():
    write("Asset,speed,gait\nall,Any,Any\n")
    assert run("coverage", "tables", "--fail-under", "100").code == 0
    write("Asset,speed,gait\nall,0..9.9999999999999,Any\n")
    result = run("coverage", "tables", "--fail-under", "100")
    assert result.code == 1
    assert "100 % of the contexts" not in result.out
    assert "(exact)" in result.out


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


def test_any_table_below_the_bar_fails():
    write("Asset,speed,gait\nall,Any,Any\n", "all")
    result = run("coverage", "tables", "--fail-under", "60", "--json")
    assert result.code == 1
    assert {t["table"]: [g["passed"] for g in t["gates"]] for t in result.json["tables"]} == {"jog": [False], "all": [True]}
    assert result.json["passed"] is False


def test_a_baseline_of_the_same_tables_passes():
    baseline()
    result = run("coverage", "tables", "--baseline", "before.json")
    assert result.code == 0
    assert "as before; 0 new gaps, 0 closed" in result.out


def test_a_new_gap_fails_unless_the_drop_is_allowed():
    baseline()
    write("Asset,speed,gait\nwalk,0..4,Walk\nrun,6..10,Run\n")
    result = run("coverage", "tables", "--baseline", "before.json", "--json")
    assert result.code == 1
    change = result.json["tables"][0]["baseline"]
    assert round(change["drop"], 9) == 0.1
    assert len(change["opened"]) == 2
    assert run("coverage", "tables", "--baseline", "before.json", "--max-drop", "10").code == 0
    assert run("coverage", "tables", "--baseline", "before.json", "--max-drop", "9.9").code == 1


def test_a_closed_gap_passes_and_is_told():
    baseline()
    write(JOG + "stroll,(4..10],Walk\n")
    result = run("coverage", "tables", "--baseline", "before.json")
    assert result.code == 0
    assert "0 new gaps, 1 closed" in result.out
    assert "- 30.00 %  speed: (4..10], gait: Walk" in result.out


def test_a_new_table_fails_nothing():
    baseline()
    write("Asset,speed,gait\n", "new")
    assert run("coverage", "tables", "--baseline", "before.json").code == 0


@pytest.mark.parametrize("name", ["run", "-run", "a b"])
def test_a_table_of_the_baseline_that_is_gone_fails_unless_it_is_named(name: str):
    write(JOG, name)
    baseline()
    Path(f"tables/{name}.csv").rename("tables/dash.csv")
    result = run("coverage", "tables", "--baseline", "before.json", "--max-drop", "100")
    assert result.code == 1
    assert f'FAILED gone the table "{name}" of the baseline no longer exists. New since the baseline: "dash".' in folded(result.out)
    assert "1 of 2 thresholds missed." in result.out
    assert run("coverage", "tables", "--baseline", "before.json", f"--gone={name}").code == 0


def test_a_table_that_lost_all_its_rows_fails_unless_it_is_named():
    baseline()
    write("Asset,speed,gait\n")
    result = run("coverage", "tables", "--baseline", "before.json", "--max-drop", "100")
    assert (result.code, "the table had 2 rows in the baseline and has none now." in folded(result.out)) == (1, True)
    assert run("coverage", "tables", "--baseline", "before.json", "--gone", "jog").code == 0


@pytest.mark.parametrize("format_name", ["json", "github", "junit", "sarif", "markdown", "html"])
def test_every_format_tells_a_table_that_is_gone(format_name: str):
    write(JOG, "run")
    baseline()
    Path("tables/run.csv").unlink()
    result = run("coverage", "tables", "--baseline", "before.json", "--format", format_name)
    assert result.code == 1
    assert "run" in result.out
    assert "of the baseline no longer exists" in result.out


def test_gone_tables_want_a_baseline():
    result = run("coverage", "tables", "--gone", "run")
    assert (result.code, "--gone names tables of a baseline" in result.err) == (2, True)


def test_an_altered_baseline_is_refused_and_one_that_was_only_written_anew_is_not():
    baseline()
    text = Path("before.json").read_text(encoding="utf-8")
    document = json.loads(text)
    Path("before.json").write_text(json.dumps(document, indent=1, sort_keys=True).replace(": 1.0", ": 1"), encoding="utf-8")
    assert run("coverage", "tables", "--baseline", "before.json").code == 0
    document["tables"][0]["covered"]["lower"] = 0.1
    Path("before.json").write_text(json.dumps(document), encoding="utf-8")
    result = run("coverage", "tables", "--baseline", "before.json")
    assert (result.code, "its contents do not match its digest" in result.err) == (2, True)
    del document["digest"]
    Path("before.json").write_text(json.dumps(document), encoding="utf-8")
    assert run("coverage", "tables", "--baseline", "before.json").code == 0


def test_an_output_file_is_written_and_nothing_is_printed():
    result = run("coverage", "tables", "-o", "report.txt", "--fail-under", "90")
    assert (result.code, result.out) == (1, "")
    assert "50.00 % of the contexts have a valid row" in Path("report.txt").read_text(encoding="utf-8")


def test_a_gap_is_told_by_number_and_by_id():
    by_number = run("coverage", "jog", "--gap", "2")
    assert by_number.code == 0
    assert by_number.lines[0].startswith("Gap 2 of 2 in jog (")
    gap_id = by_number.lines[0].partition("(")[2].partition(")")[0]
    assert run("coverage", "jog", "--gap", gap_id).out == by_number.out
    assert "contextdb query tables/jog.csv speed=2 gait=Run --unknown any --explain" in by_number.out


@pytest.mark.parametrize(("policy", "level"), [("first", "warning"), ("collect", "info")])
def test_a_row_is_explained_by_number_and_by_asset(policy: str, level: str):
    if policy == "first":
        one_may_play()
    write(JOG + "jog,1..2,Walk\n")
    result = run("coverage", "jog", "--explain", "jog")
    assert result.code == 0
    assert result.out == run("coverage", "jog", "--explain", "3").out
    assert result.lines[:5] == [
        "line 4 jog of jog (row 3)",
        "valid in 5.00 % of the contexts",
        "",
        f'{level} subsumed-row: wherever it is valid, line 2 ("walk") is valid too.',
        "  line 2 walk, valid in 20.00 %",
    ]
    assert "redundant" in run("coverage", "jog", "--explain", "walk").out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("nowhere",), "nowhere: there is no such table."),
        (("tables", "--fail-under", "120"), "is not a percentage"),
        (("tables", "--fail-under", "nan"), "is not a percentage"),
        (("tables", "--max-drop", "1"), "--max-drop compares with a baseline."),
        (("tables", "--baseline", "nowhere.json"), "nowhere.json"),
        (("tables", "--baseline", "tables/jog.csv"), "tables/jog.csv: the baseline cannot be read"),
        (("tables", "--seed", "-1"), ""),
        (("tables", "--samples", "many"), "is not a whole number"),
        (("tables", "--format", "htm"), 'Did you mean "html"?'),
        (("jog", "--gap", "9"), 'there is no gap "9".'),
        (("jog", "--gap", "1", "--explain", "1"), "do not go together"),
        (("jog", "--gap", "1", "--format", "html"), "--format html does not go with them"),
        (("jog", "--explain", "wlak"), 'Did you mean "walk"?'),
        (("jog", "--explain", "0"), 'there is no row "0". Accepted: a row from 1 to 2, or an asset.'),
        (("jog", "--explain", "3"), 'there is no row "3".'),
    ],
)
def test_bad_use_exits_with_2_and_says_what_is_wrong(arguments: tuple[str, ...], said: str):
    result = run("coverage", *arguments)
    assert (result.code, result.out) == (2, "")
    assert said in result.err
    assert "Traceback" not in result.err


def test_a_table_that_cannot_be_read_exits_with_2_and_names_every_fault():
    write(JOG + "x,5..,Wlak\n")
    write("Asset,speed\na,oops\n", "other")
    result = run("coverage", "tables")
    assert result.code == 2
    assert 'jog.csv, line 4, column "gait"' in result.err
    assert 'other.csv, line 2, column "speed"' in result.err


def test_a_folder_without_tables_and_a_table_without_rows():
    Path("empty").mkdir()
    assert run("coverage", "empty").code == 2
    write("Asset,speed,gait\n")
    result = run("coverage", "tables", "--fail-under", "1")
    assert result.code == 1
    assert "0 % of the contexts have a valid row" in result.out


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


def test_recorded_moments_are_held_to_their_own_bar(here: Path):
    Path("seen.csv").write_text("speed,gait,n\n1,Walk,97\n9,Run,2\n9,Walk,1\n", encoding="utf-8")
    told = ("coverage", "jog", "--telemetry", "seen*.csv", "--count", "n")
    result = run(*told, "--json", "--fail-under-telemetry", "99")
    assert (result.code, result.err) == (0, "")
    (table,) = result.json["tables"]
    seen = table["telemetry"]
    assert (seen["rows"], seen["distinct"], seen["covered"]) == (3, 3, 0.99)
    assert run(*told, "--fail-under-telemetry", "99.5").code == 1
    text = run(*told)
    assert "99.00 % of 100 recorded moments have a valid row (3 distinct)." in text.out
    assert "1.00 %  speed: (4..10], gait: Walk" in text.out


def test_telemetry_that_cannot_be_read_whole_is_no_answer(here: Path):
    Path("good.csv").write_text("speed,gait\n1,Walk\n", encoding="utf-8")
    Path("seen.parquet").write_bytes(b"PAR1 cut off")
    result = run("coverage", "jog", "--telemetry", "good.csv", "--telemetry", "seen.parquet", "--fail-under-telemetry", "1")
    assert result.code == 2
    assert "seen.parquet" in result.err
    assert "not read: seen.parquet" in result.out


@pytest.mark.parametrize(
    "option", [("--fail-under-telemetry", "9"), ("--count", "n"), ("--engine", "dask"), ("--scheduler", "x"), ("--resume", "x")]
)
def test_options_about_telemetry_want_files(option: tuple[str, str]):
    result = run("coverage", "tables", *option)
    assert (result.code, result.out) == (2, "")
    assert f"{option[0]} is about recorded contexts. Accepted: --telemetry GLOB" in result.err


def test_the_report_is_the_same_to_the_byte_on_one_core_and_on_four(here: Path):
    rows = [f"clip{i},{i % 7}..{i % 7 + 2},{'Walk' if i % 3 else 'Any'}" for i in range(60)]
    write("\n".join(["Asset,speed,gait", *rows, ""]))
    moments = [f"{i / 40},{'Run' if i % 2 else 'Walk'}" for i in range(400)]
    Path("moments.csv").write_text("\n".join(["speed,gait", *moments, ""]), encoding="utf-8")
    command = [sys.executable, "-m", "contextdb", "coverage", "tables", "--telemetry", "moments.csv", "--format", "json"]
    reports = []
    for cores in ("1", "4"):
        threads = {"NUMBA_NUM_THREADS": cores, "POLARS_MAX_THREADS": cores, "PYTHONPATH": str(ROOT)}
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


def test_rules_of_rows_count_in_every_share_and_are_no_conditions_themselves(ruled: Path):
    document = run("coverage", ruled, "--json").json["tables"][0]
    assert document["conditions"] == 2 == run("check", ruled, "--json").json["tables"][0]["conditions"]
    named = {name for pair in document["pairs"] for name in pair["cells"]}
    assert named == {"speed", "air", "gait"}
    said = run("coverage", ruled).out
    assert "3 rows, 2 conditions" in said


def test_a_gap_is_told_with_the_rule_of_the_nearest_row(ruled: Path):
    gaps = run("coverage", ruled, "--json").json["tables"][0]["gaps"]["items"]
    gap = next(g for g in gaps if "When" in g["cells"])
    rule = ['air or gait == "Run"', "not air or speed < 2", "Any"][gap["nearest"]["row"]]
    table = run("coverage", ruled, "--gap", gap["id"]).out.split("the gap\n")[1]
    assert re.search(rf"^  When +{re.escape(rule)}  +{re.escape(gap['cells']['When'])}$", table, re.MULTILINE)


def test_where_gaps_name_rules_the_list_says_that_it_is_by_volume(ruled: Path):
    recorded = ruled.with_name("recorded.csv")
    recorded.write_text("speed,air,gait\n2,False,Walk\n2,False,Walk\n9,False,Walk\n2,True,Walk\n")
    found = run("coverage", ruled, "--telemetry", str(recorded))
    gaps = run("coverage", ruled, "--telemetry", str(recorded), "--json").json["tables"][0]["gaps"]["items"]
    moments = [gap["telemetry"] or 0.0 for gap in gaps]
    assert moments != sorted(moments, reverse=True)
    assert "; the largest first\n" in found.out


def test_gaps_that_name_rules_which_were_written_anew_are_not_surely_new(ruled: Path):
    baseline = str(ruled.with_name("before.json"))
    assert run("coverage", ruled, "--format", "json", "-o", baseline).code == 0
    ruled.write_text(ruled.read_text().replace("air or gait", "(air) or gait"))
    change = run("coverage", ruled, "--baseline", baseline, "--json").json["tables"][0]["baseline"]
    assert (change["drop"], change["complete"]) == (0.0, False)
    assert "some may have been there" in " ".join(run("coverage", ruled, "--baseline", baseline).out.split())
