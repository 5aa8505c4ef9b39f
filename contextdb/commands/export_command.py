"""Export a table for other programs: CSV, TSV, Excel, Parquet, JSON, DMN, Unreal. The suffix of DST or --as selects the format.

Reports, with its place, what the format cannot hold. A workbook keeps the settings in contextdb.toml of the table, so importing it
again loses nothing.

  contextdb export tables/hit_mid_air.csv moves.xlsx
  contextdb export hit_mid_air moves.json
  contextdb export hit_mid_air - --as tsv | pbcopy
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from contextdb.console import ExitCode, output, printable
from contextdb.disk import is_stream, write_atomic
from contextdb.edits.notes import NO_NOTES, Notes
from contextdb.errors import Fault, FileError, Place, plural
from contextdb.exchange.formats import FORMATS, format_of, write
from contextdb.tables.places import table_path
from contextdb.tables.project import load_table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("source", metavar="SRC", help="a table file, or the name of a table")
    parser.add_argument("target", metavar="DST", help="the file to write; - for standard output")
    names = [name for name, one in FORMATS.items() if one.is_written]
    parser.add_argument("--as", dest="format", metavar="FORMAT", choices=names, help=f"the format of DST: {', '.join(names)}")
    help_text = (
        "cells of CSV and TSV that a spreadsheet may run as formulas: report them, keep them, or put ' before each (default: tell)"
    )
    parser.add_argument("--formulas", choices=("tell", "keep", "quote"), default="tell", help=help_text)
    parser.add_argument("--force", action="store_true", help="overwrite an existing file")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Write one table; what could not be written is reported on standard error."""
    is_standard = arguments.target == "-"
    if is_standard and arguments.format is None:
        raise FileError(Fault("standard output has no suffix that gives a format.", "--as with a format", "--as tsv"))
    kind = format_of(arguments.target, arguments.format, for_writing=True)
    if not is_standard and os.path.exists(arguments.target) and not (arguments.force or is_stream(Path(arguments.target))):
        raise FileError(Fault("the file already exists.", "a new name, or --force to write over it", place=Place(arguments.target)))
    table = load_table(table_path(arguments.source), strict=False)
    notes = Notes.beside(table.path) if table.path is not None else NO_NOTES
    raw, remarks = write(table, kind, arguments.formulas, notes)
    for remark in remarks:
        print(printable(f"{table.name}: {remark}"), file=sys.stderr)
    if is_standard:
        with output():
            sys.stdout.flush()
            sys.stdout.buffer.write(raw)
        return ExitCode.OK
    write_atomic(Path(arguments.target), raw)
    print(printable(arguments.target))
    n_left_out = sum(remark.n_left_out for remark in remarks)
    written = f"{table.n_rows - n_left_out:,} of " if n_left_out else ""
    summary = f"{table.name}: {written}{plural(table.n_rows, 'row')} as {kind.about.split(';')[0]}, {len(raw):,} bytes"
    print(printable(summary), file=sys.stderr)
    return ExitCode.OK
