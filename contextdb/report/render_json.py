"""A report as JSON. Of a check: `{"format": 1, "findings": [{"rule", "level", "row", "asset", "line", "column", …}], "tables"}`.

Rows count from 0, lines from 1; `by` are the rows that cause a finding. What is not known is null.
"""

from __future__ import annotations

import json
import re

from contextdb.files.reports import DIGEST, sealed
from contextdb.report.results import Report

_UNSAFE = re.compile("[\x7f-\x9f\u2028\u2029\ud800-\udfff]")


def render(report: Report) -> str:
    document = report.to_json()
    text = as_json(document)
    return sealed(text) if DIGEST in document else text


def as_json(document: object) -> str:
    """A JSON text that is valid UTF-8 and moves no cursor; half of a surrogate pair, which JSON cannot hold, becomes its escape
    as text."""
    return _UNSAFE.sub(_escaped, json.dumps(document, ensure_ascii=False, indent=2)) + "\n"


def _escaped(match: re.Match[str]) -> str:
    code = ord(match[0])
    return f"\\\\u{code:04x}" if code >= 0xD800 else f"\\u{code:04x}"
