"""The compiled joint search: the best joint frame and cast of all that may be.

What a cast costs in a box of 16 joint frames is at least the sum of what its actors' queries cost against the bounds of the box in
each role, of what the places and facings of its actors cost against theirs, and of the least bias. Boxes are looked at in the order
of the least of these bounds over casts, until it is above the best total; within a box only casts whose bound is not above it. What
an actor costs in a role is computed once a box, whatever casts share him. Bounds and costs are float64, bounds lowered by what
rounding may add, so that no tie is lost; costs are summed up in the order of `contextdb.motion.joint.scan`.

A actors, C casts, K roles, P ordered pairs of roles, B joint boxes, F features, 16 lanes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types

from contextdb.motion.search.layout import LANES

_options: dict[str, Any] = {"cache": True, "nogil": True, "boundscheck": False, "error_model": "numpy"}

ROUNDED = 1e-12
"""More than rounding can add to a bound, of its size."""
TILE = 64
"""So many boxes are bounded at a time, so that what actors see of each other stays in the processor's cache."""


def _in(dtype: str, n_axes: int) -> Any:
    """The type of an array that is only read: also one that may not be written."""
    return types.Array(getattr(types, dtype), n_axes, "C", readonly=True)


_given = {
    "blocks": _in("f4", 3),
    "lows": _in("f4", 3),
    "highs": _in("f4", 3),
    "order": _in("i8", 1),
    "rank": _in("i8", 1),
    "channels": _in("i8", 1),
    "weights": _in("f8", 1),
    "boxes": _in("i8", 2),
    "box_ranges": _in("i8", 1),
    "box_firsts": _in("i8", 1),
    "relative": _in("f4", 4),
    "relative_lows": _in("f4", 3),
    "relative_highs": _in("f4", 3),
    "pairs": _in("i8", 2),
    "relative_weights": _in("f8", 1),
    "queries": _in("f8", 2),
    "seen": _in("f8", 3),
    "casts": _in("i8", 2),
    "range_biases": _in("f8", 2),
    "frame_biases": _in("f8", 2),
    "best": types.f8,
    "best_frame": types.i8,
}
"""What `search` takes. Told beforehand, so that no array of another kind has it compiled again in the middle of a game."""

SIGNATURE = types.Tuple((types.f8, types.i8, types.i8))(*_given.values())


@njit(**_options)
def search(
    blocks,
    lows,
    highs,
    order,
    rank,
    channels,
    weights,
    boxes,
    box_ranges,
    box_firsts,
    relative,
    relative_lows,
    relative_highs,
    pairs,
    relative_weights,
    queries,
    seen,
    casts,
    range_biases,
    frame_biases,
    best,
    best_frame,
):
    """The lowest total, its joint frame and its cast.

    Parameters
    ----------
    blocks, lows, highs, order, rank
        Of the database's `Layout`.
    channels : int64 array, shape (channels + 1,); weights : float64 array, shape (channels,)
        Where channels begin, and the end of the last; the joint database's `own_weights`.
    boxes, box_ranges, box_firsts, relative, relative_lows, relative_highs
        See `contextdb.motion.joint.boxes`.
    pairs : int64 array, shape (P, 2)
    relative_weights : float64 array, shape (2,)
    queries, seen, casts, range_biases
        See `contextdb.motion.joint.scan.Asked`.
    frame_biases : float64 array, shape (B, 16)
    best, best_frame : float, int
        The lowest total of casts before these, and its frame; inf and -1 where there is none. Given back, with the cast -1, where
        none of these is better.
    """
    n_actors, n_features = queries.shape
    n_casts, n_roles = casts.shape
    n_boxes, n_pairs = boxes.shape[0], pairs.shape[0]
    best_cast = -1

    plays = np.zeros((n_actors, n_roles), np.bool_)
    for c in range(n_casts):
        for k in range(n_roles):
            plays[casts[c, k], k] = True
    feature_weights = np.empty(n_features)
    for c in range(weights.shape[0]):
        feature_weights[channels[c] : channels[c + 1]] = weights[c]

    own = _own_bounds(boxes, lows, highs, order, feature_weights, queries, plays)
    bounds, least = np.empty((n_casts, n_boxes)), np.full(n_boxes, np.inf)
    near = np.empty((n_pairs, n_actors, n_actors, TILE))
    for start in range(0, n_boxes, TILE):
        stop = min(start + TILE, n_boxes)
        _relative_bounds(start, stop, relative_lows, relative_highs, pairs, relative_weights, seen, casts, near)
        _bounds(start, stop, box_ranges, own, near, pairs, casts, range_biases, frame_biases, bounds, least)

    costs = np.empty((n_actors, n_roles, LANES))
    is_known = np.empty((n_actors, n_roles), np.bool_)
    totals = np.empty(LANES)
    for box in np.argsort(least, kind="mergesort"):
        if least[box] > best or least[box] == np.inf:
            break
        is_known[:] = False
        for c in range(n_casts):
            if bounds[c, box] > best or bounds[c, box] == np.inf:
                continue
            totals[:] = 0.0
            for k in range(n_roles):
                actor = casts[c, k]
                if not is_known[actor, k]:
                    _own_costs(blocks, boxes[box, k], rank, queries[actor], channels, weights, costs[actor, k])
                    is_known[actor, k] = True
                for lane in range(LANES):
                    totals[lane] += costs[actor, k, lane]
            for p in range(n_pairs):
                wanted = seen[casts[c, pairs[p, 0]], casts[c, pairs[p, 1]]]
                for part in range(2):
                    for lane in range(LANES):
                        first = np.float64(relative[box, p, 2 * part, lane]) - wanted[2 * part]
                        second = np.float64(relative[box, p, 2 * part + 1, lane]) - wanted[2 * part + 1]
                        totals[lane] += relative_weights[part] * (first * first + second * second)
            range_bias = range_biases[c, box_ranges[box]]
            for lane in range(LANES):
                total = totals[lane] + (range_bias + frame_biases[box, lane])
                frame = box_firsts[box] + lane
                if total < best or (total == best < np.inf and (frame < best_frame or (frame == best_frame and c < best_cast))):
                    best, best_frame, best_cast = total, frame, c
    return best, best_frame, best_cast


