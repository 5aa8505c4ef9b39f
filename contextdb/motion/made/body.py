"""Made motion, second half: a body that follows a timeline and stands on its steps. Nothing here is captured.

The hips hang as high as both legs reach, by a soft minimum, which gives a walk its rise over each standing leg; two-bone inverse
kinematics puts each ankle where its step or swing wants it, so that a planted foot stays at one place in the world. F frames.

Metres, y up; a body at rest faces +z, its left is +x. Rotations are quaternions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from contextdb.motion.clips import quaternions as q
from contextdb.motion.clips.clip import CENTIMETRE
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import POSITIONS, Skeleton
from contextdb.motion.clips.trajectory import heading_vectors

SIDES = {"Left": 1.0, "Right": -1.0}
HIP_WIDTH_M = 0.09
HIP_DROP_M = 0.05
THIGH_M = 0.46
SHIN_M = 0.45
LEG_M = (THIGH_M + SHIN_M) * 0.998
"""How far a leg is stretched at most: a knee at its limit would jerk."""
BALL = np.array([0.0, -0.06, 0.13])
"""From the ankle to the ball of the foot."""
ANKLE_M = 0.08
HIPS_M = ANKLE_M + LEG_M + HIP_DROP_M - 0.01
"""Height of the hips when standing."""
SOFTNESS_M = 0.015
BREATH_S = 3.0
STEP_WIDTH_M = 0.08
"""From the middle of the path to a footstep."""
TIPS = {"Head": (0.0, 20.0, 0.0), "Hand": (0.0, -16.0, 0.0), "Toe": (0.0, 0.0, 8.0)}
"""From joints at the ends of their chains to the chains' tips, in centimetres."""

Vector = tuple[float, float, float]


def made_skeleton() -> Skeleton:
    """The skeleton of all made clips: 19 joints, offsets in centimetres, arms and legs straight down at rest."""
    listed = _joints()
    places = {name: joint for joint, (name, _, _) in enumerate(listed)}
    turns = ("Xrotation", "Yrotation", "Zrotation")
    return Skeleton(
        tuple(places),
        np.array([places.get(parent, -1) for _, parent, _ in listed], np.int64),
        np.array([offset for _, _, offset in listed]) / CENTIMETRE,
        ((*POSITIONS, "Yrotation", "Xrotation", "Zrotation"), *[turns] * (len(listed) - 1)),
        tuple((joint, tip) for name, joint in places.items() for end, tip in TIPS.items() if name.endswith(end)),
    )


def _joints() -> list[tuple[str, str, Vector]]:
    """Name, parent and offset in metres of each joint, a joint's descendants directly behind it."""
    joints: list[tuple[str, str, Vector]] = [
        ("Hips", "", (0.0, 0.0, 0.0)),
        ("Spine", "Hips", (0.0, 0.10, 0.0)),
        ("Chest", "Spine", (0.0, 0.18, 0.0)),
        ("Neck", "Chest", (0.0, 0.24, 0.0)),
        ("Head", "Neck", (0.0, 0.10, 0.02)),
    ]
    for side, sign in SIDES.items():
        joints.append((f"{side}Arm", "Chest", (sign * 0.19, 0.20, 0.0)))
        joints.append((f"{side}ForeArm", f"{side}Arm", (0.0, -0.29, 0.0)))
        joints.append((f"{side}Hand", f"{side}ForeArm", (0.0, -0.26, 0.0)))
    for side, sign in SIDES.items():
        joints.append((f"{side}UpLeg", "Hips", (sign * HIP_WIDTH_M, -HIP_DROP_M, 0.0)))
        joints.append((f"{side}Leg", f"{side}UpLeg", (0.0, -THIGH_M, 0.0)))
        joints.append((f"{side}Foot", f"{side}Leg", (0.0, -SHIN_M, 0.0)))
        joints.append((f"{side}Toe", f"{side}Foot", (float(BALL[0]), float(BALL[1]), float(BALL[2]))))
    return joints


@dataclass(frozen=True)
class Manner:
    """How a body carries itself at its full pace. Angles in degrees, lengths in metres; all shrink with the share of the pace.

    `push` is how fast a foot leaves and meets the ground against its mean speed in the air: 0 in a walk, more in a run.
    """

    crouch_m: float
    bob_m: float
    sway_m: float
    twist_deg: float
    lean_deg: float
    arm_deg: float
    elbow_deg: float
    lift_m: float
    heel_deg: float
    push: float
    stoop_deg: float = 0.0
    """Bend of spine and neck, at rest too."""
    breath_m: float = 0.006
    is_run: bool = False


