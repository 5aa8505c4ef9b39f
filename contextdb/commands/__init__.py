"""The commands of the command line: each module has `add_arguments(parser)` and `run(arguments) -> ExitCode`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from contextdb.console import output, wants_colour
from contextdb.disk import write_atomic
from contextdb.errors import ContextError, Fault, QueryError


def add_format_arguments(parser: argparse.ArgumentParser, formats: Sequence[str]) -> None:
    """The format of a report: --format, --json for short, and -o where it is not printed."""
    parser.add_argument("--format", choices=formats, default="text", metavar="FORMAT", help=f"{', '.join(formats)} (default: text)")
    same = "the same as --format json"
    parser.add_argument("--json", action="store_const", const="json", dest="format", default=argparse.SUPPRESS, help=same)
    parser.add_argument("-o", "--output", metavar="FILE", help="write the report to a file")


def is_coloured(arguments: argparse.Namespace) -> bool:
    """Whether a report goes to a terminal that shows colours."""
    return not arguments.output and wants_colour(sys.stdout)


def deliver(text: str, arguments: argparse.Namespace) -> None:
    """Write a report to the file of -o, or print it."""
    if arguments.output:
        write_atomic(Path(arguments.output), text.encode("utf-8", "backslashreplace"))
    else:
        with output():
            print(text, end="")


def add_page_arguments(parser: argparse.ArgumentParser, formats: Sequence[str]) -> None:
    """The format of what is printed or written, as other commands take it, beside an older option for each."""
    parser.add_argument("--format", choices=formats, default="text", metavar="FORMAT", help=f"{', '.join(formats)} (default: text)")
    parser.add_argument("-o", "--output", metavar="FILE", help="where --format html writes the page")


def take_page_arguments(arguments: argparse.Namespace) -> None:
    """Set the older option that a --format is the same as; raises QueryError for a page without a file."""
    if arguments.format == "html":
        if arguments.output is None:
            raise QueryError(Fault("a page is written to a file.", "-o FILE with --format html"))
        arguments.html = arguments.output
    elif arguments.output is not None:
        raise QueryError(Fault(f"-o writes a page, and --format {arguments.format} prints.", "--format html with -o FILE"))
    elif arguments.format != "text":
        setattr(arguments, arguments.format, True)


def answer(arguments: argparse.Namespace, document: Callable[[], Mapping[str, object]], lines: Callable[[], Iterable[str]]) -> None:
    """Print an answer: with --json its document, else its lines."""
    with output():
        if arguments.json:
            from contextdb.report.render_json import as_json

            print(as_json({"format": 1, **document()}), end="")
        else:
            print(*lines(), sep="\n")


@contextmanager
def missing_facts_by_option() -> Iterator[None]:
    """Say of a missing fact what to write on the command line, where the error says it in Python."""
    try:
        yield
    except ContextError as error:
        accepted = "a value for each condition, or --unknown any, or --unknown never"
        faults = (replace(f, accepted=accepted) if f.rule == "missing-fact" else f for f in error.faults)
        raise ContextError(*faults) from None
