"""Loops over characters: what plays sampled for all, then each through the stages, then each on its feet.

Rows, their columns and what a shaping and bones are: `contextdb.motion.output.stages`. N characters, and their poses as arrays:
rotations [N, J, 4], positions of the joints that have some of their own [N, M, 3], and of all joints in the world [N, J, 3].
"""
# mypy: disable-error-code="no-untyped-def, no-untyped-call, untyped-decorator, no-any-return"

from __future__ import annotations

import numpy as np

from contextdb.motion.output import feet_loops, kernels, stages
from contextdb.motion.output.alignment import align
from contextdb.motion.output.dead_blending import dead_blend
from contextdb.motion.output.kernels import compiled
from contextdb.motion.output.root import move_body, place_root
from contextdb.motion.output.spring import spring


@compiled
def _part(row, at, number, width):
    """A part of a row as an array of so many columns."""
    part = row[at[number] : at[number + 1]]
    return part.reshape((part.shape[0] // width, width))


@compiled
def sample_rows(bank, frames, at, given, rows, contacts):
    """Write what plays of each character whose clip is in a bank of this number: pose, root, which feet are down, and travel."""
    for i in range(given.shape[0]):
        if given[i, stages.IN_BANK] != bank:
            continue
        number = int(given[i, stages.RANGE])
        low, high, share = kernels.between(
            frames.starts[number], frames.n_steps[number], frames.looping[number], given[i, stages.AT] * frames.rate
        )
        row = rows[i]
        rotations, positions = _part(row, at, stages.ROTATIONS, 4), _part(row, at, stages.POSITIONS, 3)
        kernels.sample(frames.rotations, frames.positions, low, high, share, rotations, positions)
        for k in range(3):
            a, b = frames.ways[low, k], frames.ways[high, k]
            row[stages.CLIP_ROOT + k] = a + share * np.float64(b - a)
            a, b = frames.ways[low, 3 + k], frames.ways[high, 3 + k]
            given[i, stages.TRAVEL + k] = a + share * np.float64(b - a)
        near = high if share >= 0.5 else low
        given[i, stages.FRAME] = near
        for k in range(contacts.shape[1]):
            contacts[i, k] = frames.contacts[near, k]


@compiled
def sample_seams(bank, frames, seams, velocities, rotations, spins, positions, speeds):
    """Write each moment at a seam that is in a bank of this number; seams [S, 4] are bank, range, second, and how fast it plays.

    One behind the end of its clip goes on as the clip did there, unless it stands: what runs out within an update does not stop
    for the rest of it. Rotations [S, J, 4], spins [S, J, 3], positions and speeds [S, M, 3], and the velocities of the root [S, 3].
    """
    for i in range(seams.shape[0]):
        if seams[i, stages.IN_BANK] != bank:
            continue
        number, rate = int(seams[i, stages.RANGE]), seams[i, 3]
        low, high, share = kernels.between(
            frames.starts[number], frames.n_steps[number], frames.looping[number], seams[i, stages.AT] * frames.rate
        )
        kernels.sample(frames.rotations, frames.positions, low, high, share, rotations[i], positions[i])
        kernels.slopes(frames.rotations, frames.positions, low, high, frames.rate, spins[i], speeds[i])
        velocity = kernels.root_velocity(frames.root, low, high, share, frames.rate)
        for k in range(3):
            velocities[i, k] = rate * velocity[k]
        past = 0.0 if frames.looping[number] or rate == 0.0 else seams[i, stages.AT] - frames.n_steps[number] / frames.rate
        if past > 0.0:
            kernels.turn_by(past * spins[i], rotations[i], rotations[i])
            positions[i] += past * speeds[i]
        for j in range(spins.shape[1]):
            for k in range(3):
                spins[i, j, k] *= rate
        for j in range(speeds.shape[1]):
            for k in range(3):
                speeds[i, j, k] *= rate


@compiled
def _play_rate(given, before, dt):
    """Seconds of the clip in a second of play, where it plays on; else what it was."""
    if given[stages.ACTION] == stages.HOLDS:
        return 0.0
    if given[stages.ACTION] != stages.CONTINUES or given[stages.IN_BANK] < 0.0 or given[stages.IS_ON] == 0.0 or dt <= 0.0:
        return before[stages.PLAY_RATE] if before[stages.PLAY_RATE] != 0.0 else 1.0
    return (given[stages.AT] - before[stages.TIME]) / dt


@compiled
def _blend(to, at, i, k, dt, left, before, row, rotations, positions):
    """The joints: the clip's pose, and what is left of the seams over it. `left` holds the moments of seams, two for each."""
    clip, clip_positions = _part(row, at, stages.ROTATIONS, 4), _part(row, at, stages.POSITIONS, 3)
    if to.blend != stages.SPRING and to.blend != stages.DEAD:
        rotations[:], positions[:] = clip, clip_positions
        return
    width = 3 if to.blend == stages.SPRING else 4
    offsets, new = _part(before, at, stages.LEFT, width), _part(row, at, stages.LEFT, width)
    spins, new_spins = _part(before, at, stages.SPINS, 3), _part(row, at, stages.SPINS, 3)
    shifts, new_shifts = _part(before, at, stages.SHIFTS, 3), _part(row, at, stages.SHIFTS, 3)
    speeds, new_speeds = _part(before, at, stages.SPEEDS, 3), _part(row, at, stages.SPEEDS, 3)
    seam_rotations, seam_spins, seam_positions, seam_speeds = left
    a, b = (2 * k, 2 * k + 1) if k >= 0 else (0, 0)
    if to.blend == stages.SPRING:
        spring(
            offsets, spins, shifts, speeds, to.damping, dt, k >= 0,
            seam_rotations[a], seam_spins[a], seam_positions[a], seam_speeds[a],
            seam_rotations[b], seam_spins[b], seam_positions[b], seam_speeds[b], clip, clip_positions,
            new, new_spins, new_shifts, new_speeds, rotations, positions,
        )  # fmt: skip
        return
    row[stages.SINCE] = dead_blend(
        offsets, spins, shifts, speeds, before[stages.SINCE], to.fade_s, to.braking, dt, k >= 0,
        seam_rotations[a], seam_spins[a], seam_positions[a], seam_speeds[a], clip, clip_positions,
        new, new_spins, new_shifts, new_speeds, rotations, positions,
    )  # fmt: skip


@compiled
def move_rows(
    to, bones, at, before, given, left, velocities, dt, rows, roots, rotations, moved, translations, positions, world, free
):  # fmt: skip
    """Put each character through all stages up to its feet, whose places without a lock are written.

    A character that appears has not moved, and has no seam.
    """
    for i in range(given.shape[0]):
        was, row, own = before[i], rows[i], given[i]
        is_on = was[stages.BEGUN] != 0.0
        dt_s, k = (dt, int(own[stages.SEAM])) if is_on else (0.0, -1)
        motion = (own[stages.MOTION], own[stages.MOTION + 1], own[stages.MOTION + 2]) if is_on else (0.0, 0.0, 0.0)
        row[stages.BEGUN], row[stages.SINCE] = 1.0, was[stages.SINCE]
        row[stages.PLAY_RATE], row[stages.CLIP_RATE] = _play_rate(own, was, dt), own[stages.RATE]
        row[stages.TIME] = own[stages.AT] if own[stages.IN_BANK] >= 0.0 else was[stages.TIME]
        if own[stages.IN_BANK] < 0.0:
            row[stages.CLIP_ROOT : stages.CLIP_ROOT + 3] = was[stages.CLIP_ROOT : stages.CLIP_ROOT + 3]
            row[at[stages.ROTATIONS] :] = was[at[stages.ROTATIONS] :]
        move_body(own, dt, was, row)
        _blend(to, at, i, k, dt_s, left, was, row, rotations[i], moved[i])
        a, b = (2 * k, 2 * k + 1) if k >= 0 else (0, 0)
        seam_left = (velocities[a, 0], velocities[a, 1], velocities[a, 2])
        seam_entered = (velocities[b, 0], velocities[b, 1], velocities[b, 2])
        if k >= 0 and own[stages.LOST] > 0.0:
            gone = own[stages.LOST]
            motion = (motion[0] + gone * seam_left[0], motion[1] + gone * seam_left[1], motion[2] + gone * seam_left[2])
        x, z, heading = place_root(to, own, motion, dt_s, k >= 0, seam_left, seam_entered, was, row)
        roots[i, 0], roots[i, 1], roots[i, 2] = x, z, heading
        align(to, bones, own, heading, dt_s, was, row, rotations[i], moved[i])
        row[stages.HIPS : stages.LOWER + 2] = was[stages.HIPS : stages.LOWER + 2]
        row[at[stages.FEET] : at[stages.FOOTINGS + 1]] = was[at[stages.FEET] : at[stages.FOOTINGS + 1]]
        is_flat = own[stages.GIVES_GROUND] == 0.0 and was[stages.HIPS] == 0.0 and was[stages.HIPS + 1] == 0.0
        for j in range(at[stages.FOOTINGS], at[stages.FOOTINGS + 1]):
            is_flat = is_flat and was[j] == 0.0
        is_level = is_flat and row[stages.STRIDE] == 1.0 and was[stages.LOWER] == 0.0 and was[stages.LOWER + 1] == 0.0
        own[stages.IS_FLAT], own[stages.BENDS] = 1.0 if is_flat else 0.0, 0.0 if is_level and not to.is_locking else 1.0
    bends = given[:, stages.BENDS] != 0.0
    kernels.place_rows(
        bones.parents, bones.offsets, bones.places, bends, rotations, moved, roots, translations, positions, world
    )  # fmt: skip
    for i in range(given.shape[0]):
        row = rows[i]
        if bends[i]:
            vx = row[stages.VELOCITY] if row[stages.HAS_VELOCITY] != 0.0 else 0.0
            vz = row[stages.VELOCITY + 1] if row[stages.HAS_VELOCITY] != 0.0 else 0.0
            feet_loops.free_places(positions[i], bones.legs, row[stages.STRIDE] - 1.0, vx, vz, free[i])


@compiled
def stand_rows(to, bones, at, before, given, contacts, dt, rows, roots, rotations, moved, free, translations, positions, world):
    """Stand each character on its feet, with the ground below them as its row has it, and place its joints in the world."""
    for i in range(given.shape[0]):
        row = rows[i]
        if given[i, stages.BENDS] != 0.0:
            dt_s = dt if before[i, stages.BEGUN] != 0.0 else 0.0
            feet_loops.stand_all(
                bones.parents, bones.offsets, bones.places,
                _part(row, at, stages.ROTATIONS, 4), _part(row, at, stages.POSITIONS, 3), bones.legs, bones.hinges,
                bones.top_places, to.is_locking, to.foot_damping, to.foot_radius_m, bones.most_accel, dt_s, contacts[i], free[i],
                _part(row, at, stages.FOOTINGS, stages.FOOTING), row[stages.HIPS],
                _part(before[i], at, stages.FEET, stages.FOOT), positions[i], world[i], _part(row, at, stages.FEET, stages.FOOT),
                row[stages.LOWER : stages.LOWER + 2], rotations[i], moved[i],
            )  # fmt: skip
    everyone = np.ones(given.shape[0], np.bool_)
    kernels.place_rows(
        bones.parents, bones.offsets, bones.places, everyone, rotations, moved, roots, translations, positions, world
    )  # fmt: skip
