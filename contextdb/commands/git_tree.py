"""The tables of a folder as they are in a commit, read from git's objects into another folder. An edge: it runs git.

A ref is never an option of git: it is looked up once, behind `--end-of-options`, and git is then given the hash of the commit.
A folder that is made to look like a repository of its own is none. Blobs are read as they are, without filters, hooks or replaced
objects, and only contextdb.toml, tables and saved contexts are written, as plain files: no link, and no name that leads out of the
folder.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from contextdb.disk import TABLE_SUFFIXES, make_folder, read_bytes, write_atomic
from contextdb.disk.git import LFS_POINTER, is_in_a_repository, run_git
from contextdb.errors import ContextDBError, ContextError, Fault, FileError, Place, in_quotes, safe_text
from contextdb.files.file_names import alike
from contextdb.schema.settings import extends_of
from contextdb.tables.other_files import cases_path
from contextdb.tables.project import SCHEMA_FILE, read_folder_schema

MOST_EXTENDED = 16
"""So many projects extend each other in a row."""

_PLAIN_FILES = ("100644", "100755")


@dataclass(frozen=True)
class Commit:
    """A commit of the repository that a folder is in."""

    folder: Path
    ref: str
    hash: str

    @classmethod
    def of(cls, folder: Path, ref: str) -> Commit:
        """The commit that a ref names. Raises ContextError where there is none, and FileError where there is no git or no
        repository."""
        if not is_in_a_repository(folder):
            sentence = "the folder is in no git repository, so that there is nothing to compare with."
            raise FileError(Fault(sentence, "--baseline FILE, or a folder of a repository", place=Place(str(folder))))
        code, commit = (1, b"") if _is_no_ref(ref) else run_git(folder, *_lookup(ref))
        if code == 0:
            return cls(folder, ref, commit.decode("ascii", "replace").strip())
        is_shallow = run_git(folder, "rev-parse", "--is-shallow-repository")[1].strip() == b"true"
        mend = "git fetch --unshallow, or fetch-depth: 0 of actions/checkout, as this clone is shallow" if is_shallow else ""
        if not mend and not _is_no_ref(ref) and run_git(folder, *_lookup(f"origin/{ref}"))[0] == 0:
            mend = in_quotes(f"origin/{ref}")
        raise ContextError(Fault(f"git has no commit {in_quotes(ref)} here.", "a branch, a tag or a commit of this clone", mend))

    @property
    def name(self) -> str:
        """The commit in words."""
        return f"{safe_text(self.ref)} (commit {self.hash[:12]})"

    def tables_into(self, root: Path) -> Path | None:
        """Write the folder's tables, as they are in the commit, into an empty folder, at their path in the repository, with what
        their project extends; gives their folder, None where it has no file there. Raises ContextDBError where its contextdb.toml
        cannot be read, or git does not have a file."""
        prefix = run_git(self.folder, "rev-parse", "--show-prefix")[1].decode("utf-8", "surrogateescape").strip("\n")
        target = root.joinpath(*PurePosixPath(prefix).parts)
        code, listed = run_git(self.folder, "ls-tree", "-r", "-z", "--full-tree", f"{self.hash}:{prefix.rstrip('/')}")
        blobs = dict(_plain_files(listed)) if code == 0 else {}
        make_folder(root / ".git")  # what is extended may climb to here
        if SCHEMA_FILE in blobs:
            self._write(blobs, [SCHEMA_FILE], target)
            self._write_extended(target / SCHEMA_FILE, root)
        schema = read_folder_schema(target)
        declared = {alike(file) for settings in schema.tables.values() for file in settings.files}
        expected = {alike(settings.expected) for settings in schema.tables.values() if settings.expected is not None}
        declared |= expected | {alike(cases_path(Path(file)).as_posix()) for file in declared}
        wanted = [name for name in blobs if _is_tabular(name) and ("/" not in name or alike(name) in declared)]
        self._write(blobs, wanted, target)
        return target if wanted else None

    def _write_extended(self, schema: Path, root: Path) -> None:
        """Write what a contextdb.toml extends, as it is in the commit; what the commit does not have is missed by whoever reads."""
        for _ in range(MOST_EXTENDED):
            extends = extends_of(read_bytes(schema).decode("utf-8", "replace"), str(schema))
            schema = Path(os.path.normpath(schema.parent / (extends or ".")))
            if extends is None or not schema.is_relative_to(root) or schema.exists():
                return
            name = schema.relative_to(root).as_posix()
            code, listed = run_git(self.folder, "ls-tree", "-z", "--full-tree", self.hash, name)
            blobs = dict(_plain_files(listed)) if code == 0 else {}
            if name not in blobs:
                return
            self._write(blobs, [name], root)

    def _write(self, blobs: dict[str, str], names: list[str], target: Path) -> None:
        if not names:
            return
        request = "".join(f"{blobs[name]}\n" for name in names).encode()
        code, out = run_git(self.folder, "cat-file", "--batch", given=request)
        at = 0
        for name in names:
            head, _, _ = out[at : at + 200].partition(b"\n")
            parts = head.split()
            if code != 0 or len(parts) != 3 or parts[1] != b"blob":
                raise ContextDBError(Fault("git does not have the contents of the file.", place=Place(f"{self.ref}:{name}")))
            start = at + len(head) + 1
            raw = out[start : start + int(parts[2])]
            at = start + len(raw) + 1
            if raw.startswith(LFS_POINTER):
                sentence = "the file is a pointer of Git LFS: its contents are not in git."
                raise ContextDBError(Fault(sentence, "--baseline FILE, a report of that commit", place=Place(f"{self.ref}:{name}")))
            path = target.joinpath(*PurePosixPath(name).parts)
            make_folder(path.parent)
            write_atomic(path, raw, syncs=False)


def _lookup(ref: str) -> tuple[str, ...]:
    return "rev-parse", "--verify", "--quiet", "--end-of-options", f"{ref}^{{commit}}"


def _is_no_ref(ref: str) -> bool:
    """Whether no commit can be named so: git would take it for an option, or the system for the end of a text."""
    return not ref.strip() or ref.startswith("-") or not ref.isprintable()


def _plain_files(listed: bytes) -> Iterator[tuple[str, str]]:
    """Name and object of each plain file of a listed tree; a name that could lead elsewhere is passed over."""
    for entry in listed.split(b"\0"):
        about, _, raw_name = entry.partition(b"\t")
        mode, _, blob = about.decode("ascii", "replace").partition(" blob ")
        name = raw_name.decode("utf-8", "surrogateescape")
        parts = name.split("/")
        is_safe = all(part not in ("", ".", "..") and not set(part) & {"\\", ":", "\0"} for part in parts)
        if mode in _PLAIN_FILES and is_safe and not any(alike(part) == ".git" for part in parts):
            yield name, blob


def _is_tabular(name: str) -> bool:
    return name.lower().endswith(TABLE_SUFFIXES)
