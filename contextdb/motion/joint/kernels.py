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
    "valid": _in("b1", 2),
    "range_biases": _in("f8", 1),
    "frame_biases": _in("f8", 2),
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
    valid,
    range_biases,
    frame_biases,
):
    """The lowest total, its joint frame and its cast; inf, -1, -1 for none.

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
    queries, seen, casts, valid, range_biases
        See `contextdb.motion.joint.scan.Asked`.
    frame_biases : float64 array, shape (B, 16)
    """
    n_actors, n_features = queries.shape
    n_casts, n_roles = casts.shape
    n_pairs = pairs.shape[0]
    best, best_frame, best_cast = np.inf, -1, -1

    plays = np.zeros((n_actors, n_roles), np.bool_)
    for c in range(n_casts):
        for k in range(n_roles):
            plays[casts[c, k], k] = True
    feature_weights = np.empty(n_features)
    for c in range(weights.shape[0]):
        feature_weights[channels[c] : channels[c + 1]] = weights[c]

    own = _own_bounds(boxes, lows, highs, order, feature_weights, queries, plays)
    near = _relative_bounds(relative_lows, relative_highs, pairs, relative_weights, seen, casts)
    bounds, least = _bounds(boxes, box_ranges, own, near, pairs, casts, valid, range_biases, frame_biases)

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
            range_bias = range_biases[box_ranges[box]]
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
def _relative_bounds(lows, highs, pairs, weights, seen, casts):
    """What one actor sees of another costs at least, for each ordered pair of roles: [P, A, A, B], where a cast has them."""
    n_actors, n_boxes = seen.shape[0], lows.shape[2]
    found = np.empty((pairs.shape[0], n_actors, n_actors, n_boxes))
    is_known = np.zeros((pairs.shape[0], n_actors, n_actors), np.bool_)
    for c in range(casts.shape[0]):
        for p in range(pairs.shape[0]):
            one, other = casts[c, pairs[p, 0]], casts[c, pairs[p, 1]]
            if is_known[p, one, other]:
                continue
            is_known[p, one, other] = True
            total = found[p, one, other]
            total[:] = 0.0
            for i in range(4):
                wanted, weight = seen[one, other, i], weights[i // 2]
                for box in range(n_boxes):
                    apart = max(max(np.float64(lows[p, i, box]) - wanted, wanted - np.float64(highs[p, i, box])), 0.0)
                    total[box] += weight * (apart * apart)
    return found


@njit(**_options)
def _bounds(boxes, box_ranges, own, near, pairs, casts, valid, range_biases, frame_biases):
    """What each cast costs at least in each box, inf where it may not play, and the least of all casts: [C, B] and [B]."""
    n_casts, n_boxes = casts.shape[0], boxes.shape[0]
    bounds, least = np.empty((n_casts, n_boxes)), np.full(n_boxes, np.inf)
    biases = np.empty(n_boxes)
    for box in range(n_boxes):
        biases[box] = np.inf
        for lane in range(LANES):
            biases[box] = min(biases[box], frame_biases[box, lane])
        biases[box] += range_biases[box_ranges[box]]
    for c in range(n_casts):
        bound = bounds[c]
        bound[:] = 0.0
        for k in range(casts.shape[1]):
            part = own[casts[c, k], k]
            for box in range(n_boxes):
                bound[box] += part[box]
        for p in range(pairs.shape[0]):
            part = near[p, casts[c, pairs[p, 0]], casts[c, pairs[p, 1]]]
            for box in range(n_boxes):
                bound[box] += part[box]
        for box in range(n_boxes):
            if valid[c, box_ranges[box]] and biases[box] < np.inf:
                lowered = bound[box] * (1.0 - ROUNDED) + biases[box]
                bound[box] = lowered - ROUNDED * (abs(lowered) + abs(biases[box]))
                least[box] = min(least[box], bound[box])
            else:
                bound[box] = np.inf
    return bounds, least


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
