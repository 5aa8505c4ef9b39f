"""Texts with delimiters, in the dialects that Excel and other programs write: which one a file is in, and its grid.

Commas, semicolons, tabs or vertical bars; fields in double quotes with quotes doubled; "sep=;" as the first line, which Excel
obeys. Decimal commas are distinguished from pairs (centre, tolerance) by the rest of the file. What was decided, and why,
is in the remarks.
"""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice

from contextdb.columns import TextColumn
from contextdb.errors import Fault, Place, TableError, in_quotes, no_such, plural
from contextdb.exchange.grid import MOST_ABOVE, Block, columns_of, is_grouped, is_header
from contextdb.exchange.reading import Reading, Remark, require_no_conflicts, with_points
from contextdb.files.csv_source import MOST_CHARACTERS
from contextdb.files.strangers import line_of, other_kind

DELIMITERS = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "vertical bars"}
SAMPLE = 100
"""Records that tell which delimiter a file has."""

LEAST_BELOW_TITLE = 3
"""Columns of a table below a title; with two, a comma in a text could make the header."""

_SEP_LINE = re.compile(r'"?sep=(.)"?\r?\n?', re.IGNORECASE)
_BROKEN = {
    "unexpected end of data": "a quoted field is never closed",
    "'\"' expected after '\"'": "a field continues after its closing quote",
    "delimiter": "a field continues after its closing quote",
}


@dataclass(frozen=True, slots=True)
class Dialect:
    """How a text is cut into fields."""

    delimiter: str
    first: int = 0
    """Where its first record starts: behind a "sep=;" line."""
    remarks: tuple[Remark, ...] = ()


def read_delimited(
    text: str, file: str, wanted: str | None = None, block: Block | None = None, is_decimal_comma: bool | None = None
) -> Reading:
    """Read a text with delimiters: those that are `wanted`, else those that fit best. `is_decimal_comma` says whether 3,5 is a
    number with a decimal comma; None: the cells tell. `block` is cells that were chosen, by record and field.

    Raises TableError, with the line, for an unresolved git conflict, quotes that
    do not close, rows of different length, or no table."""
    require_no_conflicts(text, file)
    dialect = dialect_of(text, wanted)
    grid, notes = _records(text[dialect.first :], dialect.delimiter, file, has_titles=block is None)
    top = int(block is None and is_grouped(grid[:2]))
    all_cells = Block(top, 0, len(grid), len(grid[0]) if grid else 0)
    read = columns_of(grid, file, block or all_cells, "line", takes_all=block is not None and not block.is_open)
    columns, decimals = with_points(read.columns, dialect.delimiter, is_decimal_comma)
    lost = [group for group in filter(None, grid[0]) if not any(c.name.startswith(group) for c in columns)] if top else []
    notes += [Remark(f"left out above the header: {in_quotes(', '.join(lost))}.")] if lost else []
    name = "tsv" if dialect.delimiter == "\t" else "csv"
    return Reading(tuple(columns), name, (*dialect.remarks, *notes, *read.remarks, *decimals), has_whole_names=True)


def records(text: str, file: str, wanted: str | None = None) -> list[list[str]]:
    """All records of a text, as wide as the longest. Raises TableError where quotes do not close."""
    dialect = dialect_of(text, wanted)
    return _records(text[dialect.first :], dialect.delimiter, file, has_titles=False)[0]


def dialect_of(text: str, wanted: str | None = None) -> Dialect:
    """The dialect of a text; the remarks say how it was inferred."""
    if wanted is not None:
        return Dialect(wanted)
    if match := _SEP_LINE.match(text):
        named = DELIMITERS.get(match[1], in_quotes(match[1]))
        return Dialect(
            match[1], match.end(), (Remark(f"{named} between the fields, as the line {in_quotes(match[0].strip())} says."),)
        )
    counts = {mark: _field_counts(text, mark) for mark in DELIMITERS}
    best = max(DELIMITERS, key=lambda mark: _fitness(counts[mark]))
    if _fitness(counts[best])[0] == 0:
        return Dialect(",", 0, (Remark("one column: the first line has no delimiter."),))
    header, agreeing, total = _fit(counts[best])
    sentence = f"{DELIMITERS[best]} between the fields: {header} in the first line and in {agreeing:,} of the next {total:,}."
    return Dialect(
        best, 0, (Remark(sentence),) if total else (Remark(f"{DELIMITERS[best]} between the fields: {header} in the first line."),)
    )


