"""The grid: what is painted, where the cursor goes, and that no table and no window is too odd for it."""

from itertools import product
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.style import Style
from saved_bytes import bytes_for
from strategies import examples, some
from terminal import press, screen_text, with_editor
from textual.strip import Strip

from contextdb.columns import TextColumn
from contextdb.schema.settings import Schema, TableSettings, conditions_from_dict
from contextdb.tables.table import Table
from tui.commands import GRID
from tui.model.layout import layout
from tui.model.sheet import Sheet
from tui.model.views import Filter, Sort
from tui.widgets.grid_paint import Look, Painter

SCHEMA = {"speed": {"type": "number", "unit": "m/s"}, "hit": {"type": "bool"}, "gait": {"type": "enum", "values": ["Walk", "Run"]}}
ROWS = {
    "Asset": ["walk", "run", "jump"],
    "speed": ["0..2", "Any", "5; 9"],
    "hit": ["True", "Any", "False"],
    "gait": ["Walk", "Run", ""],
    "Enabled": ["True", "True", "False"],
}
TABLES = {
    "ordinary": "Asset,speed,hit\nwalk,0..2,True\nrun,2..6,Any\njump,Any,False\n",
    "empty": "Asset,speed,hit\n",
    "one_column": "Asset\nwalk\nrun\n",
    "one_cell": "Asset\nwalk\n",
    "last_asset": "speed,hit,gait,Asset\n0..2,True,Walk,walk\n",
    "wide_texts": "Asset,text\n日本語のアセット,👩‍👩‍👧 emoji\n\u05e9\u05dc\u05d5\u05dd,\u202eabc\n" + "x" * 5000 + ",y\n",
    "controls": 'Asset,speed\n"zwei\nZeilen",5; 9\n"tab\tstop",\x1b[31mred\n[red]markup[/],[/]\n',
    "many_columns": ",".join(["Asset", *(f"c{i}" for i in range(300))]) + "\n" + ",".join(["walk", *["Any"] * 300]) + "\n",
}


def painter_of(sheet: Sheet) -> Painter:
    """A painter whose styles name their ground and what stands on it."""
    return Painter(sheet, lambda ground, meant: Style.from_meta({"ground": ground, "meant": meant}))


def sheet_of(columns: dict[str, list[str]] = ROWS, enabled: str | None = "Enabled") -> Sheet:
    """A sheet of texts that need not be readable."""
    declared = Schema(conditions=conditions_from_dict({n: SCHEMA[n] for n in SCHEMA if n in columns}))
    texts = [TextColumn.of(name, values) for name, values in columns.items()]
    return Sheet(Table.build("t", texts, declared, TableSettings("t", enabled=enabled if enabled in columns else None)))


def look_of(sheet: Sheet, width: int = 80, height: int = 26, **more: object) -> Look:
    made = layout([10] * sheet.shape[1], 1, sheet.table.n_rows, width)
    seen = {"left": 0, "top": 0, "is_in_test_row": False, "has_focus": True} | more
    return Look(made, height, **seen)


def text_of(strip: Strip) -> str:
    return "".join(segment.text for segment in strip)


def lines(sheet: Sheet, **more: object) -> list[str]:
    look, painter = look_of(sheet, **more), painter_of(sheet)
    return [text_of(painter.line(y, look)).rstrip() for y in range(look.height)]


def parts(strip: Strip) -> list[tuple[str, str, str]]:
    """Text, ground and meaning of each segment."""
    return [
        (segment.text.strip(), segment.style.meta["ground"], segment.style.meta["meant"])
        for segment in strip
        if segment.style is not None and segment.text.strip() not in ("", "│")
    ]


def part(strip: Strip, text: str) -> tuple[str, str]:
    """The ground and the meaning of the segment with this text."""
    return next((ground, meant) for found, ground, meant in parts(strip) if found == text)


# ---- painting


def test_three_lines_of_headers_say_name_type_unit_and_how_many_rows_the_fact_leaves():
    sheet = sheet_of()
    sheet.set_fact("hit", "True")
    assert lines(sheet)[:3] == [
        "#    Asset   ↕│ speed   ↕│ hit     ↕│ gait    ↕│ Enabled ↕│",
        "     asset    │ m/s      │ bool     │ enum     │ enabled  │",
        "              │          │ 2 left   │          │          │",
    ]


def test_in_a_low_window_one_line_of_headers_says_the_type_or_what_the_fact_leaves():
    sheet = sheet_of()
    sheet.set_fact("hit", "True")
    assert lines(sheet, height=20)[:2] == [
        "#    Asset   ↕│ speed   ↕│ hit     ↕│ gait    ↕│ Enabled ↕│",
        "     asset    │ m/s      │ 2 left   │ enum     │ enabled  │",
    ]


