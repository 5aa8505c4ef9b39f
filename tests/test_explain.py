"""Explanations: which cells of which rows fail, what is nearest, and what to change; held to reading every cell."""

import math
from itertools import pairwise
from unittest import mock

import numpy as np
import oracles
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from strategies import for_each

from contextdb import bitmask
from contextdb.cells.domains import Domain
from contextdb.cells.facts import cell
from contextdb.cells.grammar import parse_cell
from contextdb.compiled.classes import ColumnMasks
from contextdb.compiled.explain import Explanation
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.errors import ContextError
from contextdb.schema.settings import TableSettings
from contextdb.tables.table import Table

UNKNOWN = st.sampled_from(["any", "never"])
PLAY = {"state": {"type": "enum", "values": ["Ground", "Air"]}, "speed": {"type": "number", "min": 0, "max": 10, "unit": "m/s"}}


def table_of(kind: str, *cells: str, **more: object) -> CompiledTable:
    """A table of one condition `x`."""
    rows = [f"row {i}" for i in range(len(cells))]
    return Table.from_columns({"Asset": rows, "x": list(cells)}, {"x": {"type": kind, **more}}).compile()


def mend_of(kind: str, text: str, fact: object, unknown: str = "error", **more: object) -> str:
    """The cell that is suggested instead of one that fails."""
    (failure,) = table_of(kind, text, **more).explain({"x": fact}, unknown=unknown).row(0).failures
    return failure.mend


# ---- held to reading every cell


def failing(table: Table, context: dict[str, object], row: int, unknown: str) -> list[str]:
    """The conditions whose cell of this row does not accept (any value of) the fact."""
    return [
        name
        for name, domain, texts in oracles.columns(table)
        if not any(oracles.passes(texts[row], domain, fact, unknown) for fact in oracles.values(context.get(name)))
    ]


def gap(text: str, domain: Domain, fact: float) -> float:
    """How far a number is from the nearest one that a cell holds; infinite where it holds none."""
    held = [v for v in oracles.representatives([text], domain) if oracles.accepts(text, domain, v)]
    gaps = [abs(v - fact) for v in held]
    return min([min(g, 360.0 - g) if domain.kind == "angle" else g for g in gaps], default=math.inf)


def distance(compiled: CompiledTable, table: Table, context: dict[str, object], row: int, unknown: str) -> float:
    """What the failing facts of a row add up to: a number by its share of the domain's width, anything else 1."""
    far = 0.0
    for at, (name, domain, texts) in enumerate(oracles.columns(table)):
        fact = context.get(name)
        if name in failing(table, context, row, unknown):
            is_number = isinstance(fact, float) and math.isfinite(fact)
            far += min(gap(texts[row], domain, fact) / width(domain, data_of(compiled).masks[at]), 1.0) if is_number else 1.0
    return far


def width(domain: Domain, masks: ColumnMasks) -> float:
    """The declared width of a domain, or from the first to the last number where the column's answers change."""
    if domain.kind == "angle":
        return 180.0
    if math.isfinite(domain.maximum - domain.minimum):
        return domain.maximum - domain.minimum
    spread = np.ptp(masks.bounds) if masks.bounds.size else 0.0
    is_one_number = masks.bounds.size == 2 and masks.bounds[1] == np.nextafter(masks.bounds[0], np.inf)
    return 1.0 if is_one_number or not spread else min(float(spread), 1.7976931348623157e308)


@given(strategies.tables(), st.data(), UNKNOWN)
def test_each_row_fails_with_the_cells_that_reading_them_finds(table: Table, data: st.DataObject, unknown: str):
    context, plain = data.draw(strategies.contexts(table, has_missing=True, has_sets=True))
    explanation = table.compile().explain(context, unknown=unknown)
    assert len(explanation) == table.n_rows
    for row in range(table.n_rows):
        found = explanation.row(row)
        assert [f.condition for f in found.failures] == failing(table, plain, row, unknown)
        assert [f.cell for f in found.failures] == [table.text(row, f.condition) for f in found.failures]
        assert (found.row, found.asset, found.is_enabled) == (row, table.assets[row], oracles.is_enabled(table, row))
    valid = [row for row in range(table.n_rows) if explanation.row(row).is_valid]
    assert valid == explanation.matches.indices.tolist() == oracles.rows(table, plain, unknown)
    assert bitmask.rows(explanation.matches.always).tolist() == oracles.rows_always(table, plain, unknown)


