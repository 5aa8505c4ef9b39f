"""What described clips become as a table: a new one, or columns and rows filled into one that is there, with its contextdb.toml.

What stands in a cell already stays; where it does not accept what the clip shows, that is reported, and replaced only where asked.
The command `motion describe` and Autofill in the editor are made of the same functions: `rows_for`, and `Filling` with its edit.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from contextdb.authoring.clip_folder import MARKUP, Databases, FolderClips, Tell, below, clips_of, facts_on_rigs
from contextdb.authoring.clip_looks import Looks
from contextdb.cells.conditions import Condition
from contextdb.cells.grammar import parse_cell
from contextdb.cells.kinds import Family
from contextdb.cells.output_types import OutputType
from contextdb.cells.sets import Cell
from contextdb.columns import TextColumn
from contextdb.disk import read_bytes
from contextdb.disk.boundary import inside
from contextdb.disk.engines import Engines, here
from contextdb.disk.together import NewFile, write_together
from contextdb.edits.schema_file import schema_change
from contextdb.errors import ContextDBError, Fault, FileError, Place, TableError, row_name, some
from contextdb.files.file_names import require_new_table_name
from contextdb.files.texts import new_source
from contextdb.files.toml_shapes import Path as KeyPath
from contextdb.motion.characters.facts import UNITS
from contextdb.motion.clips.clip import Up
from contextdb.motion.clips.doubts import doubts, grouped
from contextdb.motion.preparing.cells_of_clips import CONDITIONS, OUTPUTS, SOFT, softened
from contextdb.motion.preparing.describing import (
    Described,
    by_rig,
    condition_sections,
    described,
    joint_clips,
    joint_row,
    meeting_rigs,
    mirror_of,
    motion_sections,
    table_section,
)
from contextdb.motion.preparing.describing import Sections as TomlSections
from contextdb.motion.preparing.look import notes_of
from contextdb.schema.sections import settings_to_dict
from contextdb.schema.toml_edit import absent, add_sections
from contextdb.tables.changes import Cells, Change, Columns, Edit, Rows, Sections
from contextdb.tables.nesting.names import asset_name, asset_text
from contextdb.tables.project import SCHEMA_FILE, schema_for, settings_of
from contextdb.tables.table import Table

ASSET = "Asset Name"
BOM = "\ufeff"
NEAR_S = 0.01
"""Durations that differ by less are the same."""
SHOWN = {
    "gait": "enum",
    "speed": "number in m/s",
    "direction": "angle in degrees",
    "turn": "number in degrees a second",
    "style": "enum",
    "duration_s": "number",
    "start": "text",
    "end": "text",
}
"""What clips show in each column, for messages."""


@dataclass(frozen=True, slots=True)
class Difference:
    """A cell that does not accept what its clip shows, or that is not soft though its column is to be."""

    row: int
    line: int | None
    asset: str
    column: str
    cell: str
    clip: str
    """The cell that the clip would have."""

    def to_json(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in self.__slots__}

    def __str__(self) -> str:
        where = f"line {self.line}" if self.line is not None else row_name(self.row)
        is_right = self.column in SOFT and self.clip == softened(self.cell, self.column)
        wanted = "it would be" if is_right else "the clip shows"
        return f"{where}, {self.asset}, {self.column}: the cell is {self.cell}, {wanted} {self.clip}"


@dataclass
class DescribedTable:
    """A table as it is to be written, and what is to be said of it."""

    path: Path
    table: Table
    folder: Path
    toml: str
    toml_was: bytes | None

    @property
    def toml_path(self) -> Path:
        return self.folder / SCHEMA_FILE

    @property
    def is_used(self) -> bool:
        """Whether a database holds its rows, or none is declared."""
        databases = self.table.schema.databases.values()
        return not databases or any(part.get("table") == self.table.name for part in databases)

    def write(self) -> None:
        """Write the table and contextdb.toml in one step: both or neither; what says all of it already is not touched."""
        new = new_source(self.path, self.table.columns, self.table.source, self.table.origin).raw
        was = None if self.table.source is None else self.table.source.raw
        files = [] if new == was else [NewFile(self.path, new, was)]
        toml = self.toml.encode()
        files += [] if toml == (self.toml_was or b"") else [NewFile(self.toml_path, toml, self.toml_was)]
        if files and not write_together(self.folder, files):
            problem = "a file was changed by somebody else in this moment."
            raise FileError(Fault(problem, mend="to do the same once more", place=Place(str(self.path)), rule="merge-conflict"))


# ---- the clips


@dataclass
class ClipRows:
    """The clips of a folder, and the row of each."""

    source: FolderClips
    rows: list[Described]
    files: list[Path]
    """Of each row its clip; of joint clips that of the first role."""

    def soften(self, columns: Collection[str]) -> None:
        """Make the cells of some columns of `SOFT` soft."""
        for i, row in enumerate(self.rows):
            soft = {name: softened(cell, name) for name, cell in row.cells.items() if name in columns}
            self.rows[i] = replace(row, cells={**row.cells, **soft})

    def motion(self, table: Path) -> TomlSections | None:
        """What contextdb.toml is to say of the motion of a table: nothing where a project says it; None where it cannot."""
        folder, schema = schema_for(table)
        if schema.databases:
            return {}
        paths = below(self.source.paths, folder)
        if paths is None:
            return None
        has_markup = inside(self.source.folder / MARKUP, self.source.folder).is_file()
        markup = below([self.source.folder / MARKUP], folder) if has_markup else None
        return motion_sections(by_rig(self.source.clips, paths), table.stem, markup[0] if markup else None, self.source.is_by_feet)


def rows_for(
    folder: str | Path,
    into: Path | None,
    progress: Callable[[str], AbstractContextManager[Tell]],
    metres_per_unit: float | None = None,
    up: Up | None = None,
    engines: Engines = here,
    root: str | None = None,
) -> ClipRows:
    """Read and describe the clips of a folder: in a project those of the databases of the table that is filled, where it has any.

    `progress` gives, for the name of a part of the work, the function that is called for each of its clips. Raises ContextDBError
    where there is no such folder, no clip in it that can be read, or all are joint clips of several actors.
    """
    notes: list[str] = []
    looks = Looks(facts=True)
    with progress("reading clips") as tell:
        wants = lambda all_of: _playing_alone(all_of, into, notes)  # noqa: E731
        folder_clips = clips_of(folder, metres_per_unit, up, tell, wants, looks, engines, root)
    clips = folder_clips.clips
    measures = [(seen.head.name, None, seen.measures) for seen in folder_clips.seen]
    folder_clips.notes += [*notes, *grouped(doubts(measures), len(clips))]
    if not clips:
        raise ContextDBError(*(Fault(message) for message in folder_clips.left_out))
    joint = {} if folder_clips.config.databases else joint_clips(clips)
    together = {i for roles in joint.values() for i in roles.values()}
    alone = [i for i in range(len(clips)) if i not in together]
    bones = [clip.skeleton.names for clip in clips]
    if not folder_clips.config.databases:
        met, _ = meeting_rigs(clips)
        facts_on_rigs(folder_clips, met, looks, engines)
        bones = [bones[{i: each.members[0] for each in met for i in each.members}.get(i, i)] for i in range(len(clips))]
        folder_clips.notes += notes_of(clips, met)
    facts = folder_clips.facts()
    rows = described([facts[i] for i in alone], [bones[i] for i in alone], _is_mirrored(folder_clips)) if alone else []
    first = {asset: next(iter(roles.values())) for asset, roles in joint.items()}
    rows += [joint_row(asset, facts[i]) for asset, i in first.items()]
    if joint:
        folder_clips.notes.append(f"one row each for the joint clips {some(list(joint))}: its cells ask nothing of a single body.")
    return ClipRows(folder_clips, rows, [folder_clips.paths[i] for i in (*alone, *first.values())])


def _playing_alone(databases: Databases, path: Path | None, notes: list[str]) -> Databases:
    """The databases whose clips are described: those of the table that is filled, where it has any; none of joint clips.

    The clips of several actors are one row, which asks each of them for facts; what one of them does says little of it.
    """
    name = None if path is None else settings_of(path, *schema_for(path)).name
    if any(settings.table == name for settings in databases.values() if name is not None):
        databases = {each: settings for each, settings in databases.items() if settings.table == name}
    alone = {each: settings for each, settings in databases.items() if not settings.roles}
    joint = some([each for each in databases if each not in alone])
    if not alone:
        message = f"{joint} holds joint clips, each of several actors; a row of its table asks the actor of each role for facts."
        raise ContextDBError(Fault(message, "clips that one character plays alone"))
    if len(alone) < len(databases):
        notes.append(f"left out: the joint clips of {joint}: a row has no cell for what each actor does.")
    return alone


def _is_mirrored(clips: FolderClips) -> bool:
    """Whether the clips play mirrored too: as the databases of a project say, else wherever the rig has two sides."""
    databases = clips.config.databases.values()
    if databases:
        return all(settings.mirror for settings in databases)
    return all(mirror_of(rig.clips[0]) for rig in by_rig(clips.clips, [str(path) for path in clips.paths]))


# ---- a table that is there


@dataclass(frozen=True)
class Filling:
    """What the clips give to a table that is there: `added` are the rows that are missing, `empty` the cells of rows that are there
    and say nothing, `differences` those that do not accept what their clips show, `without_clip` the assets that no clip has.
    `cells` are those that the clip of each asset gives; `notes` say which columns are not filled, as contextdb.toml declares them
    otherwise; `sections` is what it is to say."""

    table: Table
    new_columns: list[str]
    added: list[Described]
    empty: list[Difference]
    differences: list[Difference]
    without_clip: list[str]
    cells: Mapping[str, Mapping[str, str]]
    notes: list[str]
    sections: Sections

    def edit(self, *, updates: bool = False) -> Edit:
        """Fill what is missing, as one step; with `updates` replace the cells that differ, too. Raises ContextDBError where the
        conditions are declared so that the cells cannot be read, or another cell of the table cannot be."""
        n, changes = self.table.n_rows, list[Change]()
        texts = dict[str, dict[int, str]]()
        for each in [*self.empty, *(self.differences if updates else ())]:
            texts.setdefault(each.column, {})[each.row] = each.clip
        if self.added:
            changes.append(Rows(np.append(np.arange(n), np.full(len(self.added), -1))))
        names = [column.name for column in self.table.columns]
        for at, row in enumerate(self.added, n):
            cells = {self.table.asset_column: asset_text(row.asset), **row.cells}
            for column in (*names, *self.new_columns):
                if column in cells:
                    texts.setdefault(column, {})[at] = cells[column]
        if self.new_columns:
            changes.append(Columns((*((name, name) for name in names), *((name, None) for name in self.new_columns))))
        changes += [] if self.sections.is_empty else [self.sections]
        changes += [Cells(texts)] if texts else []
        edit = Edit("Autofill", tuple(changes))
        if faults := edit.apply(self.table).faults:
            raise TableError(*faults)
        return edit


def filling(table: Table, rows: Sequence[Described]) -> Filling:
    """What the clips give to a table that is there."""
    other = {name: text for name in (*CONDITIONS, *OUTPUTS) if (text := _declared_otherwise(table, name))}
    sections = _sections(table, rows, other)
    rows = [replace(row, cells={name: cell for name, cell in row.cells.items() if name not in other}) for row in rows]
    known = {row.asset: row for row in rows}
    assets = [asset_name(cell) for cell in table.assets]
    names = [column.name for column in table.columns]
    new = [name for name in (*CONDITIONS, *OUTPUTS) if name not in names and name not in other]
    empty, differences = [], []
    for name in (*names, *new):
        if name == table.asset_column:
            continue
        texts = table.text_column(name).to_list() if name not in new else [""] * table.n_rows
        for at, (asset, text) in enumerate(zip(assets, texts, strict=True)):
            cell = known[asset].cells.get(name, "") if asset in known else ""
            if not cell or text == cell:
                continue
            each = Difference(at, table.place(at).line, asset, name, text, cell)
            if not text.strip():
                empty.append(each)
            elif not _accepts(table, name, text, known[asset]):
                differences.append(each)
            elif name in SOFT and cell.endswith(SOFT[name]) and _excludes(table, name, text):
                differences.append(replace(each, clip=softened(text, name)))
    added = [row for row in rows if row.asset not in set(assets)]
    cells = {row.asset: row.cells for row in rows}
    without = [asset for asset in dict.fromkeys(assets) if asset not in known]
    return Filling(table, new, added, empty, differences, without, cells, list(other.values()), sections)


def _declared_otherwise(table: Table, column: str) -> str:
    """Why the cells of clips are none of a column of that name: contextdb.toml gives it another job, type or unit. Empty where they
    are."""
    condition, output = table.schema.conditions.get(column), table.settings.output(column)
    job = next((job for job, name in table.settings.jobs if name == column), "")
    declared = ""
    if job and (column in CONDITIONS or job != "outputs"):
        declared = "an output" if job == "outputs" else f"a column for {job}"
    elif output is not None and not _may_say(output.type, column):
        declared = f"an output of type {output.kind}"
    elif condition is not None and not _is_measurable(condition, column):
        unit = condition.unit.strip()
        declared = f"{condition.domain.type.name} in {unit}" if unit else condition.domain.type.name
    return f'"{column}" is not filled: clips show {SHOWN[column]}, contextdb.toml declares {declared}.' if declared else ""


def _may_say(kind: OutputType, column: str) -> bool:
    """Whether outputs of a type can be what clips show."""
    return kind.is_free or (kind.is_numeric and not kind.is_whole if column == "duration_s" else kind.has_values)


def _is_measurable(condition: Condition, column: str) -> bool:
    """Whether clips show what a condition asks for."""
    kind = condition.domain.type
    if column in UNITS:
        fits = kind.is_decimal and kind.is_circular == (column == "direction")
        return fits and condition.unit.strip() in UNITS[column]
    return column in CONDITIONS and kind.family is Family.VALUES and kind.python is not bool


def _sections(table: Table, rows: Sequence[Described], other: Collection[str]) -> Sections:
    """What contextdb.toml is to say of a table that is there: conditions and outputs that it does not declare yet, without those of
    `other` names."""
    declared = {*table.schema.conditions, *other}
    conditions = {name: part for (_, name), part in condition_sections(rows).items() if name not in declared}
    wanted = table_section(rows, table.asset_column)
    if table.settings.name in table.schema.tables:
        wanted = {"outputs": wanted["outputs"]}
    typed: Any = wanted["outputs"]
    section: Any = settings_to_dict(table.settings).get("outputs") or {}
    outputs: dict[str, Any] = dict(section) if isinstance(section, Mapping) else {name: {"type": "text"} for name in section}
    more = {name: each for name, each in typed.items() if name not in outputs and name not in other}
    wanted |= {"outputs": {**outputs, **more}}
    settings = wanted if more or len(wanted) > 1 else {}
    return Sections(settings, {"conditions": conditions} if conditions else {})


def empty_table(path: Path) -> Table:
    """A table without rows that is to be the new file. Raises FileError where the file is there already, or no table can have its
    name; ContextDBError where contextdb.toml cannot be read."""
    if path.exists():
        problem = "the file is there already."
        raise FileError(Fault(problem, "a file that is new", f"--into {path}, which fills what is missing", Place(str(path))))
    require_new_table_name(path)
    folder, schema = schema_for(path)
    settings = settings_of(path, folder, schema)
    return Table.build(settings.name, [TextColumn.of(ASSET, [])], schema, settings, path)


def described_table(fills: Filling, motion: TomlSections, *, updates: bool = False) -> DescribedTable:
    """A table with what its clips give, and contextdb.toml with what it then means and some motion. Raises ContextDBError where
    contextdb.toml cannot be read, or as of `Filling.edit`."""
    before = fills.table
    assert before.path is not None
    after = fills.edit(updates=updates).apply(before)
    folder, _ = schema_for(before.path)
    path = folder / SCHEMA_FILE
    raw = read_bytes(path) if path.is_file() else None
    change = schema_change(before, after)
    text = (raw or b"" if change is None else change.raw).decode()
    there = set(absent(text.removeprefix(BOM), list(motion)))
    wanted: dict[KeyPath, Mapping[str, object]] = {part: values for part, values in motion.items() if part in there}
    toml = add_sections(text.removeprefix(BOM), wanted) if wanted else text
    return DescribedTable(before.path, after, folder, toml if toml == text or BOM not in text else BOM + toml, raw)


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
    if column not in table.schema.conditions or values[column] is None:
        return True
    cell = _cell(table, column, text)
    return cell is not None and cell.holds(values[column])


def _excludes(table: Table, column: str, text: str) -> bool:
    """Whether a cell of a condition can be read, is not Any and not soft."""
    cell = _cell(table, column, text) if column in table.schema.conditions else None
    return cell is not None and cell.accepts is not None and not cell.is_soft


def _cell(table: Table, column: str, text: str) -> Cell | None:
    """A cell of a condition; None where it cannot be read."""
    try:
        return parse_cell(text, table.schema.conditions[column].domain, wants_mend=False)
    except ContextDBError:
        return None


def _same_output(text: str, cell: str) -> bool:
    try:
        return abs(float(text) - float(cell)) <= NEAR_S
    except ValueError:
        return text.strip() == cell
