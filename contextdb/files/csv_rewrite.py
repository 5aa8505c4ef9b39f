"""Texts written over the CSV they came from: what nobody changed keeps its bytes.

Rows that are as they were are copied in runs, with their line ends. A row that changed, or whose columns moved, is put together
from the fields as the source has them and those that are rewritten. So an edit changes its line, and in it its field.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from contextdb.bitmask import Flags
from contextdb.columns import TextColumn
from contextdb.errors import Fault, Place, TableError, in_quotes
from contextdb.files.csv_records import Positions, as_field, field_bounds, fields_of, needs_quotes
from contextdb.files.csv_source import CONFLICT, MOST_CHARACTERS, NO_SOURCE, Source, name_faults
from contextdb.files.strangers import UTF8_BOM, other_delimiter

Origin = NDArray[np.int64]
"""For each row, the record of the source it came from, or -1 for a new row."""

_SAMPLE = 100
"""Records that tell whether a column's fields always are in quotes."""


def rewritten(
    columns: Sequence[TextColumn], source: Source | None, origin: Origin, field_of: Sequence[int] | None = None
) -> Source:
    """Write texts over the source they came from; gives the new bytes as `read_csv` would read them: record r is row r.

    `columns` are those of the new file. Without a source it is a fresh CSV with line feeds, and quotes where they are needed.
    `origin` int64 [n_rows] is the record of the source that each row came from, -1 for a new row, which is written in the file's
    own style. `field_of` is the column of the source that each column came from, -1 for a new one; None: the one of the same name.
    Raises TableError for a text or a name that a CSV cannot hold, such as one with a NUL character.
    """
    change = _Change.of(columns, source or NO_SOURCE, origin, field_of)
    faults = [*name_faults([c.name for c in columns]), *_unwritable(change)]
    if faults or not columns:
        raise TableError(*faults or [Fault("the table has no columns.", "at least one column, the assets")])
    built = _built_rows(change)
    if change.is_moved or [c.name for c in columns] != [c.name for c in change.source.columns]:
        built[-1] = _header(change)
    return _assembled(change, built)


@dataclass(frozen=True, eq=False)
class _Change:
    """What became of a source: its rows (`origin`), its columns (`fields`) and its texts (`changed`)."""

    columns: Sequence[TextColumn]
    source: Source
    origin: Origin
    fields: Sequence[int]
    """The column of the source that each column came from, or -1."""
    changed: Mapping[int, Flags]
    """For each column that has any, the rows whose text is not the source's: all new rows, and every row of a new column."""

    @classmethod
    def of(cls, columns: Sequence[TextColumn], source: Source, origin: Origin, field_of: Sequence[int] | None) -> _Change:
        fields = source_fields(columns, source.columns, field_of)
        flags = changed_rows(columns, source.columns, fields, origin)
        return cls(columns, source, origin, fields, {at: rows for at, rows in enumerate(flags) if rows.any()})

    @property
    def is_moved(self) -> bool:
        """Whether columns were added, taken away or moved."""
        return list(self.fields) != list(range(len(self.source.columns)))


def source_fields(columns: Sequence[TextColumn], before: Sequence[TextColumn], field_of: Sequence[int] | None) -> list[int]:
    """Which column of the source each column came from, or -1: as given, else the one of the same name."""
    by_name = {column.name: at for at, column in enumerate(before)}
    return [by_name.get(c.name, -1) for c in columns] if field_of is None else list(field_of)


def changed_rows(columns: Sequence[TextColumn], before: Sequence[TextColumn], fields: Sequence[int], origin: Origin) -> list[Flags]:
    """For each column, the rows whose text is not the source's: bool [n_rows]. New rows, and all of a new column, are changed."""
    is_in_order = bool(before) and np.array_equal(origin, np.arange(before[0].n_rows))
    nothing, all_rows = np.zeros(len(origin), np.bool_), np.ones(len(origin), np.bool_)
    flags = []
    for column, old in ((c, before[f] if f >= 0 else None) for c, f in zip(columns, fields, strict=True)):
        if old is None:
            flags.append(all_rows)
        elif is_in_order and column.codes is old.codes and column.texts is old.texts:
            flags.append(nothing)
        else:
            flags.append(_differs(column, old, origin))
    return flags


