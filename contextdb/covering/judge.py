"""What coverage finds wrong with rows: each rule is a question about boxes that has an exact answer.

    equal-row        valid in just the contexts of an earlier row, but not written alike (those are `check`'s identical-rows)
    subsumed-row     another row is valid wherever this one is, and elsewhere too
    redundant-row    several rows together are valid wherever this one is
    dead-row         all its contexts are impossible
    never-chosen     by the table's policy another row always comes first: one above it, of a higher priority, or more specific
    policy-overlap   the policy is "unique" and another row can be valid at the same time
    no-context       no context at all is possible

Single points count: a row that alone holds the number 5 is not redundant. A row has one of equal, subsumed, redundant and dead.
What of these is variety, under the table's policy, is information: see `contextdb.tables.variety`. Under "specific" a row that is
more specific than those that make it redundant is preferred to them, and has no finding.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.cells.words import cells_text
from contextdb.compiled.choosing import Choosing
from contextdb.compiled.data import CompiledData
from contextdb.covering.draw import Drawer
from contextdb.covering.points import MANY, Questions
from contextdb.covering.progress import SILENT, Progress
from contextdb.covering.space import Box, Space
from contextdb.covering.witness import BoxSet, OutOfSteps, Steps
from contextdb.errors import in_quotes, plural, row_name
from contextdb.findings import Finding, Level
from contextdb.schema.policies import POLICIES, lets_choose, rank_columns
from contextdb.tables.table import EitherTable
from contextdb.tables.variety import NEEDLESS, gathered, identical_rows, named, needless, softened

AHEAD = 0.2
"""This share of the work, where rows are many, is done for all of them before the first."""
MOST_CAUSES = 24
"""Up to so many rows the causes of a redundant row are thinned out to those that are needed."""
MOST_SIBLINGS = 50
"""So many other rows of a row's asset are compared with it one by one."""
MOST_JOINT = 1000
"""A finding names at most so many other rows that can be valid at the same time."""
QUESTIONS = 40
"""One question may use this part of the steps."""
QUICK, QUICK_BOXES = 50, 5000
"""Up to so many boxes a question is searched for so many steps first, which most need no more than; they count for nothing."""
STEP, STEP_A_BOX = 100, 0.0625
"""A step of the search takes as long as so many of the core's, and more for each box."""


