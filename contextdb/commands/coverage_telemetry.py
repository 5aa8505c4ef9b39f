"""The part of `contextdb coverage` that evaluates recorded contexts."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace

from contextdb.commands.progress import bar, has_many_bytes
from contextdb.console import note, printable
from contextdb.covering import Gap
from contextdb.errors import ContextError, Fault
from contextdb.report.coverage_results import Measured
from contextdb.tables.table import EitherTable
from contextdb.telemetry import Observed
from contextdb.telemetry.contexts import context_files

ENGINES = ("local", "dask")


def add_arguments(parser: argparse.ArgumentParser, percent: Callable[[str], float]) -> None:
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


def ranked(arguments: argparse.Namespace, measured: Measured, table: EitherTable) -> Measured:
    """What was measured, with the gaps ranked by the recorded contexts, where there are any."""
    if measured.telemetry is None:
        return measured
    from contextdb.covering.assumed import opened
    from contextdb.telemetry.seen_gaps import ranked as by_moments

    report = by_moments(measured.report, opened(table), measured.telemetry, arguments.work, arguments.samples)
    return replace(measured, report=report)
