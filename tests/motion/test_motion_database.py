"""The search is exact: held to a scan of every frame in float64, for any ranges, masks, tags, ties, biases and current frames."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import made_clips, make_clip
from motion_oracles import best_frame

from contextdb.errors import QueryError
from contextdb.motion import Clip, FeatureSchema, Hit, MotionDatabase, query_from
from contextdb.motion.answers import NamedAssets
from contextdb.motion.features.normalisation import floor_of
from contextdb.motion.search.database import build_databases

SCHEMA = FeatureSchema.from_dict(
    "loco",
    {
        "rate": 30.0,
        "channels": [
            {"type": "position", "bone": "LeftFoot", "weight": 0.75},
            {"type": "velocity", "bone": "LeftFoot"},
            {"type": "velocity", "bone": "Hips"},
            {"type": "trajectory", "what": "position", "at": [0.33, 0.67, 1.0]},
            {"type": "trajectory", "what": "direction", "along": [0.5, 1.0], "weight": 1.5},
        ],
    },
)
CLIPS = [made.clip for made in made_clips()]
LOCO = MotionDatabase.build(CLIPS, SCHEMA)


def matches(*names):
    """What a table's query answers, as far as a search looks."""
    return NamedAssets(list(names))


@st.composite
def databases(draw):
    """Few features with many equal values, so that ties are common; ranges with gaps, some empty, in any order."""
    n_frames, n_features = draw(st.integers(0, 40)), draw(st.integers(1, 4))
    values = st.sampled_from([0.0, -0.0, 1.0, -1.5, 0.1, 1e-30, 3e38]) | st.floats(-10, 10, width=32)
    features = draw(st.lists(st.lists(values, min_size=n_features, max_size=n_features), min_size=n_frames, max_size=n_frames))
    array = np.array(features, np.float32).reshape(n_frames, n_features)
    cuts = sorted(draw(st.lists(st.integers(0, n_frames), max_size=12)))
    pairs = draw(st.permutations(list(zip(cuts[::2], cuts[1::2], strict=False))))
    assets = [draw(st.sampled_from(["a", "b", "c"])) for _ in pairs]
    database = MotionDatabase.from_features(array, [start for start, _ in pairs], [stop for _, stop in pairs], assets)
    query = draw(st.lists(values, min_size=n_features, max_size=n_features))
    return database, np.array(query)


@given(databases(), st.data())
def test_a_search_finds_what_scanning_every_frame_finds(drawn, data):
    database, query = drawn
    n_ranges, n_frames = len(database.assets), database.n_frames
    flags = data.draw(st.none() | st.lists(st.booleans(), min_size=n_ranges, max_size=n_ranges))
    tags = data.draw(st.none() | st.lists(st.booleans(), min_size=n_frames, max_size=n_frames))
    numbers = st.sampled_from([0.0, -1.0, 0.5, math.inf])
    bias = data.draw(st.none() | st.lists(numbers, min_size=n_frames, max_size=n_frames))
    current = data.draw(st.none() | st.integers(0, n_frames - 1)) if n_frames else None
    frame, cost = best_frame(database.features, database.starts, database.stops, query, None, flags, tags, current, bias)
    hit = database.search(query, flags, tags, current, bias)
    if frame is None:
        assert (bool(hit), hit.cost, hit.asset) == (False, math.inf, None)
    else:
        i = database.range_of(frame)
        assert hit == Hit(database.assets[i], i, frame, cost)
        assert database.starts[i] <= frame < database.stops[i]


@given(databases(), st.sets(st.sampled_from(["a", "b", "c", "elsewhere"])))
def test_matches_allow_the_ranges_of_their_assets(drawn, names):
    database, query = drawn
    flags = np.array([asset in names for asset in database.assets], bool)
    assert database.search(query, matches(*names)) == database.search(query, flags)


@given(databases(), st.data())
def test_searching_for_many_is_searching_for_each(drawn, data):
    database, query = drawn
    n_ranges, n_frames = len(database.assets), database.n_frames
    n_queries = data.draw(st.integers(0, 4))
    queries = np.array([query + i for i in range(n_queries)]).reshape(n_queries, database.n_features)
    flags = np.array(
        data.draw(st.lists(st.lists(st.booleans(), min_size=n_ranges, max_size=n_ranges), min_size=n_queries, max_size=n_queries))
    )
    masks = flags.astype(bool).reshape(n_queries, n_ranges)
    frames = data.draw(st.lists(st.integers(-1, n_frames - 1), min_size=n_queries, max_size=n_queries))
    singly = [database.search(q, m, current=None if f < 0 else f) for q, m, f in zip(queries, masks, frames, strict=True)]
    assert database.search_many(queries, masks, frames) == singly
    assert database.search_many(queries, list(masks), np.array(frames, int)) == singly
    assert database.search_many(queries) == [database.search(q) for q in queries]


def test_one_mask_serves_all_queries_or_each_has_its_own():
    database = MotionDatabase.from_features(np.arange(4.0)[:, None], [0, 2], [2, 4], ["a", "b"])
    queries = [[0.0], [3.0]]

    def frames(valid):
        return [hit.frame for hit in database.search_many(queries, valid)]

    assert frames(None) == [0, 3]
    assert frames(matches("b")) == [2, 3]
    assert frames([False, True]) == [2, 3]
    assert frames(np.array([False, True])) == [2, 3]
    assert frames([matches("b"), None]) == [2, 3]
    assert frames([None, [True, False]]) == [0, 1]


