"""Measure which contexts have a valid row, and which have none.

Exits with 1 if a threshold is missed, compared with the lower bound of the covered share; with a --baseline also if a table is
gone, new or redefined, or if saved contexts expect less, unless an option accepts that (--max-drop is then 0 by default).

  contextdb coverage tables/
  contextdb coverage locomotion --gap 1
  contextdb coverage tables/ --baseline coverage.json --max-drop 0.5
  contextdb coverage tables/ --format html -o coverage.html
  contextdb coverage locomotion --telemetry "recorded/*.parquet" --fail-under-telemetry 99.5
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from contextdb.commands import add_format_arguments, deliver, is_coloured
from contextdb.commands.gating import (
    Accepted,
    add_accepting_arguments,
    case_gates,
    earlier_report,
    gone_gates,
    require_baseline,
    with_gates,
)
from contextdb.commands.numbers import percent
from contextdb.commands.progress import Bar, bar, has_many_bytes, has_many_cells
from contextdb.console import ExitCode, note, printable, terminal_width
from contextdb.covering import Gap
from contextdb.covering.baseline import ACCEPTED, Baseline, CaseCounts, read_baseline
from contextdb.covering.engine import MOST_GAPS, SAMPLES, WORK
from contextdb.covering.expected import Expectation
from contextdb.covering.pairs import PairTable
from contextdb.covering.progress import Tell
from contextdb.errors import ContextDBError, ContextError, Fault, FileError, Place, TableError, in_quotes, no_such, plural
from contextdb.report import formats, render
from contextdb.report.coverage_results import CoverageResults, Measured
from contextdb.report.results import Gate, as_path
from contextdb.tables.expected_file import expected_path, read_situations
from contextdb.tables.gap_work import GapWork
from contextdb.tables.nesting.flat import FlatTable
from contextdb.tables.other_files import cases_path
from contextdb.tables.places import table_path
from contextdb.tables.project import SCHEMA_FILE, Project, load_table
from contextdb.tables.table import EitherTable, Table
from contextdb.tables.variants import WholeTable
from contextdb.telemetry import Observed
from contextdb.telemetry.contexts import context_files


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="PATH", help="a folder of tables, one table, or the name of a table")
    add_format_arguments(parser, formats("coverage"))
    parser.add_argument("--fail-under", type=percent, metavar="PCT", help="fail if the covered percentage of any table is lower")
    parser.add_argument("--baseline", metavar="FILE", help="compare with the JSON of an earlier run")
    parser.add_argument("--max-drop", type=percent, metavar="PCT", help="how many points a table may fall below the baseline")
    add_accepting_arguments(parser)
    parser.add_argument("--gap", metavar="N", help="show all details of one gap, by its number or id")
    parser.add_argument("--explain", metavar="ROW", help="show all details of one row, by its number (from 1) or asset")
    parser.add_argument("--all", action="store_true", help="list every gap and finding")
    add_measuring_arguments(parser)


def add_measuring_arguments(parser: argparse.ArgumentParser) -> None:
    """The budgets of a measurement, and recorded contexts."""
    parser.add_argument("--seed", type=_count, default=0, metavar="N", help="the seed of the samples (default: 0)")
    parser.add_argument("--work", type=_count, default=WORK, metavar="N", help=f"steps of the exact count (default: {WORK:,})")
    parser.add_argument(
        "--samples", type=_count, metavar="N", help=f"contexts to sample (default: {SAMPLES:,}, fewer above 500 conditions)"
    )
    parser.add_argument(
        "--fail-under-expected", type=percent, metavar="PCT", help="fail if the covered percentage of what is expected is lower"
    )
    add_telemetry_arguments(parser, percent)


def run(arguments: argparse.Namespace) -> ExitCode:
    """Measure one table or a folder of them."""
    _require_sense(arguments)
    tables = Tables.at(arguments.path)
    baseline = earlier_report(arguments.baseline, read_baseline, ACCEPTED) if arguments.baseline else None
    if arguments.gap is not None or arguments.explain is not None:
        text, code = _details(arguments, _only([table.flat() for table in tables.outer])), ExitCode.OK
    else:
        counts_cases = baseline is not None or arguments.format == "json"
        results = measured_results(arguments, tables, baseline, Accepted.of(arguments), counts_cases)
        code = code_of(results)
        colour = is_coloured(arguments)
        text = render(arguments.format, results, colour=colour, width=terminal_width(), shows_all=arguments.all)
    deliver(text, arguments)
    return code


def code_of(results: CoverageResults) -> ExitCode:
    """Whether every threshold is met; telemetry that could not be read whole is no answer."""
    if any(m.telemetry is not None and not m.telemetry.is_complete for m in results.tables):
        return ExitCode.BAD_USE
    return ExitCode.OK if results.passed else ExitCode.FOUND


@dataclass(frozen=True)
class Tables:
    """The tables under a path: a folder of them, one file, or a table by its name."""

    outer: Sequence[Table]
    """Those that are in no other."""
    inner: Sequence[Table]
    """Those that are in others, of a folder: they are measured where they are."""
    is_folder: bool

    @classmethod
    def at(cls, text: str) -> Tables:
        """Raises ContextDBError with every fault of every file; a folder without a table is one."""
        if not os.path.isdir(text) and Path(text).name != SCHEMA_FILE:
            return cls([load_table(table_path(text))], [], False)
        project = Project.load(text)
        if not project.tables:
            accepted = f"a folder with {SCHEMA_FILE} and a .csv or .parquet file for each table"
            raise FileError(Fault("the folder holds no table.", accepted, place=Place(text), rule="no-tables"))
        inner = project.inner
        own, others = ([t for name, t in project.tables.items() if (name in inner) == is_in] for is_in in (False, True))
        return cls(own, others, True)

    def case_counts(self) -> dict[str, CaseCounts]:
        """How much the saved contexts of each table expect. Raises ContextDBError where they cannot be read."""
        from contextdb.checks.cases import counted, read_cases

        with_files = ((table, table.path) for table in (*self.outer, *self.inner))
        return {table.name: counted(table, read_cases(cases_path(path))) for table, path in with_files if path is not None}


def _require_sense(arguments: argparse.Namespace) -> None:
    require_baseline(arguments, bool(arguments.baseline))
    require_telemetry(arguments)
    is_detail = arguments.gap is not None or arguments.explain is not None
    names = ("fail_under", "fail_under_expected", "fail_under_telemetry", "max_drop", "baseline")
    bars = [f"--{name.replace('_', '-')}" for name in names if getattr(arguments, name) is not None]
    if is_detail and (arguments.format != "text" or bars):
        other = f"--format {arguments.format}" if arguments.format != "text" else bars[0]
        raise ContextError(Fault(f"--gap and --explain are text about one thing; {other} does not go with them."))
    if arguments.gap is not None and arguments.explain is not None:
        raise ContextError(Fault("--gap and --explain do not go together.", "one of them"))


def measured_results(
    arguments: argparse.Namespace, tables: Tables, baseline: Baseline | None, accepted: Accepted, counts_cases: bool = True
) -> CoverageResults:
    """Every table measured, and compared with a baseline where there is one: also those of it that are in other tables now."""
    from contextdb.report.coverage_results import CoverageResults

    before = baseline.tables if baseline is not None else {}
    flat = [table.flat() for table in (*tables.outer, *(t for t in tables.inner if t.name in before))]
    cases = tables.case_counts() if counts_cases else {}
    measured, others = [_measured(arguments, table) for table in flat], list[tuple[str, Gate]]()
    if arguments.fail_under_expected is not None and not any(m.expected for m in measured):
        problem = "--fail-under-expected has nothing to look at: no table says what is expected of it."
        raise ContextError(Fault(problem, f'expected = "FILE" of a table in {SCHEMA_FILE}'))
    if baseline is not None:
        names = [table.name for table in (*tables.outer, *tables.inner)]
        missing = [name for name in dict.fromkeys((*before, *baseline.cases)) if name not in names and tables.is_folder]
        limit = arguments.max_drop or 0.0
        measured = [with_gates(m, table, baseline, limit, accepted, missing) for m, table in zip(measured, flat, strict=True)]
        others = gone_gates(missing, sorted(set(names).difference(before)), accepted)
        of_cases = case_gates(baseline.cases, cases, accepted)
        measured = [replace(m, gates=(*m.gates, *of_cases.pop(m.report.table, ()))) for m in measured]
        others += [(name, gate) for name, gates in sorted(of_cases.items()) for gate in gates]
        accepted.require_needed()
    ranked = (_ranked(arguments, m, table) for m, table in zip(measured, flat, strict=True))
    return CoverageResults(tuple(ranked), tuple(others), cases)


def _ranked(arguments: argparse.Namespace, measured: Measured, table: EitherTable) -> Measured:
    """With the gaps in their order, and the work on them. Raises FileError where the file of that cannot be read."""
    ranked = ranked_by_moments(arguments, measured, table)
    work = GapWork({}) if table.path is None else GapWork.beside(table.path)
    return ranked.with_work(work, [column.condition for column in table.conditions]) if work.lines else ranked


def _measured(arguments: argparse.Namespace, table: EitherTable) -> Measured:
    from contextdb.report.coverage_results import fail_under, fail_under_expected, fail_under_telemetry

    measured = measure(arguments, table)
    gates = [] if arguments.fail_under is None else [fail_under(measured.report, arguments.fail_under)]
    if arguments.fail_under_expected is not None:
        gates.append(fail_under_expected(measured.expected, arguments.fail_under_expected))
    if measured.telemetry is not None and arguments.fail_under_telemetry is not None:
        gates.append(fail_under_telemetry(measured.telemetry, arguments.fail_under_telemetry))
    return replace(measured, gates=tuple(gates))


def measure(arguments: argparse.Namespace, table: EitherTable) -> Measured:
    """The coverage of one table and of its pairs of conditions, by the budgets of the arguments."""
    from contextdb.covering import coverage
    from contextdb.covering.baseline import declared
    from contextdb.report.coverage_results import Measured

    with _placed(table):
        with bar(f"measuring {printable(table.name)}", has_many_cells(table)) as progress:
            report = coverage(
                table,
                seed=arguments.seed,
                work=arguments.work,
                samples=arguments.samples,
                max_gaps=MOST_GAPS,
                progress=_tell(progress),
            )
        seen = observed(arguments, table, report.gaps)
        expected = _expected(arguments, table)
        compared = _pairs(arguments, table)
    lines = tuple(table.place(row).line for row in range(table.n_rows))
    file = str(table.path) if table.path else None
    space = declared(table, report.assumed)
    inside = _inside(table)
    owner, fallback = table.settings.owner, table.settings.fallback or ""
    assets = tuple(table.assets)
    return Measured(report, file, assets, lines, compared, None, seen, (), inside, space, expected, owner, fallback)


def _expected(arguments: argparse.Namespace, table: EitherTable) -> Expectation | None:
    """The coverage of the contexts that are expected of a table; None where none are."""
    from contextdb.covering.expected import expectation

    path = expected_path(table)
    if path is None:
        return None
    situations = read_situations(path, [column.condition for column in table.conditions])
    file = table.settings.expected or ""
    return expectation(table, file, situations, seed=arguments.seed, work=arguments.work, samples=arguments.samples)


def _pairs(arguments: argparse.Namespace, table: EitherTable) -> PairTable | None:
    """The coverage of pairs of conditions; None where the conditions are too many."""
    from contextdb.covering import pairs
    from contextdb.covering.pairs import SAMPLES, left_out

    if left_out(len(table.conditions)):
        return None
    label = f"comparing conditions of {printable(table.name)}"
    with bar(label, has_many_cells(table)) as progress:
        return pairs(
            table,
            seed=arguments.seed,
            samples=None if arguments.samples is None else min(arguments.samples, SAMPLES),
            progress=_tell(progress),
        )


def _tell(progress: Bar | None) -> Tell | None:
    """What tells a bar of a computation."""
    return None if progress is None else lambda part, share: progress(int(1000 * share), 1000, part)


def _inside(table: EitherTable) -> dict[int, str]:
    """For the rows that are in other files than the table their files, from the table's folder."""
    if table.path is None or not isinstance(table, (FlatTable, WholeTable)):
        return {}
    files = {row: table.place(row).file for row in range(table.n_rows)}
    own, folder = str(table.path), table.path.parent
    return {row: as_path(os.path.relpath(file, folder)) for row, file in files.items() if file is not None and file != own}


