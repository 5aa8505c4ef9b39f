"""Made clips: walks, runs, turns, starts, stops and idling, computed by formulas. Made, not captured: nobody moved for them.

They stand for real clips in samples, tests and the demo. All cycles begin with the left foot down, mid-stride, so that all are in
phase; feet do not slide; the body itself travels. `RECIPES` lists those of the sample tables, `ABOUT_TURNS` turns on the way by 180
degrees, which no table names. `describe` measures from a clip's root motion what a table of assets says of it.

Source: Forsyth, "How a Character Should Walk", Game Tech 2004.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from os import PathLike
from pathlib import Path
from typing import Literal

import numpy as np

from contextdb.cells.arguments import require_many_of, require_path, require_text
from contextdb.errors import MotionError, no_such, plural
from contextdb.motion.clips.clip import CENTIMETRE, Clip, write_bvh
from contextdb.motion.clips.feet import Footfalls
from contextdb.motion.clips.poses import poses_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.clips.trajectory import Trajectory, root_trajectory, to_own_frame
from contextdb.motion.made.body import (
    RATE,
    SIDES,
    STEP_WIDTH_M,
    Change,
    Manner,
    Pace,
    Steps,
    about_turn,
    made_skeleton,
    made_values,
    steps_of,
    timeline,
)

Gait = Literal["Idle", "Walk", "Run"]
Style = Literal["normal", "tired"]


@dataclass(frozen=True)
class Recipe:
    """What a made clip shows: at which pace, carried how, turning how fast (degrees a second, positive to the left)."""

    name: str
    gait: Gait
    style: Style
    pace: Pace
    manner: Manner
    turn_dps: float = 0.0
    change: Change = "steady"
    n_cycles: int = 4
    turned_deg: float = 0.0
    """How far a clip of the change "turn" turns, positive to the left."""


@dataclass(frozen=True, eq=False)
class MadeClip:
    """A made clip with the recipe it came from and the times at which its feet were put down and lifted."""

    clip: Clip
    recipe: Recipe
    footfalls: Footfalls

    @property
    def name(self) -> str:
        return self.clip.name


@dataclass(frozen=True)
class Description:
    """What a table of assets says of a clip. All numbers are measured from its root motion; angles are positive to the left."""

    asset: str
    gait: Gait
    style: Style
    change: Change
    """`asset`, `gait`, `style`, `change`: `change`: "steady", "start" (from a stand), "stop" (to one) or "turn" (about, on the
    way)."""
    speed_mps: float
    start_mps: float
    end_mps: float
    """`speed_mps`, `start_mps`, `end_mps`: over the ground: mean of the whole clip, of its first and of its last 0.2 s."""
    direction_deg: float
    """Of travel, against the facing: 0 is ahead."""
    turn_dps: float
    heading_change_deg: float
    """`turn_dps`, `heading_change_deg`: how fast the facing turns on the mean, and how far in all."""
    duration_s: float


PACES = {
    "idle": Pace(0.0, 0.0, 1.0),
    "walk_slow": Pace(0.8, RATE / 34, 0.60),
    "walk": Pace(1.3, RATE / 31, 0.56),
    "walk_fast": Pace(1.8, RATE / 27, 0.52),
    "jog": Pace(2.5, RATE / 23, 0.34),
    "run": Pace(3.6, RATE / 22, 0.28),
    "sprint": Pace(5.5, RATE / 19, 0.22),
}
"""Speeds, cycles a second (a whole number of frames each) and the share of a cycle for which a foot is down."""

#                       crouch  bob   sway twist lean arm elbow  lift heel push
MANNERS = {
    "idle": Manner(0.000, 0.000, 0.000, 0.0, 0.0, 0.0, 8.0, 0.00, 0.0, 0.00),
    "walk_slow": Manner(0.005, 0.012, 0.022, 4.0, 1.0, 14.0, 15.0, 0.05, 22.0, 0.00),
    "walk": Manner(0.018, 0.015, 0.020, 5.0, 2.0, 22.0, 20.0, 0.06, 30.0, 0.00),
    "walk_fast": Manner(0.030, 0.020, 0.018, 6.0, 4.0, 30.0, 35.0, 0.07, 36.0, 0.00),
    "jog": Manner(0.050, 0.030, 0.012, 6.0, 6.0, 32.0, 85.0, 0.12, 45.0, 0.35, is_run=True),
    "run": Manner(0.060, 0.035, 0.010, 7.0, 9.0, 40.0, 95.0, 0.17, 55.0, 0.45, is_run=True),
    "sprint": Manner(0.080, 0.030, 0.008, 8.0, 13.0, 55.0, 100.0, 0.22, 65.0, 0.55, is_run=True),
}

RAMP_S = {"Idle": 0.5, "Walk": 0.8, "Run": 1.1}
"""How long a start takes to reach the pace, and a stop to leave it."""
ENDS_S = 0.2
"""How much of a clip's beginning and end its first and last speed are measured over."""


