"""A pose stream: what a controller decides, tick by tick, as poses.

The decision says which clip plays and when in it. The clip's pose is sampled between frames, goes through the stages of
the core (`pose.h`), and is placed joint by joint. A stream reads no clock and draws no random number: the same
decisions give the same poses. One stream is a crowd of one: see `contextdb.motion.output.streams`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from contextdb.cells.arguments import require_kind, require_real
from contextdb.errors import ContextError, Fault, MotionError, plural
from contextdb.motion.clips.ground_place import A_BODY, OfBody, place_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.steering import Steered
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.ground import A_GROUND, Ground
from contextdb.motion.output.pipeline import COLUMNS, Pipeline, Rows
from contextdb.motion.output.pose import CrowdPoses, Pose
from contextdb.motion.output.samples import Flags
from contextdb.motion.output.settings import PoseSettings, RootMode
from contextdb.motion.selection.controller import Decided
from contextdb.motion.selection.decision import Decision, Playing, plays

__all__ = ["Pose", "PoseState", "PoseStream"]

DEFAULT_SETTINGS = PoseSettings()
OTHER_STATE = Fault("the state is of a stream of other settings or of another rig.", "a state of this stream")


@dataclass(frozen=True, eq=False, slots=True)
class PoseState:
    """Where a stream is: all that its next pose depends on beside the next decision. Never changed, so it may be stored as it is.

    Attributes
    ----------
    settings : PoseSettings
    n_joints : int
    playing : Playing or None
        What was displayed last.
    row : float64 array, shape (W,)
        All else: the columns of the stages, see the core's pose.h.
    """

    settings: PoseSettings
    n_joints: int
    playing: Playing | None
    row: Floats

    def __repr__(self) -> str:
        return f"<PoseState: {plays(self.playing)}, {plural(self.n_joints, 'joint')}>"

    @property
    def warp(self) -> tuple[float, float]:
        """How many times as long steps are as the clip's, and by how many radians hips and legs are turned against the root."""
        return float(self.row[COLUMNS["stride"]]), float(self.row[COLUMNS["turn"]])


