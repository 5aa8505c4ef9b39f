"""Workbooks: what we write a second reader understands; what others write is read with all that a person should know."""

import io
import re
import zipfile
from pathlib import Path
from typing import Any

import openpyxl
import pytest
from openpyxl.worksheet.worksheet import Worksheet

from contextdb.columns import TextColumn
from contextdb.errors import FileError, TableError
from contextdb.exchange import xlsx_scan
from contextdb.exchange.formats import FORMATS, ReadOptions, read, write
from contextdb.exchange.reading import Reading
from contextdb.schema.settings import TableSettings
from contextdb.tables.project import Project
from contextdb.tables.table import Table

ROOT = Path(__file__).parent.parent.parent


def book(**sheets: list[list[Any]]) -> openpyxl.Workbook:
    found = openpyxl.Workbook()
    found.remove(found.active)  # type: ignore[arg-type]
    for name, rows in sheets.items():
        sheet = found.create_sheet(name)
        for row in rows:
            sheet.append(row)
    return found


def raw_of(workbook: openpyxl.Workbook) -> bytes:
    out = io.BytesIO()
    workbook.save(out)
    return out.getvalue()


def read_book(workbook: openpyxl.Workbook, sheet: str | None = None) -> Reading:
    return read(raw_of(workbook), "x.xlsx", ReadOptions(sheet=sheet))


def texts(reading: Reading) -> dict[str, list[str]]:
    return {column.name: column.to_list() for column in reading.columns}


def told(reading: Reading) -> str:
    return "\n".join(map(str, reading.remarks))


def refused(raw: bytes | openpyxl.Workbook, sheet: str | None = None) -> str:
    data = raw if isinstance(raw, bytes) else raw_of(raw)
    with pytest.raises(TableError) as caught:
        read(data, "x.xlsx", ReadOptions("xlsx", sheet))
    return str(caught.value)


# ---- what we write


def written_sheet(table: Table) -> Worksheet:
    return openpyxl.load_workbook(io.BytesIO(write(table, FORMATS["xlsx"])[0])).worksheets[0]


def test_a_second_reader_finds_every_cell_of_the_sample_tables_as_text():
    for table in Project.load(ROOT / "tables").tables.values():
        sheet = written_sheet(table)
        rows = [[cell.value or "" for cell in row] for row in sheet.iter_rows()]
        assert rows == [[c.name for c in table.columns], *([c[r] for c in table.columns] for r in range(table.n_rows))]
        assert {cell.number_format for row in sheet.iter_rows() for cell in row} == {"@"}


def test_the_header_and_the_assets_stand_frozen_and_columns_are_as_wide_as_their_texts():
    columns = {"Asset": ["a_long_name_of_an_asset"], "speed": ["5"], "note": ["x" * 500]}
    sheet = written_sheet(Table.from_columns(columns))
    assert sheet.freeze_panes == "B2"
    assert [int(sheet.column_dimensions[letter].width) for letter in "ABC"] == [25, 10, 46]


def test_bools_and_enums_have_drop_downs_that_forbid_nothing():
    declared = {"on": {"type": "bool"}, "pos": {"type": "enum", "values": ["CB", "Half, Back"]}, "speed": {"type": "number"}}
    table = Table.from_columns({"Asset": ["x"], "on": ["True"], "pos": ["CB"], "speed": ["5"]}, declared)
    workbook = openpyxl.load_workbook(io.BytesIO(write(table, FORMATS["xlsx"])[0]))
    rules = {str(rule.sqref): rule for rule in workbook.worksheets[0].data_validations.dataValidation}
    assert sorted(rules) == ["B2:B1002", "C2:C1002"]
    offered = {}
    for cells, rule in rules.items():
        assert not rule.showErrorMessage
        name, _, area = rule.formula1.partition("!")
        offered[cells] = [row[0].value for row in workbook[name][area.replace("$", "")]]
    assert offered == {"B2:B1002": ["True", "False", "Any"], "C2:C1002": ["CB", '"Half, Back"', "Any"]}


def test_a_sheet_is_printed_across_with_its_header_and_assets_on_every_page():
    narrow, wide = ({"Asset": ["x"], **{f"fact number {i}": ["5"] for i in range(n)}} for n in (3, 30))
    for columns, fits_page in ((narrow, True), (wide, False)):
        sheet = written_sheet(Table.from_columns(columns, name="it's a table"))
        assert (sheet.page_setup.orientation, sheet.print_title_rows, sheet.print_title_cols) == ("landscape", "$1:$1", "$A:$A")
        assert bool(sheet.sheet_properties.pageSetUpPr and sheet.sheet_properties.pageSetUpPr.fitToPage) is fits_page


