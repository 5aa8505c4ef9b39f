"""Characters in C are those of Python to the bit: what they decide, how they stand, where they are, and what they pack."""

from __future__ import annotations

import dataclasses
import math
import os
import random
import shutil
import struct
from functools import cache
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from c_compilers import PROGRAMS, all_compilers, compiled, ran, sanitizers, variants
from made_once import make_clip
from strategies import IS_FULL
from test_output_ground import slope, stairs

import contextdb as cdb
from contextdb import motion
from contextdb.commands.compile_command import c_motion_header
from contextdb.commands.motion_build_command import file_of
from contextdb.compiled.c_header import c_header_of
from contextdb.motion.characters.facts import Moment
from contextdb.motion.made.game import JOINT_RECIPES, JOINT_ROLES, make_joint_clip
from contextdb.motion.markup.markup import Markup
from contextdb.motion.markup.tag_filter import covers
from contextdb.motion.output.bank import moving_alike
from contextdb.motion.selection.chooser import N_DECISION
from contextdb.motion.storage.bundle import Played, bundle_of

pytestmark = pytest.mark.skipif(os.name == "nt" or not all_compilers(), reason="no gcc or clang was found")
MOCAP = Path(os.environ.get("CONTEXTDB_MOCAP", Path(__file__).parents[2].parent / "shared" / "data" / "mocap"))
N_DAMAGED = int(os.environ.get("DAMAGED", 4_000 if IS_FULL else 100))
N_SESSIONS = int(os.environ.get("SESSIONS", 12 if IS_FULL else 3))
NAMES = ("idle", "walk", "walk_turn_left_90", "jog", "start_walk", "stop_walk")
CAPTURED = (
    "walk_normal", "walk_tired", "walk-turn-left_normal", "run_normal", "walk-turn-right_normal", "run_tired", "walk-back_normal",
    "walk-left_normal", "dash_normal",
)  # fmt: skip
EVENTS = ("Contact.Left", "Contact.Right", "Hit")
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
IN_NODE = """
import { readFileSync } from 'node:fs'
import { WASI } from 'node:wasi'
const [module, ...args] = process.argv.slice(2)
const wasi = new WASI({ version: 'preview1', args: ['character', ...args], preopens: { '/': '/' }, returnOnExit: true })
const { instance } = await WebAssembly.instantiate(readFileSync(module), { wasi_snapshot_preview1: wasi.wasiImport })
process.exitCode = wasi.start(instance)
"""
MARKS = Markup.parse(
    "asset,tag,from,to,value\nidle,Looping,,,\nwalk,Looping,,,\njog,Looping,,,\nstop_walk,NextNaturalOnly,0,0.5,\n"
    "stop_walk,MatchRange,0,2.2,\nstop_walk,WarpPosition,0.5,1.7,\nstop_walk,WarpRotation,0.9,4,\njog,Excluded,1.5,1.6,\n"
    "walk,Contact.Left,0.2,0.5,\nwalk,Contact.Right,0.7,0.9,\njog,Contact.Left,0.1,0.3,\nwalk_turn_left_90,Contact.Right,0.3,0.6,\n"
    "walk,Excluded,0.55,0.6,\nidle,Hit.Soft,1.0,1.2,\nstart_walk,Hit,0.5,0.6,\nwalk_turn_left_90,Hit,0.2,0.3,\n"
)
CAPTURED_MARKS = Markup.parse(
    "asset,tag,from,to,value\nwalk_normal,Contact.Left,0.5,0.8,\nwalk_normal,Contact.Right,1.0,1.3,\nrun_normal,Contact.Left,0.3,0.4,\n"
    "walk_tired,Hit,0.8,0.9,\nwalk-turn-left_normal,Hit.Soft,0.6,0.7,\nwalk-turn-left_normal,Contact.Right,0.2,0.5,\n"
    "walk-back_normal,NextNaturalOnly,0,0.5,\nrun_tired,Excluded,0.5,0.6,\n"
)
CAPTURED_GAITS = [{"run": "Run", "dash": "Run"}.get(name.split("_")[0], "Idle Walk") for name in CAPTURED]
CAPTURED_COLUMNS = {"Asset Name": list(CAPTURED), "gait": CAPTURED_GAITS, "direction": ["Any"] * len(CAPTURED)}
CONDITIONS = {
    "gait": {"type": "enum", "values": ["Idle", "Walk", "Run"]},
    "direction": {"type": "angle", "hysteresis": 100.0, "mirror": "negate"},
}
OF_PLAYED = {
    "LeftFoot.Down": {"type": "bool", "mirror": {"Left": "Right"}},
    "RightFoot.Down": {"type": "bool", "mirror": {"Left": "Right"}},
    "RightFoot.UntilDown_s": {"type": "number", "unit": "s"},
    "Playing.Speed": {"type": "number", "unit": "m/s", "hysteresis": 0.4},
    "Playing.Turn": {"type": "number", "mirror": "negate"},
    "Playing.Phase": {"type": "number", "hysteresis": 0.15},
    "Playing.Tag.hit": {"type": "bool"},
}
COLUMNS = {
    "Asset Name": list(NAMES),
    "gait": ["Idle", "Walk", "Walk", "Run", "Walk", "Idle Walk"],
    "direction": ["Any", "-40..40", "20..180", "-40..40", "Any", "Any"],
    "LeftFoot.Down": ["Any", "Any", "False ~0.4", "True ~0.3", "Any", "Any"],
    "RightFoot.Down": ["Any", "Any", "Any", "False ~0.2", "Any", "Any"],
    "RightFoot.UntilDown_s": ["Any", "<0.2 ~0.5", "Any", "Any", ">=0.1 ~0.2", "Any"],
    "Playing.Speed": ["Any", "1..9 ~0.3/2", "Any", "<2.5 ~0.1/1", "Any", "Any"],
    "Playing.Turn": ["-5..5 ~0.2/20", "Any", "Any", "Any", "Any", "-20..20 ~0.1/9"],
    "Playing.Phase": ["Any", "<0.6", ">0.3 ~0.3/2", "<0.6", "<0.8", "Any"],
    "Playing.Tag.hit": ["Any", "Any", "Any", "Any", "Any", "False"],
    "play_rate": ["", "0.9..1.2", "", "", "1.1", "1.3..1.5"],
    "start_s": ["", "", "0.4", "", "", ""],
    "blend_s": ["", "", "", "0.2", "", "0.1"],
    "root": ["", "", "", "", "animation", "animation"],
}
OUTPUTS = ["play_rate", "start_s", "blend_s", "root"]
ROLES = {"Host": ("mood", ("glad", "cross")), "Guest": ("side", (-1.0, 0.5, 2.0)), "Judge": ("awake", (False, True))}
MEETING_CONDITIONS = {
    "rain": {"type": "bool"},
    "Host.mood": {"type": "enum", "values": ["glad", "cross"]},
    "Guest.side": {"type": "number", "mirror": "negate"},
    "Judge.awake": {"type": "bool"},
}
MEETING_COLUMNS = {
    "Asset Name": ["greet_walk", "greet_tired", "greet_walk", "greet_run", "greet_run", "greet_tired"],
    "rain": ["Any", "No ~0.25", "Any", "Any", "Yes", "Any"],
    "Host.mood": ["glad", "Any", "cross ~0.5", "glad ~0.25", "Any", "cross"],
    "Guest.side": ["Any", "<1", "<0", ">0 ~0.125", "Any", "Any"],
    "Judge.awake": ["Any", "Yes ~0.375", "Any", "Any", "Yes", "Any"],
}


