"""Questions of yes or no about boxes, answered by search: is there a context in none of them, and which?

Boxes are bits of Python integers: `rejects[f][k]` holds the boxes whose side of factor f does not have class k. The search fixes
one factor at a time. A box with one free factor left decides that factor; of the classes only those are tried that keep fewest
boxes open, as one that keeps open what another does and more can do nothing better. Exact whatever the measure: single points
count.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import compress
from operator import ne

from contextdb import bitmask
from contextdb.covering.progress import SILENT, Progress
from contextdb.covering.space import Box

Point = tuple[int, ...]
FACTORS = 100
"""So many factors more make a step twice as long."""


class OutOfSteps(Exception):
    """The search was not finished within its budget."""


@dataclass
class Steps:
    """How many steps a search has left, and who may stop it between two of them."""

    left: int
    progress: Progress = SILENT

    def take(self, n_free: int = 0) -> None:
        """One step that looks at so many factors, and is more where they are very many. Raises OutOfSteps when there is none left,
        Cancelled when the search was stopped."""
        if self.left <= 0:
            raise OutOfSteps
        self.left -= 1 + n_free // FACTORS
        self.progress.check()


@dataclass(eq=False)
class _Node:
    """A factor that a search has fixed."""

    factor: int
    free: list[int]
    """The factors that were free before, this one among them."""
    open_boxes: int
    known: int
    """The boxes that are open there, of the first so many."""
    n_before: int
    """How many boxes there were when the present class was chosen."""
    left: list[tuple[int, int]]
    """What the classes that are still to be tried keep open, and the classes."""
    searched: set[int] = field(default_factory=set)


@dataclass(eq=False)
class BoxSet:
    """Boxes as bits, to be queried; more can be added."""

    full: Box
    rejects: list[list[int]] = field(default_factory=list)
    """For each factor and class the boxes that do not accept the class."""
    restricts: list[int] = field(default_factory=list)
    """For each factor the boxes that do not accept every class."""
    n_boxes: int = 0

    @classmethod
    def of(cls, full: Box, boxes: Sequence[Box], progress: Progress = SILENT) -> BoxSet:
        """The boxes in their order: bit i is box i."""
        rejects, restricts = [], []
        for f, side_full in enumerate(full):
            progress.check()
            sides: dict[int, list[int]] = {}
            for i, box in enumerate(boxes):
                if box[f] != side_full:
                    sides.setdefault(box[f], []).append(i)
            turns = [0] * (side_full.bit_length() + 1)
            restricted = 0
            for side, members in sides.items():
                bits = bitmask.int_of(members)
                restricted |= bits
                for first, stop in bitmask.runs_of(side):
                    turns[first] ^= bits
                    turns[stop] ^= bits
            own, so_far = [], restricted
            for turn in turns[:-1]:
                so_far ^= turn
                own.append(so_far)
            rejects.append(own)
            restricts.append(restricted)
        return cls(full, rejects, restricts, len(boxes))

    def add(self, box: Box) -> None:
        bit = 1 << self.n_boxes
        self.n_boxes += 1
        for f in compress(range(len(box)), map(ne, box, self.full)):
            self.restricts[f] |= bit
            own = self.rejects[f]
            for first, stop in bitmask.runs_of(self.full[f] & ~box[f]):
                for k in range(first, stop):
                    own[k] |= bit

    @property
    def all(self) -> int:
        return (1 << self.n_boxes) - 1

    def meeting(self, f: int, side: int) -> int:
        """The boxes that share a class of the factor with a side."""
        if side == self.full[f]:
            return self.all
        missed = self.all
        for first, stop in bitmask.runs_of(side):
            for bits in self.rejects[f][first:stop]:
                missed &= bits
        return self.all & ~missed

    def holding(self, f: int, side: int) -> int:
        """The boxes that accept every class of a side of the factor."""
        if side == self.full[f]:
            return self.all & ~self.restricts[f]
        missed = 0
        for first, stop in bitmask.runs_of(side):
            for bits in self.rejects[f][first:stop]:
                missed |= bits
        return self.all & ~missed

    def behind(self, point: Sequence[int], order: Sequence[int] | None = None) -> list[int]:
        """The boxes that accept a point's classes of all factors in an order from each place on; the last are all boxes."""
        order = range(len(point)) if order is None else order
        rows = [self.all]
        for f in reversed(order):
            rows.append(rows[-1] & ~self.rejects[f][point[f]])
        return rows[::-1]

    def outside(self, open_boxes: int, within: Box, steps: Steps) -> Point | None:
        """A context of `within` that is in none of the open boxes, or None when there is none.

        Raises OutOfSteps when the steps, which count down, are used up.
        """
        for f, side in enumerate(within):
            if open_boxes and side != self.full[f]:
                open_boxes &= self.meeting(f, side)
        return next(self._contexts(open_boxes, within, steps), None)

    def hold(self, box: Box, steps: Steps, otherwise: bool) -> bool:
        """Whether every context of a box is in one of these; `otherwise` where the steps are used up before that is known."""
        try:
            return self.outside(self.all, box, steps) is None
        except OutOfSteps:
            return otherwise

    def points(self, within: Box, steps: Steps) -> Iterator[Point]:
        """Contexts of `within` that are in no box, one after the other, until there is none.

        Before the next one is requested, a box that holds the last one must be added. The search continues where it was: what was
        searched once is not searched again. Raises OutOfSteps when the steps, which count down, are used up.
        """
        open_boxes = self.all
        for f, side in enumerate(within):
            if side != self.full[f]:
                open_boxes &= self.meeting(f, side)
        yield from self._contexts(open_boxes, within, steps)

    def _contexts(self, open_boxes: int, within: Box, steps: Steps) -> Iterator[Point]:
        """The contexts of `within` that a search meets, of the factors that it leaves open the first class."""
        firsts = [(side & -side).bit_length() - 1 for side in within]
        for fixed in self._points(open_boxes, within, list(range(len(within))), steps):
            yield tuple(fixed.get(f, first) for f, first in enumerate(firsts))

    def _points(self, open_boxes: int, within: Box, free: list[int], steps: Steps) -> Iterator[dict[int, int]]:
        fixed: dict[int, int] = {}
        path: list[_Node] = []
        known = self.n_boxes
        while True:
            while not (now := self._open_now(open_boxes, known, fixed)):
                yield fixed
            steps.take(len(free))
            factor = self._next_factor(now, within, free)
            if factor is not None:
                path.append(_Node(factor, free, open_boxes, known, self.n_boxes, self._choices(now, factor, within[factor])))
            while path and not self._next_choice(path[-1], within, fixed):
                path.pop()
            if not path:
                return
            node = path[-1]
            open_boxes, k = node.left.pop(0)
            known = node.n_before = self.n_boxes
            free = [f for f in node.free if f != node.factor]
            fixed[node.factor] = k

    def _next_choice(self, node: _Node, within: Box, fixed: dict[int, int]) -> bool:
        """Go on to the next class of a node, one that is worth it after what was added meanwhile; whether there is one."""
        k = fixed.pop(node.factor, None)
        if k is not None:
            node.searched.add(k)
            if self.n_boxes > node.n_before:
                now = self._open_now(node.open_boxes, node.known, fixed)
                choices = self._choices(now, node.factor, within[node.factor], node.searched)
                node.left = [choice for choice in choices if choice[1] not in node.searched]
        return bool(node.left)

    def _open_now(self, open_boxes: int, known: int, fixed: dict[int, int]) -> int:
        """Open boxes, and those of the boxes from number `known` on that hold what is fixed."""
        if known == self.n_boxes:
            return open_boxes
        added = (self.all >> known) << known
        for f, k in fixed.items():
            added &= ~self.rejects[f][k]
        return open_boxes | added

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
        own = self.rejects[factor]
        choices = {open_boxes & ~own[k]: k for k in searched}
        for first, stop in bitmask.runs_of(side):
            for k in range(first, stop):
                choices.setdefault(open_boxes & ~own[k], k)
        ordered = sorted(choices.items(), key=lambda item: (item[0].bit_count(), item[1]))
        best: list[tuple[int, int]] = []
        for bits, k in ordered:
            if not any(fewer & ~bits == 0 for fewer, _ in best):
                best.append((bits, k))
        return best
