"""Which cycles make up a walk now, and with which weights; one phase for all of them.

A weight is the product of four columns that each sum to one:

    gait            by `contextdb.motion.walking.walker`
    speed           the nearest two steady cycles of the gait; the slowest below it, the fastest above it
    acceleration    slowing down, steady, speeding up
    turn            to the right, none, to the left

A product for which there is no cycle goes to that of its steady neighbour, so that the weights of those that there are still sum
to one and have no step. All play in one phase, which advances by the metres that the body comes, over the weighted mean of the
strides: with that, feet that stand in the cycles stand in their blend.

Source: Forsyth, "How a Character Should Walk", Game Tech 2004, who blends frequencies instead of strides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from contextdb.cells.arguments import require_kind, require_many_of, require_real, require_text
from contextdb.errors import Fault, MotionError, in_quotes
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.output.bank import RIG_MEND
from contextdb.motion.output.samples import Place3
from contextdb.motion.walking.cycle import Cycle
from contextdb.motion.walking.stances import Stances, blended_stances

CORNERS = ("speeding_up", "slowing_down", "turning_left", "turning_right")


@dataclass(frozen=True, eq=False)
class Gait:
    """The cycles of one gait, such as walking.

    Raises
    ------
    MotionError
        No steady cycle, two of one speed, or cycles of different rigs.
    ContextError
        An argument of another type.
    """

    name: str
    steady: Sequence[Cycle]
    """At least one; given in any order, kept from the slowest to the fastest."""
    speeding_up: Cycle | None = None
    slowing_down: Cycle | None = None
    turning_left: Cycle | None = None
    turning_right: Cycle | None = None
    """`speeding_up`, `slowing_down`, `turning_left`, `turning_right`: how a body holds itself at the full of each. They go
    straight on, at a middle speed."""

    def __post_init__(self) -> None:
        require_text(self.name, "name")
        steady = sorted(require_many_of(self.steady, Cycle, "steady", "a list of Cycle"), key=lambda cycle: cycle.speed_mps)
        for corner in CORNERS:
            require_kind(getattr(self, corner), (Cycle, type(None)), corner, "a Cycle, or None")
        object.__setattr__(self, "steady", tuple(steady))
        if not steady:
            raise MotionError(Fault(f"the gait {in_quotes(self.name)} has no steady cycle.", "at least one"))
        for slow, fast in pairwise(steady):
            if slow.speed_mps == fast.speed_mps:
                problem = f"{in_quotes(slow.name)} and {in_quotes(fast.name)} are both {slow.speed_mps:g} m/s fast."
                raise MotionError(Fault(problem, "steady cycles of different speeds"))
        same_rig(self.cycles)

    @cached_property
    def cycles(self) -> tuple[Cycle, ...]:
        """All cycles: the steady ones, then those of the corners that there are."""
        corners = [getattr(self, corner) for corner in CORNERS]
        return (*self.steady, *(cycle for cycle in corners if cycle is not None))

    @property
    def slowest_mps(self) -> float:
        """The speed of the slowest steady cycle."""
        return self.steady[0].speed_mps

    @property
    def fastest_mps(self) -> float:
        """The speed of the fastest steady cycle."""
        return self.steady[-1].speed_mps

    def weights(self, speed_mps: float, acceleration: float = 0.0, turn: float = 0.0) -> Floats:
        """The weight of each of `cycles`, which sum to one; acceleration and turn from -1 to 1, where 1 is the full of it."""
        speed_mps, acceleration, turn = (
            require_real(value, name) for value, name in ((speed_mps, "speed_mps"), (acceleration, "acceleration"), (turn, "turn"))
        )
        weights = np.zeros(len(self.cycles))
        speeds = _between([cycle.speed_mps for cycle in self.steady], speed_mps)
        for i, of_acceleration in enumerate(_column(acceleration)):
            for j, of_turn in enumerate(_column(turn)):
                place = self._corners[i][j]
                if place is None:
                    weights[: len(self.steady)] += of_acceleration * of_turn * speeds
                else:
                    weights[place] += of_acceleration * of_turn
        return weights

    @cached_property
    def _corners(self) -> list[list[int | None]]:
        """The cycle of each acceleration (none, up, down) and turn (none, left, right), by its place; None: the steady ones."""
        at = {id(cycle): i for i, cycle in enumerate(self.cycles)}
        up, down, left, right = (None if each is None else at[id(each)] for each in (getattr(self, name) for name in CORNERS))
        turns = [None, left, right]
        return [turns, *([turn if own is None else own for turn in turns] for own in (up, down))]


def same_rig(cycles: Sequence[Cycle]) -> None:
    """Raise MotionError for cycles of different rigs or feet."""
    first = cycles[0]
    for other in cycles[1:]:
        same = other.skeleton.names == first.skeleton.names and np.array_equal(other.skeleton.parents, first.skeleton.parents)
        if not same or other.feet != first.feet:
            problem = f"{in_quotes(first.name)} and {in_quotes(other.name)} are of different rigs."
            raise MotionError(Fault(problem, "cycles of one rig", RIG_MEND))


def _column(value: float) -> tuple[float, float, float]:
    """The shares of none, of the full of it, and of the full of its opposite; they sum to one."""
    value = min(max(value, -1.0), 1.0)
    return 1.0 - abs(value), max(value, 0.0), max(-value, 0.0)


def _between(speeds: Sequence[float], speed_mps: float) -> Floats:
    """The weights of ascending speeds: those of the nearest two, or of the first or last alone."""
    at = float(np.interp(speed_mps, speeds, np.arange(len(speeds))))
    low = min(int(at), len(speeds) - 1)
    shares = np.zeros(len(speeds))
    shares[low] = 1.0 - (at - low)
    if at > low:
        shares[low + 1] = at - low
    return shares


@dataclass(frozen=True, eq=False)
class Mix:
    """Cycles with weights that sum to one; those without weight are left out."""

    cycles: tuple[Cycle, ...]
    weights: tuple[float, ...]

    @classmethod
    def of(cls, cycles: Sequence[Cycle], weights: Floats) -> Mix:
        """Those of the cycles that have weight."""
        indices = [i for i, weight in enumerate(weights.tolist()) if weight > 0.0]
        return cls(tuple(cycles[i] for i in indices), tuple(weights[indices].tolist()))

    @cached_property
    def movement(self) -> Place3:
        """How far the body comes in one cycle of the blend: to the left, ahead, and turning."""
        left, ahead, turn = (sum(w * c.movement[i] for c, w in self._pairs) for i in range(3))
        return left, ahead, turn

    @cached_property
    def stride_m(self) -> float:
        return sum(weight * cycle.stride_m for cycle, weight in self._pairs)

    @cached_property
    def stances(self) -> Stances:
        """When the feet are down in the blend."""
        return blended_stances([cycle.stances for cycle in self.cycles], self.weights)

    def toes_at(self, phase: float) -> Floats:
        """Where both toes are at a phase, against the body: [2, 3]."""
        return np.asarray(sum(weight * cycle.toes_at(phase) for cycle, weight in self._pairs))

    def at(self, phase: float) -> tuple[Floats, Floats]:
        """Rotations [J, 4] and positions [J, 3] at a phase: rotations as weighted sums on the side of the heaviest cycle's."""
        if len(self.cycles) == 1:
            return self.cycles[0].at(phase)
        poses = [cycle.at(phase) for cycle in self.cycles]
        heaviest = poses[int(np.argmax(self.weights))][0]
        mixed, placed = np.zeros_like(heaviest), np.zeros_like(poses[0][1])
        for (rotations, positions), weight in zip(poses, self.weights, strict=True):
            signs = np.where((rotations * heaviest).sum(axis=-1, keepdims=True) < 0.0, -weight, weight)
            mixed += signs * rotations
            placed += weight * positions
        return mixed / np.linalg.norm(mixed, axis=-1, keepdims=True), placed

    @property
    def _pairs(self) -> list[tuple[Cycle, float]]:
        return list(zip(self.cycles, self.weights, strict=True))
