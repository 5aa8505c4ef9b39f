"""The Coverage tab: what it shows of a report, what its keys tell the screen, and what becomes of it after an edit."""

from collections.abc import Awaitable, Callable, Mapping
from importlib import import_module
from threading import Event
from typing import Any

import pytest
from terminal import drive, screen_text
from textual.app import App, ComposeResult
from textual.pilot import Pilot

import contextdb as cdb
from contextdb.covering import Cancelled
from tui.messages import FillGap, GoToCell, Notice, SetContext
from tui.model.coverage_lines import as_typed
from tui.model.coverage_run import CoverageRun, Result
from tui.model.sheet import Sheet
from tui.panes.coverage import CoveragePane
from tui.panes.pair_map import PairMap
from tui.widgets.line_list import LineList

SCHEMA = {
    "gait": {"type": "enum", "values": ["Walk", "Run"]},
    "speed": {"type": "number", "min": 0, "max": 10},
    "up": {"type": "bool"},
}
WAIT_S = 30.0


class PaneApp(App[None]):
    """The tab alone; what it tells is kept."""

    CSS = "CoveragePane { height: 1fr; }"

    def __init__(self, table: cdb.Table, run: CoverageRun | None = None) -> None:
        super().__init__()
        self.sheet, self.run_, self.told = Sheet(table), run or CoverageRun(), []
        self.pane = CoveragePane(self.sheet, self.run_)
        self.gap, self.pair, self.place = 0, None, (0, 0)

    def compose(self) -> ComposeResult:
        yield self.pane

    def on_mount(self) -> None:
        self.pane.take_focus()

    def note(self) -> None:
        """Keep where the cursors are, for after the end."""
        self.gap = self.query_one("#gaps", LineList).index
        self.pair, self.place = self.query_one(PairMap).pair, self.query_one(PairMap).place

    def on_fill_gap(self, message: FillGap) -> None:
        self.told.append(message)

    def on_set_context(self, message: SetContext) -> None:
        self.told.append(message)

    def on_go_to_cell(self, message: GoToCell) -> None:
        self.told.append(message)

    def on_notice(self, message: Notice) -> None:
        self.told.append(message)


def table(**columns: list[str]) -> cdb.Table:
    cells = {"gait": ["Walk", "Run", "Run"], "speed": ["..5", "..4", "..3"], "up": ["Any", "True", "True"]} | columns
    n_rows = len(next(iter(cells.values())))
    return cdb.Table.from_columns({"Asset": [f"Anim_{r}" for r in range(n_rows)]} | cells, SCHEMA)


async def settled(pilot: Pilot[None]) -> None:
    """Wait until nothing runs and everything is shown: the first pause lets a run begin."""
    await pilot.pause()
    pilot.app.run_.join(WAIT_S)
    await pilot.pause()
    await pilot.pause()


def shown(
    script: Callable[[Pilot[None]], Awaitable[Any]] | None = None,
    of: cdb.Table | None = None,
    size: tuple[int, int] = (80, 18),
    keys: tuple[str, ...] = (),
    run: CoverageRun | None = None,
) -> tuple[PaneApp, str]:
    """The app and its screen after some keys, and a script."""
    app = PaneApp(table() if of is None else of, run)

    async def play(pilot: Pilot[None]) -> str:
        if run is None:
            await settled(pilot)
        for key in keys:
            await pilot.press(key)
        await pilot.pause()
        if script is not None:
            await script(pilot)
            await pilot.pause()
        app.note()
        return screen_text(app)

    return app, drive(app, play, size)


def test_a_small_table_is_measured_at_once_and_its_gaps_stand_largest_first():
    _, screen = shown()
    lines = [line.strip() for line in screen.splitlines()]
    assert lines[0] == "35.00 % of the contexts have a valid row (exact)."
    assert lines[3].startswith("1 Gaps 3   2 Pairs   3 Crowded 1   4 Rows 1   5 About")
    assert lines[5].startswith("▸  50.00 %       all  speed: (5..10]")
    assert "Gap 1 of 3: 50.00 % of the contexts" in screen


def test_the_detail_follows_the_cursor_and_shows_the_cell_to_change():
    _, screen = shown(keys=("down",))
    assert "Gap 2 of 3: 30.00 % of the contexts, 5.00 % without the gaps above" in screen
    assert "gait: Run, speed: (4..10]" in screen
    assert "Nearest: row 1 Anim_0, with 2 cells to change: first gait from Walk to Any." in screen


