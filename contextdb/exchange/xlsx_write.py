"""A table as an XLSX workbook that Excel leaves as it is, written by XlsxWriter.

Every cell is formatted as text, so that `5..10`, `1-2`, `007` and `True` stay what they are, and what is typed later stays text
too; plain numbers in columns of numbers are numbers, which can be summed. Notes are comments, and colours of rows fills. The header
and the asset stand frozen, columns are as wide as their texts, bools and enums have a drop-down that suggests without forbidding. A
second sheet keeps what contextdb.toml says. The same table gives the same bytes.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterator, Sequence
from datetime import datetime
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
import xlsxwriter

from contextdb.cells.words import format_number, quoted
from contextdb.columns import TextColumn
from contextdb.console import width_of
from contextdb.edits.notes import NO_NOTES, Notes
from contextdb.errors import Fault, Place, TableError, in_quotes, plural
from contextdb.exchange.grid import column_letters
from contextdb.exchange.mapping import TYPES_SHEET, described
from contextdb.exchange.xlsx_scan import FILLS
from contextdb.tables.table import Table

MOST_ROWS, MOST_COLUMNS, MOST_CHARACTERS, MOST_OF_NAME = 1_048_576, 16_384, 32_767, 31
"""What a sheet of Excel, a cell and the name of a sheet can hold. Characters beyond U+FFFF count as two."""
LEAST_WIDTH, MOST_WIDTH, WIDTH_SAMPLE = 8, 44, 2_000
TYPES_WIDTH = 90
PAGE_WIDTH = 220
"""A table of so many characters across is printed on one page's width; a wider one would be too small to read."""
SPARE_ROWS = 1_000
"""Rows below the table that have drop-downs too."""
NEVER = re.compile(r"[\x00\ufffe\uffff\ud800-\udfff]")
"""Characters that no workbook holds."""

_OPTIONS = {"in_memory": True, "use_zip64": True}
_CREATED = datetime(1980, 1, 1)  # the day that a ZIP archive begins to count from
_TEXT = {"num_format": "@"}
_BOLD = {**_TEXT, "bold": True}
_HEADER = {**_BOLD, "bg_color": "#E7EDF3", "bottom": 1, "bottom_color": "#8497A8"}
_UNFIT_IN_NAMES = re.compile(r"[\[\]:*?/\\\x00-\x1f]")
_FALSE_MARK = re.compile(r"_(?=x[0-9A-Fa-f]{4}[_\x01-\x08\x0b-\x1f])")
_MISSPELT = re.compile(r"\A<r>.*</r>\Z|_x[0-9A-Fa-f]{4}(?:_x[0-9A-Fa-f]{4}_|[\x01-\x08\x0b-\x1f])", re.DOTALL)

Lists = dict[str, tuple[str, ...]]
"""What the drop-down of each column suggests, by the column's name."""


def write_xlsx(table: Table, notes: Notes = NO_NOTES) -> bytes:
    """The workbook of a table and its notes. Raises TableError for more rows or columns than a sheet has, or too long texts."""
    lines, lists = described(table), _lists(table)
    _require_room(table, lines)
    out = io.BytesIO()
    with xlsxwriter.Workbook(out, _OPTIONS) as book:
        book.set_properties({"created": _CREATED})
        text, bold, header = map(book.add_format, (_TEXT, _BOLD, _HEADER))
        fills = {
            word: tuple(book.add_format({**one, "bg_color": colour}) for one in (_TEXT, _BOLD)) for word, colour in FILLS.items()
        }
        of_rows = [fills.get(notes.colours.get(asset, ""), (text, bold)) for asset in table.assets]
        numeric = _numeric(table)
        sheet = book.add_worksheet(sheet_name(table.name))
        _set_up(sheet, table, text)
        for at, column in enumerate(table.columns):
            is_asset = column.name == table.asset_column
            _put(sheet, 0, at, column.name, header)
            styles = [one[is_asset] for one in of_rows]
            _write_column(sheet, at, column, styles, is_asset, column.name in numeric)
            for row, asset in enumerate(table.assets, 1):
                if note := notes.texts.get((asset, column.name)) if notes.texts else None:
                    sheet.write_comment(row, at, note, {"author": "contextdb"})
        _suggest(sheet, table, lists)
        _write_types(book.add_worksheet(TYPES_SHEET), lines, lists, text, header)
    return out.getvalue()


