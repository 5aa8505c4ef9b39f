"""What lets an asset play on that is no longer valid: each guard as a scenario, and how it is told."""

import math
import pickle
import re
from dataclasses import replace

import pytest
from lines import DT, RATE, line

import contextdb as cdb
from contextdb.motion import Action, Controller, ControllerSettings, Entry, FeatureSchema, Selector, Trace
from contextdb.motion.answers import NamedAssets
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.selection.guards import Held
from contextdb.motion.trace.views import decision_lines, session_lines


def controller(database, recorder=None, **changes):
    settings = {"search_every_s": 60.0, "jump_threshold_s": 0.0, "history_s": 0.0, "rate": RATE, **changes}
    return Controller(Selector([Entry("a", database)]), ControllerSettings(**settings), recorder)


def valid(*assets):
    return NamedAssets(list(assets))


def at(decision):
    return decision.playing.asset, round(decision.playing.time_s, 6)


def updates(one, places, mask, **options):
    return [one.update(DT, [place], mask, **options) for place in places]


# ---- the cost bar


def test_a_forced_jump_over_the_bar_waits_and_is_taken_when_one_comes_under_it():
    one = controller(line(walk=range(10), run=range(5, 15)), cost_bar=2.0, grace_s=0.5)
    one.update(DT, [0.0])
    decisions = updates(one, (1.0, 2.0, 4.0), valid("run"))
    assert [(d.action, at(d), d.held, d.searched) for d in decisions] == [
        (Action.CONTINUE, ("walk", 0.1), "cost bar", True),
        (Action.CONTINUE, ("walk", 0.2), "cost bar", True),
        (Action.JUMP, ("run", 0.0), "", True),
    ]
    assert decisions[0].why == (
        "walk is not valid any more: run at 0.00 s costs 16, over the bar 2, so walk plays on, at most 0.50 s more."
    )
    assert decisions[1].why.endswith("run at 0.00 s costs 9, over the bar 2, so walk plays on, at most 0.40 s more.")
    assert decisions[2].why == "walk is not valid any more: run at 0.00 s costs 1."


def test_after_the_grace_time_the_best_jump_is_the_last_resort_and_says_so():
    one = controller(line(walk=range(10), run=range(50, 60)), cost_bar=2.0, grace_s=0.2)
    one.update(DT, [0.0])
    decisions = updates(one, (1.0, 1.0, 1.0), valid("run"))
    assert [(d.action, d.held) for d in decisions] == [
        (Action.CONTINUE, "cost bar"),
        (Action.CONTINUE, "cost bar"),
        (Action.JUMP, ""),
    ]
    assert decisions[2].why == (
        "walk is not valid any more: run at 0.00 s costs 2401; over the bar 2, but the last resort after 0.20 s."
    )


def test_databases_with_a_schema_have_a_bar_and_others_none_unless_it_is_given():
    channels = [{"type": "trajectory", "what": "speed", "at": 0.0}]
    schema = FeatureSchema.from_dict("speed", {"rate": RATE, "channels": channels})
    plain = line(walk=range(10), run=range(50, 60))
    assert ControllerSettings().bar_of(plain) == math.inf
    assert ControllerSettings().bar_of(replace(plain, schema=schema)) == 1.0
    assert ControllerSettings(cost_bar=3).bar_of(plain) == 3
    one = controller(replace(plain, schema=schema))
    one.update(DT, [0.0])
    assert updates(one, [1.0], valid("run"))[0].held == "cost bar"


def test_the_end_of_a_clip_and_an_interruption_pass_the_bar():
    one = controller(line(walk=range(3), run=range(50, 60)), cost_bar=2.0, grace_s=5.0)
    one.update(DT, [1.0])
    assert [d.action for d in updates(one, (1.0, 1.0), valid("run"))] == [Action.CONTINUE, Action.JUMP]
    one = controller(line(walk=range(9), run=range(50, 60)), cost_bar=2.0, grace_s=5.0)
    one.update(DT, [1.0])
    interrupted = updates(one, [1.0], valid("run"), interrupt=True)[0]
    assert (interrupted.action, interrupted.why) == (Action.JUMP, "walk was interrupted: run at 0.00 s costs 2401.")


# ---- natural ends


def test_a_forced_jump_waits_for_the_end_of_a_next_natural_span():
    one = controller(line("walk,NextNaturalOnly,0.2,0.3,\n", walk=range(10), run=range(50, 60)))
    one.update(DT, [1.0])
    decisions = updates(one, (1.0, 1.0, 1.0), valid("run"))
    assert [(d.action, d.held, d.searched) for d in decisions] == [
        (Action.CONTINUE, "next natural", False),
        (Action.CONTINUE, "next natural", False),
        (Action.JUMP, "", True),
    ]
    assert decisions[0].why == "walk is not valid any more, but plays on while its NextNaturalOnly span lasts."


def test_until_natural_lets_a_clip_play_to_its_end_and_a_loop_does_not_wait():
    one = controller(line("", start=range(4), run=range(50, 60)), until_natural=True)
    one.update(DT, [1.0])
    decisions = updates(one, (1.0, 1.0, 1.0), valid("run"))
    assert [(d.action, d.held) for d in decisions] == [
        (Action.CONTINUE, "until natural"),
        (Action.CONTINUE, "until natural"),
        (Action.JUMP, ""),
    ]
    assert decisions[0].why == "start is not valid any more, but plays on to its natural end."
    assert decisions[2].why.startswith("start has ended: ")
    one = controller(line("walk,Looping,,,\n", walk=range(4), run=range(50, 60)), until_natural=True)
    one.update(DT, [0.0])
    assert updates(one, [1.0], valid("run"))[0].action is Action.JUMP


