"""What Python's own calls touch on the disk while a test looks: by an audit hook, which a process keeps once it has it."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
NO_FOLLOW = getattr(os, "O_NOFOLLOW", 0)
NAMED = {
    "os.rename": 2,
    "os.remove": 1,
    "os.mkdir": 1,
    "os.rmdir": 1,
    "os.link": 2,
    "os.symlink": 2,
    "os.listdir": 1,
    "os.scandir": 1,
}
FOLLOWED = ("os.truncate", "os.chmod", "os.chown", "os.utime", "os.listdir", "os.scandir")
READS = ("os.listdir", "os.scandir")


class Touched:
    """The files that were read, and those that were written, made, renamed or removed, without links on their way."""

    def __init__(self) -> None:
        self.read: set[Path] = set()
        self.written: set[Path] = set()

    def outside(self, project: Path, around: Path) -> list[str]:
        """What was touched in a folder around a project, and not in the project."""
        touched = sorted({path for path in self.read | self.written if path.is_relative_to(around)})
        return [
            str(path) for path in touched if not path.is_relative_to(project) and path != around and path not in project.parents
        ]


_looking: list[Touched] = []


@contextmanager
def touched() -> Iterator[Touched]:
    """Take down what is touched."""
    _installed()
    found = Touched()
    _looking.append(found)
    try:
        yield found
    finally:
        _looking.remove(found)


@cache
def _installed() -> None:
    sys.addaudithook(_take)


def _take(event: str, given: tuple[object, ...]) -> None:
    if not _looking:
        return
    if event == "open":
        path, mode, flags = given
        is_written = bool(isinstance(flags, int) and flags & WRITES) or bool(isinstance(mode, str) and set(mode) & set("wax+"))
        _add(path, is_written, follows=not (isinstance(flags, int) and flags & NO_FOLLOW))
    elif event in NAMED or event in FOLLOWED:
        for path in given[: NAMED.get(event, 1)]:
            _add(path, event not in READS, follows=event in FOLLOWED)


def _add(path: object, is_written: bool, follows: bool) -> None:
    if not isinstance(path, (str, bytes, os.PathLike)):
        return
    text = os.fsdecode(path)
    if "\0" in text:
        return
    whole = (
        os.path.realpath(text) if follows else os.path.join(os.path.realpath(os.path.dirname(text) or "."), os.path.basename(text))
    )
    for each in _looking:
        (each.written if is_written else each.read).add(Path(whole))
