"""Gaps: boxes of contexts that have no valid row, as wide as they can be.

A context without a row is widened one condition at a time, those that fewest rows restrict first, so that what stays restricted is
what designers look at. Two ways give such contexts: samples (large gaps come first), and a search for what is in no row and in no
gap found so far, which also proves that there is nothing more. Gaps may overlap; contexts that cannot happen may lie in them.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from contextdb import bitmask
from contextdb.bitmask import Flags
from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.grammar import format_cell, parse_cell
from contextdb.cells.intervals import Span
from contextdb.cells.sets import Cell, NumberSet, TagSet, ValueSet, union
from contextdb.cells.words import quoted
from contextdb.compiled.data import CompiledData
from contextdb.covering.count import Bounds, uncovered_within
from contextdb.covering.factors import TagFactor
from contextdb.covering.numbered import NumberedBoxes
from contextdb.covering.progress import SILENT, Progress
from contextdb.covering.report import Gap, Nearest
from contextdb.covering.space import Box, Sides, Space
from contextdb.covering.witness import BoxSet, OutOfSteps, Point, Steps

Measure = Callable[[Sides, Sequence[Sides]], tuple[float, bool]]
"""Tells which share of the possible contexts is in a box and in none of some others, and whether it is exact."""
SHARE_WORK = 200_000
"""Steps for the share of one gap; one that needs more is the middle of its bounds, and not `is_exact`."""

MOST_NEAR = 256
"""So many rows that change in as few cells are compared by how much these grow."""
ROUNDED = 9
"""Digits to which growths are compared."""


@dataclass(frozen=True)
class Gaps:
    """Maximal boxes without a row, and whether they hold every context that has none."""

    boxes: tuple[Box, ...]
    is_complete: bool


def find_gaps(space: Space, seeds: Iterable[Point], most: int, steps: int, progress: Progress = SILENT) -> Gaps:
    """Gaps round the seeds, then by search, until there are no more, `most` are found, or the steps are used up."""
    rows = space.numbered
    gaps: list[Box] = []
    sides: list[Sides] = []
    for point in seeds:
        if len(gaps) >= most // 2:
            break
        progress.at(len(gaps) / most)
        if not any(all(side >> point[f] & 1 for f, side in box.items()) for box in sides):
            gaps.append(widened(space, rows, point))
            sides.append(space.sides_of(gaps[-1]))
    if not space.is_fitting:
        return Gaps(tuple(gaps), False)
    seen = BoxSet.of(space.full, (*space.boxes, *space.impossible, *gaps), progress)
    left = Steps(steps, progress)
    is_complete = True
    try:
        for point_left in seen.points(space.full, left):
            if len(gaps) >= most:
                is_complete = False
                break
            progress.at(len(gaps) / most)
            gaps.append(widened(space, rows, point_left))
            seen.add(gaps[-1])
    except OutOfSteps:
        is_complete = False
    return Gaps(tuple(gaps), is_complete)


def widened(space: Space, rows: NumberedBoxes, point: Point) -> Box:
    """The widest box round a context that meets no row, one factor after the other, those that fewest rows restrict first."""
    box, order = list(space.full), rows.order
    behind = rows.behind(point, order)
    before = behind[-1]
    for at in range(_n_free(behind), len(order)):
        f, others = order[at], before & behind[at + 1]
        allowed = space.full[f] & ~rows.accepted_by(f, others)
        factor = space.factors[f]
        box[f] = factor.widest(point[f], allowed) if isinstance(factor, TagFactor) else allowed
        before = before & rows.meeting(f, box[f])
    return tuple(box)


def _n_free(behind: Sequence[Flags]) -> int:
    """How many factors, from the first on, may take every class, as no box holds a point's classes of all that come after."""
    return max(0, bisect_left(behind, True, key=np.any) - 1)


