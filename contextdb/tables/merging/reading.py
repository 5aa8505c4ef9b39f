"""Tables from bytes whose file may have any name, as git hands them to a merge driver, and the bytes of a merge."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from contextdb.columns import TextColumn
from contextdb.files.csv_rewrite import rewritten
from contextdb.files.csv_source import read_csv
from contextdb.files.parquet import ParquetSource, read_parquet, rewritten_parquet
from contextdb.files.texts import AnySource
from contextdb.schema.settings import EMPTY, Schema, TableSettings
from contextdb.tables.data import AnyTable
from contextdb.tables.merging.merging import Merge

PARQUET = b"PAR1"
"""How a Parquet file begins."""


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
    source: AnySource
    source, columns = read_parquet(raw, file) if raw.startswith(PARQUET) else read_csv(raw, file)
    settings = _fitting(settings or TableSettings(Path(file).stem), columns)
    return kind.build(settings.name, columns, schema, settings, Path(file), source)


def merged_bytes(merge: Merge[AnyTable]) -> bytes:
    """The bytes of a merge, written over those of ours: what theirs did not change stays, under a renamed column too."""
    table, fields = merge.table, merge.fields.ours.tolist()
    if isinstance(table.source, ParquetSource):
        return rewritten_parquet(table.columns, table.source, table.origin, fields).raw
    return rewritten(table.columns, table.source, table.origin, fields).raw


def _fitting(settings: TableSettings, columns: list[TextColumn]) -> TableSettings:
    names = {c.name for c in columns}
    jobs: dict[str, Any] = {key: getattr(settings, key) for key in ("asset", "enabled", "priority", "weight", "when")}
    kept: dict[str, Any] = {key: name if name in names else None for key, name in jobs.items()}
    return replace(settings, **kept, outputs=tuple(name for name in settings.outputs if name in names))
