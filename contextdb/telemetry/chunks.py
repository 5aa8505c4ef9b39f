"""The rows of a telemetry file, some at a time: never the whole file at once.

A CSV is cut at ends of lines outside of quotes, and each piece read as strictly as a table is. A Parquet file is read by polars a
batch at a time.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import polars as pl
from polars.selectors import by_name

from contextdb.disk import TABLE_SUFFIXES
from contextdb.errors import Fault, FileError, Place, TableError, in_quotes
from contextdb.files.csv_faults import record_faults
from contextdb.files.csv_records import Records, fields_of, find_records, text_of
from contextdb.files.csv_source import name_faults, read_csv
from contextdb.files.strangers import UTF8_BOM, line_of, require_text
from contextdb.files.texts import is_parquet, scanned_parquet

ROWS = 1 << 16
BYTES = 1 << 24


@dataclass(frozen=True, eq=False)
class Chunk:
    """Some rows of a file: the columns that were asked for."""

    n_rows: int
    frame: pl.DataFrame
    first_row: int
    is_text: bool
    """Facts are written as on the command line."""
    share_done: float = 1.0
    """How much of the file is behind with this chunk, 0…1."""
    raw: bytes = b""
    starts: list[int] = field(default_factory=list)
    """Where in `raw` each row begins."""
    lines_before: int = 0

    def line(self, row: int) -> int | None:
        """The line of a row of this chunk; None where the file has no lines."""
        return self.lines_before + line_of(self.raw, self.starts[row]) if self.starts else None


@dataclass(frozen=True)
class TelemetryFile:
    """One file: the names of its columns, and its rows."""

    path: Path

    def chunks(self, wanted: Collection[str]) -> Iterator[tuple[tuple[str, ...], Chunk]]:
        """The names of all columns with each chunk of the wanted ones; one empty chunk where the file has no rows.

        Raises
        ------
        TableError, FileError
            The file cannot be read, with its faults.
        """
        if self.path.suffix.lower() not in TABLE_SUFFIXES:
            found = f"a file of contexts does not end in {in_quotes(self.path.suffix)}."
            raise FileError(Fault(found, " or ".join(TABLE_SUFFIXES), place=Place(str(self.path))))
        yield from _parquet_chunks(self.path, wanted) if is_parquet(self.path) else _csv_chunks(self.path, wanted)


def _parquet_chunks(path: Path, wanted: Collection[str]) -> Iterator[tuple[tuple[str, ...], Chunk]]:
    with scanned_parquet(path) as scan:
        names = tuple(scan.collect_schema().names())
        n_rows = int(scan.select(pl.len()).collect().item())
        asked = [name for name in names if name in wanted]
        chosen = scan.select(by_name(asked))
        done = 0
        if not n_rows:
            yield names, Chunk(0, pl.DataFrame(), 0, False)
        if not asked:
            for start in range(0, n_rows, ROWS):
                stop = min(start + ROWS, n_rows)
                yield names, Chunk(stop - start, pl.DataFrame(), start, False, stop / n_rows)
        if not n_rows or not asked:
            return
        for batch in _batches(chosen, n_rows):
            for start in range(0, len(batch), ROWS):
                part = batch.slice(start, ROWS)
                yield names, Chunk(len(part), part, done, False, min(1.0, (done + len(part)) / n_rows))
                done += len(part)
    if done != n_rows:
        raise TableError(Fault(f"only {done:,} of {n_rows:,} rows came.", "a whole Parquet file", place=Place(str(path))))


def _batches(scan: pl.LazyFrame, n_rows: int) -> Iterator[pl.DataFrame]:
    if hasattr(scan, "collect_batches"):
        yield from scan.collect_batches(chunk_size=ROWS, engine="streaming")
    else:  # an older polars
        for start in range(0, n_rows, ROWS):
            yield scan.slice(start, ROWS).collect()


def _csv_chunks(path: Path, wanted: Collection[str]) -> Iterator[tuple[tuple[str, ...], Chunk]]:
    names: tuple[str, ...] | None = None
    head = b""
    n_rows, n_lines, n_bytes, size = 0, 0, 0, max(1, os.path.getsize(path)) if path.exists() else 1
    for raw in _pieces(path):
        require_text(raw, str(path))
        records, strays = find_records(head + raw)
        if not len(records.starts):
            continue
        if strays or record_faults(head + raw, records, strays, str(path)):
            raise _told(path)
        if names is None:
            names = _names(raw, records, path)
            head = raw[: int(records.starts[1])] if len(records.starts) > 1 else raw
            lead = 0
        else:
            lead = len(head)
        n_bytes += len(raw)
        before = n_lines - head[:lead].count(b"\n")
        chunk = _csv_chunk(head[:lead] + raw, records, names, wanted, n_rows, before, min(1.0, n_bytes / size))
        n_lines += line_of(raw, len(raw)) - 1
        n_rows += chunk.n_rows
        if chunk.n_rows:
            yield names, chunk
    if names is None:
        raise _told(path)
    if not n_rows:
        yield names, Chunk(0, pl.DataFrame(), 0, True)


def _csv_chunk(
    raw: bytes,
    records: Records,
    names: tuple[str, ...],
    wanted: Collection[str],
    first_row: int,
    lines_before: int,
    share_done: float,
) -> Chunk:
    starts, stops = records.starts[1:].tolist(), records.stops[1:].tolist()
    places = [at for at, name in enumerate(names) if name in wanted]
    frame = pl.DataFrame()
    if starts and places:
        rows = b"\n".join([raw[a:b] for a, b in zip(starts, stops, strict=True)])
        rows = UTF8_BOM + rows if rows.startswith(UTF8_BOM) else rows  # polars takes one away: here it is text
        schema = dict.fromkeys(map(str, range(len(names))), pl.String)
        frame = pl.read_csv(rows, has_header=False, schema=schema).select(map(str, places))
        frame = frame.rename({str(at): names[at] for at in places})
    return Chunk(len(starts), frame, first_row, True, share_done, raw, starts, lines_before)


def _pieces(path: Path) -> Iterator[bytes]:
    """The bytes of a file in pieces that end where a line does, outside of quotes."""
    try:
        with path.open("rb") as file:
            rest = b""
            while block := file.read(BYTES):
                rest += block
                cut = _cut(rest)
                if cut:
                    yield rest[:cut]
                    rest = rest[cut:]
            if rest:
                yield rest
    except OSError as error:
        raise FileError(Fault(f"the file cannot be read: {error.strerror}.", place=Place(str(path)))) from None


def _cut(raw: bytes) -> int:
    """Where the last line ends that ends outside of quotes; 0 where none does."""
    cut = raw.rfind(b"\n") + 1
    quotes = raw.count(b'"', 0, cut)
    while cut and quotes % 2:
        before = raw.rfind(b"\n", 0, cut - 1) + 1
        quotes -= raw.count(b'"', before, cut)
        cut = before
    return cut


def _names(raw: bytes, records: Records, path: Path) -> tuple[str, ...]:
    head = raw[int(records.starts[0]) : int(records.stops[0])]
    names = tuple(text_of(f) for f in fields_of(head, int(records.n_fields[0])))
    if any(name_faults(names)):
        raise _told(path)
    return names


def _told(path: Path) -> TableError:
    """What is wrong with a CSV, found by reading it whole."""
    try:
        read_csv(path.read_bytes(), str(path))
    except TableError as error:
        return error
    return TableError(Fault("the file has no whole rows.", "a CSV with a header", place=Place(str(path))))
