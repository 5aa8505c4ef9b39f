"""The scale of costs: a weighted mean of squared differences, whatever the schema; the oracle is one line of numpy."""

from functools import reduce
from operator import add

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from contextdb.motion import Entry, FeatureSchema, MatchGate, MotionDatabase, Selector, best_start
from contextdb.motion.features.extraction import ClipFeatures
from contextdb.motion.features.normalisation import Normalisation
from contextdb.motion.features.schema import Channel
from contextdb.motion.search.filters import Biases
from contextdb.motion.trace.reasked_decision import continuing_cost

WEIGHTS = st.one_of(st.just(0.0), st.floats(1e-3, 1e3))


@st.composite
def schemas(draw):
    """Sizes and weights of some channels, at least one above 0."""
    sizes = draw(st.lists(st.integers(1, 5), min_size=1, max_size=5))
    weights = draw(st.lists(WEIGHTS, min_size=len(sizes), max_size=len(sizes)))
    assume(any(weights))
    return sizes, weights


def database_of(features, sizes, weights, *, names=None, group=None, biases=None):
    """A database of two ranges of some raw features, their channels' sizes and weights."""
    names = names or [f"c{i}" for i in range(len(sizes))]
    channels = [
        Channel("custom", float(weight), function=name, size=size, group=group)
        for name, size, weight in zip(names, sizes, weights, strict=True)
    ]
    schema = FeatureSchema("random", 30.0, tuple(channels))
    half = len(features) // 2
    parts = [
        ClipFeatures(name, False, block, np.zeros((len(block), 3), np.float32))
        for name, block in (("a", features[:half]), ("b", features[half:]))
    ]
    return MotionDatabase.from_parts(parts, schema, biases=biases or Biases())


def random_features(seed, n_features, n_frames=60):
    rng = np.random.default_rng(seed)
    spread = rng.uniform(0.2, 5.0, n_features)
    return (rng.normal(size=(n_frames, n_features)) * spread).astype(np.float32), rng.normal(size=n_features) * spread


def plain_costs(database, query, sizes, weights):
    """Every frame's cost, as the documents say it."""
    apart = database.features - database.normalisation.apply(query)
    each = np.repeat(weights, sizes)
    return (apart**2 * each).sum(axis=1) / each.sum()


@given(schemas(), st.integers(0, 2**32))
def test_a_cost_is_the_plain_weighted_mean_everywhere(schema, seed):
    sizes, weights = schema
    features, query = random_features(seed, sum(sizes))
    database = database_of(features, sizes, weights)
    expected = plain_costs(database, query, sizes, weights)
    hit = database.search(query)
    assert hit.cost == pytest.approx(expected.min(), rel=1e-9)
    assert expected[hit.frame] == pytest.approx(expected.min(), rel=1e-9)
    rows = database.candidates(query, len(features)).rows
    assert [row.cost for row in rows] == pytest.approx(np.sort(expected), rel=1e-9)
    # All that gives a cost gives the same one to the last bit.
    frame = hit.frame
    assert rows[0].cost == hit.cost == reduce(add, database.channel_costs(frame, query).values())
    assert reduce(add, rows[0].channels.values()) == hit.cost
    assert [each.cost for each in database.search_many([query] * 3)] == [hit.cost] * 3
    assert database.best_of_ranges(query, 0.0)[0].cost == hit.cost
    assert continuing_cost(database, query, database.filter(current=frame)) == hit.cost
    assert Selector([Entry("x", database)]).search(query).hit.cost == hit.cost
    assert MatchGate(database, 1.0).cost(query) == best_start(database, query).cost == hit.cost


@given(schemas(), st.integers(0, 2**32))
def test_twice_the_weights_change_no_cost(schema, seed):
    sizes, weights = schema
    features, query = random_features(seed, sum(sizes))
    database = database_of(features, sizes, weights)
    doubled = database_of(features, sizes, [2.0 * weight for weight in weights])
    turned = database.with_weights({f"custom c{i}": 2.0 * weight for i, weight in enumerate(weights)})
    assert database.search(query) == doubled.search(query) == turned.search(query)
    assert [row.cost for row in database.candidates(query, 60)] == [row.cost for row in doubled.candidates(query, 60)]


@given(schemas(), st.integers(0, 2**32), st.data())
def test_a_channel_divided_into_two_of_its_weight_changes_no_cost(schema, seed, data):
    sizes, weights = schema
    sizes = [2 * size for size in sizes]
    features, query = random_features(seed, sum(sizes))
    i = data.draw(st.integers(0, len(sizes) - 1))
    half = sizes[i] // 2
    names = [f"c{k}" for k in range(len(sizes))]
    whole = database_of(features, sizes, weights, names=names, group="one")
    divided = database_of(
        features,
        [*sizes[:i], half, half, *sizes[i + 1 :]],
        [*weights[:i], weights[i], weights[i], *weights[i + 1 :]],
        names=[*names[:i], "first", "second", *names[i + 1 :]],
        group="one",  # one scale, as the channel had before
    )
    before, after = (d.candidates(query, 60).rows for d in (whole, divided))
    assert [row.cost for row in after] == pytest.approx([row.cost for row in before], rel=1e-9)


@given(schemas(), st.integers(0, 2**32))
def test_a_channel_that_is_there_twice_at_half_its_weight_changes_no_cost(schema, seed):
    sizes, weights = schema
    features, query = random_features(seed, sum(sizes))
    first = sizes[0]
    whole = database_of(features, sizes, weights)
    twice = database_of(
        np.concatenate([features[:, :first], features], axis=1),
        [first, *sizes],
        [weights[0] / 2, weights[0] / 2, *weights[1:]],
        names=["again", *(f"c{i}" for i in range(len(sizes)))],
    )
    before = [row.cost for row in whole.candidates(query, 60)]
    assert [row.cost for row in twice.candidates(np.concatenate([query[:first], query]), 60)] == pytest.approx(before, rel=1e-9)


def test_frames_that_have_nothing_to_do_with_each_other_cost_about_two():
    rng = np.random.default_rng(1)
    features = rng.normal(size=(2000, 12)).astype(np.float32)
    database = database_of(features, [3, 9], [0.5, 4.0])
    raw = database.normalisation.undo(rng.normal(size=12))
    costs = [row.cost for row in database.candidates(raw, 2000)]
    query = database.normalisation.apply(raw)
    share = np.repeat(database.cost_weights, [3, 9])
    assert np.mean(costs) == pytest.approx(1.0 + (share * query**2).sum(), rel=0.05)  # 1 + 1 over all queries


def test_weights_that_float64_can_hardly_add_are_weighed_all_the_same():
    features, query = random_features(4, 4)
    for weight in (5e-324, 1e308):
        database = database_of(features, [2, 2], [1.0, 1.0]).with_weights({"custom c0": weight, "custom c1": weight})
        assert database.cost_weights.tolist() == [0.25, 0.25]
        assert database.search(query) == database_of(features, [2, 2], [1.0, 1.0]).search(query)


def test_the_normalisation_of_another_database_is_taken_as_it_is():
    features, _ = random_features(6, 3)
    schema = FeatureSchema("random", 30.0, (Channel("custom", function="c0", size=3),))
    shared = Normalisation.of([features], schema)
    parts = [ClipFeatures("a", False, features[:5], np.zeros((5, 3), np.float32))]
    assert MotionDatabase.from_parts(parts, schema, normalisation=shared).normalisation is shared
