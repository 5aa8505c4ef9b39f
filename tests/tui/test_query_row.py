"""The test row of the editor against query and explain."""

import numpy as np
from edit_strategies import edits_of
from hypothesis import given
from hypothesis import strategies as st
from strategies import contexts, examples, quoted, sets, tables

from contextdb import cell
from contextdb.cells.facts import describe, read_fact
from contextdb.edits import edits
from contextdb.tables.table import Table
from tui.model.query_row import QueryRow

KINDS = ("bool", "int", "number", "angle", "enum", "tags")


@given(tables(KINDS), st.data())
@examples(2)
def test_the_test_row_answers_what_a_query_answers(table, data):
    query = QueryRow(table)
    context = {}
    for column in table.conditions:
        domain = column.condition.domain
        text = data.draw(st.just("") | sets(domain))
        fault = query.set(column.condition.name, text)
        if fault is None and text:
            context[column.condition.name] = cell(text)
    compiled = table.compile()
    expected = compiled.query(context, unknown="any")
    assert query.bits == expected.bits
    fails = query.failing(np.arange(table.n_rows))
    assert ((fails.sum(axis=1) == 0) & table.enabled).tolist() == query.valid.tolist()
    explanation = compiled.explain(context, unknown="any")
    for row in range(table.n_rows):
        named = {c.condition.name for c, f in zip(table.conditions, fails[row], strict=True) if f}
        assert named == {f.condition for f in explanation.row(row).failures}


@given(tables(KINDS), st.data())
@examples(2)
def test_single_values_are_answered_as_a_query_answers_them(table, data):
    given_facts, _ = data.draw(contexts(table))
    query, context = QueryRow(table), {}
    for column in table.conditions:
        name, fact = column.condition.name, read_fact(given_facts[column.condition.name], column.condition)
        text = quoted(fact, always=True) if isinstance(fact, str) else describe(fact, column.condition.domain)
        if not isinstance(fact, frozenset) and query.set(name, text) is None:
            context[name] = query.facts[name]
    assert query.bits == table.compile().query(context, unknown="any").bits


@given(tables(KINDS, least_conditions=1), st.data())
def test_an_edit_leaves_the_test_row_as_one_that_is_made_anew(table, data):
    query = QueryRow(table)
    for column in table.conditions:
        query.set(column.condition.name, data.draw(sets(column.condition.domain)))
    for _ in range(3):
        table = data.draw(edits_of(table)).apply(table)
        query.show(table)
        fresh = QueryRow(table)
        fresh.load(query.texts)
        assert (query.bits, query.facts, query.faults.keys()) == (fresh.bits, fresh.facts, fresh.faults.keys())
        rows = np.arange(table.n_rows)
        assert query.failing(rows).tolist() == fresh.failing(rows).tolist()


def speeds() -> Table:
    schema = {"speed": {"type": "number"}, "hit": {"type": "bool"}}
    return Table.from_columns({"Asset": ["a", "b", "c"], "speed": ["0..5", "Any", "5..9"], "hit": ["True", "Any", "False"]}, schema)


def test_each_fact_alone_says_how_many_rows_it_leaves():
    query = QueryRow(speeds())
    assert query.leaves("speed") is None
    query.set("speed", "7")
    query.set("hit", "True")
    assert (query.leaves("speed"), query.leaves("hit"), query.n_valid) == (2, 2, 1)


def test_a_fact_that_cannot_be_read_says_why_and_is_left_out():
    query = QueryRow(speeds())
    assert query.set("speed", "fast").place.column == "speed"
    assert query.n_valid == 3
    assert query.set("speed", "1") is None
    assert not query.faults


def test_a_row_with_a_cell_that_cannot_be_read_is_never_valid_nor_near():
    table = edits.set_cells(speeds(), [(1, "speed", "fast")]).apply(speeds())
    query = QueryRow(table)
    assert query.valid.tolist() == [True, False, True]
    query.set("speed", "10")
    assert [row.asset for row in query.nearest()] == ["c", "a"]


def test_the_nearest_rows_say_what_would_mend_them():
    query = QueryRow(speeds())
    query.set("speed", "10")
    query.set("hit", "False")
    assert [str(row) for row in query.nearest(1)] == ["c: speed is 10, the cell says 5..9"]


@given(tables(KINDS, least_conditions=1), st.data())
@examples(2)
def test_what_cannot_be_read_takes_away_its_row_and_nothing_else(table, data):
    names = [column.condition.name for column in table.conditions if not column.condition.domain.type.is_tags]
    cells = st.tuples(st.integers(0, max(table.n_rows - 1, 0)), st.sampled_from(names or ["Asset"]))
    wrong = data.draw(st.lists(cells, max_size=4)) if names and table.n_rows else []
    broken = edits.set_cells(table, [(row, name, "5; ~ 3") for row, name in wrong]).apply(table)
    query = QueryRow(broken)
    for column in table.conditions:
        query.set(column.condition.name, data.draw(st.just("") | sets(column.condition.domain)))
    unread = {row for column in broken.conditions for row, _ in column.faulty_rows()}
    sound = [row for row in range(table.n_rows) if row not in unread]
    expected = table.with_rows_taken(sound).compile().query(query.given, unknown="any").indices.tolist()
    assert np.flatnonzero(query.valid).tolist() == [sound[row] for row in expected]
