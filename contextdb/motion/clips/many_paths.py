"""The paths of a crowd: as `contextdb.motion.clips.trajectory` has one, at one moment of each.

Q paths of F frames, P points of each. What is asked for is worked out for all at once, by the formulas for one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

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

    def after_seconds(self, seconds: tuple[float, ...]) -> PathPoints:
        """Each path some seconds after its present, or before: its arrays are [Q, P, ...]; see `trajectory.after_seconds`."""
        return self._points(_after_seconds(seconds, self.now, self._last, self.rate))

    def along(self, metres: tuple[float, ...]) -> PathPoints:
        """Each path some metres further along than its present, or back: [Q, P, ...]; see `trajectory.along_path`."""
        steps = np.asarray(metres, np.float64)
        wanted = self.lengths[:, self.now, None] + steps
        inside = np.where(
            steps == 0.0, float(self.now), self._frames_at(wanted)
        )  # where a body stands, many frames have one length
        beyond = np.clip(wanted - self.lengths[:, -1:], 0.0, None), np.clip(wanted, None, 0.0)
        first, last = (np.linalg.norm(self._velocities_at(at), axis=-1)[:, None] for at in (0, self._last))
        after = np.divide(beyond[0] * self.rate, last, out=np.zeros(wanted.shape), where=last > STANDING_MPS)
        before = np.divide(beyond[1] * self.rate, first, out=np.zeros(wanted.shape), where=first > STANDING_MPS)
        with np.errstate(invalid="ignore"):  # a path that is not finite has points that are not
            return self._points(_Sampling.of(inside + after + before, self._last, self.rate))

    @property
    def _last(self) -> int:
        return int(self.headings.shape[1]) - 1

    def _frames_at(self, lengths: Floats) -> Floats:
        """Where each path has some lengths [Q, P], as frames between its first and last: `np.interp` of each row."""
        at = np.clip((self.lengths[:, None] <= lengths[..., None]).sum(axis=-1) - 1, 0, max(0, self._last - 1))
        begins = np.take_along_axis(self.lengths, at, axis=1)
        steps = np.take_along_axis(self.lengths, np.minimum(at + 1, self._last), axis=1) - begins
        shares = np.divide(lengths - begins, steps, out=np.zeros(lengths.shape), where=steps > 0.0)
        return np.asarray(np.where(lengths >= self.lengths[:, -1:], float(self._last), at + np.clip(shares, 0.0, 1.0)))

    def _velocities_at(self, frame: int) -> Floats:
        """Metres a second of each path at one frame: [Q, 2]; central differences, one-sided at the ends."""
        before, after = max(frame - 1, 0), min(frame + 1, self._last)
        return np.asarray((self.positions[:, after] - self.positions[:, before]) / (max(after - before, 1) * (1.0 / self.rate)))

    def _points(self, at: _Sampling) -> PathPoints:
        """Each path at some moments, also before its first frame and behind its last."""
        before, after, *around = self._taken(self.positions, at.frames)
        velocities = (around[1] - around[0]) / at.seconds[0] * at.rests + (around[3] - around[2]) / at.seconds[1] * at.shares
        positions = before * at.rests + after * at.shares + velocities * at.beyond_s
        headings = self._taken(self.headings, at.frames[:2])
        return PathPoints(positions, headings[0] * at.rests[..., 0] + headings[1] * at.shares[..., 0], velocities)

    def _taken(self, values: Floats, frames: NDArray[np.int64]) -> Floats:
        """The values [Q, F, ...] at frames [K, P], the same of each path, or [K, Q, P]: [K, Q, P, ...]."""
        if frames.ndim == 2:
            return values.take(frames, axis=1).swapaxes(0, 1)
        return np.asarray(values[np.arange(len(values))[:, None], frames])


@dataclass(frozen=True, eq=False, slots=True)
class _Sampling:
    """Where to look in paths for P moments each, the same of all paths [P] or of each its own [Q, P].

    Attributes
    ----------
    frames : int64 array, shape (6, P) or (6, Q, P)
        The frames before and after the moment, and for the velocity of either the frames around it.
    seconds : float64 array, shape (2, P, 1) or (2, Q, P, 1)
        From one to the other of the frames around.
    rests, shares : float64 array, shape (P, 1) or (Q, P, 1)
        How much of the frame before, and of the one after.
    beyond_s : float64 array, shape (P, 1) or (Q, P, 1)
        How far before the path's start, negative, or behind its end.
    """

    frames: NDArray[np.int64]
    seconds: Floats
    rests: Floats
    shares: Floats
    beyond_s: Floats

    @classmethod
    def of(cls, moments: Floats, last: int, rate: float) -> _Sampling:
        """Of fractional frames of paths whose last frame is `last`."""
        inside = np.clip(moments, 0.0, float(last))
        before = np.clip(inside.astype(np.int64), 0, max(0, last - 1))
        after = np.minimum(before + 1, last)
        around = [(np.maximum(at - 1, 0), np.minimum(at + 1, last)) for at in (before, after)]
        seconds = np.stack([np.maximum(high - low, 1) * (1.0 / rate) for low, high in around])[..., None]
        shares = (inside - before)[..., None]
        frames = np.stack([before, after, *around[0], *around[1]])
        return cls(frames, seconds, 1.0 - shares, shares, ((moments - inside) / rate)[..., None])


@lru_cache(256)
def _after_seconds(seconds: tuple[float, ...], now: int, last: int, rate: float) -> _Sampling:
    """Where to look some seconds after the present: the same in every path of one length."""
    return _Sampling.of(now + np.array(seconds, np.float64) * rate, last, rate)
