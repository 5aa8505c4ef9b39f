"""The core's functions of numbers are right to the last places, and its poses the same bits whatever compiled them."""

import math
import os
import platform
import struct
from decimal import Decimal, localcontext
from pathlib import Path

import numpy as np
import pytest
from c_compilers import PROGRAMS, all_compilers, compiled, ran, sanitizers, variants
from played import bank, decisions
from test_output_ground import slope
from test_same_bits import has_avx2

from contextdb.motion import PoseSettings, PoseStream
from contextdb.motion.output import pipeline as pipelines

CORE = Path(pipelines.__file__).parents[2] / "core"
WIDE = [("-O3", "-mavx2")] if platform.machine() in ("x86_64", "AMD64") and has_avx2() else []
pytestmark = pytest.mark.skipif(os.name == "nt" or not all_compilers(), reason="no gcc or clang was found")


def results(folder, mode, given):
    """What each compiler gives, with little optimisation, much, and under sanitizers."""
    (folder / "in").write_bytes(given)
    first = all_compilers()[0]
    for command in variants(("-O0",), ("-O3",), *WIDE) + [(*first, *own) for own in [sanitizers(*first)] if own]:
        program = compiled([*command, "-std=c99", "-ffp-contract=off"], PROGRAMS / "poses.c", folder / "poses", CORE, "-lm")
        ran(program, mode, folder / "in", folder / "out")
        yield (folder / "out").read_bytes()


# ---- functions


def atan(x):
    """By halving the angle until it is small, and the series."""
    if abs(x) > Decimal("0.1"):
        return 2 * atan(x / (1 + (1 + x * x).sqrt()))
    term, total, k = x, x, 1
    while abs(term) > Decimal(10) ** -50:
        term, k = -term * x * x, k + 2
        total += term / k
    return total


def sine(x, k=0):
    """By the series of the sine, k = 1 that of the cosine."""
    x = x % (8 * atan(Decimal(1)))
    term = total = x if k == 0 else Decimal(1)
    n = 1 if k == 0 else 0
    while abs(term) > Decimal(10) ** -50:
        term, n = -term * x * x / ((n + 1) * (n + 2)), n + 2
        total += term
    return total


def atan2(y, x):
    pi = 4 * atan(Decimal(1))
    if x == 0:
        return pi / 2 if y > 0 else -pi / 2 if y < 0 else Decimal(0)
    return atan(y / x) + (0 if x > 0 else pi if y >= 0 else -pi)


def exact(x, y):
    """The seven functions of a pair, with 60 digits; the remainder against math's, the logarithm 0 where there is none."""
    with localcontext() as context:
        context.prec = 60
        a, b, c = Decimal(x), Decimal(y), Decimal(min(max(y, -1.0), 1.0))
        log = b.ln() if y > 1e-300 else Decimal(0)
        return sine(a), sine(a, 1), atan2(b, a), atan2((1 - c * c).sqrt(), c), b.exp(), Decimal(math.remainder(x, math.tau)), log


def pairs():
    rng = np.random.default_rng(5)
    edges = [0.0, 1e-300, 1e-9, 0.4375, 0.6875, 1.1875, 2.4375, math.pi / 4, math.pi / 2, math.pi, 3.0, 1e5, 1.0, 0.999999999]
    drawn = [rng.uniform(-1.0, 1.0, 300), rng.uniform(-7.0, 7.0, 300), rng.uniform(-700.0, 700.0, 100), rng.uniform(-1e6, 1e6, 100)]
    first = np.concatenate([edges, np.negative(edges), *drawn])
    return np.column_stack((first, np.clip(rng.permutation(first), -740.0, 700.0)))


def test_functions_are_right_to_the_last_places(tmp_path):
    given = pairs()
    made = np.frombuffer(next(results(tmp_path, "functions", struct.pack("q", len(given)) + given.tobytes()))).reshape(-1, 7)
    worst = np.zeros(7)
    for numbers, (x, y) in zip(made.tolist(), given.tolist(), strict=True):
        for k, (number, true) in enumerate(zip(numbers, exact(x, y), strict=True)):
            size = max(abs(float(true)), 1.0 if k < 2 and abs(x) > 4.0 else 0.0)  # far angles: against 1
            worst[k] = max(worst[k], abs(float(Decimal(number) - true)) / math.ulp(size))
    assert (worst <= [0.8, 0.8, 1.1, 2.6, 0.9, 0.0, 0.8]).all(), worst