@contextmanager
def _placed(table: EitherTable) -> Iterator[None]:
    """Say of a fault which table it is in."""
    try:
        yield
    except ContextDBError as error:
        file = str(table.path) if table.path else table.name
        raise type(error)(*(f if f.place.file else f.at(Place(file, column=f.place.column)) for f in error.faults)) from None


def _details(arguments: argparse.Namespace, table: EitherTable) -> str:
    from contextdb.report.coverage_text import gap_details, row_details

    width = terminal_width()
    if arguments.explain is not None:
        row = _row(arguments.explain, table)
        return row_details(measure(arguments, table), row, width)
    measured = _ranked(arguments, measure(arguments, table), table)
    gaps = measured.report.gaps
    text = arguments.gap
    matching = [g for i, g in enumerate(gaps, 1) if text in (str(i), g.id)]
    if not matching:
        accepted = f"1 to {len(gaps)}, or an id of the JSON report" if gaps else "none: there is no gap"
        raise ContextError(Fault(f"there is no gap {in_quotes(text)}.", accepted))
    return gap_details(measured, matching[0], table, width)


def _row(text: str, table: EitherTable) -> int:
    """The row that --explain means: a number from 1, else an asset that is in one row."""
    rows = [row for row, asset in enumerate(table.assets) if asset == text]
    if len(rows) == 1:
        return rows[0]
    if text.isdecimal() and 1 <= int(text) <= table.n_rows:
        return int(text) - 1
    if rows:
        numbers = ", ".join(str(row + 1) for row in rows[:6])
        raise ContextError(Fault(f"the asset {in_quotes(text)} is in {plural(len(rows), 'row')}.", f"one of the rows {numbers}"))
    accepted = f"a row from 1 to {table.n_rows:,}, or an asset" if table.n_rows else "none: the table has no rows"
    raise ContextError(no_such("row", text, table.assets, accepted))


