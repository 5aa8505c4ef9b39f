"""Clips of a walker: what its cycles look like at some speeds and in some turns, each one loop, for a motion database.

So a handful of cycles is a database of a selector beside captured clips: it is chosen by its costs, thresholds and priority as any
other, and the same pose stream shows it. The feet of a clip stand on their footsteps, in a turn too.

    cycle ─► moments evenly spread over a round ─► matrices from the rest pose ─► points of a mesh, by the joints that hold them

The rest pose has the joints at their offsets, none turned, the first at the origin. Positions are against the body, which the game
moves by `speed_mps`; the moment behind the last is the first. F moments, J joints, V points; metres, y up.

Source: Forsyth, "How a Character Should Walk", Game Tech 2004: a crowd plays cycles that are stored as vertices.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contextdb.cells.arguments import require_kind, require_many, require_real, require_whole
from contextdb.errors import Fault, MotionError
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.poses import LEAST_RATE, MOST_RATE, LocalPoses, forward_kinematics
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.clips.steering import Steered
from contextdb.motion.output.stream import Pose
from contextdb.motion.output.track import clip_of_rig
from contextdb.motion.walking.blending import Gait, Mix
from contextdb.motion.walking.cycle import Cycle
from contextdb.motion.walking.walker import USUAL, Walker, WalkSettings

SETTLED_CYCLES = 2
"""After so many a walker walks evenly."""
MOST_CYCLES = 5
"""A clip has as many, at most, as come nearest to a whole number of frames."""
NEAR, HALVINGS = 1.1, 50
"""A speed at which they are one is looked for within this factor, by halving so often."""
MANY = "a list of numbers"
LEAST_MPS, MOST_MPS, MOST_DPS = 0.1, 20.0, 360.0


def walked_clips(
    gaits: Iterable[Gait],
    speeds_mps: Iterable[float],
    turns_dps: Iterable[float] = (0.0,),
    *,
    rate: float = 30.0,
    settings: WalkSettings = USUAL,
) -> list[Clip]:
    """A clip of one cycle or a few, a loop, for each speed and each turn; those of one speed one after another.

    Parameters
    ----------
    gaits : iterable of Gait
        As for `Walker`.
    speeds_mps : iterable of float
        Metres a second, changed by a little, so that a clip is a whole number of frames.
    turns_dps : iterable of float
        Degrees a second, positive to the left.
    rate : float
        Frames a second.
    settings : WalkSettings

    Returns
    -------
    list of Clip
        In centimetres. A name is the gait, the speed as it was requested, and the turn: "walk_1.30", "walk_1.30_left_45".

    Raises
    ------
    MotionError
        What `Walker` raises, or the same speed and turn twice.
    ContextError
        An argument of another type, or out of range.
    """

    owned = Walker(gaits, settings).gaits
    rate = require_real(rate, "rate", LEAST_RATE, MOST_RATE)
    speeds = [require_real(each, "one of speeds_mps", LEAST_MPS, MOST_MPS) for each in require_many(speeds_mps, "speeds_mps", MANY)]
    turns = [require_real(each, "one of turns_dps", -MOST_DPS, MOST_DPS) for each in require_many(turns_dps, "turns_dps", MANY)]
    clips = [_walked(owned, speed, turn, rate, settings) for speed in speeds for turn in turns]
    if len({clip.name for clip in clips}) < len(clips):
        raise MotionError(Fault("two clips would have one name.", "speeds that differ by 0.01 m/s, and turns by a degree a second"))
    return clips


def _walked(gaits: Sequence[Gait], wanted_mps: float, turn_dps: float, rate: float, settings: WalkSettings) -> Clip:
    speed, n = _even(gaits, wanted_mps, turn_dps / settings.full_turn_dps, rate)
    walker = _settled(gaits, speed, turn_dps, rate, settings)
    poses = [walker.update(1.0 / rate, _body(speed, turn_dps, (frame + 1) / rate)) for frame in range(n + 1)]
    side = f"_{'left' if turn_dps > 0.0 else 'right'}_{abs(turn_dps):.0f}" if turn_dps else ""
    return clip_of_rig(
        poses, _rig(walker.gaits[0].cycles[0].skeleton, poses[0]), [0], rate, f"{walker.gait}_{wanted_mps:.2f}{side}"
    )


def _even(gaits: Sequence[Gait], wanted_mps: float, turn: float, rate: float) -> tuple[float, int]:
    """The speed near a wanted one at which some cycles are a whole number of frames, and that number."""
    gait = next((each for each in gaits if wanted_mps <= each.fastest_mps), gaits[-1])

    def frames(speed: float) -> float:
        return Mix.of(gait.cycles, gait.weights(speed, 0.0, turn)).stride_m * rate / speed

    exact = frames(wanted_mps)
    n_cycles = min(range(1, MOST_CYCLES + 1), key=lambda k: abs(round(k * exact) / (k * exact) - 1.0))
    n = max(1, round(n_cycles * exact))
    slow, fast = wanted_mps / NEAR, wanted_mps * NEAR
    for _ in range(HALVINGS):
        middle = (slow + fast) / 2.0
        slow, fast = (middle, fast) if n_cycles * frames(middle) > n else (slow, middle)
    return (slow + fast) / 2.0, n


def _settled(gaits: Sequence[Gait], speed: float, turn_dps: float, rate: float, settings: WalkSettings) -> Walker:
    """A walker that comes evenly to the origin, for some cycles."""
    walker = Walker(gaits, settings)
    cycle_s = max(cycle.stride_m for gait in gaits for cycle in gait.cycles) / speed
    n = math.ceil(SETTLED_CYCLES * cycle_s * rate)
    for frame in range(-n, 1):
        walker.update(1.0 / rate if frame > -n else 0.0, _body(speed, turn_dps, frame / rate))
    return walker


def _body(speed: float, turn_dps: float, seconds: float) -> Steered:
    """A body that goes through the origin at time 0, straight on or on a circle."""
    turn = math.radians(turn_dps)
    heading = turn * seconds
    chord = speed * seconds * float(np.sinc(heading / 2.0 / np.pi))
    place = chord * math.sin(heading / 2.0), chord * math.cos(heading / 2.0)
    velocity = speed * math.sin(heading), speed * math.cos(heading)
    return Steered(position=place, velocity=velocity, heading=heading, turn_rate=turn)


def _rig(skeleton: Skeleton, pose: Pose) -> Skeleton:
    """A skeleton with its offsets in metres, as a pose has them."""
    offsets = np.array(pose.translations)
    offsets[0] = 0.0
    own, displayed = (float(np.linalg.norm(each[1:])) for each in (skeleton.offsets, offsets))
    scale = displayed / own if own else 1.0
    ends = tuple((joint, (x * scale, y * scale, z * scale)) for joint, (x, y, z) in skeleton.end_sites)
    return replace(skeleton, offsets=offsets, end_sites=ends)


# ---- a cycle baked for a crowd: its poses in a table of matrices, or points of a mesh, so that showing one is a look-up and
# no work


MOST_MOMENTS = 4096
POINTS, WEIGHTS = "points of the rest pose, [V, 3] in metres", "for each point a weight of each joint, [V, J], which sum to one"


def baked_cycle(
    cycle: Cycle, n_moments: int = 32, points: ArrayLike | None = None, weights: ArrayLike | None = None
) -> dict[str, NDArray[Any]]:
    """The arrays of a cycle, for `write_arrays`.

    Parameters
    ----------
    cycle : Cycle
    n_moments : int
        How many, evenly spread over one round.
    points, weights : float arrays, shapes (V, 3) and (V, J), optional
        A mesh in the rest pose, and how much each joint holds of each point. Default: no mesh.

    Returns
    -------
    dict
        `matrices` float32 [F, J, 3, 4], which take a point of the rest pose to where its joint has it; `rest` float32 [J, 3], the
        joints of the rest pose; `bones` [J]; `phase` [F], 0 is the left foot in mid-stance; `speed_mps`, `turn_dps`, `duration_s`;
        with a mesh `positions` float32 [F, V, 3].

    Raises
    ------
    MotionError
        Points without weights, or of other shapes, weights that do not sum to one, or too few moments.
    ContextError
        An argument of another type.
    """
    require_kind(cycle, Cycle, "cycle", "a Cycle")
    n_moments = require_whole(n_moments, "n_moments")
    if not 2 <= n_moments <= MOST_MOMENTS:
        raise MotionError(Fault(f"n_moments is {n_moments}.", f"from 2 to {MOST_MOMENTS:,}"))
    phases = np.arange(n_moments) / n_moments
    rotations, translations = (np.array(each) for each in zip(*map(cycle.at, phases.tolist()), strict=True))
    poses = forward_kinematics(LocalPoses(cycle.skeleton, 1.0, translations, rotations))
    rest = _rest(cycle)
    turns = np.stack([quaternions.rotate(poses.rotations, axis) for axis in np.eye(3)], axis=-1)
    moved = poses.positions - np.einsum("fjab,jb->fja", turns, rest)
    matrices = np.concatenate((turns, moved[..., None]), axis=-1)
    arrays: dict[str, NDArray[Any]] = {
        "matrices": matrices.astype(np.float32),
        "rest": rest.astype(np.float32),
        "bones": np.array(cycle.skeleton.names),
        "phase": phases,
        "speed_mps": np.array(cycle.speed_mps),
        "turn_dps": np.array(cycle.turn_dps),
        "duration_s": np.array(cycle.duration_s),
    }
    if points is not None or weights is not None:
        held, shares = _mesh(points, weights, len(rest))
        arrays["positions"] = np.einsum("vj,fjab,vb->fva", shares, matrices, held, optimize=True).astype(np.float32)
    return arrays


def _rest(cycle: Cycle) -> Floats:
    """Where the joints are in the rest pose: [J, 3]."""
    offsets = np.array(cycle.positions[0])
    offsets[0] = 0.0
    turned = np.tile([1.0, 0.0, 0.0, 0.0], (1, len(offsets), 1))
    return np.asarray(forward_kinematics(LocalPoses(cycle.skeleton, 1.0, offsets[None], turned)).positions[0])


def _mesh(points: ArrayLike | None, weights: ArrayLike | None, n_joints: int) -> tuple[Floats, Floats]:
    """The points with 1 behind each [V, 4], and the weights [V, J]."""
    try:
        own, shares = (np.asarray(each, np.float64) for each in (points, weights))
    except (TypeError, ValueError):
        raise MotionError(Fault("points or weights are not numbers.", f"{POINTS}; {WEIGHTS}")) from None
    if own.ndim != 2 or own.shape[1] != 3 or shares.shape != (len(own), n_joints):
        problem = f"points have the shape {own.shape}, weights {shares.shape}, and there are {n_joints} joints."
        raise MotionError(Fault(problem, f"{POINTS}; {WEIGHTS}"))
    if not (np.isfinite(own).all() and np.abs(shares.sum(axis=1) - 1.0).max(initial=0.0) < 1e-3):
        raise MotionError(Fault("points are not finite, or weights do not sum to one.", f"{POINTS}; {WEIGHTS}"))
    return np.concatenate((own, np.ones((len(own), 1))), axis=1), shares
