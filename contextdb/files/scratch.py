"""Arrays that may be larger than memory: from a size on they lie in a file without a name.

Such an array takes no memory that a program must have: the system keeps pages that are used, and writes others to the file, which
goes with its last user. An edge: this touches the disk, in the folder for temporary files.
"""

from __future__ import annotations

import math
import mmap
import tempfile
from collections.abc import Sequence
from typing import IO, Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

LARGE_BYTES = 16 << 20
"""An array that takes fewer is a plain one."""
ALIGNED = 64


def zeros(shape: Sequence[int], dtype: DTypeLike) -> NDArray[Any]:
    """Zeros, to be written."""
    size = math.prod(shape) * np.dtype(dtype).itemsize
    if size < LARGE_BYTES:
        return np.zeros(tuple(shape), dtype)
    with tempfile.TemporaryFile() as file:
        file.truncate(size)
        return np.frombuffer(mmap.mmap(file.fileno(), size), dtype).reshape(tuple(shape))


def joined(arrays: Sequence[NDArray[Any]], empty: NDArray[Any]) -> NDArray[Any]:
    """Arrays one below another, as `np.concatenate` has them; `empty` has their type, and no row."""
    whole = zeros((sum(map(len, arrays)), *empty.shape[1:]), empty.dtype)
    at = 0
    for array in arrays:
        whole[at : at + len(array)] = array
        at += len(array)
    return whole


class Pile:
    """Arrays that come one after another and are looked at when all are there."""

    def __init__(self) -> None:
        self._arrays: list[NDArray[Any]] = []
        self._places: list[tuple[int, tuple[int, ...], np.dtype[Any]]] = []
        self._file: IO[bytes] | None = None
        self._size = 0

    def put(self, array: NDArray[Any]) -> int:
        """Put an array on the pile; its number."""
        self._places.append((self._size, array.shape, array.dtype))
        self._arrays.append(array)
        self._size += -(-array.nbytes // ALIGNED) * ALIGNED
        if self._size >= LARGE_BYTES:
            self._spill()
        return len(self._places) - 1

    def arrays(self) -> list[NDArray[Any]]:
        """All of them, by their numbers; no more are put on it then."""
        if self._file is None:
            return self._arrays
        self._spill()
        self._file.truncate(self._size)
        with self._file as file:
            mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        return [
            np.frombuffer(mapped, dtype, math.prod(shape), at).reshape(shape) if math.prod(shape) else np.zeros(shape, dtype)
            for at, shape, dtype in self._places
        ]

    def _spill(self) -> None:
        """Write what is in memory to the file."""
        if self._file is None:
            self._file = tempfile.TemporaryFile()  # noqa: SIM115  closed where it is mapped
        first = len(self._places) - len(self._arrays)
        for (at, _, _), array in zip(self._places[first:], self._arrays, strict=True):
            self._file.seek(at)
            self._file.write(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data)
        self._file.flush()
        self._arrays = []
