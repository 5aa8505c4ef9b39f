"""Searches for many characters at once: each is answered as when it asks alone, to the last bit, whatever the masks come as."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples
from test_search import marked_databases, questions, tag_filters

import contextdb as cdb
from contextdb.errors import QueryError
from contextdb.motion.search import searcher
from contextdb.motion.search.database import MotionDatabase

ASSETS = [f"asset {i}" for i in range(9)]


def moves(data):
    """A compiled table whose rows name a database's assets, some of them several times and some not at all."""
    named = data.draw(st.lists(st.sampled_from([*ASSETS, "elsewhere"]), min_size=1, max_size=70))
    cells = data.draw(st.lists(st.sampled_from(["Any", "<2", "2..4", ">3"]), min_size=len(named), max_size=len(named)))
    columns = {"Asset": named, "speed": cells}
    return cdb.Table.from_columns(columns, {"speed": {"type": "number"}}).compile()


@examples(1)
@given(st.data())
def test_the_answers_of_a_table_serve_as_masks_in_every_form(data):
    database, compiled = data.draw(marked_databases()), moves(data)
    speeds = data.draw(st.lists(st.sampled_from([0.0, 2.0, 3.5, 5.0]), max_size=6))
    queries = np.array([data.draw(questions(database))["query"] for _ in speeds]).reshape(len(speeds), database.n_features)
    each = [compiled.query({"speed": speed}) for speed in speeds]
    singly = [database.search(query, valid) for query, valid in zip(queries, each, strict=True)]
    flags = np.array([database.filter(valid).ranges for valid in each], bool).reshape(len(speeds), len(database.assets))
    for valid in (compiled.query_many({"speed": speeds}), each, tuple(each), flags, list(flags)):
        assert database.search_many(queries, valid) == singly


@examples(1)
@given(st.data())
def test_soft_cells_and_answers_of_different_tables_count_for_each_character(data):
    database = data.draw(marked_databases())
    soft = cdb.Table.from_columns(
        {"Asset": ASSETS, "speed": ["<2 ~0.5", "2..4 ~2", ">3"] * 3}, {"speed": {"type": "number"}}
    ).compile()
    speeds = data.draw(st.lists(st.sampled_from([0.0, 2.0, 3.5, 5.0]), min_size=1, max_size=4))
    queries = np.array([data.draw(questions(database))["query"] for _ in speeds])
    each = [soft.query({"speed": speed}) for speed in speeds]
    singly = [database.search(query, valid) for query, valid in zip(queries, each, strict=True)]
    assert database.search_many(queries, soft.query_many({"speed": speeds})) == singly
    assert database.search_many(queries, each) == singly
    others = [moves(data).query({"speed": speed}) for speed in speeds]
    mixed = [one if i % 2 else other for i, (one, other) in enumerate(zip(each, others, strict=True))]
    assert database.search_many(queries, mixed) == [database.search(q, v) for q, v in zip(queries, mixed, strict=True)]


@pytest.mark.parametrize("n_cores", [1, 2, 3])
def test_blocks_and_cores_change_no_answer(n_cores, monkeypatch):
    monkeypatch.setattr(searcher, "n_cores", lambda: n_cores)
    monkeypatch.setattr(searcher, "BLOCK_QUERIES", 40)
    rng = np.random.default_rng(3)
    lengths = rng.integers(1, 300, 90)
    stops = np.cumsum(lengths)
    features = rng.normal(size=(int(stops[-1]), 27)).cumsum(axis=0)
    database = MotionDatabase.from_features(features, stops - lengths, stops, [f"a{i}" for i in range(90)])
    queries = database.features[rng.integers(0, database.n_frames, 333)] + rng.normal(0.0, 1.0, (333, 27))
    masks, currents = rng.random((333, 90)) < 0.3, rng.integers(-1, database.n_frames, 333)
    singly = [database.search(q, m, None, c) for q, m, c in zip(queries, masks, currents, strict=True)]
    assert database.search_many(queries, masks, currents) == singly


@examples(1)
@given(st.data())
def test_many_searches_with_everything_of_their_own_are_answered_like_each_alone(data):
    database = data.draw(marked_databases())
    filters = data.draw(st.lists(st.one_of(st.none(), tag_filters()), min_size=2, max_size=2))
    asked = [data.draw(questions(database)) for _ in range(data.draw(st.integers(0, 6)))]
    asked = [one | {"tags": data.draw(st.sampled_from(filters))} if data.draw(st.booleans()) else one for one in asked]
    queries = np.array([one.pop("query") for one in asked]).reshape(len(asked), database.n_features)
    singly = [database.search(query, **one) for query, one in zip(queries, asked, strict=True)]
    assert database.search_each(queries, asked) == singly


def test_a_weight_turned_to_zero_hides_no_frame_from_many_at_the_ends_of_float32():
    features = np.array([[3e38, 1.0], [-3e38, 0.0]], np.float32)
    plain = MotionDatabase.from_features(features, [0], [2], ["a"])
    database = replace(plain, slices=(slice(0, 1), slice(1, 2)), channel_names=("far", "near"), weights=np.array([0.0, 1.0]))
    assert [hit.frame for hit in database.search_many([[3e38, 0.0], [-3e38, 1.0]])] == [1, 0]


def test_one_query_that_is_no_number_is_named_and_nobody_is_answered():
    database = MotionDatabase.from_features(np.arange(4.0)[:, None], [0], [4], ["a"])
    with pytest.raises(QueryError, match='"feature 0" is nan'):
        database.search_many([[1.0], [math.nan], [2.0]])


@pytest.mark.parametrize(
    ("valid", "match"),
    [
        (np.ones((3, 1), bool), "3 masks for 2 queries"),
        (np.ones((2, 4), bool), r"valid has shape \(2, 4\)"),
        (np.ones((2, 1)), "valid has type float64"),
        ([None], "1 mask for 2 queries"),
    ],
)
def test_masks_that_fit_no_crowd_are_refused(valid, match):
    database = MotionDatabase.from_features(np.arange(4.0)[:, None], [0], [4], ["a"])
    with pytest.raises(QueryError, match=match):
        database.search_many([[1.0], [2.0]], valid)


@pytest.mark.parametrize("current", [[0], [0, 9], [0, -2], [0.5, 1], [True, 0], np.array([[0, 1]]), np.array([0, 4])])
def test_current_frames_that_fit_no_crowd_are_refused(current):
    database = MotionDatabase.from_features(np.arange(4.0)[:, None], [0], [4], ["a"])
    with pytest.raises(QueryError, match="current frame"):
        database.search_many([[1.0], [2.0]], None, current)
