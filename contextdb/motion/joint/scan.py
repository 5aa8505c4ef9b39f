"""The joint search without numba, and where candidates come from: the total of every joint frame with every cast.

C casts, J joint ranges, K roles, P ordered pairs of roles, M joint frames, A actors. Costs are summed up in the order of the
compiled search, so that both find the same frame at the same cost.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.joint.database import FACING, PLACE, JointDatabase
from contextdb.motion.search import cost


@dataclass(frozen=True, eq=False)
class Asked:
    """What one joint search of one database compares.

    `queries` float64 [A, F] are of each actor, normalised; `seen` float64 [A, A, 4] is what each sees of each other, in the units
    of costs; `casts` int64 [C, K] the actor of each role; `range_biases` float64 [C, J] what the soft cells of the table cost with
    each cast in each joint range, inf where it may not play; `frame_biases` float64 [M] is inf where a frame may not be chosen.
    """

    queries: Floats
    seen: Floats
    casts: Ints
    range_biases: Floats
    frame_biases: Floats


def least(joint: JointDatabase, asked: Asked) -> tuple[float, int, int]:
    """The lowest total, its joint frame and its cast; on a tie the lowest frame, then the first cast. inf, -1, -1 for none."""
    best, best_frame, best_cast = np.inf, -1, -1
    for c, total in enumerate(totals(joint, asked)):
        frame = int(np.argmin(total))
        if total[frame] < best or (total[frame] == best < np.inf and frame < best_frame):
            best, best_frame, best_cast = float(total[frame]), frame, c
    return best, best_frame, best_cast


def totals(joint: JointDatabase, asked: Asked) -> Iterator[Floats]:
    """For each cast the total of each joint frame, inf where it may not be: float64 [M]; of a database with frames."""
    ranges = joint.frame_ranges
    own = _own_costs(joint, asked)
    place_weight, facing_weight = joint.relative_weights
    for c, cast in enumerate(asked.casts.tolist()):
        total = np.zeros(joint.n_frames)
        for k, actor in enumerate(cast):
            total += own[actor, k]
        for p, (role, other) in enumerate(joint.pairs):
            apart = joint.relative[p] - asked.seen[cast[role], cast[other]]
            apart *= apart
            for columns, weight in ((PLACE, place_weight), (FACING, facing_weight)):
                total += weight * (apart[:, columns.start] + apart[:, columns.start + 1])
        yield total + (asked.range_biases[c][ranges] + asked.frame_biases)


def _own_costs(joint: JointDatabase, asked: Asked) -> dict[tuple[int, int], Floats]:
    """What the pose and path of an actor cost in each frame of a role that a cast gives him: [M] by (actor, role)."""
    database = joint.database
    wanted = {(actor, k) for cast in asked.casts.tolist() for k, actor in enumerate(cast)}
    return {
        (actor, k): cost.costs(database.layout, joint.frames[k], asked.queries[actor], database.slices, joint.own_weights)
        for actor, k in wanted
    }
