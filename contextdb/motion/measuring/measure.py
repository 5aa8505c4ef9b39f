"""How good the motion of a character is, in numbers, beside those of the clips that it is made of.

    session ─► Displayed: what played, where the body was ─┐
    poses of it, made again or given ──────────────────┼─► Measures
    pose banks ─► RawClips: the clips as they are ─────┘

What cannot be computed of what is given is None, and `missing` says why. Nothing here touches a disk but to read what is named by
a path.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any, TypeAlias

from numpy.typing import ArrayLike

from contextdb.cells.arguments import require_kind, require_many_of, require_mapping, require_numbers, require_real
from contextdb.errors import ContextError, Fault, MotionError, plural
from contextdb.motion.clips.poses import LEAST_RATE, MOST_RATE
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.measuring import displayed as displayed_motion
from contextdb.motion.measuring import parts, postures
from contextdb.motion.measuring.displayed import Displayed, PoseArrays
from contextdb.motion.measuring.measures import Measures
from contextdb.motion.measuring.raw_clips import Banks, Clips
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.settings import PoseSettings
from contextdb.motion.output.stream import Pose, PoseStream
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.decision import Decision
from contextdb.motion.storage.written_poses import NPZ, checked_pose_arrays, read_pose_arrays
from contextdb.motion.trace.session import Trace

OfPoses: TypeAlias = Sequence[Pose] | PoseArrays | str | PathLike[str]


def measure(
    session_or_poses: Trace | OfPoses,
    banks: Banks | None = None,
    *,
    poses: OfPoses | None = None,
    databases: Mapping[str, MotionDatabase] | None = None,
    settings: PoseSettings | None = None,
    rate: float | None = None,
    bodies: ArrayLike | None = None,
    wanted: ArrayLike | None = None,
) -> Measures:
    """Measure how good the motion of a session, or of poses, is.

    Parameters
    ----------
    session_or_poses : Trace, sequence of Pose, arrays, or path
        A session, or the path of one; poses of a `PoseStream`; or those of a `.npz` file that `motion run --poses` wrote, as its
        path or its arrays.
    banks : PoseBank, or mapping of str to PoseBank, optional
        The clips to compare with; those of the poses. Of a session the poses are made again with them.
    poses : sequence of Pose, arrays, or path, optional
        The poses of the session, one for each decision, where they are not to be made again.
    databases : mapping of str to MotionDatabase, optional
        Says how much of them is used, and what their markup keeps from playing. Default: of the banks how much is used.
    settings : PoseSettings, optional
        How the poses of the session are made. Where the session does not say where the game had the body, the root follows the
        animation.
    rate : float, optional
        Of a sequence of `Pose` without a session: how many a second has. Default: the rate of the banks.
    bodies : float array, shape (T, 3), optional
        Where the game had the body: x, z and heading. Default: what the session says.
    wanted : float array, shape (T, 2), optional
        The velocity over the ground that the stick requested at each moment, m/s, x and z. Default: that of the bodies.

    Returns
    -------
    Measures

    Raises
    ------
    MotionError
        No moment at all; poses, bodies or velocities that are not one for each; poses without a rate; or no poses in the banks of
        what played.
    ArtefactError, FileError
        A file that is no session and no poses, or that cannot be read.
    ContextError
        An argument of another type.
    """
    _check(banks, databases, settings)
    clips = None if not banks else Clips.of(banks)
    displayed = _displayed(session_or_poses, banks, poses, settings, rate)
    n = len(displayed.times_s)
    if n == 0:
        raise MotionError(Fault("there is nothing to measure: no moment.", "a session with updates, or at least one pose"))
    if bodies is not None:
        displayed = replace(displayed, bodies=_rows(bodies, n, 3, "bodies"))
    if clips is not None:
        displayed = displayed.with_contacts(clips)
    wanted_velocities = None if wanted is None else _rows(wanted, n, 2, "wanted")
    measured = {
        **parts.jumps(displayed),
        **parts.steps(displayed, clips),
        **parts.skate(displayed, clips),
        **parts.raw_skate(clips),
        **parts.accelerations(displayed, clips),
        **postures.postures(displayed, clips, wanted_velocities),
        **parts.path(displayed),
        **parts.reach(displayed, wanted_velocities),
        **parts.usage(displayed, databases, banks),
    }
    missing = {name: value for name, value in measured.items() if isinstance(value, str)}
    values: dict[str, Any] = {name: value for name, value in measured.items() if name not in missing}
    return Measures(displayed.seconds, n, int(displayed.jumped.sum()), missing=missing, **values)


def _check(banks: Banks | None, databases: Mapping[str, MotionDatabase] | None, settings: PoseSettings | None) -> None:
    """Refuse arguments of other types."""
    if banks is not None and not isinstance(banks, PoseBank):
        for each in require_mapping(banks, "banks", "a PoseBank, or a mapping of databases to them").values():
            require_kind(each, PoseBank, "one of banks", "a PoseBank")
    for database in require_mapping({} if databases is None else databases, "databases", "a mapping of databases").values():
        require_kind(database, MotionDatabase, "one of databases", "a MotionDatabase")
    require_kind(settings, (PoseSettings, type(None)), "settings", "PoseSettings, or None")


# ---- what is measured


def _displayed(
    given: object, banks: Banks | None, poses: OfPoses | None, settings: PoseSettings | None, rate: float | None
) -> Displayed:
    if isinstance(given, (str, PathLike)) and Path(given).suffix != NPZ:
        given = Trace.load(given)
    if not isinstance(given, Trace):
        if poses is not None:
            raise ContextError(Fault("poses go with a session, and none is given.", "a Trace, or the path of one"))
        return _of_poses(given, _rate_of(banks) if rate is None else rate)
    decisions = list(given.brief())
    session = displayed_motion.of_decisions(decisions)
    if poses is not None:
        return displayed_motion.with_poses(session, _of_poses(poses, session.rate if rate is None else rate))
    if not banks or not decisions:
        return session
    made = poses_of(decisions, banks, PoseSettings() if settings is None else settings)
    return displayed_motion.with_poses(session, displayed_motion.of_poses(made, session.rate))


def _rate_of(banks: Banks | None) -> float | None:
    """The frames that a second of the clips has."""
    if not banks:
        return None
    return banks.rate if isinstance(banks, PoseBank) else next(iter(banks.values())).rate


def _of_poses(given: object, rate: float | None) -> Displayed:
    if isinstance(given, (str, PathLike)):
        return displayed_motion.of_arrays(read_pose_arrays(given))
    if isinstance(given, Mapping):
        return displayed_motion.of_arrays(checked_pose_arrays(given))
    listed = require_many_of(given, Pose, "session_or_poses", "a Trace, a list of Pose, or the path of a session or of poses")
    if rate is None:
        raise MotionError(
            Fault("poses do not say how many of them a second has.", "rate=30.0, or another number of poses a second")
        )
    return displayed_motion.of_poses(listed, require_real(rate, "rate", LEAST_RATE, MOST_RATE))


def poses_of(decisions: Sequence[Decision], banks: Banks, settings: PoseSettings) -> list[Pose]:
    """The poses of a session, made again; by the animation's own root where the session does not say where the body was.

    Raises MotionError where the banks have no poses of what plays.
    """
    return [pose for pose, _ in warped_poses(decisions, banks, settings)]


def warped_poses(decisions: Sequence[Decision], banks: Banks, settings: PoseSettings) -> Iterator[tuple[Pose, tuple[float, float]]]:
    """The same, each with its warp: how many times as long the steps became, and by how many radians hips and legs were turned."""
    if settings.root != "animation" and any(decision.body is None for decision in decisions):
        settings = replace(settings, root="animation")
    stream = PoseStream(banks, settings)
    last_s = decisions[0].time_s
    for decision in decisions:
        pose = stream.update(decision, max(decision.time_s - last_s, 0.0), decision.body)
        yield pose, stream.state.warp
        last_s = decision.time_s


def _rows(given: ArrayLike, n: int, width: int, what: str) -> Floats:
    """An array of numbers, a row for each moment."""
    values = require_numbers(given, what)
    if values.shape != (n, width):
        raise MotionError(Fault(f"{what} have shape {values.shape}.", f"{width} numbers for each of {plural(n, 'moment')}"))
    return values
