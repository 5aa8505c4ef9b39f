"""Compute features: from clips for a database, and from a pose and a wished path for a query. One code path for both.

F frames at the schema's rate, N features, in the schema's units (m, m/s, unit vectors) and not yet normalised.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contextdb.errors import Fault, MotionError, Place, QueryError, in_quotes, plural
from contextdb.motion.clips import Clip
from contextdb.motion.features import Channel, FeatureSchema
from contextdb.motion.poses import Poses, poses_of
from contextdb.motion.quaternions import Floats
from contextdb.motion.skeleton import Ints
from contextdb.motion.trajectory import (
    PathPoints,
    Trajectory,
    after_seconds,
    along_path,
    heading_vectors,
    rates_of_change,
    root_trajectory,
    to_own_frame,
)

Features = NDArray[np.float32]

FARTHEST_M = 1e6


def features_of(clip: Clip, schema: FeatureSchema) -> Features:
    """The features of every frame of a clip, resampled to the schema's rate: float32 [F, N].

    Raises
    ------
    MotionError
        The skeleton lacks a bone of the schema (the nearest is named), or the clip's numbers are too large to be a body.
    """
    faults = schema.bone_faults(clip.skeleton)
    if faults:
        raise MotionError(*(fault.at(Place(clip.name)) for fault in faults))
    if clip.n_frames == 0:
        return np.zeros((0, schema.n_features), np.float32)
    with np.errstate(all="ignore"):  # numbers too large become infinite or NaN, and are refused below
        poses = poses_of(clip, schema.rate)
    _check_size(poses, clip)
    path = root_trajectory(poses, schema.root, schema.facing)
    return np.concatenate([_channel_features(channel, poses, path) for channel in schema.channels], axis=1).astype(np.float32)


def query_from(schema: FeatureSchema, clip: Clip, frame: int = 0, wanted: Trajectory | None = None) -> Features:
    """A query: the pose of a clip's frame, with the trajectory of the clip or a wished one.

    Parameters
    ----------
    schema : FeatureSchema
    clip : Clip
        Whose pose the body is in.
    frame : int
        The frame of that pose, at the schema's rate.
    wanted : Trajectory, optional
        Where the body shall go, such as `steady_path(1.4)`; its frame `now` is this moment.

    Returns
    -------
    float32 array, shape (N,)
        In the schema's units, for `MotionDatabase.search`.
    """
    features = features_of(clip, schema)
    if not 0 <= frame < len(features):
        found = f"there is no frame {frame} in {clip.name}."
        raise QueryError(
            Fault(found, f"0 to {len(features) - 1}: it has {plural(len(features), 'frame')} at {schema.rate:g} a second")
        )
    return features[frame].copy() if wanted is None else with_path(schema, features[frame], wanted)


def with_path(schema: FeatureSchema, query: Features | Floats, wanted: Trajectory) -> Features:
    """A query [N] whose trajectory is a wished one instead; the pose stays."""
    if np.shape(query) != (schema.n_features,) or not 0 <= wanted.now < len(wanted.headings):
        n_frames = len(wanted.headings)
        found = f"the query has shape {np.shape(query)}, and the path {plural(n_frames, 'frame')} and its present at {wanted.now}."
        raise QueryError(Fault(found, f"a query of {schema.n_features} features, and a path that holds its present"))
    changed = np.array(query, np.float32)
    frames = np.array([wanted.now])
    for channel in schema.channels:
        if channel.type == "trajectory":
            changed[schema.slices[channel.name]] = _trajectory_features(channel, wanted, frames)[0]
    return changed


def _channel_features(channel: Channel, poses: Poses, path: Trajectory) -> Floats:
    if channel.type == "trajectory":
        return _trajectory_features(channel, path, np.arange(poses.n_frames))
    assert channel.bone is not None, "a channel of a pose names its bone"
    positions = poses.positions[:, poses.skeleton.index(channel.bone)]
    if channel.type == "position":
        origins = np.stack((path.positions[:, 0], np.zeros(poses.n_frames), path.positions[:, 1]), axis=-1)
        return _in_body(positions - origins, path.headings)
    return _in_body(rates_of_change(positions, poses.rate), path.headings)


def _in_body(vectors: Floats, headings: Floats) -> Floats:
    """World vectors [F, 3] as (left, up, ahead) of a body with these headings [F]."""
    ground = to_own_frame(vectors[:, [0, 2]], headings)
    return np.stack((ground[:, 0], vectors[:, 1], ground[:, 1]), axis=-1)


def _trajectory_features(channel: Channel, path: Trajectory, frames: Ints) -> Floats:
    """A trajectory channel's features at some frames of a path: [frames, features of the channel]."""
    at = frames.astype(np.float64)
    points = [after_seconds(path, at, seconds) for seconds in channel.at] + [
        along_path(path, at, metres) for metres in channel.along
    ]
    return np.concatenate([_point_features(channel, path, frames, point) for point in points], axis=1)


def _point_features(channel: Channel, path: Trajectory, frames: Ints, points: PathPoints) -> Floats:
    headings = path.headings[frames]
    match channel.what:
        case "position":
            return to_own_frame(points.positions - path.positions[frames], headings)
        case "direction":
            return heading_vectors(points.headings - headings)
        case "velocity":
            return to_own_frame(points.velocities, headings)
        case _:
            return np.asarray(np.linalg.norm(points.velocities, axis=-1, keepdims=True))


def _check_size(poses: Poses, clip: Clip) -> None:
    """Refuse positions that no body has: they would turn into infinite features."""
    far = np.argwhere(~(np.abs(poses.positions).max(axis=-1) <= FARTHEST_M))
    if len(far):
        frame, joint = far[0].tolist()
        found = f"bone {in_quotes(poses.skeleton.names[joint])} is more than {FARTHEST_M / 1000.0:,.0f} km away in frame {frame}."
        accepted = f"positions of a body; one unit of the clip is taken to be {clip.metres_per_unit:g} m"
        raise MotionError(Fault(found, accepted, place=Place(clip.name)))