def _recipes() -> Iterable[Recipe]:
    """All made clips: the steady ones, the turning ones, starts and stops; some in both styles."""
    for pace in ("idle", "walk_slow", "walk", "walk_fast", "jog", "run", "sprint"):
        yield _recipe(pace, pace)
    for pace in ("idle", "walk_slow", "walk", "jog", "run"):
        yield _recipe(pace, pace, "tired")
    turns: tuple[tuple[str, int, Style], ...] = (("walk", 45, "normal"), ("walk", 90, "normal"), ("walk", 45, "tired"))
    turns += (("jog", 60, "normal"), ("jog", 60, "tired"))
    for pace, turn, style in turns:
        for side, sign in (("left", 1), ("right", -1)):
            yield _recipe(f"{pace}_turn_{side}_{turn}", pace, style, turn_dps=float(sign * turn))
    changes: tuple[Change, ...] = ("start", "stop")
    pairs: tuple[tuple[str, Style], ...] = (("walk", "normal"), ("walk", "tired"), ("run", "normal"))
    for change in changes:
        for pace, style in pairs:
            yield _recipe(f"{change}_{pace}", pace, style, change=change)


def _recipe(name: str, pace: str, style: Style = "normal", turn_dps: float = 0.0, change: Change = "steady") -> Recipe:
    gait: Gait = "Idle" if pace == "idle" else "Walk" if pace.startswith("walk") else "Run"
    n_cycles = {"Idle": 4, "Walk": 4, "Run": 5}[gait]
    normal = Recipe(name, gait, style, PACES[pace], MANNERS[pace], turn_dps, change, n_cycles)
    return normal if style == "normal" else _tired(normal)


def _tired(recipe: Recipe) -> Recipe:
    """The same, worn out: slower by shorter strides, feet longer on the ground, bent forward, arms hanging."""
    pace, manner = recipe.pace, recipe.manner
    if pace.cycles_per_s:
        pace = Pace(0.85 * pace.speed_mps, RATE / (round(RATE / pace.cycles_per_s) + 2), pace.duty + 0.04)
    tired = replace(manner, stoop_deg=22.0, breath_m=0.012, crouch_m=manner.crouch_m + 0.015, sway_m=1.7 * manner.sway_m)
    tired = replace(tired, arm_deg=0.5 * manner.arm_deg, lift_m=0.7 * manner.lift_m)
    return replace(recipe, name=f"{recipe.name}_tired", pace=pace, manner=tired)


def _about_turns() -> Iterable[Recipe]:
    """About, on the way, to either side: at a walk and at a jog."""
    for pace in ("walk", "jog"):
        for side, sign in (("left", 1.0), ("right", -1.0)):
            turn = _recipe(f"{pace}_about_{side}", pace, change="turn")
            yield replace(turn, n_cycles=turn.n_cycles + 1, turned_deg=sign * 180.0)


RECIPES: dict[str, Recipe] = {recipe.name: recipe for recipe in _recipes()}
ABOUT_TURNS: dict[str, Recipe] = {recipe.name: recipe for recipe in _about_turns()}


