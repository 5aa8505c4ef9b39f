"""Tables: edits give new ones that share what did not change, and every cell that cannot be read is kept and told."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import NUMBER
from contextdb.columns import TextColumn
from contextdb.errors import TableError
from contextdb.schema.settings import EMPTY, TableSettings
from contextdb.tables.condition_column import MOST_MENDS
from contextdb.tables.table import Table

DECLARED = {"speed": {"type": "number"}, "state": {"type": "enum", "values": ["Ground", "Air"]}}
TABLE = Table.from_columns(
    {"Asset": ["run", "jump", "fall"], "speed": ["3..6", "Any", "0..3"], "state": ["Ground", "Air", "Air Ground"]}, DECLARED
)


def faulty(columns: dict[str, list[str]], settings: TableSettings | None = None) -> Table:
    """A table as an editor opens it, with the cells that cannot be read."""
    schema = type(EMPTY)(conditions={name: Condition(name, NUMBER) for name in columns if name.startswith("n")})
    return Table.build("t", [TextColumn.of(name, texts) for name, texts in columns.items()], schema, settings)


# ---- what a table holds


def test_a_table_has_the_texts_it_was_made_of():
    assert (TABLE.name, TABLE.n_rows, len(TABLE)) == ("table", 3, 3)
    assert TABLE.assets == ["run", "jump", "fall"]
    assert TABLE.text(1, "state") == "Air"
    assert [c.condition.name for c in TABLE.conditions] == ["speed", "state"]
    assert TABLE.condition("speed").cell(0).holds(4.0)


def test_the_first_column_names_the_assets_unless_the_settings_say_otherwise():
    columns = {"speed": ["0..5"], "Anim": ["run"]}
    assert Table.from_columns(columns, DECLARED, TableSettings("t", asset="Anim")).assets == ["run"]
    assert Table.from_columns({"Anim": ["run"], "speed": ["0..5"]}, DECLARED).assets == ["run"]


def test_outputs_and_settings_columns_are_no_conditions():
    settings = TableSettings("t", outputs=("Slots",), enabled="On", priority="P", weight="W")
    columns = {"Asset": ["run"], "Slots": ["a"], "On": ["True"], "P": ["1"], "W": ["2"], "speed": ["0..5"]}
    assert [c.condition.name for c in Table.from_columns(columns, DECLARED, settings).conditions] == ["speed"]


def test_plain_columns_are_read_and_empty_ones_have_their_usual_values():
    settings = TableSettings("t", enabled="On", priority="P", weight="W")
    columns = {"Asset": ["a", "b", "c"], "On": ["no", "", "T"], "P": ["-3", "", "7"], "W": ["0", "", "2.5"]}
    table = Table.from_columns(columns, settings=settings)
    assert (table.enabled.tolist(), table.enabled.dtype) == ([False, True, True], np.bool_)
    assert (table.priorities.tolist(), table.priorities.dtype) == ([-3, 0, 7], np.int64)
    assert (table.row_weights.tolist(), table.row_weights.dtype) == ([0.0, 1.0, 2.5], np.float64)


def test_without_plain_columns_every_row_is_enabled_and_equal():
    assert (TABLE.enabled.tolist(), TABLE.priorities.tolist(), TABLE.row_weights.tolist()) == ([True] * 3, [0] * 3, [1.0] * 3)


@pytest.mark.parametrize("n_rows", [0, 1, 64])
def test_a_table_may_have_no_conditions(n_rows):
    table = Table.from_columns({"Asset": [f"A{r}" for r in range(n_rows)]})
    assert table.compile().query({}).indices.tolist() == list(range(n_rows))


def test_a_table_may_have_no_columns():
    table = Table.from_columns({})
    assert (table.n_rows, table.conditions, table.faults) == (0, (), [])
    assert table.assets == []


# ---- edits


def test_an_edit_gives_a_new_table_and_leaves_the_old_one_as_it_was():
    edited = TABLE.with_cell(1, "speed", "9..")
    assert (TABLE.text(1, "speed"), edited.text(1, "speed")) == ("Any", "9..")


def test_an_edit_shares_every_column_that_it_does_not_change():
    edited = TABLE.with_cell(1, "speed", "9..")
    assert edited.condition("state") is TABLE.condition("state")
    assert edited.text_column("Asset") is TABLE.text_column("Asset")
    assert edited.condition("state").masks is TABLE.condition("state").masks


def test_an_edit_to_a_text_that_the_column_has_reads_no_cell_anew():
    edited = TABLE.with_cell(1, "speed", "3..6")
    assert edited.condition("speed").cells is TABLE.condition("speed").cells
    assert edited.compile().query({"speed": 9, "state": "Air"}).assets == []


def test_new_rows_are_any_where_nothing_is_said():
    table = TABLE.with_rows(1, [{"Asset": "idle"}, {"Asset": "dive", "speed": "9.."}])
    assert table.assets == ["run", "idle", "dive", "jump", "fall"]
    assert table.text_column("speed").to_list() == ["3..6", "", "9..", "Any", "0..3"]
    assert table.origin.tolist() == [0, -1, -1, 1, 2]
    assert table.compile().query({"speed": 20, "state": "Air"}).assets == ["idle", "dive", "jump"]


def test_taken_rows_come_in_the_order_given_and_know_where_they_came_from():
    table = TABLE.with_rows_taken([2, 0])
    assert (table.assets, table.origin.tolist()) == (["fall", "run"], [2, 0])
    assert table.compile().query({"speed": 3, "state": "Ground"}).assets == ["fall", "run"]
    assert TABLE.with_rows_taken([]).compile().query({"speed": 3, "state": "Ground"}).assets == []


TEXTS = st.sampled_from(["Any", "5", "Air", "0..5", "Ground", "oops", ""])
EDITS = st.tuples(st.integers(0, 2), st.sampled_from(["speed", "state"]), TEXTS)


@given(st.lists(EDITS, max_size=8))
def test_a_table_after_any_edits_is_the_table_of_its_texts(edits):
    edited = TABLE
    for edit in edits:
        edited = edited.with_cell(*edit)
    texts = {c.name: c.to_list() for c in edited.columns}
    anew = Table.build("table", [TextColumn.of(name, column) for name, column in texts.items()], TABLE.schema)
    assert [str(fault) for fault in edited.faults] == [str(fault) for fault in anew.faults]
    if not edited.faults:
        for context in ({"speed": s, "state": t} for s in (0, 5, 6) for t in ("Ground", "Air")):
            assert edited.compile().query(context) == anew.compile().query(context)


# ---- faults


def test_a_cell_that_cannot_be_read_stands_in_every_row_that_holds_it():
    assert [fault.place.row for fault in faulty({"Asset": list("abc"), "n": ["x", "5", "x"]}).faults] == [0, 2]


def test_thousands_of_cells_that_cannot_be_read_are_all_told_but_few_are_mended():
    table = faulty({"Asset": [""] * 1000, "n": [f"{i};{i}" for i in range(1000)]})
    assert len(table.faults) == 1000
    assert sum(bool(fault.mend) for fault in table.faults) == MOST_MENDS


def test_plain_columns_that_cannot_be_read_are_faults_too():
    settings = TableSettings("t", enabled="On", priority="P", weight="W")
    table = faulty({"Asset": ["a", "b"], "On": ["maybe", ""], "P": ["1.5", "high"], "W": ["-1", "nan"]}, settings)
    assert [str(fault) for fault in table.faults] == [
        'row 1, column "On": cannot read "maybe". Accepted: "True" or "False".',
        'row 1, column "P": cannot read "1.5". Accepted: a whole number.',
        'row 1, column "W": cannot read "-1". Accepted: a number from 0 up.',
        'row 2, column "P": cannot read "high". Accepted: a whole number.',
        'row 2, column "W": cannot read "nan". Accepted: a number from 0 up.',
    ]
    with pytest.raises(TableError):
        table.compile()


@pytest.mark.parametrize("text", ["inf", "1e400", "1e20", "0.5"])
def test_a_priority_is_a_whole_number_that_can_be_kept(text):
    assert len(faulty({"Asset": ["a"], "P": [text]}, TableSettings("t", priority="P")).faults) == 1


# ---- what is refused
