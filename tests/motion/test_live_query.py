"""A query from a pose that is shown is what `query_from` gives for the last frame of a clip that ends there."""

import numpy as np
import pytest
from made_once import make_clip
from played import bank, decisions

from contextdb.errors import ContextDBError, MotionError, QueryError
from contextdb.motion import (
    Channel,
    Clip,
    FeatureSchema,
    LivePose,
    PoseHistory,
    PoseSettings,
    PoseStream,
    Skeleton,
    poses_of,
    query_from,
    query_from_pose,
)
from contextdb.motion.clips import quaternions

RATE = 30.0
CHANNELS = (
    Channel("position", bone="LeftFoot"),
    Channel("position", bone="RightFoot", relative_to="Hips"),
    Channel("velocity", bone="LeftFoot"),
    Channel("velocity", bone="Hips"),
    Channel("velocity", bone="RightFoot", relative_to="LeftFoot"),
    Channel("position", bone="LeftFoot", at=(-0.2, 0.1)),
    Channel("angular_velocity", bone="Head"),
    Channel("direction", bone="Head"),
    Channel("orientation", bone="LeftHand", relative_to="Head"),
    Channel("phase"),
    Channel("custom", function="height", size=2),
    Channel("trajectory", what="position", at=(-0.5, 0.33, 1.0)),
    Channel("trajectory", what="direction", at=(0.33,)),
    Channel("trajectory", what="velocity", along=(-0.5, 0.7)),
    Channel("trajectory", what="speed", at=(-0.1, 0.5)),
    Channel("trajectory", what="direction_to_velocity", at=(0.5,)),
)


def schema_of(*channels, **said):
    found = FeatureSchema("live", RATE, channels, **said)
    has_function = any(channel.function for channel in channels)
    return found.with_functions({"height": lambda poses, path: poses.positions[:, :2, 1]}) if has_function else found


def live(clip, rate=None):
    """The poses of a clip as a game has them: joints in the world, rotations against parents, the root turned anyhow."""
    poses = poses_of(clip, rate)
    parents = poses.skeleton.parents
    found = []
    for frame in range(poses.n_frames):
        heading = 0.3 * frame
        world = poses.rotations[frame]
        above = np.concatenate((quaternions.about_axis("y", np.array([heading])), world[parents[1:]]))
        found.append(LivePose(poses.positions[frame], quaternions.multiply(quaternions.inverse(above), world), (7.0, 8.0, heading)))
    return found


def asked(schema, poses, skeleton, rate=RATE, seconds=60.0):
    history = PoseHistory(skeleton, rate, seconds)
    for pose in poses[:-1]:
        history.add(pose)
    return query_from_pose(schema, poses[-1], history)


def cut(clip, n_frames):
    return Clip(clip.name, clip.skeleton, clip.frame_time_s, clip.values[:n_frames], clip.metres_per_unit, clip.up)


@pytest.mark.parametrize("name", ["walk", "walk_turn_left_90", "start_run"])
@pytest.mark.parametrize("frame", [1, 2, 17, 50])
@pytest.mark.parametrize("smooth_s", [0.0, 0.2])
def test_a_live_pose_gives_what_a_clip_that_ends_there_gives(name, frame, smooth_s):
    clip = make_clip(name).clip
    schema = schema_of(*CHANNELS, facing_smooth_s=smooth_s)
    found = asked(schema, live(clip)[: frame + 1], clip.skeleton)
    assert found.dtype == np.float32
    assert found == pytest.approx(query_from(schema, cut(clip, frame + 1), frame), abs=1e-6)


def test_a_pose_without_a_past_stands_still():
    clip = make_clip("walk").clip
    schema = schema_of(*CHANNELS)
    found = asked(schema, live(clip)[:1], clip.skeleton)
    assert found == pytest.approx(query_from(schema, cut(clip, 1), 0), abs=1e-6)
    assert not found[schema.slices["Hips velocity"]].any()


@pytest.mark.parametrize("channel", CHANNELS, ids=lambda channel: channel.name)
def test_no_more_of_the_past_is_looked_at_than_the_channel_needs(channel):
    if channel.type in ("phase", "custom") or channel.along:
        return
    clip = make_clip("walk").clip
    poses = live(clip)[:41]
    back_s = max(0.0, *(-s for s in channel.at), 0.0)
    schema = schema_of(channel)
    enough = asked(schema, poses, clip.skeleton, seconds=back_s + 3.0 / RATE)
    assert enough == pytest.approx(asked(schema, poses, clip.skeleton), abs=1e-6)


def test_a_full_history_forgets_the_oldest_pose_and_goes_on():
    clip = make_clip("walk").clip
    schema = schema_of(Channel("velocity", bone="LeftFoot"), Channel("trajectory", what="position", at=(-0.1, 1.0)))
    history = PoseHistory(clip.skeleton, RATE, 0.2)
    for frame, pose in enumerate(live(clip)):
        found = query_from_pose(schema, pose, history)
        assert found == pytest.approx(query_from(schema, cut(clip, frame + 1), frame), abs=1e-6)
        history.add(pose)
    assert len(history) == 7
    history.clear()
    assert len(history) == 0


def test_the_past_at_another_rate_gives_velocities_over_its_own_steps():
    clip = make_clip("walk").clip
    schema = schema_of(Channel("velocity", bone="LeftFoot"))
    poses = live(clip, 60.0)[:20]
    moved = (poses[-1].positions - poses[-2].positions)[clip.skeleton.index("LeftFoot")] * 60.0
    found = asked(schema, poses, clip.skeleton, 60.0)
    assert np.linalg.norm(found) == pytest.approx(np.linalg.norm(moved), abs=1e-5)


def test_the_pose_of_a_stream_asks_as_its_clip_does():
    schema = schema_of(*(c for c in CHANNELS if c.type != "phase"))
    stream = PoseStream(bank(), PoseSettings(root="animation", blend="none", foot_lock=False))
    history = PoseHistory(bank().skeleton, RATE)
    clip = make_clip("walk_turn_left_90").clip
    for decision in decisions([("walk_turn_left_90", 0.0, 30)], 1.0 / RATE):
        pose = stream.update(decision, 1.0 / RATE if decision.tick else 0.0)
        found = query_from_pose(schema, pose, history)
        history.add(pose)
    assert found == pytest.approx(query_from(schema, cut(clip, 30), 29), abs=2e-4)  # a bank keeps single precision


def test_what_is_no_pose_of_the_rig_is_refused():
    clip = make_clip("walk").clip
    [pose, *_] = live(clip)
    schema, history = schema_of(Channel("position", bone="LeftFoot")), PoseHistory(clip.skeleton)
    wrong = [LivePose(pose.positions[:3], pose.rotations), LivePose(pose.positions * np.nan, pose.rotations), None, "pose"]
    wrong += [LivePose(np.full(pose.positions.shape, "far"), pose.rotations)]
    for other in [*wrong, LivePose(pose.positions, pose.rotations, (0.0, 0.0, "north"))]:
        with pytest.raises(QueryError, match="the pose"):
            query_from_pose(schema, other, history)
        with pytest.raises(QueryError, match="the pose"):
            history.add(other)
    with pytest.raises(MotionError, match='no bone "Tail"'):
        query_from_pose(schema_of(Channel("position", bone="Tail")), pose, history)
    with pytest.raises(ContextDBError):
        PoseHistory(clip.skeleton, 0.0)
    with pytest.raises(ContextDBError):
        PoseHistory(Skeleton)
