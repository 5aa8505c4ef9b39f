"""Gaps: boxes of contexts that have no valid row, as wide as they can be.

A context without a row is widened one condition at a time, those that fewest rows restrict first, so that what stays restricted is
what designers look at. Two ways give such contexts: samples (large gaps come first), and a search for what is in no row and in no
gap found so far, which also proves that there is nothing more. Gaps may overlap; contexts that cannot happen may lie in them.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from contextdb import bitmask
from contextdb.cells.grammar import Cell, NumberSet, TagSet, ValueSet, format_cell
from contextdb.cells.intervals import union
from contextdb.compiled.table import CompiledTable
from contextdb.covering.count import Bounds, uncovered_share
from contextdb.covering.factors import TagFactor
from contextdb.covering.progress import SILENT, Progress
from contextdb.covering.report import Gap, Nearest
from contextdb.covering.space import Box, Space
from contextdb.covering.witness import BoxSet, OutOfSteps, Point, Steps

Measure = Callable[[Box, Sequence[Box]], tuple[float, bool]]
"""Tells which share of the possible contexts is in a box and in none of some others, and whether it is exact."""
SHARE_WORK = 200_000
"""Steps for the share of one gap; one that needs more is the middle of its bounds, and not `is_exact`."""


@dataclass(frozen=True)
class FoundGaps:
    """Maximal boxes without a row, and whether they hold every context that has none."""

    boxes: tuple[Box, ...]
    is_complete: bool


def find_gaps(space: Space, seeds: Iterable[Point], most: int, steps: int, progress: Progress = SILENT) -> FoundGaps:
    """Gaps round the seeds, then by search, until there are no more, `most` are found, or the steps are used up."""
    rows = BoxSet.of(space.full, space.boxes, progress)
    seen = BoxSet.of(space.full, space.boxes + space.impossible, progress)
    order = _rarest_first(rows)
    found: list[Box] = []
    for point in seeds:
        if len(found) >= most // 2:
            break
        progress.at(len(found) / most)
        if not any(all(side >> k & 1 for side, k in zip(box, point, strict=True)) for box in found):
            found.append(_add(seen, widened(space, rows, point, order)))
    left = Steps(steps, progress)
    is_complete = True
    try:
        for point_left in seen.points(space.full, left):
            if len(found) >= most:
                is_complete = False
                break
            progress.at(len(found) / most)
            found.append(_add(seen, widened(space, rows, point_left, order)))
    except OutOfSteps:
        is_complete = False
    return FoundGaps(tuple(found), is_complete)


def widened(space: Space, rows: BoxSet, point: Point, order: Sequence[int]) -> Box:
    """The widest box round a context that meets no row, one factor after the other in the given order."""
    box = [1 << k for k in point]
    behind = rows.behind(point, order)
    before = rows.all
    for at, f in enumerate(order):
        others = before & behind[at + 1]
        allowed = sum(1 << k for k, bits in enumerate(rows.accepts[f]) if not bits & others)
        factor = space.factors[f]
        box[f] = factor.widest(point[f], allowed) if isinstance(factor, TagFactor) else allowed
        before &= rows.meeting(f, box[f])
    return tuple(box)


def _rarest_first(rows: BoxSet) -> list[int]:
    return sorted(range(len(rows.full)), key=lambda f: (rows.restricts[f].bit_count(), -f))


def _add(seen: BoxSet, box: Box) -> Box:
    seen.add(box)
    return box


def described(
    space: Space,
    compiled: CompiledTable,
    found: Sequence[Box],
    measure: Measure,
    most: int,
    progress: Progress = SILENT,
) -> list[Gap]:
    """The gaps with their shares of the possible contexts, largest first."""
    sized = []
    for box in found:
        progress.check()
        sized.append((measure(box, ()), space.cells(box), box))
    sized.sort(key=lambda item: (-item[0][0], json.dumps(item[1], ensure_ascii=False)))
    gaps: list[Gap] = []
    earlier: list[Box] = []
    rows = BoxSet.of(space.full, space.boxes, progress)
    for (share, is_exact), cells, box in sized[:most]:
        progress.at(len(gaps) / min(len(sized), most))
        new_share, is_new_exact = measure(box, earlier)
        nearest = nearest_row(space, compiled, rows, box)
        gaps.append(Gap(gap_id(cells), share, min(share, new_share), cells, nearest, is_exact and is_new_exact))
        earlier.append(box)
    return gaps


def share_of(space: Space, box: Box, without: Sequence[Box], possible: Bounds, work: int) -> tuple[float, bool]:
    """The share of the possible contexts that a box holds and others do not, and whether it is exact or a middle of bounds."""
    volume, whole = space.volume(box), (possible.lower + possible.upper) / 2.0
    if volume == 0.0 or whole == 0.0:
        return 0.0, possible.is_exact or volume == 0.0
    left = uncovered_share(space, without, work, box)
    return min(1.0, volume * (left.lower + left.upper) / 2.0 / whole), left.is_exact and possible.is_exact


def gap_id(cells: dict[str, str]) -> str:
    """A name for a gap that stays the same as long as its cells do."""
    text = json.dumps(sorted(cells.items()), ensure_ascii=False)
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:12]


def nearest_row(space: Space, compiled: CompiledTable, rows: BoxSet, gap: Box) -> Nearest | None:
    """The row with fewest cells to change so that it holds the gap, the first of these, and the first cell to change."""
    if not space.boxes:
        return None
    n_failing = np.zeros(len(space.boxes), np.int64)
    failing: list[int] = []
    for own in space.of_condition:
        held = rows.all
        for f in own:
            held &= rows.holding(f, gap[f])
        failing.append(rows.all & ~held)
        n_failing += bitmask.unpack(bitmask.from_int(failing[-1], rows.n_boxes), rows.n_boxes)
    i = int(n_failing.argmin())
    at = next(at for at, bits in enumerate(failing) if bits >> i & 1)
    n_changes, row, condition = int(n_failing[i]), space.rows[i], space.conditions[at]
    now = compiled.cells(at)[int(compiled.texts[at].codes[row])]
    return Nearest(row, compiled.assets[row], n_changes, condition.name, _joined(now, space, at, gap))


def _joined(cell: Cell, space: Space, at: int, gap: Box) -> str:
    """The cell that holds what it held and the gap's contexts too."""
    more, domain = space.accepted(at, gap), space.conditions[at].domain
    old = cell.accepts
    if more is None or old is None:
        return "Any"
    if isinstance(old, NumberSet) and isinstance(more, NumberSet):
        return space.written(at, NumberSet(union([*old.spans, *more.spans]), old.is_circular))
    if isinstance(old, ValueSet) and isinstance(more, ValueSet):
        return _values_joined(old, more, space, at, gap)
    if isinstance(old, TagSet) and isinstance(more, TagSet) and not old.is_complement:
        kept = TagSet(old.needs & more.needs, old.bans & more.bans)
        return format_cell(Cell(kept), domain) if kept.needs | kept.bans else "Any"
    return "Any"


def _values_joined(old: ValueSet, more: ValueSet, space: Space, at: int, gap: Box) -> str:
    f = space.of_condition[at][0]
    side = space.factors[f].classes(old) | gap[f]
    if side == space.full[f]:
        return "Any"
    return format_cell(Cell(space.factors[f].accepts(side)), space.conditions[at].domain)
