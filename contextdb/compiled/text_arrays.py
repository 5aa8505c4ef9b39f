"""Classes of a numpy array of texts, without a Python text for each.

N texts, K values. Texts are compared as the words of their characters: each is cut to a width that no value fills, so that a longer
text differs from every value. Its words make the number of a slot, and the value of that slot is the only one that it can be.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Words = NDArray[np.uint64]
MIX = np.uint64(0x9E3779B97F4A7C15)
"""An odd number without a pattern: different texts are seldom in one slot."""
SLOT_BITS = (8, 16)
"""At least and at most so many bits number the slots: few slots for few values, which are cleared for each column of facts."""


def is_text_array(given: object) -> bool:
    """Whether `classes_of_texts` reads it: an array of numpy's texts in which none is missing."""
    if not isinstance(given, np.ndarray):
        return False
    return (given.dtype.kind == "U" and given.dtype.isnative) or (given.dtype.kind == "T" and not hasattr(given.dtype, "na_object"))


def classes_of_texts(given: NDArray[Any], values: Sequence[str]) -> NDArray[np.int32] | None:
    """The number of the value that each text is, -1 where it is none: int32 [N]; None where this cannot tell, such as where two
    values have one slot."""
    if not values or not given.nbytes or any("\0" in value for value in values):
        return None
    try:
        texts, own = _as_words(given, values)
    except UnicodeEncodeError:  # texts of numpy's variable width that are not all ASCII
        return None
    bits = _slot_bits(len(values))
    slots, own_slots = _slots(texts, bits), _slots(own, bits)
    numbers = np.zeros(1 << bits, np.int32)
    numbers[own_slots] = np.arange(len(values))
    if (numbers[own_slots] != np.arange(len(values))).any():
        return None
    classes = numbers.take(slots)
    is_same = texts == own.take(classes, axis=0)
    if not is_same.all():
        classes[~is_same.all(axis=1)] = -1
    if given.dtype.kind == "T":  # which keeps a NUL at the end of a text
        lengths = np.array([len(value) for value in values])
        classes[np.strings.str_len(given) != lengths.take(classes)] = -1
    return classes


def _as_words(given: NDArray[Any], values: Sequence[str]) -> tuple[Words, Words]:
    """The characters of texts and of values as uint64 [N, words] and [K, words], in bytes where these hold them all."""
    width = (max(map(len, values)) // 8 + 1) * 8
    if given.dtype.kind == "T":
        dtype = np.dtype(f"S{width}")
        return _words(given.astype(dtype)), _words(np.array(values, dtype))
    texts, own = _characters(given)[:, :width], _characters(np.array(values))
    size = np.uint8 if max(texts.max(initial=0), own.max(initial=0)) < 256 else np.uint32
    return _words(_padded(texts, width, size)), _words(_padded(own, width, size))


def _characters(texts: NDArray[Any]) -> NDArray[np.uint32]:
    return np.ascontiguousarray(texts).view(np.uint32).reshape(len(texts), -1)


def _padded(characters: NDArray[np.uint32], width: int, size: type[np.unsignedinteger[Any]]) -> NDArray[Any]:
    padded, given = np.zeros((len(characters), width), size), characters.shape[1]
    if given > len(characters):
        padded[:, :given] = characters
        return padded
    for at in range(given):  # numpy is slow on many short rows
        padded[:, at] = characters[:, at]
    return padded


def _words(texts: NDArray[Any]) -> Words:
    return np.ascontiguousarray(texts).view(np.uint64).reshape(len(texts), -1)


def _slot_bits(n_values: int) -> int:
    """So many that two values are seldom in one slot: with 16 slots for each pair of them in about one table of 32."""
    least, most = SLOT_BITS
    return min(most, max(least, (16 * n_values * n_values - 1).bit_length()))


def _slots(words: Words, bits: int) -> Words:
    """A number of so many bits for each text, equal for equal ones."""
    keys = words[:, 0] * MIX
    for word in words.T[1:]:
        keys ^= word
        keys *= MIX
    return keys >> np.uint64(64 - bits)