@given(strategies.tables(), st.data(), UNKNOWN)
def test_rows_come_valid_first_then_with_fewest_failures_then_the_least_far_off(table: Table, data: st.DataObject, unknown: str):
    context, plain = data.draw(strategies.contexts(table, has_missing=True, has_sets=True))
    compiled = table.compile()
    explanation = compiled.explain(context, unknown=unknown)
    order = explanation._order.tolist()
    assert sorted(order) == list(range(table.n_rows))
    n_failures = [len(failing(table, plain, r, unknown)) + (not oracles.is_enabled(table, r)) for r in range(table.n_rows)]
    assert explanation._n_failures.tolist() == n_failures
    assert order[: len(explanation.matches)] == explanation.matches.indices.tolist()
    told = [(n_failures[r], distance(compiled, table, plain, r, unknown)) for r in order]
    for (n, far), (next_n, next_far) in pairwise(told):
        assert n < next_n or (n == next_n and far <= next_far + 1e-9)
    most = data.draw(st.integers(0, 6))
    assert [r.row for r in explanation.nearest(most)] == order[len(explanation.matches) :][:most]


@given(strategies.tables(), st.data(), UNKNOWN)
def test_rows_with_the_same_cells_stay_in_the_order_of_the_file(table: Table, data: st.DataObject, unknown: str):
    context, _ = data.draw(strategies.contexts(table, has_missing=True, has_sets=True))
    place = np.argsort(table.compile().explain(context, unknown=unknown)._order)
    cells = [tuple(texts[row] for _, _, texts in oracles.columns(table)) for row in range(table.n_rows)]
    keys = [(oracles.is_enabled(table, row), cells[row]) for row in range(table.n_rows)]
    for key in set(keys):
        places = [int(place[row]) for row in range(table.n_rows) if keys[row] == key]
        assert places == sorted(places)


