"""A clip on another rig: the same rig changes nothing, a larger one goes farther in the same way, and feet still stand."""

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from made_once import make_clip

from contextdb import motion
from contextdb.errors import MotionError
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.bone_names import side_and_core
from contextdb.motion.clips.poses import local_poses
from contextdb.motion.clips.skeleton import sided_pairs

MADE = make_clip("walk")
CLIP, RIG = MADE.clip, MADE.clip.skeleton
POSES = motion.poses_of(CLIP)


def scaled(rig: motion.Skeleton, all_by: float, legs_by: float = 1.0) -> motion.Skeleton:
    """A rig of other lengths; its legs are longer or shorter than the rest by a factor."""
    offsets = rig.offsets * all_by
    for bone in ("LeftLeg", "LeftFoot", "RightLeg", "RightFoot"):
        offsets[rig.index(bone)] *= legs_by
    return replace(rig, offsets=offsets)


def without(rig: motion.Skeleton, bone: str) -> motion.Skeleton:
    """A rig without one bone: its children hang on its parent."""
    gone = rig.index(bone)
    kept = [joint for joint in range(rig.n_joints) if joint != gone]
    parents = [rig.parents[gone] if rig.parents[joint] == gone else rig.parents[joint] for joint in kept]
    places = {joint: at for at, joint in enumerate(kept)}
    offsets = np.array([rig.offsets[j] + (rig.offsets[gone] if rig.parents[j] == gone else 0.0) for j in kept])
    return motion.Skeleton(
        tuple(rig.names[joint] for joint in kept),
        np.array([places.get(int(parent), -1) for parent in parents], np.int64),
        offsets,
        tuple(rig.channels[joint] for joint in kept),
    )


def test_on_its_own_rig_a_clip_stays_what_it_is():
    again = motion.poses_of(motion.retargeted(CLIP, RIG))
    np.testing.assert_allclose(again.positions, POSES.positions, atol=1e-6)


def test_on_a_rig_twice_as_large_all_is_twice_as_large():
    again = motion.poses_of(motion.retargeted(CLIP, scaled(RIG, 2.0)))
    np.testing.assert_allclose(again.positions, 2.0 * POSES.positions, atol=1e-6)


@pytest.mark.parametrize(("legs_by", "ankles_by"), [(0.8, 1.0), (1.2, 1.0), (1.0, 0.4), (1.1, 1.6)])
def test_with_other_legs_and_ankles_the_feet_stand_where_those_of_the_clip_do_by_scale(legs_by, ankles_by):
    rig = scaled(RIG, 1.0, legs_by)
    for bone in ("LeftToe", "RightToe"):
        rig.offsets[rig.index(bone), 1] *= ankles_by
    again = motion.poses_of(motion.retargeted(CLIP, rig))
    for bone in ("LeftFoot", "RightFoot"):
        ankle, toe = RIG.index(bone), RIG.index(bone.replace("Foot", "Toe"))
        np.testing.assert_allclose(again.positions[:, ankle, ::2], legs_by * POSES.positions[:, ankle, ::2], atol=0.01)
        np.testing.assert_allclose(again.positions[:, toe, 1], legs_by * POSES.positions[:, toe, 1], atol=0.01)
        for begin, end in MADE.footfalls.down[bone]:
            frames = slice(int(np.ceil(begin * 30.0)), int(end * 30.0) + 1)
            assert np.ptp(again.positions[frames, ankle], axis=0).max() < 0.01
    lengths = np.linalg.norm(again.positions[:, 1:] - again.positions[:, RIG.parents[1:]], axis=-1)
    assert np.ptp(lengths, axis=0).max() < 1e-9


def test_what_a_bone_turned_that_the_rig_has_not_is_in_the_bone_below_it():
    rig = without(RIG, "Spine")
    again = motion.poses_of(motion.retargeted(CLIP, rig))
    chest = again.rotations[:, rig.index("Chest")], POSES.rotations[:, RIG.index("Chest")]
    assert np.abs((chest[0] * chest[1]).sum(axis=-1)).min() > 1.0 - 1e-9


SPELLINGS: dict[str, Callable[[str], str]] = {
    "a namespace": lambda name: f"mixamorig:{name}",
    "a namespace that became a part of the name": lambda name: f"mixamorig1{name}",
    "sides behind": lambda name: re.sub("^(Left|Right)(.*)", lambda m: f"{m[2].lower()}.{m[1][0]}", name),
    "sides of three letters": lambda name: re.sub("^(Left|Right)(.*)", lambda m: f"{SHORT[m[1]]}_{m[2]}", name),
    "words of 3ds Max": lambda name: "Bip01 " + WORDS_OF_MAX[side_and_core(name)[1]].format(name[0]),
    "words of nobody": lambda name: WORDS_OF_NOBODY.get(name, name),
}
SHORT = {"Left": "lft", "Right": "rgt"}
WORDS_OF_MAX = {
    "hips": "Pelvis", "spine": "Spine", "chest": "Spine1", "neck": "Neck", "head": "Head", "arm": "{} UpperArm", "hand": "{} Hand",
    "forearm": "{} Forearm", "upleg": "{} Thigh", "leg": "{} Calf", "foot": "{} Foot", "toe": "{} Toe0",
}  # fmt: skip
WORDS_OF_NOBODY = {"Hips": "COG", "LeftUpLeg": "L_one", "LeftLeg": "L_two", "RightUpLeg": "R_one", "RightLeg": "R_two"}