@cache
def table(is_captured=False):
    return (
        cdb.Table.from_columns(CAPTURED_COLUMNS, CONDITIONS)
        if is_captured
        else cdb.Table.from_columns(COLUMNS, {**CONDITIONS, **OF_PLAYED}, {"outputs": OUTPUTS})
    ).compile()


@cache
def meeting_table():
    return cdb.Table.from_columns(MEETING_COLUMNS, MEETING_CONDITIONS).compile()


@cache
def joint_parts(ways):
    """Two joint databases of the made greetings, with the features of a controller, and their banks."""
    schema = parts(ways, False)[0]
    clips = {name: list(make_joint_clip(name).values()) for name in JOINT_RECIPES}
    takes = {"tired": clips["greet_tired"], "greetings": [clip for each in clips.values() for clip in each]}
    marks = Markup.parse(
        "asset,tag,from,to,value\ngreet_walk.*,WarpPosition,1.0,4.5,\ngreet_run.Host,WarpRotation,0.5,4.2,\n"
        "greet_walk.Host,MatchRange,0,3,\ngreet_run.Guest,Hit.Soft,2,3,\ngreet_run.Host,Excluded,4.3,4.35,\ngreet_walk.*,Hit,1,2,\n"
    )
    databases = {name: motion.MotionDatabase.build(own, schema, mirror=True, markup=marks) for name, own in takes.items()}
    banks = {name: motion.PoseBank.build(own, schema, mirror=True, markup=marks) for name, own in takes.items()}
    return {name: motion.JointDatabase.of(each, JOINT_ROLES) for name, each in databases.items()}, banks


