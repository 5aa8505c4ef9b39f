"""What people put around a table and into it: titles, totals, errors, hidden rows; each is read right, and said."""

from __future__ import annotations

import io
from typing import Any

import pytest
import xlsxwriter

from contextdb.errors import TableError
from contextdb.exchange.formats import ReadOptions, read
from contextdb.exchange.importing import whole_names_sentence
from contextdb.exchange.mapping import Mapped, propose
from contextdb.exchange.reading import Reading, with_intervals
from contextdb.schema.settings import EMPTY, TableSettings

ROWS: list[list[Any]] = [["Asset", "speed", "pos"], ["jog", 1.5, "CB"], ["run", 2.5, "FS"]]
ERRORS = ["#N/A", "#DIV/0!", "#REF!", "#VALUE!", "#NAME?", "#NULL!", "#NUM!"]


def workbook(rows: list[list[Any]], **sheets: list[list[Any]]) -> tuple[io.BytesIO, xlsxwriter.Workbook, Any]:
    out = io.BytesIO()
    book = xlsxwriter.Workbook(out)
    made = []
    for name, one in {"Moves": rows, **sheets}.items():
        sheet = book.add_worksheet(name)
        for at, row in enumerate(one):
            sheet.write_row(at, 0, row)
        made.append(sheet)
    return out, book, made


def reading_of(out: io.BytesIO, book: xlsxwriter.Workbook, sheet: str | None = None) -> Reading:
    book.close()
    return read(out.getvalue(), "x.xlsx", ReadOptions(sheet=sheet))


def told(reading: Reading) -> str:
    return "\n".join(map(str, reading.remarks))


def texts(reading: Reading) -> dict[str, list[str]]:
    return {column.name: column.to_list() for column in reading.columns}


# ---- errors of Excel


@pytest.mark.parametrize("error", ERRORS)
def test_an_error_of_excel_is_named_with_its_cell_and_is_never_any(error: str):
    out, book, (sheet,) = workbook(ROWS)
    sheet.write_formula("B3", "=NA()", None, error)
    sheet.write_formula("C2", "=NA()", None, error)
    reading = reading_of(out, book)
    assert f"cell B3: an error of Excel, {error}; no type reads it." in told(reading)
    assert f"cell C2: an error of Excel, {error}; no type reads it." in told(reading)
    assert (texts(reading)["speed"][1], texts(reading)["pos"][0]) == (error, error)
    found = {column.source: column for column in propose(reading, EMPTY, TableSettings("t"))}
    assert (found["speed"].kind, found["speed"].n_unreadable) == ("number", 1)
    assert found["pos"].n_unreadable == 1
    assert error not in found["pos"].declared["values"]  # type: ignore[index,operator]


def test_an_error_in_text_is_kept_unreadable_too():
    reading = read(b"Asset;pos\njog;#N/A\nrun;Mid Air\nrun2;Mid Air\n", "x.csv")
    found = propose(reading, EMPTY, TableSettings("t"))[1]
    assert found.n_unreadable == 1
    assert found.cells is not None
    assert found.cells.to_list() == ["#N/A", '"Mid Air"', '"Mid Air"']


# ---- how people write cells


def of_column(name: str, *cells: str) -> Mapped:
    text = "\n".join([f"Asset;{name}", *(f"row{at};{cell}" for at, cell in enumerate(cells))])
    return propose(read(text.encode(), "x.csv"), EMPTY, TableSettings("t"))[1]


@pytest.mark.parametrize(
    ("name", "cells", "kind", "become"),
    [
        ("Reach (m)", ["> 1,5", "0,5", "1,2 - 3,4", "0.5..2"], "number", ["> 1.5", "0.5", "1.2..3.4", "0.5..2"]),
        ("Angle (°)", ["±30", "90 ± 20", "-120,5 - 30"], "angle", ["0 ± 30", "90 ± 20", "-120.5..30"]),
        ("Is blocking", ["x", "no", "X", "any"], "bool", ["True", "no", "True", "any"]),
        (
            "Stance",
            ["Low", "Low / Mid", "Mid,Very High", "Very High"],
            "enum",
            ["Low", "Low Mid", 'Mid "Very High"', '"Very High"'],
        ),
    ],
)
def test_cells_as_people_write_them_become_cells_of_ours(name: str, cells: list[str], kind: str, become: list[str]):
    found = of_column(name, *cells)
    assert (found.kind, found.n_unreadable) == (kind, 0)
    assert found.cells is not None
    assert found.cells.to_list() == become
    assert "is read as" in found.why


@pytest.mark.parametrize(
    ("name", "cells"), [("axis", ["x", "y", "z"]), ("path", ["a/b", "a/c", "d"]), ("offset (m)", ["20,5", "30,5"])]
)
def test_texts_that_may_mean_something_else_stay_as_they_are(name: str, cells: list[str]):
    text = "\n".join([f"Asset,{name}", *(f'row{at},"{cell}"' for at, cell in enumerate(cells))])
    found = propose(read(text.encode(), "x.csv"), EMPTY, TableSettings("t"))[1]
    assert found.cells is None or found.cells.to_list() == cells


