"""A character does in one update what its parts do by hand, and each part may be another; a crowd does what each does alone."""

import copy
import math
import pickle
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip

import contextdb as cdb
from contextdb import motion
from contextdb.motion.characters.drives import drives
from contextdb.motion.characters.facts import FACTS, Moment
from contextdb.motion.characters.probing import plan_of
from contextdb.motion.characters.walks import begun, wished_along
from contextdb.motion.clips.steering import N_NUMBERS, steered_path

DT = 1.0 / 30.0
NAMES = ("idle", "walk", "walk_turn_left_90", "walk_turn_right_90", "jog", "start_walk", "stop_walk")
CHANNELS = [
    {"type": "position", "bone": "LeftFoot"},
    {"type": "position", "bone": "RightFoot"},
    {"type": "velocity", "bone": "Hips"},
    {"type": "trajectory", "what": "position", "at": [0.33, 0.67, 1.0]},
    {"type": "trajectory", "what": "direction", "at": [0.33, 0.67, 1.0]},
]
PAST = {"type": "trajectory", "what": "position", "at": [-0.4, 0.4]}
COLUMNS = {
    "Asset Name": list(NAMES),
    "gait": ["Idle", "Walk", "Walk", "Walk", "Run", "Walk", "Idle Walk"],
    "speed": ["0..0.5", "0.5..1.8", "0.5..1.8", "0.5..1.8", "1.6..4", "0..1.4", "0..1.4"],
    "direction": ["Any", "-60..60", "30..180", "-180..-30", "Any", "Any", "Any"],
}
CONDITIONS = {
    "gait": {"type": "enum", "values": ["Idle", "Walk", "Run"]},
    "speed": {"type": "number", "min": 0, "max": 6, "unit": "m/s"},
    "direction": {"type": "angle"},
}


@cache
def clips():
    return tuple(make_clip(name).clip for name in NAMES)


@cache
def table():
    return cdb.Table.from_columns(COLUMNS, CONDITIONS).compile()


@cache
def parts(*more):
    schema = motion.FeatureSchema.from_dict("loco", {"rate": 30.0, "channels": [*CHANNELS, *(PAST for _ in more)]})
    return schema, motion.MotionDatabase.build(clips(), schema), motion.PoseBank.build(clips(), schema)


def character(root="mixed", tables=None, *more, poses=True, **options):
    schema, database, bank = parts(*more)
    controller = motion.Controller(motion.Selector([motion.Entry("all", database)]))
    stream = motion.PoseStream(bank, motion.PoseSettings(root=root)) if poses else None
    return motion.Character(controller, schema, table() if tables is None else tables, stream, **options)


