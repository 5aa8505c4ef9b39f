"""Sets of rows as bits in uint64 words: pack, unpack, count, and the same as one Python integer.

Row r is bit r % 64 of word r // 64, in every mask of the project. A mask over R rows has W = ceil(R / 64) words; the bits past the
last row are 0, always. As a Python integer, row r is bit r.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Words = NDArray[np.uint64]
Flags = NDArray[np.bool_]
Rows = NDArray[np.int64]
Array = TypeVar("Array", bound=NDArray[Any])


def n_words(n_rows: int) -> int:
    """Words that a mask over `n_rows` rows has."""
    return (n_rows + 63) // 64


def pack(flags: Flags) -> Words:
    """Masks of flags: bool [..., R] to uint64 [..., W]."""
    n_rows = flags.shape[-1]
    octets = np.zeros((*flags.shape[:-1], n_words(n_rows) * 8), np.uint8)
    packed = np.packbits(flags, axis=-1, bitorder="little")
    octets[..., : packed.shape[-1]] = packed
    return octets.view("<u8").astype(np.uint64, copy=False)


def unpack(words: Words, n_rows: int) -> Flags:
    """Flags of masks: uint64 [..., W] to bool [..., n_rows]."""
    octets = np.ascontiguousarray(words.astype("<u8", copy=False)).view(np.uint8)
    return np.unpackbits(octets, axis=-1, count=n_rows, bitorder="little").view(np.bool_)


def rows(words: Words) -> Rows:
    """Row numbers of one mask, ascending: uint64 [W] to int64 [count]."""
    return np.flatnonzero(unpack(words, len(words) * 64))


def from_rows(row_numbers: Rows, n_rows: int) -> Words:
    """The mask that holds the given rows."""
    words = np.zeros(n_words(n_rows), np.uint64)
    numbers = np.asarray(row_numbers, np.int64)
    np.bitwise_or.at(words, numbers >> 6, np.uint64(1) << (numbers & 63).astype(np.uint64))
    return words


def full(n_rows: int) -> Words:
    """The mask of all rows: uint64 [W]."""
    return pack(np.ones(n_rows, np.bool_))


def count(words: Words) -> NDArray[np.int64]:
    """How many rows each mask holds: uint64 [..., W] to int64 [...]."""
    counts = np.bitwise_count(words)
    return np.asarray(counts[..., 0].astype(np.int64) if words.shape[-1] == 1 else counts.sum(axis=-1, dtype=np.int64))


def to_int(words: Words) -> int:
    """One mask as a Python integer."""
    return int.from_bytes(words.astype("<u8", copy=False).tobytes(), "little")


def from_int(bits: int, n_rows: int) -> Words:
    """One mask from a Python integer whose bits are all below `n_rows`; read-only."""
    octets = bits.to_bytes(n_words(n_rows) * 8, "little")
    return read_only(np.frombuffer(octets, "<u8").astype(np.uint64, copy=False))


def flags_of(bits: int, n_rows: int) -> Flags:
    """Flags of one mask as a Python integer whose bits are all below `n_rows`: bool [n_rows], read-only."""
    return unpack(from_int(bits, n_rows), n_rows)


def rows_of(bits: int) -> list[int]:
    """Row numbers of one mask as a Python integer, ascending."""
    return [] if bits == 0 else rows(from_int(bits, bits.bit_length())).tolist()


def runs_of(bits: int) -> list[tuple[int, int]]:
    """A set of bits as runs: the first bit, and the one after the last."""
    runs, at = [], 0
    while bits:
        skip = (bits & -bits).bit_length() - 1
        bits >>= skip
        length = (~bits & (bits + 1)).bit_length() - 1
        runs.append((at + skip, at + skip + length))
        bits >>= length
        at += skip + length
    return runs


def int_of(row_numbers: Sequence[int]) -> int:
    """One mask as a Python integer from the numbers of its rows, ascending; it costs what the last of them is, once."""
    octets = bytearray((row_numbers[-1] >> 3) + 1 if row_numbers else 0)
    for row in row_numbers:
        octets[row >> 3] |= 1 << (row & 7)
    return int.from_bytes(octets, "little")


def places(masks: Words) -> tuple[Rows, Rows]:
    """Which mask holds which row, for masks uint64 [N, W]: the numbers of masks, ascending, and of rows, int64 [n] each.

    It costs what is held: far less than unpacking where that is little.
    """
    held = np.flatnonzero(masks != 0)  # flags are gone through several times as fast as words
    octets = masks.ravel()[held].astype("<u8", copy=False).view(np.uint8)
    bits = np.flatnonzero(np.unpackbits(octets, bitorder="little").view(np.bool_))
    at, word = np.divmod(held, max(masks.shape[-1], 1))
    pair = bits >> 6
    return at[pair], 64 * word[pair] + (bits & 63)


def read_only(array: Array) -> Array:
    """The array, which nobody can write to any more."""
    array.flags.writeable = False
    return array
