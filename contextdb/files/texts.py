"""Files of tables: their texts, read and written as the suffix says. An edge: the texts themselves touch no disk."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from contextdb.columns import TextColumn
from contextdb.columns import polars as pl
from contextdb.console import announce_file
from contextdb.disk import TABLE_SUFFIXES, path_in_quotes, read_bytes, write_atomic
from contextdb.errors import ContextDBError, Fault, FileError, Place, TableError, in_quotes, nearest
from contextdb.files.csv_rewrite import Origin, rewritten
from contextdb.files.csv_source import Source, read_csv
from contextdb.files.parquet import ParquetSource, read_parquet, rewritten_parquet
from contextdb.files.parquet_frame import MAGIC, DamagedFrame, require_whole_file

AnySource = Source | ParquetSource
"""What a table's texts came from."""

_OTHER_TABLES = (".tsv", ".xlsx", ".json")


def is_parquet(file: str | Path | bytes) -> bool:
    """Whether a file is Parquet and not CSV: by its suffix, or, given its bytes, by the first of them."""
    return file.startswith(MAGIC) if isinstance(file, bytes) else Path(file).suffix.lower() == ".parquet"


def read_texts(path: str | Path) -> tuple[AnySource, list[TextColumn]]:
    """Read a table's texts, as its suffix says, .csv or .parquet: what is needed to write the same bytes again, and the columns in
    the order of the file. Raises FileError where there is no such file, it may not be read, or its suffix is another; TableError
    where the file is not a table, with every fault in it."""
    raw = read_bytes(path)
    _require_table(path)
    announce_file(str(path), len(raw))
    return texts_of(raw, str(path))


def texts_of(raw: bytes, file: str, as_parquet: bool | None = None) -> tuple[AnySource, list[TextColumn]]:
    """A table's texts from the bytes of a file, as its name says if nothing else does; the rest as in `read_texts`."""
    return read_parquet(raw, file) if (is_parquet(file) if as_parquet is None else as_parquet) else read_csv(raw, file)


@contextmanager
def scanned_parquet(path: Path) -> Iterator[pl.LazyFrame]:
    """Scan a Parquet file of contexts, whose frame is checked first. Raises TableError or FileError where the file is missing, no
    Parquet or damaged, found now or while the scan is collected inside the `with`."""
    try:
        require_whole_file(path)
        yield pl.scan_parquet(path, glob=False, low_memory=True)
    except ContextDBError:  # an OSError too where it is a FileError
        raise
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
    _require_table(path)
    return written_over(source, columns, origin, field_of, is_parquet(path))


def written_over(
    source: AnySource | None,
    columns: Sequence[TextColumn],
    origin: Origin,
    field_of: Sequence[int] | None = None,
    as_parquet: bool | None = None,
) -> AnySource:
    """Texts written over the bytes they came from; from scratch where another format than theirs is requested."""
    kind = type(source) if as_parquet is None else ParquetSource if as_parquet else Source
    write: Callable[..., AnySource] = rewritten_parquet if kind is ParquetSource else rewritten
    return write(columns, source, origin, field_of) if isinstance(source, kind) else write(columns, None, np.full(len(origin), -1))


def write_texts(
    path: str | Path,
    columns: Sequence[TextColumn],
    source: AnySource | None,
    origin: Origin,
    field_of: Sequence[int] | None = None,
) -> AnySource:
    """Write a table's texts, as the suffix says, .csv or .parquet, and give what they now come from: record r of it is row r.

    `columns`, `source`, `origin` and `field_of` are as in `contextdb.files.csv_rewrite.rewritten`; where the source has the other
    format, the file is written from scratch. Raises FileError where the disk refuses, and the old file is then whole; TableError
    for a text or a name that such a file cannot hold.
    """
    new = new_source(path, columns, source, origin, field_of)
    write_atomic(path, new.raw)
    return new


def _require_table(path: str | Path) -> None:
    suffix = Path(path).suffix
    if suffix.lower() in TABLE_SUFFIXES:
        return
    near = nearest(suffix, TABLE_SUFFIXES)
    mend = "to save it as CSV" if suffix.lower() in _OTHER_TABLES else path_in_quotes(Path(path).with_suffix(near)) if near else ""
    problem = f"a table file does not end in {in_quotes(suffix)}." if suffix else "the name has no suffix."
    raise FileError(Fault(problem, " or ".join(TABLE_SUFFIXES), mend, Place(str(path))))