def test_nothing_valid_is_a_false_hit_of_infinite_cost():
    for hit in (
        LOCO.search(np.zeros(LOCO.n_features), matches()),
        LOCO.search(np.zeros(LOCO.n_features), tags=np.zeros(LOCO.n_frames, bool)),
    ):
        assert not hit
        assert hit == Hit(None, -1, -1, math.inf)
    empty = MotionDatabase.from_features(np.zeros((0, 2)), [], [], [])
    assert not empty.search([0, 0])
    assert not empty.search([0, 0], valid=[])
    assert not MotionDatabase.build([], SCHEMA).search(np.zeros(LOCO.n_features))


# ---- built from clips


def test_a_built_search_equals_a_scan_of_normalised_frames():
    rng = np.random.default_rng(5)
    scale, offset = LOCO.normalisation.scale, LOCO.normalisation.offset
    weights = np.concatenate([np.full(part.stop - part.start, w) for part, w in zip(LOCO.slices, LOCO.weights, strict=True)])
    for _ in range(20):
        query = offset + rng.normal(size=LOCO.n_features) * scale
        valid = rng.random(len(LOCO.assets)) < 0.2
        costs = (((LOCO.features - (query - offset) / scale) ** 2) * weights).sum(axis=1) / weights.sum()
        allowed = np.concatenate(
            [np.full(stop - start, flag) for start, stop, flag in zip(LOCO.starts, LOCO.stops, valid, strict=True)]
        )
        hit = LOCO.search(query, valid)
        assert hit.cost == pytest.approx(costs[allowed].min(), rel=1e-12)
        assert hit.frame == np.flatnonzero(allowed)[np.argmin(costs[allowed])]


def test_features_without_variation_are_compared_by_the_floors_of_their_channels():
    still = Clip("still", CLIPS[0].skeleton, 1 / 30, np.repeat(CLIPS[0].values[:1], 10, axis=0))
    database = MotionDatabase.build([still], SCHEMA)
    floors = {name: floor_of(channel)[0] for name, channel in zip(SCHEMA.slices, SCHEMA.channels, strict=True)}
    expected = [floors[name] for name, part in SCHEMA.slices.items() for _ in range(part.stop - part.start)]
    assert database.normalisation.scale.tolist() == expected
    query = database.raw(0)
    query[0] += 2.0 * expected[0]
    total = sum(channel.weight * channel.n_features for channel in SCHEMA.channels)
    assert database.search(query).cost == pytest.approx(0.75 * 4.0 / total)


def test_turning_a_weight_shares_the_features_and_changes_the_cost():
    query = query_from(SCHEMA, make_clip("walk").clip, 10) + 0.1
    turned = LOCO.with_weights({"Hips velocity": 5.0})
    assert turned.layout is LOCO.layout
    before, after = LOCO.channel_costs(7, query), turned.channel_costs(7, query)
    weight = dict(zip(LOCO.channel_names, LOCO.weights, strict=True))["Hips velocity"]
    total = sum(channel.weight * channel.n_features for channel in SCHEMA.channels)
    share = total / (total + 3 * (5.0 - weight))  # the hips' velocity has three features
    assert after.pop("Hips velocity") == pytest.approx(share * 5.0 / weight * before.pop("Hips velocity"))
    assert after == pytest.approx({name: share * cost for name, cost in before.items()})


def test_databases_built_together_share_their_normalisation():
    tired = [clip for clip in CLIPS if clip.name.endswith("_tired")]
    both = build_databases({"tired": tired, "all": CLIPS}, SCHEMA)
    assert both["tired"].normalisation is both["all"].normalisation
    query = query_from(SCHEMA, tired[0], 5)
    assert both["tired"].search(query).cost == both["all"].search(query).cost
    again = MotionDatabase.build(tired, SCHEMA, normalisation=both["all"].normalisation)
    assert np.array_equal(again.features, both["tired"].features)


def test_an_empty_clip_is_an_empty_range():
    empty = Clip("empty", CLIPS[0].skeleton, 1 / 30, np.zeros((0, CLIPS[0].skeleton.n_channels)))
    database = MotionDatabase.build([empty, CLIPS[1], Clip("too", empty.skeleton, 1 / 30, empty.values)], SCHEMA)
    assert database.starts.tolist() == [0, 0, CLIPS[1].n_frames]
    assert database.search(database.raw(3)).frame == 3
    assert not database.search(database.raw(3), matches("empty", "too"))


# ---- what is refused


def test_the_features_of_many_frames_are_those_of_each_and_none_between_ranges():
    database = MotionDatabase.from_features(np.arange(10.0).reshape(5, 2), [0, 3], [2, 5], ["a", "b"])
    assert database.raw_many([4, 0, 1]).tolist() == [database.raw(frame).tolist() for frame in (4, 0, 1)]
    with pytest.raises(QueryError, match="frame 2 is in no range"):
        database.raw_many([0, 2])


def test_a_hit_in_a_database_of_many_blocks_is_the_lowest_of_equal_frames():
    database = MotionDatabase.from_features(np.ones((40_000, 3), np.float32), [10], [40_000], ["a"])
    assert database.search([0, 0, 0]) == Hit("a", 0, 10, 3.0)
    assert database.search([0, 0, 0], current=39_999) == Hit("a", 0, 39_999, 3.0)
