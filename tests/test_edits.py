"""Edits as data and their history: undo and redo give the same bytes, also past a save."""

import json

import numpy as np
import pytest
from edit_strategies import edits_of, insert_column
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, for_each, tables

from contextdb.authoring.weights import set_selector
from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.edits import edits
from contextdb.edits.edits import edit_between
from contextdb.edits.history import History
from contextdb.errors import SchemaError, TableError
from contextdb.files.csv_rewrite import rewritten
from contextdb.files.csv_source import read_csv
from contextdb.schema.sections import schema_to_dict
from contextdb.schema.settings import EMPTY, TableSettings, read_schema
from contextdb.tables.changes import Edit
from contextdb.tables.table import Table

RAW = b'Asset Name,"speed",hit\r\nwalk,0..5,True\nrun,"5, 1", Any\r\n"a ""b""","Any",False\n'


def table_of(raw: bytes = RAW, settings: TableSettings | None = None) -> Table:
    source, columns = read_csv(raw, "t.csv")
    return Table.build("t", columns, EMPTY, settings, source=source)


def bytes_of(table: Table) -> bytes:
    return rewritten(table.columns, table.source, table.origin).raw


def texts_of(table: Table) -> dict[str, list[str]]:
    return {c.name: c.to_list() for c in table.columns}


def saved(table: Table) -> Table:
    """The table as a save leaves it, without a disk."""
    source, columns = read_csv(bytes_of(table), "t.csv")
    return Table.build("t", columns, table.schema, table.settings, source=source)


@given(st.data())
@examples(1)
def test_any_edits_undone_give_the_same_bytes_and_redone_the_edited_ones(data):
    history = History(table_of())
    states = [bytes_of(history.table)]
    for _ in range(data.draw(st.integers(1, 8))):
        before = history.position
        history.do(data.draw(edits_of(history.table)))
        states += [bytes_of(history.table)] * (history.position - before)
    for expected in reversed(states[:-1]):
        assert history.undo()
        assert bytes_of(history.table) == expected
    assert not history.undo()
    for expected in states[1:]:
        assert history.redo()
        assert bytes_of(history.table) == expected
    assert not history.redo()


@given(st.data())
@examples(1)
def test_a_history_that_keeps_few_tables_goes_the_same_ways(data):
    wide, narrow = History(table_of()), History(table_of(), most_bytes=0)
    for _ in range(data.draw(st.integers(10, 24))):
        edit = data.draw(edits_of(wide.table))
        wide.do(edit)
        narrow.do(edit)
    assert len(narrow._cached) <= 16
    for position in data.draw(st.lists(st.integers(0, wide.position), max_size=6)):
        one, other = wide.go(position), narrow.go(position)
        assert one.name == other.name
        assert bytes_of(wide.table) == bytes_of(narrow.table)


@given(st.data())
@examples(1)
def test_steps_back_past_a_save_give_the_bytes_from_before_it(data):
    history = History(table_of())
    for _ in range(data.draw(st.integers(1, 4))):
        history.do(data.draw(edits_of(history.table)))
    at, on_disk = history.position, bytes_of(history.table)
    history.saved(saved(history.table))
    assert not history.is_modified
    for _ in range(3):
        history.do(data.draw(edits_of(history.table)))
    assert history.is_modified is (history.position != at)
    history.go(at)
    assert not history.is_modified
    assert bytes_of(history.table) == on_disk
    history.go(0)
    assert bytes_of(history.table) == RAW
    assert history.is_modified is (at != 0)


@given(st.data())
@examples(1)
def test_an_edit_read_back_from_json_does_the_same(data):
    table = table_of()
    for _ in range(3):
        edit = data.draw(edits_of(table))
        again = Edit.from_json(json.loads(json.dumps(edit.to_json())))
        assert again.name == edit.name
        assert bytes_of(again.apply(table)) == bytes_of(edit.apply(table))
        assert again.apply(table).settings == edit.apply(table).settings
        assert again.apply(table).schema == edit.apply(table).schema
        table = edit.apply(table)


@given(st.data())
@examples(1)
def test_a_step_says_which_row_each_row_was(data):
    history = History(table_of())
    for _ in range(data.draw(st.integers(1, 6))):
        history.do(data.draw(edits_of(history.table)))
    for position in data.draw(st.lists(st.integers(0, history.position), min_size=1, max_size=4)):
        origin = history.table.origin
        step = history.go(position)
        came_from = np.arange(len(origin)) if step.came_from is None else step.came_from
        assert len(came_from) == history.table.n_rows
        pairs = zip(history.table.origin.tolist(), np.append(origin, -1)[came_from].tolist(), strict=True)
        assert all(now == before for now, before in pairs if now >= 0 and before >= 0)  # -1: a row that is new, or a copy


