"""The Problems tab: findings of the table as it is, errors first, a filter, and the way to the cell."""

import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from threading import Event
from typing import Any

import pytest
from strategies import in_full_runs
from terminal import drive, press, screen_text, settled, with_editor
from textual.app import App, ComposeResult
from textual.pilot import Pilot

import contextdb as cdb
from contextdb.commands.check_command import check_path
from contextdb.covering import Cancelled
from tui.messages import GoToCell, Notice
from tui.model.coverage_lines import in_rows
from tui.model.problems import Problem, Problems, cell_findings, row_findings
from tui.model.sheet import Sheet
from tui.panes import problems
from tui.panes.problems import ProblemsPane
from tui.widgets.find_bar import FilterBar
from tui.widgets.line_list import LineList

TOML = """
[conditions.speed]
type = "number"
min = 0
max = 10

[conditions.gait]
type = "enum"
values = ["Walk", "Run"]
"""
ROWS = 'Asset,speed,gait\nJog,5..3,Walk\nRun,1 to 5,Wlk\n[red]odd[/],0..5,Run\nJog,0..99,Run\n"",0..5,Any\n'


@pytest.fixture
def table(tmp_path: Path) -> cdb.Table:
    (tmp_path / "contextdb.toml").write_text(TOML)
    (tmp_path / "a.csv").write_text(ROWS)
    return cdb.load(tmp_path / "a.csv", strict=False)


class PaneApp(App[None]):
    """The tab alone; what it tells is kept."""

    CSS = "ProblemsPane { height: 1fr; }"

    def __init__(self, table: cdb.Table) -> None:
        super().__init__()
        self.sheet = Sheet(table)
        self.pane = ProblemsPane(self.sheet)
        self.told: list[GoToCell | Notice] = []

    def compose(self) -> ComposeResult:
        yield self.pane

    def on_mount(self) -> None:
        self.pane.take_focus()

    def on_go_to_cell(self, message: GoToCell) -> None:
        self.told.append(message)

    def on_notice(self, message: Notice) -> None:
        self.told.append(message)


def shown(
    table: cdb.Table,
    *keys: str,
    script: Callable[[Pilot[None]], Awaitable[Any]] | None = None,
    size: tuple[int, int] = (100, 18),
) -> tuple[PaneApp, str]:
    app = PaneApp(table)

    async def play(pilot: Pilot[None]) -> str:
        for key in keys:
            await pilot.press(key)
        if script is not None:
            await script(pilot)
        await pilot.pause()
        return screen_text(app)

    return app, drive(app, play, size)


def test_errors_come_first_and_rows_count_from_1_as_in_the_grid(table):
    _, screen = shown(table)
    lines = screen.splitlines()
    assert lines[0].strip() == "4 errors, 1 warning, 1 for information."
    assert lines[2].split() == ["1", "All", "6", "2", "Errors", "4", "3", "Warnings", "1", "4", "Information", "1"]
    assert [line.split()[0] for line in lines[4:10]] == ["▸", "error", "error", "error", "warning", "information"]
    assert lines[4].split()[2:5] == ["1", "Jog", "speed"]


def test_the_detail_has_the_whole_message_and_the_cure(table):
    _, screen = shown(table, "down")
    assert 'Error unreadable-cell: row 2, Run, column "speed"' in screen
    assert 'Did you mean "1..5"?' in screen
    assert "The text of a cell does not follow the grammar of its type." in screen


def test_enter_goes_to_the_cell(table):
    app, _ = shown(table, "down", "down", "enter")
    assert app.told == [GoToCell(1, "gait")]


def test_a_click_goes_to_the_line_and_a_second_one_to_the_cell(table):
    async def click(pilot: Pilot[None]) -> None:
        await pilot.click(LineList, offset=(10, 2))
        assert pilot.app.told == []
        await pilot.click(LineList, offset=(10, 2))

    app, _ = shown(table, script=click)
    assert app.told == [GoToCell(1, "speed")]


@pytest.mark.parametrize(
    ("key", "levels"), [("2", {"error"}), ("3", {"warning"}), ("4", {"info"}), ("1", {"error", "warning", "info"})]
)
def test_a_number_key_shows_one_level(table, key, levels):
    app, _ = shown(table, key)
    assert {p.level for p in app.pane.lines} == levels