class PoseStream:
    """Gives the poses of one character.

    Parameters
    ----------
    bank : PoseBank, or mapping of str to PoseBank
        By the names of the databases where a selector has several; all of one rig. One bank alone serves decisions of any
        database.
    settings : PoseSettings

    Raises
    ------
    MotionError
        No bank, or banks of different rigs.
    ContextError
        `bank` or `settings` are none.
    """

    def __init__(self, bank: PoseBank | Mapping[str, PoseBank], settings: PoseSettings = DEFAULT_SETTINGS) -> None:
        require_kind(settings, PoseSettings, "settings", "PoseSettings")
        self._pipeline = Pipeline(bank, settings)
        self._rows, self._at = self._pipeline.begun(), 0
        self._state: PoseState | None = None

    def __repr__(self) -> str:
        return f'<PoseStream: root "{self.settings.root}", {plural(self.rig.n_joints, "joint")}>'

    @property
    def settings(self) -> PoseSettings:
        """The settings, as given."""
        return self._pipeline.settings

    @property
    def banks(self) -> PoseBank | Mapping[str, PoseBank]:
        """The pose bank, or those of the databases by their names."""
        return self._pipeline.only or self._pipeline.banks

    @property
    def rig(self) -> PoseBank:
        """A bank of the rig that the poses are of, such as for `write_poses`."""
        return self._pipeline.rig

    def is_like(self, other: PoseStream) -> bool:
        """Whether another stream has the same banks and settings, so that a `PoseStreams` takes both.
        Raises ContextError for no stream."""
        require_kind(other, PoseStream, "other", "a PoseStream")
        return self._pipeline.is_like(other._pipeline)

    @property
    def state(self) -> PoseState:
        """Where the stream is, to come back to with `restore`."""
        if self._state is None:
            row, playing = self._rows.numbers[self._at].copy(), self._rows.playing(self._at)
            self._state = PoseState(self.settings, self.rig.n_joints, playing, row)
        return self._state

    def restore(self, state: PoseState) -> None:
        """Go on from a state of this stream, or of another one with the same banks and settings.

        Raises ContextError for what is no state, or one of another rig or other settings; MotionError where no bank has what it
        displayed.
        """
        require_kind(state, PoseState, "state", "a PoseState, what `state` gives")
        if state.settings != self.settings or state.n_joints != self.rig.n_joints or len(state.row) != self._pipeline.width:
            raise ContextError(OTHER_STATE)
        self._rows, self._at, self._state = self._pipeline.rows_at(state.row, state.playing), 0, state

    @property
    def displayed(self) -> Floats:
        """What was displayed last, as the core has it: the number of a bank, -1 for none, its range and second."""
        displayed: Floats = self._rows.displayed[self._at]
        return displayed

    @property
    def width(self) -> int:
        """How many numbers its row has."""
        return self._pipeline.width

    def stand_on(self, displayed: Floats, row: Floats) -> bool:
        """Go on from what was displayed, as the core has it, and a row; False where there is no such moment."""
        playing = None
        if displayed[0] >= 0.0:
            playing = self._pipeline.playing_at(displayed.tolist())
            if playing is None:
                return False
        self._rows, self._at, self._state = Rows(row[None], displayed[None], [playing]), 0, None
        return True

    @property
    def _place(self) -> tuple[Rows, int]:
        """The rows that the stream is among, and its own."""
        return self._rows, self._at

    def _go_on(self, rows: Rows, at: int) -> None:
        """Go on from one of some rows, of a stream with the same banks and settings."""
        self._rows, self._at, self._state = rows, at, None

    def update(
        self,
        decision: Decision,
        dt: float,
        body: Steered | tuple[float, float, float] | None = None,
        ground: Ground | None = None,
    ) -> Pose:
        """The pose after a decision.

        Parameters
        ----------
        decision : Decision
            What `Controller.update` gave for this tick, or `MatchPlay.decision`: what one shows after the other is blended too.
        dt : float
            Seconds since the last update, as the controller had them.
        body : Steered or (x, z, heading), optional
            Where the game has the body now; every root mode but "animation" needs it.
        ground : function, optional
            Of x and z: the height of the ground in metres and its normal, (nx, ny, nz), or None where it is flat.

        Raises
        ------
        MotionError
            The bank has no poses of what plays, or the root mode needs a body. The stream then stands where it stood.
        ContextError
            An argument of another type.
        """
        require_kind(decision, Decision, "decision", "a Decision")
        dt = require_real(dt, "dt", 0.0)
        if ground is not None and not callable(ground):
            raise ContextError(Fault(f"ground is {ground!r}.", A_GROUND))
        place = checked_place(body, root_of(decision, self.settings))
        grounds = None if ground is None else [ground]
        rows, own = self._rows.row(self._at), self._pipeline
        places, plays = None if place is None else np.array([place]), own.plays_of(rows, [decision], grounds)
        rows, poses = own.update(rows, [decision], plays, dt, places, grounds)
        self._go_on(rows, 0)
        return poses[0]

    def posed(self, decided: Decided, dt: float, places: Floats, ground: Ground | None) -> tuple[CrowdPoses, Flags]:
        """The same unchecked, of one, with the place of its body [1, 3], whose `Pose` is made when it is requested; and whether the
        clip alone moves the body [1]."""
        grounds, (((_, updates),), decisions) = None if ground is None else [ground], (decided.updates, decided.decisions)
        rows, own = self._rows.row(self._at), self._pipeline
        plays = own.plays_in(rows, updates, decisions, grounds)
        rows, poses = own.update(rows, decisions, plays, dt, places, grounds)
        self._go_on(rows, 0)
        return poses, own.moves_body(plays)


def root_of(decision: Decision, settings: PoseSettings) -> RootMode:
    """What moves the body: as the row of what plays says, or else the settings."""
    said = None if decision.play is None else decision.play.root
    return settings.root if said is None else said


def checked_place(body: OfBody | None, root: RootMode) -> tuple[float, float, float] | None:
    """Where the game's body is. Raises MotionError where a root mode needs one and none is given."""
    if body is None and root != "animation":
        raise MotionError(Fault(f'root = "{root}" needs a body, and none was given.', A_BODY, 'root = "animation"'))
    return place_of(body)
