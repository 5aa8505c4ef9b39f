"""The cell editor in a terminal: every kind of cell, its list or its picture."""

from collections.abc import Sequence
from typing import Any

from editor_desk import CHART, HIT, SIDE, SPEED, STATE, STEPS, WAY, Desk, committed, line_at, press, taken
from terminal import drive, screen_text
from textual.pilot import Pilot

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from tui.widgets.editing.choice_list import ChoiceList

# ---- bool


def test_spaces_round_a_condition_are_left_out_unless_they_were_there():
    assert taken(CHART, "CB", "space", "enter") == "CB"
    assert taken(CHART, "CB ", "enter") == "CB "
    assert taken(None, "CB", "space", "enter", kind="output") == "CB "


def test_an_enabled_cell_is_true_or_false():
    desk = Desk(None, "t", kind="enabled", is_typing=True)
    assert "Any" not in press(desk, "enter")
    assert committed(desk)[0] == "True"


def test_a_bool_may_be_negated_and_soft():
    assert taken(HIT, "not True ~2.5", "enter") == "not True ~2.5"


def test_a_click_on_a_row_takes_it_at_once():
    desk = Desk(HIT, "True", open_list=True)

    async def script(pilot: Pilot[Any]) -> None:
        await pilot.click(ChoiceList, offset=(6, 2))
        await pilot.pause()

    drive(desk, script)
    assert committed(desk) == ("Any", 0, 0, False)


# ---- values


def test_a_click_ticks_a_value():
    desk = Desk(CHART, "CB", open_list=True)

    async def script(pilot: Pilot[Any]) -> str:
        await pilot.click(ChoiceList, offset=(6, 3))
        await pilot.pause()
        await pilot.press("enter")
        return screen_text(desk)

    drive(desk, script)
    assert committed(desk)[0] == "CB SS"


def test_values_of_a_text_column_are_offered_from_its_cells():
    assert taken(SIDE, "l", "ctrl+t", "enter", is_typing=True, known=("left right", "up")) == "left"


def test_ten_thousand_values_are_offered_and_only_those_seen_are_painted(monkeypatch):
    many = Condition("many", Domain("enum", tuple(f"Clip_{n:05}" for n in range(10_000))))
    asked, paint = [], ChoiceList._text
    monkeypatch.setattr(ChoiceList, "_text", lambda self, row: asked.append(row) or paint(self, row))
    screen = press(Desk(many, "Clip_00000", open_list=True), "end")
    assert "10,000 values" in screen
    assert "▸[ ] Clip_09999" in screen
    assert len(set(asked)) < 250
    assert taken(many, "0", "7", "7", "7", "7", "ctrl+t", "enter", is_typing=True) == "Clip_07777"


# ---- tags


# ---- numbers


# ---- other columns


def test_an_asset_is_completed_from_the_assets_known():
    desk = Desk(None, "w", kind="asset", known=("walk fast", "walk", "run"), is_typing=True)
    screen = press(desk)
    assert "walk fast" in screen
    assert "run" not in screen
    assert taken(None, "w", "f4", "down", "enter", kind="asset", known=("walk fast", "walk"), is_typing=True) == "walk"


def test_a_column_with_nothing_to_offer_has_no_popup():
    desk = Desk(None, "12", kind="priority", known=("1", "2"))
    press(desk)
    assert desk.popup_at is None


def test_line_ends_that_a_text_has_are_shown_as_signs_and_kept():
    desk = Desk(None, "one\ntwo\tthree", kind="output", known=())
    assert "one⏎two⇥three" in line_at(press(desk))
    assert taken(None, "one\ntwo", "x", "enter", kind="output") == "one\ntwox"


# ---- every kind together

KINDS: Sequence[tuple[Condition | None, str, str]] = [
    (HIT, "True", "only True"),
    (CHART, "CB", "1 of 5 declared values"),
    (STATE, "+InAir", "has InAir"),
    (SPEED, "1..2", "1 to 2 m/s, ends included"),
    (STEPS, "1..2", "1 to 2, ends included"),
    (WAY, "90", "exactly 90 degrees"),
    (SIDE, "left", "1 value"),
]


# ---- dates

"""Of the year 2026."""
