"""What changed between two versions of a table: rows by asset, columns, and cells, those of meaning apart from those of writing.

Exits with 0 when nothing did, with 1 when something did, with 2 when a table cannot be read.

  contextdb diff old/hit_mid_air.csv tables/hit_mid_air.csv
  contextdb diff a.csv b.csv --format markdown
"""

from __future__ import annotations

import argparse
import sys

from contextdb.commands.diff_views import as_markdown, as_text
from contextdb.console import output, wants_colour
from contextdb.diff import Diff, diff
from contextdb.exit_codes import ExitCode
from contextdb.places import table_path
from contextdb.project import load_table
from contextdb.report.render_json import as_json

FORMATS = ("text", "markdown", "json")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the command."""
    parser.add_argument("before", metavar="A", help="the table as it was: a .csv or .parquet file, or the name of a table")
    parser.add_argument("after", metavar="B", help="the table as it is")
    parser.add_argument("--format", choices=FORMATS, default="text", metavar="FORMAT", help=f"{', '.join(FORMATS)} (default: text)")
    parser.add_argument("--json", action="store_const", const="json", dest="format", help="the same as --format json")
    parser.add_argument("--all", action="store_true", help="print every difference, not the first of each kind")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Compare two tables. Cells that cannot be read are compared as texts."""
    before, after = (load_table(table_path(text), strict=False) for text in (arguments.before, arguments.after))
    found = diff(before, after)
    text = _rendered(found, arguments)
    with output():
        print(text, end="")
    return ExitCode.FOUND if found else ExitCode.OK


def _rendered(found: Diff, arguments: argparse.Namespace) -> str:
    if arguments.format == "json":
        return as_json(found.to_json())
    if arguments.format == "markdown":
        return as_markdown(found, arguments.all)
    return as_text(found, wants_colour(sys.stdout), arguments.all)
