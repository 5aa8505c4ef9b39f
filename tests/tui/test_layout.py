"""Where columns stand: every one can be reached, and what stands at a place is what was put there."""

import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from rich.cells import cell_len

from contextdb.columns import TextColumn
from tui.model.alignment import indent_of, indented, shared_end
from tui.model.layout import JOINER, NARROWEST, WIDEST, Layout, cut, cut_middle, fitted_width, layout, name_lines, name_width


@st.composite
def layouts(draw: st.DrawFn) -> Layout:
    widths = draw(st.lists(st.integers(NARROWEST, WIDEST), min_size=1, max_size=30))
    return layout(widths, draw(st.integers(0, min(3, len(widths)))), draw(st.integers(0, 10**6)), draw(st.integers(16, 200)))


def room(made: Layout) -> int:
    """How many cells are left for the columns that scroll."""
    return made.width - made.gutter - made.frozen


def furthest(made: Layout) -> int:
    return max(made.extent - made.width, 0)


@given(layouts(), st.data())
def test_scrolling_to_a_column_shows_it_as_whole_as_may_be(made, data):
    column = data.draw(st.integers(0, len(made.widths) - 1))
    assume(room(made) > 0)
    scroll = made.scroll_to(column, data.draw(st.integers(0, furthest(made))))
    first = made.place(column, scroll)
    assert first >= made.gutter + (made.frozen if column >= made.n_frozen else 0)
    if column >= made.n_frozen and made.widths[column] <= room(made):
        assert first + made.widths[column] <= made.width


@given(layouts(), st.data())
def test_no_column_is_further_than_one_can_scroll(made, data):
    column = data.draw(st.integers(0, len(made.widths) - 1))
    start = data.draw(st.integers(0, furthest(made)))
    assert 0 <= made.scroll_to(column, start) <= furthest(made)


@given(layouts(), st.data())
def test_scrolling_by_keys_begins_at_a_columns_first_cell(made, data):
    scroll, begins = 0, {at - made.frozen for at in made.starts[made.n_frozen :]}
    for column in data.draw(st.lists(st.integers(0, len(made.widths) - 1), min_size=1, max_size=20)):
        scroll = made.scroll_to(column, scroll)
        assert scroll in begins


@given(layouts(), st.data())
def test_the_column_at_a_place_is_the_one_that_stands_there(made, data):
    scroll = data.draw(st.integers(0, furthest(made)))
    for column in made.visible(scroll):
        first = max(made.place(column, scroll), made.gutter + made.frozen)
        for x in range(first, min(made.place(column, scroll) + made.widths[column] + 1, made.width)):
            assert made.column_at(x, scroll) == column
    for column in range(made.n_frozen):
        assert made.column_at(made.place(column, scroll), scroll) == column


@given(layouts(), st.data())
def test_all_that_stands_in_the_window_is_visible(made, data):
    scroll = data.draw(st.integers(0, furthest(made)))
    left, right = made.gutter + made.frozen, made.width
    assume(right > left)
    seen = {
        column
        for column in range(made.n_frozen, len(made.widths))
        if made.place(column, scroll) < right and made.place(column, scroll) + made.widths[column] >= left
    }
    assert seen <= set(made.visible(scroll))


@given(layouts(), st.data())
def test_a_separator_is_where_a_column_ends(made, data):
    column = data.draw(st.integers(0, len(made.widths) - 1))
    scroll = made.scroll_to(column, 0)
    end = made.place(column, scroll) + made.widths[column]
    assume(column < made.n_frozen or made.gutter + made.frozen <= end)
    assert made.separator_at(end, scroll) == column
    assert made.separator_at(end - 1, scroll) is None


def test_a_separator_that_is_scrolled_behind_the_frozen_columns_is_not_there():
    made = layout([10, 10, 10, 10], 1, 9, 30)
    assert made.separator_at(made.place(1, 12) + made.widths[1], 12) is None


