"""Pick one asset out of the valid ones, by the table's policy.

    first               the first valid row of the file
    unique              the only valid row; two at once break the table's promise and raise PolicyError
    collect, priority   of the rows with the highest priority one at random, by row weight, and not the one picked last

Rows of weight 0 are never picked at random. When no row is left, the table's fallback is the answer.
"""

from __future__ import annotations

import random
from typing import TYPE_CHECKING, Protocol
from weakref import WeakKeyDictionary

import numpy as np

from contextdb.errors import Fault, PolicyError, some
from contextdb.matches import Matches

if TYPE_CHECKING:
    from contextdb.compiled import CompiledTable


class Rng(Protocol):
    """What the pick needs of a random generator: `random.Random` and `numpy.random.Generator` both have it."""

    def random(self) -> float:
        """A number in [0, 1)."""
        ...


class Memory:
    """Which asset each random generator picked last, so that no character repeats itself. Forgets generators that are gone."""

    def __init__(self) -> None:
        self._own = random.Random()
        self._last: WeakKeyDictionary[Rng, str] = WeakKeyDictionary()
        self._last_of_others: str | None = None

    def rng(self, given: Rng | int | None) -> Rng:
        """The generator to use: the given one, one seeded with the given number, or the table's own."""
        if given is None:
            return self._own
        return random.Random(given) if isinstance(given, int) else given

    def last(self, rng: Rng) -> str | None:
        """The asset that this generator picked last."""
        try:
            return self._last.get(rng)
        except TypeError:
            return self._last_of_others

    def remember(self, rng: Rng, asset: str) -> None:
        """Keep what this generator picked."""
        try:
            self._last[rng] = asset
        except TypeError:
            self._last_of_others = asset


def pick(compiled: CompiledTable, matches: Matches, rng: Rng | int | None = None, last: str | None = None) -> str | None:
    """One asset of the valid rows.

    Parameters
    ----------
    rng : random.Random, numpy.random.Generator or int, optional
        Where chance comes from; one generator a character, so that each has its own memory. A number seeds a new one: the same
        number, the same pick. Default: the table's own.
    last : str, optional
        The asset not to repeat; default: what this generator picked last in this table.

    Returns
    -------
    str or None
        The asset; the table's fallback when no row is valid, None when it has none.

    Raises
    ------
    PolicyError
        The policy is "unique" and several rows are valid.
    """
    row = pick_row(compiled, matches, rng, last)
    return compiled.fallback if row is None else compiled.assets[row]


def pick_row(compiled: CompiledTable, matches: Matches, rng: Rng | int | None = None, last: str | None = None) -> int | None:
    """The row that `pick` picks, or None."""
    rows = matches.indices
    if not len(rows):
        return None
    if compiled.policy == "unique" and len(rows) > 1:
        raise PolicyError(
            Fault(
                f"{len(rows)} rows are valid at once: {some(matches.assets)}.",
                'one: the table\'s policy is "unique"',
                rule="not-unique",
            )
        )
    if compiled.policy in ("first", "unique"):
        return int(rows[0])
    priorities = compiled.priorities[rows]
    return _weighted(compiled, rows[priorities == priorities.max()].tolist(), rng, last)


def _weighted(compiled: CompiledTable, rows: list[int], rng: Rng | int | None, last: str | None) -> int | None:
    memory = compiled.memory
    source = memory.rng(rng)
    last = memory.last(source) if last is None else last
    rows = [r for r in rows if compiled.row_weights[r] > 0.0]
    fresh = [r for r in rows if compiled.assets[r] != last]
    candidates = fresh or rows
    if not candidates:
        return None
    sums = np.cumsum(compiled.row_weights[candidates])
    at = int(np.searchsorted(sums, source.random() * sums[-1], "right"))
    row = candidates[min(at, len(candidates) - 1)]
    memory.remember(source, compiled.assets[row])
    return row
