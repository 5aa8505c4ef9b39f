"""The fewest of some sets that together hold everything: exactly where a search finishes, else by the largest first.

Sets are bits of Python integers. The search takes something that fewest sets hold, and tries each of them; it is cut where so many
things of which no two are in one set are left that it could only be as good as what is known.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from heapq import heapify, heapreplace

from contextdb import bitmask

MOST_SETS = 2_000
"""Of more sets the search is not tried."""
STEPS = 20_000


def fewest(sets: Sequence[int], steps: int = STEPS) -> tuple[list[int], bool]:
    """The numbers of few sets that hold all that any of them holds, ascending, and whether there is no shorter list."""
    wanted = _union(sets)
    candidates = _not_within_others(sets)
    best = _largest_first({i: sets[i] for i in candidates}, wanted)
    if len(candidates) > MOST_SETS:
        return sorted(best), False
    search = _Search({i: sets[i] for i in candidates}, best, steps)
    search.run()
    return sorted(search.best), search.steps > 0


def _union(sets: Sequence[int]) -> int:
    whole = 0
    for one in sets:
        whole |= one
    return whole


def _not_within_others(sets: Sequence[int]) -> list[int]:
    """Of sets of which one holds another the larger one, of equal ones the first."""
    order = sorted(range(len(sets)), key=lambda i: (-sets[i].bit_count(), i))
    larger: list[int] = []
    for i in order:
        if sets[i] and (len(larger) > MOST_SETS or not any(sets[i] & ~sets[j] == 0 for j in larger)):
            larger.append(i)
    return larger


def _largest_first(sets: dict[int, int], wanted: int) -> list[int]:
    """Always the set that holds most of what is left; then without those that the others make needless."""
    chosen: list[int] = []
    queue = [(-one.bit_count(), i) for i, one in sets.items()]  # at least as many as each still holds: sets only become smaller
    heapify(queue)
    while wanted:
        _, i = queue[0]
        now = (-(sets[i] & wanted).bit_count(), i)
        if now > queue[0]:
            heapreplace(queue, now)
            continue
        chosen.append(i)
        wanted &= ~sets[i]
    twice = _held_twice([sets[i] for i in chosen])
    for i in list(chosen):
        if not sets[i] & ~twice:
            chosen.remove(i)
            twice = _held_twice([sets[j] for j in chosen])
    return chosen


def _held_twice(sets: Iterable[int]) -> int:
    """What more than one set holds."""
    once = twice = 0
    for one in sets:
        twice |= once & one
        once |= one
    return twice


class _Search:
    """A search for fewer sets than are known; bits are numbered anew, those in fewest sets first."""

    def __init__(self, sets: dict[int, int], best: list[int], steps: int) -> None:
        self.best, self.steps = best, steps
        holders: dict[int, list[int]] = {}
        for i, one in sets.items():
            for bit in bitmask.rows_of(one):
                holders.setdefault(bit, []).append(i)
        self.holders = sorted(holders.values(), key=len)
        self.sets = dict.fromkeys(sets, 0)
        for bit, held in enumerate(self.holders):
            for i in held:
                self.sets[i] |= 1 << bit
        self.near = [_union([self.sets[i] for i in held]) for held in self.holders]
        """For each bit all that some set holds together with it."""

    def run(self) -> None:
        """`best` becomes shorter where that is possible."""
        self._choose((1 << len(self.holders)) - 1, [])

    def _choose(self, wanted: int, chosen: list[int]) -> None:
        """Choose sets for what is left."""
        if not wanted:
            self.best = list(chosen)
            return
        self.steps -= 1
        if self.steps <= 0 or len(chosen) + self._least(wanted) >= len(self.best):
            return
        held = self.holders[(wanted & -wanted).bit_length() - 1]
        for i in sorted(held, key=lambda i: -(self.sets[i] & wanted).bit_count()):
            self._choose(wanted & ~self.sets[i], [*chosen, i])

    def _least(self, wanted: int) -> int:
        """So many sets are needed at least: one for each of some bits of which no two are in one set."""
        n = 0
        while wanted:
            wanted &= ~self.near[(wanted & -wanted).bit_length() - 1]
            n += 1
        return n
