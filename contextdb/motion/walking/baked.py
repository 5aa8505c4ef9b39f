"""A cycle baked for a crowd: its poses in a table of matrices, or points of a mesh, so that showing one is a look-up and no work.

    cycle ─► moments evenly spread over a round ─► matrices from the rest pose ─► points of a mesh, by the joints that hold them

The rest pose has the joints at their offsets, none turned, the first at the origin. Positions are against the body, which the game
moves by `speed_mps`; the moment behind the last is the first. F moments, J joints, V points; metres, y up.

Source: Forsyth, "How a Character Should Walk", Game Tech 2004: a crowd plays cycles that are stored as vertices.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contextdb.cells.arguments import require_kind, require_whole
from contextdb.errors import Fault, MotionError
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.poses import LocalPoses, forward_kinematics
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.walking.cycle import Cycle

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
