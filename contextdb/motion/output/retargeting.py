"""A clip of one rig as a clip of another: bones by their names, lengths by those of the legs, feet by bending the legs.

    clip ─► rotations in the world, by names and shape ─► root moved by the scale of the legs ─► feet stand ─► clip of the rig

Soles are as high above the ground as those of the clip, by scale, however high an ankle is above its own. Both rigs must rest
alike: their bones point the same way where nothing is turned, as those of one studio do; or clips are given whose first frames show
both bodies in one pose. A bone that the other rig has not is left out, and what it turns is in the bone below it; one that the clip
has not keeps its rest. F frames, J joints.

Source: Forsyth, "How a Character Should Walk", Game Tech 2004.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import radians

import numpy as np

from contextdb.cells.arguments import require_kind, require_many_of, require_mapping, require_real
from contextdb.core import bend_legs
from contextdb.errors import Fault, MotionError, Place, in_quotes
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.bone_names import cores_of, without_namespace
from contextdb.motion.clips.clip import CENTIMETRE, Clip
from contextdb.motion.clips.foot_bones import feet_of
from contextdb.motion.clips.poses import LocalPoses, Poses, forward_kinematics, local_poses, poses_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.output.legs import Leg, leg_of
from contextdb.motion.output.track import clip_of_tracks

STRAIGHT = radians(170.0)
ALIKE_LEGS, ALIKE_ARMS = 0.5, 0.85
"""The least cosine between a bone of the rig and that of a clip where both are in the pose of reference."""
SAME_WAY = 0.99
"""The least cosine between bones that rest alike."""
ARMS = ("forearm", "hand")
"""The ends of the bones of an arm."""
STILL = np.array([1.0, 0.0, 0.0, 0.0])
LEAST_M, MOST_M = 1e-9, 1e9


def retargeted(
    clip: Clip,
    rig: Skeleton,
    *,
    metres_per_unit: float = CENTIMETRE,
    names: Mapping[str, str] | None = None,
    references: Sequence[Clip] = (),
) -> Clip:
    """A clip on another rig.

    Parameters
    ----------
    clip : Clip
    rig : Skeleton
        Such as that of another clip.
    metres_per_unit : float
        Of the rig's offsets.
    names : mapping of str to str, optional
        For bones of the rig those of the clip. Default: hips and legs by the shape of both; others of the same name, in any case
        and without namespace, of the same side and meaning in any spelling, or as far up the spine.
    references : list of Clip, optional
        Clips whose first frames show one pose, such as a T, of the rig, of the clip's body, or of each. A body without one is taken
        to rest in that pose. Default: both rest alike.

    Returns
    -------
    Clip
        In centimetres, y up, of the same rate and name.

    Raises
    ------
    MotionError
        The rig or the clip has no feet or legs, has no bone of one of `names`, or a bone of legs or arms points elsewhere in
        the pose of reference.
    ContextError
        An argument of another type.
    """
    require_kind(clip, Clip, "clip", "a Clip")
    require_kind(rig, Skeleton, "rig", "a Skeleton")
    metres_per_unit = require_real(metres_per_unit, "metres_per_unit", LEAST_M, MOST_M)
    given = {} if names is None else require_mapping(names, "names", "a mapping of the rig's bones to the clip's")
    shown = require_many_of(references, Clip, "references", "a list of Clip")
    local = local_poses(clip)
    source_poses = forward_kinematics(local)
    offsets = np.array(rig.offsets) * metres_per_unit
    offsets[0] = 0.0
    legs = list(zip(_legs(rig), _legs(clip.skeleton, Place(clip.name)), strict=True))
    own = _counterparts(rig, clip, given, legs)
    lengths = np.array([(_length(offsets, leg), _length(local.positions[0], other)) for leg, other in legs])
    if not lengths.min() > 0.0:
        raise MotionError(Fault("a leg has no length.", "legs of thigh, shin and foot", place=Place(clip.name)))
    poses = [_reference(body, shown) for body in (rig, clip.skeleton)]
    _require_alike(rig, clip, legs, own, poses)
    turned = _turned(rig, clip.skeleton, own, poses)
    scale = float(lengths[:, 0].sum() / lengths[:, 1].sum())
    rotations = _rotations(rig, source_poses, own, turned)
    translations = np.repeat(offsets[None], clip.n_frames, axis=0)
    placed = forward_kinematics(LocalPoses(rig, clip.rate, translations, rotations))
    translations[:, 0] = scale * source_poses.positions[:, own[rig.hips]] - placed.positions[:, rig.hips]
    placed = forward_kinematics(LocalPoses(rig, clip.rate, translations, rotations))
    lifts = [_lifts(rig, leg, placed, source_poses, own, scale) for leg, _ in legs]
    lift = float(np.median(lifts))
    translations[:, 0, 1] += lift
    placed.positions[..., 1] += lift
    ahead = quaternions.rotate(quaternions.inverse(turned[rig.hips]), np.array([0.0, 0.0, 1.0]))
    aheads = quaternions.rotate(placed.rotations[:, rig.hips], ahead)
    for (leg, _), higher in zip(legs, lifts, strict=True):
        ankles = scale * source_poses.positions[:, own[int(leg.joints[2])]]
        ankles[:, 1] += higher
        bend_legs(
            np.asarray(rig.parents, np.int64), placed.positions, placed.rotations, leg.joints, ankles, aheads, STRAIGHT, rotations
        )
    ends = tuple((joint, (x * metres_per_unit, y * metres_per_unit, z * metres_per_unit)) for joint, (x, y, z) in rig.end_sites)
    metres = Skeleton(rig.names, rig.parents, offsets, rig.channels, ends)
    return clip_of_tracks(rotations, translations, metres, [0], clip.rate, clip.name)


def _legs(body: Skeleton, place: Place | None = None) -> list[Leg]:
    legs = [leg_of(body, foot) for foot in feet_of(body)]
    complete = [leg for leg in legs if leg is not None]
    if len(complete) < len(legs):
        which = "a leg of the rig" if place is None else "a leg"
        raise MotionError(Fault(f"{which} has no hip and knee of its own.", "legs of thigh, shin and foot", place=place or Place()))
    return complete


def _counterparts(rig: Skeleton, clip: Clip, names: Mapping[str, str], legs: Sequence[tuple[Leg, Leg]]) -> dict[int, int]:
    """For joints of the rig those of the clip: of the same name, core or height in the spine, of legs by the shape, or as given."""
    other = clip.skeleton
    own: dict[int, int] = {}
    spines = [_spine(body) for body in (rig, other)]
    for i, joint in enumerate(spines[0]):
        if spines[1]:
            own[joint] = spines[1][round(i * (len(spines[1]) - 1) / max(len(spines[0]) - 1, 1))]
    plain = [[("", without_namespace(name).casefold()) for name in body.names] for body in (rig, other)]
    for mine, theirs in ((cores_of(rig.names), cores_of(other.names)), plain):
        own |= {mine.index(name): theirs.index(name) for name in mine if mine.count(name) == theirs.count(name) == 1}
    own[rig.hips] = other.hips
    for leg, source_leg in legs:
        own |= zip([*leg.joints.tolist(), leg.toe], [*source_leg.joints.tolist(), source_leg.toe], strict=True)
    for bone, name in names.items():
        if bone not in rig:
            raise MotionError(rig.missing_bone(str(bone)))
        if name not in other:
            raise MotionError(other.missing_bone(str(name)).at(Place(clip.name)))
        own[rig.index(bone)] = other.index(name)
    return own


def _spine(body: Skeleton) -> list[int]:
    """The joints above the hips up to where the neck begins, from below; none where no bone is named as a head."""
    head = next((joint for joint, core in enumerate(cores_of(body.names)) if core == ("", "head")), None)
    above = [] if head is None else body.ancestors(head)
    spine = above[: above.index(body.hips)][::-1] if body.hips in above else []
    return [joint for joint in spine if "neck" not in body.names[joint].casefold()]


def _reference(body: Skeleton, references: Sequence[Clip]) -> Floats | None:
    """The rotations in the world [J, 4] of the first frame that shows a body; None where it is to be at rest."""
    for clip in references:
        if clip.n_frames and _is_same_body(body, clip.skeleton):
            return np.asarray(poses_of(replace(clip, values=clip.values[:1])).rotations[0])
    return None


def _is_same_body(one: Skeleton, other: Skeleton) -> bool:
    """Whether two skeletons have the same bones, which rest alike."""
    names = [[without_namespace(name) for name in body.names] for body in (one, other)]
    if names[0] != names[1] or one.parents.tolist() != other.parents.tolist():
        return False
    lengths = np.linalg.norm(one.offsets, axis=1) * np.linalg.norm(other.offsets, axis=1)
    return bool(((one.offsets * other.offsets).sum(axis=1) >= SAME_WAY * lengths)[1:].all())


def _turned(rig: Skeleton, other: Skeleton, own: Mapping[int, int], poses: Sequence[Floats | None]) -> Floats:
    """For each joint of the rig the rotation [4] that, behind that of its counterpart, makes it that of the rig: [J, 4]."""
    turned = np.tile(STILL, (rig.n_joints, 1))
    if poses[0] is poses[1] is None:
        return turned
    mine, theirs = _rotations_in(rig, poses[0]), _rotations_in(other, poses[1])
    headings = [_heading(body, pose) for body, pose in ((rig, mine), (other, theirs))]
    to_theirs = quaternions.about_axis("y", np.array(headings[1] - headings[0]))
    for joint, source in own.items():
        turned[joint] = quaternions.multiply(quaternions.inverse(theirs[source]), quaternions.multiply(to_theirs, mine[joint]))
    return turned


def _rotations_in(body: Skeleton, pose: Floats | None) -> Floats:
    return np.tile(STILL, (body.n_joints, 1)) if pose is None else pose


def _heading(body: Skeleton, pose: Floats) -> float:
    """Which way a body faces in a pose, by its thighs."""
    if body.facing_pair is None:
        return 0.0
    left, right = (_place(body, pose, joint) for joint in body.facing_pair)
    return float(np.arctan2(-(left - right)[2], (left - right)[0]))


def _place(body: Skeleton, pose: Floats, joint: int) -> Floats:
    """Where a joint is in a pose of rotations in the world, against the root: [3]."""
    chain = [joint, *body.ancestors(joint)][:-1]
    return np.asarray(sum((_along(body, pose, each) for each in chain), np.zeros(3)))


def _along(body: Skeleton, pose: Floats, joint: int) -> Floats:
    """The bone that ends at a joint, in a pose of rotations in the world: [3]."""
    return np.asarray(quaternions.rotate(pose[body.parents[joint]], body.offsets[joint]))


def _require_alike(
    rig: Skeleton, clip: Clip, legs: Sequence[tuple[Leg, Leg]], own: Mapping[int, int], poses: Sequence[Floats | None]
) -> None:
    """Refuse bodies whose legs or arms point elsewhere in the pose of reference: one lies, has other axes, or its arms lower."""
    mine, theirs = _rotations_in(rig, poses[0]), _rotations_in(clip.skeleton, poses[1])
    back = -_heading(rig, mine), -_heading(clip.skeleton, theirs)
    to_front = [quaternions.about_axis("y", np.array(each)) if any(p is not None for p in poses) else STILL for each in back]
    least = {joint: ALIKE_LEGS for leg, _ in legs for joint in leg.joints[1:].tolist()}
    least |= {joint: ALIKE_ARMS for joint, (_, core) in enumerate(cores_of(rig.names)) if core in ARMS and joint in own}
    for joint, cosine in least.items():
        if own[joint] == 0 or own.get(int(rig.parents[joint])) != clip.skeleton.parents[own[joint]]:
            continue
        one = quaternions.rotate(to_front[0], _along(rig, mine, joint))
        other = quaternions.rotate(to_front[1], _along(clip.skeleton, theirs, own[joint]))
        if float(one @ other) < cosine * float(np.linalg.norm(one) * np.linalg.norm(other)):
            problem = f"{in_quotes(rig.names[joint])} of the rig points another way at rest than that of the clip."
            accepted = "a rig that rests as the clip does, with the same axis up"
            mend = "rig_pose in [databases.NAME], with files whose first frames show both bodies in one pose"
            raise MotionError(Fault(problem, accepted, mend, Place(clip.name)))


def _lifts(rig: Skeleton, leg: Leg, placed: Poses, retargeted: Poses, own: Mapping[int, int], scale: float) -> Floats:
    """How much higher than by scale an ankle is to be in each frame, so that its sole is as high as by scale: [F]."""
    ankle = int(leg.joints[2])
    soles = [joint for joint in range(rig.n_joints) if joint in own and ankle in rig.ancestors(joint)]
    soles = [joint for joint in soles if own[ankle] in retargeted.skeleton.ancestors(own[joint])]
    if not soles:
        return np.zeros(placed.n_frames)
    drop = _drop(placed.positions[..., 1], ankle, soles)
    return drop - scale * _drop(retargeted.positions[..., 1], own[ankle], [own[joint] for joint in soles])


def _drop(heights: Floats, ankle: int, soles: list[int]) -> Floats:
    """How far the lowest joint of a foot is below its ankle: [F]."""
    return np.asarray(np.maximum(heights[:, ankle] - heights[:, soles].min(axis=1), 0.0))


def _length(offsets: Floats, leg: Leg) -> float:
    """How long thigh and shin are together."""
    return float(np.linalg.norm(offsets[leg.joints[1:]], axis=-1).sum())


def _rotations(rig: Skeleton, source: Poses, own: Mapping[int, int], turned: Floats) -> Floats:
    """Against their parents, so that each joint is turned in the world as its counterpart, and then its own way: [F, J, 4]."""
    still = np.broadcast_to(STILL, (source.n_frames, 4))
    world: list[Floats] = []
    rotations = np.empty((source.n_frames, rig.n_joints, 4))
    for joint, parent in enumerate(rig.parents.tolist()):
        above = still if parent < 0 else world[parent]
        world.append(quaternions.multiply(source.rotations[:, own[joint]], turned[joint]) if joint in own else above)
        rotations[:, joint] = quaternions.multiply(quaternions.inverse(above), world[joint])
    return rotations
