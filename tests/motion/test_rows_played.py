"""A row says how it plays: a character obeys as one does whose settings or markup say the same by hand."""

import math
import pickle
from itertools import pairwise

import numpy as np
import pytest
from lines import DT as TICK_S
from lines import RATE, line
from test_character import CHANNELS, COLUMNS, CONDITIONS, DT, NAMES, clips, driven, parts

import contextdb as cdb
from contextdb import motion
from contextdb.cells.row_play import ACCEPTED, RowPlay
from contextdb.motion import Action, Controller, ControllerSettings, Entry, Selector, Trace
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.selection.decision import plays

BLENDS = 6.638352 / (2.0 * math.log(2.0))
"""So many half-lives a blend takes."""

USUAL, CONTROLLER = motion.PoseSettings(), ControllerSettings()


def table_of(columns, conditions, **said):
    """A table whose rows say how they play: an output each, one text for all rows or a list."""
    n = len(next(iter(columns.values())))
    outputs = {name: [cells] * n if isinstance(cells, str) else cells for name, cells in said.items()}
    return cdb.Table.from_columns({**columns, **outputs}, conditions, {"outputs": list(outputs)}).compile()


def moves(**said):
    return table_of(COLUMNS, CONDITIONS, **said)


def character(tables, settings=USUAL, controller=CONTROLLER, mirror=False):
    schema, database, bank = mirrored_parts() if mirror else parts()
    chooser = Controller(Selector([Entry("all", database)]), controller)
    return motion.Character(chooser, schema, tables, motion.PoseStream(bank, settings))


def mirrored_parts():
    schema = motion.FeatureSchema.from_dict("loco", {"rate": 30.0, "channels": CHANNELS, "mirror": [["Left*", "Right*"]]})
    build = motion.MotionDatabase.build, motion.PoseBank.build
    return schema, *(each(clips(), schema, mirror=True) for each in build)


def assert_same(one, other, ticks=160):
    for left, right in zip(driven(one, ticks), driven(other, ticks), strict=True):
        assert left.decision.playing == right.decision.playing
        assert left.decision.action == right.decision.action
        np.testing.assert_allclose(left.pose.positions, right.pose.positions, rtol=0.0, atol=1e-6)
        np.testing.assert_allclose(left.pose.root, right.pose.root, rtol=0.0, atol=1e-6)
        assert left.body == pytest.approx(right.body)


# ---- the oracle: the same by hand


@pytest.mark.parametrize("root", ["animation", "code", "mixed", "path"])
@pytest.mark.parametrize("settings_root", ["mixed", "animation"])
def test_a_root_that_all_rows_say_is_as_that_of_the_settings(root, settings_root):
    if settings_root == "animation" and root != "animation":
        pytest.skip("a stream whose settings say animation bends nobody to a path")
    said = character(moves(root=root), motion.PoseSettings(root=settings_root))
    assert_same(said, character(moves(), motion.PoseSettings(root=root)))


@pytest.mark.parametrize("halflife_s", [0.03, 0.2])
def test_a_blend_that_all_rows_say_is_as_that_of_the_settings(halflife_s):
    said = character(moves(blend_s=str(BLENDS * halflife_s)))
    assert_same(said, character(moves(), motion.PoseSettings(halflife_s=halflife_s)))


@pytest.mark.parametrize(("cell", "low", "high"), [("1", 1.0, 1.0), ("0.7..1.5", 0.7, 1.5)])
def test_a_play_rate_that_all_rows_say_is_as_that_of_the_settings(cell, low, high):
    by_hand = ControllerSettings(min_play_rate=low, max_play_rate=high)
    assert_same(character(moves(play_rate=cell)), character(moves(), controller=by_hand))


@pytest.mark.parametrize(("cell", "is_until_natural"), [("natural", True), ("any", False)])
def test_an_end_that_all_rows_say_is_as_that_of_the_settings(cell, is_until_natural):
    by_hand = ControllerSettings(until_natural=is_until_natural)
    said = ControllerSettings(until_natural=not is_until_natural)
    assert_same(character(moves(until=cell), controller=said), character(moves(), controller=by_hand))


def test_a_loop_that_rows_say_is_as_that_of_the_markup():
    columns = {"asset": ["wave", "nod"], "x": ["Any", "Any"]}
    said, plain = (table_of(columns, {"x": {"type": "number"}}, **more).query({"x": 0}) for more in ({"loop": ["True", ""]}, {}))
    settings = ControllerSettings(history_s=0.0, rate=RATE)
    marked, unmarked = line("wave,Looping,,,\n", wave=range(5), nod=range(90, 95)), line(wave=range(5), nod=range(90, 95))
    by_hand, by_row = (Controller(Selector([Entry("a", each)]), settings) for each in (marked, unmarked))
    for tick in range(25):
        query = [float(tick % 4)]
        one, other = by_hand.update(TICK_S, query, plain), by_row.update(TICK_S, query, said)
        assert (one.action, one.playing) == (other.action, other.playing)
    ends = table_of(columns, {"x": {"type": "number"}}, loop="False").query({"x": 0})
    by_row = Controller(Selector([Entry("a", marked)]), settings)
    assert Action.LOOP not in [by_row.update(TICK_S, [4.0], ends).action for _ in range(20)]


@pytest.mark.parametrize(("cell", "is_mirrored"), [("always", True), ("never", False)])
def test_a_mirror_that_rows_say_leaves_the_others_out(cell, is_mirrored):
    one = character(moves(mirror=cell), mirror=True)
    assert {update.decision.playing.mirrored for update in driven(one, 120)} == {is_mirrored}
    assert_same(character(moves(mirror="as asked"), mirror=True), character(moves(), mirror=True))


