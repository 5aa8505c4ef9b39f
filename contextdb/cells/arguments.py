"""Check what a caller gives besides facts: rows, places, texts, numbers. Each error names the argument and what is accepted."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping
from numbers import Real
from operator import index
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.errors import ContextError, Fault, FileError, NoSuchPlace, Place, WrongType, in_quotes, plural

MOST = 1e9
"""The most seconds, or whatever else is waited for or counted."""


def require_whole(value: object, what: str) -> int:
    """A whole number, of numpy's too."""
    try:
        return index(value)  # type: ignore[arg-type]
    except TypeError:
        raise _wrong(value, what, "a whole number") from None


def require_row(row: object, n_rows: int) -> int:
    """The number of one of some rows."""
    number = require_whole(row, "row")
    if not 0 <= number < n_rows:
        accepted = f"rows 0 to {n_rows - 1}" if n_rows else "no row: the table is empty"
        raise NoSuchPlace(Fault(f"there is no row {number}.", accepted))
    return number


def require_place(place: object, length: int, what: str) -> int:
    """A place in a sequence, counted from its end where it is negative; gives it from the beginning."""
    number = require_whole(place, what)
    if not -length <= number < length:
        accepted = f"0 to {length - 1}" if length else "none: there is nothing"
        raise NoSuchPlace(Fault(f"there is no {what} {number} among {plural(length, what)}.", accepted))
    return number % length


def require_text(value: object, what: str) -> str:
    """The text. Raises WrongType for all else; `what` is its name in the message."""
    if not isinstance(value, str):
        raise _wrong(value, what, "a text")
    return value


def require_number(value: object, what: str) -> float:
    """A number from 0 up, not infinite."""
    if isinstance(value, (int, float)) and 0.0 <= value <= MOST:
        return float(value)
    error = _wrong(value, what, f"a number from 0 to {MOST:g}")
    raise ContextError(*error.faults) if isinstance(value, (int, float)) else error


def require_real(value: object, what: str, least: float = -MOST, most: float = MOST) -> float:
    """A number between two bounds, of numpy's too."""
    is_number = type(value) is float or (isinstance(value, Real) and not isinstance(value, bool))
    if is_number and least <= value <= most:  # type: ignore[operator]
        return float(value)  # type: ignore[arg-type]
    raise _wrong(value, what, f"a number from {least:g} to {most:g}")


def as_number(value: object) -> float | None:
    """A finite float, or None for anything else; True is not a number."""
    if type(value) is float:
        return value if math.isfinite(value) else None
    if isinstance(value, bool) or not isinstance(value, Real):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def require_point(value: object, what: str, accepted: str) -> tuple[float, float]:
    """A pair of finite numbers, which may be an array."""
    if type(value) is tuple and len(value) == 2:
        one, other = value
        if type(one) is type(other) is float and -MOST <= one <= MOST and -MOST <= other <= MOST:  # as mostly
            return one, other
    is_row = isinstance(value, (tuple, list)) or (isinstance(value, np.ndarray) and value.ndim == 1)
    if not is_row or len(value) != 2:  # type: ignore[arg-type]
        raise _wrong(value, what, accepted)
    each = f"one of {what}"
    return require_real(value[0], each), require_real(value[1], each)  # type: ignore[index]


def require_pair(value: object, what: str, accepted: str) -> None:
    """Raise ContextError for what is no pair of texts."""
    if not (isinstance(value, (tuple, list)) and len(value) == 2 and all(isinstance(each, str) for each in value)):
        raise _wrong(value, what, accepted)


def require_path(value: object, what: str = "path") -> Path:
    """A path as a text or a `Path`, of which the system can make the name of a file. Raises ContextError where it is of another
    type, FileError where it holds a character that no name of a file can hold."""
    if not isinstance(value, (str, os.PathLike)) or not isinstance(os.fspath(value), str):
        raise _wrong(value, what, "a text or a pathlib.Path")
    path = Path(value)
    try:
        is_name = b"\0" not in os.fsencode(path)
    except UnicodeEncodeError:
        is_name = False
    if not is_name:
        problem = "the path holds a character that no name of a file can hold."
        raise FileError(Fault(problem, place=Place(str(path)), rule="no-such-path"))
    return path


def require_mapping(value: object, what: str, accepted: str) -> Mapping[Any, Any]:
    """The mapping. Raises WrongType for all else; `what` is its name in the message."""
    if not isinstance(value, Mapping):
        raise _wrong(value, what, accepted)
    return value


def require_many(value: object, what: str, accepted: str) -> Iterable[Any]:
    """Something to go through that is not text."""
    if isinstance(value, (str, bytes, Mapping)) or not isinstance(value, Iterable):
        raise _wrong(value, what, accepted)
    return value


def require_numbers(value: object, what: str) -> NDArray[np.float64]:
    """An array of real numbers, as float64."""
    accepted = "real numbers, in rows of one length"
    try:
        array = np.asarray(value)
    except ValueError:
        raise ContextError(Fault(f"{what} has rows of different lengths.", accepted)) from None
    if array.dtype.kind not in "fiub" and array.size:
        raise ContextError(Fault(f"{what} is an array of {array.dtype}.", accepted))
    return array.astype(np.float64)


def require_callable(value: object, what: str) -> None:
    """Raise ContextError for what is neither a function nor None."""
    if value is not None and not callable(value):
        raise _wrong(value, what, "a function, or None")


def require_many_of(value: object, kind: type, what: str, accepted: str) -> list[Any]:
    """Several things of one type, as a list."""
    listed = list(require_many(value, what, accepted))
    for each in listed:
        require_kind(each, kind, f"one of {what}", accepted)
    return listed


def require_kind(value: object, kinds: type | tuple[type, ...], what: str, accepted: str) -> None:
    """Raise ContextError for what is of none of some types."""
    if not isinstance(value, kinds):
        raise _wrong(value, what, accepted)


def _wrong(value: object, what: str, accepted: str) -> WrongType:
    if isinstance(value, (str, int, float)):
        return WrongType(Fault(f"{what} is {type(value).__name__} {in_quotes(text_of(value))}.", accepted))
    return WrongType(Fault(f"{what} is of type {type(value).__name__}.", accepted))


def text_of(value: object) -> str:
    """A value as a message shows it."""
    try:
        return str(value)
    except ValueError:  # a whole number of very many digits
        return "…"
