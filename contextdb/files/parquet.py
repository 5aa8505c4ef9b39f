"""A Parquet file as texts, and a Parquet file again.

Strings stay as they are; numbers become the shortest text that reads back as the same number, bools True and False, a list of
strings an enum set (`CB FS "Half Back"`), and null is empty: Any. Without an edit the same bytes are written. After one, a column
keeps its type where every text still fits it, and becomes strings where one does not. What is written is sealed: its metadata hold
the digest of its bytes. Nothing here touches the disk.
"""

from __future__ import annotations

import datetime
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal

import numpy as np
from numpy.typing import NDArray

from contextdb.bitmask import Flags
from contextdb.cells.words import NUMBER_TEXT, quoted, says_any, truth_of
from contextdb.columns import TextColumn
from contextdb.columns import polars as pl
from contextdb.errors import Fault, Place, TableError, plural, row_name, safe_text
from contextdb.files.csv_rewrite import Origin, changed_rows, source_fields
from contextdb.files.csv_source import MOST_CHARACTERS, name_faults, text_columns
from contextdb.files.parquet_frame import MAGIC, UNSEALED, DamagedFrame, require_whole, sealed
from contextdb.files.strangers import seems_to_be

_ACCEPTED = "strings, categories, bools, numbers, dates, and lists of strings"
MOST_ROWS, MOST_CELLS = 10_000_000, 100_000_000
"""Of a table. Equal cells take no room in a file, and some 60 bytes each in memory."""
_WHOLE = re.compile(r"[+-]?\d{1,40}")
_NUMBER = re.compile(NUMBER_TEXT)
_NAME = re.compile(r'(?:"((?:[^"]|"")*)"|([^\s"]+))(?:\s+|\Z)')
_UNFIT = object()
"""The mark of a text that has no value in a type."""


@dataclass(frozen=True, eq=False)
class ParquetSource:
    """The bytes of a Parquet file and the texts that they mean; record r is row r of the file."""

    raw: bytes
    columns: tuple[TextColumn, ...]

    @property
    def n_records(self) -> int:
        return self.columns[0].n_rows

    def line(self, record: int) -> int | None:
        """None: a Parquet file has no lines."""
        return None


def read_parquet(raw: bytes, file: str) -> tuple[ParquetSource, list[TextColumn]]:
    """Read the texts of a Parquet file; `file` is its name in messages.

    Gives what is needed to write the same bytes again, and the columns in the order of the file. Raises TableError where the file
    is no Parquet, cut off or damaged, or has columns of a type that no cell has, each with what it is.
    """
    frame = _frame(raw, file)
    if not frame.width:
        raise TableError(Fault("the file has no columns.", "at least one column, the assets", place=Place(file)))
    columns = columns_of_frame(frame, file)
    return ParquetSource(raw, tuple(columns)), columns


def columns_of_frame(frame: pl.DataFrame, file: str | None = None) -> list[TextColumn]:
    """The texts of a DataFrame as those of a Parquet file; raises TableError for columns of a type that no cell has."""
    faults = [fault.at(Place(file)) for fault in name_faults(frame.columns)]
    faults += [fault.at(Place(file, column=s.name)) for s in frame for fault in _type_faults(s)]
    columns = [] if faults or not frame.width else _texts(frame)
    faults += [fault.at(Place(file, column=c.name)) for c in columns for fault in _long_faults(c)]
    if faults:
        raise TableError(*faults)
    return columns


def rewritten_parquet(
    columns: Sequence[TextColumn], source: ParquetSource | None, origin: Origin, field_of: Sequence[int] | None = None
) -> ParquetSource:
    """Write texts over the Parquet file they came from; parameters as in `contextdb.files.csv_rewrite.rewritten`. Raises TableError
    for a text or a name that no Parquet file can hold."""
    before = source.columns if source else ()
    fields = source_fields(columns, before, field_of)
    changed = changed_rows(columns, before, fields, origin)
    is_same = [c.name for c in columns] == [c.name for c in before] and fields == list(range(len(before)))
    if source and is_same and np.array_equal(origin, np.arange(source.n_records)) and not any(flags.any() for flags in changed):
        return source
    faults = [*name_faults([c.name for c in columns]), *_surrogates(columns)]
    if faults or not columns:
        raise TableError(*faults or [Fault("the table has no columns.", "at least one column, the assets")])
    old = _frame(source.raw, "").get_columns() if source else []
    series = [_series(c, old[f] if f >= 0 else None, origin, rows) for c, f, rows in zip(columns, fields, changed, strict=True)]
    out = io.BytesIO()
    pl.DataFrame(series).write_parquet(out, metadata=dict(UNSEALED))
    return read_parquet(sealed(out.getvalue()), "")[0]


