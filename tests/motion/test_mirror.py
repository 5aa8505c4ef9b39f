"""Mirroring poses, paths and clips by declared bone pairs."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip
from test_mocap import FOLDER, listed, load

from contextdb.errors import MotionError
from contextdb.motion import Clip, FeatureSchema, Skeleton
from contextdb.motion.clips.foot_bones import feet_of
from contextdb.motion.clips.mirror import fixed_joints, has_even_axes, mirrored, own_axes, partners_of, unevenness
from contextdb.motion.clips.poses import LocalPoses, forward_kinematics, local_poses
from contextdb.motion.clips.quaternions import inverse, matrices, multiply, rotation_vectors
from contextdb.motion.clips.skeleton import sided_pairs
from contextdb.motion.features.extraction import clip_features
from contextdb.motion.features.schema import Channel

MADE = make_clip("walk").clip.skeleton
SIDES = (("Left*", "Right*"),)


@st.composite
def local_poses_of_some_body(draw):
    """A body with a left and a right branch of like shape but any offsets and rest axes, in any local pose."""
    n_spine, n_limb, n_frames = draw(st.integers(1, 3)), draw(st.integers(1, 3)), draw(st.integers(1, 3))
    names, parents = [f"Spine{i}" for i in range(n_spine)], [i - 1 for i in range(n_spine)]
    for side in ("Left", "Right"):
        above = n_spine - 1
        for i in range(n_limb):
            names.append(f"{side}{i}")
            parents.append(above)
            above = len(names) - 1
    rng = np.random.default_rng(draw(st.integers(0, 2**20)))
    skeleton = Skeleton(tuple(names), np.array(parents), rng.normal(size=(len(names), 3)), tuple(() for _ in names))
    rotations = rng.normal(size=(n_frames, len(names), 4))
    rotations /= np.linalg.norm(rotations, axis=-1, keepdims=True)
    return LocalPoses(skeleton, 30.0, rng.normal(size=(n_frames, len(names), 3)), rotations)


@given(local_poses_of_some_body())
def test_a_body_mirrored_twice_is_as_it_was(local):
    again = mirrored(mirrored(local, SIDES), SIDES)
    assert np.allclose(again.positions, local.positions, atol=1e-12)
    assert np.allclose(matrices(again.rotations), matrices(local.rotations), atol=1e-12)
    if (own_axes(local.skeleton, partners_of(local.skeleton, SIDES)).turns == [1.0, 0.0, 0.0, 0.0]).all():
        assert np.array_equal(again.rotations, local.rotations)


@given(local_poses_of_some_body())
def test_mirrored_local_poses_place_all_bones_where_the_mirror_shows_them(local):
    placed, plain = forward_kinematics(mirrored(local, SIDES)), forward_kinematics(local)
    seen = mirrored(plain, SIDES)
    assert np.allclose(placed.positions, seen.positions, atol=1e-12)
    assert np.allclose(matrices(placed.rotations), matrices(seen.rotations), atol=1e-12)


@given(local_poses_of_some_body())
def test_a_mirrored_bone_is_the_reflection_of_its_partner_turned_about_itself(local):
    plain = forward_kinematics(local)
    seen = mirrored(plain, SIDES)
    turns = matrices(own_axes(plain.skeleton, partners_of(plain.skeleton, SIDES)).turns)
    flip = np.diag([-1.0, 1.0, 1.0])
    for joint, name in enumerate(plain.skeleton.names):
        other = plain.skeleton.index(name.replace("Left", "?").replace("Right", "Left").replace("?", "Right"))
        assert np.allclose(seen.positions[:, joint], plain.positions[:, other] @ flip)
        reflected = flip @ matrices(plain.rotations[:, other]) @ flip
        assert np.allclose(matrices(seen.rotations[:, joint]), reflected @ turns[joint], atol=1e-12)


def test_patterns_and_names_give_the_same_pairs():
    by_pattern = partners_of(MADE, SIDES)
    lefts = [name for name in MADE.names if name.startswith("Left")]
    assert np.array_equal(by_pattern, partners_of(MADE, tuple((name, "Right" + name[4:]) for name in lefts)))
    assert MADE.names[by_pattern[MADE.index("LeftHand")]] == "RightHand"
    assert by_pattern[MADE.index("Head")] == MADE.index("Head")


def test_a_star_may_stand_anywhere_in_a_name():
    names = ("rig:Hips", "rig:Leg_L", "rig:Leg_R", "rig:lArm", "rig:rArm")
    skeleton = Skeleton(names, np.array([-1, 0, 0, 0, 0]), np.zeros((5, 3)), tuple(() for _ in names))
    assert partners_of(skeleton, (("*_L", "*_R"), ("rig:l*", "rig:r*"))).tolist() == [0, 2, 1, 4, 3]


@st.composite
def even_bodies(draw):
    """A body that is even at rest, each bone of it then turned to axes of its own, in poses of any rotations.

    Offsets are those of a world-aligned body, in the axes of the bones: even in every part, however the axes lie.
    """
    n_spine, n_limb, n_frames = draw(st.integers(1, 3)), draw(st.integers(1, 4)), draw(st.integers(1, 3))
    rng = np.random.default_rng(draw(st.integers(0, 2**20)))
    names, parents = [f"Spine{i}" for i in range(n_spine)], [i - 1 for i in range(n_spine)]
    for limb in ("Arm", "Leg")[: draw(st.integers(1, 2))]:
        for side in ("Left", "Right"):
            above = n_spine - 1 if limb == "Arm" else 0
            for i in range(n_limb):
                names.append(f"{side}{limb}{i}")
                parents.append(above)
                above = len(names) - 1
    partners = [names.index(_other_side(name)) for name in names]
    flip = np.diag([-1.0, 1.0, 1.0])
    offsets = rng.normal(size=(len(names), 3)) * draw(st.sampled_from([0.1, 1.0, 30.0]))
    if draw(st.booleans()):  # bones along one axis, as most rigs have them
        offsets *= rng.permuted(np.tile([1.0, 0.0, 0.0], (len(names), 1)), axis=1)
    for joint, partner in enumerate(partners):
        offsets[joint] = offsets[joint] * [0.0, 1.0, 1.0] if partner == joint else offsets[joint]
        if partner < joint:
            offsets[joint] = flip @ offsets[partner]
    axes = _axes(draw, rng, len(names))
    own = np.array([offsets[0], *(axes[parents[j]].T @ offsets[j] for j in range(1, len(names)))])
    skeleton = Skeleton(tuple(names), np.array(parents), own, tuple(() for _ in names))
    rotations = rng.normal(size=(n_frames, len(names), 4))
    rotations /= np.linalg.norm(rotations, axis=-1, keepdims=True)
    positions = np.repeat(own[None], n_frames, axis=0)
    positions[:, 0] = rng.normal(size=(n_frames, 3))
    return LocalPoses(skeleton, 30.0, positions, rotations)


def _other_side(name):
    return name.replace("Left", "?").replace("Right", "Left").replace("?", "Right")


def _axes(draw, rng, n_bones):
    """The axes of each bone at rest, as columns: any, a few degrees from the world's, or half turns from it."""
    form = draw(st.sampled_from(["any", "near", "half turns"]))
    if form == "half turns":
        signs = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
        return np.array([np.diag(signs[i]) for i in rng.integers(0, 4, n_bones)])
    turns = rng.normal(size=(n_bones, 4)) if form == "any" else rng.normal(size=(n_bones, 4)) * 0.03 + [1.0, 0, 0, 0]
    return matrices(turns / np.linalg.norm(turns, axis=-1, keepdims=True))


