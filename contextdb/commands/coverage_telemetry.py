"""The part of `contextdb coverage` that evaluates recorded contexts."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Protocol

from contextdb.console import PREPARING, printable
from contextdb.covering import Gap
from contextdb.errors import ContextError, Fault
from contextdb.report.coverage_results import Measured
from contextdb.tables.table import EitherTable
from contextdb.telemetry import Observed
from contextdb.telemetry.contexts import context_files

ENGINES = ("local", "dask")

MANY_CELLS = 20_000
"""From so many cells of a table on a log is told of the work."""
MANY_BYTES = 10_000_000
"""From so many bytes of recorded contexts on a log is told of the work."""


class Bar(Protocol):
    """Is told how much is done of how much, and what is being done."""

    def __call__(self, done: float, total: int, part: str = "") -> None: ...


def add_arguments(parser: argparse.ArgumentParser, percent: Callable[[str], float]) -> None:
    """The arguments about telemetry."""
    told = parser.add_argument_group("recorded contexts")
    told.add_argument(
        "--telemetry",
        action="append",
        metavar="GLOB",
        help="CSV or Parquet files with a column for each fact, or recordings (.jsonl); may be repeated",
    )
    told.add_argument(
        "--fail-under-telemetry", type=percent, metavar="PCT", help="fail if the covered percentage of recorded moments is lower"
    )
    told.add_argument("--count", metavar="COLUMN", help="the column that says how often each moment was seen")
    told.add_argument("--engine", choices=ENGINES, default="local", help="read files here, or on Dask workers (default: local)")
    told.add_argument("--scheduler", metavar="ADDRESS", help="the Dask scheduler; without it, workers on this machine")
    told.add_argument(
        "--resume", metavar="FOLDER", help="keep the sums of finished files, and continue from them after an interruption"
    )


def require_telemetry(arguments: argparse.Namespace) -> None:
    """Refuse options about telemetry where there is none.

    Raises
    ------
    ContextError
        The first of them is named.
    """
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
        found = observe(
            table,
            arguments.telemetry,
            count=arguments.count,
            engine=arguments.engine,
            scheduler=arguments.scheduler,
            progress=tell,
            resume=arguments.resume,
            known=known,
        )
    for file in found.unread:
        for fault in file.faults:
            print(printable(f"contextdb: {fault}"), file=sys.stderr)
    return found


def ranked(arguments: argparse.Namespace, measured: Measured, table: EitherTable) -> Measured:
    """What was measured, with the gaps ranked by the recorded contexts, where there are any."""
    if measured.telemetry is None:
        return measured
    from contextdb.covering.assumed import opened
    from contextdb.telemetry.gap_list import ranked as by_moments

    report = by_moments(measured.report, opened(table), measured.telemetry, arguments.work, arguments.samples)
    return replace(measured, report=report)


def has_many_cells(table: EitherTable) -> bool:
    """Whether a table is so large that a log is told of the work."""
    return table.n_rows * len(table.conditions) >= MANY_CELLS


def has_many_bytes(files: Sequence[Path]) -> bool:
    """Whether files of recorded contexts are so large that a log is told of the work."""
    return sum(os.path.getsize(file) for file in files if os.path.exists(file)) >= MANY_BYTES


@contextmanager
def bar(label: str, is_long: bool) -> Iterator[Bar | None]:
    """Shows on standard error what is being done and how much of it is: a bar on a terminal, else lines as `log_of` has them."""
    if not sys.stderr.isatty():
        yield log_of(label, is_long)
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as shown:
        task = shown.add_task(label, total=None)
        yield lambda done, total, part="": shown.update(
            task, completed=done, total=total, description=f"{label}: {part}" if part else label
        )


def log_of(label: str, is_long: bool) -> Bar | None:
    """Tells of the work in plain lines on standard error, one for each tenth that is done; None for a terminal. Where the work is
    not long it tells only that loops are compiled."""
    if sys.stderr.isatty():
        return None
    told: set[object] = set()

    def tell(done: float, total: int, part: str = "") -> None:
        tenth = int(10 * done / total) if total else 0
        mark = part if part == PREPARING else tenth
        if mark not in told and (mark == PREPARING or is_long):
            told.add(mark)
            print(f"contextdb: {label}: {10 * tenth} % {part}".rstrip(), file=sys.stderr, flush=True)

    return tell
