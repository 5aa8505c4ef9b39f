"""The queries of a crowd: the poses of many characters, each with its own wished path."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from contextdb.cells.arguments import require_kind
from contextdb.errors import Fault, QueryError, plural
from contextdb.motion import arguments
from contextdb.motion.clips.many_paths import ManyTrajectories
from contextdb.motion.clips.trajectory import Trajectory
from contextdb.motion.features.extraction import Features
from contextdb.motion.features.path_features import write_paths
from contextdb.motion.features.schema import FeatureSchema


def with_paths(schema: FeatureSchema, queries: ArrayLike, wanted: ManyTrajectories | Sequence[Trajectory]) -> Features:
    """Queries whose trajectories are wished ones instead; the poses stay. What `with_path` gives for each, for all at once.

    Parameters
    ----------
    schema : FeatureSchema
    queries : float array, shape (Q, N)
        In the schema's units, such as `ControllerGroup.poses` or `MotionDatabase.raw_many` give them.
    wanted : ManyTrajectories, or sequence of Q Trajectory
        Where each body shall go, such as `steered_paths` gives it; its frame `now` is this moment. Single ones have one rate, one
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
        found = (
            f"the queries have shape {changed.shape}, and there {'is' if len(paths) == 1 else 'are'} {plural(len(paths), 'path')}."
        )
        raise QueryError(Fault(found, f"a path for each query of {plural(schema.n_features, 'feature')}"))
    write_paths(schema, changed, paths)
    return changed
