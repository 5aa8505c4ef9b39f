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
from textual.events import Paste
from textual.widgets import Input

from contextdb.checks.cases import read_cases
from contextdb.tables.project import load
from contextdb.tables.table import Table
from tui.model.context_list import ContextList
from tui.screens.contexts import ContextsDialog, Loaded, columns_of, displayed_facts

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


def test_the_chosen_context_is_told_in_full(table: Table):
    lines = shown(pressed(Stage(table)))
    assert lines.index("[bold]why") < lines.index("✓ It holds; 1 row valid.") < lines.index("Expected: walk")
    lines = shown(pressed(Stage(table), "down"))
    assert '✗ "walk" should be valid and is not; "run" should not be valid and is.' in lines
    assert "speed=5 gait=Run" in lines
    assert any("quick" in line and "cannot be evaluated" in line for line in shown(pressed(Stage(table), "end")))


def test_enter_gives_back_the_list_standing_on_the_context(table: Table):
    app = Stage(table)
    pressed(app, "down", "enter")
    assert isinstance(app.answer, Loaded)
    assert (app.answer.contexts.title, app.answer.contexts.texts) == ("fast (2 of 4)", {"speed": "5", "gait": "Run"})


def test_the_list_that_is_stepped_through_opens_where_it_stands_and_is_judged_anew(table: Table):
    contexts = ContextList.beside(table)
    contexts.go(1)
    app = Stage(table.with_cell(0, "speed", "4..9"), contexts=contexts)
    text = pressed(app)
    assert app.chosen == 1
    assert "3 of them fail" in text


def test_escape_leaves_without_an_answer(table: Table):
    app = Stage(table)
    pressed(app, "escape")
    assert app.answer is None


def test_letters_filter_and_backspace_and_escape_take_them_back(table: Table):
    app = Stage(table)
    text = pressed(app, *"run")
    assert "filter: run▏ 1 found" in text
    assert app.chosen == 1
    text = pressed(Stage(table), *"walk 5")
    assert "1 found" in text
    assert "No context has this text." in pressed(Stage(table), *"zz")
    assert "▸ slow" in pressed(Stage(table), *"zz", "backspace", "backspace")
    app = Stage(table)
    assert "filter:" not in pressed(app, *"zz", "escape")
    assert app.answer == "none yet"


def test_a_context_that_was_filtered_for_is_loaded(table: Table):
    app = Stage(table)
    pressed(app, *"look", "enter")
    assert app.answer.contexts.title == "[red]look (3 of 4)"


def test_a_table_without_cases_says_how_to_save_one(table: Table, tmp_path: Path):
    (tmp_path / "t.cases.csv").unlink()
    app = Stage(table)
    text = pressed(app, "enter", "f2", "f5", "delete")
    assert "No context is saved yet: F6 saves the test row." in text
    assert app.answer == "none yet"


def test_a_file_of_cases_that_cannot_be_read_is_told(table: Table, tmp_path: Path):
    (tmp_path / "t.cases.csv").write_text("Name,speed\na,1\n")
    assert 'there is no column "Case"' in pressed(Stage(table))


def test_a_context_is_chosen_by_mouse(table: Table):
    app = Stage(table)

    async def script(pilot) -> None:
        await pilot.click("#contexts-lines", offset=(10, 2))
        await pilot.click("#contexts-lines", offset=(10, 2))
        await pilot.pause()

    drive(app, script)
    assert app.answer.contexts.at == 1


# ---- saving


def test_the_test_row_is_saved_with_the_assets_that_are_valid_now(table: Table, tmp_path: Path):
    app = Stage(table, {"speed": "5", "gait": ""})
    text = pressed(app, "f6", *"new", "enter")
    assert '✓ "new" is saved.' in text
    assert app.chosen == 4
    case = read_cases(tmp_path / "t.cases.csv")[-1]
    assert (case.name, dict(case.facts), case.expected) == ("new", {"speed": "5"}, "run")