def stick_at(tick):
    return ((0.0, 0.0), (0.0, 1.2), (1.2, 0.0), (0.0, 2.6), (0.0, 0.0))[tick // 20 % 5]


def gait(stick):
    speed = math.hypot(*stick)
    return {"gait": "Idle" if not speed else "Walk" if speed < 2.0 else "Run"}


def test_a_character_and_its_copy_stand_on_the_ground_that_they_are_given():
    flat, high = character(), character(ground=lambda x, z: (0.3, (0.0, 1.0, 0.0)))
    driven(flat, 10), driven(high, 10)
    for one, other in zip(driven(flat, 30), driven(high.copy(), 30), strict=True):
        np.testing.assert_allclose(other.pose.positions - one.pose.positions, np.tile([0.0, 0.3, 0.0], (19, 1)), atol=1e-3)


def driven(one, ticks, begin=0):
    return [one.update(DT, stick_at(tick), gait(stick_at(tick))) for tick in range(begin, begin + ticks)]


def assert_same_poses(left, right, atol=0.0):
    for one, other in zip(left, right, strict=True):
        assert one.decision.playing == other.decision.playing
        assert one.facts == pytest.approx(other.facts)
        np.testing.assert_allclose(one.pose.positions, other.pose.positions, rtol=0.0, atol=atol)


# ---- one character


def test_an_update_is_what_its_parts_do_by_hand():
    schema, database, bank = parts()
    controller = motion.Controller(motion.Selector([motion.Entry("all", database)]))
    stream = motion.PoseStream(bank, motion.PoseSettings(root="code"))
    body, one = motion.Steered(), character("code")
    for tick in range(100):
        stick = stick_at(tick)
        body = body.moved(DT, stick)
        ahead = controller.upcoming(DT)
        if ahead is None:
            pose = database.normalisation.undo(np.zeros(schema.n_features))
            pose[schema.slices["Hips velocity"]] = 0.0
        else:
            pose = database.raw(ahead.frame)
        direction = math.degrees(math.remainder(math.atan2(*stick) - body.heading, math.tau)) if any(stick) else 0.0
        facts = {**gait(stick), "speed": math.hypot(*body.velocity), "direction": direction}
        query = motion.with_path(schema, pose, steered_path([body], stick, reach_s=1.0 + DT))
        decision = controller.update(DT, query, table().query(facts))
        updated = one.update(DT, stick, gait(stick))
        assert updated.body == body
        assert updated.facts == pytest.approx(facts)
        assert updated.decision.playing == decision.playing
        expected = stream.update(decision, DT, body)
        np.testing.assert_allclose(updated.pose.positions, expected.positions, rtol=0.0, atol=1e-9)


def test_a_stick_may_be_an_array():
    one, other = character(), character()
    for tick in range(40):
        moved, same = (
            one.update(DT, stick_at(tick), gait(stick_at(tick))),
            other.update(DT, np.array(stick_at(tick)), gait(stick_at(tick))),
        )
    assert (moved.body, moved.decision.playing) == (same.body, same.decision.playing)


def test_a_search_hears_where_the_animation_really_is():
    one = character()
    driven(one, 50)
    before = one.state
    body, root = one.body, one.update(0.0, (1.2, 0.0), gait((1.2, 0.0))).pose.root
    assert math.dist(root[:2], body.position) > 0.01
    one.restore(before)
    updated = one.update(0.0, (1.2, 0.0), gait((1.2, 0.0)))
    path = updated.path
    assert path.positions[path.now] == pytest.approx(root[:2], abs=0.02)
    end = steered_path([updated.body], (1.2, 0.0), reach_s=1.0 + DT)
    assert math.dist(path.positions[-1], end.positions[-1]) < 0.1 * math.dist(root[:2], body.position)


def test_where_the_clip_moves_the_body_the_game_s_body_is_where_the_pose_is():
    one = character("animation")
    for updated in driven(one, 60):
        assert (*updated.body.position, updated.body.heading) == updated.pose.root
    assert one.body == updated.body


def test_the_game_may_move_the_body_and_plan_the_path_itself():
    one = character("code")
    body = motion.Steered(position=(3.0, 4.0), velocity=(0.0, 1.0), heading=0.5)
    path = motion.Trajectory(30.0, np.linspace((3.0, 4.0), (3.0, 5.0), 40), np.full(40, 0.5))
    updated = one.update(DT, (0.0, 1.0), {"gait": "Walk"}, body=body, path=path)
    assert one.body == body
    assert updated.facts["speed"] == 1.0
    assert updated.pose.root == (3.0, 4.0, 0.5)
    np.testing.assert_allclose(updated.path.positions, path.positions, atol=1e-12)


def test_a_character_put_elsewhere_plays_on_there():
    one = character()
    driven(one, 40)
    one.body = replace(one.body, position=(50.0, -20.0))
    updated = one.update(DT, (0.0, 1.2), {"gait": "Walk"})
    assert math.dist(updated.pose.root[:2], (50.0, -20.0)) < 0.3


# ---- facts and tables


def test_facts_of_the_game_win_over_the_character_s_own():
    updated = character().update(DT, (0.0, 1.2), {"gait": "Walk", "speed": 3.5})
    assert updated.facts == {"direction": 0.0, "gait": "Walk", "speed": 3.5}


@pytest.mark.parametrize(
    ("stick", "heading", "expected"), [((1.0, 0.0), 0.0, 90.0), ((0.0, -1.0), 3.0, 8.1), ((0.0, 0.0), 2.0, 0.0)]
)
def test_the_direction_is_the_stick_s_against_the_facing(stick, heading, expected):
    moment = Moment(DT, stick, None, motion.Steered(heading=heading), None)
    assert FACTS["direction"](moment) == pytest.approx(expected, abs=0.02)


def test_speed_and_turn_are_the_body_s():
    moment = Moment(DT, (0.0, 0.0), None, motion.Steered(velocity=(3.0, 4.0), turn_rate=math.pi), None)
    assert FACTS["speed"](moment) == 5.0
    assert FACTS["turn"](moment) == 180.0


@pytest.mark.parametrize(
    "condition", [{"type": "number", "unit": "km/h"}, {"type": "enum", "values": ["slow", "fast"]}, {"type": "text"}]
)
def test_a_condition_of_another_type_or_unit_is_not_answered(condition):
    asked = cdb.Table.from_columns({"Asset Name": ["walk"], "speed": ["Any"]}, {"speed": condition}).compile()
    with pytest.raises(cdb.ContextError, match='"speed" is missing'):
        character(tables=asked).update(DT, (0.0, 1.0))


def test_facts_of_one_s_own_are_functions_of_the_moment():
    asked = cdb.Table.from_columns(
        {"Asset Name": ["walk"], "speed": ["36"]}, {"speed": {"type": "number", "unit": "km/h"}}
    ).compile()
    one = character(tables=asked, own_facts={"speed": lambda moment: 3.6 * math.hypot(*moment.body.velocity)})
    updated = one.update(DT, facts={}, body=motion.Steered(velocity=(0.0, 10.0)))
    assert updated.facts == {"speed": 36.0}
    assert updated.decision.playing.asset == "walk"


def test_a_live_context_is_set_and_asked():
    live = table().live()
    live["gait"] = "Walk"
    one, plain = character(tables=live), character()
    for tick in range(20, 60):
        of_live = one.update(DT, stick_at(tick))
        of_table = plain.update(DT, stick_at(tick), {"gait": "Walk"})
        assert of_live.decision.playing == of_table.decision.playing
    assert live["speed"] == pytest.approx(math.hypot(*one.body.velocity))


def test_each_database_may_have_a_table_of_its_own():
    schema, database, bank = parts()
    only_jog = cdb.Table.from_columns({"Asset Name": ["jog"], "speed": ["Any"]}, {"speed": {"type": "number"}}).compile()
    selector = motion.Selector([motion.Entry("first", database, 1e-9), motion.Entry("second", database)])
    stream = motion.PoseStream({"first": bank, "second": bank})
    one = motion.Character(motion.Controller(selector), schema, {"first": only_jog, "second": table()}, stream)
    statuses = {(each.database, each.status) for each in one.update(DT, (0.0, 1.2), {"gait": "Walk"}).decision.choice.searches}
    assert {database for database, _ in statuses} == {"first", "second"}
    assert one.playing.database == "second"


def test_without_a_table_all_may_play_and_without_a_stream_there_is_no_pose():
    schema, database, _ = parts()
    one = motion.Character(motion.Controller(motion.Selector([motion.Entry("all", database)])), schema)
    updated = [one.update(DT, (0.0, 2.6)) for _ in range(60)][-1]
    assert updated.pose is None
    assert updated.decision.playing.asset == "jog"
    assert updated.decision.context is None


def test_valid_takes_the_place_of_the_tables():
    updated = character().update(DT, (0.0, 1.2), {}, valid=[name == "jog" for name in parts()[1].assets])
    assert updated.decision.playing.asset == "jog"


def test_the_pose_of_a_query_may_be_another():
    asked = []

    def pose(one, dt):
        asked.append((one.playing, dt))
        return parts()[1].raw(0)

    updated = character(pose=pose).update(DT, (0.0, 1.2), {"gait": "Walk"})
    assert asked == [(None, DT)]
    assert updated.decision.query[:9] == pytest.approx(parts()[1].raw(0)[:9], abs=1e-5)


# ---- state


def test_a_character_goes_back_and_does_the_same_again():
    one = character("mixed", None, "past")
    driven(one, 35)
    state = one.state
    first = driven(one, 40, 35)
    one.restore(state)
    assert_same_poses(first, driven(one, 40, 35))
    other = character("mixed", None, "past")
    other.restore(state)
    assert_same_poses(first, driven(other, 40, 35))


def test_a_copy_stands_where_the_character_stands_and_goes_its_own_way():
    one = character()
    driven(one, 35)
    copied = one.copy()
    went = driven(one, 40, 35)
    assert_same_poses(went, driven(copied, 40, 35))
    driven(copied, 5)
    assert copied.body != one.body


@pytest.mark.parametrize(
    "copied",
    [copy.copy, lambda one: copy.copy(motion.Crowd([one]))[0], lambda one: pickle.loads(pickle.dumps(one))],
    ids=["copy", "copy of a crowd", "pickle"],
)
def test_copies_of_python_s_own_go_their_own_way(copied):
    one, same = character(), character()
    driven(one, 35), driven(same, 35)
    other = copied(one)
    assert_same_poses(driven(other, 40, 35), driven(same.copy(), 40, 35))
    assert_same_poses(driven(one, 40, 35), driven(same, 40, 35))


def test_what_a_character_is_made_of_shows_itself_in_one_line():
    one = character()
    assert [repr(part) for part in (one, one.controller, one.controller.selector, one.record())] == [
        "<Character: plays nothing>",
        "<Controller: plays nothing>",
        '<Selector: "all">',
        "<Trace: 0 decisions>",
    ]
    driven(one, 1)
    assert (repr(one), repr(one.stream)) == ('<Character: plays "idle">', '<PoseStream: root "mixed", 19 joints>')
    assert re.fullmatch(r"<PoseBank: \d+ ranges, [\d,]+ frames, 19 joints>", repr(one.stream.rig))


def test_what_a_character_gives_and_is_put_back_to_shows_itself_in_one_short_line():
    one = character()
    [updated] = driven(one, 1)
    assert repr(updated) == '<Updated: tick 0, plays "idle", at x 0, z 0>'
    assert repr(one.stream.state) == '<PoseState: plays "idle", 19 joints>'


def test_what_is_refused_leaves_the_character_where_it_stood():
    one = character()
    driven(one, 30)
    state, before, body = one.state, one.controller.state, one.body
    with pytest.raises(cdb.ContextError, match="Wlak"):
        one.update(DT, (0.0, 1.0), {"gait": "Wlak"})
    assert one.state == state
    one.stream = motion.PoseStream({"other": parts()[2]})
    with pytest.raises(motion.MotionError, match='no pose bank of the database "all"'):
        one.update(DT, (0.0, 1.0), {"gait": "Walk"})
    assert (one.controller.state, one.body) == (before, body)


def test_a_record_has_every_decision_and_its_facts():
    one = character()
    trace = one.record(2)
    updated = driven(one, 30)
    assert [decision.playing for decision in trace] == [each.decision.playing for each in updated]
    assert trace[25].context == pytest.approx(dict(updated[25].facts))


# ---- a path from the root


def path_from(root, path):
    """The path that a character wishes for whose root is there, and whose body stands at the origin, where the path begins."""
    schema = parts()[0]
    row = begun(schema.ways, motion.Steered())
    row[0, N_NUMBERS : N_NUMBERS + 3] = root
    wished = wished_along(schema, row, path, np.zeros((1, schema.n_features)))[0][0]
    return motion.Trajectory(wished.rate, wished.positions[wished.now :], wished.headings[wished.now :])


@given(st.tuples(st.floats(-2, 2), st.floats(-2, 2), st.floats(-0.78, 0.78)), st.tuples(st.floats(-2, 2), st.floats(-2, 2)))
def test_a_path_from_a_root_begins_there_and_comes_to_the_body_s_path_without_a_step(root, stick):
    path = steered_path([motion.Steered(velocity=(0.0, 1.0))], stick, reach_s=12.0, rate=300.0)
    found = path_from(root, path)
    apart = np.column_stack((found.positions - path.positions, found.headings - path.headings))
    assert apart[0] == pytest.approx(root, abs=1e-9)
    np.testing.assert_allclose(apart[-1], 0.0, atol=1e-3)
    left = np.abs(apart)
    assert (left[1:] <= left[:-1] + 1e-12).all()
    np.testing.assert_allclose(apart[1], apart[0], atol=0.02 * (1.0 + np.abs(apart[0]).max()))  # no velocity at first


def test_a_character_that_faces_far_away_is_told_to_be_45_degrees_away():
    path = steered_path([motion.Steered()], (0.0, 1.0))
    assert path_from((0.0, 0.0, 3.0), path).headings[0] == pytest.approx(math.radians(45.0))
    assert path_from((0.0, 0.0, -3.0), path).headings[0] == pytest.approx(-math.radians(45.0))


def test_a_body_that_is_where_its_root_is_keeps_its_path():
    path = steered_path([motion.Steered()], (0.0, 1.0))
    found = path_from((0.0, 0.0, math.tau), path)
    assert np.array_equal(found.positions, path.positions)
    assert np.array_equal(found.headings, path.headings)


def test_what_lies_behind_is_where_the_animation_was():
    one = character("mixed", None, "past")
    roots = [updated.pose.root for updated in driven(one, 60)]
    path = one.update(DT, stick_at(60), gait(stick_at(60))).path
    assert path.now >= 12
    behind = path.positions[path.now - 10]
    assert behind == pytest.approx(roots[-10][:2], abs=0.05)


# ---- crowds


def crowd_of(members):
    return motion.Crowd(members), [member.copy() for member in members]


@pytest.mark.parametrize("more", [(), ("past",)])
def test_a_crowd_plays_what_each_plays_alone(more):
    members = []
    for i in range(6):
        one = character("mixed", None, *more)
        driven(one, 7 * i)
        members.append(one)
    members[2].tables = table().live()
    members[3].tables = {"all": table()}
    members[4].own_facts = {**FACTS, "speed": lambda moment: 1.0}
    members[5].ground = lambda x, z: (0.2, (0.0, 1.0, 0.0))
    crowd, alone = crowd_of(members)
    for tick in range(70):
        sticks = [stick_at(tick + 9 * i) for i in range(6)]
        gaits = {"gait": [gait(stick)["gait"] for stick in sticks]}
        facing = [0.3 * i for i in range(6)] if tick > 40 else None
        together = crowd.update(DT, sticks, gaits, facing)
        each = [
            one.update(DT, stick, gait(stick), None if facing is None else facing[i])
            for i, (one, stick) in enumerate(zip(alone, sticks, strict=True))
        ]
        assert_same_poses(together, each, atol=1e-6)


@pytest.mark.parametrize("tables", [table, lambda: {"all": table()}])
def test_a_crowd_of_one_table_plays_what_each_plays_alone(tables):
    own = tables()
    crowd, alone = crowd_of([character("mixed", own) for _ in range(4)])
    for tick in range(60):
        sticks = [stick_at(tick + 9 * i) for i in range(4)]
        together = crowd.update(DT, sticks, {"gait": [gait(stick)["gait"] for stick in sticks]})
        each = [one.update(DT, stick, gait(stick)) for one, stick in zip(alone, sticks, strict=True)]
        assert_same_poses(together, each)
        assert [one.decision.why for one in together] == [one.decision.why for one in each]


@pytest.mark.parametrize(
    ("sticks", "facing", "message"),
    [
        ([[0.0, 1.0]], None, r"the sticks have shape \(1, 2\)\. Accepted: \(2, 2\), x and z for each character"),
        ([[0.0, 1.0], [np.nan, 0.0]], None, r"the velocity \[nan, 0.0\] is asked of character 1. Accepted: numbers from -1e\+09"),
        (np.zeros((2, 2)), np.zeros(3), r"the facing has shape \(3,\)"),
        (np.zeros((2, 2)), [np.inf, 0.0], "the facing inf is asked of character 0. Accepted: radians"),
        ("north", None, "sticks"),
    ],
)
def test_a_stick_or_facing_of_a_crowd_that_is_none_is_refused_with_its_character(sticks, facing, message):
    crowd = motion.Crowd([character() for _ in range(2)])
    states = crowd.states
    with pytest.raises(cdb.ContextDBError, match=message):
        crowd.update(DT, sticks, {"gait": "Walk"}, facing)
    assert crowd.states == states


def test_a_crowd_goes_back_to_its_states():
    crowd, _ = crowd_of([character() for _ in range(3)])
    facts = {"gait": "Walk"}
    for _ in range(20):
        crowd.update(DT, [(0.0, 1.2)] * 3, facts)
    states = crowd.states
    first = [crowd.update(DT, [(1.2, 0.0)] * 3, facts) for _ in range(10)]
    crowd.restore(states)
    for one, other in zip(first, [crowd.update(DT, [(1.2, 0.0)] * 3, facts) for _ in range(10)], strict=True):
        assert_same_poses(one, other)


def test_facts_of_a_crowd_are_one_for_all_or_one_for_each():
    crowd = motion.Crowd([character() for _ in range(2)])
    facts = [{"gait": "Walk", "speed": 1.0}, {"gait": "Run", "speed": 2.0}]
    columns = {"gait": ["Walk", "Run"], "speed": np.array([1.0, 2.0])}
    for given_facts in (facts, columns):
        assert [one.facts["speed"] for one in crowd.update(DT, [(0.0, 1.0)] * 2, given_facts)] == [1.0, 2.0]
    with pytest.raises(cdb.ContextError, match='"gait" has 3 facts for 2 characters'):
        crowd.update(DT, [(0.0, 1.0)] * 2, {"gait": ["Walk"] * 3})


def test_what_a_table_refuses_leaves_the_whole_crowd_where_it_stood():
    crowd = motion.Crowd([character() for _ in range(3)])
    crowd.update(DT, [(0.0, 1.2)] * 3, {"gait": "Walk"})
    states = crowd.states
    with pytest.raises(cdb.ContextError, match="Wlak"):
        crowd.update(DT, [(0.0, 1.2)] * 3, {"gait": ["Walk", "Walk", "Wlak"]})
    assert crowd.states == states


def test_a_character_is_in_a_crowd_once():
    one = character()
    crowd = motion.Crowd([one])
    with pytest.raises(motion.MotionError, match="has this character already"):
        crowd.add(one)
    crowd.remove(one)
    assert len(crowd) == 0
    assert crowd.update(DT, np.zeros((0, 2))) == []


# ---- of a project


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> cdb.Project:
    from contextdb.commands.demo_command import make_sample, sample_folder

    folder: Path = tmp_path_factory.mktemp("project") / "game"
    make_sample(sample_folder(), folder)
    return cdb.Project.load(folder)


def test_a_character_of_a_project_walks(project):
    player = motion.Character.of(project, "player")
    updated = [player.update(DT, (0.0, 1.3), {"gait": "Walk", "style": "normal"}) for _ in range(60)]
    assert updated[0].decision.playing.asset == "start_walk"
    assert all("walk" in each.decision.playing.asset for each in updated)
    assert updated[-1].pose.root[1] == pytest.approx(updated[-1].body.position[1], abs=0.15)
    assert updated[-1].body.position[1] > 1.5
    assert set(player.tables) == {"loco_tired", "loco"}


def test_a_controller_that_the_project_has_not_is_told_with_the_nearest(project):
    with pytest.raises(cdb.ContextDBError, match=r'there is no \[controllers.plyer\]. .* Did you mean "player"'):
        motion.Character.of(project, "plyer")


def test_a_probe_lets_a_gait_follow_the_speed_and_takes_every_style(project):
    plan = plan_of(motion.Character.of(project, "player"))
    assert [scene.facts for scene in plan.scenes] == [{"style": "normal"}, {"style": "tired"}]
    for scene in plan.scenes:
        assert [scene.at(stick)["gait"] for stick in ((0.0, 0.0), (0.0, 1.3), (3.4, 0.0))] == ["Idle", "Walk", "Run"]
        assert len(scene.speeds_mps) == 2
        assert 0.8 <= scene.speeds_mps[0] <= 2.0 <= scene.speeds_mps[1] <= 5.0


def test_a_probe_of_a_character_without_tables_goes_as_fast_as_its_clips():
    schema, database, _ = parts()
    plan = plan_of(motion.Character(motion.Controller(motion.Selector([motion.Entry("all", database)])), schema))
    [scene] = plan.scenes
    assert scene.at((0.0, 1.0)) == {}
    assert [0.9 <= speed <= 3.0 for speed in scene.speeds_mps] == [True, True]


def test_drives_ask_for_their_speed_and_come_back_round():
    for drive in drives(1.5):
        speeds = {round(math.hypot(*drive.at(i / 30.0)), 6) for i in range(int(drive.seconds * 30))}
        assert speeds <= {0.0, 0.9, 1.5}, drive.name
        assert 1.5 in speeds
    circle = next(drive for drive in drives(1.5) if drive.name == "circle to the left")
    steps = np.array([circle.at(i / 100.0) for i in range(round(circle.seconds * 100))])
    assert np.abs(steps.sum(axis=0)).max() / 100.0 < 0.05