def _only(tables: Sequence[EitherTable]) -> EitherTable:
    if len(tables) != 1:
        names = ", ".join(in_quotes(table.name) for table in tables[:6])
        raise TableError(Fault(f"--gap and --explain are about one table, and there are {len(tables)}.", f"one of {names}"))
    return tables[0]


def _count(text: str) -> int:
    plain = text.replace("_", "").replace(",", "")
    if not (plain.isascii() and plain.isdecimal()) or len(plain) > 15:
        raise argparse.ArgumentTypeError(f"{in_quotes(text)} is not a whole number from 0 up.")
    return int(plain)


# ---- the part of `contextdb coverage` that evaluates recorded contexts

ENGINES = ("local", "dask")


def add_telemetry_arguments(parser: argparse.ArgumentParser, percent: Callable[[str], float]) -> None:
    group = parser.add_argument_group("recorded contexts")
    group.add_argument(
        "--telemetry",
        action="append",
        metavar="GLOB",
        help="CSV or Parquet files with a column for each fact, or recordings (.jsonl); may be repeated",
    )
    group.add_argument(
        "--fail-under-telemetry", type=percent, metavar="PCT", help="fail if the covered percentage of recorded moments is lower"
    )
    group.add_argument("--count", metavar="COLUMN", help="the column that says how often each moment was seen")
    group.add_argument("--engine", choices=ENGINES, default="local", help="read files here, or on Dask workers (default: local)")
    group.add_argument("--scheduler", metavar="ADDRESS", help="the Dask scheduler; without it, workers on this machine")
    group.add_argument(
        "--resume", metavar="FOLDER", help="keep the sums of finished files, and continue from them after an interruption"
    )


