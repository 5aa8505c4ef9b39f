"""Names of files as one types them: what a path may go on to be."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

MOST_NAMES = 500


def completions(text: str, folder: Path, suffixes: Sequence[str]) -> list[str]:
    """The folders (with a slash at the end) and files that a path may go on to be, folders first; hidden ones when requested.

    Parameters
    ----------
    text : str
        What is typed so far; a path that is not absolute is below `folder`, and `~` is the home folder.
    suffixes : sequence of str
        The ends of the names of files wanted.
    """
    tail = text.replace(os.sep, "/").rpartition("/")[2]
    start = text[: len(text) - len(tail)]
    try:
        listed = sorted(os.scandir(folder / os.path.expanduser(start or ".")), key=lambda entry: entry.name.casefold())
        entries = [(entry.name, entry.is_dir()) for entry in listed]
    except (OSError, ValueError):
        return []
    near = [(name, is_dir) for name, is_dir in entries if name.casefold().startswith(tail.casefold()) and _is_meant(name, tail)]
    folders = [f"{start}{name}/" for name, is_dir in near if is_dir]
    files = [f"{start}{name}" for name, is_dir in near if not is_dir and name.lower().endswith(tuple(suffixes))]
    return [*folders, *files][:MOST_NAMES]


def common_start(names: Sequence[str], text: str) -> str:
    """The longest text that all names begin with; what is typed already when they agree on no more."""
    first, last = min(names, default=""), max(names, default="")
    n_same = next((i for i, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), min(len(first), len(last)))
    shared = first[:n_same]
    return shared if len(shared) > len(text) else text


def resolved(text: str, folder: Path) -> Path:
    """The path that a text means."""
    return folder / os.path.expanduser(text.strip())


def _is_meant(name: str, tail: str) -> bool:
    return tail.startswith(".") or not name.startswith(".")
