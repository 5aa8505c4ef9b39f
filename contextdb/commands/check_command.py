"""Find what is wrong with the tables: unreadable cells, cells that accept nothing, redundant rows, saved contexts that fail, and
contracts that some context breaks.

Exits with 1 if there are findings at the level of --fail-on, with 2 if the path does not exist.

  contextdb check tables/
  contextdb check tables/ --format github --fail-on warning
  contextdb check tables/hit_mid_air.cases.csv
  contextdb check --projects games/
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from contextdb import report
from contextdb.authoring.rows_against_markup import check_against_markup
from contextdb.checks.cases import CaseBar, check_cases, read_cases
from contextdb.checks.contracts import contract_findings, proofs_of, strayed
from contextdb.checks.rows import check_rows, unused_conditions
from contextdb.checks.run import check
from contextdb.commands import add_format_arguments, deliver, is_coloured
from contextdb.commands.numbers import percent, whole_type
from contextdb.commands.progress import Bar, has_many_cells, log_of
from contextdb.console import ExitCode, printable, progress, terminal_width
from contextdb.covering.contracts import Proof
from contextdb.disk import CASES_SUFFIX, TABLE_SUFFIXES, path_in_quotes, read_bytes
from contextdb.errors import ContextDBError, Fault, in_quotes, nearest
from contextdb.files.file_names import alike, composed, confusable, why_unportable
from contextdb.files.texts import read_texts
from contextdb.findings import LEVELS, Finding, Level
from contextdb.report.results import CheckReport, TableSummary
from contextdb.schema.settings import Schema
from contextdb.schema.toml_lines import key_lines
from contextdb.tables import project
from contextdb.tables.expected_file import expected_path, read_situations
from contextdb.tables.gap_work import GapWork
from contextdb.tables.other_files import cases_path, notes_path
from contextdb.tables.places import table_path
from contextdb.tables.table import Table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="PATH", nargs="?", help="a folder of tables, one table or its name, or its cases")
    parser.add_argument("--projects", metavar="ROOT", help="check every project below a folder, and say which fail")
    add_format_arguments(parser, report.formats("check"))
    parser.add_argument(
        "--fail-on", choices=("error", "warning", "none"), default="error", help="the lowest level that fails (default: error)"
    )
    parser.add_argument("--all", action="store_true", help="print every finding, not the first few of each kind")
    number = whole_type("a number of saved contexts, such as 10.")
    parser.add_argument(
        "--min-cases", type=number, default=0, metavar="N", help="fail if a table has fewer saved contexts that expect something"
    )
    share = "fail if they reach a smaller part of the rows of a table"
    parser.add_argument("--min-rows-reached", type=percent, default=0.0, metavar="PCT", help=share)
    parser.add_argument(
        "--propose",
        action="store_true",
        help="print contracts that hold today and are likely meant, and nothing else",
    )


def run(arguments: argparse.Namespace) -> ExitCode:
    """Check one table, a folder of them, or all projects below one."""
    _require_one(arguments)
    if arguments.propose:
        return _propose(arguments)
    bar = CaseBar(arguments.min_cases, arguments.min_rows_reached)
    if arguments.projects is not None:
        return printed(_of_projects(arguments.projects, bar, failing_levels(arguments.fail_on)), arguments)
    return printed(check_path(arguments.path, bar), arguments)


def _require_one(arguments: argparse.Namespace) -> None:
    """Refuse no path, and two; and contracts proposed for many projects."""
    if (arguments.path is None) == (arguments.projects is None) or (arguments.propose and arguments.projects is not None):
        given = "PATH is missing." if arguments.path is None and arguments.projects is None else "--projects ROOT stands by itself."
        raise ContextDBError(Fault(given, "PATH, or --projects ROOT"))


def _of_projects(root: str, bar: CaseBar, failing: Sequence[Level]) -> CheckReport:
    from contextdb.commands.projects_below import ProjectCheck, ProjectsReport, extend_up_to, project_folders

    folders = project_folders(root)
    extend_up_to(root)
    return ProjectsReport.of([ProjectCheck(folder, check_path(str(folder), bar)) for folder in folders], failing)


def failing_levels(fail_on: str) -> tuple[Level, ...]:
    """The levels that fail, by the lowest of them or "none"."""
    return LEVELS[: LEVELS.index(fail_on) + 1] if fail_on != "none" else ()


def _propose(arguments: argparse.Namespace) -> ExitCode:
    """Print the contracts of tables that can be read which hold and are likely meant."""
    from contextdb.checks.proposals import proposal_toml, proposals
    from contextdb.report.render_json import as_json

    path = arguments.path
    is_folder = os.path.isdir(path) or Path(path).name == project.SCHEMA_FILE
    tables = project.Project.load(path).tables.values() if is_folder else [project.load_table(table_path(path))]
    proofs = [proof for table in tables for proof in proposals(table)]
    if arguments.format == "json":
        text = as_json({"format": 1, "proposed": [proof.to_json() | {"toml": proposal_toml(proof.contract)} for proof in proofs]})
    else:
        text = "\n".join(proposal_toml(proof.contract) for proof in proofs)
    deliver(text or "# no contract holds that is likely meant\n", arguments)
    return ExitCode.OK


def printed(checked: CheckReport, arguments: argparse.Namespace) -> ExitCode:
    """Print a report in the wanted format; the code says whether anything in it fails."""
    failing = failing_levels(arguments.fail_on)
    text = report.render(
        arguments.format,
        checked,
        colour=is_coloured(arguments),
        width=terminal_width(),
        shows_all=arguments.all,
        failing=failing,
    )
    deliver(text, arguments)
    return ExitCode.FOUND if any(f.level in failing for f in checked.findings) else ExitCode.OK


def check_path(text: str, bar: CaseBar | None = None) -> CheckReport:
    """Check everything under a path, saved contexts too; what cannot be read at all is a finding. `bar`: of saved contexts."""
    path = Path(text)
    if not os.path.isdir(text) and path.name != project.SCHEMA_FILE:
        file = table_path(text)
        table = _table_of(file) if _is_cases(file) else file
        return CheckReport((), (_stray(file),)) if table is None else _check_files([(None, table)], None, bar)
    folder = project.folder_of(path)
    try:
        schema = project.read_folder_schema(folder)
        files = list(project.table_files(folder, schema))
    except ContextDBError as error:
        return CheckReport((), tuple(_as_findings(error, None)))
    if not files:
        accepted = f"a folder with {project.SCHEMA_FILE} and a .csv or .parquet file for each table"
        return CheckReport(
            (), (Finding("no-tables", "error", f"the folder holds no table. Accepted: {accepted}.", file=str(folder)),)
        )
    report = _check_files(files, schema, bar)
    others = (Finding("not-a-table", "info", sentence, file=str(path)) for path, sentence in project.stray_files(folder, schema))
    strays = _strays(folder, [file for _, file in files])
    return replace(report, findings=(*report.findings, *_unportable(files, schema), *others, *strays))


def _unportable(files: Sequence[tuple[str, Path]], schema: Schema) -> Iterator[Finding]:
    """A finding for every table whose file another system could not have, or would take for another one."""
    others = dict(confusable(str(path) for _, path in files))
    for name, path in files:
        wanted = [Path(one).name for one in (schema.tables[name].files if name in schema.tables else ())]
        declared = next((one for one in wanted if alike(one) == alike(path.name)), path.name)
        messages = [f"{why}." for why in [why_unportable(path.name)] if why]
        if other := others.get(str(path)):
            ignored = "the Unicode form of names" if composed(other) == composed(str(path)) else "case"
            messages.append(f"this and {path_in_quotes(other)} are one file on disks that ignore {ignored}.")
        if composed(declared) != composed(path.name):
            messages.append(
                f"{project.SCHEMA_FILE} calls it {in_quotes(declared)}: there is no such file on disks that distinguish case."
            )
        yield from (Finding("unportable-name", "warning", message, name, str(path)) for message in messages)


def _check_files(files: Sequence[tuple[str | None, Path]], schema: Schema | None = None, bar: CaseBar | None = None) -> CheckReport:
    """Check some tables; `schema` is given when they are all of its folder."""
    tables: list[TableSummary] = []
    read: list[Table] = []
    proofs: list[Proof] = []
    findings = [Finding.of(fault) for fault in project.twice_named((name, path) for name, path in files if name is not None)]
    for name, path in progress(files, "checking"):
        try:
            table = project.load_table(path, strict=False)
        except ContextDBError as error:
            findings += _as_findings(error, name)
            continue
        tables.append(TableSummary(table.name, str(path), table.n_rows, len(table.conditions)))
        read.append(table)
        log = log_of(f"checking {printable(table.name)}", has_many_cells(table))
        if log is not None:
            log(0, 1, "Reading rows")
        findings += check(table)
        tell = None if log is None else partial(_tell, log)
        findings += check_rows(table, progress=tell)
        proofs += proofs_of(table, tell)
        findings += _check_cases(table, cases_path(path), bar or CaseBar())
        findings += [*_check_notes(table, notes_path(path)), *_check_expected(table)]
    if schema is not None:
        names = [name for name, _ in files if name is not None]
        proofs += strayed(schema, names, [name for name in names if name not in {table.name for table in read}])
    known = schema or next((table.schema for table in read), None)
    if known is not None and known.file:
        lines = key_lines(read_bytes(Path(known.file)).decode("utf-8-sig"))
        findings += contract_findings(proofs, read, known, lines)
        findings += unused_conditions(known, read, lines) if schema is not None and len(read) == len(files) else []
        findings += check_against_markup(read, Path(known.file).parent)
    return CheckReport(tuple(tables), tuple(findings), tuple(proofs))


def _tell(progress: Bar, part: str, share: float) -> None:
    progress(int(1000 * share), 1000, part)


def _check_cases(table: Table, path: Path, bar: CaseBar) -> list[Finding]:
    try:
        cases = read_cases(path)
        return [*check_cases(table, cases, str(path)), *bar.findings(table, cases, str(table.path) if table.path else None)]
    except ContextDBError as error:
        return _as_findings(error, table.name)


def _check_expected(table: Table) -> list[Finding]:
    """What is wrong in the file of the contexts that are expected of a table."""
    if table.settings.expected is None or table.faults:
        return []
    try:
        path = expected_path(table)
        if path is not None:
            read_situations(path, [column.condition for column in table.flat().conditions])
    except ContextDBError as error:
        return _as_findings(error, table.name)
    return []


def _check_notes(table: Table, path: Path) -> list[Finding]:
    """A finding for notes, or work on gaps, that cannot be read, such as between git's marks: nobody would see any of it."""
    try:
        if path.is_file():
            read_texts(path)
        if table.path is not None:
            GapWork.beside(table.path)
    except ContextDBError as error:
        return _as_findings(error, table.name)
    return []


