"""Crowded contexts: where most rows are valid at once, as boxes that all of those rows hold.

A context with many valid rows is moved, one factor at a time, to the class that keeps most rows, until no class keeps more. The
rows that are valid there meet in one box. Where the space was gone through whole, the first is the fullest there is; else the best
that samples led to, or met, where rows do not fit into memory. Single points of a domain do not count: two ends that touch are no
crowd.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice
from operator import and_

from contextdb import bitmask
from contextdb.covering.factors import TagFactor
from contextdb.covering.progress import SILENT, Progress
from contextdb.covering.space import Box, Space
from contextdb.covering.witness import BoxSet, Point

MOST_CROWDS = 10
BOXES = 1 << 15
"""So many boxes more make a look at a class twice as long."""
MOST_CLASSES = 1_000_000
"""About so many classes are looked at in one sweep of all contexts together; where boxes are very many, fewer."""
SWEEPS = 20
"""So many times each factor may be moved; it takes two or three."""


@dataclass(frozen=True)
class CrowdBox:
    """Boxes of the space (by number, as bits) and what they share."""

    held_by: int
    box: Box


def find_crowds(space: Space, seeds: Iterable[Point], most: int = MOST_CROWDS, progress: Progress = SILENT) -> list[CrowdBox]:
    """The fullest boxes that climbing from the seeds leads to, most rows first; none lies within the rows of another."""
    rows = BoxSet.of(space.full, space.boxes if space.is_fitting else (), progress)
    impossible = BoxSet.of(space.full, space.impossible, progress)
    crowds: dict[int, Point] = {}
    n_looked_at = sum(len(factor.weights) for factor in space.factors) * (1 + len(space.boxes) // BOXES)
    for point in islice(seeds, max(most, MOST_CLASSES // max(1, n_looked_at))):
        progress.check()
        top = _climbed(space, rows, impossible, point) if space.is_fitting else point
        crowds[_holding(rows, list(top)) if space.is_fitting else space.numbered.bits_at(point)] = top
    chosen: list[int] = []
    for bits in sorted(crowds, key=lambda b: (-b.bit_count(), b)):
        if bits.bit_count() > 1 and not any(bits & ~other == 0 for other in chosen):
            chosen.append(bits)
    return [CrowdBox(bits, _written(space, _shared(space, bits), crowds[bits])) for bits in chosen[:most]]


def _climbed(space: Space, rows: BoxSet, impossible: BoxSet, start: Point) -> Point:
    """The fullest possible context which changes of one factor at a time lead to."""
    point = list(start)
    n_valid = _holding(rows, point).bit_count()
    for _ in range(SWEEPS):
        before = n_valid
        n_valid = _swept(space, rows, impossible, point, n_valid)
        if n_valid == before:
            break
    return tuple(point)


def _swept(space: Space, rows: BoxSet, impossible: BoxSet, point: list[int], n_valid: int) -> int:
    """Move each factor once, to the class with most rows, the present one unless another has more; how many rows there are then."""
    behind, ruled_behind = rows.behind(point), impossible.behind(point)
    before, ruled_before = rows.all, impossible.all
    for f in range(len(point)):
        if rows.restricts[f]:
            others, ruled_out = before & behind[f + 1], ruled_before & ruled_behind[f + 1]
            for k, weight in enumerate(space.factors[f].weights.tolist()):
                n = (others & ~rows.rejects[f][k]).bit_count()
                if n > n_valid and weight > 0.0 and not ruled_out & ~impossible.rejects[f][k]:
                    point[f], n_valid = k, n
        before &= ~rows.rejects[f][point[f]]
        ruled_before &= ~impossible.rejects[f][point[f]]
    return n_valid


def _holding(boxes: BoxSet, point: list[int]) -> int:
    return boxes.behind(point)[0]


def _written(space: Space, box: Box, point: Point) -> Box:
    """The box as cells can say it, around a point: of "not +Move -InAir" the part that one conjunction of tags holds."""
    sides = list(box)
    for f, factor in enumerate(space.factors):
        if isinstance(factor, TagFactor) and factor.classes(factor.accepts(box[f])) != box[f]:
            sides[f] = factor.widest(point[f], box[f])
    return tuple(sides)


def _shared(space: Space, bits: int) -> Box:
    box = space.full
    for i in bitmask.rows_of(bits):
        box = tuple(map(and_, box, space.boxes[i]))
    return box
