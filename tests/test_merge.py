"""Two sides of one table made one: cell by cell, rows and columns where both put them, and what they disagree about as data."""

from dataclasses import replace

import numpy as np
import pytest
from edit_strategies import TEXTS, edits_of, insert_column
from hypothesis import assume, given
from hypothesis import strategies as st

from contextdb.columns import TextColumn
from contextdb.edits import edits
from contextdb.files.csv_rewrite import rewritten
from contextdb.files.csv_source import read_csv
from contextdb.schema.settings import EMPTY, TableSettings
from contextdb.tables.changes import Edit, Rows
from contextdb.tables.merging.merging import Merge, merge
from contextdb.tables.table import Table

RAW = 'Asset,speed,hit,tags\r\nwalk,"0..5",True,+A\nrun,5..9,Any,\njump,Any,False,+B -C\ndive,"20, 9.99",True,Any\n'


def table_of(text: str, **settings: object) -> Table:
    source, columns = read_csv(text.encode(), "t.csv")
    return Table.build("t", columns, EMPTY, replace(TableSettings("t"), **settings), source=source)


def saved(table: Table) -> bytes:
    return rewritten(table.columns, table.source, table.origin).raw


def fresh(table: Table) -> bytes:
    return rewritten(table.columns, None, np.full(table.n_rows, -1)).raw


def after(table: Table, *steps: Edit) -> Table:
    for step in steps:
        table = step.apply(table)
    return table


def clean(base: Table, ours: Table, theirs: Table) -> Table:
    found = merge(base, ours, theirs)
    assert found.conflicts == ()
    return found.table


def told(found: Merge) -> list[tuple[object, ...]]:
    return [(c.kind, c.place, c.base, c.ours, c.theirs) for c in found.conflicts]


@pytest.fixture
def base() -> Table:
    return table_of(RAW)


# ---- what always holds


@given(st.data())
def test_a_merge_with_itself_is_the_file_byte_for_byte(data):
    table = table_of(RAW)
    assert saved(merge(table, table, table).table) == RAW.encode()
    edited = after(table, *(data.draw(edits_of(table)) for _ in range(1)))
    assert saved(clean(table, edited, edited)) == saved(edited)


@given(st.data())
def test_what_only_one_side_did_is_what_the_merge_holds(data):
    base = table_of(RAW)
    edited = base
    for _ in range(data.draw(st.integers(1, 3))):
        edited = after(edited, data.draw(edits_of(edited)))
    assert saved(clean(base, edited, base)) == saved(edited)
    assert fresh(clean(base, base, edited)) == fresh(edited)


@given(st.data())
def test_edits_of_different_cells_are_both_made(data):
    base = table_of(RAW)
    names = [c.name for c in base.columns]
    places = [(r, c) for r in range(4) for c in names]
    mine = data.draw(st.sets(st.sampled_from(places)))
    texts = st.sampled_from(TEXTS)
    new = iter(f"new_{i}" for i in range(99))

    def some(chosen: list[tuple[int, str]]) -> list[tuple[int, str, str]]:
        return [(r, c, next(new) if c == "Asset" else data.draw(texts)) for r, c in chosen]

    ours = edits.set_cells(base, some(sorted(mine)))
    theirs = edits.set_cells(base, some([p for p in places if p not in mine and data.draw(st.booleans())]))
    assume(_are_known(base, ours.apply(base)) and _are_known(base, theirs.apply(base)))
    merged = clean(base, ours.apply(base), theirs.apply(base))
    assert saved(merged) == saved(after(base, ours, theirs))


def _are_known(base: Table, side: Table) -> bool:
    """Whether no row has both another name and mostly other cells: then it is another row, for anybody."""
    pairs = zip(*(zip(*(c.to_list() for c in t.columns), strict=True) for t in (base, side)), strict=True)
    return all(a[0] == b[0] or sum(x == y for x, y in zip(a[1:], b[1:], strict=True)) == 3 for a, b in pairs)


@given(st.data())
def test_cells_of_one_side_follow_the_rows_and_columns_that_the_other_moved(data):
    base = table_of(RAW)
    order = data.draw(st.permutations(range(4)))
    moving = [edits.reorder_rows(base, order)]
    moving.append(edits.move_column(base, data.draw(st.sampled_from(["speed", "hit"])), data.draw(st.integers(1, 4))))
    cells = edits.set_cells(base, [(data.draw(st.integers(0, 3)), "tags", "+X"), (data.draw(st.integers(0, 3)), "hit", "yes!")])
    expected = fresh(after(base, cells, *moving))
    assert fresh(clean(base, after(base, *moving), cells.apply(base))) == expected
    assert fresh(clean(base, cells.apply(base), after(base, *moving))) == expected


