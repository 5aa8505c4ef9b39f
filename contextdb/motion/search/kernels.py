"""Numba kernels: the exact search over boxes. Arrays only; their shapes are those of `contextdb.motion.search.layout`.

F features, C channels, R ranges, K kinds, N frames. A box is skipped when its lower bound *plus its least bias* is above the best
total so far; without that term biases would make pruning unsound. Bounds and the first look at a box are in float32, widened by
what rounding may take away; a frame that passes both is scored in float64, channel by channel, in the order of
`contextdb.motion.search.cost`, so that both give the same cost to the last bit.

Boxes of 16 frames and the seeding by the current frame as in orangeduck/Motion-Matching, `database.h`; the lanes, the least biases
and the masks are ours.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numba import carray, njit, types  # type: ignore[attr-defined]
from numba.extending import intrinsic
from numpy.typing import NDArray

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.search.layout import Layout
from contextdb.motion.search.simd import bounds_at_most, costs_at_most, lowest

_options: dict[str, Any] = {"cache": True, "nogil": True, "boundscheck": False, "error_model": "numpy"}

LANES = 16
FEW = 14
"""After so many features each, a box, group or cluster may be given up."""
UNIT = 6e-8
"""The greatest relative rounding error of one float32 operation."""
NEVER = 3e38
NOTHING, REFUSED = -1, -2
GREATEST = 3.4028234663852886e38
"""The largest float32: a query beyond it is refused."""


@intrinsic
def _pointer(typing, address):
    """An address as a pointer, for `carray`."""

    def generate(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], context.get_value_type(types.voidptr))

    return types.voidptr(types.int64), generate


def pack(
    layout: Layout, kinds: NDArray[np.uint16], offset: Floats, scale: Floats, slices: Sequence[slice], weights: Floats
) -> Pack:
    """What a database gives every search, as sizes and addresses: handing over twenty arrays takes longer than some searches."""
    channels = np.array([0, *(columns.stop for columns in slices)], np.int64)
    feature_weights = np.repeat(weights, np.diff(channels)).astype(np.float32)
    kept_kinds = kinds if kinds.any() else kinds[:0]
    lay = layout
    arrays = (
        *(
            lay.blocks,
            lay.lows,
            lay.highs,
            lay.cluster_lows,
            lay.cluster_highs,
            lay.order,
            lay.rank,
            lay.box_starts,
            lay.box_sizes,
            lay.box_ranges,
            lay.range_boxes,
            lay.range_order,
        ),
        *(lay.kinds_of_boxes(kinds), kept_kinds, offset, scale, channels, weights, feature_weights),
    )
    kept = tuple(np.ascontiguousarray(array) for array in arrays)
    sizes = (lay.n_features, len(lay.box_starts), len(lay.lows), len(lay.cluster_lows), len(lay.range_boxes), len(lay.range_order))
    numbers = [*sizes, len(kept_kinds), len(weights), *(array.ctypes.data for array in kept)]
    return Pack(np.array(numbers, np.int64), kept)


class Pack(NamedTuple):
    """Sizes and addresses int64, and the arrays that they are of, kept alive."""

    numbers: Ints
    arrays: tuple[NDArray[Any], ...]


def _in(dtype: str, n_axes: int = 1) -> Any:
    """The type of an array that is only read: also one that may not be written."""
    return types.Array(getattr(types, dtype), n_axes, "C", readonly=True)


@njit(**_options)
def _limit(budget, size, n_features):
    """The float32 below which a sum of squares may be, when it is at most `budget` in float64; -1 when none can be.

    `size` is the weighted square of the query: what rounding the query to float32 may add grows with it.
    """
    if budget < 0.0:
        return np.float32(-1.0)
    widened = budget * (1.0 + (3 * n_features + 16) * UNIT) + (budget + size) * 4.0 * UNIT + 1e-30
    return np.float32(widened) if widened < NEVER else np.float32(np.inf)


@njit(**_options)
def _budget(best, bias):
    """What the squares of a frame with this bias may cost at most; widened by what the sum with the bias may round away."""
    if bias == np.inf:
        return -1.0
    return best - bias + 1e-15 * (abs(best) + abs(bias)) if best < np.inf else np.inf


@njit(inline="always", **_options)
def _cost(blocks, box, lane, rank, query, channels, weights):
    """A frame's cost without bias, in float64 and in the order of `cost.costs`."""
    total = 0.0
    for c in range(weights.shape[0]):
        squares = 0.0
        for f in range(channels[c], channels[c + 1]):
            apart = np.float64(blocks[box, rank[f], lane]) - query[f]
            squares += apart * apart
        total += weights[c] * squares
    return total


@njit(inline="always", **_options)
def _is_skipped(frame, skips):
    for i in range(skips.shape[0]):  # noqa: SIM110
        if skips[i, 0] <= frame < skips[i, 1]:
            return True
    return False


@njit(inline="always", **_options)
def _least_of(biases, start, stop):
    least = np.inf
    for i in range(start, stop):
        least = min(least, biases[i])
    return least


