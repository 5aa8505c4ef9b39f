"""Sheets as people lay them out, at random: titles, merged headers, legends, totals, blank rows."""

from __future__ import annotations

import contextlib

import openpyxl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from openpyxl.worksheet.worksheet import Worksheet
from strategies import examples
from test_workbooks import raw_of, read_book, texts, told

from contextdb.columns import TextColumn
from contextdb.errors import ContextDBError
from contextdb.exchange.formats import ReadOptions, read
from contextdb.exchange.mapping import propose
from contextdb.schema.settings import EMPTY, TableSettings
from contextdb.tables.table import Table
from tui.model.importing import Draft

HEADERS = ["Clip", "Asset", "Speed", "min", "max", "Gait", "", "0.5", "True", "Legend", "Summe"]
CELLS = ["jog", "run", "1", "0,5", "2,5-6", "1=yes", "", " ", "WAHR", "x", "True", "20, 9.99", "Any", "#N/A", "Low / Mid", "Total"]
TABLE = Table.build("t", [TextColumn.of("Asset", ["jog"]), TextColumn.of("speed", ["1"])])


@st.composite
def blocks(draw: st.DrawFn) -> tuple[int, int, list[list[str]]]:
    """Cells with a header over them, and where they stand."""
    width = draw(st.integers(1, 4))
    header = draw(st.lists(st.sampled_from(HEADERS), min_size=width, max_size=width))
    body = st.lists(st.sampled_from(CELLS), min_size=width, max_size=width)
    return draw(st.integers(0, 5)), draw(st.integers(0, 6)), [header, *draw(st.lists(body, max_size=4))]


@st.composite
def merges(draw: st.DrawFn) -> tuple[int, int, int, int, str]:
    """A merged area, with a text: top, left, bottom, right from 1, both ends in it."""
    top, left = draw(st.integers(1, 6)), draw(st.integers(1, 6))
    return (
        top,
        left,
        top + draw(st.sampled_from([0, 0, 1])),
        left + draw(st.sampled_from([0, 1, 1, 2])),
        draw(st.sampled_from(HEADERS)),
    )


def workbook(parts: list[tuple[int, int, list[list[str]]]], areas: list[tuple[int, int, int, int, str]]) -> openpyxl.Workbook:
    book = openpyxl.Workbook()
    sheet = book.active
    assert isinstance(sheet, Worksheet)
    for top, left, rows in parts:
        for down, row in enumerate(rows):
            for right, text in enumerate(row):
                sheet.cell(top + down + 1, left + right + 1, text or None)
    taken = set[tuple[int, int]]()
    for top, left, bottom, right, text in areas:
        cells = {(row, column) for row in range(top, bottom + 1) for column in range(left, right + 1)}
        if not cells & taken and len(cells) > 1:
            taken |= cells
            sheet.cell(top, left, text or None)
            sheet.merge_cells(start_row=top, start_column=left, end_row=bottom, end_column=right)
    return book


@examples(2)
@given(st.lists(blocks(), min_size=1, max_size=3), st.lists(merges(), max_size=3))
def test_a_sheet_of_random_blocks_is_imported_or_refused_in_our_own_words(parts, areas):
    raw = raw_of(workbook(parts, areas))
    with contextlib.suppress(ContextDBError):
        propose(read(raw, "x.xlsx"), EMPTY, TableSettings("t"))
    with contextlib.suppress(ContextDBError):
        draft = Draft.read(TABLE, raw, "x.xlsx", ReadOptions())
        draft.answer()


@pytest.mark.parametrize("legend", [["Legend", "1=yes"], ["Legend", "1=yes", "2=no", "3=maybe", "4", "5", "6"]])
def test_a_merged_group_header_beside_a_legend_of_one_column_is_read(legend: list[str]):
    table = [["Clip", "Speed", None], [None, "min", "max"], ["jog", "1", "2"], ["run", "2", "3"]]
    book = openpyxl.Workbook()
    sheet = book.active
    assert isinstance(sheet, Worksheet)
    for row in table:
        sheet.append(row)
    sheet.merge_cells("B1:C1")
    sheet.merge_cells("A1:A2")
    for at, text in enumerate(legend, 1):
        sheet.cell(at, 5, text)
    reading = read_book(book)
    assert texts(reading) == {"Clip": ["jog", "run"], "Speed min": ["1", "2"], "Speed max": ["2", "3"]}
    assert 'left out because it is not a table: "Legend"' in told(reading)
