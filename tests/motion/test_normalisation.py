"""Normalisation: one scale for each group, and features that do not vary."""

from __future__ import annotations

import numpy as np
import pytest

from contextdb.motion import FeatureSchema, Normalisation, features_of, make_clip
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


def test_features_that_do_not_vary_keep_their_own_unit():
    schema = FeatureSchema("test", 30.0, (Channel("phase"), Channel("trajectory", what="speed", at=(0.0,))))
    still = np.tile(np.array([[0.0, 0.0, 0.0, 0.0, 1.5]], np.float32), (9, 1))
    found = Normalisation.of([still], schema)
    assert found.scale.tolist() == [1.0] * 5
    assert found.apply(still[0] + 1.0).tolist() == [1.0] * 5


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
