"""Cells that fail: counted in the gutter, pointed at from the edges, and gone to by a key."""

from pathlib import Path

import pytest
from terminal import press, said, screen_text, with_editor

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


@pytest.fixture
def wide(tmp_path: Path) -> Path:
    names = [f"condition_{at}" for at in range(12)]
    rows = ["a," + ",".join(["False"] * 12), "b," + ",".join(["Any"] * 11 + ["False"])]
    file = tmp_path / "t.csv"
    file.write_text("\n".join([",".join(["Asset", *names]), *rows]) + "\n")
    return file


def test_the_gutter_counts_and_the_edges_point(wide):
    async def script(app, pilot):
        sheet = app.main.session.sheet
        for at in (0, 1, 11):
            sheet.set_fact(f"condition_{at}", "True")
        app.main.show()
        await press(pilot)
        at_first = screen_text(app).splitlines()
        await press(pilot, "end")
        at_end = screen_text(app).splitlines()
        return [next(line for line in lines if row in line) for lines in (at_first, at_end) for row in ("1×", "2×")]

    first, second, first_at_end, second_at_end = with_editor(wide, script)
    assert first.startswith("1×3 ")
    assert second.startswith("2×1 ")
    assert ("»" in second, "«" in second) == (True, False)
    assert ("»" in first_at_end, "«" in first_at_end) == (False, True)
    assert "«" not in second_at_end


def test_the_keys_go_there(wide):
    async def script(app, pilot):
        app.main.session.sheet.set_fact("condition_11", "True")
        await press(pilot, "alt+n")
        first = app.main.session.sheet.cursor
        await press(pilot, "alt+n", "alt+v", "alt+v")
        return first, app.main.session.sheet.cursor, said(app)

    assert with_editor(wide, script) == ((0, 12), (1, 12), "")
