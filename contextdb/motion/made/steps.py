"""Made motion, first half: how the body travels and where its feet stand. Nothing here is captured.

A clip's timeline gives for every moment the distance and heading travelled and the phase: cycles since the left foot stood in
mid-stride under the body. A foot stands for `duty` of each cycle, centred where the phase is whole (left) or half (right); its
footstep is next to the body's place at that moment, so that a planted foot never slides however the body turns, starts or stops.

Ground positions are (x, z) in metres and headings radians, as in `contextdb.motion.clips.trajectory`.

Source: Forsyth, "How a Character Should Walk", Game Tech 2004: cycles begin with the left foot down, mid-stride, so that all are in
phase; two times for each foot and cycle; speed comes from longer strides far more than from faster ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.trajectory import heading_vectors

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
