"""Legs: steps as long as the way asks for, feet on the ground that the game has, and feet that stay where they came down.

Stride: a foot is moved along the way, away from or to the point below its hip, by as much as the stride is longer or shorter.

Ground: a foot that is down stands on the ground below it, as steep as that is; one that is up goes from the ground that it left to
that where its clip will put it down: up in the first half of its swing, down in the second. The hips go by the lowest of these, and
all comes there as critically damped springs do, so that a step of the ground is none of the body. On flat ground nothing changes.

Lock: when a foot comes down in the clip its place over the ground is kept, and its height comes to that of the clip, rolls and all.
It is let go when it goes up in the clip, or when it would be farther from the clip's place than the radius; then what lies between
the two decays as a spring. It goes up with the clip's own velocity; only where it had to be let go does its velocity change
by and by. One that was let go while it was down is locked again when it has nearly come to its clip's place.

The hips go down by the least that lets legs reach, stretched no more than in the clip or than a knee of 170°. The place of a foot
is that of the toe where it has one, else of the ankle. The hip and knee turn so that the foot gets there, and the foot keeps its
rotation but for the slope. A leg cannot become longer: a place out of its reach is not reached.

Contacts are those of the clip, as those of the shown pose would hide the worst slides.

Source: orangeduck/Motion-Matching, `contact_update` and `ik_two_bone`; stride warping of Unreal's Animation Warping; feet, hips and
the knee's damping from Forsyth, "How a Character Should Walk".
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.output import kernels
from contextdb.motion.output.bank import Place3, PoseBank, tops_of
from contextdb.motion.output.ground import FLAT, Footing, below, standing, swinging
from contextdb.motion.output.legs import Leg, eased, leg_of
from contextdb.motion.output.settings import PoseSettings
from contextdb.motion.output.stages import Posture, Tick, damping, decayed

Triple = tuple[float, float, float]

STILL: Triple = (0.0, 0.0, 0.0)
STRAIGHT = math.radians(170.0)
"""A knee that is straighter is damped."""
FAR_M = 1.0
"""A foot that is farther from its clip's place belongs to a character that was put elsewhere: it goes there at once."""
BACK_SHARE, SLOW_MPS = 1.0 / 3.0, 0.5
"""A foot that had to be let go is locked again when it has come back to its clip as far as to this share of the radius, and
moves no faster than this."""
HIPS_HALFLIFE_S = 0.1
"""How fast hips and feet come to the height of the ground."""
HIPS_DAMPING = damping(HIPS_HALFLIFE_S)
LEAST_MPS = 1e-6
GONE = (1.0, 0.0, 0.0)
"""The step of a foot where there is no ground any more: it is there already."""
MOST_LOWER = 0.25
"""The hips go down by no more metres than this for a foot out of reach."""


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


@dataclass(frozen=True, slots=True)
class Height:
    """A height in metres, and its change a second."""

    now: float = 0.0
    speed: float = 0.0

    def come(self, goal: float, dt_s: float) -> Height:
        """The height some time later, on its way to a goal."""
        (apart, _, _), (speed, _, _) = decayed((self.now - goal, 0.0, 0.0), (self.speed, 0.0, 0.0), HIPS_DAMPING, dt_s)
        return Height(goal + apart, speed)

    def gone_down(self, least: float, dt_s: float) -> Height:
        """How far hips are down some time later: as far as legs need it, and back up by and by."""
        back = self.come(least, dt_s)
        return back if back.now >= least else Height(least, max(back.speed, 0.0))


LEVEL_HIPS = Height()


@dataclass(frozen=True, eq=False, slots=True)
class LegsState:
    """The feet and what is below them, the height of the hips over their clip's, and how much lower than that legs need them."""

    feet: tuple[FootState | None, ...]
    footings: tuple[Footing, ...]
    hips: Height = LEVEL_HIPS
    lower: Height = LEVEL_HIPS

    @property
    def is_flat(self) -> bool:
        """Whether no ground is felt any more."""
        return (self.hips is LEVEL_HIPS or self.hips == LEVEL_HIPS) and self.footings == (FLAT,) * len(self.footings)


