"""Show a table with fewer cells that gives the same answers: rows of one asset join, and cells that exclude nothing become Any.

Valid assets, picks and their chances stay the same in every context that can happen, which is proved before anything is shown.
Exits with 1 if there is something to tidy and --write is not given, with 0 if there is not, or it was written.

  contextdb tidy tables/locomotion.csv
  contextdb tidy locomotion --write
"""

from __future__ import annotations

import argparse

from contextdb.checks.tidying import tidied
from contextdb.commands import add_format_arguments, deliver, is_coloured
from contextdb.commands.diff_views import as_markdown, as_text
from contextdb.console import ExitCode, note, printable
from contextdb.edits.diffing import diff
from contextdb.errors import plural
from contextdb.report.render_json import as_json
from contextdb.tables.places import table_path
from contextdb.tables.project import load_table
from contextdb.tables.table import Table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("table", metavar="TABLE", help="a .csv or .parquet file, or the name of a table")
    parser.add_argument("--write", action="store_true", help="write the table; only lines that change are rewritten")
    add_format_arguments(parser, ("text", "markdown", "json"))
    parser.add_argument("--all", action="store_true", help="print every difference, not the first of each kind")


def run(arguments: argparse.Namespace) -> ExitCode:
    before = load_table(table_path(arguments.table))
    after = tidied(before)
    changes = diff(before, after)
    cells = {"before": n_cells(before), "after": n_cells(after)}
    if arguments.format == "json":
        text = as_json(changes.to_json() | {"cells_saying_something": cells, "written": bool(arguments.write and changes)})
    elif not changes:
        text = printable(f"{before.name}: no row or cell can be left out.") + "\n"
    elif arguments.format == "markdown":
        text = as_markdown(changes, arguments.all)
    else:
        text = as_text(changes, is_coloured(arguments), arguments.all)
        text += f"\n{plural(cells['before'], 'cell')} that say something become {cells['after']:,}, with the same answers.\n"
    if arguments.write and changes:
        after.save()
    deliver(text, arguments)
    if changes and not arguments.write:
        note("--write writes it.")
    return ExitCode.FOUND if changes and not arguments.write else ExitCode.OK


def n_cells(table: Table) -> int:
    """How many cells of conditions are not Any."""
    return sum(not column.cells[int(code)].is_any for column in table.conditions for code in column.texts.codes.tolist())
