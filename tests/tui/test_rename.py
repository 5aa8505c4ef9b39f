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


def test_a_rename_with_unsaved_edits_asks_to_save_first(folder):
    workspace = Workspace(folder / "a.csv")
    session = workspace.session("a")
    session.sheet.go(0, 0)
    session.sheet.type_text("sprint")
    with pytest.raises(TableError, match="unsaved edits"):
        workspace.rename("a", renaming(session.sheet.table, "speed", "velocity"), {})
    assert texts(folder)["b.csv"] == FILES["b.csv"]
    workspace.close()


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
