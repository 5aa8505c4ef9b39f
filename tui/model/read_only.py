"""Why a file could not be saved, told when it is opened. An edge: this asks the disk."""

from __future__ import annotations

import os
import stat
from pathlib import Path


def why_read_only(path: Path) -> str:
    """Why a save would be refused, for a person; empty when nothing speaks against it. Whether it works only a save shows."""
    target = Path(os.path.realpath(path))
    folder = target.parent
    try:
        mode = target.stat().st_mode
    except OSError:
        mode = None
    if mode is not None and not (mode & (stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH) and os.access(target, os.W_OK)):
        return "the file is marked read-only"
    if folder.is_dir() and not os.access(folder, os.W_OK | os.X_OK):  # a save puts a new file into the folder
        return "its folder may not be written in"
    return ""