@given(st.data())
def test_rows_that_one_side_inserts_or_deletes_and_cells_of_others_go_together(data):
    base = table_of(RAW)
    row = data.draw(st.integers(0, 3))
    cells = edits.set_cells(base, [(r, "speed", f"{r}..9") for r in range(4) if r != row and data.draw(st.booleans())])
    at = data.draw(st.integers(0, 4))
    rows = [edits.insert_rows(base, at, [{"Asset": "new", "hit": "True"}, {}])]
    rows.append(edits.delete_rows(after(base, *rows), [row + 2 * (row >= at)]))
    expected = fresh(after(base, cells, *rows))
    assert fresh(clean(base, after(base, *rows), cells.apply(base))) == expected
    assert fresh(clean(base, cells.apply(base), after(base, *rows))) == expected


@given(st.data())
def test_any_two_sides_merge_and_no_text_appears_from_nowhere(data):
    base = table_of(RAW)
    ours = theirs = base
    for _ in range(data.draw(st.integers(0, 3))):
        ours = after(ours, data.draw(edits_of(ours)))
        theirs = after(theirs, data.draw(edits_of(theirs)))
    found = merge(base, ours, theirs)
    known = {text for table in (base, ours, theirs) for column in table.columns for text in column.to_list()} | {""}
    assert {text for column in found.columns for text in column.to_list()} <= known
    assert fresh(found.table) == fresh(found.edit_of_theirs().apply(theirs))
    every = found.resolved(dict.fromkeys(range(len(found.conflicts)), "theirs"))
    again = every.resolved(dict.fromkeys(range(len(every.conflicts)), "theirs"))
    assert again.conflicts == ()


@given(st.data())
def test_deciding_for_ours_changes_nothing_but_the_conflicts(data):
    base = table_of(RAW)
    ours, theirs = (after(base, data.draw(edits_of(base))) for _ in range(2))
    found = merge(base, ours, theirs)
    decided = found.resolved(dict.fromkeys(range(len(found.conflicts)), "ours"))
    assert decided.conflicts == ()
    assert fresh(decided.table) == fresh(found.table)


# ---- the file


def test_only_lines_that_theirs_changed_are_written_anew(base):
    ours = base.with_cell(0, "hit", "False")
    theirs = base.with_cell(2, "speed", "1..2")
    expected = RAW.replace('walk,"0..5",True', 'walk,"0..5",False').replace("jump,Any,", "jump,1..2,")
    assert saved(clean(base, ours, theirs)) == expected.encode()


# ---- rows


def test_both_insert_different_rows_at_one_place_ours_stand_first(base):
    ours = after(base, edits.insert_rows(base, 1, [{"Asset": "mine"}]))
    theirs = after(base, edits.insert_rows(base, 1, [{"Asset": "yours"}]))
    assert clean(base, ours, theirs).assets == ["walk", "mine", "yours", "run", "jump", "dive"]


def test_rows_inserted_behind_a_row_that_the_other_side_deleted_stay_between_its_neighbours(base):
    ours = after(base, edits.delete_rows(base, [1]))
    theirs = after(base, edits.insert_rows(base, 2, [{"Asset": "new"}]))
    assert clean(base, ours, theirs).assets == ["walk", "new", "jump", "dive"]


def test_each_side_moves_another_row(base):
    ours = after(base, edits.move_rows(base, [0], 2))
    theirs = after(base, edits.move_rows(base, [3], 2))
    assert clean(base, ours, theirs).assets == ["run", "dive", "walk", "jump"]


def test_what_both_moved_stands_where_ours_has_it(base):
    ours, theirs = after(base, edits.move_rows(base, [0], 4)), after(base, edits.move_rows(base, [0], 2))
    assert clean(base, ours, theirs).assets == ["run", "jump", "dive", "walk"]


def test_both_delete_the_same_row(base):
    side = after(base, edits.delete_rows(base, [1]))
    assert clean(base, side, after(base, edits.delete_rows(base, [1]))).assets == side.assets


