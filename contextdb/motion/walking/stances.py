"""When each foot stands in a cycle: one interval of phases a foot, and how much it is held there.

A phase is a share of the cycle, from 0 to 1, and then 0 again. Foot 0 is the left one, foot 1 the right one. A foot that slips, as
that of a sprinter does, is held in part: 1 is held where it came down, 0 not at all.

Source: Forsyth, "How a Character Should Walk", Game Tech 2004: "just represented by two times for each single walk cycle".
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contextdb.cells.arguments import require_many, require_numbers, require_real, require_whole
from contextdb.errors import ContextError, Fault, MotionError

Pair = tuple[float, float]

DOWN_SHARE = 0.95
"""Of the most that a curve has: there the foot is down."""
A_FOOT = "0, the left foot, or 1, the right one"
A_CURVE = "one number from 0 to 1 for each foot at moments that are evenly spread over the cycle, [n, 2]"


@dataclass(frozen=True)
class Stances:
    """When each foot of a cycle is down.

    Raises
    ------
    MotionError
        A phase is not in 0 to 1, or a hold is none.
    """

    down: Pair
    up: Pair
    """`down`, `up`: the phases at which a foot comes down and goes up."""
    holds: Pair = (1.0, 1.0)
    """How much each foot is held where it came down."""

    def __post_init__(self) -> None:
        for name in ("down", "up", "holds"):
            values = getattr(self, name)
            if not isinstance(values, tuple) or len(values) != 2:
                raise MotionError(Fault(f"{name} is {values!r}.", "two numbers from 0 to 1: of the left foot and of the right one"))
            checked = tuple(require_real(value, f"one of {name}", 0.0, 1.0) for value in values)
            object.__setattr__(self, name, checked if name == "holds" else tuple(value % 1.0 for value in checked))

    @classmethod
    def of_curves(cls, curves: object) -> Stances:
        """Of an attribute that an artist has drawn: a foot is down where its curve is within 5 % of its highest value, which is how
        much the foot is held. Raises MotionError where the numbers are no such curves, or a foot is never up, never down, or down
        more than once; ContextError where they are no numbers."""
        values = require_numbers(curves, "curves")
        if values.ndim != 2 or values.shape[1] != 2 or len(values) < 2 or not ((values >= 0.0) & (values <= 1.0)).all():
            raise MotionError(Fault(f"the curves have shape {values.shape}, or are not from 0 to 1.", A_CURVE))
        edges = [_edges(values[:, foot], foot) for foot in (0, 1)]
        most = values.max(axis=0)
        return cls((edges[0][0], edges[1][0]), (edges[0][1], edges[1][1]), (float(most[0]), float(most[1])))

    def is_down(self, foot: int, phase: float) -> bool:
        """Whether a foot is down at a phase."""
        foot, phase = _foot(foot), require_real(phase, "phase")
        return (phase - self.down[foot]) % 1.0 < self.length(foot)

    def until_change(self, foot: int, phase: float) -> float:
        """The share of the cycle until a foot next comes down or goes up."""
        foot, phase = _foot(foot), require_real(phase, "phase")
        edge = self.up[foot] if self.is_down(foot, phase) else self.down[foot]
        until = (edge - phase) % 1.0
        return until if until < 1.0 else 0.0  # a hair before the edge rounds to a whole cycle

    def share_of_state(self, foot: int, phase: float) -> float:
        """How much of the time for which a foot is down, or up, has passed: 0 to 1."""
        foot, phase = _foot(foot), require_real(phase, "phase")
        is_down, length = self.is_down(foot, phase), self.length(foot)
        since = (phase - (self.down if is_down else self.up)[foot]) % 1.0
        whole = length if is_down else 1.0 - length
        return min(since / whole, 1.0) if whole > 0.0 else 0.0

    def length(self, foot: int) -> float:
        """The share of the cycle for which a foot is down."""
        return (self.up[foot] - self.down[foot]) % 1.0

    def middle(self, foot: int) -> float:
        """The phase in the middle of a foot's stance."""
        return (self.down[foot] + 0.5 * self.length(foot)) % 1.0

    def shifted(self, phase: float) -> Stances:
        """The same stances, counted from another phase."""
        edges = [[(edge - phase) % 1.0 for edge in both] for both in (self.down, self.up)]
        return Stances((edges[0][0], edges[0][1]), (edges[1][0], edges[1][1]), self.holds)


def blended_stances(stances: Sequence[Stances], weights: Sequence[float]) -> Stances:
    """The stances between some, by weights that sum to one: each edge is their weighted mean on the circle.

    Raises ContextError for none, or where there is not one weight for each.
    """
    listed, shares = list(require_many(stances, "stances", "a list of Stances")), list(weights)
    if not listed or len(listed) != len(shares) or any(not isinstance(each, Stances) for each in listed):
        raise ContextError(Fault(f"{len(listed)} stances and {len(shares)} weights.", "Stances, and a weight for each"))
    down, up = (_means([getattr(each, edge) for each in listed], shares) for edge in ("down", "up"))
    holds = [sum(share * each.holds[foot] for share, each in zip(shares, listed, strict=True)) for foot in (0, 1)]
    return Stances(down, up, (min(max(holds[0], 0.0), 1.0), min(max(holds[1], 0.0), 1.0)))


def _means(edges: Sequence[Pair], weights: Sequence[float]) -> Pair:
    return _mean([edge[0] for edge in edges], weights), _mean([edge[1] for edge in edges], weights)


def _mean(phases: Sequence[float], weights: Sequence[float]) -> float:
    """The weighted mean of phases on the circle, counted from the first of them: that of equal ones is exactly the same."""
    first, sines, cosines = phases[0], 0.0, 0.0
    for phase, weight in zip(phases, weights, strict=True):
        sines += weight * math.sin(math.tau * (phase - first))
        cosines += weight * math.cos(math.tau * (phase - first))
    return (first + math.atan2(sines, cosines) / math.tau) % 1.0


def _foot(foot: object) -> int:
    number = require_whole(foot, "foot")
    if number not in (0, 1):
        raise ContextError(Fault(f"there is no foot {number}.", A_FOOT))
    return number


def _edges(curve: np.ndarray, foot: int) -> Pair:
    """Where a curve goes over the bar, and below it again, between its moments."""
    bar, n, side = DOWN_SHARE * curve.max(), len(curve), ("left", "right")[foot]
    is_down, after = curve >= bar, np.roll(curve, -1)
    rises, falls = np.flatnonzero(~is_down & (after >= bar)), np.flatnonzero(is_down & (after < bar))
    if len(rises) != 1:
        problem = f"comes down {len(rises)} times" if len(rises) else "never comes down, or never goes up"
        raise MotionError(
            Fault(f"the {side} foot {problem} in the curves.", "a foot that comes down once and goes up once in a cycle")
        )
    down, up = (i + (bar - curve[i]) / (after[i] - curve[i]) for i in (int(rises[0]), int(falls[0])))
    return float(down / n) % 1.0, float(up / n) % 1.0
