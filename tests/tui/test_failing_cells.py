"""Cells that fail: counted in the gutter, pointed at from the edges, and gone to by a key."""

import pytest

from contextdb.columns import TextColumn
from contextdb.schema.settings import Schema, TableSettings, conditions_from_dict
from contextdb.tables.table import Table
from tui.model.sheet import Sheet

SCHEMA = {"hit": {"type": "bool"}, "gait": {"type": "enum", "values": ["Walk", "Run"]}, "speed": {"type": "number"}}
COLUMNS = {
    "Asset": ["a", "b", "c", "d"],
    "hit": ["True", "False", "False", "Any"],
    "gait": ["Walk", "Run", "Any", "Walk"],
    "speed": ["0..2", ">5", "1", "odd"],
}


def sheet_of(**facts: str) -> Sheet:
    texts = [TextColumn.of(name, values) for name, values in COLUMNS.items()]
    declared = Schema(conditions=conditions_from_dict(SCHEMA))
    sheet = Sheet(Table.build("t", texts, declared, TableSettings("t")))
    for name, text in facts.items():
        sheet.set_fact(name, text)
    return sheet


def gone_to(sheet: Sheet, is_backwards: bool = False) -> list[tuple[int, int]]:
    """Where the key goes, until it is back."""
    places: list[tuple[int, int]] = []
    while (place := sheet.next_failing(is_backwards)) is not None and place not in places:
        places.append(place)
        sheet.go(*place)
    return places


@pytest.mark.parametrize("is_backwards", [False, True])
def test_the_key_goes_through_every_failing_cell_and_round(is_backwards):
    sheet = sheet_of(hit="True", gait="Walk", speed="1")
    fails = sheet.failing(0, 4)
    wanted = [(int(r), int(c)) for r, c in zip(*fails.nonzero(), strict=True)]
    assert len(wanted) > 3
    assert gone_to(sheet, is_backwards) == (wanted[::-1] if is_backwards else wanted)


def test_it_goes_on_where_the_rows_are_looked_through_in_blocks(monkeypatch):
    monkeypatch.setattr("tui.model.displayed_table.SEEK_ROWS", 2)
    sheet = sheet_of(hit="True")
    for is_backwards in (False, True):
        assert sorted(gone_to(sheet, is_backwards)) == [(1, 1), (2, 1)]


def test_without_facts_it_goes_to_what_cannot_be_read():
    assert gone_to(sheet_of()) == [(3, 3)]


def test_where_none_fails_there_is_nothing_to_go_to():
    assert sheet_of(hit="True", gait="Walk").next_failing() is not None
    sheet = Sheet(Table.from_columns({"Asset": ["a"], "hit": ["Any"]}, SCHEMA))
    sheet.set_fact("hit", "True")
    assert sheet.next_failing() is None