def test_a_narrow_column_says_its_type_where_its_unit_has_no_room():
    declared = Schema(conditions=conditions_from_dict({"speed": {"type": "number", "unit": "metres per second"}}))
    texts = [TextColumn.of("Asset", ["walk"]), TextColumn.of("speed", ["0..2"])]
    sheet = Sheet(Table.build("t", texts, declared, TableSettings("t")))
    assert lines(sheet)[1] == "     asset    │ number   │"


def test_each_mark_says_without_colour_what_a_row_or_a_cell_is():
    sheet = sheet_of()
    sheet.set_fact("hit", "False")
    assert lines(sheet)[4:7] == [
        "1 ×1 walk     │ 0..2     │×True     │ Walk     │ True     │",
        "2 ◉  run      │ Any      │ Any      │ Run      │ True     │",
        "3 –  jump     │!5; 9     │ False    │          │ False    │",
    ]


def test_a_fact_that_cannot_be_read_is_marked_and_named_over_its_column():
    sheet = sheet_of()
    sheet.set_fact("speed", "fast")
    shown = lines(sheet)
    assert "!cannot b…" in shown[2]
    assert "!fast" in shown[3]


def test_the_test_row_stands_under_the_header_and_counts():
    sheet = sheet_of()
    assert lines(sheet)[3].split() == ["?", "test", "row", "│", "│", "│", "│", "│"]
    sheet.set_fact("hit", "True")
    assert lines(sheet, width=120)[3].startswith("?    2 of 3   │")


def test_an_empty_table_and_a_filter_that_hides_all_say_so():
    assert "the table has no rows: Ctrl+N makes one" in lines(sheet_of({"Asset": [], "hit": []}))[4]
    sheet = sheet_of()
    sheet.set_filter(Filter(text="nowhere"))
    assert "no row passes the filter" in lines(sheet)[4]


def test_row_numbers_are_those_of_the_file_in_a_sorted_view():
    sheet = sheet_of()
    sheet.set_sort(Sort("Asset"))
    assert [line[:1] for line in lines(sheet)[4:7]] == ["3", "2", "1"]
    assert "Asset   ▲" in lines(sheet)[0]
    sheet.set_sort(Sort("Asset", True))
    assert "Asset   ▼" in lines(sheet)[0]


def test_the_cursor_is_painted_away_while_something_else_has_the_keys():
    sheet = sheet_of()
    assert part(painter_of(sheet).line(4, look_of(sheet)), "walk") == ("cursor", "on-cursor")
    assert part(painter_of(sheet).line(4, look_of(sheet, has_focus=False)), "walk") == ("cursor-away", "name")


def test_the_selected_cells_and_the_headers_over_them_are_painted_so():
    sheet = sheet_of()
    sheet.go(0, 1)
    sheet.go(1, 2, extend=True)
    painter, look = painter_of(sheet), look_of(sheet)
    assert part(painter.line(5, look), "Any") == ("selected", "any")
    assert part(painter.line(5, look), "run")[0] == "frozen"
    assert part(painter.line(6, look), "jump")[0] == "frozen"
    assert [g for text, g, _ in parts(painter.line(0, look)) if text in ("speed", "hit", "gait")] == [
        "header-chosen",
        "header-chosen",
        "header",
    ]


def test_a_selection_is_not_painted_while_the_cursor_is_in_the_test_row():
    sheet = sheet_of()
    sheet.go(0, 1)
    sheet.go(1, 2, extend=True)
    painter, look = painter_of(sheet), look_of(sheet, is_in_test_row=True)
    assert {ground for _, ground, _ in parts(painter.line(4, look))} == {"gutter", "frozen", "row"}
    assert ("cursor" in {s.style.meta["ground"] for s in painter.line(look.test_line, look) if s.style}) is True


def test_a_disabled_row_is_struck_but_what_cannot_be_read_in_it_stays_marked():
    sheet = sheet_of(ROWS | {"Enabled": ["False", "False", "False"]})
    strip = painter_of(sheet).line(6, look_of(sheet))
    assert part(strip, "jump")[1] == "disabled"
    assert part(strip, "!5; 9")[1] == "fault"


@pytest.mark.parametrize("name", TABLES)
def test_every_line_is_exactly_as_wide_as_the_window(name):
    sheet = sheet_of(columns_of(TABLES[name]))
    for width, height, left in product((0, 1, 4, 8, 20, 40, 80, 200), (1, 2, 4, 8), (0, 3, 11, 400)):
        look = look_of(sheet, width, height, left=left)
        painter = painter_of(sheet)
        assert [painter.line(y, look).cell_length for y in range(height)] == [width] * height


def columns_of(text: str) -> dict[str, list[str]]:
    import csv
    import io

    head, *rows = csv.reader(io.StringIO(text))
    return {name: [row[at] for row in rows] for at, name in enumerate(head)}


