"""Joints given as arrays: put in the order of a skeleton, and written as the channels of a clip.

F frames, J joints; metres, y up. Rotations are unit quaternions (w, x, y, z) against the parent.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from contextdb.errors import ClipError, Fault, in_quotes, plural
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import POSITIONS, Ints

AXES = "zxy"
TURNS = ("Zrotation", "Xrotation", "Yrotation")
STILL_M = 1e-6
"""A joint that moves less against its parent is at its offset."""
MOST_JOINTS = 10_000
MOST_FRAME_JOINTS = 10_000_000
"""Joints of all frames together."""
SMALL_FRAME_JOINTS = 500_000
"""So many may a file of few keys mean, and a large one one more for each of its bytes."""


def most_frame_joints(n_bytes: int) -> int:
    """How many joints of frames a file of a size may mean, so that a damaged time in a small file does not take all memory."""
    return min(SMALL_FRAME_JOINTS + n_bytes, MOST_FRAME_JOINTS)


def channels_of(n_joints: int, placed: Collection[int]) -> tuple[tuple[str, ...], ...]:
    """The channels of joints of which some have positions of their own."""
    return tuple((*POSITIONS, *TURNS) if joint in placed else TURNS for joint in range(n_joints))


def values_of(rotations: Floats, positions: Floats, placed: Collection[int]) -> Floats:
    """The values [F, C] of these channels: positions [F, J, 3] as they are, rotations [F, J, 4] in degrees."""
    angles = np.rad2deg(quaternions.to_euler(AXES, rotations))
    columns: list[Floats] = []
    for joint in range(rotations.shape[1]):
        if joint in placed:
            columns.append(positions[:, joint])
        columns.append(angles[:, joint])
    return np.concatenate(columns, axis=1)


def moving_joints(offsets: Floats, positions: Floats) -> list[int]:
    """The root, and the joints that do not stay at their offsets."""
    apart = np.abs(positions - offsets).max(axis=(0, 2), initial=0.0)
    return sorted({0, *np.flatnonzero(apart > STILL_M).tolist()})


def depth_first(parents: Ints) -> Ints:
    """The joints in the order of a skeleton, a parent's descendants directly behind it: int64 [J]."""
    children: list[list[int]] = [[] for _ in parents]
    for joint, parent in enumerate(parents.tolist()):
        if parent >= 0:
            children[parent].append(joint)
    order, waiting = [], np.flatnonzero(parents < 0).tolist()[::-1]
    while waiting:
        order.append(waiting.pop())
        waiting += reversed(children[order[-1]])
    return np.array(order, np.int64)


def tree_faults(names: Sequence[str], parents: NDArray[np.generic]) -> Iterator[Fault]:
    """What keeps names and parents from being a skeleton."""
    if not 0 < len(names) <= MOST_JOINTS:
        yield Fault(f"there are {plural(len(names), 'joint')}.", f"1 to {MOST_JOINTS:,}")
        return
    twice = next((name for i, name in enumerate(names) if name in set(names[:i])), None) if len(set(names)) < len(names) else None
    if twice is not None:
        yield Fault(f"two joints are named {in_quotes(twice)}.", "different names for all joints")
    if parents.shape != (len(names),) or parents.dtype.kind not in "iu":
        yield Fault(
            f"the parents are {parents.dtype} {list(parents.shape)}.", f"whole numbers, one for each of {len(names)} joints"
        )
        return
    listed = parents.astype(np.int64)
    roots = int((listed < 0).sum())
    if roots != 1:
        yield Fault(f"{plural(roots, 'joint')} of {len(names)} have no parent (-1).", "one, the root")
    elif (listed >= len(names)).any() or len(depth_first(listed)) < len(names):
        yield Fault("the parents are no tree.", "for each joint the number of its parent, from 0; -1 for the root")


def require_numbers(array: Floats, what: str, shape: tuple[int | None, ...]) -> None:
    """Raise ClipError unless an array has a shape (None: any length) and holds finite numbers only."""
    fits = array.ndim == len(shape) and all(n is None or n == own for n, own in zip(shape, array.shape, strict=True))
    if not fits or not np.isfinite(array).all():
        wanted = ", ".join("frames" if n is None else str(n) for n in shape)
        problem = f"the {what} are {list(array.shape)}{', not all finite' if fits else ''}."
        raise ClipError(Fault(problem, f"finite numbers, [{wanted}]"))
