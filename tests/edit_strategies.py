"""Examples for property tests of edits: any edit that a person could make to a table."""

from typing import Any

from hypothesis import strategies as st

from contextdb.edits import edits
from contextdb.edits.schema_file import schema_change
from contextdb.tables.changes import Edit
from contextdb.tables.table import Table

TEXTS = [
    "Any",
    "",
    "True",
    "20, 9.99",
    "5..3",
    "0..5 | 10..15",
    "CB FS",
    'say ""no""',
    "a,b",
    'a"b',
    "zwei\nZeilen",
    " x ",
    "~~",
    "+A -B",
]
KINDS = ["cells", "insert", "delete", "duplicate", "move", "reorder", "enable", "column", "drop", "shift", "rename"]
KINDS += ["settings", "declare", "blueprint", "columns"]
PARTS = [{"type": "number", "min": 0.0, "max": 9.5}, {"type": "enum", "values": ["CB", "FS"]}, {"type": "tags"}, {"type": "text"}]


@st.composite
def edits_of(draw: st.DrawFn, table: Table) -> Edit:
    """An edit that fits a table."""
    n_rows, names = table.n_rows, [c.name for c in table.columns]
    others = [n for n in names if n != table.asset_column]
    fitting = [k for k in KINDS if (n_rows or k in ("insert", "column")) and (others or k not in ("drop", "shift"))]
    kind = draw(st.sampled_from(fitting))
    a_row = st.integers(0, max(n_rows - 1, 0))
    some_rows = st.lists(a_row, min_size=1, max_size=4)
    texts = st.sampled_from(TEXTS)
    if kind == "cells":
        return edits.set_cells(table, draw(st.lists(st.tuples(a_row, st.sampled_from(names), texts), max_size=20)))
    if kind == "insert":
        rows = draw(st.lists(st.dictionaries(st.sampled_from(names), texts), max_size=3))
        return edits.insert_rows(table, draw(st.integers(0, n_rows)), rows)
    if kind == "delete":
        return edits.delete_rows(table, draw(some_rows))
    if kind == "duplicate":
        return edits.duplicate_rows(table, draw(some_rows))
    if kind == "move":
        return edits.move_rows(table, draw(some_rows), draw(st.integers(0, n_rows)))
    if kind == "reorder":
        return edits.reorder_rows(table, draw(st.permutations(range(n_rows))))
    if kind == "enable":
        return edits.enable_rows(table, draw(some_rows), draw(st.booleans()))
    free = [n for n in ("new", "Neu ä", "x,y", "speed 2", "q") if n not in names]
    place = st.integers(1, len(names))
    if kind == "column" and free:
        declared = draw(st.none() | st.just({"type": "number", "min": 0.0}))
        name = draw(st.sampled_from(free))
        can_be_output = declared is None and name not in table.schema.conditions  # a deleted column leaves its declaration
        job = draw(st.sampled_from(["condition", "output"] if can_be_output else ["condition"]))
        return insert_column(table, draw(place), name, job, declared, draw(st.sampled_from(["", "5"])))
    if kind == "columns" and free:
        new = [edits.NewColumn(name, "condition", draw(st.none() | st.sampled_from(PARTS))) for name in free[:2]]
        return edits.insert_columns(table, draw(place), new)
    if kind == "settings":
        plain = [n for n in others if n not in table.schema.conditions]
        first, second, *rest = [*(draw(st.permutations(plain)) if plain else []), None, None]
        said = {"enabled": first, "priority": second, "outputs": [name for name in rest if name]}
        chosen = {key: said.get(key) for key in draw(st.sets(st.sampled_from(["enabled", "priority", "outputs"])))}
        others_too = dict.fromkeys({"enabled", "priority", "weight", "outputs"} - chosen.keys())
        return edits.set_settings(table, **chosen, **others_too, policy=draw(st.sampled_from(["collect", "first"])))
    conditions = [c.condition.name for c in table.conditions]
    if kind == "declare" and conditions:
        return edits.set_condition(table, draw(st.sampled_from(conditions)), **draw(st.sampled_from(PARTS)))
    if kind == "blueprint" and conditions:
        return edits.set_blueprint(table, "b", draw(st.none() | st.lists(st.sampled_from(conditions), unique=True)))
    if kind == "drop":
        return edits.delete_columns(table, [draw(st.sampled_from(others))])
    if kind == "shift":
        return edits.move_column(table, draw(st.sampled_from(others)), draw(place))
    if kind == "rename" and free:
        return edits.rename_column(table, draw(st.sampled_from(names)), draw(st.sampled_from(free)))
    return edits.set_cells(table, [])


def insert_column(table: Table, at: int, *new: Any, **said: Any) -> Edit:
    """Insert one column before column `at`."""
    return edits.insert_columns(table, at, [edits.NewColumn(*new, **said)])


def write_schema(before: Table | None, after: Table) -> bool:
    """Write what `after` says differently from `before`; gives whether there was something to write.

    The parameters and errors are those of `schema_change`.
    """
    change = schema_change(before, after)
    if change is not None:
        change.write()
    return change is not None