def test_brackets_and_clicks_change_the_level(table):
    app, _ = shown(table, "right_square_bracket", "right_square_bracket")
    assert app.pane.level == "warning"

    async def click(pilot: Pilot[None]) -> None:
        await pilot.click("#problems-levels", offset=(14, 0))

    app, _ = shown(table, script=click)
    assert app.pane.level == "error"


def test_an_edit_that_mends_a_cell_takes_its_problem_away(table):
    async def mend(pilot: Pilot[None]) -> None:
        sheet = pilot.app.sheet
        sheet.go(0, 1)
        assert sheet.type_text("3..5") is None
        pilot.app.pane.show()

    app, screen = shown(table, script=mend)
    assert screen.splitlines()[0].strip() == "3 errors, 1 warning, 1 for information."
    assert all(p.row != 0 for p in app.pane.lines if p.level == "error")


def test_a_fact_of_the_test_row_that_cannot_be_read_is_a_problem_too(table):
    async def ask(pilot: Pilot[None]) -> None:
        pilot.app.sheet.query.set("gait", "Wlak")
        pilot.app.pane.show()
        await pilot.pause()
        await pilot.press("home", "enter")

    app, screen = shown(table, script=ask)
    assert "test row" in screen
    assert "5 errors" in screen
    assert "test row" in app.told[0].text


def test_a_sound_table_has_nothing_to_show():
    sound = cdb.Table.from_columns({"Asset": ["A"], "up": ["True"]}, {"up": {"type": "bool"}})
    app, screen = shown(sound, "enter", "down", "end", "4")
    assert "finds nothing wrong with this table" in screen
    assert app.told == []


def test_a_problem_of_the_whole_table_has_no_cell_to_go_to():
    app, _ = shown(cdb.Table.from_columns({"Asset": []}), "enter")
    assert [type(m) for m in app.told] == [Notice]


def test_texts_that_look_like_markup_are_shown_as_they_are(table):
    _, screen = shown(table.with_cell(2, "gait", "[bold]"), "2")
    assert "[red]odd[/]" in screen
    assert '"[bold]"' in screen


def test_rows_that_cause_a_problem_are_named(table):
    found = Problems.of(cell_findings(table), {})
    [twin] = [p for p in found.items if p.rule == "duplicate-asset"]
    assert "(row 1)" in twin.text


@in_full_runs  # a check that ends when it is no longer wanted every day
def test_a_large_table_is_checked_beside_the_keys():
    n_rows = 20_001
    names = [f"b{i}" for i in range(9)]
    columns = {"Asset": [f"A{r}" for r in range(n_rows)]} | {n: ["True"] * n_rows for n in names}
    large = cdb.Table.from_columns(columns, {n: {"type": "bool"} for n in names[:8]})

    async def wait(pilot: Pilot[None]) -> None:
        await pilot.app.workers.wait_for_complete()
        await pilot.pause()

    app, screen = shown(large, script=wait)
    n_found = len(cell_findings(large)) + len(row_findings(large))
    assert screen.splitlines()[0].strip() == "1 warning, 1 for information."
    assert len(app.pane.lines) == n_found


def test_a_check_ends_when_its_table_is_no_longer_wanted(monkeypatch):
    n_rows, ended = 20_001, Event()
    columns = {"Asset": [f"A{r}" for r in range(n_rows)], **{f"b{i}": ["True"] * n_rows for i in range(9)}}
    large = cdb.Table.from_columns(columns, {f"b{i}": {"type": "bool"} for i in range(9)})
    with pytest.raises(Cancelled):
        row_findings(large, lambda: True)

    def for_ever(table, should_stop):
        while not should_stop():
            time.sleep(0.001)
        ended.set()
        raise Cancelled("the computation was stopped.")

    monkeypatch.setattr("tui.panes.problems.row_findings", for_ever)

    async def leave(pilot: Pilot[None]) -> None:
        await pilot.pause()

    shown(large, script=leave)
    assert ended.wait(10)


def test_the_tab_shows_what_the_command_check_finds(tmp_path):
    """Needless rows and saved contexts that fail stand in it, as in the report that a build sees."""
    (tmp_path / "contextdb.toml").write_text(TOML)
    file = tmp_path / "a.csv"
    with (tmp_path / "contextdb.toml").open("a") as toml:
        toml.write('[tables.a]\npolicy = "first"\n')
    file.write_text("Asset,speed,gait\nslow,0..5,Walk\nslower,0..2,Walk\nrun,0..99,Run\n")
    (tmp_path / "a.cases.csv").write_text("Case,Expected,speed,gait\nat rest,run,0,Walk\n")
    reported = check_path(str(file)).findings

    table = cdb.load(file)
    app, screen = shown(table, "end", "home", "enter")
    assert 'row 1 ("slow")' in screen  # and not the line of the file
    assert sorted((f.rule, in_rows(f, table)) for f in reported) == sorted((p.rule, p.message) for p in app.pane.lines)
    assert {"case-failed", "subsumed-row", "beyond-domain"} <= {p.rule for p in app.pane.lines}
    assert app.pane.lines[0].place == "contexts"
    assert "F9" in app.told[0].text


