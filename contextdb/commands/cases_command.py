"""Say what the saved contexts of a table reach: rows, rows that are picked, ends of ranges; and which slips make one of them fail.

A slip is a row left out, an end of a range moved by one in its last digit, a bool flipped, a value or a tag left out. --write adds
the fewest contexts that reach all that can be reached; each expects the assets that are valid today, so look at them once.

  contextdb cases tables/locomotion.csv
  contextdb cases locomotion --write
  contextdb cases locomotion --json
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from contextdb import bitmask
from contextdb.cells.facts import fact_text
from contextdb.checks.case_contexts import Reach, contexts_for
from contextdb.checks.cases import Case, exactly, judge, keep_cases, question_of, read_cases
from contextdb.checks.slips import LEFT_OUT, PICKED, VALID, Slip, Slips, flags_of
from contextdb.commands import answer
from contextdb.commands.progress import has_many_cells, log_of
from contextdb.compiled.table import data_of
from contextdb.console import ExitCode, aligned, printable
from contextdb.covering.progress import SILENT, Progress
from contextdb.errors import plural
from contextdb.tables.other_files import cases_path
from contextdb.tables.places import table_path
from contextdb.tables.project import load_table
from contextdb.tables.table import Table

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
    contexts = [{"name": c.name, "facts": dict(c.facts), "expected": c.expected, "note": c.note} for c in new]
    answer(
        arguments,
        lambda: {"table": table.name, **_json(reached), "written": n_written, "contexts": contexts},
        lambda: [*_lines(reached, arguments.all), *_more(reached, len(new), file, arguments.write)],
    )
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


# ---- what the saved contexts of a table reach, which slips make one of them fail, and the fewest more that reach the rest


MOST_NOTED = 3
"""So many things that a context reaches stand in its note."""


@dataclass(frozen=True, eq=False)
class Reached:
    """What saved contexts reach of a table."""

    slips: Slips
    n_cases: int
    """Saved contexts that hold and expect something."""
    reached: int
    """The targets that they reach, as bits."""
    reach: Reach
    """What could be reached, and by which contexts besides."""

    def counts(self, *kinds: str) -> tuple[int, int]:
        """How many targets of some kinds are reached, of those that can be: "valid", "picked", "left out", "end", "slip"."""
        reached = [t for t in bitmask.rows_of(self.reach.reachable) if self._kind(t) in kinds]
        return sum(self.reached >> t & 1 for t in reached), len(reached)

    def _kind(self, target: int) -> str:
        kind = self.slips.kind_of(target)
        return kind if isinstance(kind, str) else "end" if kind.is_end else "slip"

    @property
    def left(self) -> list[int]:
        """The targets that no saved context reaches, by rows."""
        return sorted(bitmask.rows_of(self.reach.reachable & ~self.reached), key=lambda target: (self.slips.row_of(target), target))

    @property
    def rows_left(self) -> list[int]:
        """The enabled rows that are valid in no saved context."""
        enabled = self.slips.table.enabled
        return [row for row in range(self.slips.n_rows) if enabled[row] and not self.reached >> row & 1]

    def sentence(self, targets: Sequence[int]) -> str:
        """Some targets of one row in a few words: "the row; speed from 0.2, up to 3"."""
        kinds = [self.slips.kind_of(target) for target in targets]
        words = ["the row"] if VALID in kinds else ["the row left out"] if LEFT_OUT in kinds else []
        words += ["the row picked"] if PICKED in kinds and VALID not in kinds else []
        slipped: dict[str, dict[str, None]] = {}
        for slip in (kind for kind in kinds if isinstance(kind, Slip)):
            slipped.setdefault(slip.condition, {})[slip.what] = None
        return "; ".join([*words, *(f"{condition} {', '.join(what)}" for condition, what in slipped.items())])

    @property
    def new_cases(self) -> list[Case]:
        """The contexts as cases that expect what is valid today."""
        return list(self._cases())

    def _cases(self) -> Iterator[Case]:
        seen = self.reached
        for one in self.reach.contexts:
            new = bitmask.rows_of(one.targets & ~seen)
            seen |= one.targets
            facts = {name: fact_text(value) for name, value in one.moment.items()}
            valid = [self.slips.table.assets[row] for row in bitmask.rows_of(one.targets & ((1 << self.slips.n_rows) - 1))]
            yield Case(self._name(new), facts, exactly(valid), note=self._note(new))

    def _name(self, targets: Sequence[int]) -> str:
        row = self.slips.row_of(targets[0])
        asset = self.slips.table.assets[row]
        slip = next((kind for t in targets if isinstance(kind := self.slips.kind_of(t), Slip) and kind.row == row), None)
        return asset if slip is None or VALID in map(self.slips.kind_of, targets) else f"{asset}: {slip.text}"

    def _note(self, targets: Sequence[int]) -> str:
        of_row: dict[int, list[int]] = {}
        for target in targets:
            of_row.setdefault(self.slips.row_of(target), []).append(target)
        parts = [f"{self.slips.table.assets[row]}: {self.sentence(own)}" for row, own in of_row.items()]
        more = [f"{len(parts) - MOST_NOTED} rows more"] if len(parts) > MOST_NOTED else []
        return "reaches " + " / ".join([*parts[:MOST_NOTED], *more])


def reached_by(table: Table, cases: Sequence[Case], seed: int = 0, progress: Progress = SILENT) -> Reached:
    """What saved contexts reach of a table, and what would reach the rest. One that fails, or can only hold, reaches nothing.

    Raises TableError where cells of the table cannot be read, ExpressionError where an assumption cannot.
    """
    slips = Slips.of(table)
    written = data_of(table.compile())
    holding = [case for case in cases if judge(written, case).holds]
    reached = 0
    for case in holding:
        reached |= _targets(slips, case)
    return Reached(slips, len(holding), reached, contexts_for(slips, reached, seed, progress))


def _targets(slips: Slips, case: Case) -> int:
    """What a case reaches: rows that are valid, and slips after which it does not hold."""
    expected, facts, _ = question_of(slips.compiled, case)
    bits = slips.compiled.query(facts, unknown="any").bits
    targets = bitmask.to_int(bitmask.pack(slips.hits(flags_of([bits], slips.slipped.n_rows))[0]))
    if expected.is_exact:
        return targets
    named = expected.wanted | expected.banned
    return bitmask.int_of([t for t in bitmask.rows_of(targets) if t < 2 * slips.n_rows or slips.asset_of(t) in named])


def with_names(new: Sequence[Case], known: Sequence[Case]) -> list[Case]:
    """The new cases under names that no other case has."""
    taken = {case.name for case in known}
    named = []
    for case in new:
        name = next(name for name in (case.name, *(f"{case.name} {n}" for n in range(2, 3 + len(taken)))) if name not in taken)
        taken.add(name)
        named.append(Case(name, case.facts, case.expected, None, case.note))
    return named