@njit(inline="always", **_options)
def _prepare(raw, offset, scale, weights, order, query, narrow, narrow_weights):
    """Normalise a query; in float64, and in float32 in the order of the layout, with the weights.

    Gives the weighted square of the query, or -1 when a number is NaN or too large to be compared.
    """
    size = 0.0
    for f in range(raw.shape[0]):
        query[f] = (raw[f] - offset[f]) / scale[f]
        if not (abs(query[f]) <= GREATEST and abs(raw[f]) <= GREATEST):
            return -1.0
        size += weights[f] * query[f] * query[f]
    for i in range(raw.shape[0]):
        narrow[i], narrow_weights[i] = query[order[i]], weights[order[i]]
    return size


@njit(inline="always", **_options)
def _bounded(lows, highs, at, query, weights, n_features, totals, limit):
    """Which lanes of a group or cluster may hold a frame that costs at most `limit`; their bounds are left in `totals`."""
    for lane in range(LANES):
        totals[lane] = np.float32(0.0)
    mask, start = -1, 0
    while mask and start < n_features:
        stop = min(start + FEW, n_features)
        mask = bounds_at_most(lows, highs, at, query, weights, start, stop, totals, limit)
        start = stop
    return mask


@njit(inline="always", **_options)
def _passing(blocks, box, query, weights, n_features, totals, limit):
    """Which frames of a box cost at most `limit`, in float32."""
    for lane in range(LANES):
        totals[lane] = np.float32(0.0)
    mask, start = -1, 0
    while mask and start < n_features:
        stop = min(start + FEW, n_features)
        mask = costs_at_most(blocks, box, query, weights, start, stop, totals, limit)
        start = stop
    return mask


_given = {
    "pack": _in("i8"),
    "raw": _in("f8"),
    "ranges": _in("b1"),
    "is_whole": types.b1,
    "range_biases": _in("f8"),
    "least_of_ranges": types.f8,
    "allowed": _in("b1"),
    "kind_biases": _in("f8"),
    "playable": _in("b1"),
    "flags": _in("b1"),
    "frame_biases": _in("f8"),
    "skips": _in("i8", 2),
    "current": types.i8,
    "continuing": types.f8,
    "within": types.f8,
    "bests": types.f8[::1],
    "best_frames": types.i8[::1],
}
"""What `search` takes. Told beforehand, so that no array of another kind has it compiled again in the middle of a game."""


SIGNATURE = types.i8(*_given.values())
"""What the search is compiled for, when it is first loaded."""


