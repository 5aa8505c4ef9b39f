"""Before a save the editor lists the moments in which something else may play, and nothing else."""

from pathlib import Path

import numpy as np
import pytest
from terminal import EditorApp, press, said, screen_text, settled, with_editor

import contextdb as cdb
from contextdb.edits import edits
from contextdb.tables.project import load_table
from tui.model.changed_moments import changed_moments

TOML = '[conditions.speed]\ntype = "number"\nmin = 0\nmax = 10\n[tables.t]\npolicy = "first"\nfallback = "idle"\n'


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text(TOML)
    (tmp_path / "t.csv").write_text("Asset,speed\nwalk,0..5\nrun,3..10\n")
    (tmp_path / "t.cases.csv").write_text("Case,speed,Expected\nslow,1,walk\nmiddle,4,\nfast,9,run\nbetween,2..6,\nodd,x,\n")
    return tmp_path / "t.csv"


def test_the_moments_that_change_are_those_in_which_another_asset_may_play(path: Path) -> None:
    before = load_table(path)
    after = edits.set_cells(before, [(0, "speed", "0..2")]).apply(before)
    changes = changed_moments(before, after, path.parent)
    listed = {moment.where: (moment.before, moment.after) for moment in changes.moments}
    assert listed == {"middle": ("walk", "run")}
    assert changes.summary == "1 of 5 saved contexts play something else."


def test_recorded_moments_are_listed_with_the_file_and_a_recording_that_cannot_be_read_is_counted(path: Path) -> None:
    with cdb.link("game", record=path.with_name("play.jsonl")) as link:
        link.watch(compiled := cdb.load(path).compile(), "player")
        for speed in (1.0, 4.0, 9.0, 2.5):
            compiled.query({"speed": speed})
    path.with_name("broken.jsonl").write_text("no\n")
    before = load_table(path)
    changes = changed_moments(before, edits.set_cells(before, [(0, "speed", "0..2")]).apply(before), path.parent)
    recorded = [one for one in changes.moments if one.where.startswith("play.jsonl")]
    assert [(one.facts["speed"], one.before, one.after) for one in recorded] == [("2.5", "walk", "idle"), ("4", "walk", "run")]
    assert "2 of 4 recorded moments play something else. 1 recording cannot be read." in changes.summary


def test_what_is_listed_is_what_asking_both_tables_gives(path: Path) -> None:
    rng = np.random.default_rng(3)
    (path.parent / "t.cases.csv").write_text("Case,speed\n" + "".join(f"c{i},{i / 4}\n" for i in range(41)))
    before = load_table(path)
    for _ in range(20):
        cells = [(row, "speed", "..".join(map(str, sorted(rng.integers(0, 11, 2).tolist())))) for row in (0, 1)]
        after = edits.set_cells(before, cells).apply(before)
        plays = [
            [(one.query({"speed": i / 4}).assets or ["idle"])[0] for i in range(41)] for one in (before.compile(), after.compile())
        ]
        expected = {f"c{i}": pair for i, pair in enumerate(zip(*plays, strict=True)) if pair[0] != pair[1]}
        listed = {one.where: (one.before, one.after) for one in changed_moments(before, after, path.parent).moments}
        assert listed == expected


def test_the_dialog_lists_them_and_enter_loads_one_into_the_test_row(path: Path) -> None:
    async def script(app: EditorApp, pilot) -> tuple[str, dict[str, str]]:
        await press(pilot, "right", *"0..2", "enter")
        await app.main.run_command("changes")
        await settled(pilot)
        text = screen_text(app)
        await press(pilot, "enter")
        return text, dict(app.main.session.sheet.query.texts)

    text, facts = with_editor(path, script, (120, 36))
    assert "1 of 5 saved contexts play something else." in text
    assert "middle" in text
    assert facts == {"speed": "4"}


def test_without_an_edit_nothing_changes(path: Path) -> None:
    async def script(app: EditorApp, pilot) -> str:
        await app.main.run_command("changes")
        await settled(pilot)
        text = screen_text(app)
        await press(pilot, "enter", "escape")
        return text + said(app)

    assert "No moment changes." in with_editor(path, script)
