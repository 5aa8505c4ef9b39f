"""The pose of one character after one update, worked out slowly in numpy: the second opinion on the stages of the core.

What an update is given is taken as the pipeline hands it to the core. Velocities at seams are differences of poses a moment apart.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from contextdb.motion.clips.quaternions import about_axis, inverse, multiply, rotate, rotation_vectors
from contextdb.motion.output.bank import STEP_S, tops_of
from contextdb.motion.output.ground import below
from contextdb.motion.output.legs import eased, hinges_of, legs_of
from contextdb.motion.output.pipeline import ADDED_SHARE, spine_of

STILL = np.array([1.0, 0.0, 0.0, 0.0])
UP = np.array([0.0, 1.0, 0.0])
A_MOMENT = 1e-5
HIPS_HALFLIFE_S, MOST_LOWER, STRAIGHT, FAR_M = 0.1, 0.25, math.radians(170.0), 1.0
LIFTED_S, LIFTED_M, REACH_M, REST_S, REST_M, SLOW_MPS = 0.3, 0.05, 0.08, 0.3, 0.025, 0.2


@dataclass(frozen=True)
class Foot:
    is_down: bool
    lock: tuple | None
    offset: np.ndarray
    speed: np.ndarray
    free: np.ndarray
    displayed: np.ndarray
    lifted_s: float = 0.0
    stood_s: float = 0.0


@dataclass(frozen=True)
class State:
    rotations: np.ndarray
    positions: np.ndarray
    turns: tuple
    shifts: tuple
    n_feet: int
    is_begun: bool = False
    clip_root: np.ndarray = field(default_factory=lambda: np.zeros(3))
    body: np.ndarray | None = None
    velocity: np.ndarray | None = None
    base: np.ndarray | None = None
    offset: tuple = field(default_factory=lambda: (np.zeros(3), np.zeros(3)))
    turn: tuple = (0.0, 0.0)
    stride: tuple = (1.0, 0.0)
    hips: tuple = (0.0, 0.0)
    lower: tuple = (0.0, 0.0)
    footings: tuple = ()
    feet: tuple = ()

    @classmethod
    def of(cls, bank):
        rig, n = bank.skeleton, len(bank.feet)
        none = tuple((np.zeros((k, 3)), np.zeros((k, 3))) for k in (rig.n_joints, len(bank.moving)))
        level = ((np.zeros(3), np.zeros(3), np.zeros(3)),) * n
        return cls(np.tile(STILL, (rig.n_joints, 1)), rig.offsets[bank.moving], *none, n, footings=level, feet=(None,) * n)


def decayed(value, speed, halflife_s, dt):
    """What a critically damped spring leaves of a number, and its change a second."""
    y = 2.0 * math.log(2.0) / halflife_s
    pushed = speed + y * value
    return math.exp(-y * dt) * (value + pushed * dt), math.exp(-y * dt) * (speed - y * pushed * dt)


def come(value, goal, halflife_s, dt):
    left, speed = decayed(value[0] - goal, value[1], halflife_s, dt)
    return goal + left, speed


def rotation(turns):
    angles = np.linalg.norm(turns, axis=-1, keepdims=True)
    axes = np.where(angles > 0.0, turns / np.where(angles > 0.0, angles, 1.0), 0.0)
    return np.concatenate((np.cos(angles / 2.0), np.sin(angles / 2.0) * axes), axis=-1)


def arc(u, v):
    size = np.linalg.norm(u) * np.linalg.norm(v)
    half = np.concatenate(([size + u @ v], np.cross(u, v)))
    return STILL if size < 1e-12 or half[0] < 1e-9 * size else half / np.linalg.norm(half)


def remainder(angle):
    return math.remainder(angle, math.tau)


def turned(place, motion):
    """A movement to the left and ahead, seen from a heading, over the ground."""
    sin, cos = math.sin(place), math.cos(place)
    return np.array([cos * motion[0] + sin * motion[1], cos * motion[1] - sin * motion[0]])


def posed(banks, settings, state, given, seams, dt, place, ground):
    """(rotations, translations, positions, root, contacts) and the next state."""
    number, at, at_s, _, _, _, left, ahead, turn, _, is_ahead, seam, lost_s, *_ = given
    rig, bank = banks[0].skeleton, banks[int(number)] if number >= 0 else None
    dt, motion = (dt, np.array([left, ahead, turn])) if state.is_begun else (0.0, np.zeros(3))
    pair = [seams[2 * int(seam) + i] for i in (0, 1)] if state.is_begun and seam >= 0 else []
    moment = None if bank is None else bank.moment_of(int(at), at_s)
    state = replace(state, is_begun=True) if moment is None else replace(
        state, rotations=moment.rotations, positions=moment.positions, clip_root=np.array(moment.root)
    )  # fmt: skip
    velocities = [each[3] * np.array(banks[int(each[0])].sample_of(int(each[1]), each[2]).root_velocity) for each in pair]
    if pair and lost_s > 0.0:
        motion = motion + lost_s * velocities[0]
    rotations, moved, turns, shifts = joints(banks, settings, state, pair, dt)
    root, parts = placed_root(settings, state, given, motion, velocities, dt, place, bool(is_ahead))
    translations = np.array(rig.offsets)
    translations[banks[0].moving] = moved
    now = replace(state, turns=turns, shifts=shifts, is_begun=True, **parts)
    now = aligned(banks[0], settings, state, now, moment, given, root, dt, rotations, translations)
    contacts = np.zeros(state.n_feet, bool) if moment is None else np.array(moment.contacts)
    now = stood(banks, settings, state, now, (bank, moment), contacts, root, ground, dt, rotations, translations)
    return (rotations, translations, world(rig, rotations, translations, root)[0], root, contacts), now


def joints(banks, settings, state, pair, dt):
    """The clip's pose with what is left of the seams over it."""
    if settings.blend == "none":
        return state.rotations.copy(), state.positions.copy(), state.turns, state.shifts
    turns, shifts = (decayed(*each, settings.halflife_s, dt) for each in (state.turns, state.shifts))
    if pair:
        before, after = (moment_at(banks, each) for each in pair)
        # what is displayed a moment before and after the seam, and what lies between it and what is entered
        rest = [
            rotation_vectors(multiply(multiply(rotation(turns[0] + t * turns[1]), before(t)[0]), inverse(after(t)[0])))
            for t in (-A_MOMENT, 0.0, A_MOMENT)
        ]
        apart = [before(t)[1] - after(t)[1] for t in (-A_MOMENT, 0.0, A_MOMENT)]
        turns = rest[1], (rest[2] - rest[0]) / (2.0 * A_MOMENT)
        shifts = shifts[0] + apart[1], shifts[1] + (apart[2] - apart[0]) / (2.0 * A_MOMENT)
    return multiply(rotation(turns[0]), state.rotations), state.positions + shifts[0], turns, shifts


