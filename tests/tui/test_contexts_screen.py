"""The dialog of the contexts: load, filter, save, rename, delete, open another file."""

import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import polars as pl
import pytest
from terminal import drive, screen_text
from textual.app import App

from contextdb.checks.cases import read_cases
from contextdb.tables.project import load
from contextdb.tables.table import Table
from tui.model.context_list import ContextList
from tui.screens.contexts import ContextsDialog, columns_of, displayed_facts

TOML = """
[conditions.speed]
type = "number"
[conditions.gait]
type = "enum"
values = ["Walk", "Run"]
"""
CASES = 'Case,Expected,Note,speed,gait\nslow,walk,"[bold]why",1,Walk\nfast,walk,,5,Run\n[red]look,,,1,\nodd,walk,,quick,\n'


@pytest.fixture
def table(tmp_path: Path) -> Table:
    (tmp_path / "contextdb.toml").write_text(TOML)
    (tmp_path / "t.csv").write_text("Asset,speed,gait\nwalk,0..2,Walk\nrun,2..6,Run\n")
    (tmp_path / "t.cases.csv").write_text(CASES)
    return load(tmp_path / "t.csv")


class Stage(App[Any]):
    """Shows the dialog, and keeps its answer."""

    def __init__(self, table: Table, facts: Mapping[str, str] | None = None, contexts: ContextList | None = None) -> None:
        super().__init__()
        self.dialog = ContextsDialog(table, facts or {}, contexts)
        self.answer: Any = "none yet"
        self.chosen: int | None = None

    def on_mount(self) -> None:
        self.push_screen(self.dialog, self.keep)

    def keep(self, answer: Any) -> None:
        self.answer = answer


def pressed(app: Stage, *keys: str, size: tuple[int, int] = (80, 24)) -> str:
    async def script(pilot) -> str:
        for key in keys:
            await pilot.press(key)
            if len(app.workers):  # a file is read, or searched
                await app.workers.wait_for_complete()
        await pilot.pause()
        app.chosen = app.dialog.chosen if app.dialog.is_attached else None
        return screen_text(app)

    return drive(app, script, size)


def shown(text: str) -> list[str]:
    """The lines of the screen inside the box, with single spaces."""
    return [" ".join(line.strip(" │").split()) for line in text.splitlines()]


# ---- the list


@pytest.mark.parametrize("size", [(80, 24), (160, 48)])
def test_every_case_says_its_facts_and_whether_it_holds(table: Table, size: tuple[int, int]):
    lines = shown(pressed(Stage(table), size=size))
    for line in ("slow ✓ holds 1 Walk", "fast ✗ fails 5 Run", "[red]look – open 1 ·", "odd ✗ unread quick ·"):
        assert any(line in found for found in lines), line
    assert "t.cases.csv: 4 contexts, 2 of them fail" in lines


def test_a_table_without_cases_says_how_to_save_one(table: Table, tmp_path: Path):
    (tmp_path / "t.cases.csv").unlink()
    app = Stage(table)
    text = pressed(app, "enter", "f2", "f5", "delete")
    assert "No context is saved yet: F6 saves the test row." in text
    assert app.answer == "none yet"


def test_a_context_is_chosen_by_mouse(table: Table):
    app = Stage(table)

    async def script(pilot) -> None:
        await pilot.click("#contexts-lines", offset=(10, 2))
        await pilot.click("#contexts-lines", offset=(10, 2))
        await pilot.pause()

    drive(app, script)
    assert app.answer.contexts.at == 1


# ---- saving


def test_what_the_disk_refuses_is_told_and_nothing_is_lost(table: Table, tmp_path: Path):
    (tmp_path / "t.cases.csv").chmod(0o444)
    assert "the file is marked read-only" in " ".join(shown(pressed(Stage(table), "delete", "y")))
    assert "▸ slow" in pressed(Stage(table), "delete", "y")


