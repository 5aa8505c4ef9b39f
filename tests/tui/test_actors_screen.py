"""The screen of actors: a small sheet for each role, whose actors the test row casts."""

import json
from pathlib import Path

import pytest
from terminal import press, said, screen_text, settled, with_editor

from tui.screens.actors import ActorsDialog

TOML = """
[conditions.air]
type = "bool"
[conditions."Defender.chart"]
type = "enum"
values = ["CB", "FS"]
[conditions."Receiver.near"]
type = "number"
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text(TOML)
    file = tmp_path / "catch.csv"
    file.write_text("Asset,air,Defender.chart,Receiver.near\nboth,Any,CB,0..2\ndefender,True,FS,Any\nnobody,Any,Any,Any\n")
    return file


def valid(app) -> list[bool]:
    return app.main.session.sheet.query.valid.tolist()


def test_actors_of_two_roles_are_cast_and_seen_beside_the_cells(path):
    async def script(app, pilot):
        await press(pilot, "alt+p", *"Ivy", "tab", *"CB", "enter")
        await press(pilot, "alt+right", *"Kim", "tab", "1", "enter")
        labels = screen_text(app)
        await press(pilot, "escape")
        return labels, screen_text(app), valid(app), app.main.session.sheet.notes(0)

    labels, screen, rows, notes = with_editor(path, script, (100, 24))
    assert "Defender 1" in labels
    assert "Receiver 1" in labels
    assert "near" in labels
    assert rows == [True, False, True]
    assert notes == {2: "Ivy", 3: "Kim"}
    assert "Defender: Ivy · Receiver: Kim" in screen
    assert "1 actor" in screen


def test_what_the_file_beside_the_table_holds_is_offered_when_the_screen_is_left(path):
    kept = {"Defender": [{"name": "Ivy", "chart": "CB"}], "Receiver": [{"id": 7, "near": 1.5}]}
    path.with_name("catch.actors.json").write_text(json.dumps(kept))

    async def script(app, pilot):
        before = valid(app)
        await press(pilot, "alt+p", "escape")
        return before, valid(app), app.main.session.sheet.query.casting(0)

    assert with_editor(path, script) == ([True, True, True], [True, False, True], {"Defender": "Ivy", "Receiver": "7"})


def test_actors_are_pasted_from_excel_and_taken_back_as_one_step(path):
    async def script(app, pilot):
        await press(pilot, "alt+p")
        app.screen.grid.paste("Ivy\tCB\nBo\tFS\n")
        await settled(pilot)
        pasted = app.screen.sheet.texts
        await press(pilot, "ctrl+z")
        return pasted, app.screen.sheet.texts, type(app.screen)

    pasted, after, screen = with_editor(path, script)
    assert pasted == [{"Actor": "Ivy", "chart": "CB"}, {"Actor": "Bo", "chart": "FS"}]
    assert (after, screen) == ([], ActorsDialog)


def test_saving_writes_a_file_that_a_program_can_offer(path):
    async def script(app, pilot):
        await press(pilot, "alt+p", *"Ivy", "tab", *"CB", "enter", "ctrl+s")
        return screen_text(app)

    assert "Saved catch.actors.json." in with_editor(path, script)
    assert json.loads(path.with_name("catch.actors.json").read_text()) == {
        "Defender": [{"name": "Ivy", "id": "Ivy", "chart": "CB"}]
    }


def test_nobody_is_offered_any_more_after_alt_x_in_the_screen_and_in_the_grid(path):
    async def script(app, pilot):
        await press(pilot, "alt+p", *"Ivy", "tab", *"CB", "enter", "escape")
        cast = valid(app)
        await press(pilot, "alt+x")
        cleared = valid(app)
        await press(pilot, "alt+p", "escape")
        again = valid(app)
        await press(pilot, "alt+p", "alt+x", "escape")
        return cast, cleared, again, valid(app)

    cast, cleared, again, nobody = with_editor(path, script)
    assert cast == again == [False, False, True]
    assert cleared == nobody == [True, True, True]


def test_a_file_of_actors_that_cannot_be_read_is_said_and_the_screen_stays_closed(path):
    path.with_name("catch.actors.json").write_text("[1]")

    async def script(app, pilot):
        await press(pilot, "alt+p")
        return said(app), type(app.screen).__name__

    text, screen = with_editor(path, script)
    assert "catch.actors.json" in text
    assert screen == "MainScreen"


def test_a_table_without_roles_says_how_a_role_is_named(tmp_path):
    file = tmp_path / "t.csv"
    file.write_text("Asset,hit\nwalk,True\n")

    async def script(app, pilot):
        await press(pilot, "alt+p")
        return said(app)

    assert "Defender.DepthChart" in with_editor(file, script)


def test_actors_stay_when_another_table_is_looked_at(path):
    path.with_name("other.csv").write_text("Asset,air\nwalk,True\n")

    async def script(app, pilot):
        await press(pilot, "alt+p", *"Ivy", "tab", *"CB", "enter", "escape")
        app.open_table("other")
        await settled(pilot)
        app.open_table("catch")
        await settled(pilot)
        cast = valid(app)
        await press(pilot, "alt+p")
        return cast, app.screen.sheet.texts

    assert with_editor(path, script) == ([False, False, True], [{"Actor": "Ivy", "chart": "CB"}])


def test_why_names_the_actor_whose_fact_is_in_the_way_and_m_mends_the_cell(path):
    async def script(app, pilot):
        await press(pilot, "alt+p", *"Ivy", "tab", *"CB", "enter", "escape", "down", "f12")
        screen = screen_text(app)
        await press(pilot, "m")
        return screen, app.main.session.sheet.text(1, 2), valid(app)

    screen, cell, rows = with_editor(path, script, (110, 24))
    assert "CB of Ivy" in screen
    assert cell == "CB FS"
    assert rows[1]


def test_every_key_of_the_grid_leaves_the_screen_of_actors_whole(path):
    keys = (
        "f6",
        "up",
        "ctrl+n",
        "ctrl+b",
        "ctrl+k",
        "ctrl+d",
        "ctrl+r",
        "alt+s",
        "ctrl+a",
        "delete",
        "alt+delete",
        "alt+shift+right",
    )
    more = ("ctrl+e", "alt+o", "f4", "escape", "ctrl+z", "ctrl+y", "insert", "ctrl+end", "shift+up", "ctrl+x", "ctrl+v", "alt+k")

    async def script(app, pilot):
        await press(pilot, "alt+p", *"Ivy", "enter", *keys, *more)
        return type(app.screen), [c.name for c in app.screen.sheet.table.columns]

    assert with_editor(path, script) == (ActorsDialog, ["Actor", "chart"])
