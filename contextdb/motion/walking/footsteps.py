"""Where feet stand: the last footstep of each foot, frozen when it came down, and the next, foretold in each update.

A footstep is where the toe stands in mid-stance, as the body will be then: on a straight way that is where it comes down, and in a
turn or a strafe the foot comes down such that it is below the body, and straight, when the body is over it.

    wanted      the body in that mid-stance, by the game's movement, and the blend's toe against it
    reference   the same by the blend's own movement: where the toe stands when nothing is done
    delta       from the reference to what is wanted; 0 where the game moves the body as the cycles do

Source: Forsyth, "How a Character Should Walk", Game Tech 2004.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from contextdb.errors import ContextError, Fault
from contextdb.motion.output.samples import Place3
from contextdb.motion.walking.blending import Mix
from contextdb.motion.walking.places import HERE, joined, moved

FAR_M = 1.0
"""A footstep that is farther from where the blend has it belongs to a body that was put elsewhere."""
LONGEST_S = 2.0
"""No body is foretold for longer."""
LEAST_MPS = 1e-6


@dataclass(frozen=True, slots=True)
class Footstep:
    """Where a foot stands."""

    foot: int
    """0 is the left one, 1 the right one."""
    x: float
    z: float
    """`x`, `z`: of the toe, metres."""
    heading: float
    """That of the body when it is over the foot, radians."""


Adjust = Callable[[Footstep], Footstep | None]
AN_ADJUST = "a function of a Footstep that gives another one of the same foot, or None to leave it"


@dataclass(frozen=True, slots=True)
class Steps:
    """One foot: whether it is down, and its last and next footstep."""

    is_down: bool
    last: Footstep
    next: Footstep


@dataclass(frozen=True, slots=True)
class Going:
    """Where a body is and how it moves: its place, and to its left, ahead and turning, a second."""

    place: Place3
    movement: Place3

    @property
    def speed_mps(self) -> float:
        """Metres a second over the ground."""
        return math.hypot(self.movement[0], self.movement[1])


def stepped(own: Steps | None, foot: int, mix: Mix, phase: float, going: Going, adjust: Adjust | None) -> Steps:
    """The footsteps of a foot after an update: the next one foretold, and the last one frozen where the foot has come down."""
    is_down = mix.stances.is_down(foot, phase)
    behind, ahead = middles(mix, foot, phase)
    if own is None:
        place = reference(mix, foot, behind, phase, going.place)
        own = Steps(is_down, place, place)
    if is_down and not own.is_down:
        own = Steps(True, adjusted(foretold(mix, foot, behind, phase, going), adjust), own.next)
    last, seen = own.last, reference(mix, foot, behind, phase, going.place)
    if math.hypot(last.x - seen.x, last.z - seen.z) > FAR_M:
        last = seen
    return Steps(is_down, last, adjusted(foretold(mix, foot, ahead, phase, going), adjust))


def middles(mix: Mix, foot: int, phase: float) -> tuple[float, float]:
    """How far away in phase, below 0 where it is past, the mid-stances of a foot's last footstep and of its next one are."""
    stances = mix.stances
    ahead = (stances.middle(foot) - phase) % 1.0
    if stances.is_down(foot, phase) and ahead <= 0.5:
        return ahead, ahead + 1.0
    return ahead - 1.0, ahead


def foretold(mix: Mix, foot: int, away: float, phase: float, going: Going) -> Footstep:
    """The footstep of a mid-stance so far away, by the game's movement of the body."""
    speed = going.speed_mps
    seconds = min(max(away * mix.stride_m / speed, -LONGEST_S), LONGEST_S) if speed > LEAST_MPS else 0.0
    return _step(mix, foot, phase + away, joined(going.place, moved(going.movement, seconds)))


def reference(mix: Mix, foot: int, away: float, phase: float, place: Place3) -> Footstep:
    """The footstep of a mid-stance so far away, by the blend's own movement."""
    return _step(mix, foot, phase + away, joined(place, moved(mix.movement, away)))


def _step(mix: Mix, foot: int, phase: float, body: Place3) -> Footstep:
    toe = mix.toes_at(phase)[foot].tolist()
    x, z, heading = joined(body, (toe[0], toe[2], 0.0))
    return Footstep(foot, x, z, heading)


def adjusted(step: Footstep, adjust: Adjust | None) -> Footstep:
    """A footstep as the game moves it. Raises ContextError where it gives something else."""
    if adjust is None:
        return step
    adjustment = adjust(step)
    if adjustment is None:
        return step
    if not isinstance(adjustment, Footstep) or adjustment.foot != step.foot:
        raise ContextError(Fault(f"adjust gave {adjustment!r}.", AN_ADJUST))
    if not all(isinstance(each, (int, float)) and math.isfinite(each) for each in (adjustment.x, adjustment.z, adjustment.heading)):
        raise ContextError(Fault(f"adjust gave {adjustment!r}.", "finite numbers"))
    return adjustment


def delta(wanted: Footstep, seen: Footstep) -> Place3:
    """From where a foot would stand to where it is to stand: metres along x and z, and a turn."""
    return wanted.x - seen.x, wanted.z - seen.z, math.remainder(wanted.heading - seen.heading, math.tau)


def ramp(mix: Mix, own: Steps, foot: int, phase: float, place: Place3) -> tuple[float, Place3]:
    """How much of a correction a foot has, and that correction: metres along x and z, and a turn.

    All of the last footstep's while the foot is down, so that it stands; less and less in the first half of the swing, and none in
    its middle; then more and more of the next footstep's, until the foot comes down.
    """
    stances = mix.stances
    behind, ahead = middles(mix, foot, phase)
    half, swing = 0.5 * stances.length(foot), 0.0 if own.is_down else stances.share_of_state(foot, phase)
    if own.is_down:
        weight, step, away, edge, left = 1.0, own.last, behind, phase, behind
    elif swing < 0.5:
        weight, step, away, edge, left = 1.0 - 2.0 * swing, own.last, behind, stances.up[foot], -half
    else:
        weight, step, away, edge, left = 2.0 * swing - 1.0, own.next, ahead, stances.down[foot], half
    x, z, turn = delta(step, reference(mix, foot, away, phase, place))
    to_left, to_ahead = slip(mix, foot, edge, left)
    sin, cos = math.sin(place[2]), math.cos(place[2])
    return stances.holds[foot] * weight, (x + cos * to_left + sin * to_ahead, z + cos * to_ahead - sin * to_left, turn)


def slip(mix: Mix, foot: int, phase: float, away: float) -> tuple[float, float]:
    """What takes a toe at a phase to where it stands in a mid-stance so far away: to the left of the body and ahead; 0 for a toe
    that stands still in the cycles."""
    planted = reference(mix, foot, away, phase, HERE)
    toe = mix.toes_at(phase)[foot].tolist()
    return planted.x - toe[0], planted.z - toe[2]
