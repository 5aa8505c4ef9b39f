"""Random variation among frames that are about equally good, with a memory of what was played.

Only near ties vary: frames that cost at most `within` more than the best. What plays already plays on while it is among them, so
that variation never makes a character flicker. The core draws, see `cdbm_vary` in `contextdb/core/controller.h`: by the seed of a
character and how often it has drawn, which are in its state.

Source: "RandomVariation" in the settings of EA's diagnostics; reproducible, because the game gives the seed.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import blake2b
from typing import TypeAlias

import numpy as np

from contextdb.errors import ContextError, Fault, MotionError
from contextdb.files.settings import Declared, number
from contextdb.motion.clips.quaternions import Floats

Rng: TypeAlias = random.Random | np.random.Generator
MOST_SEED = 1 << 53


@dataclass(frozen=True, slots=True)
class Variation(Declared, error=MotionError):
    """How a frame is chosen among near ties.

    Raises
    ------
    MotionError
        `within` is not a finite number of 0 or more, or `memory` no whole one.
    """

    within: float = number(
        "Frames that cost at most so much more than the best are as good as it.", least=0.0, unit="a cost", such_as=0.05
    )
    memory: int = number(
        "How many of the last assets are not chosen while another is as good.", 1, 0, 1000, "a whole number", 2, is_whole=True
    )


def seed_of(rng: Rng | int | None) -> int:
    """The seed of a character: a number's last 53 bits, or drawn from a generator. Raises ContextError for anything else."""
    if rng is None:
        return 0
    if isinstance(rng, (int, np.integer)):
        return int(rng) % MOST_SEED
    if isinstance(rng, type) or not callable(getattr(rng, "random", None)):
        problem = f"rng is of type {type(rng).__name__}."
        raise ContextError(Fault(problem, "a whole number, or a random.Random or numpy.random.Generator to draw one from"))
    return int(rng.random() * MOST_SEED)


def is_place(rng: object) -> bool:
    """Whether it is a seed and how often chance has decided, or None."""
    if rng is None:
        return True
    return isinstance(rng, tuple) and len(rng) == 2 and all(isinstance(n, int) and 0 <= n < MOST_SEED for n in rng)


def asset_keys(assets: Sequence[str]) -> Floats:
    """The numbers by which characters remember assets, the same in all databases: float64, whole and above 0."""
    hashes = (int.from_bytes(blake2b(asset.encode(errors="surrogatepass"), digest_size=8).digest(), "little") for asset in assets)
    return np.array([float(each >> 11 | 1) for each in hashes])
