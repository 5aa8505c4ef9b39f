"""Where much work is done: the options of commands that read many files of clips."""

from __future__ import annotations

import argparse

from contextdb.disk import engines
from contextdb.disk.engines import ENGINES, Engines
from contextdb.errors import ContextError, Fault


def add_engine_arguments(parser: argparse.ArgumentParser) -> None:
    """`--engine` and `--scheduler`."""
    parser.add_argument(
        "--engine", choices=ENGINES, default="local", help="work on all cores of this machine, or on Dask workers (default: local)"
    )
    parser.add_argument("--scheduler", metavar="ADDRESS", help="the Dask scheduler; without it, workers on this machine")


def engines_of(arguments: argparse.Namespace) -> Engines:
    """Where the work is done. Raises ContextError for a scheduler of nothing."""
    if arguments.engine == "dask":
        return engines.dask(arguments.scheduler, "to run again: clips that were done are not read again")
    if arguments.scheduler is not None:
        raise ContextError(Fault("--scheduler is the address of Dask's.", "--engine dask with it"))
    return engines.local
