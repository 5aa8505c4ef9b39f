"""Write the binary artefact for the game: .safetensors, opened there by memory map.

Prints the path of each file that was written. --stubs also writes the facts of all these tables as Python types, for completion
in editors and for type checkers.

  contextdb compile tables/                  one artefact beside each table
  contextdb compile tables/ -o build/        all of them into a folder
  contextdb compile tables/hit_mid_air.csv -o hit_mid_air.safetensors
  contextdb compile tables/ -o build/ --stubs game/facts.py
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path, PurePath

from contextdb.artefact import SUFFIX
from contextdb.console import output, printable, progress
from contextdb.disk import make_folder, path_in_quotes, write_atomic
from contextdb.errors import ContextDBError, Fault, FileError, Place, plural
from contextdb.exit_codes import ExitCode
from contextdb.places import table_path
from contextdb.project import SCHEMA_FILE, Project, load_table
from contextdb.stubs import stubs_of
from contextdb.table import Table

SEPARATORS = ("/", "\\")
STUB_SUFFIXES = (".py", ".pyi")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the command."""
    parser.add_argument("path", metavar="PATH", help="a folder of tables, or one table")
    parser.add_argument("-o", "--out", metavar="FILE", help="the artefact, or a folder for several (default: beside each table)")
    parser.add_argument("--stubs", metavar="FILE", help="also write the facts of the tables as Python types: a .py or .pyi file")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Compile one table or a folder of them; prints the path of each file."""
    stubs = None if arguments.stubs is None else _stubs_target(arguments.stubs)
    tables = _tables(arguments.path)
    targets = [_target(table, arguments.out, len(tables)) for table in tables]
    _require_different(targets)
    for table, target in progress(list(zip(tables, targets, strict=True)), "compiling"):
        compiled = table.compile()
        make_folder(target.parent)
        compiled.save(target)
        _print_path(target)
        size = f"{plural(table.n_rows, 'row')}, {plural(len(table.conditions), 'condition')}, {compiled.nbytes:,} bytes of masks"
        print(printable(f"{table.name}: {size}"), file=sys.stderr)
    if stubs is not None:
        make_folder(stubs.parent)
        write_atomic(stubs, stubs_of({table.name: table.compile() for table in tables}).encode("utf-8"))
        _print_path(stubs)
    return ExitCode.OK


def _print_path(path: Path) -> None:
    with output():
        print(printable(str(path)))


def _stubs_target(text: str) -> Path:
    path = Path(text)
    if path.suffix in STUB_SUFFIXES and not text.endswith(SEPARATORS) and not os.path.isdir(text):
        return path
    mend = "" if os.path.isdir(text) or text.endswith(SEPARATORS) else path_in_quotes(path.with_suffix(".py"))
    raise FileError(Fault("this is no name of a Python file.", "a name that ends in .py or .pyi", mend, Place(text)))


def _tables(text: str) -> list[Table]:
    if os.path.isdir(text) or Path(text).name == SCHEMA_FILE:
        tables = list(Project.load(text).tables.values())
        if not tables:
            raise ContextDBError(Fault("the folder holds no table.", "a folder with .csv or .parquet files", place=Place(text)))
        return tables
    return [load_table(table_path(text))]


def _target(table: Table, out: str | None, n_tables: int) -> Path:
    assert table.path is not None
    if out is None:
        return table.path.with_suffix(SUFFIX)
    is_artefact = Path(out).suffix == SUFFIX and not out.endswith(SEPARATORS) and not os.path.isdir(out)
    if is_artefact and n_tables > 1:
        raise FileError(Fault(f"{n_tables} tables do not go into one artefact.", "a folder", place=Place(out)))
    if is_artefact:
        return Path(out)
    if n_tables > 1 or out.endswith(SEPARATORS) or os.path.isdir(out):
        is_file_name = PurePath(table.name).name == table.name and not any(c in table.name for c in SEPARATORS)
        return Path(out) / f"{table.name if is_file_name else table.path.stem}{SUFFIX}"
    mend = path_in_quotes(Path(out).with_suffix(SUFFIX))
    raise FileError(Fault("this is no name of an artefact.", f"a name that ends in {SUFFIX}, or a folder", mend, Place(out)))


def _require_different(targets: list[Path]) -> None:
    twice = sorted({str(t) for t in targets if targets.count(t) > 1})
    if twice:
        raise ContextDBError(
            *(Fault("two tables would be written to one file.", "one file for each table", place=Place(t)) for t in twice)
        )