def test_the_same_table_gives_the_same_bytes_on_every_day():
    table = Table.from_columns({"Asset": ["x", "y"], "speed": ["5", "6"]})
    raw = write(table, FORMATS["xlsx"])[0]
    assert raw == write(table, FORMATS["xlsx"])[0]
    with zipfile.ZipFile(io.BytesIO(raw)) as archive:
        assert {info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert re.findall(rb">(\d{4})-", archive.read("docProps/core.xml")) == [b"1980", b"1980"]


def test_no_text_becomes_a_formula_a_number_or_a_link():
    texts = ["=1+1", "{=A1}", "5", "1e5", "True", "https://example.org", "mailto:a@example.org", "internal:t!A1", "#N/A"]
    sheet = written_sheet(Table.build("t", [TextColumn.of("Asset", texts)]))
    cells = [row[0] for row in sheet.iter_rows(min_row=2)]
    assert [(cell.value, cell.data_type, cell.hyperlink) for cell in cells] == [(text, "s", None) for text in texts]


MARKS = [
    "_x0041_x0042_",
    "_x0041_x0042_x0043_",
    "_x0041\x01",
    "_x0041_x0042\x01",
    "__x0041_",
    "_x005F_x0041_",
    "_x0001_\x01",
    "_x0041__x0042_",
]


@pytest.mark.parametrize(
    "text", [*MARKS, "<r>a</r>", "<r><t>a</t></r>", "<r>\n&amp;\x01_x0041_x0042_</r>", "a\r\nb\tc", "\u2028", "\u3000x "]
)
def test_a_text_that_looks_like_the_inside_of_a_workbook_comes_back(text: str):
    table = Table.build("t", [TextColumn.of("Asset", [text, "x"]), TextColumn.of(text, ["x", text])])
    reading = read(write(table, FORMATS["xlsx"])[0], "t.xlsx")
    assert texts(reading) == {"Asset": [text, "x"], text: ["x", text]}


@pytest.mark.parametrize("name", ["a/b:c*d?[e]", "x" * 40, "\U0001f3c3" * 20, "contextdb", "History", "'", ""])
def test_a_table_of_any_name_gives_a_sheet_with_a_name_that_excel_takes(name: str):
    table = Table.from_columns({"Asset": ["x"]}, settings=TableSettings(name or "t"), name=name or "t")
    title = written_sheet(table).title
    assert 1 <= len(title.encode("utf-16-le")) // 2 <= 31
    assert not set(title) & set("[]:*?/\\")
    assert title.casefold() not in ("contextdb", "history")


UNFIT = [
    ("x" * 40_000, "takes 40,000 characters in a workbook"),
    ("\U0001f3c3" * 16_384, "takes 32,768 characters in a workbook"),
    ("a\ufffe", "has a character that no workbook holds"),
]


@pytest.mark.parametrize(("text", "why"), UNFIT)
def test_a_text_that_excel_cannot_hold_is_refused_with_its_place(text: str, why: str):
    table = Table.from_columns({"Asset": ["x", "y"], "speed": ["5", "6"]}, settings=TableSettings("t", outputs=("speed",)))
    with pytest.raises(TableError, match=why) as caught:
        write(table.with_cell(1, "speed", text), FORMATS["xlsx"])
    assert 'row 2, column "speed"' in str(caught.value)


# ---- what others write


def test_values_of_excel_become_cells():
    reading = read_book(book(moves=[["Asset", "on", "speed", "whole"], ["jog", True, 2.5, 5], ["run", False, 0.1, -3]]))
    assert texts(reading) == {
        "Asset": ["jog", "run"],
        "on": ["True", "False"],
        "speed": ["2.5", "0.1"],
        "whole": ["5", "-3"],
    }


def test_a_date_is_told_with_its_cell():
    import datetime

    reading = read_book(book(moves=[["Asset", "speed"], ["jog", datetime.date(2026, 1, 2)]]))
    assert "cell B2: a date, 2026-01-02, as Excel makes of texts such as 1-2" in told(reading)


def test_formulas_are_read_as_values_and_one_without_a_value_is_told():
    workbook = book(moves=[["Asset", "speed"], ["jog", "=1+1"], ["run", "=B2*2"]])
    with_value = _edited(raw_of(workbook), "xl/worksheets/sheet1.xml", b"<f>1+1</f><v />", b"<f>1+1</f><v>2</v>")
    reading = read(with_value, "x.xlsx")
    assert texts(reading)["speed"] == ["2", ""]
    assert "cell B2, =1+1: 1 formula read as the values that they had when the file was saved." in told(reading)
    assert "cell B3: the formula =B2*2 has no value saved with it: the cell is empty." in told(reading)


def _edited(raw: bytes, part: str, old: bytes, new: bytes) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(raw)) as source, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as target:
        for info in source.infolist():
            data = source.read(info)
            if info.filename == part:
                assert old in data
                data = data.replace(old, new)
            target.writestr(info, data)
    return out.getvalue()


