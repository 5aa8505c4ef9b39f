"""The sheet marks what `check` warns of in cells that can be read: values outside the bounds, and names that two rows have."""

from __future__ import annotations

from pathlib import Path

from hypothesis import given
from strategies import tables
from terminal import press, screen_text, with_editor

from contextdb.checks.run import check
from contextdb.tables.table import Table
from tui.model.sheet import Sheet
from tui.model.window import Window

RULES = ("outside-domain", "empty-cell", "duplicate-asset")


@given(tables())
def test_a_cell_is_marked_where_check_warns_of_it(table: Table):
    sheet, names = Sheet(table), [column.name for column in table.columns]
    findings = [finding for finding in check(table) if finding.rule in RULES and finding.row is not None]
    marked = {(row, name) for row in range(table.n_rows) for at, name in enumerate(names) if sheet.doubt(row, at)}
    warned = {(finding.row, finding.column) for finding in findings}
    first = {(finding.by[0], finding.column) for finding in findings if finding.rule == "duplicate-asset"}
    assert marked == warned | first
    window = Window(sheet, 0, max(table.n_rows, 1))
    assert not [
        place for place in marked if window.cell(place[0], names.index(place[1]))[1] == "any"
    ]  # so that it is not asked there


def test_the_sheet_marks_it_and_the_line_of_the_cell_says_why_also_after_an_edit(tmp_path: Path):
    (tmp_path / "contextdb.toml").write_text('[conditions.wind]\ntype = "number"\nmin = 0\nmax = 30\n')
    (tmp_path / "t.csv").write_text("Asset,wind\nwalk,0..5\nrun,1\n")

    async def script(app, pilot):
        before = screen_text(app)
        await press(pilot, "right", *"50", "enter", "up")
        outside = screen_text(app)
        await press(pilot, "left", "down", *"walk", "enter", "up")
        return before, outside, screen_text(app)

    before, outside, twice = with_editor(tmp_path / "t.csv", script, (120, 24), paints=True)
    assert "?" not in before.splitlines()[6]
    assert "?50" in outside
    assert "wholly outside the declared 0 to 30" in outside
    assert twice.count("?walk") == 2
    assert "another row has this name, too" in twice
