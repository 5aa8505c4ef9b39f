"""What a change does to contexts: by asset, in gaps and in rows, held against trying every context."""

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

from contextdb.cells.grammar import parse_cell
from contextdb.checks.effects import effects, meet, merge_effects
from contextdb.errors import TableError
from contextdb.tables.table import Table

SCHEMA = {
    "air": {"type": "bool"},
    "way": {"type": "enum", "values": ["N", "E", "S"]},
    "on": {"type": "bool"},
}
VALUES = {"air": (False, True), "way": ("N", "E", "S"), "on": (False, True)}
CELLS = {"air": ["True", "False", "Any"], "way": ["N", "E S", "not N", "Any"], "on": ["True", "False", "Any"]}
CONTEXTS = [dict(zip(VALUES, values, strict=True)) for values in product(*VALUES.values())]


def table(*rows: tuple[str, ...]) -> Table:
    names = ["Asset", *SCHEMA]
    return Table.from_columns({name: [row[i] for row in rows] for i, name in enumerate(names)}, schema=SCHEMA)


def holding(found: Table, asset: str | None = None) -> list[dict[str, object]]:
    """The contexts in which some row is valid, of one asset or of any: every cell of every row is read."""

    def holds(row: int, context: dict[str, object]) -> bool:
        return all(column.cell(row).holds(context[column.condition.name]) for column in found.conditions)

    rows = [row for row, name in enumerate(found.assets) if asset in (None, name)]
    return [context for context in CONTEXTS if any(holds(row, context) for row in rows)]


def inside(boxes, found: Table) -> list[dict[str, object]]:
    """The contexts of some boxes."""
    domains = {column.condition.name: column.condition.domain for column in found.conditions}
    return [
        context
        for context in CONTEXTS
        if any(all(parse_cell(text, domains[name]).holds(context[name]) for name, text in box.cells.items()) for box in boxes)
    ]


def without(some, others):
    return [context for context in some if context not in others]


ROWS = st.lists(st.tuples(st.sampled_from("abc"), *(st.sampled_from(texts) for texts in CELLS.values())), min_size=1, max_size=4)


@examples(0.25)
@given(ROWS, ROWS)
def test_effects_are_those_that_trying_every_context_finds(old, new):
    before, after = table(*old), table(*new)
    found = effects(before, after)
    reached = {reach.asset: reach for reach in found.assets}
    for reach in reached.values():
        if {before.assets.count(reach.asset), after.assets.count(reach.asset)} <= {1}:
            assert reach.share_gained == pytest.approx(len(inside(reach.gained, after)) / len(CONTEXTS))
            assert reach.share_lost == pytest.approx(len(inside(reach.lost, after)) / len(CONTEXTS))
    assert inside(found.opened, after) == without(holding(before), holding(after))
    assert inside(found.closed, after) == without(holding(after), holding(before))


def test_a_column_of_another_type_is_refused_with_its_name():
    before = Table.from_columns({"Asset": ["a"], "x": ["True"]}, schema={"x": {"type": "bool"}})
    after = Table.from_columns({"Asset": ["a"], "x": ["5"]}, schema={"x": {"type": "number"}})
    with pytest.raises(TableError, match='"x" is of the type bool before and of the type number after'):
        effects(before, after)


def test_a_value_that_is_declared_no_more_can_still_be_lost():
    before, after = (
        Table.from_columns({"Asset": ["a"], "way": [text]}, schema={"way": {"type": "enum", "values": values}})
        for text, values in (("N", ["N", "S"]), ("S", ["S", "E"]))
    )
    (reach,) = effects(before, after).assets
    assert [box.cells for box in (*reach.gained, *reach.lost)] == [{"way": "S"}, {"way": "N"}]


def test_the_same_change_gives_the_same_effects():
    one, other = table(("a", "True", "N", "Any")), table(("a", "Any", "N E", "False"))
    assert effects(one, other).to_json() == effects(one, other).to_json()


def test_assets_beyond_the_limit_are_counted():
    rows = [(name, "True", "Any", "Any") for name in "abcde"]
    found = effects(table(*rows), table(*((name, "False", "Any", "Any") for name in "abcde")), most=2)
    assert (len(found.assets), found.n_left_out, found.is_complete) == (2, 3, False)


def test_a_merge_tells_the_contexts_that_both_sides_covered():
    ours = table(("a", "True", "Any", "Any"), ("b", "Any", "N", "Any"))
    theirs = table(("a", "Any", "N", "Any"), ("b", "True", "Any", "Any"))
    merged = table(("a", "Any", "N", "Any"), ("b", "Any", "N", "Any"))
    found = merge_effects(ours, theirs, merged)
    assert inside(found.opened, merged) == without(holding(ours), holding(merged))
    assert not merge_effects(ours, merged, merged)


def test_tags_that_no_single_cell_holds_are_told_in_several():
    schema = {"state": {"type": "tags", "values": ["Move", "Move.Run", "InAir"]}, "p": {"type": "bool"}}
    columns = [{"Asset": ["a"], "state": ["-Move"], "p": ["Any"]}, {"Asset": ["a"], "state": ["not +Move -InAir"], "p": ["Any"]}]
    effects_of = effects(*(Table.from_columns(some, schema) for some in columns))
    assert [box.cells for box in effects_of.closed] == [{"state": "+InAir +Move"}]
    conditions = {column.condition.name: column.condition for column in Table.from_columns(columns[0], schema).conditions}
    assert meet({"state": "+Move.Run"}, {"state": "not +Move -InAir"}, conditions) == [{"state": "+InAir +Move.Run"}]
    both = meet({"state": "-Move.Run"}, {"state": "not +Move -InAir"}, conditions)
    assert both == [{"state": "-Move -Move.Run"}, {"state": "+InAir -Move.Run"}]
