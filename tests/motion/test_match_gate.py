"""A match gate: when it opens and closes, what it tells, and the entry animation that it gives."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip

from contextdb.errors import MotionError, QueryError
from contextdb.motion import MotionDatabase, query_from
from contextdb.motion.answers import NamedAssets
from contextdb.motion.nodes.match_gate import MatchGate
from contextdb.motion.nodes.match_node import MatchNode
from contextdb.motion.nodes.pose_match import pose_schema
from contextdb.motion.nodes.warping import Target

SCHEMA = pose_schema(make_clip("walk").clip.skeleton)
POINTS = MotionDatabase.from_features([[0.0], [10.0]], [0, 1], [1, 2], ["near", "far"])
"""A frame costs the square of its distance to the query, so a query of x costs x² up to 5."""


def at(cost):
    """A query whose best cost is this."""
    return [math.sqrt(cost)]


# ---- as in the talk


def test_it_opens_when_the_best_entry_animation_costs_little_and_gives_it_to_play():
    entries = MotionDatabase.build([make_clip(name).clip for name in ("stop_run", "stop_walk")], SCHEMA)
    gate = MatchGate(MatchNode(entries), 3.0)
    run = make_clip("run").clip
    target = Target(0.0, 4.0, 0.0)
    far = gate.update(query_from(SCHEMA, run, 14), Target(0.0, 40.0, 0.0))
    assert not gate.is_open
    assert far.play is None
    near = gate.update(query_from(SCHEMA, run, 15), target)
    assert near.opens
    assert near.play.hit == near.hit
    assert near.hit.asset == "stop_run"
    there = near.play.at(near.play.path.position_s)
    assert (there.left_m, there.ahead_m) == pytest.approx((0.0, 4.0), abs=1e-9)
    assert gate.update(query_from(SCHEMA, run, 16), target).play is None  # open already: it is being played


def test_over_a_database_it_tells_only_whether_the_best_asset_fits():
    gate = MatchGate(POINTS, 2.0)
    assert gate.cost(at(1.0)) == pytest.approx(1.0)
    assert not gate.is_open
    look = gate.update(at(1.0))
    assert gate.is_open
    assert (look.hit.asset, look.bar, look.play) == ("near", 2.0, None)


# ---- the bars


@given(st.lists(st.integers(0, 20).map(lambda i: i / 4), max_size=20), st.sampled_from([None, 2.0, 3.0]))
def test_it_opens_under_its_threshold_and_closes_when_no_longer_under_the_other_bar(costs, close_above):
    gate, is_open = MatchGate(POINTS, 2.0, close_above), False
    for cost in costs:
        look = gate.update([cost])  # costs its square
        bar = (close_above or 2.0) if is_open else 2.0
        was_open, is_open = is_open, cost * cost < bar
        assert (gate.is_open, look.was_open, look.is_open, look.bar) == (is_open, was_open, is_open, bar)
        assert (look.opens, look.closes) == (is_open and not was_open, was_open and not is_open)


def test_it_is_shut_when_nothing_may_play():
    gate = MatchGate(POINTS, 1e9)
    assert gate.update([0.0]).is_open
    look = gate.update([0.0], valid=NamedAssets([]))
    assert look.closes
    assert look.cost == math.inf


def test_closed_by_hand_it_gives_the_entry_animation_anew():
    node = MatchNode(replace(POINTS, root=np.zeros((2, 3), np.float32)), rate=30.0)
    gate = MatchGate(node, 1.0)
    assert gate.update([0.0], Target(0.0, 0.0)).play is not None
    gate.close()
    assert not gate.is_open
    assert gate.update([0.0], Target(0.0, 0.0)).play is not None


def test_what_it_saw_reads_as_a_line():
    gate = MatchGate(POINTS, 2.0, close_above=2.5)
    none = NamedAssets([])
    told = [str(gate.update([x])) for x in (2.0, 1.0, 1.5, 3.0)] + [str(gate.update([0.0], valid=none))]
    assert told == [
        "shut: near costs 4.000, not under 2",
        "opens: near costs 1.000, under 2",
        "open: near costs 2.250, under 2.5",
        "closes: near costs 9.000, not under 2.5",
        "shut: nothing may play",
    ]


# ---- what does not fit


@pytest.mark.parametrize("bar", [math.nan, math.inf, "low", None])
def test_a_bar_that_is_no_cost_is_refused(bar):
    with pytest.raises(MotionError, match="the gate's threshold is"):
        MatchGate(POINTS, bar)


def test_a_bar_to_close_at_below_the_one_to_open_at_is_refused():
    with pytest.raises(MotionError, match="cannot close above 1"):
        MatchGate(POINTS, 2.0, close_above=1.0)
    with pytest.raises(MotionError, match="close_above is nan"):
        MatchGate(POINTS, 2.0, close_above=math.nan)


def test_a_target_is_asked_for_by_a_match_node_alone():
    node = MatchNode(replace(POINTS, root=np.zeros((2, 3), np.float32)), rate=30.0)
    with pytest.raises(QueryError, match="has no target"):
        MatchGate(node, 1.0).update([0.0])
    with pytest.raises(QueryError, match="was given a target"):
        MatchGate(POINTS, 1.0).cost([0.0], Target(0.0, 0.0))
