"""What one should know of an import is shown whole, to read through, where it is more than a line."""

from pathlib import Path

from terminal import press, screen_text, with_editor

from tui.screens.remarks import RemarksDialog

REMARKS = [f"column {n} is of another type than its condition" for n in range(1, 31)]


def test_remarks_are_scrolled_through_to_the_last_and_left_with_escape(tmp_path: Path):
    path = tmp_path / "t.csv"
    path.write_text("Asset,speed\nwalk,0..2\n")

    async def script(app, pilot):
        app.push_screen(RemarksDialog("Import moves.csv", REMARKS))
        await press(pilot)
        first = screen_text(app)
        await press(pilot, "end")
        last = screen_text(app)
        await press(pilot, "escape")
        return first, last, isinstance(app.screen, RemarksDialog)

    first, last, is_open = with_editor(path, script)
    assert "Import moves.csv" in first
    assert f"· {REMARKS[0]}" in first
    assert REMARKS[-1] not in first
    assert f"· {REMARKS[-1]}" in last
    assert not is_open