def test_the_one_cell_that_would_close_a_gap_stands_in_its_line():
    _, screen = shown(of=table(gait=["Any", "Any"], speed=["..5", "6.."], up=["Any", "Any"]))
    assert "row 1: speed → <6" in screen
    assert "Nearest: row 1 Anim_0. It would do to change speed from ..5 to <6." in screen


@pytest.mark.parametrize(("size", "seen"), [((80, 24), 24), ((160, 48), 90)])
def test_of_more_than_a_hundred_gaps_the_most_is_seen_and_where_they_are_summed_up(size, seen):
    names = [f"speed_{c}" for c in range(7)]
    cells = {
        name: [f"{(c * r + c) % 9}..{(c * r + c) % 9 + 2}" if (r + c) % 3 else "Any" for r in range(14)]
        for c, name in enumerate(names)
    }
    open_ = cdb.Table.from_columns(
        {"Asset": [f"Anim_{r}" for r in range(14)]} | cells, {key: {"type": "number", "min": 0, "max": 12} for key in names}
    )
    _, screen = shown(of=open_, size=size)
    lines = screen.splitlines()
    assert "100+ gaps (2 by pairs, 6 as played), on average" in lines[1]
    assert "1 Gaps 100+" in lines[3]
    assert lines[4].index("Nearest row") - lines[4].index("Contexts") >= seen
    assert "Gap 1 of 100+: " in screen
    assert lines[1].rstrip().endswith("rows valid")


def test_enter_on_a_gap_asks_for_a_new_row_of_its_cells():
    app, _ = shown(keys=("enter",))
    assert app.told == [FillGap({"speed": "(5..10]"}, below=0)]


def test_a_gap_with_open_ends_is_filled_with_a_cell_as_people_write_it():
    free = cdb.Table.from_columns({"Asset": ["a"], "speed": ["0.5..3"]}, schema={"speed": {"type": "number"}})
    app, screen = shown(of=free, keys=("enter",))
    assert app.told == [FillGap({"speed": "<0.5 | >3"}, below=0)]
    assert "speed: <0.5 | >3" in screen
    assert [as_typed(cell) for cell in ("..0.5) | (3..4]", "(3..", "-5..5", "..x)")] == ["<0.5 | (3..4]", ">3", "-5..5", "..x)"]


def test_t_asks_for_a_context_in_the_gap_for_which_no_row_is_valid():
    app, _ = shown(keys=("down", "t"))
    [message] = app.told
    assert message == SetContext({"gait": "Run", "speed": "7"}, "gap 2")
    assert not app.sheet.table.compile().query({"gait": "Run", "speed": 7.0}, unknown="any")


@pytest.mark.parametrize("seed", range(3))
def test_every_gap_of_a_table_gives_a_context_without_a_valid_row(seed):
    columns = {
        "gait": ["Walk" if (seed + r) % 2 else "Run" for r in range(4)],
        "speed": [f"{(seed * r) % 7}..{(seed * r) % 7 + 2}" for r in range(4)],
        "up": ["True" if r % 3 == seed % 3 else "Any" for r in range(4)],
    }
    app, _ = shown(of=table(**columns), keys=("t", "down") * 6)
    contexts = [m.facts for m in app.told if isinstance(m, SetContext)]
    assert len(contexts) == 6
    for facts in contexts:
        assert not app.sheet.table.compile().query(read(facts, app.sheet.table), unknown="any")


def read(facts: Mapping[str, str], of: cdb.Table) -> dict[str, object]:
    """Facts as values, those that are left out missing."""
    from contextdb.cells.facts import read_fact_text

    return {c.condition.name: read_fact_text(facts.get(c.condition.name, ""), c.condition) for c in of.conditions}


def test_pairs_show_the_least_covered_combination_and_enter_opens_the_pair():
    app, screen = shown(keys=("2",))
    assert "least covered, %" in screen
    assert "gait with speed" in screen
    assert "no row accepts this" in screen
    app, screen = shown(keys=("2", "enter", "right"))
    assert app.pair == (1, 0)
    assert "speed \\ gait" in screen
    assert "speed: 0..3, gait: Run" in screen
    assert "Of its contexts 50.00 % have a valid row. It is 15.00 % of all contexts." in screen
    assert "2 rows can be valid here; some row names it explicitly." in screen


def test_escape_goes_back_from_a_pair_to_all_pairs():
    app, screen = shown(keys=("2", "right", "enter", "escape"))
    assert app.pair is None
    assert app.place == (0, 2)
    assert "gait with up" in screen


def test_t_on_a_square_tries_a_context_of_it():
    app, _ = shown(keys=("2", "enter", "t"))
    [message] = app.told
    assert message.facts.keys() == {"gait", "speed"}
    assert message.name == "slice"


