"""How good the motion is, stage by stage, beside the raw clips and beside plain motion matching.

    python benchmarks/motion_quality.py                       all captured clips of one rig, and the made ones: some minutes
    python benchmarks/motion_quality.py --set made --seconds 20
    python benchmarks/motion_quality.py --half 1              a random half of the captured ones
    python benchmarks/motion_quality.py --probes              the last stage probe by probe too; --json FILE for programs

A body follows a stick as `Steered` does, in six probes of a minute: straight on, turns of 90 and of 180 degrees, changes of speed,
a circle and a figure eight. The controller is asked with its path; its decisions become poses with more and more stages. The last
one is a `Character`, whose path begins where the animation is shown, not where the body is. All assets are valid, settings are the
defaults. A stage whose settings this version does not have is left out.

The captured clips are not part of this project: the environment variable CONTEXTDB_MOCAP names their folder.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

from benchmarks import captured, timing
from benchmarks.plain_matching import PlainMatching
from benchmarks.sections import print_aligned
from contextdb import motion
from contextdb.motion import ControllerSettings, FeatureSchema, Markup, Measures, MotionDatabase, PoseBank, PoseSettings
from contextdb.motion.clips.steering import steered_path
from contextdb.motion.made.recipes import ABOUT_TURNS, RECIPES, make_clip
from contextdb.motion.search.filters import Biases
from contextdb.motion.storage.database_settings import DatabaseSettings

RATE = 30.0
WALK_MPS, RUN_MPS, CIRCLE_M = 1.3, 2.6, 2.0
RIG = "bandai_namco/*.bvh"
LOOPS = "idle*,Looping,,,\nwalk*,Looping,,,\njog*,Looping,,,\nrun*,Looping,,,\nstrafe*,Looping,,,\n"

Stick = Callable[[float], tuple[float, float]]


# ---- what is asked of the character


def _turns(every_s: float, degrees: float) -> Stick:
    return lambda t: _ahead(WALK_MPS, math.radians(degrees) * (t // every_s))


def _ahead(speed: float, angle: float) -> tuple[float, float]:
    return speed * math.sin(angle), speed * math.cos(angle)


def _eight(t: float) -> tuple[float, float]:
    turn = WALK_MPS / CIRCLE_M
    lap_s = math.tau / turn
    return _ahead(WALK_MPS, turn * (t % lap_s) * (1.0 if t // lap_s % 2 == 0 else -1.0))


PROBES: dict[str, Stick] = {
    "straight": lambda t: _ahead(WALK_MPS, 0.0),
    "turns of 90": _turns(5.0, 90.0),
    "turns of 180": _turns(6.0, 180.0),
    "speeds": lambda t: _ahead((WALK_MPS, RUN_MPS, 0.0)[int(t // 5.0) % 3], 0.0),
    "circle": lambda t: _ahead(WALK_MPS, WALK_MPS / CIRCLE_M * t),
    "figure eight": _eight,
}


# ---- what plays


@dataclass(frozen=True, eq=False)
class Clips:
    """A set of clips: a database and a pose bank of them."""

    name: str
    schema: FeatureSchema
    database: MotionDatabase
    bank: PoseBank

    @classmethod
    def of(cls, name: str, clips: Sequence[motion.Clip], feet: tuple[str, str], pairs: list[list[str]], markup: str) -> Clips:
        """With the features of feet, hips and the way ahead, mirrored too."""
        points = {"type": "trajectory", "at": [0.33, 0.67, 1.0]}
        channels: list[dict[str, Any]] = [
            *({"type": "position", "bone": foot, "weight": 0.75} for foot in feet),
            *({"type": "velocity", "bone": bone} for bone in (*feet, "Hips")),
            points | {"what": "position"},
            points | {"what": "direction", "weight": 1.5},
        ]
        schema = FeatureSchema.from_dict("loco", {"rate": RATE, "channels": channels, "mirror": pairs})
        marks = Markup.parse(f"asset,tag,from,to,value\n{markup}")
        said: dict[str, Any] = {field.name: field.default for field in fields(DatabaseSettings)}
        biases = Biases(said["base_bias"], said["looping_bias"], said["continuing_bias"])
        database = MotionDatabase.build(clips, schema, mirror=True, markup=marks, biases=biases, end_s=said["end_s"])
        return cls(name, schema, database, PoseBank.build(clips, schema, mirror=True, markup=marks))


def sets(wanted: Sequence[str], half: int | None = None) -> Iterator[Clips]:
    """The sets of clips, as far as they are there."""
    if "captured" in wanted:
        paths = sorted(captured.FOLDER.glob(RIG))
        paths = paths if half is None else sorted(random.Random(half).sample(paths, len(paths) // 2))
        clips = [motion.load_bvh(path) for path in paths]
        if clips:
            yield Clips.of("captured clips", clips, ("Foot_L", "Foot_R"), [["*_L", "*_R"]], "")
        else:
            print("no captured clips: set CONTEXTDB_MOCAP\n")
    if "made" in wanted:
        made = [make_clip(name).clip for name in (*RECIPES, *ABOUT_TURNS)]
        yield Clips.of("made clips", made, ("LeftFoot", "RightFoot"), [["Left*", "Right*"]], LOOPS)


# ---- stages


@dataclass(frozen=True)
class Stage:
    """A stage: who chooses, and how its choice is shown."""

    name: str
    is_plain: bool
    has_rate: bool
    settings: PoseSettings
    is_closed: bool = False
    """Whether it is a `Character`: the path that is asked for begins where the animation is shown, not where the game's body is."""


