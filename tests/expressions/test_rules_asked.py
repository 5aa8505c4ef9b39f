"""Tables with rules against reading every cell and every rule anew: one context and many, live, explained, opened from a file."""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import oracles
import pytest
from expression_oracle import CONDITIONS, GAITS, Told, contexts, truths
from hypothesis import given
from hypothesis import strategies as st
from strategies import cells, examples

import contextdb as cdb
from contextdb.cells.conditions import Condition
from contextdb.cells.domains import BOOL
from contextdb.compiled.table import CompiledTable
from contextdb.covering.ruled import without_rules
from contextdb.errors import ContextError
from contextdb.expressions import ExpressionError, read_expression
from contextdb.schema.settings import Schema, TableSettings

COLUMNS = ("a", "n", "gait", "p", "tags")
NONE = Told("", lambda facts: True)
SCHEMA = Schema(conditions=CONDITIONS)


def reads(told: Told) -> bool:
    try:
        read_expression(told.text, CONDITIONS, Condition("", BOOL))
    except ExpressionError:
        return False
    return True


@dataclass(frozen=True)
class Case:
    """A table, its rules as functions, and what was drawn to ask it with."""

    table: cdb.Table
    rules: list[Told]

    def answer(self, facts: dict[str, Any], unknown: str) -> list[int] | None:
        """The valid rows; None for a question that is refused."""
        asked = set(self.compiled.asked)
        if unknown == "error" and any(facts[name] is None for name in asked):
            return None
        valid = []
        for row, rule in enumerate(self.rules):
            texts = ((self.table.text(row, name), CONDITIONS[name].domain, facts[name]) for name in COLUMNS)
            if not all(oracles.passes(*one, unknown) for one in texts):
                continue
            truth = rule.value(facts)
            if truth is None and unknown == "error":
                return None
            if truth or (truth is None and unknown == "any"):
                valid.append(row)
        return valid

    @property
    def compiled(self) -> CompiledTable:
        return self.table.compile()


@st.composite
def cases(draw: st.DrawFn) -> Case:
    n_rows = draw(st.sampled_from([1, 2, 5, 70]))
    few = [*draw(st.lists(truths(2).filter(reads), min_size=1, max_size=4)), NONE]
    rules = [draw(st.sampled_from(few)) for _ in range(n_rows)]
    columns = {"Asset": [f"row {i}" for i in range(n_rows)]}
    for name in COLUMNS:
        some = draw(st.lists(cells(CONDITIONS[name].domain), min_size=1, max_size=3))
        columns[name] = [draw(st.sampled_from(["Any", "Any", *some])) for _ in range(n_rows)]
    columns["When"] = [rule.text or draw(st.sampled_from(["", "-", "Any", " any "])) for rule in rules]
    table = cdb.Table.from_columns(columns, SCHEMA, TableSettings("table", when="When"))
    return Case(table, rules)


def asked(compiled: CompiledTable, facts: dict[str, Any], unknown: str) -> list[int] | None:
    try:
        return compiled.query(facts, unknown=unknown).indices.tolist()
    except ContextError:
        return None


@examples(2)
@given(cases(), st.lists(contexts(), min_size=1, max_size=6), st.sampled_from(["error", "any", "never"]))
def test_a_row_is_valid_when_its_cells_accept_the_facts_and_its_rule_is_true(case, moments, unknown):
    compiled = case.compiled
    for facts in moments:
        assert asked(compiled, facts, unknown) == case.answer(facts, unknown)


@examples(1)
@given(cases(), st.lists(contexts(), min_size=1, max_size=6), st.sampled_from(["error", "any", "never"]))
def test_many_contexts_have_the_answers_of_each_alone(case, moments, unknown):
    compiled = case.compiled
    expected = [case.answer(facts, unknown) for facts in moments]
    columns = {name: [facts[name] for facts in moments] for name in CONDITIONS}
    if None in expected:
        with pytest.raises(ContextError):
            _ = compiled.query_many(columns, unknown=unknown).counts
        return
    for few_rows in (-1, 64):  # against whole masks, row by row
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("contextdb.expressions.rules.rules.MANY_ROWS", few_rows)
            assert [rows.tolist() for rows in compiled.query_many(columns, unknown=unknown).lists()] == expected
    many = compiled.query_many(columns, unknown=unknown)
    assert [rows.tolist() for rows in many.lists()] == expected
    assert many.counts.tolist() == [len(rows) for rows in expected]
    assert many.hits.tolist() == [sum(row in rows for rows in expected) for row in range(compiled.n_rows)]
    flags = np.unpackbits(many.mask.view(np.uint8), axis=1, bitorder="little")[:, : compiled.n_rows]
    assert [np.flatnonzero(row).tolist() for row in flags] == expected


