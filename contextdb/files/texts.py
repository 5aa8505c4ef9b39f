"""Files of tables: their texts, read and written as the suffix says. An edge: the texts themselves touch no disk."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import polars as pl

from contextdb.columns import TextColumn
from contextdb.disk import TABLE_SUFFIXES, path_in_quotes, read_bytes, write_atomic
from contextdb.errors import Fault, FileError, Place, TableError, in_quotes, nearest
from contextdb.files.csv_rewrite import Origin, rewritten
from contextdb.files.csv_source import Source, read_csv
from contextdb.files.parquet import ParquetSource, read_parquet, rewritten_parquet
from contextdb.files.parquet_frame import DamagedFrame, require_whole_file

AnySource = Source | ParquetSource
"""What a table's texts came from."""

_OTHER_TABLES = (".tsv", ".xlsx", ".json")


def read_texts(path: str | Path) -> tuple[AnySource, list[TextColumn]]:
    """Read a table's texts, as its suffix says: .csv or .parquet.

    Returns
    -------
    Source or ParquetSource
        What is needed to write the same bytes again.
    list of TextColumn
        The columns in the order of the file.

    Raises
    ------
    FileError
        There is no such file, it may not be read, or its suffix is another.
    TableError
        The file is not a table, with every fault in it.
    """
    raw = read_bytes(path)
    return read_parquet(raw, str(path)) if _suffix(path) == ".parquet" else read_csv(raw, str(path))


@contextmanager
def scanned_parquet(path: Path) -> Iterator[pl.LazyFrame]:
    """Scan a Parquet file of contexts, whose frame is checked first.

    Raises
    ------
    TableError, FileError
        The file is missing, no Parquet or damaged, found now or while the scan is collected inside the `with`.
    """
    try:
        require_whole_file(path)
        yield pl.scan_parquet(path, glob=False, low_memory=True)
    except (DamagedFrame, pl.exceptions.PolarsError, pl.exceptions.PanicException, OSError) as error:
        read_texts(path)  # says what is wrong with the file
        raise TableError(Fault(f"cannot read the file: {error}.", "a whole Parquet file", place=Place(str(path)))) from None


def new_source(
    path: str | Path,
    columns: Sequence[TextColumn],
    source: AnySource | None,
    origin: Origin,
    field_of: Sequence[int] | None = None,
) -> AnySource:
    """What a file becomes, before it is written: its bytes are `raw`. The parameters and errors are those of `write_texts`."""
    fresh = np.full(len(origin), -1)
    if _suffix(path) == ".csv":
        return rewritten(columns, source, origin, field_of) if isinstance(source, Source) else rewritten(columns, None, fresh)
    if isinstance(source, ParquetSource):
        return rewritten_parquet(columns, source, origin, field_of)
    return rewritten_parquet(columns, None, fresh)


def write_texts(
    path: str | Path,
    columns: Sequence[TextColumn],
    source: AnySource | None,
    origin: Origin,
    field_of: Sequence[int] | None = None,
) -> AnySource:
    """Write a table's texts, as the suffix says, and give what they now come from: record r of it is row r.

    Parameters
    ----------
    path : str or Path
        A .csv or .parquet file, there already or not.
    columns, source, origin, field_of
        As in `contextdb.files.csv_rewrite.rewritten`. When the source has the other format, the file is written from scratch.

    Raises
    ------
    FileError
        The disk refuses; the old file is then whole.
    TableError
        A text or a name that such a file cannot hold.
    """
    new = new_source(path, columns, source, origin, field_of)
    write_atomic(path, new.raw)
    return new


def _suffix(path: str | Path) -> str:
    suffix = Path(path).suffix
    if suffix.lower() in TABLE_SUFFIXES:
        return suffix.lower()
    near = nearest(suffix, TABLE_SUFFIXES)
    mend = "to save it as CSV" if suffix.lower() in _OTHER_TABLES else path_in_quotes(Path(path).with_suffix(near)) if near else ""
    found = f"a table file does not end in {in_quotes(suffix)}." if suffix else "the name has no suffix."
    raise FileError(Fault(found, " or ".join(TABLE_SUFFIXES), mend, Place(str(path))))