@given(even_bodies())
def test_mirrored_rotations_fit_the_offsets_of_a_rig_whose_bones_have_any_axes(local):
    skeleton, seen = local.skeleton, mirrored(forward_kinematics(local), SIDES)
    in_mirror = mirrored(local, SIDES)
    size = np.abs(skeleton.offsets).max() + 1.0
    constant = np.repeat(skeleton.offsets[None], len(local.positions), axis=0)
    constant[:, 0] = in_mirror.positions[:, 0]
    placed = forward_kinematics(replace(in_mirror, positions=constant))
    assert np.abs(placed.positions - seen.positions).max() < 1e-7 * size
    assert np.abs(forward_kinematics(in_mirror).positions - seen.positions).max() < 1e-9 * size
    assert own_axes(skeleton, partners_of(skeleton, SIDES)).apart.max() < 1e-7 * size


def uneven_clip():
    """A body whose right bones have axes turned about against the left ones', as some exporters write them."""
    names = ("Hips", "LeftLeg", "LeftFoot", "RightLeg", "RightFoot")
    offsets = np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.5, 0], [-0.1, 0, 0], [0, -0.5, 0]])
    skeleton = Skeleton(names, np.array([-1, 0, 1, 0, 3]), offsets, tuple(() for _ in names))
    return Clip("uneven", skeleton, 1.0 / 30.0, np.zeros((3, 0)), 1.0)


