"""What changed between two tables: rows by asset, cells by meaning, and an edit that does it all."""

from dataclasses import replace
from time import process_time

import numpy as np
import pytest
from edit_strategies import TEXTS, edits_of, insert_column
from hypothesis import given
from hypothesis import strategies as st

from contextdb.columns import TextColumn
from contextdb.edits import edits
from contextdb.edits.diffing import Diff, diff
from contextdb.files.csv_rewrite import rewritten
from contextdb.files.csv_source import read_csv
from contextdb.schema.settings import EMPTY, TableSettings
from contextdb.tables.changes import Edit, Rows
from contextdb.tables.table import Table

NAMES = ["Asset", "speed", "hit", "Größe", "x,y"]
RAW = 'Asset,speed,hit\nwalk,0..5,True\nrun,5..9,Any\njump,Any,False\ndive,"20, 9.99",True\n'


def table_of(text: str, **settings: object) -> Table:
    source, columns = read_csv(text.encode(), "t.csv")
    return Table.build("t", columns, EMPTY, replace(TableSettings("t"), **settings), source=source)


def fresh(table: Table) -> bytes:
    """The table as a CSV written anew."""
    return rewritten(table.columns, None, np.full(table.n_rows, -1)).raw


def saved(table: Table) -> bytes:
    """The table as a save writes it over what it came from."""
    return rewritten(table.columns, table.source, table.origin).raw


@pytest.fixture
def table() -> Table:
    return table_of(RAW)


@st.composite
def any_tables(draw: st.DrawFn) -> Table:
    """A table whose assets are often the same or empty."""
    names = draw(st.lists(st.sampled_from(NAMES), min_size=1, max_size=4, unique=True))
    n_rows = draw(st.integers(0, 7))
    texts = st.sampled_from(TEXTS)
    rows = [
        [draw(st.sampled_from(["a", "b", "c", "walk", ""]) if i == 0 else texts) for i in range(len(names))] for _ in range(n_rows)
    ]
    columns = {name: [row[at] for row in rows] for at, name in enumerate(names)}
    asset = draw(st.none() | st.sampled_from(names))
    return Table.build("t", [TextColumn.of(n, t) for n, t in columns.items()], EMPTY, TableSettings("t", asset=asset))


# ---- the edit


@given(any_tables(), any_tables())
def test_the_edit_of_a_diff_makes_any_table_the_other_one(before, after):
    made = diff(before, after).edit().apply(before)
    assert fresh(made) == fresh(after)
    assert made.asset_column == after.asset_column


@given(st.data())
def test_a_file_edited_by_the_diff_of_its_edits_is_byte_for_byte_the_edited_file(data):
    before = table_of(RAW)
    after = before
    for _ in range(data.draw(st.integers(0, 4))):
        after = data.draw(edits_of(after)).apply(after)
    again = diff(before, after).edit().apply(before)
    assert saved(again) == fresh(again) == fresh(after)
    assert not diff(after, again)


@given(any_tables())
def test_a_table_does_not_differ_from_itself(table):
    found = diff(table, table)
    assert not found
    assert found.edit().changes == ()
    assert found.summary == "no difference"


@given(any_tables(), any_tables())
def test_every_row_is_told_once_at_most(before, after):
    found = diff(before, after)
    kept = found.alignment.rows[found.alignment.rows >= 0].tolist()
    assert len(set(kept)) == len(kept)
    assert sorted(kept + found.rows_removed) == list(range(before.n_rows))
    assert len(kept) + len(found.rows_added) == after.n_rows


# ---- what is told


def told(before: Table, after: Table) -> str:
    return diff(before, after).summary


def test_a_changed_cell_is_told_with_its_asset_and_column(table):
    [change] = diff(table, table.with_cell(1, "speed", "5..8")).cells
    assert (change.row, change.asset, change.column, change.before, change.after) == (1, "run", "speed", "5..9", "5..8")
    assert change.is_meaning


def test_a_cell_that_means_the_same_is_only_written_otherwise(table):
    found = diff(table, table.with_cell(3, "speed", "20.0000, 9.9900").with_cell(2, "speed", "-"))
    assert found.summary == "2 cells written differently"
    assert [c.is_meaning for c in found.cells] == [False, False]


def test_cells_that_cannot_be_read_mean_themselves(table):
    bad = table.with_cell(0, "speed", "5;3")
    assert told(bad, table.with_cell(0, "speed", "5; 3")) == "1 cell changed"


def test_jobs_are_read_as_what_they_are():
    before = table_of("A,On,P,W,out\na,True,1,,x\n", enabled="On", priority="P", weight="W", outputs=("out",))
    after = before.with_cells([(0, "On", "yes"), (0, "P", "1.0"), (0, "W", "1"), (0, "out", "x ")])
    assert told(before, after) == "1 cell changed, 3 cells written differently"


def test_rows_are_known_by_their_asset_wherever_they_stand(table):
    after = edits.move_rows(table, [0], 4).apply(table).with_cell(3, "hit", "False")
    found = diff(table, after)
    assert found.summary == "1 row moved, 1 cell changed"
    [move] = found.rows_moved
    assert (move.name, move.place_before, move.place_after) == ("walk", 0, 3)