def moment_at(banks, seam):
    """The pose about a seam as a function of seconds: it goes on as fast as it does there, behind its end too."""
    bank, at, at_s, rate = banks[int(seam[0])], int(seam[1]), seam[2], seam[3]
    sample = bank.sample_of(at, at_s)
    past = 0.0 if bank.looping[at] or rate == 0.0 else max(0.0, at_s - bank.last_s(at))

    def goes_on(t):
        seconds = past + rate * t
        return multiply(rotation(seconds * sample.spins), sample.rotations), sample.positions + seconds * sample.velocities

    return goes_on


def placed_root(settings, state, given, motion, velocities, dt, place, is_ahead):
    """Where the root is displayed, and what of the state says that."""
    weight, mode = given[9], settings.root
    moved = {"mixed": weight * settings.position_weight, "code": 0.0}.get(mode, 1.0)
    turning = {"mixed": weight * settings.rotation_weight, "animation": 1.0}.get(mode, 0.0)
    body = state.body if place is None else np.array(place)
    velocity = state.velocity
    if place is not None and state.body is not None and dt > 0.0:
        velocity = (body - state.body)[:2] / dt
    way = None
    if mode == "path" and velocity is not None and np.linalg.norm(velocity) > 0.1:
        way = velocity / np.linalg.norm(velocity)

    def bent(step):
        return state.stride[0] * turned(state.turn[0], step)

    base = state.base if state.base is not None else body if place is not None else state.clip_root
    after = np.append(base[:2] + moved * turned(base[2], bent(motion[:2])), base[2] + turning * motion[2])
    if place is not None and mode == "code":
        after = body
    elif place is not None and mode != "animation":
        last = body if state.body is None else state.body
        if way is not None:
            after[:2] = base[:2] + np.linalg.norm(after[:2] - base[:2]) * way
        after[:2] += (1.0 - moved) * (body - last)[:2]
        after[2] += (1.0 - turning) * remainder(body[2] - last[2])
        own = np.linalg.norm(after[:2] - base[:2])
        after = pulled(settings, after, beside(body, way, after), own, abs(after[2] - base[2]) + 6.0 * own, dt)
    offset, speed = state.offset
    if settings.blend == "spring":
        offset, speed = decayed(offset, speed, settings.halflife_s, dt)
        if velocities:
            entered = motion / dt if is_ahead and dt > 0.0 else velocities[1]
            step = moved * turned(after[2], bent((velocities[0] - entered)[:2]))
            step = np.append(step, turning * (velocities[0] - entered)[2])
            offset, speed = offset + dt * step if is_ahead else offset, speed + step
    if place is not None and mode in ("mixed", "path"):
        displayed = after + offset
        apart = displayed - beside(body, way, displayed)
        size, limit = np.linalg.norm(apart[:2]), math.radians(settings.rotation_clamp_deg)
        if size > settings.position_clamp_m:
            after[:2] += (settings.position_clamp_m / size - 1.0) * apart[:2]
        angle = remainder(apart[2])
        after[2] -= angle - min(max(angle, -limit), limit)
    return after + offset, {"body": body, "velocity": velocity, "base": after, "offset": (offset, speed)}