def _differs(column: TextColumn, before: TextColumn, origin: Origin) -> Flags:
    known = {text: code for code, text in enumerate(before.texts)}
    as_before = np.array([known.get(text, -1) for text in column.texts], np.int64)
    flags: Flags = origin < 0
    old = np.flatnonzero(~flags)
    flags[old] = as_before[column.codes[old]] != before.codes[origin[old]]
    return flags


# ---- texts that no CSV can hold


def _unwritable(change: _Change) -> Iterator[Fault]:
    for column in change.columns:
        if why := _why_unwritable(column.name):
            yield Fault(f"the column name {why}.", "text in UTF-8", place=Place(column=column.name))
    for at, flags in change.changed.items():
        column = change.columns[at]
        for code in np.unique(column.codes[flags]).tolist():
            if why := _why_unwritable(column.texts[code]):
                row = int(np.flatnonzero(flags & (column.codes == code))[0])
                yield Fault(f"the text {why}.", "text in UTF-8", place=Place(column=column.name, row=row))


def _why_unwritable(text: str) -> str | None:
    if "\0" in text:
        return f"{in_quotes(text)} has a NUL character"
    if len(text) > MOST_CHARACTERS:
        return f"has {len(text):,} characters, more than {MOST_CHARACTERS:,}"
    try:
        text.encode()
    except UnicodeEncodeError as error:
        return f"has half a surrogate pair as character {error.start + 1}"
    return None


# ---- lines


def _header(change: _Change) -> bytes:
    source = change.source
    old = fields_of(source.raw[source.starts[0] : source.stops[0]], len(source.columns)) if source.columns else []
    pairs = zip(change.columns, change.fields, strict=True)
    return _guarded(
        b",".join(old[f] if f >= 0 and source.columns[f].name == c.name else as_field(c.name) for c, f in pairs), is_header=True
    )


def _built_rows(change: _Change) -> dict[int, bytes]:
    """The lines of new and changed rows, by row."""
    is_built: Flags = np.logical_or.reduce([change.origin < 0, *change.changed.values()]) | change.is_moved
    rows = np.flatnonzero(is_built)
    if not len(rows):
        return {}
    always = _always_quoted(change.source)
    is_quoted = [f >= 0 and always[f] for f in change.fields]
    new, old = rows[change.origin[rows] < 0], rows[change.origin[rows] >= 0]
    new_parts = [_written(c, new, q) for c, q in zip(change.columns, is_quoted, strict=True)]
    old_parts = _parts_of_old_rows(change, old, is_quoted) if len(old) else ()
    lines = [_guarded(b",".join(parts)) for part in (new_parts, old_parts) for parts in zip(*part, strict=True)]
    return dict(zip([*new.tolist(), *old.tolist()], lines, strict=True))


def _written(column: TextColumn, rows: Positions, is_quoted: bool) -> list[bytes]:
    """A column's fields in some rows, rewritten."""
    codes = column.codes[rows]
    written = {code: as_field(column.texts[code], is_quoted) for code in np.unique(codes).tolist()}
    return [written[code] for code in codes.tolist()]


def _parts_of_old_rows(change: _Change, rows: Positions, is_quoted: Sequence[bool]) -> Iterator[list[bytes]]:
    """What the lines of some rows consist of, from left to right: runs of fields as the source has them, and fields written
    again."""
    source, fields, end = change.source, change.fields, 0
    records = change.origin[rows] + 1
    first, last = source.starts[records], source.stops[records]
    chunk = b"".join([source.raw[a:b] for a, b in zip(first.tolist(), last.tolist(), strict=True)])
    starts, stops = field_bounds(chunk, last - first, len(source.columns))
    while end < len(fields):
        at, end = end, _end_of_run(change, end)
        if fields[at] < 0:
            yield _written(change.columns[at], rows, is_quoted[at])
            continue
        bounds = zip(starts[:, fields[at]].tolist(), stops[:, fields[end - 1]].tolist(), strict=True)
        parts = [chunk[a:b] for a, b in bounds]
        if at in change.changed:
            column = change.columns[at]
            for i in np.flatnonzero(change.changed[at][rows]).tolist():
                parts[i] = as_field(column[int(rows[i])], is_quoted[at] or _is_quoted_without_need(parts[i]))
        yield parts


