"""What a character showed, moment by moment: read from a session, from poses, or from the arrays of a pose file.

T moments, J joints, K feet.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from contextdb.errors import Fault, MotionError, plural
from contextdb.motion.clips.foot_bones import feet_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints, Skeleton
from contextdb.motion.measuring import formulas
from contextdb.motion.measuring.raw_clips import At, Clips, RawClips, toe_of
from contextdb.motion.output.samples import Flags
from contextdb.motion.output.stream import Pose
from contextdb.motion.selection.decision import Action, Decision, Playing

PoseArrays: TypeAlias = Mapping[str, NDArray[Any]]
"""Those of a `.npz` file, as `pose_arrays` gives them."""


@dataclass(frozen=True, eq=False)
class Displayed:
    """Moments of a character."""

    times_s: Floats
    """Float64 [T]."""
    playing: Sequence[At | None]
    entered: Flags
    jumped: Flags
    forced: Flags
    """`entered`, `jumped`, `forced`: whether something else begins to play; by a jump; and because what played could not play on:
    bool [T]."""
    before: Sequence[At | None]
    """At a jump: what would have played on."""
    costs: Floats
    """At a forced jump what it cost; NaN elsewhere, and where it is not known: float64 [T]."""
    bodies: Floats | None = None
    """Where the game had the body: x, z and heading. NaN where it is not known. Float64 [T, 3], or None."""
    positions: Floats | None = None
    """Float64 [T, J, 3], or None."""
    roots: Floats | None = None
    """Float64 [T, 3], or None."""
    feet: Ints | None = None
    """The joints that are planted: int64 [K], or None."""
    contacts: Flags | None = None
    """Which feet are down in the clip: bool [T, K], or None."""
    sources: Sequence[tuple[RawClips, int] | None] | None = None
    """The clips that each moment is from, and its nearest frame there."""

    @property
    def seconds(self) -> float:
        """From the first moment to the last."""
        return float(self.times_s[-1] - self.times_s[0]) if len(self.times_s) else 0.0

    @property
    def rate(self) -> float:
        """About how many moments a second has."""
        return 1.0 / float(np.median(np.diff(self.times_s))) if self.seconds > 0.0 else 30.0

    def with_contacts(self, clips: Clips | None) -> Displayed:
        """With the contacts of the clips that play, and the joints of their feet.

        What the poses say is the nearest frame's: a foot would be planted half a frame before it comes down.
        """
        if clips is None or self.positions is None:
            return self
        feet = next(iter(clips.raw.values())).feet
        if len(feet) == 0 or feet.max() >= self.positions.shape[1]:
            return self
        contacts = np.zeros((len(self.times_s), len(feet)), np.bool_)
        sources: list[tuple[RawClips, int] | None] = [None] * len(contacts)
        for i, at in enumerate(self.playing):
            if at is not None and (clip := clips.find(at)) is not None:
                contacts[i] = clip[0].contacts_at(clip[1], at.time_s)
                sources[i] = clip[0], clip[0].frame_at(clip[1], at.time_s)
        return replace(self, feet=feet, contacts=contacts, sources=sources)


def of_decisions(decisions: Sequence[Decision]) -> Displayed:
    """What decisions say; without poses."""
    bodies = np.array([(np.nan,) * 3 if d.body is None else d.body for d in decisions], np.float64).reshape(-1, 3)
    forced = [decision.is_forced for decision in decisions]
    costs = [d.cost if is_it and d.cost is not None else np.nan for d, is_it in zip(decisions, forced, strict=True)]
    return Displayed(
        np.array([decision.time_s for decision in decisions], np.float64),
        [_at(decision.playing) for decision in decisions],
        np.array([decision.action in (Action.START, Action.JUMP) for decision in decisions], np.bool_),
        np.array([decision.action is Action.JUMP for decision in decisions], np.bool_),
        np.array(forced, np.bool_),
        [_at(decision.before) for decision in decisions],
        np.array(costs, np.float64),
        None if np.isnan(bodies).any(axis=1).all() else bodies,
    )


def of_poses(poses: Sequence[Pose], rate: float) -> Displayed:
    """What poses of a stream show, so many a second."""
    playing = [_at(pose.playing) for pose in poses]
    jumped = np.array([pose.is_jump for pose in poses], np.bool_)
    rates = [pose.play_rate for pose in poses]
    n_joints = len(poses[0].positions) if poses else 1
    displayed = Displayed(
        np.arange(len(poses)) / rate,
        playing,
        _entered(playing, jumped),
        jumped,
        np.array([pose.is_forced for pose in poses], np.bool_),
        _played_on(playing, jumped, rates, rate),
        np.full(len(poses), np.nan),
        positions=np.array([pose.positions for pose in poses], np.float64).reshape(-1, n_joints, 3),
        roots=np.array([pose.root for pose in poses], np.float64).reshape(-1, 3),
    )
    contacts = [pose.contacts for pose in poses]
    return replace(displayed, contacts=np.array(contacts, np.bool_)) if contacts and len(contacts[0]) else displayed


def of_arrays(arrays: PoseArrays) -> Displayed:
    """What the arrays of a pose file show."""
    rate = float(arrays["rate"])
    assets, times_s, sides = (arrays[name].tolist() for name in ("asset", "time_s", "mirrored"))
    playing = [At("", asset, side, at) if asset else None for asset, at, side in zip(assets, times_s, sides, strict=True)]
    jumped = np.asarray(arrays["jumped"], np.bool_)
    return Displayed(
        np.arange(len(playing)) / rate,
        playing,
        _entered(playing, jumped),
        jumped,
        np.asarray(arrays["forced"], np.bool_),
        _played_on(playing, jumped, [1.0] * len(playing), rate),
        np.full(len(playing), np.nan),
        positions=np.asarray(arrays["positions"], np.float64),
        roots=np.asarray(arrays["root"], np.float64),
        feet=_feet(arrays["bones"].tolist(), arrays["parents"]),
    )


def with_poses(session: Displayed, poses: Displayed) -> Displayed:
    """A session with the poses that were made of it. Raises MotionError where there is not one for each decision."""
    n, n_poses = len(session.times_s), len(poses.times_s)
    if n != n_poses:
        problem = f"there are {plural(n_poses, 'pose')} for {plural(n, 'decision')}."
        raise MotionError(Fault(problem, "a pose for each decision of the session"))
    for i, (at, displayed) in enumerate(zip(session.playing, poses.playing, strict=True)):
        if at is not None and displayed is not None and (at.asset, at.mirrored) != (displayed.asset, displayed.mirrored):
            problem = f"pose {i} is of {displayed.asset!r}, but the session plays {at.asset!r}."
            raise MotionError(Fault(problem, "the poses of this session"))
    return replace(session, positions=poses.positions, roots=poses.roots, feet=poses.feet, contacts=poses.contacts)


def _at(playing: Playing | None) -> At | None:
    return None if playing is None else At(playing.database, playing.asset, playing.mirrored, playing.time_s)


def _entered(playing: Sequence[At | None], jumped: Flags) -> Flags:
    """Where something begins to play: at each jump, and where nothing played before."""
    begins = [at is not None and (i == 0 or playing[i - 1] is None) for i, at in enumerate(playing)]
    return np.asarray(jumped | np.array(begins, np.bool_))


def _played_on(playing: Sequence[At | None], jumped: Flags, rates: Sequence[float], rate: float) -> list[At | None]:
    """At each jump what played before, moved on by a moment."""
    played: list[At | None] = [None] * len(playing)
    for i in np.flatnonzero(jumped).tolist():
        last = playing[i - 1] if i else None
        played[i] = None if last is None else replace(last, time_s=last.time_s + rates[i - 1] / rate)
    return played


def _feet(bones: Sequence[str], parents: Ints) -> Ints | None:
    """The joints that are planted; None where no bones are named like feet."""
    rig = Skeleton(tuple(bones), np.asarray(parents, np.int64), np.zeros((len(bones), 3)), ((),) * len(bones))
    try:
        return np.array([toe_of(rig, foot) for foot in feet_of(rig)], np.int64)
    except MotionError:
        return None


# ---- what is measured, moment by moment: for a timeline. NaN where a moment has no value


def strips_of(it: Displayed) -> dict[str, Floats]:
    """Of each measure that there is its value at each moment: float64 [T].

    "skate": the speed of the fastest planted foot, cm/s; "accel": the largest acceleration of a joint, m/s²; "error": how far the
    root is from the game's body, m.
    """
    strips: dict[str, Floats] = {}
    if it.positions is not None and len(it.times_s) > 1:
        strips["accel"] = _accelerations(it.positions, it.times_s)
        if it.feet is not None and it.contacts is not None:
            strips["skate"] = _skate(it.positions[:, it.feet], it)
    if it.roots is not None and it.bodies is not None:
        strips["error"] = formulas.apart(it.roots, it.bodies)[0]
    return strips


def _accelerations(positions: Floats, times_s: Floats) -> Floats:
    step = formulas.step_of(times_s)
    accelerations = np.full(len(times_s), np.nan)
    largest = formulas.accelerations(positions, times_s, step)
    if len(largest):
        accelerations[step:-step] = largest.max(axis=1)
    return accelerations


def _skate(feet: Floats, it: Displayed) -> Floats:
    assert it.contacts is not None, "was looked at before"
    down = formulas.standing(it.contacts, feet, it.times_s)
    slides = formulas.Slides.of(feet, it.times_s, down, formulas.floor_of(feet))
    speeds = np.full(len(it.times_s), np.nan)
    speeds[len(speeds) - len(slides.seconds) :] = np.where(slides.planted, 100.0 * slides.speeds, 0.0).max(axis=1)
    return speeds
