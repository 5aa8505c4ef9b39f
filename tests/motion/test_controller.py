"""One character: each rule as a scenario."""

import math
import random
from itertools import pairwise

import numpy as np
import pytest
from lines import DT, RATE, line
from made_once import make_clip

from contextdb.errors import QueryError
from contextdb.motion import Entry, FeatureSchema, MotionDatabase, Selector, query_from, steady_path, with_path
from contextdb.motion.answers import NamedAssets
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.markup.marks import TagFilter
from contextdb.motion.search.filters import Biases
from contextdb.motion.selection.choice import Status
from contextdb.motion.selection.controller import Controller
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.decision import Action
from contextdb.motion.selection.variation import Variation
from contextdb.motion.trace.reasked_decision import continuing_cost

EVERY = {"search_every_s": 0.0, "jump_threshold_s": 0.0, "history_s": 0.0, "rate": RATE}
"""Search at every update, and leave nothing out."""


def controller(*databases, recorder=None, rng=None, clock=None, **changes):
    """A controller over databases "a", "b" and so on, without thresholds, that searches at every update unless told otherwise."""
    entries = [Entry(name, database) for name, database in zip("abc", databases, strict=False)]
    return Controller(Selector(entries), ControllerSettings(**{**EVERY, **changes}), recorder, rng, clock)


def valid(*assets):
    return NamedAssets(list(assets))


def at(decision):
    """What plays, as (asset, time)."""
    return None if decision.playing is None else (decision.playing.asset, round(decision.playing.time_s, 6))


# ---- starting, playing on, jumping


def test_the_continuing_pose_wins_though_another_frame_is_a_little_better_and_loses_when_it_is_much_better():
    places = {"walk": [0.0, 1.0, 2.0, 3.0], "run": [5.0, 2.9, 5.0, 5.0]}
    for bias, action in ((-0.3, Action.CONTINUE), (-0.05, Action.JUMP), (0.0, Action.JUMP)):
        one = controller(line(continuing=bias, **places))
        one.update(DT, [1.0])
        decision = one.update(DT, [2.5])  # walk at 0.2 s: 0.25, run at 0.1 s: 0.16
        assert decision.action is action
        assert decision.continuing_cost == pytest.approx(0.25 + bias)
    assert decision.why == "A search was due: run at 0.10 s costs 0.16, playing on 0.25."


def test_the_cost_of_playing_on_is_to_the_last_bit_what_the_search_makes_of_it():
    markup = "walk,CostModifier,,,0.3\nwalk,Move,,,"
    database = line(markup, continuing=-0.01, base=0.7, walk=[0.1, 0.7, 0.3], run=[0.5, 0.2, 0.21])
    seen = Recorder(10)
    one = controller(database, recorder=seen)
    asked = {"tags": TagFilter(avoid={"Move": 0.9}), "penalties": {"walk": 0.17}, "bias": {"a": np.linspace(0.1, 0.7, 6)}}
    one.update(0.0, [0.1], valid("walk"), **asked)
    decision = one.update(DT, [0.2], **asked)
    assert decision.action is Action.JUMP
    current = next(row for row in decision.candidates[0][1] if row.frame == 1)
    assert decision.continuing_cost == current.cost
    assert set(current.biases) == {"base", "penalty", "tags", "modifier", "given", "continuing"}


def test_the_cost_of_playing_on_is_exact_in_a_database_of_many_channels():
    channels = [{"type": kind, "bone": bone, "weight": 0.7} for kind in ("position", "velocity") for bone in ("LeftFoot", "Hips")]
    schema = FeatureSchema.from_dict(
        "loco", {"rate": 30.0, "channels": [*channels, {"type": "trajectory", "what": "speed", "at": 0.3}]}
    )
    clips = [make_clip(name).clip for name in ("walk", "run")]
    database = MotionDatabase.build(clips, schema, biases=Biases(0.1, -0.005, -0.01))
    stick = random.Random(6)
    for _ in range(50):
        current, query = stick.randrange(database.n_frames), database.raw(stick.randrange(database.n_frames))
        found = database.candidates(query, database.n_frames, current=current)
        expected = next(row.cost for row in found if row.frame == current)
        assert continuing_cost(database, query, database.filter(current=current)) == expected


# ---- when to search


def test_a_forced_search_does_not_wait_and_what_plays_may_win_it():
    one = controller(line(walk=range(30), run=range(100, 130)), search_every_s=60.0)
    one.update(DT, [0.0])
    played_on = one.update(DT, [1.1], force=True)
    assert (played_on.action, played_on.searched) == (Action.CONTINUE, True)
    assert at(one.update(DT, [105.0], force=True)) == ("run", 0.5)


