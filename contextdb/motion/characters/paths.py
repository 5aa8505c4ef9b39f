"""The path ahead of a character: where the clip that plays leads."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contextdb.cells.arguments import require_kind, require_real
from contextdb.errors import ContextError, Fault, MotionError
from contextdb.motion.clips.trajectory import Trajectory
from contextdb.motion.output.samples import Place3
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.decision import Playing
from contextdb.motion.selection.root_motion import RootMotion, between

MOST_AHEAD_S = 3600.0
A_PLACE = "x and z in metres and a heading in radians"


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
