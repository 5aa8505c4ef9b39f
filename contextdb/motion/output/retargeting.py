"""A clip of one rig as a clip of another: bones by their names, lengths by those of the legs, feet by bending the legs.

    clip ─► rotations in the world, by names ─► root moved by the scale of the legs ─► legs bent until feet stand ─► clip of the rig

Soles are as high above the ground as those of the clip, by scale, however high an ankle is above its own. Both rigs must rest
alike: their bones point the same way where nothing is turned, as those of one studio do. A bone that the other rig has not is left
out, and what it turns is in the bone below it; one that the clip has not keeps its rest. F frames, J joints.

Source: Forsyth, "How a Character Should Walk", Game Tech 2004.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import radians

import numpy as np

from contextdb.cells.arguments import require_kind, require_mapping, require_real
from contextdb.errors import Fault, MotionError, Place, in_quotes, some
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.bone_names import meant_bone
from contextdb.motion.clips.clip import CENTIMETRE, Clip
from contextdb.motion.clips.foot_bones import feet_of
from contextdb.motion.clips.poses import LocalPoses, Poses, forward_kinematics, local_poses
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.output.bank import leg_loops
from contextdb.motion.output.legs import Leg, leg_of
from contextdb.motion.output.track import clip_of_tracks

STRAIGHT = radians(170.0)
ALIKE_AT_REST = 0.5
"""The least cosine between a bone of the rig and that of a clip."""
LEAST_M, MOST_M = 1e-9, 1e9


def retargeted(clip: Clip, rig: Skeleton, *, metres_per_unit: float = CENTIMETRE, names: Mapping[str, str] | None = None) -> Clip:
    """A clip on another rig.

    Parameters
    ----------
    clip : Clip
    rig : Skeleton
        Such as that of another clip.
    metres_per_unit : float
        Of the rig's offsets.
    names : mapping of str to str, optional
        For bones of the rig those of the clip, where they differ. Default: of the same name, in any case.

    Returns
    -------
    Clip
        In centimetres, y up, of the same rate and name.

    Raises
    ------
    MotionError
        The rig or the clip has no feet or legs, a bone of hips or legs has no counterpart, or points elsewhere at rest.
    ContextError
        An argument of another type.
    """
    require_kind(clip, Clip, "clip", "a Clip")
    require_kind(rig, Skeleton, "rig", "a Skeleton")
    metres_per_unit = require_real(metres_per_unit, "metres_per_unit", LEAST_M, MOST_M)
    given = {} if names is None else require_mapping(names, "names", "a mapping of the rig's bones to the clip's")
    local = local_poses(clip)
    shown = forward_kinematics(local)
    offsets = np.array(rig.offsets) * metres_per_unit
    offsets[0] = 0.0
    legs = [(leg, leg_of(clip.skeleton, foot)) for leg, foot in zip(_legs(rig), feet_of(clip.skeleton), strict=True)]
    own = _counterparts(rig, clip, given, [joint for leg, _ in legs for joint in leg.joints.tolist()])
    lengths = np.array([(_length(offsets, leg), _length(local.positions[0], other)) for leg, other in legs if other is not None])
    if len(lengths) < len(legs) or not lengths.min() > 0.0:
        raise MotionError(
            Fault("a leg has no hip and knee of its own, or no length.", "legs of thigh, shin and foot", place=Place(clip.name))
        )
    _require_alike_at_rest(rig, clip, legs, own)
    scale = float(lengths[:, 0].sum() / lengths[:, 1].sum())
    rotations = _rotations(rig, shown, own)
    translations = np.repeat(offsets[None], clip.n_frames, axis=0)
    placed = forward_kinematics(LocalPoses(rig, clip.rate, translations, rotations))
    translations[:, 0] = scale * shown.positions[:, own[rig.hips]] - placed.positions[:, rig.hips]
    placed = forward_kinematics(LocalPoses(rig, clip.rate, translations, rotations))
    lifts = [_lifts(rig, leg, placed, shown, own, scale) for leg, _ in legs]
    lift = float(np.median(lifts))
    translations[:, 0, 1] += lift
    placed.positions[..., 1] += lift
    for (leg, _), higher in zip(legs, lifts, strict=True):
        ankles = scale * shown.positions[:, own[int(leg.joints[2])]]
        ankles[:, 1] += higher
        _bend(rig, leg, placed, ankles, rotations)
    ends = tuple((joint, (x * metres_per_unit, y * metres_per_unit, z * metres_per_unit)) for joint, (x, y, z) in rig.end_sites)
    metres = Skeleton(rig.names, rig.parents, offsets, rig.channels, ends)
    return clip_of_tracks(rotations, translations, metres, [0], clip.rate, clip.name)


def _legs(rig: Skeleton) -> list[Leg]:
    legs = [leg_of(rig, foot) for foot in feet_of(rig)]
    found = [leg for leg in legs if leg is not None]
    if len(found) < len(legs):
        raise MotionError(Fault("a leg of the rig has no hip and knee of its own.", "legs of thigh, shin and foot"))
    return found


def _counterparts(rig: Skeleton, clip: Clip, names: Mapping[str, str], needed: list[int]) -> dict[int, int]:
    """For joints of the rig those of the clip."""
    known = {name.casefold(): joint for joint, name in enumerate(clip.skeleton.names)}
    wanted = {bone: str(names.get(bone, bone)) for bone in rig.names}
    for bone, other in names.items():
        if bone not in rig:
            raise MotionError(rig.missing_bone(str(bone)))
        if other not in clip.skeleton:
            raise MotionError(clip.skeleton.missing_bone(str(other)).at(Place(clip.name)))
    found = {joint: known[wanted[bone].casefold()] for joint, bone in enumerate(rig.names) if wanted[bone].casefold() in known}
    missing = [rig.names[joint] for joint in dict.fromkeys([rig.hips, *needed]) if joint not in found]
    if missing:
        near = meant_bone(missing[0], clip.skeleton.names)
        told = f"there is no bone for {some(missing)} of the rig."
        accepted = f"a bone of the same name; else names={{{missing[0]!r}: BONE}}, or rig_bones in contextdb.toml"
        raise MotionError(Fault(told, accepted, in_quotes(near) if near else "", Place(clip.name)))
    return found


def _require_alike_at_rest(rig: Skeleton, clip: Clip, legs: list[tuple[Leg, Leg | None]], own: Mapping[int, int]) -> None:
    """Refuse rigs whose legs point another way where nothing is turned: one lies, or has its axes otherwise."""
    for leg, _ in legs:
        for joint in leg.joints[1:].tolist():
            one, other = rig.offsets[joint], clip.skeleton.offsets[own[joint]]
            if float(one @ other) < ALIKE_AT_REST * float(np.linalg.norm(one) * np.linalg.norm(other)):
                told = f"{in_quotes(rig.names[joint])} of the rig points another way at rest than that of the clip."
                raise MotionError(Fault(told, "a rig that rests as the clip does, with the same axis up", place=Place(clip.name)))


def _lifts(rig: Skeleton, leg: Leg, placed: Poses, shown: Poses, own: Mapping[int, int], scale: float) -> Floats:
    """How much higher than by scale an ankle is to be in each frame, so that its sole is as high as by scale: [F]."""
    ankle = int(leg.joints[2])
    soles = [joint for joint in range(rig.n_joints) if joint in own and ankle in rig.ancestors(joint)]
    soles = [joint for joint in soles if own[ankle] in shown.skeleton.ancestors(own[joint])]
    if not soles:
        return np.zeros(placed.n_frames)
    drop = _drop(placed.positions[..., 1], ankle, soles)
    return drop - scale * _drop(shown.positions[..., 1], own[ankle], [own[joint] for joint in soles])


def _drop(heights: Floats, ankle: int, soles: list[int]) -> Floats:
    """How far the lowest joint of a foot is below its ankle: [F]."""
    return np.asarray(np.maximum(heights[:, ankle] - heights[:, soles].min(axis=1), 0.0))


def _length(offsets: Floats, leg: Leg | None) -> float:
    """How long thigh and shin are together."""
    return 0.0 if leg is None else float(np.linalg.norm(offsets[leg.joints[1:]], axis=-1).sum())


def _rotations(rig: Skeleton, shown: Poses, own: Mapping[int, int]) -> Floats:
    """Against their parents, so that each joint is turned in the world as its counterpart: [F, J, 4]."""
    still = np.broadcast_to(np.array([1.0, 0.0, 0.0, 0.0]), (shown.n_frames, 4))
    world: list[Floats] = []
    found = np.empty((shown.n_frames, rig.n_joints, 4))
    for joint, parent in enumerate(rig.parents.tolist()):
        above = still if parent < 0 else world[parent]
        world.append(shown.rotations[:, own[joint]] if joint in own else above)
        found[:, joint] = quaternions.multiply(quaternions.inverse(above), world[joint])
    return found


def _bend(rig: Skeleton, leg: Leg, placed: Poses, ankles: Floats, rotations: Floats) -> None:
    """Bend a leg in each frame so that its ankle is where it is to be."""
    kernels, parents = leg_loops(), np.asarray(rig.parents, np.int64)
    ahead = quaternions.rotate(placed.rotations[:, rig.hips], np.array([0.0, 0.0, 1.0]))
    for frame in range(placed.n_frames):
        of_frame = placed.positions[frame], placed.rotations[frame], leg.joints, ankles[frame], ahead[frame]
        kernels.bend_leg(parents, *of_frame, STRAIGHT, rotations[frame])
