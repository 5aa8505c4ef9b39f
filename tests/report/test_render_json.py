"""JSON: the fixed shape, and every text as it was."""

import json

from hypothesis import given
from report_strategies import EXAMPLE, reports

from contextdb.report import render_json
from contextdb.report.results import CheckReport

FIXED = {"rule", "level", "row", "asset", "line", "column", "message", "by"}


def as_it_comes_back(value: object) -> object:
    """Halves of surrogate pairs come back as their escape: no JSON text in UTF-8 can hold them."""
    return value.encode("utf-8", "backslashreplace").decode() if isinstance(value, str) else value


@given(reports())
def test_every_field_of_every_finding_comes_back(report: CheckReport):
    document = json.loads(render_json.render(report).encode())
    assert document["format"] == 1
    assert document["findings"] == [{key: as_it_comes_back(v) for key, v in f.to_json().items()} for f in report.findings]
    assert [t["rows"] for t in document["tables"]] == [t.n_rows for t in report.tables]


def test_a_finding_has_the_fixed_fields_with_rows_from_0_and_lines_from_1():
    document = json.loads(render_json.render(EXAMPLE))
    assert document.keys() == {"format", "findings", "tables", "contracts"}
    assert all(f.keys() >= FIXED for f in document["findings"])
    assert document["findings"][3] == {
        "rule": "identical-rows",
        "level": "warning",
        "row": 2,
        "asset": "Run_2",
        "line": None,
        "column": None,
        "message": "the same as row 0: 50%, a|b.",
        "by": [0],
        "table": "run",
        "file": "tables/run.parquet",
    }
    assert document["tables"][0] == {"table": "jog", "file": "tables/jog.csv", "rows": 17, "conditions": 8}


def test_nothing_found_is_an_empty_list():
    assert json.loads(render_json.render(CheckReport((), ()))) == {"format": 1, "findings": [], "tables": [], "contracts": []}
