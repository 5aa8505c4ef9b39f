"""Check a folder of tables as a build does: findings, coverage and saved contexts, against a commit or a report; with report files.

The first line says what was compared with what. Exits with 1 if anything fails: a finding at the level of --fail-on, a threshold,
or a gate that no option accepts; with 2 if the commit, the report or an option cannot be used.

  contextdb ci tables/ --against origin/main --max-drop 0.5 --out report/
  contextdb ci tables/ --against origin/main --new dive --gone roll
  contextdb ci tables/ --baseline coverage.json --format github
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from contextdb.commands.check_command import check_path
from contextdb.commands.coverage_command import Tables, add_measuring_arguments, code_of, measured_results
from contextdb.commands.coverage_telemetry import require_telemetry
from contextdb.commands.gating import OPTIONS, Accepted, add_accepting_arguments, earlier_report, require_baseline
from contextdb.commands.git_tree import Commit
from contextdb.commands.numbers import percent
from contextdb.console import ExitCode, output, printable, terminal_width, wants_colour
from contextdb.covering.baseline import ACCEPTED, Baseline, read_baseline
from contextdb.disk import make_folder, real_path, remove, write_atomic
from contextdb.disk.boundary import inside
from contextdb.errors import ContextDBError, ContextError, Fault, in_quotes, plural, safe_text
from contextdb.findings import LEVELS, Level
from contextdb.report import render
from contextdb.report.coverage_results import CoverageResults
from contextdb.report.render_markdown import escaped
from contextdb.report.results import CheckReport, Gate
from contextdb.tables.project import folder_of

SUMMARY = "summary.md"
OF_CHECK, OF_COVERAGE = {"check.xml": "junit"}, {"coverage.xml": "junit", "coverage.html": "html", "coverage.json": "json"}
FINDINGS = "contextdb.sarif"
REPORTS = (SUMMARY, FINDINGS, *OF_CHECK, *OF_COVERAGE)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="FOLDER", nargs="?", default=".", help="a folder of tables (default: .)")
    against = parser.add_mutually_exclusive_group()
    against.add_argument("--against", metavar="REF", help="compare with the folder in a branch, tag or commit of git")
    against.add_argument("--baseline", metavar="FILE", help="compare with the coverage.json of an earlier run")
    parser.add_argument("--out", metavar="FOLDER", help=f"write {', '.join(REPORTS)} there")
    parser.add_argument(
        "--format", choices=("text", "github"), default="text", metavar="FORMAT", help="text, github (default: text)"
    )
    parser.add_argument(
        "--fail-on",
        choices=("error", "warning", "none"),
        default="error",
        help="the lowest level of findings that fails (default: error)",
    )
    parser.add_argument("--fail-under", type=percent, metavar="PCT", help="fail if the covered percentage of any table is lower")
    parser.add_argument("--max-drop", type=percent, metavar="PCT", help="how many points a table may fall below the baseline")
    add_accepting_arguments(parser)
    uncompared = "the commit has no tables that can be measured, and that is known: nothing is compared"
    parser.add_argument("--uncompared", action="store_true", help=uncompared)
    add_measuring_arguments(parser)


@dataclass(frozen=True)
class Before:
    """What the tables are compared with: its name, and what it says; or why it says nothing, and whether that is accepted."""

    name: str
    baseline: Baseline | None = None
    missing: str = ""
    is_accepted: bool = False

    @property
    def words(self) -> str:
        if self.baseline is None:
            why = f", as {self.missing}" if self.missing else "; --against REF or --baseline FILE compares"
            return f"compared with nothing{why}"
        n_cases = sum(counts.count for counts in self.baseline.cases.values())
        return f"compared with {self.name}: {plural(len(self.baseline.tables), 'table')}, {plural(n_cases, 'saved context')}"

    @property
    def gates(self) -> list[tuple[str, Gate]]:
        """The gate of a comparison that was wanted and is not possible."""
        if not self.missing:
            return []
        message = (
            f"{self.missing}, as --uncompared accepts."
            if self.is_accepted
            else f"{self.missing}. Where that is intended: --uncompared."
        )
        return [(self.name, Gate("uncompared", 0.0, 1.0, self.is_accepted, message, is_accepted=self.is_accepted))]


def run(arguments: argparse.Namespace) -> ExitCode:
    """Check and measure a folder of tables, and compare it."""
    folder = folder_of(Path(arguments.path))
    require_baseline(arguments, bool(arguments.against is not None or arguments.baseline), "--against REF or --baseline FILE")
    require_telemetry(arguments)
    before = _before(arguments, folder)
    checked = check_path(str(folder))
    failing = LEVELS[: LEVELS.index(arguments.fail_on) + 1] if arguments.fail_on != "none" else ()
    results = _results(arguments, folder, checked, before)
    has_failing = any(finding.level in failing for finding in checked.findings)
    code = ExitCode.OK if results is None else code_of(results)
    code = ExitCode.FOUND if code == ExitCode.OK and (has_failing or results is None) else code
    head = _head(folder, checked, before)
    verdict = _verdict(has_failing, results)
    if arguments.out is not None:
        _write_reports(Path(arguments.out), checked, results, (head, verdict), failing)
    is_text = arguments.format == "text"
    colour, width = is_text and wants_colour(sys.stdout), terminal_width()
    with output():
        print(printable(head))
        for report in (checked, results) if results is not None else (checked,):
            text = render(arguments.format, report, colour=colour, width=width, failing=failing)
            print("\n" if is_text else "", text, sep="", end="")
        print(printable(verdict))
    return code


def _before(arguments: argparse.Namespace, folder: Path) -> Before:
    if arguments.against is None and arguments.uncompared:
        raise ContextError(Fault("--uncompared is about a commit.", "--against REF with it"))
    if arguments.baseline:
        return Before(safe_text(arguments.baseline), earlier_report(arguments.baseline, read_baseline, ACCEPTED))
    if arguments.against is None:
        return Before("nothing")
    before = _of_commit(arguments, Commit.of(folder, arguments.against))
    if arguments.uncompared and not before.missing:
        sentence = f"--uncompared accepts nothing: the tables of {before.name} were measured."
        raise ContextError(Fault(sentence, "no --uncompared"))
    return replace(before, is_accepted=arguments.uncompared)


def _of_commit(arguments: argparse.Namespace, commit: Commit) -> Before:
    """The tables of a commit, measured as those of the folder are."""
    with TemporaryDirectory(prefix="contextdb-ci-") as temporary:
        target, folder = real_path(temporary), None
        try:
            if (folder := commit.tables_into(target)) is None:
                return Before(commit.name, missing=f"{commit.name} has no tables in this folder")
            plain = argparse.Namespace(**vars(arguments) | {"telemetry": None, "fail_under": None, "fail_under_expected": None})
            results = measured_results(plain, Tables.at(str(folder)), None, Accepted({}))
        except ContextDBError as error:
            first = error.faults[0]
            file = Path(first.place.file or "")
            inner = next((one for one in (folder, target) if one is not None and file.is_relative_to(one)), None)
            what = f"{file.relative_to(inner).as_posix()}: " if inner is not None else ""
            return Before(commit.name, missing=f"the tables of {commit.name} cannot be measured: {what}{first.found.rstrip('.')}")
        return Before(commit.name, read_baseline(render("json", results), commit.name))


def _results(arguments: argparse.Namespace, folder: Path, checked: CheckReport, before: Before) -> CoverageResults | None:
    """Coverage, compared; None where tables cannot be read, as the check says."""
    try:
        tables = Tables.at(str(folder))
        tables.case_counts()
    except ContextDBError:
        if any(finding.level == "error" for finding in checked.findings):
            return None
        raise
    results = measured_results(arguments, tables, before.baseline, Accepted.of(arguments))
    if before.baseline is None and (names := [f"--{o}" for o in OPTIONS if getattr(arguments, o.replace("-", "_"))]):
        raise ContextError(Fault(f"{names[0]} accepts nothing: nothing is compared.", f"no {names[0]}"))
    return replace(results, others=(*before.gates, *results.others))


def _head(folder: Path, checked: CheckReport, before: Before) -> str:
    return f"{folder.as_posix()}: {plural(len(checked.tables), 'table')}, {before.words}."


def _verdict(has_failing: bool, results: CoverageResults | None) -> str:
    """Which parts fail, in one sentence."""
    missed = [] if results is None else [f"{gate.name} of {in_quotes(name)}" for name, gate in _missed(results)]
    parts = [*(["check"] if has_failing else []), *(["coverage, which cannot be measured"] if results is None else []), *missed]
    return f"FAILED: {', '.join(parts)}." if parts else "PASSED."


def _missed(results: CoverageResults) -> Iterator[tuple[str, Gate]]:
    own = ((measured.report.table, gate) for measured in results.tables for gate in measured.gates)
    return ((name, gate) for name, gate in (*results.others, *own) if not gate.passed)


def _write_reports(
    out: Path, checked: CheckReport, results: CoverageResults | None, sentences: tuple[str, str], failing: tuple[Level, ...]
) -> None:
    """Write the report files; those of coverage that cannot be measured are deleted, so that no old one is left."""
    head, verdict = sentences
    reports: list[CheckReport | CoverageResults] = [checked] if results is None else [checked, results]
    summary = "\n".join([f"{escaped(head)}\n", f"**{escaped(verdict)}**\n", *(render("markdown", report) for report in reports)])
    findings = CheckReport(checked.tables, tuple(finding for report in reports for finding in report.as_check().findings))
    texts: dict[str, str] = {SUMMARY: summary, FINDINGS: render("sarif", findings)}
    texts |= {name: render(kind, checked, failing=failing) for name, kind in OF_CHECK.items()}
    texts |= {} if results is None else {name: render(kind, results) for name, kind in OF_COVERAGE.items()}
    _write_into(out, texts)


def _write_into(out: Path, texts: Mapping[str, str]) -> None:
    make_folder(out)
    for path in [inside(out / name, out) for name in REPORTS]:
        if path.name in texts:
            write_atomic(path, texts[path.name].encode("utf-8", "backslashreplace"))
        else:
            remove(path)
