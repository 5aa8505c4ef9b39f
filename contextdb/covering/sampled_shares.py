"""Shares of boxes out of samples, where only samples know what can happen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.covering.sample import Codes, Sampler
from contextdb.covering.space import Sides, Space


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