@given(layouts())
def test_frozen_columns_take_at_most_half_of_the_window(made):
    assert made.frozen <= max((made.width - made.gutter) // 2, 0)


@given(st.integers(5, 40), st.integers(0, 3))
def test_every_column_can_be_scrolled_to_in_the_narrowest_windows(width, n_frozen):
    made = layout([10, 8, 6, 30, 6], n_frozen, 5, width)
    for column in range(5):
        assert column < made.n_frozen or column in made.visible(made.scroll_to(column, 0))


@pytest.mark.parametrize(("n_rows", "gutter"), [(0, 4), (9, 4), (10, 5), (100_000, 9)])
def test_the_gutter_is_as_wide_as_the_largest_row_number(n_rows, gutter):
    assert layout([10], 1, n_rows, 80).gutter == gutter


@given(st.text(max_size=40), st.integers(1, 30))
@example("日本語", 4)
@example("a\u0301bc", 3)
@example("👩‍👩‍👧 family", 6)
@example("\u202eright to left", 10)
def test_a_text_is_cut_to_exactly_so_many_cells(text, width):
    shown = cut(text, width)
    assert cell_len(shown) == width
    assert shown.replace(JOINER, "").isprintable()


@pytest.mark.parametrize(
    ("text", "shown"),
    [("a\nb", "a⏎b  "), ("a\r\nb", "a⏎⏎b "), ("a\tb", "a⇥b  "), ("\x1b[31m", "�[31m"), ("too long", "too …"), ("日本語", "日本…")],
)
def test_what_a_terminal_would_obey_is_shown_by_signs(text, shown):
    assert cut(text, 5) == shown


def test_a_text_with_a_right_to_left_override_does_not_turn_the_line_round():
    assert "\u202e" not in cut("\u202eabc", 10)


def test_no_cell_at_all_holds_nothing():
    assert cut("abc", 0) == ""


def test_a_column_is_as_wide_as_its_longest_text_within_bounds():
    assert fitted_width(TextColumn.of("a", ["x" * 10]), ["a"]) == 12
    assert fitted_width(TextColumn.of("a", ["x"]), ["a"]) == NARROWEST
    assert fitted_width(TextColumn.of("a", ["x" * 500]), ["a"]) == WIDEST
    assert fitted_width(TextColumn.of("a", ["日本語日本"]), ["a"]) == 12
    assert fitted_width(TextColumn.of("a", []), ["a longer name"]) == 15


@pytest.mark.parametrize(
    ("name", "width", "lines"),
    [
        ("ActivateDiveAtMidAirHigh", 9, ("Activate", "DiveAtMid", "AirHigh")),
        ("Defender.MidAir_Contesting", 10, ("Defender.", "MidAir_", "Contesting")),
        ("dir_to_tackle_target_future_pos", 17, ("dir_to_tackle_", "target_future_pos")),
        ("speed", 12, ("speed",)),
    ],
)
def test_a_name_is_parted_at_its_joints_and_capitals(name, width, lines):
    assert name_lines(name, width) == lines


@given(st.from_regex(r"[A-Za-z_.]{1,60}", fullmatch=True))
def test_a_name_is_whole_in_the_least_width_that_it_needs(name):
    lines = name_lines(name, name_width(name))
    assert "".join(lines) == name
    assert len(lines) <= 3


@given(st.text(min_size=1, max_size=80), st.integers(5, 30))
def test_no_line_of_a_name_is_wider_than_its_column(name, width):
    lines = name_lines(name, width)
    assert len(lines) <= 3
    assert all(cell_len(line) <= width for line in lines)


def test_names_that_differ_at_their_end_still_differ_when_they_are_cut():
    assert cut_middle("MidAir_Tackle_Dive_High_Left_D1_v1", 21) == "MidAir_Tac…Left_D1_v1"
    assert cut_middle("D3_Contested_MidAir_V1_ScenarioController", 21, 19) == "D3_Contest…MidAir_V1…"


def test_frozen_columns_take_a_third_where_not_all_columns_are_seen():
    assert layout([50, 30, 30], 1, 9, 160).widths[0] == 50
    assert layout([50, 10, 10, 10, 10], 1, 9, 80).widths[0] == 24


def test_the_points_of_numbers_are_below_each_other():
    column = TextColumn.of("a", ["2.5000, 5.0000", "-20.0000, 9.9900", "Any", ">8", "..5"])
    indent = indent_of(column)
    assert [indented(text, indent) for text in column.texts] == ["  2.5000, 5.0000", "-20.0000, 9.9900", "Any", " >8", "..5"]


def test_the_end_that_all_texts_have_in_common_is_found():
    assert shared_end(TextColumn.of("a", ["V1_Controller", "V2_Controller", ""])) == len("_Controller")
    assert shared_end(TextColumn.of("a", ["V1_x", "V2_x"])) == 0
    assert shared_end(TextColumn.of("a", ["V1_Controller"])) == 0


def test_several_frozen_columns_share_half_of_the_window_and_none_vanishes_for_another():
    wide = [18] * 10
    assert layout([18, 17, *wide], 2, 9, 80).widths[:2] == (18, 17)
    assert layout([30, 20, *wide], 2, 9, 80).widths[:2] == (18, 18)
    assert layout([30, 7, *wide], 2, 9, 80).widths[:2] == (29, 7)
    assert layout(wide, 2, 9, 0).n_frozen == 0  # before the window has a size


def test_a_table_that_is_seen_whole_is_no_wider_than_itself_so_that_no_scroll_bar_stays():
    assert layout([20, 10], 1, 30, 80).extent == layout([20, 10], 1, 30, 79).extent
