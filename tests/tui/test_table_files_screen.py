"""Tables are renamed, copied and deleted in the editor; it goes on with what is there then."""

from pathlib import Path

import pytest
from terminal import EditorApp, press, said, settled


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