def test_bones_with_unlike_axes_are_mirrored_in_place_but_not_in_direction():
    clip = uneven_clip()
    assert not has_even_axes(clip.skeleton, partners_of(clip.skeleton, SIDES))
    assert has_even_axes(MADE, partners_of(MADE, SIDES))
    place = FeatureSchema("loco", 30.0, (Channel("position", 1.0, "LeftFoot"),), mirror=SIDES)
    found = clip_features(clip, place, mirrored=True).features
    right = FeatureSchema("loco", 30.0, (Channel("position", 1.0, "RightFoot"),))
    assert np.allclose(found, clip_features(clip, right).features * [-1.0, 1.0, 1.0])
    for kind in ("direction", "orientation"):
        turned = FeatureSchema("loco", 30.0, (Channel(kind, 1.0, "LeftFoot"),), mirror=SIDES)
        with pytest.raises(MotionError, match=f'so channel "LeftFoot {kind}.*" cannot be mirrored'):
            clip_features(clip, turned, mirrored=True)


def test_local_poses_of_a_clip_stay_within_the_file_s_bone_lengths():
    local = local_poses(make_clip("jog").clip)
    lengths = np.linalg.norm(mirrored(local, SIDES).positions[:, 1:], axis=-1)
    assert np.allclose(lengths, np.linalg.norm(local.positions[:, 1:], axis=-1))


@pytest.mark.skipif(not (FOLDER / "assets.csv").is_file(), reason="no captured clips: set CONTEXTDB_MOCAP to their folder")
def test_captured_bodies_are_mirrored_by_their_sided_names():
    for row in listed()[::8]:
        clip = load(row)
        pairs = tuple(sided_pairs(clip.skeleton.names))
        foot, other = feet_of(clip.skeleton)
        channels = [Channel(kind, 1.0, foot) for kind in ("position", "velocity", "angular_velocity")]
        across = [Channel(kind, 1.0, other) for kind in ("position", "velocity", "angular_velocity")]
        seen = clip_features(clip, FeatureSchema("m", 30.0, (*channels, Channel("phase")), mirror=pairs), mirrored=True)
        plain = clip_features(clip, FeatureSchema("m", 30.0, (*across, Channel("phase", feet=(other, foot)))))
        signs = [-1, 1, 1, -1, 1, 1, 1, -1, -1, 1, 1, 1, 1]
        assert np.allclose(seen.features, plain.features * signs, atol=1e-4), row["asset"]


@pytest.mark.skipif(not (FOLDER / "assets.csv").is_file(), reason="no captured clips: set CONTEXTDB_MOCAP to their folder")
def test_mirrored_rotations_of_captured_clips_fit_the_rig():
    """With the offsets of the rig, bones lie where the mirror shows them; of an uneven body, as far off as its bones tell."""
    told, differing = 0.0, []
    for row in listed()[::4]:
        clip = load(row)
        skeleton, pairs = clip.skeleton, tuple(sided_pairs(clip.skeleton.names))
        local = local_poses(clip)
        local = replace(local, positions=local.positions[::20], rotations=local.rotations[::20])
        in_mirror, seen = mirrored(local, pairs), mirrored(forward_kinematics(local), pairs)
        constant = in_mirror.positions.copy()
        constant[:, fixed_joints(skeleton)] = skeleton.offsets[fixed_joints(skeleton)] * clip.metres_per_unit
        off_m = np.linalg.norm(forward_kinematics(replace(in_mirror, positions=constant)).positions - seen.positions, axis=-1).max()
        uneven_m = sum(unevenness(skeleton, pairs).values()) * clip.metres_per_unit
        assert off_m <= uneven_m + 1e-5, row["asset"]
        if row["asset"].startswith("bandai"):
            assert off_m < 1e-5, row["asset"]
            told = max(told, uneven_m)
        moving = mirrored(local_poses(clip), pairs).rotations
        if row["content"] in ("walk", "run"):  # the mirrored body bends its joints as the body itself does
            apart = rotation_vectors(multiply(inverse(_mean(moving)), _mean(local_poses(clip).rotations)))
            differing += np.degrees(np.linalg.norm(apart, axis=-1))[1:].tolist()
    assert told < 1e-4
    assert np.quantile(differing, 0.99) < 60.0


def _mean(rotations):
    """The mean of rotations that are not far apart: [J, 4]."""
    alike = rotations * np.sign((rotations * rotations[:1]).sum(axis=-1, keepdims=True))
    return alike.mean(axis=0) / np.linalg.norm(alike.mean(axis=0), axis=-1, keepdims=True)
