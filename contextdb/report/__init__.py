"""The findings of a check, and measured coverage and motion, as text for people and for machines.

A format is one module, imported when it is used.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from importlib import import_module

from contextdb.errors import ContextDBError, no_such
from contextdb.findings import Level
from contextdb.report.results import Report, Subject

RENDERERS: Mapping[tuple[Subject, str], tuple[str, tuple[str, ...]]] = {
    ("check", "text"): ("render_text", ("colour", "width", "shows_all")),
    ("check", "json"): ("render_json", ()),
    ("check", "github"): ("render_github", ()),
    ("check", "junit"): ("render_junit", ("failing", "shows_all")),
    ("check", "sarif"): ("render_sarif", ("shows_all",)),
    ("check", "markdown"): ("render_markdown", ("shows_all",)),
    ("coverage", "text"): ("coverage_text", ("colour", "width", "shows_all")),
    ("coverage", "json"): ("render_json", ()),
    ("coverage", "github"): ("render_github", ()),
    ("coverage", "junit"): ("render_junit:render_coverage", ()),
    ("coverage", "sarif"): ("render_sarif", ("shows_all",)),
    ("coverage", "markdown"): ("coverage_document:as_comment", ("shows_all",)),
    ("coverage", "html"): ("document_html:as_html", ()),
    ("measures", "text"): ("document:as_text", ("colour", "width", "shows_all")),
    ("measures", "json"): ("render_json", ()),
    ("measures", "junit"): ("motion_junit:measures", ()),
    ("measures", "markdown"): ("document:as_markdown", ()),
    ("measures", "html"): ("document_html:as_html", ()),
    ("motion coverage", "text"): ("document:as_text", ("colour", "width", "shows_all")),
    ("motion coverage", "json"): ("render_json", ()),
    ("motion coverage", "markdown"): ("document:as_markdown", ()),
    ("motion coverage", "html"): ("document_html:as_html", ()),
    ("motion coverage", "junit"): ("motion_junit:motion_coverage", ()),
}
"""For each subject and format the module that renders it, by `render` or by the function after the colon, and its options."""
DOCUMENTS: Mapping[Subject, str] = {
    "coverage": "coverage_document",
    "measures": "measure_results",
    "motion coverage": "motion_coverage_document",
}
"""The module that writes the document of a subject, by `document`."""
ERRORS: tuple[Level, ...] = ("error",)


def formats(subject: Subject) -> list[str]:
    """The formats of a subject, in the order in which they are offered."""
    return [name for about, name in RENDERERS if about == subject]


def render(
    format_name: str,
    report: Report,
    *,
    colour: bool = False,
    width: int = 100,
    shows_all: bool = False,
    failing: Collection[Level] = ERRORS,
) -> str:
    """Render the findings of a check, or measured coverage; the same arguments always give the same text.

    `format_name` is one of `formats(report.subject)`. `colour` and `width`, in terminal cells, are for `text`; `shows_all` gives
    every finding and gap, where people would else see the first few of each kind; `failing` are the levels that make a test of
    `junit` fail, as they make the command fail. Raises ContextDBError where there is no such format.
    """
    known = formats(report.subject)
    if format_name not in known:
        raise ContextDBError(no_such("format", format_name, known))
    module, taken = RENDERERS[report.subject, format_name]
    options = {"colour": colour, "width": width, "shows_all": shows_all, "failing": failing}
    module, _, function = module.partition(":")
    rendered = getattr(import_module(f"contextdb.report.{module}"), function or "render")
    if module.startswith("document"):
        written_by = import_module(f"contextdb.report.{DOCUMENTS[report.subject]}")
        report = written_by.document(report, shows_all, is_page=format_name == "html")
    text: str = rendered(report, **{name: options[name] for name in taken})
    return text
