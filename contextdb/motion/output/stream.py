"""A pose stream: what a controller decides, tick by tick, as poses.

The decision says which clip plays and when in it. The clip's pose is sampled between frames, goes through the stages of
`contextdb.motion.output.stages`, and is placed joint by joint. A stream reads no clock and draws no random number: the same
decisions give the same poses.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from contextdb.cells.arguments import require_kind, require_mapping, require_real
from contextdb.errors import ContextError, Fault, MotionError, in_quotes, nearest, some
from contextdb.motion.clips.ground_place import A_BODY, OfBody, place_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.steering import Steered
from contextdb.motion.output.bank import Flags, Moment, Place3, PoseBank, Sample, loops
from contextdb.motion.output.ground import A_GROUND
from contextdb.motion.output.root import rotation_share
from contextdb.motion.output.settings import PoseSettings
from contextdb.motion.output.stages import UNWARPED, Ground, Posture, Tick, Warp
from contextdb.motion.selection.decision import Action, Decision, Playing
from contextdb.motion.selection.root_motion import NO_MOTION

DEFAULT_SETTINGS = PoseSettings()
NOWHERE: Place3 = (0.0, 0.0, 0.0)
NO_STEPS: Sequence[Sequence[float]] = ()
NEAR_S = 0.1
"""What is shown goes on where it is not farther from where it should be than this."""


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


@dataclass(frozen=True, eq=False, slots=True)
class PoseState:
    """Where a stream is: all that its next pose depends on beside the next decision. Never changed, so it may be kept as it is."""

    settings: PoseSettings = DEFAULT_SETTINGS
    playing: Playing | None = None
    clip: Posture | None = None
    stages: tuple[object, ...] = ()
    play_rate: float = 1.0
    clip_rate: float = 1.0
    warp: Warp = UNWARPED
    body: Place3 | None = None
    velocity: tuple[float, float] | None = None


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
        from contextdb.motion.output.pipeline import stages_of

        require_kind(settings, PoseSettings, "settings", "PoseSettings")
        self._only = bank if isinstance(bank, PoseBank) else None
        self._banks = {} if isinstance(bank, PoseBank) else _checked(bank)
        self.settings = settings
        self._state = PoseState(settings)
        self._rig = self._only or next(iter(self._banks.values()))
        self._stages = stages_of(settings, self._rig)

    @property
    def banks(self) -> PoseBank | Mapping[str, PoseBank]:
        """The pose bank, or those of the databases by their names."""
        return self._only or self._banks

    @property
    def rig(self) -> PoseBank:
        """A bank of the rig that the poses are of, such as for `write_poses`."""
        return self._rig

    @property
    def state(self) -> PoseState:
        """Where the stream is, to come back to with `restore`."""
        return self._state

    def restore(self, state: PoseState) -> None:
        """Go on from a state of this stream, or of another one with the same banks and settings.

        Raises ContextError for what is no state, or one of another rig or other settings.
        """
        require_kind(state, PoseState, "state", "a PoseState, what `state` gives")
        if state.settings != self.settings or (state.clip and len(state.clip.rotations) != self._rig.n_joints):
            raise ContextError(Fault("the state is of a stream of other settings or of another rig.", "a state of this stream"))
        self._state = state

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
        place = self._place_of(body)
        velocity = _velocity(place, dt, self._state)
        decision, is_ahead = self._joined(decision, dt)
        state, playing = self._state, decision.playing
        moment, bank = None, self._rig
        if playing is not None:
            bank, number = self._find(playing)
            moment = bank.moment_of(number, playing.time_s)
        if moment is None:
            clip, contacts, travel = state.clip or self._rest(), np.zeros(len(bank.feet), np.bool_), NOWHERE
        else:
            clip, contacts = Posture(moment.rotations, moment.positions, moment.root), moment.contacts
            travel = _travel(moment, decision, self.settings)
        left, entered = self._seam(decision)
        left, entered = _at_rate(left, state.clip_rate), _at_rate(entered, decision.play_rate)
        motion, weight, steps = decision.root_motion, decision.root_weight, NO_STEPS
        if ground is not None:
            steps = bank.steps_at(moment.frame) if moment is not None else [(0.0, 0.0, 0.0)] * len(bank.feet)
        tick = Tick(dt, left, entered, motion, is_ahead, weight, place, velocity, travel, state.warp, ground, steps, clip, contacts)
        posture = clip
        begun = state.stages or tuple(stage.begin(clip, place) for stage in self._stages)
        after = []
        for stage, own in zip(self._stages, begun, strict=True):
            posture, own = stage.apply(posture, tick if state.stages else _first(tick), own)
            after.append(own)
        rate = _play_rate(decision, state, dt)
        warp, place = posture.warp, place or state.body
        stages, clip_rate = tuple(after), decision.play_rate
        self._state = PoseState(self.settings, playing or state.playing, clip, stages, rate, clip_rate, warp, place, velocity)
        return self._placed(posture, decision, rate, contacts)

    def _joined(self, decision: Decision, dt_s: float) -> tuple[Decision, bool]:
        """The decision, as a jump from what was shown where it goes on from something else: another one has decided meanwhile; and
        whether its movement is then that of what it plays."""
        shown, playing = self._state.playing, decision.playing
        if shown is None or playing is None:
            return decision, False
        is_seam = decision.action in (Action.JUMP, Action.START)
        on = decision.before if is_seam else playing
        if on is not None and (on.database, on.asset, on.mirrored) == (shown.database, shown.asset, shown.mirrored):
            ahead_s = on.time_s - shown.time_s
            if decision.action is Action.LOOP or -NEAR_S <= ahead_s <= dt_s * self._state.clip_rate + NEAR_S:
                return decision, False
        moved = replace(shown, time_s=shown.time_s + dt_s * self._state.clip_rate)
        is_ahead = not is_seam or decision.before is None
        return replace(decision, action=decision.action if is_seam else Action.JUMP, before=moved), is_ahead

    def _rest(self) -> Posture:
        """The rig at rest, for a character that has not played anything yet."""
        rotations = np.zeros((self._rig.n_joints, 4))
        rotations[:, 0] = 1.0
        return Posture(rotations, self._rig.skeleton.offsets[self._rig.moving], (0.0, 0.0, 0.0))

    def _seam(self, decision: Decision) -> tuple[Sample | None, Sample | None]:
        """Where what plays jumps, or goes over the end of a loop: what would have been shown, and what is shown instead."""
        before, playing = decision.before or self._state.playing, decision.playing
        if playing is None or before is None or self._state.playing is None:
            return None, None
        if decision.action in (Action.JUMP, Action.START):
            (bank, number), (to_bank, to_number) = self._find(before), self._find(playing)
            return bank.sample_of(number, before.time_s), to_bank.sample_of(to_number, playing.time_s)
        if decision.action is Action.LOOP:
            bank, number = self._find(playing)
            end_s = bank.last_s(number)
            return bank.sample_of(number, end_s), bank.sample_of(number, 0.0)
        return None, None

    def _placed(self, posture: Posture, decision: Decision, rate: float, contacts: Flags) -> Pose:
        rig, playing, is_jump = self._rig, decision.playing, decision.action is Action.JUMP
        n, skeleton = rig.n_joints, rig.skeleton
        translations, positions, world = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 4))
        loops().place_whole(
            skeleton.parents, skeleton.offsets, rig.places, posture.rotations, posture.positions, *posture.root,
            translations, positions, world,
        )  # fmt: skip
        is_forced = is_jump and decision.continuing_cost is None
        return Pose(playing, is_jump, is_forced, posture.root, posture.rotations, translations, positions, contacts, rate)

    def _find(self, playing: Playing) -> tuple[PoseBank, int]:
        """The bank of what plays, and its range there."""
        bank = self._only or self._banks.get(playing.database)
        if bank is None:
            near = nearest(playing.database, self._banks)
            found = f"there is no pose bank of the database {in_quotes(playing.database)}."
            raise MotionError(Fault(found, some(self._banks), in_quotes(near) if near else ""))
        return bank, bank.range_of(playing.asset, playing.mirrored)

    def _place_of(self, body: OfBody | None) -> Place3 | None:
        """Where the game's body is."""
        if body is None:
            if self.settings.root != "animation":
                found = f'root = "{self.settings.root}" needs a body, and none was given.'
                raise MotionError(Fault(found, A_BODY, 'root = "animation"'))
            return None
        return place_of(body)


