"""How to begin where there is no table: with an empty one, from a file of another program, or from the clipboard.

Reads what files a folder holds; writes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from contextdb.columns import TextColumn
from contextdb.disk import TABLE_SUFFIXES, read_bytes
from contextdb.errors import ContextDBError
from contextdb.exchange.formats import ReadOptions, read
from contextdb.schema.settings import TableSettings
from contextdb.tables.project import read_folder_schema
from contextdb.tables.table import Table

from .importing import suffixes_read
from .new_table import ASSET, name_fault

WORKBOOKS = (".xlsx", ".xlsm", ".xls")
MOST_FILES = 5
"""So many files of a folder are offered to be read."""


@dataclass(frozen=True)
class Beginning:
    """A folder in which a table may be made, and what was requested."""

    folder: Path
    name: str = ""
    """The name that was requested; empty: the dialog requests one."""
    source: Path | None = None
    """The file that was requested, which a new table can be read from."""
    near: str = ""
    """The nearest name that there is, as it would be typed."""

    @property
    def files(self) -> list[Path]:
        """Files of the folder that a table can be read from, the newest first."""
        kinds = tuple(suffix for suffix in suffixes_read() if suffix not in TABLE_SUFFIXES)
        paths = [file for file in self.folder.iterdir() if file.is_file() and file.name.lower().endswith(kinds)]
        return sorted((f for f in paths if not f.name.endswith(".actors.json")), key=lambda f: -f.stat().st_mtime)[:MOST_FILES]

    def proposed_name(self, source: Path | None, taken: list[str]) -> str:
        """A name for a table that is read from a file: that of the file, or that with a number behind it."""
        stem = self.name or (source.stem if source is not None else "table")
        names = [stem, *(f"{stem}_{n}" for n in range(2, 100))]
        return next((name for name in names if not name_fault(self.folder, name, taken)), "")


def beginning(path: Path, error: ContextDBError | None = None) -> Beginning | None:
    """How to begin with a path: `error` is why it is no table. None: it is a table, or nothing can begin there."""
    if error is None:
        return None if path.suffix.lower() in TABLE_SUFFIXES else beginning_from(path)
    fault = error.faults[0]
    if fault.rule != "no-such-path" or not path.name or not path.parent.is_dir() or path.suffix not in ("", ".csv"):
        return None
    return Beginning(path.parent, path.stem, near=fault.mend.strip('"'))


def beginning_from(path: Path) -> Beginning | None:
    """How to begin with a file that is no table of ours; None: the import cannot read it either."""
    try:
        if path.suffix.lower() not in WORKBOOKS:  # of these the sheet, and the row of its names, are requested
            read(read_bytes(path), str(path), ReadOptions())
    except ContextDBError:
        return None
    return Beginning(path.parent, source=path)


def empty_table(folder: Path, name: str) -> Table:
    """A table without rows that is not on the disk yet: what `make_table` makes."""
    columns = (TextColumn.of(ASSET, ()),)
    return Table.build(name, columns, read_folder_schema(folder), TableSettings(name), folder / f"{name}.csv")
