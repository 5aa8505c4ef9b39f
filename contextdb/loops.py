"""Loops that numba compiles: whether this machine has them compiled already, and word that they are compiled now.

The library says it to the logger "contextdb.loops", which is silent by itself; commands show it on standard error.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PREPARING = "Preparing the loops, for the first time on this machine only"
"""What is reported while the loops are compiled."""
LOGGER = logging.getLogger("contextdb.loops")


def was_compiled(loop: Any) -> bool:
    """Whether a numba function is compiled: in this process, or in numba's cache on this machine."""
    folder, module = Path(loop.stats.cache_path or ""), loop.py_func.__module__.rpartition(".")[2]
    return bool(loop.signatures) or any(folder.glob(f"{module}.{loop.py_func.__qualname__}-*.nbi"))


def announce(loop: Any) -> None:
    """Say that the loops are compiled, where this one, the longest of them, is not compiled yet."""
    if not was_compiled(loop):
        LOGGER.info(PREPARING)


class _OnStandardError(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        print(f"contextdb: {record.getMessage()}", file=sys.stderr, flush=True)


@contextmanager
def announced() -> Iterator[None]:
    """Show on standard error that loops are compiled."""
    handler, level = _OnStandardError(), LOGGER.level
    LOGGER.addHandler(handler)
    LOGGER.setLevel(logging.INFO)
    try:
        yield
    finally:
        LOGGER.setLevel(level)
        LOGGER.removeHandler(handler)
