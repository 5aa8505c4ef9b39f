"""Check a folder of tables as a build does: findings, coverage and saved contexts, against a commit or a report; with report files.

The first line says what was compared with what. Exits with 1 if anything fails: a finding at the level of --fail-on, a threshold,
or a gate that no option accepts; with 2 if the commit, the report or an option cannot be used.

  contextdb ci tables/ --against origin/main --max-drop 0.5 --out report/
  contextdb ci tables/ --against origin/main --new dive --gone roll
  contextdb ci tables/ --baseline coverage.json --format github
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

from contextdb.commands.check_command import check_path
from contextdb.commands.coverage_command import Tables, add_measuring_arguments, code_of, measured_results, require_telemetry
from contextdb.commands.gating import OPTIONS, Accepted, add_accepting_arguments, earlier_report, require_baseline
from contextdb.commands.numbers import percent
from contextdb.console import ExitCode, output, printable, terminal_width, wants_colour
from contextdb.covering.baseline import ACCEPTED, Baseline, read_baseline
from contextdb.disk import TABLE_SUFFIXES, make_folder, read_bytes, real_path, remove, write_atomic
from contextdb.disk.boundary import inside
from contextdb.disk.git import LFS_POINTER, is_in_a_repository, run_git
from contextdb.errors import ContextDBError, ContextError, Fault, FileError, Place, in_quotes, plural, safe_text
from contextdb.files.file_names import alike
from contextdb.findings import LEVELS, Level
from contextdb.report import render
from contextdb.report.coverage_results import CoverageResults
from contextdb.report.render_markdown import escaped
from contextdb.report.results import CheckReport, Gate
from contextdb.schema.settings import extends_of
from contextdb.tables.other_files import cases_path
from contextdb.tables.project import SCHEMA_FILE, folder_of, read_folder_schema

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


# ---- the tables of a folder as they are in a commit, read from git's objects into another folder. An edge: it runs git. A
# ref is never an option of git: it is looked up once, behind `--end-of-options`, and git is then given the hash of the
# commit. A folder that is made to look like a repository of its own is none. Blobs are read as they are, without filters,
# hooks or replaced objects, and only contextdb.toml, tables and saved contexts are written, as plain files: no link, and no
# name that leads out of the folder

MOST_EXTENDED = 16
"""So many projects extend each other in a row."""

_PLAIN_FILES = ("100644", "100755")


@dataclass(frozen=True)
class Commit:
    """A commit of the repository that a folder is in."""

    folder: Path
    ref: str
    hash: str

    @classmethod
    def of(cls, folder: Path, ref: str) -> Commit:
        """The commit that a ref names. Raises ContextError where there is none, and FileError where there is no git or no
        repository."""
        if not is_in_a_repository(folder):
            sentence = "the folder is in no git repository, so that there is nothing to compare with."
            raise FileError(Fault(sentence, "--baseline FILE, or a folder of a repository", place=Place(str(folder))))
        code, commit = (1, b"") if _is_no_ref(ref) else run_git(folder, *_lookup(ref))
        if code == 0:
            return cls(folder, ref, commit.decode("ascii", "replace").strip())
        is_shallow = run_git(folder, "rev-parse", "--is-shallow-repository")[1].strip() == b"true"
        mend = "git fetch --unshallow, or fetch-depth: 0 of actions/checkout, as this clone is shallow" if is_shallow else ""
        if not mend and not _is_no_ref(ref) and run_git(folder, *_lookup(f"origin/{ref}"))[0] == 0:
            mend = in_quotes(f"origin/{ref}")
        raise ContextError(Fault(f"git has no commit {in_quotes(ref)} here.", "a branch, a tag or a commit of this clone", mend))

    @property
    def name(self) -> str:
        """The commit in words."""
        return f"{safe_text(self.ref)} (commit {self.hash[:12]})"

    def tables_into(self, root: Path) -> Path | None:
        """Write the folder's tables, as they are in the commit, into an empty folder, at their path in the repository, with what
        their project extends; gives their folder, None where it has no file there. Raises ContextDBError where its contextdb.toml
        cannot be read, or git does not have a file."""
        prefix = run_git(self.folder, "rev-parse", "--show-prefix")[1].decode("utf-8", "surrogateescape").strip("\n")
        target = root.joinpath(*PurePosixPath(prefix).parts)
        code, listed = run_git(self.folder, "ls-tree", "-r", "-z", "--full-tree", f"{self.hash}:{prefix.rstrip('/')}")
        blobs = dict(_plain_files(listed)) if code == 0 else {}
        make_folder(root / ".git")  # what is extended may climb to here
        if SCHEMA_FILE in blobs:
            self._write(blobs, [SCHEMA_FILE], target)
            self._write_extended(target / SCHEMA_FILE, root)
        schema = read_folder_schema(target)
        declared = {alike(file) for settings in schema.tables.values() for file in settings.files}
        expected = {alike(settings.expected) for settings in schema.tables.values() if settings.expected is not None}
        declared |= expected | {alike(cases_path(Path(file)).as_posix()) for file in declared}
        wanted = [name for name in blobs if _is_tabular(name) and ("/" not in name or alike(name) in declared)]
        self._write(blobs, wanted, target)
        return target if wanted else None

    def _write_extended(self, schema: Path, root: Path) -> None:
        """Write what a contextdb.toml extends, as it is in the commit; what the commit does not have is missed by whoever reads."""
        for _ in range(MOST_EXTENDED):
            extends = extends_of(read_bytes(schema).decode("utf-8", "replace"), str(schema))
            schema = Path(os.path.normpath(schema.parent / (extends or ".")))
            if extends is None or not schema.is_relative_to(root) or schema.exists():
                return
            name = schema.relative_to(root).as_posix()
            code, listed = run_git(self.folder, "ls-tree", "-z", "--full-tree", self.hash, name)
            blobs = dict(_plain_files(listed)) if code == 0 else {}
            if name not in blobs:
                return
            self._write(blobs, [name], root)

    def _write(self, blobs: dict[str, str], names: list[str], target: Path) -> None:
        if not names:
            return
        request = "".join(f"{blobs[name]}\n" for name in names).encode()
        code, out = run_git(self.folder, "cat-file", "--batch", given=request)
        at = 0
        for name in names:
            head, _, _ = out[at : at + 200].partition(b"\n")
            parts = head.split()
            if code != 0 or len(parts) != 3 or parts[1] != b"blob":
                raise ContextDBError(Fault("git does not have the contents of the file.", place=Place(f"{self.ref}:{name}")))
            start = at + len(head) + 1
            raw = out[start : start + int(parts[2])]
            at = start + len(raw) + 1
            if raw.startswith(LFS_POINTER):
                sentence = "the file is a pointer of Git LFS: its contents are not in git."
                raise ContextDBError(Fault(sentence, "--baseline FILE, a report of that commit", place=Place(f"{self.ref}:{name}")))
            path = target.joinpath(*PurePosixPath(name).parts)
            make_folder(path.parent)
            write_atomic(path, raw, syncs=False)


def _lookup(ref: str) -> tuple[str, ...]:
    return "rev-parse", "--verify", "--quiet", "--end-of-options", f"{ref}^{{commit}}"


def _is_no_ref(ref: str) -> bool:
    """Whether no commit can be named so: git would take it for an option, or the system for the end of a text."""
    return not ref.strip() or ref.startswith("-") or not ref.isprintable()


def _plain_files(listed: bytes) -> Iterator[tuple[str, str]]:
    """Name and object of each plain file of a listed tree; a name that could lead elsewhere is passed over."""
    for entry in listed.split(b"\0"):
        about, _, raw_name = entry.partition(b"\t")
        mode, _, blob = about.decode("ascii", "replace").partition(" blob ")
        name = raw_name.decode("utf-8", "surrogateescape")
        parts = name.split("/")
        is_safe = all(part not in ("", ".", "..") and not set(part) & {"\\", ":", "\0"} for part in parts)
        if mode in _PLAIN_FILES and is_safe and not any(alike(part) == ".git" for part in parts):
            yield name, blob


def _is_tabular(name: str) -> bool:
    return name.lower().endswith(TABLE_SUFFIXES)
