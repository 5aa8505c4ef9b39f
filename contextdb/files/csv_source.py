"""A CSV as texts, with all that is needed to write the same bytes again.

`Source` keeps the bytes of a file and where its records are in them; `contextdb.files.csv_rewrite` writes texts over it. Columns
are read by polars and kept as their distinct texts, so that no cell is an object of its own. Nothing here touches the disk.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from contextdb.columns import TextColumn
from contextdb.columns import polars as pl
from contextdb.errors import Fault, Place, TableError, in_quotes
from contextdb.files.csv_faults import record_faults
from contextdb.files.csv_records import CR, LF, Positions, Records, field_bounds, fields_of, find_records, line_ends, text_of
from contextdb.files.strangers import UTF8_BOM, line_of, require_text, seems_json

MOST_NAME_FAULTS = 20
FEW_CELLS = 50_000
"""A file of so many cells is read by Python: it takes no longer than to load polars."""
FEW_ROWS = 1000
"""Columns of so few rows are gone through by Python, which takes less time than to ask polars about a column."""
FEW_TEXTS = 8
"""A column of so many distinct texts is compared with each of them, which is faster than looking each row up."""


@dataclass(frozen=True, eq=False)
class Source:
    """The bytes of a CSV and where its records are in them: record 0 is the first row, -1 the header.

    `starts` is int64 [n_records + 2]: where each record begins, the header first, and last the end of the file. `stops` is int64
    [n_records + 1]: where each ends; its line end, and blank lines after it, are between its stop and the next start. What stands
    before the header is a BOM or blank lines. `columns` are the texts that the bytes mean.
    """

    raw: bytes
    starts: Positions
    stops: Positions
    columns: tuple[TextColumn, ...]

    @property
    def n_records(self) -> int:
        """How many records there are, the header not counted."""
        return len(self.stops) - 1

    def line(self, record: int) -> int | None:
        """The line of the file, from 1, on which a record starts."""
        return int(self._lines[record + 1])

    @cached_property
    def _lines(self) -> Positions:
        return np.searchsorted(line_ends(self.raw), self.starts[:-1]).astype(np.int64) + 1

    @cached_property
    def line_ends(self) -> Mapping[str, int]:
        """How many records end with each kind of line end, the most common first. More than one kind: they are mixed."""
        octets = np.frombuffer(self.raw + b"  ", np.uint8)
        is_return, is_next_feed = octets[self.stops] == CR, octets[self.stops + 1] == LF
        kinds = {"\n": octets[self.stops] == LF, "\r\n": is_return & is_next_feed, "\r": is_return & ~is_next_feed}
        counts = {end: int(flags.sum()) for end, flags in kinds.items()}
        return {end: n for end, n in sorted(counts.items(), key=lambda item: -item[1]) if n}

    @property
    def line_end(self) -> str:
        return next(iter(self.line_ends), "\n")

    @property
    def ends_with_line_end(self) -> bool:
        """Whether the last record has a line end."""
        return not len(self.stops) or int(self.stops[-1]) < len(self.raw)


NO_SOURCE = Source(b"", np.zeros(1, np.int64), np.zeros(0, np.int64), ())
"""What a table that was never read comes from."""


def read_csv(raw: bytes, file: str) -> tuple[Source, list[TextColumn]]:
    """Read a strict CSV (RFC 4180) in UTF-8; `file` is its name in messages.

    Gives what is needed to write the same bytes again, and the columns in the order of the file, every text as it is there, without
    its quotes. Raises TableError with every fault of the file, each with its line.
    """
    records, names = find_rows(raw, file)
    starts, stops = records.starts[1:], records.stops[1:]
    is_small = len(starts) * len(names) <= FEW_CELLS
    columns = _read_few(raw, starts, stops, names) if is_small else text_columns(read_rows(raw, starts, stops, names), names)
    return Source(raw, np.append(records.starts, len(raw)), records.stops, tuple(columns)), columns


def find_rows(raw: bytes, file: str) -> tuple[Records, list[str]]:
    """The records of a CSV, the header first, and the names of its columns; the parameters and errors are those of `read_csv`."""
    require_text(raw, file)
    records, strays = find_records(raw)
    faults, names = record_faults(raw, records, strays, file), list[str]()
    if records.is_sound[0]:
        head = raw[records.starts[0] : records.stops[0]]
        names = [text_of(field) for field in fields_of(head, int(records.n_fields[0]))]
        place = Place(file, line_of(raw, int(records.starts[0])))
        faults = [fault.at(place) for fault in name_faults(names)] + faults
    if faults:
        hint = [Fault("not a CSV file: looks like JSON.", "CSV text in UTF-8", place=Place(file))] if seems_json(raw) else []
        raise TableError(*hint, *faults)
    return records, names


def _read_few(raw: bytes, starts: Positions, stops: Positions, names: Sequence[str]) -> list[TextColumn]:
    """The columns of a small file, without polars, which takes longer to load."""
    chunk = b"".join(raw[a:b] for a, b in zip(starts.tolist(), stops.tolist(), strict=True))
    begins, ends = (each.T.tolist() for each in field_bounds(chunk, stops - starts, len(names)))
    return [
        TextColumn.of(name, [text_of(chunk[a:b]) for a, b in zip(*fields, strict=True)])
        for name, *fields in zip(names, begins, ends, strict=True)
    ]


def read_rows(
    raw: bytes, starts: Positions, stops: Positions, names: Sequence[str], wanted: Collection[str] | None = None
) -> pl.DataFrame:
    """Rows of a CSV between these positions as strings, null where a field is empty: the wanted columns, by default all."""
    places = {str(at): name for at, name in enumerate(names) if wanted is None or name in wanted}
    if not (len(starts) and places):
        return pl.DataFrame()
    schema = dict.fromkeys(map(str, range(len(names))), pl.String)
    frame = pl.read_csv(_plain_rows(raw, starts, stops), has_header=False, schema=schema).select(list(places))
    assert frame.height == len(starts), "polars and the records disagree"
    return frame.rename(places)


def name_faults(names: Sequence[str]) -> Iterator[Fault]:
    """What is wrong with the names of the columns: one is empty, or appears twice. Names the first few."""
    faults = list(_name_faults(names))
    yield from faults[:MOST_NAME_FAULTS]
    if len(faults) > MOST_NAME_FAULTS:
        problem = f"there are {len(faults) - MOST_NAME_FAULTS:,} more such column names."
        yield Fault(problem, "a name for each column, each name once")


def _name_faults(names: Sequence[str]) -> Iterator[Fault]:
    first: dict[str, int] = {}
    for at, name in enumerate(names, 1):
        if any("\ud800" <= c <= "\udfff" for c in name):
            yield Fault(f"field {at:,} of the column names has half a surrogate pair.", "text in UTF-8")
        elif not name.strip():
            where = "the last" if at == len(names) else f"field {at:,}"
            yield Fault(f"{where} of {len(names):,} column names is empty.", "a name for each column")
        elif name in first:
            yield Fault(f"the column name {in_quotes(name)} appears twice, in fields {first[name]:,} and {at:,}.", "each name once")
        first.setdefault(name, at)


def text_columns(frame: pl.DataFrame, names: Sequence[str]) -> list[TextColumn]:
    """Columns of strings, null meaning empty, as their distinct texts in the order they first appear, and their codes."""
    if frame.height <= FEW_ROWS:
        columns = zip(names, frame.iter_columns(), strict=True)
        return [TextColumn.of(name, (text or "" for text in column.to_list())) for name, column in columns]
    numbers = [str(i) for i in range(frame.width)]  # polars would read a name such as "*" or "^a$" as a pattern
    frame = frame.rename(dict(zip(frame.columns, numbers, strict=True)))
    if with_nulls := [column for column in numbers if frame[column].null_count()]:
        frame = frame.with_columns(pl.col(with_nulls).fill_null(""))
    texts = [column[0] for column in frame.select(pl.all().unique(maintain_order=True).implode())]
    codes = frame.select(_codes(c, t, frame.height).alias(c) for c, t in zip(numbers, texts, strict=True))
    return [TextColumn(n, tuple(t.to_list()), c.to_numpy()) for n, t, c in zip(names, texts, codes, strict=True)]


def _codes(column: str, texts: pl.Series, n_rows: int) -> pl.Expr:
    """The place of each row's text among the texts, found by the cheapest way."""
    if len(texts) == n_rows:
        return pl.int_range(n_rows, dtype=pl.Int32)
    if len(texts) <= FEW_TEXTS:
        places = ((pl.col(column) == text).cast(pl.Int32) * i for i, text in enumerate(texts))
        return pl.sum_horizontal(places)
    return pl.col(column).cast(pl.Enum(texts)).to_physical().cast(pl.Int32)


def _plain_rows(raw: bytes, starts: Positions, stops: Positions) -> bytes:
    """The rows as polars reads them, with plain line ends and no blank lines between them."""
    octets, between = np.frombuffer(raw, np.uint8), starts[1:] - stops[:-1]
    is_plain = (octets[starts[1:] - 1] == LF) & ((between == 1) | ((between == 2) & (octets[stops[:-1]] == CR)))
    if is_plain.all():
        rows = raw[int(starts[0]) : int(stops[-1])]
    else:
        rows = b"\n".join([raw[a:b] for a, b in zip(starts.tolist(), stops.tolist(), strict=True)])
    return UTF8_BOM + rows if rows.startswith(UTF8_BOM) else rows  # polars takes one away: here it is text
