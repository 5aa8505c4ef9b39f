"""Screens of every size: nothing fails, and what matters most is still seen."""

import shutil
from pathlib import Path

import pytest
from strategies import IS_FULL, some
from terminal import press, screen_text, settled, with_editor

TABLES = Path(__file__).parent.parent.parent / "tables"
SIZES = ((20, 8), (200, 60), (33, 11), (80, 24), (3, 2), (1, 1), (60, 14), (80, 24))
FEW_SIZES = ((33, 11), (1, 1), (100, 30), (80, 24))
SCENES = {
    "grid": (),
    "cell editor": ("right", "right", "right", "f2"),
    "list": ("right", "f4"),
    "refused": ("right", "right", "right", "x", "enter"),
    "test row": ("f6",),
    "find": ("ctrl+f",),
    "filter": ("ctrl+l",),
    "contexts": ("f9",),
    "why": ("f8", "down", "f12"),
    "options": ("alt+2",),
    "priorities": ("alt+3",),
    "coverage": ("alt+4",),
    "pairs": ("alt+4", "2"),
    "problems": ("alt+5",),
    "add column": ("alt+c",),
    "help": ("f1",),
    "steps": ("x", "enter", "alt+z"),
    "go to": ("ctrl+g",),
    "tables": ("ctrl+o",),
    "leaving": ("x", "enter", "ctrl+q"),
    "palette": ("ctrl+p",),
}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return Path(shutil.copytree(TABLES, tmp_path / "tables", ignore=shutil.ignore_patterns("clips", ".*"))) / "hit_mid_air.csv"


@pytest.mark.parametrize("scene", some(SCENES, 3))
def test_a_screen_that_is_made_smaller_and_larger_stays_what_it_is(path, scene):
    async def script(app, pilot):
        await press(pilot, *SCENES[scene])
        app.main.coverage.join()
        await settled(pilot)
        before = screen_text(app).splitlines()
        is_of = type(app.screen), type(app.focused)
        for size in SIZES if IS_FULL else FEW_SIZES:
            await pilot.resize_terminal(*size)
            await settled(pilot)
        return before, screen_text(app).splitlines(), is_of, (type(app.screen), type(app.focused))

    before, after, was, now = with_editor(path, script, paints=True)
    assert (after[0], after[-1], len(after)) == (before[0], before[-1], len(before))
    assert now == was


@pytest.mark.parametrize("command", some(["actors", "contexts", "import", "export"], 4))
def test_a_dialog_with_few_lines_is_no_higher_than_they_need(path, command):
    async def script(app, pilot):
        await app.main.run_command(command)
        await pilot.pause()
        return app.screen.query_one("#dialog").size.height

    file = path.with_name("contested_catch.csv") if command == "actors" else path
    assert [with_editor(file, script, size) <= most for size, most in (((120, 36), 24), ((160, 48), 24), ((80, 24), 22))] == [
        True
    ] * 3


@pytest.mark.parametrize(
    ("width", "said"), [(30, "8 of 12 rows valid"), (16, "8 of 12 valid"), (12, "8 of 12"), (7, "8/12"), (4, "8")]
)
def test_how_many_rows_are_valid_is_never_cut_however_narrow_the_assets_are(tmp_path, width, said):
    file = tmp_path / "t.csv"
    file.write_text("Asset,hit\n" + "".join(f"a{at},{at < 8}\n" for at in range(12)))

    async def script(app, pilot):
        app.main.assets.set_context({"hit": "True"}, "")
        app.main.assets.grid.set_width(0, width)
        await pilot.pause()
        return next(line for line in screen_text(app).splitlines() if line.startswith("?") or line.startswith(" ?"))

    assert with_editor(file, script, (80, 24)).split("│")[0].removeprefix("  ?").strip(" ?") == said


def test_autofit_leaves_columns_without_texts_as_wide_as_they_were(tmp_path):
    file = tmp_path / "t.csv"
    file.write_text("Asset,ActivateDiveAtMidAirHigh,ActivateDiveAtMidAirLow\n" + "a,,True\nb,,False\n")

    async def script(app, pilot):
        grid = app.main.assets.grid
        before = grid.grid_layout.widths[:3]
        grid.autofit()
        return before, grid.grid_layout.widths[:3]

    before, after = with_editor(file, script, (50, 24))
    assert (after[1], after[2] > before[2]) == (before[1], True)
