"""Strips of poses as SVG: what a character shows of a movement, made of our own made clips, seen from its right.

Each pose stands in a field of its own, with its second below it. The marks on the floor are half metres of the world: a foot that
stays where it came down stays on its mark. The same program always gives the same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from html import escape

from drawing import FONTS, Sheet

from contextdb import motion
from contextdb.motion.made.recipes import ABOUT_TURNS, RECIPES, make_clip

N_POSES, RATE, BEFORE_S = 12, 30.0, 2.0
FIELD_PX, FLOOR_PX, HEIGHT_PX, METRE_PX = 92, 190, 226, 88.0
YAW, PITCH = math.radians(25.0), math.radians(8.0)
COLOURS = {"Left": "#80c7d4", "Right": "#f0938a", "": "#cfd3dc"}

Stick = Callable[[float], tuple[float, float]]
Ground = Callable[[float, float], tuple[float, tuple[float, float, float]] | None]


@dataclass(frozen=True)
class Strip:
    """What a strip shows: a sentence for those who cannot see it, the stick (metres a second) at each second, from where it changes
    at 0, the seconds of its first and last pose, and the ground."""

    title: str
    stick: Stick
    from_s: float
    to_s: float
    ground: Ground | None = None


def _step_up(x: float, z: float) -> tuple[float, tuple[float, float, float]]:
    return (0.2 if z >= 3.3 else 0.0), (0.0, 1.0, 0.0)


STRIPS = {
    "strip-turn.svg": Strip(
        "Twelve poses of a turn of 180 degrees: the walker brakes on one foot, turns over it and walks back",
        lambda t: (0.0, 1.3 if t < 0.0 else -1.3),
        0.0,
        1.6,
    ),
    "strip-stop.svg": Strip(
        "Twelve poses of a stop from a run: shorter steps, then both feet below the hips",
        lambda t: (0.0, 2.6 if t < 0.0 else 0.0),
        0.0,
        1.6,
    ),
    "strip-start.svg": Strip(
        "Twelve poses of a start: from a stand into a walk, one foot after the other",
        lambda t: (0.0, 0.0 if t < 0.0 else 1.3),
        0.0,
        1.3,
    ),
    "strip-step.svg": Strip(
        "Twelve poses of a step up by 20 centimetres: the foot is lifted over the edge and stands on the step before the hips rise",
        lambda t: (0.0, 1.3),
        0.1,
        1.5,
        _step_up,
    ),
}


@cache
def _clips() -> tuple[motion.FeatureSchema, motion.MotionDatabase, motion.PoseBank]:
    points = {"type": "trajectory", "at": [0.33, 0.67, 1.0]}
    channels = [
        *({"type": "position", "bone": bone, "weight": 0.75} for bone in ("LeftFoot", "RightFoot")),
        *({"type": "velocity", "bone": bone} for bone in ("LeftFoot", "RightFoot", "Hips")),
        points | {"what": "position"},
        points | {"what": "direction", "weight": 1.5},
    ]
    schema = motion.FeatureSchema.from_dict("loco", {"rate": RATE, "channels": channels, "mirror": [["Left*", "Right*"]]})
    clips = [make_clip(name).clip for name in (*RECIPES, *ABOUT_TURNS) if "tired" not in name]
    loops = "".join(f"{gait}*,Looping,,,\n" for gait in ("idle", "walk", "jog", "run"))
    marks = motion.Markup.parse(f"asset,tag,from,to,value\n{loops}")
    return (
        schema,
        motion.MotionDatabase.build(clips, schema, mirror=True, markup=marks),
        motion.PoseBank.build(clips, schema, mirror=True, markup=marks),
    )


def poses_of(strip: Strip) -> list[motion.Pose]:
    """The poses of a character of the default settings, evenly apart in time."""
    schema, database, bank = _clips()
    controller = motion.Controller(motion.Selector([motion.Entry("loco", database)]))
    character = motion.Character(controller, schema, None, motion.PoseStream(bank))
    character.ground = strip.ground
    ticks = round((BEFORE_S + strip.to_s) * RATE) + 1
    poses = [character.update(1.0 / RATE if i else 0.0, strip.stick(i / RATE - BEFORE_S)).pose for i in range(ticks)]
    every_s = (strip.to_s - strip.from_s) / (N_POSES - 1)
    shown = [poses[round((BEFORE_S + strip.from_s + i * every_s) * RATE)] for i in range(N_POSES)]
    return [pose for pose in shown if pose is not None]


def draw_strip(strip: Strip, sheet: Sheet) -> str:
    """The strip as SVG."""
    width = N_POSES * FIELD_PX + 2 * sheet.margin_px
    every_s = (strip.to_s - strip.from_s) / (N_POSES - 1)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {HEIGHT_PX}" '
        f'width="{width}" height="{HEIGHT_PX}" role="img">',
        f"<title>{escape(strip.title)}</title>",
        f"<style>text{{font:12px {FONTS};fill:#868d9b;text-anchor:middle}}"
        "path{fill:none;stroke-linecap:round;stroke-linejoin:round}</style>",
        f'<rect width="{width}" height="{HEIGHT_PX}" rx="8" fill="{sheet.ground}"/>',
    ]
    for i, pose in enumerate(poses_of(strip)):
        parts.append(f'<g transform="translate({sheet.margin_px + i * FIELD_PX + FIELD_PX // 2} {FLOOR_PX})">')
        parts += [*_floor(pose, strip.ground), *_bones(pose), f'<text y="26">{strip.from_s + i * every_s:.2f} s</text>', "</g>"]
    return "\n".join([*parts, "</svg>", ""])


def _point(pose: motion.Pose, x: float, y: float, z: float) -> str:
    """Where a place of the world is in the field of a pose, whose root is its middle."""
    x, z = x - pose.root[0], z - pose.root[1]
    along, away = math.cos(YAW) * z + math.sin(YAW) * x, math.cos(YAW) * x - math.sin(YAW) * z
    up = math.cos(PITCH) * y + math.sin(PITCH) * away
    return f"{METRE_PX * along:.1f} {-METRE_PX * up:.1f}"


def _floor(pose: motion.Pose, ground: Ground | None) -> Iterator[str]:
    """The floor along the way, with a mark at each half metre of the world."""
    middle = pose.root[1]
    places = [middle - 0.5 + 0.02 * i for i in range(51)]
    heights = [0.0 if ground is None else (ground(0.0, z) or (0.0,))[0] for z in places]
    line = " ".join(_point(pose, 0.0, height, z) for height, z in zip(heights, places, strict=True))
    yield f'<path d="M{line}" stroke="#4a505d" stroke-width="1.5"/>'
    for mark in range(math.ceil(2.0 * places[0]), math.floor(2.0 * places[-1]) + 1):
        height = 0.0 if ground is None else (ground(0.0, 0.5 * mark) or (0.0,))[0]
        ends = (_point(pose, side, height, 0.5 * mark) for side in (-0.3, 0.3))
        yield f'<path d="M{" ".join(ends)}" stroke="#4a505d" stroke-width="1.5"/>'


def _bones(pose: motion.Pose) -> Iterator[str]:
    """The bones, those of the left behind those of the middle behind those of the right; and a dot on what stands."""
    rig = _clips()[2].skeleton
    for side, colour in COLOURS.items():
        bones = [
            f"M{_point(pose, *pose.positions[parent])} {_point(pose, *pose.positions[joint])}"
            for joint, parent in enumerate(rig.parents.tolist())
            if parent >= 0 and side == next((each for each in ("Left", "Right") if rig.names[joint].startswith(each)), "")
        ]
        yield f'<path d="{"".join(bones)}" stroke="{colour}" stroke-width="3.5"/>'
    for side, is_down in zip(("Left", "Right"), pose.contacts.tolist(), strict=True):
        if is_down:
            x, y = _point(pose, *pose.positions[rig.index(f"{side}Toe")]).split()
            yield f'<circle cx="{x}" cy="{y}" r="4" fill="{COLOURS[side]}"/>'
