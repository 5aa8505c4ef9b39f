"""The cell editor in a terminal: where it stands, how it is left, bad entries and mends, pastes."""

from typing import Any

import pytest
from editor_desk import CELL, CHART, HIT, SIDE, SPEED, STATE, WAY, Desk, committed, line_at, press
from terminal import drive, screen_text
from textual import events
from textual.geometry import Region
from textual.pilot import Pilot
from textual.screen import ModalScreen
from textual.widgets import Button

from contextdb.errors import Fault
from tui.widgets.cell_editor import CellEditor
from tui.widgets.editing.entry import one_line
from tui.widgets.editing.popup import Mend, Popup, wrapped

# ---- where it stands


def test_the_entry_line_lies_exactly_on_the_cell():
    desk = Desk(SPEED, "0.3..1.1")
    screen = press(desk)
    assert desk.entry_at == CELL
    assert line_at(screen)[20:28] == "0.3..1.1"
    assert screen.splitlines()[11][20] == "╭"


def test_a_long_text_makes_the_entry_line_wider_and_moves_it_back_from_the_right_edge():
    desk = Desk(SIDE, "a" * 30, at=Region(70, 3, 8, 1))
    screen = press(desk)
    assert desk.entry_at == Region(49, 3, 31, 1)
    assert screen.splitlines()[3][49:79] == "a" * 30


def test_a_text_longer_than_the_screen_is_scrolled_to_the_caret():
    desk = Desk(None, "x" * 500 + "end", kind="output", known=())
    screen = press(desk)
    assert desk.entry_at == Region(0, 10, 80, 1)
    assert line_at(screen).rstrip().endswith("xend")


def test_wide_characters_are_measured_in_cells():
    desk = Desk(SIDE, "走る 歩く 歩く 歩く", at=Region(75, 3, 5, 1))
    press(desk)
    assert desk.entry_at.width == 20
    assert desk.entry_at.right == 80


