"""Random sessions asked again: unchanged they give what was recorded bit for bit, changed what a search with the change gives."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lines import DT, HEADER, RATE
from strategies import examples

import contextdb as cdb
from contextdb.motion import Controller, ControllerSettings, Entry, MotionDatabase, Selector, TagFilter, Trace
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.markup.marking import marks_of
from contextdb.motion.markup.markup import Markup
from contextdb.motion.search import cost
from contextdb.motion.search.filters import Biases
from contextdb.motion.trace.what_if import run_again

SEEDS = st.integers(0, 2**32 - 1)
ASSETS = ("walk", "jog", "idle", "turn", "stop")
CHANNELS = ("pose", "hips", "trajectory position")
TAGS = (None, None, TagFilter("Move"), TagFilter(exclude=["Calm"]), TagFilter(prefer={"Move": 0.75}))
TABLE = cdb.Table.from_columns(
    {"Asset": [*ASSETS, "walk"], "speed": ["<2", ">1", "Any", "0..1", ">2 ~1.5", "5"]}, {"speed": {"type": "number"}}
)


def made_database(rng, whole=False):
    """A few short assets of three channels, with markup; whole features, so that ties happen."""
    assets = [ASSETS[i] for i in sorted(rng.choice(len(ASSETS), rng.integers(1, 5), replace=False))]
    lengths = rng.integers(1, 12, len(assets))
    stops = np.cumsum(lengths)
    features = rng.integers(-4, 5, (int(stops[-1]), 4)).astype(np.float32) * (1.0 if whole else np.float32(0.37))
    rows = [
        f"{asset},{tag},,,"
        if tag == "Looping"
        else f"{asset},{tag},{rng.integers(0, 6) / RATE},,{'0.5' if tag == 'CostModifier' else ''}"
        for asset in assets
        for tag in rng.choice(
            ["Looping", "Move", "Calm", "DoNotChoose", "NextNaturalOnly", "CostModifier"], rng.integers(0, 3), replace=False
        )
    ]
    plain = MotionDatabase.from_features(features, stops - lengths, stops, assets)
    marks = marks_of(Markup.parse(HEADER + "\n".join(rows)), plain.assets, plain.starts, plain.stops, RATE, 0.0)
    biases = Biases(*(float(rng.choice([0.0, 0.25, -0.5])) for _ in range(3)))
    slices = (slice(0, 1), slice(1, 2), slice(2, 4))
    weights = rng.choice([0.5, 1.0, 1.7], 3)
    return replace(plain, marks=marks, biases=biases, channel_names=CHANNELS, slices=slices, weights=weights)


def recorded(seed, n=14):
    """A session in which everything that an update may be given changes."""
    rng = np.random.default_rng(seed)
    whole = bool(rng.random() < 0.5)
    entries = [Entry("a", made_database(rng, whole), rng.choice([None, 1.0, 6.0])), Entry("b", made_database(rng, whole))]
    selector = Selector(entries[int(rng.integers(2)) :], tags=("Move", "Calm"))
    settings = ControllerSettings(*(float(x) for x in rng.choice([0.0, 0.1, 0.3], 3)), rate=RATE)
    trace = Trace(3, selector.databases)
    controller = Controller(selector, settings, recorder=trace)
    compiled = TABLE.compile()
    for _ in range(n):
        context = {"speed": float(rng.choice([0.0, 1.5, 3.0, 5.0]))}
        given = {}
        if rng.random() < 0.7:
            given["valid"] = (
                compiled.query(context) if rng.random() < 0.7 else {"b": rng.random(len(entries[1].database.assets)) < 0.7}
            )
        if rng.random() < 0.3:
            given["penalties"] = {"walk": 0.5, "jog": 0.125}
        if rng.random() < 0.3:
            given["bias"] = {"b": rng.choice([0.0, 0.3, np.inf], entries[1].database.n_frames)}
        if rng.random() < 0.3:
            given["tags"] = {"b": rng.random(entries[1].database.n_frames) < 0.8}
        else:
            given["tags"] = TAGS[rng.integers(len(TAGS))]
        if rng.random() < 0.2:
            given["among"] = ["b"]
        query = rng.integers(-4, 5, 4) * (1.0 if whole else 0.37) + (0.0 if whole else rng.normal(0.0, 0.1, 4))
        controller.update(DT, query, context=context, force=bool(rng.random() < 0.3), interrupt=bool(rng.random() < 0.1), **given)
    return trace


@given(SEEDS)
def test_asked_again_unchanged_every_choice_and_cost_is_the_recorded_one_bit_for_bit(seed):
    trace = recorded(seed)
    loaded = Trace.from_bytes(trace.to_bytes())
    asked = loaded.reasked(trace.databases)
    assert len(asked) == len(loaded)
    for each, decision in zip(asked, trace, strict=True):
        assert each.choice == decision.choice
        assert not each.is_changed
        if decision.searched and decision.continuing_cost is not None:
            assert each.continuing_cost == decision.continuing_cost
        for name, found in decision.candidates:
            search = each.searches[name]
            for row in found:
                assert search.costs[row.frame] == row.cost
                assert search.left_out[row.frame] == row.left_out
                assert search.channels[row.frame].tolist() == list(row.channels.values())
        for name, search in each.searched.items():
            free = np.flatnonzero(search.left_out == LeftOut.NO)
            assert bool(len(free)) == bool(search.hit)
            if search.hit:
                assert search.costs[search.hit.frame] == search.costs[free].min() == search.hit.cost
            every = search.database.layout.frames
            plain = cost.costs(
                search.database.layout,
                every,
                search.database.normalised(search.query),
                search.database.slices,
                search.database.weights,
            )
            assert (search.costs[every] == plain + search.biases[every]).all()
            assert name in trace.databases


@given(SEEDS)
def test_with_changes_a_search_asked_again_is_the_search_of_changed_databases(seed):
    trace = recorded(seed)
    rng = np.random.default_rng(seed + 1)
    weights = {CHANNELS[rng.integers(3)]: float(rng.choice([0.0, 0.3, 4.0]))}
    biases = {"b": Biases(0.125, -0.25, 0.5)}
    thresholds = {"b": float(rng.choice([0.5, 3.0]))}
    asked = trace.reasked(weights=weights, biases=biases, thresholds=thresholds)
    for each in asked:
        if each.choice is None:
            continue
        for name, search in each.searches.items():
            changed = trace.databases[name].with_weights(weights)
            assert (search.database.weights == changed.weights).all()
            chosen = dict(each.decision.filters)[name]
            if name != "b":
                assert search.hit == changed.search_filtered(each.decision.query, chosen)
            frame = search.hit.frame
            if frame >= 0 and search.hit.cost < np.inf:
                assert search.costs[frame] == search.hit.cost
        reweighed = trace.reasked(biases=biases, thresholds=thresholds).of(each.decision).with_weights(weights)
        assert reweighed.choice == each.choice


@given(SEEDS)
def test_a_database_with_more_assets_before_the_others_is_asked_alike(seed):
    trace = recorded(seed)
    moved = {}
    for name, old in trace.databases.items():
        features = np.concatenate([np.full((5, 4), 90.0, np.float32), old.features])
        plain = MotionDatabase.from_features(features, [0, *(old.starts + 5)], [5, *(old.stops + 5)], ["new", *old.assets])
        marks = replace(
            old.marks,
            kinds=np.concatenate([np.full(5, old.marks.n_kinds), old.marks.kinds]).astype(np.int32),
            kind_tags=np.pad(old.marks.kind_tags, ((0, 1), (0, 0))),
            kind_marks=np.append(old.marks.kind_marks, np.uint8(0)),
            kind_biases=np.append(old.marks.kind_biases, 0.0),
            kind_root_weights=np.append(old.marks.kind_root_weights, 1.0),
            looping=np.append(False, old.marks.looping),
            warps=np.concatenate([np.full((1, 2, 2), np.nan), old.marks.warps]),
        )
        moved[name] = replace(
            plain, marks=marks, biases=old.biases, channel_names=old.channel_names, slices=old.slices, weights=old.weights
        )
    loaded = Trace.from_bytes(trace.to_bytes())
    asked = loaded.reasked(moved)
    assert asked.changed == set(moved)
    for each, decision in zip(asked, trace, strict=True):
        if decision.choice is None or any(search.hit and search.hit.cost > 1000.0 for search in decision.choice.searches):
            continue
        if not decision.choice:
            continue
        assert not each.is_changed
        assert each.choice.database == decision.choice.database
        assert each.choice.hit.asset == decision.choice.hit.asset
        assert each.choice.hit.frame == decision.choice.hit.frame + 5
        assert each.choice.hit.cost == decision.choice.hit.cost


@examples(0.6)
@given(SEEDS)
def test_each_proposed_change_makes_the_asset_win_or_is_reported_as_not_enough(seed):
    trace = recorded(seed, 5)
    asked = trace.reasked()
    for i, each in enumerate(asked):
        if each.choice is None:
            continue
        for asset in sorted({asset for search in each.searches.values() for asset in search.database.assets}):
            told = asked.why_not(i, asset)
            rows = [row for row in each.best_of_assets(asset) if row.row.asset == asset]
            free = [row.row.cost for row in rows if row.row.left_out == LeftOut.NO]
            if free:  # else the best may be of a database that was not searched
                assert told.cost <= min(free)
            if told.winner == asset:
                assert told.changes == () == told.reasons
                continue
            assert told.reasons
            for change in told.changes:
                _check(each, told, change)
            is_forbidden = told.cost == np.inf
            assert is_forbidden or any(change.wins for change in told.changes), told


def _check(each, told, change):
    """A bias, a weight or a threshold alone, applied by hand to what was recorded."""
    if change.kind == "weight":
        other = each.with_weights({change.what: change.to})
    elif change.kind == "threshold":
        other = each.with_threshold(change.what, change.to)
    elif change.kind == "bias":
        search = each.searches[told.database]
        at = search.database.range_of(told.frame)
        biases = search.chosen.range_biases + np.where(np.arange(len(search.chosen.range_biases)) == at, change.to, 0.0)
        chosen = search.chosen._replace(range_biases=biases)
        other = each.with_searches({**each.searches, told.database: search.with_filter(chosen)})
    else:
        return
    assert (other.choice.hit.asset == told.asset) == change.wins


@given(SEEDS)
def test_a_session_run_again_unchanged_plays_what_was_recorded(seed):
    """Its queries are of no frame, so they stay; masks between searches are those of the search before."""
    rng = np.random.default_rng(seed)
    selector = Selector([Entry("a", made_database(rng), 2.0), Entry("b", made_database(rng))], tags=("Move", "Calm"))
    trace = Trace(3, selector.databases)
    settings = ControllerSettings(*(float(x) for x in rng.choice([0.0, 0.1, 0.3], 3)), rate=RATE)
    controller = Controller(selector, settings, recorder=trace)
    valid = {"b": rng.random(len(selector.databases["b"].assets)) < 0.7}
    for i in range(12):
        controller.update(DT, rng.normal(0.0, 2.0, 4), valid, TAGS[2 + i % 3], force=i % 5 == 0, interrupt=i % 7 == 0)
    again = run_again(Trace.from_bytes(trace.to_bytes()).reasked(trace.databases))
    assert [each.playing for each in again] == [each.playing for each in trace]
    assert [(each.cost, each.action, each.why) for each in again] == [(each.cost, each.action, each.why) for each in trace]
    told = trace.what_if(weights={"pose": 0.0})
    assert told.is_reproduced
    assert told.searches == sum(decision.searched for decision in trace)
    assert trace.what_if().other_frames == 0 == trace.diff(trace).other_frames
    assert trace.what_if().before == trace.what_if().after


def test_the_weight_of_a_tie_is_that_of_the_formula():
    """X loses by 4 x 1 - 1 x 1; with the weight of its other channel raised by the difference over 4 it ties."""
    features = np.array([[2.0, 0.0, 0.0, 0.0], [1.0, 2.0, 0.0, 0.0]], np.float32)
    plain = MotionDatabase.from_features(features, [0, 1], [1, 2], ["x", "w"])
    slices = (slice(0, 1), slice(1, 2), slice(2, 4))
    database = replace(plain, channel_names=CHANNELS, slices=slices, weights=np.array([2.0, 1.0, 1.0]))
    trace = Trace(2)
    Controller(Selector([Entry("one", database)]), recorder=trace).update(0.0, [0.0] * 4)
    told = trace.reasked().why_not(0, "x")
    assert (told.winner, told.cost, told.winner_cost, told.rank) == ("w", 8.0, 6.0, 2)
    weight = next(change for change in told.changes if change.kind == "weight")
    assert (weight.what, weight.wins) == ("pose", True)
    assert weight.to == pytest.approx(2.0 - 2.0 / 3.0, rel=1e-3)
    assert weight.to < 2.0 - 2.0 / 3.0
    bias = next(change for change in told.changes if change.kind == "bias")
    assert (bias.what, bias.wins, bias.to) == ("x", True, pytest.approx(-2.0, rel=1e-3))