@dataclass(frozen=True, eq=False, slots=True)
class Feet:
    """The stage: all legs of a rig."""

    settings: PoseSettings
    bank: PoseBank
    legs: tuple[Leg | None, ...]
    toes: Ints
    tops: list[int]

    @classmethod
    def of(cls, settings: PoseSettings, bank: PoseBank) -> Feet:
        """For the feet that a bank has contacts of."""
        legs = tuple(leg_of(bank.skeleton, foot) for foot in bank.feet)
        toes = np.array([0 if leg is None else leg.toe for leg in legs], np.int64)
        return cls(settings, bank, legs, toes, np.searchsorted(bank.moving, tops_of(bank.skeleton)).tolist())

    def begin(self, posture: Posture, body: Place3 | None) -> LegsState:
        """No foot has been seen."""
        return LegsState((None,) * len(self.legs), (FLAT,) * len(self.legs))

    def apply(self, posture: Posture, tick: Tick, state: object) -> tuple[Posture, LegsState]:
        """The posture with its legs bent to where the feet are to be."""
        assert isinstance(state, LegsState)
        is_flat = tick.ground is None and state.is_flat
        is_level = is_flat and posture.warp.stride == 1.0 and state.lower == LEVEL_HIPS
        if is_level and not self.settings.foot_lock:
            return posture, state
        positions, world = self._placed(posture)
        ways = self._lengthened(posture, tick, positions)
        free = [None if leg is None else _sum(_triple(positions[leg.toe]), way) for leg, way in zip(self.legs, ways, strict=True)]
        if not is_flat:
            state = self._on_ground(posture, tick, state, free)
        feet = self._stood(tick, state, free)
        lower = state.lower.gone_down(self._too_high(state, feet, positions), tick.dt_s)
        state = LegsState(feet, state.footings, state.hips, lower)
        height, places = state.hips.now - state.lower.now, posture.positions
        if height != 0.0:
            places = places.copy()
            for top in self.tops:
                places[top, 1] += height
            positions[:, 1] += height
        rotations, parents = posture.rotations.copy(), self.bank.skeleton.parents
        for leg, foot, footing in zip(self.legs, feet, state.footings, strict=True):
            if leg is not None and foot is not None and (foot.shown, footing.now) != (_triple(positions[leg.toe]), FLAT.now):
                _, x, z = footing.now
                kernels.stand(parents, positions, world, leg.joints, leg.toe, np.array(foot.shown), x, z, STRAIGHT, rotations)
        return Posture(rotations, places, posture.root, posture.warp), state

    def _lengthened(self, posture: Posture, tick: Tick, positions: Floats) -> list[Triple]:
        """How far each foot is moved along the way, for steps of the stride's length."""
        more, (x, z) = posture.warp.stride - 1.0, tick.velocity or (0.0, 0.0)
        size = math.hypot(x, z)
        if more == 0.0 or size < LEAST_MPS:
            return [STILL] * len(self.legs)
        x, z, ways = x / size, z / size, []
        for leg in self.legs:
            if leg is None:
                ways.append(STILL)
                continue
            hip, ankle = positions[leg.joints[0]].tolist(), positions[leg.joints[2]].tolist()
            along = more * (x * (ankle[0] - hip[0]) + z * (ankle[2] - hip[2]))
            ways.append((along * x, 0.0, along * z))
        return ways

    def _on_ground(self, posture: Posture, tick: Tick, state: LegsState, free: list[Triple | None]) -> LegsState:
        """The state with feet and hips where the ground has them."""
        footings, heights = list(state.footings), []
        is_new = True
        for i, (toe, own, foot) in enumerate(zip(free, state.footings, state.feet, strict=True)):
            if toe is None:
                continue
            is_far = foot is None or math.hypot(toe[0] - foot.free[0], toe[2] - foot.free[2]) > FAR_M
            is_new = is_new and is_far
            point = (toe[0], toe[2]) if is_far or foot is None or foot.point is None else foot.point
            share, left, ahead = tick.steps[i] if tick.steps else GONE
            if tick.contacts[i] or is_far:
                here = below(tick.ground, *point)
                footings[i] = Footing(here, last=here) if is_far else standing(own, here, HIPS_DAMPING, tick.dt_s)
                heights.append(here[0])
                continue
            there = below(tick.ground, *_landing(posture, left, ahead))
            footings[i] = swinging(own, there, share, HIPS_DAMPING, tick.dt_s)
            heights.append(own.last[0] + eased(share) * (there[0] - own.last[0]))
        goal = min(heights) if heights else below(tick.ground, *posture.root[:2])[0]
        hips = Height(goal) if is_new and heights else state.hips.come(goal, tick.dt_s)
        return replace(state, footings=tuple(footings), hips=hips)

    def _stood(self, tick: Tick, state: LegsState, free: list[Triple | None]) -> tuple[FootState | None, ...]:
        """The feet after this tick, on their ground."""
        heights = self._heights(tick.clip) if self.settings.foot_lock else None
        found: list[FootState | None] = []
        for i, (leg, toe, own, footing) in enumerate(zip(self.legs, free, state.feet, state.footings, strict=True)):
            if leg is None or toe is None:
                found.append(None)
                continue
            over = (toe[0], toe[1] + footing.now[0], toe[2])
            if heights is None:
                found.append(_free(False, STILL, STILL, over))
            else:
                height = heights[i] + footing.now[0]
                found.append(self._moved(own, over, height, bool(tick.contacts[i]), tick.dt_s))
        return tuple(found)

    def _too_high(self, state: LegsState, feet: tuple[FootState | None, ...], positions: Floats) -> float:
        """By how much the hips are too high for a leg to reach its foot's place, stretched as in the clip or to a straight knee."""
        most = 0.0
        for leg, foot, footing in zip(self.legs, feet, state.footings, strict=True):
            if leg is not None and foot is not None:
                _, x, z = footing.now
                down = kernels.too_high(positions, leg.joints, leg.toe, np.array(foot.shown), x, z, STRAIGHT)
                most = max(most, min(down + state.hips.now, MOST_LOWER))
        return most

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
        if is_down and (not state.is_down or self._is_back(offset, _apart(toe, state.free), dt_s)):
            shown = _sum(toe, offset)
            point = (shown[0], shown[2])
            return _locked(point, _apart(shown, _over(point, height)), STILL, height, toe)
        return _free(is_down, offset, speed, toe)

    def _is_back(self, offset: Triple, moved: Triple, dt_s: float) -> bool:
        """Whether a foot is nearly at its clip's place again, and that hardly moves."""
        is_near = math.hypot(offset[0], offset[2]) < BACK_SHARE * self.settings.foot_radius_m
        return is_near and math.hypot(moved[0], moved[2]) <= SLOW_MPS * dt_s

    def _heights(self, clip: Posture) -> list[float]:
        """How high each toe is in the clip."""
        rig, found = self.bank.skeleton, np.empty(len(self.toes))
        kernels.heights(rig.parents, rig.offsets, self.bank.places, clip.rotations, clip.positions, self.toes, found)
        heights: list[float] = found.tolist()
        return heights

    def _placed(self, posture: Posture) -> tuple[Floats, Floats]:
        """Positions and rotations of all joints in the world."""
        rig, translations = self.bank.skeleton, self.bank.translations(posture.positions)
        positions, world = np.empty((rig.n_joints, 3)), np.empty((rig.n_joints, 4))
        kernels.place(rig.parents, translations, posture.rotations, *posture.root, positions, world)
        return positions, world


def _locked(point: tuple[float, float], offset: Triple, speed: Triple, height: float, toe: Triple) -> FootState:
    """A foot that is down and locked."""
    return FootState(True, point, offset, speed, toe, _sum(_over(point, height), offset))


def _free(is_down: bool, offset: Triple, speed: Triple, toe: Triple) -> FootState:
    """A foot that is not locked."""
    return FootState(is_down, None, offset, speed, toe, _sum(toe, offset))


def _landing(posture: Posture, left: float, ahead: float) -> tuple[float, float]:
    """A place that a clip has to the left and ahead of the body, where the warped body comes to it."""
    x, z, heading = posture.root
    sin, cos, stride = math.sin(heading + posture.warp.turn), math.cos(heading + posture.warp.turn), posture.warp.stride
    return x + stride * (cos * left + sin * ahead), z + stride * (cos * ahead - sin * left)


def _triple(place: Floats) -> Triple:
    x, y, z = place.tolist()
    return x, y, z


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
