"""Legs: steps as long as the way asks for, feet on the ground that the game has, and feet that stay where they came down.

Stride: a foot is moved along the way, away from or to the point below its hip, by as much as the stride is longer or shorter.

Ground: a foot that is down stands on the ground below it, as steep as that is; one that is up goes from the ground that it left to
that where its clip will put it down: up in the first half of its swing, down in the second. The hips go by the lowest of these, and
all comes there as critically damped springs do, so that a step of the ground is none of the body. On flat ground nothing changes.

Lock: when a foot comes down in the clip its place over the ground is kept, and its height comes to that of the clip, rolls and all.
It is let go when it goes up in the clip, or when it would be farther from the clip's place than the radius; then what lies between
the two decays as a spring. It goes up with the clip's own velocity; only where it had to be let go does its velocity change
by and by. One that was let go while it was down is locked again when it has nearly come to its clip's place.

The hips go down so that legs reach, stretched no more than in the clip or than a knee of 170°: the nearer a leg is to that, the
more of the way is theirs, so that no knee stops at once. The place of a foot is that of the toe where it has one, else of the
ankle. The hip and knee turn so that the foot gets there, and the foot keeps its rotation but for the slope. What a knee bends more
than in the clip it bends about the axis that it has on the mean of the clips, as that of a knee that is nearly straight may point
anywhere. A leg cannot become longer: a place out of its reach is not reached.

Contacts are those of the clip, as those of the shown pose would hide the worst slides.

Source: orangeduck/Motion-Matching, `contact_update` and `ik_two_bone`; stride warping of Unreal's Animation Warping; feet, hips and
the knee's damping from Forsyth, "How a Character Should Walk".
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.foot_state import FAR_M, FREE, HIPS_DAMPING, LOCKED, POINT, SEEN
from contextdb.motion.output.ground import Footing, Triple, standing, swinging
from contextdb.motion.output.legs import LEFT, eased, hinge_of, leg_of
from contextdb.motion.output.samples import Flags, Place3
from contextdb.motion.output.stages import FEET, FOOT, FOOTING, FOOTINGS, HIPS, STRIDE, TURN, Columns, decayed

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


def legs_of(bank: PoseBank) -> Ints:
    """The hip, knee, ankle and what stands of each foot that a bank has contacts of, all `NO_LEG` for one without a leg: [F, 4]."""
    legs = [leg_of(bank.skeleton, foot) for foot in bank.feet]
    joints = [[NO_LEG] * 4 if leg is None else [*leg.joints.tolist(), leg.toe] for leg in legs]
    return np.array(joints, np.int64).reshape(-1, 4)


def hinges_of(bank: PoseBank) -> Floats:
    """The axis that the knee of each foot's leg bends about in the clips: [F, 3]."""
    legs = [leg_of(bank.skeleton, foot) for foot in bank.feet]
    axes = [
        LEFT if leg is None else hinge_of(bank.skeleton, leg, bank.rotations[:, leg.joints[1]].astype(np.float64)) for leg in legs
    ]
    return np.array(axes, np.float64).reshape(-1, 3)


@dataclass(frozen=True, eq=False, slots=True)
class OnGround:
    """The feet of one character that feels a ground, in one update: asked first where, and then told what is below.

    `steps` says how far each foot is through its swing in the clip, and where it comes down; empty without a ground. `root` is
    where the body is, `free` [F, 3] where the feet are without a lock; `row` is written, and has footings and hips as they were.
    """

    legs: Ints
    columns: Columns
    contacts: Flags
    steps: Sequence[Sequence[float]]
    root: Place3
    free: Floats
    row: Floats

    def points(self) -> list[tuple[float, float]]:
        """Where the ground is asked, x and z: for each foot that has a leg where it is, or where it will come down; without any
        where the body is."""
        found = []
        for i, toe, foot in self._feet():
            if self.contacts[i] or _is_far(toe, foot):
                is_held = foot[LOCKED] and not _is_far(toe, foot)
                found.append((foot[POINT], foot[POINT + 1]) if is_held else (toe[0], toe[2]))
            else:
                found.append(self._landing(*self._step(i)[1:]))
        return found or [self.root[:2]]

    def stand(self, below: Sequence[Triple], dt_s: float) -> None:
        """Write footings and hips as they are some time later, with this ground at the points."""
        part = self.row[self.columns.at[FOOTINGS] : self.columns.at[FOOTINGS + 1]].reshape(-1, FOOTING)
        heights, is_new, feet = [], True, list(self._feet())
        for (i, toe, foot), here in zip(feet, below, strict=False):
            numbers = part[i].tolist()
            own = Footing((*numbers[0:3],), (*numbers[3:6],), (*numbers[6:9],))
            is_far = _is_far(toe, foot)
            is_new = is_new and is_far
            if self.contacts[i] or is_far:
                now = Footing(here, last=here) if is_far else standing(own, here, HIPS_DAMPING, dt_s)
                heights.append(here[0])
            else:
                share = self._step(i)[0]
                now = swinging(own, here, share, HIPS_DAMPING, dt_s)
                heights.append(own.last[0] + eased(share) * (here[0] - own.last[0]))
            part[i] = (*now.now, *now.speed, *now.last)
        goal = min(heights) if heights else below[0][0]
        hips = Height(*self.row[HIPS : HIPS + 2].tolist())
        hips = Height(goal) if is_new and heights else hips.come(goal, dt_s)
        self.row[HIPS : HIPS + 2] = hips.now, hips.speed

    def _feet(self) -> list[tuple[int, list[float], list[float]]]:
        """The number, the toe and the state of each foot that has a leg."""
        part = self.row[self.columns.at[FEET] : self.columns.at[FEET + 1]].reshape(-1, FOOT).tolist()
        each = zip(self.legs[:, 0].tolist(), self.free.tolist(), part, strict=True)
        return [(i, toe, foot) for i, (hip, toe, foot) in enumerate(each) if hip != NO_LEG]

    def _step(self, foot: int) -> Sequence[float]:
        return self.steps[foot] if self.steps else GONE

    def _landing(self, left: float, ahead: float) -> tuple[float, float]:
        """A place that a clip has to the left and ahead of the body, where the warped body comes to it."""
        x, z, heading = self.root
        turn, stride = float(self.row[TURN]), float(self.row[STRIDE])
        sin, cos = math.sin(heading + turn), math.cos(heading + turn)
        return x + stride * (cos * left + sin * ahead), z + stride * (cos * ahead - sin * left)


def _is_far(toe: Sequence[float], foot: Sequence[float]) -> bool:
    """Whether a foot belongs to a character that was put elsewhere."""
    return not foot[SEEN] or math.hypot(toe[0] - foot[FREE], toe[2] - foot[FREE + 2]) > FAR_M
