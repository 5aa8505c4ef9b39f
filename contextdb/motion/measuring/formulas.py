"""The formulas of motion quality, on arrays alone.

T moments at `times_s`, K feet, J joints; positions in metres, y up. Moments need not be evenly apart. What is taken over frames in
the sources is taken over seconds here, so that a motion has the same measures at each rate: speeds of feet and accelerations over
steps of 1/30 s, a mean speed over 1/6 s.

Sources: the weighted form of skating from MANN (Zhang and others, 2018), its ratio from GMD (Karunratanakul and others, 2023), the
time to reach a direction after TrajAug (2024).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips.quaternions import Floats

Flags = NDArray[np.bool_]

STEP_S = 1.0 / 30.0
"""Speeds of feet and accelerations are taken over steps of about this length."""
MEAN_S = 5.0 / 30.0
"""The ratio form compares the mean speed over this time too: 5 frames."""
WEIGHTED_M, RATIO_M, RATIO_MPS = 0.025, 0.05, 0.5
"""The weighted form counts feet lower than the first; the ratio form those lower than the second and faster than the third."""
LIFTED_M, LIFTED_S = 0.02, 0.5
"""A foot that is so much above where it was lowest, both in so long before and after, is in a step."""
FLOOR_SHARE = 0.01
"""A foot's floor is the height that it is above in all but this share of the moments."""
STEADY_MPS2 = 0.5
"""A velocity that changes less is steady."""
LEAST_CHANGE_MPS, STANDING_MPS, LEAST_TURN = 0.2, 0.1, math.radians(20.0)
SETTLE_S = 0.1
"""A change that pauses for less is one change."""
WINDOW_S = 0.2
"""The velocity with which something is reached is the mean over this time."""
REACHED = 0.1
"""Something is reached when so much of the change is left, or less."""
NEAR_MPS, NEAR_RAD = 0.1, math.radians(5.0)
"""… or when it is as near as this."""


# ---- feet


@dataclass(frozen=True, eq=False)
class Slides:
    """How feet move over n steps of about 1/30 s; at a higher rate they overlap.

    `seconds` float64 [n] is for how long each counts. Of K feet, float64 [n, K]: `speeds` and `mean_speeds` over the ground in m/s,
    in the step and in 1/6 s about it; `heights` of the higher end of the step above the foot's own floor, in m. `planted` bool [n,
    K]: the clip has the foot down all the time.
    """

    seconds: Floats
    speeds: Floats
    mean_speeds: Floats
    heights: Floats
    planted: Flags

    @classmethod
    def of(cls, feet: Floats, times_s: Floats, contacts: Flags, floor: Floats) -> Slides:
        """Of feet at places [T, K, 3], planted or not [T, K], above a floor [K]."""
        step = min(step_of(times_s), len(times_s) - 1)
        seconds = (times_s[step:] - times_s[:-step]) / step
        speeds = np.linalg.norm((feet[step:] - feet[:-step])[..., [0, 2]], axis=-1) / (step * seconds)[:, None]
        heights = np.maximum(feet[step:, :, 1], feet[:-step, :, 1]) - floor
        planted = np.logical_and.reduce([contacts[i : len(contacts) - step + i] for i in range(step + 1)])
        return cls(seconds, speeds, _means(speeds, seconds), heights, planted)

    @classmethod
    def joined(cls, parts: Sequence[Slides]) -> Slides:
        """Those of several clips."""
        names = ("seconds", "speeds", "mean_speeds", "heights", "planted")
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))

    def skate_mps(self) -> float | None:
        """The mean speed of planted feet; None where no foot is ever planted."""
        return _mean(self.speeds, np.asarray(self.seconds[:, None] * self.planted))

    def skated_m_per_s(self) -> float | None:
        """How far planted feet slide in a second, of both feet together."""
        total_s = float(self.seconds.sum())
        return float((self.speeds * self.seconds[:, None] * self.planted).sum()) / total_s if total_s > 0.0 else None

    def weighted_mps(self) -> float | None:
        """The mean of speed x (2 - 2^(h / H)) over feet at a height h below H = 2.5 cm."""
        heights = np.asarray(np.maximum(self.heights, 0.0))
        weighted = np.asarray(self.speeds * (2.0 - np.exp2(np.minimum(heights / WEIGHTED_M, 1.0))))
        return _mean(weighted, self.seconds[:, None] * (heights < WEIGHTED_M))

    def ratio(self) -> float | None:
        """The share of time in which a foot below 5 cm is faster than 0.5 m/s, at once and in the mean over 1/6 s."""
        slides = (self.heights < RATIO_M) & (self.speeds > RATIO_MPS) & (self.mean_speeds > RATIO_MPS)
        return _mean(np.asarray(slides.any(axis=1), np.float64), self.seconds)


