"""Normalisation: one scale for each group, and features that do not vary."""

import numpy as np
import pytest
from made_once import make_clip
from strategies import for_each

from contextdb.motion import FeatureSchema, MotionDatabase, query_from
from contextdb.motion.features.extraction import features_of
from contextdb.motion.features.normalisation import Normalisation, floor_of
from contextdb.motion.features.schema import Channel

CHANNELS = (
    Channel("velocity", bone="LeftFoot"),
    Channel("direction", bone="LeftFoot"),
    Channel("orientation", bone="LeftHand"),
    Channel("angular_velocity", bone="LeftLeg"),
    Channel("phase"),
    Channel("trajectory", what="speed", at=(0.0,), along=(1.0,)),
    Channel("trajectory", what="direction", at=(0.5,)),
)
NAMES = ("walk", "run", "stop_walk_tired", "walk_turn_left_90", "walk_turn_right_90", "idle")


def blocks_of(schema):
    return [features_of(make_clip(name).clip, schema) for name in NAMES]


@pytest.mark.parametrize("channel", CHANNELS, ids=lambda channel: channel.name)
def test_a_channel_s_features_vary_by_one_on_average_whatever_their_unit(channel):
    schema = FeatureSchema("test", 30.0, (channel,))
    blocks = blocks_of(schema)
    found = Normalisation.of(blocks, schema).apply(np.concatenate(blocks))
    assert np.allclose(found.mean(axis=0), 0.0, atol=1e-6)
    assert found.std(axis=0).mean() == pytest.approx(1.0, abs=1e-6)
    assert np.abs(found).max() < 20.0


def test_channels_of_a_group_share_a_scale_and_others_do_not():
    feet = [Channel("velocity", bone=f"{side}Foot", group="feet") for side in ("Left", "Right")]
    schema = FeatureSchema("test", 30.0, (*feet, Channel("velocity", bone="Hips")))
    scale = Normalisation.of(blocks_of(schema), schema).scale
    assert len(set(scale[:6].tolist())) == 1
    assert scale[6] != scale[0]


def test_a_custom_channel_that_does_not_vary_keeps_its_own_unit():
    schema = FeatureSchema("test", 30.0, (Channel("custom", function="reach", size=2),))
    still = np.tile(np.array([[0.5, 1.5]], np.float32), (9, 1))
    found = Normalisation.of([still], schema)
    assert (found.scale.tolist(), found.raised) == ([1.0, 1.0], ())
    assert found.apply(still[0] + 1.0).tolist() == [1.0, 1.0]


EVERY_KIND = (
    *(Channel(kind, bone="Hips") for kind in ("position", "velocity", "direction", "orientation", "angular_velocity")),
    Channel("phase"),
    *(
        Channel("trajectory", what=what, at=(0.5,))
        for what in ("position", "velocity", "speed", "direction", "direction_to_velocity")
    ),
)


@for_each(EVERY_KIND, [0.0, 0.5, 0.999, 1.001, 3.0])
def test_a_scale_is_what_the_features_vary_by_and_at_least_the_floor_of_their_kind(channel, times_the_floor):
    schema = FeatureSchema("test", 30.0, (channel,))
    floor, unit = floor_of(channel)
    signs = np.where(np.arange(40) % 2, 1.0, -1.0)[:, None]  # vary by exactly 1
    block = np.repeat(signs * floor * times_the_floor, channel.n_features, axis=1).astype(np.float32)
    found = Normalisation.of([block], schema)
    assert found.scale == pytest.approx(np.full(channel.n_features, floor * max(1.0, times_the_floor)))
    assert [(each.channels, each.floor, each.unit) for each in found.raised] == (
        [((channel.name,), floor, unit)] if times_the_floor < 1.0 else []
    )
    assert [each.spread for each in found.raised] == pytest.approx([floor * times_the_floor] if times_the_floor < 1.0 else [])


def test_a_group_has_the_least_floor_of_its_channels():
    group = [Channel("velocity", bone="Hips", group="g"), Channel("position", bone="Hips", group="g")]
    still = np.ones((9, 6), np.float32)
    found = Normalisation.of([still], FeatureSchema("test", 30.0, tuple(group)))
    assert found.scale == pytest.approx(np.full(6, 0.01))
    assert found.raised[0].channels == ("Hips velocity", "Hips position")
    free = (*group, Channel("custom", function="reach", group="g"))
    assert Normalisation.of([np.ones((9, 7), np.float32)], FeatureSchema("test", 30.0, free)).raised == ()


def test_clips_that_go_straight_leave_a_cost_of_which_a_turn_is_a_part():
    channels = [
        {"type": "position", "bone": "LeftFoot"},
        {"type": "trajectory", "what": "direction", "at": [0.33, 0.67, 1.0]},
    ]
    schema = FeatureSchema.from_dict("test", {"rate": 30.0, "channels": channels})
    clips = [make_clip(name).clip for name in ("walk", "walk_fast", "jog")]
    database = MotionDatabase.build(clips, schema)
    assert [each.channels for each in database.normalisation.raised] == [("trajectory direction at 0.33 0.67 1 s",)]
    query = query_from(schema, clips[0], 40)
    query[3:] = [1.0, 0.0] * 3  # to the left at once; each of the six features of 9 is 1 away from straight ahead
    assert database.search(query).cost == pytest.approx(6 / 9 / 0.2**2, rel=0.1)  # by the spread of 0.05 it would be 250


def test_a_normalisation_can_be_undone():
    schema = FeatureSchema("test", 30.0, CHANNELS)
    blocks = blocks_of(schema)
    found = Normalisation.of(blocks, schema)
    assert np.allclose(found.undo(found.apply(blocks[1])), blocks[1], atol=1e-9)


def test_without_frames_nothing_is_changed():
    schema = FeatureSchema("test", 30.0, CHANNELS)
    for blocks in ([], [np.zeros((0, schema.n_features), np.float32)]):
        found = Normalisation.of(blocks, schema)
        assert not found.offset.any()
        assert (found.scale == 1.0).all()
