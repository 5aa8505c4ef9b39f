"""What coverage says of a table: numbers, gaps and findings. Data only; `to_json` is what `coverage --format json` prints."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from contextdb.cells.notebook import as_html, one_line
from contextdb.cells.words import InCells
from contextdb.columns import Framed, frame_of
from contextdb.columns import polars as pl
from contextdb.errors import plural
from contextdb.findings import Finding

Method = Literal["exact", "bounds", "estimate"]


@dataclass(frozen=True, slots=True)
class Nearest:
    """The row that needs fewest changes to hold a gap: how many cells, and the first of them with what it would say."""

    row: int
    asset: str
    n_changes: int
    condition: str
    cell: str
    more: tuple[tuple[str, str], ...] = ()
    """The other cells to change, with what they would say."""

    @property
    def cells(self) -> dict[str, str]:
        """All cells to change, with what they would say."""
        return {self.condition: self.cell, **dict(self.more)}

    def to_json(self) -> dict[str, object]:
        return {
            "row": self.row,
            "asset": self.asset,
            "changes": self.n_changes,
            "condition": self.condition,
            "cell": self.cell,
            "cells": self.cells,
        }


@dataclass(frozen=True, slots=True)
class Gap(InCells):
    """A box of contexts without a valid row. `cells` leaves out the conditions that it does not restrict."""

    id: str
    share: float
    """Of the possible contexts; 0 for single points."""
    new_share: float
    """What no earlier gap of the list holds."""
    cells: dict[str, str]
    nearest: Nearest | None = None
    is_exact: bool = True
    """False where a share needed too much work: it is then the middle of certain bounds."""
    telemetry: float | None = None
    """The share of the recorded moments that lie in it; None where none were observed."""

    def to_json(self) -> dict[str, object]:
        nearest = None if self.nearest is None else self.nearest.to_json()
        return {
            "id": self.id,
            "share": self.share,
            "new_share": self.new_share,
            "exact": self.is_exact,
            "telemetry": self.telemetry,
            "cells": self.cells,
            "nearest": nearest,
        }


@dataclass(frozen=True, slots=True)
class Overlap:
    """How many rows are valid at once: the mean, and the share of contexts that have 0, 1, 2, … valid rows."""

    mean: float
    histogram: tuple[float, ...]
    method: Literal["exact", "estimate"]

    def to_json(self) -> dict[str, object]:
        return {"mean": self.mean, "histogram": list(self.histogram), "method": self.method}


@dataclass(frozen=True, slots=True)
class Crowd:
    """A box of contexts in which all of these rows, and no fewer, are valid. `cells` as in a gap."""

    rows: tuple[int, ...]
    share: float
    """Of the possible contexts."""
    cells: dict[str, str]

    @property
    def n_rows(self) -> int:
        """How many rows are valid at once."""
        return len(self.rows)

    def to_json(self) -> dict[str, object]:
        return {"rows": list(self.rows), "share": self.share, "cells": self.cells}


@dataclass(frozen=True, slots=True, repr=False)
class CoverageReport(Framed):
    """The context coverage of one table.

    `covered` is between `lower` and `upper`: all are equal when `method` is "exact"; with "bounds" it is their middle and they are
    certain; with "estimate" it was sampled and they are its 99 % interval (Wilson). All are shares of the possible contexts.
    """

    table: str
    n_rows: int
    n_conditions: int
    covered: float
    lower: float
    upper: float
    method: Method
    gaps: tuple[Gap, ...]
    gaps_complete: bool
    findings: tuple[Finding, ...]
    findings_complete: bool
    """False when the work budget ended before every row was decided."""
    overlap: Overlap
    certain: tuple[float, float]
    """Bounds that hold whatever the samples say."""
    seed: int
    n_samples: int
    work: int
    """Steps spent on counting."""
    hits: tuple[float, ...]
    """For each row the share of the possible contexts in which it is valid."""
    assumed: dict[str, str]
    """What had to be assumed of conditions without bounds or declared values."""
    weighted: tuple[str, ...]
    """The conditions whose values do not all count the same."""
    crowded: tuple[Crowd, ...] = ()
    """Where most rows are valid at once, the fullest first; the first is the fullest of all when `overlap` is exact."""
    assumptions: tuple[str, ...] = ()
    """The table's assumptions, as contextdb.toml has them."""
    needless: tuple[Finding, ...] = ()
    """The rows that `findings` tell of in groups, as variety: a finding for each."""
    sampled: tuple[str, ...] = ()
    """Of these, and of the derived facts, what only samples know: with any of them the share is an estimate."""

    @property
    def headline(self) -> str:
        """The covered share in one sentence, with how it was computed."""
        if self.method == "exact":
            return f"{format_percent(self.covered)} of the contexts have a valid row (exact)."
        ends = " and ".join(distinct_percents(self.lower, self.upper))
        how = "certain bounds" if self.method == "bounds" else f"99 % interval, {self.n_samples:,} samples, seed {self.seed}"
        return f"Between {ends} of the contexts have a valid row ({how})."

    def to_polars(self) -> pl.DataFrame:
        """The gaps as a DataFrame: `gap` (its id), `share`, and a cell for each condition that one of them limits, else null.
        A condition of the name "gap" or "share" is left out."""
        limited = dict.fromkeys(name for gap in self.gaps for name in gap.cells)
        columns: dict[str, object] = {name: [gap.cells.get(name) for gap in self.gaps] for name in limited}
        columns |= {"gap": [gap.id for gap in self.gaps], "share": np.array([gap.share for gap in self.gaps], np.float64)}
        return frame_of(columns, ["gap", *limited]).select("gap", "share", *(n for n in limited if n not in ("gap", "share")))

    def __repr__(self) -> str:
        return one_line("CoverageReport", self.table, f"{self.headline.rstrip('.')}, {plural(len(self.gaps), 'gap')}")

    def _repr_html_(self) -> str:
        rows = [(gap.text, format_percent(gap.share)) for gap in self.gaps]
        return as_html(f"{self.table}: {self.headline}", ("gap", "share of the contexts"), rows)

    def to_json(self) -> dict[str, object]:
        """The report as plain data: one entry of `tables` in `coverage --format json`."""
        return {
            "table": self.table,
            "rows": self.n_rows,
            "conditions": self.n_conditions,
            "covered": {
                "method": self.method,
                "value": self.covered,
                "lower": self.lower,
                "upper": self.upper,
                "certain": list(self.certain),
                "seed": self.seed,
                "samples": self.n_samples,
                "work": self.work,
                "assumed": self.assumed,
                "weighted": list(self.weighted),
                "assumptions": list(self.assumptions),
                "sampled": list(self.sampled),
            },
            "gaps": {"complete": self.gaps_complete, "items": [gap.to_json() for gap in self.gaps]},
            "findings": [finding.to_json() for finding in self.findings],
            "findings_complete": self.findings_complete,
            "overlap": self.overlap.to_json(),
            "crowded": [crowd.to_json() for crowd in self.crowded],
        }


