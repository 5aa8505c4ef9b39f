"""Shares as text, and intervals round a share that was sampled."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.covering.sample import Codes, Sampler
from contextdb.covering.space import Sides, Space

Z_99 = 2.5758293035489004
"""Standard deviations that 99 % of a normal distribution lie within."""


def format_percent(share: float, digits: int = 2) -> str:
    """A share as a percentage that never rounds to 0 or 100 when it is not: "99.999 %", "> 99.9999999999 %", "0.0003 %"."""
    if math.isnan(share):
        return "unknown"
    if share <= 0.0 or share >= 1.0:
        return "0 %" if share <= 0.0 else "100 %"
    if share < 0.5:
        percent = 100.0 * share
        texts = (f"{percent:.{places}f}" for places in range(digits, 11))
        return f"{next((text for text in texts if float(text) > 0.0), f'{percent:.1g}')} %"
    for places in range(digits, 13):
        text = f"{100.0 * share:.{places}f}"
        if float(text) < 100.0:
            return f"{text} %"
    return "> 99.9999999999 %"


def told_apart(one: float, other: float) -> tuple[str, str]:
    """Two shares as percentages, with as many digits as it takes to tell them apart."""
    texts = [(format_percent(one, digits), format_percent(other, digits)) for digits in range(2, 9)]
    return next((pair for pair in texts if pair[0] != pair[1]), texts[0])


def wilson(n_hits: int, n_samples: int, z: float = Z_99) -> tuple[float, float]:
    """The interval that a share lies in, after `n_hits` of `n_samples`: E. B. Wilson, JASA 22, 1927. No sample says nothing."""
    if n_samples <= 0:
        return 0.0, 1.0
    share, zz = n_hits / n_samples, z * z
    centre = share + zz / (2 * n_samples)
    spread = z * math.sqrt(share * (1 - share) / n_samples + zz / (4 * n_samples * n_samples))
    low, high = (centre - spread) / (1 + zz / n_samples), (centre + spread) / (1 + zz / n_samples)
    return (0.0 if n_hits == 0 else max(0.0, low)), (1.0 if n_hits == n_samples else min(1.0, high))


# ---- shares of boxes out of samples, where only samples know what can happen


@dataclass(eq=False)
class SampledShares:
    """The share of N sampled contexts, all of which can happen, that a box holds and others do not; never exact."""

    space: Space
    codes: Codes
    """int32 [N, factors]."""
    _taken: NDArray[np.bool_] = field(init=False)
    _n_taken: int = 0

    def __post_init__(self) -> None:
        self._taken = np.zeros(len(self.codes), np.bool_)

    @classmethod
    def of(cls, sampler: Sampler, n_samples: int, rng: np.random.Generator) -> SampledShares:
        """The shares in so many draws."""
        chunks = [codes[sampler.is_possible(codes)] for codes, _ in sampler.random_contexts(n_samples, rng)]
        empty = np.zeros((0, len(sampler.space.factors)), np.int32)
        return cls(sampler.space, np.concatenate([empty, *chunks]))

    def __call__(self, box: Sides, without: Sequence[Sides]) -> tuple[float, bool]:
        """The share; the boxes of `without` may only grow in number from one call to the next, unless there are none."""
        held = self._held(box)
        if without:
            for other in without[self._n_taken :]:
                self._taken |= self._held(other)
            self._n_taken = len(without)
            held = held & ~self._taken
        return (float(held.mean()) if len(held) else 0.0), False

    def _held(self, box: Sides) -> NDArray[np.bool_]:
        flags = np.ones(len(self.codes), np.bool_)
        for f, side in box.items():
            flags &= bitmask.flags_of(side, len(self.space.factors[f].weights))[self.codes[:, f]]
        return flags