def _strays(folder: Path, tables: Sequence[Path]) -> Iterator[Finding]:
    """A finding for every file of cases next to the tables that is none of theirs."""
    taken = {os.path.abspath(cases_path(table)) for table in tables}
    for folder_near in sorted({folder, *(table.parent for table in tables if table.parent.is_dir())}):
        for path in sorted(folder_near.iterdir()):
            if _is_cases(path) and path.is_file() and os.path.abspath(path) not in taken:
                taken.add(os.path.abspath(path))
                yield _stray(path)


def _stray(path: Path) -> Finding:
    stem = path.name[: -len(CASES_SUFFIX)]
    stems = [p.stem for p in path.parent.iterdir() if _is_table(p)]
    near = nearest(stem, stems)
    mend = f" Did you mean {in_quotes(near + CASES_SUFFIX)}?" if near else ""
    accepted = " or ".join(in_quotes(stem + suffix) for suffix in TABLE_SUFFIXES)
    message = f"its cases cannot be evaluated: there is no table next to it. Accepted: {accepted}.{mend}"
    return Finding("unreadable-case", "error", message, file=str(path))


def _table_of(cases: Path) -> Path | None:
    """The table that a file of cases belongs to."""
    return next((p for p in sorted(cases.parent.iterdir()) if _is_table(p) and cases_path(p) == cases), None)


def _is_cases(path: Path) -> bool:
    return path.name.lower().endswith(CASES_SUFFIX) and not path.name.startswith(".")


def _is_table(path: Path) -> bool:
    return path.suffix.lower() in TABLE_SUFFIXES and not _is_cases(path)


def _as_findings(error: ContextDBError, table: str | None) -> list[Finding]:
    return [Finding.of(fault if isinstance(fault, Fault) else Fault(str(fault)), "error", table) for fault in error.faults]
