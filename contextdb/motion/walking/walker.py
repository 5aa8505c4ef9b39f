"""A walker: the body that a game moves, as poses of blended cycles whose feet stand on their footsteps.

    body ─► speed, acceleration, turn (damped) ─► weights ─► phase ─► blended pose ─► footsteps ─► legs and hips ─► Pose

Golden rule: nothing here moves the body over the ground. The root of each pose is the game's body, to the last bit; only the hips
go up and down with the ground. What is damped is what the animation sees of the movement, never the movement.

A walker reads no clock and draws no random number. Standing is none of its cycles: at speed 0 it holds the pose that it is in.

Source: Forsyth, "How a Character Should Walk", Game Tech 2004.

A body goes over to the next faster gait above its own fastest cycle, and to the next slower one below its own slowest: where the
two overlap it keeps the one it has. Where they leave a gap between them, the gap is what it keeps its gait in.

Source: Forsyth, "How a Character Should Walk", Game Tech 2004: "transitioned while the foot is in the air, and the transition must
have finished by the time that foot hits".
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from contextdb.cells.arguments import require_kind, require_many_of, require_real
from contextdb.errors import ContextError, Fault, MotionError
from contextdb.files.settings import Declared, number
from contextdb.motion.clips.ground_place import A_BODY, OfBody, place_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.steering import Steered
from contextdb.motion.output.ground import A_GROUND, Ground
from contextdb.motion.output.legs import eased
from contextdb.motion.output.samples import Place3
from contextdb.motion.output.stream import Pose
from contextdb.motion.walking.blending import Gait, Mix, same_rig
from contextdb.motion.walking.footsteps import AN_ADJUST, Adjust, Footstep, Going, Steps, stepped
from contextdb.motion.walking.stances import Stances
from contextdb.motion.walking.standing import LEVEL, GroundState, Legs

STILL: Place3 = (0.0, 0.0, 0.0)
FAR_M, FASTEST_MPS = 1.0, 30.0
"""A body that comes farther than both allow between two updates was put elsewhere."""
LEAST_MPS = 1e-6


@dataclass(frozen=True, slots=True)
class WalkSettings(Declared, error=ContextError):
    """What counts as the full of an acceleration and of a turn, and how fast the blend follows them.

    Raises ContextError for numbers that are not above 0.
    """

    full_acceleration_mps2: float = number(
        "Where the cycles of speeding up and slowing down have all the weight.", 3.0, 1e-3, 1e6, "metres a second squared"
    )
    full_turn_dps: float = number("Where the cycles of turning have all the weight.", 180.0, 1e-3, 1e6, "degrees a second")
    halflife_s: float = number(
        "How fast speed, acceleration and turn, as the blend sees them, follow those of the body.", 0.15, 1e-3, 60.0, "seconds"
    )


USUAL = WalkSettings()


@dataclass(frozen=True, eq=False, slots=True)
class WalkState:
    """Where a walker is: all that its next pose depends on beside the next body. Never changed, so it may be stored as it is.

    `seen` is what the blend sees of the body: its speed, and its acceleration and turn as shares of the full of them; `seen_change`
    is how that changes a second.
    """

    phase: float = 0.0
    gait: GaitState | None = None
    going: Going | None = None
    seen: Place3 | None = None
    seen_change: Place3 = STILL
    steps: tuple[Steps, Steps] | None = None
    ground: GroundState | None = None


class Walker:
    """Gives the poses of one character that walks.

    Parameters
    ----------
    gaits : iterable of Gait
        From the slowest to the fastest; all of one rig.
    settings : WalkSettings
    phase : float
        Where in the cycle it begins, 0 to 1; 0 is the left foot in mid-stance.

    Raises
    ------
    MotionError
        No gait, gaits of different rigs, or not from slow to fast.
    ContextError
        An argument of another type.
    """

    def __init__(self, gaits: Iterable[Gait], settings: WalkSettings = USUAL, *, phase: float = 0.0) -> None:
        require_kind(settings, WalkSettings, "settings", "WalkSettings")
        self.gaits: tuple[Gait, ...] = tuple(require_many_of(gaits, Gait, "gaits", "a list of Gait"))
        self.settings = settings
        if not self.gaits:
            raise MotionError(Fault("there is no gait.", "at least one"))
        for slow, fast in pairwise(self.gaits):
            if not (slow.slowest_mps < fast.slowest_mps and slow.fastest_mps < fast.fastest_mps):
                raise MotionError(
                    Fault(f'"{slow.name}" is not slower than "{fast.name}".', "gaits from the slowest to the fastest")
                )
        self._cycles = tuple(cycle for gait in self.gaits for cycle in gait.cycles)
        same_rig(self._cycles)
        self._legs = Legs.of(self._cycles)
        self._state = WalkState(require_real(phase, "phase", 0.0, 1.0) % 1.0)

    @property
    def state(self) -> WalkState:
        """Where the walker is, to come back to with `restore`."""
        return self._state

    def restore(self, state: WalkState) -> None:
        """Go on from a state of this walker, or of another one of the same gaits. Raises ContextError for what is none."""
        require_kind(state, WalkState, "state", "a WalkState, what `state` gives")
        if state.gait is not None and max(state.gait.now, state.gait.to) >= len(self.gaits):
            raise ContextError(Fault("the state is of a walker of other gaits.", "a state of this walker"))
        self._state = state

    @property
    def phase(self) -> float:
        """How far through the cycle it is: 0 to 1."""
        return self._state.phase

    @property
    def gait(self) -> str:
        """The gait; in a change the one that it comes from."""
        return self.gaits[self._state.gait.now if self._state.gait else 0].name

    @property
    def weights(self) -> Mapping[str, float]:
        """The cycles that have weight now, by the names of their clips."""
        mix = self._mix(self._state)
        weights = dict.fromkeys((cycle.name for cycle in mix.cycles), 0.0)
        for cycle, weight in zip(mix.cycles, mix.weights, strict=True):
            weights[cycle.name] += weight
        return weights

    @property
    def footsteps(self) -> tuple[Footstep, ...]:
        """The last footstep of each foot, then the next of each; none before the first update."""
        steps = self._state.steps or ()
        return (*(each.last for each in steps), *(each.next for each in steps))

    def update(self, dt: float, body: OfBody, ground: Ground | None = None, adjust: Adjust | None = None) -> Pose:
        """The pose some time later.

        Parameters
        ----------
        dt : float
            Seconds since the last update.
        body : Steered or (x, z, heading)
            Where the game has the body now.
        ground : function, optional
            Of x and z: the height of the ground in metres and its normal, (nx, ny, nz), or None where it is flat.
        adjust : function, optional
            Of a `Footstep` that is foretold: the one to take instead, such as one that is away from an edge, or None to leave it.

        Returns
        -------
        Pose
            Its `root` is the body. `playing` is None: no clip plays.

        Raises
        ------
        ContextError
            An argument of another type, or a ground or a footstep that is none. The walker then is where it was.
        """
        dt = require_real(dt, "dt", 0.0)
        for function, what, accepted in ((ground, "ground", A_GROUND), (adjust, "adjust", AN_ADJUST)):
            if function is not None and not callable(function):
                raise ContextError(Fault(f"{what} is {function!r}.", accepted))
        place = place_of(body)
        if place is None:
            raise ContextError(Fault("there is no body.", A_BODY))
        state, is_new = self._moved(self._state, body, place, dt)
        before = self._state.going
        distance = math.dist(place[:2], before.place[:2]) if before is not None and not is_new else 0.0
        old = self._mix(state)
        step = distance / old.stride_m
        state = self._stepped(state, step)
        mix, going = self._mix(state), state.going
        assert going is not None
        own = state.steps if state.steps is not None and not is_new else (None, None)
        steps = (
            stepped(own[0], 0, mix, state.phase, going, adjust),
            stepped(own[1], 1, mix, state.phase, going, adjust),
        )
        return self._displayed(state, mix, steps, ground, dt, is_new, step)

    def _moved(self, state: WalkState, body: OfBody, place: Place3, dt: float) -> tuple[WalkState, bool]:
        """The state with what the game does with the body; and whether the body is new where it is."""
        before = state.going
        away = math.inf if before is None else math.dist(place[:2], before.place[:2])
        is_new = away > max(FAR_M, FASTEST_MPS * dt)
        movement = self._movement(body, place, None if is_new else before, dt)
        if movement is None:
            going = Going(place, before.movement if before is not None else STILL)
            return replace(state, going=going), is_new
        going = Going(place, movement)
        goal = self._goal(body, going, before, dt, is_known=not is_new and state.seen is not None)
        if state.seen is None or state.gait is None:
            first = next((i for i, each in enumerate(self.gaits) if going.speed_mps <= each.fastest_mps), len(self.gaits) - 1)
            return replace(state, gait=GaitState(first, first), going=going, seen=goal), True
        apart = state.seen[0] - goal[0], state.seen[1] - goal[1], state.seen[2] - goal[2]
        remaining, change = _decayed(np.array(apart), np.array(state.seen_change), self.settings.halflife_s, dt)
        speed, gained, turned = (np.array(goal) + remaining).tolist()
        return replace(state, going=going, seen=(speed, gained, turned), seen_change=tuple(change.tolist())), is_new

    def _movement(self, body: OfBody, place: Place3, before: Going | None, dt: float) -> Place3 | None:
        """How the body moves a second, to its left, ahead and turning; None where that is not to be known."""
        if isinstance(body, Steered):
            (x, z), turn = body.velocity, float(body.turn_rate)
        elif before is not None and dt > 0.0:
            x, z = ((place[i] - before.place[i]) / dt for i in (0, 1))
            turn = math.remainder(place[2] - before.place[2], math.tau) / dt
        else:
            return None
        heading = place[2]
        sin, cos = math.sin(heading), math.cos(heading)
        return cos * x - sin * z, sin * x + cos * z, turn

    def _goal(self, body: OfBody, going: Going, before: Going | None, dt: float, *, is_known: bool) -> Place3:
        """What the blend is to see of the body: its speed, and the shares of the full acceleration and of the full turn."""
        speed, gained = going.speed_mps, 0.0
        if isinstance(body, Steered) and speed > LEAST_MPS:
            gained = sum(a * v for a, v in zip(body.acceleration, body.velocity, strict=True)) / speed
        elif before is not None and is_known and dt > 0.0 and before.speed_mps > LEAST_MPS:
            gained = (speed - before.speed_mps) / dt
        shares = gained / self.settings.full_acceleration_mps2, math.degrees(going.movement[2]) / self.settings.full_turn_dps
        return speed, min(max(shares[0], -1.0), 1.0), min(max(shares[1], -1.0), 1.0)

    def _stepped(self, state: WalkState, step: float) -> WalkState:
        """The state with phase and gait a step of phase later."""
        gait, going = state.gait, state.going
        if gait is not None and going is not None:
            wanted = wanted_gait(self.gaits, gait.now, going.speed_mps)
            if wanted != gait.now or gait.is_changing:
                each = [Mix.of(own.cycles, own.weights(*(state.seen or STILL))).stances for own in self.gaits]
                gait = advanced(gait, self.gaits, wanted, each, state.phase, step)
        return replace(state, phase=(state.phase + step) % 1.0, gait=gait)

    def _mix(self, state: WalkState) -> Mix:
        gait, seen = state.gait or GaitState(0, 0), state.seen or STILL
        parts: list[Floats] = []
        for i, own in enumerate(self.gaits):
            share = gait.share if i == gait.to and gait.is_changing else 1.0 - gait.share if i == gait.now else 0.0
            parts.append(share * own.weights(*seen) if share > 0.0 else np.zeros(len(own.cycles)))
        return Mix.of(self._cycles, np.concatenate(parts))

    def _displayed(
        self, state: WalkState, mix: Mix, steps: tuple[Steps, Steps], ground: Ground | None, dt: float, is_new: bool, step: float
    ) -> Pose:
        """The pose on its ground; the walker then is in that state."""
        assert state.going is not None
        place = state.going.place
        below = self._legs.grounded(state.ground or LEVEL, mix, state.phase, steps, ground, dt, is_new or state.ground is None)
        pose, below = self._legs.displayed(below, mix, state.phase, steps, place, dt)
        self._state = replace(state, steps=steps, ground=below)
        duration_s = sum(weight * cycle.duration_s for cycle, weight in zip(mix.cycles, mix.weights, strict=True))
        rate = step * duration_s / dt if dt > 0.0 else 1.0
        contacts = np.array([each.is_down for each in steps], np.bool_)
        return Pose(None, False, False, place, pose.rotations, pose.translations, pose.positions, contacts, rate)


def _decayed(offset: Floats, speed: Floats, halflife_s: float, dt_s: float) -> tuple[Floats, Floats]:
    """Numbers that decay to 0 as critically damped springs, and their change a second, some time later."""
    y = 2.0 * math.log(2.0) / halflife_s
    pushed, fade = speed + offset * y, math.exp(-y * dt_s)
    return fade * (offset + pushed * dt_s), fade * (speed - pushed * y * dt_s)


# ---- the change from one gait to the next: begun when a foot lifts, over before that foot lands


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
