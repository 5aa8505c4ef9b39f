"""Tables inside tables: what is asked of the outer table is what its rows and the rows inside them answer, one by one."""

import math
import random
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import oracles
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from nested_tables import NAMES, Nest, cost_of, is_valid, nests, pickable
from strategies import TAGS, contexts

import contextdb as cdb
from contextdb import bitmask
from contextdb.cells.grammar import format_cell
from contextdb.compiled.pick import Outcome
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.schema.settings import TableSettings
from contextdb.tables.project import Project, around_each_other

UNKNOWNS = st.sampled_from(["error", "any", "never"])


def assert_answers(compiled: CompiledTable, nest: Nest, given: dict, plain: dict, unknown: str) -> None:
    ways = nest.ways()
    valid = [row for row, way in enumerate(ways) if is_valid(nest, way, plain, unknown)]
    found = compiled.query(given, unknown=unknown)
    assert found.indices.tolist() == valid
    assert found.leaves == [table.assets[row] for table, row in (ways[r][-1] for r in valid)]
    assert found.flags.sum() == len(found)
    always = [row for row, way in enumerate(ways) if is_valid(nest, way, plain, unknown, all)]
    assert bitmask.rows(found.always).tolist() == always
    expected = [cost_of(way, plain, unknown) for way in ways]
    assert np.allclose(found.penalties, expected)


# ---- the same as by hand


@given(nests(), st.data())
def test_a_nested_table_answers_what_its_rows_and_those_inside_answer_one_by_one(nest: Nest, data: st.DataObject):
    given_facts, plain = data.draw(contexts(nest.all_cells()))
    assert_answers(nest.outer.compile(nest.tables), nest, given_facts, plain, "error")


@given(nests(), st.sampled_from(["any", "never"]), st.data())
def test_missing_and_set_valued_facts_mean_the_same_through_the_nesting(nest: Nest, unknown: str, data: st.DataObject):
    given_facts, plain = data.draw(contexts(nest.all_cells(), has_missing=True, has_sets=True))
    assert_answers(nest.outer.compile(nest.tables), nest, given_facts, plain, unknown)


@given(nests(("tags",)), st.data())
def test_tags_that_no_single_cell_can_say_meet_exactly(nest: Nest, data: st.DataObject):
    given_facts, plain = data.draw(contexts(nest.all_cells(), has_sets=True))
    assert_answers(nest.outer.compile(nest.tables), nest, given_facts, plain, "any")


@given(nests(), st.data())
def test_many_contexts_and_a_live_one_answer_as_single_ones(nest: Nest, data: st.DataObject):
    compiled = nest.outer.compile(nest.tables)
    asked = [data.draw(contexts(nest.all_cells()))[0] for _ in range(3)]
    names = list(data_of(compiled).places)
    asked = [{name: context[name] for name in names} for context in asked]
    single = [compiled.query(context) for context in asked]
    many = compiled.query_many({name: [context[name] for context in asked] for name in names} if names else {})
    if names:
        assert many.mask.tolist() == [m.mask.tolist() for m in single]
    live = compiled.live(asked[0])
    for context, expected in zip(asked, single, strict=True):
        live.update(context)
        assert live.matches() == expected
        assert np.allclose(live.matches().penalties, expected.penalties)


@given(nests(), UNKNOWNS, st.data())
def test_an_opened_artefact_answers_as_the_table_does(tmp_path_factory, nest: Nest, unknown: str, data: st.DataObject):
    compiled = nest.outer.compile(nest.tables)
    path = tmp_path_factory.getbasetemp() / "nested.safetensors"
    compiled.save(path)
    opened = CompiledTable.open(path)
    given_facts, plain = data.draw(contexts(nest.all_cells(), has_missing=unknown != "error"))
    assert_answers(opened, nest, given_facts, plain, unknown)
    assert [opened.way(row) for row in range(opened.n_rows)] == [compiled.way(row) for row in range(compiled.n_rows)]
    assert [data_of(opened).cells(at) for at in range(len(opened.conditions))] == [
        data_of(compiled).cells(at) for at in range(len(opened.conditions))
    ]
    picks = [c.pick(given_facts, rng=7, unknown=unknown) for c in (compiled, opened)]
    assert picks[0] == picks[1]


@given(nests(), st.data())
def test_the_cells_that_an_explanation_names_are_those_that_fail(nest: Nest, data: st.DataObject):
    given_facts, plain = data.draw(contexts(nest.all_cells()))
    compiled = nest.outer.compile(nest.tables)
    explained = compiled.explain(given_facts)
    for row, way in enumerate(nest.ways()):
        failing = [
            (table.name, inner, column.condition.name)
            for column_name in data_of(compiled).places
            for table, inner in way
            for column in table.conditions
            if column.condition.name == column_name
            and not oracles.passes(column.texts[inner], column.condition.domain, plain[column_name])
        ]
        failures = explained.row(row).failures
        found = [(f.step.table, f.step.row, f.condition) if f.step else ("outer", row, f.condition) for f in failures]
        assert found == failing
    assert len(explained.nearest(10**6)) == len(nest.ways()) - len(explained.matches)
    n_failing = [len(row.failures) + (not row.is_enabled) for row in explained.nearest(10**6)]
    assert n_failing == sorted(n_failing), "as many as the pages say: cells, not conditions"