def test_crowded_contexts_name_the_rows_that_are_valid_at_once():
    app, screen = shown(keys=("3", "enter"))
    assert "2 rows at once in 7.50 % of the contexts: row 2 Anim_1, row 3 Anim_2." in screen
    assert app.told == [GoToCell(1)]


def test_rows_that_are_too_many_are_listed_and_enter_goes_there():
    app, screen = shown(keys=("4", "enter"))
    assert "shares contexts: variety" in screen
    assert 'row 2 Anim_1: row 3 ("Anim_2") is valid only where this row is valid too.' in screen
    assert app.told == [GoToCell(1)]


def test_the_last_section_says_how_the_numbers_are_known():
    unbounded = cdb.Table.from_columns({"Asset": ["A"], "speed": ["0..5"]}, {"speed": {"type": "number"}})
    _, screen = shown(of=unbounded, keys=("5",))
    assert "The covered share is exact." in screen
    assert "speed is not fully declared: ..0) counts 2.5" in screen


def test_sections_turn_with_brackets_and_are_clicked():
    app, _ = shown(keys=("right_square_bracket", "right_square_bracket"))
    assert app.pane.section == 2
    app, _ = shown(keys=("left_square_bracket",))
    assert app.pane.section == 6

    async def click(pilot: Pilot[None]) -> None:
        await pilot.click("#coverage-sections", offset=(16, 0))

    app, _ = shown(click)
    assert app.pane.section == 1


class Held:
    """A run that waits until it is stopped."""

    def __init__(self) -> None:
        self.begun, self.never = Event(), Event()

    def __call__(self, of, tell, should_stop) -> Result:
        tell("Counting contexts", 0.42)
        self.begun.set()
        while not should_stop():
            self.never.wait(0.005)
        raise Cancelled("stopped")


def test_a_large_table_waits_to_be_asked_and_tells_its_progress_and_escape_stops_it():
    held = Held()
    run = CoverageRun(held)
    names = [f"b{i}" for i in range(30)]
    large = cdb.Table.from_columns({"Asset": ["A"] * 60} | {n: ["True"] * 60 for n in names})

    async def play(pilot: Pilot[None]) -> None:
        assert "R works it out (60 rows, 30 conditions)" in screen_text(pilot.app)
        await pilot.press("r")
        assert held.begun.wait(WAIT_S)
        await pilot.pause()
        assert "Counting contexts … 42 %\n  █████████████░░░░░░░░░░░░░░░░░  Esc stops" in screen_text(pilot.app)
        await pilot.press("escape")

    _, screen = shown(play, of=large, run=run)
    assert run.state == "none"
    assert "R works it out" in screen


@pytest.mark.parametrize("section", ["1", "3", "4"])
def test_while_contexts_are_counted_no_list_says_that_there_is_nothing(section):
    held = Held()
    run = CoverageRun(held)
    large = cdb.Table.from_columns({"Asset": ["A"] * 60} | {f"b{i}": ["True"] * 60 for i in range(30)})
    seen = []

    async def play(pilot: Pilot[None]) -> None:
        await pilot.press(section)
        seen.append(screen_text(pilot.app))
        await pilot.press("r")
        assert held.begun.wait(WAIT_S)
        await pilot.pause()
        seen.append(screen_text(pilot.app))
        await pilot.press("escape")

    shown(play, of=large, run=run)
    assert "Not counted yet: R counts." in seen[0]
    assert "  Counting …" in seen[1]
    assert not any(word in text for text in seen for word in ("No gap", "Nowhere", "No row was found"))


def test_after_an_edit_a_large_report_is_called_stale_and_r_renews_it():
    names = [f"b{i}" for i in range(9)]
    columns = {"Asset": ["A"] * 100} | {n: ["True"] * 100 for n in names}
    large = cdb.Table.from_columns(columns, {n: {"type": "bool"} for n in names})

    async def play(pilot: Pilot[None]) -> None:
        await pilot.press("r")
        await settled(pilot)
        assert "0.20 % of the contexts" in screen_text(pilot.app)
        pilot.app.sheet.go(0, 1)
        pilot.app.sheet.type_text("Any")
        pilot.app.pane.show()
        await pilot.pause()
        assert "The table has changed since. R measures it again." in screen_text(pilot.app)
        await pilot.press("r")
        await settled(pilot)

    _, screen = shown(play, of=large)
    assert "0.39 % of the contexts have a valid row (exact)." in screen


