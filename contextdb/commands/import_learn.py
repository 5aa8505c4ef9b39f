"""The part of `contextdb import` that learns a table from recorded pairs of facts and an asset."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from contextdb.console import ExitCode, output, printable
from contextdb.covering.shares import format_percent
from contextdb.errors import ContextDBError, Fault, in_quotes, mend_for, plural, safe_text, some
from contextdb.exchange import importing
from contextdb.exchange.learned import Learned, learned
from contextdb.exchange.mapping import as_condition, as_job, propose
from contextdb.exchange.reading import Reading
from contextdb.files.texts import written_over

HERE = Path("learned.csv")
"""A table in the folder here, whose contextdb.toml counts where no other is named."""
MOST_LISTED = 5


def require_learning(arguments: argparse.Namespace) -> None:
    """Refuse --learn and --asset without each other, and an import to nowhere."""
    if arguments.learn != (arguments.asset is not None):
        given, missing = ("--learn", "--asset COLUMN") if arguments.learn else ("--asset", "--learn")
        raise ContextDBError(Fault(f"{given} needs {missing}.", "--learn --asset COLUMN"))
    if arguments.target is None and not arguments.learn:
        raise ContextDBError(Fault("DST is missing.", "a table file to write: .csv or .parquet"))


def learn(reading: Reading, renames: dict[str, str], arguments: argparse.Namespace, name: str) -> ExitCode:
    """Write the table that recorded pairs make, or print it where no file is named; the rest goes to standard error. The code is 1
    where there is nothing to learn."""
    target = HERE if arguments.target is None else Path(arguments.target)
    schema, settings = importing.project_of(target)
    if arguments.asset not in reading.names:
        mend = mend_for(arguments.asset, reading.names)
        raise ContextDBError(Fault(f"--asset: there is no column {in_quotes(arguments.asset)}.", some(reading.names), mend))
    mapped = []
    for column in propose(reading, schema, replace(settings, asset=None), renames):
        if column.source == arguments.asset:
            mapped.append(as_job(column, "asset"))
        elif column.job == "asset":
            mapped.append(as_condition(column, reading.column(column.source), column.name, schema))
        elif column.job == "condition":
            mapped.append(column)
    result = learned(reading, mapped, schema)
    for line in _lines(result, reading, name):
        print(printable(line), file=sys.stderr)
    if not result.is_worth_it:
        return ExitCode.FOUND
    if arguments.target is None:
        columns = result.reading.columns
        raw = written_over(None, columns, np.full(result.reading.n_rows, -1), as_parquet=False).raw
        with output():
            print(raw.decode(), end="")
    elif not arguments.dry_run:
        plan = importing.plan_import(result.reading, target, mapped=result.columns)
        plan.write()
        with output():
            print(printable(f"{target}: {plural(plan.table.n_rows, 'row')} of {plural(len(plan.table.conditions), 'condition')}"))
    return ExitCode.OK


def _lines(result: Learned, reading: Reading, name: str) -> Iterator[str]:
    pairs = plural(result.n_pairs, "pair")
    left_out = f"; {plural(result.n_missing, 'row')} without an asset or with a missing fact left out" if result.n_missing else ""
    yield f"{name}: {pairs} of facts and an asset{left_out}."
    held = f"{format_percent(result.held_out)} of the held-out pairs"
    if not result.is_worth_it:
        always = format_percent(result.baseline)
        yield f"Nothing to learn: the facts tell the asset in {held}, and always the commonest asset is right in {always}."
        return
    yield f"{plural(result.reading.n_rows, 'row')}; rows learned from four of five pairs are right in {held}."
    if result.idle:
        yield f"Without influence, so without a column: {some(result.idle)}."
    if result.n_exceptions:
        yield f"{plural(result.n_exceptions, 'exception')}, where the rows say otherwise than the recording:"
        yield from (f"  {line}" for line in _exceptions(result, reading, result.exceptions[:MOST_LISTED]))
        if result.n_exceptions > MOST_LISTED:
            yield f"  and {result.n_exceptions - MOST_LISTED:,} more"


def _exceptions(result: Learned, reading: Reading, rows: Sequence[int]) -> Iterator[str]:
    for row in rows:
        line = reading.source.line(row) if reading.source is not None else None
        place = f"row {row + 1}" if line is None else f"line {line}"
        facts = " ".join(f"{column.name}={column[row]}" for column in reading.columns)
        yield f"{place}: {safe_text(facts, 200)}"
