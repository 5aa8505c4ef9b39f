"""What a table that is saved has in its file."""

from pathlib import Path

from contextdb.files.texts import new_source
from contextdb.tables.table import Table


def bytes_for(table: Table, path: Path) -> bytes:
    """The bytes that `Table.save` writes."""
    return new_source(path, table.columns, table.source, table.origin).raw
