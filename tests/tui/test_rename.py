"""Renaming a column whose condition others use: it asks, and both answers leave a project that is whole."""

from __future__ import annotations

import pytest
from terminal import press, said, screen_text, with_editor
from test_renaming import FAMILY, FILES, family, family_now, texts, write

from contextdb.edits.renaming import renaming
from contextdb.errors import TableError
from tui.model.workspace import Workspace


async def rename(pilot, name: str) -> None:
    """Rename the column `speed` of the table, up to the question."""
    pilot.app.main.assets.action_rename_column()
    await press(pilot, "ctrl+u", *name, "enter")


@pytest.fixture
def folder(tmp_path):
    return write(tmp_path)


def test_a_rename_that_would_fork_a_condition_asks_and_escape_changes_nothing(folder):
    async def script(app, pilot):
        await press(pilot, "right")
        await rename(pilot, "velocity")
        question = screen_text(app)
        await press(pilot, "escape")
        return question, app.main.session.sheet.is_modified

    question, is_modified = with_editor(folder / "a.csv", script, (100, 24))
    assert "speed is used by 1 table, 1 derived fact, 2 assumptions, 1 contract," in question
    assert "Rename everywhere" in question
    assert "Only here" in question
    assert not is_modified
    assert texts(folder)["contextdb.toml"] == FILES["contextdb.toml"]


@pytest.mark.parametrize(("keys", "toml"), [(("enter",), 1), (("down", "enter"), 2)])
def test_a_rename_is_written_at_once_keeps_the_test_row_and_says_how_to_take_it_back(folder, keys, toml):
    async def script(app, pilot):
        app.workspace.session("a").sheet.query.load({"speed": "5", "target": "1"})
        app.workspace.session("b").sheet.query.load({"speed": "5"})
        await press(pilot, "right")
        await rename(pilot, "velocity")
        await press(pilot, *keys)
        sheet = app.main.session.sheet
        found = said(app), sheet.query.texts, sheet.query.n_valid, sheet.is_modified
        assert sheet.cursor == (0, 1)
        now = texts(folder)
        await press(pilot, "ctrl+z", "ctrl+z")
        nothing = said(app)
        await press(pilot, "ctrl+y", "ctrl+z")
        return found, said(app), now, nothing

    (told, facts, n_valid, is_modified), undone, now, nothing = with_editor(folder / "a.csv", script)
    assert nothing == "There is nothing to undo."
    assert {name: text for name, text in texts(folder).items() if name in FILES} == FILES
    assert told.startswith("Renamed speed to velocity")
    assert "Ctrl+Z takes it back" in told
    assert (facts, n_valid, is_modified) == ({"velocity": "5", "target": "1"}, 1, False)
    assert undone == "Undo: Rename speed to velocity."
    assert now["contextdb.toml"].count("[conditions.speed]") == toml - 1
    assert ("velocity" in now["b.csv"]) == (toml == 1)


def test_a_rename_with_unsaved_edits_asks_to_save_first(folder):
    workspace = Workspace(folder / "a.csv")
    session = workspace.session("a")
    session.sheet.go(0, 0)
    session.sheet.type_text("sprint")
    with pytest.raises(TableError, match="unsaved edits"):
        workspace.rename("a", renaming(session.sheet.table, "speed", "velocity"), {})
    assert texts(folder)["b.csv"] == FILES["b.csv"]
    workspace.close()


def test_a_column_that_nothing_else_names_is_renamed_as_one_step(folder):
    async def script(app, pilot):
        await press(pilot, "right", "right")
        await rename(pilot, "gap")
        after = [c.name for c in app.main.session.sheet.table.columns]
        await press(pilot, "ctrl+z")
        return after, [c.name for c in app.main.session.sheet.table.columns]

    after, undone = with_editor(folder / "a.csv", script)
    assert (after[2], undone[2]) == ("gap", "closing")


def test_a_rename_in_the_base_carries_an_open_variant_and_projects_that_extend_and_is_one_step(tmp_path):
    studio = family(tmp_path) / "studio"

    async def script(app, pilot):
        assert app.workspace.session("boss").sheet.table.condition("speed").condition.name == "speed"
        await press(pilot, "right")
        await rename(pilot, "pace")
        question = screen_text(app)
        await press(pilot, "enter")
        message, names = said(app), [c.condition.name for c in app.workspace.session("boss").sheet.table.conditions]
        now = family_now(tmp_path)
        await press(pilot, "ctrl+z")
        return question, message, names, now, [c.condition.name for c in app.workspace.session("boss").sheet.table.conditions]

    question, message, names, now, undone = with_editor(studio / "human.csv", script, (120, 30))
    assert "2 extending projects" in question
    assert "../game/moves.csv" in message
    assert "pace" in names
    assert "speed" not in names
    assert "speed" in undone
    assert "pace" in now["far/all.csv"]
    assert family_now(tmp_path) == FAMILY
