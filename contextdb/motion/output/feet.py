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
from contextdb.motion.output.bank import Place3, PoseBank, tops_of
from contextdb.motion.output.feet_loops import FAR_M, FREE, HIPS_DAMPING, LOCKED, POINT, SEEN, WIDTH, free_places, stand_all
from contextdb.motion.output.ground import FLAT, Footing, below, standing, swinging
from contextdb.motion.output.legs import Leg, eased, leg_of
from contextdb.motion.output.settings import PoseSettings
from contextdb.motion.output.stages import Posture, Tick, damping, decayed

GONE = (1.0, 0.0, 0.0)
"""The step of a foot where there is no ground any more: it is there already."""
NO_LEG = -1
"""In place of the joints of a foot that has no leg of its own."""


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

    feet: Floats
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
    joints: Ints
    tops: Ints

    @classmethod
    def of(cls, settings: PoseSettings, bank: PoseBank) -> Feet:
        """For the feet that a bank has contacts of."""
        legs = tuple(leg_of(bank.skeleton, foot) for foot in bank.feet)
        joints = [[NO_LEG] * 4 if leg is None else [*leg.joints.tolist(), leg.toe] for leg in legs]
        tops = np.searchsorted(bank.moving, tops_of(bank.skeleton))
        return cls(settings, bank, legs, np.array(joints, np.int64).reshape(-1, 4), tops)

    def begin(self, posture: Posture, body: Place3 | None) -> LegsState:
        """No foot has been seen."""
        return LegsState(np.zeros((len(self.legs), WIDTH)), (FLAT,) * len(self.legs))

    def apply(self, posture: Posture, tick: Tick, state: object) -> tuple[Posture, LegsState]:
        """The posture with its legs bent to where the feet are to be."""
        assert isinstance(state, LegsState)
        is_flat = tick.ground is None and state.is_flat
        is_level = is_flat and posture.warp.stride == 1.0 and state.lower == LEVEL_HIPS
        if is_level and not self.settings.foot_lock:
            return posture, state
        rig, places, (vx, vz) = self.bank.skeleton, self.bank.places, tick.velocity or (0.0, 0.0)
        n_joints, n_feet, root = len(rig.parents), len(self.legs), posture.root
        positions, world, free = np.empty((n_joints, 3)), np.empty((n_joints, 4)), np.empty((n_feet, 3))
        more = posture.warp.stride - 1.0
        free_places(
            rig.parents, rig.offsets, places, posture.rotations, posture.positions, *root, self.joints, more, vx, vz,
            positions, world, free,
        )  # fmt: skip
        if not is_flat:
            state = self._on_ground(posture, tick, state, free.tolist())
        footings = np.array([footing.now for footing in state.footings]).reshape(-1, 3)
        feet, lower = np.empty((n_feet, WIDTH)), np.array((state.lower.now, state.lower.speed))
        rotations, moved = posture.rotations.copy(), posture.positions.copy()
        lock = self.settings.foot_lock, damping(self.settings.foot_halflife_s), self.settings.foot_radius_m
        stand_all(
            rig.parents, rig.offsets, places, tick.clip.rotations, tick.clip.positions, self.joints, self.tops, *lock, tick.dt_s,
            np.array(tick.contacts), free, footings, state.hips.now, state.feet, positions, world, feet, lower, rotations, moved,
        )  # fmt: skip
        now, speed = lower.tolist()
        state = LegsState(feet, state.footings, state.hips, Height(now, speed))
        return Posture(rotations, moved, root, posture.warp), state

    def _on_ground(self, posture: Posture, tick: Tick, state: LegsState, free: list[list[float]]) -> LegsState:
        """The state with feet and hips where the ground has them."""
        footings, heights = list(state.footings), []
        is_new = True
        for i, (leg, toe, own, foot) in enumerate(zip(self.legs, free, state.footings, state.feet.tolist(), strict=True)):
            if leg is None:
                continue
            is_far = not foot[SEEN] or math.hypot(toe[0] - foot[FREE], toe[2] - foot[FREE + 2]) > FAR_M
            is_new = is_new and is_far
            point = (foot[POINT], foot[POINT + 1]) if foot[LOCKED] and not is_far else (toe[0], toe[2])
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


def _landing(posture: Posture, left: float, ahead: float) -> tuple[float, float]:
    """A place that a clip has to the left and ahead of the body, where the warped body comes to it."""
    x, z, heading = posture.root
    sin, cos, stride = math.sin(heading + posture.warp.turn), math.cos(heading + posture.warp.turn), posture.warp.stride
    return x + stride * (cos * left + sin * ahead), z + stride * (cos * ahead - sin * left)