def test_a_row_with_a_new_name_and_the_same_cells_is_renamed(table):
    [one] = diff(table, table.with_cell(1, "Asset", "sprint")).rows_renamed
    assert (one.before, one.after, one.place_after) == ("run", "sprint", 1)


def test_a_row_renamed_moved_and_half_changed_is_still_found_in_its_gap():
    before = table_of("A,x,y,z,w\na,1,2,3,4\nb,5,6,7,8\nc,1,1,1,1\n")
    after = table_of("A,x,y,z,w\na,1,2,3,4\nb2,5,6,0,0\nc,1,1,1,1\n")
    assert told(before, after) == "1 row renamed, 2 cells changed"


def test_a_row_with_another_name_and_other_cells_is_another_row():
    before = table_of("A,x,y,z\na,1,2,3\nb,5,6,7\n")
    after = table_of("A,x,y,z\na,1,2,3\nq,5,0,0\n")
    assert told(before, after) == "1 row added, 1 row removed"


def test_rows_that_accept_everything_are_not_taken_for_one_another_unless_their_names_are_alike():
    before = table_of("A,x\nwalk_left,Any\n")
    assert told(before, table_of("A,x\nwalk_left2,Any\n")) == "1 row renamed"
    assert told(before, table_of("A,x\nHeadstand,\n")) == "1 row added, 1 row removed"


def test_of_rows_with_one_name_those_that_are_the_same_belong_together():
    before = table_of("A,x\na,1\na,2\na,3\nb,4\n")
    after = table_of("A,x\na,3\na,1\nb,4\n")
    found = diff(before, after)
    assert found.rows_removed == [1]
    assert found.summary == "1 row removed, 1 row moved"


def test_a_copy_put_elsewhere_is_an_added_row_and_the_first_one_stays():
    before = table_of("A,x\na,1\nb,2\nc,3\n")
    after = table_of("A,x\na,1\nb,2\nb,2\nc,3\n")
    assert told(before, after) == "1 row added"


def test_a_renamed_column_is_known_by_its_cells(table):
    after = edits.rename_column(table, "speed", "velocity").apply(table)
    found = diff(table, after)
    assert [(c.before, c.after) for c in found.columns_renamed] == [("speed", "velocity")]
    assert found.summary == "1 column renamed"


def test_columns_come_go_and_move(table):
    after = edits.move_column(table, "hit", 1).apply(table)
    assert told(table, after) == "1 column moved"
    after = edits.delete_columns(after, ["speed"]).apply(after)
    after = insert_column(after, 1, "new", text="A B").apply(after)
    found = diff(table, after)
    assert (found.columns_added, found.columns_removed) == (["new"], ["speed"])


def test_a_renamed_asset_column_still_names_the_assets(table):
    after = edits.rename_column(table, "Asset", "Name").apply(table)
    assert told(table, after) == "1 column renamed"


def test_json_has_every_difference_as_plain_data(table):
    after = edits.delete_rows(table, [0]).apply(table).with_cell(0, "speed", "5..8")
    data = diff(table, after).to_json()
    assert data["format"] == 1
    assert data["same"] is False
    assert data["rows"]["removed"] == [{"row": 0, "asset": "walk", "line": 2}]
    assert data["cells"] == [{"row": 0, "asset": "run", "column": "speed", "before": "5..9", "after": "5..8", "meaning": True}]


# ---- size


def large(n_rows: int, n_columns: int) -> Table:
    rng = np.random.default_rng(0)
    columns = {"Asset": [f"Anim_{i}" for i in range(n_rows)]}
    texts = ["Any", "0..5", "20, 9.99", "5..9", ">= 3", ""]
    for at in range(n_columns - 1):
        columns[f"c{at}"] = [texts[i] for i in rng.integers(0, len(texts), n_rows).tolist()]
    return Table.from_columns(columns)


def with_changes(table: Table, n: int) -> Table:
    rng = np.random.default_rng(1)
    places = zip(rng.integers(0, table.n_rows, n).tolist(), rng.integers(1, len(table.columns), n).tolist(), strict=True)
    return edits.set_cells(table, ((r, table.columns[c].name, f"{i}..{i + 1}") for i, (r, c) in enumerate(places))).apply(table)


def time_s(before: Table, after: Table) -> tuple[Diff, float]:
    start = process_time()
    found = diff(before, after)
    found.to_json()
    return found, process_time() - start


def test_a_thousand_changed_cells_of_twenty_thousand_rows_are_found_within_budget_also_when_rows_moved():
    table = large(20_000, 20)
    after = with_changes(table, 1000)
    order = Rows(np.roll(np.arange(table.n_rows), 7))
    after = Edit("", (order,)).apply(after)
    again = Table.build("t", read_csv(fresh(after), "t.csv")[1], EMPTY)
    found, taken_s = time_s(table, again)
    assert 990 <= found.n_changed <= 1000
    assert len(found.rows_moved) == 7
    assert taken_s < 2.0
