"""A contextdb.toml that somebody else changed, joined with what was edited of it here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from contextdb.disk import real_path
from contextdb.errors import SchemaError
from contextdb.schema.sections import EDITED_SECTIONS, settings_to_dict, settings_with
from contextdb.schema.settings import Schema, TableSettings
from contextdb.tables.changes import Edit, Sections
from contextdb.tables.table import Table


def under_schema(saved: Table, present: Table, path: Path, folder: Path, schema: Schema) -> Callable[[Table], Table]:
    """What puts a table of the history under a new schema: what it says otherwise than `saved` stays, all else is as the file says.
    Raises SchemaError where the present table cannot be under it. A past one that cannot stays as it is."""
    settings = schema.settings_for(_below(path, folder))

    def renewed(table: Table) -> Table:
        sections: dict[str, Any] = {part: _merged_section(saved.schema, table.schema, schema, part) for part in EDITED_SECTIONS}
        wanted = replace(schema, **sections)
        merged = _merged_settings(saved.settings, table.settings, settings)
        changed = Sections.between(table, replace(table, schema=wanted, settings=merged)).apply(table)
        return replace(changed, schema=replace(changed.schema, **_rest(schema)))

    renewed(present)

    def change(table: Table) -> Table:
        try:
            return renewed(table)
        except SchemaError:
            return table

    return change


def with_settings(edit: Edit, before: Table, after: Table) -> Edit:
    """An edit that leads from `before` to the texts of `after`, with all that `after` says of contextdb.toml besides."""
    sections = Sections.between(edit.apply(before), after)
    if sections.is_empty:
        return edit
    whole = replace(edit, changes=(*edit.changes, sections))
    try:
        whole.apply(before)
    except SchemaError:  # what others made of the table does not go with it
        return edit
    return whole


def _merged_section(saved: Schema, table: Schema, disk: Schema, section: str) -> dict[str, Any]:
    """One section, name by name: as the table has it where that was edited here, else as the disk."""
    was, mine, yours = (getattr(schema, section) for schema in (saved, table, disk))
    return _three_way(was, mine, yours)


def _merged_settings(saved: TableSettings, table: TableSettings, disk: TableSettings) -> TableSettings:
    joined = _three_way(settings_to_dict(saved), settings_to_dict(table), settings_to_dict(disk))
    return settings_with(TableSettings(disk.name), joined)


def _three_way(was: Mapping[str, Any], mine: Mapping[str, Any], yours: Mapping[str, Any]) -> dict[str, Any]:
    names = [*yours, *(name for name in mine if name not in yours)]
    values = {name: yours.get(name) if mine.get(name) == was.get(name) else mine.get(name) for name in names}
    return {name: value for name, value in values.items() if value is not None}


def _rest(schema: Schema) -> dict[str, Any]:
    """What edits do not change."""
    names = ("name", "tables", "features", "databases", "controllers", "output", "file", "transitions", "studio", "shared")
    return {name: getattr(schema, name) for name in names}


def _below(path: Path, folder: Path) -> str:
    whole, root = real_path(path.parent) / path.name, real_path(folder)
    return whole.relative_to(root).as_posix() if whole.is_relative_to(root) else path.name
