"""The dialog that says why a row is not valid, and which rows are nearest."""

from typing import Any

import pytest
from terminal import drive, screen_text
from textual.app import App

from contextdb.tables.table import Table
from tui.model.query_row import QueryRow
from tui.screens.nearest import CellAnswer, NearestDialog

SCHEMA = {"speed": {"type": "number", "unit": "m/s"}, "gait": {"type": "enum", "values": ["Walk", "Run"]}}
ROWS = {"Asset": ["walk", "[red]run", "idle"], "speed": ["0..2", "2..6", "Any"], "gait": ["Walk", "Run", "Walk"]}


class Stage(App[Any]):
    """Shows one dialog, and keeps its answer."""

    def __init__(self, row: int | None, table: Table | None = None, **facts: str) -> None:
        super().__init__()
        table = Table.from_columns(ROWS, SCHEMA) if table is None else table
        query = QueryRow(table)
        query.load(facts)
        self.dialog = NearestDialog(query, table, row)
        self.answer: object = "none yet"

    def on_mount(self) -> None:
        self.push_screen(self.dialog, self.keep)

    def keep(self, answer: object) -> None:
        self.answer = answer


def pressed(app: Stage, *keys: str, size: tuple[int, int] = (80, 24)) -> str:
    async def script(pilot) -> str:
        await pilot.press(*keys)
        await pilot.pause()
        return screen_text(app)

    return drive(app, script, size)


@pytest.mark.parametrize("size", [(80, 24), (160, 48)])
def test_the_row_of_the_cursor_is_told_cell_by_cell(size: tuple[int, int]):
    text = pressed(Stage(0, speed="3", gait="Walk"), size=size)
    assert "✗ Row 1, walk: not valid, 1 cell keeps it from that" in text
    lines = [" ".join(line.strip("│ ").split()) for line in text.splitlines()]
    assert any("✗ fails speed 3 m/s 0..2 0..3" in line for line in lines)
    assert any("✓ holds gait Walk Walk" in line for line in lines)
    assert '"0..3" would also accept it.' in text


def test_a_row_that_is_valid_says_so_and_the_nearest_rows_are_a_key_away():
    app = Stage(2, speed="7", gait="Walk")
    text = pressed(app, "tab")
    assert "◉ Row 3, idle: valid; picked" in text
    text = pressed(Stage(2, speed="7", gait="Walk"))
    assert "1 of 3 rows valid" in text


def test_the_nearest_rows_name_their_assets_as_they_are():
    text = pressed(Stage(None, speed="7", gait="Run"))
    assert "0 of 3 rows valid" in text
    assert text.index("[red]run") < text.index("idle") < text.index("walk  ")
    assert "Row 2, [red]run: speed is 7 m/s; the cell says" in text


def test_enter_goes_to_the_cell():
    app = Stage(0, speed="3", gait="Run")
    pressed(app, "down", "enter")
    assert app.answer == CellAnswer(0, "gait")


@pytest.mark.parametrize("key", ["m", "f4"])
def test_one_key_mends_the_cell(key: str):
    app = Stage(0, speed="3", gait="Run")
    pressed(app, "down", key)
    assert app.answer == CellAnswer(0, "gait", "Walk Run")


def test_the_nearest_rows_can_be_gone_to_and_mended():
    app = Stage(0, speed="7", gait="Run")
    pressed(app, "tab", "m")
    assert app.answer == CellAnswer(1, "speed", "2..7")


def test_a_cell_that_holds_is_not_mended():
    app = Stage(2, speed="3", gait="Walk")
    text = pressed(app, "tab", "m")
    assert "Mend" not in text
    assert app.answer == "none yet"


def test_escape_leaves_without_an_answer():
    app = Stage(0, speed="3")
    pressed(app, "escape")
    assert app.answer is None


def test_a_test_row_that_asks_for_nothing_and_a_fact_that_cannot_be_read_are_told():
    assert "The test row is empty" in pressed(Stage(0))
    assert "The fact speed cannot be read" in pressed(Stage(0, speed="quick", gait="Run"))


def test_a_table_without_rows_has_a_dialog_too():
    table = Table.from_columns({"Asset": [], "speed": []}, SCHEMA)
    assert "Every row is valid." in pressed(Stage(0, table, speed="3"), "enter", "m", "tab")


def test_a_cell_can_be_chosen_by_mouse():
    app = Stage(0, speed="3", gait="Run")

    async def script(pilot) -> None:
        await pilot.click("#nearest-lines", offset=(20, 2))
        await pilot.click("#nearest-lines", offset=(20, 2))
        await pilot.pause()

    drive(app, script)
    assert app.answer == CellAnswer(0, "gait")
