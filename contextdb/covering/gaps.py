"""Gaps: boxes of contexts that have no valid row, as wide as they can be.

A context without a row is widened one condition at a time, those that fewest rows restrict first, so that what stays restricted is
what designers look at. Two ways give such contexts: samples (large gaps come first), and a search for what is in no row and in no
gap found so far, which also proves that there is nothing more. Gaps may overlap; contexts that cannot happen may lie in them.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from contextdb.cells import Cell, NumberSet, TagSet, ValueSet, format_cell
from contextdb.compiled import CompiledTable
from contextdb.covering.count import Bounds, uncovered_share
from contextdb.covering.factors import TagFactor
from contextdb.covering.report import Gap, Nearest
from contextdb.covering.space import Box, Space
from contextdb.covering.witness import BoxSet, OutOfSteps, Point
from contextdb.intervals import union

SHARE_WORK = 200_000
"""Row visits for the share of one gap; one that needs more is the middle of its bounds, and not `is_exact`."""


@dataclass(frozen=True)
class FoundGaps:
    """Maximal boxes without a row, and whether they hold every context that has none."""

    boxes: tuple[Box, ...]
    is_complete: bool


def find_gaps(space: Space, seeds: Iterable[Point], most: int, steps: int) -> FoundGaps:
    """Gaps round the seeds, then by search, until there are no more, `most` are found, or the steps are used up."""
    rows = BoxSet.of(space.full, space.boxes)
    seen = BoxSet.of(space.full, space.boxes + space.impossible)
    order = _rarest_first(rows)
    found: list[Box] = []
    for point in seeds:
        if len(found) >= most // 2:
            break
        if not any(all(side >> k & 1 for side, k in zip(box, point, strict=True)) for box in found):
            found.append(_add(seen, widened(space, rows, point, order)))
    left = [steps]
    try:
        while len(found) < most:
            point_left = seen.outside(seen.all, space.full, left)
            if point_left is None:
                return FoundGaps(tuple(found), True)
            found.append(_add(seen, widened(space, rows, point_left, order)))
        is_complete = seen.outside(seen.all, space.full, left) is None
    except OutOfSteps:
        is_complete = False
    return FoundGaps(tuple(found), is_complete)


def widened(space: Space, rows: BoxSet, point: Point, order: Sequence[int]) -> Box:
    """The widest box round a context that meets no row, one factor after the other in the given order."""
    box = [1 << k for k in point]
    meets = [rows.accepts[f][k] for f, k in enumerate(point)]
    for f in order:
        others = rows.all
        for g, bits in enumerate(meets):
            if g != f:
                others &= bits
        allowed = sum(1 << k for k, bits in enumerate(rows.accepts[f]) if not bits & others)
        factor = space.factors[f]
        box[f] = factor.widest(point[f], allowed) if isinstance(factor, TagFactor) else allowed
        meets[f] = rows.meeting(f, box[f])
    return tuple(box)


def _rarest_first(rows: BoxSet) -> list[int]:
    return sorted(range(len(rows.full)), key=lambda f: (rows.restricts[f].bit_count(), -f))


def _add(seen: BoxSet, box: Box) -> Box:
    seen.add(box)
    return box


def described(space: Space, compiled: CompiledTable, found: Sequence[Box], possible: Bounds, most: int, work: int) -> list[Gap]:
    """The gaps with their shares of the possible contexts, largest first."""
    sized = [(_share(space, box, space.impossible, possible, work), space.cells(box), box) for box in found]
    sized.sort(key=lambda item: (-item[0][0], json.dumps(item[1], ensure_ascii=False)))
    gaps: list[Gap] = []
    earlier: list[Box] = []
    for (share, is_exact), cells, box in sized[:most]:
        new_share, is_new_exact = _share(space, box, [*space.impossible, *earlier], possible, work)
        nearest = nearest_row(space, compiled, box)
        gaps.append(Gap(gap_id(cells), share, min(share, new_share), cells, nearest, is_exact and is_new_exact))
        earlier.append(box)
    return gaps


def _share(space: Space, box: Box, without: Sequence[Box], possible: Bounds, work: int) -> tuple[float, bool]:
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


def nearest_row(space: Space, compiled: CompiledTable, gap: Box) -> Nearest | None:
    """The row with fewest cells to change so that it holds the gap, the first of these, and the first cell to change."""
    best: tuple[int, int, int] | None = None
    for i, box in enumerate(space.boxes):
        failing = [at for at, own in enumerate(space.of_condition) if any(gap[f] & ~box[f] for f in own)]
        if best is None or len(failing) < best[0]:
            best = len(failing), i, failing[0]
    if best is None:
        return None
    n_changes, i, at = best
    row, condition = space.rows[i], space.conditions[at]
    now = compiled.cells(at)[int(compiled.texts[at].codes[row])]
    return Nearest(row, compiled.assets[row], n_changes, condition.name, _joined(now, space, at, gap))


def _joined(cell: Cell, space: Space, at: int, gap: Box) -> str:
    """The cell that holds what it held and the gap's contexts too."""
    more, domain = space.accepted(at, gap), space.conditions[at].domain
    old = cell.accepts
    if more is None or old is None:
        return "Any"
    if isinstance(old, NumberSet) and isinstance(more, NumberSet):
        return format_cell(Cell(NumberSet(union([*old.spans, *more.spans]), old.is_circular)), domain)
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
