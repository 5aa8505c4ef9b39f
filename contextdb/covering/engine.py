"""Context coverage: which share of the contexts has a valid row, which have none, and what is wrong with rows.

One call asks four engines: a counter for the share (`count`), samples where it does not finish and for overlap (`sample`), a search
for gaps (`gaps`) and one for findings (`judge`). Budgets count steps, never time.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import islice
from operator import and_

import numpy as np

from contextdb import bitmask
from contextdb.cells.arguments import require_callable
from contextdb.compiled.table import CompiledTable
from contextdb.covering.assumed import Opened, opened
from contextdb.covering.count import Bounds, left_open, uncovered_share
from contextdb.covering.factors import TagFactor
from contextdb.covering.gaps import SHARE_WORK, Gaps, Measure, described, find_gaps, share_of
from contextdb.covering.judge import Judge
from contextdb.covering.progress import SILENT, Progress, Stops, Tell
from contextdb.covering.report import CoverageReport, Crowd, Gap, Method, Overlap, wilson
from contextdb.covering.sample import LITTLE, Counts, SampledShares, Sampler, samples_of
from contextdb.covering.space import Box, CellBox, Space, WeightsOf, comparable_rows, require_counts
from contextdb.covering.witness import BoxSet, Point
from contextdb.tables.table import EitherTable

WORK = 40_000_000
SAMPLES = 200_000
MOST_GAPS = 200
COUNT_AT, SAMPLES_AT, GAPS_AT, SHARES_AT, FINDINGS_AT, CROWDS_AT = 0.02, 0.4, 0.48, 0.6, 0.75, 0.97
"""Where the parts of the work begin, for a bar of progress."""


@dataclass(frozen=True, slots=True)
class Covered:
    """The covered share and how it is known, as in `CoverageReport`."""

    value: float
    lower: float
    upper: float
    method: Method


def coverage(
    table: EitherTable | CompiledTable,
    *,
    seed: int = 0,
    work: int = WORK,
    samples: int | None = None,
    max_gaps: int = MOST_GAPS,
    impossible: Sequence[CellBox] = (),
    weights: WeightsOf | None = None,
    assume: bool = True,
    progress: Tell | None = None,
    should_stop: Stops | None = None,
) -> CoverageReport:
    """Compute which contexts have a valid row.

    Parameters
    ----------
    table : Table or CompiledTable
        Findings of a Table have lines, and include rows that are written alike; a CompiledTable has no assumptions.
    seed : int
        Where samples start; the same input and seed give the same report.
    work : int
        Steps of the exact count, and in proportion of the searches for gaps and findings. 0: bounds only.
    samples : int, optional
        Random contexts, for the estimate where the count is not finished and for overlap; 0: none. The report says how many there
        were. Default: 200,000, and of a table of more than 500 conditions as many fewer as it has more.
    max_gaps : int
        The report names at most this many gaps, the largest.
    impossible : sequence of mapping of str to Cell or cell text
        Contexts that cannot occur, as boxes, besides those that the table's own `assume` excludes: no share counts them.
    weights : mapping of str to mapping of value or cell text to float, optional
        For some conditions, how often their values occur, in any unit; a cell's weight is spread over it. Default: all values
        alike, numbers by length.
    assume : bool
        False ignores what contextdb.toml says about contexts: the `assume` of the table, and how derived facts are computed.
    progress : callable of (str, float), optional
        Called with what is being worked out and which share of the whole is done; the report is the same without it.
    should_stop : callable that gives bool, optional
        Called often, from the thread of the call; True ends the call with Cancelled.

    Raises
    ------
    ExpressionError
        An assumption of the table cannot be read.
    TableError
        The table has cells that cannot be read, or a condition whose domain is empty.
    ContextError, CellError
        `impossible` or `weights` name what is missing.
    Cancelled
        `should_stop` said so.

    Notes
    -----
    Assumptions that boxes can tell are exact. One that computes with facts or compares them, and derived facts that are not bools
    of other conditions of the table, are known to samples only: the share is then an estimate, a gap's share is that of the samples
    in it, and gaps without a sample that can happen are left out.
    """
    require_counts(work=work, samples=SAMPLES if samples is None else samples, max_gaps=max_gaps, seed=seed)
    require_callable(progress, "progress")
    require_callable(should_stop, "should_stop")
    watcher = Progress(progress, should_stop)
    drawn = opened(table, impossible, weights, assume, watcher.within("Reading the cells", 0.0, COUNT_AT), "any")
    report = _report(drawn, seed, work, samples, max_gaps, watcher)
    return report if drawn.ruled is None else drawn.ruled.with_rules(report)


@dataclass(frozen=True, slots=True)
class Counted:
    """The covered share of a table's contexts, and the gaps; what it takes to say more of them."""

    possible: Bounds
    left: Bounds
    certain: Bounds
    is_whole: bool
    """Whether every context was looked at."""
    counts: Counts
    covered: Covered
    gap_boxes: Gaps
    gaps: list[Gap]
    measure: Measure


