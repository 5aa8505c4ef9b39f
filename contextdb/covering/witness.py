"""Questions of yes or no about boxes, answered by search: is there a context in none of them, and which?

Boxes are bits of Python integers: `accepts[f][k]` holds the boxes whose side of factor f has class k. The search fixes one factor
at a time. A box with one free factor left decides that factor; of the classes only those are tried that keep fewest boxes open, as
one that keeps open what another does and more can do nothing better. Exact whatever the measure: single points count.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field

from contextdb.covering.progress import SILENT, Progress
from contextdb.covering.space import Box, runs_of

Point = tuple[int, ...]


class OutOfSteps(Exception):
    """The search was not finished within its budget."""


@dataclass
class Steps:
    """How many steps a search has left, and who may stop it between two of them."""

    left: int
    progress: Progress = SILENT

    def take(self) -> None:
        """One step. Raises OutOfSteps when there is none left, Cancelled when the search was stopped."""
        if self.left <= 0:
            raise OutOfSteps
        self.left -= 1
        self.progress.check()


@dataclass(eq=False)
class BoxSet:
    """Boxes as bits, to be asked; more can be added."""

    full: Box
    accepts: list[list[int]] = field(default_factory=list)
    """For each factor and class the boxes that accept the class."""
    restricts: list[int] = field(default_factory=list)
    """For each factor the boxes that do not accept every class."""
    n_boxes: int = 0

    @classmethod
    def of(cls, full: Box, boxes: Sequence[Box], progress: Progress = SILENT) -> BoxSet:
        """The boxes in their order: bit i is box i."""
        everything = (1 << len(boxes)) - 1
        accepts, restricts = [], []
        for f, side_full in enumerate(full):
            progress.check()
            sides: dict[int, int] = {}
            for i, box in enumerate(boxes):
                if box[f] != side_full:
                    sides[box[f]] = sides.get(box[f], 0) | 1 << i
            turns = [0] * (side_full.bit_length() + 1)
            for side, bits in sides.items():
                for first, stop in runs_of(side):
                    turns[first] ^= bits
                    turns[stop] ^= bits
            restricted = sum(sides.values())
            own, so_far = [], everything & ~restricted
            for turn in turns[:-1]:
                so_far ^= turn
                own.append(so_far)
            accepts.append(own)
            restricts.append(restricted)
        return cls(full, accepts, restricts, len(boxes))

    def add(self, box: Box) -> None:
        """One more box, with the next bit."""
        bit = 1 << self.n_boxes
        self.n_boxes += 1
        for f, side in enumerate(box):
            if side != self.full[f]:
                self.restricts[f] |= bit
            own = self.accepts[f]
            for first, stop in runs_of(side):
                for k in range(first, stop):
                    own[k] |= bit

    @property
    def all(self) -> int:
        """Every box."""
        return (1 << self.n_boxes) - 1

    def meeting(self, f: int, side: int) -> int:
        """The boxes that share a class of the factor with a side."""
        if side == self.full[f]:
            return self.all
        found = 0
        for first, stop in runs_of(side):
            for bits in self.accepts[f][first:stop]:
                found |= bits
        return found

    def holding(self, f: int, side: int) -> int:
        """The boxes that accept every class of a side of the factor."""
        if side == self.full[f]:
            return self.all & ~self.restricts[f]
        found = self.all
        for first, stop in runs_of(side):
            for bits in self.accepts[f][first:stop]:
                found &= bits
        return found

    def outside(self, open_boxes: int, within: Box, steps: Steps) -> Point | None:
        """A context of `within` that is in none of the open boxes, or None when there is none.

        Raises OutOfSteps when the steps, which count down, are used up.
        """
        for f, side in enumerate(within):
            if open_boxes and side != self.full[f]:
                open_boxes &= self.meeting(f, side)
        point = self._search(open_boxes, within, list(range(len(within))), steps)
        return None if point is None else tuple(point.get(f, _first(side)) for f, side in enumerate(within))

    def points(self, within: Box, steps: Steps) -> Iterator[Point]:
        """Contexts of `within` that are in no box, one after the other, until there is none.

        Before the next one is asked for, a box that holds the last one must be added. The search goes on where it was: what was
        searched once is not searched again. Raises OutOfSteps when the steps, which count down, are used up.
        """
        open_boxes = self.all
        for f, side in enumerate(within):
            if side != self.full[f]:
                open_boxes &= self.meeting(f, side)
        for point in self._points(open_boxes, {}, within, list(range(len(within))), steps):
            yield tuple(point.get(f, _first(side)) for f, side in enumerate(within))

    def _points(
        self, open_boxes: int, fixed: dict[int, int], within: Box, free: list[int], steps: Steps
    ) -> Iterator[dict[int, int]]:
        known = self.n_boxes
        while not (now := self._open_now(open_boxes, known, fixed)):
            yield fixed
        steps.take()
        factor = self._next_factor(now, within, free)
        if factor is None:
            return
        rest = [f for f in free if f != factor]
        searched: set[int] = set()
        left = self._choices(now, factor, within[factor])
        while left:
            bits, k = left.pop(0)
            n_before = self.n_boxes
            yield from self._points(bits, fixed | {factor: k}, within, rest, steps)
            searched.add(k)
            if self.n_boxes > n_before:
                now = self._open_now(open_boxes, known, fixed)
                choices = self._choices(now, factor, within[factor], searched)
                left = [choice for choice in choices if choice[1] not in searched]

    def _open_now(self, open_boxes: int, known: int, fixed: dict[int, int]) -> int:
        """Open boxes, and those of the boxes from number `known` on that hold what is fixed."""
        added = (self.all >> known) << known
        for f, k in fixed.items():
            added &= self.accepts[f][k]
        return open_boxes | added

    def _search(self, open_boxes: int, within: Box, free: list[int], steps: Steps) -> dict[int, int] | None:
        if not open_boxes:
            return {}
        steps.take()
        factor = self._next_factor(open_boxes, within, free)
        if factor is None:
            return None
        rest = [f for f in free if f != factor]
        for kept, k in self._choices(open_boxes, factor, within[factor]):
            found = self._search(kept, within, rest, steps)
            if found is not None:
                found[factor] = k
                return found
        return None

    def _next_factor(self, open_boxes: int, within: Box, free: list[int]) -> int | None:
        """The factor to fix: of a box that has only that one left, else the one that most boxes restrict; None when some box has
        none left, so that it holds everything."""
        once = twice = 0
        best, most = None, -1
        limits: list[tuple[int, int]] = []
        for f in free:
            limited = self.restricts[f] & open_boxes
            if not limited:
                continue
            if within[f] != self.full[f]:
                limited &= ~self.holding(f, within[f])
            twice |= once & limited
            once |= limited
            limits.append((f, limited))
            if (n := limited.bit_count()) > most:
                best, most = f, n
        if open_boxes & ~once:
            return None
        if single := once & ~twice:
            return max(limits, key=lambda item: (item[1] & single).bit_count())[0]
        return best

    def _choices(self, open_boxes: int, factor: int, side: int, searched: Collection[int] = ()) -> list[tuple[int, int]]:
        """What each class that is worth trying keeps open, and the class: fewest first. Of equal classes a searched one counts."""
        own = self.accepts[factor]
        kept = {own[k] & open_boxes: k for k in searched}
        for first, stop in runs_of(side):
            for k in range(first, stop):
                kept.setdefault(own[k] & open_boxes, k)
        ordered = sorted(kept.items(), key=lambda item: (item[0].bit_count(), item[1]))
        best: list[tuple[int, int]] = []
        for bits, k in ordered:
            if not any(fewer & ~bits == 0 for fewer, _ in best):
                best.append((bits, k))
        return best


def _first(side: int) -> int:
    return (side & -side).bit_length() - 1