def captured(name):
    path = next(MOCAP.glob(f"bandai_namco/*_{name}_001.bvh"))
    return dataclasses.replace(motion.load_bvh(path, metres_per_unit=0.01), name=name)


@cache
def parts(ways, is_captured):
    left, right, mirrored = ("Foot_L", "Foot_R", "*_L *_R") if is_captured else ("LeftFoot", "RightFoot", "Left* Right*")
    feet = [{"type": "position", "bone": bone} for bone in (left, right)]
    channels = [*feet, {"type": "velocity", "bone": "Hips"}, *WAYS[ways]]
    schema = motion.FeatureSchema.from_dict("loco", {"rate": 30.0, "channels": channels, "mirror": [mirrored.split()]})
    marks = CAPTURED_MARKS if is_captured else MARKS
    clips = [*map(captured, CAPTURED)] if is_captured else [make_clip(name).clip for name in NAMES]
    takes = {"turns": clips[2:3], "all": clips}
    databases = {name: motion.MotionDatabase.build(own, schema, mirror=True, markup=marks) for name, own in takes.items()}
    banks = {name: motion.PoseBank.build(own, schema, mirror=True, markup=marks) for name, own in takes.items()}
    if is_captured:
        return schema, databases, banks
    return schema, databases, {**banks, "all": with_one_more_position(banks["all"])}


def with_one_more_position(bank):
    """A bank of the same poses in which another joint has positions of its own too, as of a take that moved its hips."""
    assert bank.moving.tolist() == [0]
    offsets = np.tile(bank.skeleton.offsets[1].astype(np.float32), (bank.n_frames, 1, 1))
    return dataclasses.replace(bank, moving=np.array([0, 1]), positions=np.concatenate((bank.positions, offsets), axis=1))


@cache
def header():
    return c_motion_header(c_header_of({}, "CDB_MOTION_READER_H"))


@pytest.fixture(scope="module")
def programs(tmp_path_factory):
    """The program, as each compiler makes it with little optimisation, with much, and under sanitizers."""
    folder, first = tmp_path_factory.mktemp("character"), all_compilers()[0]
    (folder / "contextdb_motion.h").write_text(header(), encoding="ascii")
    commands = variants(("-O0",), ("-O3",) if IS_FULL else ("-O0", "-DCDBM_NARROW")) + [
        (*first, *own, "-DCDBM_CASTS_AT_ONCE=2") for own in [sanitizers(*first)] if own
    ]
    options = ["-std=c99", "-ffp-contract=off", "-Wall", "-Wextra", "-Wconversion", "-Wno-unused-function"]
    made = [
        compiled([*command, *options], PROGRAMS / "character.c", folder / f"character{number}", folder, "-lm")
        for number, command in enumerate(commands)
    ]
    zig = next((command for command in all_compilers() if command[-1] == "cc"), None)
    if IS_FULL and zig and (node := shutil.which("node")):
        options = [*options, "-O2", "-target", "wasm32-wasi"]
        module = compiled([*zig, *options], PROGRAMS / "character.c", folder / "character.wasm", folder)
        (folder / "wasm.mjs").write_text(IN_NODE, encoding="ascii")
        (folder / "wasm").write_text(f'#!/bin/sh\nexec "{node}" --no-warnings "{folder}/wasm.mjs" "{module}" "$@"\n')
        (folder / "wasm").chmod(0o755)
        made.append(folder / "wasm")
    return made


def drawn(rng, is_captured):
    """A controller, what it plays, and how its characters' poses are made; all at random."""
    ways, root = rng.choice(list(WAYS)), rng.choice(["mixed", "animation", "code", "path"])
    schema, databases, banks = parts(ways, is_captured)
    entries = [motion.Entry("turns", databases["turns"], rng.choice([0.2, 0.6])), motion.Entry("all", databases["all"])]
    settings = motion.ControllerSettings(
        search_every_s=rng.choice([0.0, 0.1, 0.3]), history_s=rng.choice([0.0, 0.5]), until_natural=rng.random() < 0.3,
        grace_s=rng.choice([0.0, 0.3]), asset_history_s=rng.choice([0.0, 1.5]),
        variation=rng.choice([None, motion.Variation(0.3, 0), motion.Variation(1.0, 2)]),
    )  # fmt: skip
    output = motion.PoseSettings(root=root, foot_lock=rng.random() < 0.7, path_alignment=rng.random() < 0.5)
    return motion.Controller(motion.Selector(entries), settings), schema, banks, output


