"""Loops over the feet of one pose: where they are without a lock, where they are shown, and the legs that bend to that.

`contextdb.motion.output.feet` says what they do and why, `contextdb.motion.output.kernels` how they are compiled. F feet, and for
each its joints [F, 4]: hip, knee, ankle and what stands, all below 0 for a foot without a leg. A footing is the height of the
ground below a foot and by how much it rises along x and z: [F, 3].
"""
# mypy: disable-error-code="no-untyped-def, no-untyped-call, untyped-decorator, no-any-return"

from __future__ import annotations

import math

import numpy as np

from contextdb.motion.output import leg_kernels
from contextdb.motion.output.bank import STEP_S
from contextdb.motion.output.foot_state import (
    BACK_SHARE,
    DOWN,
    FAR_M,
    FREE,
    HIPS_DAMPING,
    LEAST_MPS,
    LOCKED,
    MOST_LOWER,
    OFFSET,
    POINT,
    SEEN,
    SHOWN,
    SLOW_MPS,
    SPEED,
    STRAIGHT,
)
from contextdb.motion.output.kernels import compiled, flat_length


@compiled
def _come(value, speed, y, dt):
    """A number and its change a second some time later: it decays to 0 as a critically damped spring."""
    fade, pushed = math.exp(-y * dt), speed + value * y
    return fade * (value + pushed * dt), fade * (speed - pushed * y * dt)


@compiled
def free_places(positions, joints, more, vx, vz, to_free):
    """Write each foot's toe, with the joints placed in the world, moved along the way for steps that are by `more` longer."""
    size = flat_length(vx, vz)
    for foot in range(joints.shape[0]):
        hip, ankle, toe = joints[foot, 0], joints[foot, 2], joints[foot, 3]
        if toe < 0:
            continue
        for i in range(3):
            to_free[foot, i] = positions[toe, i]
        if more != 0.0 and size >= LEAST_MPS:
            ways = (vx / size, vz / size)
            apart = (positions[ankle, 0] - positions[hip, 0], positions[ankle, 2] - positions[hip, 2])
            along = more * (ways[0] * apart[0] + ways[1] * apart[1])
            to_free[foot, 0] += along * ways[0]
            to_free[foot, 2] += along * ways[1]


@compiled
def _locked(to, x, z, height, toe):
    """Write a foot that is down and locked, its offset and speed written already."""
    to[SEEN], to[DOWN], to[LOCKED], to[POINT], to[POINT + 1] = 1.0, 1.0, 1.0, x, z
    place = (x, height, z)
    for i in range(3):
        to[FREE + i] = toe[i]
        to[SHOWN + i] = place[i] + to[OFFSET + i]


@compiled
def _free(to, is_down, toe):
    """Write a foot that is not locked, its offset and speed written already."""
    to[SEEN], to[DOWN], to[LOCKED], to[POINT], to[POINT + 1] = 1.0, 1.0 if is_down else 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        to[FREE + i] = toe[i]
        to[SHOWN + i] = toe[i] + to[OFFSET + i]


@compiled
def move_foot(own, toe, height, is_down, y, radius, most_accel, dt, to):
    """Write the foot after this tick, whose toe is at a place without a lock and has a height in the clip."""
    moved = (toe[0] - own[FREE], toe[1] - own[FREE + 1], toe[2] - own[FREE + 2])
    for i in range(6):
        to[OFFSET + i] = 0.0
    if own[SEEN] == 0.0 or math.sqrt(moved[0] * moved[0] + moved[1] * moved[1] + moved[2] * moved[2]) > FAR_M:
        if is_down:
            to[OFFSET + 1] = toe[1] - height
            _locked(to, toe[0], toe[2], height, toe)
        else:
            _free(to, False, toe)
        return
    was_locked = own[LOCKED] != 0.0
    if was_locked and not is_down:
        for i in range(3):
            to[OFFSET + i], to[SPEED + i] = _come(own[SHOWN + i] - own[FREE + i], 0.0, y, dt)
        _free(to, False, toe)
        return
    for i in range(3):
        to[OFFSET + i], to[SPEED + i] = _come(own[OFFSET + i], own[SPEED + i], y, dt)
    if was_locked:
        x, z = own[POINT], own[POINT + 1]
        if flat_length(x - toe[0], z - toe[2]) <= radius:
            _locked(to, x, z, height, toe)
            return
        point = (x, height, z)
        for i in range(3):
            to[OFFSET + i] = point[i] + to[OFFSET + i] - toe[i]
            to[SPEED + i] -= moved[i] / dt if dt > 0.0 else 0.0
        _free(to, True, toe)
        return
    is_near = flat_length(to[OFFSET], to[OFFSET + 2]) < BACK_SHARE * radius
    is_back = is_near and flat_length(moved[0], moved[2]) <= SLOW_MPS * dt
    if is_down and (own[DOWN] == 0.0 or is_back):
        x, z = toe[0] + to[OFFSET], toe[2] + to[OFFSET + 2]
        to[OFFSET + 1] = toe[1] + to[OFFSET + 1] - height
        to[OFFSET], to[OFFSET + 2] = 0.0, 0.0
        to[SPEED + 1] = 0.0
        x, z = _stopped(own, x, z, y, most_accel, dt, to)
        _locked(to, x, z, height, toe)
        return
    _free(to, is_down, toe)


