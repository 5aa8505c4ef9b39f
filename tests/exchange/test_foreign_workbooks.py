"""Workbooks of other people: each comes in meaning what it meant, with at most three choices of a person."""

from __future__ import annotations

import datetime
import re
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import openpyxl
import pytest
from openpyxl.worksheet.worksheet import Worksheet
from test_workbooks import raw_of, told

from contextdb.commands.import_command import _typed
from contextdb.exchange.formats import ReadOptions, read
from contextdb.exchange.mapping import propose
from contextdb.exchange.reading import Reading, with_intervals
from contextdb.schema.settings import EMPTY, TableSettings

MOST_CHOICES = 3
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
Rows = list[list[str]]


@dataclass
class Workbook:
    """A workbook, what a person says of it, and the table that it means."""

    name: str
    sheets: dict[str, Rows] = field(default_factory=dict)
    becomes: Rows = field(default_factory=list)
    merged: list[str] = field(default_factory=list)
    hidden: list[int] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    chosen: dict[str, str] = field(default_factory=dict)

    @classmethod
    def parsed(cls, text: str) -> Workbook:
        head, _, after = text.partition("\n=>\n")
        name, *lines = head.split("\n")
        book, rows = cls(name, {"Sheet": []}), list[list[str]]()
        book.sheets["Sheet"] = rows
        for line in lines:
            word, _, rest = line.partition(" ")
            if word == "merge":
                book.merged += rest.split()
            elif word == "hide":
                book.hidden.append(int(rest))
            elif word == "says":
                book.said.append(rest)
            elif word == "choose":
                key, _, value = rest.partition("=")
                book.chosen[key] = value
            elif word == "sheet":
                book.sheets[rest] = rows = []
            else:
                rows.append(_cells(line))
        book.becomes = [_cells(line) for line in after.strip().split("\n")]
        return book

    def raw(self) -> bytes:
        book = openpyxl.Workbook()
        book.remove(book.worksheets[0])
        for name, rows in self.sheets.items():
            sheet = book.create_sheet(name)
            assert isinstance(sheet, Worksheet)
            for at, row in enumerate(rows, 1):
                for column, text in enumerate(row, 1):
                    sheet.cell(at, column, _value(text))
            for area in self.merged:
                sheet.merge_cells(area)
            for at in self.hidden:
                sheet.row_dimensions[at].hidden = True
        return raw_of(book)


def _cells(line: str) -> list[str]:
    return [cell.strip(" ").replace("⏎", "\n") for cell in line.split("|")]


def _value(text: str) -> object:
    if text.startswith("@"):
        return datetime.datetime.fromisoformat(text[1:])
    if text in ("TRUE", "FALSE"):
        return text == "TRUE"
    return float(text) if NUMBER.fullmatch(text) else text.removeprefix("'") or None


def workbooks() -> Iterator[Workbook]:
    text = (Path(__file__).parent / "foreign_workbooks.txt").read_text(encoding="utf-8")
    return map(Workbook.parsed, text.split("\n## ")[1:])


WORKBOOKS = list(workbooks())


def table_of(raw: bytes, chosen: dict[str, str]) -> tuple[Reading, Rows]:
    """What a workbook becomes, with what a person chose: names and kinds, then the cells of each row."""
    decimal, names = chosen.get("decimal"), chosen.get("names")
    options = ReadOptions(
        sheet=chosen.get("sheet"),
        is_decimal_comma=None if decimal is None else decimal == "comma",
        has_whole_names=None if names is None else names == "whole",
    )
    reading = read(raw, "x.xlsx", options)
    reading = reading if chosen.get("pairs") == "apart" else with_intervals(reading)
    types = {key.removeprefix("type "): value for key, value in chosen.items() if key.startswith("type ")}
    mapped = [one for one in _typed(propose(reading, EMPTY, TableSettings("t")), reading, types) if one.job != "left out"]
    columns = [(column.cells or reading.column(column.source)).to_list() for column in mapped]
    return reading, [[f"{column.name}:{column.kind}" for column in mapped], *map(list, zip(*columns, strict=True))]


@pytest.mark.parametrize("workbook", WORKBOOKS, ids=lambda one: one.name)
def test_a_workbook_of_other_people_comes_in_meaning_what_it_meant(workbook: Workbook):
    assert len(workbook.chosen) <= MOST_CHOICES
    reading, rows = table_of(workbook.raw(), workbook.chosen)
    assert rows == workbook.becomes
    assert [words for words in workbook.said if words not in told(reading)] == []


def test_there_are_forty_workbooks_and_most_need_no_choice():
    assert len(WORKBOOKS) >= 40
    assert sum(not one.chosen for one in WORKBOOKS) >= 30


@pytest.mark.skipif(not shutil.which("soffice"), reason="LibreOffice is not installed")
def test_workbooks_that_libreoffice_saved_again_mean_the_same(tmp_path: Path):
    for at, workbook in enumerate(WORKBOOKS):
        (tmp_path / f"{at}.xlsx").write_bytes(workbook.raw())
    out = tmp_path / "out"
    subprocess.run(["soffice", "--headless", "--convert-to", "xlsx", "--outdir", out, *sorted(tmp_path.glob("*.xlsx"))], check=True)
    for at, workbook in enumerate(WORKBOOKS):
        assert table_of((out / f"{at}.xlsx").read_bytes(), workbook.chosen)[1] == workbook.becomes, replace(workbook, said=[])
