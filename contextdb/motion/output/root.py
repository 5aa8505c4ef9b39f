"""Where the body is: moved by the animation, by the game, or by both, and without a step in its velocity where what plays jumps.

Movement of the animation goes the way that the body is aligned to, in steps as long as its legs make.

In the mode "mixed" a share of the movement is the animation's and the rest the game's. What then lies between the character and the
game's body is made up for by and by, by at most half as far as the character moves itself, so that nobody slides while standing;
and never is it farther away than the clamp. The heading may be pulled by more with each metre that is walked: a clip that goes
straight on is steered along a curve, and turns on the feet that are locked.

In the mode "path" the way is the game's, and how fast it is gone is the animation's: what lies to the side of the way is made up
for, what lies along it is not. The game then goes on from the pose's root.

A jump moves nobody, but it changes the velocity of what plays. The difference decays as the offsets of joints do: the body runs on
or falls back a little, and comes to the path of what plays.

Source: Root Motion Weight in EA's talk; speed from the animation along a path from code in Remedy's; the
adjustment and the clamp of orangeduck/Motion-Matching, `controller.cpp`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from contextdb.motion.clips.steering import STANDING_MPS
from contextdb.motion.output.bank import Place3
from contextdb.motion.output.settings import PoseSettings
from contextdb.motion.output.stages import Posture, Tick, Warp, damping, decayed
from contextdb.motion.selection.root_motion import RootMotion

MOST_PULL = 0.5
"""The pull is at most this share of the character's own movement."""
TURN_PER_M = 6.0
"""So many radians of turning a metre of way allows the pull as well: who walks may be steered, and who stands is not turned."""
NOTHING: Place3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class RootState:
    """Where the root is without its offset, the offset and its change a second, and where the game's body was."""

    base: Place3
    offset: Place3
    offset_speed: Place3
    body: Place3 | None


@dataclass(frozen=True, slots=True)
class Root:
    """The stage: the root's place and heading."""

    settings: PoseSettings

    def begin(self, posture: Posture, body: Place3 | None) -> RootState:
        """At the game's body; without one where the posture has the root."""
        return RootState(posture.root if body is None else body, NOTHING, NOTHING, body)

    def apply(self, posture: Posture, tick: Tick, state: object) -> tuple[Posture, RootState]:
        """The posture at its place."""
        assert isinstance(state, RootState)
        position_share = _position_share(self.settings, tick.root_weight)
        rotations = rotation_share(self.settings, tick.root_weight)
        base = self._moved(state, tick, position_share, rotations)
        offset, speed = state.offset, state.offset_speed
        if self.settings.blend != "none":
            offset, speed = decayed(offset, speed, damping(self.settings.halflife_s), tick.dt_s)
            step = _step(tick, base[2], position_share, rotations)
            speed = _sum(speed, step)
            if tick.is_ahead:
                offset = _sum(offset, (step[0] * tick.dt_s, step[1] * tick.dt_s, step[2] * tick.dt_s))
        if self.settings.root in ("mixed", "path") and tick.body is not None:
            base = self._clamped(base, offset, tick.body, _way(tick) if self.settings.root == "path" else None)
        return Posture(posture.rotations, posture.positions, _sum(base, offset)), RootState(
            base, offset, speed, tick.body or state.body
        )

    def _moved(self, state: RootState, tick: Tick, position_share: float, rotation_share: float) -> Place3:
        """The base after this tick's movement and the pull to the game's body."""
        body = tick.body
        if body is None or self.settings.root == "animation":
            return _after(state.base, _warped(tick), position_share, rotation_share)
        if self.settings.root == "code":
            return body
        way = _way(tick) if self.settings.root == "path" else None
        x, z, heading = _after(state.base, _warped(tick), position_share, rotation_share)
        before = body if state.body is None else state.body
        if way is not None:
            far = math.hypot(x - state.base[0], z - state.base[1])
            x, z = state.base[0] + far * way[0], state.base[1] + far * way[1]
        x += (1.0 - position_share) * (body[0] - before[0])
        z += (1.0 - position_share) * (body[1] - before[1])
        heading += (1.0 - rotation_share) * math.remainder(body[2] - before[2], math.tau)
        moved = math.hypot(x - state.base[0], z - state.base[1])
        turned = abs(heading - state.base[2]) + TURN_PER_M * moved
        return self._pulled((x, z, heading), _beside((x, z), body, way), moved, turned, tick.dt_s)

    def _pulled(self, base: Place3, body: Place3, way: float, turned: float, dt_s: float) -> Place3:
        """The base nearer to the game's body, by what it moved and turned itself at most."""
        x, z, heading = body[0] - base[0], body[1] - base[1], math.remainder(body[2] - base[2], math.tau)
        apart = math.hypot(x, z)
        share = _made_up(self.settings.position_pull_s, dt_s)
        share = min(share, MOST_PULL * way / apart) if apart > 0.0 else 0.0
        turn_share = _made_up(self.settings.rotation_pull_s, dt_s)
        turn = math.copysign(min(turn_share * abs(heading), MOST_PULL * turned), heading)
        return base[0] + share * x, base[1] + share * z, base[2] + turn

    def _clamped(self, base: Place3, offset: Place3, body: Place3, along: tuple[float, float] | None) -> Place3:
        """The base from which the shown root is within the clamp: of the body, or of its way where that is given."""
        x, z, heading = _sum(base, offset)
        body = _beside((x, z), body, along)
        left, ahead, turn = x - body[0], z - body[1], math.remainder(heading - body[2], math.tau)
        apart, most = math.hypot(left, ahead), self.settings.position_clamp_m
        share = most / apart - 1.0 if apart > most else 0.0
        most_turn = math.radians(self.settings.rotation_clamp_deg)
        over = turn - min(max(turn, -most_turn), most_turn)
        return base[0] + share * left, base[1] + share * ahead, base[2] - over


