"""What a character takes for an update, and what an update gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypedDict

from numpy.typing import ArrayLike

from contextdb.motion.characters.tables import Facts
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.steering import Steered
from contextdb.motion.clips.trajectory import ManyTrajectories, Trajectory
from contextdb.motion.output.stream import Pose
from contextdb.motion.records import quickly_made
from contextdb.motion.selection.decision import Decision, plays
from contextdb.motion.selection.events import Event
from contextdb.motion.selection.search_options import Among, OfPenalties, OfTags, OfValid

UNKNOWN = ("error", "any", "never")
Paths = ManyTrajectories | Sequence[Trajectory]


class Options(TypedDict, total=False):
    """What a controller is asked with beside the query; see `Controller.update`."""

    valid: OfValid | None
    tags: OfTags | None
    bias: Mapping[str, ArrayLike] | None
    penalties: OfPenalties | None
    among: Among | None
    force: bool
    interrupt: bool
    event: Event | None


def _at(body: Steered) -> str:
    return f"at x {body.position[0]:.6g}, z {body.position[1]:.6g}"


@quickly_made
@dataclass(frozen=True, eq=False, slots=True)
class Updated:
    """What one update of a character gave.

    Attributes
    ----------
    body : Steered
        Where the game has the body.
    facts : mapping of str to object
        Those of the game and the character's own.
    paths, poses : sequence of Trajectory, of Pose
        Those of the crowd that is updated together.
    decision : Decision
    at : int
        Which of them are this one's.
    """

    body: Steered
    facts: Facts
    paths: Paths
    decision: Decision
    poses: Sequence[Pose | None] = ()
    at: int = 0

    def __repr__(self) -> str:
        return f"<Updated: tick {self.decision.tick:,}, {plays(self.decision.playing)}, {_at(self.body)}>"

    @property
    def path(self) -> Trajectory:
        """The path that was wished for."""
        return self.paths[self.at]

    @property
    def pose(self) -> Pose | None:
        """The pose, made of the arrays of a crowd when it is requested; None for a character without a stream."""
        return self.poses[self.at] if self.poses else None


@quickly_made
@dataclass(frozen=True, eq=False, slots=True)
class Step:
    """Half an update: what a character is about to ask."""

    dt_s: float
    walk: Floats
    goal: Floats
    body: Steered
    facts: Facts
