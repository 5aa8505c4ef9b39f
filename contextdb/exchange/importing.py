"""Import: what a reading becomes as a table of a project, decided first, then written. An edge: this touches the disk.

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

import numpy as np

from contextdb.cells.conditions import Condition
from contextdb.cells.words import quoted
from contextdb.columns import TextColumn
from contextdb.disk import TABLE_SUFFIXES, real_path, write_atomic
from contextdb.disk.own_files import FOLDER, has_own, make_own_folder, read_own, write_own
from contextdb.disk.together import NewFile, write_together
from contextdb.edits.notes import Notes
from contextdb.edits.schema_file import SchemaChange, schema_change
from contextdb.errors import ContextDBError, Fault, FileError, Place, TableError, in_quotes
from contextdb.exchange.mapping import COLUMN_JOBS, Mapped, as_condition, as_job, as_type, propose
from contextdb.exchange.reading import Reading, commas_in_numbers, listed
from contextdb.files.file_names import alike
from contextdb.files.texts import AnySource, new_source
from contextdb.schema.sections import condition_to_dict, job_faults
from contextdb.schema.settings import Schema, TableSettings, conditions_from_dict, settings_renamed, with_outputs
from contextdb.tables.project import below, schema_for, settings_of, twice_named
from contextdb.tables.table import Table

NAMES = {"whole": "each text is one name", "words": "each word is a name"}
"""How the texts of a column that nobody declares may be read, as `--names` and the dialog of the editor call it."""


def has_whole_names(names: str | None, path: Path | None) -> bool | None:
    """Whether a text is one name, where that is said; else not in a table of ours, and None, which leaves it to the format."""
    if names:
        return names == "whole"
    return False if path is not None and _is_of_a_project(path) else None


def _is_of_a_project(path: Path) -> bool:
    """Whether a contextdb.toml declares a file as a table, so that its cells are cells of ours."""
    if path.suffix.lower() not in TABLE_SUFFIXES or not path.is_file():
        return False
    try:
        folder, schema = schema_for(path)
    except ContextDBError:  # it is no concern of this import
        return False
    name = (real_path(path.parent) / path.name).relative_to(real_path(folder)).as_posix()
    return any(name in settings.files for settings in schema.tables.values())


def whole_names_sentence(columns: Sequence[Mapped], reading: Reading, other_way: str) -> str:
    """Which columns have texts that became one name each though blanks part names in a cell, with the first such text.

    `other_way` says how to read each word as a name; the sentence is empty where there is no such text.
    """
    changed = [(column.source, text) for column in columns for text in _whole(column, reading.column(column.source))]
    names = list(dict.fromkeys(name for name, _ in changed))
    example = next((text for _, text in changed), None)
    if example is None:
        return ""
    where = "column" if len(names) == 1 else "columns"
    return f"{where} {listed(names)}: each text is one name, such as {in_quotes(example)}; {other_way} reads each word as a name."


def decimal_commas_reported(columns: Sequence[Mapped], reading: Reading, schema: Schema, other_way: str) -> list[str]:
    """What a person should know of numbers with commas, a sentence for each column; `other_way` reads them as decimals."""
    messages = list[str]()
    for column, cells in zip(columns, reading.columns, strict=True):
        condition = schema.conditions.get(column.name)
        kind = column.declared["type"] if column.declared else condition.domain.kind if condition is not None else None
        if column.job == "condition" and kind is not None:
            messages += commas_in_numbers(column.source, str(kind), column.cells or cells, other_way)
    return messages


@dataclass(frozen=True, eq=False)
class Plan:
    """A table that is about to be written, and what contextdb.toml will say of it."""

    path: Path
    columns: tuple[Mapped, ...]
    table: Table
    change: SchemaChange | None
    """What contextdb.toml becomes; None where it says all of it already."""
    field_of: tuple[int, ...]
    """The column of the reading that each column of the table came from."""
    spots: Mapping[tuple[int, str], tuple[str, str]] = field(default_factory=dict)
    """As those of the reading."""

    @property
    def new_conditions(self) -> list[str]:
        """The conditions that contextdb.toml will newly declare."""
        return [column.name for column in self.columns if column.is_new and column.job == "condition"]

    def write(self) -> None:
        """Write the table and contextdb.toml in one step: both or neither. Raises FileError or TableError where the disk refuses, a
        text cannot be written, or somebody else has changed contextdb.toml since it was read; what stood there before is then
        whole."""
        table = self.table
        new = NewFile(self.path, new_source(self.path, table.columns, table.source, table.origin, self.field_of).raw)
        change = self.change
        if change is None:
            write_atomic(new.path, new.data)
        elif not write_together(change.path.parent, [new, change.new_file]):
            raise FileError(change.fault)
        if self.spots:
            notes = Notes.read(self.path, or_more=True)
            notes_of(self.spots, self.columns, table.assets, table.asset_column, notes).write(self.path)


def notes_of(
    spots: Mapping[tuple[int, str], tuple[str, str]],
    columns: Sequence[Mapped],
    assets: Sequence[str],
    asset_column: str,
    notes: Notes,
) -> Notes:
    """Notes with those of a reading whose columns became others; a note on a column that is left out stands at the asset. `assets`
    are those of the rows of the reading."""
    names = {one.source: asset_column if one.job in ("asset", "left out") else one.name for one in columns}
    for (row, source), (text, colour) in spots.items():
        if colour:
            notes = notes.with_colour([assets[row]], colour)
        if text:
            notes = notes.with_note(assets[row], names.get(source, asset_column), text)
    return notes


def plan_import(
    reading: Reading, path: Path, renames: Mapping[str, str] | None = None, mapped: Sequence[Mapped] | None = None
) -> Plan:
    """Decide what a reading becomes as the table file `path`. `renames` is as in `contextdb.exchange.mapping.propose`; `mapped` is
    what becomes of each column, where a person decided. Raises ContextDBError where contextdb.toml cannot be read or could not say
    this, or the columns do not make a table."""
    schema, settings = project_of(path)
    columns = tuple(mapped) if mapped is not None else propose(reading, schema, settings, renames)
    table, field_of = table_of(reading, columns, schema, settings, path)
    before = replace(table, schema=schema, settings=settings)
    return Plan(path, columns, table, schema_change(before, table), field_of, reading.spots)


def project_of(path: Path) -> tuple[Schema, TableSettings]:
    """What contextdb.toml declares for a table file that is there or not yet, and what it says of this table. Raises TableError
    where it declares a table of this name in another file."""
    folder, schema = schema_for(path)
    settings = settings_of(path, folder, schema)
    declared = schema.tables[settings.name].files if settings.name in schema.tables else ()
    if declared and alike(below(path, folder)) not in map(alike, declared):
        raise TableError(*twice_named([(settings.name, folder / declared[0]), (settings.name, path)]))
    return schema, settings


def table_of(
    reading: Reading, mapped: Sequence[Mapped], schema: Schema, settings: TableSettings, path: Path | None = None
) -> tuple[Table, tuple[int, ...]]:
    """The table that columns become, and the column of the reading that each came from. Raises TableError where no column
    names the assets, or two do, or a column has no place under its name; SchemaError for a new condition that
    contextdb.toml could not hold."""
    retained = [(at, column) for at, column in enumerate(mapped) if column.job != "left out"]
    assets = [column for _, column in retained if column.job == "asset"]
    if len(assets) != 1:
        problem = "no column names the assets." if not assets else f"{len(assets)} columns name the assets."
        raise TableError(Fault(problem, "one column of names", place=Place(str(path) if path else None)))
    declared = {c.name: c.declared for _, c in retained if c.is_new and c.job == "condition" and c.declared is not None}
    beside = _named_beside(reading, [column for _, column in retained], schema)
    schema = replace(schema, conditions={**schema.conditions, **conditions_from_dict(declared), **beside})
    settings = _settings(settings, retained, reading)
    faults = list(job_faults(settings, [column.name for _, column in retained], schema))
    if faults:
        raise TableError(*(fault.at(Place(str(path) if path else None)) for fault in faults))
    texts = [_renamed(column.cells or reading.columns[at], column.name) for at, column in retained]
    source, field_of = _source(reading, path), tuple(at for at, _ in retained)
    table = Table.build(settings.name, texts, schema, settings, path, source)
    return replace(table, origin=np.arange(table.n_rows) if source else np.full(table.n_rows, -1)), field_of if source else (
        -1,
    ) * len(retained)


def _named_beside(reading: Reading, retained: Sequence[Mapped], schema: Schema) -> dict[str, Condition]:
    """Conditions that the file declares and that are not columns: facts that its rules name, where those come in."""
    if not any(column.job == "when" for column in retained):
        return {}
    taken = {*reading.names, *(column.name for column in retained), *schema.conditions}
    return {name: condition for name, condition in reading.schema.conditions.items() if name not in taken}


def _renamed(column: TextColumn, name: str) -> TextColumn:
    return column if column.name == name else column.renamed(name)


def _source(reading: Reading, path: Path | None) -> AnySource | None:
    """The bytes that the file is written over, where it has the same format."""
    is_same = path is not None and path.suffix.lower() == f".{reading.format}"
    return reading.source if is_same else None


def _settings(settings: TableSettings, placed: Sequence[tuple[int, Mapped]], reading: Reading) -> TableSettings:
    """The settings under the jobs of the columns; what the file itself keeps of fallback, policy and assumptions is taken over."""
    retained = [column for _, column in placed]
    values: dict[str, Any] = {"asset": next(column.name for column in retained if column.job == "asset")}
    for job in COLUMN_JOBS:
        values[job] = next((column.name for column in retained if column.job == job), None)
    own = next(iter(reading.schema.tables.values()), None)
    if own is not None and settings == TableSettings(settings.name, settings.file):
        values |= {"fallback": own.fallback, "policy": own.policy, "assume": own.assume}
        named = settings_renamed(own, {reading.columns[at].name: column.name for at, column in placed}.get)
        values |= {"typed": named.typed, "fallback_outputs": named.fallback_outputs}
    return with_outputs(replace(settings, **values), (column.name for column in retained if column.job == "output"))


def declared_differently(reading: Reading, schema: Schema) -> list[str]:
    """Conditions that the file itself declares differently from the project, which goes first."""
    ours, theirs = schema.conditions, reading.schema.conditions
    return [name for name in theirs if name in ours and condition_to_dict(ours[name]) != condition_to_dict(theirs[name])]


def _whole(column: Mapped, read: TextColumn) -> list[str]:
    """The texts with blanks of a column that became one name each."""
    if column.cells is None or column.names is None:
        return []
    whole = set(column.cells.texts) & set(column.names.texts)
    return [text for text in read.texts if " " in text.strip() and quoted(text.strip()) in whole]


# ---- what somebody chose when a file was imported, for the next file of that name. An edge: this touches the disk


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
