"""Text for a terminal: widths, columns, colour, and progress that never touches the data."""

import io
import os
import sys
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb import console
from contextdb.console import aligned, output, printable, progress, styled, terminal_width, wants_colour, width_of


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """A usual terminal, and no wishes about colour."""
    for name in ("NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")


# ---- colour


@pytest.mark.parametrize(
    ("environment", "on_terminal", "elsewhere"),
    [
        ({}, True, False),
        ({"NO_COLOR": "1"}, False, False),
        ({"NO_COLOR": ""}, True, False),
        ({"FORCE_COLOR": "1"}, True, True),
        ({"FORCE_COLOR": "1", "NO_COLOR": "1"}, False, False),
        ({"TERM": "dumb"}, False, False),
        ({"TERM": "dumb", "FORCE_COLOR": "1"}, True, True),
    ],
)
def test_colour_is_for_terminals_that_can_unless_told_otherwise(
    monkeypatch: pytest.MonkeyPatch, environment: dict[str, str], on_terminal: bool, elsewhere: bool
):
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert wants_colour(Terminal()) is on_terminal
    assert wants_colour(io.StringIO()) is elsewhere


def test_a_style_wraps_the_text_and_ends_after_it():
    assert styled("no", "red", True) == "\x1b[31mno\x1b[0m"
    assert styled("no", "red", False) == "no"
    assert styled("", "red", True) == ""


# ---- widths and columns


@given(st.text(max_size=40))
def test_printable_text_moves_no_cursor_and_is_left_alone_a_second_time(text: str):
    shown = printable(text)
    assert shown.isprintable()
    assert printable(shown) == shown
    assert all(unicodedata.category(c) not in ("Cc", "Cf", "Cs", "Zl", "Zp") for c in shown)
    if text.isprintable():
        assert shown == text


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\x1b[31m", "\\x1b[31m"),
        ("a\nb", "a\\nb"),
        ("\u202eabc", "\\u202eabc"),
        ("\udc80", "\\udc80"),
        ("läuft → 走", "läuft → 走"),
    ],
)
def test_what_would_move_the_cursor_is_escaped(text: str, shown: str):
    assert printable(text) == shown


@pytest.mark.parametrize(("text", "width"), [("abc", 3), ("走る", 4), ("e\u0301", 1), ("", 0), ("ﾊﾝｶｸ", 4)])
def test_the_width_of_a_text_is_counted_in_cells_of_the_terminal(text: str, width: int):
    assert width_of(text) == width


@given(st.integers(1, 4).flatmap(lambda n: st.lists(st.lists(st.text(max_size=12), min_size=n, max_size=n), max_size=6)))
def test_columns_start_at_the_same_cell_on_every_line(rows: list[list[str]]):
    marked = [[f"[{cell}]" for cell in row] for row in rows]
    lines = list(aligned(marked))
    assert len(lines) == len(rows)
    for column in range(len(rows[0]) if rows else 0):
        starts = set()
        for row, line in zip(marked, lines, strict=True):
            clean = [printable(cell) for cell in row]
            at = 0
            for cell in clean[:column]:
                at = line.index(cell, at) + len(cell)
            starts.add(width_of(line[: line.index(clean[column], at)]))
        assert len(starts) == 1


def test_columns_may_stand_to_the_right_and_lines_have_no_blanks_at_the_end():
    assert list(aligned([("n", "name"), ("10", "走"), ("9", "")], right=(0,), indent="  ")) == ["   n  name", "  10  走", "   9"]
    assert list(aligned([])) == []


def test_the_terminal_is_100_cells_wide_where_there_is_none(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("COLUMNS", "72")
    assert terminal_width() == 72
    monkeypatch.delenv("COLUMNS")
    monkeypatch.setattr(sys, "__stdout__", io.StringIO())
    assert terminal_width() == 100


# ---- output and progress


def test_a_broken_pipe_ends_the_output_and_not_the_command(monkeypatch: pytest.MonkeyPatch):
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w", encoding="utf-8") as stream:
        monkeypatch.setattr(sys, "stdout", stream)
        with output():
            print("nobody reads this" * 10_000)
        print("and this goes nowhere", flush=True)
    assert stream.closed


def test_output_lets_other_errors_through():
    with pytest.raises(ZeroDivisionError), output():
        raise ZeroDivisionError


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The seconds that go by between two looks at the clock."""
    now, step = [0.0], [0.1]

    def look() -> float:
        now[0] += step[0]
        return now[0]

    monkeypatch.setattr(console, "monotonic", look)
    return step


def test_progress_passes_everything_on_and_prints_nothing_where_no_terminal_is(
    capsys: pytest.CaptureFixture[str], clock: list[float]
):
    clock[0] = 10.0
    assert list(progress(range(5), "counting")) == [0, 1, 2, 3, 4]
    assert capsys.readouterr() == ("", "")


def test_work_that_is_soon_done_has_no_progress_bar(monkeypatch: pytest.MonkeyPatch, clock: list[float]):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    assert list(progress(range(4), "counting")) == [0, 1, 2, 3]
    assert terminal.getvalue() == ""


@pytest.mark.parametrize("seconds", [0.2, 10.0])
def test_progress_of_long_work_goes_to_standard_error_alone(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, clock: list[float], seconds: float
):
    clock[0] = seconds
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    assert list(progress(range(7), "counting")) == list(range(7))
    assert list(progress([], "counting")) == []
    assert capsys.readouterr().out == ""
    assert "counting" in terminal.getvalue()
    assert "100%" in terminal.getvalue()
