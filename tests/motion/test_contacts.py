"""Footfalls from heel and toe: on made clips of every rate and rig, on captured ones, and as marks say them."""

import json
import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_once import make_clip
from strategies import for_each

from contextdb.errors import MotionError
from contextdb.motion import Clip, FeatureSchema, Markup, MotionDatabase, PoseBank, Skeleton, load_bvh
from contextdb.motion.clips.contacts import _most_nearby, stances
from contextdb.motion.clips.feet import footfalls, footfalls_of, marked
from contextdb.motion.clips.foot_bones import FootBones, feet_of
from contextdb.motion.clips.poses import forward_kinematics, local_poses, resampled
from contextdb.motion.features.extraction import clip_features
from contextdb.motion.made.recipes import RECIPES

FRAME_S = 1.01 / 30.0
STANCES = Path(os.environ.get("CONTEXTDB_STANCES", ""))
CLIPS = Path(os.environ.get("CONTEXTDB_MOCAP", ""))


@for_each(RECIPES, [30.0, 60.0, 120.0])
def test_every_made_clip_gives_the_footfalls_it_was_made_with_at_any_rate(name, rate):
    made = make_clip(name)
    found = footfalls_of(forward_kinematics(resampled(local_poses(made.clip), rate)))
    for foot in found.feet:
        assert found.down[foot] == pytest.approx(made.footfalls.down[foot], abs=FRAME_S)


@pytest.mark.parametrize("name", ["walk", "sprint", "walk_tired"])
@pytest.mark.parametrize("seed", range(3))
def test_the_noise_of_capture_moves_no_footfall_by_more_than_two_frames(name, seed):
    made = make_clip(name)
    poses = forward_kinematics(local_poses(made.clip))
    noise = np.random.default_rng(seed).normal(0.0, 0.0015, poses.positions.shape)
    found = footfalls_of(replace(poses, positions=poses.positions + noise))
    for foot in found.feet:
        assert found.down[foot] == pytest.approx(made.footfalls.down[foot], abs=2.0 * FRAME_S)


# ---- rigs


def renamed(clip, names):
    return Clip(clip.name, replace(clip.skeleton, names=names), clip.frame_time_s, clip.values, clip.metres_per_unit)


def without_toes(clip, *, ends):
    """The clip on a rig whose feet have no toe joint, but perhaps an end where it was."""
    rig = clip.skeleton
    kept = [joint for joint, name in enumerate(rig.names) if "Toe" not in name]
    number = {joint: i for i, joint in enumerate(kept)}
    toes = [joint for joint in range(rig.n_joints) if joint not in number]
    offsets = tuple((number[int(rig.parents[toe])], tuple(rig.offsets[toe].tolist())) for toe in toes) if ends else ()
    columns = [c for joint in kept for c in range(rig.channel_starts[joint], rig.channel_starts[joint] + len(rig.channels[joint]))]
    skeleton = Skeleton(
        tuple(rig.names[joint] for joint in kept),
        np.array([number.get(int(rig.parents[joint]), -1) for joint in kept]),
        rig.offsets[kept],
        tuple(rig.channels[joint] for joint in kept),
        offsets,
    )
    return Clip(clip.name, skeleton, clip.frame_time_s, clip.values[:, columns], clip.metres_per_unit)


@pytest.mark.parametrize("name", ["walk", "run", "walk_turn_left_90"])
def test_the_end_of_a_foot_serves_as_its_toe(name):
    made = make_clip(name)
    found = footfalls(without_toes(made.clip, ends=True))
    for foot in found.feet:
        assert found.down[foot] == pytest.approx(made.footfalls.down[foot], abs=2.0 * FRAME_S)


def test_an_ankle_alone_finds_every_stance_though_its_edges_are_nearer_together():
    made = make_clip("walk")
    found = footfalls(without_toes(made.clip, ends=False))
    for foot in found.feet:
        assert found.down[foot] == pytest.approx(made.footfalls.down[foot], abs=0.2)


def test_feet_are_found_by_names_of_any_rig_or_else_at_the_ends_of_the_legs():
    made = make_clip("walk")
    plain = made.clip.skeleton.names
    for left, right, foot in [("l", "r", "foot"), ("Bip01 L ", "Bip01 R ", "Ankle"), ("rig:Left", "rig:Right", "Foot")]:
        names = tuple(n.replace("Left", left).replace("Right", right).replace("Foot", foot) for n in plain)
        assert feet_of(replace(made.clip.skeleton, names=names)) == (left + foot, right + foot)
    nameless = tuple(n.replace("Foot", "Part3").replace("Toe", "Part4") for n in plain)
    found = footfalls(renamed(made.clip, nameless))
    assert found.feet == ("LeftPart3", "RightPart3")
    assert found.down["LeftPart3"] == pytest.approx(made.footfalls.down["LeftFoot"], abs=FRAME_S)


