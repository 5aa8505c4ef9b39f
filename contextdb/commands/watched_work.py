"""Work on a folder of clips done again whenever its files change: `--watch` of `motion build` and `motion prepare`.

An edge: this looks at disk and clock.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

from contextdb.console import ExitCode, note
from contextdb.disk import TABLE_SUFFIXES
from contextdb.errors import ContextDBError
from contextdb.motion.clips.source import ENDINGS
from contextdb.tables.project import SCHEMA_FILE, folder_of
from contextdb.tables.watching.rest import Rest, Stamps, look
from contextdb.tables.watching.watcher import POLL_S, SETTLE_S, SHORTEST_WAIT_S

SUFFIXES = (*ENDINGS, *TABLE_SUFFIXES)
"""What clips, tables and markup are in, next to contextdb.toml."""

sleep, clock = time.sleep, time.monotonic


def watched(path: str, work: Callable[[], ExitCode]) -> ExitCode:
    """Do some work on a folder now, and again when files in it have changed and rested; ends with Ctrl+C.

    Says what is wrong; the next change may mend it. Raises FileError where there is no such folder.
    """
    folder = folder_of(Path(path))
    seen: Stamps = look(_files(folder))
    rest = Rest(seen, clock(), SETTLE_S)
    try:
        while True:
            _done(work)
            note(f"watching {folder}. Ctrl+C ends it.")
            seen = _next(folder, seen, rest)
    except KeyboardInterrupt:  # how it ends
        return ExitCode.OK


def _next(folder: Path, before: Stamps, rest: Rest) -> Stamps:
    """The stamps of the files when they have changed, and rest."""
    while True:
        seen, now = look(_files(folder)), clock()
        if rest.is_due(seen, now) and seen != before:
            rest.taken(now)
            return seen
        rest_s = rest.wait_s(now)
        sleep(POLL_S if rest_s is None else min(POLL_S, max(rest_s, SHORTEST_WAIT_S)))


def _done(work: Callable[[], ExitCode]) -> None:
    try:
        work()
    except ContextDBError as error:
        note(*error.faults)
    sys.stdout.flush()


def _files(folder: Path) -> list[Path]:
    """What the work may depend on, in the folder and below; hidden folders, such as that of the cache, are passed over."""
    files = []
    for at, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith(".")]
        files += [Path(at) / name for name in names if name == SCHEMA_FILE or name.lower().endswith(SUFFIXES)]
    return sorted(files)
