"""What is wrong with the tables: cells that cannot be read, empty cells, identical rows, undeclared conditions.

Exits with 1 when there are findings at the level of --fail-on, with 2 when there is no such path.

  contextdb check tables/
  contextdb check tables/ --format github --fail-on warning
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from contextdb import report
from contextdb.check import check
from contextdb.console import output, progress, terminal_width, wants_colour
from contextdb.errors import ContextDBError, Fault
from contextdb.exit_codes import ExitCode
from contextdb.findings import LEVELS, Finding
from contextdb.places import table_path
from contextdb.project import SCHEMA_FILE, folder_of, load_table, read_folder_schema, table_files, twice_named
from contextdb.report.results import CheckReport, TableSummary


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the command."""
    parser.add_argument("path", metavar="PATH", help="a folder of tables, or one table")
    formats = ", ".join(report.FORMATS)
    parser.add_argument("--format", choices=report.FORMATS, default="text", metavar="FORMAT", help=f"{formats} (default: text)")
    parser.add_argument("--json", action="store_const", const="json", dest="format", help="the same as --format json")
    parser.add_argument(
        "--fail-on", choices=("error", "warning", "none"), default="error", help="the level that fails (default: error)"
    )
    parser.add_argument("--all", action="store_true", help="print every finding, not the first few of each kind")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Check one table or a folder of them."""
    found = check_path(arguments.path)
    failing = LEVELS[: LEVELS.index(arguments.fail_on) + 1] if arguments.fail_on != "none" else ()
    text = report.render(
        arguments.format,
        found,
        colour=wants_colour(sys.stdout),
        width=terminal_width(),
        shows_all=arguments.all,
        failing=failing,
    )
    with output():
        print(text, end="")
    return ExitCode.FOUND if any(f.level in failing for f in found.findings) else ExitCode.OK


def check_path(text: str) -> CheckReport:
    """Check everything under a path; what cannot be read at all is a finding too."""
    path = Path(text)
    if not os.path.isdir(text) and path.name != SCHEMA_FILE:
        return _check_files([(None, table_path(text))])
    folder = folder_of(path)
    try:
        files = list(table_files(folder, read_folder_schema(folder)))
    except ContextDBError as error:
        return CheckReport((), tuple(_as_findings(error, None)))
    if not files:
        accepted = f"a folder with {SCHEMA_FILE} and a .csv or .parquet file for each table"
        return CheckReport(
            (), (Finding("no-tables", "error", f"the folder holds no table. Accepted: {accepted}.", file=str(folder)),)
        )
    return _check_files(files)


def _check_files(files: Sequence[tuple[str | None, Path]]) -> CheckReport:
    tables: list[TableSummary] = []
    findings = [Finding.of(fault) for fault in twice_named((name, path) for name, path in files if name is not None)]
    for name, path in progress(files, "checking"):
        try:
            table = load_table(path, strict=False)
        except ContextDBError as error:
            findings += _as_findings(error, name)
            continue
        tables.append(TableSummary(table.name, str(path), table.n_rows, len(table.conditions)))
        findings += check(table)
    return CheckReport(tuple(tables), tuple(findings))


def _as_findings(error: ContextDBError, table: str | None) -> list[Finding]:
    return [Finding.of(fault if isinstance(fault, Fault) else Fault(str(fault)), "error", table) for fault in error.faults]
