"""What trajectory channels say of a path: of the frames of a clip, and of wished paths, written into queries.

Q queries with a path each, P points of a path, N features.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contextdb import core
from contextdb.cells.arguments import require_kind
from contextdb.errors import Fault, QueryError, plural
from contextdb.motion import arguments
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.trajectory import ManyTrajectories, PathPoints, Trajectory, heading_vectors, to_own_frame
from contextdb.motion.features.channels import What
from contextdb.motion.features.schema import FeatureSchema

SLOW_MPS = 0.3
"""A body that is slower moves in no clear direction: its direction to velocity shrinks evenly to 0, 0 at rest."""


def point_features(what: What | None, origins: Floats, headings: Floats, points: PathPoints) -> Floats:
    """What a channel says of points [..., 2] to bodies at these places [..., 2] with these headings [...]: [..., 1 or 2]."""
    match what:
        case "position":
            return to_own_frame(points.positions - origins, headings)
        case "direction":
            return heading_vectors(points.headings - headings)
        case "velocity":
            return to_own_frame(points.velocities, headings)
        case "direction_to_velocity":
            return _direction_to_velocity(points)
        case _:
            return np.asarray(np.linalg.norm(points.velocities, axis=-1, keepdims=True))


def with_paths(schema: FeatureSchema, queries: ArrayLike, wanted: ManyTrajectories | Sequence[Trajectory]) -> NDArray[np.float32]:
    """Queries whose trajectories are wished ones instead; the poses stay. What `with_path` gives for each, for all at once.

    Parameters
    ----------
    schema : FeatureSchema
    queries : float array, shape (Q, N)
        In the schema's units, such as `ControllerGroup.poses` or `MotionDatabase.raw_many` give them.
    wanted : ManyTrajectories, or sequence of Q Trajectory
        Where each body shall go, such as `steered_path` gives it; its frame `now` is this moment. Single ones have one rate, one
        length and one present.

    Returns
    -------
    float32 array, shape (Q, N)
        For `MotionDatabase.search_many`.

    Raises
    ------
    QueryError
        There is not one path for each query, or an argument cannot be used.
    """
    require_kind(schema, FeatureSchema, "schema", "a FeatureSchema")
    paths = wanted if isinstance(wanted, ManyTrajectories) else ManyTrajectories.of(wanted)
    changed = arguments.array_of(queries, "the queries").astype(np.float32)
    if changed.shape != (len(paths), schema.n_features):
        problem = (
            f"the queries have shape {changed.shape}, and there {'is' if len(paths) == 1 else 'are'} {plural(len(paths), 'path')}."
        )
        raise QueryError(Fault(problem, f"a path for each query of {plural(schema.n_features, 'feature')}"))
    write_paths(schema, changed, paths)
    return changed


def write_paths(schema: FeatureSchema, queries: NDArray[np.float32], paths: ManyTrajectories) -> None:
    """Write what the trajectory channels say of wished paths into queries [Q, N]; the pose stays."""
    positions, headings = (np.ascontiguousarray(each, np.float64) for each in (paths.positions, paths.headings))
    core.write_paths(positions, headings, paths.now, paths.rate, *schema.path_features, queries)


def _direction_to_velocity(points: PathPoints) -> Floats:
    """The facing as seen by one who looks where the body moves: [..., 2], of length 1 from `SLOW_MPS` on and shorter below."""
    speeds = np.linalg.norm(points.velocities, axis=-1, keepdims=True)
    moving = to_own_frame(points.velocities / np.maximum(speeds, SLOW_MPS), points.headings)
    return np.asarray(moving * np.array([-1.0, 1.0]))
