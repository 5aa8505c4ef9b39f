"""The commands of the command line: each module has `add_arguments(parser)` and `run(arguments) -> ExitCode`."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

from contextdb.errors import ContextError


def add_format_arguments(parser: argparse.ArgumentParser, formats: Sequence[str]) -> None:
    """The format of what is printed: --format, and --json for short."""
    parser.add_argument("--format", choices=formats, default="text", metavar="FORMAT", help=f"{', '.join(formats)} (default: text)")
    same = "the same as --format json"
    parser.add_argument("--json", action="store_const", const="json", dest="format", default=argparse.SUPPRESS, help=same)


@contextmanager
def missing_facts_by_option() -> Iterator[None]:
    """Say of a missing fact what to write on the command line, where the error says it in Python."""
    try:
        yield
    except ContextError as error:
        accepted = "a value for each condition, or --unknown any, or --unknown never"
        faults = (replace(f, accepted=accepted) if f.rule == "missing-fact" else f for f in error.faults)
        raise ContextError(*faults) from None
