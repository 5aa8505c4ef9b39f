"""Which asset each random generator picked last, so that no character repeats itself."""

from __future__ import annotations

import random
import sys
import threading
import weakref
from collections.abc import Callable
from typing import Protocol

import numpy as np

from contextdb.errors import ContextError, Fault

FEW = 1024
"""Up to so many generators that cannot say when they are gone are kept without a look at who is still there."""


class Rng(Protocol):
    """What the pick needs of a random generator: `random.Random` and `numpy.random.Generator` both have it."""

    def random(self) -> float:
        """A number in [0, 1)."""
        ...


class Memory:
    """Which asset each random generator picked last, so that no character repeats itself.

    A generator is known by its identity as long as anybody else holds it: however many there are, none of them is forgotten. One
    that cannot be referred to weakly (numpy's) is held here; when their number has doubled, those that nobody else holds are let
    go.
    `lock` is held from the look at what was last until the new pick is remembered, for threads that share a generator.
    """

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self._own = random.Random()
        self._last: dict[int, tuple[Callable[[], Rng | None], str]] = {}
        """By the id of a generator: what gives it, or None once it is gone, and the asset."""
        self._held: dict[int, Rng] = {}
        """Those that cannot be referred to weakly."""
        self._most = FEW
        """So many are held before it is looked which of them are gone."""

    def __len__(self) -> int:
        return len(self._last)

    def rng(self, given: Rng | int | None) -> Rng:
        """The generator to use: the given one, one seeded with the given number, or the table's own."""
        if given is None:
            return self._own
        if isinstance(given, random.Random):
            return given
        if isinstance(given, (int, np.integer)):
            return random.Random(int(given))
        if isinstance(given, type) or not callable(getattr(given, "random", None)):
            problem = f"rng is of type {type(given).__name__}."
            raise ContextError(Fault(problem, "a random.Random, a numpy.random.Generator, or a number to seed one with"))
        return given

    def last(self, rng: Rng) -> str | None:
        """The asset that this generator picked last."""
        known = self._last.get(id(rng))
        return known[1] if known is not None and known[0]() is rng else None

    def remember(self, rng: Rng, asset: str) -> None:
        key = id(rng)
        known = self._last.get(key)
        if known is not None and known[0]() is rng:
            self._last[key] = known[0], asset
            return
        try:
            self._last[key] = weakref.ref(rng, lambda gone: self._forget(key, gone)), asset
        except TypeError:
            if len(self._held) >= self._most:
                self._let_go()
            self._held[key] = rng
            self._last[key] = lambda: self._held.get(key), asset

    def _forget(self, key: int, gone: object) -> None:
        known = self._last.get(key)
        if known is not None and known[0] is gone:
            del self._last[key]

    def _let_go(self) -> None:
        """Forget the generators that are held here alone."""
        probe = {0: object()}
        alone = sys.getrefcount(probe[0])
        for key in list(self._held):
            if sys.getrefcount(self._held[key]) <= alone:
                del self._held[key], self._last[key]
        self._most = max(FEW, 2 * len(self._held))