def beside(body, way, place):
    """The game's body, on a way moved along it to beside a place."""
    return body if way is None else np.append(body[:2] + ((place - body)[:2] @ way) * way, body[2])


def pulled(settings, base, body, own_m, own_turn, dt):
    apart, angle = np.linalg.norm((body - base)[:2]), remainder(body[2] - base[2])
    made_up = [1.0 - 0.5 ** (dt / h) if h > 0.0 else 0.0 for h in (settings.position_pull_s, settings.rotation_pull_s)]
    share = min(made_up[0], 0.5 * own_m / apart) if apart > 0.0 else 0.0
    turn = math.copysign(min(made_up[1] * abs(angle), 0.5 * own_turn), angle)
    return np.append(base[:2] + share * (body - base)[:2], base[2] + turn)


def aligned(bank, settings, state, now, moment, given, root, dt, rotations, translations):
    """Hips and legs turned to the way of the game, the chest as it was: rotations and translations are changed."""
    spine = spine_of(bank)
    is_warping = settings.root != "animation" and (
        settings.path_alignment or settings.min_stride < 1.0 or settings.max_stride > 1.0
    )
    if spine is None or not is_warping:
        return replace(now, turn=(0.0, 0.0), stride=(1.0, 0.0))
    turn, stride = 0.0, 1.0
    travel = (0.0, 0.0, 0.0) if moment is None else moment.travel
    velocity = np.zeros(2) if now.velocity is None else now.velocity
    own, game = given[5] * math.hypot(*travel[:2]), float(np.linalg.norm(velocity))
    if abs(own) >= 0.2 and now.velocity is not None:
        sign = math.copysign(1.0, given[5])
        share = {"mixed": given[9] * settings.rotation_weight, "animation": 1.0}.get(settings.root, 0.0)
        heading = root[2] - share * travel[2]
        turn = remainder(math.atan2(*velocity) - heading - math.atan2(sign * travel[0], sign * travel[1])) if game >= 0.2 else 0.0
        if abs(turn) <= math.pi / 2.0:
            limit = math.radians(settings.alignment_limit_deg) if settings.path_alignment else 0.0
            turn = min(max(turn, -limit), limit)
            least = settings.min_stride if settings.min_stride == 1.0 else settings.min_stride * min(game / 0.2, 1.0)
            stride = 1.0 if settings.root == "path" else min(max(game / abs(own), least), settings.max_stride)
        else:
            turn = 0.0
    turn, stride = (
        come(was, goal, settings.alignment_halflife_s, dt) for was, goal in ((state.turn, turn), (state.stride, stride))
    )
    facings = world(bank.skeleton, rotations, translations, (0.0, 0.0, 0.0))[1]
    for top in tops_of(bank.skeleton):
        rotations[top] = multiply(about_axis("y", turn[0]), rotations[top])
        translations[top] = rotate(about_axis("y", turn[0]), translations[top])
    for joint, left in zip(spine.joints.tolist(), spine.left.tolist(), strict=True):
        above = world(bank.skeleton, rotations, translations, (0.0, 0.0, 0.0))[1][bank.skeleton.parents[joint]]
        rotations[joint] = multiply(inverse(above), multiply(about_axis("y", left * turn[0]), facings[joint]))
    return replace(now, turn=turn, stride=stride)