@given(st.data())
@examples(1)
def test_the_edit_between_two_tables_leads_from_one_to_the_other(data):
    history = History(table_of())
    for _ in range(data.draw(st.integers(1, 5))):
        history.do(data.draw(edits_of(history.table)))
    before = history.table
    step = history.go(data.draw(st.integers(0, history.position)))
    came_from = np.arange(before.n_rows) if step.came_from is None else step.came_from
    edit = edit_between(before, history.table, came_from, "back")
    assert texts_of(edit.apply(before)) == texts_of(history.table)
    assert edit.apply(before).settings == history.table.settings
    assert schema_to_dict(edit.apply(before).schema) == schema_to_dict(history.table.schema)


@given(tables(), st.data())
def test_an_edited_table_means_what_a_table_made_of_its_texts_means(table, data):
    edit = data.draw(edits_of(table))
    now = edit.apply(table)
    fresh = Table.build("t", now.columns, now.schema, now.settings)
    assert [c.condition.name for c in now.conditions] == [c.condition.name for c in fresh.conditions]
    for one, other in zip(now.conditions, fresh.conditions, strict=True):
        if other.condition.is_declared:
            assert [one.cell(r) for r in range(now.n_rows)] == [other.cell(r) for r in range(now.n_rows)]
    assert len(now.origin) == now.n_rows


def test_an_edit_shares_the_columns_that_it_does_not_touch():
    table = table_of()
    now = edits.set_cells(table, [(0, "speed", "0..9")]).apply(table)
    assert now.text_column("hit") is table.text_column("hit")
    assert now.condition("hit") is table.condition("hit")


def test_edits_have_names_for_people():
    table = table_of()
    assert edits.set_cells(table, [(1, "speed", "0..9")]).name == "Type speed of run"
    nameless = edits.set_cells(table, [(1, table.asset_column, "")]).apply(table)
    assert edits.set_cells(nameless, [(1, table.asset_column, "run")]).name.endswith(" of row 2")
    assert edits.set_cells(table, [(1, "speed", "0..9"), (0, "hit", "Any")]).name == "Change 2 cells"
    assert edits.delete_rows(table, [1]).name == "Delete run"
    assert edits.delete_rows(table, [1, 2, 1]).name == "Delete 2 rows"
    assert edits.move_rows(table, [0], 3).name == "Move walk"
    assert edits.enable_rows(table, [0], False).name == "Disable walk"
    assert edits.rename_column(table, "hit", "is_hit").name == "Rename hit to is_hit"


def test_typing_what_stands_there_already_is_no_step():
    history = History(table_of())
    history.do(edits.set_cells(history.table, [(1, "speed", "5, 1")]))
    assert not history.can_undo
    assert not history.is_modified


def test_an_edit_changes_only_its_line():
    table = table_of()
    now = edits.set_cells(table, [(1, "speed", "5, 2")]).apply(table)
    assert bytes_of(now) == RAW.replace(b'"5, 1"', b'"5, 2"')


def test_rows_keep_their_bytes_when_they_move():
    table = table_of()
    lines = RAW.splitlines(keepends=True)
    assert bytes_of(edits.move_rows(table, [2], 0).apply(table)).splitlines()[1] == lines[3].rstrip()
    assert edits.move_rows(table, [0, 1], 3).apply(table).assets == ['a "b"', "walk", "run"]


def test_a_copied_row_stands_below_and_is_new():
    now = edits.duplicate_rows(table_of(), [0, 1]).apply(table_of())
    assert now.assets == ["walk", "run", "walk", "run", 'a "b"']
    assert now.origin.tolist() == [0, 1, -1, -1, 2]


def test_disabling_a_row_of_a_table_without_a_column_for_it_adds_one():
    table = table_of()
    now = edits.enable_rows(table, [1], False).apply(table)
    assert now.settings.enabled == "Enabled"
    assert now.enabled.tolist() == [True, False, True]
    assert [c.condition.name for c in now.conditions] == ["speed", "hit"]
    again = edits.enable_rows(now, [1], True).apply(now)
    assert again.enabled.tolist() == [True, True, True]
    assert len(again.columns) == 4


def test_a_renamed_column_keeps_what_is_declared_of_it():
    schema = {"speed": {"type": "number", "min": 0.0}}
    table = Table.from_columns({"Asset": ["a"], "speed": ["1..2"]}, schema)
    now = edits.rename_column(table, "speed", "pace").apply(table)
    assert now.condition("pace").condition.domain == table.condition("speed").condition.domain
    assert now.schema.conditions["pace"].name == "pace"


