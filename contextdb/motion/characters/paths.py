"""The path of a character: how much of it a search must know, where it was, and how it comes to the path of the game's body.

The animation is rarely where the game has the body. A search that knows only the body's path never learns of that; told where the
root really is, it prefers frames that lead back.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from contextdb.cells.arguments import require_kind, require_real
from contextdb.errors import ContextError, Fault, MotionError
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.trajectory import Trajectory
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.output.samples import Place3
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.decision import Playing
from contextdb.motion.selection.root_motion import RootMotion, between

RETURN_HALFLIFE_S = 0.27
"""How fast a character is wished to come to the path of the body; as fast as a body follows a stick."""
MOST_TURN_RAD = math.radians(45.0)
"""A character that faces farther away than this counts as so far away: few clips turn more at once, and where none does, a path
that asks for all of it makes the search jump to and fro."""
SETTLED_HALFLIVES = 15.0
"""After so many half-lives a body goes straight on, and so does a path beyond its end."""
LEAST_BACK_S, MOST_AHEAD_S = 2.0, 3600.0
A_PLACE = "x and z in metres and a heading in radians"


def ahead_s(schema: FeatureSchema, speed_mps: float, halflife_s: float) -> float:
    """How many seconds of the way ahead a search must be given; behind them the way goes straight on."""
    seconds, metres = schema.path_reaches
    needed = max((0.0, *seconds))
    if metres:
        settled = SETTLED_HALFLIVES * halflife_s
        needed = max(needed, min(settled, max(metres) / speed_mps) if speed_mps > 0.0 else settled)
    return needed + 1.0 / schema.rate


def back_s(schema: FeatureSchema) -> float:
    """How many seconds of the way back a search must be given; 0 where no feature looks back."""
    seconds, metres = schema.path_reaches
    back = 0.0 - min((0.0, *seconds))
    return max(back, LEAST_BACK_S) if min((0.0, *metres)) < 0.0 else back


def path_from(root: Sequence[float], path: Trajectory, *, halflife_s: float = RETURN_HALFLIFE_S) -> Trajectory:
    """The path that a character is wished to take which is not where the game has the body: from its root, such as `Pose.root`, to
    the body's path, such as `steered_path` gives it; its frame `now` is where the body is.

    What lies between the two decays as a critically damped spring does, without a step in place or velocity. Headings are at most
    45 degrees apart. Raises ContextError where `root` is no place, `path` is none, or `halflife_s` is no number above 0.
    """
    require_kind(path, Trajectory, "path", "a Trajectory, such as steered_path gives")
    require_real(halflife_s, "halflife_s", 0.001, 60.0)
    return path_from_place(place_of(root, "root"), path, halflife_s)


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


def path_from_place(place: Place3, path: Trajectory, halflife_s: float = RETURN_HALFLIFE_S) -> Trajectory:
    """The same, unchecked."""
    x, z = path.positions[path.now].tolist()
    apart = np.array([place[0] - x, place[1] - z])
    turned = math.remainder(place[2] - float(path.headings[path.now]), math.tau)
    turned = min(max(turned, -MOST_TURN_RAD), MOST_TURN_RAD)
    if not turned and not apart.any():
        return path
    left = shares_left(len(path.headings), path.now, path.rate, halflife_s)
    return Trajectory(path.rate, path.positions + left[:, None] * apart, path.headings + left * turned, path.now)


@lru_cache(64)
def shares_left(n_frames: int, now: int, rate: float, halflife_s: float = RETURN_HALFLIFE_S) -> Floats:
    """What is left of a difference at each frame of a path: all of it up to the present, then (1 + y t) e^{-y t}."""
    y_t = 2.0 * math.log(2.0) / halflife_s * np.maximum(np.arange(n_frames) - now, 0) / rate
    shares = np.asarray((1.0 + y_t) * np.exp(-y_t))
    shares.flags.writeable = False
    return shares


def place_of(place: object, what: str) -> Place3:
    """A place as three numbers; raises ContextError for anything else."""
    if not isinstance(place, (tuple, list, np.ndarray)) or len(place) != 3:
        raise ContextError(Fault(f"{what} is {place!r}.", A_PLACE))
    x, z, heading = (require_real(each, what) for each in place)
    return x, z, heading


def apart_of(place: Place3, body: Place3) -> RootMotion:
    """A place as the body sees it: metres to its left and ahead, and a turn."""
    x, z = place[0] - body[0], place[1] - body[1]
    sin, cos = math.sin(body[2]), math.cos(body[2])
    return RootMotion(cos * x - sin * z, sin * x + cos * z, math.remainder(place[2] - body[2], math.tau))


def place_beside(body: Place3, apart: RootMotion) -> Place3:
    """The place that the body sees so."""
    sin, cos = math.sin(body[2]), math.cos(body[2])
    left, ahead = apart.left_m, apart.ahead_m
    return body[0] + cos * left + sin * ahead, body[1] - sin * left + cos * ahead, body[2] + apart.turn_rad
