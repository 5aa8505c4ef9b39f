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
from contextdb.motion.output.stages import Posture, Tick, damping, decayed

Triple = tuple[float, float, float]

STILL: Triple = (0.0, 0.0, 0.0)
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
    offset: Triple
    speed: Triple
    free: Triple
    shown: Triple


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
            toe: Triple = tuple(positions[leg.toe].tolist())
            now = self._moved(own, toe, float(heights[leg.toe]), bool(tick.contacts[i]), tick.dt_s)
            if now.shown != toe:
                ankle = positions[leg.joints[2]]
                ahead = positions[leg.toe] - ankle if leg.toe != leg.joints[2] else world[leg.joints[1], 1:]
                target = ankle + _apart(now.shown, toe)
                parents = self.bank.skeleton.parents
                kernels.bend_leg(parents, positions, world, leg.joints, target, ahead, STRAIGHT, rotations)
            after.append(now)
        return replace(posture, rotations=rotations), tuple(after)

    def _moved(self, state: FootState | None, toe: Triple, height: float, is_down: bool, dt_s: float) -> FootState:
        """The foot after this tick, whose toe is at a place without a lock and has a height in the clip."""
        ground = (toe[0], toe[2])
        if state is None or math.dist(toe, state.free) > FAR_M:
            if is_down:
                return _locked(ground, _apart(toe, _over(ground, height)), STILL, height, toe)
            return _free(False, STILL, STILL, toe)
        y = damping(self.settings.foot_halflife_s)
        if state.point is not None and not is_down:
            return _free(False, *decayed(_apart(state.shown, state.free), STILL, y, dt_s), toe)
        offset, speed = decayed(state.offset, state.speed, y, dt_s)
        if state.point is not None:
            place = _sum(_over(state.point, height), offset)
            if math.hypot(state.point[0] - ground[0], state.point[1] - ground[1]) <= self.settings.foot_radius_m:
                return _locked(state.point, offset, speed, height, toe)
            velocity = _over_time(_apart(toe, state.free), dt_s)
            return _free(True, _apart(place, toe), _apart(speed, velocity), toe)
        if is_down and not state.is_down:
            shown = _sum(toe, offset)
            point = (shown[0], shown[2])
            return _locked(point, _apart(shown, _over(point, height)), STILL, height, toe)
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


def _locked(point: tuple[float, float], offset: Triple, speed: Triple, height: float, toe: Triple) -> FootState:
    """A foot that is down and locked."""
    return FootState(True, point, offset, speed, toe, _sum(_over(point, height), offset))


def _free(is_down: bool, offset: Triple, speed: Triple, toe: Triple) -> FootState:
    """A foot that is not locked."""
    return FootState(is_down, None, offset, speed, toe, _sum(toe, offset))


def _over(point: tuple[float, float], height: float) -> Triple:
    """A place over the ground at a height."""
    return point[0], height, point[1]


def _sum(first: Triple, second: Triple) -> Triple:
    return first[0] + second[0], first[1] + second[1], first[2] + second[2]


def _apart(first: Triple, second: Triple) -> Triple:
    return first[0] - second[0], first[1] - second[1], first[2] - second[2]


def _over_time(way: Triple, dt_s: float) -> Triple:
    """A velocity; none where no time passes."""
    return (way[0] / dt_s, way[1] / dt_s, way[2] / dt_s) if dt_s > 0.0 else STILL
