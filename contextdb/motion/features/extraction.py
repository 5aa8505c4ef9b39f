"""Compute features: from clips for a database, and from a pose and a wished path for a query.

F frames at the schema's rate, N features, in the schema's units (m, m/s, rad/s, unit vectors) and not yet normalised.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import require_kind, require_whole
from contextdb.errors import Fault, MotionError, Place, QueryError, in_quotes, mend_for, plural, some
from contextdb.motion.clips import mirror, quaternions
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.contacts import three_rounds
from contextdb.motion.clips.feet import NO_MARKS, ContactMarks, footfalls_of, phases, rounds_of
from contextdb.motion.clips.foot_bones import feet_of
from contextdb.motion.clips.poses import Poses, poses_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints, Skeleton
from contextdb.motion.clips.trajectory import (
    ManyTrajectories,
    Trajectory,
    after_seconds,
    along_path,
    rates_of_change,
    to_own_frame,
    unbroken,
)
from contextdb.motion.features.channels import DEFAULT_AXIS, Channel
from contextdb.motion.features.path_features import point_features, write_paths
from contextdb.motion.features.schema import CustomFunction, FeatureSchema

Features = NDArray[np.float32]

FARTHEST_M = 1e6
LARGEST_CUSTOM = 1e12


@dataclass(frozen=True, eq=False)
class ClipFeatures:
    """What a clip, as it is or mirrored, gives to a database."""

    asset: str
    """The clip's name, mirrored or not."""
    mirrored: bool
    features: Features
    """In the schema's units: float32 [F, N]."""
    root: Features
    """Where the body is on the ground and which way it faces: x and z in metres, heading in radians, unwrapped. Float32 [F, 3]."""


def clip_features(
    clip: Clip, schema: FeatureSchema, *, mirrored: bool = False, looping: bool = False, contacts: ContactMarks = NO_MARKS
) -> ClipFeatures:
    """The features of every frame of a clip, resampled to the schema's rate, and the body's path.

    Of a schema with permutations they are those of the first; the parameters and what it raises are those of `clip_permutations`.
    """
    return clip_permutations(clip, schema, mirrored=mirrored, looping=looping, contacts=contacts)[0]


def clip_permutations(
    clip: Clip, schema: FeatureSchema, *, mirrored: bool = False, looping: bool = False, contacts: ContactMarks = NO_MARKS
) -> list[ClipFeatures]:
    """The features of every frame of a clip in each permutation of the schema, one where it has none, in order.

    `mirrored` takes the clip in a mirror, left and right bones exchanged by the schema's `mirror`. A `looping` clip continues at
    its start when it ends: its path continues too, and does not run out straight. `contacts` are when each foot of the clip is
    down, as marks say it, see `Markup.contacts_of`; without them this is detected.

    Raises MotionError where the skeleton lacks a bone of the schema (the nearest is named) or cannot be mirrored by its pairs, the
    clip's numbers are too large to be a body, or a custom channel has no function or one that does not give what it should;
    ContextError where `clip` or `schema` is none.
    """
    require_kind(clip, Clip, "clip", "a Clip")
    require_kind(schema, FeatureSchema, "schema", "a FeatureSchema")
    faults = list(_faults(clip.skeleton, schema, mirrored))
    if faults:
        raise MotionError(*(fault.at(Place(clip.name)) for fault in faults))
    if clip.n_frames == 0:
        none = ClipFeatures(clip.name, mirrored, np.zeros((0, schema.n_features), np.float32), np.zeros((0, 3), np.float32))
        return [none] * len(schema.permutation_s)
    with np.errstate(all="ignore"):  # numbers too large become infinite or NaN, and are refused below
        poses = poses_of(clip, schema.rate)
    _check_size(poses, clip)
    if mirrored:
        poses = mirror.mirrored(poses, schema.mirror)
    path = schema.path_of(poses)
    root = np.column_stack((path.positions, path.headings)).astype(np.float32)
    own, marks = slice(None), (contacts[1], contacts[0]) if mirrored else contacts
    if looping:
        marks = rounds_of(marks, 3, (poses.n_frames - 1) / poses.rate)
        poses, own = three_rounds(poses, path)
        path = schema.path_of(poses)
    blocks = {
        channel.name: _unbroken_features(channel, poses, path, schema, clip.name, marks)[own]
        for channel in schema.channels
        if not channel.varies
    }
    permutations = []
    for ahead_s in schema.permutation_s:
        for channel in schema.channels:
            if channel.varies:
                blocks[channel.name] = _unbroken_features(channel, poses, path, schema, clip.name, marks, ahead_s)[own]
        features = np.concatenate([blocks[channel.name] for channel in schema.channels], axis=1).astype(np.float32)
        permutations.append(ClipFeatures(clip.name, mirrored, features, root))
    return permutations


