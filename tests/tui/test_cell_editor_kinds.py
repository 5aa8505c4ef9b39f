"""The cell editor in a terminal: every kind of cell, its list or its picture."""

from collections.abc import Sequence
from typing import Any

import pytest
from editor_desk import CHART, HIT, SIDE, SPEED, STATE, STEPS, WAY, Desk, committed, line_at, press, taken
from terminal import drive, screen_text
from textual.pilot import Pilot

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from tui.widgets.editing.choice_list import ChoiceList

# ---- bool


@pytest.mark.parametrize(
    ("typed", "text"), [("t", "True"), ("f", "False"), ("a", "Any"), ("TR", "True"), ("no", "False"), ("1", "True")]
)
def test_a_few_letters_are_enough_for_a_bool(typed, text):
    assert taken(HIT, typed[0], *typed[1:], "enter", is_typing=True) == text


def test_a_bool_is_chosen_from_a_list():
    desk = Desk(HIT, "True", open_list=True)
    screen = press(desk)
    assert [row in screen for row in ("▸• True", "False", "Any")] == [True] * 3
    assert taken(HIT, "True", "down", "enter", open_list=True) == "False"
    assert taken(HIT, "True", "f", "enter", open_list=True) == "False"
    assert taken(HIT, "True", "enter", open_list=True) == "True"


def test_the_row_that_a_few_letters_mean_is_marked():
    screen = press(Desk(HIT, "f", is_typing=True))
    assert "• False" in screen
    assert "• True" not in screen


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


def test_the_fact_of_a_bool_may_be_left_out():
    desk = Desk(HIT, "True", is_fact=True, open_list=True)
    assert "(not given)" in press(desk)
    assert taken(HIT, "True", "end", "enter", is_fact=True, open_list=True) == ""


# ---- values


def test_the_word_being_typed_is_completed_from_the_list():
    assert taken(CHART, "CB", "space", "L", "down", "enter", "enter") == "CB LB"
    assert taken(CHART, "C", "f4", "down", "enter", "enter", is_typing=True) == '"Half Back"'


def test_one_key_takes_the_first_value_that_the_word_may_be():
    assert taken(CHART, "CB h", "ctrl+t", "enter") == 'CB "Half Back"'


def test_the_list_follows_the_caret():
    screen = press(Desk(CHART, "C FS"), "home", "right")
    assert "2 values possible" in screen
    assert "▸" not in screen
    assert "CB" in screen


def test_space_ticks_several():
    desk = Desk(CHART, "CB SS ~2", open_list=True)
    screen = press(desk, "down", "space")
    assert "[x] FS" in screen
    assert "[ ] LB" in screen
    assert "3 of 5 declared values; others cost 2 more" in screen
    assert taken(CHART, "CB", "down", "space", "down", "space", "enter", open_list=True) == "CB FS SS"
    assert taken(CHART, "CB FS", "space", "enter", open_list=True) == "FS"


def test_enter_on_another_row_takes_that_value_alone():
    assert taken(CHART, "CB FS ~2", "end", "enter", open_list=True) == '"Half Back" ~2'
    assert taken(CHART, "CB FS", "home", "enter", open_list=True) == "Any"
    assert taken(CHART, "CB FS", "enter", open_list=True) == "CB FS"


def test_typing_into_the_open_list_begins_another_word():
    assert taken(CHART, "CB", "L", "ctrl+t", "enter", open_list=True) == "CB LB"
    assert taken(CHART, "Any", "L", "ctrl+t", "enter", open_list=True) == "LB"


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


def test_a_user_text_is_never_markup():
    odd = Condition("odd", Domain("enum", ("[red]", "[/]", "[bold]x")))
    screen = press(Desk(odd, "[", is_typing=True))
    assert all(value in screen for value in ("[red]", "[/]", "[bold]x"))
    assert "Ctrl+T [red]" in screen


# ---- tags