def floor_of(feet: Floats) -> Floats:
    """The height of the floor below each foot [K], of places [T, K, 3]."""
    return np.asarray(np.quantile(feet[..., 1], FLOOR_SHARE, axis=0))


def standing(contacts: Flags, feet: Floats, times_s: Floats) -> Flags:
    """Where feet [T, K, 3] are planted [T, K] and not in a step: one that is lifted and put down elsewhere does not slide. Heights
    alone decide, against the foot's own before and after, so that it is the same on stairs."""
    n = max(1, round(LIFTED_S / float(np.median(np.diff(times_s))))) if len(times_s) > 1 else 1
    heights = np.pad(feet[..., 1], ((n, n), (0, 0)), constant_values=np.inf)
    least = np.lib.stride_tricks.sliding_window_view(heights, n + 1, axis=0).min(axis=-1)
    return np.asarray(contacts & (feet[..., 1] <= np.maximum(least[:-n], least[n:]) + LIFTED_M))


def _means(speeds: Floats, seconds: Floats) -> Floats:
    """The mean speed over 1/6 s about each interval; near the ends over what there is."""
    n = max(1, round(MEAN_S / float(np.median(seconds))))
    ways = np.concatenate((np.zeros((1, speeds.shape[1])), np.cumsum(speeds * seconds[:, None], axis=0)))
    times_s = np.concatenate(([0.0], np.cumsum(seconds)))
    first = np.maximum(np.arange(len(seconds)) - n // 2, 0)
    after = np.minimum(first + n, len(seconds))
    first = np.maximum(after - n, 0)
    return np.asarray((ways[after] - ways[first]) / (times_s[after] - times_s[first])[:, None])


def _mean(values: Floats, weights: Floats) -> float | None:
    total = float(np.sum(weights))
    return float(np.sum(values * weights)) / total if total > 0.0 else None


# ---- accelerations


def step_of(times_s: Floats) -> int:
    """How many moments are about 1/30 s."""
    return max(1, round(STEP_S / float(np.median(np.diff(times_s))))) if len(times_s) > 1 else 1


def accelerations(positions: Floats, times_s: Floats, step: int) -> Floats:
    """How much the velocity of each joint [T, J, 3] changes a second, over steps of some moments: float64 [T - 2 step, J], m/s²."""
    if len(positions) <= 2 * step:
        return np.zeros((0, positions.shape[1]))
    past, now, ahead = positions[: -2 * step], positions[step:-step], positions[2 * step :]
    before_s, after_s = (np.diff(pair, axis=0)[0] for pair in _steps(times_s, step))
    change = (ahead - now) / after_s[:, None, None] - (now - past) / before_s[:, None, None]
    return np.asarray(np.linalg.norm(change, axis=-1) * 2.0 / (before_s + after_s)[:, None])


def _steps(times_s: Floats, step: int) -> tuple[Floats, Floats]:
    past, now, ahead = times_s[: -2 * step], times_s[step:-step], times_s[2 * step :]
    return np.stack((past, now)), np.stack((now, ahead))


# ---- the path


def apart(roots: Floats, bodies: Floats) -> tuple[Floats, Floats]:
    """How far roots [T, 3] are from bodies, in metres, and their headings, in radians; both as x, z and heading."""
    metres = np.hypot(*(roots - bodies)[:, :2].T)
    turns = roots[:, 2] - bodies[:, 2]
    return metres, np.abs(np.arctan2(np.sin(turns), np.cos(turns)))


def rms(values: Floats) -> float:
    return math.sqrt(float(np.mean(np.square(values))))


@dataclass(frozen=True, slots=True)
class Change:
    """A change of the wanted velocity: the moment at which it begins, until which moment it counts, and from what to what."""

    at: int
    until: int
    before: Floats
    after: Floats

    @property
    def kind(self) -> str:
        """What there is to reach: "stop", "direction" or "speed"."""
        if np.hypot(*self.after) < STANDING_MPS:
            return "stop"
        is_turn = np.hypot(*self.before) >= STANDING_MPS and _angle(self.before, self.after) > LEAST_TURN
        return "direction" if is_turn else "speed"

    def is_reached(self, velocity: Floats) -> bool:
        """Whether a velocity [2] is as good as the wanted one."""
        speed, wanted, before = (float(np.hypot(*each)) for each in (velocity, self.after, self.before))
        if self.kind == "direction":
            return speed >= STANDING_MPS and _angle(velocity, self.after) <= max(
                NEAR_RAD, REACHED * _angle(self.before, self.after)
            )
        return abs(speed - wanted) <= max(NEAR_MPS, REACHED * abs(wanted - before))


def changes_of(wanted: Floats, times_s: Floats) -> list[Change]:
    """The changes of a velocity [T, 2], which is wanted from each moment to the next; one that does not end is none."""
    if len(wanted) < 2:
        return []
    strong = np.linalg.norm(np.diff(wanted, axis=0), axis=1) > STEADY_MPS2 * np.diff(times_s)
    runs: list[list[int]] = []
    for i in np.flatnonzero(strong).tolist():
        if runs and times_s[i] - times_s[runs[-1][1]] <= SETTLE_S + 1e-9:
            runs[-1][1] = i
        else:
            runs.append([i, i])
    ended = [run for run in runs if times_s[-1] - times_s[run[1] + 1] > SETTLE_S]
    changes = []
    for k, (first, last) in enumerate(ended):
        until = runs[k + 1][0] + 1 if k + 1 < len(runs) else len(times_s) - 1
        if np.linalg.norm(wanted[last + 1] - wanted[first]) > LEAST_CHANGE_MPS:
            changes.append(Change(first + 1, until, wanted[first], wanted[last + 1]))
    return changes


def velocities(places: Floats, times_s: Floats) -> Floats:
    """The velocity of places [T, 2] at each moment, the mean over 0.2 s about it: float64 [T, 2]."""
    low = np.clip(times_s - WINDOW_S / 2.0, times_s[0], times_s[-1])
    high = np.clip(times_s + WINDOW_S / 2.0, times_s[0], times_s[-1])
    ends = [np.stack([np.interp(at, times_s, column) for column in places.T], axis=-1) for at in (low, high)]
    return np.asarray((ends[1] - ends[0]) / np.maximum(high - low, 1e-9)[:, None])


def reach_s(change: Change, moved: Floats, times_s: Floats) -> float | None:
    """Seconds from a change until velocities [T, 2] have reached what is wanted; None where the next change comes first."""
    for i in range(change.at, change.until + 1):
        if change.is_reached(moved[i]):
            return float(times_s[i] - times_s[change.at])
    return None


def _angle(a: Floats, b: Floats) -> float:
    """The angle between two directions [2], 0 to π."""
    return abs(math.atan2(float(a[0] * b[1] - a[1] * b[0]), float(a @ b)))