def test_a_row_is_entered_at_its_second_and_nowhere_else():
    starts = dict(zip(NAMES, ["", "0.5", "0.2", "", "1.25", "", "0"], strict=True))
    one = character(moves(start_s=list(starts.values())))
    trace = one.record(2000)
    entered = [update.decision for update in driven(one, 300) if update.decision.action in (Action.START, Action.JUMP)]
    of_rows = [(each.playing.asset, each.playing.time_s) for each in entered if starts[each.playing.asset]]
    assert len(of_rows) > 2
    assert all(time_s == pytest.approx(float(starts[asset]), abs=0.5 / 30.0) for asset, time_s in of_rows)
    assert any(candidates.counts.get(LeftOut.START) for each in trace if each.searched for _, candidates in each.candidates)


def test_of_two_rows_of_an_asset_the_valid_one_says_how_it_plays():
    columns = {"asset": ["walk", "walk", "walk"], "calm": ["True", "False", "False"]}
    table = table_of(columns, {"calm": {"type": "bool"}}, play_rate=["0.5", "2", "3"])
    one = Controller(Selector([Entry("a", line(walk=range(100)))]), ControllerSettings(rate=RATE))
    rates = [one.update(TICK_S, [0.0], table.query({"calm": calm})).play_rate for calm in (True, True, False)]
    assert rates[:2] == [0.5, 0.5]
    assert rates[2] == 0.5, "what plays goes on as it was entered"
    again = Controller(Selector([Entry("a", line(walk=range(100)))]), ControllerSettings(rate=RATE))
    assert again.update(TICK_S, [0.0], table.query({"calm": False})).play_rate == 2.0


# ---- a blend of nothing, a change of what moves the root


def test_a_blend_of_no_seconds_is_a_cut():
    cut, plain = (character(moves(**said), motion.PoseSettings(root="code", **more)) for said, more in (
        ({"blend_s": "0"}, {}), ({}, {"blend": "none"}),
    ))  # fmt: skip
    for one, other in zip(driven(cut, 100), driven(plain, 100), strict=True):
        np.testing.assert_allclose(one.pose.rotations, other.pose.rotations, atol=1e-9)


def test_the_root_takes_no_step_where_rows_say_another_root():
    roots = dict(zip(NAMES, ["code", "animation", "path", "code", "mixed", "animation", ""], strict=True))
    one = character(moves(root=list(roots.values())))
    updates = driven(one, 300)
    modes = [roots[update.decision.playing.asset] for update in updates]
    assert len({mode for mode, after in pairwise(modes) if mode != after}) > 2
    steps = np.linalg.norm(np.diff([update.pose.root[:2] for update in updates], axis=0), axis=1)
    assert steps.max() < 4.5 * DT, "nobody runs faster"


def test_a_row_that_needs_a_body_says_so_without_one():
    one = character(moves(root="code"), motion.PoseSettings(root="animation"))
    decision = one.update(DT, (0.0, 0.0), {"gait": "Idle"}).decision
    with pytest.raises(motion.MotionError, match='root = "code" needs a body'):
        motion.PoseStream(one.stream.banks, motion.PoseSettings(root="animation")).update(decision, DT)


# ---- what is kept


def test_how_a_row_plays_is_in_the_state_and_in_the_session(tmp_path):
    one = character(moves(play_rate="0.9..1.1", blend_s="0.4"))
    trace = one.record(0)
    driven(one, 30)
    other, state = character(moves(play_rate="0.9..1.1", blend_s="0.4")), pickle.loads(pickle.dumps(one.state))
    other.restore(state)
    assert other.controller.state.play == RowPlay(blend_s=0.4, min_rate=0.9, max_rate=1.1)
    for left, right in zip(driven(one, 60, 30), driven(other, 60, 30), strict=True):
        np.testing.assert_array_equal(left.pose.positions, right.pose.positions)
    trace.save(tmp_path / "session.parquet")
    again = Trace.load(tmp_path / "session.parquet")
    assert [decision.play for decision in again] == [decision.play for decision in trace]
    assert plays(again[-1].playing) == plays(trace[-1].playing)


def test_a_crowd_plays_as_each_does_alone():
    tables = moves(play_rate=["1.2", "", "0.8..1", "", "", "1", ""], blend_s=["", "0.1", "0.8", "", "0", "", ""], start_s="0.1",
                   root=["code", "", "animation", "", "path", "", ""])  # fmt: skip
    alone, together = [character(tables) for _ in range(3)], motion.Crowd([character(tables) for _ in range(3)])
    sticks = [(0.0, 1.2), (1.2, 0.4), (0.0, 2.6)]
    for tick in range(60):
        asked = [stick if tick > 10 * i else (0.0, 0.0) for i, stick in enumerate(sticks)]
        facts = [{"gait": "Idle" if not any(stick) else "Run" if stick[1] > 2.0 else "Walk"} for stick in asked]
        crowd = together.update(DT, asked, facts)
        for one, stick, fact, other in zip(alone, asked, facts, crowd, strict=True):
            np.testing.assert_allclose(one.update(DT, stick, fact).pose.positions, other.pose.positions, atol=1e-9)


def test_a_decision_without_rows_that_say_anything_says_nothing():
    one = character(moves(**dict.fromkeys(ACCEPTED, "")))
    assert {update.decision.play for update in driven(one, 40)} == {None}
    assert_same(character(moves(**dict.fromkeys(ACCEPTED, ""))), character(moves()))
