"""Oracles for motion, too simple to be wrong: one frame and one joint at a time, plain matrices, plain loops."""

import math

import numpy as np

AXES = {"X": 0, "Y": 1, "Z": 2}
UP = {
    "y": np.eye(3),
    "z": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),  # (x, y, z) becomes (x, z, -y)
    "x": np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]),  # (x, y, z) becomes (-y, x, z)
}


def rotation_about(axis, degrees):
    a, b = [(1, 2), (2, 0), (0, 1)][AXES[axis]]
    matrix = np.eye(3)
    matrix[a, a] = matrix[b, b] = math.cos(math.radians(degrees))
    matrix[b, a] = math.sin(math.radians(degrees))
    matrix[a, b] = -matrix[b, a]
    return matrix


def place_joint(clip, frame, joint):
    """The position in metres and the rotation matrix of one joint in one frame, by asking its parent."""
    skeleton = clip.skeleton
    offset = skeleton.offsets[joint].copy()
    turn = np.eye(3)
    first = sum(len(channels) for channels in skeleton.channels[:joint])
    for i, channel in enumerate(skeleton.channels[joint]):
        value = clip.values[frame, first + i]
        if channel.endswith("position"):
            offset[AXES[channel[0]]] = value
        else:
            turn = turn @ rotation_about(channel[0], value)
    parent = skeleton.parents[joint]
    above, above_turn = place_joint(clip, frame, parent) if parent >= 0 else (np.zeros(3), UP[clip.up])
    return above + above_turn @ offset * clip.metres_per_unit, above_turn @ turn


def best_frame(features, starts, stops, query, weights=None, range_flags=None, tags=None, current=None, bias=None):
    """The frame of least cost in float64, its cost, or (None, inf): every frame of every range, one by one."""
    weights = np.ones(features.shape[1]) if weights is None else weights
    found, least = None, math.inf
    for i in sorted(range(len(starts)), key=lambda i: starts[i]):
        if range_flags is not None and not range_flags[i]:
            continue
        for frame in range(starts[i], stops[i]):
            if tags is not None and not tags[frame]:
                continue
            apart = [float(x) - float(q) for x, q in zip(features[frame], query, strict=True)]
            cost = sum(w * (d * d) for w, d in zip(weights, apart, strict=True))  # d ** 2 may round otherwise
            cost += 0.0 if bias is None else float(bias[frame])
            if cost < least or (cost == least < math.inf and frame == current):
                found, least = frame, cost
    return found, least


# ---- features: one frame and one channel at a time


class SlowBody:
    """A clip at the schema's rate, with every joint placed by `place_joint`; it faces across LeftUpLeg and RightUpLeg."""

    def __init__(self, clip, flipped=False):
        self.rate = clip.rate
        self.n_frames = clip.n_frames
        self.names = clip.skeleton.names
        self.placed = [[place_joint(clip, f, j) for j in range(len(self.names))] for f in range(clip.n_frames)]
        if flipped:
            partners = [self.names.index(other_side(name)) for name in self.names]
            flip = np.diag([-1.0, 1.0, 1.0])
            self.placed = [[(flip @ frame[j][0], flip @ frame[j][1] @ flip) for j in partners] for frame in self.placed]
        self.headings = []
        for f in range(self.n_frames):
            x, _, z = self.place(f, "LeftUpLeg") - self.place(f, "RightUpLeg")
            heading = math.atan2(-z, x)
            before = self.headings[-1] if self.headings else heading
            self.headings.append(heading + 2.0 * math.pi * round((before - heading) / (2.0 * math.pi)))

    def place(self, frame, bone):
        return self.placed[frame][self.names.index(bone)][0]

    def turn(self, frame, bone):
        return self.placed[frame][self.names.index(bone)][1]

    def ground(self, frame):
        return self.place(frame, "Hips") * np.array([1.0, 0.0, 1.0])

    def own(self, frame, vector):
        return rotation_about("Y", -math.degrees(self.headings[frame])) @ vector

    def around(self, frame):
        """The frames before and behind one, as far as there are any, and the seconds between them."""
        before, after = max(frame - 1, 0), min(frame + 1, self.n_frames - 1)
        return before, after, (after - before) / self.rate

    def velocity(self, frame, place):
        before, after, seconds = self.around(frame)
        return (place(after) - place(before)) / seconds if seconds else np.zeros(3)

    def spin(self, frame, bone):
        """Radians a second about the world's axes: the mean of the turns to the frame and from it."""
        before, after, _ = self.around(frame)
        turns = [turn_between(self.turn(f, bone), self.turn(f + 1, bone)) for f in range(before, after)]
        return np.mean(turns, axis=0) * self.rate if turns else np.zeros(3)

    def at_frame(self, frame):
        """Place on the ground, heading and velocity at a fractional frame, going straight on beyond the ends."""
        inside = min(max(frame, 0.0), self.n_frames - 1.0)
        low = int(inside)
        high = min(low + 1, self.n_frames - 1)
        share = inside - low
        velocity = (1 - share) * self.velocity(low, self.ground) + share * self.velocity(high, self.ground)
        place = (1 - share) * self.ground(low) + share * self.ground(high) + velocity * (frame - inside) / self.rate
        return place, (1 - share) * self.headings[low] + share * self.headings[high], velocity

    def frame_along(self, frame, metres):
        """The fractional frame so many metres further, by walking there step by step."""
        left, step, here = abs(metres), 1 if metres > 0 else -1, frame
        while left > 0.0 and 0 <= here + step < self.n_frames:
            long = float(np.linalg.norm(self.ground(here + step) - self.ground(here)))
            if long >= left:
                return here + step * left / long
            left, here = left - long, here + step
        speed = float(np.linalg.norm(self.velocity(here, self.ground)))
        return here + step * left / speed * self.rate if left > 0.0 and speed > 0.05 else here