def test_a_tag_has_three_states():
    desk = Desk(STATE, "+InAir -Move.Run", open_list=True)
    screen = press(desk)
    assert [row in screen for row in ("[+] InAir", "[ ] Move", "[-] Move.Run", "[ ] Stunned")] == [True] * 4
    assert taken(STATE, "+InAir", "end", "space", "space", "enter", open_list=True) == "+InAir -Stunned"
    assert taken(STATE, "+InAir", "end", "minus", "home", "down", "minus", "enter", open_list=True) == "-InAir -Stunned"


def test_the_fact_of_a_tag_is_a_plain_set():
    assert taken(STATE, "InAir", "end", "space", "enter", open_list=True, is_fact=True) == "InAir Stunned"


# ---- numbers


def test_numbers_are_drawn_as_they_are_typed():
    screen = press(Desk(SPEED, "(0.3..1.1]"))
    assert "0 ├" in screen
    assert "○━" in screen
    assert "0.3 to 1.1 m/s, 0.3 excluded" in screen


def test_an_angle_has_a_dial_and_words():
    screen = press(Desk(WAY, "20.0000, 9.9900"))
    assert "10.01 to 29.99 degrees, ends included" in screen
    assert any("90 ⡇" in row and "⢸ -90" in row for row in screen.splitlines())


def test_arrows_move_the_number_at_the_caret():
    assert taken(SPEED, "0.3..1.1", "up", "up", "enter") == "0.3..1.3"
    assert taken(SPEED, "0.3..1.1", "home", "down", "enter") == "0.2..1.1"
    assert taken(SPEED, "0.3..1.1", "pageup", "enter") == "0.3..2.1"
    assert taken(STEPS, "3", "alt+up", "enter", is_typing=True) == "4"
    assert taken(WAY, "20.0000, 9.9900", "alt+left", "enter") == "20.0000, 8.9900"


def test_one_key_changes_between_bounds_and_centre_with_tolerance():
    assert taken(SPEED, "1..3", "f4", "enter") == "2, 1"
    assert taken(SPEED, "2, 1", "f4", "enter") == "1..3"
    assert "other form" not in press(Desk(SPEED, "0.1..0.3"))


def test_the_fact_of_a_number_is_drawn_as_a_point():
    screen = press(Desk(SPEED, "3", is_fact=True))
    assert "exactly 3 m/s" in screen
    assert "─●─" in screen


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


@pytest.mark.parametrize(("condition", "text", "said"), KINDS)
def test_every_kind_says_what_the_text_means(condition, text, said):
    assert said in press(Desk(condition, text))
    assert "others cost 2.5 more" in press(Desk(condition, f"{text} ~2.5"))
    assert "! " not in press(Desk(condition, f"not {text}"))


@pytest.mark.parametrize("condition", [kind[0] for kind in KINDS])
def test_every_kind_takes_any_and_the_empty_cell(condition):
    assert taken(condition, "Any", "enter") == "Any"
    assert taken(condition, "", "enter") == ""


# ---- dates

DAY = Condition("day", Domain("date", None, 20454.0, 20818.0))
"""Of the year 2026."""


def test_a_date_is_typed_and_drawn_on_the_line_of_its_year():
    assert taken(DAY, "2", *"026-03-01..", "enter", is_typing=True) == "2026-03-01.."
    screen = press(Desk(DAY, "2026-03-01..2026-05-31"))
    assert "2026-01-01 ├────●━━━━━●───────────────┤ 2026-12-31" in screen
    assert "2026-03-01 to 2026-05-31" in screen


def test_the_day_under_the_caret_moves_over_the_end_of_a_month():
    assert taken(DAY, "2026-02-28", "up", "enter") == "2026-03-01"
    assert taken(DAY, "2026-03-01..2026-05-31", "home", "down", "enter") == "2026-02-28..2026-05-31"


def test_a_day_that_the_calendar_does_not_have_stays_in_its_cell_with_the_reason():
    assert 'cannot read "2026-02-30" as a date' in press(Desk(DAY, "2026-02-30"), "enter")
