"""Which columns of a table a person hid, folded and froze, kept until the next time. An edge: this reads and writes the disk.

They are in `.contextdb-journal` next to the table, which git passes over: they are one person's own, and no part of the table.
"""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path

from contextdb.disk import read_bytes, write_atomic
from contextdb.errors import ContextDBError
from tui.model.columns_shown import ColumnsShown
from tui.model.lock import FOLDER, own_folder


def kept_path(table: Path) -> Path:
    """The file that keeps it for a table's file."""
    return table.parent / FOLDER / f"{table.name}.columns.json"


def kept_columns(table: Path) -> ColumnsShown:
    """What was kept; every column is seen where nothing was, or where it cannot be read."""
    path = kept_path(table)
    with suppress(ContextDBError, ValueError, TypeError, AttributeError):
        said = json.loads(read_bytes(path)) if path.is_file() else {}
        frozen = said.get("frozen")
        return ColumnsShown(
            frozenset(map(str, said.get("hidden", ()))),
            frozenset(map(str, said.get("folded", ()))),
            frozen if isinstance(frozen, str) else None,
        )
    return ColumnsShown()


def keep_columns(table: Path, shown: ColumnsShown) -> None:
    """Keep it; a disk that refuses does not hinder who leaves the table."""
    path = kept_path(table)
    with suppress(ContextDBError, OSError):
        if shown == ColumnsShown():
            path.unlink(missing_ok=True)
            return
        own_folder(path.parent)
        said = {"hidden": sorted(shown.hidden), "folded": sorted(shown.folded), "frozen": shown.frozen}
        write_atomic(path, (json.dumps(said, ensure_ascii=False, indent=2) + "\n").encode())