@compiled
def _stopped(own, x, z, y, most_accel, dt, to):
    """Where a foot that is locked at a place comes to rest, its offset to that and its speed written: there and at once, but for
    what it is too fast to lose in a step as joints lose it in the clips."""
    left, ahead = x - own[SHOWN], z - own[SHOWN + 2]
    way = flat_length(left, ahead)
    over = way / dt - STEP_S * most_accel if dt > 0.0 else 0.0
    if over <= 0.0:
        to[SPEED], to[SPEED + 2] = 0.0, 0.0
        return x, z
    over *= y * STEP_S / (1.0 - math.exp(-y * STEP_S)) / way
    to[SPEED], to[SPEED + 2] = over * left, over * ahead
    to[OFFSET], to[OFFSET + 2] = -over * left / y, -over * ahead / y
    return x + over * left / y, z + over * ahead / y


@compiled
def stand_all(
    parents, offsets, places, clip_rotations, clip_positions, joints, hinges, tops, is_locking, y, radius, most_accel, dt,
    contacts, free, footings, hips, feet, positions, world, to_feet, lower, rotations, moved,
):  # fmt: skip
    """Move all feet on, lower the hips by what their legs need, and bend the legs.

    `lower`, how low the hips are and its change a second, `rotations` and `moved`, the positions [M, 3], are changed.
    """
    n_feet = joints.shape[0]
    toes, heights = np.zeros(n_feet, np.int64), np.zeros(n_feet)
    for foot in range(n_feet):
        toes[foot] = max(joints[foot, 3], 0)
    if is_locking:
        leg_kernels.heights(parents, offsets, places, clip_rotations, clip_positions, toes, heights)
    most = 0.0
    for foot in range(n_feet):
        to = to_feet[foot]
        if joints[foot, 3] < 0:
            to[:] = 0.0
            continue
        over = (free[foot, 0], free[foot, 1] + footings[foot, 0], free[foot, 2])
        if is_locking:
            move_foot(feet[foot], over, heights[foot] + footings[foot, 0], contacts[foot], y, radius, most_accel, dt, to)
        else:
            for i in range(6):
                to[OFFSET + i] = 0.0
            _free(to, False, over)
        shown = (to[SHOWN], to[SHOWN + 1], to[SHOWN + 2])
        down = leg_kernels.too_high(
            positions, joints[foot], joints[foot, 3], shown, footings[foot, 1], footings[foot, 2], STRAIGHT, hips
        )
        most = max(most, min(down, MOST_LOWER))
    apart, speed = _come(lower[0] - most, lower[1], HIPS_DAMPING, dt)
    lower[0], lower[1] = most + apart, speed
    if lower[0] < most:
        lower[0], lower[1] = most, max(speed, 0.0)
    height = hips - lower[0]
    if height != 0.0:
        for k in range(tops.shape[0]):
            moved[tops[k], 1] += height
        for j in range(positions.shape[0]):
            positions[j, 1] += height
    for foot in range(n_feet):
        toe = joints[foot, 3]
        if toe < 0:
            continue
        shown = (to_feet[foot, SHOWN], to_feet[foot, SHOWN + 1], to_feet[foot, SHOWN + 2])
        is_there = shown[0] == positions[toe, 0] and shown[1] == positions[toe, 1] and shown[2] == positions[toe, 2]
        if not is_there or footings[foot, 0] != 0.0 or footings[foot, 1] != 0.0 or footings[foot, 2] != 0.0:
            leg_kernels.stand(
                parents, positions, world, joints[foot], toe, hinges[foot], shown, footings[foot, 1], footings[foot, 2], STRAIGHT,
                rotations,
            )  # fmt: skip
