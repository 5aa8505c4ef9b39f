"""The change from one gait to the next: begun when a foot lifts, over before that foot lands.

A body goes over to the next faster gait above its own fastest cycle, and to the next slower one below its own slowest: where the
two overlap it keeps the one it has. Where they leave a gap between them, the gap is what it keeps its gait in.

Source: Forsyth, "How a Character Should Walk", Game Tech 2004: "transitioned while the foot is in the air, and the transition must
have finished by the time that foot hits".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from contextdb.motion.output.legs import eased
from contextdb.motion.walking.blending import Gait
from contextdb.motion.walking.stances import Stances

READY_SHARE = 0.95
"""Of the way to its landing: by then the change is over."""


@dataclass(frozen=True, slots=True)
class GaitState:
    """The gait, the one that it is changing to, or itself, the length of that change in phase, and how much of it has passed."""

    now: int
    to: int
    length: float = 0.0
    passed: float = 0.0

    @property
    def is_changing(self) -> bool:
        """Whether a change has begun and is not over."""
        return self.now != self.to

    @property
    def share(self) -> float:
        """How much of the gait that it is changing to is there, 0 to 1."""
        return eased(self.passed / self.length) if self.is_changing else 0.0


def wanted_gait(gaits: Sequence[Gait], now: int, speed_mps: float) -> int:
    """The gait that a speed asks for, of ascending gaits: its own, or one beside it."""
    if now + 1 < len(gaits) and speed_mps > max(_limits(gaits, now)):
        return now + 1
    if now > 0 and speed_mps < min(_limits(gaits, now - 1)):
        return now - 1
    return now


def advanced(state: GaitState, gaits: Sequence[Gait], wanted: int, each: Sequence[Stances], phase: float, step: float) -> GaitState:
    """The gait after a step of phase; `each` are the stances of every gait by itself at this speed."""
    if state.is_changing:
        passed = state.passed + step
        return GaitState(state.to, state.to) if passed >= state.length else GaitState(state.now, state.to, state.length, passed)
    if wanted == state.now:
        return state
    own, other = each[state.now], each[wanted]
    for foot in (0, 1):
        until = own.until_change(foot, phase)
        if own.is_down(foot, phase) and until <= step:
            lift = phase + until
            length = READY_SHARE * min((stances.down[foot] - lift) % 1.0 for stances in (own, other))
            if length > step - until:
                return GaitState(state.now, wanted, length, step - until)
    return state


def _limits(gaits: Sequence[Gait], slower: int) -> tuple[float, float]:
    """The two speeds between which both of two neighbouring gaits are retained."""
    return gaits[slower].fastest_mps, gaits[slower + 1].slowest_mps
