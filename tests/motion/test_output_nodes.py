"""One-offs in a pose stream: into a match node, through its warp, and out again, without a step."""

import math
from functools import cache

import numpy as np
import pytest
from made_once import make_clip
from played import LOOPS, RATE, SCHEMA, clips, decisions

from contextdb.errors import ContextError
from contextdb.motion import (
    Action,
    Markup,
    MatchNode,
    MotionDatabase,
    PoseBank,
    PoseSettings,
    PoseStream,
    RootMotion,
    Target,
    query_from,
)
from contextdb.motion.nodes.pose_match import pose_schema

STEP = 1.0 / RATE
ANIMATION = PoseSettings(root="animation", foot_lock=False)
MARKS = Markup.parse(
    "asset,tag,from,to\nstop_run,MatchRange,1.8,3.2\nstop_run,WarpPosition,0.0,4.0\nstop_run,WarpRotation,3.0,4.0\n"
)
START = RootMotion(3.0, 1.0, 0.2)


@cache
def node():
    schema = pose_schema(clips()[0].skeleton)
    return MatchNode(MotionDatabase.build([make_clip("stop_run").clip], schema, markup=MARKS))


@cache
def banks():
    return {
        "loco": PoseBank.build(clips(), SCHEMA, mirror=True, markup=LOOPS),
        "stops": PoseBank.build([make_clip("stop_run").clip], pose_schema(clips()[0].skeleton)),
    }


def shown(settings, dt=STEP, n_run=40, n_after=40, body_of=lambda place: None):
    """A run, a stop at a target, and an idle: poses, the tick of both changes, and where the play had the body."""
    stream, poses, places = PoseStream(banks(), settings), [], []
    for d in decisions([("run", 0.0, n_run)], dt):
        poses.append(stream.update(d, dt if d.tick else 0.0, body_of(START)))
    body = RootMotion(*poses[-1].root) if body_of(START) is None else START
    query = query_from(node().database.schema, make_clip("run").clip, 14)
    play = node().enter(query, Target.seen_from(body, body.left_m + 1.0, body.ahead_m + 2.2, 0.6))
    while not play.is_done:
        place = body.then(play.advance(dt))
        places.append(place)
        poses.append(stream.update(play.decision("stops"), dt, body_of(place)))
    for d in decisions([("idle", 1.0, n_after)], dt):
        poses.append(stream.update(d, dt, body_of(place)))
    return poses, (n_run, n_run + len(places)), places


def test_a_jump_into_the_node_and_out_of_it_is_marked_and_no_other():
    poses, changes, _ = shown(ANIMATION)
    assert tuple(i for i, pose in enumerate(poses) if pose.is_jump) == (changes[0],)
    assert poses[changes[1]].playing.asset == "idle"


def test_no_joint_has_a_step_in_its_velocity_at_any_moment():
    dt = 0.002
    poses, changes, _ = shown(ANIMATION, dt, n_run=308, n_after=300)
    cut, _, _ = shown(PoseSettings(root="animation", blend="none", foot_lock=False), dt, n_run=308, n_after=300)
    for change in changes:
        smooth, hard = (
            np.linalg.norm(np.diff([pose.positions for pose in each[change - 3 : change + 4]], n=2, axis=0), axis=-1).max() / dt
            for each in (poses, cut)
        )
        assert smooth < 1.0, change
        assert hard > 2.0, change


@pytest.mark.parametrize("root", ["animation", "mixed"])
def test_the_body_comes_to_the_target_by_the_warp(root):
    body_of = (lambda place: None) if root == "animation" else (lambda p: (p.left_m, p.ahead_m, p.turn_rad))
    poses, changes, places = shown(PoseSettings(root=root), body_of=body_of)
    last, end = poses[changes[1] - 1].root, places[-1]
    near = 0.1 if root == "animation" else 1e-4
    assert math.hypot(last[0] - end.left_m, last[1] - end.ahead_m) < near
    assert math.remainder(last[2] - end.turn_rad, math.tau) == pytest.approx(0.0, abs=0.1)


def test_a_controllers_jump_that_was_not_seen_is_blended_from_what_was():
    stream = PoseStream(banks(), ANIMATION)
    run, *_ = decisions([("run", 0.3, 1)], STEP)
    stream.update(run, 0.0)
    play = node().enter(query_from(node().database.schema, make_clip("run").clip, 14), Target(0.0, 2.0))
    for _ in range(5):
        play.advance(STEP)
        last = stream.update(play.decision("stops"), STEP)
    jump = list(decisions([("run", 0.5, 3), ("idle", 1.0, 1)], STEP))[-1]
    assert jump.action is Action.JUMP
    pose = stream.update(jump, 0.0)
    np.testing.assert_allclose(pose.rotations, last.rotations, atol=1e-9)


def test_the_database_of_a_play_is_named_by_a_text():
    play = node().enter(query_from(node().database.schema, make_clip("run").clip, 14), Target(0.0, 2.0))
    with pytest.raises(ContextError):
        play.decision(3)