def test_an_interruption_leaves_what_plays_though_it_would_win():
    one = controller(line(walk=range(30), run=range(100, 130)), search_every_s=60.0)
    one.update(DT, [0.0])
    decision = one.update(DT, [1.0], valid("walk", "run"), interrupt=True)
    assert (decision.action, decision.continuing_cost) == (Action.JUMP, None)
    assert decision.why.startswith("walk was interrupted: ")
    alone = controller(line(walk=[0.0]), search_every_s=60.0)
    alone.update(0.0, [0.0])
    assert alone.update(0.0, [0.0], interrupt=True).why == "walk was interrupted, but nothing else may play: walk plays on."


# ---- where it may not jump


def test_frames_within_the_jump_threshold_of_the_playing_one_are_no_candidates():
    one = controller(line(walk=range(30), run=range(30)), jump_threshold_s=0.5, recorder=Recorder(1))
    one.update(DT, [10.0], valid("walk"))
    candidates = one.update(0.0, [10.0]).candidates[0][1]
    assert [frame for frame in range(60) if candidates.why[frame] == LeftOut.JUMP] == [5, 6, 7, 8, 9, 11, 12, 13, 14, 15]
    assert at(one.update(0.0, [15.0], valid("walk"))) == ("walk", 1.6)
    assert at(one.update(0.0, [10.0], valid("walk"))) == ("walk", 1.0)


# ---- ends


def test_at_the_end_of_a_clip_it_searches_though_none_is_due_and_leaves_the_end():
    one = controller(line(stop=[0, 1, 2, 3], walk=range(10, 40)), search_every_s=60.0)
    one.update(DT, [0.0])
    times = [at(one.update(DT, [3.0])) for _ in range(3)]
    assert times == [("stop", 0.1), ("stop", 0.2), ("stop", 0.3)]
    decision = one.update(DT, [3.0])
    assert (decision.action, decision.searched, at(decision)) == (Action.JUMP, True, ("stop", 0.0))
    assert decision.why == "stop has ended: stop at 0.00 s costs 9."
    assert decision.continuing_cost is None


def test_a_clip_that_has_ended_is_held_when_nothing_else_may_play():
    one = controller(line("stop,DoNotChoose,0.1,,", stop=[0, 1, 2]), history_s=60.0)
    for _ in range(3):
        one.update(DT, [0.0])
    for _ in range(2):
        decision = one.update(DT, [0.0])
        assert (decision.action, at(decision), decision.searched) == (Action.HOLD, ("stop", 0.2), True)
        assert decision.why == "stop has ended and nothing else may play: its last frame is held."


# ---- what the table says


def test_an_asset_that_is_no_longer_valid_plays_on_when_nothing_else_may_and_says_so():
    one = controller(line(walk=range(10)), search_every_s=60.0)
    one.update(DT, [0.0])
    decision = one.update(DT, [1.0], valid("swim"))
    assert (decision.action, at(decision), decision.searched) == (Action.CONTINUE, ("walk", 0.1), True)
    assert decision.why == "walk is not valid any more, but nothing else may play: walk plays on."
    assert not decision.choice


# ---- several databases


def priority(threshold=2.75, **changes):
    tired, jog = line(jog_tired=[10, 11, 12, 13, 14, 15]), line(jog=[9, 9.5, 10, 10.5, 11, 11.5])
    selector = Selector([Entry("jog_tired", tired, threshold), Entry("jog", jog)])
    return Controller(selector, ControllerSettings(**{**EVERY, **changes}))


def test_a_priority_database_under_its_threshold_wins_over_the_continuing_pose():
    one = priority()
    assert at(one.update(DT, [9.0], among=["jog"])) == ("jog", 0.0)
    decision = one.update(DT, [9.5])
    assert (decision.action, at(decision)) == (Action.JUMP, ("jog_tired", 0.0))
    assert decision.continuing_cost == 0.0
    expected = "A search was due: jog_tired at 0.00 s costs 0.25, under the threshold 2.75 of jog_tired, playing on 0."
    assert decision.why == expected


def test_another_bucket_is_entered_at_once():
    one = controller(line(walk=range(10)), line(stop=range(100, 110)), search_every_s=60.0)
    one.update(DT, [0.0], among=["a"])
    decision = one.update(DT, [1.0], among=["b"])
    assert (decision.action, at(decision)) == (Action.JUMP, ("stop", 0.0))
    assert decision.why.startswith("a is not among the databases of the moment: stop at 0.00 s")
    assert decision.choice.searches[0].status is Status.NOT_AMONG


