"""Where characters are over the ground, as rows of the core: their bodies, their animations, and the paths that they wish for.

Q characters, W numbers in a row, F features; see `contextdb/core/walk.h`. Nothing is changed in place but what was made here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from contextdb.core import Ways
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.steering import N_NUMBERS, Ground, Steered
from contextdb.motion.clips.trajectory import ManyTrajectories, Trajectory
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.output.samples import Place3
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.root_motion import RootMotion

N_WALK = N_NUMBERS + 4
"""So many numbers a walk is before the places where the animation was."""
UNKNOWN = math.nan


def begun(ways: Ways, body: Steered) -> Floats:
    """The row of a character that begins with a body: [1, W]."""
    row = np.zeros((1, ways.width))
    row[0, :N_NUMBERS] = body.numbers
    return row


def fitted(ways: Ways, row: Floats) -> Floats:
    """A row as wide as some ways need it; what was behind is forgotten where that changes."""
    if row.shape[1] == ways.width:
        return row
    other = np.zeros((1, ways.width))
    other[0, : N_WALK - 1] = row[0, : N_WALK - 1]
    return other


def with_body(row: Floats, body: Steered) -> Floats:
    """A row with another body."""
    changed = row.copy()
    changed[0, :N_NUMBERS] = body.numbers
    return changed


def body_of(row: Floats) -> Steered:
    """The body of a row [1, W]."""
    return Steered.of_numbers(row[0, :N_NUMBERS].tolist())


def bodies_of(rows: Floats) -> list[Steered]:
    """The bodies of rows [Q, W]."""
    return [Steered.of_numbers(each) for each in rows[:, :N_NUMBERS].tolist()]


def apart_of(row: Floats) -> RootMotion:
    """Where the animation is, as the body sees it."""
    return RootMotion(*row[0, N_NUMBERS : N_NUMBERS + 3].tolist())


def goals_of(sticks: Sequence[Ground], facings: Sequence[float | None]) -> Floats:
    """What sticks and facings ask for, as the core takes it: [Q, 3]."""
    each = zip(sticks, facings, strict=True)
    return np.array([(*stick, UNKNOWN if facing is None else facing) for stick, facing in each], np.float64)


def moved(ways: Ways, rows: Floats, goals: Floats, dt_s: float, bodies: Sequence[Steered | None] = ()) -> Floats:
    """Characters some time later, where the game has not put their bodies itself."""
    after, given = np.empty_like(rows), None
    if any(bodies):
        given = np.array([(UNKNOWN,) * N_NUMBERS if body is None else body.numbers for body in bodies])
    ways.move(rows, goals, given, dt_s, after)
    return after


def wished(schema: FeatureSchema, rows: Floats, goals: Floats, poses: Floats) -> tuple[ManyTrajectories, Floats]:
    """The paths that characters wish to take if their sticks stay as they are, and the queries that ask for them."""
    ways = schema.ways
    n, n_frames = len(rows), ways.n_frames(rows, goals)
    positions, headings, queries = np.empty((n, n_frames, 2)), np.empty((n, n_frames)), np.empty((n, schema.n_features))
    ways.ask(rows, goals, schema.rate, poses, positions, headings, queries)
    return ManyTrajectories(schema.rate, positions, headings, ways.n_behind(schema.rate)), queries


def wished_along(schema: FeatureSchema, row: Floats, path: Trajectory, pose: Floats) -> tuple[ManyTrajectories, Floats]:
    """The same of one character whose path the game plans: from its present on."""
    now = schema.ways.n_behind(path.rate)
    ahead, turns = path.positions[path.now :], path.headings[path.now :]
    positions, headings = np.zeros((1, now + len(turns), 2)), np.zeros((1, now + len(turns)))
    positions[0, now:], headings[0, now:], query = ahead, turns, np.empty((1, schema.n_features))
    schema.ways.ask(row, None, path.rate, pose, positions, headings, query)
    return ManyTrajectories(path.rate, positions, headings, now), query


def resting(schema: FeatureSchema, rows: Floats, databases: Mapping[str, MotionDatabase]) -> Floats:
    """The poses of characters that play nothing: the mean of all frames, moving as the body does; [Q, F]."""
    mean, poses = np.zeros(schema.n_features), np.empty((len(rows), schema.n_features))
    for database in databases.values():
        mean = np.ascontiguousarray(database.normalisation.undo(mean), np.float64)
        break
    schema.ways.rest(rows, mean, poses)
    return poses


def settled(ways: Ways, rows: Floats, roots: Floats, moves_body: bool) -> Floats:
    """Rows whose poses are displayed at some roots [Q, 3]."""
    ways.settle(rows, roots, int(moves_body))
    return rows


def place_of(row: Floats) -> Place3:
    """Where the animation of a row [1, W] is."""
    body, apart = body_of(row), apart_of(row)
    x, z, heading = row[0, 0], row[0, 1], body.heading
    place = RootMotion(float(x), float(z), heading).then(apart)
    return place.left_m, place.ahead_m, place.turn_rad


def are_walks(ways: Ways, rows: Floats) -> bool:
    """Whether rows may be walks: of finite numbers, and no longer a way behind than is remembered."""
    n_most = (ways.width - N_WALK) // 4
    halflives = rows[:, N_NUMBERS - 2 : N_NUMBERS]
    return bool(np.isfinite(rows).all() and (halflives > 0.0).all() and (np.isin(rows[:, N_WALK - 1], np.arange(n_most + 1))).all())