def make_clip(name: str) -> MadeClip:
    """Compute one made clip of `RECIPES` or `ABOUT_TURNS`; the same every time.

    Raises MotionError for another name, with the nearest.
    """
    known = RECIPES | ABOUT_TURNS
    if require_text(name, "name") not in known:
        accepted = f"one of {plural(len(known), 'made clip')}, the names of RECIPES and ABOUT_TURNS"
        raise MotionError(no_such("made clip", name, known, accepted))
    recipe = known[name]
    if recipe.change == "turn":
        way = about_turn(recipe.pace, recipe.turned_deg, recipe.n_cycles, RAMP_S[recipe.gait])
    else:
        way = timeline(recipe.pace, recipe.turn_dps, recipe.change, recipe.n_cycles, RAMP_S[recipe.gait])
    steps = {side: steps_of(way, recipe.pace, sign * STEP_WIDTH_M) for side, sign in SIDES.items()}
    values = made_values(way, steps, recipe.manner, recipe.turn_dps, recipe.pace.speed_mps)
    clip = Clip(name, _skeleton(), 1.0 / RATE, values, CENTIMETRE)
    down = {f"{side}Foot": _down(steps[side], clip.duration_s) for side in SIDES}
    return MadeClip(clip, recipe, Footfalls(clip.duration_s, down))


def made_clips() -> list[MadeClip]:
    """Compute all made clips, in the order of `RECIPES`."""
    return [make_clip(name) for name in RECIPES]


def write_recipes(folder: str | PathLike[str]) -> list[Path]:
    """Write all made clips into a folder that exists, each as NAME.bvh in centimetres, y up; the paths, in order.

    Raises FileError where they cannot be written.
    """
    paths = [require_path(folder, "folder") / f"{name}.bvh" for name in RECIPES]
    for path in paths:
        write_bvh(make_clip(path.stem).clip, path)
    return paths


def descriptions(clips: Sequence[MadeClip] | None = None) -> list[Description]:
    """What a table says of made clips, by default of all; raises ContextError for what are no made clips."""
    given = made_clips() if clips is None else require_many_of(clips, MadeClip, "clips", "a list of MadeClip")
    return [describe(made.clip, made.recipe) for made in given]


def describe(clip: Clip, recipe: Recipe) -> Description:
    """Measure a clip's root motion, and say it with the words of its recipe."""
    path = root_trajectory(poses_of(clip))
    n_ends = round(ENDS_S * path.rate)
    left, ahead = _mean_velocity(path, slice(None))
    turned = float(np.rad2deg(path.headings[-1] - path.headings[0]))
    speeds = [float(np.hypot(*_mean_velocity(path, part))) for part in (slice(None), slice(0, n_ends), slice(-n_ends, None))]
    whole, start, end = (round(speed, 2) + 0.0 for speed in speeds)
    return Description(
        asset=clip.name,
        gait=recipe.gait,
        style=recipe.style,
        change=recipe.change,
        speed_mps=whole,
        start_mps=start,
        end_mps=end,
        direction_deg=round(float(np.rad2deg(np.arctan2(left, ahead)))) + 0.0 if whole else 0.0,
        turn_dps=round(turned / clip.duration_s, 1) + 0.0,
        heading_change_deg=round(turned) + 0.0,
        duration_s=round(clip.duration_s, 3),
    )


def _mean_velocity(path: Trajectory, part: slice) -> Floats:
    """The mean velocity as (to the left, ahead) of the body: [2].

    Against the heading without its swing from foot to foot, a straight line through it, so that the sway cancels out.
    """
    moves = np.diff(path.positions, axis=0) * path.rate
    moments = np.arange(len(moves)) + 0.5
    headings = np.polyval(np.polyfit(np.arange(len(path.headings)), path.headings, 1), moments)
    return np.asarray(to_own_frame(moves, headings)[part].mean(axis=0))


def _down(steps: Steps, duration_s: float) -> Floats:
    """The intervals of a foot's steps within the clip: [n, 2]."""
    inside = (steps.up > 0.0) & (steps.down < duration_s)
    return np.clip(np.stack((steps.down[inside], steps.up[inside]), axis=-1), 0.0, duration_s)


@cache
def _skeleton() -> Skeleton:
    return made_skeleton()
