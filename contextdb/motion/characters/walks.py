"""Where characters are over the ground, as rows of the core: their bodies, their animations, and the paths that they wish for.

Q characters, W numbers in a row, F features; see `contextdb/core/walk.h`. Nothing is changed in place but what was made here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from contextdb.cells.sequences import Made
from contextdb.core import Ways
from contextdb.errors import Fault, MotionError, plural
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.steering import N_NUMBERS, Steered
from contextdb.motion.clips.trajectory import ManyTrajectories, Trajectory
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.output.samples import Flags, Place3
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.chooser import N_MOVED, Chooser
from contextdb.motion.selection.root_motion import RootMotion

N_WALK = N_NUMBERS + 4
"""So many numbers a walk is before the places where the animation was."""
UNKNOWN = math.nan
Goal = tuple[float, float, float]
"""What a stick asks for, x and z in m/s and a heading; also what a character knows of itself."""


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


def body_of(rows: Floats, i: int = 0) -> Steered:
    """The body of one of some rows [Q, W]."""
    return Steered.of_numbers(rows[i, :N_NUMBERS].tolist())


def apart_of(row: Floats) -> RootMotion:
    """Where the animation is, as the body sees it."""
    return RootMotion(*row[0, N_NUMBERS : N_NUMBERS + 3].tolist())


class Onward(NamedTuple):
    """Characters some time later, before their poses are displayed: their walks [Q, W]; what has moved [Q, 16] and the queries that
    ask for what they wish [Q, F], as their controllers take them; where their bodies are [Q, 3]; and of each its own facts."""

    walks: Floats
    moved: Floats
    queries: Floats
    places: Floats
    facts: Sequence[Goal]


def onward(
    schema: FeatureSchema,
    chooser: Chooser,
    rows: Floats,
    walks: Floats,
    goals: Floats | Goal,
    dt_s: float,
    poses: Floats | None = None,
    body: Steered | None = None,
) -> Onward:
    """Characters of one chooser, whose rows these are, some time later. `poses` [Q, F] are given where they are not those of what
    plays, NaN where they are; and the `body` of one where the game puts it. Raises MotionError for databases of other features."""
    n = len(walks)
    if chooser.n_features not in (0, schema.n_features):
        problem = f"the databases have {plural(chooser.n_features, 'feature')}, the schema {schema.n_features}."
        raise MotionError(Fault(problem, "databases of one schema"))
    bodies = None if body is None else np.array([body.numbers])
    made = np.empty_like(walks), np.empty((n, N_MOVED)), np.empty((n, schema.n_features)), np.empty((n, 3))
    return Onward(*made, schema.ways.go_on(chooser.core, walks, goals, bodies, dt_s, rows, poses, *made))


class WishedPaths(Made[Trajectory]):
    """The paths that characters wish to take if their sticks stay as they are: worked out when one is requested."""

    def __init__(self, schema: FeatureSchema, walks: Floats, goals: Floats | Goal) -> None:
        self._schema, self._walks, self._goals = schema, walks, goals

    def __len__(self) -> int:
        return len(self._walks)

    def _at(self, i: int) -> Trajectory:
        return self.together[i]

    @cached_property
    def together(self) -> ManyTrajectories:
        """All of them."""
        ways, walks, n_features = self._schema.ways, self._walks, self._schema.n_features
        goals = np.array(self._goals, np.float64, ndmin=2)
        n, n_frames = len(walks), ways.n_frames(walks, goals)
        positions, headings, poses = np.empty((n, n_frames, 2)), np.empty((n, n_frames)), np.zeros((n, n_features))
        ways.ask(walks, goals, self._schema.rate, poses, positions, headings, np.empty_like(poses))
        return ManyTrajectories(self._schema.rate, positions, headings, ways.n_behind(self._schema.rate))


def wished_along(schema: FeatureSchema, row: Floats, path: Trajectory, query: Floats) -> tuple[ManyTrajectories, Floats]:
    """The path of one character which the game plans, from its present on, and its query [1, F] with that path."""
    now = schema.ways.n_behind(path.rate)
    ahead, turns = path.positions[path.now :], path.headings[path.now :]
    positions, headings = np.zeros((1, now + len(turns), 2)), np.zeros((1, now + len(turns)))
    positions[0, now:], headings[0, now:], asked = ahead, turns, np.empty_like(query)
    schema.ways.ask(row, None, path.rate, query, positions, headings, asked)
    return ManyTrajectories(path.rate, positions, headings, now), asked


def resting(schema: FeatureSchema, rows: Floats, databases: Mapping[str, MotionDatabase]) -> Floats:
    """The poses of characters that play nothing: the mean of all frames, moving as the body does; [Q, F]."""
    mean, poses = np.zeros(schema.n_features), np.empty((len(rows), schema.n_features))
    for database in databases.values():
        mean = np.ascontiguousarray(database.normalisation.undo(mean), np.float64)
        break
    schema.ways.rest(rows, mean, poses)
    return poses


def settled(ways: Ways, walks: Floats, roots: Floats, moves_body: Flags) -> Floats:
    """The walks of characters whose poses are displayed at some roots [Q, 3], whether the clip moved the body of each."""
    after = walks.copy()
    ways.settle(after, roots, moves_body)
    return after


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