def other_side(name):
    return name.replace("Left", "?").replace("Right", "Left").replace("?", "Right")


def turn_between(first, second):
    """The axis times the angle of the turn from one rotation matrix to another."""
    turn = second @ first.T
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2.0
    sine = float(np.linalg.norm(axis))
    return axis * (math.atan2(sine, (np.trace(turn) - 1.0) / 2.0) / sine) if sine > 1e-9 else axis


def slow_channel(body, channel, frame, ahead_s=0.0):
    """One channel's features in one frame; of a permuted channel in a permutation so many seconds ahead."""
    if channel.type == "permutation_time":
        return [ahead_s]
    if channel.permuted:
        return slow_bone(body, channel, frame, min(frame + round(ahead_s * body.rate), body.n_frames - 1))
    if channel.type == "trajectory":
        frames = [frame + seconds * body.rate for seconds in channel.at]
        frames += [body.frame_along(frame, metres) for metres in channel.along]
        return [x for point in frames for x in slow_point(body, channel.what, frame, point)]
    found = []
    for seconds in channel.at or (0.0,):
        moment = min(max(frame + round(seconds * body.rate), 0), body.n_frames - 1)
        found += slow_bone(body, channel, moment, moment)
    return found


def slow_bone(body, channel, frame, then):
    """What the bone does then, seen from the body or the other bone in the frame."""
    bone, other = channel.bone, channel.relative_to
    if channel.type == "position":
        return list(body.own(frame, body.place(then, bone) - (body.place(frame, other) if other else body.ground(frame))))
    if channel.type == "velocity":
        velocities = [body.velocity(then, lambda f, b=b: body.place(f, b)) for b in (bone, other) if b]
        return list(body.own(frame, velocities[0] - sum(velocities[1:])))
    if channel.type == "angular_velocity":
        return list(body.own(frame, body.spin(then, bone) - (body.spin(then, other) if other else 0.0)))
    seen = body.turn(frame, other).T @ body.turn(then, bone) if other else body.own(frame, body.turn(then, bone))
    if channel.type == "orientation":
        return [*seen[:, 0], *seen[:, 1]]
    return list(seen[:, AXES[channel.axis[-1].upper()]] * (-1.0 if channel.axis.startswith("-") else 1.0))


def slow_point(body, what, frame, point):
    place, heading, velocity = body.at_frame(point)
    left_and_ahead = [0, 2]
    if what == "position":
        return list(body.own(frame, place - body.ground(frame))[left_and_ahead])
    if what == "velocity":
        return list(body.own(frame, velocity)[left_and_ahead])
    if what == "speed":
        return [float(np.linalg.norm(velocity))]
    if what == "direction":
        return [math.sin(heading - body.headings[frame]), math.cos(heading - body.headings[frame])]
    speed = float(np.linalg.norm(velocity))
    turned = heading - math.atan2(velocity[0], velocity[2])
    return [math.sin(turned) * min(1.0, speed / 0.3), math.cos(turned) * min(1.0, speed / 0.3)]