def test_wide_characters_line_up_and_are_cut_whole():
    sheet = sheet_of({"Asset": ["日本語のアセット", "ab"], "hit": ["True", "Any"]})
    look, painter = look_of(sheet), painter_of(sheet)
    first, second = painter.line(4, look), painter.line(5, look)
    assert text_of(first).startswith("1    日本語の…│ True")
    assert first.cell_length == second.cell_length == 80


def test_line_ends_tabs_and_controls_of_a_cell_are_shown_by_signs():
    sheet = sheet_of({"Asset": ["zwei\nZ", "a\tb", "\x1b[31mred"], "hit": ["", "", ""]})
    assert [line.split("│")[0].split(None, 1)[1].strip() for line in lines(sheet)[4:7]] == ["zwei⏎Z", "a⇥b", "�[31mred"]


def test_a_line_costs_the_same_however_long_the_table_is():
    """Only the rows on the screen are read."""
    n_read = 0

    class Counted(Sheet):
        def header(self, column):
            nonlocal n_read
            n_read += 1
            return super().header(column)

    sheet = Counted(Table.from_columns({"Asset": [f"a{i}" for i in range(5000)], **{f"c{i}": ["Any"] * 5000 for i in range(100)}}))
    painter, look = painter_of(sheet), look_of(sheet, 80, 24)
    for y in range(24):
        painter.line(y, look)
    assert n_read <= 8


# ---- in the editor


@pytest.fixture
def ordinary(tmp_path: Path) -> Path:
    file = tmp_path / "ordinary.csv"
    file.write_text(TABLES["ordinary"], "utf-8")
    return file


@pytest.mark.parametrize(("name", "size"), some(product(TABLES, [(20, 8), (40, 12), (160, 48)])))
def test_every_table_opens_moves_and_edits_in_every_window(tmp_path, name, size):
    path = tmp_path / f"{name}.csv"
    path.write_text(TABLES[name], "utf-8")

    async def script(app, pilot):
        await press(pilot, "ctrl+end", "ctrl+home", "down", "right", "pagedown", "pageup", "end", "f6", "f6")
        await press(pilot, "f2", "escape", "shift+down", "shift+right", "ctrl+a", "escape", "alt+w")
        return screen_text(app), app.main.session.sheet.is_modified

    shown, is_modified = with_editor(path, script, size)
    assert len(shown.splitlines()) == size[1]
    assert not is_modified


def test_what_is_typed_faster_than_an_editor_opens_is_all_in_it(ordinary):
    """As a terminal sends it over a slow line: many keys at once, then a paste."""
    from textual.events import Key, Paste

    async def script(app, pilot):
        await press(pilot, "right")
        for key in ["1", "full_stop", "full_stop", "2", "5", "enter", "f2", "end", "backspace", "9", "tab"]:
            character = {"full_stop": "."}.get(key, key) if len(key) == 1 or key == "full_stop" else None
            app.post_message(Key(key, character))
        app.post_message(Paste("False"))
        await press(pilot)
        await press(pilot)
        return {c.name: c.to_list() for c in app.main.session.sheet.table.columns}

    texts = with_editor(ordinary, script)
    assert texts["speed"] == ["1..25", "2..9", "Any"]
    assert texts["hit"] == ["True", "False", "False"]


def test_what_is_typed_right_after_a_key_that_opens_a_bar_or_a_dialog_goes_there(ordinary):
    from textual.events import Key

    async def script(app, pilot):
        for key in ["ctrl+f", "r", "u", "n", "enter", "escape", "ctrl+g", "3", "enter"]:
            app.post_message(Key(key, key if len(key) == 1 else None))
        await press(pilot)
        await press(pilot)
        sheet = app.main.session.sheet
        return sheet.cursor, sheet.is_modified

    assert with_editor(ordinary, script) == ((2, 0), False)


VERB_KEYS = [c.keys.split(",")[0] for c in GRID if c.keys and c.id not in ("redo",)]


@examples(0.08)
@given(keys=st.lists(st.sampled_from(VERB_KEYS), min_size=1, max_size=12))
def test_whatever_is_pressed_undoing_all_gives_the_same_bytes(keys, tmp_path_factory):
    folder = tmp_path_factory.mktemp("any")
    file = folder / "t.csv"
    file.write_bytes(b'Asset,speed,hit\r\nwalk,"0..2",True\nrun,5; 9,Any\njump,Any,False\n')

    async def script(app, pilot):
        await pilot.press(*keys)
        await press(pilot, "escape", "escape")
        sheet = app.main.session.sheet
        for _ in range(len(keys) + 1):
            sheet.undo()
        return bytes_for(sheet.table, file)

    assert with_editor(file, script) == file.read_bytes()