def share_at_once(report: CoverageReport, n_rows: int) -> str:
    """The share of the contexts with so many valid rows; that of none is as exact as `covered`, and a sample never says all."""
    share = report.overlap.histogram[n_rows]
    if n_rows == 0 and report.method == "exact":
        return format_percent(1.0 - report.covered)
    is_certain = report.overlap.method == "exact" or share < 1.0
    return format_percent(share) if is_certain else f"at least {format_percent(1.0 - report.upper)}"


# ---- shares as text, and intervals round a share that was sampled

Z_99 = 2.5758293035489004
"""Standard deviations that 99 % of a normal distribution lie within."""


def format_percent(share: float, digits: int = 2) -> str:
    """A share as a percentage that never rounds to 0 or 100 when it is not: "99.999 %", "> 99.9999999999 %", "0.0003 %"."""
    if math.isnan(share):
        return "unknown"
    if share <= 0.0 or share >= 1.0:
        return "0 %" if share <= 0.0 else "100 %"
    if share < 0.5:
        percent = 100.0 * share
        texts = (f"{percent:.{places}f}" for places in range(digits, 11))
        return f"{next((text for text in texts if float(text) > 0.0), f'{percent:.1g}')} %"
    for places in range(digits, 13):
        text = f"{100.0 * share:.{places}f}"
        if float(text) < 100.0:
            return f"{text} %"
    return "> 99.9999999999 %"


def distinct_percents(one: float, other: float) -> tuple[str, str]:
    """Two shares as percentages, with as many digits as it takes to tell them apart."""
    texts = [(format_percent(one, digits), format_percent(other, digits)) for digits in range(2, 9)]
    return next((pair for pair in texts if pair[0] != pair[1]), texts[0])


def wilson(n_hits: int, n_samples: int, z: float = Z_99) -> tuple[float, float]:
    """The interval that a share lies in, after `n_hits` of `n_samples`: E. B. Wilson, JASA 22, 1927. No sample says nothing."""
    if n_samples <= 0:
        return 0.0, 1.0
    share, zz = n_hits / n_samples, z * z
    centre = share + zz / (2 * n_samples)
    spread = z * math.sqrt(share * (1 - share) / n_samples + zz / (4 * n_samples * n_samples))
    low, high = (centre - spread) / (1 + zz / n_samples), (centre + spread) / (1 + zz / n_samples)
    return (0.0 if n_hits == 0 else max(0.0, low)), (1.0 if n_hits == n_samples else min(1.0, high))
