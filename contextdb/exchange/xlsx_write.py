"""A table as an XLSX workbook that Excel leaves as it is.

Every cell is text, formatted as text, so that `5..10`, `1-2`, `007` and `True` stay what they are, and what is typed later stays
text too. The header and the asset stand frozen, columns are as wide as their texts, bools and enums have a drop-down that
suggests without forbidding. A second sheet keeps what contextdb.toml says. Texts are rendered once each, so that a cell costs a
look-up; nothing is installed for this.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator, Sequence

import numpy as np

from contextdb.cell_words import quoted
from contextdb.columns import TextColumn
from contextdb.console import width_of
from contextdb.errors import Fault, Place, TableError, in_quotes, plural
from contextdb.exchange import xlsx_parts as parts
from contextdb.exchange.described import described
from contextdb.exchange.grid import column_letters
from contextdb.table import Table

LEAST_WIDTH, MOST_WIDTH, WIDTH_SAMPLE = 8, 44, 2_000
PAGE_WIDTH = 220
"""A table of so many characters across is printed on one page's width; a wider one would be too small to read."""
SPARE_ROWS = 1_000
"""Rows below the table that have drop-downs too."""
_BLOCK = 5_000
_TIME = (1980, 1, 1, 0, 0, 0)  # the same table gives the same bytes


def write_xlsx(table: Table) -> bytes:
    """The workbook of a table.

    Raises
    ------
    TableError
        More rows or columns than a sheet has, or texts longer than Excel takes.
    """
    _require_room(table)
    strings: dict[str, int] = {}
    lists = _lists(table)
    sheets = [_table_sheet(table, lists, strings), _types_sheet(described(table).splitlines(), lists, strings)]
    files = {
        "[Content_Types].xml": parts.CONTENT_TYPES,
        "_rels/.rels": parts.RELATIONS,
        "xl/workbook.xml": parts.workbook(parts.sheet_name(table.name), column_letters(_n_frozen(table) - 1)),
        "xl/_rels/workbook.xml.rels": parts.WORKBOOK_RELATIONS,
        "xl/styles.xml": parts.STYLES,
        "xl/worksheets/sheet1.xml": sheets[0],
        "xl/worksheets/sheet2.xml": sheets[1],
        "xl/sharedStrings.xml": parts.shared_strings(list(strings)),
    }
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, text in files.items():
            archive.writestr(zipfile.ZipInfo(name, _TIME), text.encode(), zipfile.ZIP_DEFLATED)
    return out.getvalue()


def _require_room(table: Table) -> None:
    faults = []
    for n, most, noun in ((table.n_rows + 1, parts.MOST_ROWS, "row"), (len(table.columns), parts.MOST_COLUMNS, "column")):
        if n > most:
            faults.append(
                Fault(f"the table has {plural(n, noun)}, its header counted.", f"at most {most:,}, as a sheet of Excel has")
            )
    for column in table.columns:
        faults += [_unfit(column, text) for text in (column.name, *column.texts) if _is_unfit(text)]
    if faults:
        raise TableError(*faults)


def _is_unfit(text: str) -> bool:
    return len(text) > parts.MOST_CHARACTERS or parts.NEVER.search(text) is not None


def _unfit(column: TextColumn, text: str) -> Fault:
    row = None if text == column.name else int(np.argmax(column.codes == column.texts.index(text)))
    place = Place(column=ascii(column.name)[1:-1] if parts.NEVER.search(column.name) else column.name, row=row)
    if len(text) > parts.MOST_CHARACTERS:
        found = f"{in_quotes(text)} has {len(text):,} characters."
        return Fault(found, f"at most {parts.MOST_CHARACTERS:,}, as a cell of Excel has", place=place)
    return Fault(f"{in_quotes(text)} has a character that no workbook holds.", "text without it", place=place)


# ---- the sheet of the table


def _table_sheet(table: Table, lists: dict[str, tuple[str, ...]], strings: dict[str, int]) -> str:
    n_rows, columns = table.n_rows, table.columns
    last = column_letters(len(columns) - 1)
    asset, widths = _asset_at(table), [_width(column) for column in columns]
    fits_page = sum(widths) <= PAGE_WIDTH
    xml = [parts.sheet_start(fits_page), f'<dimension ref="A1:{last}{n_rows + 1}"/>', _frozen(_n_frozen(table)), "<cols>"]
    xml += [
        f'<col min="{at}" max="{at}" width="{width}" style="{parts.TEXT}" customWidth="1"/>' for at, width in enumerate(widths, 1)
    ]
    xml += ["</cols><sheetData>", _row(1, [(c.name, parts.HEADER) for c in columns], strings)]
    xml += _rows(columns, asset, strings)
    xml += ["</sheetData>", *_drop_downs(columns, n_rows, lists), parts.page(fits_page)]
    xml += [f'<ignoredErrors><ignoredError sqref="A1:{last}{n_rows + 1}" numberStoredAsText="1"/></ignoredErrors></worksheet>']
    return "".join(xml)


def _asset_at(table: Table) -> int:
    return [c.name for c in table.columns].index(table.asset_column)


def _n_frozen(table: Table) -> int:
    """How many columns stay in view: those up to the asset's, unless they would fill the screen."""
    n_columns = _asset_at(table) + 1
    return n_columns if n_columns <= 3 else 1