def stages() -> list[Stage]:
    """From a cut to everything that this version has."""
    known = {field.name for field in fields(PoseSettings)}
    off: dict[str, Any] = {"foot_lock": False}
    aligned: dict[str, Any] = {}
    for name, without in (("path_alignment", False), ("min_stride", 1.0), ("max_stride", 1.0)):
        if name in known:
            off[name], aligned[name] = without, getattr(PoseSettings(), name)
    settings = PoseSettings(blend="none", **off), PoseSettings(**off)
    found = [
        Stage("plain, cut", True, False, settings[0]),
        Stage("plain, inertialized", True, False, settings[1]),
        Stage("cut", False, False, settings[0]),
        Stage("inertialized", False, False, settings[1]),
    ]
    has_rate = any(field.name == "min_play_rate" for field in fields(ControllerSettings))
    if aligned or has_rate:
        found.append(Stage("+ alignment and rate", False, has_rate, PoseSettings(**{**off, **aligned})))
    everything = PoseSettings()
    return [
        *found,
        Stage("+ foot lock", False, has_rate, everything),
        Stage("+ closed loop", False, has_rate, everything, is_closed=True),
    ]


def controller_of(clips: Clips, has_rate: bool) -> Any:
    """A controller of the default settings."""
    rates = dict.fromkeys(("min_play_rate", "max_play_rate"), 1.0)
    known = {field.name for field in fields(ControllerSettings)}
    said: dict[str, Any] = {} if has_rate else {name: rate for name, rate in rates.items() if name in known}
    return motion.Controller(motion.Selector([motion.Entry("loco", clips.database)]), ControllerSettings(**said))


@dataclass(frozen=True, eq=False)
class Run:
    """What was decided along a probe, the poses where they were made on the way, and the stick."""

    trace: motion.Trace
    poses: list[motion.Pose] | None
    wanted: list[tuple[float, float]]


def run(clips: Clips, stick: Stick, seconds: float, chooser: Any) -> Run:
    """Let a chooser follow a stick."""
    chooser.recorder = trace = motion.Trace(0)
    body = motion.Steered()
    past, wanted = [body], []
    pose = clips.database.normalisation.undo(np.zeros(clips.schema.n_features))
    for tick in range(round(seconds * RATE) + 1):
        asked = stick(tick / RATE)
        wanted.append(asked)
        dt_s = 1.0 / RATE if tick else 0.0
        if tick:
            body = body.moved(dt_s, asked)
            past = [*past, body][-31:]
        ahead = chooser.upcoming(dt_s)
        pose = pose if ahead is None else clips.database.raw(ahead.frame)
        query = motion.with_path(clips.schema, pose, steered_path(past, asked))
        chooser.update(dt_s, query, body=body)
    return Run(trace, None, wanted)


def run_character(clips: Clips, stick: Stick, seconds: float, controller: Any, settings: PoseSettings) -> Run:
    """Let a character follow a stick."""
    character = motion.Character(controller, clips.schema, None, motion.PoseStream(clips.bank, settings))
    trace, wanted = character.record(0), [stick(tick / RATE) for tick in range(round(seconds * RATE) + 1)]
    poses = [character.update(1.0 / RATE if tick else 0.0, asked).pose for tick, asked in enumerate(wanted)]
    return Run(trace, [pose for pose in poses if pose is not None], wanted)


# ---- the tables