def test_a_bucket_without_anything_to_play_lets_what_plays_play_on():
    one = controller(line(walk=range(10)), line(stop=range(100, 110)), search_every_s=60.0)
    one.update(DT, [0.0])
    decision = one.update(DT, [1.0], valid("walk"), among=valid("b", "no database"))
    assert (decision.action, at(decision)) == (Action.CONTINUE, ("walk", 0.1))


def test_a_database_that_is_dropped_while_it_plays_is_left_at_once():
    one = controller(line(jog_tired=range(10)), line(jog=range(20, 30)), search_every_s=60.0)
    one.update(DT, [0.0])
    one.selector = one.selector.with_database("a", None)
    decision = one.update(DT, [1.0])
    assert (decision.action, at(decision)) == (Action.JUMP, ("jog", 0.0))
    assert decision.before.asset == "jog_tired"
    assert decision.why == "jog_tired is no longer loaded: jog at 0.00 s costs 361."
    one.selector = one.selector.with_database("b", None)
    decision = one.update(DT, [1.0])
    assert (decision.action, decision.playing) == (Action.NOTHING, None)
    assert decision.why == "jog is no longer loaded, and nothing may play."


def test_in_a_database_that_was_built_anew_the_same_asset_plays_on():
    one = controller(line(walk=range(10), run=range(50, 60)), search_every_s=60.0)
    one.update(DT, [53.0])
    one.selector = one.selector.with_database("a", line(crawl=[7] * 5, walk=range(10), run=range(50, 60)))
    decision = one.update(DT, [53.0])
    assert (decision.action, at(decision), decision.playing.range) == (Action.CONTINUE, ("run", 0.4), 2)


# ---- variation


def test_near_ties_vary_remember_and_never_cost_more_than_they_may():
    assets = {name: [place] + [50.0] * 5 for name, place in zip("pqrs", (0.0, 0.1, 0.2, 1.0), strict=True)}
    chosen = []
    one = controller(line(**assets), variation=Variation(within=0.05, memory=1), rng=random.Random(4))
    for _ in range(60):
        decision = one.update(DT, [0.0])
        chosen.append(decision.playing.asset)
        assert decision.cost <= decision.choice.hit.cost + 0.05
    assert set(chosen) == set("pqr")
    assert all(asset != following for asset, following in pairwise(chosen))


def test_what_plays_plays_on_while_it_is_a_near_tie():
    one = controller(line(p=[0.0] * 9, q=[0.1] * 9), variation=Variation(within=0.05), rng=np.random.default_rng(1))
    one.update(DT, [0.0], valid("q"))
    decisions = [one.update(DT, [0.0]) for _ in range(8)]
    assert [decision.action for decision in decisions] == [Action.CONTINUE] * 8
    assert decisions[0].why == "A search was due: playing on, at cost 0.01, is about as cheap as the best, 0."


def test_variation_keeps_to_what_is_under_the_threshold_that_let_its_database_win():
    tired = line(p=[0.0, 50.0], q=[0.3, 50.0])
    selector = Selector([Entry("tired", tired, 0.05), Entry("jog", line(r=[0.2, 50.0]))])
    for seed in range(8):
        one = Controller(selector, ControllerSettings(**EVERY, variation=Variation(0.2)), rng=random.Random(seed))
        assert at(one.update(DT, [0.0])) == ("p", 0.0)


# ---- state


@pytest.mark.parametrize("rng", [lambda: random.Random(3), lambda: np.random.default_rng(3)])
def test_from_a_restored_state_it_decides_the_same_again(rng):
    stick = random.Random(5)
    asked = [[stick.uniform(0.0, 9.0)] for _ in range(60)]
    assets = {name: range(i, i + 10) for i, name in enumerate("pqrst")}
    one = controller(line("p,Looping,,,", **assets), history_s=0.3, variation=Variation(0.3, 2), rng=rng())
    for place in asked[:20]:
        one.update(DT, place)
    state = one.state
    first = [told(one.update(DT, place)) for place in asked[20:]]
    one.restore(state)
    assert [told(one.update(DT, place)) for place in asked[20:]] == first
    other = Controller(one.selector, one.settings, rng=rng())
    other.restore(state)
    assert [told(other.update(DT, place)) for place in asked[20:]] == first