def features_of(clip: Clip, schema: FeatureSchema) -> Features:
    """The features of every frame of a clip alone: float32 [F, N]; raises what `clip_features` raises."""
    return clip_features(clip, schema).features


def query_from(
    schema: FeatureSchema,
    clip: Clip,
    frame: int = 0,
    wanted: Trajectory | None = None,
    *,
    mirrored: bool = False,
    permutation: int = 0,
) -> Features:
    """A query: the pose of a clip's frame, with the trajectory of the clip or a wished one.

    Parameters
    ----------
    schema : FeatureSchema
    clip : Clip
        Whose pose the body is in. Phases and custom channels count as pose.
    frame : int
        The frame of that pose, at the schema's rate.
    wanted : Trajectory, optional
        Where the body shall go, such as `steady_path(1.4)`; its frame `now` is this moment.
    mirrored : bool
        Take the clip in a mirror; a wished path stays as it is wished.
    permutation : int
        Which permutation of the clip: by how many seconds the permuted channels look ahead.

    Returns
    -------
    float32 array, shape (N,)
        In the schema's units, for `MotionDatabase.search`.

    Raises
    ------
    QueryError
        The clip has no such frame, or the schema no such permutation.
    MotionError
        As `clip_features`.
    ContextError
        `frame` or `permutation` is no whole number, or `wanted` no path.
    """
    parts = clip_permutations(clip, schema, mirrored=mirrored)
    if not 0 <= require_whole(permutation, "permutation") < len(parts):
        raise QueryError(Fault(f"there is no permutation {permutation} in [features.{schema.name}].", f"0 to {len(parts) - 1}"))
    features = parts[permutation].features
    if not 0 <= require_whole(frame, "frame") < len(features):
        problem = f"there is no frame {frame} in {clip.name}."
        raise QueryError(
            Fault(problem, f"0 to {len(features) - 1}: it has {plural(len(features), 'frame')} at {schema.rate:g} a second")
        )
    return features[frame].copy() if wanted is None else with_path(schema, features[frame], wanted)


def with_path(schema: FeatureSchema, query: Features | Floats, wanted: Trajectory) -> Features:
    """A query [N] whose trajectory is a wished one instead; the pose stays.

    Raises QueryError for a query of another shape, and ContextError for what is no schema or no path.
    """
    require_kind(schema, FeatureSchema, "schema", "a FeatureSchema")
    require_kind(wanted, Trajectory, "wanted", "a Trajectory, such as steady_path(1.4)")
    if np.shape(query) != (schema.n_features,) or not 0 <= wanted.now < len(wanted.headings):
        n_frames = len(wanted.headings)
        problem = (
            f"the query has shape {np.shape(query)}, and the path {plural(n_frames, 'frame')} and its present at {wanted.now}."
        )
        raise QueryError(Fault(problem, f"a query of {schema.n_features} features, and a path that holds its present"))
    changed = np.array(query, np.float32)
    write_paths(schema, changed[None], ManyTrajectories(wanted.rate, wanted.positions[None], wanted.headings[None], wanted.now))
    return changed


def _unbroken_features(
    channel: Channel, poses: Poses, path: Trajectory, schema: FeatureSchema, clip: str, marks: ContactMarks, ahead_s: float = 0.0
) -> Floats:
    """A channel's features of every frame; none of a bone or the path looks across a moment at which the body is put elsewhere."""
    parts = unbroken(path)
    if len(parts) == 1 or channel.type in ("phase", "custom"):
        return _channel_features(channel, poses, path, schema, clip, marks, ahead_s)
    columns = []
    for own in parts:
        part = replace(poses, positions=poses.positions[own], rotations=poses.rotations[own])
        way = Trajectory(path.rate, path.positions[own], path.headings[own])
        columns.append(_channel_features(channel, part, way, schema, clip, marks, ahead_s))
    return np.concatenate(columns)


