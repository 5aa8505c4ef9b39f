"""What commands say to people and to the shell: aligned columns, colour only where a terminal shows it, progress, exit codes."""

from __future__ import annotations

import logging
import os
import shutil
import sys
import unicodedata
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from enum import IntEnum
from threading import Event, Thread
from time import monotonic
from typing import IO, TypeVar

Item = TypeVar("Item")

PATIENCE_S = 0.5
"""Work that is done sooner has no progress bar."""

__version__ = "0.1.0"

READING = logging.getLogger("contextdb.reading")
"""Where the library reports that it reads a large file: silent by itself; commands show it on standard error."""
MANY_BYTES = 2_000_000
"""A table's file of so many bytes is large: to read it may take a second."""
VERY_MANY_BYTES = 50_000_000
"""The same for a file of clips."""
TELL_S = 5.0
"""So often it is said for how long a file has been read."""

STYLES = {"bold": "1", "dim": "2", "red": "31", "green": "32", "yellow": "33", "cyan": "36"}


class ExitCode(IntEnum):
    """The exit codes of every command."""

    OK = 0
    FOUND = 1
    """No asset is valid; findings at the level that fails."""
    BAD_USE = 2
    """A wrong argument, no such file, a table that cannot be read."""
    INTERNAL = 70
    """An error of contextdb's own (EX_SOFTWARE of sysexits.h): nothing is known of the input."""
    INTERRUPTED = 130


class ScreenCrash(Exception):
    """The editor or the debugger ended by an error of contextdb's own, its `cause`; the screen is restored."""

    def __init__(self, cause: BaseException) -> None:
        super().__init__()
        self.cause = cause


@contextmanager
def output() -> Iterator[None]:
    """Print to a reader who may stop reading, as `head` does: the rest is dropped, and the command comes to its exit code."""
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        drop_output()


def drop_output() -> None:
    """Send standard output nowhere from now on, what still waits to be written included."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    with suppress(OSError, ValueError):  # a test's standard output has no number
        os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def wants_colour(stream: IO[str]) -> bool:
    """Whether to colour: on a terminal that can, unless NO_COLOR says otherwise; FORCE_COLOR colours anywhere."""
    if os.environ.get("NO_COLOR"):
        return False
    if os.environ.get("FORCE_COLOR"):
        return True
    return stream.isatty() and os.environ.get("TERM", "") not in ("dumb", "unknown")


def styled(text: str, style: str, colour: bool) -> str:
    """The text in a style, where colour is wanted."""
    return f"\x1b[{STYLES[style]}m{text}\x1b[0m" if colour and text else text


def printable(text: str) -> str:
    """The text without what would move the cursor or ring the bell."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def note(*texts: object) -> None:
    """Print lines that are no part of the answer on standard error."""
    for text in texts:
        print(printable(f"contextdb: {text}"), file=sys.stderr, flush=True)


def width_of(text: str) -> int:
    """How many terminal cells the text takes; wide characters take two, combining ones none."""
    if text.isascii():
        return len(text)
    return sum(0 if unicodedata.combining(c) else 2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text)


def aligned(rows: Sequence[Sequence[str]], right: Sequence[int] = (), indent: str = "") -> Iterator[str]:
    """Rows of texts as lines with aligned columns, two spaces between; columns in `right` are to the right."""
    clean = [[printable(t) for t in row] for row in rows]
    widths = [max(map(width_of, column)) for column in zip(*clean, strict=True)]
    for row in clean:
        cells = [_padded(t, w, i in right) for i, (t, w) in enumerate(zip(row, widths, strict=True))]
        yield (indent + "  ".join(cells)).rstrip()


def _padded(text: str, width: int, to_right: bool) -> str:
    gap = " " * (width - width_of(text))
    return gap + text if to_right else text + gap


def terminal_width() -> int:
    """How many cells a line of the terminal has; 100 where there is none."""
    return shutil.get_terminal_size((100, 24)).columns


def progress(items: Sequence[Item], label: str) -> Iterator[Item]:
    """Pass the items on; when that takes long, with a progress bar on standard error where that is a terminal."""
    start, rest = monotonic(), iter(items)
    for done, item in enumerate(rest, 1):
        yield item
        if done < len(items) and monotonic() - start > PATIENCE_S and sys.stderr.isatty():
            yield from _with_bar(rest, label, len(items) - done)


def _with_bar(rest: Iterator[Item], label: str, total: int) -> Iterator[Item]:
    from rich.console import Console
    from rich.progress import track

    yield from track(rest, label, total, console=Console(stderr=True), transient=True)


# ---- large files


def announce_file(file: str, n_bytes: int) -> None:
    """Say that a file is read, where it is large."""
    if n_bytes >= MANY_BYTES:
        READING.info("reading %s, %.1f MB", printable(file), n_bytes / 1e6)


def announce_very_large(file: str, n_bytes: int) -> None:
    """Say the same where it is very large: clips of the usual size are read without a word."""
    if n_bytes >= VERY_MANY_BYTES:
        announce_file(file, n_bytes)


@contextmanager
def announced_while(file: str, start: float) -> Iterator[None]:
    """Say every few seconds that a file is still read, and for how long since it was opened."""
    if not READING.isEnabledFor(logging.INFO):
        yield
        return
    done = Event()

    def tell() -> None:
        while not done.wait(TELL_S):
            READING.info("still reading %s, for %.0f s", printable(file), monotonic() - start)

    Thread(target=tell, daemon=True).start()
    try:
        yield
    finally:
        done.set()


class _OnStandardError(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        note(record.getMessage())


@contextmanager
def announced() -> Iterator[None]:
    """Show on standard error that large files are read."""
    handler, level = _OnStandardError(), READING.level
    READING.addHandler(handler)
    READING.setLevel(logging.INFO)
    try:
        yield
    finally:
        READING.setLevel(level)
        READING.removeHandler(handler)
