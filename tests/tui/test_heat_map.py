"""The heat map: squares that never round to 0 or 100, labels that stay, a cursor that is seen without colour."""

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len
from terminal import drive, screen_text
from textual.app import App, ComposeResult
from textual.pilot import Pilot

from tui.widgets.fitted import bar, fitted
from tui.widgets.heat_map import HeatMap, Square, short_percent


class MapApp(App[None]):
    """A map alone."""

    CSS = "HeatMap { height: 1fr; }"

    def __init__(self, rows: Sequence[str], columns: Sequence[str], most_wide: int = 5) -> None:
        super().__init__()
        self.labels = rows, columns, most_wide
        self.moved: list[tuple[int, int]] = []
        self.chosen: list[tuple[int, int]] = []

    def compose(self) -> ComposeResult:
        yield HeatMap()

    def on_mount(self) -> None:
        rows, columns, most_wide = self.labels
        found = self.query_one(HeatMap)
        found.show(
            rows, columns, lambda r, c: Square((r * 10 + c) / 100, (r * 10 + c) / 100, (r * 10 + c) / 100), (0, 0), most_wide
        )
        found.focus()

    def on_heat_map_moved(self, message: HeatMap.Moved) -> None:
        self.moved.append((message.row, message.column))

    def on_heat_map_chosen(self, message: HeatMap.Chosen) -> None:
        self.chosen.append((message.row, message.column))


def played(app: MapApp, *keys: str, size: tuple[int, int] = (40, 8), click: tuple[int, int] | None = None) -> str:
    async def play(pilot: Pilot[None]) -> str:
        for key in keys:
            await pilot.press(key)
        if click:
            await pilot.click(HeatMap, offset=click)
        await pilot.pause()
        return screen_text(app)

    return drive(app, play, size)


NAMES = [f"name{i}" for i in range(10)]
NUMBERS = [str(i) for i in range(10)]


def test_numbers_stand_in_the_squares_and_the_chosen_one_in_brackets():
    screen = played(MapApp(NAMES[:3], NUMBERS[:3]), "down", "right")
    assert screen.splitlines()[:4] == [
        "             0        1        2",
        "name0        0        1        2",
        "name1       10      [11]      12",
        "name2       20       21       22",
    ]
    assert screen.splitlines()[5].split()[:5] == ["0", "<20", "<40", "<60", "<80"]


@pytest.mark.parametrize(
    ("square", "text", "level"),
    [
        (Square(None), "·", "none"),
        (Square(0.0, 0.0, 0.0), "0", "empty"),
        (Square(1.0, 1.0, 1.0), "100", "full"),
        (Square(0.999, 0.999, 0.999), ">99", "step-4"),
        (Square(0.001, 0.001, 0.001), "<1", "step-0"),
        (Square(0.5, 0.5, 0.5), "50", "step-2"),
        (Square(0.0, 0.0, 0.031), "<4", "step-0"),
        (Square(1.0, 0.969, 1.0), ">96", "step-4"),
        (Square(0.42, 0.3, 0.6), "42", "step-2"),
    ],
)
def test_a_square_says_0_or_100_only_where_that_is_known(square, text, level):
    assert (square.text, square.level) == (text, level)


@given(st.floats(0.0, 1.0))
def test_a_short_percentage_is_0_or_100_only_where_the_share_is(share):
    text = short_percent(share)
    assert (text == "0") == (share == 0.0)
    assert (text == "100") == (share == 1.0)
    assert len(text) <= 3


def test_the_legend_is_whole_beside_long_labels():
    screen = played(MapApp(["a_label_of_many_letters" * 3], NUMBERS[:3]), size=(60, 8))
    assert "100  % covered" in screen


def test_without_colour_the_less_is_covered_the_brighter_is_the_square(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("NO_COLOR", "1")

    async def script(pilot: Pilot[None]) -> list[int]:
        strips = pilot.app.screen._compositor.render_strips()
        legend = next(strip for strip in strips if "<20" in "".join(segment.text for segment in strip))
        grounds = [
            s.style.bgcolor
            for s in legend
            if s.style and s.style.bgcolor and s.text.strip() in ("0", "<20", "<40", "<60", "<80", "<100", "100")
        ]
        return [ground.get_truecolor().red for ground in grounds]

    shades = drive(MapApp(NAMES, NUMBERS), script, (80, 16))
    assert len(shades) == 7
    assert sorted(set(shades), reverse=True) == shades


def test_arrows_stay_on_the_map_and_tell_each_square():
    app = MapApp(NAMES, NUMBERS)
    played(app, "up", "left", "down", "right", "end", "pagedown", "pagedown", "pagedown", "home")
    assert app.moved[-1] == (9, 0)
    assert (0, 0) in app.moved
    assert (1, 9) in app.moved


def test_a_map_that_is_too_wide_scrolls_under_its_labels():
    screen = played(MapApp(NAMES, NUMBERS), "end", "down", "down", "down", "down", "down", "down", "down", "down", size=(30, 6))
    lines = screen.splitlines()
    assert "name8" in screen
    assert "name0" not in screen
    assert lines[0].rstrip().endswith("9")
    assert "[89]" in screen


def test_enter_and_a_second_click_choose_a_square():
    app = MapApp(NAMES, NUMBERS)
    played(app, "right", "enter")
    assert app.chosen == [(0, 1)]
    app = MapApp(NAMES, NUMBERS)
    played(app, click=(13, 2))
    assert app.moved[-1] == (1, 1)
    assert app.chosen == []
    app = MapApp(NAMES, NUMBERS)
    played(app, click=(7, 1))
    assert app.chosen == [(0, 0)]


def test_a_click_on_a_label_or_beside_the_map_changes_nothing():
    for place in ((2, 2), (10, 0), (38, 1), (10, 7)):
        app = MapApp(NAMES[:3], NUMBERS[:3])
        played(app, click=place)
        assert set(app.moved) == {(0, 0)}
        assert app.chosen == []


def test_columns_are_as_wide_as_their_labels_where_there_is_room():
    wide = played(MapApp(["a"], ["0..0.9)", "0.9..1.8", "a very long label"], 14), size=(60, 4))
    assert "0..0.9)" in wide
    assert "a very long …" in wide
    narrow = played(MapApp(["a"], ["0..0.9)", "0.9..1.8", "a very long label"], 14), size=(24, 4))
    assert "a ver…" in narrow


def test_a_map_without_squares_is_empty_and_takes_keys():
    app = MapApp([], [])
    played(app, "down", "end", "enter", "pagedown")
    assert (app.moved, app.chosen) == ([], [])


@given(st.text(max_size=30), st.integers(0, 20), st.booleans())
def test_a_fitted_text_takes_just_its_width_and_no_control_character(text, width, to_right):
    found = fitted(text, width, to_right)
    assert cell_len(found) == width
    assert all(c.isprintable() for c in found)


def test_what_is_cut_ends_in_an_ellipsis_and_wide_characters_take_two_cells():
    assert fitted("abcdef", 4) == "abc…"
    assert fitted("abc", 4) == "abc "
    assert fitted("abc", 4, True) == " abc"
    assert fitted("跳跃动画", 5) == "跳跃…"


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.integers(2, 60))
def test_a_bar_is_empty_or_full_only_where_the_share_is(one, other, width):
    lower, upper = sorted((one, other))
    drawn = bar(lower, upper, width)
    assert len(drawn) == width
    assert ("█" in drawn) == (lower > 0.0)
    assert (drawn == "█" * width) == (lower == 1.0)
    assert ("░" in drawn) == (upper < 1.0)
