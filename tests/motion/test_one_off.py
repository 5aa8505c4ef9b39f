"""A one-off moves a character to its target, and what would play without it goes on below."""

import math

import numpy as np
import pytest
from test_character import DT, character, parts

from contextdb import motion
from contextdb.errors import ContextError
from contextdb.motion.characters.paths import path_ahead
from contextdb.motion.selection.decision import Playing


def begun():
    """A character that walks, and a one-off of it: a turn that ends two metres ahead of it, to the left."""
    one = character()
    for _ in range(20):
        one.update(DT, (0.0, 1.3), {"gait": "Walk"})
    node = motion.MatchNode(parts()[1])
    play = node.enter(one.features(), motion.Target(0.3, 2.0), [name == "stop_walk" for name in node.database.assets])
    return one, motion.OneOff(one, play, "all")


def test_a_one_off_ends_at_its_target_and_the_character_goes_on_from_there():
    one, once = begun()
    goal = one.root.then(motion.RootMotion(0.3, 2.0))
    while not once.is_done:
        updated = once.update(DT, (0.0, 1.3), {"gait": "Walk"})
        assert updated.pose.playing.asset == "stop_walk"
    assert one.body.position == pytest.approx((goal.left_m, goal.ahead_m), abs=1e-6)
    after = one.update(DT, (0.0, 1.3), {"gait": "Walk"})
    assert math.dist(after.pose.root[:2], one.body.position) < 0.2


def test_facts_that_are_refused_leave_a_one_off_where_it_was():
    one, once = begun()
    before = one.state
    with pytest.raises(ContextError, match="Wlak"):
        once.update(DT, (0.0, 1.3), {"gait": "Wlak"})
    assert once.play.time_s == 0.0
    assert one.state == before


def test_a_character_without_poses_plays_no_one_off():
    _, once = begun()
    with pytest.raises(ContextError, match="the character has no pose stream"):
        motion.OneOff(character(poses=False), once.play, "all")


def test_a_screen_names_the_one_off_that_is_shown_and_why():
    one, once = begun()
    readout = motion.Readout()
    updated = once.update(DT, (0.0, 1.3), {"gait": "Walk"})
    readout.update(updated, one.tables, once.decision)
    assert readout.title.startswith("stop_walk")
    assert readout.why.startswith("plays stop_walk on to its target; its cost was ")


def test_the_path_ahead_is_where_the_clip_goes_from_its_root():
    database = parts()[1]
    start = int(database.starts[database.assets.index("walk")])
    playing = Playing("all", "walk", database.assets.index("walk"), start + 10, 1 / 3, False)
    path = path_ahead(database, playing, (3.0, 4.0, math.pi / 2.0), 0.5)
    assert len(path.positions) == 16
    assert path.positions[0] == pytest.approx((3.0, 4.0))
    own = database.root[start + 10 : start + 26]
    assert path.positions[-1][0] - 3.0 == pytest.approx(np.linalg.norm(own[-1, :2] - own[0, :2]), abs=0.02)
    last = Playing("all", "walk", playing.range, int(database.stops[playing.range]) - 1, 0.0, False)
    assert len(path_ahead(database, last, (0.0, 0.0, 0.0)).positions) == 1


def test_a_target_says_how_far_and_in_which_direction_it_is():
    target = motion.Target(3.0, -4.0)
    assert target.distance_m == pytest.approx(5.0)
    assert target.direction_deg == pytest.approx(143.13, abs=0.01)
