"""Undo in the test row: it takes back facts, and never an edit of the table."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from terminal import press, said, with_editor

import contextdb as cdb
from tui.app import EditorApp
from tui.model.sheet import Sheet

RAW = "Asset,speed,hit\nwalk,0..2,True\nrun,2..6,Any\njump,Any,False\n"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "t.csv"
    path.write_text(RAW)
    return path


def test_ctrl_z_in_the_test_row_takes_back_the_fact_and_leaves_the_table(file):
    async def script(app: EditorApp, pilot) -> list[object]:
        sheet = app.main.session.sheet
        await press(pilot, "x", "enter", "f6", "3", "enter", "ctrl+z")
        seen: list[object] = [sheet.table.assets[0], dict(sheet.query.facts), said(app)]
        await press(pilot, "ctrl+z")
        seen += [sheet.table.assets[0], said(app)]
        await press(pilot, "ctrl+y")
        seen += [sheet.query.facts["speed"]]
        await press(pilot, "f6", "ctrl+z")
        return [*seen, sheet.table.assets[0], sheet.query.facts["speed"]]

    assert with_editor(file, script) == [
        "x", {"speed": None, "hit": None}, "Undo: the fact of speed.",
        "x", "There is no fact to undo. F6 goes back to the table, and its steps.",
        3.0, "walk", 3.0,
    ]  # fmt: skip


def test_a_cleared_test_row_comes_back_whole(file):
    async def script(app: EditorApp, pilot) -> list[dict[str, str]]:
        query, seen = app.main.session.sheet.query, []
        await press(pilot, "f6", "3", "tab", "t", "enter", "alt+x")
        seen.append(dict(query.texts))
        await press(pilot, "ctrl+z")
        return [*seen, dict(query.texts)]

    assert with_editor(file, script) == [{}, {"speed": "3", "hit": "True"}]


@pytest.mark.parametrize("key", ["ctrl+d", "ctrl+r", "ctrl+b", "ctrl+k", "ctrl+e", "alt+i", "alt+m"])
def test_a_key_that_edits_rows_does_nothing_from_the_test_row(file, key):
    async def script(app: EditorApp, pilot) -> tuple[bool, str]:
        await press(pilot, "down", "f6", key)
        return app.main.session.sheet.is_modified, said(app)

    assert with_editor(file, script) == (False, "The cursor is in the test row. F6 goes back to the table.")


steps = st.lists(
    st.one_of(
        st.tuples(st.just("set"), st.sampled_from(["speed", "hit"]), st.sampled_from(["", "1", "True", "not a fact"])),
        st.tuples(st.just("load"), st.sampled_from([{}, {"speed": "4"}, {"hit": "False", "speed": "1"}])),
        st.tuples(st.just("undo")),
        st.tuples(st.just("redo")),
    ),
    max_size=12,
)


@given(steps)
def test_undo_and_redo_of_facts_are_those_of_a_list_of_states(moves):
    sheet = Sheet(
        cdb.Table.from_columns(
            {"Asset": ["a"], "speed": ["1"], "hit": ["True"]}, {"speed": {"type": "number"}, "hit": {"type": "bool"}}
        )
    )
    states: list[dict[str, str]] = [{}]
    at = 0
    for move in moves:
        if move[0] in ("undo", "redo"):
            sheet.undo_fact(move[0] == "redo")
            at = max(0, at - 1) if move[0] == "undo" else min(len(states) - 1, at + 1)
        else:
            new = move[1] if move[0] == "load" else {name: text for name, text in {**states[at], move[1]: move[2]}.items() if text}
            sheet.ask("facts", move[1]) if move[0] == "load" else sheet.set_fact(move[1], move[2])
            if new != states[at]:
                states, at = [*states[: at + 1], new], at + 1
        assert {name: text for name, text in sheet.query.texts.items() if text} == states[at]
        assert (sheet.query.facts["speed"] is None) == (states[at].get("speed", "") in ("", "True", "not a fact"))