# ---- the file


def _frame(raw: bytes, file: str) -> pl.DataFrame:
    fault = _no_parquet(raw)
    if fault:
        raise TableError(fault.at(Place(file)))
    try:
        about = require_whole(raw)
        if about.n_rows > MOST_ROWS or about.n_rows * about.n_columns > MOST_CELLS:
            problem = f"the file has {plural(about.n_rows, 'row')} of {plural(about.n_columns, 'column')}."
            accepted = f"at most {MOST_ROWS:,} rows and {MOST_CELLS:,} cells"
            raise TableError(Fault(problem, accepted, place=Place(file), rule="too-many-rows"))
        return pl.read_parquet(io.BytesIO(raw))
    except DamagedFrame as error:
        reason = str(error)
    except pl.exceptions.PolarsError as error:
        reason = safe_text(str(error).split("\n")[0], 200)
    except (TableError, MemoryError):
        raise
    except (Exception, pl.exceptions.PanicException):  # some damage makes polars panic instead of raise
        reason = "its parts contradict each other"
    raise TableError(Fault(f"the file is damaged: {reason}.", "a Parquet file as it was written", place=Place(file)))


def _no_parquet(raw: bytes) -> Fault | None:
    """What is wrong with the file's first and last bytes, if anything."""
    if not raw:
        return Fault("the file is empty.", "a Parquet file")
    if not raw.startswith(MAGIC):
        kind = seems_to_be(raw) or ("binary data" if b"\0" in raw[:1000] else "text")
        mend = "the suffix .csv" if kind == "text" else ""
        return Fault(f"not a Parquet file: looks like {kind}.", "a Parquet file", mend)
    size = int.from_bytes(raw[-8:-4], "little")
    if len(raw) < 12 or not raw.endswith(MAGIC) or size > len(raw) - 12:
        return Fault(
            "the file is cut off: its end, where Parquet lists its columns, is missing.", "a Parquet file as it was written"
        )
    return None


def _strings() -> tuple[type[pl.DataType], ...]:
    return pl.String, pl.Categorical, pl.Enum


def _type_faults(series: pl.Series) -> Iterator[Fault]:
    dtype = series.dtype
    if isinstance(dtype, pl.List) and isinstance(dtype.inner, _strings()):
        if series.list.len().eq(0).any():
            yield Fault("a list without names in it, which would match nothing.", "null for Any, or at least one name")
        if series.list.eval(pl.element().is_null()).list.any().any():
            yield Fault("a list with a null in it.", "names only")
    elif isinstance(dtype, pl.Datetime):
        if dtype.time_zone or (series.dt.time() != datetime.time()).any():
            has = "a time zone" if dtype.time_zone else "times of day"
            yield Fault(
                f"the column has {has}.", "days: dates, or midnights without a time zone", "to write it as dates or strings"
            )
    elif not (isinstance(dtype, (*_strings(), pl.Boolean, pl.Date, pl.Null)) or dtype.is_integer() or dtype.is_float()):
        yield Fault(f"the column is of type {dtype}.", _ACCEPTED, "to write it as strings")


def _long_faults(column: TextColumn) -> Iterator[Fault]:
    for code, text in enumerate(column.texts):
        if len(text) > MOST_CHARACTERS:
            row = int((column.codes == code).argmax())
            yield Fault(
                f"the cell in {row_name(row)} has {len(text):,} characters.", f"at most {MOST_CHARACTERS:,} characters in a cell"
            )


