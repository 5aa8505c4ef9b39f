"""Tables from bytes whose file may have any name, as git hands them to a merge driver, and the bytes of a merge."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from contextdb.columns import TextColumn
from contextdb.files.texts import is_parquet, texts_of, written_over
from contextdb.schema.settings import EMPTY, Schema, TableSettings
from contextdb.tables.data import AnyTable
from contextdb.tables.merging.merging import Merge


def table_of(
    kind: type[AnyTable], raw: bytes, file: str, schema: Schema = EMPTY, settings: TableSettings | None = None
) -> AnyTable:
    """A table from bytes, CSV or Parquet as they are; `file` is its name in messages, `kind` the class to make.

    Jobs of columns that this version of the table does not have yet are left out.

    Raises
    ------
    TableError
        The bytes are not a table.
    """
    source, columns = texts_of(raw, file, is_parquet(raw))
    settings = _fitting(settings or TableSettings(Path(file).stem), columns)
    return kind.build(settings.name, columns, schema, settings, Path(file), source)


def merged_bytes(merge: Merge[AnyTable]) -> bytes:
    """The bytes of a merge, written over those of ours: what theirs did not change stays, under a renamed column too."""
    table, fields = merge.table, merge.fields.ours.tolist()
    return written_over(table.source, table.columns, table.origin, fields).raw


def _fitting(settings: TableSettings, columns: list[TextColumn]) -> TableSettings:
    names = {c.name for c in columns}
    jobs: dict[str, Any] = {key: getattr(settings, key) for key in ("asset", "enabled", "priority", "weight", "when")}
    kept: dict[str, Any] = {key: name if name in names else None for key, name in jobs.items()}
    return replace(settings, **kept, outputs=tuple(name for name in settings.outputs if name in names))