def test_declared_heels_and_toes_count_and_must_be_bones_of_the_rig():
    made = make_clip("walk")
    poses = forward_kinematics(local_poses(made.clip))
    toes = next((a, b) for a, b in [("LeftToe", "RightToe"), ("LeftToeBase", "RightToeBase")] if a in made.clip.skeleton)
    named = FootBones(("LeftFoot", "RightFoot"), toes=toes)
    assert footfalls_of(poses, named).down["LeftFoot"].tolist() == footfalls_of(poses).down["LeftFoot"].tolist()
    with pytest.raises(MotionError, match='no bone "LeftHeel"'):
        footfalls_of(poses, replace(named, heels=("LeftHeel", "RightHeel")))
    schema = {"rate": 30, "channels": [{"type": "phase"}], "feet": ["LeftFoot", "RightFoot"], "toes": list(toes)}
    assert FeatureSchema.from_dict("a", schema).foot_bones() == named
    [fault] = FeatureSchema.from_dict("a", {**schema, "heels": ["LeftHeel", "RightFoot"]}).bone_faults(made.clip.skeleton)
    assert 'no bone "LeftHeel"' in str(fault)


# ---- how points move


@pytest.mark.parametrize("reach", [1, 2, 3, 7, 8, 40])
def test_the_largest_value_nearby_is_that_of_a_plain_window(reach):
    values = np.random.default_rng(reach).normal(size=30)
    plain = [values[max(0, i - reach) : i + reach + 1].max() for i in range(30)]
    assert _most_nearby(values, reach).tolist() == plain


def points(heights, ahead, rate=30.0):
    """A foot [F, 1, 3] from its heights and how far ahead it is."""
    return np.stack((np.zeros(len(heights)), np.asarray(heights), np.asarray(ahead)), axis=-1)[:, None]


def strides(n, rise_m, *, starts_down, steps=15):
    """Heights and ways of a foot that stands and steps by turns, and each time comes down higher by so much."""
    heights, ways, at, way = [], [], 0.0, 0.0
    for i in range(n):
        share = np.arange(steps) / steps
        if (i % 2 == 0) == starts_down:
            heights += [at] * steps
            ways += [way] * steps
        else:
            smooth = share * share * (3.0 - 2.0 * share)
            lift = 0.05 if rise_m < 0 else 0.15
            heights += (at + np.minimum(1.0, 1.6 * smooth) * rise_m + lift * np.sin(np.pi * share)).tolist()
            ways += (way + 0.6 * smooth).tolist()
            at, way = at + rise_m, way + 0.6
    return points(heights, ways)


@pytest.mark.parametrize("rise_m", [0.34, -0.34, 0.0])
def test_stairs_up_and_down_have_the_stances_of_level_ground(rise_m):
    left, right = stances((strides(6, rise_m, starts_down=True), strides(6, rise_m, starts_down=False)), 30.0)
    assert left == pytest.approx(np.array([[0.0, 15.0], [30.0, 45.0], [60.0, 75.0]]) / 30.0, abs=4.0 / 30.0)
    assert (np.diff(right, axis=1) > 0.1).sum() == 3  # one that the clip cuts may be short


def test_a_jump_has_both_feet_up_at_its_top_too():
    at_s = np.clip(np.arange(60) / 30.0 - 0.7, 0.0, 0.6)
    foot = points(np.maximum(0.0, 3.0 * at_s - 5.0 * at_s**2), np.zeros(60))
    for down in stances((foot, foot), 30.0):
        assert down == pytest.approx(np.array([[0.0, 21.0], [39.0, 59.0]]) / 30.0, abs=FRAME_S)


def test_a_foot_held_still_above_the_other_one_is_up_and_who_stands_has_both_down():
    held = points([0.0] * 20 + np.linspace(0.0, 0.3, 60).tolist() + [0.3] * 60 + np.linspace(0.3, 0.0, 60).tolist(), [0.0] * 200)
    standing = points([0.0] * 200, [0.0] * 200)
    left, right = stances((held, standing), 30.0)
    assert right.tolist() == [[0.0, 199.0 / 30.0]]
    assert not any(a < 110 / 30.0 < b for a, b in left.tolist())
    assert [d.tolist() for d in stances((standing, standing), 30.0)] == [[[0.0, 199.0 / 30.0]]] * 2
    idle = footfalls(make_clip("idle").clip)
    assert all(idle.down[foot].tolist() == [[0.0, idle.duration_s]] for foot in idle.feet)


# ---- marks


