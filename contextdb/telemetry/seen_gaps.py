"""Gaps that the game was in: recorded contexts without a row, widened to boxes and ranked by their moments."""

from __future__ import annotations

import json
import math
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from contextdb.bitmask import Flags
from contextdb.cells.grammar import parse_cell
from contextdb.compiled.classes import TagMasks, ValueMasks
from contextdb.compiled.data import CompiledData
from contextdb.covering.assumed import Opened
from contextdb.covering.count import Bounds, uncovered_share
from contextdb.covering.engine import SAMPLES, measure_of
from contextdb.covering.factors import Factor, NumberFactor, ValueFactor
from contextdb.covering.gaps import Measure, NearRows, gap_id, widened
from contextdb.covering.report import CoverageReport, Gap
from contextdb.covering.sample import samples_of
from contextdb.covering.space import Box, Sides, Space
from contextdb.telemetry.observed import Observed, SeenGap
from contextdb.telemetry.parts import Part

Points = NDArray[np.int64]
"""A class for each context and factor, -1 where the fact is missing or outside the domain: int64 [N, F]."""
TRIED = 4
"""Boxes that are made for each gap that is named, so that the largest are among them."""


@dataclass(frozen=True, eq=False)
class SeenGaps:
    """The largest gaps, and the moments without a row that no box of the domains holds."""

    gaps: tuple[SeenGap, ...]
    elsewhere: float


def seen_gaps(space: Space, compiled: CompiledData, part: Part, most: int, known: Sequence[Box] = ()) -> SeenGaps:
    """Widen the contexts without a row that lie in no known gap, those of most moments first, until `most` gaps are found.

    Of the known gaps those are named that the game was in.
    """
    points = _points(space, compiled, part)
    is_placed = (points >= 0).all(axis=1)
    counted = int(part.open_moments.sum())
    scale = part.uncovered / counted if counted else 0.0
    elsewhere = int(part.open_moments[~is_placed].sum())
    moments = part.open_moments[is_placed]
    near = NearRows(space, compiled)
    held = [(box, _inside(box, points[is_placed])) for box in dict.fromkeys(known)]
    boxes = [(box, inside) for box, inside in held if inside.any()]
    boxes += _boxes(space, points[is_placed], moments, most * TRIED, boxes)
    ranked = _ranked(space, boxes, points[is_placed], moments)[: most + len(held)]
    gaps, before = [], np.zeros(len(moments), np.bool_)
    for box, inside in ranked:
        n, n_new = int(moments[inside].sum()), int(moments[inside & ~before].sum())
        before |= inside
        sides = space.sides_of(box)
        cells, nearest = space.cells(sides), near.nearest(sides)
        sizes = _scaled(n, scale, part), n * scale / part.moments, n_new * scale / part.moments
        gaps.append(SeenGap(gap_id(cells), *sizes, cells, nearest, part.has_all_open))
    return SeenGaps(tuple(gaps), _scaled(elsewhere, scale, part))


def _scaled(moments: int, scale: float, part: Part) -> float:
    return moments if part.has_all_open else moments * scale


def _boxes(
    space: Space, points: Points, moments: NDArray[np.int64], most: int, known: Sequence[tuple[Box, Flags]]
) -> list[tuple[Box, Flags]]:
    """Boxes round the contexts of most moments that no known one holds, each with the contexts in it."""
    left = np.lexsort((*points.T[::-1], -moments))
    for _, inside in known:
        left = left[~inside[left]]
    boxes: list[tuple[Box, Flags]] = []
    while len(left) and len(boxes) < most:
        box = widened(space, space.numbered, tuple(points[left[0]].tolist()))
        inside = _inside(box, points)
        inside[left[0]] = True
        boxes.append((box, inside))
        left = left[~inside[left]]
    return boxes


def _inside(box: Box, points: Points) -> Flags:
    inside = np.ones(len(points), np.bool_)
    for f, side in enumerate(box):
        held = np.array([side >> k & 1 for k in range(side.bit_length() + 1)], np.bool_)
        inside &= held[np.minimum(points[:, f], len(held) - 1)]
    return inside


def _ranked(
    space: Space, boxes: Sequence[tuple[Box, Flags]], points: Points, moments: NDArray[np.int64]
) -> list[tuple[Box, Flags]]:
    key = [(-int(moments[inside].sum()), json.dumps(space.cells(space.sides_of(box)), ensure_ascii=False)) for box, inside in boxes]
    return [boxes[i] for i in sorted(range(len(boxes)), key=key.__getitem__)]


