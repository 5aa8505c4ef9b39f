"""The settings of git for tables: lines of .gitattributes, and sections of git's configuration. Shared by the `git` commands."""

from __future__ import annotations

import argparse
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from contextdb.console import ExitCode, output, printable
from contextdb.disk import read_bytes, remove, write_atomic
from contextdb.disk.boundary import inside
from contextdb.errors import ContextDBError, Fault, FileError, Place

ATTRIBUTES = ".gitattributes"
LINES = (
    b"*.csv merge=contextdb diff=contextdb",
    b"*.parquet merge=contextdb diff=contextdb",
    b"contextdb.toml merge=contextdb",
)
NAME = "contextdb: tables by asset and cell"
BY_LINES = "{ test $? = 1 || git merge-file --diff3 -L ours -L base -L theirs %A %O %B; exit 1; }"
"""What git does where the driver cannot be run or fails: else ours alone would are in the file, without a mark."""


@dataclass(frozen=True)
class Setup:
    """One folder of a repository and the configuration that is meant. `command` is how git calls contextdb."""

    folder: Path
    is_global: bool
    command: str

    @property
    def attributes(self) -> Path:
        """The file that says which files are tables."""
        return inside(self.folder / ATTRIBUTES, self.folder)

    @property
    def settings(self) -> dict[str, str]:
        """The keys of git's configuration, and what they say."""
        return {
            "merge.contextdb.name": NAME,
            "merge.contextdb.driver": f"{self.command} merge %O %A %B --path=%P || {BY_LINES}",
            "diff.contextdb.textconv": f"{self.command} git text --",
            "diff.contextdb.xfuncname": r"^([^[:space:]].*)$",
        }

    def git(self, *arguments: str, accepts: tuple[int, ...] = (0,)) -> str:
        """What git says on standard output; an error with git's own words where it exits otherwise."""
        return _git(self.folder, *arguments, accepts=accepts)

    @property
    def where(self) -> str:
        """The name of the configuration in messages."""
        return "git's configuration for all repositories" if self.is_global else "the configuration of this clone"

    def missing_lines(self) -> list[bytes]:
        """The lines that .gitattributes does not have."""
        present = self.lines()
        return [line for line in LINES if line not in present]

    def lines(self) -> list[bytes]:
        """The lines of .gitattributes, without their ends."""
        return [line.strip() for line in self.raw().splitlines()]

    def raw(self) -> bytes:
        """What .gitattributes holds; nothing where it is missing."""
        return read_bytes(self.attributes) if self.attributes.is_file() else b""

    def value(self, key: str) -> str | None:
        output = self.git("config", self.scope, "--get", "--null", key, accepts=(0, 1))
        return output.removesuffix("\0") if output else None

    @property
    def scope(self) -> str:
        """The option of `git config`."""
        return "--global" if self.is_global else "--local"

    @contextmanager
    def all_or_nothing(self) -> Iterator[None]:
        """Put .gitattributes and the keys back as they were where not all of a change could be written."""
        raw = self.raw()
        before = {key: self.git("config", self.scope, "--get-all", "--null", key, accepts=(0, 1)) for key in self.settings}
        try:
            yield
        except BaseException:  # also when the user interrupts
            with suppress(ContextDBError):
                if self.raw() != raw:
                    self.write(raw)
            with suppress(ContextDBError):
                for key, values in before.items():
                    if self.git("config", self.scope, "--get-all", "--null", key, accepts=(0, 1)) != values:
                        self.unset(key)
                        for value in values.split("\0")[:-1]:
                            self.git("config", self.scope, "--add", key, value)
            raise

    def set(self, key: str, value: str) -> None:
        self.git("config", self.scope, "--replace-all", key, value)

    def unset(self, key: str) -> None:
        self.git("config", self.scope, "--unset-all", key, accepts=(0, 5))

    def write(self, raw: bytes) -> None:
        """Write .gitattributes; an empty one is removed."""
        if raw:
            write_atomic(self.attributes, raw)
        else:
            remove(self.attributes)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="PATH", nargs="?", default=".", help=f"the folder that contains {ATTRIBUTES} (default: .)")
    scope = parser.add_mutually_exclusive_group()
    scope.add_argument("--local", action="store_false", dest="is_global", default=False, help="configure this clone (default)")
    scope.add_argument("--global", action="store_true", dest="is_global", help="configure all repositories of this user")


def setup_of(arguments: argparse.Namespace) -> Setup:
    """What the arguments mean. Raises FileError where there is no such folder, no git, or the folder is in no repository."""
    folder = Path(arguments.path)
    if not os.path.isdir(arguments.path):
        raise FileError(Fault("there is no such folder.", "a folder of a git repository", place=Place(arguments.path)))
    if _git(folder, "rev-parse", "--is-inside-work-tree", accepts=(0, 128)).strip() != "true":
        mend = "git init, or another folder"
        raise FileError(Fault("the folder is in no git repository.", "a folder of one", f"to call {mend}", Place(str(folder))))
    return Setup(folder, arguments.is_global, getattr(arguments, "command_line", None) or own_command())


def own_command() -> str:
    """How a shell calls this contextdb: by name where that is on the path, else by its interpreter."""
    return "contextdb" if shutil.which("contextdb") else f"{shlex.quote(Path(sys.executable).as_posix())} -m contextdb"


def _git(folder: Path, *arguments: str, accepts: tuple[int, ...]) -> str:
    try:
        done = subprocess.run(["git", *arguments], cwd=folder, capture_output=True, check=False)
    except OSError as error:
        fault = Fault(f"git cannot be run: {error.strerror}.", "git on the search path", "to install git")
        raise FileError(fault, errno=error.errno) from None
    if done.returncode not in accepts:
        messages = done.stderr.decode(errors="replace").strip().splitlines()
        raise ContextDBError(
            Fault(
                f"git {arguments[0]} failed: {messages[-1] if messages else f'exit code {done.returncode}.'}",
                place=Place(str(folder)),
            )
        )
    return done.stdout.decode(errors="surrogateescape")


def changed(arguments: argparse.Namespace, steps: Sequence[Callable[[Setup], list[str]]], nothing: str) -> ExitCode:
    """Do some steps, all or none, and print what each did; `nothing` says why where none did anything."""
    setup = setup_of(arguments)
    with setup.all_or_nothing():
        lines = [line for step in steps for line in step(setup)] or [f"nothing to do: {nothing}"]
    with output():
        print(*map(printable, lines), sep="\n")
    return ExitCode.OK
