"""Pairs of conditions: what going through every context gives, and what is said where it was sampled."""

import json
import random
from collections.abc import Callable
from functools import cache

import oracles
import pytest
from brute import Brute, random_boxes, random_table
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import contextdb as cdb
from contextdb.covering import Cancelled, PairTable, Slice, pairs

SEEDS = st.integers(0, 2**32)


def made(seed: int) -> tuple[Brute, PairTable]:
    rng = random.Random(seed)
    table = random_table(rng)
    brute = Brute(table, random_boxes(rng, table))
    return brute, pairs(table, impossible=brute.impossible)


def inside_of(brute: Brute) -> Callable[[Slice], list[bool]]:
    """Which contexts a slice holds; each part is looked at once."""

    @cache
    def held(name: str, part: str) -> list[bool]:
        return brute.inside({name: part})

    return lambda found: [all(flags) for flags in zip(*(held(*item) for item in found.cells.items()), strict=True)]


def restricting(brute: Brute, name: str) -> set[int]:
    """The rows whose cell does not accept every value of a condition."""
    [(domain, texts)] = [(domain, texts) for n, domain, texts in brute.columns if n == name]
    values = {repr(context[name]): context[name] for context, _ in brute.contexts}.values()
    return {row for row, text in enumerate(texts) if not all(oracles.passes(text, domain, value) for value in values)}


@examples(2)
@given(SEEDS)
def test_the_conditional_coverage_of_every_slice_is_that_of_its_contexts(seed):
    brute, found = made(seed)
    assert found.method == "exact"
    inside_slice = inside_of(brute)
    for i, j in found.pairs():
        for slice_ in found.slices(i, j):
            inside = inside_slice(slice_)
            share = brute.share(inside)
            assert slice_.share == pytest.approx(share, abs=1e-9)
            if share:
                covered = brute.share([a and bool(rows) for a, rows in zip(inside, brute.valid, strict=True)])
                assert slice_.lower == slice_.covered == slice_.upper
                assert slice_.covered == pytest.approx(covered / share, abs=1e-9)
            else:
                assert (slice_.covered, slice_.lower, slice_.upper) == (None, 0.0, 1.0)


@examples(2)
@given(SEEDS)
def test_rows_of_a_slice_are_those_valid_in_it_and_named_are_those_that_restrict_both(seed):
    brute = Brute(random_table(random.Random(seed)))
    found, inside_slice = pairs(brute.table), inside_of(brute)
    for i, j in found.pairs():
        both = restricting(brute, found.conditions[i]) & restricting(brute, found.conditions[j])
        for slice_ in found.slices(i, j):
            inside = inside_slice(slice_)
            rows = {row for valid, flag in zip(brute.valid, inside, strict=True) if flag for row in valid}
            assert slice_.n_rows == len(rows)
            assert slice_.is_named == bool(rows & both)


@examples(1)
@given(SEEDS)
def test_parts_that_are_no_tags_hold_every_context_once(seed):
    brute, found = made(seed)
    kinds = {name: domain.kind for name, domain, _ in brute.columns}
    for name, parts in zip(found.conditions, found.parts, strict=True):
        held = [brute.inside({name: part}) for part in parts]
        assert len(parts) <= 8
        for at in range(len(brute.contexts)):
            n_held = sum(flags[at] for flags in held)
            assert n_held == 1 or kinds[name] == "tags"


def wide(n_conditions: int = 24, n_rows: int = 30) -> cdb.Table:
    names = [f"b{i}" for i in range(n_conditions)]
    columns = {n: ["True" if (r * 31 + i * 17) % 13 == 0 else "Any" for r in range(n_rows)] for i, n in enumerate(names)}
    columns["b0"] = ["True"] * n_rows
    return cdb.Table.from_columns({"Asset": ["A"] * n_rows, **columns}, {name: {"type": "bool"} for name in names})


def test_a_wide_table_is_sampled_the_same_way_for_the_same_seed():
    one, two, other = (pairs(wide(), seed=seed, samples=2000) for seed in (1, 1, 2))
    assert (one.method, one.n_samples) == ("estimate", 2000)
    assert one.to_json() == two.to_json() != other.to_json()


