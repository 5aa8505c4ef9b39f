"""A table plays without a search: what it picks plays as its row says, and is blended as a stream does by hand."""

import pickle

import numpy as np
import pytest
from played import LOOPS, RATE, SCHEMA, bank, clips, database, decisions
from test_rows_played import BLENDS, table_of

from contextdb import motion
from contextdb.cells.row_play import ROOTS
from contextdb.errors import ContextError, MotionError
from contextdb.motion import Action, PoseSettings, PoseStream, TablePlayer, Target

DT = 1.0 / RATE
MOOD = {"mood": {"type": "enum", "values": ["calm", "busy", "gone"]}}
DAY = {
    "asset": ["idle", "walk", "idle", "jog", "walk", "run", "start_walk", "walk_turn_left_90", "idle", "walk", "jog", "run"],
    "mood": ["calm"] * 4 + ["busy"] * 5 + ["gone"] * 3,
}
SAYS = {
    "blend_s": ["", "0.2", "0", "0.5", "", "0.3", "", "1", "", "0.1", "", ""],
    "start_s": ["", "0.3", "", "", "0.1", "", "0.5", "", "1", "", "", ""],
    "play_rate": ["", "1.2", "0.8", "0.9..1.1", "1.5..2", "", "", "0.7", "", "", "", ""],
    "mirror": ["", "always", "", "never", "as asked", "", "", "", "", "always", "", ""],
    "loop": ["False", "False", "False", "", "", "False", "", "", "False", "True", "", ""],
    "root": ["code", "mixed", "animation", "path", "", "code", "", "mixed", "", "", "", ""],
    "until": ["", "natural", "", "any", "natural", "", "natural", "", "", "any", "", ""],
}


def player(columns, stream=None, **said):
    table = table_of(columns, MOOD, **said)
    return TablePlayer(table, {"loco": database()}, table.picker(seed=1), stream)


def played(one, ticks, mood="calm", **options):
    return [one.update(DT, {"mood": mood}, (0.0, 0.0, 0.0), **options) for _ in range(ticks)]


def test_a_day_of_gestures_is_played_as_its_rows_say():
    one = player(DAY, PoseStream(bank(), PoseSettings()), **SAYS)
    seen = []
    for mood in ("calm", "busy", "gone") * 12:
        seen += played(one, 70, mood)
    assert {each.playing.asset for each in seen} == set(DAY["asset"])
    for decision in (each for each in seen if each.action in (Action.START, Action.JUMP)):
        rows = [row for row, asset in enumerate(DAY["asset"]) if asset == decision.playing.asset]
        said = [{name: cells[row] for name, cells in SAYS.items()} for row in rows]
        assert any(_is_as_said(decision, row) for row in said), decision
    assert {each.play.root for each in seen if each.play is not None} > set(ROOTS) - {"animation"}


def _is_as_said(decision, row):
    playing, rates = decision.playing, [float(part) for part in (row["play_rate"] or "1").split("..")]
    starts = abs(playing.time_s - float(row["start_s"] or 0.0)) <= 0.5 / RATE
    is_mirrored = playing.mirrored == (row["mirror"] == "always")
    return starts and is_mirrored and min(rates) <= decision.play_rate <= max(rates)


def test_poses_are_those_of_a_stream_that_is_driven_by_hand():
    columns = {"asset": ["start_walk", "walk_turn_left_90"], "mood": ["Any", "Any"]}
    halflife_s, said = 0.07, {"root": "code", "start_s": ["0.5", ""]}
    one = player(columns, PoseStream(bank(), PoseSettings()), blend_s=str(BLENDS * halflife_s), **said)
    poses, segments = [], []
    for decision in (one.update(DT, {"mood": "calm"}, (0.0, 0.0, 0.0)) for _ in range(300)):
        poses.append(one.pose)
        if decision.action in (Action.START, Action.JUMP):
            segments.append([decision.playing.asset, decision.playing.time_s, 0])
        segments[-1][2] += 1
    assert len(segments) > 2
    by_hand = PoseStream(bank(), PoseSettings(root="code", halflife_s=halflife_s))
    for decision, pose in zip(decisions(segments, DT), poses, strict=True):
        np.testing.assert_allclose(by_hand.update(decision, DT, (0.0, 0.0, 0.0)).positions, pose.positions, atol=1e-6)


