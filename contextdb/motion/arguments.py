"""Check what a search is given, and say what does not fit: numbers, flags, frames."""

from __future__ import annotations

import numbers
from collections.abc import Callable, Sequence
from types import NoneType
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contextdb.cells.arguments import require_many
from contextdb.errors import Fault, MotionError, QueryError, in_quotes, plural, some
from contextdb.motion.answers import Answer, Answers, are_answers, is_answer
from contextdb.motion.clips.quaternions import Floats

Flags = NDArray[np.bool_]
NO_BIASES: Floats = np.empty(0)
SURELY_FINITE = 1e70
"""Numbers whose squares sum to less are finite as float32 too."""


class ValidRanges(NamedTuple):
    """What a mask means to one database: which of its ranges may play, bool [R], and their biases, float64 [R]."""

    flags: Flags
    biases: Floats
    widened: Callable[[], Valid | None] | None = None
    """Gives the same for what plays already, as `valid` of a search; None where that is nothing else."""


Valid: TypeAlias = Answer | ArrayLike | ValidRanges
ValidForMany: TypeAlias = Valid | Answers | Sequence["Valid | None"]
"""One for all queries, or one for each."""
Currents: TypeAlias = Sequence[int | None] | NDArray[np.integer]


def array_of(values: object, what: str, error: type[MotionError] = QueryError) -> NDArray[np.generic]:
    """An array of real numbers or bools, of whatever type they have."""
    try:
        array = np.asarray(values)
    except ValueError:
        raise error(Fault(f"{what} cannot be an array: rows of different lengths.", "numbers in rows of one length")) from None
    if array.dtype.kind not in "fiub" and array.size:
        raise error(Fault(f"{what} has type {array.dtype}.", "real numbers"))
    return array


def numbers_of(values: object, what: str) -> Floats:
    """An array of real numbers as float64."""
    return array_of(values, what).astype(np.float64)


def flags_of(values: object, wanted: int | tuple[int, int], what: str, of: str) -> Flags:
    """A bool array of one shape; numbers are refused, for they possible as indices."""
    shape = (wanted,) if isinstance(wanted, int) else wanted
    each = f"one bool for each of {plural(shape[-1], of)}{', for each query' if len(shape) > 1 else ''}"
    accepted = f"Matches, or {each}" if what == "valid" else each
    if are_answers(values):
        raise QueryError(Fault(f"{what} holds the answers for many contexts.", accepted, "to give that of one: many[i]"))
    try:
        array = np.asarray(values)
    except ValueError:
        raise QueryError(Fault(f"{what} has rows of different lengths.", accepted)) from None
    if array.dtype != np.bool_ and array.size:
        raise QueryError(Fault(f"{what} has type {array.dtype}.", accepted))
    if array.shape != shape:
        raise QueryError(Fault(f"{what} has shape {array.shape}.", accepted))
    return np.ascontiguousarray(array, np.bool_)


def query_of(query: object, names: Sequence[str]) -> Floats:
    """One query as float64 [F], or a QueryError that names the features that are no finite numbers."""
    array = numbers_of(query, "the query")
    if array.shape != (len(names),):
        raise QueryError(Fault(f"the query has shape {array.shape}.", f"{plural(len(names), 'feature')}: {some(names, 3)}"))
    refuse_infinite(array, array, names)
    return array


def refuse_infinite(values: Floats, named_values: Floats, names: Sequence[str]) -> None:
    """Refuse a query whose `values` are not all finite as float32; the message shows what was given, `named_values`."""
    if np.vdot(values, values) < SURELY_FINITE:  # as dot, without its warning of an overflow
        return
    with np.errstate(over="ignore", invalid="ignore"):
        wrong = np.flatnonzero(~np.isfinite(values.astype(np.float32))).tolist()
    if wrong:
        listed = ", ".join(f"{in_quotes(names[i])} is {named_values[i]:g}" for i in wrong[:3])
        more = f" and {len(wrong) - 3} more" if len(wrong) > 3 else ""
        raise QueryError(Fault(f"no frame can be compared with the query: {listed}{more}.", "finite numbers that fit a float32"))


def are_finite(values: Floats) -> bool:
    """Whether all are finite as float32."""
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(np.isfinite(values.astype(np.float32)).all())


def frame_of(frame: object, n_frames: int, what: str) -> int:
    """A frame's number, checked."""
    if type(frame) is int and 0 <= frame < n_frames:  # the usual one, spared the abstract class
        return frame
    if isinstance(frame, bool) or not isinstance(frame, numbers.Integral) or not 0 <= int(frame) < n_frames:
        accepted = f"a whole number from 0 to {n_frames - 1}" if n_frames else "none: the database has no frames"
        raise QueryError(Fault(f"the {what} is {frame!r}.", accepted))
    return int(frame)


def current_of(current: object, n_frames: int) -> int:
    """The current frame, -1 for none: None, or -1, the frame of a miss."""
    if current is None or (type(current) is int and current == -1):
        return -1
    if type(current) is int:
        return frame_of(current, n_frames, "current frame")
    is_none = isinstance(current, numbers.Integral) and not isinstance(current, bool) and current == -1
    return -1 if is_none else frame_of(current, n_frames, "current frame")


def bias_of(bias: object, n_frames: int) -> Floats:
    """The bias of each frame, without NaN and without negative infinity; empty where none is given."""
    if bias is None:
        return NO_BIASES
    array = numbers_of(bias, "the bias")
    if array.shape != (n_frames,):
        raise QueryError(Fault(f"the bias has shape {array.shape}.", f"one number for each of {plural(n_frames, 'frame')}"))
    wrong = np.flatnonzero(np.isnan(array) | np.isneginf(array))
    if len(wrong):
        problem = f"the bias of frame {wrong[0]} is {array[wrong[0]]}."
        raise QueryError(Fault(problem, "a number; positive infinity forbids a frame"))
    return array


def currents_of(current: Currents | None, n: int, n_frames: int) -> NDArray[np.int64]:
    """The current frame of each of n searches, -1 for none: int64 [n]."""
    if current is None:
        return np.full(n, -1, np.int64)
    if not isinstance(current, np.ndarray):
        current = list(require_many(current, "current", "one frame, or None, a query"))
    elif current.ndim != 1:
        raise QueryError(Fault(f"the current frames have shape {current.shape}.", "one for each query"))
    if len(current) != n:
        raise QueryError(Fault(f"{plural(len(current), 'current frame')} for {n} queries.", "one for each query"))
    are_plain = current.dtype.kind == "i" if isinstance(current, np.ndarray) else set(map(type, current)) <= {int, NoneType}
    if are_plain:
        frames = np.array([-1 if frame is None else frame for frame in current], np.int64)
        if not n or (frames.min() >= -1 and frames.max() < n_frames):
            return frames
    return np.array([current_of(frame, n_frames) for frame in current], np.int64)


def widened_of(valid: Valid | None) -> Valid | None:
    """What may play for what plays already, if that is anything else than what may play for all."""
    if isinstance(valid, ValidRanges):
        return None if valid.widened is None else valid.widened()
    return valid.widened if is_answer(valid) and valid.widened is not valid else None


def is_one_for_each(valid: object) -> bool:
    """Whether there is one mask for each query, and not one for all."""
    if isinstance(valid, np.ndarray):
        return valid.ndim == 2
    if are_answers(valid):
        return True
    if not isinstance(valid, (list, tuple)) or isinstance(valid, ValidRanges):
        return False
    return not valid or any(mask is None or is_answer(mask) or np.ndim(mask) for mask in valid)
