"""Below a list of gaps, problems or databases are the rows of the table that its line is about, where there is room for them."""

import shutil
from pathlib import Path

import pytest
from terminal import press, screen_text, with_editor

import contextdb as cdb
from contextdb.covering import coverage
from tui.model.rows_near import is_near_at_once, rows_near
from tui.panes.rows_below import RowsBelow, _columns
from tui.widgets.heat_map import HeatMap

TABLES = Path(__file__).parents[2] / "tables"
TOML = '[conditions.speed]\ntype = "number"\nmin = 0\nmax = 10\n[conditions.hit]\ntype = "bool"\n'
ROWS = "Asset,speed,hit\nidle,0..1,True\nwalk,1..4,Any\njog,4..5; 3,True\nrun,5..6,False\n"
ROOMY = (120, 36)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text(TOML)
    (tmp_path / "t.csv").write_text(ROWS)
    return tmp_path / "t.csv"


def below(path: Path, *keys: str, size: tuple[int, int] = ROOMY) -> list[str]:
    """The lines from the title of the rows on; none where they are not seen."""

    async def script(app, pilot):
        await press(pilot, *keys)
        await app.workers.wait_for_complete()
        await press(pilot)
        rows = next(iter(app.main.query(RowsBelow)))
        region = rows.region
        return screen_text(app).splitlines()[region.y : region.bottom] if region else []

    return with_editor(path, script, size)


@pytest.mark.parametrize("name", ["locomotion", "hit_mid_air", "contested_catch"])
def test_the_nearest_row_of_each_gap_is_that_of_the_report(name):
    table = cdb.load(TABLES / f"{name}.csv")
    gaps = coverage(table).gaps
    assert gaps
    for gap in gaps:
        assert gap.nearest is not None
        near = rows_near(table, gap.cells, 9, gap.nearest.row)
        assert next(iter(near)) == gap.nearest.row
        assert set(near[gap.nearest.row]) == gap.nearest.cells.keys()
        n_short = [len(short) for short in near.values()]
        assert n_short == sorted(n_short)


def test_the_nearest_row_of_the_report_is_the_first_below_its_gap(tmp_path):
    shutil.copytree(TABLES, tmp_path / "game")
    path = tmp_path / "game" / "hit_mid_air.csv"
    nearest = coverage(cdb.load(path)).gaps[0].nearest
    assert nearest is not None
    assert nearest.row > 0
    _, _, first, *_ = below(path, "alt+4")
    assert first.replace("▸", " ").split()[:2] == [str(nearest.row + 1), nearest.asset]


def test_a_row_with_a_cell_that_cannot_be_read_or_switched_off_is_not_near(path):
    path.with_name("contextdb.toml").write_text(TOML + '[tables.t]\nenabled = "on"\n')
    path.write_text("Asset,on,speed,hit\na,True,0..9,True\nb,False,Any,Any\nc,True,4; x; 1,Any\nd,True,9..,Any\n")
    near = rows_near(cdb.load(path, strict=False), {"speed": "(9..10]", "hit": "False"}, 9)
    assert near == {3: (), 0: ("speed", "hit")}


NEAR = (("(5..8)", "True"), ("(5..8)", "False"), ("2..3", "Any"))


def test_of_rows_with_equally_many_cells_to_change_those_come_first_that_name_what_the_gap_names(path):
    path.write_text("Asset,speed,hit\nidle,Any,True\nstrafe,0..9,False\nback,4..9,False\nstop,Any,True\n")
    assert [list(rows_near(cdb.load(path), {"speed": speed, "hit": hit}, 9)) for speed, hit in NEAR] == [
        [0, 3, 1, 2], [1, 2, 0, 3], [1, 0, 3, 2],
    ]  # fmt: skip


def test_rows_are_ranked_at_once_by_how_many_different_cells_there_are_and_not_by_how_many_rows():
    many = cdb.Table.from_columns({"Asset": ["a"] * 5_000, "speed": ["0..5"] * 5_000})
    different = cdb.Table.from_columns({"Asset": ["a"] * 5_000, "speed": [f"0..{n}" for n in range(1, 5_001)]})
    assert [is_near_at_once(table) for table in (many, different)] == [True, False]


def test_a_gap_is_shown_with_its_nearest_rows_and_the_cells_that_keep_them_from_closing_it(path):
    path.write_text(ROWS.replace("4..5; 3", "4..5"))
    title, header, *rows = below(path, "alt+4")
    assert "nearest rows" in title
    assert header.split() == ["Row", "Asset", "speed", "hit"]
    gap = coverage(cdb.load(path, strict=False)).gaps[0]
    assert gap.nearest is not None
    assert rows[0].split()[1] == str(gap.nearest.row + 1)
    assert rows[0].count("×") == gap.nearest.n_changes


def test_a_problem_is_shown_at_its_place_among_the_other_rows(path):
    _, _, *rows = below(path, "alt+5")
    assert [row.replace("▸", " ").split()[:2] for row in rows[:4]] == [["1", "idle"], ["2", "walk"], ["3", "jog"], ["4", "run"]]
    assert rows[2].startswith("▸")
    assert "!4..5; 3" in rows[2]


def test_the_rows_of_a_database_are_shown_with_the_valid_ones_first(tmp_path):
    shutil.copytree(TABLES, tmp_path / "game")
    title, _, *rows = below(tmp_path / "game" / "locomotion.csv", "f8", "f8", "alt+3")
    assert "Rows of loco_tired, then of loco" in title
    assert rows[0].split()[:3] == ["▸", "10", "walk_tired"]
    assert "×" not in rows[0]
    assert all("×" in row for row in rows[1:11])


def test_a_small_screen_has_no_room_for_them(path):
    assert below(path, "alt+5", size=(80, 24)) == []


def test_enter_on_such_a_row_goes_to_it(path):
    async def script(app, pilot):
        await press(pilot, "alt+5")
        app.main.query_one(RowsBelow).focus()
        await press(pilot, "up", "enter")
        return app.main.tab, app.main.session.sheet.cursor

    assert with_editor(path, script, ROOMY) == ("assets", (1, 1))


def test_all_lines_of_the_chosen_square_of_a_map_have_one_ground(path):
    path.write_text(ROWS.replace("4..5; 3", "4..5"))

    async def script(app, pilot):
        app.theme = "catppuccin-latte"
        await press(pilot, "alt+4", "2")
        await app.workers.wait_for_complete()
        await press(pilot)
        square = app.main.query_one("PairMap", HeatMap)
        x, y = square.content_region.x + square.label_width, square.content_region.y + 1
        x += square.place[1] * square.square_width
        lines = app.screen._compositor.render_strips()[y : y + square.square_height]
        return [next(iter(line.crop(x, x + 1))).style for line in lines]

    styles = with_editor(path, script, ROOMY)
    assert len(styles) == 3
    assert len({style.color if style.reverse else style.bgcolor for style in styles}) == 1


def test_of_very_many_columns_only_those_are_read_that_have_room(monkeypatch: pytest.MonkeyPatch):
    names, n_read = [f"c{at}" for at in range(3000)], 0
    table = cdb.Table.from_columns({"Asset": ["a", "b"], **{name: ["True", "Any"] for name in names}})
    text = type(table).text

    def counted(self, row, column):
        nonlocal n_read
        n_read += 1
        return text(self, row, column)

    monkeypatch.setattr(type(table), "text", counted)
    shown, widths = _columns(table, range(2), 60, "c2000")
    assert shown == ["Asset", "c1994", "c1995", "c1996", "c1997", "c1998", "c1999", "c2000"]
    assert sum(widths) + 2 * len(widths) <= 60
    assert n_read < 50
