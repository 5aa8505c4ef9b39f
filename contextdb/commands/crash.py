"""What is reported of an error of contextdb's own: what, where and with which versions, and none of the user's data.

The text of an exception may quote a cell, a fact or a path. So its type is named and never its text; of a file of code the name
within its package, and of the arguments the command and the names of its options. Nothing is written to a file: commands write
only where the project or the command line says, and standard error can be redirected.
"""

from __future__ import annotations

import sys
import traceback
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path

from contextdb.commands import installed
from contextdb.console import ScreenCrash, __version__

MOST_CALLS = 12
"""The number of innermost calls that are listed; repeated ones count as one."""


def lines(error: BaseException, arguments: Sequence[str]) -> Iterator[str]:
    """The report of an error that escaped from a command with these arguments."""
    if isinstance(error, ScreenCrash):
        yield "The edits since the last save are in the journal: open the table again to go on with them."
        error = error.cause
    yield f"  {_type(error)} in {' '.join(('contextdb', *_command(arguments)))}"
    calls = [
        f"  at {_module(frame.f_code.co_filename)}:{line}, {frame.f_code.co_name}"
        for frame, line in traceback.walk_tb(error.__traceback__)
    ]
    runs = [(call, len(list(same))) for call, same in groupby(calls)]
    yield from (f"{call}, {n:,} times" if n > 1 else call for call, n in runs[-MOST_CALLS:])
    yield f"  contextdb {__version__}"
    yield from installed.lines()


def _type(error: BaseException) -> str:
    cause = error.__cause__ or error.__context__
    return type(error).__name__ + (f" after {type(cause).__name__}" if cause else "")


def _command(arguments: Sequence[str]) -> Iterator[str]:
    """The words of a command that was loaded, and the names of its options."""
    for n_words in (2, 1):
        if f"contextdb.commands.{'_'.join(arguments[:n_words])}_command" in sys.modules:
            yield from arguments[:n_words]
            break
    for text in arguments:
        if text == "--":
            return
        if text.startswith("--"):
            yield text.partition("=")[0]


def _module(file: str) -> str:
    """A file of code from its package on: the folder that Python finds it in may name a user or a project."""
    path = Path(file)
    inside = [path.relative_to(root).as_posix() for root in map(Path, sys.path) if root.is_absolute() and path.is_relative_to(root)]
    return min(inside, key=len, default=path.name)
