"""Dialogs that keep edits safe: conflicts decided one by one, leaving with unsaved edits, a table that is open elsewhere."""

from collections.abc import Sequence
from typing import Any

import pytest
from terminal import drive, screen_text
from textual.app import App
from textual.pilot import Pilot

from contextdb.tables.merging.conflicts import Conflict
from tui.model.lock import Holder
from tui.screens.conflicts import ConflictsDialog, version_text
from tui.screens.dialog import Dialog
from tui.screens.leaving import HeldDialog, LeavingDialog

CONFLICTS = [
    Conflict("cell", "run", "speed", 1, "0..5", "1..2", "3..4", (1,)),
    Conflict("cell", "dive", "hit", 3, "Any", "True", "[red]False[/]", (2,)),
    Conflict("row", "jump", "", None, "jump", None, "speed: 3..4", (3,)),
    Conflict("name", "", "pace", None, "speed", "pace", "velocity", (4,)),
]


class Host(App[None]):
    """An app with nothing but a dialog, and its answer."""

    def __init__(self, dialog: Dialog[Any]) -> None:
        super().__init__()
        self.dialog = dialog
        self.answers: list[object] = []

    def on_mount(self) -> None:
        self.push_screen(self.dialog, self.answers.append)


def answer(dialog: Dialog[Any], *keys: str) -> tuple[list[object], str]:
    """What the dialog gives after these keys, and what stood on the screen before the last of them."""

    async def script(pilot: Pilot[None]) -> tuple[list[object], str]:
        for key in keys[:-1]:
            await pilot.press(key)
        await pilot.pause()
        seen = screen_text(pilot.app)
        await pilot.press(*keys[-1:])
        await pilot.pause()
        return pilot.app.answers, seen

    return drive(Host(dialog), script)


def decided(*keys: str, conflicts: Sequence[Conflict] = CONFLICTS) -> object:
    return answer(ConflictsDialog(conflicts, "t.csv"), *keys)[0]


# ---- conflicts


def test_each_conflict_is_decided_with_the_arrows_and_the_next_one_follows():
    assert decided("left", "right", "right", "left", "enter") == [{0: "ours", 1: "theirs", 2: "theirs", 3: "ours"}]


def test_all_are_decided_at_once_and_single_ones_turned():
    assert decided("m", "enter") == [dict.fromkeys(range(4), "ours")]
    assert decided("d", "down", "space", "enter") == [{0: "theirs", 1: "ours", 2: "theirs", 3: "theirs"}]


def test_enter_leads_to_what_is_not_decided_yet():
    keys = ["right", "down", "left", "enter"]  # the first, then the third
    answers, seen = answer(ConflictsDialog(CONFLICTS), *keys, "f5")
    assert answers == []
    assert "Decide 2 first" in seen
    assert "▸ dive" in seen


def test_escape_decides_nothing():
    assert decided("d", "escape") == [None]


def test_texts_are_shown_as_they_are_with_what_was_there_and_what_is_chosen():
    _, seen = answer(ConflictsDialog(CONFLICTS, "t.csv"), "right", "left", "f5")
    assert "4 places in t.csv changed both here and on disk" in seen
    assert "● 3..4" in seen
    assert "● True" in seen
    assert "○ [red]F" in seen
    assert "(row)" in seen
    assert "On disk  speed: 3..4" in seen
    assert "2 of 4 to decide" in seen


def test_the_whole_text_of_the_place_in_question_stands_below_the_list():
    _, seen = answer(ConflictsDialog(CONFLICTS), "down", "f5")
    assert "dive, hit" in seen
    assert "On disk  [red]False[/]" in seen


def test_a_click_on_a_text_takes_it():
    async def script(pilot: Pilot[None]) -> list[object]:
        await pilot.pause()
        lines = screen_text(pilot.app).splitlines()
        for y, text in ((row(lines, "run"), "3..4"), (row(lines, "dive"), "True")):
            await pilot.click(offset=(lines[y].index(text), y))
        y = row(lines, "All mine")
        assert pilot.app.dialog.sides == {0: "theirs", 1: "ours"}
        await pilot.click(offset=(lines[y].index("All on disk") + 1, y))
        await pilot.click(offset=(lines[y].index("Merge") + 1, y))
        await pilot.pause()
        return pilot.app.answers

    assert drive(Host(ConflictsDialog(CONFLICTS)), script) == [dict.fromkeys(range(4), "theirs")]


def row(lines: list[str], text: str) -> int:
    return next(y for y, line in enumerate(lines) if text in line)


@pytest.mark.parametrize("size", [(80, 24), (160, 48), (100, 30)])
def test_a_thousand_conflicts_fit_any_screen_and_the_end_is_reached(size):
    many = [Conflict("cell", f"anim_{i}", "speed", i, "0..5", "1..2", "3..4", (i,)) for i in range(1000)]

    async def script(pilot: Pilot[None]) -> str:
        await pilot.press("end", "right")
        await pilot.pause()
        return screen_text(pilot.app)

    seen = drive(Host(ConflictsDialog(many)), script, size)
    assert "▸ anim_999" in seen
    assert "999 of 1,000 to decide" in seen


def test_what_is_not_there_is_said_in_words():
    assert [version_text(None), version_text(""), version_text(" "), version_text("a\nb")] == [
        "(deleted)",
        "(empty)",
        "(empty)",
        "a\\nb",
    ]


# ---- leaving


def test_leaving_asks_what_becomes_of_unsaved_edits():
    for key, expected in (("s", "save"), ("enter", "save"), ("d", "discard"), ("escape", None)):
        assert answer(LeavingDialog(["hit_mid_air"]), key)[0] == [expected]


def test_leaving_names_the_tables_that_have_them():
    _, seen = answer(LeavingDialog(["hit_mid_air", "loco[b]motion"]), "escape")
    assert "These tables have edits that are not saved" in seen
    assert "loco[b]motion" in seen
    assert "Save all 2" in seen
    _, seen = answer(LeavingDialog([f"t{i}" for i in range(20)]), "escape")
    assert "and 12 more tables" in seen


def test_the_answers_of_leaving_can_be_clicked():
    async def script(pilot: Pilot[None]) -> list[object]:
        await pilot.pause()
        lines = screen_text(pilot.app).splitlines()
        y = row(lines, "Do not save")
        await pilot.click(offset=(lines[y].index("Do not save") + 1, y))
        await pilot.pause()
        return pilot.app.answers

    assert drive(Host(LeavingDialog(["t"])), script) == ["discard"]


# ---- open elsewhere


def test_a_table_open_on_this_machine_can_be_read_but_not_taken():
    dialog = HeldDialog("t", Holder(812, "x"))
    answers, seen = answer(dialog, "t", "r")
    assert answers == ["read-only"]
    assert "another editor (process 812)" in seen
    assert "Take over" not in seen


def test_a_table_open_on_another_machine_can_be_taken_over():
    answers, seen = answer(HeldDialog("t", Holder(812, "x", "workstation-7")), "t")
    assert answers == ["take-over"]
    assert "another editor on workstation-7 (process 812)" in " ".join(seen.replace("│", " ").split())
    assert "Take over" in seen
    assert answer(HeldDialog("t", Holder(812, "x", "workstation-7")), "escape")[0] == [None]