def counted(opened: Opened, seed: int, work: int, max_samples: int | None, max_gaps: int, watcher: Progress = SILENT) -> Counted:
    """The covered share of an opened table, and its gaps; the arguments are those of `coverage`."""
    space, compiled, drawer = opened.space, opened.compiled, opened.drawer
    samples = samples_of(max_samples, SAMPLES, space)
    possible = uncovered_share(space, space.impossible, work, watcher.within("Counting contexts", COUNT_AT, COUNT_AT))
    left = left_open(space, work, watcher.within("Counting contexts", COUNT_AT, SAMPLES_AT))
    sampler = Sampler(space, watcher.within("Trying random contexts", SAMPLES_AT, GAPS_AT), drawer)
    rng = np.random.default_rng(seed)
    whole = sampler.all_contexts()
    if whole is not None and not space.is_fitting:
        left = Bounds(float(whole.histogram[0]), float(whole.histogram[0]))
    counts = whole or sampler.sampled(samples, rng)
    certain = _certain(space, possible, left, drawer is not None)
    covered = _covered(certain, counts, whole is None, sampler, possible, rng, samples)
    steps = search_steps(work, len(space.boxes))
    searching = watcher.within("Looking for gaps", GAPS_AT, SHARES_AT)
    gap_boxes = find_gaps(space, () if whole and space.is_fitting else counts.uncovered, 4 * max_gaps + 1, steps, searching)
    sizing = watcher.within("Measuring gaps", SHARES_AT, FINDINGS_AT)
    measure = measure_of(opened, possible, work, samples, seed)
    gaps = described(space, compiled, gap_boxes.boxes, measure, max_gaps, sizing)
    if drawer is not None:
        gaps = [gap for gap in gaps if gap.share > 0.0]
    if possible.lower + possible.upper == 0.0 and drawer is None:
        covered = _of_nothing(gap_boxes.is_complete and not gap_boxes.boxes)
    return Counted(possible, left, certain, whole is not None, counts, covered, gap_boxes, gaps, measure)


def _report(opened: Opened, seed: int, work: int, max_samples: int | None, max_gaps: int, watcher: Progress) -> CoverageReport:
    space, compiled, drawer = opened.space, opened.compiled, opened.drawer
    of = counted(opened, seed, work, max_samples, max_gaps, watcher)
    covered, n_open = of.covered, len(of.gap_boxes.boxes)
    judging = watcher.within("Comparing rows", FINDINGS_AT, CROWDS_AT)
    compared = space.first(comparable_rows(compiled))
    judge = Judge(compared, compiled, opened.table, finding_steps(work, len(compared.boxes)), judging, drawer)
    findings = judge.findings()
    hits = _hits(space, of.counts, drawer is not None)
    crowding = watcher.within("Looking for crowded contexts", CROWDS_AT, 1.0)
    crowded = _crowded(space, of.counts, of.measure, crowding)
    return CoverageReport(
        table=compiled.name,
        n_rows=compiled.n_rows,
        n_conditions=len(compiled.conditions),
        covered=covered.value,
        lower=covered.lower,
        upper=covered.upper,
        method=covered.method,
        gaps=tuple(of.gaps),
        gaps_complete=of.gap_boxes.is_complete and n_open <= max_gaps and len(of.gaps) == n_open,
        findings=tuple(judge.gathered(findings)),
        needless=tuple(judge.needless(findings)),
        findings_complete=judge.is_complete,
        overlap=_overlap(of.counts, hits, of.is_whole),
        certain=(of.certain.lower, of.certain.upper) if of.possible.upper else (covered.lower, covered.upper),
        seed=int(seed),
        n_samples=0 if of.is_whole else of.counts.n_contexts,
        work=of.possible.work + of.left.work,
        hits=_of_all_rows(hits, space, compiled.n_rows),
        assumed=space.assumed,
        weighted=space.weighted,
        crowded=crowded,
        assumptions=opened.assumptions,
        sampled=opened.sampled,
    )


def search_steps(work: int, n_boxes: int) -> int:
    """Search steps for the gaps, that take about as long as so many of the count."""
    return 4 * work // (500 + n_boxes)