@pytest.mark.parametrize("spelling", SPELLINGS)
def test_bones_meet_in_any_spelling(spelling: str):
    """A rig of which all but the hands and the chest are the clip's, whose names are spelt otherwise: all move as they do there."""
    rig = replace(RIG, names=tuple(map(SPELLINGS[spelling], RIG.names)))
    assert len(rig_pairs := sided_pairs(rig.names)) == len(sided_pairs(RIG.names)), rig_pairs
    again = motion.poses_of(motion.retargeted(CLIP, rig))
    np.testing.assert_allclose(again.positions, POSES.positions, atol=1e-6)
    back = motion.poses_of(motion.retargeted(replace(CLIP, skeleton=rig), RIG))
    np.testing.assert_allclose(back.positions, POSES.positions, atol=1e-6)


def test_a_bone_is_known_without_its_namespace():
    rig = replace(RIG, names=tuple(f"mixamorig:{name}" for name in RIG.names))
    assert rig.index("LeftFoot") == rig.index("mixamorig:LeftFoot") == RIG.index("LeftFoot")
    two = replace(RIG, names=("a:Hips", "b:Hips", *RIG.names[2:]))
    assert "Hips" not in two


def test_names_that_are_given_come_first_and_must_be_there():
    rig = replace(RIG, names=tuple("Pelvis" if name == "Hips" else name for name in RIG.names))
    again = motion.poses_of(motion.retargeted(CLIP, rig, names={"Pelvis": "Hips"}))
    np.testing.assert_allclose(again.positions, POSES.positions, atol=1e-6)
    with pytest.raises(MotionError, match="Did you mean"):
        motion.retargeted(CLIP, rig, names={"Pelvis": "Hip"})


def resting(clip: motion.Clip, turns: dict[str, float], heading: float = 0.0) -> motion.Clip:
    """The same motion of a body that rests in another pose: some bones turned about the z axis, and all about the y axis."""
    body = clip.skeleton
    pose = np.tile([1.0, 0.0, 0.0, 0.0], (body.n_joints, 1))
    for joint, parent in enumerate(body.parents.tolist()):
        above = quaternions.about_axis("y", np.array(heading)) if parent < 0 else pose[parent]
        pose[joint] = quaternions.multiply(above, quaternions.about_axis("z", np.array(turns.get(body.names[joint], 0.0))))
    world, local = motion.poses_of(clip), local_poses(clip)
    offsets = body.offsets * clip.metres_per_unit
    offsets[1:] = quaternions.rotate(pose[body.parents[1:]], offsets[1:])
    rotations = quaternions.multiply(world.rotations, quaternions.inverse(pose))
    above = np.where(body.parents[:, None] < 0, np.array([1.0, 0.0, 0.0, 0.0]), rotations[:, np.maximum(body.parents, 0)])
    turned = quaternions.multiply(quaternions.inverse(above), rotations)
    return motion.Clip.from_arrays(body.names, body.parents, offsets, turned, local.positions[:, 0], clip.rate, name=clip.name)


def standing(clip: motion.Clip, rest: dict[str, float], heading: float = 0.0) -> motion.Clip:
    """A clip of one frame in which the made body stands at rest, of a body that rests otherwise."""
    turns = np.tile([1.0, 0.0, 0.0, 0.0], (1, RIG.n_joints, 1))
    plain = motion.Clip.from_arrays(RIG.names, RIG.parents, RIG.offsets * 0.01, turns, np.array([[0.0, 1.0, 0.0]]), 30.0)
    return resting(plain, rest, heading)


ARMS_UP = {"LeftArm": np.pi / 3.0, "RightArm": -np.pi / 3.0}


@pytest.mark.parametrize("heading", [0.0, 2.0])
@pytest.mark.parametrize("which", ["the rig", "the clip"])
def test_a_declared_pose_puts_arms_that_rest_otherwise_where_they_belong(which: str, heading: float):
    other = resting(CLIP, ARMS_UP, heading)
    np.testing.assert_allclose(motion.poses_of(other).positions, POSES.positions, atol=1e-9)
    of_other, plain = standing(CLIP, ARMS_UP, heading), standing(CLIP, {})
    clip, rig = (CLIP, other.skeleton) if which == "the rig" else (other, RIG)
    with pytest.raises(MotionError, match=r"rig points another way at rest.*rig_pose"):
        motion.retargeted(clip, rig)
    for references in ([of_other], [of_other, plain]) if heading == 0.0 else ([of_other, plain],):
        again = motion.poses_of(motion.retargeted(clip, rig, references=references))
        np.testing.assert_allclose(again.positions, POSES.positions, atol=1e-6)


def test_a_rig_that_rests_with_another_axis_up_is_refused():
    lying = replace(RIG, offsets=RIG.offsets[:, [0, 2, 1]])
    with pytest.raises(MotionError, match='"LeftLeg" of the rig points another way at rest'):
        motion.retargeted(CLIP, lying)


def test_a_rig_without_legs_is_refused():
    with pytest.raises(MotionError):
        motion.retargeted(CLIP, motion.Skeleton(("Hips",), np.array([-1]), np.zeros((1, 3)), (("Xposition",),)))
