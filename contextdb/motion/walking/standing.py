"""Legs that reach their footsteps: each toe by its delta, the ground below it, and the hips as low as the lowest foot needs.

The solver of legs, the knee's damping above 170°, the slope of a foot, its height over the ground and the height of the hips are
those of `contextdb.motion.output`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contextdb.core import feel_ground, lower_hips, stand_legs
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints, Skeleton
from contextdb.motion.output.bank import placed
from contextdb.motion.output.clip_parts import tops_of
from contextdb.motion.output.ground import Ground, below
from contextdb.motion.output.legs import hinges_of, legs_of
from contextdb.motion.output.samples import Place3
from contextdb.motion.walking.blending import Mix
from contextdb.motion.walking.cycle import Cycle
from contextdb.motion.walking.footsteps import Steps, ramp


@dataclass(frozen=True, eq=False, slots=True)
class GroundState:
    """What is below each foot [2, 9], as in the core's ground.h, how high the hips are over the cycles', and how much lower than
    that the legs need them: each a height and its change a second [2]."""

    footings: Floats
    hips: Floats
    lower: Floats


LEVEL = GroundState(np.zeros((2, 9)), np.zeros(2), np.zeros(2))
DOWN = -1.0
"""In place of the share of its swing, for a foot that is down."""


@dataclass(frozen=True, eq=False, slots=True)
class Displayed:
    """A pose on its ground: rotations [J, 4] and translations [J, 3] against parents, positions [J, 3] in the world."""

    rotations: Floats
    translations: Floats
    positions: Floats


@dataclass(frozen=True, eq=False)
class Legs:
    """The legs of a rig [2, 4], and the axes of their knees [2, 3]; those without hip and knee are left as the cycles have them."""

    rig: Skeleton
    legs: Ints
    hinges: Floats
    tops: list[int]

    @classmethod
    def of(cls, cycles: Sequence[Cycle]) -> Legs:
        rig = cycles[0].skeleton
        legs = legs_of(rig, cycles[0].feet)
        return cls(rig, legs, hinges_of(rig, legs, np.concatenate([cycle.rotations for cycle in cycles])), tops_of(rig))

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
        footings, hips = state.footings.copy(), state.hips.copy()
        goals, shares = np.empty((2, 3)), np.full(2, DOWN)
        for foot, at in enumerate(steps):
            goals[foot] = here = below(ground, at.last.x, at.last.z)
            if is_new:
                footings[foot] = *here, 0.0, 0.0, 0.0, *here
            if not at.is_down:
                shares[foot], goals[foot] = mix.stances.share_of_state(foot, phase), below(ground, at.next.x, at.next.z)
        feel_ground(footings, hips, goals, shares, is_new, dt_s)
        return GroundState(footings, hips, LEVEL.lower if is_new else state.lower)

    def displayed(
        self, state: GroundState, mix: Mix, phase: float, steps: tuple[Steps, Steps], place: Place3, dt_s: float
    ) -> tuple[Displayed, GroundState]:
        """The pose of the blend with its feet on their footsteps, and the ground with the hips as low as its legs need them."""
        rotations, translations = (each.copy() for each in mix.at(phase))
        positions, world = placed(self.rig, translations, rotations, place)
        toes = self._stood(state, mix, phase, steps, place, positions, world)
        raised, lower = float(state.hips[0]), state.lower.copy()
        lower_hips(positions, self.legs, toes, state.footings, raised, lower, dt_s)
        positions[:, 1] += raised - lower[0]
        translations[self.tops, 1] += raised - lower[0]
        stand_legs(self.rig.parents, positions, world, self.legs, self.hinges, toes, state.footings, rotations)
        positions, _ = placed(self.rig, translations, rotations, place)
        return Displayed(rotations, translations, positions), GroundState(state.footings, state.hips, lower)

    def _stood(
        self,
        state: GroundState,
        mix: Mix,
        phase: float,
        steps: tuple[Steps, Steps],
        place: Place3,
        positions: Floats,
        world: Floats,
    ) -> Floats:
        """Where each toe is to be; its foot is turned to the way it is to point."""
        own, toes = mix.toes_at(phase), np.empty((2, 3))
        sin, cos = math.sin(place[2]), math.cos(place[2])
        for foot, ((_, _, ankle, joint), at) in enumerate(zip(self.legs.tolist(), steps, strict=True)):
            weight, (x, z, turn) = ramp(mix, at, foot, phase, place)
            left, up, ahead = own[foot].tolist()
            there = np.array([place[0] + cos * left + sin * ahead, up, place[1] + cos * ahead - sin * left])
            if ankle < 0:
                toes[foot] = there
                continue
            toe = positions[joint].copy()
            toes[foot] = toe + weight * (there + np.array([x, 0.0, z]) - toe)
            toes[foot, 1] += state.footings[foot, 0]
            if turn != 0.0:
                self._turn(ankle, joint, weight * turn, positions, world)
        return toes

    def _turn(self, ankle: int, toe: int, turn: float, positions: Floats, world: Floats) -> None:
        """Turn a foot about the upright axis through its ankle."""
        about = np.array([math.cos(0.5 * turn), 0.0, math.sin(0.5 * turn), 0.0])
        world[ankle] = quaternions.multiply(about, world[ankle])
        positions[toe] = positions[ankle] + quaternions.rotate(about, positions[toe] - positions[ankle])
