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

Places are (x, z, heading). Rows are those of `contextdb.motion.output.stages`.

Source: Root Motion Weight in EA's talk; speed from the animation along a path from code in Remedy's; the
adjustment and the clamp of orangeduck/Motion-Matching, `controller.cpp`.
"""
# mypy: disable-error-code="no-untyped-def, no-untyped-call, untyped-decorator, no-any-return"

from __future__ import annotations

import math

from contextdb.motion.clips.steering import STANDING_MPS
from contextdb.motion.output import stages
from contextdb.motion.output.kernels import compiled, flat_length, remainder

MOST_PULL = 0.5
"""The pull is at most this share of the character's own movement."""
TURN_PER_M = 6.0
"""So many radians of turning a metre of way allows the pull as well: who walks may be steered, and who stands is not turned."""


@compiled
def rotation_share(to, root_weight):
    """How much of the turning is the animation's."""
    if to.root == stages.MIXED:
        return root_weight * to.rotation_weight
    return 1.0 if to.root == stages.ANIMATION else 0.0


@compiled
def _position_share(to, root_weight):
    """How much of the movement is the animation's."""
    if to.root == stages.MIXED:
        return root_weight * to.position_weight
    return 0.0 if to.root == stages.CODE else 1.0


@compiled
def move_body(given, dt, before, row):
    """Write where the game has the body, and how fast it moves it: by how far it came since the last update, as a session knows no
    more."""
    has_place, had_body = given[stages.GIVES_BODY] != 0.0, before[stages.HAS_BODY] != 0.0
    row[stages.HAS_BODY] = 1.0 if has_place or had_body else 0.0
    for i in range(3):
        row[stages.BODY + i] = given[stages.GIVEN_BODY + i] if has_place else before[stages.BODY + i]
    is_moved = has_place and had_body and dt > 0.0
    row[stages.HAS_VELOCITY] = 1.0 if is_moved else before[stages.HAS_VELOCITY]
    for i in range(2):
        row[stages.VELOCITY + i] = (
            (given[stages.GIVEN_BODY + i] - before[stages.BODY + i]) / dt if is_moved else before[stages.VELOCITY + i]
        )


@compiled
def place_root(to, given, motion, dt, is_seam, left, entered, before, row):
    """Write the root after some time, in which the clip moved it by `motion`; gives where it is shown.

    At a seam, `left` and `entered` are the velocities of what was left and what is entered, in the body's own frame.
    """
    moved, turned = _position_share(to, given[stages.WEIGHT]), rotation_share(to, given[stages.WEIGHT])
    base = _moved(to, given, motion, dt, moved, turned, before, row)
    offset = (before[stages.OFFSET], before[stages.OFFSET + 1], before[stages.OFFSET + 2])
    speed = (before[stages.OFFSET_SPEED], before[stages.OFFSET_SPEED + 1], before[stages.OFFSET_SPEED + 2])
    if to.blend != stages.PLAIN:
        offset, speed = _decayed(offset, speed, to.damping, dt)
        if is_seam:
            if given[stages.IS_AHEAD] != 0.0 and dt > 0.0:
                entered = (motion[0] / dt, motion[1] / dt, motion[2] / dt)
            apart = (left[0] - entered[0], left[1] - entered[1], 0.0)
            step = _after((0.0, 0.0, base[2]), _bent(apart, before), moved, 0.0)
            change = (step[0], step[1], turned * (left[2] - entered[2]))
            speed = _sum(speed, change)
            if given[stages.IS_AHEAD] != 0.0:
                offset = _sum(offset, (change[0] * dt, change[1] * dt, change[2] * dt))
    if (to.root == stages.MIXED or to.root == stages.PATH) and given[stages.GIVES_BODY] != 0.0:
        base = _clamped(to, base, offset, row)
    for i in range(3):
        row[stages.BASE + i], row[stages.OFFSET + i], row[stages.OFFSET_SPEED + i] = base[i], offset[i], speed[i]
    return _sum(base, offset)


