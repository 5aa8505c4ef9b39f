"""Markup proposed for clips: what is known of made clips comes back, and nothing is proposed beside its own result."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from made_once import made_clips
from strategies import in_full_runs

from contextdb import motion
from contextdb.errors import ContextDBError
from contextdb.motion.markup.reserved import ReservedTag
from contextdb.motion.markup.span_faults import TOLERANCE_S
from contextdb.motion.preparing.look import span_of_frames
from contextdb.motion.preparing.proposal import KINDS, Proposal
from contextdb.motion.walking.blending import Gait
from contextdb.motion.walking.cycle import Cycle
from contextdb.motion.walking.walked import walked_clips

MADE = made_clips()
CLIPS = {made.name: made.clip for made in MADE}
STEADY = {made.name for made in MADE if made.recipe.change == "steady"}
FOUND = motion.prepare(list(CLIPS.values()))
FRAME_S = 1.0 / 30.0


def of(kind: str, found: Sequence[Proposal] = FOUND) -> list[Proposal]:
    return [each for each in found if each.kind == kind]


def as_markup(found: Sequence[Proposal]) -> motion.Markup:
    return motion.Markup(
        tuple(
            motion.Span(each.asset, each.tag, each.from_s or 0.0, np.inf if each.to_s is None else each.to_s, each.value)
            for each in found
            if each.tag is not None
        )
    )


# ---- made clips


def test_the_clips_that_loop_are_found_and_no_others():
    assert {each.asset for each in of("loops")} == STEADY
    assert {each.tag for each in of("loops")} == {ReservedTag.LOOPING}


@in_full_runs  # loops of made clips every day
def test_loops_of_one_cycle_are_found_whose_feet_come_down_at_an_end():
    gaits = [
        Gait(name, [Cycle.of(CLIPS[each]) for each in own])
        for name, own in (("walk", ("walk", "walk_fast")), ("run", ("jog", "run")))
    ]
    clips = walked_clips(gaits, speeds_mps=[1.3, 1.4, 1.55, 2.5], turns_dps=[0, 45])
    assert {each.asset for each in motion.prepare(clips, kinds=["loops"])} == {clip.name for clip in clips}


def test_the_contacts_are_those_of_the_recipe_within_a_frame_or_two():
    tags = {"LeftFoot": ReservedTag.CONTACT_LEFT, "RightFoot": ReservedTag.CONTACT_RIGHT}
    for made in (made for made in MADE if made.recipe.change == "steady" and made.recipe.gait == "Walk"):
        for foot, tag in tags.items():
            mine = [each for each in of("contacts") if (each.asset, each.tag) == (made.name, tag)]
            own = np.array([(e.from_s or 0.0, made.clip.duration_s if e.to_s is None else e.to_s) for e in mine])
            known = made.footfalls.down[foot]
            known = known[np.diff(known, axis=1)[:, 0] > 0.1]
            assert own.shape == known.shape, (made.name, foot)
            assert np.abs(own - known).max() <= 2.01 * FRAME_S, (made.name, foot)


def test_contacts_that_are_written_hold_no_foot_longer_than_what_is_found():
    schema = motion.FeatureSchema.from_dict("p", {"rate": 30, "channels": [{"type": "phase"}]})
    clips = [CLIPS[name] for name in ("walk", "run", "start_walk")]
    plain, marked = (motion.PoseBank.build(clips, schema, markup=markup) for markup in (None, as_markup(of("contacts"))))
    assert marked.contacts.any(axis=0).all()
    assert np.array_equal(marked.contacts, plain.contacts)


def test_starts_play_as_a_whole_and_stands_are_not_entered():
    starts = {made.name for made in MADE if made.recipe.change == "start"}
    stops = {made.name for made in MADE if made.recipe.change == "stop"}
    assert {each.asset for each in of("starts")} == starts
    assert {each.asset for each in of("tails") if each.from_s is None} == starts
    assert {each.asset for each in of("tails") if each.to_s is None} == stops
    assert of("noise") == of("duplicates") == of("turns") == []


def test_clips_that_come_to_a_stand_may_be_bent_to_a_target_until_they_stand_and_entered_before_they_slow_down():
    for made in (made for made in MADE if made.recipe.change == "stop"):
        own = {each.tag: each for each in of("targets") if each.asset == made.name}
        entered, bent = own[ReservedTag.MATCH_RANGE], own[ReservedTag.WARP_POSITION]
        way_m = np.linalg.norm(np.diff(motion.root_trajectory(motion.poses_of(made.clip)).positions, axis=0), axis=1).sum()
        assert bent.measure == pytest.approx(way_m, abs=0.15)
        assert entered.from_s is bent.from_s is None
        assert made.clip.duration_s - 0.5 >= bent.to_s > entered.to_s > made.clip.duration_s - 0.5 - 1.1  # a rest, a ramp
    assert {each.asset for each in of("targets")} == {made.name for made in MADE if made.recipe.change == "stop"}


@pytest.mark.parametrize("rate", [24.0, 30.0, 60000 / 1001, 120.0, 240.0])
def test_a_span_holds_its_frames_and_no_other(rate: float):
    times = np.arange(500) / rate
    for first in range(500):
        begin, end = span_of_frames(first, 499 - first, rate)
        assert begin is not None
        assert end is not None
        assert np.searchsorted(times, begin - TOLERANCE_S) == first
        assert np.searchsorted(times, end + TOLERANCE_S, side="right") == 500 - first
        assert (float(f"{begin:.3f}"), float(f"{end:.3f}")) == (begin, end)


def test_a_cut_that_is_proposed_makes_a_loop():
    for each in of("cuts"):
        clip = CLIPS[each.asset]
        first, last = (round(float(time_s or 0.0) / FRAME_S) for time_s in (each.from_s, each.to_s))
        again = motion.prepare([replace(clip, values=clip.values[first : last + 1])], kinds=["loops", "cuts"])
        assert [(one.kind, one.asset) for one in again] == [("loops", each.asset)]


def test_a_walk_with_a_head_cuts_to_a_whole_number_of_steps():
    walk = CLIPS["walk"]
    long = replace(walk, name="long", values=walk.values[5:-9])
    (cut,) = of("cuts", motion.prepare([long]))
    assert cut.from_s is not None
    assert cut.to_s is not None
    steps = (cut.to_s - cut.from_s) / (31 * FRAME_S)
    assert abs(steps - round(steps)) < 0.04


# ---- noise, turns, duplicates


def test_a_frame_that_jumps_is_excluded():
    values = np.array(CLIPS["walk"].values)
    values[60, 1] += 80.0
    (each,) = of("noise", motion.prepare([replace(CLIPS["walk"], values=values)]))
    assert (each.tag, each.from_s, each.to_s) == (ReservedTag.EXCLUDED, 1.967, 2.033)  # its neighbours are at 1.9667 and 2.0333
    assert each.measure == pytest.approx(0.8 * 30.0, rel=0.1)


def test_a_frame_that_jumps_is_excluded_with_all_that_it_is_a_part_of_at_another_rate():
    values = np.array(CLIPS["walk"].values)
    values[60, 1] += 80.0
    (each,) = of("noise", motion.prepare([replace(CLIPS["walk"], values=values, frame_time_s=1.0 / 24.0)]))
    at = np.arange(200) / 30.0
    touched = at[(at > 59.0 / 24.0) & (at < 61.0 / 24.0)]
    assert each.from_s <= touched[0] <= touched[-1] <= each.to_s


def test_another_pose_at_the_start_is_cut_off():
    values = np.array(CLIPS["walk"].values)
    values[:3, 0] += 300.0
    (each,) = of("noise", motion.prepare([replace(CLIPS["walk"], values=values)]))
    assert (each.from_s, each.to_s) == (None, pytest.approx(3 * FRAME_S - 1e-3, abs=1e-3))


def test_a_turn_in_a_straight_clip_plays_as_a_whole():
    clip = turning_clip(90.0, 1.0)
    (each,) = of("turns", motion.prepare([clip]))
    assert each.tag == ReservedTag.NEXT_NATURAL_ONLY
    assert each.measure == pytest.approx(90.0, abs=15.0)
    assert each.from_s is not None
    assert each.to_s is not None
    assert abs(each.from_s - 2.0) < 0.5
    assert abs(each.to_s - 3.0) < 0.5


def turning_clip(degrees: float, seconds: float) -> motion.Clip:
    """The walk, turned about the upright axis from its second 2 on."""
    walk = CLIPS["walk"]
    root = walk.skeleton.channels[0]
    yaw, x, z = (root.index(name) for name in ("Yrotation", "Xposition", "Zposition"))
    assert root.index("Yrotation") == min(root.index(name) for name in ("Xrotation", "Yrotation", "Zrotation"))
    values = np.array(walk.values)
    times = np.arange(walk.n_frames) * walk.frame_time_s
    angles = degrees * np.clip((times - 2.0) / seconds, 0.0, 1.0)
    values[:, yaw] += angles
    steps = np.diff(walk.values[:, [x, z]], axis=0)
    middle = np.radians((angles[1:] + angles[:-1]) / 2.0)
    turned = np.stack(
        (np.cos(middle) * steps[:, 0] + np.sin(middle) * steps[:, 1], np.cos(middle) * steps[:, 1] - np.sin(middle) * steps[:, 0]),
        axis=1,
    )
    values[1:, [x, z]] = values[0, [x, z]] + np.cumsum(turned, axis=0)
    return replace(walk, name="turning", values=values)


def test_a_copy_with_a_little_noise_is_a_near_duplicate_of_the_first():
    walk = CLIPS["walk"]
    noise = np.random.default_rng(0).normal(0.0, 0.3, walk.values.shape)
    copy = replace(walk, name="walk_again", values=walk.values + noise)
    (each,) = of("duplicates", motion.prepare([walk, CLIPS["walk_tired"], copy]))
    assert (each.asset, each.tag, each.from_s, each.to_s) == ("walk_again", ReservedTag.DO_NOT_CHOOSE, None, None)
    assert '"walk"' in each.reason


def test_a_turn_with_the_steps_of_a_walk_is_no_duplicate_of_it():
    walk = CLIPS["walk"]
    assert of("duplicates", motion.prepare([walk, turning_clip(90.0, 2.0)])) == []


# ---- markup that is there


def test_beside_its_own_result_nothing_is_proposed():
    again = motion.prepare(list(CLIPS.values()), as_markup(FOUND))
    assert [each for each in again if each.tag is not None] == []


def test_what_is_marked_by_hand_or_by_a_pattern_stays_alone():
    spans = (motion.Span("walk*", "Looping"), motion.Span("start_walk", "NextNaturalOnly", 0.4, 1.5, 0.3))
    spans += (motion.Span("walk", "Contact.Left", 0.0, 0.5),)
    found = motion.prepare([CLIPS["walk"], CLIPS["start_walk"]], motion.Markup(spans))
    said = {(each.asset, each.tag) for each in found}
    assert ("walk", ReservedTag.LOOPING) not in said
    assert ("walk", ReservedTag.CONTACT_LEFT) not in said
    assert ("walk", ReservedTag.CONTACT_RIGHT) in said
    assert ("start_walk", ReservedTag.NEXT_NATURAL_ONLY) not in said


@pytest.mark.parametrize("kind", KINDS)
def test_only_the_kinds_that_are_asked_for_are_proposed(kind: str):
    clips = [CLIPS[name] for name in ("walk", "start_walk", "stop_walk")]
    assert motion.prepare(clips, kinds=[kind]) == of(kind, motion.prepare(clips))


def test_an_unknown_kind_is_refused_with_the_nearest():
    with pytest.raises(ContextDBError, match='Did you mean "loops"'):
        motion.prepare([CLIPS["walk"]], kinds=["lops"])


@pytest.mark.parametrize("n_frames", [1, 2, 3, 5])
def test_a_clip_of_few_frames_is_looked_at(n_frames: int):
    short = replace(CLIPS["walk"], values=CLIPS["walk"].values[:n_frames])
    assert {each.kind for each in motion.prepare([short])} <= {"contacts"}