@dataclass(eq=False)
class Judge:
    """Asks the questions of one table, with so many search steps for all of them."""

    space: Space
    compiled: CompiledData
    table: EitherTable | None
    steps: int
    progress: Progress = SILENT
    drawer: Drawer | None = None
    """Tells which contexts can happen, where boxes cannot."""
    is_complete: bool = True
    """False when the steps ended before an answer."""
    unsure: set[int] = field(default_factory=set)
    """The rows of which some question had no answer."""
    _pairs_left: int = 10_000_000
    """So many pairs of rows that may be valid together are looked at."""
    _asked_of: int | None = None
    """The box that questions are about."""
    _held: dict[tuple[int, int], int] = field(default_factory=dict)
    _met: dict[tuple[int, int], int] = field(default_factory=dict)

    def findings(self) -> list[Finding]:
        """Every finding, those of the whole table first, then by row."""
        if self.space.impossible and not self._is_possible(self.space.full):
            return [
                self._whole("no-context", "error", "no context is possible under the assumptions; do they contradict each other?")
            ]
        findings = [*self._left_out(), *self._identical, *self._rows(), *self._policy()]
        findings = [f for f in findings if not self._is_preferred(f)]
        findings = softened(findings, self.compiled.assets) if lets_choose(self.compiled.policies) else findings
        return sorted(findings, key=lambda f: (f.row is not None, f.row or 0))

    def _left_out(self) -> Iterator[Finding]:
        """That the last rows of a table that is too large are not compared."""
        if self.space.n_left:
            self.is_complete = False
            left = f"the last {self.space.n_left:,} of {plural(self.compiled.n_rows, 'row')}"
            message = f"the table is too large to compare all its rows: {left} are only searched for rows that are written alike."
            yield self._whole("undecided-rows", "info", message)

    def gathered(self, findings: Sequence[Finding]) -> list[Finding]:
        """The findings, those of variety in one for each group of rows where the policy wants it."""
        if not lets_choose(self.compiled.policies):
            return list(findings)
        return gathered(findings, self.compiled.assets, partial(self._finding, "variety", "info", ""), self._row_named)

    def needless(self, findings: Sequence[Finding]) -> list[Finding]:
        """The findings that `gathered` puts into groups."""
        return needless(findings, self.compiled.assets) if lets_choose(self.compiled.policies) else []

    @cached_property
    def boxes(self) -> BoxSet:
        """The rows, then the impossible contexts, as bits."""
        return BoxSet.of(self.space.full, self.space.boxes + self.space.impossible, self.progress)

    @cached_property
    def _impossible(self) -> int:
        return self.boxes.all & ~((1 << len(self.space.boxes)) - 1)

    @cached_property
    def _identical(self) -> list[Finding]:
        return [] if self.table is None else list(identical_rows(self.table))

    @cached_property
    def _equal(self) -> dict[Box, list[int]]:
        """For each distinct box the rows that have it."""
        groups: dict[Box, list[int]] = {}
        for i, box in enumerate(self.space.boxes):
            groups.setdefault(box, []).append(i)
        return groups

    def _rows(self) -> Iterator[Finding]:
        rows = {f.row for f in self._identical}
        first_of: dict[tuple[int, str], int] = {}
        before = 0.0
        if self._questions is not None:
            self.progress.at(AHEAD / 2 if self.boxes.n_boxes else 0.0)
            before = AHEAD if len(self._first_holders) else 0.0
        for i, box in enumerate(self.space.boxes):
            self.progress.at(before + (1.0 - before) * i / len(self.space.boxes))
            self._asked_of = i
            same = self._equal[box]
            first_same = first_of.setdefault((same[0], self._asset(i)), i)
            if self.space.impossible and not self._is_possible(box):
                yield self._at(i, "dead-row", "warning", "the row is valid only in contexts that the assumptions exclude.")
                continue
            if same[0] != i:
                if self.space.rows[i] not in rows:
                    first = same[0] if first_same == i else first_same
                    yield self._at(
                        i, "equal-row", "warning", f"is valid in exactly the contexts of {self._named(first, i)}.", 1 << first
                    )
                continue
            yield from self._contained(i, box, same)

    def _contained(self, i: int, box: Box, same: Sequence[int]) -> Iterator[Finding]:
        other = self._own_holder(i, box)
        equal = bitmask.int_of(same)
        other = self._first_holder(i, box, equal) if other is None else other
        if other is not None:
            yield self._at(i, "subsumed-row", "warning", f"wherever it is valid, {self._named(other, i)} is valid too.", 1 << other)
            return
        others = self._meeting(box) & ~equal
        if others & ~self._impossible and self._covered(box, others):
            causes = self._thinned(box, others) & ~self._impossible
            is_one = causes.bit_count() == 1
            by = self._named(causes.bit_length() - 1, i) if is_one else f"one of {plural(causes.bit_count(), 'other row')}"
            yield self._at(i, "redundant-row", "info", f"wherever it is valid, {by} is valid too.", causes)

    def _policy(self) -> Iterator[Finding]:
        ways, policies = self.compiled.ways, [POLICIES[policy] for policy in self.compiled.policies]
        if self.space.is_strict:
            yield from self._overlapping()
        if any(policy.is_order for policy in policies):
            for i, box in enumerate(self.space.boxes):
                self.progress.check()
                self._asked_of = i
                before = self._before(i) & self._meeting(box) & ~self._resting
                if before and self._covered(box, before | self._impossible) and self._is_possible(box):
                    why = "comes before it" if ways is not None else self._why_before
                    message = f"the row is never chosen: wherever it is valid, a valid row {why}."
                    yield self._at(
                        i, "never-chosen", "warning", message, self._thinned(box, before | self._impossible) & ~self._impossible
                    )

    @property
    def _why_before(self) -> str:
        """Why the policy prefers a row."""
        columns = rank_columns(self.compiled.policy, self.compiled.priorities, self.compiled.picking.specificities)
        return " or ".join(key.above for key, values in columns if values.min() < values.max())

    def _is_preferred(self, finding: Finding) -> bool:
        """Whether rows make a row redundant that is preferred to all of them for being more specific: that is the point of it."""
        row = finding.row
        if row is None or finding.rule not in NEEDLESS or not finding.by:
            return False
        ways, compiled = self.compiled.ways, self.compiled
        if ways is not None:
            return all(ways.policy_between(row, by).is_narrowing and ways.preferred_to(by)[row] for by in finding.by)
        if not (POLICIES[compiled.policy].is_narrowing and self._pickable[row]):
            return False
        return bool((compiled.ranks[list(finding.by)] < compiled.ranks[row]).all())

    def _before(self, i: int) -> int:
        """The rows that the policy prefers to row i."""
        if self.compiled.ways is not None:
            preferred = self.compiled.ways.preferred_to(self.space.rows[i])
        else:
            preferred = (self.compiled.ranks > self.compiled.ranks[self.space.rows[i]]) & self._pickable
        return bitmask.to_int(bitmask.pack(preferred[list(self.space.rows)]))

    @cached_property
    def _resting(self) -> int:
        """The rows that rest after they were picked, when those that they come before have their turn."""
        ways = self.compiled.ways
        limited = self.compiled.picking.limited if ways is None else ways.resting
        return bitmask.int_of(np.flatnonzero(np.isin(self.space.rows, limited)).tolist())

    @cached_property
    def _pickable(self) -> NDArray[np.bool_]:
        """Whether each row may be picked at all."""
        return self.compiled.once(Choosing.of).pickable

    def _overlapping(self) -> Iterator[Finding]:
        for i, box in enumerate(self.space.boxes):
            self.progress.check()
            self._asked_of = i
            others = list(islice(self._joint(i, bitmask.rows_of(self._meeting(box) & ((1 << i) - 1))), MOST_JOINT))
            if others:
                cells = self.space.cells(self.space.sides_of(self._shared(i, others[0])), is_label=True)
                other = self._named(others[0], i)
                message = f'the policy is "{self._refusing}", and {other} can be valid at the same time: {cells_text(cells)}.'
                yield self._at(i, "policy-overlap", "error", message, bitmask.int_of(others))

    @property
    def _refusing(self) -> str:
        return next(policy for policy in sorted(self.compiled.policies) if POLICIES[policy].choose == "refuse")

    def _joint(self, i: int, others: Iterable[int]) -> Iterator[int]:
        """Those of some rows, which all share contexts with row i, that may be valid in one with it that can happen."""
        ways, rows = self.compiled.ways, self.space.rows
        for j in others:
            if self._pairs_left == 0:
                self._leave_open()
                return
            self._pairs_left -= 1
            if ways is not None and ways.policy_between(rows[i], rows[j]).choose != "refuse":
                continue
            if self.space.impossible or self.drawer is not None:
                shared = self._shared(i, j)
                if not (self._is_possible(shared) and self._was_seen(shared)):
                    continue
            yield j

    def _shared(self, i: int, j: int) -> Box:
        return tuple(a & b for a, b in zip(self.space.boxes[i], self.space.boxes[j], strict=True))

    def _is_possible(self, box: Box) -> bool:
        return not (self.space.impossible and self._covered(box, self._impossible))

    def _was_seen(self, box: Box) -> bool:
        """Whether draws, where they are needed, give a context of the box that can happen."""
        return self.drawer is None or self.drawer.may_happen(box, np.random.default_rng(0))

    def _covered(self, box: Box, by: int) -> bool:
        """Whether some boxes hold all of a box; "no" where that cannot be reported within the steps."""
        allowed = min(self.steps, max(200, self.steps // QUESTIONS))
        if self._questions is not None:
            return self._answered(self._questions, box, by & self._meeting(box), allowed)
        steps = Steps(allowed, self.progress)
        try:
            answer = self.boxes.outside(by, box, steps) is None
        except OutOfSteps:
            answer = False
            self._leave_open()
        self.steps -= allowed - steps.left
        return answer

    def _leave_open(self) -> None:
        """Take down that a question has no answer."""
        self.is_complete = False
        if self._asked_of is not None:
            self.unsure.add(self.space.rows[self._asked_of])

    @cached_property
    def _questions(self) -> Questions | None:
        """The core answers where boxes are many."""
        boxes = self.space.boxes + self.space.impossible
        if len(boxes) < MANY or not self.space.full:
            return None
        return Questions(boxes, self.space.full, self.progress)

    def _answered(self, questions: Questions, box: Box, by: int, allowed: int) -> bool:
        self.progress.check()
        if len(questions.boxes) <= QUICK_BOXES:
            try:
                return self.boxes.outside(by, box, Steps(QUICK, self.progress)) is None
            except OutOfSteps:
                pass
        step = STEP + int(STEP_A_BOX * len(questions.boxes))
        is_held, is_certain, done = questions.are_held(box, by, allowed * step) if by and allowed else (False, not by, 0)
        if not is_certain:
            self._leave_open()
        self.steps -= min(allowed, 1 + done // step)
        return is_held

    def _thinned(self, box: Box, by: int) -> int:
        """Boxes that together hold a box, without those that are not needed."""
        by &= self._meeting(box)
        if by.bit_count() <= MOST_CAUSES:
            for j in reversed(bitmask.rows_of(by)):
                if self._covered(box, by & ~(1 << j)):
                    by &= ~(1 << j)
        return by

    def _meeting(self, box: Box) -> int:
        holders = self.boxes.all
        for f, side in enumerate(box):
            if side != self.space.full[f]:
                if (f, side) not in self._met:
                    self._met[f, side] = self.boxes.meeting(f, side)
                holders &= self._met[f, side]
        return holders

    def _own_holder(self, i: int, box: Box) -> int | None:
        """The first row of the same asset that is valid wherever row i is, and elsewhere too; of very many the first few count."""
        others = (j for j in self._of_asset[self._asset(i)] if self.space.boxes[j] != box)
        return next((j for j in islice(others, MOST_SIBLINGS) if _holds(self.space.boxes[j], box)), None)

    @cached_property
    def _of_asset(self) -> dict[str, list[int]]:
        rows: dict[str, list[int]] = {}
        for i in range(len(self.space.boxes)):
            rows.setdefault(self._asset(i), []).append(i)
        return rows

    def _asset(self, i: int) -> str:
        return self.compiled.assets[self.space.rows[i]]

    def _first_holder(self, i: int, box: Box, equal: int) -> int | None:
        """The first row that is valid wherever row i is, and elsewhere too."""
        if self._questions is not None:
            holder = int(self._first_holders[i])
            return None if holder < 0 else holder
        over = self.boxes.all & ~self._impossible & ~equal
        for f, side in enumerate(box):
            if (f, side) not in self._held:
                self._held[f, side] = self.boxes.holding(f, side)
            over &= self._held[f, side]
            if not over:
                break
        return (over & -over).bit_length() - 1 if over else None

    @cached_property
    def _first_holders(self) -> NDArray[np.int64]:
        assert self._questions is not None
        progress, size = self.progress, self.progress.stop - self.progress.start
        ahead = progress.within(progress.part, progress.start + size * AHEAD / 2, progress.start + size * AHEAD)
        return self._questions.holders(len(self.space.boxes), ahead)

    def _named(self, i: int, of: int) -> str:
        return self._row_named(self.space.rows[i], self.space.rows[of])

    def _row_named(self, row: int, of: int) -> str:
        """A row in a sentence about another."""
        if self.table is None:
            return f"{row_name(row)} ({in_quotes(self.compiled.assets[row])})"
        return named(self.table, row, of)

    def _at(self, i: int, rule: str, level: Level, message: str, by: int = 0) -> Finding:
        return self._finding(rule, level, message, self.space.rows[i], tuple(self.space.rows[j] for j in bitmask.rows_of(by)))

    def _finding(self, rule: str, level: Level, message: str, row: int, by: tuple[int, ...] = ()) -> Finding:
        asset = self.compiled.assets[row]
        if self.table is None:
            return Finding(rule, level, message, self.compiled.name, row=row, asset=asset, by=by)
        place = self.table.place(row)
        return Finding(rule, level, message, self.table.name, place.file, row, asset, place.line, None, by)

    def _whole(self, rule: str, level: Level, message: str) -> Finding:
        file = str(self.table.path) if self.table is not None and self.table.path else None
        return Finding(rule, level, message, self.compiled.name, file)


def _holds(outer: Box, inner: Box) -> bool:
    return all(side & ~around == 0 for around, side in zip(outer, inner, strict=True))
