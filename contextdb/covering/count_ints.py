"""The count of `count_kernels` for where numba is not installed: the same steps and bytes, a set of boxes in one integer.

What numba goes through word by word is one operation here. Whole weights (`count`) make sums exact in whatever order, so groups of
classes need not be made again for fewer boxes, and a part within a box shares most of its factors with the part around it. Sizes
are multiplied in the order of the factors, and measures are added in the order of the boxes, as there.
"""

from __future__ import annotations

from math import log2
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.covering import count_kernels
from contextdb.covering.progress import Progress

Array = NDArray[Any]
Shares = tuple[float, float]
Open = tuple[int, float, int]
"""A box, its measure, and its hashes, stirred: the first LANE bits up, the second below."""
WORD, LANE = (1 << 64) - 1, 96
GOLDEN = 0x9E3779B97F4A7C15
MOST_KEPT = 100_000
"""So many factors within boxes, and stirred hashes, are kept."""
ASK_EVERY = 20_000
"""Progress is asked after so many steps."""


class Base:
    """Some boxes of a table, numbered from 0, and what their factors are within other boxes."""

    def __init__(self, boxes: list[int], cells: list[list[int]], hashes: list[list[int]]) -> None:
        self.boxes, self.cells, self.hashes = boxes, cells, hashes
        self.all = (1 << len(boxes)) - 1
        self.within: dict[tuple[int, int, int], Factor] = {}


class Factor(dict[int, tuple[int, int, float, int]]):
    """A factor: groups of classes with the boxes that accept them and what they weigh; for each box, when asked, those that accept
    all that it accepts, those that accept some of it, the share that it accepts, and its mark."""

    __slots__ = ("base", "free", "groups", "limits", "number", "of_cell", "salt", "total")

    def __init__(self, base: Base, number: int, groups: list[tuple[int, float]], salt: int) -> None:
        self.base, self.number, self.groups, self.salt = base, number, groups, salt
        everywhere, somewhere, total = base.all, 0, 0.0
        for boxes, weight in groups:
            everywhere &= boxes
            somewhere |= boxes
            total += weight
        self.limits, self.total = base.all & ~everywhere, total
        self.free = everywhere, somewhere, 1.0, 0  # of a box that accepts everything
        self.of_cell: dict[int, tuple[int, int, float, int]] = {}  # boxes of one cell share what is known of them

    def __missing__(self, box: int) -> tuple[int, int, float, int]:
        bit, around, meets, size = 1 << box, -1, 0, 0.0
        if not self.limits & bit:
            self[box] = self.free
            return self.free
        cell = self.base.cells[self.number][self.base.boxes[box]]
        if cell in self.of_cell:
            self[box] = self.of_cell[cell]
            return self[box]
        for boxes, weight in self.groups:
            if boxes & bit:
                around &= boxes
                meets |= boxes
                size += weight
        first, second = self.base.hashes[cell]
        mark = mixed(first ^ self.salt) << 64 | mixed(second + self.salt & WORD)
        self[box] = self.of_cell[cell] = found = around, meets, size / self.total, mark
        return found

    def inside(self, box: int) -> Factor:
        base = self.base
        cell = base.cells[self.number][base.boxes[box]]
        known = base.within.get((self.number, self.salt, cell))
        if known is None:
            if len(base.within) >= MOST_KEPT:
                base.within.clear()
            salt, bit = self.salt + mixed(base.hashes[cell][0]) & WORD, 1 << box
            known = Factor(base, self.number, [group for group in self.groups if group[0] & bit], salt)
            base.within[self.number, self.salt, cell] = known
        return known

    def of(self, base: Base, places: list[int], boxes: int) -> Factor:
        """The factor of fewer boxes, which get numbers of their own."""
        merged: dict[int, float] = {}
        for group, weight in self.groups:
            group &= boxes
            merged[group] = merged.get(group, 0.0) + weight
        renumbered = [
            (sum([1 << i for i, place in enumerate(places) if group >> place & 1]), weight) for group, weight in merged.items()
        ]
        return Factor(base, self.number, renumbered, self.salt)