@given(nests(), st.integers(0, 2**32), st.data())
def test_a_pick_goes_through_the_tables_one_by_one(nest: Nest, seed: int, data: st.DataObject):
    given_facts, _ = data.draw(contexts(nest.all_cells()))
    compiled = nest.outer.compile(nest.tables)
    matches = compiled.query(given_facts)
    possible = {compiled.assets[row] for row in pickable(nest, matches.indices.tolist())}
    outcome = Outcome(data_of(compiled), matches)
    assert set(outcome.candidates.tolist()) == pickable(nest, matches.indices.tolist()) == set(outcome.chances)
    assert sum(outcome.chances.values()) == pytest.approx(1.0 if possible else 0.0)
    assert {row for row in matches.rows.tolist() if outcome.said_of([row]).startswith("picked")} == set(outcome.chances)
    rng = random.Random(seed)
    picked = [compiled.pick(given_facts, rng) for _ in range(6)]
    assert set(picked) <= (possible or {None})
    has_chance = any(t.settings.policy != "first" for t in (nest.outer, *nest.tables.values()))
    if has_chance and len(possible) > 1:
        assert all(one != other for one, other in pairwise(picked))


@given(nests(("bool", "int", "enum"), most_rows=4), st.data())
def test_the_covered_share_is_that_of_the_rows_by_hand(nest: Nest, data: st.DataObject):
    compiled = nest.outer.compile(nest.tables)
    by_hand = hand_flattened(nest)
    report, expected = cdb.coverage(compiled, samples=0), cdb.coverage(by_hand, samples=0)
    assert math.isclose(report.covered, expected.covered, abs_tol=1e-12)
    assert [gap.share for gap in report.gaps] == [gap.share for gap in expected.gaps]
    assert np.allclose(report.hits, expected.hits)


def hand_flattened(nest: Nest) -> cdb.Table:
    """The flat table with the cells of each way written as one."""
    flat = nest.outer.flat(nest.tables)
    columns: dict[str, list[str]] = {"Asset": flat.assets, "On": [str(bool(on)) for on in flat.enabled]}
    for column in flat.conditions:
        cells, domain = map(column.cell, range(flat.n_rows)), column.condition.domain
        columns[column.condition.name] = ["Any" if cell.is_soft else format_cell(cell, domain) for cell in cells]
    return cdb.Table.from_columns(columns, nest.outer.schema, TableSettings("outer", enabled="On"))


@given(nests(("tags",), most_rows=3))
def test_the_covered_share_of_tags_is_that_of_every_set_of_tags(nest: Nest):
    declared = [c.domain.values for c in nest.outer.schema.conditions.values()]
    if len(declared) > 1 or declared[0] is None:
        return
    compiled = nest.outer.compile(nest.tables)
    sets = [frozenset(tags) for n in range(len(TAGS) + 1) for tags in combinations(TAGS, n)]
    valid = [bool(compiled.query(dict.fromkeys(data_of(compiled).places, tags))) for tags in sets]
    assert math.isclose(cdb.coverage(compiled, samples=0).covered, sum(valid) / len(sets), abs_tol=1e-12)


@given(nests(("bool", "int", "enum")), st.data())
def test_a_row_that_is_called_never_chosen_is_never_picked(nest: Nest, data: st.DataObject):
    compiled = nest.outer.compile(nest.tables)
    never = {f.row for f in cdb.coverage(compiled, samples=0).findings if f.rule == "never-chosen"}
    domains = {c.name: c.domain for c in compiled.conditions}
    bounds = {name: (d.minimum, d.maximum) for name, d in domains.items() if d.kind == "int"}
    for _ in range(4):
        given_facts, _ = data.draw(contexts(nest.all_cells()))
        assume(all(low <= given_facts.get(name, low) <= high for name, (low, high) in bounds.items()))
        assert never.isdisjoint(pickable(nest, compiled.query(given_facts).indices.tolist()))


@given(nests(("bool", "enum"), least_conditions=3), st.data())
def test_actors_are_cast_as_for_the_table_by_hand(nest: Nest, data: st.DataObject):
    given_facts, _ = data.draw(contexts(nest.all_cells()))
    domain = nest.outer.schema.conditions["Defender.Tags"].domain
    values = st.sampled_from(domain.values or (False, True))
    actors = {"Defender": [{"id": i, "Tags": value} for i, value in enumerate(data.draw(st.lists(values, max_size=3)))]}
    facts = {name: fact for name, fact in given_facts.items() if name != "Defender.Tags"}
    compiled, by_hand = nest.outer.compile(nest.tables), hand_flattened(nest).compile()
    actors = actors if "Defender.Tags" in data_of(compiled).places else {}
    found, expected = (c.query(facts, actors=actors) for c in (compiled, by_hand))
    assert found.indices.tolist() == expected.indices.tolist()
    assert [found.casting(row) for row in found.rows] == [expected.casting(row) for row in expected.rows]


# ---- edits


@given(nests(), st.data())
def test_edits_share_what_did_not_change_and_answer_as_tables_made_anew(nest: Nest, data: st.DataObject):
    project = Project(Path(), nest.outer.schema, around_each_other({"outer": nest.outer, **nest.tables}))
    texts = nest.all_cells()
    for _ in range(3):
        project["outer"].compile()
        table = project[data.draw(st.sampled_from(NAMES))]
        if table.n_rows:
            row, column = data.draw(st.integers(0, table.n_rows - 1)), data.draw(st.sampled_from(table.columns))
            known = next((c.texts for c in texts.columns[1:] if c.name == column.name), column.texts)
            project = project.with_table(table.with_cell(row, column.name, data.draw(st.sampled_from(known))))
    edited = Nest(project["outer"], {name: project[name] for name in NAMES[1:]})
    given_facts, plain = data.draw(contexts(edited.all_cells()))
    assert_answers(edited.outer.compile(), edited, given_facts, plain, "error")
