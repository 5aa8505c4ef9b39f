"""The paths of a crowd: as `contextdb.motion.clips.trajectory` has one, at one moment of each.

Q paths of F frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contextdb.cells.arguments import require_many_of
from contextdb.errors import Fault, QueryError
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.trajectory import Trajectory
from contextdb.motion.records import quickly_made


@quickly_made
@dataclass(frozen=True, eq=False, slots=True)
class ManyTrajectories:
    """Paths of one rate and one length, with their present at one frame.

    Raises
    ------
    QueryError
        Shapes that do not fit each other, or a present outside the paths.
    """

    rate: float
    """Frames a second."""
    positions: Floats
    """On the ground, metres: float64 [Q, F, 2]."""
    headings: Floats
    """Radians, unwrapped: float64 [Q, F]."""
    now: int = 0
    """The frame that counts as time 0."""

    def __post_init__(self) -> None:
        shape = np.shape(self.headings)
        if len(shape) != 2 or np.shape(self.positions) != (*shape, 2) or not 0 <= self.now < shape[1]:
            problem = (
                f"positions of shape {np.shape(self.positions)} and headings of shape {shape}, with the present at {self.now}."
            )
            raise QueryError(Fault(problem, "(paths, frames, 2) and (paths, frames), and a present among the frames"))

    @classmethod
    def of(cls, paths: Sequence[Trajectory]) -> ManyTrajectories:
        """Single paths together; they have one rate, one length and one present."""
        paths = require_many_of(paths, Trajectory, "paths", "a list of Trajectory")
        if not paths:
            return cls(1.0, np.zeros((0, 1, 2)), np.zeros((0, 1)))
        first = paths[0]
        for i, path in enumerate(paths):
            if (path.rate, len(path.headings), path.now) != (first.rate, len(first.headings), first.now):
                problem = f"path {i} has {len(path.headings)} frames at {path.rate:g} a second and its present at {path.now}."
                accepted = f"as path 0: {len(first.headings)} frames at {first.rate:g} a second, the present at {first.now}"
                raise QueryError(Fault(problem, accepted))
        positions, headings = np.array([path.positions for path in paths]), np.array([path.headings for path in paths])
        return cls(first.rate, positions, headings, first.now)

    def __len__(self) -> int:
        return len(self.headings)

    def __getitem__(self, i: int) -> Trajectory:
        return Trajectory(self.rate, self.positions[i], self.headings[i], self.now)