# ---- what fits


def _require_room(table: Table, lines: list[str]) -> None:
    faults = []
    for n, most, noun in ((table.n_rows + 1, MOST_ROWS, "row"), (len(table.columns), MOST_COLUMNS, "column")):
        if n > most:
            faults.append(
                Fault(f"the table has {plural(n, noun)}, its header counted.", f"at most {most:,}, as a sheet of Excel has")
            )
    for column in table.columns:
        faults += [_unfit(text).at(_place(column, text)) for text in (column.name, *column.texts) if _is_unfit(text)]
    faults += [_unfit(line).at(Place(f'sheet "{TYPES_SHEET}"')) for line in lines if _is_unfit(line)]
    if faults:
        raise TableError(*faults)


def _is_unfit(text: str) -> bool:
    return _n_characters(text) > MOST_CHARACTERS or NEVER.search(text) is not None


def _unfit(text: str) -> Fault:
    if NEVER.search(text):
        return Fault(f"{in_quotes(text)} has a character that no workbook holds.", "text without it")
    problem = f"{in_quotes(text)} takes {_n_characters(text):,} characters in a workbook."
    return Fault(problem, f"at most {MOST_CHARACTERS:,}, as a cell of Excel has")


def _place(column: TextColumn, text: str) -> Place:
    row = None if text == column.name else int(np.argmax(column.codes == column.texts.index(text)))
    return Place(column=ascii(column.name)[1:-1] if NEVER.search(column.name) else column.name, row=row)


def _n_characters(text: str) -> int:
    """How many characters a text takes in a cell, as Excel counts them."""
    spelt = _spelt(text)
    return len(spelt) if 2 * len(spelt) <= MOST_CHARACTERS else len(spelt.encode("utf-16-le", "surrogatepass")) // 2


def sheet_name(name: str) -> str:
    """A name that a sheet may have, as near to a table's as can be."""
    fit = _UNFIT_IN_NAMES.sub("_", name).strip(" '")
    shortened = fit.encode("utf-16-le")[: 2 * MOST_OF_NAME].decode("utf-16-le", "ignore").strip(" '") or "table"
    return f"{shortened}_" if shortened.casefold() in (TYPES_SHEET, "history") else shortened


# ---- cells


def _put(sheet: Any, row: int, column: int, text: str, style: Any) -> None:
    sheet.write_string(row, column, _spelt(text), style)


def _spelt(text: str) -> str:
    """What XlsxWriter is given, so that a reader finds the text again: nearly always the text itself.

    A control character stands in a workbook as `_x0001_`, and a text that looks so as `_x005F_x0001_`. XlsxWriter overlooks the
    second of two such marks that share a `_`, and takes `<r>…</r>` for formatted text: these it is given as formatted text.
    """
    if not _MISSPELT.search(text):
        return text
    return f'<r><t xml:space="preserve">{escape(_FALSE_MARK.sub("_x005F_", text)).replace("_", "&#95;")}</t></r>'


def _numeric(table: Table) -> frozenset[str]:
    """The columns whose plain numbers are written as numbers."""
    settings = table.settings
    jobs = (settings.priority, settings.weight, settings.cooldown_s, settings.cooldown_turns)
    return frozenset(
        {*filter(None, jobs), *(one.condition.name for one in table.conditions if one.condition.domain.type.is_numeric)}
    )


def _number(text: str) -> float | None:
    """A text as the number that a reader gives back as this text; None for every other."""
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) and format_number(float(f"{number:.16G}")) == text else None


