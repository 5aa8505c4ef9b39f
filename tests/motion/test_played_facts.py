"""Facts of what plays: which foot is down, how fast the clip goes, its phase and its tags, given to tables that ask for them."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_character import CHANNELS, COLUMNS, CONDITIONS, DT, NAMES, clips, parts

import contextdb as cdb
from contextdb import motion
from contextdb.core import going
from contextdb.motion.characters.played import MOST_S, Played
from contextdb.motion.selection.decision import Playing

FOOT = {"type": "bool"}
FACTS = {
    "LeftFoot.Down": FOOT,
    "RightFoot.Down": FOOT,
    "LeftFoot.UntilDown_s": {"type": "number", "unit": "s"},
    "Playing.Speed": {"type": "number", "unit": "m/s"},
    "Playing.Turn": {"type": "number"},
    "Playing.Phase": {"type": "number"},
    "Playing.Tag.Move": {"type": "bool"},
}


def playing(asset: str, time_s: float, *, mirrored: bool = False) -> Playing:
    at = NAMES.index(asset)
    _, database, _ = parts()
    return Playing("loco", asset, at, int(database.starts[at]) + round(time_s * 30.0), time_s, mirrored)


def played(asset: str, time_s: float) -> Played:
    _, database, bank = parts()
    return Played(playing(asset, time_s), database, bank)


@given(asset=st.sampled_from(NAMES), time_s=st.floats(0.0, 6.0), foot=st.integers(0, 1))
def test_until_down_is_the_first_contact_of_the_clip_from_now_on(asset, time_s, foot):
    _, _, bank = parts()
    number = bank.range_of(asset)
    contacts = bank.contacts[bank.starts[number] : bank.stops[number], foot]
    now = min(math.floor(time_s * 30.0 + 0.5), len(contacts) - 1)
    rounds = 2 if bank.looping[number] else 1
    later = [i for i in range(now, len(contacts) * rounds) if contacts[i % len(contacts)]]
    expected = min((later[0] - now) / 30.0, MOST_S) if later else MOST_S
    asked = played(asset, time_s)
    assert asked.until_down_s(foot) == pytest.approx(expected)
    assert asked.is_down(foot) == bool(contacts[now])


def place_at(path, frame):
    """Where a path is at a frame, by itself."""
    low = min(max(int(frame), 0), len(path) - 1)
    share = min(max(frame - low, 0.0), 1.0)
    here, there = path[low].tolist(), path[min(low + 1, len(path) - 1)].tolist()
    return [one + share * (other - one) for one, other in zip(here, there, strict=True)]


@given(st.integers(1, 90), st.floats(0.0, 4.0))
def test_speed_and_turn_are_those_between_two_places_a_second_apart(n, at_s):
    path = np.random.default_rng(n).normal(size=(n, 3)).astype(np.float32)
    first, last = max(at_s * 30.0 - 15.0, 0.0), min(at_s * 30.0 + 15.0, n - 1.0)
    (x, z, heading), (to_x, to_z, to_heading) = place_at(path, first), place_at(path, last)
    seconds = (last - first) / 30.0
    moved = [math.hypot(to_x - x, to_z - z), math.degrees(to_heading - heading)]
    expected = [each / seconds for each in moved] if last > first else [0.0, 0.0]
    assert going(path, 30.0, at_s) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(("asset", "speed"), [("walk", 1.3), ("jog", 2.6), ("idle", 0.0)])
def test_the_speed_is_that_of_the_made_clip(asset, speed):
    found, turn = played(asset, 1.0).motion()
    assert found == pytest.approx(speed, abs=0.25)
    assert abs(turn) < 15.0


def test_a_clip_that_turns_left_has_a_positive_turn_and_its_phase_goes_from_0_to_1():
    turns = [played("walk_turn_left_90", each).motion()[1] for each in np.arange(0.0, 4.0, 0.1)]
    assert max(turns) > 30.0
    assert min(turns) > -10.0
    assert played("walk_turn_left_90", 0.0).phase() == 0.0
    assert played("walk_turn_left_90", 99.0).phase() == 1.0


def test_a_tag_covers_those_below_it():
    marks = motion.Markup.parse("asset,tag,from,to\nwalk,Move.Walk,,\njog,Moves,,\n")
    schema = motion.FeatureSchema.from_dict("loco", {"rate": 30.0, "channels": CHANNELS})
    database = motion.MotionDatabase.build(clips(), schema, markup=marks)

    def has(asset: str, tag: str) -> bool:
        return Played(playing(asset, 1.0), database, None).has_tag(tag)

    assert [has("walk", tag) for tag in ("Move", "move.walk", "Move.Wal", "Run")] == [True, True, False, False]
    assert not has("jog", "Move")


def character(columns: dict, conditions: dict) -> motion.Character:
    schema, database, bank = parts()
    table = cdb.Table.from_columns(columns, conditions).compile()
    selector = motion.Selector([motion.Entry("loco", database)])
    return motion.Character(motion.Controller(selector), schema, table, motion.PoseStream(bank))


def test_a_character_gives_them_to_a_table_that_asks_and_only_then():
    conditions = {**CONDITIONS, **FACTS}
    columns = {**COLUMNS, **{name: ["Any"] * len(NAMES) for name in FACTS}}
    walker = character(columns, conditions)
    first = walker.update(DT, (0.0, 1.3), {"gait": "Walk"})
    assert {first.facts[name] for name in ("LeftFoot.Down", "Playing.Tag.Move")} == {False}
    assert first.facts["LeftFoot.UntilDown_s"] == MOST_S
    for _ in range(60):
        before = walker.playing
        step = walker.update(DT, (0.0, 1.3), {"gait": "Walk"})
        assert before is not None
        asked = played(before.asset, before.time_s)
        assert step.facts["LeftFoot.Down"] == asked.is_down(0)
        assert step.facts["RightFoot.Down"] == asked.is_down(1)
        assert step.facts["Playing.Speed"] == asked.motion()[0]
        assert 0.0 <= step.facts["Playing.Phase"] <= 1.0
    plain = character(COLUMNS, CONDITIONS).update(DT, (0.0, 1.3), {"gait": "Walk"})
    assert not set(FACTS) & set(plain.facts)


def test_they_are_recorded_in_a_session_as_they_were_given(tmp_path):
    columns = {"Asset Name": list(NAMES), "LeftFoot.Down": ["Any"] * len(NAMES), "Playing.Speed": ["Any"] * len(NAMES)}
    walker = character(columns, {name: FACTS[name] for name in columns if name in FACTS})
    walker.controller.recorder = trace = motion.Trace()
    told = [walker.update(DT, (0.0, 1.3)).facts for _ in range(10)]
    trace.save(tmp_path / "session.parquet")
    assert [each.context for each in motion.Trace.load(tmp_path / "session.parquet")] == told


def test_the_game_wins_and_another_type_or_unit_is_not_answered():
    conditions = {**CONDITIONS, "Playing.Speed": {"type": "number", "unit": "km/h"}, "LeftFoot.Down": FOOT}
    columns = {**COLUMNS, "Playing.Speed": ["Any"] * len(NAMES), "LeftFoot.Down": ["True"] + ["Any"] * (len(NAMES) - 1)}
    walker = character(columns, conditions)
    step = walker.update(DT, (0.0, 1.3), {"gait": "Walk", "LeftFoot.Down": True, "Playing.Speed": 4.0})
    assert (step.facts["LeftFoot.Down"], step.facts["Playing.Speed"]) == (True, 4.0)
    with pytest.raises(cdb.ContextDBError, match=r"Playing\.Speed"):
        walker.update(DT, (0.0, 1.3), {"gait": "Walk"})


def test_start_with_the_free_foot_is_a_cell():
    columns = {
        "Asset Name": ["walk", "walk_turn_left_90", "walk_turn_right_90"],
        "LeftFoot.Down": ["Any", "False", "True"],
    }
    walker = character(columns, {"LeftFoot.Down": FOOT})
    seen = set()
    for _ in range(90):
        before = walker.playing
        walker.update(DT, (0.0, 1.3))
        valid = walker.tables.query({"LeftFoot.Down": before is not None and played(before.asset, before.time_s).is_down(0)})
        seen.add(tuple(valid.assets))
    assert seen == {("walk", "walk_turn_left_90"), ("walk", "walk_turn_right_90")}
    assert math.isfinite(walker.body.heading)
