"""The core's poses are those of an oracle that works one character out, one update after the other."""

import math
import random
from copy import copy
from dataclasses import replace

import numpy as np
import pose_oracle
import pytest
from played import NAMES, RATE, bank, decisions, range_of
from strategies import IS_FULL
from test_output_streams import NOTHING, stairs

from contextdb.motion import PoseSettings, PoseStream


def slope(x, z):
    return 0.2 * z, (0.0, 1.0, -0.2)


def steep(x, z):
    return 0.5 * math.sin(3.0 * x) + 0.4 * z, (0.9, 0.3, -0.4)


def settings_of(rng):
    return PoseSettings(
        root=rng.choice(["animation", "code", "mixed", "path"]),
        blend=rng.choice(["spring", "spring", "none"]),
        halflife_s=rng.choice([0.1, 0.03, 0.4]),
        position_weight=rng.choice([1.0, 0.4]),
        rotation_weight=rng.choice([1.0, 0.5]),
        position_pull_s=rng.choice([0.1, 0.0, 1.0]),
        position_clamp_m=rng.choice([0.1, 1.0]),
        rotation_clamp_deg=rng.choice([90.0, 20.0]),
        path_alignment=rng.random() < 0.7,
        min_stride=rng.choice([0.8, 1.0]),
        max_stride=rng.choice([1.0, 1.25]),
        foot_lock=rng.random() < 0.7,
        foot_radius_m=rng.choice([0.45, 0.1]),
    )


def play_of(rng, step):
    """Decisions with gaps and other rates, some of clips that are near their end, and where the body is."""
    names = [rng.choice(NAMES) for _ in range(5)]
    ends = [bank().last_s(range_of(name)) - rng.uniform(0.0, 9.0 * step) for name in names]
    segments = [
        (name, rng.choice([rng.uniform(0.0, 1.2), end]), rng.randint(2, 14), rng.random() < 0.4)
        for name, end in zip(names, ends, strict=True)
    ]
    ticks = list(decisions(segments, step))
    cut = rng.randint(1, len(ticks) - 1)
    ticks = [*ticks[:cut], *[NOTHING] * rng.randint(0, 1), *ticks[cut + rng.randint(0, 5) :]]
    weight, speed, turn = rng.choice([1.0, 0.3]), rng.choice([0.0, 1.0, 2.0, 3.0]) * rng.random(), rng.uniform(-3.0, 3.0)
    rate = rng.uniform(-0.01, 0.02)
    for i, decision in enumerate(ticks):
        place = (speed * math.sin(turn) * i * step, speed * i * step, turn * i * step)
        yield replace(decision, root_weight=weight, play_rate=1.0 + rate * i), place


@pytest.mark.parametrize("seed", range(200 if IS_FULL else 10))
def test_poses_are_those_of_the_oracle(seed):
    rng = random.Random(seed)
    step, settings, banks = rng.choice([1.0 / RATE, 1.0 / 60.0, 0.1]), settings_of(rng), {"loco": bank(), "other": copy(bank())}
    stream, state = PoseStream(banks, settings), pose_oracle.State.of(bank())
    ground, leaves_at = rng.choice([None, stairs, slope, steep]), rng.randint(0, 60)
    for i, (decision, place) in enumerate(play_of(rng, step)):
        dt, below = step if i else 0.0, None if i >= leaves_at else ground
        rows, at = stream._place
        own, row = stream._pipeline, rows.row(at)
        grounds = None if below is None else (below,)
        made = own.update(row, [decision], own.plays_of(row, [decision], grounds), dt, np.array([place]), grounds)[1]
        expected, state = pose_oracle.posed(list(banks.values()), settings, state, made.given[0], made.seams, dt, place, below)
        pose = stream.update(decision, dt, place, below)
        displayed = pose.rotations, pose.translations, pose.positions, pose.root, pose.contacts
        for one, other in zip(displayed, expected, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-6)