@dataclass(frozen=True, eq=False)
class _Foot:
    """One foot in the world: ankle [F, 3], heading and pitch [F]; pitch is positive with the toe down."""

    ankle: Floats
    heading: Floats
    pitch: Floats


def made_values(way: Timeline, steps: Mapping[str, Steps], manner: Manner, turn_dps: float, speed_mps: float) -> Floats:
    """The channels of a clip on the made skeleton: [F, channels], in centimetres and degrees."""
    times = way.frame_times
    feet = {side: _foot(steps[side], times, manner) for side in SIDES}
    trunk = _trunk(way, times, manner, turn_dps, speed_mps)
    hips = _hips(way, times, manner, trunk["Hips"], feet)
    local = dict(trunk)
    for side, sign in SIDES.items():
        local.update(_leg(side, sign, hips, trunk["Hips"], feet[side]))
    return _channels(hips, local)


# ---- feet


def _foot(steps: Steps, times: Floats, manner: Manner) -> _Foot:
    """Where a foot is: planted on its step, or swinging to the next."""
    i = np.searchsorted(steps.down, times, side="right") - 1
    following = np.minimum(i + 1, len(steps.down) - 1)
    is_up = times > steps.up[i]
    span = np.where(is_up, steps.down[following] - steps.up[i], 1.0)
    u = np.where(is_up, (times - np.where(is_up, steps.up[i], 0.0)) / span, 0.0)
    moved = _hermite(u, manner.push)[:, None]
    ground = _ball_places(steps, i) * (1.0 - moved) + _ball_places(steps, following) * moved
    turned = u * u * (3.0 - 2.0 * u)
    heading = steps.headings[i] * (1.0 - turned) + steps.headings[following] * turned
    size = np.minimum(1.0, np.linalg.norm(steps.places[following] - steps.places[i], axis=-1) / 0.6 + 0.2)
    arc = np.sin(np.pi * u) ** 2
    height = ANKLE_M + BALL[1] + arc * manner.lift_m * size
    pitch = np.deg2rad(manner.heel_deg) * size * np.sin(np.pi * u) * ((1.0 - u) * 1.6 - 0.5 * u) * (u < 1.0)
    ball = np.stack((ground[:, 0], height, ground[:, 1]), axis=-1)
    return _Foot(ball - q.rotate(_foot_rotation(heading, pitch), BALL), heading, pitch)


def _hermite(u: Floats, slope: float) -> Floats:
    """From 0 to 1, with this slope at both ends."""
    return np.asarray(u * u * (3.0 - 2.0 * u) + slope * (2.0 * u**3 - 3.0 * u**2 + u))


def _ball_places(steps: Steps, i: np.ndarray) -> Floats:
    """Where on the ground the ball of the foot is at some steps."""
    return np.asarray(steps.places[i] + BALL[2] * heading_vectors(steps.headings[i]))


def _foot_rotation(heading: Floats, pitch: Floats) -> Floats:
    return q.multiply(q.about_axis("y", heading), q.about_axis("x", pitch))


# ---- trunk and arms


def _trunk(way: Timeline, times: Floats, manner: Manner, turn_dps: float, speed_mps: float) -> dict[str, Floats]:
    """The rotations of the trunk and the arms against their parents; the hips against the world."""
    cycle = 2.0 * np.pi * way.at(way.phases, times)
    effort = np.sqrt(way.at(way.shares, times))
    pushed = np.gradient(way.at(way.shares, times), 1.0 / RATE) * speed_mps
    lean = np.deg2rad(manner.lean_deg) * effort + 0.04 * pushed
    stoop = np.deg2rad(manner.stoop_deg) + 0.01 * np.sin(_breaths(way, times))
    twist = np.deg2rad(manner.twist_deg) * effort * np.sin(cycle)
    roll = -np.arctan(np.deg2rad(turn_dps) * speed_mps / 9.81) * way.at(way.shares, times) * 0.5
    zero = np.zeros_like(times)
    local = {
        "Hips": _turn(way.at(way.headings, times) + twist, lean * 0.5, roll + 0.02 * effort * np.cos(cycle)),
        "Spine": _turn(-1.2 * twist, lean * 0.5 + stoop * 0.5, roll * 0.5),
        "Chest": _turn(-1.0 * twist, stoop * 0.5, roll * 0.5),
        "Neck": _turn(0.6 * twist, stoop * 0.3 - lean * 0.4, zero),
        "Head": _turn(0.6 * twist, stoop * 0.3 - lean * 0.4, -roll),
    }
    swing = np.deg2rad(manner.arm_deg) * effort
    bend = np.deg2rad(8.0 + (manner.elbow_deg - 8.0) * effort)
    for side, sign in SIDES.items():
        ahead = sign * swing * np.sin(cycle)
        local[f"{side}Arm"] = _turn(zero, -ahead - lean - stoop * 0.8, zero + sign * np.deg2rad(6.0))
        local[f"{side}ForeArm"] = _turn(zero, -bend - 0.4 * np.maximum(ahead, 0.0), zero)
        local[f"{side}Hand"] = _turn(zero, zero, zero)
    return local