def described(
    space: Space,
    compiled: CompiledData,
    boxes: Sequence[Box],
    measure: Measure,
    most: int,
    progress: Progress = SILENT,
) -> list[Gap]:
    """The gaps with their shares of the possible contexts, largest first."""
    sized = []
    for sides in map(space.sides_of, boxes):
        progress.check()
        sized.append((measure(sides, ()), space.cells(sides), sides))
    sized.sort(key=lambda item: (-item[0][0], json.dumps(item[1], ensure_ascii=False)))
    gaps: list[Gap] = []
    earlier: list[Sides] = []
    rows = NearRows(space, compiled)
    for (share, is_exact), cells, sides in sized[:most]:
        progress.at(len(gaps) / min(len(sized), most))
        new_share, is_new_exact = measure(sides, earlier)
        nearest = rows.nearest(sides)
        gaps.append(Gap(gap_id(cells), share, min(share, new_share), cells, nearest, is_exact and is_new_exact))
        earlier.append(sides)
    return gaps


def share_of(space: Space, box: Sides, without: Sequence[Sides], possible: Bounds, work: int) -> tuple[float, bool]:
    """The share of the possible contexts that a box holds and others do not, and whether it is exact or a middle of bounds."""
    volume, whole = space.volume(box), (possible.lower + possible.upper) / 2.0
    if volume == 0.0 or whole == 0.0:
        return 0.0, possible.is_exact or volume == 0.0
    left = uncovered_within(space, without, box, work)
    return min(1.0, volume * (left.lower + left.upper) / 2.0 / whole), left.is_exact and possible.is_exact


def gap_id(cells: dict[str, str]) -> str:
    """A name for a gap that stays the same as long as its cells do."""
    text = json.dumps(sorted(cells.items()), ensure_ascii=False)
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:12]