def test_merged_cells_hold_their_value_everywhere_and_are_told():
    workbook = book(moves=[["Asset", "pos", "speed"], ["jog", "CB", 1], ["run", None, 2]])
    workbook["moves"].merge_cells("B2:B3")
    reading = read_book(workbook)
    assert texts(reading)["pos"] == ["CB", "CB"]
    assert 'cells B2:B3: merged cells; each now holds "CB".' in told(reading)


def test_a_title_above_the_table_is_left_out_and_told():
    reading = read_book(book(moves=[["Moves of 2026"], [], ["Asset", "speed"], ["jog", 1], [], ["run", 2]]))
    assert texts(reading) == {"Asset": ["jog", "run"], "speed": ["1", "2"]}
    assert 'cells A1: left out because it is not a table: "Moves of 2026".' in told(reading)
    assert "sheet row 5: 1 blank sheet row left out." in told(reading)


def test_two_tables_on_one_sheet_are_named_and_one_is_chosen_by_its_cells():
    rows = [["Asset", "speed", None, "Name", "pos"], ["jog", 1, None, "x", "CB"], ["run", 2, None, "y", "FS"]]
    said = refused(book(moves=rows))
    assert "the sheet holds 2 tables: A1:B3, D1:E3" in said
    assert "--sheet" in said
    assert texts(read_book(book(moves=rows), "moves!D1:E3")) == {"Name": ["x", "y"], "pos": ["CB", "FS"]}
    assert texts(read_book(book(moves=rows), "A1:B2")) == {"Asset": ["jog"], "speed": ["1"]}


def test_two_tables_below_each_other_are_told_apart_by_a_narrower_header():
    rows = [["Asset", "speed", "pos"], ["jog", 1, "CB"], [], ["Name", "pos"], ["x", "CB"], ["y", "FS"]]
    assert "the sheet holds 2 tables: A1:C2, A4:B6" in refused(book(moves=rows))


def test_of_several_sheets_the_filled_one_is_read_and_of_several_filled_ones_one_must_be_named():
    rows: list[list[Any]] = [["Asset", "speed"], ["jog", 1]]
    assert texts(read_book(book(empty=[], moves=rows)))["Asset"] == ["jog"]
    assert '2 sheets hold cells: "a", "moves".' in refused(book(a=rows, moves=rows))
    assert texts(read_book(book(a=[["x"], [1]], moves=rows), "moves"))["Asset"] == ["jog"]
    assert 'there is no sheet "move". Accepted: "a", "moves". Did you mean "moves"?' in refused(book(a=rows, moves=rows), "move")


def test_a_row_that_a_designer_adds_to_our_workbook_comes_back_with_the_types():
    table = Table.from_columns({"Asset": ["jog"], "speed": ["1..2"]}, {"speed": {"type": "number", "unit": "m/s"}})
    workbook = openpyxl.load_workbook(io.BytesIO(write(table, FORMATS["xlsx"])[0]))
    workbook.worksheets[0].append(["run", 5])
    reading = read_book(workbook)
    assert texts(reading) == {"Asset": ["jog", "run"], "speed": ["1..2", "5"]}
    assert reading.schema.conditions["speed"].unit == "m/s"


DECLARED: list[tuple[str, dict[str, Any]]] = [
    ("v1", {"type": "enum", "values": [f"v{i}" for i in range(9_000)]}),
    ("L", {"type": "enum", "values": ["L", "R"], "mirror": {"L": "R"}}),
    ("5", {"type": "number", "unit": 'm/"s"', "description": "one\u2028two\x7f\nthree \\ four"}),
]


@pytest.mark.parametrize(("cell", "declared"), DECLARED)
def test_all_that_is_declared_of_a_condition_comes_back(cell: str, declared: dict[str, Any]):
    table = Table.from_columns({"Asset": ["x"], "fact": [cell]}, {"fact": declared})
    reading = read(write(table, FORMATS["xlsx"])[0], "x.xlsx")
    assert reading.schema.conditions == table.schema.conditions
    assert not reading.remarks


