"""Which files belong to a project: those in its folder. An edge: this asks the disk.

A project may come from a stranger. A path that a person typed is followed wherever it leads. A path that is put together here, of a
folder and a name that the project gives, is `inside` that folder or refused: a link in a clone must not choose what is read or
written elsewhere. Links that stay in the folder are followed.

One path may leave the folder: that of the contextdb.toml which a project extends. It may climb to the nearest folder with a .git,
or to a folder that a person typed, and no link is on its way.
"""

from __future__ import annotations

import errno
import os
import stat
from contextvars import ContextVar
from pathlib import Path

from contextdb.errors import Fault, FileError, Place, in_quotes

SCHEMA_FILE = "contextdb.toml"
CASES_SUFFIX = ".cases.csv"
"""What the file of a table's saved contexts ends in: no table itself."""
NOTES_SUFFIX = ".notes.csv"
"""What the file of the notes on a table ends in: no table itself, either."""
GAPS_SUFFIX = ".gaps.csv"
"""What the file of the work on a table's gaps ends in: no table."""
ACTORS_SUFFIX = ".actors.json"
"""What the file of the actors for a table's roles ends in."""
COMPANIONS = (SCHEMA_FILE, CASES_SUFFIX, NOTES_SUFFIX, GAPS_SUFFIX, ACTORS_SUFFIX)
"""The ends of the names of files that are found next to a table. Nobody types them, so they are always `inside`."""


TYPED_ROOT: ContextVar[Path | None] = ContextVar("TYPED_ROOT", default=None)
"""The folder that a person typed, up to which projects may extend another one."""


def extended_file(folder: Path, path: str) -> Path:
    """The file that the project of a folder extends, given as contextdb.toml has it: from its folder. It has no links on its way.
    Raises FileError where it is not below the root, a link is on its way, or there is no such file."""
    start = real_path(folder)
    file = Path(os.path.normpath(start / path))
    root = real_path(typed) if (typed := TYPED_ROOT.get()) is not None and is_below(start, real_path(typed)) else work_tree(start)
    place, accepted = Place(str(folder / SCHEMA_FILE)), "a contextdb.toml below it"
    prefix = f"[project] extends = {in_quotes(path)}"
    if not file.is_relative_to(root):
        mend = "--root FOLDER, a folder that has both, or a git repository of both"
        raise FileError(Fault(f"{prefix}: the file is not in {_quoted(root)}.", accepted, mend, place, "link-outside"))
    if real_path(file) != file:
        raise FileError(Fault(f"{prefix}: a link is on its way.", accepted, "to name the file itself", place, "link-outside"))
    if not file.is_file():
        raise FileError(Fault(f"{prefix}: there is no such file.", accepted, "", place, "no-such-path"))
    return file


def inside(path: Path, folder: Path) -> Path:
    """The path as it is. Raises FileError where a link leads out of the folder, or where a pipe or a device has the name."""
    if why := why_outside(path, folder):
        raise FileError(why)
    return path


def real_path(path: str | Path) -> Path:
    """The whole path with its links followed as far as they lead; `Path.resolve` raises RuntimeError at a link to itself."""
    return Path(os.path.realpath(path))


def why_outside(path: Path, folder: Path) -> Fault | None:
    """Why a path is not `inside` a folder; None where it is."""
    try:
        target, root = real_path(path), real_path(folder)
        if not is_below(target, root):
            problem = f"a link leads to {_quoted(target)}, which is not in the folder {_quoted(folder)}."
            mend = "to put the file itself there"
            return Fault(problem, "files of that folder", mend, Place(str(path)), "link-outside")
        mode = os.stat(target).st_mode
    except (OSError, ValueError) as error:  # missing, or a name that no file can have: whoever opens it says so
        is_loop = isinstance(error, OSError) and error.errno == errno.ELOOP
        return Fault("a link leads to itself.", "a file", "to remove it", Place(str(path)), "link-outside") if is_loop else None
    if stat.S_ISREG(mode) or stat.S_ISDIR(mode):
        return None
    return Fault("this is not a regular file.", "a file", "to remove it", Place(str(path)))


def is_below(target: Path, root: Path) -> bool:
    """Whether a path without links is a folder, or in it, however the disk spells the two."""
    if target.is_relative_to(root):
        return True
    return any(_is_same(each, root) for each in (target, *target.parents))


def require_companion_inside(path: Path) -> None:
    """Raise FileError where the name of a path is that of a companion of a table, and it is not a file in the project of its
    folder."""
    if path.name.lower().endswith(COMPANIONS) and not _is_plain(path):
        inside(path, project_folder(real_path(path.parent)))


def project_folder(folder: Path) -> Path:
    """The nearest folder, from this one upwards, that has a contextdb.toml; else this one. It has no links on its way."""
    return next((each for each in (folder, *folder.parents) if os.path.lexists(each / SCHEMA_FILE)), folder)


def work_tree(folder: Path) -> Path:
    """The nearest folder, from this one upwards, that has a .git; else that of its project. It has no links on its way."""
    real = Path(os.path.realpath(folder))
    return next((each for each in (real, *real.parents) if os.path.lexists(each / ".git")), project_folder(real))


def project_folders(root: Path) -> list[Path]:
    """The folders with a contextdb.toml, of this one and those below it, in the order of their paths; hidden folders and links are
    passed over."""
    folders = []
    for at, below, names in os.walk(root):
        below[:] = sorted(name for name in below if not name.startswith("."))
        folders += [Path(at)] if SCHEMA_FILE in names else []
    return folders


def _is_plain(path: Path) -> bool:
    try:
        return stat.S_ISREG(os.lstat(path).st_mode)
    except (OSError, ValueError):
        return True


def _is_same(one: Path, other: Path) -> bool:
    try:
        return os.path.samefile(one, other)
    except OSError:
        return False


def _quoted(path: Path) -> str:
    return in_quotes(str(path), most=4096)
