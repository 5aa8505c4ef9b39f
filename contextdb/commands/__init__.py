"""The commands of the command line: each module has `add_arguments(parser)` and `run(arguments) -> ExitCode`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from contextdb.errors import ContextError


@contextmanager
def missing_facts_by_option() -> Iterator[None]:
    """Say of a missing fact what to write on the command line, where the error says it in Python."""
    try:
        yield
    except ContextError as error:
        said = "a value for each condition, or --unknown any, or --unknown never"
        faults = (replace(f, accepted=said) if f.rule == "missing-fact" else f for f in error.faults)
        raise ContextError(*faults) from None