def _surrogates(columns: Sequence[TextColumn]) -> Iterator[Fault]:
    for column in columns:
        for text in (column.name, *column.texts):
            try:
                text.encode()
            except UnicodeEncodeError:
                yield Fault("a text has half a surrogate pair.", "text in UTF-8", place=Place(column=ascii(column.name)[1:-1]))
                break


# ---- values to texts


def _texts(frame: pl.DataFrame) -> list[TextColumn]:
    strings = pl.DataFrame([_as_strings(series).alias(str(i)) for i, series in enumerate(frame)])
    return text_columns(strings, frame.columns)


def _as_strings(series: pl.Series) -> pl.Series:
    if isinstance(series.dtype, pl.List):
        return pl.Series([None if names is None else " ".join(map(quoted, names)) for names in series.to_list()], dtype=pl.String)
    strings = (series.dt.date() if isinstance(series.dtype, pl.Datetime) else series).cast(pl.String)
    return strings.str.to_titlecase() if series.dtype == pl.Boolean else strings


# ---- texts to values


def _series(column: TextColumn, old: pl.Series | None, origin: Origin, is_changed: Flags) -> pl.Series:
    """A column's values: of the old type where the changed texts fit it, else strings."""
    new = None if old is None else _fitting(column, old, is_changed)
    if old is None or new is None:
        is_nullable = old is not None and old.null_count() > 0
        texts = [None if is_nullable and not text else text for text in column.texts]
        return _taken(column.name, pl.Series(texts, dtype=pl.String), column.codes)
    values = _taken(column.name, new, column.codes)
    if is_changed.all():
        return values
    return _taken(column.name, old, np.maximum(origin, 0)).zip_with(pl.Series(~is_changed), values)


def _taken(name: str, values: pl.Series, at: NDArray[np.integer]) -> pl.Series:
    return (values.gather(at) if len(at) else values.clear()).alias(name)


def _fitting(column: TextColumn, old: pl.Series, is_changed: Flags) -> pl.Series | None:
    """One value for each distinct text, null for those that no changed row has; None where one does not fit the type."""
    values: list[object] = [None] * len(column.texts)
    for code in np.unique(column.codes[is_changed]).tolist():
        value = _value(column.texts[code], old)
        if value is _UNFIT:
            return None
        values[code] = value
    try:
        return pl.Series(values, dtype=old.dtype, strict=True)
    except (pl.exceptions.PolarsError, TypeError, OverflowError):
        return None


def _value(text: str, old: pl.Series) -> object:
    """The value of a text in the type of a column, or _UNFIT."""
    dtype = old.dtype
    if isinstance(dtype, (pl.String, pl.Categorical)):
        return None if not text and old.null_count() else text
    if isinstance(dtype, pl.Enum):
        return text if text in dtype.categories else _UNFIT if text else None
    if says_any(text):
        return None
    if isinstance(dtype, pl.List):
        return _names(text)
    if isinstance(dtype, pl.Boolean):
        truth = truth_of(text)
        return _UNFIT if truth is None else truth
    if isinstance(dtype, pl.Date):
        return _date(text)
    if isinstance(dtype, pl.Datetime):
        day = _date(text)
        return datetime.datetime.combine(day, datetime.time()) if isinstance(day, datetime.date) else _UNFIT
    if dtype.is_integer():
        return int(text) if _WHOLE.fullmatch(text) else _UNFIT
    return _float(text, dtype) if dtype.is_float() else _UNFIT


def _date(text: str) -> object:
    try:
        day = datetime.date.fromisoformat(text)
    except ValueError:
        return _UNFIT
    return day if str(day) == text else _UNFIT


def _float(text: str, dtype: pl.DataType) -> object:
    """The number that a text means, if the type holds it without rounding what was written."""
    if not _NUMBER.fullmatch(text):
        return _UNFIT
    value = pl.Series([float(text)], dtype=pl.Float64).cast(dtype)
    return value[0] if Decimal(value.cast(pl.String)[0]) == Decimal(text) else _UNFIT


def _names(text: str) -> object:
    """The names of a plain enum set."""
    names, at = [], 0
    while match := _NAME.match(text, at):
        names.append(match[2] if match[1] is None else match[1].replace('""', '"'))
        at = match.end()
    return names if at == len(text) and " ".join(map(quoted, names)) == text else _UNFIT