@njit(**_options)
def _own_bounds(boxes, lows, highs, order, feature_weights, queries, plays):
    """What the pose and path of each actor cost at least in each role's part of each joint box: [A, K, B]."""
    n_features = order.shape[0]
    n_groups, n_boxes = lows.shape[0], boxes.shape[0]
    found = np.empty((queries.shape[0], plays.shape[1], n_boxes))
    of_boxes = np.empty((n_groups, LANES))
    for actor in range(queries.shape[0]):
        for group in range(n_groups):
            of_boxes[group] = 0.0
            for i in range(n_features):
                wanted, weight = queries[actor, order[i]], feature_weights[order[i]]
                for lane in range(LANES):
                    below = np.float64(lows[group, i, lane]) - wanted
                    above = wanted - np.float64(highs[group, i, lane])
                    apart = max(max(below, above), 0.0)
                    of_boxes[group, lane] += weight * (apart * apart)
        for k in range(plays.shape[1]):
            if plays[actor, k]:
                for box in range(n_boxes):
                    found[actor, k, box] = of_boxes[boxes[box, k] // LANES, boxes[box, k] % LANES]
    return found


@njit(**_options)
def _relative_bounds(start, stop, lows, highs, pairs, weights, seen, casts, found):
    """What one actor sees of another costs at least in some boxes, for each ordered pair of roles, where a cast has them: fills
    `found` [P, A, A, TILE]."""
    is_known = np.zeros(found.shape[:3], np.bool_)
    for c in range(casts.shape[0]):
        for p in range(pairs.shape[0]):
            one, other = casts[c, pairs[p, 0]], casts[c, pairs[p, 1]]
            if is_known[p, one, other]:
                continue
            is_known[p, one, other] = True
            total = found[p, one, other]
            total[:] = 0.0
            for i in range(4):
                wanted, weight, low, high = seen[one, other, i], weights[i // 2], lows[p, i], highs[p, i]
                for at in range(stop - start):
                    apart = max(max(np.float64(low[start + at]) - wanted, wanted - np.float64(high[start + at])), 0.0)
                    total[at] += weight * (apart * apart)


@njit(**_options)
def _bounds(start, stop, box_ranges, own, near, pairs, casts, range_biases, frame_biases, bounds, least):
    """What each cast costs at least in some boxes, inf where it may not play, and the least of all casts: fills `bounds` [C, B] and
    `least` [B]."""
    biases = np.full(TILE, np.inf)
    for at in range(stop - start):
        for lane in range(LANES):
            biases[at] = min(biases[at], frame_biases[start + at, lane])
    for c in range(casts.shape[0]):
        bound = bounds[c]
        for box in range(start, stop):
            bound[box] = 0.0
        for k in range(casts.shape[1]):
            part = own[casts[c, k], k]
            for box in range(start, stop):
                bound[box] += part[box]
        for p in range(pairs.shape[0]):
            part = near[p, casts[c, pairs[p, 0]], casts[c, pairs[p, 1]]]
            for box in range(start, stop):
                bound[box] += part[box - start]
        for box in range(start, stop):
            bias = biases[box - start] + range_biases[c, box_ranges[box]]
            if bias < np.inf:
                lowered = bound[box] * (1.0 - ROUNDED) + bias
                bound[box] = lowered - ROUNDED * (abs(lowered) + abs(bias))
                least[box] = min(least[box], bound[box])
            else:
                bound[box] = np.inf


@njit(inline="always", **_options)
def _own_costs(blocks, box, rank, query, channels, weights, totals):
    """What the pose and path of an actor cost in each lane of a box, in the order of `cost.costs`."""
    squares = np.empty(LANES)
    for lane in range(LANES):
        totals[lane] = 0.0
    for c in range(weights.shape[0]):
        for lane in range(LANES):
            squares[lane] = 0.0
        for f in range(channels[c], channels[c + 1]):
            for lane in range(LANES):
                apart = np.float64(blocks[box, rank[f], lane]) - query[f]
                squares[lane] += apart * apart
        for lane in range(LANES):
            totals[lane] += weights[c] * squares[lane]