def test_lists_of_names_are_not_told_as_one_name_each():
    reading = read(b"Asset;stance\na;Low\nb;Low / Mid\nc;Mid\nd;Low\n", "x.csv")
    assert whole_names_sentence(propose(reading, EMPTY, TableSettings("t")), reading, "words") == ""


# ---- titles


@pytest.mark.parametrize("n_blank", [0, 1])
@pytest.mark.parametrize("n_titles", [1, 2])
@pytest.mark.parametrize("is_merged", [False, True])
def test_a_title_above_the_header_is_left_out_and_said(n_blank: int, n_titles: int, is_merged: bool):
    titles = [[f"Moves of {year}"] for year in range(2025, 2025 + n_titles)]
    out, book, (sheet,) = workbook([*titles, *([[]] * n_blank), *ROWS])
    if is_merged:
        for at, (title,) in enumerate(titles):
            sheet.merge_range(at, 0, at, 2, title)
    reading = reading_of(out, book)
    assert texts(reading) == {"Asset": ["jog", "run"], "speed": ["1.5", "2.5"], "pos": ["CB", "FS"]}
    assert '"Moves of 2025"' in told(reading)
    assert len(reading.remarks) < 6


@pytest.mark.parametrize("form", ["Moves of 2026\n{}", "Moves of 2026,,\n{}", "Moves,,\n,of 2026,\n\n{}", '"Moves, all",,\n{}'])
@pytest.mark.parametrize("mark", [",", ";"])
def test_a_title_above_a_csv_is_left_out_and_said(form: str, mark: str):
    text = form.format("Asset,speed,pos\njog,1.5,CB\nrun,2.5,FS\n")
    if mark == ";":
        text = text.replace(",", ";").replace("Moves; all", "Moves, all")
    reading = read(text.encode(), "x.csv")
    assert texts(reading) == {"Asset": ["jog", "run"], "speed": ["1.5", "2.5"], "pos": ["CB", "FS"]}
    assert "line 1: left out above the header" in told(reading)


@pytest.mark.parametrize("title", ["", "Moves of 2026\n\n"])
@pytest.mark.parametrize(
    "header",
    [
        "Clip,Speed,,pos\n,min,max,",
        ",Speed\nClip,min,max,pos",
        ",Speed,,\nClip,from,to,pos",
        ",Speed,,Body\nClip,Min,Max,pos",
        "Clip,Speed,,pos\n,von,bis",
    ],
)
def test_a_group_over_the_first_of_min_and_max_of_a_csv_makes_one_interval(title: str, header: str):
    reading = with_intervals(read(f"{title}{header}\njog,1.5,2.5,CB\nrun,2.5,4,FS\n".encode(), "x.csv"))
    assert texts(reading) == {"Clip": ["jog", "run"], "Speed": ["1.5..2.5", "2.5..4"], "pos": ["CB", "FS"]}
    assert "are one interval" in told(reading)
    assert ('left out above the header: "Body"' in told(reading)) == ("Body" in header)


@pytest.mark.parametrize("row", [",low,high", "jog,low,high"])
def test_cells_that_say_low_and_high_are_no_ends(row: str):
    reading = read(f"Clip,danger,risk\n{row}\nrun,high,low\n".encode(), "x.csv")
    assert texts(reading) == {"Clip": [row.split(",")[0], "run"], "danger": ["low", "high"], "risk": ["high", "low"]}


@pytest.mark.parametrize("has_title", [False, True])
@pytest.mark.parametrize("first", ["", "Clip"])
def test_groups_merged_over_the_header_are_left_out_and_said(has_title: bool, first: str):
    titles = [["Chefs of sprint 12"], ["owner: Ines"]] * has_title
    n = len(titles)
    header, row = ["Clip", "tool", "grip", "heat", "fill"], ["stir", "Spoon", 5, 20, 1]
    out, book, (sheet,) = workbook([*titles, [first], header, row])
    sheet.merge_range(n, 1, n, 2, "Hands")
    sheet.merge_range(n, 3, n, 4, "Pan")
    if first:
        sheet.merge_range(n, 0, n + 1, 0, first)
    if has_title:
        sheet.merge_range(0, 0, 0, 4, "Chefs of sprint 12")
    reading = reading_of(out, book)
    assert texts(reading) == {"Clip": ["stir"], "tool": ["Spoon"], "grip": ["5"], "heat": ["20"], "fill": ["1"]}
    said = f"{first}, Hands, Pan" if first else "Hands, Pan"
    assert f'sheet row {n + 1}: left out above the header: "{said}".' in told(reading)


