"""Ranges of frames: [start, stop) of one asset each, in any order, without overlap.

R ranges, int64 arrays `starts` and `stops`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from contextdb.cells.arguments import require_many
from contextdb.errors import Fault, MotionError, in_quotes, plural
from contextdb.motion.clips.skeleton import Ints


def frames_between(starts: Ints, stops: Ints) -> Ints:
    """All frames of some ranges one after another: int64."""
    lengths = stops - starts
    begins = np.cumsum(lengths) - lengths
    return np.asarray(np.arange(int(lengths.sum()), dtype=np.int64) + np.repeat(starts - begins, lengths))


def check_ranges(starts: ArrayLike, stops: ArrayLike, assets: Sequence[str], n_frames: int) -> tuple[Ints, Ints, tuple[str, ...]]:
    """Starts, stops and assets as arrays of one length, or a MotionError that says which range does not fit."""
    first, last, names = _whole(starts, "starts"), _whole(stops, "stops"), tuple(require_many(assets, "assets", "a list of names"))
    if not len(first) == len(last) == len(names):
        counts = f"{plural(len(first), 'start')}, {plural(len(last), 'stop')} and {plural(len(names), 'asset')}"
        raise MotionError(Fault(f"the ranges have {counts}.", "as many of each"))
    for name in names:
        if not isinstance(name, str):
            raise MotionError(Fault(f"an asset is {name!r}.", "names"))
    wrong = np.flatnonzero((first < 0) | (last < first) | (last > n_frames))
    if len(wrong):
        i = int(wrong[0])
        problem = f"range {i}, asset {in_quotes(names[i])}, is [{first[i]}, {last[i]})."
        raise MotionError(Fault(problem, f"0 <= start <= stop <= {n_frames:,}, the number of frames"))
    _check_overlap(first, last, names)
    return first, last, names


def _check_overlap(starts: Ints, stops: Ints, names: Sequence[str]) -> None:
    filled = np.flatnonzero(stops > starts)
    order = filled[np.argsort(starts[filled], kind="stable")]
    wrong = np.flatnonzero(starts[order][1:] < stops[order][:-1])
    if len(wrong):
        i, j = order[wrong[0]], order[wrong[0] + 1]
        ranges_text = " and ".join(f"range {k} of {in_quotes(names[k])}, [{starts[k]}, {stops[k]})," for k in (i, j))
        raise MotionError(Fault(f"{ranges_text} overlap.", "each frame in one range at most"))


def _whole(values: ArrayLike, what: str) -> Ints:
    array = np.asarray(values)
    if array.ndim != 1 or (array.dtype.kind not in "iu" and array.size):
        raise MotionError(Fault(f"{what} has shape {array.shape} and type {array.dtype}.", "a row of whole numbers"))
    return array.astype(np.int64)