def _points(space: Space, compiled: CompiledData, part: Part) -> Points:
    """Each context's class in every factor."""
    codes, keys = compiled.codes, part.open_keys
    points = np.full((len(keys), len(space.factors)), -1, np.int64)
    tag = codes.n_codes
    for at, masks in enumerate(compiled.masks):
        numbers = space.of_condition[at]
        if isinstance(masks, TagMasks):
            points[:, list(numbers)] = keys[:, tag : tag + len(numbers)]
            tag += len(numbers)
        else:
            own = keys[:, codes.slots[at].start] - codes.starts[at]
            classes = _classes(masks, space.factors[numbers[0]])
            points[:, numbers[0]] = np.array([*classes, -1], np.int64)[np.clip(own, 0, len(classes))]
    return points


def _classes(masks: object, factor: Factor) -> list[int]:
    """For each class of a column the class of the factor that holds it, or one that no row tells from it; -1: outside."""
    if isinstance(masks, ValueMasks):
        assert isinstance(factor, ValueFactor)
        place = {value: k for k, value in enumerate(factor.values)}
        named = [place.get(value, -1) for value in masks.values]
        return [*named, len(factor.values)] if masks.has_others else named
    assert isinstance(factor, NumberFactor)
    bounds = [float(b) for b in masks.bounds]  # type: ignore[attr-defined]
    return [_span_of(low, stop, factor) for low, stop in zip([-math.inf, *bounds], [*bounds, math.nan], strict=True)]


def _span_of(low: float, stop: float, factor: NumberFactor) -> int:
    """The span that holds the least number of the domain from `low` on, if it is below `stop` (NaN: there is none)."""
    first = max(low, factor.spans[0][0])
    if factor.kind.is_whole and math.isfinite(first):
        first = float(math.ceil(first))
    if first >= stop or first > factor.spans[-1][1]:
        return -1
    return bisect_right([s[0] for s in factor.spans], first) - 1


# ---- one list of gaps: those that coverage found and those that only the recording shows, ranked by the moments in them


def ranked(report: CoverageReport, ready: Opened, seen: Observed, work: int, samples: int | None) -> CoverageReport:
    """The report with each gap's share of the recorded moments, those of most moments first, then the largest.

    `ready` is the table that the report and the recording are of; `seen` was observed with the report's gaps as `known`. Gaps that
    only the recording shows join the list, with their share of the possible contexts; `new_share` is that of the new order. Where
    rules are part of the gaps, which boxes cannot say, the list stays as it is, and gaps get the moments that are known of them.
    """
    moments = {gap.id: gap.share for gap in seen.gaps}
    if ready.ruled is not None and ready.ruled.column is not None:
        return replace(report, gaps=tuple(replace(gap, telemetry=moments.get(gap.id)) for gap in report.gaps))
    known = {gap.id for gap in report.gaps}
    cells = {gap.id: gap.cells for gap in report.gaps} | {gap.id: gap.cells for gap in seen.gaps}
    boxes = {gap_id: box_of(ready.space, own) for gap_id, own in cells.items()}
    listed = [replace(g, telemetry=moments.get(g.id, None if boxes[g.id] is None else 0.0)) for g in report.gaps]
    possible = uncovered_share(ready.space, ready.space.impossible, work) if ready.drawer is None else Bounds(0.0, 1.0)
    measure = measure_of(ready, possible, work, samples_of(samples, SAMPLES, ready.space), report.seed)
    for gap in seen.gaps:
        box = boxes[gap.id]
        if gap.id not in known and box is not None:
            share, is_exact = measure(ready.space.sides_of(box), ())
            listed.append(Gap(gap.id, share, share, gap.cells, gap.nearest, is_exact, gap.share))
    listed.sort(key=lambda gap: (-(gap.telemetry or 0.0), -gap.share, json.dumps(gap.cells, ensure_ascii=False)))
    return replace(report, gaps=tuple(_renewed(ready.space, listed, boxes, measure)))


def _renewed(space: Space, gaps: Sequence[Gap], boxes: Mapping[str, Box | None], measure: Measure) -> list[Gap]:
    """The gaps with what none before them holds."""
    renewed: list[Gap] = []
    earlier: list[Sides] = []
    for gap in gaps:
        box = boxes[gap.id]
        if box is not None:
            sides = space.sides_of(box)
            new_share, is_exact = measure(sides, earlier)
            gap = replace(gap, new_share=min(gap.share, new_share), is_exact=gap.is_exact and is_exact)
            earlier.append(sides)
        renewed.append(gap)
    return renewed


def box_of(space: Space, cells: Mapping[str, str]) -> Box | None:
    """The box that some cells of a gap mean; None where the space cannot say them."""
    domains = {condition.name: condition.domain for condition in space.conditions}
    if not cells.keys() <= domains.keys():
        return None
    box = space.box({name: parse_cell(text, domains[name], wants_mend=False) for name, text in cells.items()})
    return box if box is not None and space.cells(space.sides_of(box)) == cells else None
