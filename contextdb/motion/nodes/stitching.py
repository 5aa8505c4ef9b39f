"""The shortest part of a clip that joins two poses: it begins near the old one and ends near the new one.

    cost of a part = cost of its first frame for the old pose, and its biases + cost of its last frame for the new one

N frames. Source: the stitch databases of Unreal's PoseSearch, which put a clip between two others under a greatest cost.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from contextdb.cells.arguments import as_number
from contextdb.errors import Fault, QueryError
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.search import cost
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filters import Filter


def shortest_part(
    database: MotionDatabase, old: ArrayLike, new: ArrayLike, most_cost: float, chosen: Filter, lasts: Ints
) -> tuple[int, int, float] | None:
    """The first and the last frame of the shortest part that costs at most so much, and its cost; None where there is none.

    Of parts that are equally short the one that costs least, on a tie the earliest. It begins where a search may choose, see
    `chosen`, and is at least a frame long; `lasts` is the last frame that playing on from each leads to: int64 [N].

    Raises QueryError for a query that does not fit, or a cost that is none.
    """
    most = as_number(most_cost)
    if most is None or not most >= 0.0:
        raise QueryError(Fault(f"the most that a part may cost is {most_cost!r}.", "a cost, 0 or more"))
    lay, kinds = database.layout, database.marks.kinds
    wanted = [database.normalised(query) for query in (old, new)]
    starts = lay.frames[chosen.why(lay.frame_ranges, kinds)[lay.frames] == LeftOut.NO]
    totals = cost.costs(lay, starts, wanted[0], database.slices, database.cost_weights)
    totals = totals + chosen.biases(lay.frame_ranges, kinds)[starts]
    ends = np.full(database.n_frames, math.inf)
    ends[lay.frames] = cost.costs(lay, lay.frames, wanted[1], database.slices, database.cost_weights)
    least = float(ends.min(initial=math.inf))
    for length in range(1, int((lasts - np.arange(len(lasts))).max(initial=0)) + 1):
        is_open = (lasts[starts] >= starts + length) & (totals + least <= most)
        starts, totals = starts[is_open], totals[is_open]
        joined = totals + ends[starts + length]
        if len(joined) and joined.min() <= most:
            at = int(joined.argmin())
            return int(starts[at]), int(starts[at]) + length, float(joined[at])
    return None
