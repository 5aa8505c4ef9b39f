"""Random variation among frames that are about equally good, with a memory of what was played.

Only near ties vary: frames that cost at most `within` more than the best. What plays already plays on while it is among them, so
that variation never makes a character flicker.

Source: "RandomVariation" in the settings of EA's diagnostics; reproducible, because the game gives the generator.
"""

from __future__ import annotations

import json
import random
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from contextdb.errors import MotionError
from contextdb.files.settings import Declared, number
from contextdb.motion.search.hit import Hit

Rng: TypeAlias = random.Random | np.random.Generator


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

    def choose(self, ties: Sequence[Hit], recent: Collection[str], rng: Rng) -> Hit:
        """One of some near ties, each equally likely; of the assets played recently only when there is no other."""
        fresh = [hit for hit in ties if hit.asset not in recent]
        among = fresh or list(ties)
        return among[int(rng.random() * len(among))]

    def remember(self, recent: tuple[str, ...], asset: str) -> tuple[str, ...]:
        """The last `memory` assets, the latest of them last."""
        return (*recent, asset)[-self.memory :] if self.memory else ()


def state_of(rng: Rng | None) -> object:
    """Where a generator is, to come back to with `restore`; None for none."""
    if rng is None:
        return None
    return rng.getstate() if isinstance(rng, random.Random) else rng.bit_generator.state


def restore(rng: Rng | None, state: object) -> None:
    """Set a generator to where it, or one of its kind, stood."""
    if rng is None or state is None:
        return
    if isinstance(rng, random.Random):
        rng.setstate(state)  # type: ignore[arg-type]
    else:
        rng.bit_generator.state = state  # type: ignore[assignment]


def packed(recent: tuple[str, ...], rng: Rng) -> bytes:
    """The assets of the last changes and where a generator is."""
    return json.dumps([recent, state_of(rng)], default=np.ndarray.tolist).encode()


def unpacked(data: bytes, rng: Rng | None) -> tuple[str, ...] | None:
    """The assets of the last changes out of `packed`, with the generator set to where it was; None for what was not packed so."""
    if rng is None or not data:
        return None if data else ()
    before = state_of(rng)
    try:
        recent, state = json.loads(data)
        restore(rng, (state[0], tuple(state[1]), state[2]) if isinstance(rng, random.Random) else state)
        return tuple(map(str, recent))
    except (ValueError, TypeError, KeyError, LookupError, OverflowError, RecursionError):
        restore(rng, before)
        return None