COLUMNS = (
    ("jumps/s", "jumps_per_s", 2),
    ("forced", "forced_jumps", 0),
    ("jump cm", "jump_cm", 1),
    ("skate cm/s", "skate_cm_s", 1),
    ("toe down", "skate_toe_cm_s", 1),
    ("worst s", "skate_toe_worst_cm_s", 1),
    ("MANN", "skate_weighted_cm_s", 1),
    ("dip cm", "hip_dip_cm", 1),
    ("below cm", "penetration_cm", 1),
    ("knees %", "knee_limit_share", -1),
    ("off feet cm", "hips_off_feet_cm", 1),
    ("lean deg", "lean_deg", 1),
    ("acc p99", "accel_p99", 1),
    ("snaps %", "snap_share", -1),
    ("path m", "path_rms_m", 3),
    ("deg", "heading_rms_deg", 1),
    ("reach s", "reach_s", 2),
    ("missed", "n_missed", 0),
    ("stay s", "stay_s", 2),
    ("used %", "frames_used_share", -1),
    ("forced cost", "forced_cost", 2),
)
RAW = {
    "skate_cm_s": "skate_raw_cm_s",
    "skate_toe_cm_s": "skate_toe_raw_cm_s",
    "skate_weighted_cm_s": "skate_weighted_raw_cm_s",
    "penetration_cm": "penetration_raw_cm",
    "knee_limit_share": "knee_limit_raw_share",
    "accel_p99": "accel_raw_p99",
}
TOGETHER: dict[str, Callable[..., Any]] = {
    **{"forced_jumps": sum, "n_missed": sum, "forced_cost": max},
    **dict.fromkeys(("hip_dip_cm", "penetration_cm", "hips_off_feet_cm", "lean_deg", "skate_toe_worst_cm_s"), max),
}


def row(name: str, found: Sequence[Measures]) -> tuple[str, ...]:
    """A line of the table: means over probes, sums of counts, or the dearest forced jump."""
    cells = [name]
    for _, key, decimals in COLUMNS:
        values = [value for each in found if (value := getattr(each, key)) is not None]
        value = (TOGETHER.get(key, np.mean)(values)) if values else None
        cells.append("-" if value is None else _figure(value, decimals))
    return tuple(cells)


def _figure(value: float, decimals: int) -> str:
    return f"{100.0 * value:.2f}" if decimals < 0 else f"{value:.{decimals}f}"


def raw_row(found: Measures) -> tuple[str, ...]:
    """The line of the clips as they are."""
    values = {key: getattr(found, raw) for key, raw in RAW.items()}
    shown = ["-" if values.get(key) is None else _figure(values[key], decimals) for _, key, decimals in COLUMNS]
    return ("raw clips", *shown)


def measured(clips: Clips, seconds: float) -> Iterator[tuple[Stage, dict[str, Measures]]]:
    """The measures of each stage, probe by probe. What was decided is the same for all stages that choose alike."""
    runs: dict[tuple[bool, bool, bool], dict[str, Run]] = {}
    for stage in stages():
        key = stage.is_plain, stage.has_rate, stage.is_closed
        if key not in runs:
            choosers = (PlainMatching(clips.database) if stage.is_plain else controller_of(clips, stage.has_rate) for _ in PROBES)
            runs[key] = {
                name: run_character(clips, stick, seconds, chooser, stage.settings)
                if stage.is_closed
                else run(clips, stick, seconds, chooser)
                for (name, stick), chooser in zip(PROBES.items(), choosers, strict=True)
            }
        yield (
            stage,
            {
                name: motion.measure(each.trace, clips.bank, poses=each.poses, settings=stage.settings, wanted=each.wanted)
                for name, each in runs[key].items()
            },
        )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="how good the motion is, stage by stage")
    parser.add_argument("--set", choices=("captured", "made"), action="append", help="only this set of clips")
    parser.add_argument("--half", type=int, metavar="SEED", help="of the captured clips a random half, drawn by this number")
    parser.add_argument("--seconds", type=float, default=60.0, help="of each probe (default: 60)")
    parser.add_argument("--probes", action="store_true", help="the last stage probe by probe too")
    parser.add_argument("--json", metavar="FILE", help="write all measures to a file")
    arguments = parser.parse_args()
    print(", ".join(f"{name} {value}" for name, value in timing.machine().items()))
    documents: dict[str, Any] = {}
    for clips in sets(arguments.set or ("captured", "made"), arguments.half):
        told = list(measured(clips, arguments.seconds))
        n_assets = len(set(clips.database.assets))
        print(
            f"\n{clips.name}: {n_assets} clips, {clips.database.n_frames:,} frames, mirrored ones among them; "
            f"means over {len(PROBES)} probes of {arguments.seconds:g} s; forced and missed are sums, forced cost is the most\n"
        )
        header = ("stage", *(label for label, _, _ in COLUMNS))
        rows = [row(stage.name, list(found.values())) for stage, found in told]
        print_aligned([header, raw_row(told[0][1]["straight"]), *rows])
        if arguments.probes:
            print(f"\n{told[-1][0].name}, probe by probe\n")
            print_aligned([("probe", *header[1:]), *(row(name, [each]) for name, each in told[-1][1].items())])
        documents[clips.name] = {stage.name: {name: each.to_json() for name, each in found.items()} for stage, found in told}
    if arguments.json:
        Path(arguments.json).write_text(json.dumps({"format": 1, "sets": documents}, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
