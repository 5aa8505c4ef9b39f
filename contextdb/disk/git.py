"""What git knows of a folder and of a file, read from its objects. An edge: it runs git, without a shell.

Nothing that a repository says is run: no hook, no pager, no program for signatures, no filter; names are literal.
"""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from contextdb.disk.boundary import real_path
from contextdb.errors import Fault, FileError, Place

MOST_VERSIONS = 100
MOST_BYTES = 100_000_000
MOST_S = 10.0
LFS_POINTER = b"version https://git-lfs.github.com/spec/"
_FORMAT = "--format=%H%x00%an%x00%ad%x00%s"


@dataclass(frozen=True)
class FileVersion:
    """A commit that changed a file, and the file's bytes in it; empty where the commit removed it."""

    commit: str
    author: str
    date: str
    """In the author's zone: 2026-03-01 14:05."""
    message: str
    """Its first line."""
    raw: bytes


@dataclass(frozen=True)
class FileVersions:
    """The commits of a file, the newest first."""

    versions: Sequence[FileVersion]
    n_left_out: int = 0
    """Older ones that were too many, or too large, to be read."""


def versions_of(path: Path, most: int = MOST_VERSIONS, most_bytes: int = MOST_BYTES, most_s: float = MOST_S) -> FileVersions:
    """The versions of a file under its name now. Raises FileError where there is no git, no repository or no commit of the file,
    or git takes too long."""
    folder, end = path.parent, time.monotonic() + most_s
    if not path.name.isprintable():
        raise FileError(Fault("the file has a name that git cannot be asked for.", "a name of printable characters"))
    if not is_in_a_repository(folder, most_s):
        raise FileError(Fault("the folder is in no git repository, so that nothing is known of earlier versions."))
    log = ("-c", "log.showSignature=false", "log", f"-n{most + 1}", _FORMAT, "--date=format:%Y-%m-%d %H:%M", "--", path.name)
    code, out = run_git(folder, *log, most_s=max(0.1, end - time.monotonic()))
    lines = [line.split("\0") for line in out.decode("utf-8", "replace").split("\n") if line] if code == 0 else []
    about = [line for line in lines if len(line) == 4]
    if not about:
        raise FileError(Fault("no commit has the file yet, so that nothing is known of earlier versions."))
    request = "".join(f"{commit}:./{path.name}\n" for commit, *_ in about[:most]).encode("utf-8", "surrogateescape")
    sizes = _sizes(run_git(folder, "cat-file", "--batch-check", given=request, most_s=max(0.1, end - time.monotonic()))[1])
    n, total = 0, 0
    for size in sizes[:most]:
        total += size or 0
        if total > most_bytes:
            break
        n += 1
    given = b"".join(line + b"\n" for line in request.split(b"\n")[:n])
    _, out = run_git(folder, "cat-file", "--batch", given=given, most_s=max(0.1, end - time.monotonic()))
    raws = _contents(out, n)
    versions = [FileVersion(line[0], line[1], line[2], line[3], raw) for line, raw in zip(about, raws, strict=False)]
    return FileVersions(versions, len(about) - len(versions))


def _sizes(out: bytes) -> list[int | None]:
    """The size of each object that was asked for; None where there is none."""
    sizes: list[int | None] = []
    for line in out.splitlines():
        words = line.rsplit(b" ", 2)
        sizes.append(int(words[2]) if len(words) == 3 and words[1] == b"blob" and words[2].isdigit() else None)
    return sizes


def _contents(out: bytes, n: int) -> list[bytes]:
    """The bytes of so many objects; none of one that is missing."""
    raws: list[bytes] = []
    at = 0
    for _ in range(n):
        head, _, _ = out[at : at + 8192].partition(b"\n")
        size = _sizes(head)[0] if head else None
        start = at + len(head) + 1
        raws.append(b"" if size is None else out[start : start + size])
        at = start if size is None else start + size + 1
    return raws


def is_in_a_repository(folder: Path, most_s: float | None = None) -> bool:
    """Whether a folder is in the work tree of a repository that is not itself made of files of that tree."""
    code, out = run_git(folder, "rev-parse", "--is-inside-work-tree", "--show-toplevel", "--absolute-git-dir", most_s=most_s)
    is_inside, *paths = os.fsdecode(out).splitlines() or [""]
    if code != 0 or is_inside != "true" or len(paths) != 2:
        return False
    top, own = (real_path(path) for path in paths)
    return not own.is_relative_to(top) or own.is_relative_to(top / ".git")


def run_git(folder: Path, *arguments: str, given: bytes = b"", most_s: float | None = None) -> tuple[int, bytes]:
    """The exit code of git and its standard output. Raises FileError where it cannot be run, or takes longer than `most_s`."""
    command = ["git", "-c", "safe.bareRepository=explicit", "--no-replace-objects", "--literal-pathspecs", *arguments]
    environment = os.environ | {"LC_ALL": "C", "GIT_TERMINAL_PROMPT": "0"}
    try:
        done = subprocess.run(command, cwd=folder, input=given, capture_output=True, check=False, env=environment, timeout=most_s)
    except subprocess.TimeoutExpired:
        raise FileError(Fault(f"git takes longer than {most_s:g} s.", place=Place(str(folder)))) from None
    except OSError as error:
        fault = Fault(f"git cannot be run: {error.strerror}.", "git on the search path", "to install git, or --baseline FILE")
        raise FileError(fault, errno=error.errno) from None
    if done.returncode and b"dubious ownership" in done.stderr:
        accepted = "a repository of this user, or one that git's safe.directory names"
        raise FileError(Fault("git refuses the repository: another user owns it.", accepted, place=Place(str(folder))))
    return done.returncode, done.stdout