def test_functions_are_the_same_bits_by_all_compilers(tmp_path):
    given = pairs()
    assert len(set(results(tmp_path, "functions", struct.pack("q", len(given)) + given.tobytes()))) == 1


def test_what_is_no_finite_number_stays_none(tmp_path):
    odd = np.array([[math.nan, math.nan], [math.inf, math.inf], [-math.inf, -math.inf], [1e300, -1e300], [-1e300, 800.0]])
    made = np.frombuffer(next(results(tmp_path, "functions", struct.pack("q", len(odd)) + odd.tobytes()))).reshape(-1, 7)
    assert np.isnan(made[:3, [0, 1, 5]]).all()
    assert np.isfinite(made[3:, [0, 1, 2, 3, 5]]).all()
    assert made[1:, 4].tolist() == [math.inf, 0.0, 0.0, math.inf]


# ---- poses


def padded(array):
    raw = np.ascontiguousarray(array).tobytes()
    return raw + bytes(-len(raw) % 8)


def test_poses_are_the_same_bits_by_all_compilers_and_in_python(tmp_path):
    settings, step = PoseSettings(), 1.0 / 30.0
    segments = [("walk", 0.1, 20), ("run", 0.3, 9), ("idle", 0.2, 12, True), ("start_walk", 0.5, 30), ("walk_turn_left_90", 0.2, 9)]
    stream, ticks, expected = PoseStream(bank(), settings), [], []
    for decision in decisions(segments, step):
        dt, place = step if decision.tick else 0.0, (0.01 * decision.tick, 0.05 * decision.tick, 0.02 * decision.tick)
        rows, at = stream._place
        own, row = stream._pipeline, rows.row(at)
        made = own.update(row, [decision], own.plays_of(row, [decision], (slope,)), dt, np.array([place]), (slope,))[1]
        given, seams = made.given, made.seams if made.given[0, 11] >= 0.0 else np.zeros((0, 4))
        ticks.append(struct.pack("dq", dt, len(seams)) + padded(given) + padded(np.array(place)) + padded(seams))
        pose = stream.update(decision, dt, place, slope)
        arrays = stream.state.row, np.array(pose.root), pose.rotations, pose.translations, pose.positions
        expected.append(b"".join(padded(each) for each in arrays))
    numbers = pipelines.numbers_of(settings)
    given = struct.pack("q", len(numbers)) + b"".join(struct.pack("32sd", key.encode(), value) for key, value in numbers.items())
    given += rig_and_frames() + struct.pack("q", len(ticks)) + b"".join(ticks)
    for made in results(tmp_path, "play", given):
        assert made == b"".join(expected)


def rig_and_frames():
    own, rig, spine = bank(), bank().skeleton, pipelines.spine_of(bank())
    legs, tops = pipelines.legs_of(rig, own.feet), np.array(pipelines.tops_of(rig))
    parents, offsets, places = own.joints
    bones = parents, offsets, places, legs, pipelines.hinges_of(rig, legs, own.rotations), tops, spine.joints, spine.left
    sizes = rig.n_joints, len(own.moving), len(own.feet), len(tops), len(spine.joints)
    ways, n_steps = np.asarray(own._ways, np.float64), own.stops - own.starts - 1
    frames = own.rotations, own.positions, own.root, ways, own.contacts, own._steps, own.starts, n_steps, own.looping
    return b"".join(
        (
            struct.pack("5q", *sizes),
            *(padded(each) for each in bones),
            struct.pack("d", pipelines.ADDED_SHARE * own.most_accel),
            struct.pack("2q", own.n_frames, len(own.assets)),
            *(padded(each) for each in frames),
            struct.pack("d", own.rate),
        )
    )