def options_for(rng, database):
    """What a match node is given beside its target, at random: what Python takes, and what C is given for it."""
    options, ways, costs, penalty = {}, [0, 0, 0], [rng.choice([0.0, 0.5, 3.0]) for _ in EVENTS], (-1, 0.0)
    known = [any(covers(tag, each) for each in database.marks.tags) for tag in EVENTS]
    if rng.random() < 0.5:
        ways = [rng.choice([0, 0, 1, 2, 3, 4, 5]) if is_known else 0 for is_known in known]
        of = [[tag for tag, own in zip(EVENTS, ways, strict=True) if own == way] for way in range(6)]
        soft = [{tag: costs[EVENTS.index(tag)] for tag in each} for each in of[4:]]
        options["tags"] = motion.TagFilter(*of[1:4], *soft)
    if rng.random() < 0.3:
        penalty = rng.randrange(len(database.assets)), rng.choice([0.25, 4.0, math.inf])
        options["penalties"] = {database.assets[penalty[0]]: penalty[1]}
    has_frames = not any(ways) and rng.random() < 0.2
    if has_frames:
        options["tags"] = np.arange(database.n_frames) % 3 != 0
    return options, (*ways, *costs, *penalty, has_frames)


def entered(rng, one, stick, gait, nodes):
    """A one-off that a match node gives a character, None where nothing may play, and what C is given for it."""
    name = rng.choice(list(nodes))
    node, turn = nodes[name], rng.choice([None, rng.uniform(-4.0, 4.0)])
    target = motion.Target(rng.uniform(-2.0, 2.0), rng.uniform(-1.0, 4.0), turn)
    moment = Moment(0.0, stick, None, one.body, one.playing, one._played())
    facts = {"gait": gait} | {fact: of(moment) for fact, of in one.asked_facts.items()}
    options, numbers = options_for(rng, node.database)
    stitched = (rng.randrange(node.database.n_frames), rng.choice([1.0, 8.0, 60.0])) if rng.random() < 0.4 else (-1, 0.0)
    valid = one.tables.query(facts)
    if stitched[0] < 0:
        play = node.enter(one.features(), target, valid, **options)
    else:
        play = node.stitch(one.features(), node.database.raw(stitched[0]), stitched[1], valid, **options)
    weights = node.position_weight, node.rotation_weight
    aimed = list(nodes).index(name), target.left_m, target.ahead_m, math.nan if turn is None else turn, *weights
    return None if play is None else motion.OneOff(one, play, name), (*aimed, *numbers, *stitched)


def offers_for(rng, actors):
    """Who is offered for which role of the table of meetings, with a fact each, at random."""
    return {
        role: [{"id": i, fact: rng.choice(values)} for i in actors if rng.random() < 0.8] for role, (fact, values) in ROLES.items()
    }


def number_of(value):
    return float(MEETING_CONDITIONS["Host.mood"]["values"].index(value) if isinstance(value, str) else value)


def meeting(rng, members, searchers):
    """A joint choice of some characters, by their number, and what C is given for it."""
    name, rain, table = rng.choice(list(searchers)), rng.random() < 0.5, meeting_table()
    searcher, options, way = searchers[name], {}, rng.choice([0, 1, 2, 2, 2, 3])
    numbers = [list(searchers).index(name), len(members), *members, way, *([rain] if way in (1, 2) else [])]
    if way == 1:
        facts = {f"{role}.{fact}": rng.choice(values) for role, (fact, values) in ROLES.items()}
        options["valid"] = table.query({"rain": rain, **facts})
        numbers += map(number_of, facts.values())
    elif way == 2:
        offers = offers_for(rng, range(len(members)))
        options["valid"] = table.query({"rain": rain}, actors=offers)
        each = [(list(ROLES).index(role), one["id"], one[ROLES[role][0]]) for role, own in offers.items() for one in own]
        numbers += [len(each), *(number_of(number) for one in each for number in one)]
    elif way == 3:
        rows = rng.sample(range(6), 3)
        assets = {MEETING_COLUMNS["Asset Name"][row] for row in rows}
        options["valid"] = {each: np.array([a in assets for a in own.assets]) for each, own in searcher.databases.items()}
        numbers.append(sum(1 << row for row in rows))
    gives = rng.choice([None, (1.0, 1.0), (0.0, 1.0), (0.5, 3.0)])
    if gives is not None:
        options["gives"] = dict(zip(JOINT_ROLES, gives, strict=True))
    every = list(permutations(range(len(members)), 2))
    casts = rng.sample(every, rng.randint(0, len(every))) if rng.random() < 0.3 else None
    if casts is not None:
        options["casts"] = [dict(zip(JOINT_ROLES, cast, strict=True)) for cast in casts]
    options["in_match_range"] = rng.random() < 0.3
    ways, costs = [0, 0, rng.choice([0, 0, 0, 1, 3, 4, 5])], [0.0, 0.0, 0.5]
    if ways[2]:
        options["tags"] = motion.TagFilter(
            **{[0, "include", "every", "exclude", "prefer", "avoid"][ways[2]]: "Hit" if ways[2] < 4 else {"Hit": 0.5}}
        )
    listed = [actor for cast in casts or () for actor in cast]
    numbers += [gives is not None, *(gives or (1.0, 1.0)), casts is not None, len(casts or ()), *listed]
    return name, options, [*numbers, options["in_match_range"], *ways, *costs]