def test_groups_with_a_column_of_one_name_are_roles_and_stand_before_all_their_columns():
    out, book, (sheet,) = workbook([["Fights, version 3"], [""], ["Clip", "Stance", "Reach", "Stance", "Size"], ["a", 1, 2, 3, 4]])
    sheet.merge_range(0, 0, 0, 4, "Fights, version 3")
    sheet.merge_range(1, 1, 1, 2, "Player")
    sheet.merge_range(1, 3, 1, 4, "Opponent")
    reading = reading_of(out, book)
    assert reading.names == ["Clip", "Player.Stance", "Player.Reach", "Opponent.Stance", "Opponent.Size"]
    assert 'names have their group in front: "Stance" is now "Player.Stance".' in told(reading)


def test_a_header_with_a_merged_name_is_no_row_of_groups():
    out, book, (sheet,) = workbook([["Asset", "pos", ""], ["jog", "CB", "FS"]])
    sheet.merge_range(0, 1, 0, 2, "pos")
    with pytest.raises(TableError, match='the column name "pos" appears twice'):
        reading_of(out, book)


def test_a_header_that_only_looks_like_a_title_is_none():
    with pytest.raises(TableError, match="column B has no name"):
        read(b"Name,,\njog,1,2\n", "x.csv")
    assert read(b"Name\nSmith; J\nDoe; K\n", "x.csv").names == ["Name"]
    assert read(b"Name,speed\nrun,\n", "x.csv").names == ["Name", "speed"]


def test_rows_above_a_header_that_are_more_than_a_title_are_named_once_with_the_cells_to_ask_for():
    groups = ["Who", "How", "How", *(["Where"] * 40)]
    header = ["Asset", "speed", *(f"fact {i}" for i in range(41))]
    out, book, _ = workbook([groups, header, ["jog", *range(42)]])
    with pytest.raises(TableError) as caught:
        reading_of(out, book)
    assert len(caught.value.faults) == 1
    assert 'Try to name the cells of the table: --sheet "Moves!A2:AQ3"' in str(caught.value)
    assert reading_of(*workbook([groups, header, ["jog", *range(42)]])[:2], "Moves!A2:AQ3").names == header


def test_many_columns_without_a_name_make_one_message():
    out, book, _ = workbook([["Asset", *[""] * 20], ["jog", *range(20)]])
    with pytest.raises(TableError, match=r"20 of 21 columns have no name: B, C, D, …") as caught:
        reading_of(out, book)
    assert len(caught.value.faults) == 1


# ---- a missing header, a total


@pytest.mark.parametrize("first", ["jog,3.5,CB", "jog,True,CB", "jog,1..2,CB", "jog,x,CB"])
def test_a_first_row_that_looks_like_values_is_doubted(first: str):
    said = told(read(f"{first}\nrun,2.5,CB\n".encode(), "x.csv"))
    assert "is the header missing?" in said
    assert told(read(b"Asset,speed,pos\njog,3.5,CB\n", "x.csv")) == ""


@pytest.mark.parametrize("word", ["Total", "TOTAL:", "Sum", "Summe", "Gesamt"])
def test_a_row_that_sums_up_is_left_out_and_said(word: str):
    reading = reading_of(*workbook([*ROWS, [word, 4]])[:2])
    assert f'sheet row 4: left out, as it is no asset: "{word}".' in told(reading)
    assert reading.names == ROWS[0]
    assert reading.n_rows == 2
    assert reading_of(*workbook([*ROWS, ["Total_A", 4]])[:2]).n_rows == 3
    assert reading_of(*workbook([*ROWS, [word, "CB"]])[:2]).n_rows == 3  # it says more than a sum
    assert reading_of(*workbook([*ROWS, [word, 4]])[:2], "A1:C4").n_rows == 3  # these cells are what somebody chose


# ---- what Excel does not show


def test_hidden_rows_and_columns_come_in_and_are_named():
    out, book, (sheet,) = workbook([*ROWS, ["walk", 0.5, "SS"]])
    sheet.set_row(2, None, None, {"hidden": True})
    sheet.set_column(1, 1, None, None, {"hidden": True})
    sheet.set_column(20, 30, None, None, {"hidden": True})
    reading = reading_of(out, book)
    assert texts(reading)["Asset"] == ["jog", "run", "walk"]
    assert "sheet row 3: 1 hidden row read like all others." in told(reading)
    assert "column B: 1 hidden column read like all others." in told(reading)


def test_a_hidden_sheet_is_left_out_beside_one_that_is_seen_and_read_when_asked():
    def book() -> tuple[io.BytesIO, xlsxwriter.Workbook]:
        out, made, (_, notes) = workbook(ROWS, Notes=[["a", "b"], [1, 2]])
        notes.hide()
        return out, made

    reading = reading_of(*book())
    assert reading.names == ["Asset", "speed", "pos"]
    assert 'sheet "Notes": left out: it is hidden; --sheet reads it.' in told(reading)
    assert reading_of(*book(), "Notes").names == ["a", "b"]
