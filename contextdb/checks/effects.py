"""What a change of a table does: which contexts gain or lose assets, gaps that open and close, rows that can no longer be chosen.

Both tables are read under one set of conditions, so that their contexts can be compared; a column that one of them does not have
says Any there. What an asset gains is what its rows hold now and held not before. A gap that opens lies where some asset lost
contexts, one that closes where some asset gained them: only there it is looked for. Budgets count work, never time; what was left
out is said. Cells name contexts as in `contextdb.coverage`, whose engines do the measuring.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from contextdb.cells.conditions import Condition
from contextdb.cells.grammar import format_cell, parse_cell
from contextdb.cells.plain_ends import cuts_of, plain
from contextdb.cells.sets import Accepted, Cell, TagSet, meet_plainly, plain_parts
from contextdb.cells.words import InCells
from contextdb.checks.effects_space import Cells, Rows, Shared, shared_space
from contextdb.covering import CoverageReport, coverage, format_percent
from contextdb.covering.ruled import without_rules
from contextdb.edits.diffing import Diff, diff
from contextdb.errors import Fault, Place, TableError, in_quotes
from contextdb.findings import Finding
from contextdb.tables.nesting.flat import FlatTable
from contextdb.tables.nesting.plain import as_plain
from contextdb.tables.table import EitherTable, has_others

WORK = 1_000_000
"""Steps for each question about a whole table."""
SAMPLES = 10_000
MOST_ASSETS = 20
MOST_BOXES = 20
"""Boxes of lost or gained contexts in which gaps are looked for."""
MOST_PARTS = 20
"""Parts of one box that are named, the largest."""
MOST_GAPS = 1
"""Gaps that are named where only their share is requested."""
MOST_CELLS = 60_000
"""Cells of conditions above which gaps and the covered share are not worked out."""
MOST_ROWS = 2_000
"""The same for rows."""
DEAD_RULES = ("dead-row", "never-chosen")
OVERLAP_RULES = ("policy-overlap",)


@dataclass(frozen=True, slots=True)
class Box(InCells):
    """Contexts, as cells of the conditions that they restrict, and their share of all contexts."""

    cells: Cells
    share: float

    def to_json(self) -> dict[str, object]:
        return {"share": self.share, "cells": self.cells}


@dataclass(frozen=True, slots=True)
class Reach:
    """The contexts of one asset before and after. Shares are of all contexts."""

    asset: str
    before: float
    after: float
    gained: tuple[Box, ...]
    """Largest first; boxes may share contexts."""
    lost: tuple[Box, ...]
    share_gained: float
    share_lost: float

    def to_json(self) -> dict[str, object]:
        return {
            "asset": self.asset,
            "before": self.before,
            "after": self.after,
            "gained": {"share": self.share_gained, "boxes": [box.to_json() for box in self.gained]},
            "lost": {"share": self.share_lost, "boxes": [box.to_json() for box in self.lost]},
        }


@dataclass(frozen=True, slots=True)
class Effects:
    """What a change does. False when no context gains or loses an asset and no finding is new."""

    before: CoverageReport | None
    """None where the table is too large for its coverage to be worked out here."""
    after: CoverageReport | None
    assets: tuple[Reach, ...]
    n_left_out: int
    """Changed assets that were not looked at."""
    opened: tuple[Box, ...]
    closed: tuple[Box, ...]
    dead: tuple[Finding, ...]
    """Rows that can play no more; rows and lines are those of the table after."""
    overlaps: tuple[Finding, ...]
    """Rows that a policy "unique" forbids and did not before."""
    is_complete: bool
    """False where gaps may have been missed."""

    def __bool__(self) -> bool:
        return bool(self.assets or self.n_left_out or self.opened or self.closed or self.dead or self.overlaps)

    def to_json(self) -> dict[str, object]:
        return {
            "covered": {"before": _covered(self.before), "after": _covered(self.after)},
            "assets": [reach.to_json() for reach in self.assets],
            "assets_left_out": self.n_left_out,
            "gaps": {
                "opened": [box.to_json() for box in self.opened],
                "closed": [box.to_json() for box in self.closed],
                "complete": self.is_complete,
            },
            "dead": [finding.to_json() for finding in self.dead],
            "overlaps": [finding.to_json() for finding in self.overlaps],
        }


def covered_text(report: CoverageReport) -> str:
    """The covered share of a report in a few words that say how it is known."""
    if report.method == "exact":
        return f"{format_percent(report.covered)} (exact)"
    how = "bounds" if report.method == "bounds" else "estimate"
    return f"{format_percent(report.lower)} to {format_percent(report.upper)} ({how})"


def _covered(report: CoverageReport | None) -> dict[str, object] | None:
    if report is None:
        return None
    return {"method": report.method, "value": report.covered, "lower": report.lower, "upper": report.upper}


def effects(
    before: EitherTable,
    after: EitherTable,
    *,
    changes: Diff | None = None,
    work: int = WORK,
    samples: int = SAMPLES,
    seed: int = 0,
    most: int = MOST_ASSETS,
) -> Effects:
    """What the change from one table to another does.

    The tables have no cells that cannot be read; `changes` is their diff where it is known already. `work`, `samples` and `seed`
    are as in `contextdb.coverage`, for each question. At most `most` changed assets are looked at, in the order of their rows.
    Raises TableError where cells cannot be read, or a column is of another type before than after; ExpressionError where an
    assumption of the table cannot be read.
    """
    if has_others(before) or has_others(after):
        before, after, changes = _flat(before), _flat(after), None
    changes = changes if changes is not None else diff(before, after)
    before, after = without_rules(before).table, without_rules(after).table
    changes = replace(changes, before=before, after=after)
    space = shared_space(before, after)
    groups = _changed(changes, space)
    measure = Measure(space, work, samples, seed)
    reaches = [measure.reach(name, *rows) for name, rows in list(groups.items())[:most]]
    is_whole = max(t.n_rows for t in (before, after)) <= min(MOST_ROWS, MOST_CELLS // max(1, len(space.conditions)))
    reports = tuple(measure.whole(table) for table in (before, after)) if is_whole and groups else (None, None)
    opened, told_opened = measure.holes(after, [box for reach in reaches for box in reach.lost]) if is_whole else ([], False)
    closed, told_closed = measure.holes(before, [box for reach in reaches for box in reach.gained]) if is_whole else ([], False)
    new = _new_findings(after, reports[1], (before, reports[0]))
    return Effects(
        before=reports[0],
        after=reports[1],
        assets=tuple(reach for reach in reaches if reach.gained or reach.lost),
        n_left_out=max(0, len(groups) - most),
        opened=tuple(opened),
        closed=tuple(closed),
        dead=tuple(f for f in new if f.rule in DEAD_RULES),
        overlaps=tuple(f for f in new if f.rule in OVERLAP_RULES),
        is_complete=is_whole and told_opened and told_closed and len(groups) <= most,
    )


@dataclass(frozen=True, slots=True)
class MergeEffects:
    """What a merge brings that neither side had. False when it is nothing."""

    opened: tuple[Box, ...]
    """Contexts without a valid row that had one in both sides."""
    findings: tuple[Finding, ...]
    """Overlaps under a policy "unique", and rows that can no longer be chosen; rows are those of the merge."""

    def __bool__(self) -> bool:
        return bool(self.opened or self.findings)


def merge_effects(
    ours: EitherTable, theirs: EitherTable, merged: EitherTable, *, work: int = WORK, samples: int = SAMPLES
) -> MergeEffects:
    """Gaps and findings of a merge that neither side had. Raises as `effects` does."""
    mine, yours = (effects(side, merged, work=work, samples=samples) for side in (ours, theirs))
    ours, theirs, merged = _flat(ours), _flat(theirs), _flat(merged)
    measure = Measure(shared_space(without_rules(ours).table, without_rules(merged).table), work, samples, 0)
    both = [box for one in mine.opened for other in yours.opened for box in measure.common(one, other)]
    gaps = sorted({box.text: box for box in both}.values(), key=lambda box: -box.share)
    retained = {_key(merged, finding) for finding in (*yours.dead, *yours.overlaps)}
    findings = tuple(f for f in (*mine.dead, *mine.overlaps) if _key(merged, f) in retained)
    return MergeEffects(tuple(gaps), findings)


# ---- which rows changed


def _flat(table: EitherTable) -> EitherTable:
    """A table with the rows of its inner tables, by what they say together."""
    flat = table.flat()
    if not isinstance(flat, FlatTable):
        return flat
    plain = as_plain(flat)
    if plain is None:
        problem = f"tags of {in_quotes(table.name)} and of a table inside it have requirements that no single cell can describe."
        raise TableError(Fault(problem, place=Place(str(table.path) if table.path else None)))
    return plain


def _changed(changes: Diff, space: Shared) -> dict[str, tuple[list[int], list[int]]]:
    """For each asset whose cells changed, all its rows before and after; an asset that was renamed has its new name."""
    before, after = changes.before, changes.after
    names = list(before.assets)
    for a, b in enumerate(changes.alignment.rows.tolist()):
        if b >= 0:
            names[b] = after.assets[a]
    touched = [after.assets[row] for row in _touched_rows(changes, space)] + [names[row] for row in changes.rows_removed]
    groups: dict[str, tuple[list[int], list[int]]] = {name: ([], []) for name in touched}
    for side, (table, known) in enumerate(((before, names), (after, after.assets))):
        for row in np.flatnonzero(table.enabled).tolist():
            if known[row] in groups:
                groups[known[row]][side].append(row)
    return groups


def _touched_rows(changes: Diff, space: Shared) -> list[int]:
    """Rows of after that are new, or whose conditions or whose "enabled" changed."""
    before, after = changes.before, changes.after
    was = changes.alignment.rows
    is_touched = was < 0
    retained = np.flatnonzero(~is_touched)
    is_touched[retained] |= before.enabled[was[retained]] != after.enabled[retained]
    for name in space.conditions:
        old, new = space.column(before, name), space.column(after, name)
        pairs = np.stack([old.codes[was[retained]], new.codes[retained]], axis=1)
        distinct, which = np.unique(pairs, axis=0, return_inverse=True)
        differs = np.array([old.texts[x] != new.texts[y] for x, y in distinct.tolist()], np.bool_)
        is_touched[retained] |= differs[which.reshape(-1)] if len(retained) else False
    return np.flatnonzero(is_touched).tolist()


# ---- measuring


@dataclass(frozen=True)
class Measure:
    """Asks the coverage engines about rows of both tables."""

    space: Shared
    work: int
    samples: int
    seed: int

    def whole(self, table: EitherTable) -> CoverageReport:
        """The coverage of a whole table, under the conditions of both."""
        return self._report([(table, range(table.n_rows))])

    def reach(self, asset: str, before: Sequence[int], after: Sequence[int]) -> Reach:
        """What rows of both tables hold, and what they hold alone."""
        old, new = self.space.boxes(self.space.before, before), self.space.boxes(self.space.after, after)
        share_old, share_new = (self._report([boxes]).covered if boxes else 0.0 for boxes in (old, new))
        gained, share_gained = self._beyond(new, old, share_new)
        lost, share_lost = self._beyond(old, new, share_old)
        return Reach(asset, share_old, share_new, gained, lost, share_gained, share_lost)

    def _beyond(self, boxes: list[Cells], others: list[Cells], share: float) -> tuple[tuple[Box, ...], float]:
        """What boxes, which hold a share of the contexts, hold beyond others: the largest parts, and the share of all of them."""
        parts: dict[str, Box] = {}
        for box in boxes:
            whole = share if len(boxes) == 1 else self._report([[box]]).covered
            pieces, _ = self._left_by([others], Box(box, whole))
            parts |= {part.text: part for part in pieces}
        if not parts:
            return (), 0.0
        beyond = self._report([others], self._outside([boxes])) if len(boxes) > 1 or others else None
        parts_left = tuple(sorted(parts.values(), key=lambda part: -part.share))
        return parts_left, share if beyond is None else (1.0 - beyond.covered) * share

    def holes(self, table: EitherTable, within: Sequence[Box]) -> tuple[list[Box], bool]:
        """Contexts of some boxes that have no valid row in a table, and whether these are all of them."""
        boxes: list[Box] = []
        is_complete = len(within) <= MOST_BOXES
        wanted = sorted(within, key=lambda box: -box.share)[:MOST_BOXES]
        compiled = self.space.compiled(table) if wanted else None
        for box in wanted:
            assert compiled is not None
            near = self.space.meeting(compiled, box.cells)
            seen = [hole.cells for hole in boxes]
            holes, are_all = self._left_by([(table, near[near < table.n_rows]), seen], box)
            boxes += holes
            is_complete = is_complete and are_all
        return sorted(boxes, key=lambda box: -box.share), is_complete

    def _left_by(self, rows: Rows, box: Box) -> tuple[list[Box], bool]:
        """What rows leave of a box, in its cells, and whether that is all."""
        few = replace(self, work=self.work // 10, samples=self.samples // 5)
        report = few._report(rows, self._outside([[box.cells]]), MOST_PARTS)
        boxes: list[Box] = []
        for gap in report.gaps:
            parts = meet(box.cells, gap.cells, self.space.conditions)
            boxes += [Box(parts[0], gap.share * box.share)] if len(parts) == 1 else self._measured(parts)
        return boxes, report.gaps_complete

    def common(self, one: Box, other: Box) -> list[Box]:
        return self._measured(meet(one.cells, other.cells, self.space.conditions))

    def _measured(self, parts: Sequence[Cells]) -> list[Box]:
        return [Box(cells, self._report([[cells]]).covered) for cells in parts]

    def _outside(self, rows: Rows) -> list[Cells]:
        """Boxes that hold what rows do not."""
        report = coverage(self.space.table(rows), seed=self.seed, work=self.work, samples=0, max_gaps=2000, assume=False)
        if not report.gaps_complete:
            raise TableError("the rows of one asset have too many shapes to be compared.")
        return [gap.cells for gap in report.gaps]

    def _report(self, rows: Rows, impossible: Sequence[Cells] = (), most: int = MOST_GAPS) -> CoverageReport:
        table = self.space.table(rows)
        return coverage(table, seed=self.seed, work=self.work, samples=self.samples, max_gaps=most, impossible=impossible)


# ---- findings

Key = tuple[str, str, tuple[str, ...]]


def _new_findings(
    after: EitherTable, report: CoverageReport | None, earlier: tuple[EitherTable, CoverageReport | None]
) -> list[Finding]:
    """The dead rows and overlaps that were not there, placed in the table after."""
    if report is None or earlier[1] is None:
        return []
    left = Counter(_key(earlier[0], f) for f in _row_findings(earlier[0], earlier[1]))
    new = []
    for finding in _row_findings(after, report):
        key = _key(after, finding)
        left[key] -= 1
        if left[key] < 0:
            new.append(_placed(after, finding))
    return new


def _row_findings(table: EitherTable, report: CoverageReport) -> Iterator[Finding]:
    rules = (*DEAD_RULES, *OVERLAP_RULES)
    return (f for f in report.findings if f.rule in rules and f.row is not None and f.row < table.n_rows)


def _key(table: EitherTable, finding: Finding) -> Key:
    others = sorted(table.assets[row] for row in finding.by if row < table.n_rows) if finding.rule in OVERLAP_RULES else ()
    return finding.rule, table.assets[finding.row or 0], tuple(others)


def _placed(table: EitherTable, finding: Finding) -> Finding:
    place = table.place(finding.row or 0)
    return replace(finding, table=table.name, file=place.file, line=place.line, asset=table.assets[finding.row or 0])


# ---- what two boxes of cells have in common


def meet(one: Mapping[str, str], other: Mapping[str, str], conditions: Mapping[str, Condition]) -> list[dict[str, str]]:
    """Boxes that together hold what both hold, as cells; one, but for cells of tags that begin with "not". Cells are not soft."""
    ways: dict[str, list[str]] = {}
    for name in (name for name in conditions if name in one or name in other):
        if not (name in one and name in other):
            ways[name] = [one[name] if name in one else other[name]]  # as somebody wrote it
            continue
        domain = conditions[name].domain
        mine, yours = (parse_cell(box[name], domain).accepts for box in (one, other))
        both = [mine or yours] if mine is None or yours is None else _meets(mine, yours)
        ways[name] = [format_cell(Cell(part and plain(part, cuts_of(mine, yours))), domain) for part in both]
    return [dict(zip(ways, texts, strict=True)) for texts in product(*ways.values())]


def _meets(one: Accepted, other: Accepted) -> list[Accepted]:
    """Sets that together hold what two have in common and that cells can say."""
    sides = (plain_parts(side) if isinstance(side, TagSet) else [side] for side in (one, other))
    return [both for pair in product(*sides) if not (both := meet_plainly(*pair)).is_empty]