def _field_counts(text: str, delimiter: str) -> list[int]:
    """How many fields each of the first records has under a delimiter; blank lines have none."""
    records = csv.reader(io.StringIO(text[: SAMPLE * 4096], newline=""), delimiter=delimiter)
    try:
        counts = [len(record) for record in islice(records, SAMPLE + 1) if any(record)]
    except csv.Error:
        return []
    header = next((at for at, n in enumerate(counts[:MOST_ABOVE]) if n > 1), 0)
    return counts[header:] if counts and counts[header] >= LEAST_BELOW_TITLE else counts  # a title has one field


def _fit(counts: Sequence[int]) -> tuple[int, int, int]:
    """The fields of the header, how many other records have as many, and how many others there are."""
    header, rest = counts[0], counts[1:]
    return header, sum(n == header for n in rest), len(rest)


def _fitness(counts: Sequence[int]) -> tuple[float, int]:
    """How well a delimiter fits: the share of records that have as many fields as the header, and how many those are."""
    if not counts or counts[0] < 2:
        return 0.0, 0
    header, agreeing, total = _fit(counts)
    return (1 + agreeing) / (1 + total), header


def _records(text: str, delimiter: str, file: str, has_titles: bool = True) -> tuple[list[list[str]], list[Remark]]:
    """The records of a text, all as wide as its header; of one in which cells were chosen, as wide as the longest."""
    csv.field_size_limit(max(csv.field_size_limit(), 2 * MOST_CHARACTERS))
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    grid, lines, line = list[list[str]](), list[int](), 1
    try:
        for record in reader:
            if record or grid:
                grid.append(record)
                lines.append(line)
            line = reader.line_num + 1
    except csv.Error as error:
        raise TableError(_broken(str(error), text, line, file)) from None
    while grid and not any(grid[-1]):
        grid.pop()
    if not has_titles:
        width = max(map(len, grid), default=0)
        return [record + [""] * (width - len(record)) for record in grid], []
    titles = _titles(grid)
    titles_above = [(at, next(filter(None, grid[at]), "")) for at in titles]
    remarks = [Remark(f"left out above the header: {in_quotes(text)}.", f"line {lines[at]}") for at, text in titles_above if text]
    grid, short = _evened(grid[len(titles) :], lines[len(titles) :], file)
    return grid, [*remarks, *short]


def _titles(grid: Sequence[list[str]]) -> range:
    """The first records, where they are a title: at most one field each that says something, then a header of several columns, or
    groups of them above it, which become as wide."""
    n = next((at for at, record in enumerate(grid[:MOST_ABOVE]) if sum(map(bool, record)) > 1), 0)
    top = next((at for at in (n - 1, n) if at >= 0 and is_grouped(grid[at : at + 2])), None)
    if top is not None and len(grid[top + 1]) >= LEAST_BELOW_TITLE:
        grid[top] += [""] * (len(grid[top + 1]) - len(grid[top]))
        return range(top)
    return range(n if n and len(grid[n]) >= LEAST_BELOW_TITLE and is_header(grid[n]) else 0)


def _evened(grid: list[list[str]], lines: Sequence[int], file: str) -> tuple[list[list[str]], list[Remark]]:
    """Records as wide as the header: empty fields at the end may be missing or too many; others are faults."""
    if not grid:
        return grid, []
    while len(grid[0]) > 1 and not grid[0][-1].strip() and not any(any(record[len(grid[0]) - 1 :]) for record in grid):
        grid[0].pop()
    width = len(grid[0])
    wrong = [at for at, record in enumerate(grid) if len(record) > width and any(record[width:])]
    if wrong:
        faults = [_too_wide(len(grid[at]), width, Place(file, lines[at])) for at in wrong[:20]]
        raise TableError(*faults)
    short = [at for at, record in enumerate(grid) if 0 < len(record) < width and any(record)]
    grid = [record if len(record) == width else (record + [""] * (width - len(record)))[:width] for record in grid]
    if not short:
        return grid, []
    return grid, [
        Remark(
            f"{plural(len(short), 'line')} with fewer than {width} fields; the missing ones are empty.", f"line {lines[short[0]]}"
        )
    ]


def _too_wide(n_fields: int, width: int, place: Place) -> Fault:
    problem = f"found {plural(n_fields, 'field')}, the first line has {width}."
    return Fault(problem, "a field with the delimiter in it in double quotes", "to name the delimiter with --delimiter", place)


def _broken(why: str, text: str, line: int, file: str) -> Fault:
    if "field limit" in why:
        return Fault(f"a field has more than {MOST_CHARACTERS:,} characters.", "a shorter one", place=Place(file, line))
    reason = next((sentence for part, sentence in _BROKEN.items() if part in why), why)
    shown_line = next(islice(io.StringIO(text), line - 1, None), "").rstrip("\r\n")
    accepted = "a field in double quotes from its start to its end, each quote in it doubled"
    return Fault(f"{reason}: {in_quotes(shown_line)}.", accepted, place=Place(file, line))


# ---- tab-separated text