def world(rig, rotations, translations, root):
    positions, facings = np.empty((rig.n_joints, 3)), np.empty((rig.n_joints, 4))
    for joint, parent in enumerate(rig.parents.tolist()):
        above = about_axis("y", np.array(root[2])) if parent < 0 else facings[parent]
        start = np.array([root[0], 0.0, root[1]]) if parent < 0 else positions[parent]
        positions[joint], facings[joint] = start + rotate(above, translations[joint]), multiply(above, rotations[joint])
    return positions, facings


def stood(banks, settings, state, now, playing, contacts, root, ground, dt, rotations, translations):
    """The feet on their ground, held where they came down; rotations and translations are changed."""
    bank, rig = banks[0], banks[0].skeleton
    legs = legs_of(rig, bank.feet)
    hinges = hinges_of(rig, legs, bank.rotations)
    is_flat = ground is None and state.hips == (0.0, 0.0) and not any(np.any(part) for own in state.footings for part in own)
    if is_flat and now.stride[0] == 1.0 and state.lower == (0.0, 0.0) and not settings.foot_lock:
        return now
    positions, facings = world(rig, rotations, translations, root)
    free = [free_place(leg, positions, now, root[2], playing[1]) for leg in legs]
    if not is_flat:
        now = grounded(state, now, playing, contacts, root, ground, dt, free)
    clip = world(rig, state.rotations, bank.translations(state.positions), (0.0, 0.0, 0.0))[0]
    most_accel, feet, need = ADDED_SHARE * max(each.most_accel for each in banks), [], 0.0
    restless = restless_foot(state, now, playing[1], free)
    for i, (leg, toe) in enumerate(zip(legs, free, strict=True)):
        height, *slope = now.footings[i][0]
        over = toe + height * UP
        goes = i == restless or must_go(
            settings, state.feet[i], over, clip[leg[3], 1] + height, positions, leg, slope, now.hips[0], dt
        )
        foot = held(settings, state.feet[i], over, clip[leg[3], 1] + height, bool(contacts[i]), goes, most_accel, dt)
        feet.append(foot)
        need = max(
            need, min(too_high(positions, leg, foot.displayed, slope, now.hips[0]), REACH_M if foot.lock is None else MOST_LOWER)
        )
    lower = come(state.lower, need, HIPS_HALFLIFE_S, dt)
    lower = (need, max(lower[1], 0.0)) if lower[0] < need else lower
    for top in tops_of(rig):
        translations[top, 1] += now.hips[0] - lower[0]
    positions[:, 1] += now.hips[0] - lower[0]
    for i, (leg, foot) in enumerate(zip(legs, feet, strict=True)):
        if np.any(foot.displayed != positions[leg[3]]) or np.any(now.footings[i][0]):
            stand(rig, leg, hinges[i], positions, facings, foot.displayed, now.footings[i][0][1:], rotations)
    return replace(now, feet=tuple(feet), lower=lower)


def free_place(leg, positions, now, heading, moment):
    """Where a toe is without a lock, moved along the way for steps of another length: that of a body that stands is its clip's."""
    way = np.zeros(2) if now.velocity is None else np.asarray(now.velocity)
    if np.linalg.norm(way) < 1e-6 and moment is not None:
        way = np.array(turned(heading, moment.travel[:2]))
    toe = positions[leg[3]].copy()
    if np.linalg.norm(way) >= 1e-6:
        way = way / np.linalg.norm(way)
        toe[[0, 2]] += (now.stride[0] - 1.0) * (((positions[leg[2]] + toe) / 2.0 - positions[leg[0]])[[0, 2]] @ way) * way
    return toe