def rotation_share(settings: PoseSettings, root_weight: float) -> float:
    """How much of the turning is the animation's."""
    if settings.root == "mixed":
        return root_weight * settings.rotation_weight
    return 1.0 if settings.root == "animation" else 0.0


def _position_share(settings: PoseSettings, root_weight: float) -> float:
    """How much of the movement is the animation's."""
    if settings.root == "mixed":
        return root_weight * settings.position_weight
    return 0.0 if settings.root == "code" else 1.0


def _sum(first: Place3, second: Place3) -> Place3:
    return first[0] + second[0], first[1] + second[1], first[2] + second[2]


def _after(base: Place3, motion: RootMotion, position_share: float, rotation_share: float) -> Place3:
    """A place after a share of a movement in its own frame."""
    sin, cos = math.sin(base[2]), math.cos(base[2])
    left, ahead = position_share * motion.left_m, position_share * motion.ahead_m
    return base[0] + cos * left + sin * ahead, base[1] - sin * left + cos * ahead, base[2] + rotation_share * motion.turn_rad


def _warped(tick: Tick) -> RootMotion:
    """The movement of what plays, turned and stretched as the legs were."""
    return _bent(tick.root_motion, tick.warp)


def _bent(motion: RootMotion, warp: Warp) -> RootMotion:
    if warp.turn == 0.0 and warp.stride == 1.0:
        return motion
    sin, cos = warp.stride * math.sin(warp.turn), warp.stride * math.cos(warp.turn)
    left, ahead = motion.left_m, motion.ahead_m
    return RootMotion(cos * left + sin * ahead, cos * ahead - sin * left, motion.turn_rad)


def _way(tick: Tick) -> tuple[float, float] | None:
    """Which way the game goes; none where it stands."""
    x, z = tick.velocity or (0.0, 0.0)
    size = math.hypot(x, z)
    return (x / size, z / size) if size > STANDING_MPS else None


def _beside(place: tuple[float, float], body: Place3, way: tuple[float, float] | None) -> Place3:
    """The body, moved along its way to beside a place."""
    if way is None:
        return body
    along = (place[0] - body[0]) * way[0] + (place[1] - body[1]) * way[1]
    return body[0] + along * way[0], body[1] + along * way[1], body[2]


def _step(tick: Tick, heading: float, position_share: float, rotation_share: float) -> Place3:
    """By how much the velocity of what plays drops at a seam, over the ground of the world."""
    if tick.left is None or tick.entered is None:
        return NOTHING
    entered = tick.entered.root_velocity
    if tick.is_ahead and tick.dt_s > 0.0:
        own = tick.root_motion
        entered = own.left_m / tick.dt_s, own.ahead_m / tick.dt_s, own.turn_rad / tick.dt_s
    left, ahead, turn = (a - b for a, b in zip(tick.left.root_velocity, entered, strict=True))
    x, z, _ = _after((0.0, 0.0, heading), _bent(RootMotion(left, ahead), tick.warp), position_share, 0.0)
    return x, z, rotation_share * turn


def _made_up(halflife_s: float, dt_s: float) -> float:
    """The share of a difference that is gone after some time; none where no half-life is set."""
    return 1.0 - math.exp(-math.log(2.0) * dt_s / halflife_s) if halflife_s > 0.0 else 0.0