@pytest.mark.parametrize("condition", [HIT, CHART, STATE, SPEED, WAY])
@pytest.mark.parametrize("size", [(80, 24), (160, 48), (40, 12)])
def test_the_popup_is_on_the_screen_and_never_over_the_entry_line(condition, size):
    desk = Desk(condition, "Any", open_list=True)
    width, height = size

    async def script(pilot: Pilot[Any]) -> None:
        for y in (0, 1, height // 2, height - 2, height - 1):
            for x in (0, width // 2, width - 5, width - 1):
                desk.editor.place(Region(x, y, 10, 1), desk.size)
                await pilot.pause()
                desk.look()
                assert desk.popup_at is not None
                assert desk.entry_at.y == y
                assert desk.screen.region.contains_region(desk.entry_at)
                assert desk.screen.region.contains_region(desk.popup_at)
                assert desk.popup_at.bottom == y or desk.popup_at.y == y + 1

    drive(desk, script, size)


def test_on_a_low_screen_the_list_is_shorter_and_scrolls():
    desk = Desk(CHART, "Any", at=Region(2, 3, 10, 1), open_list=True)
    screen = press(desk, "end", size=(40, 9))
    assert "Half Back" in screen
    assert "[ ] Any" not in screen


def test_without_room_for_a_popup_the_entry_line_stands_alone():
    desk = Desk(CHART, "CB", at=Region(0, 1, 10, 1))
    press(desk, size=(20, 3))
    assert desk.popup_at is None


def test_it_can_be_placed_again_when_the_screen_changes():
    desk = Desk(SPEED, "1..2")

    async def script(pilot: Pilot[Any]) -> None:
        desk.editor.place(Region(2, 2, 12, 1), desk.size)
        await pilot.pause()
        desk.look()

    drive(desk, script)
    assert desk.entry_at == Region(2, 2, 12, 1)
    assert desk.popup_at is not None
    assert desk.popup_at.y == 3


# ---- leaving


def test_nothing_is_posted_twice():
    desk = Desk(SPEED, "1..2")
    press(desk, "enter", "enter", "escape", "tab")
    assert len(desk.said) == 1


async def _click_elsewhere(pilot: Pilot[Any]) -> None:
    await pilot.click(Button)
    await pilot.pause()


def test_a_click_elsewhere_takes_a_good_text():
    desk = Desk(SPEED, "1..2")

    async def script(pilot: Pilot[Any]) -> None:
        await pilot.press("5")
        await _click_elsewhere(pilot)

    drive(desk, script)
    assert committed(desk) == ("1..25", 0, 0, False)


def test_a_click_elsewhere_keeps_a_bad_text_and_its_caret():
    desk = Desk(SPEED, "1..2")

    async def script(pilot: Pilot[Any]) -> str:
        await pilot.press("x")
        await _click_elsewhere(pilot)
        assert desk.focused is desk.editor.entry
        return screen_text(desk)

    assert 'cannot read "1..2x"' in drive(desk, script)
    assert desk.said == []


def test_a_click_elsewhere_leaves_a_bad_text_that_was_there_before():
    desk = Desk(SPEED, "rubbish")
    drive(desk, _click_elsewhere)
    assert [type(m) for m in desk.said] == [CellEditor.Cancelled]


def test_a_window_that_is_left_for_another_keeps_the_editor_open():
    desk = Desk(SPEED, "1..2")

    async def script(pilot: Pilot[Any]) -> None:
        await pilot.press("5")
        desk.post_message(events.AppBlur())
        await pilot.pause()
        assert desk.said == []
        desk.post_message(events.AppFocus())
        await pilot.pause()
        await pilot.press("enter")

    drive(desk, script)
    assert committed(desk)[0] == "1..25"


def test_a_dialog_over_the_editor_leaves_it_as_it_is():
    desk = Desk(SPEED, "1..2")

    async def script(pilot: Pilot[Any]) -> None:
        await pilot.press("5")
        await desk.push_screen(ModalScreen())
        await pilot.pause()
        desk.pop_screen()
        await pilot.pause()
        await pilot.press("enter")

    drive(desk, script)
    assert committed(desk)[0] == "1..25"


def test_a_click_on_the_popup_changes_nothing():
    desk = Desk(SPEED, "1..2")

    async def script(pilot: Pilot[Any]) -> None:
        await pilot.press("5")
        await pilot.click(Popup, offset=(3, 1))
        await pilot.press("enter")

    drive(desk, script)
    assert committed(desk)[0] == "1..25"


# ---- bad entries and mends


def test_a_click_takes_the_mend():
    desk = Desk(WAY, "20; 9.99")

    async def script(pilot: Pilot[Any]) -> None:
        await pilot.press("enter")
        await pilot.pause()
        await pilot.click(Mend)
        await pilot.press("enter")

    drive(desk, script)
    assert committed(desk)[0] == "20, 9.99"


def test_a_cell_that_nothing_matches_is_refused_as_the_check_says():
    refusal = Fault("no.", "something else", "to think again")
    desk = Desk(SPEED, "1", check=lambda text: refusal)
    screen = press(desk, "enter")
    assert "! no." in screen
    assert "Try to think again." in screen
    assert desk.said == []


def test_what_was_taken_can_still_be_refused():
    desk = Desk(SPEED, "1")

    async def script(pilot: Pilot[Any]) -> str:
        await pilot.press("enter")
        desk.editor.refuse(Fault("the file is read-only."))
        await pilot.pause()
        await pilot.press("enter")
        return screen_text(desk)

    drive(desk, script)
    assert len(desk.said) == 2


# ---- paste


@pytest.mark.parametrize(
    ("pasted", "line"),
    [
        ("CB", "CB"),
        ("CB\r\n", "CB"),
        ("CB\tFS\rSS\tLB\r", "CB FS SS LB"),
        ("a\n\n\nb", "a b"),
        ("", ""),
        ("\n", ""),
        (" x ", " x "),
        ("a\x00\x1bb", "ab"),
    ],
)
def test_a_paste_is_one_line(pasted, line):
    assert one_line(pasted) == line


def test_the_words_of_a_message_are_broken_at_spaces_and_long_ones_anywhere():
    assert wrapped("one two three", 8) == ["one two", "three"]
    assert wrapped("歩く歩く歩く", 5) == ["歩く", "歩く", "歩く"]
    assert wrapped("", 5) == []
