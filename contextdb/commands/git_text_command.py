"""Print a table as lines: each asset, then its cells that are not empty. Git compares these lines in `git diff` and `git log -p`.

A file that is not a table is printed as it is.

  contextdb git text tables/hit_mid_air.csv
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator

from contextdb.console import ExitCode, output, printable
from contextdb.disk import read_bytes
from contextdb.errors import TableError
from contextdb.tables.merging.merging import table_of
from contextdb.tables.table import Table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="a .csv or .parquet file, under any name that git gives it")


def run(arguments: argparse.Namespace) -> ExitCode:
    raw = read_bytes(arguments.file)
    try:
        table = table_of(Table, raw, arguments.file)
    except TableError:  # in the middle of a merge, say; git diff must go on
        with output():
            sys.stdout.flush()
            sys.stdout.buffer.write(raw)
        return ExitCode.OK
    with output():
        sys.stdout.writelines(f"{line}\n" for line in _lines(table))
    return ExitCode.OK


def _lines(table: Table) -> Iterator[str]:
    asset = table.asset_column
    columns = [c for c in table.columns if c.name != asset]
    for row, name in enumerate(table.assets):
        yield printable(name.strip()) or "(no name)"
        for column in columns:
            if column[row].strip():
                yield f"  {printable(column.name)}: {printable(column[row])}"
