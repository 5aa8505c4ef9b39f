"""Findings as annotations of GitHub Actions: one line a finding, `::error file=…,line=…,title=…::message`.

GitHub shows the first ten errors, ten warnings and ten notices of a step, so the worst come first; the log holds them all. A value
cannot end its field: "%", line ends and, in properties, ":" and "," are written as the runner reads them back.

Source: actions/toolkit, `packages/core/src/command.ts`; actions/runner, `ActionCommand.cs`.
"""

from __future__ import annotations

from contextdb.console import printable
from contextdb.findings import Finding, Level
from contextdb.report.results import Report, as_path, message_of, worst_first

COMMANDS: dict[Level, str] = {"error": "error", "warning": "warning", "info": "notice"}


def render(report: Report) -> str:
    """One annotation a finding, and nothing else."""
    return "".join(f"{_annotation(finding)}\n" for finding in worst_first(report.as_check().findings))


def _annotation(finding: Finding) -> str:
    properties = {"title": f"contextdb {printable(finding.rule)}"}
    if finding.file:
        place = {"file": as_path(finding.file)} | ({"line": str(finding.line)} if finding.line is not None else {})
        properties = place | properties
    written = ",".join(f"{key}={_as_property(value)}" for key, value in properties.items())
    return f"::{COMMANDS[finding.level]} {written}::{_as_data(message_of(finding))}"


def _as_data(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _as_property(text: str) -> str:
    return _as_data(text).replace(":", "%3A").replace(",", "%2C")
