"""Show what changed between two versions of a table: rows by asset, columns, and cells, with changes of text alone listed apart.

Exits with 0 if nothing changed, with 1 if something did, with 2 if a table cannot be read. With --telemetry both versions are
asked in every recorded moment; with --max-changed or --max-emptied only these decide between 0 and 1.

  contextdb diff old/hit_mid_air.csv tables/hit_mid_air.csv
  contextdb diff a.csv b.csv --format html -o review.html
  contextdb diff a.csv b.csv --telemetry "play/*.parquet" --max-emptied 0.1
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING

from contextdb.checks.effects import Effects
from contextdb.commands import add_format_arguments, deliver, is_coloured
from contextdb.commands.diff_views import as_markdown, as_text, effects_json, effects_markdown, effects_text, look_first
from contextdb.commands.numbers import percent
from contextdb.console import ExitCode
from contextdb.edits.diffing import Diff, diff
from contextdb.errors import ContextDBError, ContextError, Fault
from contextdb.report.render_json import as_json
from contextdb.report.render_markdown import escaped
from contextdb.tables.nesting.names import inner_name
from contextdb.tables.places import table_path
from contextdb.tables.project import load_table
from contextdb.tables.table import Table

if TYPE_CHECKING:
    from contextdb.commands.diff_backtest import RepeatedSession, Replayed

ENGINES = ("local", "dask")
FORMATS = ("text", "markdown", "json", "html")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("before", metavar="A", help="the table as it was: a .csv or .parquet file, or the name of a table")
    parser.add_argument("after", metavar="B", help="the table as it is")
    add_format_arguments(parser, FORMATS)
    parser.add_argument("--no-effects", action="store_false", dest="effects", help="leave out the effects of the change")
    group = parser.add_argument_group("recorded moments")
    group.add_argument("--telemetry", action="append", metavar="GLOB", help="files of recorded contexts; may be repeated")
    group.add_argument("--max-changed", type=percent, metavar="PERCENT", help="fail if the answer changes in more of the moments")
    group.add_argument("--max-emptied", type=percent, metavar="PERCENT", help="fail if more of the moments are left without a row")
    group.add_argument("--count", metavar="COLUMN", help="the column that says how often each moment was seen")
    group.add_argument("--character", metavar="COLUMN", help="the column that says whose moment it is")
    group.add_argument("--time", metavar="COLUMN", help="the column of seconds: changes are counted per character and minute")
    group.add_argument("--engine", choices=ENGINES, default="local", help="read files here, or on Dask workers (default: local)")
    group.add_argument("--scheduler", metavar="ADDRESS", help="the Dask scheduler; without it, workers on this machine")
    motion = parser.add_argument_group("recorded sessions of motion")
    motion.add_argument("--session", action="append", metavar="GLOB", help="repeat their searches with both; may be repeated")
    motion.add_argument("--project", metavar="FOLDER", help="the project of the sessions, where they do not say")
    parser.add_argument("--all", action="store_true", help="print every difference, not the first of each kind")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Compare two tables. Cells that cannot be read are compared as texts."""
    require_moments(arguments)
    before, after = (load_table(table_path(text), strict=False) for text in (arguments.before, arguments.after))
    changes = diff(before, after)
    effect = _effects(changes) if arguments.effects and _may_matter(changes) else None
    replayed = None
    if arguments.telemetry:
        from contextdb.commands.diff_backtest import replayed_moments

        replayed = replayed_moments(arguments, before, after, effect)
    text = _rendered(changes, effect, replayed, arguments, _sessions(arguments, before, after))
    deliver(text, arguments)
    if replayed is not None and replayed.gates:
        return ExitCode.OK if all(gate.passed for gate in replayed.gates) else ExitCode.FOUND
    return ExitCode.FOUND if changes else ExitCode.OK


def _sessions(arguments: argparse.Namespace, before: Table, after: Table) -> list[RepeatedSession]:
    if not arguments.session:
        return []
    from contextdb.commands.diff_backtest import repeated_sessions

    return repeated_sessions(arguments.session, arguments.project, before, after)


def require_moments(arguments: argparse.Namespace) -> None:
    """Refuse options about recorded moments where there are none."""
    if arguments.telemetry:
        return
    for option in ("max_changed", "max_emptied", "count", "character", "time", "scheduler"):
        if getattr(arguments, option) is not None:
            sentence = f"--{option.replace('_', '-')} is about recorded moments."
            raise ContextError(Fault(sentence, "--telemetry GLOB with it"))


def _may_matter(changes: Diff) -> bool:
    """Whether more changed than how things are written and where they are."""
    is_other_rows = (
        changes.rows_added or changes.rows_removed or changes.columns_added or changes.columns_removed or changes.columns_renamed
    )
    names_tables = any(inner_name(text) is not None for row in changes.rows_renamed for text in (row.before, row.after))
    return bool(is_other_rows or changes.n_changed or names_tables)


def _effects(changes: Diff) -> Effects | Fault:
    """What the change does, or why that cannot be reported."""
    from contextdb.checks.effects import effects

    try:
        return effects(changes.before, changes.after, changes=changes)
    except ContextDBError as error:
        return error.faults[0]


def _rendered(
    changes: Diff,
    effect: Effects | Fault | None,
    replayed: Replayed | None,
    arguments: argparse.Namespace,
    sessions: Sequence[RepeatedSession],
) -> str:
    lines = [line for session in sessions for line in session.lines]
    if arguments.format == "json":
        more = {} if replayed is None else replayed.to_json()
        more |= {"sessions": [session.to_json() for session in sessions]} if sessions else {}
        return as_json(
            changes.to_json() | {"look_first": next(iter(look_first(effect)), None), "effects": effects_json(effect)} | more
        )
    if arguments.format == "html":
        from contextdb.commands.diff_page import as_page

        return as_page(changes, effect, replayed, lines)
    if arguments.format == "markdown":
        below = "" if replayed is None else replayed.markdown
        below += "".join(f"\n- {escaped(line)}" for line in lines) + "\n" if lines else ""
        return as_markdown(changes, arguments.all, effects_markdown(effect, arguments.all) + below, look_first(effect))
    colour = is_coloured(arguments)
    below = "" if replayed is None else replayed.text(colour, arguments.all)
    below += "\nsessions\n" + "".join(f"  {line}\n" for line in lines) if lines else ""
    return as_text(changes, colour, arguments.all, look_first(effect)) + effects_text(effect, colour, arguments.all) + below