def _turn(yaw: Floats, pitch: Floats, roll: Floats) -> Floats:
    """A rotation that rolls, then pitches, then yaws."""
    return q.multiply(q.about_axis("y", yaw), q.multiply(q.about_axis("x", pitch), q.about_axis("z", roll)))


# ---- hips and legs


def _hips(way: Timeline, times: Floats, manner: Manner, rotations: Floats, feet: Mapping[str, _Foot]) -> Floats:
    """Where the hips are: over the path, swaying over the standing leg, as high as the manner wants and both legs reach.

    They rise with the breath only as far as the body stands: a walking body's breath lifts its chest, and its cycles are alike.
    """
    phases, effort = way.at(way.phases, times), np.sqrt(way.at(way.shares, times))
    cycle = 2.0 * np.pi * phases
    headings = way.at(way.headings, times)
    sway = manner.sway_m * effort * np.cos(cycle)
    ground = way.at(way.places, times) + sway[:, None] * heading_vectors(headings + np.pi / 2.0)
    bob = manner.bob_m * effort * np.cos(2.0 * cycle) * (-1.0 if manner.is_run else 1.0)
    breath = manner.breath_m * (1.0 - effort) * (np.cos(_breaths(way, times)) - 1.0)
    wanted = HIPS_M - manner.crouch_m * effort - manner.bob_m * effort + bob + breath
    limits = [wanted, *(_reach(ground, rotations, sign, feet[side].ankle) for side, sign in SIDES.items())]
    return np.stack((ground[:, 0], _soft_minimum(np.stack(limits)), ground[:, 1]), axis=-1)


def _breaths(way: Timeline, times: Floats) -> Floats:
    """The phase of breathing in radians: a whole number of breaths in a clip, so that it loops."""
    return 2.0 * np.pi * max(1, round(way.duration_s / BREATH_S)) * times / way.duration_s


def _reach(ground: Floats, rotations: Floats, sign: float, ankle: Floats) -> Floats:
    """The height of the hips at which a leg is stretched to its ankle."""
    socket = q.rotate(rotations, np.array([sign * HIP_WIDTH_M, -HIP_DROP_M, 0.0]))
    away = ground + socket[:, [0, 2]] - ankle[:, [0, 2]]
    return np.asarray(ankle[:, 1] + np.sqrt(np.maximum(LEG_M**2 - (away**2).sum(axis=-1), 0.01)) - socket[:, 1])


def _soft_minimum(heights: Floats) -> Floats:
    """A height [F] just below the least of several [n, F], without a kink where another becomes the least."""
    least = heights.min(axis=0)
    return np.asarray(least - SOFTNESS_M * np.log(np.exp(-(heights - least) / SOFTNESS_M).sum(axis=0)))


def _leg(side: str, sign: float, hips: Floats, hips_rotations: Floats, foot: _Foot) -> dict[str, Floats]:
    """The rotations of a leg's joints against their parents, so that its ankle is where the foot wants it."""
    socket = hips + q.rotate(hips_rotations, np.array([sign * HIP_WIDTH_M, -HIP_DROP_M, 0.0]))
    reach = foot.ankle - socket
    distance = np.linalg.norm(reach, axis=-1, keepdims=True)
    along = reach / distance
    ahead = heading_vectors(foot.heading)
    forward = np.stack((ahead[:, 0], np.zeros(len(ahead)), ahead[:, 1]), axis=-1)
    across = q.cross(forward, along)
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    cosine = np.clip((THIGH_M**2 + distance**2 - SHIN_M**2) / (2.0 * THIGH_M * distance), -1.0, 1.0)
    knee = THIGH_M * (cosine * along + np.sqrt(1.0 - cosine**2) * q.cross(along, across))
    thigh = _bone_rotation(across, knee / THIGH_M)
    shin = _bone_rotation(across, (reach - knee) / np.linalg.norm(reach - knee, axis=-1, keepdims=True))
    sole = _foot_rotation(foot.heading, foot.pitch)
    return {
        f"{side}UpLeg": q.multiply(q.inverse(hips_rotations), thigh),
        f"{side}Leg": q.multiply(q.inverse(thigh), shin),
        f"{side}Foot": q.multiply(q.inverse(shin), sole),
        f"{side}Toe": q.about_axis("x", -0.6 * np.maximum(foot.pitch, 0.0)),
    }


