"""What a character takes for an update, and what an update gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypedDict

from numpy.typing import ArrayLike

from contextdb.motion.characters.tables import Facts
from contextdb.motion.characters.walks import Onward, WishedPaths, body_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.steering import Steered
from contextdb.motion.clips.trajectory import ManyTrajectories, Trajectory
from contextdb.motion.output.stream import Pose
from contextdb.motion.records import quickly_made
from contextdb.motion.selection.decision import Decision, plays
from contextdb.motion.selection.events import Event
from contextdb.motion.selection.search_options import Among, OfPenalties, OfTags, OfValid

UNKNOWN = ("error", "any", "never")
Paths = ManyTrajectories | WishedPaths


class More(TypedDict, total=False):
    """What a controller is asked with beside the query and what is valid; see `Controller.update`."""

    tags: OfTags | None
    bias: Mapping[str, ArrayLike] | None
    penalties: OfPenalties | None
    among: Among | None
    force: bool
    interrupt: bool
    event: Event | None


class Options(More, total=False):
    """And what is valid."""

    valid: OfValid | None


def _at(body: Steered) -> str:
    return f"at x {body.position[0]:.6g}, z {body.position[1]:.6g}"


@quickly_made
@dataclass(frozen=True, eq=False, slots=True)
class Updated:
    """What one update of a character gave.

    Attributes
    ----------
    walks : float64 array, shape (Q, W)
        Where the characters of the crowd that is updated together are, as the core has it.
    facts : mapping of str to object
        Those of the game and the character's own.
    paths, poses : sequence of Trajectory, of Pose
        Those of the crowd.
    decision : Decision
    at : int
        Which of them are this one's.
    """

    walks: Floats
    facts: Facts
    paths: Paths
    decision: Decision
    poses: Sequence[Pose | None] = ()
    at: int = 0

    def __repr__(self) -> str:
        return f"<Updated: tick {self.decision.tick:,}, {plays(self.decision.playing)}, {_at(self.body)}>"

    @property
    def body(self) -> Steered:
        """Where the game has the body."""
        return body_of(self.walks, self.at)

    @property
    def path(self) -> Trajectory:
        """The path that was wished for."""
        return self.paths[self.at]

    @property
    def pose(self) -> Pose | None:
        """The pose, made of the arrays of a crowd when it is requested; None for a character without a stream."""
        return self.poses[self.at] if self.poses else None


class Step(NamedTuple):
    """Half an update: what a character is about to ask."""

    dt_s: float
    on: Onward
    facts: Facts
    paths: Paths
