"""The parts of conditions: each condition's domain cut into a few sets of values, to compare conditions with each other.

A value of a bool, enum or text is a part, of many values those that most rows name, then all others; numbers are cut into eighths
by weight; a tag is there or not.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.cells.grammar import format_cell
from contextdb.cells.sets import Cell, TagSet
from contextdb.covering.factors import TagFactor, ValueFactor
from contextdb.covering.space import Sides, Space

MOST_PARTS = 8
"""A condition has so many parts at most."""


def parts_of(space: Space, at: int) -> list[tuple[str, Sides]]:
    """The parts of a condition: each as a cell, and as classes of its factors."""
    numbers = space.of_condition[at]
    if space.conditions[at].domain.type.is_tags:
        return _tag_parts(space, at)
    f = numbers[0]
    factor = space.factors[f]
    sides = _value_sides(space, f) if isinstance(factor, ValueFactor) else _span_sides(factor.weights)
    return [(space.written(at, factor.accepts(side), is_label=True), {f: side}) for side in sides]


def _value_sides(space: Space, f: int) -> list[int]:
    """Each value; of many those that most rows name, then all others."""
    n = len(space.factors[f].weights)
    if n <= MOST_PARTS:
        return [1 << k for k in range(n)]
    named = np.zeros(n, np.int64)
    for side, n_boxes in Counter(box[f] for box in space.boxes).items():
        if side != space.full[f]:
            named += n_boxes * bitmask.flags_of(side, n)
    chosen = sorted(np.argsort(-named, kind="stable")[: MOST_PARTS - 1].tolist())
    sides = [1 << k for k in chosen]
    return [*sides, space.full[f] & ~sum(sides)]


def _span_sides(weights: NDArray[np.float64]) -> list[int]:
    """Neighbouring spans of numbers; single points go to the span below them, or to the first."""
    wide = np.flatnonzero(weights > 0.0)
    starts = [0, *wide[1:].tolist()]
    if len(wide) > MOST_PARTS:
        middle = np.cumsum(weights)[wide] - weights[wide] / 2.0
        eighth = np.minimum((middle * MOST_PARTS).astype(np.int64), MOST_PARTS - 1)
        starts = [0, *wide[1:][eighth[1:] != eighth[:-1]].tolist()]
    stops = [*starts[1:], len(weights)]
    return [(1 << stop) - (1 << start) for start, stop in zip(starts, stops, strict=True)]


def _tag_parts(space: Space, at: int) -> list[tuple[str, Sides]]:
    """With and without each tag that cells name; of many those that most rows restrict."""
    placed: list[tuple[int, str, Sides, Sides]] = []
    for f in space.of_condition[at]:
        factor = space.factors[f]
        assert isinstance(factor, TagFactor)
        for tag in factor.tags:
            side = factor.classes(TagSet(frozenset((tag,)), frozenset()))
            n_rows = sum(not (box[f] & side and box[f] & ~side) for box in space.boxes)
            placed.append((n_rows, tag, {f: side}, {f: space.full[f] & ~side}))
    placed.sort(key=lambda item: -item[0])
    domain = space.conditions[at].domain
    parts: list[tuple[str, Sides]] = []
    for _, tag, with_it, without in placed[: MOST_PARTS // 2]:
        parts.append((format_cell(Cell(TagSet(frozenset((tag,)), frozenset())), domain), with_it))
        parts.append((format_cell(Cell(TagSet(frozenset(), frozenset((tag,)))), domain), without))
    return [(text, sides) for text, sides in parts if all(sides.values())]