def told(decision):
    return decision.tick, decision.time_s, decision.action, decision.why, decision.playing, decision.cost, decision.continuing_cost


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"dt_s": math.nan}, "an update of nan seconds"),
        ({"dt_s": -0.1}, r"an update of -0\.1 seconds\. Accepted: a finite number, 0 or more"),
        ({"dt_s": "0.1"}, "an update of '0.1' seconds"),
        ({"query": [math.nan]}, '"feature 0" is nan'),
        ({"query": [1.0, 2.0]}, r"the query has shape \(2,\)"),
        ({"valid": [True]}, r"valid has shape \(1,\)"),
        ({"valid": {"z": [True, True]}, "force": True}, r'the selector has no database "z"'),
        ({"tags": TagFilter("Clam")}, r'there is no tag "Clam".*Did you mean "Calm"\?'),
        ({"among": ["z"]}, r'the selector has no database "z"'),
    ],
)
def test_what_cannot_be_meant_is_refused_and_changes_nothing(given, message):
    one = controller(line("walk,Calm,,,", walk=range(10), run=range(5)), search_every_s=60.0)
    one.update(DT, [0.0])
    before = one.state
    with pytest.raises(QueryError, match=message):
        one.update(**{"dt_s": DT, "query": [0.0], **given})
    assert one.state == before


# ---- recording


class Recorder:
    def __init__(self, n_candidates):
        self.n_candidates = n_candidates
        self.decisions = []

    def record(self, decision):
        self.decisions.append(decision)


def test_a_recorder_is_handed_every_decision_with_the_candidates_it_wants():
    seen, context = Recorder(2), {"speed": 1.0}
    ticks = iter([1.0, 1.5, 7.0, 7.25])
    one = controller(line("run,DoNotChoose,,,", walk=range(10), run=range(10)), recorder=seen, clock=lambda: next(ticks))
    decisions = [one.update(DT, [place], context=context) for place in (3.0, 8.0)]
    assert seen.decisions == decisions
    assert [decision.context for decision in decisions] == [context, context]
    assert [decision.search_us for decision in decisions] == [500000.0, 250000.0]
    ((name, candidates),) = decisions[1].candidates
    assert name == "a"
    assert [(row.asset, row.cost, row.left_out) for row in candidates] == [
        ("walk", 0.0, LeftOut.NO),
        ("run", 0.0, LeftOut.DO_NOT_CHOOSE),
        ("walk", 1.0, LeftOut.NO),
    ]
    assert candidates.rows[0].cost == decisions[1].cost


def test_a_decision_that_is_read_late_says_what_it_said_at_once():
    asked = [[math.sin(i) * 5.0 + 5.0] for i in range(40)]
    database = line(walk=range(10), run=range(2, 12))
    one, other = controller(database, search_every_s=0.2, history_s=0.5), controller(database, search_every_s=0.2, history_s=0.5)
    at_once = [told(one.update(DT, place, valid("walk") if i % 9 else None)) for i, place in enumerate(asked)]
    late = [other.update(DT, place, valid("walk") if i % 9 else None) for i, place in enumerate(asked)]
    assert list(map(told, late)) == at_once


def test_what_was_entered_just_now_is_left_for_a_large_gain_alone_and_says_so():
    settings = ControllerSettings(
        rate=RATE, search_every_s=0.1, jump_threshold_s=0.0, history_s=0.0, settle_bias=-5.0, settle_s=1.0
    )
    one = Controller(Selector([Entry("a", line(walk=range(20), run=[9.0] * 20))]), settings)
    assert one.update(DT, [0.0]).playing.asset == "walk"
    held = one.update(DT, [3.0])
    assert (held.playing.asset, held.action, held.continuing_cost) == ("walk", Action.CONTINUE, 4.0)
    assert held.why == (
        "A search was due: playing on costs 4; the best, 0, is not cheap enough to leave it 0.10 s after it was entered."
    )
    later = [one.update(DT, [float(tick)]) for tick in range(2, 10)][-1]
    assert later.playing.asset == "walk"
    assert one.update(DT, [7.5]).action is Action.JUMP


def test_what_was_entered_just_now_is_left_at_once_when_the_body_is_to_stand():
    ways = [{"type": "trajectory", "what": "position", "at": [0.33, 0.67, 1.0]}]
    schema = FeatureSchema.from_dict("ways", {"rate": 30.0, "channels": [{"type": "velocity", "bone": "Hips"}, *ways]})
    database = MotionDatabase.build([make_clip(name).clip for name in ("idle", "jog", "walk")], schema)
    one = Controller(Selector([Entry("a", database)]), ControllerSettings(settle_bias=-1000.0, settle_s=100.0, min_play_rate=1.0))

    def played_along(pose, speed_mps):
        query = with_path(schema, query_from(schema, make_clip(pose).clip, 20), steady_path(speed_mps))
        return [one.update(1 / 30, query).playing.asset for _ in range(12)][-1]

    assert [played_along("jog", 2.6), played_along("walk", 1.3), played_along("idle", 0.0)] == ["jog", "jog", "idle"]
