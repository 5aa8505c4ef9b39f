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

# mypy: disable-error-code="no-untyped-def, no-untyped-call, untyped-decorator, no-any-return"

from __future__ import annotations

import math

from contextdb.motion.output import kernels, stages
from contextdb.motion.output.kernels import compiled, flat_length, remainder
from contextdb.motion.output.root import rotation_share

LEAST_MPS = 0.2
"""What goes slower goes nowhere: neither turn nor stride are wanted of it."""
MOST_TURN = math.pi / 2.0


@compiled
def align(to, bones, given, heading, dt, before, row, rotations, positions):
    """Write how the body is bent, and turn its hips by that; a rig without a spine is left as it is."""
    row[stages.TURN], row[stages.TURN_SPEED], row[stages.STRIDE], row[stages.STRIDE_SPEED] = 0.0, 0.0, 1.0, 0.0
    if not to.is_warping or bones.spine.shape[0] == 0:
        return
    turn, stride = _wanted(to, given, heading, row)
    row[stages.TURN], row[stages.TURN_SPEED] = _followed(before[stages.TURN], before[stages.TURN_SPEED], turn, to.turn_damping, dt)
    row[stages.STRIDE], row[stages.STRIDE_SPEED] = _followed(
        before[stages.STRIDE], before[stages.STRIDE_SPEED], stride, to.turn_damping, dt
    )
    if row[stages.TURN] != 0.0:
        kernels.align(
            bones.parents, bones.tops, bones.top_places, bones.spine, bones.left, row[stages.TURN], rotations, positions
        )  # fmt: skip


@compiled
def _wanted(to, given, heading, row):
    """The turn and the stride that the game's velocity asks for; 0 and 1 where either body stands."""
    left, ahead = given[stages.RATE] * given[stages.TRAVEL], given[stages.RATE] * given[stages.TRAVEL + 1]
    sway = given[stages.TRAVEL + 2] * rotation_share(to, given[stages.WEIGHT])
    x = row[stages.VELOCITY] if row[stages.HAS_VELOCITY] != 0.0 else 0.0
    z = row[stages.VELOCITY + 1] if row[stages.HAS_VELOCITY] != 0.0 else 0.0
    own, wanted = flat_length(left, ahead), flat_length(x, z)
    if own < LEAST_MPS or wanted < LEAST_MPS:
        return 0.0, 1.0
    turn = remainder(math.atan2(x, z) - (heading - sway) - math.atan2(left, ahead))
    if abs(turn) > MOST_TURN:
        return 0.0, 1.0
    stride = 1.0 if to.root == stages.PATH else wanted / own
    return min(max(turn, -to.turn_limit), to.turn_limit), min(max(stride, to.min_stride), to.max_stride)


@compiled
def _followed(value, speed, goal, y, dt_s):
    """A number that comes to a goal as a critically damped spring, and its change a second."""
    apart = value - goal
    pushed, fade = speed + apart * y, math.exp(-y * dt_s)
    return goal + fade * (apart + pushed * dt_s), fade * (speed - pushed * y * dt_s)