def most_alike(rows: Sequence[int], assets: Sequence[str]) -> int:
    """Of some rows the one whose asset has most words in common with those of the others; the first of equals."""
    words = [frozenset(re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", asset)) for asset in assets]
    counts = Counter(word for own in words for word in own)
    likeness = [sum(counts[word] for word in own) / max(1, len(own)) for own in words]
    return rows[likeness.index(max(likeness))]


@dataclass(frozen=True, eq=False)
class NearRows:
    """The rows of a table, to be asked which of them is nearest to a gap."""

    space: Space
    compiled: CompiledData

    def nearest(self, gap: Sides) -> Nearest | None:
        """The row that has to change least to hold the gap: the fewest cells; of equal ones those that grow least, then the one
        whose asset is most like the others, then the lowest row; and its cells that change."""
        space, compiled = self.space, self.compiled
        if not space.boxes:
            return None
        failing = {at: self._failing(at, gap) for at in range(len(space.conditions))}
        n_failing = np.zeros(len(space.boxes), np.int64)
        for flags in failing.values():
            n_failing += flags
        near = np.flatnonzero(n_failing == n_failing.min())[:MOST_NEAR].tolist()
        growths = {i: round(self._growth(i, gap, failing), ROUNDED) for i in near}
        least = [i for i in near if growths[i] == min(growths.values())]
        i = most_alike(least, [compiled.assets[space.rows[i]] for i in least])
        row = space.rows[i]
        changes = [at for at, rows in failing.items() if rows[i]]
        cells = [(space.conditions[at].name, self._cell_with(at, row, gap)) for at in changes]
        return Nearest(row, compiled.assets[row], len(changes), *cells[0], tuple(cells[1:])) if cells else None

    def _cell_with(self, at: int, row: int, gap: Sides) -> str:
        cell = self.compiled.cells(at)[int(self.compiled.texts[at].codes[row])]
        return _cell_with(cell, self.space, at, gap)

    def _growth(self, i: int, gap: Sides, failing: Mapping[int, Flags]) -> float:
        """How much the cells of a row grow that come to hold a gap: the shares of their domains, added up."""
        space, box, growth = self.space, self.space.boxes[i], 0.0
        for f in (f for at, rows in failing.items() if rows[i] for f in space.of_condition[at]):
            more = gap.get(f, space.full[f]) & ~box[f]
            growth += float(space.factors[f].weights[bitmask.flags_of(more, len(space.factors[f].weights))].sum())
        return growth

    def _failing(self, at: int, gap: Sides) -> Flags:
        """The rows whose cell of condition number `at` does not hold all of a gap."""
        failing = np.zeros(len(self.space.boxes), np.bool_)
        for f in self.space.of_condition[at]:
            failing |= ~self.space.numbered.holding(f, gap.get(f, self.space.full[f]))
        return failing


EVERY_NUMBER = NumberSet(((-math.inf, math.inf),))


def _cell_with(cell: Cell, space: Space, at: int, gap: Sides) -> str:
    """The cell that holds what it held and the gap's contexts too."""
    more, domain = space.accepted(at, gap), space.conditions[at].domain
    old = cell.accepts
    if more is None or old is None:
        return "Any"
    if isinstance(old, NumberSet) and isinstance(more, NumberSet):
        both = union(old, more)
        return "Any" if both == EVERY_NUMBER else space.written(at, both)
    if isinstance(old, ValueSet) and isinstance(more, ValueSet):
        return _values_joined(old, more, space, at, gap)
    if isinstance(old, TagSet) and isinstance(more, TagSet) and not old.is_complement:
        tags = TagSet(old.needs & more.needs, old.bans & more.bans)
        return format_cell(Cell(tags), domain) if tags.needs | tags.bans else "Any"
    return "Any"


def _values_joined(old: ValueSet, more: ValueSet, space: Space, at: int, gap: Sides) -> str:
    f = space.of_condition[at][0]
    side = space.factors[f].classes(old) | gap[f]
    if side == space.full[f]:
        return "Any"
    return format_cell(Cell(space.factors[f].accepts(side)), space.conditions[at].domain)


# ---- one context out of a box of cells, to try: plain values, as facts are written


def facts_inside(cells: Mapping[str, str], conditions: Sequence[Condition]) -> dict[str, str]:
    """A fact for each condition that the cells restrict, so that all of them hold; the others are left out. Raises CellError where
    a cell cannot be read."""
    facts: dict[str, str] = {}
    for condition in conditions:
        if condition.name in cells:
            fact = _fact(parse_cell(cells[condition.name], condition.domain), condition.domain)
            if fact is not None:
                facts[condition.name] = fact
    return facts


def _fact(cell: Cell, domain: Domain) -> str | None:
    """A value that a cell holds; None where it holds everything or nothing."""
    accepts = cell.accepts
    if accepts is None or accepts.is_empty:
        return None
    if isinstance(accepts, NumberSet):
        return domain.type.spelling.write(_round_number(max(accepts.spans, key=_length), domain))
    return _tags(accepts) if isinstance(accepts, TagSet) else _value(accepts, domain)


def _length(span: Span) -> float:
    return span[1] - span[0]


def _round_number(span: Span, domain: Domain) -> float:
    """The number of fewest digits near the middle of a span; near its end where it has only one."""
    low, high = max(span[0], domain.minimum), min(span[1], domain.maximum)
    if low > high:
        low, high = span
    if math.isinf(low) and math.isinf(high):
        return 0.0
    low, high = (high - 2.0 if math.isinf(low) else low), (low + 2.0 if math.isinf(high) else high)
    middle = low + (high - low) / 2.0
    for digits in range(17):
        if low <= round(middle, digits) <= high:
            return round(middle, digits)
    return middle


def _value(accepts: ValueSet, domain: Domain) -> str:
    known = domain.everything or tuple(sorted(map(str, accepts.values)))
    for value in known:
        if accepts.holds(value):
            return str(value) if domain.type.is_truth else quoted(str(value))
    name = "other"
    while not accepts.holds(name):
        name += "_"
    return name


def _tags(accepts: TagSet) -> str:
    """A set of tags with just those that are needed; one that is banned where only the complement of a ban is requested."""
    tags = sorted(accepts.needs)
    if accepts.is_complement:
        tags = [] if accepts.needs else sorted(accepts.bans)[:1]
    return " ".join(map(quoted, tags)) or '""'
