"""Poses to show: one, and those of many characters at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from contextdb.cells.sequences import Made
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.output.samples import Flags, Place3
from contextdb.motion.records import quickly_made
from contextdb.motion.selection.decision import Action, Decision, Playing

IS_AHEAD, LOST = 10, 12
"""Where a `cdbo_given` of the core's pose.h has whether what is entered has moved the body already, and the seam."""


@quickly_made
@dataclass(frozen=True, eq=False, slots=True)
class Pose:
    """A pose to show.

    Attributes
    ----------
    playing : Playing or None
        What it is a pose of.
    is_jump, is_forced : bool
        Whether something else began to play, and whether it had to: because what played could not play on.
    root : (x, z, heading)
        Where the body is: metres and radians.
    rotations : float64 array, shape (J, 4)
        Each joint against its parent, the first against the root.
    translations : float64 array, shape (J, 3)
        Likewise, in metres; the rig's offset for a joint without a position of its own.
    positions : float64 array, shape (J, 3)
        Each joint in the world.
    contacts : bool array, shape (n feet,)
        Which of `PoseBank.feet` are down in the clip.
    play_rate : float
        Seconds of the clip that pass in a second of play.
    """

    playing: Playing | None
    is_jump: bool
    is_forced: bool
    root: Place3
    rotations: Floats
    translations: Floats
    positions: Floats
    contacts: Flags
    play_rate: float


@quickly_made
@dataclass(frozen=True, eq=False, slots=True)
class CrowdPoses(Made[Pose]):
    """The poses of N characters: a sequence, whose poses are made when they are requested, with their arrays as views.

    Attributes
    ----------
    decisions : sequence of N Decision
        What they are poses of.
    given : float64 array
        What happened to each, as the core has it; see `cdbo_given` in pose.h.
    roots : float64 array, shape (N, 3)
        x, z and heading of each.
    rotations : float64 array, shape (N, J, 4)
    translations, positions : float64 array, shape (N, J, 3)
    contacts : bool array, shape (N, n feet)
    play_rates : float64 array, shape (N,)
    """

    decisions: Sequence[Decision]
    given: Floats
    roots: Floats
    rotations: Floats
    translations: Floats
    positions: Floats
    contacts: Flags
    play_rates: Floats

    def __len__(self) -> int:
        return len(self.decisions)

    def _at(self, i: int) -> Pose:
        decision, (x, z, heading) = self.decisions[i], self.roots[i].tolist()
        is_ahead, seam = self.given[i, IS_AHEAD:LOST].tolist()
        action = decision.action
        is_jump = seam >= 0.0 and (action is Action.JUMP or (action is not Action.START and is_ahead != 0.0))
        is_forced = is_jump and decision.continuing_cost is None
        arrays = self.rotations[i], self.translations[i], self.positions[i], self.contacts[i]
        return Pose(decision.playing, is_jump, is_forced, (x, z, heading), *arrays, float(self.play_rates[i]))
