"""What somebody chose when a file was imported, for the next file of that name. An edge: this touches the disk.

It is kept in a folder of our own beside the tables, which git passes over. Numbers in a name do not count, so that "moves_W13.xlsx"
is read as "moves_W12.xlsx" was. A chosen last row is not kept: the next file has other rows.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from contextdb.columns import TextColumn
from contextdb.disk.own_files import FOLDER, has_own, make_own_folder, read_own, write_own
from contextdb.errors import ContextDBError
from contextdb.exchange.mapping import Mapped, as_condition, as_job, as_type
from contextdb.exchange.reading import Reading
from contextdb.schema.settings import Schema

MOST = 200
"""Files of which the choices are kept; the oldest go."""
_LAST_ROW = re.compile(r"(?<=[A-Za-z])\d+$")


@dataclass(frozen=True)
class Choices:
    """What somebody chose; empty where the file decides."""

    sheet: str = ""
    """A sheet, cells of one, or both: "Moves!A5:F20", and to the last row of column F "Moves!A5:F"."""
    decimal: str = ""
    names: str = ""
    pairs: str = ""
    mode: str = ""
    """Which rows come, as the editor calls it."""
    columns: Mapping[str, Sequence[str]] = field(default_factory=dict)
    """For a column of the file its job, its name in the table, and its type if it is a new condition."""

    def without_last_row(self) -> Choices:
        """The same for another file, with all of its rows."""
        return replace(self, sheet=_LAST_ROW.sub("", self.sheet) if ":" in self.sheet else self.sheet)

    def applied(self, mapped: Sequence[Mapped], reading: Reading, schema: Schema) -> list[Mapped]:
        """What was proposed for the columns of a file, changed as somebody chose; what cannot be so any more stays."""
        return [self._applied(column, reading.column(column.source), schema) for column in mapped]

    def _applied(self, mapped: Mapped, column: TextColumn, schema: Schema) -> Mapped:
        job, name, kind = (*self.columns.get(mapped.source, ()), "", "", "")[:3]
        with suppress(ContextDBError):
            if job == "condition" and name in schema.conditions:
                return as_condition(mapped, column, name, schema)
            if job:
                new = replace(mapped, name=name)
                return as_type(new, column, kind) if job == "condition" else as_job(new, job)
        return mapped


NOTHING_CHOSEN = Choices()


def chosen_columns(mapped: Sequence[Mapped]) -> dict[str, Sequence[str]]:
    """What to keep of columns that somebody decided."""
    chosen = (column for column in mapped if column.why.startswith("chosen"))
    return {column.source: (column.job, column.name, column.kind if column.is_new else "") for column in chosen}


def choices_of(folder: Path, file: str) -> Choices | None:
    """What was chosen for a file of this name when it came into a folder; None where nothing is known."""
    known = _all(folder).get(_key(file))
    if known is None:
        return None
    texts = {key: known[key] for key in ("sheet", "decimal", "names", "pairs", "mode") if isinstance(known.get(key), str)}
    columns = known.get("columns")
    listed = {key: one for key, one in columns.items() if isinstance(one, list)} if isinstance(columns, dict) else {}
    return replace(Choices(columns={key: tuple(map(str, one)) for key, one in listed.items()}), **texts)


def remember(folder: Path, file: str, choices: Choices) -> None:
    """Keep what was chosen, where anything was; a disk that refuses hinders nobody."""
    others = {key: value for key, value in _all(folder).items() if key != _key(file)}
    if choices != Choices():
        others[_key(file)] = asdict(choices.without_last_row())
    elif len(others) == len(_all(folder)):
        return
    with suppress(ContextDBError, OSError):
        make_own_folder(folder / FOLDER)
        document = dict(list(others.items())[-MOST:])
        write_own(_path(folder), (json.dumps(document, ensure_ascii=False, indent=1) + "\n").encode())


def _all(folder: Path) -> dict[str, dict[str, Any]]:
    with suppress(ContextDBError, OSError, ValueError, RecursionError):
        document = json.loads(read_own(_path(folder))) if has_own(_path(folder)) else {}
        return {key: one for key, one in document.items() if isinstance(one, dict)} if isinstance(document, dict) else {}
    return {}


def _path(folder: Path) -> Path:
    return folder / FOLDER / "imports.json"


def _key(file: str) -> str:
    return re.sub(r"\d+", "0", Path(file).name.casefold())
