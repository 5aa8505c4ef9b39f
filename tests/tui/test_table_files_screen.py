"""Tables are renamed, copied and deleted in the editor; it goes on with what is there then."""

from pathlib import Path

import pytest
from terminal import EditorApp, press, said, settled, with_editor


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "u.csv").write_text("Asset,speed\n@t,1\n")
    (tmp_path / "t.csv").write_text("Asset,speed\nwalk,1\n")
    return tmp_path / "t.csv"


async def command(app: EditorApp, pilot, name: str, text: str = "") -> None:
    await app.main.run_command(name)
    await settled(pilot)
    if text:
        await press(pilot, "ctrl+a", "delete", *text)
    await press(pilot, "enter")
    await settled(pilot)


def test_a_rename_goes_on_under_the_new_name_and_others_refer_to_it(path: Path) -> None:
    async def script(app: EditorApp, pilot) -> tuple[str, str, list[str]]:
        await command(app, pilot, "rename-table", "walks")
        return app.main.table_name, said(app), sorted(app.workspace.files)

    assert with_editor(path, script) == ("walks", "t is now walks.csv.", ["u", "walks"])
    assert (path.parent / "u.csv").read_text() == "Asset,speed\n@walks,1\n"
    assert not path.exists()


def test_unsaved_edits_are_saved_first(path: Path) -> None:
    async def script(app: EditorApp, pilot) -> tuple[str, str]:
        await press(pilot, *"x", "enter")
        await command(app, pilot, "rename-table", "walks")
        return app.main.table_name, said(app)

    name, text = with_editor(path, script)
    assert name == "t"
    assert "Ctrl+S" in text


def test_a_copy_is_opened_and_a_table_is_deleted_after_a_question(path: Path) -> None:
    async def script(app: EditorApp, pilot) -> tuple[str, str]:
        await command(app, pilot, "duplicate-table")
        copied = app.main.table_name
        await command(app, pilot, "delete-table")
        return copied, app.main.table_name

    assert with_editor(path, script) == ("t_copy", "t")
    assert sorted(one.name for one in path.parent.glob("*.csv")) == ["t.csv", "u.csv"]


def test_a_table_that_others_refer_to_stays(path: Path) -> None:
    async def script(app: EditorApp, pilot) -> str:
        await command(app, pilot, "delete-table")
        return said(app)

    assert "refer" in with_editor(path, script)
    assert path.exists()


def test_with_read_only_no_table_is_renamed_and_no_cell_opens(path: Path) -> None:
    from terminal import alone, drive

    from tui.model.workspace import Workspace

    before = {one.name: one.read_bytes() for one in path.parent.iterdir()}

    async def script(app: EditorApp, pilot) -> list[str]:
        texts = []
        await press(pilot, *"x", "enter")
        texts.append(said(app))
        await command(app, pilot, "rename-table", "walks")
        texts.append(said(app))
        await press(pilot, "ctrl+s")
        return [*texts, said(app)]

    with alone(path.parent):
        app = EditorApp(Workspace(path, reads_only=True))
        edited, renamed, saved = drive(app, lambda pilot: script(app, pilot))
        app.workspace.close()
    assert "Nothing is edited" in edited
    assert "read only" in renamed
    assert "nothing is written" in saved
    assert {one.name: one.read_bytes() for one in path.parent.iterdir()} == before
