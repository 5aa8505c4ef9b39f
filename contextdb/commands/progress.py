"""Progress on standard error: a bar on a terminal, plain lines in a log."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import process_time
from typing import Protocol

from contextdb.console import printable
from contextdb.tables.table import EitherTable

MANY_CELLS = 20_000
"""A log gets lines of progress for tables of at least this many cells."""
MANY_BYTES = 10_000_000
"""The same for recorded contexts, in bytes."""
LONG_S = 10.0
"""Other work gets them when the process has worked so long on it, in seconds of CPU: columns of a thousand tags have few cells."""
MANY_CLIPS = 100
"""The same for clips."""


class Bar(Protocol):
    """Takes how much is done of how much, and what is being done."""

    def __call__(self, done: float, total: int, part: str = "") -> None: ...


def has_many_cells(table: EitherTable) -> bool:
    """Whether a table is so large that a log gets lines of progress."""
    return table.n_rows * len(table.conditions) >= MANY_CELLS


def has_many_bytes(files: Sequence[Path]) -> bool:
    """Whether files of recorded contexts are so large that a log gets lines of progress."""
    return sum(os.path.getsize(file) for file in files if os.path.exists(file)) >= MANY_BYTES


@contextmanager
def bar(label: str, is_long: bool) -> Iterator[Bar | None]:
    """Shows on standard error what is being done and how much of it is: a bar on a terminal, else lines as `log_of` has them."""
    if not sys.stderr.isatty():
        yield log_of(label, is_long)
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as display:
        task = display.add_task(label, total=None)
        yield lambda done, total, part="": display.update(
            task, completed=done, total=total, description=f"{label}: {part}" if part else label
        )


def log_of(label: str, is_long: bool) -> Bar | None:
    """Tells of the work in plain lines on standard error, one for each tenth that is done; None for a terminal. Where the work is
    not long, and does not get long, it tells nothing."""
    if sys.stderr.isatty():
        return None
    logged: set[int] = set()
    start = process_time()

    def tell(done: float, total: int, part: str = "") -> None:
        tenth = int(10 * done / total) if total else 0
        if tenth not in logged and (is_long or process_time() - start > LONG_S):
            logged.add(tenth)
            print(f"contextdb: {label}: {10 * tenth} % {part}".rstrip(), file=sys.stderr, flush=True)

    return tell


@contextmanager
def building_bar(label: str = "building", *, tells_few: bool = True) -> Iterator[Callable[[int, int, str], None]]:
    """The progress of building motion databases, or of other work, by clips; on a terminal of few clips too where `tells_few`."""
    with bar(label, is_long=True) as tell:
        is_terminal = tells_few and sys.stderr.isatty()

        def tell_clip(done: int, total: int, clip: str) -> None:
            if tell is not None and (is_terminal or total >= MANY_CLIPS):
                tell(done, total, f"{done}/{total} {printable(clip)}")

        yield tell_clip
