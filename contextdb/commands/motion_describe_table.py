"""What described clips become as a table: a new one, or columns and rows filled into one that is there, with its contextdb.toml.

What stands in a cell already stays; where it does not accept what the clip shows, that is told, and replaced only where asked.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from contextdb.cells.grammar import parse_cell
from contextdb.columns import TextColumn
from contextdb.disk.together import NewFile, write_together
from contextdb.errors import ContextDBError, Fault, FileError, Place, TableError
from contextdb.files.file_names import require_new_table_name
from contextdb.files.texts import AnySource, new_source
from contextdb.motion.preparing.cells_of_clips import CONDITIONS, OUTPUTS
from contextdb.motion.preparing.describing import Described, Sections, condition_sections, table_section
from contextdb.schema.sections import settings_to_dict
from contextdb.schema.settings import Schema, read_schema
from contextdb.schema.toml_edit import absent, add_sections, set_key
from contextdb.tables.nesting.names import asset_name, asset_text
from contextdb.tables.project import SCHEMA_FILE, load_table, schema_for, settings_of
from contextdb.tables.table import Table

ASSET = "Asset Name"
NEAR_S = 0.01
"""Durations that differ by less are the same."""


@dataclass(frozen=True, slots=True)
class Difference:
    """A cell that does not accept what its clip shows."""

    row: int
    line: int | None
    asset: str
    column: str
    cell: str
    clip: str
    """The cell that the clip would have."""

    def to_json(self) -> dict[str, Any]:
        """As plain data."""
        return {name: getattr(self, name) for name in self.__slots__}

    def __str__(self) -> str:
        where = f"line {self.line}" if self.line is not None else f"row {self.row}"
        return f"{where}, {self.asset}, {self.column}: the cell is {self.cell}, the clip shows {self.clip}"


@dataclass
class DescribedTable:
    """A table as it is to be written, and what is to be said of it."""

    path: Path
    table: Table
    folder: Path
    toml: str
    toml_was: bytes | None
    source: AnySource | None = None
    differences: list[Difference] = field(default_factory=list)
    filled: int = 0
    added: list[str] = field(default_factory=list)
    """The assets of new rows."""
    without_clip: list[str] = field(default_factory=list)

    @property
    def toml_path(self) -> Path:
        """The contextdb.toml."""
        return self.folder / SCHEMA_FILE

    @property
    def is_used(self) -> bool:
        """Whether a database holds its rows, or none is declared."""
        databases = self.table.schema.databases.values()
        return not databases or any(part.get("table") == self.table.name for part in databases)

    def write(self) -> None:
        """Write the table and contextdb.toml in one step: both or neither; what says all of it already is not touched."""
        new = new_source(self.path, self.table.columns, self.table.source, self.table.origin).raw
        was = None if self.source is None else self.source.raw
        files = [] if new == was else [NewFile(self.path, new, was)]
        toml = self.toml.encode()
        files += [] if toml == self.toml_was else [NewFile(self.toml_path, toml, self.toml_was)]
        if files and not write_together(self.folder, files):
            found = "a file was changed by somebody else in this moment."
            raise FileError(Fault(found, mend="to do the same once more", place=Place(str(self.path)), rule="merge-conflict"))


def new_table(path: Path, rows: Sequence[Described], motion: Sections) -> DescribedTable:
    """The table of some rows as a new file.

    Raises
    ------
    FileError
        The file is there already, or no table can have its name.
    ContextDBError
        contextdb.toml cannot be read, or declares the conditions so that the cells cannot be read.
    """
    if path.exists():
        found = "the file is there already."
        raise FileError(Fault(found, "a file that is new", f"--into {path}, which fills what is missing", Place(str(path))))
    require_new_table_name(path)
    names = (ASSET, *CONDITIONS, *OUTPUTS)
    columns = [
        TextColumn.of(name, ([asset_text(row.asset), *row.cells.values()][i] for row in rows)) for i, name in enumerate(names)
    ]
    return _with_settings(path, columns, rows, motion)


def filled_table(path: Path, rows: Sequence[Described], motion: Sections, *, updates: bool = False) -> DescribedTable:
    """A table that is there, with the cells of clips where it has none; with `updates` also where the clip says otherwise.

    Raises
    ------
    ContextDBError
        The table or contextdb.toml cannot be read, or declares the conditions so that the cells cannot be read.
    """
    before = load_table(path, strict=False)
    known = {row.asset: row for row in rows}
    assets = [asset_name(cell) for cell in before.assets]
    columns = list(before.columns)
    columns += [TextColumn.of(name, [""] * before.n_rows) for name in (*CONDITIONS, *OUTPUTS) if name not in _names(columns)]
    added = [row for row in rows if row.asset not in set(assets)]
    filled, differences = 0, []
    for i, column in enumerate(columns):
        if column.name == before.asset_column:
            columns[i] = column.with_inserted(before.n_rows, [asset_text(row.asset) for row in added])
            continue
        texts = [row.cells.get(column.name, "") for row in added]
        for at, asset in enumerate(assets):
            cell = known[asset].cells.get(column.name, "") if asset in known else ""
            if not cell or column[at] == cell:
                continue
            if not column[at].strip():
                columns[i] = columns[i].with_text(at, cell)
                filled += 1
            elif not _accepts(before, column.name, column[at], known[asset]):
                differences.append(Difference(at, before.place(at).line, asset, column.name, column[at], cell))
                columns[i] = columns[i].with_text(at, cell) if updates else columns[i]
        columns[i] = columns[i].with_inserted(before.n_rows, texts)
    origin = np.concatenate((before.origin, np.full(len(added), -1)))
    made = _with_settings(path, columns, rows, motion, before, origin)
    made.differences, made.filled, made.added = differences, filled, [row.asset for row in added]
    made.without_clip = [asset for asset in dict.fromkeys(assets) if asset not in known]
    return made


def _names(columns: Sequence[TextColumn]) -> set[str]:
    return {column.name for column in columns}


def _accepts(table: Table, column: str, text: str, row: Described) -> bool:
    """Whether a cell accepts what a clip shows; one that cannot be read does not."""
    facts = row.facts
    direction = facts.direction_deg
    values: dict[str, object] = {
        "gait": facts.gait,
        "speed": facts.speed_mps.middle,
        "direction": None if direction is None else (direction.middle + 180.0) % 360.0 - 180.0,
        "turn": facts.turn_dps.middle,
        "style": facts.style,
    }
    if column not in values:
        return _same_output(text, row.cells[column])
    condition = table.schema.conditions.get(column)
    if condition is None or values[column] is None:
        return True
    try:
        return parse_cell(text, condition.domain, wants_mend=False).holds(values[column])
    except ContextDBError:
        return False


def _same_output(text: str, cell: str) -> bool:
    try:
        return abs(float(text) - float(cell)) <= NEAR_S
    except ValueError:
        return text.strip() == cell


# ---- contextdb.toml


def _with_settings(
    path: Path,
    columns: Sequence[TextColumn],
    rows: Sequence[Described],
    motion: Sections,
    before: Table | None = None,
    origin: np.ndarray[tuple[int], np.dtype[np.int64]] | None = None,
) -> DescribedTable:
    """The table under a contextdb.toml that declares what it needs; what is declared already stays."""
    folder, schema = schema_for(path)
    file = folder / SCHEMA_FILE
    raw = file.read_bytes() if file.is_file() else None
    text = "" if raw is None else raw.decode("utf-8-sig")
    now = _toml(text, folder, path, rows, motion, schema, columns, before)
    toml = now if raw is None or not raw.startswith(b"\xef\xbb\xbf") else "\ufeff" + now
    after = read_schema(now, str(file))
    settings = settings_of(path, folder, after)
    table = Table.build(settings.name, columns, after, settings, path, None if before is None else before.source)
    table = replace(table, origin=np.full(table.n_rows, -1) if origin is None else origin)
    if faults := table.faults:
        raise TableError(*faults)
    return DescribedTable(path, table, folder, toml, raw, None if before is None else before.source)


def _toml(
    text: str,
    folder: Path,
    path: Path,
    rows: Sequence[Described],
    motion: Sections,
    schema: Schema,
    columns: Sequence[TextColumn],
    before: Table | None,
) -> str:
    if not text.strip():
        text = set_key("", ("project", "name"), folder.resolve().name or "tables")
    settings = settings_of(path, folder, schema)
    below = path.resolve().relative_to(folder.resolve()).as_posix()
    asset = ASSET if before is None else before.asset_column
    wanted = _missing(condition_sections(rows), text)
    if settings.name not in schema.tables:
        wanted[("tables", settings.name)] = table_section(rows, asset, below)
    else:
        said = settings_to_dict(settings).get("outputs") or {}
        outputs: dict[str, Any] = dict(said) if isinstance(said, Mapping) else {name: {"type": "text"} for name in _list(said)}
        typed: Any = table_section(rows, asset, below)["outputs"]
        more = {name: each for name, each in typed.items() if name not in outputs}
        if more:
            text = set_key(text, ("tables", settings.name, "outputs"), {**outputs, **more})
    wanted |= _missing(motion, text)
    return add_sections(text, dict(wanted.items())) if wanted else text


def _missing(sections: Sections, text: str) -> Sections:
    """Those sections of which nothing is in a text."""
    there = set(absent(text, list(sections)))
    return {path: said for path, said in sections.items() if path in there}


def _list(value: object) -> list[str]:
    return [str(each) for each in value] if isinstance(value, (list, tuple)) else []