@njit(**_options)
def search(
    pack,
    raw,
    ranges,
    is_whole,
    range_biases,
    least_of_ranges,
    allowed,
    kind_biases,
    playable,
    flags,
    frame_biases,
    skips,
    current,
    continuing,
    within,
    bests,
    best_frames,
):
    """Fill `bests` and `best_frames` with the lowest total and its frame: one for all (length 1), or one each range (length R).

    Parameters
    ----------
    pack : int64 array, see `pack`
    raw : float64 array, shape (F,)
        The query as the caller gives it.
    ranges, is_whole : bool array, shape (R,), bool
        The ranges that may play; whether that is all of them.
    range_biases, least_of_ranges : float64 array, shape (R,), float
        And the least of them.
    allowed, kind_biases, playable : bool, float64 and bool arrays, shape (K,)
        See `contextdb.motion.search.filters.Kinds`.
    flags : bool array, shape (N,) or (0,)
        The frames that may be chosen; empty: all.
    frame_biases : float64 array, shape (N,) or (0,)
    skips : int64 array, shape (S, 2)
    current : int
        The frame that would play on, or -1; `continuing` is its bias.
    within : float
        Totals above this are not told; inf: all are.

    Returns
    -------
    int
        The range of the best frame; NOTHING, or REFUSED for a query that cannot be compared. 0 for one for each range.
    """
    n_features, n_boxes, n_groups, n_clusters = pack[0], pack[1], pack[2], pack[3]
    n_ranges, n_filled, n_kinds, n_channels = pack[4], pack[5], pack[6], pack[7]
    blocks = carray(_pointer(pack[8]), (n_boxes, n_features, LANES), np.float32)
    lows = carray(_pointer(pack[9]), (n_groups, n_features, LANES), np.float32)
    highs = carray(_pointer(pack[10]), (n_groups, n_features, LANES), np.float32)
    cluster_lows = carray(_pointer(pack[11]), (n_clusters, n_features, LANES), np.float32)
    cluster_highs = carray(_pointer(pack[12]), (n_clusters, n_features, LANES), np.float32)
    order = carray(_pointer(pack[13]), (n_features,), np.int64)
    rank = carray(_pointer(pack[14]), (n_features,), np.int64)
    box_starts = carray(_pointer(pack[15]), (n_boxes,), np.int64)
    box_sizes = carray(_pointer(pack[16]), (n_boxes,), np.int32)
    box_ranges = carray(_pointer(pack[17]), (n_boxes,), np.int32)
    range_boxes = carray(_pointer(pack[18]), (n_ranges, 2), np.int64)
    range_order = carray(_pointer(pack[19]), (n_filled,), np.int64)
    box_kinds = carray(_pointer(pack[20]), (n_boxes,), np.int32)
    kinds = carray(_pointer(pack[21]), (n_kinds,), np.uint16)
    offset = carray(_pointer(pack[22]), (n_features,), np.float64)
    scale = carray(_pointer(pack[23]), (n_features,), np.float64)
    channels = carray(_pointer(pack[24]), (n_channels + 1,), np.int64)
    weights = carray(_pointer(pack[25]), (n_channels,), np.float64)
    feature_weights = carray(_pointer(pack[26]), (n_features,), np.float32)

    query, scratch = np.empty(n_features), np.empty((4, max(n_features, LANES)), np.float32)
    narrow, narrow_weights, totals, frame_totals = scratch[0], scratch[1], scratch[2], scratch[3]
    size = _prepare(raw, offset, scale, feature_weights, order, query, narrow, narrow_weights)
    if size < 0.0:
        return REFUSED
    is_one = bests.shape[0] == 1
    for i in range(bests.shape[0]):
        bests[i], best_frames[i] = within, -1
    least_kind = _least_of(kind_biases, 0, kind_biases.shape[0])
    least = least_of_ranges + least_kind
    if frame_biases.shape[0]:
        least += _least_of(frame_biases, 0, frame_biases.shape[0])

    best_range = NOTHING
    if current >= 0:
        box = np.searchsorted(box_starts, current, side="right") - 1
        kind = kinds[current] if n_kinds else 0
        is_in_range = box >= 0 and current < box_starts[box] + box_sizes[box]
        if not is_in_range or not ranges[box_ranges[box]] or not playable[kind] or (flags.shape[0] and not flags[current]):
            current = -1
        else:
            bias = range_biases[box_ranges[box]] + kind_biases[kind]
            if frame_biases.shape[0]:
                bias += frame_biases[current]
            total = _cost(blocks, box, current - box_starts[box], rank, query, channels, weights) + (bias + continuing)
            if total <= within and total < np.inf:
                slot = 0 if is_one else box_ranges[box]
                bests[slot], best_frames[slot], best_range = total, current, box_ranges[box]

    limit = _limit(_budget(bests[0] if is_one else within, least), size, n_features)
    next_group, cluster, open_groups = 0, -1, 0
    for run in range(1 if is_whole else n_filled):
        if is_whole:
            first_box, stop_box = 0, n_boxes
        elif ranges[range_order[run]]:
            first_box, stop_box = range_boxes[range_order[run], 0], range_boxes[range_order[run], 1]
        else:
            continue
        for group in range(max(first_box // LANES, next_group), (stop_box + LANES - 1) // LANES):
            next_group = group + 1
            if group // LANES != cluster:
                cluster = group // LANES
                open_groups = _bounded(cluster_lows, cluster_highs, cluster, narrow, narrow_weights, n_features, totals, limit)
            if not (open_groups >> (group % LANES)) & 1:
                continue
            mask = _bounded(lows, highs, group, narrow, narrow_weights, n_features, totals, limit)
            while mask:
                lane = lowest(mask)
                mask &= mask - 1
                box = group * LANES + lane
                if box >= n_boxes or not ranges[box_ranges[box]]:
                    continue
                kind = box_kinds[box]
                if kind >= 0 and not allowed[kind]:
                    continue
                slot = 0 if is_one else box_ranges[box]
                start, count, range_bias = box_starts[box], box_sizes[box], range_biases[box_ranges[box]]
                least_of_box = range_bias + (kind_biases[kind] if kind >= 0 else least_kind)
                if frame_biases.shape[0]:
                    least_of_box += _least_of(frame_biases, start, start + count)
                own_limit = _limit(_budget(bests[slot], least_of_box), size, n_features)
                if totals[lane] > own_limit:
                    continue
                passing = _passing(blocks, box, narrow, narrow_weights, n_features, frame_totals, own_limit)
                while passing:
                    lane = lowest(passing)
                    passing &= passing - 1
                    frame = start + lane
                    if lane >= count or frame == current or (flags.shape[0] and not flags[frame]) or _is_skipped(frame, skips):
                        continue
                    kind = kinds[frame] if n_kinds else 0
                    if not allowed[kind]:
                        continue
                    bias = range_bias + kind_biases[kind]
                    if frame_biases.shape[0]:
                        bias += frame_biases[frame]
                    total = _cost(blocks, box, lane, rank, query, channels, weights) + bias
                    if total < bests[slot] or (total == bests[slot] < np.inf and best_frames[slot] < 0):
                        bests[slot], best_frames[slot], best_range = total, frame, box_ranges[box]
                        if is_one:
                            limit = _limit(_budget(total, least), size, n_features)
    return best_range if is_one else 0
