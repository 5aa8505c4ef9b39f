"""A query from the pose that is displayed: what the features of a body are now, from it and from the poses before.

It is what `query_from` gives for the last frame of a clip that ends here: velocities are those since the pose before, and a path
goes on straight ahead as it came. How much of the past a query needs follows from its schema:

    position, direction, orientation      the pose itself
    velocity, angular_velocity            one pose before
    trajectory ahead, in seconds          two poses before
    trajectory along metres               as far back as these metres reach, or two poses
    any channel at seconds before         so many seconds
    phase                                 two steps, 2 seconds: it is known by the footfalls before
    custom                                all there is

With less than that the query is that of a clip that begins where the history does. J joints; lengths in metres, y up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from contextdb.cells.arguments import require_kind, require_real
from contextdb.errors import Fault, QueryError, plural
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.poses import LEAST_RATE, MOST_RATE, Poses
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints, Skeleton
from contextdb.motion.clips.trajectory import PathPoints, Trajectory, after_seconds, along_path
from contextdb.motion.features.channels import Channel
from contextdb.motion.features.extraction import Features, block_of, require_features
from contextdb.motion.features.path_features import point_features
from contextdb.motion.features.schema import FeatureSchema

LONGEST_S = 60.0
PATH_FRAMES = 3
"""So many poses give a path its last velocity, and that before it."""
PLAIN = ("position", "velocity")


class HasPose(Protocol):
    """A pose, such as `Pose` and `LivePose`."""

    @property
    def positions(self) -> Floats:
        """Each joint in the world: [J, 3]."""

    @property
    def rotations(self) -> Floats:
        """Each joint against its parent, the first against the root: [J, 4]."""

    @property
    def root(self) -> tuple[float, float, float]:
        """x and z in metres, and a heading in radians."""


@dataclass(frozen=True, eq=False, slots=True)
class LivePose:
    """A pose from anywhere.

    Attributes
    ----------
    positions : float array, shape (J, 3)
        Each joint in the world, metres, y up.
    rotations : float array, shape (J, 4)
        Each joint against its parent, the first against the root: unit quaternions (w, x, y, z).
    root : (x, z, heading)
        Metres and radians. Only rotations depend on the heading: where the body is follows from its joints, as in clips.
    """

    positions: Floats
    rotations: Floats
    root: tuple[float, float, float] = (0.0, 0.0, 0.0)


class PoseHistory:
    """The poses that were displayed, the newest last.

    Parameters
    ----------
    skeleton : Skeleton
        The rig, such as `PoseBank.skeleton`.
    rate : float
        How many poses a second are added.
    seconds : float
        How far back it reaches; older poses are forgotten.

    Raises
    ------
    ContextError
        `skeleton` is none, or a number is out of range.
    """

    def __init__(self, skeleton: Skeleton, rate: float = 60.0, seconds: float = 2.0) -> None:
        require_kind(skeleton, Skeleton, "skeleton", "a Skeleton")
        self.skeleton = skeleton
        self.rate = require_real(rate, "rate", LEAST_RATE, MOST_RATE)
        self._most = max(PATH_FRAMES, math.ceil(require_real(seconds, "seconds", 0.0, LONGEST_S) * self.rate) + 1)
        self._positions = np.zeros((2 * self._most, skeleton.n_joints, 3))
        self._rotations = np.zeros((2 * self._most, skeleton.n_joints, 4))
        self._headings = np.zeros(2 * self._most)
        self._begin = self._end = 0
        self._planned: tuple[FeatureSchema, _Plan] | None = None

    def __len__(self) -> int:
        return self._end - self._begin

    def add(self, pose: HasPose) -> None:
        """Keep a pose, once it was asked with. Raises QueryError for one of another rig."""
        self._put(pose)
        self._end += 1
        self._begin = max(self._begin, self._end - self._most)

    def clear(self) -> None:
        """Forget all poses, as when the character is put elsewhere."""
        self._begin = self._end = 0

    def with_pose(self, pose: HasPose, most: int) -> tuple[Floats, Floats, Floats]:
        """Positions, rotations and headings of the newest `most` poses, of which this is the last; it is not kept."""
        self._put(pose)
        seen = slice(max(self._begin, self._end + 1 - most), self._end + 1)
        return self._positions[seen], self._rotations[seen], self._headings[seen]

    def plan(self, schema: FeatureSchema) -> _Plan:
        """How a schema is asked of this rig; that of the last schema is cached."""
        if self._planned is None or self._planned[0] is not schema:
            self._planned = schema, _plan(schema, self.skeleton, self.rate)
        return self._planned[1]

    def _put(self, pose: HasPose) -> None:
        if self._end == 2 * self._most:
            for array in (self._positions, self._rotations, self._headings):
                array[: len(self)] = array[self._begin : self._end].copy()
            self._begin, self._end = 0, len(self)
        try:
            positions, rotations, heading = np.asarray(pose.positions), np.asarray(pose.rotations), float(pose.root[2])
        except (AttributeError, TypeError, ValueError, IndexError):
            raise QueryError(Fault(f"the pose is {pose!r}.", "a Pose, or a LivePose")) from None
        n = self.skeleton.n_joints
        if positions.shape != (n, 3) or rotations.shape != (n, 4):
            problem = f"the pose has positions of shape {positions.shape} and rotations of shape {rotations.shape}."
            raise QueryError(Fault(problem, f"{plural(n, 'joint')}: ({n}, 3) and ({n}, 4)"))
        try:
            self._positions[self._end], self._rotations[self._end] = positions, rotations
        except (TypeError, ValueError):
            raise QueryError(
                Fault("the pose contains something that is not a number.", "positions in metres and unit quaternions")
            ) from None
        if not np.isfinite(self._positions[self._end]).all() or not math.isfinite(heading):
            raise QueryError(Fault("the pose holds a number that is not finite.", "positions in metres, a heading in radians"))
        self._headings[self._end] = heading


def query_from_pose(schema: FeatureSchema, pose: HasPose, history: PoseHistory) -> Features:
    """A query: the features of a pose that is displayed, wherever it comes from, and of the way it came.

    Parameters
    ----------
    schema : FeatureSchema
    pose : Pose or LivePose
        What is displayed now.
    history : PoseHistory
        What was displayed before. Add the pose to it afterwards.

    Returns
    -------
    float32 array, shape (N,)
        In the schema's units. `with_path` puts the wished trajectory in.

    Raises
    ------
    QueryError
        The pose is none, of another rig, or not finite.
    MotionError
        The rig lacks a bone of the schema, or a custom channel has no function.
    ContextError
        `schema` or `history` are none.

    Notes
    -----
    At the schema's rate this is what `query_from` gives for the last frame of a clip of the same poses; at another rate of the
    history, velocities are those over the time since its last pose.
    """
    require_kind(schema, FeatureSchema, "schema", "a FeatureSchema")
    require_kind(history, PoseHistory, "history", "a PoseHistory")
    plan = history.plan(schema)
    positions, rotations, headings = history.with_pose(pose, plan.n_frames)
    query = np.empty(schema.n_features, np.float32)
    poses = Poses(history.skeleton, history.rate, positions, rotations)
    path = schema.path_of(poses)
    plan.put_plain(query, positions, path)
    if plan.trajectories:
        _put_trajectories(query, plan, path)
    if plan.others:
        turned = Poses(history.skeleton, history.rate, positions, _in_world(history.skeleton, rotations, headings))
        for channel, where in plan.others:
            query[where] = block_of(channel, turned, path, schema)[-1]
    return query


@dataclass(frozen=True, eq=False, slots=True)
class _Plan:
    """What of a schema is computed how: for one rig and one rate.

    Attributes
    ----------
    n_frames : int
        Poses that are needed, the newest among them.
    bones, others_of : int64 array, shape (P,)
        Of positions and velocities: the joint, and that it is relative to; -1 for the body.
    moves : bool array, shape (P,)
        Which are velocities.
    places : int64 array, shape (P, 3)
        Their features.
    seconds : float array, shape (S,)
        All points of time of the trajectory channels.
    trajectories : list of (channel, features, where its points of time begin)
    others : list of (channel, features)
    """

    n_frames: int
    bones: Ints
    against: Ints
    moves: Floats
    places: Ints
    seconds: Floats
    trajectories: list[tuple[Channel, slice, int]]
    others: list[tuple[Channel, slice]]

    def put_plain(self, query: Features, positions: Floats, path: Trajectory) -> None:
        """Positions and velocities now, in the body's own frame."""
        if not len(self.bones):
            return
        now, before = positions[-1], positions[-2] if len(positions) > 1 else positions[-1]
        still = 1.0 - self.moves
        origin = np.array([path.positions[-1, 0], 0.0, path.positions[-1, 1]])
        is_body = self.against < 0
        base = np.where(is_body[:, None], origin * still, now[self.against])
        last = np.where(is_body[:, None], 0.0, before[self.against])
        vectors = now[self.bones] - base - self.moves * (before[self.bones] - last)
        vectors = vectors * (still + self.moves * path.rate)
        heading = float(path.headings[-1])
        sin, cos = math.sin(heading), math.cos(heading)
        turned = vectors @ np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
        query[self.places] = turned


