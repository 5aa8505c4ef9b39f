"""The contexts that a designer expects, and which share of them has a valid row.

Situations are boxes of contexts, each with how often it comes. The expected contexts are those of all situations, each by its
weight, and within one all that can happen alike. What is left without a row is a list of things to do, the most expected first.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from contextdb.cells.domains import Domain
from contextdb.cells.sets import Cell, complement
from contextdb.covering.assumed import Opened, opened
from contextdb.covering.engine import SAMPLES, WORK, Covered, counted
from contextdb.covering.gaps import described
from contextdb.covering.progress import SILENT, Progress
from contextdb.covering.report import Gap, distinct_percents, format_percent
from contextdb.covering.space import Box
from contextdb.covering.witness import BoxSet, Steps
from contextdb.errors import Fault, TableError, plural
from contextdb.tables.expected_file import Situation
from contextdb.tables.table import EitherTable

MOST_GAPS = 40
"""So many gaps of one situation are named, the largest."""
LEAST_WORK = 200_000
LEAST_SAMPLES = 2_000
"""So much work and so many samples each situation gets, however many there are."""
STEPS = 10_000


@dataclass(frozen=True, slots=True)
class Measured:
    """One situation with its coverage. Shares of gaps are of the contexts of the situation that can happen."""

    situation: Situation
    covered: Covered
    gaps: tuple[Gap, ...]


@dataclass(frozen=True, slots=True)
class Todo:
    """A part of a situation in which nothing plays; `share` is that of all expected contexts."""

    situation: Situation
    gap: Gap
    share: float


@dataclass(frozen=True, slots=True)
class Expectation:
    """The coverage of all situations."""

    file: str
    situations: tuple[Measured, ...]

    @property
    def total(self) -> float:
        """What all situations weigh."""
        return sum(each.situation.weight for each in self.situations)

    @property
    def covered(self) -> Covered:
        """The share of what is expected that has a valid row."""
        value, lower, upper = (
            self._mean([getattr(each.covered, end) for each in self.situations]) for end in ("value", "lower", "upper")
        )
        methods = {each.covered.method for each in self.situations}
        return Covered(value, lower, upper, "exact" if methods == {"exact"} else "estimate" if "estimate" in methods else "bounds")

    def _mean(self, shares: Sequence[float]) -> float:
        weights = [each.situation.weight for each in self.situations]
        if all(share == shares[0] for share in shares):
            return shares[0]
        return sum(weight * share for weight, share in zip(weights, shares, strict=True)) / self.total

    @property
    def headline(self) -> str:
        """The covered share in one sentence."""
        covered, of = (
            self.covered,
            f"what {plural(n := len(self.situations), 'expected situation')} {'asks' if n == 1 else 'ask'} for",
        )
        if covered.method == "exact":
            return f"{format_percent(covered.value)} of {of} has a valid row."
        ends = " and ".join(distinct_percents(covered.lower, covered.upper))
        return f"Between {ends} of {of} has a valid row."

    @property
    def todo(self) -> list[Todo]:
        """Where nothing plays, the most expected first; parts without a measure last."""
        items = [
            Todo(each.situation, gap, each.situation.weight / self.total * gap.new_share)
            for each in self.situations
            for gap in each.gaps
        ]
        return sorted(items, key=lambda item: -item.share)

    def to_json(self) -> dict[str, object]:
        covered = self.covered
        return {
            "file": self.file,
            "weight": self.total,
            "covered": {"method": covered.method, "value": covered.value, "lower": covered.lower, "upper": covered.upper},
            "situations": [
                {
                    "name": each.situation.name,
                    "line": each.situation.line,
                    "weight": each.situation.weight,
                    "cells": dict(each.situation.cells),
                    "covered": each.covered.value,
                    "gaps": [gap.to_json() for gap in each.gaps],
                }
                for each in self.situations
            ],
        }


def expectation(
    table: EitherTable,
    file: str,
    situations: Sequence[Situation],
    *,
    seed: int = 0,
    work: int = WORK,
    samples: int | None = None,
    progress: Progress = SILENT,
) -> Expectation | None:
    """Measure each situation of a table; None where there is none. `seed`, `work` and `samples` are as in `contextdb.coverage`, for
    all together. Raises TableError where a situation cannot happen."""
    n = max(1, len(situations))
    most = SAMPLES if samples is None else samples
    own_work, own_samples = max(min(work, LEAST_WORK), work // n), max(min(most, LEAST_SAMPLES), most // n)
    domains = {column.condition.name: column.condition.domain for column in table.conditions}
    measured, faults = [], []
    for at, situation in enumerate(situations):
        progress.at(at / n)
        ready = opened(table, list(_outside(situation.parsed, domains)))
        box = ready.space.box(situation.parsed)
        impossible = BoxSet.of(ready.space.full, ready.space.impossible)
        if box is None or impossible.hold(box, Steps(STEPS), False):
            faults.append(Fault("the situation cannot happen: the table assumes that it does not.", place=situation.place))
            continue
        measured.append(_measured(ready, situation, box, seed, own_work, own_samples))
    if faults:
        raise TableError(*faults)
    return Expectation(file, tuple(measured)) if measured else None


def _outside(cells: Mapping[str, Cell], domains: Mapping[str, Domain]) -> Iterator[dict[str, Cell]]:
    """The contexts that are not in a box of cells, as boxes."""
    for name, cell in cells.items():
        yield {name: Cell(complement(cell.accepts, domains[name]))}


def _measured(ready: Opened, situation: Situation, box: Box, seed: int, work: int, samples: int) -> Measured:
    space = ready.space
    of = counted(ready, seed, work, samples, MOST_GAPS)
    inside = {tuple(own & side for own, side in zip(gap, box, strict=True)): None for gap in of.gap_boxes.boxes}
    boxes = [gap for gap in inside if 0 not in gap]
    gaps = described(space, ready.compiled, boxes, of.measure, MOST_GAPS)
    if ready.drawer is not None:
        gaps = [gap for gap in gaps if gap.share > 0.0]
    return Measured(situation, of.covered, tuple(gaps if ready.ruled is None else map(ready.ruled.gap, gaps)))