def _write_column(sheet: Any, at: int, column: TextColumn, styles: Sequence[Any], keeps_empty: bool, is_numeric: bool) -> None:
    """The cells of a column. An empty one is blank, unless it `keeps_empty` texts: a row without any text is a row all the same."""
    write, blank = sheet.write_string, sheet.write_blank
    texts = [_spelt(text) for text in column.texts]
    numbers = [_number(text) if is_numeric else None for text in column.texts]
    for (row, code), style in zip(enumerate(column.codes.tolist(), 1), styles, strict=True):
        text, number = texts[code], numbers[code]
        if number is not None:
            sheet.write_number(row, at, number, style)
        elif text or keeps_empty:
            write(row, at, text, style)
        else:
            blank(row, at, None, style)


# ---- the sheet of the table


def _set_up(sheet: Any, table: Table, text: Any) -> None:
    """What is frozen on the screen and repeated on each page in print, how wide columns are, and how the sheet is printed."""
    n_frozen, widths = _n_frozen(table), [_width(column) for column in table.columns]
    sheet.freeze_panes(1, n_frozen)
    sheet.repeat_rows(0)
    sheet.repeat_columns(0, n_frozen - 1)
    for at, width in enumerate(widths):
        sheet.set_column(at, at, width, text)
    _print_across(sheet, fits_page=sum(widths) <= PAGE_WIDTH)
    last = column_letters(len(widths) - 1)
    sheet.ignore_errors({"number_stored_as_text": f"A1:{last}{table.n_rows + 1}"})


def _n_frozen(table: Table) -> int:
    """How many columns stay in view: those up to the asset's, unless they would fill the screen."""
    n_columns = [c.name for c in table.columns].index(table.asset_column) + 1
    return n_columns if n_columns <= 3 else 1


def _width(column: TextColumn) -> int:
    longest = max(map(width_of, (column.name, *column.texts[:WIDTH_SAMPLE])))
    return min(max(longest, LEAST_WIDTH), MOST_WIDTH) + 2


def _print_across(sheet: Any, fits_page: bool) -> None:
    sheet.set_landscape()
    if fits_page:
        sheet.fit_to_pages(1, 0)


# ---- drop-downs, and the sheet of types


def _lists(table: Table) -> Lists:
    lists: Lists = {name: ("True", "False") for name in (table.settings.enabled, table.settings.once) if name}
    for column in table.conditions:
        domain = column.condition.domain
        if domain.type.is_truth:
            lists[column.condition.name] = ("True", "False", "Any")
        elif domain.type.needs_values and domain.values:
            lists[column.condition.name] = (*map(quoted, domain.values), "Any")
    return lists


def _placed(lists: Lists) -> Iterator[tuple[int, str, tuple[str, ...]]]:
    """Where each list stands on the sheet of types, from column C on, the first column that it is for, and what it suggests."""
    for at, values in enumerate(dict.fromkeys(lists.values()), 2):
        yield at, next(name for name, of in lists.items() if of == values), values


def _suggest(sheet: Any, table: Table, lists: Lists) -> None:
    """Lists to choose from, which stand on the sheet of types: a list in the rule itself is limited to 255 characters."""
    bottom = min(table.n_rows + SPARE_ROWS, MOST_ROWS - 1)
    places = {values: column_letters(at) for at, _, values in _placed(lists)}
    for at, column in enumerate(table.columns):
        if values := lists.get(column.name):
            letter = places[values]
            source = f"={TYPES_SHEET}!${letter}$2:${letter}${len(values) + 1}"
            rule = {"validate": "list", "source": source, "show_error": False, "show_input": False}
            sheet.data_validation(1, at, bottom, at, rule)


def _write_types(sheet: Any, lines: list[str], lists: Lists, text: Any, header: Any) -> None:
    """Column A: the lines of a contextdb.toml. From column C on: what the drop-downs suggest."""
    sheet.set_column(0, 0, TYPES_WIDTH, text)
    _print_across(sheet, fits_page=True)
    for at, texts in ((0, lines), *((at, [name, *values]) for at, name, values in _placed(lists))):
        for row, each in enumerate(texts):
            if each:
                _put(sheet, row, at, each, text if row else header)
