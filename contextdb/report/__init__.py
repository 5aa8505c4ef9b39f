"""What a check found, as text for people and for machines: one module a format, imported when it is asked for."""

from __future__ import annotations

from collections.abc import Collection
from typing import Literal, get_args

from contextdb.errors import ContextDBError, Fault, in_quotes, nearest, some
from contextdb.findings import Level
from contextdb.report.results import CheckReport

Format = Literal["text", "json", "github", "junit", "sarif", "markdown"]
FORMATS: tuple[Format, ...] = get_args(Format)
ERRORS: tuple[Level, ...] = ("error",)


def render(
    format_name: str,
    report: CheckReport,
    *,
    colour: bool = False,
    width: int = 100,
    shows_all: bool = False,
    failing: Collection[Level] = ERRORS,
) -> str:
    """Render the findings of a check; the same arguments always give the same text.

    Parameters
    ----------
    format_name : str
        One of `FORMATS`.
    colour, width : bool, int
        For `text`: whether to colour it, and how many terminal cells a line may have.
    shows_all : bool
        Every finding, where people would else see the first few of each kind.
    failing : collection of str
        For `junit`: the levels that make a test fail, as they make the command fail.

    Raises
    ------
    ContextDBError
        There is no such format.
    """
    match format_name:
        case "text":
            from contextdb.report import render_text

            return render_text.render(report, colour, width, shows_all)
        case "json":
            from contextdb.report import render_json

            return render_json.render(report)
        case "github":
            from contextdb.report import render_github

            return render_github.render(report)
        case "junit":
            from contextdb.report import render_junit

            return render_junit.render(report, failing, shows_all)
        case "sarif":
            from contextdb.report import render_sarif

            return render_sarif.render(report, shows_all)
        case "markdown":
            from contextdb.report import render_markdown

            return render_markdown.render(report, shows_all)
    near = nearest(format_name, FORMATS)
    found = f"there is no format {in_quotes(format_name)}."
    raise ContextDBError(Fault(found, some(FORMATS), in_quotes(near) if near else ""))
