"""Characters in C are those of Python to the bit: what they decide, how they stand, where they are, and what they pack."""

from __future__ import annotations

import math
import os
import random
import struct
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from c_compilers import PROGRAMS, all_compilers, compiled, ran, sanitizers, variants
from made_once import make_clip
from strategies import IS_FULL
from test_output_ground import slope

import contextdb as cdb
from contextdb import motion
from contextdb.commands.motion_bundle import file_of
from contextdb.compiled.c_header import c_header_of
from contextdb.motion.markup.markup import Markup
from contextdb.motion.selection.chooser import N_DECISION
from contextdb.motion.storage.bundle import Played, bundle_of
from contextdb.motion.storage.c_header import c_motion_header

pytestmark = pytest.mark.skipif(os.name == "nt" or not all_compilers(), reason="no gcc or clang was found")
NAMES = ("idle", "walk", "walk_turn_left_90", "jog", "start_walk", "stop_walk")
POSE = [{"type": "position", "bone": "LeftFoot"}, {"type": "position", "bone": "RightFoot"}, {"type": "velocity", "bone": "Hips"}]
AHEAD = [
    {"type": "trajectory", "what": "position", "at": [0.33, 0.67, 1.0]},
    {"type": "trajectory", "what": "direction", "at": [0.33, 0.67, 1.0]},
]
WAYS = {
    "ahead": AHEAD,
    "past": [*AHEAD, {"type": "trajectory", "what": "position", "at": [-0.4, 0.4]}],
    "metres": [
        {"type": "trajectory", "what": "speed", "at": [0.5]},
        {"type": "trajectory", "what": "direction", "along": [-0.5, 1.0]},
    ],
}
MARKS = Markup.parse(
    "asset,tag,from,to,value\nidle,Looping,,,\nwalk,Looping,,,\njog,Looping,,,\nstop_walk,NextNaturalOnly,0,0.5,\n"
)
CONDITIONS = {"gait": {"type": "enum", "values": ["Idle", "Walk", "Run"]}, "direction": {"type": "angle"}}
COLUMNS = {
    "Asset Name": list(NAMES),
    "gait": ["Idle", "Walk", "Walk", "Run", "Walk", "Idle Walk"],
    "direction": ["Any", "-70..70", "20..180", "Any", "Any", "Any"],
}


@cache
def table():
    return cdb.Table.from_columns(COLUMNS, CONDITIONS).compile()


@cache
def parts(ways):
    schema = motion.FeatureSchema.from_dict(
        "loco", {"rate": 30.0, "channels": [*POSE, *WAYS[ways]], "mirror": [["Left*", "Right*"]]}
    )
    clips = [make_clip(name).clip for name in NAMES]
    databases = {
        "turns": motion.MotionDatabase.build(clips[2:3], schema, mirror=True, markup=MARKS),
        "all": motion.MotionDatabase.build(clips, schema, mirror=True, markup=MARKS),
    }
    banks = {
        name: motion.PoseBank.build(own, schema, mirror=True, markup=MARKS) for name, own in (("turns", clips[2:3]), ("all", clips))
    }
    return schema, databases, banks


@cache
def header():
    return c_motion_header(c_header_of({}, "CDB_MOTION_READER_H"))


@pytest.fixture(scope="module")
def programs(tmp_path_factory):
    """The program, as each compiler makes it with little optimisation, with much, and under sanitizers."""
    folder, first = tmp_path_factory.mktemp("character"), all_compilers()[0]
    (folder / "contextdb_motion.h").write_text(header(), encoding="ascii")
    commands = variants(("-O0",), ("-O3",) if IS_FULL else ("-O0", "-DCDBM_NARROW")) + [
        (*first, *own) for own in [sanitizers(*first)] if own
    ]
    options = ["-std=c99", "-ffp-contract=off", "-Wall", "-Wextra", "-Wconversion", "-Wno-unused-function"]
    return [
        compiled([*command, *options], PROGRAMS / "character.c", folder / f"character{number}", folder, "-lm")
        for number, command in enumerate(commands)
    ]


def drawn(rng):
    """A controller, what it plays, and how its characters' poses are made; all at random."""
    ways, root = rng.choice(list(WAYS)), rng.choice(["mixed", "animation", "code", "path"])
    schema, databases, banks = parts(ways)
    entries = [motion.Entry("turns", databases["turns"], rng.choice([0.2, 0.6])), motion.Entry("all", databases["all"])]
    settings = motion.ControllerSettings(
        search_every_s=rng.choice([0.0, 0.1, 0.3]), history_s=rng.choice([0.0, 0.5]), until_natural=rng.random() < 0.3,
        grace_s=rng.choice([0.0, 0.3]),
    )  # fmt: skip
    output = motion.PoseSettings(root=root, foot_lock=rng.random() < 0.7, path_alignment=rng.random() < 0.5)
    return motion.Controller(motion.Selector(entries), settings), schema, banks, output