def test_settings_follow_their_columns():
    settings = TableSettings("t", asset="Asset Name", outputs=("hit",), enabled=None)
    table = table_of(settings=settings)
    now = edits.rename_column(table, "hit", "data").apply(table)
    assert now.settings.outputs == ("data",)
    gone = edits.delete_columns(now, ["data"]).apply(now)
    assert gone.settings.outputs == ()
    first = edits.move_column(table, "speed", 0).apply(table)
    assert first.columns[0].name == "speed"
    assert first.assets == table.assets


def test_a_condition_is_declared_as_it_was_understood_with_what_is_said_of_it():
    table = table_of()
    now = edits.set_condition(table, "speed", unit="m/s", min=0).apply(table)
    assert now.schema.conditions["speed"] == Condition("speed", Domain("number", minimum=0.0), "m/s")
    assert now.condition("speed").condition.is_declared
    assert edits.set_condition(now, "speed", unit="m/s").changes == ()


def test_what_has_no_place_under_a_new_type_goes_with_the_old_one():
    table = table_of()
    number = edits.set_condition(table, "speed", type="number", min=0, max=9).apply(table)
    text = edits.set_condition(number, "speed", type="text").apply(number)
    assert text.schema.conditions["speed"] == Condition("speed", Domain("text"))


def test_a_column_that_is_no_condition_any_more_keeps_its_texts():
    table = table_of()
    now = edits.set_settings(table, outputs=["speed"]).apply(table)
    assert [c.condition.name for c in now.conditions] == ["hit"]
    assert texts_of(now) == texts_of(table)
    back = edits.set_settings(now, outputs=None).apply(now)
    assert back.settings == table.settings
    assert [c.condition.name for c in back.conditions] == ["speed", "hit"]


def test_a_declared_condition_gets_no_other_job():
    table = Table.from_columns({"Asset": ["a"], "speed": ["1..2"]}, {"speed": {"type": "number"}})
    with pytest.raises(SchemaError, match="declares as a condition"):
        edits.set_settings(table, outputs=["speed"])


def test_an_assumption_must_read_and_a_type_must_leave_those_there_are():
    table = table_of()
    with pytest.raises(SchemaError, match="hitt"):
        edits.set_settings(table, assume=["not hitt"])
    now = edits.set_settings(table, assume=["not hit"]).apply(table)
    with pytest.raises(SchemaError, match="not hit"):
        edits.set_condition(now, "hit", type="number")
    assert edits.set_condition(now, "hit", type="bool").apply(now).schema.conditions["hit"].domain.kind == "bool"


def test_a_description_reads_no_cell_again():
    table = Table.from_columns({"Asset": ["a"], "speed": ["1..2"]}, {"speed": {"type": "number"}})
    now = edits.set_condition(table, "speed", description="how fast").apply(table)
    assert now.condition("speed").cells is table.condition("speed").cells
    assert now.condition("speed").condition.description == "how fast"


def test_the_columns_of_a_blueprint_come_in_one_step():
    table = table_of()
    new = [edits.NewColumn("a"), edits.NewColumn("b", "output", text="-"), edits.NewColumn("c", declared={"type": "angle"})]
    edit = edits.insert_columns(table, 2, new)
    assert edit.name == "Insert 3 columns"
    now = edit.apply(table)
    assert [c.name for c in now.columns] == ["Asset Name", "speed", "a", "b", "c", "hit"]
    assert now.settings.outputs == ("b",)
    assert now.text_column("b").to_list() == ["-"] * 3
    assert now.condition("c").condition.domain.kind == "angle"


def test_a_blueprint_of_undeclared_conditions_declares_them():
    table = table_of()
    now = edits.set_blueprint(table, "base", ["speed", "hit"]).apply(table)
    assert now.schema.blueprints == {"base": ("speed", "hit")}
    assert {name: c.domain.kind for name, c in now.schema.conditions.items()} == {"speed": "number", "hit": "bool"}
    gone = edits.set_blueprint(now, "base", None).apply(now)
    assert gone.schema.blueprints == {}


MOTION = """
[features.f]
rate = 30
channels = [{ type = "position", bone = "Foot", weight = 1 }]
[databases.a]
clips = "a/*.bvh"
features = "f"
[databases.b]
clips = "b/*.bvh"
features = "f"
[selectors.s]
order = [{ database = "a", threshold = 2 }, { database = "b" }]
"""


