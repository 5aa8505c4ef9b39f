"""Import a table from another program into a folder of tables: CSV in any dialect, TSV, Excel, Parquet, JSON, DMN, Unreal.

Columns are matched with the conditions that contextdb.toml declares. For others the command infers a type from their cells, and
declares it there with the new table. It prints its decisions and their reasons; --dry-run writes nothing else. What the options
say is remembered in the folder for the next file of that name, numbers in it apart: --again imports that one alike.

--learn takes a recording, a row for each moment, and makes the fewest rows that say in each the asset of --asset. Without DST the
table is printed. It exits with 1 if the facts do not tell the asset.

  contextdb import moves.xlsx tables/moves.csv --dry-run
  contextdb import moves.xlsx tables/moves.csv --sheet Moves --map Sped=speed --map Notes=
  contextdb import german.csv tables/jog.csv --decimal comma --type heading=angle
  contextdb import takedowns_W13.xlsx tables/takedowns.csv --again --force
  pbpaste | contextdb import - tables/pasted.csv --as tsv
  contextdb import machine_log.parquet tables/moves.csv --learn --asset played --map time=
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from contextdb.cells.kinds import KINDS
from contextdb.console import ExitCode, aligned, output, printable
from contextdb.covering.report import format_percent
from contextdb.disk import TABLE_SUFFIXES, is_stream, path_in_quotes, read_bytes
from contextdb.errors import (
    ContextDBError,
    Fault,
    FileError,
    Place,
    in_quotes,
    mend_for,
    nearest,
    plural,
    row_name,
    safe_text,
    some,
)
from contextdb.exchange import importing
from contextdb.exchange.formats import FORMATS, ReadOptions, read
from contextdb.exchange.importing import Choices, choices_of, chosen_columns, remember
from contextdb.exchange.learned import Learned, learned
from contextdb.exchange.mapping import JOBS, Mapped, as_condition, as_job, as_type, propose
from contextdb.exchange.reading import Reading, listed, with_intervals
from contextdb.files.file_names import require_new_table_name
from contextdb.files.texts import written_over
from contextdb.schema.shapes import KIND_SYNONYMS
from contextdb.tables.project import SCHEMA_FILE

DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", "bar": "|"}
LARGE_BYTES, LARGE_CELLS, LARGE_COLUMNS = 10_000_000, 1_000_000, 2_000
"""From such a size on an import takes seconds, and says what it is at."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("source", metavar="SRC", help="the file to import; - for standard input")
    parser.add_argument("target", metavar="DST", nargs="?", help="the table file to write: .csv or .parquet, in a folder of tables")
    names = [name for name, one in FORMATS.items() if one.is_read]
    parser.add_argument("--as", dest="format", metavar="FORMAT", choices=names, help=f"the format of SRC: {', '.join(names)}")
    parser.add_argument(
        "--sheet",
        metavar="NAME",
        help="a sheet of a workbook, or cells (Moves!A1:F20, A5:F to the last row); a decision of a DMN file",
    )
    parser.add_argument(
        "--map", metavar="COLUMN=NAME", action="append", default=[], help="the name of a column in the table; COLUMN= leaves it out"
    )
    parser.add_argument(
        "--type", metavar="NAME=TYPE", action="append", default=[], help="the type of a new condition, or output, priority, …"
    )
    parser.add_argument("--encoding", help="the encoding of a text file (default: detected)")
    between = f"the delimiter between fields: {', '.join(DELIMITERS)} (default: detected)"
    parser.add_argument("--delimiter", metavar="NAME", choices=DELIMITERS, help=between)
    parser.add_argument(
        "--decimal", choices=("comma", "point"), help="the decimal sign of the file (default: detected from its cells)"
    )
    whole = "whether Mid Air is one name (whole) or two (words), in new columns (default: whole, except in our own workbooks)"
    parser.add_argument("--names", choices=importing.NAMES, help=whole)
    pairs = "whether Speed min and Speed max become one interval (joined) or stay two columns (apart) (default: joined)"
    parser.add_argument("--pairs", choices=("joined", "apart"), help=pairs)
    parser.add_argument(
        "--again", action="store_true", help="as a file of this name was last imported here; other options go first"
    )
    parser.add_argument("--dry-run", action="store_true", help="write nothing")
    parser.add_argument("--force", action="store_true", help="overwrite an existing table")
    group = parser.add_argument_group("learning")
    group.add_argument("--learn", action="store_true", help="SRC is a recording: make the fewest rows that say the same")
    group.add_argument("--asset", metavar="COLUMN", help="the column of the recording that names what was played")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Read, decide, say what was decided, write."""
    require_learning(arguments)
    target = None if arguments.target is None else _target(arguments.target, arguments.force or arguments.dry_run)
    before = _before(arguments, target)
    raw, name = _bytes(arguments.source)
    if len(raw) >= LARGE_BYTES:
        _say(name, f"reading {len(raw) / 1e6:,.0f} MB …")
    reading = read(raw, name, _options(arguments))
    is_large = reading.n_rows * len(reading.columns) >= LARGE_CELLS or len(reading.columns) >= LARGE_COLUMNS
    if is_large:
        size = f"{plural(reading.n_rows, 'row')} of {plural(len(reading.columns), 'column')}"
        _say(name, f"{size} read; finding the type of each column …")
    for remark in reading.remarks:
        print(printable(f"{name}: {remark}"), file=sys.stderr)
    if arguments.learn or target is None:
        return learn(reading, _pairs(arguments.map, "--map", "COLUMN=NAME"), arguments, name)
    if arguments.pairs != "apart":
        apart = {*importing.project_of(target)[0].conditions, *_pairs(arguments.map, "--map", "COLUMN=NAME"), *before.columns}
        n_remarks, reading = len(reading.remarks), with_intervals(reading, apart)
        for remark in reading.remarks[n_remarks:]:
            print(printable(f"{name}: {remark}"), file=sys.stderr)
    plan = _plan(reading, target, arguments, before)
    if arguments.names is None and (note := importing.whole_names_sentence(plan.columns, reading, "--names words")):
        print(printable(f"{name}: {note}"), file=sys.stderr)
    if arguments.decimal is None:
        for message in importing.decimal_commas_reported(plan.columns, reading, plan.table.schema, "--decimal comma"):
            print(printable(f"{name}: {message}"), file=sys.stderr)
    if not arguments.dry_run:
        if is_large:
            _say(name, f"writing {plan.path} …")
        plan.write()
        _remember(plan, arguments, before)
    with output():
        print(*_lines(plan, reading, name, arguments.dry_run), sep="\n")
    return ExitCode.OK


def _say(name: str, what: str) -> None:
    """What a long import is at, as a line that a log shows at once."""
    print(printable(f"{name}: {what}"), file=sys.stderr, flush=True)


def _target(text: str, may_overwrite: bool) -> Path:
    target = Path(text)
    place = Place(text)
    if target.suffix.lower() not in TABLE_SUFFIXES:
        mend = path_in_quotes(target.with_suffix(".csv")) if target.name else ""
        raise FileError(Fault("a table file does not end so.", f"a name that ends in {' or '.join(TABLE_SUFFIXES)}", mend, place))
    require_new_table_name(target)
    if not os.path.isdir(target.parent):
        folder = path_in_quotes(target.parent)
        raise FileError(Fault(f"there is no folder {folder}.", "a folder of tables", place=place, rule="no-such-path"))
    if is_stream(target):  # a table is a file; who writes into a pipe waits for its reader
        raise FileError(Fault("this is not a regular file.", "a file", "to remove it", place))
    if os.path.exists(target) and not may_overwrite:
        raise FileError(Fault("the file already exists.", "a new name, or --force to write over it", place=place))
    return target


def _bytes(source: str) -> tuple[bytes, str]:
    return (sys.stdin.buffer.read(), "standard input") if source == "-" else (read_bytes(source), source)


def _before(arguments: argparse.Namespace, target: Path | None) -> Choices:
    """What was chosen for such a file before, where that counts; what the options do not say is taken over. Raises ContextDBError
    where nothing is known of it."""
    if not arguments.again:
        return Choices()
    known = choices_of(target.parent, arguments.source) if target is not None else None
    if known is None:
        problem = f"--again: nothing was chosen for {in_quotes(Path(arguments.source).name)} in this folder."
        raise ContextDBError(Fault(problem, "a file of a name that was imported with choices"))
    for key in ("sheet", "decimal", "names", "pairs"):
        if getattr(arguments, key) is None:
            setattr(arguments, key, getattr(known, key) or None)
    return known


def _remember(plan: importing.Plan, arguments: argparse.Namespace, before: Choices) -> None:
    """Keep what was chosen for the next file of this name."""
    if arguments.source == "-":
        return
    named = {*_pairs(arguments.map, "--map", "COLUMN=NAME"), *_pairs(arguments.type, "--type", "NAME=TYPE")}
    columns = [replace(one, why="chosen") for one in plan.columns if named & {one.name, one.source}]
    said = {key: getattr(arguments, key) or "" for key in ("sheet", "decimal", "names", "pairs")}
    choices = replace(before, **said, columns={**before.columns, **chosen_columns(columns)})
    remember(plan.path.parent, arguments.source, choices)


def _options(arguments: argparse.Namespace) -> ReadOptions:
    is_comma = None if arguments.decimal is None else arguments.decimal == "comma"
    delimiter = None if arguments.delimiter is None else DELIMITERS[arguments.delimiter]
    is_whole = importing.has_whole_names(arguments.names, None if arguments.source == "-" else Path(arguments.source))
    return ReadOptions(arguments.format, arguments.sheet, arguments.encoding, delimiter, is_comma, is_whole)


def _plan(reading: Reading, target: Path, arguments: argparse.Namespace, before: Choices) -> importing.Plan:
    schema, settings = importing.project_of(target)
    renames = _pairs(arguments.map, "--map", "COLUMN=NAME")
    known = replace(before, columns={source: one for source, one in before.columns.items() if source not in renames})
    mapped = known.applied(propose(reading, schema, settings, renames), reading, schema)
    for name in importing.declared_differently(reading, schema):
        message = f"the file declares {in_quotes(name)} differently from contextdb.toml, which takes precedence."
        print(printable(message), file=sys.stderr)
    return importing.plan_import(reading, target, mapped=_typed(mapped, reading, _pairs(arguments.type, "--type", "NAME=TYPE")))


def _pairs(given: Sequence[str], option: str, form: str) -> dict[str, str]:
    faults = [Fault(f"{option} {in_quotes(text)} has no =.", form) for text in given if "=" not in text]
    if faults:
        raise ContextDBError(*faults)
    return dict(text.rsplit("=", 1) for text in given)


def _typed(mapped: Sequence[Mapped], reading: Reading, types: dict[str, str]) -> list[Mapped]:
    """The columns with the wanted types, by their names here or in the file."""
    names = {column.name: column for column in mapped} | {column.source: column for column in mapped}
    wanted: dict[str, Mapped] = {}
    for name, given in types.items():
        kind = KIND_SYNONYMS.get(given.casefold(), given)
        if name not in names:
            near = nearest(name, names)
            raise ContextDBError(
                Fault(f"--type: there is no column {in_quotes(name)}.", listed(list(names)), in_quotes(near) if near else "")
            )
        column = names[name]
        if kind in KINDS:
            if column.job == "condition" and not column.is_new:
                raise ContextDBError(
                    Fault(f"--type: contextdb.toml declares {in_quotes(name)} already.", "a condition that is new")
                )
            wanted[column.source] = as_type(column, reading.column(column.source), kind)
        elif kind in JOBS:
            wanted[column.source] = as_job(column, kind)
        else:
            words = [*KINDS, *JOBS]
            raise ContextDBError(Fault(f"--type: there is no type {in_quotes(given)}.", ", ".join(words), mend_for(kind, words)))
    return [wanted.get(column.source, column) for column in mapped]


# ---- what is printed


def _lines(plan: importing.Plan, reading: Reading, name: str, is_dry: bool) -> list[str]:
    table = plan.table
    done = "would become" if is_dry else "became"
    head = f"{name} ({FORMATS[reading.format].about.split(';')[0]}) {done} {plan.path}: {plural(table.n_rows, 'row')}."
    rows = [("column", "becomes", "why"), *(_row(column) for column in plan.columns)]
    return [printable(head), *aligned(rows, indent="  "), *_toml_lines(plan, is_dry), *_fault_lines(plan)]


def _row(column: Mapped) -> tuple[str, str, str]:
    if column.job == "left out":
        return column.source, "(left out)", column.why
    name = "" if column.name == column.source else f" {column.name}"
    if column.job != "condition":
        return column.source, f"{column.job}{name}", column.why
    kind = f"new condition{name}, {column.kind}" if column.is_new else f"condition{name}"
    meant = f'; is "{column.near}" meant? --map "{column.source}={column.near}"' if column.near else ""
    return column.source, kind, f"{column.why}{meant}"


def _toml_lines(plan: importing.Plan, is_dry: bool) -> list[str]:
    if plan.change is None:
        return [f"{SCHEMA_FILE} says all of it already."]
    new = plan.new_conditions
    what = f"{plural(len(new), 'condition')} ({listed(new)}) and the table" if new else "the table"
    return [
        printable(f"{plan.change.path} {'would declare' if is_dry else 'declares'} {what} {in_quotes(plan.table.settings.name)}.")
    ]


def _fault_lines(plan: importing.Plan) -> list[str]:
    faults = plan.table.faults
    if not faults:
        return []
    listed = [f"  {f.place.column}, {row_name(f.place.row or 0)}: {f.message}" for f in faults[:3]]
    more = f"  and {len(faults) - 3:,} more: contextdb check {plan.path}" if len(faults) > 3 else ""
    return [f"{plural(len(faults), 'cell')} cannot be read:", *map(printable, listed), *([more] if more else [])]


# ---- the part of `contextdb import` that learns a table from recorded pairs of facts and an asset

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
    for line in _learned_lines(result, reading, name):
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


def _learned_lines(result: Learned, reading: Reading, name: str) -> Iterator[str]:
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