def _channel_features(
    channel: Channel, poses: Poses, path: Trajectory, schema: FeatureSchema, clip: str, marks: ContactMarks, ahead_s: float = 0.0
) -> Floats:
    """A channel's features of every frame; what varies with permutations looks some seconds ahead."""
    match channel.type:
        case "permutation_time":
            return np.full((poses.n_frames, 1), ahead_s)
        case "trajectory":
            return trajectory_features(channel, path, np.arange(poses.n_frames))
        case "phase":
            values = phases(footfalls_of(poses, schema.foot_bones(channel.feet), marks), np.arange(poses.n_frames) / poses.rate)
        case "custom":
            values = _custom_features(channel, poses, path, schema.functions, clip)
        case _:
            values = _bone_features(channel, poses, path, ahead_s * poses.rate)
    return values if not channel.at else np.concatenate([_moved(values, seconds * poses.rate) for seconds in channel.at], axis=1)


def block_of(channel: Channel, poses: Poses, path: Trajectory, schema: FeatureSchema) -> Floats:
    """A channel's features of every frame of some poses and their path: [F, features of the channel]."""
    return _channel_features(channel, poses, path, schema, schema.name, NO_MARKS, schema.permutation_s[0])


def require_features(skeleton: Skeleton, schema: FeatureSchema) -> None:
    """Raise MotionError where the features of a skeleton's poses cannot be computed."""
    faults = list(_faults(skeleton, schema, False))
    if faults:
        raise MotionError(*faults)


def _moved(values: Floats, frames: float) -> Floats:
    """Values [F, ...] as they are some frames later, at the nearest frame within the clip."""
    every = np.arange(len(values))
    return values[np.clip(every + int(np.rint(frames)), 0, len(values) - 1)]


# ---- a bone


def _bone_features(channel: Channel, poses: Poses, path: Trajectory, ahead: float) -> Floats:
    """A bone's features; of a permuted channel as the bone is some frames ahead, seen from the body now."""
    ahead = ahead if channel.permuted else 0.0
    assert channel.bone is not None, "a channel of a bone names it"
    bone = poses.skeleton.index(channel.bone)
    other = None if channel.relative_to is None else poses.skeleton.index(channel.relative_to)
    match channel.type:
        case "position":
            vectors = _moved(poses.positions[:, bone], ahead) - (_origins(path) if other is None else poses.positions[:, other])
        case "velocity":
            places = poses.positions[:, bone] - (0.0 if other is None else poses.positions[:, other])
            vectors = _moved(rates_of_change(places, poses.rate), ahead)
        case "angular_velocity":
            vectors = angular_velocities(poses.rotations[:, bone], poses.rate)
            if other is not None:
                vectors = vectors - angular_velocities(poses.rotations[:, other], poses.rate)
            vectors = _moved(vectors, ahead)
        case "direction":
            return quaternions.rotate(_seen_rotations(poses, path, bone, other, ahead), _axis(channel.axis or DEFAULT_AXIS))
        case _:
            turned = _seen_rotations(poses, path, bone, other, ahead)
            return np.concatenate([quaternions.rotate(turned, _axis(axis)) for axis in "xy"], axis=-1)
    return _in_body(vectors, path.headings)


def _origins(path: Trajectory) -> Floats:
    """The body's places on the ground, in the world: [F, 3]."""
    return np.insert(path.positions, 1, 0.0, axis=1)


def _axis(name: str) -> Floats:
    """The vector of an axis such as "z" or "-z"."""
    return np.asarray((-1.0 if name[0] == "-" else 1.0) * np.eye(3)[quaternions.AXES.index(name[-1])])


def _seen_rotations(poses: Poses, path: Trajectory, bone: int, other: int | None, ahead: float) -> Floats:
    """A bone's rotations some frames ahead as the body sees them now, or another bone: [F, 4]."""
    seen_from = quaternions.about_axis("y", path.headings) if other is None else poses.rotations[:, other]
    return quaternions.multiply(quaternions.inverse(seen_from), _moved(poses.rotations[:, bone], ahead))


def angular_velocities(rotations: Floats, rate: float) -> Floats:
    """Radians a second about the world's axes of rotations [F, 4]: [F, 3]; each frame has the mean of the turns to it and from it.

    Exact for a steady turn of less than half a turn a frame; the ends have their one turn, a single frame 0.
    """
    if len(rotations) < 2:
        return np.zeros((len(rotations), 3))
    turns = quaternions.rotation_vectors(quaternions.multiply(rotations[1:], quaternions.inverse(rotations[:-1]))) * rate
    return np.concatenate((turns[:1], (turns[1:] + turns[:-1]) / 2.0, turns[-1:]))


def _in_body(vectors: Floats, headings: Floats) -> Floats:
    """World vectors [F, 3] as (left, up, ahead) of a body with these headings [F]."""
    ground = to_own_frame(vectors[:, [0, 2]], headings)
    return np.stack((ground[:, 0], vectors[:, 1], ground[:, 1]), axis=-1)