def test_marks_say_when_a_foot_is_down_and_0_when_it_is_not():
    assert marked([(0.2, 0.5, True), (0.5, 0.8, True)], 2.0).tolist() == [[0.2, 0.8]]
    assert marked([(0.0, math.inf, True), (0.5, 0.7, False)], 2.0).tolist() == [[0.0, 0.5], [0.7, 2.0]]
    assert marked([(0.0, math.inf, False)], 2.0).tolist() == []
    assert marked([(1.5, 3.0, True)], 2.0).tolist() == [[1.5, 2.0]]


MARKS = "asset,tag,from,to,value\nwalk,Contact.Left,0.5,0.9,\nwalk,contact.left,1.2,1.5,1\n*,Contact.Right,,,0\n"
PHASE = FeatureSchema.from_dict("p", {"rate": 30, "channels": [{"type": "phase"}], "mirror": [["Left*", "Right*"]]})


def test_marks_of_a_clip_take_the_place_of_what_is_found():
    markup = Markup.parse(MARKS)
    assert markup.contacts_of("walk") == (((0.5, 0.9, True), (1.2, 1.5, True)), ((0.0, math.inf, False),))
    assert markup.contacts_of("run") == (None, ((0.0, math.inf, False),))
    assert markup.tags == ()
    clip = make_clip("walk").clip
    bank = PoseBank.build([clip], PHASE, mirror=True, markup=markup)
    times = np.arange(bank.n_frames // 2) / 30.0
    wanted = ((times > 0.49) & (times < 0.91)) | ((times > 1.19) & (times < 1.51))
    assert bank.contacts[: len(times), 0].tolist() == wanted.tolist()
    assert not bank.contacts[: len(times), 1].any()
    assert bank.contacts[len(times) :, 1].tolist() == wanted.tolist()
    assert not bank.contacts[len(times) :, 0].any()


def test_marks_change_phases_and_a_loop_repeats_them():
    clip = make_clip("walk").clip
    marks = Markup.parse(MARKS).contacts_of("walk")
    plain = clip_features(clip, PHASE).features
    seen = clip_features(clip, PHASE, contacts=marks).features
    assert not seen[:, 2:].any()
    assert not np.allclose(seen, plain)
    mirrored = clip_features(clip, PHASE, mirrored=True, contacts=marks).features
    assert np.allclose(mirrored[:, 2:], seen[:, :2], atol=1e-6)
    built = MotionDatabase.build([clip], PHASE, markup=Markup.parse(MARKS))
    assert np.allclose([built.raw(frame) for frame in range(len(seen))], seen, atol=1e-5)
    looped = clip_features(clip, PHASE, looping=True, contacts=marks).features
    assert looped[0, :2] == pytest.approx(looped[-1, :2], abs=1e-5)


def test_a_mark_that_is_misspelt_or_has_another_value_is_refused_with_the_mend():
    with pytest.raises(MotionError, match=r'Did you mean "Contact\.Left"'):
        Markup.parse("asset,tag,from,to\nwalk,Contacts.Left,,\n")
    with pytest.raises(MotionError, match="1 where the foot is down"):
        Markup.parse("asset,tag,from,to,value\nwalk,Contact.Left,,,2\n")


# ---- captured clips, marked by hand


@pytest.mark.skipif(
    not (STANCES.is_file() and CLIPS.is_dir()),
    reason="no stances marked by hand: set CONTEXTDB_STANCES to their file, and CONTEXTDB_MOCAP to the folder of the clips",
)
def test_captured_walks_and_runs_have_98_percent_of_their_stances_with_edges_within_two_frames():
    n_stances = n_found = n_edges = n_near = 0
    for asset, marks in json.loads(STANCES.read_text(encoding="utf-8")).items():
        unit = 0.056444 if asset.startswith("cmu/131") else 0.01
        falls = footfalls(load_bvh(CLIPS / asset, metres_per_unit=unit))
        low_s, high_s = marks["from"] / marks["rate"], marks["to"] / marks["rate"]
        for side, foot in zip(("left", "right"), falls.feet, strict=True):
            down = np.clip(falls.down[foot], low_s, high_s)
            for begin_s, end_s in np.array(marks[side]) / marks["rate"]:
                shared = np.minimum(down[:, 1], end_s) - np.maximum(down[:, 0], begin_s)
                n_stances += 1
                if shared.max() < 0.5 * (end_s - begin_s) - 1e-9:
                    continue
                n_found += 1
                found = down[shared.argmax()]
                for edge_s, wanted_s, cut_s in ((found[0], begin_s, low_s), (found[1], end_s, high_s)):
                    if cut_s not in (edge_s, wanted_s):
                        n_edges += 1
                        n_near += abs(edge_s - wanted_s) <= 2.01 / 30.0
    assert n_found >= 0.98 * n_stances
    assert n_near >= 0.95 * n_edges
