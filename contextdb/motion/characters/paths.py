"""Paths that begin where a character is: to the path of the game's body, and where the clip that plays leads.

The animation is rarely where the game has the body. A search that knows only the body's path never learns of that; told where the
root really is, it prefers frames that lead back.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contextdb.cells.arguments import require_kind, require_real
from contextdb.core import return_path
from contextdb.errors import ContextError, Fault, MotionError
from contextdb.motion.clips.trajectory import Trajectory
from contextdb.motion.output.samples import Place3
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.decision import Playing
from contextdb.motion.selection.root_motion import RootMotion, between

RETURN_HALFLIFE_S = 0.27
"""How fast a character is wished to come to the path of the body; as fast as a body follows a stick."""
MOST_AHEAD_S = 3600.0
A_PLACE = "x and z in metres and a heading in radians"


def path_from(root: Sequence[float], path: Trajectory, *, halflife_s: float = RETURN_HALFLIFE_S) -> Trajectory:
    """The path that a character is wished to take which is not where the game has the body: from its root, such as `Pose.root`, to
    the body's path, such as `steered_path` gives it; its frame `now` is where the body is.

    What lies between the two decays as a critically damped spring does, without a step in place or velocity. Headings are at most
    45 degrees apart. Raises ContextError where `root` is no place, `path` is none, or `halflife_s` is no number above 0.
    """
    require_kind(path, Trajectory, "path", "a Trajectory, such as steered_path gives")
    require_real(halflife_s, "halflife_s", 0.001, 60.0)
    positions, headings = (np.array(each, np.float64, order="C") for each in (path.positions, path.headings))
    place = np.array(place_of(root, "root"))
    is_changed = return_path(place, path.rate, halflife_s, positions[path.now :], headings[path.now :])
    if not is_changed:
        return path
    now = path.now
    positions[:now] += positions[now] - path.positions[now]
    headings[:now] += headings[now] - path.headings[now]
    return Trajectory(path.rate, positions, headings, now)


def path_ahead(database: MotionDatabase, playing: Playing, root: Sequence[float], seconds: float = 0.5) -> Trajectory:
    """Where the clip that plays leads by itself from here on, as a path over the ground from `root`, where the character is, such
    as `Pose.root`.

    `playing` is a frame of the database, such as `Pose.playing`; the database is built from clips, with root motion and a schema.
    The path reaches `seconds` ahead; a clip that ends before gives a shorter one. Raises ContextError for an argument of another
    type, MotionError for a database without root motion, or that has no such frame.
    """
    require_kind(database, MotionDatabase, "database", "a MotionDatabase")
    require_kind(playing, Playing, "playing", "a Playing, what Pose.playing gives")
    here = RootMotion(*place_of(root, "root"))
    if database.root is None or database.schema is None or not 0 <= playing.frame < database.n_frames:
        raise MotionError(Fault(f"the database knows no way from frame {playing.frame}.", "a frame of a database built from clips"))
    rate = database.schema.rate
    n_frames = 1 + int(require_real(seconds, "seconds", 0.0, MOST_AHEAD_S) * rate + 1e-6)
    stop = int(database.stops[np.searchsorted(database.stops, playing.frame, side="right")])
    path = database.root[playing.frame : min(stop, playing.frame + n_frames)].astype(np.float64)
    first = RootMotion(*path[0].tolist())
    places = [here.then(between(first, RootMotion(*place))) for place in path.tolist()]
    headings = np.unwrap([place.turn_rad for place in places])
    return Trajectory(rate, np.array([(place.left_m, place.ahead_m) for place in places]), headings)


def place_of(place: object, what: str) -> Place3:
    """A place as three numbers; raises ContextError for anything else."""
    if not isinstance(place, (tuple, list, np.ndarray)) or len(place) != 3:
        raise ContextError(Fault(f"{what} is {place!r}.", A_PLACE))
    x, z, heading = (require_real(each, what) for each in place)
    return x, z, heading