# ---- hysteresis


def table(cells, hysteresis=0.5, **more):
    told = {"speed": {"type": "number", "hysteresis": hysteresis}, "heat": {"type": "number"}}
    return cdb.Table.from_columns({"Asset": ["walk", "run"], "speed": cells, **more}, told).compile()


def test_what_plays_stays_valid_a_little_beyond_its_edge_and_nothing_else_does():
    moves = table(["0..2", "1..9"])
    one = controller(line(walk=range(10), run=range(50, 60)))
    one.update(DT, [0.0], moves.query({"speed": 1.5}))
    stays, leaves = one.update(DT, [1.0], moves.query({"speed": 2.5})), one.update(DT, [1.0], moves.query({"speed": 2.75}))
    assert (stays.action, stays.held, stays.searched) == (Action.CONTINUE, "hysteresis", False)
    assert stays.why == "The next search is due in 59.9 s; walk is valid by hysteresis alone."
    assert (leaves.action, at(leaves), leaves.held) == (Action.JUMP, ("run", 0.0), "")
    returning = one.update(DT, [1.0], moves.query({"speed": 0.75}))
    assert (at(returning), returning.held) == (("run", 0.1), "hysteresis")
    other = controller(line(walk=range(10), run=range(50, 60)))
    assert at(other.update(DT, [0.0], moves.query({"speed": 2.25}))) == ("run", 0.0)


def test_in_a_search_it_competes_as_what_plays_but_no_other_frame_of_it_does():
    moves = table(["0..2", "1..9"])
    trace = Trace(n_candidates=30)
    one = controller(line(walk=range(10), run=range(3, 13)), trace, search_every_s=0.0)
    one.update(DT, [0.0], moves.query({"speed": 1.0}))
    stays = one.update(DT, [1.0], moves.query({"speed": 2.25}))
    assert (stays.action, at(stays), stays.held, stays.continuing_cost) == (Action.CONTINUE, ("walk", 0.1), "hysteresis", 0.0)
    assert stays.why == "A search was due: playing on is cheapest, at cost 0; walk is valid by hysteresis alone."
    ((_, found),) = stays.candidates
    reasons = {row.frame: row.left_out for row in found if row.asset == "walk"}
    assert reasons.pop(1) is LeftOut.NO
    assert set(reasons.values()) == {LeftOut.NOT_VALID}
    jumped = one.update(DT, [4.0], moves.query({"speed": 2.25}))
    assert (jumped.action, at(jumped), jumped.continuing_cost) == (Action.JUMP, ("run", 0.1), 4.0)


def test_soft_cells_cost_what_plays_by_hysteresis_what_they_cost_widened():
    moves = table(["0..2", "1..9"], heat=["0..1 ~3", "Any"])
    one = controller(line(walk=range(10), run=range(9, 19)), search_every_s=0.0)
    one.update(DT, [0.0], moves.query({"speed": 1.0, "heat": 0.0}))
    stays = one.update(DT, [1.0], moves.query({"speed": 2.25, "heat": 2.0}))
    assert (at(stays), stays.continuing_cost) == (("walk", 0.1), 3.0)


def test_beyond_the_hysteresis_the_grace_time_begins():
    moves = table(["0..2", "1..9"])
    one = controller(line(walk=range(20), run=range(50, 60)), cost_bar=2.0, grace_s=0.2)
    speeds = (1.0, 2.25, 2.25, 3.0, 3.0, 3.0)
    held = [one.update(DT, [1.0], moves.query({"speed": speed})).held for speed in speeds]
    assert held == ["", "hysteresis", "hysteresis", "cost bar", "cost bar", ""]


# ---- what is kept


def test_a_wait_is_part_of_the_state_and_goes_on_where_it_is_restored():
    one = controller(line(walk=range(20), run=range(50, 60)), cost_bar=2.0, grace_s=0.3)
    one.update(DT, [0.0])
    updates(one, (1.0, 1.0), valid("run"))
    state = pickle.loads(pickle.dumps(one.state))
    first = updates(one, (1.0, 1.0), valid("run"))
    assert [d.action for d in first] == [Action.CONTINUE, Action.JUMP]
    one.restore(state)
    assert [(d.action, d.why, d.held) for d in updates(one, (1.0, 1.0), valid("run"))] == [(d.action, d.why, d.held) for d in first]


@pytest.fixture
def recorded():
    trace = Trace(n_candidates=2)
    one = controller(line(walk=range(10), run=range(50, 60)), trace, cost_bar=2.0, grace_s=0.2)
    one.update(DT, [0.0])
    updates(one, (1.0, 1.0, 1.0), valid("run"))
    return trace


def test_a_session_stores_what_held(recorded):
    again = Trace.from_bytes(recorded.to_bytes())
    assert [d.held for d in again] == ["", "cost bar", "cost bar", ""]


def test_a_replay_shows_when_and_by_what_an_asset_was_held(recorded):
    lines = [line.rstrip() for line in session_lines(recorded)]
    assert [line.split()[:2] for line in lines[1:]] == [["0", "0.10"], ["1", "0.20"], ["3", "0.40"]]
    assert "not valid" in lines[2]
    assert "plays on (cost bar)" in lines[2]
    assert "held by     cost bar" in [line.rstrip() for line in decision_lines(recorded[1])]


def test_a_player_reads_what_a_jump_waits_for():
    said = [held.waits for held in Held if held is not Held.NOTHING]
    assert Held.NOTHING.waits == ""
    assert len(set(said)) == len(said)
    assert all(re.fullmatch(r"(No longer valid: it|Valid within) [\w ]+\.", sentence) for sentence in said)
