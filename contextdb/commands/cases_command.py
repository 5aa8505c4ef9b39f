"""Say what the saved contexts of a table reach: rows, rows that are picked, ends of ranges; and which slips make one of them fail.

A slip is a row left out, an end of a range moved by one in its last digit, a bool flipped, a value or a tag left out. --write adds
the fewest contexts that reach all that can be reached; each expects the assets that are valid today, so look at them once.

  contextdb cases tables/locomotion.csv
  contextdb cases locomotion --write
  contextdb cases locomotion --json
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from contextdb.checks.cases import keep_cases, read_cases
from contextdb.checks.reached import Reached, reached_by, with_names
from contextdb.commands.progress import has_many_cells, log_of
from contextdb.console import ExitCode, aligned, output, printable
from contextdb.covering.progress import Progress
from contextdb.errors import plural
from contextdb.report.render_json import as_json
from contextdb.tables.other_files import cases_path
from contextdb.tables.places import table_path
from contextdb.tables.project import load_table

MOST_ROWS = 20


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("table", metavar="TABLE", help="a .csv or .parquet file, or the name of a table")
    parser.add_argument("--write", action="store_true", help="add the fewest contexts that reach the rest to the saved ones")
    parser.add_argument("--all", action="store_true", help=f"print every row that is not reached, not the first {MOST_ROWS}")
    parser.add_argument("--json", action="store_true", help="a JSON document instead of text")


def run(arguments: argparse.Namespace) -> ExitCode:
    path = table_path(arguments.table)
    table = load_table(path)
    file = cases_path(path)
    cases = read_cases(file)
    log = log_of("looking for contexts", has_many_cells(table))
    tell = None if log is None else lambda part, share: log(int(1000 * share), 1000, part)
    reached = reached_by(table, cases, progress=Progress(tell))
    new = with_names(reached.new_cases, cases)
    if arguments.write and new:
        keep_cases(file, new)
    n_written = len(new) if arguments.write else 0
    if arguments.json:
        contexts = [{"name": c.name, "facts": dict(c.facts), "expected": c.expected, "note": c.note} for c in new]
        text = as_json({"format": 1, "table": table.name, **_json(reached), "written": n_written, "contexts": contexts})
    else:
        text = "\n".join([*_lines(reached, arguments.all), *_more(reached, len(new), file, arguments.write), ""])
    with output():
        print(text, end="")
    return ExitCode.OK


def _json(reached: Reached) -> dict[str, object]:
    slips = reached.slips
    n_killed, n_mutants = reached.counts("left out", "end", "slip")
    n_ends, all_ends = reached.counts("end")
    n_winners, all_winners = reached.counts("picked")
    left = [target for target in reached.left if target >= 2 * slips.n_rows]
    return {
        "cases": reached.n_cases,
        "rows": int(slips.table.enabled.sum()),
        "rows_reached": reached.counts("valid")[0],
        "rows_without_case": [slips.table.assets[row] for row in reached.rows_left],
        "winners": all_winners,
        "winners_reached": n_winners,
        "ends": all_ends,
        "ends_reached": n_ends,
        "mutants": n_mutants,
        "mutants_killed": n_killed,
        "survivors": [
            {"row": slips.row_of(t), "asset": slips.asset_of(t), "what": reached.sentence([t])}
            for t in left
            if t >= 2 * slips.n_rows
        ],
        "fewest": reached.reach.is_fewest,
        "complete": reached.reach.is_whole,
    }


def _lines(reached: Reached, shows_all: bool) -> Iterator[str]:
    slips = reached.slips
    yield printable(f"{slips.table.name}: {plural(slips.n_rows, 'row')}, {plural(reached.n_cases, 'saved context')} that hold")
    n_rows, all_rows = reached.counts("valid")[0], int(slips.table.enabled.sum())
    n_slips, all_slips = reached.counts("left out", "end", "slip")
    yield from aligned(
        [
            ("rows", f"{n_rows} of {all_rows}", "are valid in a saved context"),
            ("winners", "{} of {}".format(*reached.counts("picked")), "are what the policy may pick there"),
            ("ends", "{} of {}".format(*reached.counts("end")), "moves of an end of a range make one fail"),
            ("slips", f"{n_slips} of {all_slips}", "slips, these moves among them, make one fail"),
        ],
        right=(1,),
        indent="  ",
    )
    of_row: dict[int, list[int]] = {}
    for target in reached.left:
        of_row.setdefault(slips.row_of(target), []).append(target)
    if of_row:
        yield ""
        yield "not reached"
        wanted = list(of_row.items())[: None if shows_all else MOST_ROWS]
        yield from aligned([(slips.table.assets[row], reached.sentence(targets)) for row, targets in wanted], indent="  ")
        if len(of_row) > len(wanted):
            yield f"  and {plural(len(of_row) - len(wanted), 'row')} more: --all"


def _more(reached: Reached, n_new: int, file: Path, is_written: bool) -> Iterator[str]:
    yield ""
    some = "" if reached.reach.is_whole else " that was met"
    if not n_new:
        yield f"The saved contexts reach all{some}."
        return
    few = "; fewer would not do" if reached.reach.is_fewest else ""
    if is_written:
        yield printable(f"{plural(n_new, 'context')} written to {file}: with them all{some} is reached{few}.")
    else:
        yield printable(f"{plural(n_new, 'context')} more would reach all{some}{few}. --write adds them to {file}.")
