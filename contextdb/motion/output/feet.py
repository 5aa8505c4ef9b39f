"""Foot lock: a foot that is down in the clip stays where it came down, and its leg bends to it.

When a foot comes down in the clip its place over the ground is kept, and its height comes to that of the clip, rolls and all. It is
let go when it goes up in the clip, or when it would be farther from the clip's place than the radius; then what lies between the
two decays as a spring. It goes up with the clip's own velocity; only where it had to be let go does its velocity change by and by.

The place is that of the toe where the foot has one, else of the ankle. The hip and knee turn so that the foot gets there, and the
foot keeps its rotation. A leg cannot become longer: a place out of its reach is not reached.

Contacts are those of the clip, as those of the shown pose would hide the worst slides.

Source: orangeduck/Motion-Matching, `contact_update` and `ik_two_bone`; the knee's damping from Forsyth, "How a Character Should
Walk".
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints, Skeleton
from contextdb.motion.output import kernels
from contextdb.motion.output.bank import Place3, PoseBank
from contextdb.motion.output.settings import PoseSettings
from contextdb.motion.output.stages import Posture, Tick, damping

STRAIGHT = math.radians(170.0)
"""A knee that is straighter is damped."""
FAR_M = 1.0
"""A foot that is farther from its clip's place belongs to a character that was put elsewhere: it goes there at once."""


@dataclass(frozen=True, eq=False, slots=True)
class Leg:
    """Hip, knee and ankle [3], and the joint that is locked: the toe, or the ankle."""

    joints: Ints
    toe: int


@dataclass(frozen=True, eq=False, slots=True)
class FootState:
    """Whether the foot is down in the clip, where it is locked over the ground (x and z; None: nowhere), the offset to that or to
    where the foot is without a lock, its change a second, and where the foot is without a lock, and where it is shown."""

    is_down: bool
    point: tuple[float, float] | None
    offset: Floats
    speed: Floats
    free: Floats
    shown: Floats


@dataclass(frozen=True, eq=False, slots=True)
class Feet:
    """The stage: both feet of a rig."""

    settings: PoseSettings
    bank: PoseBank
    legs: tuple[Leg | None, ...]

    @classmethod
    def of(cls, settings: PoseSettings, bank: PoseBank) -> Feet:
        """For the feet that a bank has contacts of."""
        return cls(settings, bank, tuple(_leg(bank.skeleton, foot) for foot in bank.feet))

    def begin(self, posture: Posture, body: Place3 | None) -> tuple[FootState | None, ...]:
        """No foot has been seen."""
        return (None,) * len(self.legs)

    def apply(self, posture: Posture, tick: Tick, state: object) -> tuple[Posture, tuple[FootState | None, ...]]:
        """The posture with its legs bent to where the feet are to be."""
        assert isinstance(state, tuple)
        positions, world = self._placed(posture)
        heights = self._placed(tick.clip)[0][:, 1]
        rotations = posture.rotations.copy()
        after: list[FootState | None] = []
        for i, (leg, own) in enumerate(zip(self.legs, state, strict=True)):
            if leg is None:
                after.append(None)
                continue
            toe = positions[leg.toe].copy()
            now = self._moved(own, toe, float(heights[leg.toe]), bool(tick.contacts[i]), tick.dt_s)
            shown = now.shown
            if np.abs(shown - toe).max() > 0.0:
                ankle = positions[leg.joints[2]]
                ahead = toe - ankle if leg.toe != leg.joints[2] else world[leg.joints[1], 1:]
                target = ankle + shown - toe
                parents = self.bank.skeleton.parents
                kernels.bend_leg(parents, positions, world, leg.joints, target, ahead, STRAIGHT, rotations)
            after.append(now)
        return replace(posture, rotations=rotations), tuple(after)

    def _moved(self, state: FootState | None, toe: Floats, height: float, is_down: bool, dt_s: float) -> FootState:
        """The foot after this tick, whose toe is at a place without a lock and has a height in the clip."""
        ground, still = (float(toe[0]), float(toe[2])), np.zeros(3)
        if state is None or np.linalg.norm(toe - state.free) > FAR_M:
            if is_down:
                return _locked(ground, toe - _over(ground, height), still, height, toe)
            return _free(False, still, still, toe)
        y = damping(self.settings.foot_halflife_s)
        if state.point is not None and not is_down:
            return _free(False, *_decayed(state.shown - state.free, still, y, dt_s), toe)
        offset, speed = _decayed(state.offset, state.speed, y, dt_s)
        if state.point is not None:
            place = _over(state.point, height) + offset
            if math.hypot(state.point[0] - ground[0], state.point[1] - ground[1]) <= self.settings.foot_radius_m:
                return _locked(state.point, offset, speed, height, toe)
            velocity = (toe - state.free) / dt_s if dt_s > 0.0 else still
            return _free(True, place - toe, speed - velocity, toe)
        if is_down and not state.is_down:
            shown = toe + offset
            point = (float(shown[0]), float(shown[2]))
            return _locked(point, shown - _over(point, height), still, height, toe)
        return _free(is_down, offset, speed, toe)

    def _placed(self, posture: Posture) -> tuple[Floats, Floats]:
        """Positions and rotations of all joints in the world."""
        rig, translations = self.bank.skeleton, self.bank.translations(posture.positions)
        positions, world = np.empty((rig.n_joints, 3)), np.empty((rig.n_joints, 4))
        kernels.place(rig.parents, translations, posture.rotations, *posture.root, positions, world)
        return positions, world


def _leg(rig: Skeleton, foot: str) -> Leg | None:
    """The leg of a foot; None where it has no hip and knee of its own."""
    ankle = rig.index(foot)
    above = rig.ancestors(ankle)
    if len(above) < 3:
        return None
    below = [joint for joint in range(rig.n_joints) if rig.parents[joint] == ankle]
    toes = [joint for joint in below if "toe" in rig.names[joint].casefold() or "ball" in rig.names[joint].casefold()]
    return Leg(np.array([above[1], above[0], ankle], np.int64), (toes or [ankle])[0])


def _locked(point: tuple[float, float], offset: Floats, speed: Floats, height: float, toe: Floats) -> FootState:
    """A foot that is down and locked."""
    return FootState(True, point, offset, speed, toe, _over(point, height) + offset)


def _free(is_down: bool, offset: Floats, speed: Floats, toe: Floats) -> FootState:
    """A foot that is not locked."""
    return FootState(is_down, None, offset, speed, toe, toe + offset)


def _over(point: tuple[float, float], height: float) -> Floats:
    """A place over the ground at a height."""
    return np.array([point[0], height, point[1]])


def _decayed(offset: Floats, speed: Floats, y: float, dt_s: float) -> tuple[Floats, Floats]:
    """An offset and its change a second some time later: x = e^{-yt} (x0 + (v0 + x0 y) t)."""
    fade, pushed = math.exp(-y * dt_s), speed + offset * y
    return fade * (offset + pushed * dt_s), fade * (speed - pushed * y * dt_s)
