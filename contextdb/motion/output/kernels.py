"""Loops over the joints of one pose: sampling, blending and placing. Arrays only.

J joints, M of them with positions of their own. Rotations are unit quaternions (w, x, y, z), turns rotation vectors: an axis times
an angle in radians. What a loop writes to is its last arguments. Compiled by numba where it is installed, else run as they are: a
pose is too small for numpy, whose every call costs as much as a whole loop here.

Sources: D. Holden, "Spring-It-On", 2021, and "Dead Blending", 2023; orangeduck/Motion-Matching, `spring.h` (the decay);
J. Solà and others, "A micro Lie theory for state estimation in robotics", 2018 (the Jacobian of a rotation vector).
"""
# mypy: disable-error-code="no-untyped-def, no-untyped-call, untyped-decorator, no-any-return"

from __future__ import annotations

import math
from typing import Any

import numpy as np

try:
    import numba
except ImportError:  # pragma: no cover - the same loops, slower
    numba = None  # type: ignore[assignment]


FEW_ROWS = 8
"""So few characters are not worth a call of numpy."""


def compiled(loop: Any) -> Any:
    """The loop compiled by numba; as it is without numba, or where numba has no place to keep what it compiles."""
    if numba is None:  # pragma: no cover - the same loops, slower
        return loop
    try:
        return numba.njit(cache=True, nogil=True, boundscheck=False, error_model="numpy")(loop)
    except RuntimeError:  # pragma: no cover - a folder that nobody may write to
        return loop


# ---- rows of numbers


@compiled
def three(rows, j):
    """Row j of three numbers, in float64."""
    return (np.float64(rows[j, 0]), np.float64(rows[j, 1]), np.float64(rows[j, 2]))


@compiled
def four(rows, j):
    """Row j of four numbers, in float64."""
    return (np.float64(rows[j, 0]), np.float64(rows[j, 1]), np.float64(rows[j, 2]), np.float64(rows[j, 3]))


if not hasattr(four, "stats"):  # Python works on its own numbers several times faster

    def three(rows: Any, j: int) -> Any:
        """Row j of three numbers."""
        return rows[j].tolist()

    four = three


# ---- angles and moments


@compiled
def remainder(angle):
    """The angle that is the same and at most half a turn, as `math.remainder` has it."""
    rest = abs(angle) % math.tau
    rest = rest - math.tau if rest > math.pi else rest
    return -rest if angle < 0.0 else rest


@compiled
def flat_length(x, z):
    """How long a way over the ground is: as a square root, for `math.hypot` rounds otherwise when it is compiled."""
    return math.sqrt(x * x + z * z)


@compiled
def between(start, n_steps, is_looping, frame):
    """The two frames about a moment of a range, counted over all, and the share of the second; a loop goes on."""
    if is_looping and n_steps > 0 and not 0.0 <= frame <= n_steps:
        frame %= n_steps
    frame = min(max(float(frame), 0.0), float(n_steps))
    low = min(int(frame), max(n_steps - 1, 0))
    return start + low, start + min(low + 1, n_steps), frame - low


@compiled
def root_velocity(root, low, high, share, rate):
    """How fast the body moves between two frames: to its left and ahead, and its turning."""
    heading, to_heading = np.float64(root[low, 2]), np.float64(root[high, 2])
    x = (np.float64(root[high, 0]) - np.float64(root[low, 0])) * rate
    z = (np.float64(root[high, 1]) - np.float64(root[low, 1])) * rate
    turn = to_heading - heading
    sin, cos = math.sin(heading + share * turn), math.cos(heading + share * turn)
    return (cos * x - sin * z, sin * x + cos * z, turn * rate)


# ---- one rotation


@compiled
def product(a, b):
    """The rotation of b, then of a."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] + a[2] * b[0] + a[3] * b[1] - a[1] * b[3],
        a[0] * b[3] + a[3] * b[0] + a[1] * b[2] - a[2] * b[1],
    )


@compiled
def inverse(a):
    """The rotation back."""
    return (a[0], -a[1], -a[2], -a[3])


@compiled
def cross(a, b):
    """The cross product of two vectors."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@compiled