def test_what_no_row_accepts_is_certain_though_the_rest_was_sampled():
    found = pairs(wide(), samples=500)
    nothing = found.slice(0, 1, 0, 0)
    assert (nothing.cells, nothing.covered, nothing.n_rows, nothing.is_exact) == ({"b0": "False", "b1": "False"}, 0.0, 0, True)
    some = found.slice(0, 1, 1, 0)
    assert not some.is_exact
    assert some.lower <= some.covered <= some.upper


def test_an_interval_of_samples_holds_the_exact_share():
    narrow = wide(12)
    exact, sampled = pairs(narrow), pairs(wide(), samples=4000)
    assert exact.method == "exact"
    assert sampled.shares.sum() == pytest.approx(4.0 * 24 * 24 / 4, rel=0.05)


def test_without_samples_nothing_is_claimed_but_what_is_certain():
    found = pairs(wide(), samples=0)
    assert found.slice(0, 1, 1, 0).covered is None
    assert found.slice(0, 1, 0, 0).covered == 0.0


def test_many_values_are_the_ones_that_rows_name_and_all_others():
    values = [f"v{i}" for i in range(30)]
    schema = {"gait": {"type": "enum", "values": values}}
    found = pairs(cdb.Table.from_columns({"Asset": ["A", "B"], "gait": ["v20 v21", "v5"]}, schema))
    assert {"v5", "v20", "v21"} <= set(found.parts[0])
    assert len(found.parts[0]) == 8
    assert found.parts[0][-1].startswith(("not ", "v"))


def test_tags_are_there_or_not():
    schema = {"tags": {"type": "tags", "values": ["Move", "Move.Run", "InAir"]}, "up": {"type": "bool"}}
    found = pairs(cdb.Table.from_columns({"Asset": ["A"], "tags": ["+Move.Run"], "up": ["True"]}, schema))
    assert found.parts == (("+Move.Run", "-Move.Run"), ("False", "True"))
    assert found.slice(0, 1, 0, 1).covered == 1.0
    assert found.slice(0, 1, 1, 1).covered == 0.0


def test_the_worst_slice_is_the_one_that_is_covered_least():
    schema = {"up": {"type": "bool"}, "gait": {"type": "enum", "values": ["Walk", "Run"]}}
    found = pairs(cdb.Table.from_columns({"Asset": ["A", "B"], "up": ["True", "Any"], "gait": ["Run", "Walk"]}, schema))
    worst = found.worst(0, 1)
    assert (worst.cells, worst.covered) == ({"up": "False", "gait": "Run"}, 0.0)
    assert found.explicit(0, 1) == 0.25


def test_a_condition_with_itself_is_each_part_alone():
    schema = {"up": {"type": "bool"}, "in": {"type": "bool"}}
    found = pairs(cdb.Table.from_columns({"Asset": ["A"], "up": ["True"], "in": ["True"]}, schema))
    assert [(s.cells, s.covered) for s in found.slices(0, 0)] == [({"up": "False"}, 0.0), ({"up": "True"}, 0.5)]


@pytest.mark.parametrize("columns", [{"Asset": []}, {"Asset": ["A"]}, {"Asset": [], "up": []}])
def test_a_table_without_rows_or_conditions_has_a_table_of_pairs(columns):
    assert json.loads(json.dumps(pairs(cdb.Table.from_columns(columns)).to_json()))["items"] == []


@pytest.mark.parametrize(
    "options", [{"samples": -1}, {"seed": 1.5}, {"impossible": [{"b99": "True"}]}, {"weights": {"b0": {"x": 1}}}]
)
def test_arguments_that_cannot_be_meant_are_refused(options):
    with pytest.raises(cdb.ContextDBError, match=r"\w"):
        pairs(wide(), **options)


def test_pairs_can_be_stopped():
    with pytest.raises(Cancelled):
        pairs(wide(), should_stop=lambda: True)
