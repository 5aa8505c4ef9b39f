"""Path alignment: a body whose clip goes another way than the game wants turns its hips and legs to that way, and keeps its chest.

    turn     the angle from where the clip goes to where the game goes, at most the limit; none beyond 90°
    hips     turned by it; each joint of the spine turns a part of it back, so that the chest faces as it did
    root     what the clip moves it goes the new way too (`contextdb.motion.output.root`)

Without it feet slide by 2 v sin(turn / 2). The turn comes to its angle as a critically damped spring does, without a step in its
speed. Where the clip goes is a mean over a second, for a body sways with each step.

The same stage says how much longer or shorter the steps are to be: the game's speed over the clip's, within limits, as far as the
play rate has not made up for it. `contextdb.motion.output.feet` bends the legs to that.

Source: orientation and stride warping of Unreal's Animation Warping; the alignment of strafes in Remedy's talk.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints, Skeleton
from contextdb.motion.output import kernels
from contextdb.motion.output.bank import Place3, PoseBank, tops_of
from contextdb.motion.output.settings import PoseSettings
from contextdb.motion.output.stages import UNWARPED, Posture, Tick, Warp, damping

LEAST_MPS = 0.2
"""What goes slower goes nowhere: neither turn nor stride are wanted of it."""
MOST_TURN = math.pi / 2.0


@dataclass(frozen=True, eq=False, slots=True)
class Spine:
    """The joints that hang on the root, where they are in positions [M, 3], and the joints from the hips to the chest, which turn
    back: after each so much of the turn is left."""

    tops: Ints
    places: Ints
    joints: Ints
    left: Floats


@dataclass(frozen=True, eq=False, slots=True)
class Alignment:
    """The stage; its state is the `Warp`."""

    settings: PoseSettings
    parents: Ints
    spine: Spine | None

    @classmethod
    def of(cls, settings: PoseSettings, bank: PoseBank) -> Alignment:
        """For a rig; one without feet, or without a spine, is left as it is."""
        return cls(settings, bank.skeleton.parents, spine_of(bank))

    def begin(self, posture: Posture, body: Place3 | None) -> Warp:
        """Nothing is turned."""
        return UNWARPED

    def apply(self, posture: Posture, tick: Tick, state: object) -> tuple[Posture, Warp]:
        """The posture with its hips turned, and its warp."""
        assert isinstance(state, Warp)
        if self.spine is None:
            return posture, UNWARPED
        y = damping(self.settings.alignment_halflife_s)
        turn, stride = self._wanted(posture.root[2], tick)
        warp = Warp(
            *_followed(state.turn, state.turn_speed, turn, y, tick.dt_s),
            *_followed(state.stride, state.stride_speed, stride, y, tick.dt_s),
        )
        if warp.turn == 0.0:
            return Posture(posture.rotations, posture.positions, posture.root, warp), warp
        rotations, positions, spine = posture.rotations.copy(), posture.positions.copy(), self.spine
        kernels.align(self.parents, spine.tops, spine.places, spine.joints, spine.left, warp.turn, rotations, positions)
        return Posture(rotations, positions, posture.root, warp), warp

    def _wanted(self, heading: float, tick: Tick) -> tuple[float, float]:
        """The turn and the stride that the game's velocity asks for; 0 and 1 where either body stands."""
        (left, ahead, sway), (x, z) = tick.travel, tick.velocity or (0.0, 0.0)
        own, wanted = math.hypot(left, ahead), math.hypot(x, z)
        if own < LEAST_MPS or wanted < LEAST_MPS:
            return 0.0, 1.0
        turn = math.remainder(math.atan2(x, z) - (heading - sway) - math.atan2(left, ahead), math.tau)
        if abs(turn) > MOST_TURN:
            return 0.0, 1.0
        limit = math.radians(self.settings.alignment_limit_deg) if self.settings.path_alignment else 0.0
        stride = 1.0 if self.settings.root == "path" else wanted / own
        return min(max(turn, -limit), limit), min(max(stride, self.settings.min_stride), self.settings.max_stride)


def spine_of(bank: PoseBank) -> Spine | None:
    """The spine of a rig: from where the legs part up to where the arms do; None where there are no feet or nothing above them."""
    rig = bank.skeleton
    if not bank.feet:
        return None
    legs = [{rig.index(foot), *rig.ancestors(rig.index(foot))} for foot in bank.feet]
    shared = set.intersection(*legs)
    hips = max(shared, key=lambda joint: int(rig.depths[joint]), default=0)
    above = [joint for joint in _below(rig, hips) if not any(joint in leg for leg in legs)]
    joints: list[int] = []
    while above:
        joints.append(max(above, key=lambda joint: _size(rig, joint)))
        above = [joint for joint in _below(rig, joints[-1]) if _below(rig, joint)]
        if len(above) > 1:
            break
    if not joints:
        return None
    tops = np.array(tops_of(rig), np.int64)
    left = 1.0 - np.arange(1, len(joints) + 1) / len(joints)
    return Spine(tops, np.searchsorted(bank.moving, tops), np.array(joints, np.int64), left)


def _below(rig: Skeleton, joint: int) -> list[int]:
    return [other for other in range(rig.n_joints) if rig.parents[other] == joint]


def _size(rig: Skeleton, joint: int) -> int:
    """How many joints hang on a joint, itself among them."""
    return 1 + sum(_size(rig, other) for other in _below(rig, joint))


def _followed(value: float, speed: float, goal: float, y: float, dt_s: float) -> tuple[float, float]:
    """A number that comes to a goal as a critically damped spring, and its change a second."""
    apart = value - goal
    pushed, fade = speed + apart * y, math.exp(-y * dt_s)
    return goal + fade * (apart + pushed * dt_s), fade * (speed - pushed * y * dt_s)