def rotated(q, v):
    """The vector turned by the rotation."""
    axis = (q[1], q[2], q[3])
    t = cross(axis, v)
    t = (2.0 * t[0], 2.0 * t[1], 2.0 * t[2])
    u = cross(axis, t)
    return (v[0] + q[0] * t[0] + u[0], v[1] + q[0] * t[1] + u[1], v[2] + q[0] * t[2] + u[2])


@compiled
def _rotation(turn):
    angle = math.sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2])
    share = math.sin(0.5 * angle) / angle if angle > 1e-9 else 0.5
    return (math.cos(0.5 * angle), share * turn[0], share * turn[1], share * turn[2])


@compiled
def _turn(q):
    """The rotation vector of a rotation, the shorter way round: at most π long."""
    sign = -1.0 if q[0] < 0.0 else 1.0
    sine = math.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    share = sign * (2.0 * math.atan2(sine, abs(q[0])) / sine if sine > 1e-12 else 2.0)
    return (share * q[1], share * q[2], share * q[3])


@compiled
def _spin_of(turn, speed):
    """How fast exp(turn) spins, in the outer frame, while its rotation vector changes at `speed`."""
    a = math.sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2])
    if a < 1e-4:
        first, second = 0.5, 1.0 / 6.0
    else:
        first, second = (1.0 - math.cos(a)) / (a * a), (a - math.sin(a)) / (a * a * a)
    one = cross(turn, speed)
    two = cross(turn, one)
    return (
        speed[0] + first * one[0] + second * two[0],
        speed[1] + first * one[1] + second * two[1],
        speed[2] + first * one[2] + second * two[2],
    )


@compiled
def _speed_of(turn, spin):
    """The inverse of `_spin_of`: how fast the rotation vector changes while exp(turn) spins; angles up to π."""
    a = math.sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2])
    second = 1.0 / 12.0 if a < 1e-3 else (1.0 - 0.5 * a / math.tan(0.5 * a)) / (a * a)
    one = cross(turn, spin)
    two = cross(turn, one)
    return (
        spin[0] - 0.5 * one[0] + second * two[0],
        spin[1] - 0.5 * one[1] + second * two[1],
        spin[2] - 0.5 * one[2] + second * two[2],
    )


# ---- one pose of a clip


@compiled
def sample(rotations, positions, low, high, share, to_rotations, to_positions):
    """The pose between two frames: rotations on the shorter way, positions on the straight line."""
    first, second, from_positions, next_positions = rotations[low], rotations[high], positions[low], positions[high]
    one = 1.0 - share
    for j in range(first.shape[0]):
        a, b = four(first, j), four(second, j)
        dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
        two = -share if dot < 0.0 else share
        w, x, y, z = one * a[0] + two * b[0], one * a[1] + two * b[1], one * a[2] + two * b[2], one * a[3] + two * b[3]
        size = math.sqrt(w * w + x * x + y * y + z * z)
        to_rotations[j, 0], to_rotations[j, 1], to_rotations[j, 2], to_rotations[j, 3] = w / size, x / size, y / size, z / size
    for j in range(from_positions.shape[0]):
        p, q = three(from_positions, j), three(next_positions, j)
        for i in range(3):
            to_positions[j, i] = one * p[i] + share * q[i]


@compiled
def slopes(rotations, positions, low, high, rate, to_spins, to_velocities):
    """How fast the joints turn (in their parents' frames) and move from one frame to the next."""
    first, second, from_positions, next_positions = rotations[low], rotations[high], positions[low], positions[high]
    for j in range(first.shape[0]):
        turn = _turn(product(four(second, j), inverse(four(first, j))))
        for i in range(3):
            to_spins[j, i] = rate * turn[i]
    for j in range(from_positions.shape[0]):
        p, q = three(from_positions, j), three(next_positions, j)
        for i in range(3):
            to_velocities[j, i] = rate * (q[i] - p[i])


# ---- the spring: offsets to what plays, which decay


@compiled
def decay(offsets, speeds, damping, dt, to_offsets, to_speeds):
    """Offsets [n, 3] and their speeds after some time: x = e^{-yt} (x0 + (v0 + x0 y) t)."""
    fade = math.exp(-damping * dt)
    for j in range(offsets.shape[0]):
        offset, speed = three(offsets, j), three(speeds, j)
        for i in range(3):
            pushed = speed[i] + offset[i] * damping
            to_offsets[j, i] = fade * (offset[i] + pushed * dt)
            to_speeds[j, i] = fade * (speed[i] - pushed * damping * dt)