def _checked(banks: object) -> dict[Any, PoseBank]:
    """Banks by name, all of one rig."""
    named = dict(require_mapping(banks, "bank", "a PoseBank, or a mapping of databases to them"))
    for each in named.values():
        require_kind(each, PoseBank, "one of bank", "a PoseBank")
    if not named:
        raise MotionError(Fault("there is no pose bank.", "at least one"))
    rig, *others = named.values()
    for other in others:
        same = rig.skeleton.names == other.skeleton.names and np.array_equal(rig.skeleton.parents, other.skeleton.parents)
        if not same or not np.array_equal(rig.moving, other.moving):
            raise MotionError(Fault("the banks are of different rigs.", "banks of one rig"))
    return named


def _travel(moment: Moment, decision: Decision, settings: PoseSettings) -> Place3:
    """How fast what plays goes at its rate, and how far the root sways with it."""
    left, ahead, sway = moment.travel
    return decision.play_rate * left, decision.play_rate * ahead, sway * rotation_share(settings, decision.root_weight)


def _at_rate(sample: Sample | None, rate: float) -> Sample | None:
    """A moment of a clip that plays at a rate: all in it changes so many times as fast."""
    if sample is None or rate == 1.0:
        return sample
    left, ahead, turn = sample.root_velocity
    velocity = (rate * left, rate * ahead, rate * turn)
    return replace(sample, spins=rate * sample.spins, velocities=rate * sample.velocities, root_velocity=velocity)


def _first(tick: Tick) -> Tick:
    """The first tick of a character: it appears where it is, and has not moved."""
    return replace(tick, dt_s=0.0, left=None, entered=None, root_motion=NO_MOTION)


def _velocity(place: Place3 | None, dt_s: float, state: PoseState) -> tuple[float, float] | None:
    """How fast the game moves the body: by how far it came since the last update, as a session knows no more."""
    if place is None or state.body is None or dt_s <= 0.0:
        return state.velocity
    return (place[0] - state.body[0]) / dt_s, (place[1] - state.body[1]) / dt_s


def _play_rate(decision: Decision, state: PoseState, dt_s: float) -> float:
    """Seconds of the clip in a second of play, where it plays on; else what it was."""
    playing, before = decision.playing, state.playing
    if decision.action is Action.HOLD:
        return 0.0
    if decision.action is not Action.CONTINUE or playing is None or before is None or dt_s <= 0.0:
        return state.play_rate or 1.0
    return (playing.time_s - before.time_s) / dt_s
