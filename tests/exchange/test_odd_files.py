"""Files of others at the edges: old, empty, locked or hidden workbooks, fields without end, dates that no calendar has."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import python_calamine as calamine
from test_dmn_rules import decision
from test_workbooks import book, raw_of, read_book, refused, texts, told

from contextdb.columns import TextColumn
from contextdb.errors import ContextDBError, TableError, in_quotes
from contextdb.exchange import xlsx_scan
from contextdb.exchange.formats import FORMATS, ReadOptions, read, write
from contextdb.exchange.proposals import propose_type
from contextdb.schema.sections import settings_to_dict
from contextdb.tables.table import Table

OLD = Path(__file__).parent / "old.xls"
"""A sheet of two rows, as xlwt writes it."""


def refused_as(raw: bytes, name: str, options: ReadOptions) -> str:
    with pytest.raises(ContextDBError) as caught:
        read(raw, name, options)
    return str(caught.value)


def test_an_old_workbook_is_read_and_says_that_it_keeps_errors_to_itself():
    reading = read(OLD.read_bytes(), "old.xls")
    assert texts(reading) == {"Asset": ["Walk", "Run"], "speed": ["0..3", "4.5"]}
    assert "errors in an .xls file look like empty cells" in told(reading)


@pytest.mark.parametrize("rows", [[], [[" "], [None, None]]])
def test_a_workbook_with_nothing_in_it_is_refused(rows: list[list[Any]]):
    assert "there is nothing to read" in refused(book(empty=rows))


def test_the_only_sheet_is_read_though_it_is_hidden_and_told():
    workbook = book(seen=[], kept=[["Asset", "speed"], ["Walk", "1"]])
    workbook["kept"].sheet_state = "hidden"
    reading = read_book(workbook)
    assert texts(reading)["Asset"] == ["Walk"]
    assert "the sheet is hidden" in told(reading)


def test_a_sheet_of_types_that_somebody_else_wrote_is_left_out():
    reading = read_book(book(t=[["Asset", "speed"], ["Walk", "1"]], contextdb=[["notes"], ["of mine"]]))
    assert texts(reading) == {"Asset": ["Walk"], "speed": ["1"]}
    assert "it is not as contextdb writes it" in told(reading)


def test_a_workbook_that_unpacks_to_too_much_is_refused(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(xlsx_scan, "MOST_BYTES", 1_000)
    assert "the workbook would unpack to" in refused(book(t=[["Asset"], ["Walk"]]))


def test_a_lock_that_only_the_reader_finds_is_told_and_an_interruption_passes(monkeypatch: pytest.MonkeyPatch):
    def raising(error: BaseException) -> None:
        def from_filelike(_: object) -> None:
            raise error

        monkeypatch.setattr(calamine.CalamineWorkbook, "from_filelike", from_filelike)

    raw = raw_of(book(t=[["Asset"], ["Walk"]]))
    with monkeypatch.context():
        raising(calamine.PasswordError())
        assert "locked with a password" in refused(raw)
        raising(KeyboardInterrupt())
        with pytest.raises(KeyboardInterrupt):
            read(raw, "x.xlsx")


@pytest.mark.parametrize(
    ("raw", "name", "options", "said"),
    [
        (b"Asset;note\na;" + b"x" * 140_000 + b"\n", "x.csv", ReadOptions(), "line 2: a field has more than 65,536 characters"),
        (b"Asset,speed\na,1\n", "x.csv", ReadOptions(sheet="one"), "has no sheets. Accepted: its cells, such as A1:F20"),
        (b"Asset,speed\na,1\n", "x.csv", ReadOptions(format="jsno"), 'there is no format "jsno"'),
    ],
)
def test_what_no_reader_takes_is_refused_in_words(raw: bytes, name: str, options: ReadOptions, said: str):
    assert said in refused_as(raw, name, options)


def test_a_list_without_values_is_an_empty_cell():
    assert texts(read(b'[{"asset": "a", "tags": []}, {"asset": "b", "tags": ["x"]}]', "x.json"))["tags"] == ["", "x"]


def test_a_set_without_values_and_a_text_of_several_languages_of_unreal_become_cells():
    raw = b'---,tags,title\na,"()","NSLOCTEXT(""game"", ""key"", ""Walk on"")"\nb,"(""x"")","NSLOCTEXT(broken"\n'
    assert texts(read(raw, "x.csv")) == {"Asset Name": ["a", "b"], "tags": ["", "x"], "title": ["Walk on", "NSLOCTEXT(broken"]}


def test_two_columns_that_unreal_would_call_the_same_are_refused():
    table = Table.from_columns({"Asset": ["a"], "top speed": ["1"], "top_speed": ["2"]})
    with pytest.raises(TableError, match=r'two columns would be called "top_speed" in Unreal'):
        write(table, FORMATS["unreal-csv"])


@pytest.mark.parametrize("kind", ["csv", "jsonl", "parquet"])
def test_half_a_surrogate_pair_is_refused_by_every_writer(kind: str):
    table = Table.from_columns({"Asset": ["a"], "note": ["\ud800"]}, settings={"outputs": ["note"]})
    with pytest.raises(TableError, match=r"surrogate|UTF-8"):
        write(table, FORMATS[kind])


def test_a_number_with_two_points_is_an_unreadable_cell_of_a_column_of_numbers():
    found = propose_type(TextColumn.of("speed", ["1", "2.5", "7", "9", "1.2.3..1"]))
    assert found.declared is not None
    assert (found.declared["type"], found.n_unreadable) == ("number", 1)


def test_a_day_that_no_calendar_has_stays_as_it_is_written_and_bounds_nothing():
    day = '[date("2024-02-30")..date("2024-03-01")]'
    told_of = f"""<definitions xmlns="https://www.omg.org/spec/DMN/20191111/MODEL/"><decision name="d"><decisionTable>
      <input><inputExpression typeRef="date"><text>day</text></inputExpression><inputValues><text>{day}</text></inputValues></input>
      <output name="asset"/><rule><inputEntry><text>{day}</text></inputEntry><outputEntry><text>"a"</text></outputEntry></rule>
    </decisionTable></decision></definitions>"""
    reading = read(told_of.encode(), "x.dmn")
    assert texts(reading)["day"] == ["2024-02-30..2024-03-01"]
    assert f"the allowed values {in_quotes(day)} are not kept" in told(reading)


def test_a_long_fallback_of_a_workbook_comes_back():
    names = [f"output number {i}" for i in range(12)]
    fallback = {"asset": "nothing", "outputs": dict.fromkeys(names, "7")}
    columns = {"Asset": ["a"], **{name: ["1"] for name in names}}
    table = Table.from_columns(columns, settings={"outputs": names, "fallback": fallback}, name="t")
    again = read(write(table, FORMATS["xlsx"])[0], "t.xlsx").schema
    assert again is not None
    assert settings_to_dict(again.tables["t"]) == settings_to_dict(table.settings) | {"asset": "Asset"}


def test_dmn_says_what_it_leaves_out_of_priorities_rules_and_assumptions():
    conditions = {name: {"type": "number", "min": 0, "max": 9} for name in ("speed", "limit")}
    columns = {"Asset": ["a", "b"], "speed": ["1", "2"], "Prio": ["1", "2"], "When": ["limit > 3", ""]}
    settings = {"policy": "priority", "priority": "Prio", "when": "When", "assume": ["speed < 8"]}
    said = "\n".join(map(str, write(Table.from_columns(columns, conditions, settings), FORMATS["dmn"])[1]))
    for what in ("the priorities are an output", "its rules become an output", "assume is not kept"):
        assert what in said


def test_dmn_refuses_a_character_that_xml_cannot_hold_and_two_columns_of_one_name():
    with pytest.raises(TableError, match="a character that XML cannot hold"):
        write(Table.from_columns({"Asset": ["a\x0b"]}), FORMATS["dmn"])
    with pytest.raises(TableError, match='the column name "asset" appears twice'):
        decision({"asset": "number"}, ["1"])


def test_a_quoted_formula_stays_different_from_a_text_that_has_the_quote_already():
    table = Table.from_columns({"Asset": ["a", "b"], "note": ["=1", "'=1"]}, settings={"outputs": ["note"]})
    assert write(table, FORMATS["csv"], "quote")[0] == b"Asset,note\na,''=1\nb,'=1\n"


def test_a_sheet_of_scattered_cells_is_refused_and_a_blank_cell_parts_no_row():
    scattered = [["x" if r % 2 and c % 2 else None for c in range(80)] for r in range(80)]
    assert "more than 1,000 blocks of cells" in refused(book(t=scattered))
    parted = [["A", "b", "c"], ["a", 1, 2], [None] * 3, ["b", None, 3]]
    assert texts(read_book(book(t=parted))) == {"A": ["a", "b"], "b": ["1", ""], "c": ["2", "3"]}


def test_of_many_structs_the_first_are_told_and_how_many_more():
    rows = "".join(f'r{i},"(X=1.0,Y={i}.0)"\n' for i in range(30))
    assert "10 more structs" in told(read(f"---,at\n{rows}".encode(), "x.csv"))