@compiled
def leave(offsets, speeds, from_rotations, from_spins, to_rotations, to_spins, new_offsets, new_speeds):
    """The turns that keep the shown pose and its velocity, where another animation begins to play under them."""
    for j in range(offsets.shape[0]):
        turn, speed = three(offsets, j), three(speeds, j)
        offset = _rotation(turn)
        shown = product(offset, four(from_rotations, j))
        own = _spin_of(turn, speed)
        carried = rotated(offset, three(from_spins, j))
        rest = product(shown, inverse(four(to_rotations, j)))
        left = _turn(rest)
        under = rotated(rest, three(to_spins, j))
        spin = (own[0] + carried[0] - under[0], own[1] + carried[1] - under[1], own[2] + carried[2] - under[2])
        pace = _speed_of(left, spin)
        for i in range(3):
            new_offsets[j, i] = left[i]
            new_speeds[j, i] = pace[i]


@compiled
def turn_by(offsets, rotations, to_rotations):
    """Rotations, each turned by its offset."""
    for j in range(offsets.shape[0]):
        turned = product(_rotation(three(offsets, j)), four(rotations, j))
        for i in range(4):
            to_rotations[j, i] = turned[i]


# ---- dead blending: the pose that was left goes on, ever slower, while it fades


@compiled
def fade_turns(left, spins, reach, share, slope, braking, playing, playing_spins, to_rotations, to_spins):
    """Rotations that were left, gone on by their spins times `reach`, mixed with what plays; and how fast the mix spins.

    `share` of what plays, which grows by `slope` a second; the spins are `braking` of what they were.
    """
    for j in range(left.shape[0]):
        spun, p = three(spins, j), three(playing_spins, j)
        gone = product(_rotation((reach * spun[0], reach * spun[1], reach * spun[2])), four(left, j))
        between = product(four(playing, j), inverse(gone))
        way = _turn(between)
        part = (share * way[0], share * way[1], share * way[2])
        over = _rotation(part)
        mixed = product(over, gone)
        own = (braking * spun[0], braking * spun[1], braking * spun[2])
        carried = rotated(between, own)
        pace = _speed_of(way, (p[0] - carried[0], p[1] - carried[1], p[2] - carried[2]))
        grown = (slope * way[0] + share * pace[0], slope * way[1] + share * pace[1], slope * way[2] + share * pace[2])
        spin = _spin_of(part, grown)
        under = rotated(over, own)
        for i in range(4):
            to_rotations[j, i] = mixed[i]
        for i in range(3):
            to_spins[j, i] = spin[i] + under[i]


# ---- alignment


@compiled
def align(parents, tops, places, spine, left, turn, rotations, positions):
    """Turn the joints that hang on the root, `tops`, about the vertical, and joint by joint of the spine a part of it back.

    `places` says where the tops are in `positions` [M, 3]; of the turn `left` is left after each joint of the spine, which hang on
    each other. Rotations and positions are changed.
    """
    first = parents[spine[0]]
    above = (1.0, 0.0, 0.0, 0.0)
    while first >= 0:
        above = product(four(rotations, first), above)
        first = parents[first]
    whole = (math.cos(0.5 * turn), 0.0, math.sin(0.5 * turn), 0.0)
    for k in range(tops.shape[0]):
        turned = product(whole, four(rotations, tops[k]))
        moved = rotated(whole, three(positions, places[k]))
        for i in range(4):
            rotations[tops[k], i] = turned[i]
        for i in range(3):
            positions[places[k], i] = moved[i]
    under = product(whole, above)
    for k in range(spine.shape[0]):
        above = product(above, four(rotations, spine[k]))
        angle = 0.5 * turn * left[k]
        turned = product((math.cos(angle), 0.0, math.sin(angle), 0.0), above)
        own = product(inverse(under), turned)
        under = turned
        for i in range(4):
            rotations[spine[k], i] = own[i]


# ---- placing


