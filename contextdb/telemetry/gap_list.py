"""One list of gaps: those that coverage found and those that only the recording shows, ranked by the moments in them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from contextdb.cells.grammar import parse_cell
from contextdb.covering.assumed import Opened
from contextdb.covering.count import uncovered_share
from contextdb.covering.engine import SAMPLES
from contextdb.covering.gaps import SHARE_WORK, Measure, share_of
from contextdb.covering.report import CoverageReport, Gap
from contextdb.covering.sample import SampledShares, Sampler, samples_of
from contextdb.covering.space import Box, Sides, Space
from contextdb.telemetry.observed import Observed


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
    measure = _measure(ready, work, samples, report.seed)
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


def _measure(ready: Opened, work: int, samples: int | None, seed: int) -> Measure:
    """What tells the share of a box, as in the report."""
    space = ready.space
    if ready.drawer is not None:
        return SampledShares.of(
            Sampler(space, drawer=ready.drawer), samples_of(samples, SAMPLES, space), np.random.default_rng(seed)
        )
    possible = uncovered_share(space, space.impossible, work)
    impossible = [space.sides_of(box) for box in space.impossible]
    return lambda box, without: share_of(space, box, [*impossible, *without], possible, min(work, SHARE_WORK))


def box_of(space: Space, cells: Mapping[str, str]) -> Box | None:
    """The box that some cells of a gap mean; None where the space cannot say them."""
    domains = {condition.name: condition.domain for condition in space.conditions}
    if not cells.keys() <= domains.keys():
        return None
    box = space.box({name: parse_cell(text, domains[name], wants_mend=False) for name, text in cells.items()})
    return box if box is not None and space.cells(space.sides_of(box)) == cells else None