def _end_of_run(change: _Change, at: int) -> int:
    """Where the columns end that stand side by side in the source as they do now, and did not change; at least one column."""
    end = at + 1
    if at in change.changed:
        return end
    while end < len(change.fields) and end not in change.changed and change.fields[end] == change.fields[end - 1] + 1:
        end += 1
    return end


def _is_quoted_without_need(field: bytes) -> bool:
    return field.startswith(b'"') and not needs_quotes(field[1:-1])


def _always_quoted(source: Source) -> list[bool]:
    """Whether each column of the source always is in quotes, needed or not, as far as a sample shows."""
    width = len(source.columns)
    taken = range(1, min(_SAMPLE, source.n_records) + 1) if source.n_records > 0 else range(len(source.stops))
    sample = [fields_of(source.raw[source.starts[r] : source.stops[r]], width) for r in taken]
    columns = zip(*sample, strict=True)
    return [any(map(_is_quoted_without_need, c)) and all(f.startswith(b'"') for f in c) for c in columns]


def _guarded(line: bytes, is_header: bool = False) -> bytes:
    """The line, its first field in quotes where it would be taken for a blank line, a BOM, git's mark or another kind of CSV."""
    is_other = is_header and (line.startswith(UTF8_BOM) or other_delimiter(line) is not None)
    if line and not line.startswith(CONFLICT) and not is_other:
        return line
    field, comma, rest = line.partition(b",")
    return b'"' + field + b'"' + comma + rest


# ---- the file


def _assembled(change: _Change, built: Mapping[int, bytes]) -> Source:
    """Put the file together. Line i is row i - 1, and line 0 the header; `built` holds those that are not copied, by row."""
    source, line_end = change.source, change.source.line_end.encode()
    records = np.append(0 if source.columns else -1, np.where(change.origin < 0, -1, change.origin + 1))
    is_old = records >= 0
    sizes, gaps = np.zeros(len(records), np.int64), np.full(len(records), len(line_end))
    sizes[is_old] = (source.stops - source.starts[:-1])[records[is_old]]
    gaps[is_old] = (source.starts[1:] - source.stops)[records[is_old]]
    lines = np.array([row + 1 for row in built], np.int64)
    sizes[lines] = [len(line) for line in built.values()]
    gaps_now = np.where(gaps == 0, len(line_end), gaps)
    if not source.ends_with_line_end:
        gaps_now[-1] = 0
    is_copied = is_old & (gaps_now == gaps)
    is_copied[lines] = False
    head = source.raw[: source.starts[0]]
    raw = b"".join([head, *_pieces(source, records, built, is_copied, gaps_now > 0)])
    starts = len(head) + np.append(0, np.cumsum(sizes + gaps_now))
    return Source(raw, starts, starts[:-1] + sizes, tuple(change.columns))


def _pieces(source: Source, records: Origin, built: Mapping[int, bytes], is_copied: Flags, is_ended: Flags) -> Iterator[bytes]:
    """Runs of records as they are in the source, and between them single lines that are new or end otherwise."""
    line_end = source.line_end.encode()
    is_next = is_copied[1:] & is_copied[:-1] & (records[1:] == records[:-1] + 1)
    breaks = [0, *(np.flatnonzero(~is_next) + 1).tolist(), len(records)]
    for start, stop in pairwise(breaks):
        first, last = int(records[start]), int(records[stop - 1])
        if is_copied[start]:
            yield source.raw[source.starts[first] : source.starts[last + 1]]
            continue
        yield built[start - 1] if start - 1 in built else source.raw[source.starts[first] : source.stops[first]]
        if is_ended[start]:
            yield (source.raw[source.stops[first] : source.starts[first + 1]] if first >= 0 else b"") or line_end