def test_what_loops_stays_while_it_is_valid_and_leaves_as_its_row_says():
    columns = {"asset": ["walk", "idle"], "mood": ["calm", "busy"]}
    leaves = {}
    for until in ("any", "natural"):
        one = player(columns, until=[until, ""])
        assert {each.playing.asset for each in played(one, 200)} == {"walk"}
        leaves[until] = next(i for i, each in enumerate(played(one, 100, "busy")) if each.playing.asset == "idle")
    assert leaves["any"] == 0
    assert 0 < leaves["natural"] < database().stops[0]


def test_the_game_mirrors_what_the_row_leaves_to_it_and_interrupts():
    columns = {"asset": ["walk", "jog"], "mood": ["Any", "Any"]}
    one = player(columns, mirror=["as asked", "never"])
    entered = [played(one, 1, mirrored=True, interrupt=True)[0].playing for _ in range(8)]
    assert {(each.asset, each.mirrored) for each in entered} == {("walk", True), ("jog", False)}
    assert [each.time_s for each in entered] == [0.0] * 8


def test_it_goes_on_from_a_state():
    one = player(DAY, PoseStream(bank(), PoseSettings(root="animation")), **{**SAYS, "root": ""})
    played(one, 40)
    state, picker = one.state, pickle.loads(pickle.dumps(one.picker))
    after = [one.pose.positions for _ in played(one, 90)][-1]
    one.restore(state)
    one.picker = picker
    played(one, 90)
    np.testing.assert_array_equal(one.pose.positions, after)


def test_without_a_valid_row_nothing_plays_and_what_ends_is_held():
    one = player({"asset": ["start_walk"], "mood": ["calm"]})
    assert played(one, 1, "gone")[0].action is Action.NOTHING
    held = [*played(one, 1), *played(one, 300, "gone")][-1]
    assert (held.action, held.playing.asset) == (Action.HOLD, "start_walk")


@pytest.mark.parametrize(("asset", "said", "message"), [
    ("wlak", {}, 'no database has the asset "wlak".*Did you mean "walk"'),
])  # fmt: skip
def test_what_cannot_be_played_says_why(asset, said, message):
    one = player({"asset": [asset], "mood": ["Any"]}, **said)
    with pytest.raises(MotionError, match=message):
        played(one, 1)
    assert one.playing is None


def test_parts_of_another_type_are_refused():
    table = table_of(DAY, MOOD)
    with pytest.raises(ContextError, match="databases"):
        TablePlayer(table, database(), table.picker())
    with pytest.raises(MotionError, match="there is no database"):
        TablePlayer(table, {}, table.picker())


# ---- a one-off obeys too


def node_table(**said):
    columns = {"asset": ["start_walk", "walk_turn_left_90"], "mood": ["calm", "busy"]}
    return table_of(columns, MOOD, **said).query({"mood": "calm"})


def test_a_one_off_plays_as_its_row_says():
    plain = motion.MotionDatabase.build(clips(), SCHEMA, mirror=True, markup=LOOPS)
    node, query = motion.MatchNode(plain), plain.raw(0)
    valid = node_table(play_rate="0.5", start_s="0.4", blend_s="0.25", mirror="always", root="code")
    play, usual = node.enter(query, Target(0.0, 1.0), valid), node.enter(query, Target(0.0, 1.0), node_table())
    assert play.how.blend_s == play.decision().play.blend_s == 0.25
    assert (play.entry_s, play.playhead.mirrored, play.play_rate) == (pytest.approx(0.4), True, 0.5)
    left_s = (plain.stops[play.hit.range] - 1 - play.hit.frame) / RATE
    assert play.duration_s == pytest.approx(left_s / 0.5)
    play.advance(1.0)
    assert play.clip_s == pytest.approx(0.9)
    assert (usual.how, usual.play_rate) == (None, 1.0)