@compiled
def place(parents, translations, rotations, x, z, heading, to_positions, to_world):
    """Forward kinematics of one pose whose first joint is placed against (x, 0, z), facing `heading`."""
    for j in range(parents.shape[0]):
        p = parents[j]
        if p < 0:
            above = (math.cos(0.5 * heading), 0.0, math.sin(0.5 * heading), 0.0)
            start = (x, 0.0, z)
        else:
            above, start = four(to_world, p), three(to_positions, p)
        moved = rotated(above, three(translations, j))
        turned = product(above, four(rotations, j))
        for i in range(3):
            to_positions[j, i] = start[i] + moved[i]
        for i in range(4):
            to_world[j, i] = turned[i]


@compiled
def place_whole(parents, offsets, places, rotations, positions, x, z, heading, to_translations, to_positions, to_world):
    """As `place`, of positions [M, 3]: `places` says which row is each joint's; below 0 it keeps its offset."""
    for j in range(parents.shape[0]):
        for i in range(3):
            to_translations[j, i] = offsets[j, i] if places[j] < 0 else positions[places[j], i]
    place(parents, to_translations, rotations, x, z, heading, to_positions, to_world)


@compiled
def fastest(parents, offsets, places, rotations, positions, root, step, dt, to):
    """Write how much the joint that accelerates most does so in each frame of a range, over steps of some frames: [N - 2 step]."""
    n, j = root.shape[0], parents.shape[0]
    turns, world, moved = np.empty((j, 4)), np.empty((j, 4)), np.empty((j, 3))
    shown = np.empty((n, j, 3))
    for frame in range(n):
        turns[:] = rotations[frame]
        x, z, heading = three(root, frame)
        place_whole(parents, offsets, places, turns, positions[frame], x, z, heading, moved, shown[frame], world)
    for frame in range(n - 2 * step):
        to[frame] = sharpest(shown[frame], shown[frame + step], shown[frame + 2 * step], step * dt)


@compiled
def sharpest(before, now, after, dt):
    """The acceleration of the joint that accelerates most, of three moments."""
    most = 0.0
    for j in range(now.shape[0]):
        size = 0.0
        for i in range(3):
            change = after[j, i] - 2.0 * now[j, i] + before[j, i]
            size += change * change
        most = max(most, size)
    return math.sqrt(most) / (dt * dt)


@compiled
def _place_rows(parents, offsets, places, chosen, rotations, positions, roots, to_translations, to_positions, to_world):
    """As `place_whole`, of the characters that are chosen, bool [N], each with a root (x, z, heading): [N, 3]."""
    for i in range(chosen.shape[0]):
        if chosen[i]:
            place_whole(
                parents, offsets, places, rotations[i], positions[i], roots[i, 0], roots[i, 1], roots[i, 2],
                to_translations[i], to_positions[i], to_world[i],
            )  # fmt: skip


def _place_many(
    parents: Any, offsets: Any, places: Any, chosen: Any, rotations: Any, positions: Any, roots: Any,
    to_translations: Any, to_positions: Any, to_world: Any,
) -> None:  # fmt: skip
    """The same by numpy, of all characters at once: the formulas do for arrays as well."""
    at = np.flatnonzero(chosen)
    if len(at) < FEW_ROWS:
        _place_rows(parents, offsets, places, chosen, rotations, positions, roots, to_translations, to_positions, to_world)
        return
    moving = np.flatnonzero(places >= 0)
    translations = np.repeat(offsets[None], len(at), axis=0)
    translations[:, moving] = positions[at][:, places[moving]]
    x, z, headings = roots[at, 0], roots[at, 1], roots[at, 2].tolist()
    cos, sin = np.array([math.cos(0.5 * h) for h in headings]), np.array([math.sin(0.5 * h) for h in headings])
    placed, world = np.empty_like(translations), np.empty((len(at), len(parents), 4))
    turns = rotations[at]
    for j, p in enumerate(parents.tolist()):
        above = (cos, 0.0, sin, 0.0) if p < 0 else tuple(world[:, p].T)
        start = (x, 0.0, z) if p < 0 else tuple(placed[:, p].T)
        moved = rotated(above, tuple(translations[:, j].T))
        for i in range(3):
            placed[:, j, i] = start[i] + moved[i]
        world[:, j] = np.stack(product(above, tuple(turns[:, j].T)), axis=1)
    to_translations[at], to_positions[at], to_world[at] = translations, placed, world


place_rows: Any = _place_rows if hasattr(_place_rows, "stats") else _place_many


# ---- legs


IS_COMPILED = hasattr(sample, "stats")
"""Whether the loops are numba's."""