def _plan(schema: FeatureSchema, skeleton: Skeleton, rate: float) -> _Plan:
    """The plan for a schema, a rig and a rate; raises MotionError where they do not fit."""
    require_features(skeleton, schema)
    plain = [c for c in schema.channels if c.type in PLAIN and not c.at]
    paths = [c for c in schema.channels if c.type == "trajectory"]
    others = [(c, schema.slices[c.name]) for c in schema.channels if c not in plain and c not in paths]
    joints = [[skeleton.index(str(c.bone)), -1 if c.relative_to is None else skeleton.index(c.relative_to)] for c in plain]
    places = [list(range(*schema.slices[c.name].indices(schema.n_features))) for c in plain]
    starts = np.cumsum([0, *(len(c.at) for c in paths)])[:-1].tolist()
    pairs = np.array(joints, np.int64).reshape(-1, 2)
    return _Plan(
        _frames_needed(schema, rate),
        pairs[:, 0],
        pairs[:, 1],
        np.array([[float(c.type == "velocity")] for c in plain]).reshape(-1, 1),
        np.array(places, np.int64).reshape(-1, 3),
        np.array([seconds for c in paths for seconds in c.at]),
        [(c, schema.slices[c.name], start) for c, start in zip(paths, starts, strict=True)],
        others,
    )