def is_far(foot, toe):
    return foot is None or math.hypot(*(toe - foot.free)[[0, 2]]) > FAR_M


def grounded(state, now, playing, contacts, root, ground, dt, free):
    """What is below the feet, and the hips."""
    bank, moment = playing
    footings, heights, all_new = [], [], True
    for i, (toe, foot, (under, speed, last)) in enumerate(zip(free, state.feet, state.footings, strict=True)):
        new = is_far(foot, toe)
        all_new = all_new and new
        share, left, ahead = (
            (1.0, 0.0, 0.0) if ground is None else (0.0, 0.0, 0.0) if bank is None else bank._steps[moment.frame, i]
        )
        if contacts[i] or new:
            point = toe[[0, 2]] if new or foot.lock is None else foot.lock
        else:
            point = root[:2] + now.stride[0] * turned(root[2] + now.turn[0], (left, ahead))
        here = np.array(below(ground, *map(float, point)))
        goal, height, stays = here, here[0], here
        if new:
            under, speed = here, np.zeros(3)
        elif not contacts[i]:
            up = eased(2.0 * share) if here[0] > last[0] else eased(2.0 * share - 1.0)
            goal = last + np.array([up, eased(share), eased(share)]) * (here - last)
            height, stays = last[0] + eased(share) * (here - last)[0], last
        rest, speed = decayed(under - goal, speed, HIPS_HALFLIFE_S, dt)
        footings.append((goal + rest, speed, stays))
        heights.append(height)
    hips = (min(heights), 0.0) if all_new else come(state.hips, min(heights), HIPS_HALFLIFE_S, dt)
    return replace(now, footings=tuple(footings), hips=hips)


def restless_foot(state, now, moment, free):
    """The farthest foot of a body that stands on feet which are held for a while."""
    travel = (0.0, 0.0) if moment is None else moment.travel[:2]
    velocity = (0.0, 0.0) if now.velocity is None else now.velocity
    if max(math.hypot(*travel), math.hypot(*velocity)) >= SLOW_MPS:
        return -1
    if not all(foot is not None and foot.lock is not None and foot.stood_s >= REST_S for foot in state.feet):
        return -1
    off = [math.dist(foot.lock, toe[[0, 2]]) for foot, toe in zip(state.feet, free, strict=True)]
    return int(np.argmax(off)) if max(off, default=0.0) > REST_M else -1


def must_go(settings, foot, toe, height, positions, leg, slope, raised, dt):
    """Whether a foot is too far from its clip's place, or too far for its leg, to be held."""
    if foot is None or foot.lock is None:
        return False
    offset = decayed(foot.offset, foot.speed, settings.foot_halflife_s, dt)[0]
    place = np.array([foot.lock[0], height, foot.lock[1]]) + offset
    is_out = math.dist(foot.lock, toe[[0, 2]]) > settings.foot_radius_m
    return is_out or too_high(positions, leg, place, slope, raised) > REACH_M


def held(settings, foot, toe, height, is_down, goes, most_accel, dt):
    """A foot after an update, whose toe is at a place without a lock and has a height in the clip."""
    y, still = 2.0 * math.log(2.0) / settings.foot_halflife_s, np.zeros(3)
    lifted_s = 0.0 if foot is None else max(foot.lifted_s - dt, 0.0)
    stood_s = 0.0 if foot is None or foot.lock is None else foot.stood_s + dt

    def locked(x, z, offset, speed):
        return Foot(True, (x, z), offset, speed, toe, np.array([x, height, z]) + offset, lifted_s, stood_s)

    def unlocked(offset, speed, lifted_s=lifted_s):
        up = LIFTED_M * math.sin(math.pi * lifted_s / LIFTED_S) ** 2 * UP
        return Foot(is_down, None, offset, speed, toe, toe + up + offset, lifted_s)

    if not settings.foot_lock:
        return replace(unlocked(still, still, 0.0), is_down=False)
    if foot is None or np.linalg.norm(toe - foot.free) > FAR_M:
        lifted_s = stood_s = 0.0
        return locked(toe[0], toe[2], (toe[1] - height) * UP, still) if is_down else unlocked(still, still, 0.0)
    moved = toe - foot.free
    if foot.lock is not None and not is_down:
        return unlocked(*decayed(foot.displayed - foot.free, still, settings.foot_halflife_s, dt))
    offset, speed = decayed(foot.offset, foot.speed, settings.foot_halflife_s, dt)
    if foot.lock is not None:
        x, z = foot.lock
        if not goes:
            return locked(x, z, offset, speed)
        speed = speed - (moved / dt if dt > 0.0 else 0.0)
        return unlocked(np.array([x, height, z]) + offset - toe, speed, LIFTED_S)
    if not is_down or lifted_s > 0.0:
        return unlocked(offset, speed)
    goal, rise = (toe + offset)[[0, 2]], (toe[1] + offset[1] - height) * UP
    way = goal - foot.displayed[[0, 2]]
    far = np.linalg.norm(way)
    over = far / dt - STEP_S * most_accel if dt > 0.0 else 0.0
    if over <= 0.0:
        return locked(*goal, rise, still)
    pace = over * y * STEP_S / (1.0 - math.exp(-y * STEP_S)) * way / far
    goal = goal + pace / y
    return locked(*goal, rise - np.array([pace[0], 0.0, pace[1]]) / y, np.array([pace[0], 0.0, pace[1]]))


