"""Coverage in every format: one module a format, imported when it is asked for."""

from __future__ import annotations

from typing import Literal, get_args

from contextdb.report.coverage_results import CoverageResults

CoverageFormat = Literal["text", "json", "github", "junit", "sarif", "markdown", "html"]
FORMATS: tuple[CoverageFormat, ...] = get_args(CoverageFormat)


def render(
    format_name: CoverageFormat, results: CoverageResults, *, colour: bool = False, width: int = 100, shows_all: bool = False
) -> str:
    """Render what was measured; the same arguments always give the same text.

    `colour` and `width` are for text; `shows_all` lists every gap and finding where people would else see the first few.
    """
    match format_name:
        case "text":
            from contextdb.report import coverage_text

            return coverage_text.render(results, colour, width, shows_all)
        case "json":
            from contextdb.report.render_json import as_json

            return as_json(results.to_json())
        case "github":
            from contextdb.report import render_github

            return render_github.render(results.as_check())
        case "junit":
            from contextdb.report import coverage_junit

            return coverage_junit.render(results)
        case "sarif":
            from contextdb.report import render_sarif

            return render_sarif.render(results.as_check(), shows_all)
        case "markdown":
            from contextdb.report import coverage_markdown

            return coverage_markdown.render(results, shows_all)
        case "html":
            from contextdb.report import coverage_html

            return coverage_html.render(results)
