"""Chance that depends on nothing but who draws: the same number for the same seed, character, turn and depth, on every system.

Four whole numbers go one after the other through the mixing step of SplitMix64. So no character has a generator of its own to keep,
and what one draws does not hang on who draws with it.

Source: Steele, Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_STEP = 0x9E3779B97F4A7C15
_FIRST, _SECOND = 0xBF58476D1CE4E5B9, 0x94D049BB133111EB
_ALL = 0xFFFFFFFFFFFFFFFF


def uniform(seed: int, who: int, turn: int, depth: int) -> float:
    """A number in [0, 1)."""
    z = seed
    for part in (who, turn, depth):
        z = (z + (part + 1) * _STEP) & _ALL
        z = ((z ^ (z >> 30)) * _FIRST) & _ALL
        z = ((z ^ (z >> 27)) * _SECOND) & _ALL
        z ^= z >> 31
    return (z >> 11) * 2.0**-53


def uniforms(seed: int, who: NDArray[np.int64], turns: NDArray[np.int64], depth: int) -> NDArray[np.float64]:
    """The same for many characters: float64 [N]."""
    z = np.full(len(who), seed & _ALL, np.uint64)
    for part in (who.view(np.uint64), turns.view(np.uint64), np.array([depth], np.uint64)):
        step = part + np.uint64(1)
        step *= np.uint64(_STEP)
        z += step
        z ^= z >> np.uint64(30)
        z *= np.uint64(_FIRST)
        z ^= z >> np.uint64(27)
        z *= np.uint64(_SECOND)
        z ^= z >> np.uint64(31)
    z >>= np.uint64(11)
    return z.astype(np.float64) * 2.0**-53