def finding_steps(work: int, n_boxes: int) -> int:
    """Search steps for the findings: some for every row, fewer where rows are so many that each step is long."""
    return search_steps(work, n_boxes) + min(n_boxes * (work // 1_000_000), 16 * work // max(1, n_boxes))


def measure_of(opened: Opened, possible: Bounds, work: int, samples: int, seed: int) -> Measure:
    """What tells the share of a box: the counter, or samples where only they know what can happen."""
    if opened.drawer is not None:
        return SampledShares.of(Sampler(opened.space, drawer=opened.drawer), samples, np.random.default_rng(seed))
    space, most = opened.space, min(work, SHARE_WORK)
    impossible = [space.sides_of(box) for box in space.impossible]
    return lambda box, without: share_of(space, box, [*impossible, *without], possible, most)


def _certain(space: Space, possible: Bounds, left: Bounds, is_sampled: bool) -> Bounds:
    """The covered share of the possible contexts, for certain; never 0 or 1 by rounding."""
    if is_sampled:  # what can happen may lie within the rows, or outside of them all
        return Bounds(1.0, 1.0) if left.upper == 0.0 else Bounds(0.0, 0.0 if not space.boxes else 1.0)
    if possible.upper == 0.0:
        return Bounds(0.0, 1.0)
    lower = 1.0 - min(1.0, left.upper / possible.lower) if possible.lower > 0.0 else 0.0
    upper = 1.0 - min(1.0, left.lower / possible.upper)
    least = 0.0 if space.impossible else float(space.volumes.max(initial=0.0))
    most = math.nextafter(1.0, 0.0) if left.lower > 0.0 else 1.0
    lower, upper = (min(max(share, least), most) for share in (lower, upper))
    if possible.is_exact and left.is_exact:
        return Bounds(lower, lower)
    return Bounds(lower, upper)


def _covered(
    certain: Bounds, counts: Counts, is_sampled: bool, sampler: Sampler, possible: Bounds, rng: np.random.Generator, samples: int
) -> Covered:
    if certain.is_exact:
        return Covered(certain.lower, certain.lower, certain.upper, "exact")
    bounds = Covered((certain.lower + certain.upper) / 2.0, certain.lower, certain.upper, "bounds")
    if not is_sampled or counts.n_contexts == 0:
        return bounds
    n = counts.n_contexts
    n_covered = n - round(float(counts.histogram[0]))
    value, (lower, upper) = n_covered / n, wilson(n_covered, n)
    if value < LITTLE and possible.is_exact and sampler.drawer is None:
        value, lower, upper = (share / possible.lower for share in sampler.out_of_rows(samples, rng))
    lower, upper = max(lower, certain.lower), min(upper, certain.upper)
    if upper - lower >= certain.upper - certain.lower or lower > upper:
        return bounds
    return Covered(min(max(value, lower), upper), lower, upper, "estimate")


def _of_nothing(is_all_covered: bool) -> Covered:
    """The share when the possible contexts have no measure: all of nothing, unless single points are open."""
    share = 1.0 if is_all_covered else 0.0
    return Covered(share, share, share, "exact")


def _crowded(space: Space, counts: Counts, measure: Measure, progress: Progress) -> tuple[Crowd, ...]:
    crowds = []
    for found in find_crowds(space, counts.fullest, progress=progress):
        rows = tuple(space.rows[i] for i in bitmask.rows_of(found.held_by))
        sides = space.sides_of(found.box)
        crowds.append(Crowd(rows, measure(sides, ())[0], space.cells(sides, is_label=True)))
    return tuple(crowd for crowd in crowds if crowd.share > 0.0 or not isinstance(measure, SampledShares))


def _hits(space: Space, counts: Counts, is_sampled: bool) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    if not space.impossible and not is_sampled:
        return space.volumes
    total = counts.histogram.sum()
    return counts.hits / total if total else np.zeros(len(space.boxes))


def _overlap(counts: Counts, hits: np.ndarray[tuple[int], np.dtype[np.float64]], is_exact: bool) -> Overlap:
    total = float(counts.histogram.sum())
    histogram = np.trim_zeros(counts.histogram, "b") / total if total else np.zeros(0)
    return Overlap(float(hits.sum()), tuple(histogram.tolist()), "exact" if is_exact else "estimate")


def _of_all_rows(hits: np.ndarray[tuple[int], np.dtype[np.float64]], space: Space, n_rows: int) -> tuple[float, ...]:
    all_rows = np.zeros(n_rows)
    all_rows[list(space.rows)] = hits
    return tuple(all_rows.tolist())


# ---- crowded contexts: where most rows are valid at once, as boxes that all of those rows hold. A context with many valid
# rows is moved, one factor at a time, to the class that keeps most rows, until no class keeps more. The rows that are valid
# there meet in one box. Where the space was gone through whole, the first is the fullest there is; else the best that samples
# led to, or met, where rows do not fit into memory. Single points of a domain do not count: two ends that touch are no crowd

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