def factors_of(part: tuple[Array, ...], cells: list[list[int]], hashes: list[list[int]]) -> tuple[int, list[Factor]]:
    """All boxes of a part, and its factors; `cells` are those of each factor, and `hashes` those of cells."""
    numbers, _, groups, masses, starts, _, _, _, _, boxes = part
    base = Base(boxes.tolist(), cells, hashes)
    own = list(zip(map(bitmask.to_int, groups), masses.tolist(), strict=True))
    first = starts.tolist()
    return base.all, [Factor(base, f, own[first[x] : first[x + 1]], 0) for x, f in enumerate(numbers.tolist())]


class Part:
    """Some boxes of a base, in so many words each where numba counts."""

    def __init__(self, boxes: int) -> None:
        self.boxes, self.n_words = boxes, boxes.bit_count() + 63 >> 6
        self._n_groups: dict[int, int] = {}

    def n_groups(self, factor: Factor) -> int:
        """How many groups of classes of a factor its boxes tell apart."""
        if len(factor.groups) == 2:
            return 2
        if factor.number not in self._n_groups:
            self._n_groups[factor.number] = len({group & self.boxes for group, _ in factor.groups})
        return self._n_groups[factor.number]


class Count:
    """A count of the contexts that none of some boxes holds; `work` steps are done, and some parts may be `cut` short."""

    def __init__(self, part: tuple[Array, ...], table: tuple[Array, ...], n_known: int, depth: int, progress: Progress) -> None:
        self.boxes, self.factors = factors_of(part, table[0].T.tolist(), table[3].tolist())
        self.depth, self.progress = depth, progress
        self.deepest_alone = max(count_kernels.LEAST_DEPTH, depth - 4 * len(self.factors))
        self.keys: list[Any] = [np.zeros(n_known, np.uint64).data for _ in range(2)]
        self.bounds: list[Any] = [np.zeros(n_known).data for _ in range(2)]
        self.stirred: dict[int, int] = {}
        self.work = self.limit = self.most = self.cut = self.asked = 0
        self.is_shared = False

    def run(self, limit: int, most: int, is_shared: bool) -> Shares:
        """Bounds of the share within so many steps, of the most that there will be."""
        self.limit, self.most, self.is_shared, self.cut = limit, most, is_shared, 0
        return self._uncovered(Part(self.boxes), 0, len(self.factors), self.boxes, self.factors)

    def _uncovered(self, part: Part, depth: int, n_listed: int, opened: int, listed: list[Factor]) -> Shares:
        """As `count_kernels.uncovered`: what the open boxes leave, of which some of the listed factors are restricted."""
        self.work += 2 + (n_listed * part.n_words >> 4)
        once, own, limits = 0, [], []
        for factor in listed:
            limited = factor.limits & opened
            if limited:
                once |= limited
                own.append(factor)
                limits.append(limited)
        if opened != once:
            return 0.0, 0.0
        if not opened:
            return 1.0, 1.0
        boxes = numbers_of(opened)
        if len(boxes) > 1:
            left = without_inner(opened, boxes, own)
            if left != opened:
                opened, boxes = left, numbers_of(left)
                own = [factor for factor in own if factor.limits & left]
                limits = [factor.limits & left for factor in own]
        stirred = self.stirred
        if len(stirred) >= MOST_KEPT:
            stirred.clear()
        measured = []
        for box in boxes:
            size, hashes = 1.0, 0
            for factor in own:
                _, _, share, mark = factor[box]
                if mark:
                    size *= share
                    hashes ^= mark
            stir = stirred.get(hashes)
            if stir is None:
                stir = stirred[hashes] = mixed(hashes >> 64) << LANE | mixed((hashes & WORD) ^ GOLDEN)
            measured.append((box, size, stir))
        return self._left(part, depth, opened, measured, own, limits)

    def _left(self, part: Part, depth: int, opened: int, boxes: list[Open], own: list[Factor], limits: list[int]) -> Shares:
        """The same, where none of the boxes lies within another: their measures are known, and which of them each factor limits."""
        m, total, largest, key = len(boxes), 0.0, 0.0, 0
        self.work += m * part.n_words >> 2
        for _, size, stir in boxes:
            total += size
            largest = size if size > largest else largest
            key += stir
        low, high = max(0.0, 1.0 - total), 1.0 - largest
        if m == 1:
            return high, high
        key1, key2 = (key >> LANE) & WORD | 1, key & WORD
        at, is_known = self._slot(key1, key2)
        if is_known:
            low, high = max(low, self.bounds[0][at]), min(high, self.bounds[1][at])
            if high - low <= count_kernels.SAME:
                return min(low, high), high
        if self.work >= self.limit or depth >= self.depth - count_kernels.ROOM:
            self.cut += 1
            return low, high
        kept = hanging_together(limits)
        if kept != opened:
            return self._product(part, depth + 1, kept, opened ^ kept, boxes, own, limits)
        self.work += count_kernels.PER_NODE + (m >> 1)
        if self.work >= self.asked:
            self.asked = self.work + ASK_EVERY
            self.progress.at(self.work / max(1, self.most))
        if m >= (count_kernels.FEW if total <= count_kernels.SMALL_SUM else count_kernels.MANY) and depth < self.deepest_alone:
            found_low, found_high = self._one_after_the_other(part, depth + 2, boxes, own)
        elif part.n_words > 1 and m <= count_kernels.DENSE * part.n_words:
            self.work += m * len(own) >> 2
            less, factors = renumbered(part, opened, own)
            found_low, found_high = self._uncovered(less, depth + 2, len(factors), less.boxes, factors)
        else:
            found_low, found_high = self._fixed(part, depth + 1, opened, own, limits)
        low, high = max(low, found_low), min(high, found_high)
        low = min(low, high)
        self.keys[0][at], self.keys[1][at] = key1, key2
        self.bounds[0][at], self.bounds[1][at] = low, high
        return low, high

    def _slot(self, key1: int, key2: int) -> tuple[int, bool]:
        """Where a part is remembered, or may be, and whether it is."""
        firsts, seconds = self.keys
        last = len(firsts) - 1
        home = at = key1 >> 1 & last
        for _ in range(count_kernels.PROBES):
            first = firsts[at]
            if first == key1 and seconds[at] == key2:
                return at, True
            if not first:
                return at, False
            at = at + 1 & last
        return home, False

    def _product(
        self, part: Part, depth: int, kept: int, rest: int, boxes: list[Open], own: list[Factor], limits: list[int]
    ) -> Shares:
        """The product of what two sets of boxes leave that share no factor."""
        found_low = found_high = 1.0
        listing = 2 + (len(own) * part.n_words >> 4)
        for opened in (kept, rest):
            self.work += listing
            held = [box for box in boxes if opened >> box[0] & 1]
            if len(held) == 1:  # as `_left` would do
                self.work += part.n_words >> 2
                low = high = 1.0 - held[0][1]
            else:
                pairs = [(factor, here) for factor, limited in zip(own, limits, strict=True) if (here := limited & opened)]
                low, high = self._left(part, depth, opened, held, [factor for factor, _ in pairs], [here for _, here in pairs])
            if opened == kept and high == 0.0:
                return 0.0, 0.0
            found_low, found_high = found_low * low, found_high * high
        return found_low, found_high

    def _one_after_the_other(self, part: Part, depth: int, boxes: list[Open], own: list[Factor]) -> Shares:
        """What the boxes leave that are taken one after the other, the largest first."""
        m, n = len(boxes), len(own)
        low, high, before = 0.0, 0.0, 0
        ordered = sorted(boxes, key=lambda box: -box[1])
        for t, (box, size, _) in enumerate(ordered):
            is_over = self.work >= self.limit
            if is_over or 1.0 - low <= m * count_kernels.EPSILON:
                self.cut += is_over
                others = 0.0
                for _, other, _ in ordered[t:]:
                    others += other
                high = min(1.0, high + others)
                break
            met, bit = before, 1 << box
            for factor in own:
                if factor.limits & bit:
                    met &= factor[box][1]
            before |= bit
            self.work += 2 + (m >> 5) + (n * part.n_words >> 5)
            a = b = 1.0
            if met:
                a, b = self._within(part, depth, box, met, own, m - t)
            low += size * a
            high += size * b
        low, high = 1.0 - high, 1.0 - low
        if low < 1e-3:
            low, high = max(0.0, low - m * count_kernels.EPSILON), max(0.0, high) + m * count_kernels.EPSILON
        return low, high

    def _within(self, part: Part, depth: int, box: int, met: int, own: list[Factor], n_shares: int) -> Shares:
        """What some boxes leave of another, which may take its share of the steps that are left."""
        bit = 1 << box
        inside = [factor.inside(box) if factor.limits & bit else factor for factor in own]
        less, factors = renumbered(part, met, [factor for factor in inside if factor.limits & met])
        self.work += met.bit_count() * len(own) >> 1
        limit = self.limit
        if self.is_shared:
            self.limit = min(limit, self.work + 2 * (limit - self.work) // n_shares)
        found = self._uncovered(less, depth, len(factors), less.boxes, factors)
        self.limit = limit
        return found

    def _fixed(self, part: Part, depth: int, opened: int, own: list[Factor], limits: list[int]) -> Shares:
        """What is left when one factor is fixed, to each group of classes in turn."""
        best, chosen = chosen_groups(part, opened, own, limits)
        listed = [*own[:best], *own[best + 1 :]]
        self.work += len(chosen) * part.n_words >> 2
        low, high = 0.0, 0.0
        zeros: list[int] = []
        for group, weight in chosen:
            if any(not zero & ~group for zero in zeros):
                continue
            share = weight / own[best].total
            a, b = self._uncovered(part, depth, len(listed), group, listed)
            low += share * a
            high += share * b
            if b == 0.0:
                zeros.append(group)
        return low, high


def chosen_groups(
    part: Part, opened: int, own: list[Factor], limits: list[int], first: float = 0.0
) -> tuple[int, list[tuple[int, float]]]:
    """The place of the factor that most boxes restrict, fewer where it has more groups; and its groups as the open boxes tell them
    apart with what they weigh, those that fewest accept first, but for those that leave nothing open. A factor that is the last of
    a box counts `first` more."""
    once, twice, best, most = 0, 0, 0, -1.0
    for limited in limits:
        twice |= once & limited
        once |= limited
    for x, limited in enumerate(limits):
        n_limited = limited.bit_count()
        n_groups = n_limited + 1 if n_limited == 1 else min(part.n_groups(own[x]), n_limited + 1)
        score = n_limited / log2(1.0 + n_groups) + (first if limited & ~twice else 0.0)
        if score > most:
            best, most = x, score
    alone = limits[best] & ~twice
    found: dict[int, float] = {}
    for group, weight in own[best].groups:
        if not group & alone:
            group &= opened
            found[group] = found.get(group, 0.0) + weight
    return best, sorted(found.items(), key=lambda item: item[0].bit_count())


def without_inner(opened: int, boxes: list[int], own: list[Factor]) -> int:
    """The open boxes without those that lie within others; of equal ones the last stays open."""
    for box in boxes:
        bit = 1 << box
        around = opened ^ bit
        for factor in own:
            around &= factor[box][0]
            if not around:
                break
        else:
            opened ^= bit
    return opened


def hanging_together(limits: list[int]) -> int:
    """The boxes that hang together with those which the first factor limits."""
    kept, grows = limits[0], True
    while grows:
        grows = False
        for limited in limits:
            if limited & kept and limited & ~kept:
                kept |= limited
                grows = True
    return kept


def renumbered(part: Part, boxes: int, factors: list[Factor]) -> tuple[Part, list[Factor]]:
    """The part of fewer boxes; where they need fewer words, they get numbers of their own."""
    less = Part(boxes)
    if less.n_words == part.n_words or not factors:
        return less, factors
    old, places = factors[0].base, numbers_of(boxes)
    base = Base([old.boxes[place] for place in places], old.cells, old.hashes)
    less.boxes = base.all
    return less, [factor.of(base, places, boxes) for factor in factors]


def numbers_of(bits: int) -> list[int]:
    """The numbers of the bits that are set, ascending."""
    found = []
    while bits:
        low = bits & -bits
        found.append(low.bit_length() - 1)
        bits ^= low
    return found


def mixed(x: int) -> int:
    """As `kernels.mixed`."""
    x ^= x >> 33
    x = x * 0xFF51AFD7ED558CCD & WORD
    x ^= x >> 33
    x = x * 0xC4CEB9FE1A85EC53 & WORD
    return x ^ x >> 33