def session(rng, n_ticks):
    """A bundle, what characters are given in it, and what Python makes of that."""
    controller, schema, banks, output = drawn(rng)
    played = Played(controller, schema, banks, output)
    bundle = bundle_of({"player": played}, {"turns": "moves", "all": "moves"}, {"moves": file_of("moves", table())})
    n, ground = rng.randint(1, 4), rng.choice([None, slope])
    members = [
        motion.Character(controller.copy(), schema, table(), motion.PoseStream(banks, output), ground=ground) for _ in range(n)
    ]
    crowd, given, expected = motion.Crowd(members), [struct.pack("qq", n, n_ticks)], []
    sticks, facings = [(0.0, 0.0)] * n, [math.nan] * n
    for tick in range(n_ticks):
        dt = rng.choice([1 / 30, 1 / 30, 1 / 60, 1 / 144]) if tick else 0.0
        for i in range(n):
            if rng.random() < 0.06:
                speed, way = rng.choice([0.0, 1.2, 2.6]), rng.uniform(-math.pi, math.pi)
                sticks[i] = (speed * math.sin(way), speed * math.cos(way))
        gaits = ["Idle" if not math.hypot(*stick) else "Walk" if math.hypot(*stick) < 2.0 else "Run" for stick in sticks]
        updates = crowd.update(dt, sticks, {"gait": gaits})
        given.append(struct.pack("dqq", dt, ground is not None, 0))
        for stick, facing, updated in zip(sticks, facings, updates, strict=True):
            number = CONDITIONS["gait"]["values"].index(updated.facts["gait"])
            given.append(struct.pack("3dq", *stick, facing, number))
        states = b"".join(one.state for one in crowd)
        poses = [updated.pose for updated in updates]
        numbers = [(np.array(pose.root), pose.rotations, pose.translations, pose.positions) for pose in poses]
        packets = b"".join(bytes([len(packet)]) + packet for packet in (one.pack() for one in crowd))
        expected.append((states, [b"".join(np.ascontiguousarray(each).tobytes() for each in own) for own in numbers], packets))
    return bundle, b"".join(given), expected


def same(out, expected):
    """Compare what C wrote with what Python did, update by update."""
    at = 0
    for tick, (states, poses, packets) in enumerate(expected):
        own = out[at : at + len(states)]
        assert own == states, f"tick {tick}: {np.flatnonzero(np.frombuffer(own) != np.frombuffer(states))[:20]}"
        at += len(states)
        for pose in poses:
            at += N_DECISION * 8  # the decision, of which all that counts is in the states
            assert out[at : at + len(pose)] == pose, f"tick {tick}"
            at += len(pose)
        assert out[at : at + len(packets)] == packets, f"tick {tick}"
        at += len(packets)
    assert at == len(out)


@pytest.mark.parametrize("seed", range(30 if IS_FULL else 3))
def test_characters_in_c_are_those_of_python_to_the_bit(seed, programs, tmp_path: Path):
    bundle, given, expected = session(random.Random(seed), 1800 if IS_FULL else 150)
    (tmp_path / "bundle").write_bytes(bundle)
    (tmp_path / "in").write_bytes(given)
    for program in programs:
        ran(program, tmp_path / "bundle", tmp_path / "in", tmp_path / "out")
        same((tmp_path / "out").read_bytes(), expected)


def test_a_damaged_bundle_is_refused_or_plays_and_never_reads_outside(programs, tmp_path: Path):
    bundle, *_ = session(random.Random(1), 1)
    (tmp_path / "bundle").write_bytes(bundle)
    n = 20_000 if IS_FULL else 100
    assert all(0 < int(ran(program, tmp_path / "bundle", str(n))) < n for program in programs)


@pytest.mark.parametrize(
    ("at", "octets", "why"),
    [
        (0, b"RIFF", "it is no bundle of motion"),
        (7, b"9", "the bundle is of another version: build it again"),
        (8, b"\0" * 8, "the bundle is not as long as it says"),
        (24, b"\xff" * 8, "the bundle is too short for its parts"),
        (64 + 8, b"\xff" * 8, "a part does not lie within the bundle"),
    ],
)
def test_a_bundle_is_refused_with_the_reason(programs, tmp_path: Path, at, octets, why):
    bundle = bytearray(session(random.Random(1), 1)[0])
    bundle[at : at + len(octets)] = octets
    (tmp_path / "bundle").write_bytes(bundle)
    assert ran(programs[0], tmp_path / "bundle", tmp_path / "in", tmp_path / "out").strip() == why
