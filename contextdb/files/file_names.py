"""Names of files on disks that differ: capitals, Unicode forms, names that Windows keeps. Nothing here asks the disk.

A disk may take `Walk.csv` and `walk.csv` for one file (Windows, macOS), and may give back `é` as one character or as two (macOS).
So names are compared composed (NFC); names that differ in capitals alone are alike, and one file where the disk says so.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePath

from contextdb.disk import names_a_table
from contextdb.errors import Fault, FileError, Place, in_quotes

_DEVICES = {"con", "prn", "aux", "nul", "conin$", "conout$", *(f"{port}{n}" for port in ("com", "lpt") for n in "0123456789¹²³")}

_SIGNS = frozenset('<>:"/\\|?*')


def composed(name: str) -> str:
    """A name in the one Unicode form in which names are compared."""
    return unicodedata.normalize("NFC", name)


def alike(name: str) -> str:
    """What is equal for names that some disk takes for one file."""
    return composed(composed(name).casefold())


def why_unportable(name: str) -> str:
    """Why Windows can have no file of this name, as the end of a sentence; empty where it can."""
    stem = name.partition(".")[0].rstrip(" ")
    if stem.casefold() in _DEVICES:
        return f"Windows keeps the name {stem} for a device"
    if taken := next((c for c in name if c in _SIGNS or c < " "), None):
        return f"Windows has no {in_quotes(taken)} in names of files"
    if name[-1:] in (".", " ") or PurePath(name).stem[-1:] in (".", " "):
        return "Windows drops a dot or a blank at the end of a name"
    return ""


def why_no_table(name: str) -> str:
    """Why no new table can have a file of this name, as the end of a sentence; empty where one can."""
    if not names_a_table(name):
        return "files named so are hidden, or hold the saved contexts or notes of a table"
    return why_unportable(name)


def require_new_table_name(path: Path) -> None:
    """Raise FileError where no new table can have the name of a path."""
    if why := why_no_table(path.name):
        raise FileError(
            Fault(f"this is not a valid table name: {why}.", "a name that every system can have", place=Place(str(path)))
        )


def confusable(names: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Each name that some disk takes for one before it, with that one."""
    first: dict[str, str] = {}
    for name in names:
        other = first.setdefault(alike(name), name)
        if other != name:
            yield name, other


def spelled(wanted: str, present: Iterable[str]) -> str | None:
    """The name of a folder that is the wanted one, in whatever Unicode form; itself first. None where there is none."""
    names = set(present)
    if wanted in names:
        return wanted
    return min((name for name in names if composed(name) == composed(wanted)), default=None)