@given(strategies.tables(), st.data(), UNKNOWN)
def test_a_row_whose_failing_cells_are_changed_as_said_is_valid(table: Table, data: st.DataObject, unknown: str):
    context, _ = data.draw(strategies.contexts(table, has_missing=True, has_sets=True))
    explanation = table.compile().explain(context, unknown=unknown)
    rows = explanation._order.tolist()[:: max(1, table.n_rows // 8)]
    edits = [(row, f.condition, f.mend) for row in rows for f in explanation.row(row).failures]
    mended = table.with_cells(edits).compile().query(context, unknown=unknown).rows.tolist()
    assert [row for row in rows if oracles.is_enabled(table, row) and row not in mended] == []


@given(strategies.tables(least_conditions=1), st.data(), UNKNOWN)
def test_a_changed_cell_still_accepts_all_that_the_old_one_did(table: Table, data: st.DataObject, unknown: str):
    context, _ = data.draw(strategies.contexts(table, has_missing=True, has_sets=True))
    domains = {name: domain for name, domain, _ in oracles.columns(table)}
    failures = {(f.condition, f.cell, f.mend) for row in table.compile().explain(context, unknown=unknown) for f in row.failures}
    for name, old, new in failures:
        for value in oracles.representatives([old, new], domains[name]):
            assert oracles.accepts(new, domains[name], value) or not oracles.accepts(old, domains[name], value)


@given(strategies.tables(("int", "number", "angle"), least_conditions=1), st.data())
def test_a_changed_number_cell_accepts_no_more_than_what_lies_between_the_old_one_and_the_fact(table: Table, data: st.DataObject):
    context, plain = data.draw(strategies.contexts(table))
    domains = {name: domain for name, domain, _ in oracles.columns(table)}
    failures = {(f.condition, f.cell, f.mend) for row in table.compile().explain(context) for f in row.failures}
    for name, old, new in failures:
        domain, fact = domains[name], plain[name]
        far = gap(old, domain, fact)
        added = [v for v in oracles.representatives([old, new], domain) if not oracles.accepts(old, domain, v)]
        for value in (v for v in added if oracles.accepts(new, domain, v) and v != fact):
            off = abs(value - fact)
            off = min(off, 360.0 - off) if domain.kind == "angle" else off
            assert off <= far
            assert any(oracles.accepts(old, domain, v) for v in oracles.representatives([old], domain))


# ---- what to change, by example


@for_each(
    [
        ("number", "10..30", 5.0, "5..30"),
        ("number", "10..30", 31.5, "10..31.5"),
        ("number", "(10..30)", 10.0, "[10..30)"),
        ("number", "10..", 5.0, "5.."),
        ("number", "..10", 11.0, "..11"),
        ("number", "0..5 | 10..15", 9.0, "0..5 | 9..15"),
        ("number", "0..5 | 10..15", 7.0, "0..7 | 10..15"),
        ("number", "0..5 | 10..15", math.inf, "0..5 | 10.."),
        ("number", "0..5 | 10..15", -math.inf, "..5 | 10..15"),
        ("number", "not 1..2", 1.25, "..1.25 | (2.."),
        ("number", "5..3", 4.0, "4"),
        ("number", "not 5", 5.0, "Any"),
        ("angle", "not 5", 5.0, "Any"),
        ("int", "1..3", 5, "1..5"),
        ("angle", "170, 20", 140.0, "140..-170"),
        ("angle", "10..30", -5.0, "-5..30"),
        ("angle", "160..170", -175.0, "160..-175"),
        ("angle", "-170..-160", 175.0, "175..-160"),
        ("angle", "(5..5)", 90.0, "90"),
        ("bool", "True", False, "Any"),
        ("bool", "not Any", True, "True"),
        ("text", "run", "walk", "run walk"),
        ("text", "not walk run", "walk", "not run"),
        ("text", "not walk", "walk", "Any"),
        ("tags", "+InAir -Stunned", ["InAir", "Stunned"], "+InAir"),
        ("tags", "+InAir -Stunned", [], "-Stunned"),
        ("tags", "-Move", ["Move.Run"], "Any"),
        ("tags", "+Move.Run -Move", ["Move.Run"], "+Move.Run"),
        ("tags", "not +InAir", ["InAir"], "Any"),
    ]
)
def test_the_suggested_cell_is_the_old_one_stretched_to_the_fact(kind: str, text: str, fact: object, mend: str):
    assert mend_of(kind, text, fact) == mend


def test_the_suggested_cell_of_an_enum_keeps_the_order_of_its_values():
    assert mend_of("enum", "SS", "CB", values=["CB", "FS", "SS"]) == "CB SS"
    assert mend_of("enum", "not CB", "CB", values=["CB", "FS", "SS"]) == "CB FS SS"


def test_an_angle_a_hair_below_the_cell_stretches_it_by_that_hair_and_not_the_whole_way_round():
    assert mend_of("angle", "20.000000000000004..30", 20.0) == "20..30"
    assert mend_of("angle", "-180..-170", math.nextafter(180.0, 0.0)) == "179.99999999999997..-170"


def test_a_fact_of_many_digits_is_rounded_away_from_the_cell_where_it_stays_near():
    assert mend_of("number", "2.8..4.6", 1.3165655792130349) == "1.316..4.6"
    assert mend_of("number", "0..1", 1.3165655792130349) == "0..1.317"
    assert mend_of("number", "0..1", -1.3165655792130349) == "-1.317..1"
    assert mend_of("angle", "0..10", 59.65371234567891) == "0..59.66"
    assert mend_of("number", "0..1", 1.0000000000000002) == "0..1.0000000000000002"
    assert mend_of("number", "0..5", 1234567.8901234567) == "0..1235000"
    assert mend_of("number", "0..5", 56 * 0.1) == "0..5.601"  # 5.6000000000000005, which 5.6 leaves out
    assert mend_of("number", "not 0.30000000000000004", 3 * 0.1) == "Any"  # 0.3 is the cell's already
    assert mend_of("number", "0..5", -3 * 0.1) == "-0.3001..5"  # -0.30000000000000004


def test_a_number_with_many_digits_is_left_in_the_old_words_of_the_cell():
    assert 20 + 9.99 == 29.990000000000002
    assert mend_of("angle", "20, 9.99", 5) == "20, 9.99 | 5..10.01"
    assert mend_of("number", "20, 9.99", 35) == "10.01..35"


def test_a_set_of_facts_is_added_as_a_whole():
    assert mend_of("number", "0..5", cell("8..9 | 12")) == "0..5 | 8..9 | 12"
    assert mend_of("angle", "0..5", cell("170..-170")) == "0..5 | 170..-170"
    assert mend_of("enum", "A", cell("C B"), values=["A", "B", "C", "D"]) == "A B C"
    assert mend_of("text", "A", cell("not A B")) == "not B"
    assert mend_of("tags", "+A", cell("-A")) == "Any"
    assert mend_of("number", "5..3", cell("Any")) == "Any"


# ---- the words, and asking for one row


PLAYS = Table.from_columns(
    {"Asset": ["run", "jump", "fall", "run"], "state": ["Ground", "Air", "Air", "Air"], "speed": ["3..6", "0..4", "Any", "8.."]},
    PLAY,
).compile()


def test_a_failure_says_the_fact_with_its_unit_and_the_cell_as_it_is_written():
    explanation = PLAYS.explain({"state": "Ground", "speed": 7})
    assert str(explanation.row(0)) == "run: speed is 7 m/s, the cell says 3..6"
    assert str(explanation.row(1)) == "jump: state is Ground, the cell says Air; speed is 7 m/s, the cell says 0..4"
    assert str(PLAYS.explain({"state": "Ground", "speed": 5}).row(0)) == "run: valid"


@pytest.mark.parametrize(
    ("kind", "text", "fact", "told"),
    [
        ("number", "2.8..4.6", 1.3165655792130349, "1.317"),
        ("number", "1.3166..2", 1.3165655792130349, "1.31657"),
        ("number", "2..3", 1.25, "1.25"),
        ("angle", "-90..90", 179.56952959920164, "179.6"),
        ("angle", "-90..90", -179.99999999920164, "-179.999999999"),
    ],
)
def test_a_failure_says_a_number_of_many_digits_in_as_few_as_mean_the_same(kind: str, text: str, fact: float, told: str):
    (failure,) = table_of(kind, text).explain({"x": fact}).row(0).failures
    assert failure.fact == told


def test_an_explanation_as_text_says_how_many_rows_are_valid_and_lists_the_first_ten():
    many = Table.from_columns({"Asset": [f"a{i}" for i in range(12)], "x": ["1"] * 11 + ["2"]}, {"x": {"type": "number"}}).compile()
    lines = str(many.explain({"x": 2})).splitlines()
    assert lines[0] == "1 of 12 rows valid"
    assert lines[1:3] == ["a11: valid", "a0: x is 2, the cell says 1"]
    assert len(lines) == 11


def test_for_an_empty_answer_the_nearest_rows_tell_the_one_or_two_cells_to_change():
    explanation = PLAYS.explain({"state": "Ground", "speed": 7})
    assert not explanation.matches
    nearest = explanation.nearest(2)
    assert [(r.row, [(f.condition, f.mend) for f in r.failures]) for r in nearest] == [
        (0, [("speed", "3..7")]),
        (2, [("state", "Ground Air")]),
    ]


def test_rows_are_asked_for_by_number_and_by_asset():
    explanation = PLAYS.explain({"state": "Air", "speed": 9})
    assert [(r.row, r.is_valid) for r in explanation.asset("run")] == [(0, False), (3, True)]
    with pytest.raises(ContextError, match='has no asset "swim"'):
        explanation.asset("swim")
    assert explanation[0].row == 2
    assert explanation.facts == {"state": "Air", "speed": 9.0}


def test_a_disabled_row_is_not_valid_and_says_so():
    table = Table.from_columns(
        {"Asset": ["a", "b", "c"], "On": ["False", "True", "False"], "x": ["1", "2", "3"]},
        {"x": {"type": "number"}},
        TableSettings("t", enabled="On"),
    )
    explanation = table.compile().explain({"x": 1})
    assert not explanation.matches
    assert str(explanation.row(0)) == "a: the row is disabled"
    assert str(explanation.row(2)) == "c: x is 1, the cell says 3; the row is disabled"
    assert explanation._order.tolist() == [0, 1, 2]
    assert explanation._n_failures.tolist() == [1, 1, 2]


def test_a_fact_that_cannot_be_used_is_refused_as_in_a_query():
    with pytest.raises(ContextError, match="is missing"):
        PLAYS.explain({"state": "Air"})
    with pytest.raises(ContextError, match='Did you mean "Ground"'):
        PLAYS.explain({"state": "Gruond", "speed": 1})


def test_tables_without_rows_or_conditions_are_explained():
    assert list(table_of("number").explain({"x": 1})) == []
    bare = Table.from_columns({"Asset": ["a", "b"]}).compile()
    assert [str(r) for r in bare.explain({})] == ["a: valid", "b: valid"]


def test_a_table_whose_cells_were_mended_by_an_edit_is_explained():
    table = Table.from_columns({"Asset": ["a", "b"], "x": ["1..2", "3"]}, {"x": {"type": "number"}})
    mended = table.with_cell(0, "x", "no number").with_cell(0, "x", "5")
    assert [str(r) for r in mended.compile().explain({"x": 4.5})] == [
        "a: x is 4.5, the cell says 5",
        "b: x is 4.5, the cell says 3",
    ]


def test_numbers_at_the_end_of_the_doubles_are_ordered_by_distance():
    explanation = table_of("number", "-1.7e308", "1.7e308").explain({"x": 1e308})
    assert explanation._order.tolist() == [1, 0]


# ---- only what is asked for is worked out


def test_details_are_worked_out_only_for_the_rows_that_are_asked_for():
    n_rows = 10_000
    texts = [f"{i}..{i + 1}" for i in range(n_rows)]
    columns = {"Asset": [f"a{i}" for i in range(n_rows)], "x": texts}
    compiled = Table.from_columns(columns, {"x": {"type": "number"}}).compile()
    with (
        mock.patch.object(Explanation, "_failures", autospec=True, side_effect=Explanation._failures) as told,
        mock.patch("contextdb.compiled.explain.parse_cell", side_effect=parse_cell) as read,
    ):
        explanation = compiled.explain({"x": 20_000.0})
        assert read.call_count == told.call_count == 0
        assert [r.row for r in explanation.asset("a9993")] == [9993]
        assert told.call_count == 1
        assert read.call_count == 1


def test_the_nearest_of_many_rows_are_found_without_reading_those_that_fail_more():
    n_rows = 5_000
    columns = {
        "Asset": [f"a{i}" for i in range(n_rows)],
        "x": [f"{i}" for i in range(n_rows)],
        "y": ["1" if i % 100 else "2" for i in range(n_rows)],
    }
    compiled = Table.from_columns(columns, {"x": {"type": "number"}, "y": {"type": "number"}}).compile()
    with mock.patch("contextdb.compiled.explain.parse_cell", side_effect=parse_cell) as read:
        explanation = compiled.explain({"x": 2_049.5, "y": 2})
        assert [r.row for r in explanation.nearest(2)] == [2_000, 2_100]
    assert read.call_count <= n_rows / 100 + 4
