"""What trajectory channels say of a path: of the frames of a clip, and of wished paths, written into queries.

Q queries with a path each, P points of a path, N features.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips.many_paths import ManyTrajectories
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.trajectory import PathPoints, heading_vectors, to_own_frame
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


def write_paths(schema: FeatureSchema, queries: Floats | NDArray[np.float32], paths: ManyTrajectories) -> None:
    """Write what the trajectory channels say of wished paths into queries [Q, N]; the pose stays.

    All points of all channels are worked out together, once for each list of seconds or of metres.
    """
    origins, headings = paths.positions[:, paths.now, None], paths.headings[:, paths.now, None]
    for seconds, metres, channels in schema.path_points:
        points = paths.after_seconds(seconds) if seconds else paths.along(metres)
        for what, columns in channels:
            found = point_features(what, origins, headings, points)
            queries[:, columns] = found.reshape(len(queries), columns.stop - columns.start)


def _direction_to_velocity(points: PathPoints) -> Floats:
    """The facing as seen by one who looks where the body moves: [..., 2], of length 1 from `SLOW_MPS` on and shorter below."""
    speeds = np.linalg.norm(points.velocities, axis=-1, keepdims=True)
    moving = to_own_frame(points.velocities / np.maximum(speeds, SLOW_MPS), points.headings)
    return np.asarray(moving * np.array([-1.0, 1.0]))