_NEEDS_QUOTES = re.compile(r'[\t\r\n]|^"')


def tsv_field(text: str) -> str:
    """A cell as tab-separated text has it."""
    return '"' + text.replace('"', '""') + '"' if _NEEDS_QUOTES.search(text) else text


def write_tab_text(columns: Sequence[TextColumn]) -> bytes:
    """Columns as tab-separated text in UTF-8, the names first."""
    fields = [[tsv_field(text) for text in column.texts] for column in columns]
    header = "\t".join(tsv_field(column.name) for column in columns)
    cells = [[texts[code] for code in column.codes.tolist()] for texts, column in zip(fields, columns, strict=True)]
    return "".join(f"{line}\n" for line in (header, *map("\t".join, zip(*cells, strict=True)))).encode()


# ---- bytes of a text file as text, and how they were understood: UTF-8, UTF-16, or Windows-1252 as old Excel writes it


BOMS = (
    (codecs.BOM_UTF8, "utf-8", "UTF-8 with a byte order mark"),
    (codecs.BOM_UTF32_LE, "utf-32-le", "UTF-32"),
    (codecs.BOM_UTF16_LE, "utf-16-le", "UTF-16"),
    (codecs.BOM_UTF16_BE, "utf-16-be", "UTF-16 (big end first)"),
)
COMMON = ("utf-8", "utf-16", "cp1252", "cp1250", "cp1251", "latin-1", "mac-roman", "shift-jis", "gb18030", "big5", "euc-kr")
_WITHOUT_BOM = (("utf-16-le", 1), ("utf-16-be", 0))


def decoded(raw: bytes, file: str, encoding: str | None = None) -> tuple[str, list[Remark]]:
    """The text of a file in an encoding, else in the one that its bytes tell, without its byte order mark, and remarks on how it
    was understood. Raises TableError where the bytes are not text of that encoding, with the line, or no text at all."""
    if encoding is not None:
        return _decoded_as(raw, file, _known(encoding, file)), []
    for mark, name, remark in BOMS:
        if raw.startswith(mark):
            return _decoded_as(raw[len(mark) :], file, name), [Remark(f"the text is {remark}.")] if name != "utf-8" else []
    if detected := _utf16(raw):
        return _decoded_as(raw, file, detected), [Remark("the text is UTF-16 without a byte order mark.")]
    if b"\0" in raw:
        fault = Fault("not a text file: it contains NUL bytes.", "a text file", place=Place(line=line_of(raw, raw.find(0))))
        raise _refusal(other_kind(raw) or fault, file)
    try:
        return raw.decode(), []
    except UnicodeDecodeError as error:
        if other := other_kind(raw):
            raise _refusal(other, file) from None
        return _old_windows(raw, file, error)


def _refusal(fault: Fault, file: str) -> TableError:
    return TableError(fault.at(Place(file, fault.place.line)))


def _old_windows(raw: bytes, file: str, error: UnicodeDecodeError) -> tuple[str, list[Remark]]:
    """Text that is not UTF-8 is most likely that of an old Windows program in the west; the message shows a word to judge by."""
    text = _decoded_as(raw, file, "cp1252")
    word = raw[max(error.start - 12, 0) : error.start + 12].decode("cp1252", "replace")
    message = f"byte 0x{raw[error.start]:02X} is not UTF-8; the file is read as Windows-1252: {in_quotes(word.strip())}."
    message += " If that is wrong, name another encoding."
    return text, [Remark(message, f"line {line_of(raw, error.start)}", is_loss=True)]


def _decoded_as(raw: bytes, file: str, encoding: str) -> str:
    try:
        return raw.decode(encoding).removeprefix("\ufeff")
    except UnicodeError as error:
        start = error.start if isinstance(error, UnicodeDecodeError) else 0
        problem = f"byte 0x{raw[start]:02X} on this line is not text in {encoding}." if raw else f"the text is not {encoding}."
        mend = "to name its encoding with --encoding"
        raise TableError(Fault(problem, "UTF-8 or UTF-16, or the encoding named", mend, Place(file, line_of(raw, start)))) from None


def _known(encoding: str, file: str) -> str:
    try:
        codecs.lookup(encoding)
        "".encode(encoding)
    except (LookupError, UnicodeError):
        raise TableError(no_such("encoding", encoding, COMMON, ", ".join(COMMON), Place(file))) from None
    return encoding


def _utf16(raw: bytes) -> str | None:
    """UTF-16 without a mark, where most characters are of the west: every other byte of the beginning is then NUL."""
    head = raw[: min(len(raw), 400) // 2 * 2]
    for name, at in _WITHOUT_BOM:
        if len(head) >= 4 and not any(head[at::2]) and all(head[1 - at :: 2]):
            return name
    return None
