"""The paths of a crowd: as `contextdb.motion.clips.trajectory` has one, at one moment of each.

Q paths of F frames. What is asked for is worked out for all at once, by the formulas for one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import require_many_of
from contextdb.errors import Fault, QueryError
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.trajectory import STANDING_MPS, PathPoints, Trajectory


@dataclass(frozen=True, eq=False)
class ManyTrajectories:
    """Paths of one rate and one length, with their present at one frame.

    Attributes
    ----------
    rate : float
        Frames a second.
    positions : float64 array, shape (Q, F, 2)
        On the ground, metres.
    headings : float64 array, shape (Q, F)
        Radians, unwrapped.
    now : int
        The frame that counts as time 0.

    Raises
    ------
    QueryError
        Shapes that do not fit each other, or a present outside the paths.
    """

    rate: float
    positions: Floats
    headings: Floats
    now: int = 0

    def __post_init__(self) -> None:
        shape = np.shape(self.headings)
        if len(shape) != 2 or np.shape(self.positions) != (*shape, 2) or not 0 <= self.now < shape[1]:
            found = f"positions of shape {np.shape(self.positions)} and headings of shape {shape}, with the present at {self.now}."
            raise QueryError(Fault(found, "(paths, frames, 2) and (paths, frames), and a present among the frames"))

    @classmethod
    def of(cls, paths: Sequence[Trajectory]) -> ManyTrajectories:
        """Single paths together; they have one rate, one length and one present."""
        paths = require_many_of(paths, Trajectory, "paths", "a list of Trajectory")
        if not paths:
            return cls(1.0, np.zeros((0, 1, 2)), np.zeros((0, 1)))
        first = paths[0]
        for i, path in enumerate(paths):
            if (path.rate, len(path.headings), path.now) != (first.rate, len(first.headings), first.now):
                found = f"path {i} has {len(path.headings)} frames at {path.rate:g} a second and its present at {path.now}."
                accepted = f"as path 0: {len(first.headings)} frames at {first.rate:g} a second, the present at {first.now}"
                raise QueryError(Fault(found, accepted))
        positions, headings = np.array([path.positions for path in paths]), np.array([path.headings for path in paths])
        return cls(first.rate, positions, headings, first.now)

    def __len__(self) -> int:
        return len(self.headings)

    def __getitem__(self, i: int) -> Trajectory:
        return Trajectory(self.rate, self.positions[i], self.headings[i], self.now)

    @cached_property
    def lengths(self) -> Floats:
        """Metres along each path from its first frame: [Q, F]."""
        steps = np.linalg.norm(np.diff(self.positions, axis=1), axis=-1)
        return np.concatenate((np.zeros((len(self), 1)), np.cumsum(steps, axis=1)), axis=1)

    def after_seconds(self, seconds: float) -> PathPoints:
        """Each path some seconds after its present, or before; see `trajectory.after_seconds`."""
        return self._at_frames(np.full(len(self), self.now + seconds * self.rate))

    def along(self, metres: float) -> PathPoints:
        """Each path some metres further along than its present, or back; see `trajectory.along_path`."""
        now = np.full(len(self), float(self.now))
        wanted = self.lengths[:, self.now] + metres
        inside = now if metres == 0.0 else self._frames_at(wanted)
        beyond = np.clip(wanted - self.lengths[:, -1], 0.0, None), np.clip(wanted, None, 0.0)
        first, last = (np.linalg.norm(self._velocities(np.full(len(self), at)), axis=-1) for at in (0, self._last))
        after = np.divide(beyond[0] * self.rate, last, out=np.zeros(len(self)), where=last > STANDING_MPS)
        before = np.divide(beyond[1] * self.rate, first, out=np.zeros(len(self)), where=first > STANDING_MPS)
        return self._at_frames(inside + after + before)

    @property
    def _last(self) -> int:
        return int(self.headings.shape[1]) - 1

    @cached_property
    def _every(self) -> NDArray[np.int64]:
        return np.arange(len(self))

    def _frames_at(self, lengths: Floats) -> Floats:
        """Where each path has a length [Q], as frames between its first and last: `np.interp` of each row."""
        at = np.clip((self.lengths <= lengths[:, None]).sum(axis=1) - 1, 0, max(0, self._last - 1))
        begins, ends = self.lengths[self._every, at], self.lengths[self._every, np.minimum(at + 1, self._last)]
        steps = ends - begins
        shares = np.divide(lengths - begins, steps, out=np.zeros(len(self)), where=steps > 0.0)
        return np.asarray(np.where(lengths >= self.lengths[:, -1], float(self._last), at + np.clip(shares, 0.0, 1.0)))

    def _at_frames(self, frames: Floats) -> PathPoints:
        """Each path at one fractional frame [Q], also before its first and behind its last."""
        inside = np.clip(frames, 0.0, float(self._last))
        beyond_s = (frames - inside) / self.rate
        before = np.minimum(inside.astype(np.int64), max(0, self._last - 1))
        after, shares = np.minimum(before + 1, self._last), inside - before
        own, wide = self._every, shares[:, None]
        velocities = self._velocities(before) * (1.0 - wide) + self._velocities(after) * wide
        positions = self.positions[own, before] * (1.0 - wide) + self.positions[own, after] * wide
        headings = self.headings[own, before] * (1.0 - shares) + self.headings[own, after] * shares
        return PathPoints(positions + velocities * beyond_s[:, None], headings, velocities)

    def _velocities(self, frames: NDArray[np.int64]) -> Floats:
        """Metres a second of each path at one frame [Q]: central differences, one-sided at the ends, [Q, 2]."""
        before, after = np.maximum(frames - 1, 0), np.minimum(frames + 1, self._last)
        seconds = np.maximum(after - before, 1) * (1.0 / self.rate)
        return np.asarray((self.positions[self._every, after] - self.positions[self._every, before]) / seconds[:, None])
