"""Give a table another name in its project, copy it, or delete it, with the files beside it: saved contexts, notes and actors.

A rename goes with it into contextdb.toml (its section, contracts about it, variants of it) and into the rows of other tables that
refer to it. An edge: all files are worked out first and written in one step; then the old ones are removed.
"""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any

from contextdb.cells.words import MARK
from contextdb.disk import ACTORS_SUFFIX, CASES_SUFFIX, GAPS_SUFFIX, NOTES_SUFFIX, read_bytes, real_path, remove
from contextdb.disk.boundary import inside
from contextdb.disk.together import NewFile, write_together
from contextdb.edits.project_files import ProjectFiles, Rewrite, TableFile
from contextdb.edits.renaming import rewritten, with_texts
from contextdb.errors import Fault, TableError, in_quotes, some
from contextdb.schema.settings import EMPTY
from contextdb.tables.project import read_folder_schema, table_files

COMPANIONS = (CASES_SUFFIX, NOTES_SUFFIX, GAPS_SUFFIX, ACTORS_SUFFIX)


def copy_table(folder: Path, old: str, new: str) -> Path:
    """Copy a table of a project under another name; gives the file. Raises TableError, SchemaError or FileError."""
    files = _files(folder, old, new)
    toml = _toml(folder, lambda document: _section(document, folder, old, new, keeps=True), {})
    _write(folder, files, toml)
    return next(iter(files.values())).path


def rename_table(folder: Path, old: str, new: str) -> Path:
    """Give a table of a project another name; gives the file. Raises TableError, SchemaError or FileError."""

    def change(document: dict[str, Any]) -> None:
        _section(document, folder, old, new)
        for part in document.get("contracts", {}).values():
            part |= {"table": new} if part.get("table") == old else {}
        for part in document.get("tables", {}).values():
            part |= {"base": new} if part.get("base") == old else {}

    files = _files(folder, old, new)
    _write(folder, files, [*_toml(folder, change, {old: new}), *_referring(folder, old, new)])
    for path in files:
        remove(path)
    return next(iter(files.values())).path


def delete_table(folder: Path, name: str) -> None:
    """Delete a table and the files beside it; its section of contextdb.toml goes, too. Raises TableError where rows of other tables
    refer to it, or contextdb.toml does; SchemaError or FileError."""
    if users := [
        file.name for file in _others(folder, name) if any(_inner(text) == name for c in file.columns for text in c.texts)
    ]:
        raise TableError(Fault(f"rows of {some(users)} refer to {in_quotes(MARK + name)}.", "a table that nothing refers to"))

    def change(document: dict[str, Any]) -> None:
        document.get("tables", {}).pop(name, None)

    files = _files(folder, name, name)
    _write(folder, {}, _toml(folder, change, {}))
    for path in files:
        remove(path)


# ---- parts


def _paths(folder: Path) -> dict[str, Path]:
    paths: dict[str, Path] = {}
    for name, path in table_files(folder, read_folder_schema(folder)):
        paths.setdefault(name, path)
    return paths


def _files(folder: Path, old: str, new: str) -> dict[Path, NewFile]:
    """The table's file and those beside it, each with what it is under the new name."""
    paths = _paths(folder)
    if new != old and (new in paths or new in read_folder_schema(folder).tables):
        raise TableError(Fault(f"there is a table {in_quotes(new)} already.", "a name that no table has"))
    table = inside(paths[old], folder)
    pairs = [(table, table.with_name(new + table.suffix))]
    pairs += [(table.with_name(table.stem + suffix), table.with_name(new + suffix)) for suffix in COMPANIONS]
    return {path: NewFile(inside(to, folder), read_bytes(path), None) for path, to in pairs if path.is_file()}


def _section(document: dict[str, Any], folder: Path, old: str, new: str, keeps: bool = False) -> None:
    tables = document.get("tables", {})
    if old not in tables:
        return
    part = deepcopy(tables[old])
    if "file" in part:
        path = Path(part["file"])
        part["file"] = path.with_name(new + path.suffix).as_posix()
    document["tables"] = {name: one for name, one in tables.items() if keeps or name != old} | {new: part}


def _toml(folder: Path, change: Any, moved: dict[str, str]) -> list[Rewrite]:
    return list(ProjectFiles.read_in(folder, EMPTY).rewritten_toml(change, moved, kind="tables"))


def _others(folder: Path, name: str) -> Iterator[TableFile]:
    """The other tables that can be read; one that cannot refers to nothing."""
    project = ProjectFiles.read_in(folder, EMPTY)
    return (project.table_file(other, path) for other, path in _paths(folder).items() if other != name)


def _inner(text: str) -> str:
    return text.strip().removeprefix(MARK) if text.strip().startswith(MARK) else ""


def _referring(folder: Path, old: str, new: str) -> Iterator[Rewrite]:
    for file in _others(folder, old):
        columns = [
            with_texts(c, {text: MARK + new for text in c.texts if _inner(text) == old}) if c is file.assets else c
            for c in file.columns
        ]
        yield from rewritten(file.path, file.source, file.columns, columns)


def _write(folder: Path, files: dict[Path, NewFile], rewrites: list[Rewrite]) -> None:
    new = [*files.values(), *(NewFile(real_path(one.path), one.after, one.before) for one in rewrites)]
    if new and not write_together(folder, new):
        raise TableError(Fault("a file was changed meanwhile, or has the name already.", "a folder at rest", "to do it again"))
