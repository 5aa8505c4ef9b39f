"""What a TABLE on the command line means: a file, a table's name in the folder here or in tables/, or a folder of one table."""

from __future__ import annotations

from pathlib import Path

from contextdb.compiled import CompiledTable
from contextdb.errors import Fault, FileError, Place, TableError, in_quotes, nearest, plural, some
from contextdb.project import SCHEMA_FILE, TABLE_SUFFIXES, load_table, read_folder_schema, table_files

FOLDERS = (Path(), Path("tables"))


def open_compiled(text: str) -> CompiledTable:
    """The compiled table that TABLE means: a .safetensors artefact opened, or a table read and compiled."""
    if text.endswith(".safetensors") and Path(text).exists():
        return CompiledTable.open(text)
    return load_table(table_path(text)).compile()


def table_path(text: str) -> Path:
    """The file of the table that TABLE means."""
    path = Path(text)
    if path.is_file():
        return path
    if path.is_dir():
        return _only_table(path)
    known = {name: file for folder in FOLDERS for name, file in _tables_in(folder)}
    if text in known:
        return known[text]
    raise _no_table(path, list(known))


def _only_table(folder: Path) -> Path:
    tables = _tables_in(folder)
    if len(tables) != 1:
        names = some(str(file) for _, file in tables) or f"a folder that holds a {' or '.join(TABLE_SUFFIXES)} file"
        raise TableError(Fault(f"the folder holds {plural(len(tables), 'table')}; one is wanted.", names, place=Place(str(folder))))
    return tables[0][1]


def _tables_in(folder: Path) -> list[tuple[str, Path]]:
    if not folder.is_dir() or (folder == Path() and not (folder / SCHEMA_FILE).is_file()):
        return []
    return list(table_files(folder, read_folder_schema(folder)))


def _no_table(path: Path, names: list[str]) -> FileError:
    folder = path.parent
    files = [str(folder / p.name) for p in folder.iterdir() if p.suffix in TABLE_SUFFIXES] if folder.is_dir() else []
    near = nearest(str(path), [*files, *names]) or nearest(path.name, names)
    accepted = "a .csv, .parquet or .safetensors file, or the name of a table of the project"
    return FileError(Fault("there is no such table.", accepted, in_quotes(near) if near else "", Place(str(path)), "no-such-path"))
