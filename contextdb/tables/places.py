"""What a TABLE on the command line means: a file, a table's name in the folder here or in tables/, or a folder of one table."""

from __future__ import annotations

import os
from pathlib import Path

from contextdb.compiled.table import CompiledTable
from contextdb.disk import TABLE_SUFFIXES, TENSORS_SUFFIX, path_in_quotes
from contextdb.errors import Fault, FileError, Place, TableError, nearest, plural, safe_text
from contextdb.files.file_names import composed
from contextdb.tables.project import SCHEMA_FILE, load_table, read_folder_schema, table_files, twice_named

FOLDERS = (Path(), Path("tables"))
MOST_NAMED = 6
SAMPLES = ("contested_catch", "hit_mid_air", "locomotion")
"""The sample tables, which a checkout has and an installation makes."""


def open_compiled(text: str) -> CompiledTable:
    """The compiled table that TABLE means: a .safetensors artefact opened, or a table read and compiled."""
    path = table_path(text)
    return CompiledTable.open(path) if path.suffix == TENSORS_SUFFIX else load_table(path).compile()


def table_path(text: str) -> Path:
    """The file of the table that TABLE means. Raises FileError, TableError or SchemaError where there is no such table (with the
    nearest there is), more than one is meant, or a contextdb.toml cannot be read."""
    path = Path(text)
    if os.path.isdir(text):  # os.path says no, where Path raises, to a name that no file can have
        return _only_table(path)
    if os.path.exists(text):
        return path
    tables = [_tables_in(folder) for folder in FOLDERS]
    for here in tables:
        named = [(name, file) for name, file in here if composed(name) == composed(text)]
        if faults := twice_named(named):
            raise TableError(*faults)
        if named:
            return named[0][1]
    raise _no_table(path, [word for here in tables for name, file in here for word in (name, str(file))])


def _only_table(folder: Path) -> Path:
    tables = _tables_in(folder)
    if len(tables) != 1:
        names = ", ".join(path_in_quotes(file) for _, file in tables[:MOST_NAMED])
        if len(tables) > MOST_NAMED:
            names += f" and {len(tables) - MOST_NAMED} more"
        names = names or f"a folder that holds a {' or '.join(TABLE_SUFFIXES)} file"
        raise TableError(Fault(f"the folder holds {plural(len(tables), 'table')}; one is wanted.", names, place=Place(str(folder))))
    return tables[0][1]


def _tables_in(folder: Path) -> list[tuple[str, Path]]:
    if not folder.is_dir() or (folder == Path() and not (folder / SCHEMA_FILE).is_file()):
        return []
    return list(table_files(folder, read_folder_schema(folder)))


def _no_table(path: Path, known: list[str]) -> FileError:
    beside = [path.parent / name for name in _files_in(path.parent)]
    files = [str(p) for p in beside if p.name.endswith((*TABLE_SUFFIXES, TENSORS_SUFFIX)) or (p / SCHEMA_FILE).is_file()]
    near = nearest(str(path), [*known, *files])
    accepted = "a file, a folder of one table, or the name of a table of the project"
    mend = path_in_quotes(near) if near else ""
    if not near and path.stem in SAMPLES:
        mend = "to make the sample tables with contextdb demo --keep FOLDER"
    place = Place(safe_text(str(path), most=4096))
    return FileError(Fault("there is no such table.", accepted, mend, place, "no-such-path"))


def _files_in(folder: Path) -> list[str]:
    return sorted(os.listdir(folder)) if os.path.isdir(folder) else []
