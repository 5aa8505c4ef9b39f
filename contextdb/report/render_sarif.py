"""Findings as SARIF 2.1.0, for GitHub code scanning and for editors.

Each rule that was broken is described with its cure; each finding is at its file and line. Paths are relative to the source
root (`%SRCROOT%`) unless they were given absolute. A fingerprint of what a finding is about, not of its line, follows it from run
to run.

Source: OASIS, "Static Analysis Results Interchange Format (SARIF) Version 2.1.0 Plus Errata 01", 2023.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterator
from pathlib import PurePath
from urllib.parse import quote

from contextdb.checks.rules import RULES
from contextdb.console import __version__, printable
from contextdb.files.texts import is_parquet
from contextdb.findings import Finding, Level
from contextdb.report.render_json import as_json
from contextdb.report.results import Report, message_of, worst_first

Json = dict[str, object]

MOST_RESULTS = 5_000
"""GitHub shows no more of one run, and refuses a run of more than 25,000."""

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
LEVEL_NAMES: dict[Level, str] = {"error": "error", "warning": "warning", "info": "note"}


def render(report: Report, shows_all: bool = False) -> str:
    """The findings as a SARIF log of one run; the worst ones where there are more than `MOST_RESULTS`."""
    ordered = worst_first(report.as_check().findings)
    listed = ordered if shows_all else ordered[:MOST_RESULTS]
    rules = list(dict.fromkeys(f.rule for f in listed))
    driver = {"name": "contextdb", "semanticVersion": __version__, "rules": [_rule(name, listed) for name in rules]}
    run: Json = {
        "tool": {"driver": driver},
        "invocations": [_invocation(len(ordered) - len(listed))],
        "results": list(_results(listed, rules)),
    }
    return as_json({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]})


def _rule(name: str, findings: list[Finding]) -> Json:
    known = RULES.get(name)
    if known is None:
        return {"id": printable(name)}
    return {
        "id": printable(name),
        "shortDescription": {"text": known.summary},
        "fullDescription": {"text": known.summary},
        "help": {"text": f"{known.summary} {known.cure}", "markdown": f"{known.summary}\n\n{known.cure}"},
        "defaultConfiguration": {"level": LEVEL_NAMES[known.level]},
    }


def _invocation(n_left_out: int) -> Json:
    if not n_left_out:
        return {"executionSuccessful": True}
    text = f"{n_left_out:,} more findings are left out; contextdb check --all gives every one."
    return {"executionSuccessful": True, "toolExecutionNotifications": [{"level": "warning", "message": {"text": text}}]}


def _results(findings: list[Finding], rules: list[str]) -> Iterator[Json]:
    index = {rule: i for i, rule in enumerate(rules)}
    seen: Counter[str] = Counter()
    for finding in findings:
        digest = _digest(finding)
        seen[digest] += 1
        yield {
            "ruleId": printable(finding.rule),
            "ruleIndex": index[finding.rule],
            "level": LEVEL_NAMES[finding.level],
            "message": {"text": _as_message(message_of(finding))},
            "locations": _locations(finding),
            "partialFingerprints": {"contextdbFinding/v1": f"{digest}:{seen[digest]}"},
            "properties": _properties(finding),
        }


def _as_message(text: str) -> str:
    """Text without placeholders ("{0}") and links ("[text](1)"), as sections 3.11.5 and 3.11.6 have them written."""
    return text.replace("{", "{{").replace("}", "}}").replace("](", "\\](")


def _locations(finding: Finding) -> list[Json]:
    if not finding.file:
        return []
    place: Json = {"artifactLocation": _artifact(finding.file)}
    if finding.line is not None:
        place["region"] = {"startLine": finding.line}
    elif not is_parquet(finding.file):  # of a text the whole file is meant, and GitHub wants a line
        place["region"] = {"startLine": 1}
    return [{"physicalLocation": place}]


def _artifact(file: str) -> Json:
    path = PurePath(file)
    uri = quote(path.as_posix(), errors="backslashreplace")
    if path.is_absolute():
        return {"uri": f"file://{'' if uri.startswith('/') else '/'}{uri}"}
    return {"uri": uri, "uriBaseId": "%SRCROOT%"}


def _digest(finding: Finding) -> str:
    """A digest of what a finding is about, as long as neither the asset nor the column is renamed."""
    about = (finding.rule, finding.table or finding.file or "", finding.asset or "", finding.column or "")
    return hashlib.sha256("\n".join(map(printable, about)).encode()).hexdigest()[:32]


def _properties(finding: Finding) -> Json:
    properties = {"table": finding.table, "row": finding.row, "asset": finding.asset, "column": finding.column}
    return {key: value for key, value in properties.items() if value is not None} | ({"by": list(finding.by)} if finding.by else {})