@compiled
def _moved(to, given, motion, dt, moved, turned, before, row):
    """The base after this update's movement and the pull to the game's body."""
    body = (row[stages.BODY], row[stages.BODY + 1], row[stages.BODY + 2])
    has_body = given[stages.GIVES_BODY] != 0.0
    if before[stages.BEGUN] != 0.0:
        base = (before[stages.BASE], before[stages.BASE + 1], before[stages.BASE + 2])
    elif has_body:
        base = body
    else:
        base = (row[stages.CLIP_ROOT], row[stages.CLIP_ROOT + 1], row[stages.CLIP_ROOT + 2])
    after = _after(base, _bent(motion, before), moved, turned)
    if not has_body or to.root == stages.ANIMATION:
        return after
    if to.root == stages.CODE:
        return body
    is_on, way = _way(to, row)
    last = (before[stages.BODY], before[stages.BODY + 1], before[stages.BODY + 2]) if before[stages.HAS_BODY] != 0.0 else body
    x, z, heading = after
    if is_on:
        far = flat_length(x - base[0], z - base[1])
        x, z = base[0] + far * way[0], base[1] + far * way[1]
    x += (1.0 - moved) * (body[0] - last[0])
    z += (1.0 - moved) * (body[1] - last[1])
    heading += (1.0 - turned) * remainder(body[2] - last[2])
    own_m = flat_length(x - base[0], z - base[1])
    own_turn = abs(heading - base[2]) + TURN_PER_M * own_m
    return _pulled(to, (x, z, heading), _beside(x, z, body, is_on, way), own_m, own_turn, dt)


@compiled
def _pulled(to, base, body, way, turned, dt):
    """The base nearer to the game's body, by what it moved and turned itself at most."""
    x, z, heading = body[0] - base[0], body[1] - base[1], remainder(body[2] - base[2])
    apart = flat_length(x, z)
    share = min(_made_up(to.position_pull_s, dt), MOST_PULL * way / apart) if apart > 0.0 else 0.0
    turn = math.copysign(min(_made_up(to.rotation_pull_s, dt) * abs(heading), MOST_PULL * turned), heading)
    return (base[0] + share * x, base[1] + share * z, base[2] + turn)


@compiled
def _clamped(to, base, offset, row):
    """The base from which the shown root is within the clamp: of the body, or of its way in the mode "path"."""
    x, z, heading = _sum(base, offset)
    is_on, way = _way(to, row)
    body = _beside(x, z, (row[stages.BODY], row[stages.BODY + 1], row[stages.BODY + 2]), is_on, way)
    left, ahead, turn = x - body[0], z - body[1], remainder(heading - body[2])
    apart, most = flat_length(left, ahead), to.position_clamp_m
    share = most / apart - 1.0 if apart > most else 0.0
    over = turn - min(max(turn, -to.rotation_clamp), to.rotation_clamp)
    return (base[0] + share * left, base[1] + share * ahead, base[2] - over)


@compiled
def _sum(first, second):
    return (first[0] + second[0], first[1] + second[1], first[2] + second[2])


@compiled
def _decayed(offset, speed, y, dt):
    """An offset and its change a second some time later: `stages.decayed`."""
    fade = math.exp(-y * dt)
    p, q, r = speed[0] + offset[0] * y, speed[1] + offset[1] * y, speed[2] + offset[2] * y
    rest = (fade * (offset[0] + p * dt), fade * (offset[1] + q * dt), fade * (offset[2] + r * dt))
    return rest, (fade * (speed[0] - p * y * dt), fade * (speed[1] - q * y * dt), fade * (speed[2] - r * y * dt))


@compiled
def _after(base, motion, moved, turned):
    """A place after a share of a movement in its own frame."""
    sin, cos = math.sin(base[2]), math.cos(base[2])
    left, ahead = moved * motion[0], moved * motion[1]
    return (base[0] + cos * left + sin * ahead, base[1] - sin * left + cos * ahead, base[2] + turned * motion[2])


@compiled
def _bent(motion, before):
    """A movement of what plays, turned and stretched as the legs were."""
    turn, stride = before[stages.TURN], before[stages.STRIDE]
    if turn == 0.0 and stride == 1.0:
        return motion
    sin, cos = stride * math.sin(turn), stride * math.cos(turn)
    return (cos * motion[0] + sin * motion[1], cos * motion[1] - sin * motion[0], motion[2])


@compiled
def _way(to, row):
    """Whether the game goes a way that the root keeps to, and which; none where it stands."""
    if to.root != stages.PATH or row[stages.HAS_VELOCITY] == 0.0:
        return False, (0.0, 0.0)
    x, z = row[stages.VELOCITY], row[stages.VELOCITY + 1]
    size = flat_length(x, z)
    if size > STANDING_MPS:
        return True, (x / size, z / size)
    return False, (0.0, 0.0)


@compiled
def _beside(x, z, body, is_on, way):
    """The body, moved along its way to beside a place."""
    if not is_on:
        return body
    along = (x - body[0]) * way[0] + (z - body[1]) * way[1]
    return (body[0] + along * way[0], body[1] + along * way[1], body[2])


@compiled
def _made_up(halflife_s, dt):
    """The share of a difference that is gone after some time; none where no half-life is set."""
    return 1.0 - math.exp(-math.log(2.0) * dt / halflife_s) if halflife_s > 0.0 else 0.0
