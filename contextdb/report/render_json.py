"""Findings as JSON: `{"format": 1, "findings": [{"rule", "level", "row", "asset", "line", "column", "message", "by", …}],
"tables"}`.

Rows count from 0, lines from 1; `by` are the rows that cause a finding. What is not known is null.
"""

from __future__ import annotations

import json
import re

from contextdb.report.results import CheckReport, TableSummary

FORMAT = 1
_UNSAFE = re.compile("[\x7f-\x9f\u2028\u2029\ud800-\udfff]")


def render(report: CheckReport) -> str:
    """The findings as one JSON document."""
    findings = [finding.to_json() for finding in report.findings]
    return as_json({"format": FORMAT, "findings": findings, "tables": [_table(table) for table in report.tables]})


def as_json(document: object) -> str:
    """A JSON text that is valid UTF-8 and moves no cursor; half of a surrogate pair, which JSON cannot hold, becomes its escape
    as text."""
    return _UNSAFE.sub(_escaped, json.dumps(document, ensure_ascii=False, indent=2)) + "\n"


def _escaped(found: re.Match[str]) -> str:
    code = ord(found[0])
    return f"\\\\u{code:04x}" if code >= 0xD800 else f"\\u{code:04x}"


def _table(table: TableSummary) -> dict[str, object]:
    return {"table": table.name, "file": table.file, "rows": table.n_rows, "conditions": table.n_conditions}