def test_the_filter_on_problems_leaves_the_rows_that_the_tab_names(tmp_path):
    file = tmp_path / "a.csv"
    file.write_text("Asset,up\nall,Any\nhigh,True\n")

    async def script(app, pilot):
        await press(pilot, "alt+5")
        named = {problem.row for problem in app.main.query_one(ProblemsPane).lines if problem.row is not None}
        await press(pilot, "alt+1")
        app.main.assets.post_message(FilterBar.Wanted("", False, False, True))
        await settled(pilot)
        return named, app.main.session.sheet.view.rows.tolist()

    assert with_editor(file, script) == ({0}, [0])


def test_the_rows_of_a_larger_table_are_looked_at_beside_the_keys(table, monkeypatch):
    monkeypatch.setattr(problems, "is_quick", lambda table: False)

    async def wait(pilot: Pilot[None]) -> None:
        await pilot.app.workers.wait_for_complete()
        await pilot.pause()

    app, screen = shown(table, script=wait)
    assert app.pane.is_all
    assert screen.splitlines()[0].strip() == "4 errors, 1 warning, 1 for information."


def test_while_the_rows_are_looked_at_that_is_said(table):
    _, screen = shown(table, script=_half_known)
    assert screen.splitlines()[0].strip() == "4 errors, 1 warning, 1 for information. Looking at the rows …"


def test_while_the_rows_are_looked_at_no_empty_list_says_that_there_is_nothing():
    _, screen = shown(cdb.Table.from_columns({"Asset": ["a"], "up": ["True"]}, {"up": {"type": "bool"}}), "2", script=_half_known)
    assert "Still checking …" in screen
    assert "2 Errors …" in screen
    assert "Nothing" not in screen


async def _half_known(pilot: Pilot[None]) -> None:
    pane = pilot.app.pane
    pane.post_message(pane.Checked(pane.sheet.table, pane._findings, False))
    await pilot.pause()


def test_a_hundred_thousand_problems_are_paged_without_building_their_lines(table, monkeypatch):
    many = Problems(tuple(Problem("error", "unreadable-cell", f"cannot read {i}.", i, f"A{i}", "speed") for i in range(100_000)))
    built: list[Problem] = []

    def line(problem: Problem) -> list[str]:
        built.append(problem)
        return [problem.level, problem.place, problem.asset, "speed", problem.message]

    monkeypatch.setattr(problems, "_line", line)

    async def page(pilot: Pilot[None]) -> None:
        pilot.app.pane.problems = many
        pilot.app.pane._show_all()
        await pilot.press("pagedown", "end", "pageup", "home", "down", "end")

    _, screen = shown(table, script=page)
    assert "100,000 errors." in screen
    assert "cannot read 99999." in screen
    assert len(built) < 500


def test_problems_are_grouped_by_kind_and_mended_all_at_once(tmp_path):
    (tmp_path / "contextdb.toml").write_text('[conditions.speed]\ntype = "number"\n')
    file = tmp_path / "t.csv"
    file.write_text("Asset,speed\n" + "".join(f"a{at},{at};1\n" for at in range(5)) + "b,1..2\n")

    async def script(app, pilot):
        await press(pilot, "alt+5", "2", "g")
        pane = app.main.query_one(ProblemsPane)
        grouped = [problem.message for problem in pane.lines]
        await press(pilot, "m")
        sheet = app.main.session.sheet
        mended = sheet.table.text_column("speed").to_list(), [problem.level for problem in pane.lines]
        sheet.undo()
        return grouped, mended, sheet.table.text_column("speed").to_list()[0]

    grouped, (texts, levels), undone = with_editor(file, script, (100, 30))
    assert len(grouped) == 1
    assert grouped[0].startswith("5 like this: ")
    assert texts == ["0, 1", "1, 1", "2, 1", "3, 1", "4, 1", "1..2"]
    assert levels == []
    assert undone == "0;1"