def _bone_rotation(across: Floats, along: Floats) -> Floats:
    """The rotation of a bone that points along a direction [F, 3], its x axis `across`."""
    return q.from_matrices(np.stack((across, -along, q.cross(across, -along)), axis=-1))


def _channels(hips: Floats, local: Mapping[str, Floats]) -> Floats:
    """The values of the made skeleton's channels: [F, channels]."""
    root = np.rad2deg(q.to_euler("yxz", local["Hips"]))
    root[:, 0] = np.unwrap(root[:, 0], period=360.0)
    others = [np.rad2deg(q.to_euler("xyz", local[name])) for name, _, _ in _joints()[1:]]
    return np.concatenate((hips / CENTIMETRE, root, *others), axis=1)


# ---- made motion, first half: how the body travels and where its feet stand. Nothing here is captured. A clip's timeline
# gives for every moment the distance and heading travelled and the phase: cycles since the left foot stood in mid-stride
# under the body. A foot stands for `duty` of each cycle, centred where the phase is whole (left) or half (right); its
# footstep is next to the body's place at that moment, so that a planted foot never slides however the body turns, starts or
# stops. Ground positions are (x, z) in metres and headings radians, as in `contextdb.motion.clips.trajectory`. Source:
# Forsyth, "How a Character Should Walk", Game Tech 2004: cycles begin with the left foot down, mid-stride, so that all are in
# phase; two times for each foot and cycle; speed comes from longer strides far more than from faster ones

Change = Literal["steady", "start", "stop", "turn"]

RATE = 30.0
"""Frames a second of every made clip."""
GRID = 1000.0
"""Moments a second at which a timeline is worked out."""
MARGIN_S = 2.0
"""How long a timeline continues before and after its clip, for the steps that reach beyond it."""
REST_S = 0.5
"""How long a body stands at least before it starts and after it has stopped."""
TURN_S = 1.5
"""How long a turn about takes."""
TURN_SHARE = 0.15
"""Of the full pace: how fast a body goes while it turns about."""
FIRST_LIFT = 0.04
LAST_LANDING = 0.06
"""Cycles after a start and before a stop at which the other foot leaves its place beside the standing one, and comes back to it."""


@dataclass(frozen=True)
class Pace:
    """How fast a body goes: speed in m/s, cycles a second, and the share of a cycle for which each foot is down."""

    speed_mps: float
    cycles_per_s: float
    duty: float

    @property
    def stride_m(self) -> float:
        """Metres of one cycle: two steps."""
        return self.speed_mps / self.cycles_per_s if self.cycles_per_s else 0.0


@dataclass(frozen=True, eq=False)
class Timeline:
    """A body's way, worked out at `times` [T] in seconds, of which 0 is the clip's first frame.

    `phases` [T], `places` [T, 2], `headings` [T]; `shares` [T] of the full pace, 0 at rest to 1.
    """

    duration_s: float
    times: Floats
    phases: Floats
    places: Floats
    headings: Floats
    shares: Floats

    @property
    def frame_times(self) -> Floats:
        return np.arange(round(self.duration_s * RATE) + 1) / RATE

    def at(self, values: Floats, times: Floats) -> Floats:
        """One of the timeline's arrays at some moments."""
        if values.ndim == 1:
            return np.interp(times, self.times, values)
        return np.stack([np.interp(times, self.times, column) for column in values.T], axis=-1)

    def when(self, phases: Floats) -> Floats:
        return np.interp(phases, self.phases, self.times)


@dataclass(frozen=True, eq=False)
class Steps:
    """Where and when one foot stands: down and up in seconds [n], places [n, 2], headings [n]; ascending."""

    down: Floats
    up: Floats
    places: Floats
    headings: Floats


