"""Coverage as Markdown, for a job summary or a comment on a pull request: small enough to be posted."""

from __future__ import annotations

import sys

from contextdb.report.coverage_document import document
from contextdb.report.coverage_results import CoverageResults
from contextdb.report.document import as_markdown
from contextdb.report.render_markdown import MOST_BYTES

STEPS = (10, 5, 3, 1)
"""How many gaps, pairs and rows of a rule are listed: the first that fits."""
MOST_TABLES = 50


def render(results: CoverageResults, shows_all: bool = False) -> str:
    """As much detail as a comment on a pull request holds; everything with `shows_all`."""
    if shows_all:
        return as_markdown(document(results), sys.maxsize)
    texts = (as_markdown(document(results, most=most), sys.maxsize) for most in STEPS)
    fitting = next((text for text in texts if len(text.encode()) <= MOST_BYTES), None)
    return fitting or as_markdown(document(results, most=0, most_tables=MOST_TABLES))