def _frozen(n_columns: int) -> str:
    """The header row and the first columns stay in view."""
    corner = f"{column_letters(n_columns)}2"
    return (
        '<sheetViews><sheetView tabSelected="1" workbookViewId="0">'
        f'<pane xSplit="{n_columns}" ySplit="1" topLeftCell="{corner}" activePane="bottomRight" state="frozen"/>'
        '<selection pane="topRight"/><selection pane="bottomLeft"/>'
        f'<selection pane="bottomRight" activeCell="{corner}" sqref="{corner}"/>'
        "</sheetView></sheetViews>"
    )


def _width(column: TextColumn) -> float:
    longest = max(map(width_of, (column.name, *column.texts[:WIDTH_SAMPLE])))
    return min(max(longest, LEAST_WIDTH), MOST_WIDTH) + 2


def _rows(columns: Sequence[TextColumn], asset: int, strings: dict[str, int]) -> Iterator[str]:
    """The rows of the table. Between the row's numbers stand pieces that are the same for equal texts, so a row is one join."""
    pieces = [_pieces(column, at, len(columns), at == asset, strings) for at, column in enumerate(columns)]
    n_rows = columns[0].n_rows
    for start in range(0, n_rows, _BLOCK):
        stop = min(start + _BLOCK, n_rows)
        taken = [texts[column.codes[start:stop]].tolist() for texts, column in zip(pieces, columns, strict=True)]
        numbers = map(str, range(start + 2, stop + 2))
        yield "".join([n.join(('<row r="', '"><c r="A', *row)) for n, row in zip(numbers, zip(*taken, strict=True), strict=True)])


def _pieces(column: TextColumn, at: int, n_columns: int, is_asset: bool, strings: dict[str, int]) -> np.ndarray:
    """For each text of a column what is behind its row's number: the cell, and the beginning of the next."""
    after = "</row>" if at == n_columns - 1 else f'<c r="{column_letters(at + 1)}'
    style = parts.ASSET if is_asset else parts.TEXT
    found = np.empty(len(column.texts), object)
    for code, text in enumerate(column.texts):
        if text or is_asset:  # a row without any text is a row all the same
            found[code] = f'" s="{style}" t="s"><v>{strings.setdefault(text, len(strings))}</v></c>{after}'
        else:
            found[code] = f'" s="{style}"/>{after}'
    return found


def _row(number: int, cells: Sequence[tuple[str, int]], strings: dict[str, int]) -> str:
    written = (
        f'<c r="{column_letters(at)}{number}" s="{style}" t="s"><v>{strings.setdefault(text, len(strings))}</v></c>'
        for at, (text, style) in enumerate(cells)
        if text
    )
    return f'<row r="{number}">{"".join(written)}</row>'


# ---- drop-downs


def _lists(table: Table) -> dict[str, tuple[str, ...]]:
    """What the drop-down of each column suggests, by the column's name."""
    lists: dict[str, tuple[str, ...]] = {table.settings.enabled: ("True", "False")} if table.settings.enabled else {}
    for column in table.conditions:
        domain = column.condition.domain
        if domain.kind == "bool":
            lists[column.condition.name] = ("True", "False", "Any")
        elif domain.kind == "enum" and domain.values:
            lists[column.condition.name] = (*map(quoted, domain.values), "Any")
    return lists


def _drop_downs(columns: Sequence[TextColumn], n_rows: int, lists: dict[str, tuple[str, ...]]) -> Iterator[str]:
    """Lists to choose from, which are on the sheet of types: a list in the rule itself is limited to 255 characters."""
    if not lists:
        return
    bottom = min(n_rows + 1 + SPARE_ROWS, parts.MOST_ROWS)
    places = {values: at for at, values in enumerate(dict.fromkeys(lists.values()), 2)}
    yield f'<dataValidations count="{len(lists)}">'
    for at, column in enumerate(columns):
        if column.name in lists:
            letter, source = column_letters(at), column_letters(places[lists[column.name]])
            area = f"{parts.TYPES_SHEET}!${source}$2:${source}${len(lists[column.name]) + 1}"
            cells = f"{letter}2:{letter}{bottom}"
            rule = f'<dataValidation type="list" allowBlank="1" showErrorMessage="0" sqref="{cells}">'
            yield f"{rule}<formula1>{area}</formula1></dataValidation>"
    yield "</dataValidations>"


def _types_sheet(lines: Sequence[str], lists: dict[str, tuple[str, ...]], strings: dict[str, int]) -> str:
    """Column A: the lines of a contextdb.toml. From column C on: what the drop-downs suggest."""
    distinct = list(dict.fromkeys(lists.values()))
    names = {values: next(name for name, of in lists.items() if of == values) for values in distinct}
    xml = [parts.sheet_start(fits_page=True), '<cols><col min="1" max="1" width="90" style="1" customWidth="1"/></cols><sheetData>']
    for number in range(1, max([len(lines) + 1, *(len(values) + 1 for values in distinct)]) + 1):
        line = parts.FIRST_LINE if number == 1 else lines[number - 2] if number - 2 < len(lines) else ""
        cells = [(line, parts.HEADER if number == 1 else parts.TEXT), ("", 0)]
        for values in distinct:
            text = names[values] if number == 1 else values[number - 2] if number - 2 < len(values) else ""
            cells.append((text, parts.HEADER if number == 1 else parts.TEXT))
        xml.append(_row(number, cells, strings))
    return "".join([*xml, "</sheetData>", parts.page(fits_page=True), "</worksheet>"])
