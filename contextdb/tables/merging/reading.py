"""Tables from bytes whose file may have any name, as git hands them to a merge driver, and the bytes of a merge."""

from __future__ import annotations

from pathlib import Path

from contextdb.files.texts import is_parquet, texts_of, written_over
from contextdb.schema.settings import EMPTY, Schema, TableSettings, settings_renamed
from contextdb.tables.data import AnyTable
from contextdb.tables.merging.merging import Merge


def table_of(
    kind: type[AnyTable], raw: bytes, file: str, schema: Schema = EMPTY, settings: TableSettings | None = None
) -> AnyTable:
    """A table from bytes, CSV or Parquet as they are; `file` is its name in messages, `kind` the class to make.

    Jobs of columns that this version of the table does not have yet are left out. Raises TableError where the bytes are not a
    table.
    """
    source, columns = texts_of(raw, file, is_parquet(raw))
    settings = settings_renamed(settings or TableSettings(Path(file).stem), {c.name: c.name for c in columns}.get)
    return kind.build(settings.name, columns, schema, settings, Path(file), source)


def merged_bytes(merge: Merge[AnyTable]) -> bytes:
    """The bytes of a merge, written over those of ours: what theirs did not change stays, under a renamed column too."""
    table, fields = merge.table, merge.fields.ours.tolist()
    return written_over(table.source, table.columns, table.origin, fields).raw
