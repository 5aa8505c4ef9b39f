"""A CSV as texts, with all that is needed to write the same bytes again.

`Source` keeps the bytes of a file and where its records are in them; `contextdb.files.csv_rewrite` writes texts over it. Columns
are read by polars and kept as their distinct texts, so that no cell is an object of its own. Nothing here touches the disk.

Each fault is at its line, with the nearest mend. Of one kind the first few are listed, and how many more there are.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from contextdb.columns import TextColumn
from contextdb.columns import polars as pl
from contextdb.errors import Fault, Place, TableError, in_quotes, plural
from contextdb.files.csv_records import (
    CR,
    LF,
    MOST_STRAYS,
    Positions,
    Records,
    Stray,
    as_field,
    field_bounds,
    fields_of,
    find_records,
    line_ends,
    text_of,
)
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


# ---- what is wrong with the records of a CSV: git's marks, wrong quotes, another number of fields than the header, cells too
# long


MOST_CHARACTERS = 65_536
"""The longest cell that is read; a longer one is a mistake, such as a whole file pasted into a cell."""
MOST_FAULTS = 20
"""Faults of one kind that are listed."""

CONFLICT, CONFLICT_END = b"<<<<<<<", b">>>>>>>"
"""What git writes at the start of the lines round two versions of a file that disagree."""

PlacedFault = tuple[int | None, Fault]
"""A fault, and the byte that it is about."""

_PAIR = re.compile(rb"[+-]?[\d.]+, *[\d.]+")


def record_faults(raw: bytes, records: Records, strays: list[Stray], file: str) -> list[Fault]:
    """Every fault in the form of the records, in the order of lines."""
    faults = list(_conflict_faults(raw, records))
    if not faults:
        faults = [*_stray_faults(raw, strays), *_ragged_faults(raw, records), *_long_faults(raw, records)]
    placed = [fault.at(Place(file, None if at is None else line_of(raw, at))) for at, fault in faults]
    return sorted(placed, key=lambda fault: fault.place.line or math.inf)


def _conflict_faults(raw: bytes, records: Records) -> Iterator[PlacedFault]:
    """Unresolved git conflicts. Nothing else is reported with them: which rows there are is not decided yet."""
    firsts = np.frombuffer(raw, np.uint8)[records.starts]
    at = records.starts[(firsts == CONFLICT[0]) | (firsts == CONFLICT_END[0])]
    first = raw.find(b"\n" + CONFLICT)
    marks = [start for start in at.tolist() if raw.startswith((CONFLICT, CONFLICT_END + b" "), start)]
    for start in marks[:MOST_FAULTS]:
        if raw.startswith(CONFLICT, start):
            end = raw.find(b"\n>>>>>>>", start)
            extent = f" and ends on line {line_of(raw, end + 1)}" if end >= 0 else ""
            mend = 'to keep one side and delete the lines "<<<<<<<", "=======" and ">>>>>>>"'
            yield start, Fault(f"an unresolved git conflict starts here{extent}.", "one version of each row", mend)
        elif not raw.startswith(CONFLICT) and not 0 <= first < start:
            yield start, Fault("this line is a conflict mark of git.", "one version of each row", "to delete the line")


def _stray_faults(raw: bytes, strays: list[Stray]) -> Iterator[PlacedFault]:
    for stray in strays[:MOST_STRAYS]:
        yield stray.opening, _stray_fault(raw, stray)
    if len(strays) > MOST_STRAYS:
        yield None, Fault("there are more fields with wrong quotes; the lines after these were not looked at.")


def _stray_fault(raw: bytes, stray: Stray) -> Fault:
    accepted = "a field in double quotes from its start to its end, each quote in it doubled"
    if stray.is_inside:
        field = _line_at(raw, _field_start(raw, stray.opening)).split(",", 1)[0]
        return Fault(f"a quote is inside the field {in_quotes(field)}.", accepted, _doubled(field))
    line = in_quotes(_line_at(raw, stray.opening))
    if stray.closing is None:
        return Fault(f"the quoted field that opens here is never closed: {line}.", accepted, "to close it on this line")
    n_lines = line_of(raw, stray.closing) - line_of(raw, stray.opening)
    if n_lines:
        problem = f"the quoted field that opens here runs on for {plural(n_lines, 'line')} and past the next quote: {line}."
        return Fault(problem, accepted, "to close it on this line")
    field = raw[stray.opening : stray.closing].decode() + _line_at(raw, stray.closing).split(",", 1)[0]
    problem = f"the field {in_quotes(field)} continues after its closing quote."
    return Fault(problem, accepted, _doubled(field[1:].removesuffix('"')))


def _field_start(raw: bytes, position: int) -> int:
    first = len(UTF8_BOM) if raw.startswith(UTF8_BOM) else 0
    return max(first, *(1 + raw.rfind(mark, 0, position) for mark in (b",", b"\n", b"\r")))


def _line_at(raw: bytes, start: int) -> str:
    """The text from a position up to the end of its line, or as much of it as a message can need."""
    return re.split(rb"[\r\n]", raw[start : start + 1000], maxsplit=1)[0].decode(errors="replace")


def _doubled(text: str) -> str:
    return as_field(text, is_quoted=True).decode() if len(text) <= 60 else ""


def _ragged_faults(raw: bytes, records: Records) -> Iterator[PlacedFault]:
    """Rows with more or fewer fields than the header; those with stray quotes cannot be counted and have their fault already."""
    rows = 1 + np.flatnonzero(records.is_sound[1:])
    if not records.is_sound[0] or not len(rows):
        return
    counts, header = records.n_fields[rows], int(records.n_fields[0])
    usual = _usual(counts, header)
    if usual != header:
        agree = f"{np.count_nonzero(counts == usual):,} of {plural(len(counts), 'row')}"
        problem = f"the header has {plural(header, 'field')}, but {agree} have {usual:,}."
        yield int(records.starts[0]), Fault(problem, "one name for each field of a row")
    wrong = rows[counts != usual]
    usual_text = f"the header has {usual:,}" if usual == header else f"most rows have {usual:,}"
    for record in wrong[:MOST_FAULTS].tolist():
        yield int(records.starts[record]), _ragged_fault(raw, records, record, usual, usual_text)
    if len(wrong) > MOST_FAULTS:
        yield None, Fault(f"{plural(len(wrong) - MOST_FAULTS, 'more row')} of another length; {usual_text}.")


def _usual(counts: Positions, header: int) -> int:
    """How many fields a row should have: as many as the header, unless most rows agree on another number."""
    values, times = np.unique(counts, return_counts=True)
    return int(values[times.argmax()]) if len(counts) >= 3 and 2 * times.max() > len(counts) else header


def _ragged_fault(raw: bytes, records: Records, record: int, usual: int, usual_text: str) -> Fault:
    start, stop, n_fields = int(records.starts[record]), int(records.stops[record]), int(records.n_fields[record])
    problem = f"found {plural(n_fields, 'field')}, {usual_text}."
    if n_fields < usual:
        return Fault(problem, "a field for each column, empty ones for Any")
    fields = fields_of(raw[start:stop], n_fields) if stop - start <= MOST_CHARACTERS else []
    return Fault(problem, "a cell with a comma in it in double quotes", _pair_in_quotes(fields))


def _pair_in_quotes(fields: list[bytes]) -> str:
    """A centre and its tolerance that a comma has torn apart, as they should stand."""
    pairs = (b",".join(pair) for pair in pairwise(fields))
    return next((f'"{pair.decode()}", in quotes' for pair in pairs if _PAIR.fullmatch(pair)), "")


def _long_faults(raw: bytes, records: Records) -> Iterator[PlacedFault]:
    is_long = records.is_sound & (records.stops - records.starts > MOST_CHARACTERS)
    for record in np.flatnonzero(is_long)[:MOST_FAULTS].tolist():
        start, stop = int(records.starts[record]), int(records.stops[record])
        line = raw[start:stop]
        firsts, lasts = field_bounds(line, np.array([len(line)]), int(records.n_fields[record]))
        for at in np.flatnonzero(lasts[0] - firsts[0] > MOST_CHARACTERS).tolist():
            size = len(text_of(line[firsts[0, at] : lasts[0, at]]))
            if size > MOST_CHARACTERS:
                problem = f"field {at + 1:,} has {size:,} characters."
                yield start, Fault(problem, f"at most {MOST_CHARACTERS:,} characters in a cell")