def _frames_needed(schema: FeatureSchema, rate: float) -> int:
    """How many poses a query looks at; for channels that need all there is, as many as can be stored."""
    if (
        any(c.along or c.type in ("phase", "custom") for c in schema.channels)
        or max(schema.facing_smooth_s, schema.root_smooth_s) > 0.0
    ):
        return round(LONGEST_S * MOST_RATE)
    back_s = max((-seconds for c in schema.channels for seconds in c.at), default=0.0)
    return PATH_FRAMES + max(0, math.ceil(back_s * rate - 1e-9)) + 1


def _put_trajectories(query: Features, plan: _Plan, path: Trajectory) -> None:
    """The features of all trajectory channels; their points of time are looked up at once."""
    now = len(path.headings) - 1
    is_ahead = bool((plan.seconds >= 0.0).all())
    points = _ahead(path, plan.seconds) if is_ahead else after_seconds(path, now + plan.seconds * path.rate, 0.0)
    for channel, where, start in plan.trajectories:
        blocks = []
        if channel.at:
            own = slice(start, start + len(channel.at))
            frames = np.full(len(channel.at), now)
            part = PathPoints(points.positions[own], points.headings[own], points.velocities[own])
            blocks.append(point_features(channel.what, path.positions[frames], path.headings[frames], part).ravel())
        for metres in channel.along:
            point = along_path(path, np.array([float(now)]), metres)
            blocks.append(point_features(channel.what, path.positions[now:], path.headings[now:], point).ravel())
        query[where] = blocks[0] if len(blocks) == 1 else np.concatenate(blocks)


def _ahead(path: Trajectory, seconds: Floats) -> PathPoints:
    """What `after_seconds` gives behind the end of a path, where it goes straight on."""
    end, headings = path.positions[-1], np.full(len(seconds), path.headings[-1])
    velocity = (end - path.positions[-2]) * path.rate if len(path.positions) > 1 else np.zeros(2)
    return PathPoints(end + velocity * seconds[:, None], headings, np.repeat(velocity[None], len(seconds), axis=0))


def _in_world(skeleton: Skeleton, rotations: Floats, headings: Floats) -> Floats:
    """Rotations [F, J, 4] against parents, and headings of the root [F], as rotations in the world."""
    world = rotations.copy()
    world[:, 0] = quaternions.multiply(quaternions.about_axis("y", headings), rotations[:, 0])
    for joints in skeleton.levels[1:]:
        world[:, joints] = quaternions.multiply(world[:, skeleton.parents[joints]], rotations[:, joints])
    return world
