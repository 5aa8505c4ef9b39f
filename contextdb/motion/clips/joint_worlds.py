"""Joints in the world, as other formats have them, made clips: rest poses without turns, one root, unique names.

Formats other than BVH turn bones at rest, put nodes above the root, scale them, and have nodes beside the body. Here each joint is
turned against its own rest, so that where nothing is turned the body rests, as in BVH. F frames, J joints; metres, y up.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb.errors import ClipError, Fault, plural, some
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.clip import MOST_RATE, Clip
from contextdb.motion.clips.joint_arrays import depth_first
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints

LEAST_MATRIX = 1e-12
"""A bone whose axes span less is scaled away."""


@dataclass(frozen=True, eq=False)
class JointWorlds:
    """Joints as a file has them."""

    names: Sequence[str]
    """Not always unique."""
    parents: Ints
    """-1 of each joint without one: int64 [J]."""
    rest: Floats
    frames: Floats
    """`rest`, `frames`: where each joint is in the world, as matrices whose last column is its place: float64 [J, 4, 4] and [F, J,
    4, 4]."""
    deforms: NDArray[np.bool_]
    """Whether a skin hangs on it; all False where nothing is known of skins: bool [J]."""
    rate: float
    """Frames a second."""

    def clip(self, name: str) -> Clip:
        """The clip of its body. Raises ClipError where there is none, or numbers are not finite."""
        if not 1.0 <= self.rate <= MOST_RATE:
            raise ClipError(Fault(f"the rate is {self.rate:g} frames a second.", f"1 to {MOST_RATE:g}"))
        if not (np.isfinite(self.rest).all() and np.isfinite(self.frames).all()):
            raise ClipError(Fault("places of joints are not finite.", "finite numbers"))
        body = self._body()
        left_out = [self.names[joint] for joint in sorted({*range(len(self.names))} - {*body.tolist()})]
        rank = np.full(len(self.names), -1, np.int64)
        rank[body] = np.arange(len(body))
        parents = np.where(self.parents[body] >= 0, rank[self.parents[body]], -1)
        rest, frames = self.rest[body], self.frames[:, body]
        rest_turns, turns = _turns(rest), _turns(frames)
        turns = quaternions.multiply(turns, quaternions.inverse(rest_turns))
        above, is_root = np.maximum(parents, 0), parents[:, None] < 0
        offsets = rest[:, :3, 3] - np.where(is_root, 0.0, rest[above, :3, 3])
        back = quaternions.inverse(np.where(is_root, np.array([1.0, 0.0, 0.0, 0.0]), turns[:, above]))
        places = frames[:, :, :3, 3]
        local = quaternions.rotate(back, places - np.where(is_root, 0.0, places[:, above]))
        joints = unique_names([self.names[joint] for joint in body])
        clip = Clip.from_arrays(joints, parents, offsets, quaternions.multiply(back, turns), local, self.rate, name=name)
        note = f"{plural(len(left_out), 'node')} beside the body left out: {some(left_out)}."
        return Clip(name, clip.skeleton, clip.frame_time_s, clip.values, notes=(note,) if left_out else ())

    def _body(self) -> Ints:
        """The joints of the body, a parent before its children: the tree on which most skins hang, else that with most joints, of
        trees that move before those that do not."""
        roots = np.arange(len(self.names))
        for joint in depth_first(self.parents).tolist():
            if self.parents[joint] >= 0:
                roots[joint] = roots[self.parents[joint]]
        if not len(roots):
            raise ClipError(Fault("there is no bone.", "a skeleton"))
        moves = np.ptp(self.frames, axis=0).max(axis=(1, 2), initial=0.0) > 0.0 if len(self.frames) else self.deforms
        best = max(
            set(roots.tolist()),
            key=lambda root: (
                int(self.deforms[roots == root].sum()),
                bool(moves[roots == root].any()),
                int((roots == root).sum()),
                -root,
            ),
        )
        order = depth_first(self.parents)
        return np.asarray(order[roots[order] == best])


def unique_names(names: Sequence[str]) -> list[str]:
    """The names, those that are empty or were there before with a number behind them."""
    taken: set[str] = set()
    counts: dict[str, int] = {}
    unique = []
    for each in names:
        name = plain = " ".join(each.split()) or "joint"
        while name in taken:
            counts[plain] = counts.get(plain, 1) + 1
            name = f"{plain}_{counts[plain]}"
        taken.add(name)
        unique.append(name)
    return unique


def numbered(names: Sequence[str]) -> tuple[str, ...]:
    """The names of takes, those that are there more than once with their number, from 1."""
    counts = Counter(names)
    return tuple(name if counts[name] == 1 else f"{name} {i}" for i, name in enumerate(names, start=1))


def _turns(matrices: Floats) -> Floats:
    """The rotations [..., 4] of matrices [..., 4, 4] whose axes may be scaled or mirrored."""
    axes = matrices[..., :3, :3]
    lengths = np.linalg.norm(axes, axis=-2, keepdims=True)
    if not (lengths > LEAST_MATRIX).all():
        raise ClipError(Fault("a joint is scaled to nothing.", "joints with a size"))
    unit = axes / lengths
    return quaternions.from_matrices(unit * np.sign(np.linalg.det(unit))[..., None, None])
