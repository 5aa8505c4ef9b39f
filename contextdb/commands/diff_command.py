"""Show what changed between two versions of a table: rows by asset, columns, and cells, with changes of text alone listed apart.

Exits with 0 if nothing changed, with 1 if something did, with 2 if a table cannot be read.

  contextdb diff old/hit_mid_air.csv tables/hit_mid_air.csv
  contextdb diff a.csv b.csv --format markdown
"""

from __future__ import annotations

import argparse
import sys

from contextdb.checks.effects import Effects
from contextdb.commands import add_format_arguments
from contextdb.commands.diff_views import as_markdown, as_text, effects_json, effects_markdown, effects_text
from contextdb.console import ExitCode, output, wants_colour
from contextdb.edits.diffing import Diff, diff
from contextdb.errors import ContextDBError, Fault
from contextdb.report.render_json import as_json
from contextdb.tables.nesting.names import inner_name
from contextdb.tables.places import table_path
from contextdb.tables.project import load_table

FORMATS = ("text", "markdown", "json")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("before", metavar="A", help="the table as it was: a .csv or .parquet file, or the name of a table")
    parser.add_argument("after", metavar="B", help="the table as it is")
    add_format_arguments(parser, FORMATS)
    parser.add_argument("--no-effects", action="store_false", dest="effects", help="leave out the effects of the change")
    parser.add_argument("--all", action="store_true", help="print every difference, not the first of each kind")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Compare two tables. Cells that cannot be read are compared as texts."""
    before, after = (load_table(table_path(text), strict=False) for text in (arguments.before, arguments.after))
    found = diff(before, after)
    effect = _effects(found) if arguments.effects and _may_matter(found) else None
    text = _rendered(found, effect, arguments)
    with output():
        print(text, end="")
    return ExitCode.FOUND if found else ExitCode.OK


def _may_matter(found: Diff) -> bool:
    """Whether more changed than how things are written and where they are."""
    is_other_rows = found.rows_added or found.rows_removed or found.columns_added or found.columns_removed or found.columns_renamed
    names_tables = any(inner_name(text) is not None for row in found.rows_renamed for text in (row.before, row.after))
    return bool(is_other_rows or found.n_changed or names_tables)


def _effects(found: Diff) -> Effects | Fault:
    """What the change does, or why that cannot be reported."""
    from contextdb.checks.effects import effects

    try:
        return effects(found.before, found.after, changes=found)
    except ContextDBError as error:
        return error.faults[0]


def _rendered(found: Diff, effect: Effects | Fault | None, arguments: argparse.Namespace) -> str:
    if arguments.format == "json":
        return as_json(found.to_json() | {"effects": effects_json(effect)})
    if arguments.format == "markdown":
        return as_markdown(found, arguments.all, effects_markdown(effect, arguments.all))
    colour = wants_colour(sys.stdout)
    return as_text(found, colour, arguments.all) + effects_text(effect, colour, arguments.all)
