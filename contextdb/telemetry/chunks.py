"""The rows of a telemetry file, some at a time: never the whole file at once.

A CSV is cut at ends of lines outside of quotes, and each piece read as strictly as a table is. A Parquet file is read by polars a
batch at a time. Of the lines of a link those of one table are read: see `contextdb.telemetry.link.recorded`.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import polars as pl
from polars.selectors import by_name

from contextdb.disk import CONTEXT_SUFFIXES
from contextdb.errors import Fault, FileError, Place, TableError, in_quotes
from contextdb.files.csv_source import find_rows, read_csv, read_rows
from contextdb.files.strangers import line_of
from contextdb.files.texts import is_parquet, scanned_parquet
from contextdb.telemetry.link.recorded import is_recording, pieces_of

ROWS = 1 << 16
BYTES = 1 << 24


@dataclass(frozen=True, eq=False)
class Chunk:
    """Some rows of a file: the columns that were requested."""

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


def chunks_of(path: Path, wanted: Collection[str], table: str) -> Iterator[tuple[Sequence[str], Chunk]]:
    """The names of all columns with each chunk of the wanted ones; one empty chunk where the file has no rows. Of a recording of
    several tables those rows are read that are of this one. Raises TableError or FileError where the file cannot be read, with its
    faults."""
    if path.suffix.lower() not in CONTEXT_SUFFIXES:
        problem = f"a file of contexts does not end in {in_quotes(path.suffix)}."
        raise FileError(Fault(problem, " or ".join(CONTEXT_SUFFIXES), place=Place(str(path))))
    if is_recording(path):
        yield from _recorded_chunks(path, wanted, table)
    else:
        yield from _parquet_chunks(path, wanted) if is_parquet(path) else _csv_chunks(path, wanted)


def _recorded_chunks(path: Path, wanted: Collection[str], table: str) -> Iterator[tuple[Sequence[str], Chunk]]:
    n_rows = 0
    for piece in pieces_of(path, table):
        names, frame = piece.frame(wanted)
        yield names, Chunk(len(piece.facts), frame, n_rows, True, piece.share_done, piece.raw, piece.starts, piece.lines_before)
        n_rows += len(piece.facts)


def _parquet_chunks(path: Path, wanted: Collection[str]) -> Iterator[tuple[Sequence[str], Chunk]]:
    with scanned_parquet(path) as scan:
        names = tuple(scan.collect_schema().names())
        n_rows = int(scan.select(pl.len()).collect().item())
        given = [name for name in names if name in wanted]
        chosen = scan.select(by_name(given))
        done = 0
        if not n_rows:
            yield names, Chunk(0, pl.DataFrame(), 0, False)
        if not given:
            for start in range(0, n_rows, ROWS):
                stop = min(start + ROWS, n_rows)
                yield names, Chunk(stop - start, pl.DataFrame(), start, False, stop / n_rows)
        if not n_rows or not given:
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


def _csv_chunks(path: Path, wanted: Collection[str]) -> Iterator[tuple[Sequence[str], Chunk]]:
    head, names = b"", list[str]()
    n_rows, n_lines, n_bytes, size = 0, 0, 0, max(1, os.path.getsize(path)) if path.exists() else 1
    for piece in _pieces(path):
        raw = head + piece
        try:
            records, names = find_rows(raw, str(path))
        except TableError:
            raise _csv_error(path) from None
        starts, stops = records.starts[1:], records.stops[1:]
        n_bytes += len(piece)
        if len(starts):
            frame = read_rows(raw, starts, stops, names, wanted)
            before = n_lines - _n_lines(head)
            yield names, Chunk(len(starts), frame, n_rows, True, min(1.0, n_bytes / size), raw, starts.tolist(), before)
        n_lines += _n_lines(piece)
        n_rows += len(starts)
        head = head or raw[: int(starts[0]) if len(starts) else len(raw)]
    if not names:
        raise _csv_error(path)
    if not n_rows:
        yield names, Chunk(0, pl.DataFrame(), 0, True)


def _n_lines(raw: bytes) -> int:
    return line_of(raw, len(raw)) - 1


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
        raise FileError(Fault(f"the file cannot be read: {error.strerror}.", place=Place(str(path))), errno=error.errno) from None


def _cut(raw: bytes) -> int:
    """Where the last line ends that ends outside of quotes; 0 where none does."""
    cut = raw.rfind(b"\n") + 1
    quotes = raw.count(b'"', 0, cut)
    while cut and quotes % 2:
        before = raw.rfind(b"\n", 0, cut - 1) + 1
        quotes -= raw.count(b'"', before, cut)
        cut = before
    return cut


def _csv_error(path: Path) -> TableError:
    """What is wrong with a CSV, found by reading it whole."""
    try:
        read_csv(path.read_bytes(), str(path))
    except TableError as error:
        return error
    return TableError(Fault("the file has no whole rows.", "a CSV with a header", place=Place(str(path))))