# ---- other files


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    rows = 200_000
    frame = pl.DataFrame({"gait": ["Walk", "Run"] * (rows // 2), "speed": np.arange(rows) / 8, "frame": range(rows)})
    frame.write_parquet(tmp_path / "moments.parquet")
    return tmp_path / "moments.parquet"


def test_a_recording_is_opened_by_a_name_that_is_completed(table: Table, recording: Path):
    app = Stage(table)
    text = pressed(app, "f4", *"mo", "tab", "enter", "end")
    assert "moments.parquet: 200,000 contexts" in text
    assert "▸ row 200,000" in text
    assert "speed=24999.875 gait=Run" in shown(text)
    pressed(app := Stage(table, contexts=ContextList.open(recording, table)), "down", "enter")
    assert app.answer.contexts.title == "row 2 (2 of 200,000)"
    assert app.answer.contexts.texts == {"speed": "0.125", "gait": "Run"}


def test_a_recording_is_searched(table: Table, recording: Path):
    app = Stage(table, contexts=ContextList.open(recording, table))
    text = pressed(app, *"speed=24999.")
    assert "filter: speed=24999.▏ 8 found" in text
    assert app.chosen == 199_992


def test_while_a_recording_is_searched_what_was_shown_before_stays(table: Table, recording: Path):
    contexts, may_go_on = ContextList.open(recording, table), threading.Event()
    app, search = Stage(table, contexts=contexts), type(contexts.rows).search

    def held(rows, text):
        may_go_on.wait(60)
        yield from search(rows, text)

    async def script(pilot) -> tuple[list[str], list[str], int | None]:
        before = shown(screen_text(app))
        await pilot.press(*"speed=24999.")
        app.dialog.lines.refresh()
        await pilot.pause()
        during = shown(screen_text(app))
        assert app.dialog.chosen == 0
        may_go_on.set()
        await app.workers.wait_for_complete()
        await pilot.pause()
        return before, during, app.dialog.chosen

    with patch.object(type(contexts.rows), "search", held):
        before, during, chosen = drive(app, script)
    assert during == before
    assert chosen == 199_992


def test_a_moment_of_a_recording_is_saved_among_the_cases_of_the_table(table: Table, recording: Path, tmp_path: Path):
    app = Stage(table, {"speed": "1"}, ContextList.open(recording, table))
    text = pressed(app, "down", "f6", *"moment", "enter")
    assert "▸ row 2" in text
    assert read_cases(tmp_path / "t.cases.csv")[-1].name == "moment"


def test_a_file_that_cannot_be_read_leaves_the_list_as_it_is(table: Table, tmp_path: Path):
    (tmp_path / "bad.parquet").write_bytes(b"PAR1 and nothing more")
    text = pressed(Stage(table), "f4", *"bad", "tab", "enter")
    assert "✗" in shown(text)[2]
    assert "▸ slow" in text


def test_a_recording_that_goes_away_while_it_is_shown_is_told(table: Table, recording: Path):
    contexts = ContextList.open(recording, table)
    recording.unlink()
    app = Stage(table, contexts=contexts)
    assert "there is no such file" in pressed(app, "end", "enter")
    assert app.answer == "none yet"


def test_a_recording_says_how_many_rows_are_valid_and_f3_goes_to_a_moment_without_one(table: Table, tmp_path: Path):
    (tmp_path / "few.csv").write_text("speed,gait\n1,Walk\n1,Walk\n-5,Walk\n1,Walk\n")
    app = Stage(table, contexts=ContextList.open(tmp_path / "few.csv", table))
    text = pressed(app, "f3")
    assert app.chosen == 2
    assert "none" in next(line for line in text.splitlines() if "row 3" in line)
    assert "No further one" in pressed(Stage(table, contexts=ContextList.open(tmp_path / "few.csv", table)), "f3", "f3")


# ---- room


def wide(tmp_path: Path) -> ContextList:
    names = [f"condition_{i}" for i in range(30)]
    (tmp_path / "w.csv").write_text(",".join(["Asset", *names]) + "\nwalk" + ",1..2" * 30 + "\n")
    same = ",".join(["1"] * 29)
    (tmp_path / "w.cases.csv").write_text(",".join(["Case", *names]) + f"\na,{same},1\nb,{same},2\n")
    return ContextList.beside(load(tmp_path / "w.csv"))


def test_facts_that_are_the_same_in_every_case_make_room_for_the_others(tmp_path: Path):
    contexts = wide(tmp_path)
    shown_at_80 = displayed_facts(contexts, 72)
    assert "condition_29" in shown_at_80
    assert len(shown_at_80) < 10
    assert len(displayed_facts(contexts, 1000)) == 30


@pytest.mark.parametrize("width", [30, 60, 80, 100, 160])
def test_the_columns_shown_fit_the_room(tmp_path: Path, width: int):
    contexts = wide(tmp_path)
    columns = columns_of(contexts, displayed_facts(contexts, width))
    assert sum(column.width for column in columns) + 2 * (len(columns) - 1) <= max(width, 19)