# ---- the path


def trajectory_features(channel: Channel, path: Trajectory, frames: Ints) -> Floats:
    """A trajectory channel's features at some frames of a path: [frames, features of the channel]."""
    at, origins, headings = frames.astype(np.float64), path.positions[frames], path.headings[frames]
    points = [after_seconds(path, at, seconds) for seconds in channel.at] + [
        along_path(path, at, metres) for metres in channel.along
    ]
    return np.concatenate([point_features(channel.what, origins, headings, point) for point in points], axis=1)


# ---- functions of others


def _custom_features(
    channel: Channel, poses: Poses, path: Trajectory, functions: Mapping[str, CustomFunction], clip: str
) -> Floats:
    """What a custom channel's function gives, checked: [F, size]."""
    assert channel.function is not None, "a custom channel names its function"
    place = Place(clip)
    for array in (poses.positions, poses.rotations, path.positions, path.headings):
        array.flags.writeable = False
    try:
        values = np.asarray(functions[channel.function](poses, path), np.float64)
    except Exception as error:
        problem = f"channel {in_quotes(channel.name)}: its function failed: {type(error).__name__}: {error}."
        raise MotionError(Fault(problem, f"a float array of {poses.n_frames} x {channel.size}", place=place)) from error
    if values.shape != (poses.n_frames, channel.size):
        problem = f"channel {in_quotes(channel.name)}: its function gives shape {values.shape}."
        raise MotionError(Fault(problem, f"{poses.n_frames} frames x {plural(channel.size, 'feature')}", place=place))
    wrong = np.argwhere(~(np.abs(values) <= LARGEST_CUSTOM))
    if len(wrong):
        frame, feature = wrong[0].tolist()
        problem = f"channel {in_quotes(channel.name)}: its function gives {values[frame, feature]} in frame {frame}."
        raise MotionError(Fault(problem, f"finite numbers, at most {LARGEST_CUSTOM:g}", place=place))
    return values


# ---- checks


def _faults(skeleton: Skeleton, schema: FeatureSchema, mirrored: bool) -> Iterator[Fault]:
    """Why a skeleton's features cannot be computed."""
    yield from schema.bone_faults(skeleton)
    for channel in schema.channels:
        if channel.type == "phase" and channel.feet is None and schema.feet is None:
            yield from _feet_faults(skeleton)
        if channel.type == "custom" and channel.function not in schema.functions:
            yield _no_function(channel, schema)
    if mirrored:
        yield from _mirror_faults(skeleton, schema)


def _feet_faults(skeleton: Skeleton) -> Iterator[Fault]:
    try:
        feet_of(skeleton)
    except MotionError as error:
        yield from error.faults


def _no_function(channel: Channel, schema: FeatureSchema) -> Fault:
    name = str(channel.function)
    accepted = f"schema.with_functions({{{in_quotes(name)}: function}}); there are {some(schema.functions) or 'none'}"
    return Fault(f"channel {in_quotes(channel.name)} has no function.", accepted, mend_for(name, schema.functions))


def _mirror_faults(skeleton: Skeleton, schema: FeatureSchema) -> Iterator[Fault]:
    if not schema.mirror:
        yield mirror.undeclared(skeleton, schema.name)
        return
    try:
        partners = mirror.partners_of(skeleton, schema.mirror)
    except MotionError as error:
        yield from error.faults
        return
    fault = mirror.facing_fault(skeleton, partners, schema.facing) if not schema.bone_faults(skeleton) else None
    if fault is not None:
        yield fault
    turned = [channel.name for channel in schema.channels if channel.type in ("direction", "orientation")]
    if turned and not mirror.has_even_axes(skeleton, partners):
        problem = f"the bones' own axes are not mirror images of each other, so channel {in_quotes(turned[0])} cannot be mirrored."
        yield Fault(problem, "position, velocity, angular velocity, trajectory and phase, or no mirroring of this clip")


def _check_size(poses: Poses, clip: Clip) -> None:
    """Refuse positions that no body has: they would turn into infinite features."""
    far = np.argwhere(~(np.abs(poses.positions).max(axis=-1) <= FARTHEST_M))
    if len(far):
        frame, joint = far[0].tolist()
        problem = f"bone {in_quotes(poses.skeleton.names[joint])} is more than {FARTHEST_M / 1000.0:,.0f} km away in frame {frame}."
        accepted = f"positions of a body; one unit of the clip is taken to be {clip.metres_per_unit:g} m"
        raise MotionError(Fault(problem, accepted, place=Place(clip.name)))