def met(rng, members, free, searchers):
    """A joint choice of those who are free: a one-off for each who plays it, what C is given, and what it is to write."""
    name, options, numbers = meeting(rng, free, searchers)
    is_played = rng.random() < 0.3
    queries = {i: members[at].features() for i, at in enumerate(free)}
    roots = {i: members[at].root for i, at in enumerate(free)}
    places = {i: (root.left_m, root.ahead_m, root.turn_rad) for i, root in roots.items()}
    hit = searchers[name].search(queries, places, **options)
    row = -1 if hit.row is None else hit.row
    cast = [hit.cast[role] for role in JOINT_ROLES] if hit else [-1, -1]
    plays = motion.JointNode(searchers[name]).play(hit, places).plays if hit and is_played else {}
    once = {free[hit.cast[role]]: motion.OneOff(members[free[hit.cast[role]]], play, hit.database) for role, play in plays.items()}
    given = struct.pack(f"q{len(numbers) + 1}d", len(numbers) + 1, is_played, *numbers)
    return once, given, struct.pack("6d", hit.range, hit.frame, row, hit.cost, *cast)


def seeded(controller, seed):
    return motion.Controller(controller.selector, controller.settings, rng=seed)


def session(rng, n_ticks, is_captured=False):
    """A bundle, what characters are given in it, and what Python makes of that."""
    controller, schema, banks, output = drawn(rng, is_captured)
    searchers, tables = {}, {"moves": file_of("moves", table(is_captured))}
    if not is_captured:
        joint, joint_banks = joint_parts(next(ways for ways in WAYS if parts(ways, False)[0] is schema))
        banks, tables["meetings"] = {**banks, **joint_banks}, file_of("meetings", meeting_table())
        searchers["contest"] = motion.JointSearcher(joint, {"tired": rng.choice([0.3, 1.0, 3.0])})
        searchers["greetings"] = motion.JointSearcher({"greetings": joint["greetings"]})
    databases, weights = controller.selector.databases, rng.choice([(1.0, 1.0), (20.0, 0.0), (0.0, 5.0)])
    nodes = {name: motion.MatchNode(databases[name], position_weight=weights[0], rotation_weight=weights[1]) for name in databases}
    played = Played(controller, schema, banks, output, {name: node.ends for name, node in nodes.items()})
    banks = moving_alike(banks)
    table_of = {"turns": "moves", "all": "moves", "tired": "meetings", "greetings": "meetings"}
    n = rng.randint(1, 4)
    seeds = [rng.randrange(1 << rng.choice([1, 53])) for _ in range(n)]
    bundle = bundle_of({"player": played}, table_of, tables, searchers)
    ground = rng.choice([None, slope, stairs])
    members = [
        motion.Character(seeded(controller, seed), schema, table(is_captured), motion.PoseStream(banks, output), ground=ground)
        for seed in seeds
    ]
    crowd, given, expected = motion.Crowd(members), [struct.pack("qq", n, n_ticks), struct.pack(f"{n}q", *seeds)], []
    sticks, facings, events, once = [(0.0, 0.0)] * n, [math.nan] * n, [None] * n, [None] * n
    for tick in range(n_ticks):
        dt = rng.choice([1 / 30, 1 / 30, 1 / 60, 1 / 144]) if tick else 0.0
        for i in range(n):
            if rng.random() < 0.06:
                speed, way = rng.choice([0.0, 1.2, 2.6]), rng.uniform(-math.pi, math.pi)
                sticks[i] = (speed * math.sin(way), speed * math.cos(way))
            name, left_s = events[i] or (rng.choice(EVENTS), rng.choice([0.2, 0.5, 1.0]))
            is_going_on = events[i] is not None and left_s > 0.0
            events[i] = (name, max(left_s - dt, 0.0)) if is_going_on or rng.random() < 0.04 else None
        gaits = ["Idle" if not math.hypot(*stick) else "Walk" if math.hypot(*stick) < 2.0 else "Run" for stick in sticks]
        meetings, chosen, free = [], b"", [i for i in range(n) if once[i] is None]
        if searchers and len(free) > 1 and rng.random() < 0.3:
            joined, numbers, chosen = met(rng, members, free, searchers)
            meetings.append(numbers)
            once = [joined.get(i, one) for i, one in enumerate(once)]
        entering = [i for i in range(n) if once[i] is None and rng.random() < 0.08]
        entries = [(i, *entered(rng, members[i], sticks[i], gaits[i], nodes)) for i in entering]
        for i, one, _ in entries:
            once[i] = one
        events = [None if one else event for one, event in zip(once, events, strict=True)]
        if any(once):
            options = [{} if event is None else {"event": event} for event in events]
            players = [one or each for one, each in zip(once, members, strict=True)]
            each = zip(players, sticks, gaits, options, strict=True)
            updates = [one.update(dt, stick, {"gait": gait}, **own) for one, stick, gait, own in each]
        else:
            updates = crowd.update(dt, sticks, {"gait": gaits}, event=events)
        once = [None if one is None or one.is_done else one for one in once]
        given.append(struct.pack("dqqq", dt, [None, slope, stairs].index(ground), len(entries), len(meetings)))
        for stick, facing, event, updated in zip(sticks, facings, events, updates, strict=True):
            number = CONDITIONS["gait"]["values"].index(updated.facts["gait"])
            event_number, in_s = (-1, 0.0) if event is None else (EVENTS.index(event[0]), event[1])
            given.append(struct.pack("3dqqd", *stick, facing, number, event_number, in_s))
        given += meetings + [struct.pack("18d", i, *numbers) for i, _, numbers in entries]
        states = chosen + b"".join(one.state for one in crowd)
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


