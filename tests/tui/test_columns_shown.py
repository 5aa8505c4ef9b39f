"""Columns that are hidden, folded to a group, or frozen: what is seen, where the cursor goes, and that the file stays as it is."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from terminal import press, with_editor

from tui.model.layout import layout
from tui.model.session import Session
from tui.model.visible_columns import VisibleColumns, columns_path, prefix_of, read_columns

NAMES = ["Asset", "Defender.Depth", "Defender.Facing", "gait", "Catcher.Depth", "Defender.Late"]
RAW = ",".join(NAMES) + "\na,CB,True,Walk,1,x\nb,FS,Any,Run,2,y\n"


def seen(shown: VisibleColumns) -> list[str]:
    return [name for name, is_hidden in zip(NAMES, shown.are_hidden(NAMES, "Asset"), strict=True) if not is_hidden]


def test_a_folded_group_shows_its_first_column_only():
    folded = VisibleColumns().folded_at("Defender.Facing")
    assert seen(folded) == ["Asset", "Defender.Depth", "gait", "Catcher.Depth"]
    assert folded.folded_at("Defender.Depth") == VisibleColumns()
    assert VisibleColumns().folded_at("gait") == VisibleColumns()


def test_where_the_first_of_a_group_is_hidden_the_next_one_is_seen():
    shown = VisibleColumns(frozenset(["Defender.Depth"]), frozenset(["Defender."]))
    assert seen(shown) == ["Asset", "Defender.Facing", "gait", "Catcher.Depth"]


def test_a_hidden_column_is_revealed_and_the_assets_are_never_hidden():
    shown = VisibleColumns().turned("gait").turned("Asset")
    assert "gait" not in seen(shown)
    assert "Asset" in seen(shown)
    assert seen(shown.revealed("gait")) == NAMES


def test_columns_are_frozen_up_to_one_or_up_to_the_assets():
    assert VisibleColumns().n_frozen(NAMES, "Asset") == 1
    assert VisibleColumns(frozen="gait").n_frozen(NAMES, "Asset") == 4
    assert VisibleColumns(frozen="gone").n_frozen(NAMES, "Asset") == 1


@pytest.mark.parametrize(("name", "prefix"), [("Defender.Depth", "Defender."), ("gait", None), ("a.b.c", "a.")])
def test_the_prefix_of_a_column_ends_with_its_first_point(name, prefix):
    assert prefix_of(name) == prefix


@given(st.lists(st.sampled_from([0, 8, 20]), min_size=1, max_size=15), st.integers(30, 120), st.data())
def test_a_hidden_column_takes_no_place_and_none_is_found_there(widths, width, data):
    made = layout([10, *widths], 1, 9, width)
    shown = [at for at, w in enumerate(made.widths) if w]
    column = data.draw(st.sampled_from(shown))
    scroll = made.scroll_to(column, 0)
    assert made.total == made.gutter + sum(made.widths[at] + 1 for at in shown)
    first = max(made.place(column, scroll), made.gutter + (made.frozen if column >= made.n_frozen else 0))
    if first < width:
        assert made.column_at(first, scroll) == column


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "t.csv"
    file.write_text(RAW)
    return file


def test_problems_go_to_a_hidden_column_and_show_it(path):
    async def script(app, pilot):
        await press(pilot, "right", "right", "right", "alt+0", "home")
        app.main.assets.go_to(1, "gait")
        await press(pilot)
        return app.main.session.sheet.cursor

    assert with_editor(path, script) == (1, 3)


def test_what_is_hidden_folded_and_frozen_is_kept_for_the_next_time(path):
    wanted = VisibleColumns(frozenset(["gait"]), frozenset(["Defender."]), "Defender.Depth")
    session = Session(path)
    session.sheet.show_columns(wanted)
    session.close()
    again = Session(path)
    kept, cursor = again.sheet.visible_columns, again.sheet.cursor
    again.sheet.show_columns(VisibleColumns())
    again.close()
    assert (kept, cursor) == (wanted, (0, 0))
    assert not columns_path(path).exists()
    assert path.read_text() == RAW


@pytest.mark.parametrize("raw", [b"no", b"[]", b'{"hidden": 3}', b"\xff"])
def test_a_file_of_kept_columns_that_is_none_hides_nothing(path, raw):
    columns_path(path).parent.mkdir()
    columns_path(path).write_bytes(raw)
    assert read_columns(path) == VisibleColumns()