def too_high(positions, leg, place, slope, raised):
    hip, knee, ankle, toe = positions[leg]
    way = rotate(arc(UP, np.array([-slope[0], 1.0, -slope[1]])), toe - ankle)
    upper, lower, now = (np.linalg.norm(each) for each in (knee - hip, ankle - knee, ankle - hip))
    room = math.sqrt(upper**2 + lower**2 - 2.0 * upper * lower * math.cos(STRAIGHT)) - now
    apart = place - way - hip
    down = raised - apart[1]
    over = math.sqrt(apart[0] ** 2 + down**2 + apart[2] ** 2) - now
    if over <= 0.0:
        return 0.0
    reach = now + over * room / math.hypot(room, over) if room > 0.0 else now
    return down - math.sqrt(max(reach**2 - apart[0] ** 2 - apart[2] ** 2, 0.0))


def stand(rig, leg, hinge, positions, facings, place, slope, rotations):
    """A leg bent so that its toe comes to a place: the knee by the law of cosines, then the hip by the shortest turn."""
    a, b, c, toe = positions[leg]
    hip, knee, ankle = leg[:3]
    tilt = arc(UP, np.array([-slope[0], 1.0, -slope[1]]))
    foot = multiply(tilt, facings[ankle])
    thigh, shin, way = b - a, c - b, place - rotate(tilt, toe - c) - a
    upper, lower = np.linalg.norm(thigh), np.linalg.norm(shin)
    far = min(max(np.linalg.norm(way), abs(upper - lower) + 1e-9), upper + lower)
    now = math.pi - math.atan2(np.linalg.norm(np.cross(thigh, shin)), thigh @ shin)
    wanted = math.acos(min(max((upper**2 + lower**2 - far**2) / (2.0 * upper * lower), -1.0), 1.0))
    limit = max(STRAIGHT, now)
    wanted = limit + 0.25 * (wanted - limit) if wanted > limit else wanted
    axis = np.cross(thigh, shin)
    size = np.linalg.norm(axis)
    if size > 1e-6 * upper * lower:
        axis = axis / size
        back = rotation((now - math.pi) * axis)
    else:
        axis, now, back = np.zeros(3), math.pi, arc(shin, thigh)
    if wanted < now:
        side = np.cross(thigh, np.cross(np.cross(a - c, np.cross(rotate(facings[hip], hinge), a - c)), thigh))
        size = np.linalg.norm(side)
        axis = (math.pi - now) * axis + (((now - wanted) / size) * side if size > 1e-12 else 0.0)
    size = np.linalg.norm(axis)
    if size < 1e-12:
        return
    bend = multiply(rotation((math.pi - wanted) * axis / size), back)
    swing = arc(thigh + rotate(bend, shin), way)
    new_hip, new_knee = multiply(swing, facings[hip]), multiply(swing, multiply(bend, facings[knee]))
    rotations[hip] = multiply(inverse(facings[rig.parents[hip]]), new_hip)
    rotations[knee] = multiply(inverse(new_hip), new_knee)
    rotations[ankle] = multiply(inverse(new_knee), foot)
