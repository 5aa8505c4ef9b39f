"""Which format a file is in, and who reads and writes it. Each format's module is loaded when it is first needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import TYPE_CHECKING

from contextdb.columns import TextColumn
from contextdb.edits.notes import NO_NOTES, Notes
from contextdb.errors import Fault, FileError, Place, TableError, in_quotes, nearest, no_such
from contextdb.exchange.reading import Reading, Remark
from contextdb.exchange.unreal import Formulas
from contextdb.files.strangers import page, pointer, seems_to_be
from contextdb.tables.table import Table

if TYPE_CHECKING:
    from contextdb.exchange.grid import Block


@dataclass(frozen=True, slots=True)
class Format:
    """A format: what it is called, and the endings of its files."""

    name: str
    about: str
    suffixes: tuple[str, ...]
    is_read: bool = True
    is_written: bool = True


FORMATS: Mapping[str, Format] = {
    one.name: one
    for one in (
        Format("csv", "CSV; commas, semicolons or tabs are detected on reading", (".csv", ".txt")),
        Format("tsv", "tab-separated text, as on the clipboard", (".tsv", ".tab")),
        Format("xlsx", "an Excel workbook", (".xlsx", ".xlsm", ".xls")),
        Format("parquet", "Parquet", (".parquet", ".pq")),
        Format("jsonl", "JSON lines, an object for each row", (".jsonl", ".ndjson")),
        Format("json", "JSON, a list of objects", (".json",)),
        Format("dmn", "a DMN decision table", (".dmn",)),
        Format("unreal-csv", "an Unreal DataTable as CSV", ()),
        Format("unreal-json", "an Unreal DataTable as JSON", ()),
    )
}
_GRIDS = ("csv", "tsv", "xlsx")
"""Formats in which only its place says that a row names the columns."""
_OTHER_WORKBOOKS = (".ods", ".fods", ".xlsb", ".numbers")
"""Workbooks that are not read, nor written."""
SAVE_AS_XLSX = 'to save it as "Excel workbook" (.xlsx)'
_BINARY_SIGNS = {"an Excel workbook (.xlsx)": "xlsx", "an old Excel workbook (.xls)": "xlsx", "a Parquet file": "parquet"}


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """What a person may say of a file that is read; None: the file decides."""

    format: str | None = None
    sheet: str | None = None
    """A sheet or cells of a workbook, or a decision of a DMN file."""
    encoding: str | None = None
    delimiter: str | None = None
    is_decimal_comma: bool | None = None
    has_whole_names: bool | None = None
    """Whether a text with blanks in it is one name, in a column that nobody declares; None: it is, but in files of our own."""

    @property
    def says_how(self) -> bool:
        """Whether it is specified how a text is to be read."""
        return (self.encoding, self.delimiter, self.is_decimal_comma) != (None, None, None)


def format_of(name: str, wanted: str | None = None, raw: bytes = b"", for_writing: bool = False) -> Format:
    """The format of a file: the one that is wanted, else by its first bytes, else by its suffix. Raises FileError where there is no
    such format, or the suffix gives none."""
    known = {key: one for key, one in FORMATS.items() if (one.is_written if for_writing else one.is_read)}
    if wanted is not None:
        if wanted not in known:
            raise FileError(no_such("format", wanted, known, ", ".join(known)))
        return known[wanted]
    if sign := _BINARY_SIGNS.get(seems_to_be(raw[:10_000]) or ""):
        return known[sign]
    suffix = PurePath(name).suffix.lower()
    match = next((one for one in known.values() if suffix in one.suffixes), None)
    if match and not (for_writing and suffix not in match.suffixes[:1] and match.name == "xlsx"):
        return match
    suffixes = [one.suffixes[0] for one in known.values() if one.suffixes]
    near = ".xlsx" if suffix in _OTHER_WORKBOOKS else nearest(suffix, suffixes)
    mend = SAVE_AS_XLSX if suffix in _OTHER_WORKBOOKS and not for_writing else in_quotes(near) if near else ""
    problem = (
        f"a file that ends in {in_quotes(suffix)} is of no known format."
        if suffix
        else "the name has no suffix that gives a format."
    )
    raise FileError(Fault(problem, f"{', '.join(suffixes)}, or --as with a format", mend, Place(name)))


def read(raw: bytes, name: str, options: ReadOptions = ReadOptions()) -> Reading:
    """Read a table of any format from the bytes of a file; `name` is for its suffix, and for messages. Raises TableError where the
    file cannot be read as what it is, with the place of every fault; FileError where it is of no known format."""
    kind = format_of(name, options.format, raw)
    if fault := pointer(raw) or (page(raw) if kind.name in ("csv", "tsv", "unreal-csv") else None):
        raise TableError(fault.at(Place(name)))
    reading = _read(kind.name, raw, name, options)
    if kind.name in _GRIDS:
        from contextdb.exchange.grid import doubts

        reading = replace(reading, remarks=(*reading.remarks, *doubts(reading.columns)))
    if options.is_decimal_comma and kind.name not in ("csv", "tsv", "unreal-csv"):
        from contextdb.exchange.reading import with_points

        columns, remarks = with_points(reading.columns, "", True)
        reading = replace(reading, columns=tuple(columns), remarks=(*reading.remarks, *remarks), source=None)
    if options.has_whole_names is not None:
        reading = replace(reading, has_whole_names=options.has_whole_names)
    suffix = PurePath(name).suffix.lower()
    if options.format is None and suffix and suffix not in kind.suffixes:
        remark = Remark(f"by its first bytes this is {kind.about}, though its name ends in {suffix}.")
        return replace(reading, remarks=(remark, *reading.remarks))
    return reading


def sheet_names(raw: bytes, name: str) -> list[str]:
    """The sheets of a workbook that may hold a table. Raises TableError where it is not a workbook that can be read."""
    from contextdb.exchange.xlsx_read import sheets_of

    return sheets_of(raw, name)


def grid_of(raw: bytes, name: str, options: ReadOptions) -> tuple[str, Sequence[Sequence[str]]]:
    """The sheet of a workbook, with its name, or a text with delimiters as it stands: rows of texts, all equally wide. Raises
    ContextDBError as `read` does; TableError for a file without such rows."""
    kind = format_of(name, options.format, raw).name
    if kind == "xlsx":
        from contextdb.exchange.xlsx_read import grid_of_workbook

        return grid_of_workbook(raw, name, options.sheet)
    if kind not in ("csv", "tsv"):
        raise TableError(Fault(f"{FORMATS[kind].about} has no rows to choose from.", "a workbook or CSV", place=Place(name)))
    from contextdb.exchange.delimited import decoded, records

    return "", records(decoded(raw, name, options.encoding)[0], name, options.delimiter or ("\t" if kind == "tsv" else None))


def _read(kind: str, raw: bytes, name: str, options: ReadOptions) -> Reading:
    if kind == "xlsx":
        from contextdb.exchange.xlsx_read import read_workbook

        return read_workbook(raw, name, options.sheet)
    if kind == "dmn":
        from contextdb.exchange.dmn_read import read_dmn

        return read_dmn(raw, name, options.sheet)
    from contextdb.exchange.grid import parse_block

    block = parse_block(options.sheet or "") if kind in _GRIDS else None
    if options.sheet is not None and block is None:
        accepted = "its cells, such as A1:F20" if kind in _GRIDS else "no --sheet"
        raise TableError(Fault(f"{FORMATS[kind].about} has no sheets.", accepted, place=Place(name)))
    if kind == "parquet":
        return _read_parquet(raw, name)
    if kind == "csv" and not options.says_how and not block and (ours := _own_csv(raw, name, options.has_whole_names is False)):
        return ours
    return _read_text(kind, raw, name, options, block)


def _read_parquet(raw: bytes, name: str) -> Reading:
    from contextdb.files.parquet import read_parquet

    source, columns = read_parquet(raw, name)
    return Reading(tuple(columns), "parquet", source=source)


def _own_csv(raw: bytes, name: str, is_ours: bool) -> Reading | None:
    """A CSV that contextdb reads as it is, so that it is written as it is; None for every other, as one with a total below it."""
    from contextdb.exchange.everyday import is_sum
    from contextdb.exchange.reading import begins_like_a_mark
    from contextdb.exchange.unreal import is_unreal_header
    from contextdb.files.csv_source import read_csv

    try:
        source, columns = read_csv(raw, name)
    except TableError:
        return None
    last = columns[0][columns[0].n_rows - 1] if columns[0].n_rows else ""
    if any(map(begins_like_a_mark, columns[0].texts)) or (is_sum(last) and not is_ours):
        return None
    if is_unreal_header([c.name for c in columns]) or (len(columns) == 1 and _is_parted_otherwise(columns[0])):
        return None
    return Reading(tuple(columns), "csv", source=source, has_whole_names=True)


def _is_parted_otherwise(column: TextColumn) -> bool:
    """Whether the only column of a CSV has another delimiter in its name, or, below a title, as often in each text."""
    counts = ({text.count(mark) for text in column.texts[:100]} for mark in ";\t|")
    return any(mark in column.name for mark in ";\t|") or any(len(n) == 1 and min(n) > 1 for n in counts)


def _read_text(kind: str, raw: bytes, name: str, options: ReadOptions, block: Block | None) -> Reading:
    from contextdb.exchange import unreal
    from contextdb.exchange.delimited import decoded, read_delimited
    from contextdb.exchange.json_rows import read_json

    text, remarks = decoded(raw, name, options.encoding)
    if kind in ("json", "jsonl", "unreal-json"):
        reading = read_json(text, name, kind)
        if kind == "unreal-json":
            reading = unreal.from_json(reading)
    else:
        delimiter = options.delimiter or ("\t" if kind == "tsv" else "," if kind == "unreal-csv" else None)
        reading = read_delimited(text, name, delimiter, block, options.is_decimal_comma)
        if kind == "unreal-csv" or (kind == "csv" and unreal.is_unreal_header(reading.names)):
            reading = unreal.from_csv(reading)
    return replace(reading, remarks=(*remarks, *reading.remarks))


def write(table: Table, kind: Format, formulas: Formulas = "tell", notes: Notes = NO_NOTES) -> tuple[bytes, tuple[Remark, ...]]:
    """The bytes of a table in a format, and what could not be kept. `formulas` is "tell", "keep" or "quote": what becomes of texts
    of CSV and TSV that a spreadsheet may compute, see `contextdb.exchange.unreal`; `notes` are kept by a workbook.

    Raises TableError where the table has what the
    format cannot hold, with its place."""
    try:
        return _written(table, kind.name, formulas, notes)
    except UnicodeEncodeError:
        raise TableError(Fault("a text has half a surrogate pair.", "text in UTF-8")) from None


def _written(table: Table, kind: str, formulas: Formulas, notes: Notes) -> tuple[bytes, tuple[Remark, ...]]:
    columns: Sequence[TextColumn] = table.columns
    remarks: tuple[Remark, ...] = ()
    if kind in ("csv", "tsv"):
        from contextdb.exchange.unreal import formula_remarks, quoted_formulas

        remarks = formula_remarks(columns) if formulas == "tell" else ()
        columns = quoted_formulas(columns) if formulas == "quote" else columns
    if kind == "xlsx":
        from contextdb.exchange.xlsx_write import write_xlsx

        return write_xlsx(table, notes), ()
    if kind in ("csv", "parquet"):
        from contextdb.files.texts import written_over

        return written_over(table.source, columns, table.origin, as_parquet=kind == "parquet").raw, remarks
    if kind == "tsv":
        from contextdb.exchange.delimited import write_tab_text

        return write_tab_text(columns), remarks
    if kind in ("json", "jsonl"):
        from contextdb.exchange.json_rows import write_json, write_json_lines

        lost = () if table.n_rows else (Remark("a table without rows leaves no names of columns in JSON.", is_loss=True),)
        return (write_json if kind == "json" else write_json_lines)(columns), lost
    if kind == "dmn":
        from contextdb.exchange.dmn_write import write_dmn

        return write_dmn(table)
    from contextdb.exchange import unreal

    return unreal.write_json(table) if kind == "unreal-json" else unreal.write_csv(table)
