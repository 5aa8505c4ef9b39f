"""What holds of every format, and of the report that all of them are rendered from."""

import subprocess
import sys
from dataclasses import replace

import pytest
from hypothesis import given
from report_strategies import EXAMPLE, JOG, RUN, many, reports

from contextdb import ContextDBError, report
from contextdb.findings import LEVELS, Finding
from contextdb.report.results import CheckReport, TableSummary, message_of, place_of


@given(reports())
def test_the_same_findings_give_the_same_bytes_in_valid_utf8_and_no_text_can_move_the_cursor(found: CheckReport):
    again = CheckReport(tuple(found.tables), tuple(map(replace, found.findings)))
    for name in report.formats("check"):
        text = report.render(name, found)
        assert text.encode() == report.render(name, again).encode()
        assert text == "" or text.endswith("\n")
        assert all(c == "\n" or ord(c) >= 0xA0 or c.isprintable() for c in text)


@pytest.mark.parametrize("name", report.formats("check"))
def test_every_finding_is_in_every_format_when_all_are_asked_for(name: str):
    found = many(300, n_tables=2)
    text = report.render(name, found, shows_all=True)
    written = {
        "text": ":{} ",
        "json": '"line": {},',
        "github": "line={},",
        "junit": ".csv:{}: ",
        "sarif": '"startLine": {}\n',
        "markdown": " line {} ",
    }
    for line in (3, 300, 301):
        assert text.count(written[name].format(line)) == 2


@pytest.mark.parametrize("name", report.formats("check"))
def test_one_format_does_not_load_the_others(name: str):
    script = f"""
import sys
from contextdb import report
from contextdb.report.results import CheckReport
assert not [m for m in sys.modules if "render_" in m]
report.render({name!r}, CheckReport((), ()))
print(*sorted(m.rpartition(".")[2] for m in sys.modules if "render_" in m))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    also = {"sarif": ["render_json"]}
    assert done.stdout.split() == sorted([f"render_{name}", *also.get(name, [])])


def test_a_format_that_is_not_there_is_refused_with_the_nearest():
    with pytest.raises(ContextDBError, match=r'there is no format "jsn".*Did you mean "json"\?'):
        report.render("jsn", EXAMPLE)


def test_the_summary_counts_each_level():
    assert EXAMPLE.summary == "3 tables checked: 3 errors, 1 warning, 1 info."
    assert CheckReport((JOG,), ()).summary == "1 table checked: nothing found."
    assert CheckReport((), ()).summary == "0 tables checked: nothing found."


def test_groups_begin_with_the_worst_and_end_with_the_clean():
    assert [g.label for g in EXAMPLE.groups()] == ["jog", "jump", "run", "walk"]
    assert [(level, rule, len(found)) for level, rule, found in EXAMPLE.groups()[0].blocks()] == [
        ("error", "empty-cell", 2),
        ("info", "undeclared-condition", 1),
    ]


def test_tables_of_one_name_are_told_apart_by_their_files():
    twins = (TableSummary("jog", "a/jog.csv", 1, 1), TableSummary("jog", "b/jog.csv", 1, 1))
    found = CheckReport(twins, (Finding("no-rows", "warning", "it has no rows.", "jog", "b/jog.csv"),))
    assert [(g.label, len(g.findings)) for g in found.groups()] == [("jog (b/jog.csv)", 1), ("jog (a/jog.csv)", 0)]


def test_a_finding_without_a_file_belongs_to_the_table_of_its_name():
    found = CheckReport((RUN,), (Finding("no-rows", "warning", "it has no rows.", "run"), Finding("odd", "info", "nowhere.")))
    assert [(g.label, g.table, len(g.findings)) for g in found.groups()] == [("run", RUN, 1), ("no file", None, 1)]


@given(reports())
def test_each_table_and_each_finding_is_in_one_group(found: CheckReport):
    groups = found.groups()
    assert sorted(map(repr, found.tables)) == sorted(repr(g.table) for g in groups if g.table)
    assert sorted(map(repr, found.findings)) == sorted(repr(f) for g in groups for f in g.findings)
    assert all(sum(len(b[2]) for b in g.blocks()) == len(g.findings) for g in groups)
    ranks = [min((LEVELS.index(f.level) for f in g.findings), default=3) for g in groups]
    assert ranks == sorted(ranks)


def test_a_finding_says_what_it_is_about():
    by_line = Finding("empty-cell", "error", "it is empty.", "jog", "tables/jog.csv", 3, "Jog\n1", 5, "speed")
    by_row = Finding("empty-cell", "error", "it is empty.", "run", "tables/run.parquet", 3, None, None, "speed")
    assert (place_of(by_line), message_of(by_line)) == ("tables/jog.csv:5", r'"Jog\n1", column "speed": it is empty.')
    assert message_of(by_line, names_asset=False) == 'column "speed": it is empty.'
    assert (place_of(by_row), message_of(by_row)) == ("tables/run.parquet", 'row 4, column "speed": it is empty.')
    assert (place_of(Finding("odd", "info", "nowhere.")), message_of(Finding("odd", "info", "nowhere."))) == ("", "nowhere.")


def test_labels_are_all_different():
    tables = tuple(TableSummary("jog", file, 1, 1) for file in (None, "jog.csv", "./jog.csv"))
    assert [g.label for g in CheckReport(tables, ()).groups()] == ["jog", "jog (jog.csv)", "jog (jog.csv) #2"]