def test_after_an_edit_a_small_table_is_measured_again_by_itself():
    async def play(pilot: Pilot[None]) -> None:
        pilot.app.sheet.go(0, 2)
        pilot.app.sheet.type_text("Any")
        pilot.app.pane.show()
        await settled(pilot)

    _, screen = shown(play)
    assert "60.00 % of the contexts have a valid row (exact)." in screen


def test_a_row_that_is_gone_is_not_gone_to():
    async def play(pilot: Pilot[None]) -> None:
        await pilot.press("4")
        app = pilot.app
        app.run_.cancel()
        for _ in range(2):
            app.sheet.go(app.sheet.table.n_rows - 1, 0)
            app.sheet.delete_rows()
        app.run_.follow(app.sheet.table)
        await pilot.press("enter")

    app, _ = shown(play)
    assert [m.level for m in app.told] == ["warning"]


def test_a_gap_over_a_condition_that_is_gone_is_not_filled():
    async def play(pilot: Pilot[None]) -> None:
        app = pilot.app
        app.sheet.go(0, 2)
        app.sheet.delete_columns()
        app.run_.follow(app.sheet.table)
        await pilot.press("enter")

    app, _ = shown(play)
    assert [(type(m), m.level) for m in app.told] == [(Notice, "warning")]
    assert '"speed" is not a condition any more' in app.told[0].text


def test_a_table_with_unreadable_cells_says_why_it_cannot_be_measured(tmp_path):
    (tmp_path / "a.csv").write_text("Asset,speed\nA,1 to [red]\nB,1..2\n")
    (tmp_path / "contextdb.toml").write_text('[conditions.speed]\ntype = "number"\n')
    _, screen = shown(of=cdb.load(tmp_path / "a.csv", strict=False))
    assert "Coverage cannot be worked out." in screen
    assert "1 to [red]" in screen.replace("\n", " ")


def test_texts_that_look_like_markup_are_shown_as_they_are():
    odd = cdb.Table.from_columns({"Asset": ["[red]"], "[bold]x[/]": ["True"]}, {"[bold]x[/]": {"type": "bool"}})
    _, screen = shown(of=odd)
    assert "[bold]x[/]: False" in screen
    _, screen = shown(of=odd, keys=("2",))
    assert "1 [bold]x[/]" in screen


@pytest.mark.parametrize("columns", [{"Asset": []}, {"Asset": ["A"]}, {"Asset": [], "gait": [], "up": []}])
def test_a_table_without_rows_or_conditions_has_a_screen_for_every_section(columns):
    keys = tuple(key for section in "12345" for key in (section, "down", "t", "end"))
    _, screen = shown(of=cdb.Table.from_columns(columns, SCHEMA), keys=keys)
    assert "% of the contexts have a valid row" in screen


@pytest.mark.parametrize("size", [(40, 10), (80, 18), (160, 42)])
def test_no_line_is_wider_than_the_screen_and_long_cells_end_in_an_ellipsis(size):
    names = [f"condition_with_a_long_name_{i}" for i in range(6)]
    wide = cdb.Table.from_columns({"Asset": ["An_asset_with_a_long_name"]} | {n: ["True"] for n in names})
    _, screen = shown(of=wide, size=size)
    assert all(len(line) <= size[0] for line in screen.splitlines())
    assert ("…" in screen.split("The nearest rows")[0]) == (size[0] == 40)


def test_a_long_name_is_cut_in_the_middle_in_the_list_and_whole_in_the_detail():
    names = ["ActivateDiveAtMidAirHigh", "ActivateDiveAtMidAirGround"]
    long = cdb.Table.from_columns({"Asset": ["A"]} | {n: ["True"] for n in names}, {n: {"type": "bool"} for n in names})
    _, screen = shown(of=long, size=(60, 18))
    assert "ActivateD…dAirHigh: False" in screen
    assert "ActivateD…irGround: False" in screen
    assert "ActivateDiveAtMidAirGround: False" in screen
    _, screen = shown(of=long, size=(120, 18))
    assert "ActivateD…" not in screen


def test_the_cursor_is_seen_without_colour():
    app, screen = shown(keys=("down", "down"))
    assert app.gap == 2
    assert [line[:1] for line in screen.splitlines()[5:8]] == [" ", " ", "▸"]


def test_pairs_of_too_many_conditions_are_left_out_and_the_tab_says_what_the_command_says(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(import_module("contextdb.covering.pairs"), "MOST_CONDITIONS", 2)
    said = "Pairs of conditions are not compared: the table has 3 conditions, and at most 2 are."
    for section in ("2", "5"):
        app, screen = shown(keys=(section,), size=(100, 30))
        assert said in screen
        assert app.run_.result is not None
        assert app.run_.result.pairs is None