@pytest.mark.parametrize("seed", range(N_SESSIONS))
def test_characters_in_c_are_those_of_python_to_the_bit(seed, programs, tmp_path: Path):
    is_captured = seed % 2 == 1 and (MOCAP / "assets.csv").is_file()
    bundle, given, expected = session(random.Random(seed), 2700 if IS_FULL else 150, is_captured)
    (tmp_path / "bundle").write_bytes(bundle)
    (tmp_path / "in").write_bytes(given)
    for program in programs:
        ran(program, tmp_path / "bundle", tmp_path / "in", tmp_path / "out")
        same((tmp_path / "out").read_bytes(), expected)


def test_a_damaged_bundle_is_refused_or_plays_and_never_reads_outside(programs, tmp_path: Path):
    bundle, *_ = session(random.Random(2), 1)  # with variation
    (tmp_path / "bundle").write_bytes(bundle)
    assert all(0 < int(ran(program, tmp_path / "bundle", str(N_DAMAGED))) < N_DAMAGED for program in programs)


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


def test_a_character_of_a_crowd_in_c_plays_a_one_off_to_a_place(programs, tmp_path: Path):
    controller, schema, banks, output = drawn(random.Random(1), False)
    node = motion.MatchNode(controller.selector.databases["all"])
    bundle = bundle_of({"player": Played(controller, schema, banks, output, {"all": node.ends})}, {}, {})
    (tmp_path / "bundle").write_bytes(bundle)
    (tmp_path / "contextdb_motion.h").write_text(header(), encoding="ascii")
    command = [*all_compilers()[0], "-std=c99", "-ffp-contract=off", *sanitizers(*all_compilers()[0])]
    program = compiled(command, PROGRAMS / "enter.c", tmp_path / "enter", tmp_path, "-lm")
    cost, *assets, apart = ran(program, tmp_path / "bundle").splitlines()
    assert float(cost) > 0.0
    assert len(set(assets)) == 1
    assert len(assets) > 5
    assert math.hypot(*map(float, apart.split())) < 1e-6
