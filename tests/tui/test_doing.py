"""Long work on a sheet: its share is said, Esc stops it, keys wait, and it is one step."""

from collections.abc import Callable
from itertools import count
from pathlib import Path
from threading import Event

import pytest
from terminal import press, said, screen_text, with_editor
from textual.events import Key, Paste

import tui.doing
from tui.messages import Notice
from tui.model.find import Search
from tui.model.long_work import with_progress
from tui.model.sheet import Done, Sheet
from tui.widgets.find_bar import FindBar

TABLE = "Asset,speed,note\nwalk,1..2,x\nrun,3;4,y\njump,5;6,x\n"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "t.csv"
    path.write_text(TABLE)
    (tmp_path / "contextdb.toml").write_text('[conditions.speed]\ntype = "number"\n')
    return path


@pytest.fixture
def is_long(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every verb takes long."""
    monkeypatch.setattr(tui.doing, "LONG", 0)
    monkeypatch.setattr("tui.model.long_work.OFTEN_S", 0.0)


async def ended(app, pilot) -> None:
    await app.workers.wait_for_complete()
    await pilot.pause()


def test_esc_stops_long_work_before_a_cell_is_changed(file, is_long):
    def for_ever(sheet: Sheet) -> Done:
        for _ in with_progress(count(), 1000):
            pass
        return sheet.clear()

    async def script(app, pilot):
        grid, seen = app.main.assets.grid, []
        tui.doing.do(grid, app.main.session.sheet, lambda: for_ever(app.main.session.sheet), 1)
        while "Esc stops it" not in (text := screen_text(app)):
            await pilot.pause()
        seen.append("█ " in text and "%" in text)
        app.post_message(Key("escape", None))
        await ended(app, pilot)
        return seen, said(app), app.main.session.sheet.is_modified

    assert with_editor(file, script) == ([True], "Stopped: no cell was changed.", False)


def test_keys_wait_for_a_long_paste_which_is_one_step(file, is_long):
    async def script(app, pilot):
        app.post_message(Paste("hop\t1\nskip\t2\n"))
        app.post_message(Key("ctrl+z", None))
        app.post_message(Key("ctrl+y", None))
        await ended(app, pilot)
        await press(pilot, "down")
        await pilot.pause()
        return said(app), app.main.session.sheet.table.assets, app.main.session.sheet.history.names

    assert with_editor(file, script) == ("Redo: Paste 2 × 2.", ["hop", "skip", "jump"], ["Paste 2 × 2"])


def test_a_long_copy_says_its_share_and_then_what_was_copied(file, is_long, monkeypatch):
    shares: list[str] = []
    monkeypatch.setattr(tui.doing, "Notice", lambda *told: shares.append(told[0]) or Notice(*told))

    async def script(app, pilot):
        await press(pilot, "ctrl+a", "ctrl+c")
        await ended(app, pilot)
        await press(pilot)
        return said(app), app.main.assets.clipboard.text

    assert with_editor(file, script) == ("Copied 3 × 3.", TABLE.partition("\n")[2].replace(",", "\t"))
    assert shares == ["░░░░░░░░░░░░░░░░░░░░ 0% · Esc stops it"]


def replace_all(app) -> None:
    app.main.assets.post_message(FindBar.Replaced(Search("x"), "z", is_all=True, in_selection=False))


VERBS: dict[str, Callable] = {
    "paste": lambda app: app.main.assets.grid.paste("a\t1\nb\t2\n"),
    "paste a cell over all": lambda app: (app.main.session.sheet.go(0, 1), app.main.assets.grid.paste("7")),
    "fill down": lambda app: app.main.assets.grid.action_verb("fill-down"),
    "clear": lambda app: app.main.assets.grid.action_clear(),
    "mend all": lambda app: app.main.assets.grid.action_verb("mend-all"),
    "replace all": replace_all,
}


@pytest.mark.parametrize("name", VERBS)
def test_what_is_done_beside_the_screen_is_what_is_done_at_once(file, monkeypatch, name):
    async def script(app, pilot):
        app.main.session.sheet.go(0, 1)
        await press(pilot, "shift+down", "shift+down")
        VERBS[name](app)
        await pilot.pause()
        await ended(app, pilot)
        sheet = app.main.session.sheet
        return [column.to_list() for column in sheet.table.columns], said(app), sheet.block, screen_text(app)

    at_once = with_editor(file, script)
    monkeypatch.setattr(tui.doing, "LONG", 0)
    assert with_editor(file, script) == at_once
    assert at_once[0] != [["walk", "run", "jump"], ["1..2", "3;4", "5;6"], ["x", "y", "x"]], "nothing was done"


def test_a_table_that_another_program_changed_meanwhile_is_not_changed(file, is_long):
    async def script(app, pilot):
        sheet, is_changed = app.main.session.sheet, Event()

        def cleared() -> Done:
            is_changed.wait()
            return sheet.clear()

        sheet.go(0, 1)
        tui.doing.do(app.main.assets.grid, sheet, cleared, 1)
        await pilot.pause()
        sheet.type_text("9")
        is_changed.set()
        await ended(app, pilot)
        return "changed meanwhile" in said(app), len(sheet.history.names), sheet.text(0, 1)

    assert with_editor(file, script) == (True, 1, "9")