def test_what_is_expected_may_be_nothing_or_written(table: Table, tmp_path: Path):
    pressed(Stage(table, {"speed": "5"}), "f6", *"one", "tab", "up", "enter", "tab", "tab", *"note", "enter")
    pressed(
        Stage(table, {"speed": "5"}), "f6", *"two", "tab", "tab", "end", "backspace", "backspace", "backspace", *"+run", "enter"
    )
    found = {case.name: (case.expected, case.note) for case in read_cases(tmp_path / "t.cases.csv")}
    assert (found["one"], found["two"]) == (("", "note"), ("+run", ""))


def test_a_name_is_wanted_and_a_name_that_is_taken_is_told(table: Table, tmp_path: Path):
    assert "✗ Enter a name." in pressed(Stage(table), "f6", "enter")
    assert "Written over: there is a context of this name." in pressed(Stage(table), "f6", *"fast")
    assert (tmp_path / "t.cases.csv").read_text() == CASES


def test_an_expectation_that_cannot_be_read_is_not_saved(table: Table, tmp_path: Path):
    text = pressed(Stage(table, {"speed": "5"}), "f6", *"x", "tab", "tab", "home", *'"', "enter")
    assert "a double quote is unpaired" in " ".join(shown(text))
    assert (tmp_path / "t.cases.csv").read_text() == CASES


def test_a_test_row_with_a_fact_that_cannot_be_read_is_saved_only_to_be_looked_at(table: Table, tmp_path: Path):
    app = Stage(table, {"speed": "quick"})
    text = pressed(app, "f6", *"bad")
    assert "The valid assets cannot be determined" in text
    pressed(Stage(table, {"speed": "quick"}), "f6", *"bad", "enter")
    assert read_cases(tmp_path / "t.cases.csv")[-1].expected == ""


def test_a_case_is_saved_anew_in_its_place_with_what_it_expects(table: Table, tmp_path: Path):
    text = pressed(Stage(table, {"speed": "1.5"}), "f5", "enter")
    assert '"slow" is saved' in text
    first = read_cases(tmp_path / "t.cases.csv")[0]
    assert (first.name, dict(first.facts), first.expected, first.note) == ("slow", {"speed": "1.5"}, "walk", "[bold]why")


def test_a_case_is_renamed(table: Table, tmp_path: Path):
    text = pressed(Stage(table), "down", "f2", "end", *"er", "enter")
    assert '"fast" is "faster" now.' in text
    assert [case.name for case in read_cases(tmp_path / "t.cases.csv")][1] == "faster"
    assert "There is a context of this name already." in pressed(Stage(table), "f2", *["backspace"] * 4, *"odd", "enter")


def test_a_case_is_deleted_after_a_question(table: Table, tmp_path: Path):
    text = pressed(Stage(table), "down", "delete")
    assert 'Delete "fast" from t.cases.csv?' in text
    pressed(Stage(table), "down", "delete", "escape")
    pressed(Stage(table), "down", "delete", "n")
    assert (tmp_path / "t.cases.csv").read_text() == CASES
    assert '"fast" is deleted.' in pressed(Stage(table), "down", "delete", "y")
    assert [case.name for case in read_cases(tmp_path / "t.cases.csv")] == ["slow", "[red]look", "odd"]


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


def test_the_file_may_be_chosen_in_the_list(table: Table, tmp_path: Path):
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "other.cases.csv").write_text("Case,speed\nalone,1\n")
    text = pressed(Stage(table), "f4", "down", "up", "enter", "enter")
    assert "other.cases.csv: 1 context, none fails" in text


@pytest.mark.parametrize(
    ("typed", "said"),
    [("none.csv", "There is no such file."), ("contextdb.toml", "Contexts are in .csv, .parquet, .jsonl files.")],
)
def test_a_file_that_cannot_be_meant_is_refused_at_once(table: Table, typed: str, said: str):
    async def script(pilot) -> str:
        await pilot.press("f4")
        pilot.app.screen.query_one(Input).value = typed
        await pilot.press("enter")
        await pilot.pause()
        return screen_text(pilot.app)

    assert said in drive(Stage(table), script)


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


def test_a_text_that_is_pasted_filters(table: Table):
    app = Stage(table)

    async def script(pilot) -> str:
        app.dialog.lines.post_message(Paste("walk\r5"))
        await pilot.pause()
        return screen_text(app)

    assert "filter: walk 5▏ 1 found" in drive(app, script)