def require_telemetry(arguments: argparse.Namespace) -> None:
    """Refuse options about telemetry where there is none: raises ContextError that names the first of them."""
    if arguments.telemetry:
        if arguments.scheduler is not None and arguments.engine != "dask":
            raise ContextError(Fault("--scheduler is the address of Dask's.", "--engine dask with it"))
        return
    given = {
        "--fail-under-telemetry": arguments.fail_under_telemetry is not None,
        "--count": arguments.count is not None,
        "--engine": arguments.engine != "local",
        "--scheduler": arguments.scheduler is not None,
        "--resume": arguments.resume is not None,
    }
    for option, is_given in given.items():
        if is_given:
            raise ContextError(Fault(f"{option} is about recorded contexts.", "--telemetry GLOB with it"))


def observed(arguments: argparse.Namespace, table: EitherTable, known: Sequence[Gap]) -> Observed | None:
    """What the recorded contexts say of a table and its gaps; None where no files were named. Files not read are reported."""
    if not arguments.telemetry:
        return None
    from contextdb.telemetry import observe

    files = [file for pattern in arguments.telemetry for file in context_files(pattern)]
    with bar(f"reading telemetry for {printable(table.name)}", has_many_bytes(files)) as tell:
        result = observe(
            table,
            arguments.telemetry,
            count=arguments.count,
            engine=arguments.engine,
            scheduler=arguments.scheduler,
            progress=tell,
            resume=arguments.resume,
            known=known,
        )
    for file in result.unread:
        note(*file.faults)
    return result


def ranked_by_moments(arguments: argparse.Namespace, measured: Measured, table: EitherTable) -> Measured:
    """What was measured, with the gaps ranked by the recorded contexts, where there are any."""
    if measured.telemetry is None:
        return measured
    from contextdb.covering.assumed import opened
    from contextdb.telemetry.seen_gaps import ranked as by_moments

    report = by_moments(measured.report, opened(table), measured.telemetry, arguments.work, arguments.samples)
    return replace(measured, report=report)
