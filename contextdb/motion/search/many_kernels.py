"""Numba kernels: the exact search for many queries at once, each with its own mask. Arrays only; shapes as in
`contextdb.motion.search.kernels`, which is where each step is explained.

Q queries, M = 1 or Q masks, P = 1 or Q rows of range biases. The frames are gone through once: each cluster of boxes is compared
with all queries of a block before the next cluster is read, so that it stays in the processor's cache. Costs are computed, and ties
decided, as for a query alone: the answer is the same to the last bit.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from contextdb.motion.search.kernels import (
    LANES,
    NOTHING,
    REFUSED,
    _bounded,
    _budget,
    _cost,
    _in,
    _is_skipped,
    _least_of,
    _limit,
    _options,
    _passing,
    _prepare,
)
from contextdb.motion.search.simd import lowest

_given = {
    "start": types.i8,
    "stop": types.i8,
    "blocks": _in("f4", 3),
    "lows": _in("f4", 3),
    "highs": _in("f4", 3),
    "cluster_lows": _in("f4", 3),
    "cluster_highs": _in("f4", 3),
    "order": _in("i8"),
    "rank": _in("i8"),
    "box_starts": _in("i8"),
    "box_sizes": _in("i4"),
    "box_ranges": _in("i4"),
    "range_boxes": _in("i8", 2),
    "range_order": _in("i8"),
    "box_kinds": _in("i4"),
    "kinds": _in("u2"),
    "offset": _in("f8"),
    "scale": _in("f8"),
    "channels": _in("i8"),
    "weights": _in("f8"),
    "feature_weights": _in("f4"),
    "queries": _in("f8", 2),
    "ranges": _in("b1", 2),
    "range_biases": _in("f8", 2),
    "least_of_ranges": _in("f8"),
    "allowed": _in("b1"),
    "kind_biases": _in("f8"),
    "playable": _in("b1"),
    "flags": _in("b1"),
    "frame_biases": _in("f8"),
    "skips": _in("i8", 2),
    "skip_stops": _in("i8"),
    "currents": _in("i8"),
    "continuing": types.f8,
    "bests": types.f8[::1],
    "best_frames": types.i8[::1],
    "best_ranges": types.i8[::1],
}
"""What `search_block` takes: the block, the arrays of `kernels.pack` in their order, and what is asked."""

SIGNATURE = types.void(*_given.values())


@njit(inline="always", **_options)
def _open_boxes(ranges, range_boxes, bits):
    """Which boxes may play, those of each group as one number, from which ranges may."""
    for i in range(ranges.shape[0]):
        if ranges[i]:
            box, stop = range_boxes[i, 0], range_boxes[i, 1]
            while box < stop:
                first = box % LANES
                n = min(LANES - first, stop - box)
                bits[box // LANES] |= np.uint16(((1 << n) - 1) << first)
                box += n


@njit(inline="always", **_options)
def _groups_of(bits, cluster):
    """Which groups of a cluster have a box that may play."""
    mask = 0
    for lane in range(min(LANES, bits.shape[0] - cluster * LANES)):
        if bits[cluster * LANES + lane]:
            mask |= 1 << lane
    return mask


@njit(inline="always", **_options)
def _least_lane(mask, totals):
    """The lane of the least total among those of a mask: looked at first, it spares most others."""
    least = lowest(mask)
    mask &= mask - 1
    while mask:
        lane = lowest(mask)
        mask &= mask - 1
        if totals[lane] < totals[least]:
            least = lane
    return least


@njit(**_options)
def search_block(
    start,
    stop,
    blocks,
    lows,
    highs,
    cluster_lows,
    cluster_highs,
    order,
    rank,
    box_starts,
    box_sizes,
    box_ranges,
    range_boxes,
    range_order,
    box_kinds,
    kinds,
    offset,
    scale,
    channels,
    weights,
    feature_weights,
    queries,
    ranges,
    range_biases,
    least_of_ranges,
    allowed,
    kind_biases,
    playable,
    flags,
    frame_biases,
    skips,
    skip_stops,
    currents,
    continuing,
    bests,
    best_frames,
    best_ranges,
):
    """Fill `bests`, `best_frames` and `best_ranges`, each [Q], for queries start … stop - 1.

    Parameters
    ----------
    queries : float64 array, shape (Q, F)
        As the caller gives them.
    ranges : bool array, shape (M, R)
    range_biases, least_of_ranges : float64 arrays, shapes (P, R) and (P,)
    skips, skip_stops : int64 arrays, shapes (S, 2) and (Q + 1,)
        Those of query i are skips[skip_stops[i]] … skips[skip_stops[i + 1] - 1].
    currents : int64 array, shape (Q,)

    Everything else is that of `kernels.search`, the same for all queries. The range is NOTHING where nothing may play, and REFUSED
    for a query that cannot be compared.
    """
    n_features, n_groups, n = blocks.shape[1], lows.shape[0], stop - start
    query, narrow, narrow_weights = (
        np.empty((n, n_features)),
        np.empty((n, n_features), np.float32),
        np.empty(n_features, np.float32),
    )
    totals, frame_totals = np.empty(LANES, np.float32), np.empty(LANES, np.float32)
    sizes, leasts, limits = np.empty(n), np.empty(n), np.empty(n, np.float32)
    bits, playing = np.zeros((n, n_groups), np.uint16), np.empty(n, np.int64)
    least_kind = _least_of(kind_biases, 0, kind_biases.shape[0])
    least_frame = _least_of(frame_biases, 0, frame_biases.shape[0]) if frame_biases.shape[0] else 0.0

    for i in range(n):
        own = start + i
        own_ranges, biased = min(own, ranges.shape[0] - 1), min(own, range_biases.shape[0] - 1)
        bests[own], best_frames[own], best_ranges[own], playing[i] = np.inf, -1, NOTHING, -1
        sizes[i] = _prepare(queries[own], offset, scale, feature_weights, order, query[i], narrow[i], narrow_weights)
        leasts[i] = least_of_ranges[biased] + least_kind + least_frame
        limits[i] = np.float32(-1.0)
        if sizes[i] < 0.0:
            best_ranges[own] = REFUSED
            continue
        if i and ranges.shape[0] == 1 and sizes[0] >= 0.0:
            bits[i] = bits[0]
        else:
            _open_boxes(ranges[own_ranges], range_boxes, bits[i])
        current = currents[own]
        if current >= 0:
            box = np.searchsorted(box_starts, current, side="right") - 1
            kind = kinds[current] if kinds.shape[0] else 0
            is_in_range = box >= 0 and current < box_starts[box] + box_sizes[box]
            if is_in_range and ranges[own_ranges, box_ranges[box]] and playable[kind] and (not flags.shape[0] or flags[current]):
                playing[i] = current
                bias = range_biases[biased, box_ranges[box]] + kind_biases[kind]
                if frame_biases.shape[0]:
                    bias += frame_biases[current]
                total = _cost(blocks, box, current - box_starts[box], rank, query[i], channels, weights) + (bias + continuing)
                if total < np.inf:
                    bests[own], best_frames[own], best_ranges[own] = total, current, box_ranges[box]
        limits[i] = _limit(_budget(bests[own], leasts[i]), sizes[i], n_features)

    for cluster in range(cluster_lows.shape[0]):
        for i in range(n):
            groups = _groups_of(bits[i], cluster)
            if groups:
                groups &= _bounded(cluster_lows, cluster_highs, cluster, narrow[i], narrow_weights, n_features, totals, limits[i])
            own, biased = start + i, min(start + i, range_biases.shape[0] - 1)
            while groups:
                group = cluster * LANES + lowest(groups)
                groups &= groups - 1
                mask = _bounded(lows, highs, group, narrow[i], narrow_weights, n_features, totals, limits[i])
                mask &= np.int64(bits[i, group])
                while mask:
                    lane = lowest(mask)
                    mask &= mask - 1
                    box = group * LANES + lane
                    kind = box_kinds[box]
                    if kind >= 0 and not allowed[kind]:
                        continue
                    box_start, count, range_bias = box_starts[box], box_sizes[box], range_biases[biased, box_ranges[box]]
                    least_of_box = range_bias + (kind_biases[kind] if kind >= 0 else least_kind)
                    if frame_biases.shape[0]:
                        least_of_box += _least_of(frame_biases, box_start, box_start + count)
                    limit = _limit(_budget(bests[own], least_of_box), sizes[i], n_features)
                    if totals[lane] > limit:
                        continue
                    passing = _passing(blocks, box, narrow[i], narrow_weights, n_features, frame_totals, limit) & ((1 << count) - 1)
                    lane = _least_lane(passing, frame_totals) if passing else 0
                    while passing:
                        passing &= ~(1 << lane)
                        frame = box_start + lane
                        is_free = frame != playing[i] and not frame_totals[lane] > limit
                        if is_free and flags.shape[0]:
                            is_free = flags[frame]
                        kind = kinds[frame] if is_free and kinds.shape[0] else 0
                        if is_free and allowed[kind] and not _is_skipped(frame, skips[skip_stops[own] : skip_stops[own + 1]]):
                            bias = range_bias + kind_biases[kind]
                            if frame_biases.shape[0]:
                                bias += frame_biases[frame]
                            total = _cost(blocks, box, lane, rank, query[i], channels, weights) + bias
                            is_lower = frame < best_frames[own] and best_frames[own] != playing[i]
                            if total < bests[own] or (total == bests[own] and is_lower):
                                bests[own], best_frames[own], best_ranges[own] = total, frame, box_ranges[box]
                                limit = _limit(_budget(total, least_of_box), sizes[i], n_features)
                                limits[i] = _limit(_budget(total, leasts[i]), sizes[i], n_features)
                        lane = lowest(passing) if passing else 0
