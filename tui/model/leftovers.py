"""What a save that was killed leaves behind: its temporary file beside the table. An edge: this deletes files."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

LEAST_AGE_S = 60.0
"""A younger one may be the work of somebody who is saving just now."""


def clear_leftovers(folder: Path, now_s: float) -> int:
    """Delete temporary files of saves that nobody finishes any more; gives how many. `now_s` is the time of the folder's disk."""
    n_gone = 0
    with suppress(OSError):
        for path in folder.glob(".contextdb-*.tmp"):
            with suppress(OSError):
                if now_s - path.stat().st_mtime > LEAST_AGE_S:
                    path.unlink()
                    n_gone += 1
    return n_gone
