"""The loudest line says what plays and how many rows are valid; a row that misses by one cell stands out from the others."""

from pathlib import Path

import pytest
from terminal import EditorApp, press, with_editor

from contextdb.cells.words import three_digits
from tui.widgets.bar import CellLine

TOML = '[tables.t]\npolicy = "{policy}"\npriority = "Priority"\nfallback = "idle"\n'


def path_of(folder: Path, policy: str) -> Path:
    (folder / "contextdb.toml").write_text(TOML.format(policy=policy))
    (folder / "t.csv").write_text("Asset,Priority,speed,hit\nwalk,2,0..5,Any\nrun,2,3..10,Any\nfall,1,3..10,True\nlie,1,9,True\n")
    return folder / "t.csv"


def test_without_facts_nothing_is_said(tmp_path: Path) -> None:
    async def script(app: EditorApp, pilot) -> tuple[str, bool]:
        return app.main.query_one(CellLine)._answer

    assert with_editor(path_of(tmp_path, "collect"), script)[0] == ""


def test_rows_that_miss_by_more_than_one_cell_are_dim(tmp_path: Path) -> None:
    async def script(app: EditorApp, pilot) -> list[set[str]]:
        app.main.assets.set_context({"speed": "1", "hit": "False"}, "")
        await press(pilot, "down")
        grid = app.main.assets.grid
        strips = grid.screen._compositor.render_strips()
        colours = []
        for asset in ("run", "lie"):
            strip = next(one for one in strips if f" {asset} " in one.text)
            colours.append({segment.style.color.name for segment in strip if segment.text.strip(" │") and segment.style})
        return colours

    near, far = with_editor(path_of(tmp_path, "collect"), script, (120, 24))
    assert len(near) > len(far) or not near & far


@pytest.mark.parametrize(
    ("sent", "text"),
    [
        ("0.54167881132", "0.542"),
        ("-1.2140326691628", "-1.21"),
        ("123.456789", "123"),
        ("123456.789012", "123457"),
        ("0.000123456", "0.000123"),
        ("0.00000000000000012", "0"),
        ("-1.22e-16", "0"),
        ("1.2345e-05", "0.0000123"),
        ("1.99999", "2"),
        ("0.25", "0.25"),
        ("1.2345, 2", "1.2345, 2"),
        ("v1.23456", "v1.23456"),
    ],
)
def test_a_number_of_a_game_has_three_digits_and_other_texts_are_as_they_are(sent: str, text: str) -> None:
    assert three_digits(sent) == text