def test_a_row_deleted_here_and_changed_there_is_a_conflict_and_either_can_be_taken(base):
    gone, changed = after(base, edits.delete_rows(base, [1])), base.with_cell(1, "speed", "1..2")
    found = merge(base, gone, changed)
    assert told(found) == [("row", "run", "run", None, "speed: 1..2")]
    assert found.table.assets == ["walk", "jump", "dive"]
    back = found.resolved({0: "theirs"})
    assert (back.conflicts, back.table.assets, back.table.text(1, "speed")) == ((), base.assets, "1..2")
    found = merge(base, changed, gone)
    assert told(found) == [("row", "run", "run", "speed: 1..2", None)]
    assert found.table.text(1, "speed") == "1..2"
    assert found.resolved({0: "theirs"}).table.assets == ["walk", "jump", "dive"]


@pytest.mark.parametrize(("text", "lost"), [("X", [("run", "mood", "X")]), ("Any", []), ("", [])])
def test_a_row_deleted_here_goes_with_what_a_new_column_there_says_of_it_which_is_named(base, text, lost):
    gone = after(base, edits.delete_rows(base, [1]))
    filled = after(base, edits.insert_columns(base, 2, [edits.NewColumn("mood")])).with_cell(1, "mood", text)
    for ours, theirs, side in ((gone, filled, "theirs"), (filled, gone, "ours")):
        found = merge(base, ours, theirs)
        assert told(found) == []
        assert found.table.assets == gone.assets
        assert [column.name for column in found.columns] == [column.name for column in filled.columns]
        assert [(cell.asset, cell.column, cell.text, cell.side) for cell in found.lost] == [(*cell, side) for cell in lost]


def test_a_row_deleted_here_and_changed_there_conflicts_also_where_a_new_column_says_something_of_it(base):
    gone = after(base, edits.delete_rows(base, [1]))
    filled = (
        after(base, edits.insert_columns(base, 2, [edits.NewColumn("mood")])).with_cell(1, "mood", "X").with_cell(1, "hit", "False")
    )
    found = merge(base, gone, filled)
    assert told(found) == [("row", "run", "run", None, "mood: X, hit: False")]
    assert found.lost == ()
    assert len(merge(base, filled, gone).conflicts) == 1


def test_both_insert_the_same_asset_differently(base):
    ours = after(base, edits.insert_rows(base, 4, [{"Asset": "new", "speed": "1", "hit": "True"}]))
    theirs = after(base, edits.insert_rows(base, 0, [{"Asset": "new", "speed": "2", "hit": "True"}]))
    found = merge(base, ours, theirs)
    assert told(found) == [("cell", "new, speed", None, "1", "2")]
    assert found.table.assets == [*base.assets, "new"]
    assert found.resolved({0: "theirs"}).table.text(4, "speed") == "2"


def test_both_insert_the_same_row(base):
    side = after(base, edits.insert_rows(base, 4, [{"Asset": "new", "speed": "1"}]))
    assert saved(clean(base, side, after(base, edits.insert_rows(base, 4, [{"Asset": "new", "speed": "1"}])))) == saved(side)


# ---- cells


def test_a_cell_changed_to_two_texts_is_a_conflict_and_ours_holds_until_it_is_decided(base):
    found = merge(base, base.with_cell(1, "speed", "1..2"), base.with_cell(1, "speed", "3..4"))
    assert told(found) == [("cell", "run, speed", "5..9", "1..2", "3..4")]
    assert found.conflicts[0].row == 1
    assert found.table.text(1, "speed") == "1..2"
    assert found.resolved({0: "theirs"}).table.text(1, "speed") == "3..4"


def test_a_change_of_writing_only_gives_way_to_one_of_meaning(base):
    written, meant = base.with_cell(1, "speed", "5.0..9.0"), base.with_cell(1, "speed", "1..2")
    assert clean(base, written, meant).text(1, "speed") == "1..2"
    assert clean(base, meant, written).text(1, "speed") == "1..2"
    assert clean(base, written, base.with_cell(1, "speed", "5.00..9")).text(1, "speed") == "5.0..9.0"


def test_a_rename_here_and_a_cell_there_go_together(base):
    merged = clean(base, base.with_cell(1, "Asset", "sprint"), base.with_cell(1, "speed", "7..9"))
    assert (merged.assets[1], merged.text(1, "speed")) == ("sprint", "7..9")


