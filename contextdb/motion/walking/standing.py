"""Legs that reach their footsteps: each toe by its delta, the ground below it, and the hips as low as the lowest foot needs.

The solver of legs, the knee's damping above 170°, the slope of a foot, its height over the ground and the height of the hips are
those of `contextdb.motion.output`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contextdb.motion.clips import quaternions
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.output.bank import leg_loops, loops, tops_of
from contextdb.motion.output.feet import LEVEL_HIPS, Height
from contextdb.motion.output.foot_state import HIPS_DAMPING, MOST_LOWER, STRAIGHT
from contextdb.motion.output.ground import FLAT, Footing, below, standing, swinging
from contextdb.motion.output.legs import LEFT, Leg, eased, hinge_of, leg_of
from contextdb.motion.output.samples import Place3
from contextdb.motion.output.stages import Ground
from contextdb.motion.walking.blending import Mix
from contextdb.motion.walking.cycle import Cycle
from contextdb.motion.walking.footsteps import Steps, ramp


@dataclass(frozen=True, eq=False, slots=True)
class GroundState:
    """What is below each foot, how high the hips are over the cycles', and how much lower than that the legs need them."""

    footings: tuple[Footing, Footing] = (FLAT, FLAT)
    hips: Height = LEVEL_HIPS
    lower: Height = LEVEL_HIPS


LEVEL = GroundState()


@dataclass(frozen=True, eq=False, slots=True)
class Shown:
    """A pose on its ground: rotations [J, 4] and translations [J, 3] against parents, positions [J, 3] in the world."""

    rotations: Floats
    translations: Floats
    positions: Floats


@dataclass(frozen=True, eq=False)
class Legs:
    """The legs of a rig, and the axes [3] of their knees; those without hip and knee are left as the cycles have them."""

    rig: Skeleton
    legs: tuple[Leg | None, Leg | None]
    hinges: list[Floats]
    tops: list[int]

    @classmethod
    def of(cls, cycles: Sequence[Cycle]) -> Legs:
        rig, feet = cycles[0].skeleton, cycles[0].feet
        legs = leg_of(rig, feet[0]), leg_of(rig, feet[1])
        rotations = np.concatenate([cycle.rotations for cycle in cycles])
        hinges = [LEFT if leg is None else hinge_of(rig, leg, rotations[:, leg.joints[1]]) for leg in legs]
        return cls(rig, legs, hinges, tops_of(rig))

    def grounded(
        self,
        state: GroundState,
        mix: Mix,
        phase: float,
        steps: tuple[Steps, Steps],
        ground: Ground | None,
        dt_s: float,
        is_new: bool,
    ) -> GroundState:
        """The ground below both feet and the hips, some time later; at once for a body that is new where it is."""
        footings, heights = list(state.footings), []
        for foot, (own, at) in enumerate(zip(state.footings, steps, strict=True)):
            here = below(ground, at.last.x, at.last.z)
            if is_new:
                own = Footing(here, last=here)
            if at.is_down:
                footings[foot] = standing(own, here, HIPS_DAMPING, dt_s)
                heights.append(here[0])
                continue
            share, there = mix.stances.share_of_state(foot, phase), below(ground, at.next.x, at.next.z)
            footings[foot] = swinging(own, there, share, HIPS_DAMPING, dt_s)
            heights.append(own.last[0] + eased(share) * (there[0] - own.last[0]))
        hips = Height(min(heights)) if is_new else state.hips.come(min(heights), dt_s)
        return GroundState((footings[0], footings[1]), hips, LEVEL_HIPS if is_new else state.lower)

    def shown(
        self, state: GroundState, mix: Mix, phase: float, steps: tuple[Steps, Steps], place: Place3, dt_s: float
    ) -> tuple[Shown, GroundState]:
        """The pose of the blend with its feet on their footsteps, and the ground with the hips as low as its legs need them."""
        rotations, translations = (each.copy() for each in mix.at(phase))
        positions, world = self._placed(rotations, translations, place)
        toes = self._stood(state, mix, phase, steps, place, positions, world)
        most, hips = 0.0, state.hips.now
        for leg, toe, footing in zip(self.legs, toes, state.footings, strict=True):
            if leg is not None:
                _, x, z = footing.now
                most = max(most, leg_loops().too_high(positions, leg.joints, leg.toe, toe, x, z, STRAIGHT, hips))
        lower = state.lower.gone_down(min(most, MOST_LOWER), dt_s)
        height = hips - lower.now
        positions[:, 1] += height
        for top in self.tops:
            translations[top, 1] += height
        for leg, hinge, toe, footing in zip(self.legs, self.hinges, toes, state.footings, strict=True):
            if leg is not None:
                _, x, z = footing.now
                leg_loops().stand(self.rig.parents, positions, world, leg.joints, leg.toe, hinge, toe, x, z, STRAIGHT, rotations)
        positions, _ = self._placed(rotations, translations, place)
        return Shown(rotations, translations, positions), GroundState(state.footings, state.hips, lower)

    def _stood(
        self,
        state: GroundState,
        mix: Mix,
        phase: float,
        steps: tuple[Steps, Steps],
        place: Place3,
        positions: Floats,
        world: Floats,
    ) -> list[Floats]:
        """Where each toe is to be; its foot is turned to the way it is to point."""
        own, found = mix.toes_at(phase), []
        sin, cos = math.sin(place[2]), math.cos(place[2])
        for foot, (leg, at) in enumerate(zip(self.legs, steps, strict=True)):
            weight, (x, z, turn) = ramp(mix, at, foot, phase, place)
            left, up, ahead = own[foot].tolist()
            there = np.array([place[0] + cos * left + sin * ahead, up, place[1] + cos * ahead - sin * left])
            if leg is None:
                found.append(there)
                continue
            toe = positions[leg.toe].copy()
            goal = toe + weight * (there + np.array([x, 0.0, z]) - toe)
            goal[1] += state.footings[foot].now[0]
            self._turned(leg, weight * turn, positions, world)
            found.append(goal)
        return found

    def _turned(self, leg: Leg, turn: float, positions: Floats, world: Floats) -> None:
        """Turn a foot about the upright axis through its ankle."""
        if turn == 0.0:
            return
        ankle = leg.joints[2]
        about = np.array([math.cos(0.5 * turn), 0.0, math.sin(0.5 * turn), 0.0])
        world[ankle] = quaternions.multiply(about, world[ankle])
        positions[leg.toe] = positions[ankle] + quaternions.rotate(about, positions[leg.toe] - positions[ankle])

    def _placed(self, rotations: Floats, translations: Floats, place: Place3) -> tuple[Floats, Floats]:
        """Positions and rotations of all joints in the world."""
        positions, world = np.empty((len(rotations), 3)), np.empty((len(rotations), 4))
        loops().place(self.rig.parents, translations, rotations, *place, positions, world)
        return positions, world
