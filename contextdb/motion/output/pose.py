"""Poses to show: one, and those of many characters at once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from contextdb.cells.sequences import Made
from contextdb.core import pose_columns
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.output.samples import Flags, Place3
from contextdb.motion.records import quickly_made
from contextdb.motion.selection.decision import Action, Decision, Playing

COLUMNS = pose_columns()
"""Where each single number of a row is."""
PLAY_RATE = COLUMNS["play_rate"]
N_GIVEN, N_SEAM, IS_AHEAD, LOST = 16, 4, 10, 12
"""So many numbers the core is given of a character and of a moment at a seam, see `cdbo_given` in pose.h; and where it has whether
what is entered has moved the body already, and the seam."""
N_MADE = N_GIVEN + 2 * N_SEAM


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


class CrowdPoses(Made[Pose]):
    """The poses of N characters: a sequence, whose poses are made when they are requested, with their arrays as views.

    Attributes
    ----------
    decisions : sequence of N Decision
        What they are poses of.
    roots : float64 array, shape (N, 3)
        x, z and heading of each.
    contacts : bool array, shape (N, n feet)
    """

    def __init__(
        self, decisions: Sequence[Decision], roots: Floats, contacts: Flags, rows: Floats, made: Floats, n_joints: int
    ) -> None:
        self.decisions, self.roots, self.contacts = decisions, roots, contacts
        self._rows, self._made, self._n_joints = rows, made, n_joints

    def __len__(self) -> int:
        return len(self.decisions)

    @cached_property
    def _parts(self) -> list[Floats]:
        """What the core made, one array after the other."""
        n, n_joints, stop, parts = len(self), self._n_joints, 0, list[Floats]()
        for shape in (n, N_GIVEN), (2 * n, N_SEAM), (n, n_joints, 4), (n, n_joints, 3), (n, n_joints, 3):
            start, stop = stop, stop + math.prod(shape)
            parts.append(self._made[start:stop].reshape(shape))
        return parts

    @property
    def given(self) -> Floats:
        """What happened to each, as the core has it, see `cdbo_given` in pose.h: float64 [N, 16]."""
        return self._parts[0]

    @property
    def seams(self) -> Floats:
        """The moments at seams, two for each character that has one: float64 [2 N, 4]."""
        return self._parts[1]

    @property
    def rotations(self) -> Floats:
        """Each joint against its parent: float64 [N, J, 4]."""
        return self._parts[2]

    @property
    def translations(self) -> Floats:
        """Likewise, in metres: float64 [N, J, 3]."""
        return self._parts[3]

    @property
    def positions(self) -> Floats:
        """Each joint in the world: float64 [N, J, 3]."""
        return self._parts[4]

    @property
    def play_rates(self) -> Floats:
        """Seconds of the clip that pass in a second of play: float64 [N]."""
        return self._rows[:, PLAY_RATE]

    def _at(self, i: int) -> Pose:
        decision, (x, z, heading) = self.decisions[i], self.roots[i].tolist()
        given, _, rotations, translations, positions = self._parts
        is_ahead, seam = given[i, IS_AHEAD:LOST].tolist()
        action = decision.action
        is_jump = seam >= 0.0 and (action is Action.JUMP or (action is not Action.START and is_ahead != 0.0))
        is_forced = is_jump and decision.continuing_cost is None
        arrays = rotations[i], translations[i], positions[i], self.contacts[i]
        return Pose(decision.playing, is_jump, is_forced, (x, z, heading), *arrays, float(self.play_rates[i]))