def test_two_new_names_of_one_row_are_a_conflict(base):
    found = merge(base, base.with_cell(1, "Asset", "sprint"), base.with_cell(1, "Asset", "jog"))
    assert [(c.kind, c.column, c.ours, c.theirs) for c in found.conflicts] == [("cell", "Asset", "sprint", "jog")]


# ---- columns


def test_columns_added_on_both_sides_both_stand_in_the_merge(base):
    ours = after(base, insert_column(base, 2, "mine", text="1"))
    theirs = after(base, insert_column(base, 4, "yours", text="2"))
    assert [c.name for c in clean(base, ours, theirs).columns] == ["Asset", "speed", "mine", "hit", "tags", "yours"]


def test_the_same_column_added_with_other_cells_is_a_conflict_cell_by_cell(base):
    ours = after(base, insert_column(base, 2, "new", text="1"))
    theirs = after(base, insert_column(base, 2, "new", text="1")).with_cell(3, "new", "2")
    assert told(merge(base, ours, theirs)) == [("cell", "dive, new", None, "1", "2")]


def test_a_column_deleted_here_and_changed_there_is_a_conflict(base):
    gone, changed = after(base, edits.delete_columns(base, ["hit"])), base.with_cell(1, "hit", "True")
    found = merge(base, gone, changed)
    assert told(found) == [("column", "hit", "hit", None, "changed")]
    assert "hit" not in [c.name for c in found.table.columns]
    assert found.resolved({0: "theirs"}).table.text(1, "hit") == "True"
    found = merge(base, changed, gone)
    assert told(found) == [("column", "hit", "hit", "changed", None)]
    assert "hit" not in [c.name for c in found.resolved({0: "theirs"}).table.columns]


def test_a_column_renamed_here_and_edited_there_has_the_new_name_and_the_new_cells(base):
    ours = after(base, edits.rename_column(base, "speed", "velocity"))
    merged = clean(base, ours, base.with_cell(0, "speed", "1..2"))
    assert merged.text(0, "velocity") == "1..2"
    merged = clean(base, base.with_cell(0, "speed", "1..2"), ours)
    assert merged.text(0, "velocity") == "1..2"


def test_two_names_for_one_column_are_a_conflict(base):
    ours, theirs = (after(base, edits.rename_column(base, "speed", name)) for name in ("velocity", "pace"))
    found = merge(base, ours, theirs)
    assert told(found) == [("name", "velocity", "speed", "velocity", "pace")]
    assert [c.name for c in found.resolved({0: "theirs"}).table.columns] == ["Asset", "pace", "hit", "tags"]


def test_two_columns_that_come_to_one_name_are_both_kept(base):
    ours = after(base, edits.rename_column(base, "speed", "pace"))
    theirs = after(base, insert_column(base, 4, "pace", text="x"))
    merged = merge(base, ours, theirs).table
    assert [c.name for c in merged.columns] == ["Asset", "pace", "hit", "tags", "pace 2"]
    assert merged.text(0, "pace 2") == "x"


def test_rows_disabled_on_one_side_are_disabled_in_the_merge(base):
    theirs = after(base, edits.enable_rows(base, [2], False))
    merged = clean(base, base.with_cell(0, "hit", "False"), theirs)
    assert merged.settings.enabled == "Enabled"
    assert merged.enabled.tolist() == [True, True, False, True]


@pytest.mark.parametrize("was", [{"outputs": ("hit",)}, {"enabled": "hit"}], ids=["from outputs", "to outputs"])
def test_a_column_that_theirs_gave_another_job_has_it_in_the_merge(was: dict[str, object]):
    [now] = [one for one in ({"outputs": ("hit",)}, {"enabled": "hit"}) if one != was]
    base = table_of(RAW, **was)
    merged = clean(base, base.with_cell(0, "speed", "7"), table_of(RAW, **now))
    assert merged.settings == table_of(RAW, **now).settings


def test_a_large_merge_of_moved_rows_and_cells_is_both():
    n = 3000
    columns = [TextColumn.of("A", [f"a{i}" for i in range(n)]), TextColumn.of("x", [str(i % 7) for i in range(n)])]
    base = Table.build("t", columns)
    ours = Edit("", (Rows(np.roll(np.arange(n), 5)),)).apply(base)
    theirs = base.with_cells([(i, "x", "9") for i in range(0, n, 10)])
    merged = clean(base, ours, theirs)
    assert merged.assets == ours.assets
    assert merged.text(15, "x") == "9"
    assert fresh(clean(base, theirs, ours)) == fresh(merged)