def test_a_declaration_that_no_cell_holds_is_refused():
    table = Table.from_columns({"Asset": ["x"], "fact": ["5"]}, {"fact": {"type": "number", "description": "x" * 40_000}})
    with pytest.raises(TableError, match=r'sheet "contextdb": .description = .* takes 40,016 characters'):
        write(table, FORMATS["xlsx"])


def test_cells_of_our_own_workbook_can_be_chosen_too():
    raw, _ = write(Table.from_columns({"Asset": ["jog", "run"], "speed": ["1", "2"]}), FORMATS["xlsx"])
    assert texts(read(raw, "x.xlsx", ReadOptions(sheet="table!A1:A2"))) == {"Asset": ["jog"]}


def test_a_sheet_of_types_that_somebody_broke_is_told_and_the_table_is_read_all_the_same():
    table = Table.from_columns({"Asset": ["jog"], "speed": ["1..2"]}, {"speed": {"type": "number"}})
    workbook = openpyxl.load_workbook(io.BytesIO(write(table, FORMATS["xlsx"])[0]))
    workbook["contextdb"]["A3"] = 'type = "nmber"'
    reading = read_book(workbook)
    assert texts(reading)["speed"] == ["1..2"]
    assert 'sheet "contextdb": the types it keeps cannot be used' in told(reading)


# ---- what is not a workbook


def test_a_locked_workbook_is_told_as_locked():
    locked = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600) + "EncryptedPackage".encode("utf-16-le") + bytes(600)
    assert "the workbook is locked with a password." in refused(locked)


@pytest.mark.parametrize("keep", [4, 100, 2000, -30])
def test_a_workbook_that_is_cut_off_is_told_as_broken(keep: int):
    raw = raw_of(book(moves=[["Asset"], ["jog"]]))
    assert "the workbook is broken" in refused(raw[:keep])


@pytest.mark.parametrize("raw", [b"", b"hello", b"PK\x03\x04" + b"x" * 50, b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(5000)])
def test_what_is_no_workbook_is_refused_in_words(raw: bytes):
    assert "workbook" in refused(raw) or "file is empty" in refused(raw)


def test_damage_inside_a_workbook_is_refused_in_words():
    raw = write(Table.from_columns({"Asset": ["jog"], "speed": ["5"]}), FORMATS["xlsx"])[0]
    for part in ("xl/workbook.xml", "xl/worksheets/sheet1.xml", "xl/sharedStrings.xml"):
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            data = archive.read(part)
        assert "x.xlsx" in refused(_edited(raw, part, data, data[: len(data) // 2]))


def test_a_bomb_and_a_document_type_are_refused_before_they_are_unpacked():
    raw = raw_of(book(moves=[["Asset"], ["jog"]]))
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xl/workbook.xml", bytes(50_000_000))
    assert "to 50,000,000, as a bomb does" in refused(out.getvalue())
    bomb = _edited(raw, "xl/workbook.xml", b"<workbook", b'<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]><workbook')
    assert "declares a document type" in refused(bomb)


def test_a_cell_at_the_far_end_of_a_sheet_is_refused_before_memory_is_taken_for_all_between(monkeypatch: pytest.MonkeyPatch):
    workbook = book(moves=[["Asset"], ["jog"]])
    workbook["moves"]["XFD1048576"] = "far"
    said = "the sheet reaches to cell XFD1048576, 17,179,869,184 cells in all."
    assert said in refused(workbook)
    monkeypatch.setattr(xlsx_scan, "MOST_SEARCHED", 0)  # as for a large sheet, of which only the last cells of rows are looked at
    assert said in refused(workbook)


OTHERS = [("content.xml", "an OpenDocument file"), ("xl/workbook.bin", "a binary workbook (.xlsb)"), ("a.txt", "an archive")]


@pytest.mark.parametrize(("part", "kind"), OTHERS)
def test_archives_of_other_kinds_are_named(part: str, kind: str):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr(part, "x")
    assert f"this is {kind}, no .xlsx." in refused(out.getvalue())


@pytest.mark.parametrize("name", ["moves.ods", "moves.xlsb", "moves.numbers"])
def test_a_workbook_that_is_not_read_is_refused_with_what_to_do(name: str):
    with pytest.raises(FileError, match=r'Try to save it as "Excel workbook" \(\.xlsx\)\.'):
        read(b"PK\x03\x04", name)


def test_a_workbook_named_csv_is_known_by_its_first_bytes():
    reading = read(raw_of(book(moves=[["Asset"], ["jog"]])), "x.csv")
    assert texts(reading) == {"Asset": ["jog"]}
    assert "by its first bytes this is an Excel workbook, though its name ends in .csv." in told(reading)
