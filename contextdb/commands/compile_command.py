"""Write the binary artefact for the game: .safetensors, opened there by memory map.

contextdb compile tables/                  one artefact beside each table
contextdb compile tables/ -o build/        all of them into a folder
contextdb compile tables/hit_mid_air.csv -o hit_mid_air.safetensors
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from contextdb.artefact import SUFFIX
from contextdb.console import progress
from contextdb.errors import ContextDBError, Fault, Place
from contextdb.exit_codes import ExitCode
from contextdb.places import table_path
from contextdb.project import Project, load_table
from contextdb.table import Table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the command."""
    parser.add_argument("path", metavar="PATH", help="a folder of tables, or one table")
    parser.add_argument("-o", "--out", metavar="FILE", help="the artefact, or a folder for several (default: beside each table)")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Compile one table or a folder of them; prints the path of each artefact."""
    tables = _tables(arguments.path)
    targets = [_target(table, arguments.out, len(tables)) for table in tables]
    _require_different(targets)
    for table, target in progress(list(zip(tables, targets, strict=True)), "compiling"):
        compiled = table.compile()
        target.parent.mkdir(parents=True, exist_ok=True)
        compiled.save(target)
        print(target)
        print(
            f"{table.name}: {table.n_rows} rows, {len(table.conditions)} conditions, {compiled.nbytes:,} bytes of masks",
            file=sys.stderr,
        )
    return ExitCode.OK


def _tables(text: str) -> list[Table]:
    if Path(text).is_dir():
        tables = list(Project.load(text).tables.values())
        if not tables:
            raise ContextDBError(Fault("the folder holds no table.", "a folder with .csv or .parquet files", place=Place(text)))
        return tables
    return [load_table(table_path(text))]


def _target(table: Table, out: str | None, n_tables: int) -> Path:
    assert table.path is not None
    if out is None:
        return table.path.with_suffix(SUFFIX)
    if n_tables > 1 or out.endswith(("/", "\\")) or Path(out).is_dir():
        return Path(out) / f"{table.name}{SUFFIX}"
    if Path(out).suffix != SUFFIX:
        raise ContextDBError(
            Fault(f"the artefact cannot be {out}.", f"a name that ends in {SUFFIX}", f'"{Path(out).with_suffix(SUFFIX)}"')
        )
    return Path(out)


def _require_different(targets: list[Path]) -> None:
    twice = sorted({str(t) for t in targets if targets.count(t) > 1})
    if twice:
        raise ContextDBError(
            *(Fault("two tables would be written to one file.", "one file for each table", place=Place(t)) for t in twice)
        )