def test_a_selector_takes_another_order_and_another_threshold():
    table = Table.build("t", read_csv(RAW, "t.csv")[1], read_schema(MOTION, "contextdb.toml"))
    now = set_selector(table, "s", [("b", 0.5), ("a", None)]).apply(table)
    assert now.schema.selectors["s"] == {"order": [{"database": "b", "threshold": 0.5}, {"database": "a"}]}
    assert set_selector(now, "s", [("b", 0.5), ("a", None)]).changes == ()
    assert set_selector(now, "s", None).apply(now).schema.selectors == {}
    with pytest.raises(SchemaError, match="threshold"):
        set_selector(table, "s", [("a", None), ("b", None)])


@for_each(
    [
        lambda t: edits.delete_columns(t, ["Asset Name"]),
        lambda t: edits.move_column(t, "speed", 0),
        lambda t: edits.move_column(t, "Asset Name", 2),
        lambda t: insert_column(t, 0, "x"),
        lambda t: edits.rename_column(t, "speed", "hit").apply(t),
        lambda t: edits.rename_column(t, "sped", "x"),
        lambda t: edits.set_cells(t, [(3, "speed", "1")]),
        lambda t: edits.insert_rows(t, 4, [{}]),
        lambda t: edits.insert_rows(t, 0, [{"no": "1"}]).apply(t),
        lambda t: edits.delete_rows(t, [-1]),
        lambda t: edits.delete_rows(t, []),
        lambda t: edits.move_rows(t, [0], 4),
        lambda t: edits.reorder_rows(t, [0, 0, 1]),
        lambda t: edits.set_settings(t, policy="all"),
        lambda t: edits.set_settings(t, polcy="first"),
        lambda t: edits.set_settings(t, enabled="sped"),
        lambda t: edits.set_settings(t, enabled="hit", priority="hit"),
        lambda t: edits.set_settings(t, assume=["a", "a"]),
        lambda t: edits.set_condition(t, "speed", type="numbr"),
        lambda t: edits.set_condition(t, "speed", type="number", min=3, max=2),
        lambda t: edits.set_condition(t, "speed", type="number", values=["a"]),
        lambda t: edits.set_condition(t, "speed", type="enum"),
        lambda t: edits.set_condition(t, "sped", type="text"),
        lambda t: edits.set_blueprint(t, "b", ["sped"]),
        lambda t: edits.set_blueprint(t, " ", ["speed"]),
        lambda t: edits.set_blueprint(t, "b", ["speed", "speed"]),
        lambda t: set_selector(t, "s", [("loco", None)]),
        lambda t: edits.insert_columns(t, 1, [edits.NewColumn("a"), edits.NewColumn("a")]).apply(t),
        lambda t: edits.insert_columns(t, 1, [edits.NewColumn("a", declared={"type": "enum"})]).apply(t),
    ]
)
def test_an_edit_that_does_not_fit_is_refused_with_what_is_accepted(make):
    with pytest.raises((TableError, SchemaError)) as refused:
        make(table_of())
    assert refused.value.faults[0].accepted


def test_an_edit_that_is_refused_changes_nothing():
    history = History(table_of())
    bad = edits.set_cells(history.table, [(0, "speed", "1")])
    history.do(edits.delete_columns(history.table, ["speed"]))
    with pytest.raises(TableError):
        history.do(bad)
    assert history.names == ["Delete the column speed"]
    assert history.position == 1


def test_a_typed_cell_is_checked_with_the_nearest_mend():
    angle = Condition("a", Domain("angle"))
    assert edits.check_text(angle, "20, 9.99") is None
    fault = edits.check_text(angle, "20; 9.99")
    assert fault is not None
    assert '"20, 9.99"' in fault.mend


def test_cells_of_settings_columns_are_checked_and_assets_are_free():
    raw = b"A,On,P,W,x\na,True,1,2.5,Any\n"
    table = table_of(raw, TableSettings("t", enabled="On", priority="P", weight="W"))
    assert edits.check_cell(table, "On", "maybe")
    assert edits.check_cell(table, "On", "no") is None
    assert edits.check_cell(table, "P", "1.5")
    assert edits.check_cell(table, "P", "-3") is None
    assert edits.check_cell(table, "W", "-1")
    assert edits.check_cell(table, "W", "") is None
    assert edits.check_cell(table, "A", "any text, at all") is None
    assert edits.check_cell(table, "A", "a\0b")


def test_unreadable_cells_are_taken_and_stand_among_the_faults():
    table = Table.from_columns({"Asset": ["a"], "speed": ["1..2"]}, {"speed": {"type": "number"}})
    now = edits.set_cells(table, [(0, "speed", "fast")]).apply(table)
    assert [f.place.row for f in now.faults] == [0]