def timeline(pace: Pace, turn_dps: float, change: Change, n_cycles: int, ramp_s: float) -> Timeline:
    """The way of a clip of some cycles at one pace, or up to it from standing, or from it to a stand, within about `ramp_s`.

    At rest (a pace of 0 cycles a second) a cycle is taken to last a second.
    """
    cycles_per_s = pace.cycles_per_s or 1.0
    steps = (np.arange(round(ramp_s * GRID)) + 0.5) / round(ramp_s * GRID)
    ramp_cycles = cycles_per_s * ramp_s * float(np.sqrt(_smooth(steps)).mean())
    full_s = (n_cycles - ramp_cycles) / cycles_per_s
    if pace.cycles_per_s == 0.0 or change == "steady":
        return _travel(pace, turn_dps, n_cycles / cycles_per_s, lambda t: np.full_like(t, float(pace.cycles_per_s > 0.0)))
    if change == "start":
        duration_s = _whole_frames(REST_S + ramp_s + full_s)
        begin = duration_s - full_s - ramp_s
        return _travel(pace, turn_dps, duration_s, lambda t: _smooth((t - begin) / ramp_s))
    return _travel(pace, turn_dps, _whole_frames(full_s + ramp_s + REST_S), lambda t: 1.0 - _smooth((t - full_s) / ramp_s))


def about_turn(pace: Pace, turned_deg: float, n_cycles: int, ramp_s: float) -> Timeline:
    """The way of a clip of some cycles that turns in its middle: slower within `ramp_s`, about with short steps, and off again.

    The steps come as fast as at the full pace all the time, so that no foot stands long while the body turns over it.
    """
    duration_s = n_cycles / pace.cycles_per_s
    middle = duration_s / 2.0

    def share(t: Floats) -> Floats:
        away = (np.abs(t - middle) - TURN_S / 4.0) / ramp_s
        return np.asarray(TURN_SHARE + (1.0 - TURN_SHARE) * _smooth(away))

    slow = _travel(pace, 0.0, duration_s, share)
    headings = np.deg2rad(turned_deg) * _smooth((slow.times - middle) / TURN_S + 0.5)
    velocities = (pace.speed_mps * slow.shares)[:, None] * heading_vectors(headings)
    places = np.stack([_integral(column) for column in velocities.T], axis=-1)
    return Timeline(duration_s, slow.times, pace.cycles_per_s * slow.times, places, headings, slow.shares)


def steps_of(way: Timeline, pace: Pace, side: float) -> Steps:
    """Where and when a foot stands; `side` is its distance to the left of the body, so that the right foot's is negative."""
    half = pace.duty / 2.0
    is_left = side > 0.0
    first, last = way.phases[0] + 1e-3, way.phases[-1] - 1e-3
    middles = np.arange(np.floor(first), np.ceil(last) + 1.0) + (0.0 if is_left else 0.5)
    middles = middles[(middles > first) & (middles < last)]
    down, up, middle = way.when(middles - half), way.when(middles + half), way.when(middles)
    if way.shares[0] == 0.0:
        lift = way.when(way.phases[:1] + (half if is_left else FIRST_LIFT))
        down, up, middle = np.insert(down, 0, -np.inf), np.insert(up, 0, lift), np.insert(middle, 0, 0.0)
    if way.shares[-1] == 0.0 and way.shares.any():
        landing = way.when(way.phases[-1:] - (half if is_left else LAST_LANDING))
        down, up, middle = np.append(down, landing), np.append(up, np.inf), np.append(middle, way.duration_s)
    if not way.shares.any():
        up[:] = np.inf
    headings = way.at(way.headings, middle)
    places = way.at(way.places, middle) + side * heading_vectors(headings + np.pi / 2.0)
    return Steps(down, up, places, headings)


def _travel(pace: Pace, turn_dps: float, duration_s: float, share: Callable[[Floats], Floats]) -> Timeline:
    """Travel at a share of the pace that depends on the time; at half speed the steps come 0.7 times as fast and are 0.7 times as
    long."""
    times = np.arange(-round(MARGIN_S * GRID), round((duration_s + MARGIN_S) * GRID) + 1) / GRID
    shares = share(times)
    headings = _integral(np.deg2rad(turn_dps) * shares)
    velocities = (pace.speed_mps * shares)[:, None] * heading_vectors(headings)
    places = np.stack([_integral(column) for column in velocities.T], axis=-1)
    return Timeline(duration_s, times, _integral(pace.cycles_per_s * np.sqrt(shares)), places, headings, shares)


def _integral(rates: Floats) -> Floats:
    """What has come together at each moment of the grid, 0 at time 0."""
    total = np.concatenate(([0.0], np.cumsum((rates[1:] + rates[:-1]) / (2.0 * GRID))))
    return np.asarray(total - total[round(MARGIN_S * GRID)])


def _smooth(shares: Floats) -> Floats:
    """From 0 to 1 without a jolt at either end; 0 before and 1 behind."""
    inside = np.clip(shares, 0.0, 1.0)
    return np.asarray(inside * inside * (3.0 - 2.0 * inside))


def _whole_frames(duration_s: float) -> float:
    return float(np.ceil(duration_s * RATE - 1e-9)) / RATE
