"""Loops over the joints of one leg: how high it is, where it bends, and how it stands on a slope. Arrays only.

`contextdb.motion.output.kernels` says what the arrays are and how loops are compiled.
"""
# mypy: disable-error-code="no-untyped-def, no-untyped-call, untyped-decorator, no-any-return"

from __future__ import annotations

import math

from contextdb.motion.output.kernels import compiled, cross, four, inverse, product, rotated, three


@compiled
def heights(parents, offsets, places, rotations, positions, joints, to_heights):
    """How high some joints are over the root.

    `places` says which row of `positions` [M, 3] is each joint's; below 0 it keeps its offset.
    """
    for k in range(joints.shape[0]):
        j = joints[k]
        x = (0.0, 0.0, 0.0)
        while j >= 0:
            t = three(positions, places[j]) if places[j] >= 0 else three(offsets, j)
            x = (x[0] + t[0], x[1] + t[1], x[2] + t[2])
            j = parents[j]
            if j >= 0:
                x = rotated(four(rotations, j), x)
        to_heights[k] = x[1]


@compiled
def _about(axis, angle):
    """The rotation about a unit axis."""
    sine = math.sin(0.5 * angle)
    return (math.cos(0.5 * angle), sine * axis[0], sine * axis[1], sine * axis[2])


@compiled
def _length(v):
    return math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])


@compiled
def _arc(u, v):
    """The shortest rotation of one direction to another; none for directions without length, or opposite ones."""
    size = _length(u) * _length(v)
    w = size + u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
    if size < 1e-12 or w < 1e-9 * size:
        return (1.0, 0.0, 0.0, 0.0)
    c = cross(u, v)
    n = math.sqrt(w * w + c[0] * c[0] + c[1] * c[1] + c[2] * c[2])
    return (w / n, c[0] / n, c[1] / n, c[2] / n)


@compiled
def bend_leg(parents, positions, world, leg, target, ahead, straight, rotations):
    """Bend a leg, its joints `leg` (hip, knee, ankle), so that its ankle comes to a target; the foot keeps its rotation.

    `positions` and `world` place the joints; the leg's `rotations` against their parents are written. A knee that would be
    straighter than `straight` (radians), and than it is, goes only a quarter of what is over: it never slams. What a knee bends
    more than it does already it bends to where `ahead` is: the way a nearly stretched leg is bent to says nothing.
    """
    hip, knee, ankle = leg[0], leg[1], leg[2]
    a, b, c = three(positions, hip), three(positions, knee), three(positions, ankle)
    thigh, shin = (b[0] - a[0], b[1] - a[1], b[2] - a[2]), (c[0] - b[0], c[1] - b[1], c[2] - b[2])
    way = (target[0] - a[0], target[1] - a[1], target[2] - a[2])
    upper, lower = _length(thigh), _length(shin)
    if upper < 1e-9 or lower < 1e-9:
        return
    far = min(max(_length(way), abs(upper - lower) + 1e-9), upper + lower)
    axis = cross(thigh, shin)
    now = math.pi - math.atan2(_length(axis), thigh[0] * shin[0] + thigh[1] * shin[1] + thigh[2] * shin[2])
    wanted = math.acos(min(max((upper * upper + lower * lower - far * far) / (2.0 * upper * lower), -1.0), 1.0))
    limit = max(straight, now)
    if wanted > limit:
        wanted = limit + 0.25 * (wanted - limit)
    back, size = (1.0, 0.0, 0.0, 0.0), _length(axis)
    if size > 1e-6 * upper * lower:
        axis = (axis[0] / size, axis[1] / size, axis[2] / size)
        back = _about(axis, now - math.pi)
    else:  # stretched: bent to no side of its own
        back, now, axis = _arc(shin, thigh), math.pi, (0.0, 0.0, 0.0)
    if wanted < now:
        hinge = cross(thigh, cross(cross((a[0] - c[0], a[1] - c[1], a[2] - c[2]), (ahead[0], ahead[1], ahead[2])), thigh))
        size, more = _length(hinge), now - wanted
        share = more / size if size > 1e-12 else 0.0
        bent = math.pi - now
        axis = (bent * axis[0] + share * hinge[0], bent * axis[1] + share * hinge[1], bent * axis[2] + share * hinge[2])
    size = _length(axis)
    if size < 1e-12:
        return
    bend = product(_about((axis[0] / size, axis[1] / size, axis[2] / size), math.pi - wanted), back)
    moved = rotated(bend, shin)
    swing = _arc((thigh[0] + moved[0], thigh[1] + moved[1], thigh[2] + moved[2]), way)
    new_hip = product(swing, four(world, hip))
    new_knee = product(swing, product(bend, four(world, knee)))
    first = product(inverse(four(world, parents[hip])), new_hip)
    second = product(inverse(new_hip), new_knee)
    third = product(inverse(new_knee), four(world, ankle))
    for i in range(4):
        rotations[hip, i], rotations[knee, i], rotations[ankle, i] = first[i], second[i], third[i]


@compiled
def too_high(positions, leg, toe, place, along_x, along_z, straight, raised):
    """By how much hips that are raised are too high for a leg to bring its toe to a place; 0 where they are not.

    A leg reaches as far as it does now; and farther the harder, up to where its knee is `straight`: it does not come there at once.
    """
    a, b, c, t = three(positions, leg[0]), three(positions, leg[1]), three(positions, leg[2]), three(positions, toe)
    tilt = _arc((0.0, 1.0, 0.0), (-along_x, 1.0, -along_z))
    way = rotated(tilt, (t[0] - c[0], t[1] - c[1], t[2] - c[2]))
    upper, lower = _length((b[0] - a[0], b[1] - a[1], b[2] - a[2])), _length((c[0] - b[0], c[1] - b[1], c[2] - b[2]))
    now = _length((c[0] - a[0], c[1] - a[1], c[2] - a[2]))
    room = math.sqrt(upper * upper + lower * lower - 2.0 * upper * lower * math.cos(straight)) - now
    x, y, z = place[0] - way[0] - a[0], a[1] + raised - place[1] + way[1], place[2] - way[2] - a[2]
    over = math.sqrt(x * x + y * y + z * z) - now
    if over <= 0.0:
        return 0.0
    reach = now + over * room / math.sqrt(room * room + over * over) if room > 0.0 else now
    return y - math.sqrt(max(reach * reach - x * x - z * z, 0.0))


@compiled
def stand(parents, positions, world, leg, toe, hinge, place, along_x, along_z, straight, rotations):
    """Bend a leg so that its toe comes to a place, its foot turned by the slope of the ground, which rises along x and z.

    `hinge` is the axis that its knee bends about, against its hip.
    """
    ankle = leg[2]
    tilt = _arc((0.0, 1.0, 0.0), (-along_x, 1.0, -along_z))
    turned = product(tilt, four(world, ankle))
    for i in range(4):
        world[ankle, i] = turned[i]
    a, c, t = three(positions, leg[0]), three(positions, ankle), three(positions, toe)
    way = rotated(tilt, (t[0] - c[0], t[1] - c[1], t[2] - c[2]))
    axis = rotated(four(world, leg[0]), (hinge[0], hinge[1], hinge[2]))
    ahead = cross(axis, (a[0] - c[0], a[1] - c[1], a[2] - c[2]))
    target = (place[0] - way[0], place[1] - way[1], place[2] - way[2])
    bend_leg(parents, positions, world, leg, target, ahead, straight, rotations)