STANDING_IN = {"p": False, "Role.q": True, "gait": "Run", "word": "Walk", "tags": frozenset(("InAir",))}
MOSTLY_KNOWN = contexts().map(lambda facts: {n: STANDING_IN.get(n, 1.0) if f is None else f for n, f in facts.items()}) | contexts()


@examples(2)
@given(cases(), MOSTLY_KNOWN, st.lists(st.tuples(st.sampled_from(sorted(CONDITIONS)), MOSTLY_KNOWN), max_size=16), st.data())
def test_a_live_context_answers_as_a_query_does(case, first, changes, data):
    unknown = data.draw(st.sampled_from(["error", "any", "never"]))
    facts, live = dict(first), case.compiled.live(first, unknown=unknown)
    for name, other in [("a", first), *changes]:
        facts[name] = other[name]
        if name in live.facts:
            live[name] = other[name]
        try:
            found = live.matches().indices.tolist()
        except ContextError:
            found = None
        assert found == case.answer(facts, unknown)


@examples(0.5)
@given(cases(), contexts(), st.sampled_from(["any", "never"]))
def test_a_file_keeps_the_rules_and_an_explanation_says_which_row_breaks_its_own(case, facts, unknown):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "table.safetensors")
        case.compiled.save(path)
        opened = CompiledTable.open(path)
        expected = case.answer(facts, unknown)
        assert asked(opened, facts, unknown) == expected
        assert list(opened.asked) == list(case.compiled.asked)
        explanation = opened.explain(facts, unknown=unknown)
        for row, rule in enumerate(case.rules):
            told, truth = explanation.row(row), rule.value(facts)
            assert told.is_valid == (row in expected)
            breaks = truth is False or (truth is None and unknown == "never")
            assert [f.mend for f in told.failures if f.condition == "When"] == (["Any"] if breaks else [])
        del opened, explanation


SETS = {"a": ("0..2.5", (0.0, 0.5, 1.0, 2.5)), "gait": ("Walk Run", GAITS[:2]), "p": ("Any", (False, True))}


@examples(2)
@given(cases(), contexts(), st.sets(st.sampled_from(sorted(SETS)), min_size=1), st.sampled_from(["any", "never"]))
def test_sets_of_values_leave_every_row_that_may_match_and_promise_none_that_may_not(case, facts, names, unknown):
    given_facts = {**facts, **{name: cdb.cell(SETS[name][0]) for name in names}}
    matches = case.compiled.query(given_facts, unknown=unknown)
    always = np.flatnonzero(np.unpackbits(matches.always.view(np.uint8), bitorder="little")).tolist()
    worlds = [dict(facts)]
    for name in names:
        worlds = [{**world, name: value} for world in worlds for value in SETS[name][1]]
    answers = [set(case.answer(world, unknown)) for world in worlds]
    assert set(always) <= set.intersection(*answers)
    assert set.union(*answers) <= set(matches.rows.tolist())


KNOWN = contexts().map(lambda facts: {n: STANDING_IN.get(n, 1.0) if f is None else f for n, f in facts.items()})


@examples(2)
@given(cases(), st.lists(KNOWN, min_size=1, max_size=5))
def test_the_table_that_coverage_measures_is_valid_where_the_one_with_rules_is(case, moments):
    without = without_rules(case.table)
    compiled = without.table.compile()
    for facts in moments:
        assert asked(compiled, facts, "never") == case.answer(facts, "never")


def test_a_rule_on_tags_beside_a_cell_of_all_but_some_tags_is_measured_as_both():
    columns = {"Asset": ["a", "b"], "tags": ["not Any", "not +InAir +Stun"], "When": ['"InAir" in tags', '"InAir" in tags']}
    schema = {"tags": {"type": "tags", "values": ["InAir", "Stun"]}}
    table = cdb.Table.from_columns(columns, schema, TableSettings("table", when="When"))
    compiled = without_rules(table).table.compile()
    asked_tags = [set(), {"InAir"}, {"Stun"}, {"InAir", "Stun"}]
    assert [asked(compiled, {"tags": tags}, "never") for tags in asked_tags] == [[], [1], [], []]
