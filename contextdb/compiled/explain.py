"""Why a row is valid for a context, or is not: which of its cells fail, with which fact, and what to change.

Winner first: valid rows are before all others, then the rows nearest to valid, with the fewest failing cells. The details of a
row are worked out when they are asked for.
"""

from __future__ import annotations

import decimal
import math
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Rows, Words
from contextdb.cells import intervals
from contextdb.cells.arguments import require_place, require_row, require_text, require_whole
from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.facts import Context, Fact, Unknown, describe
from contextdb.cells.grammar import format_cell, parse_cell, reads
from contextdb.cells.notebook import as_html, one_line
from contextdb.cells.sets import Accepted, Cell, NumberSet, TagSet, ValueSet, covers, union
from contextdb.cells.words import NUMBER_TEXT
from contextdb.compiled.classes import ColumnMasks, NumberMasks, WideMasks, column_masks
from contextdb.compiled.data import CompiledData
from contextdb.compiled.layers import Layers, bits_of
from contextdb.compiled.matches import Matches
from contextdb.compiled.ways import Step
from contextdb.errors import plural

if TYPE_CHECKING:
    from contextdb.compiled.failing_rules import RulePart
    from contextdb.expressions.rules import WhenRules

FEW_DIGITS = 12
"""A number of more characters than this is the work of rounding, not of a person: 29.990000000000002."""

ROUNDED_DIGITS = 4

EVERY_VALUE = (
    ValueSet(frozenset(), True),
    ValueSet(frozenset((False, True))),
    NumberSet(intervals.EVERYTHING),
    NumberSet((intervals.CIRCLE,), is_circular=True),
)
"""What a cell says as Any."""

ONE_BOUND = 1e-12
"""Bounds that are closer than this share of their size are those of one number: it and the double after it."""


@dataclass(frozen=True, slots=True)
class Failure:
    """One cell that does not accept its fact, or a rule that does not hold.

    For a rule, `condition` is the column of rules, `fact` gives the facts that it names, and `mend` is to have no rule.
    """

    condition: str
    cell: str
    """The cell as the table writes it."""
    fact: str
    mend: str
    """The cell with which the row would match, as near to the present one as can be."""
    step: Step | None = None
    """Where tables are in tables: the row of the table whose cell it is."""

    def __str__(self) -> str:
        where = "" if self.step is None else f" ({self.step})"
        return f"{self.condition} is {self.fact}, the cell says {self.cell}{where}"


@dataclass(frozen=True, slots=True)
class RowExplanation:
    """One row for a context."""

    row: int
    asset: str
    is_enabled: bool
    failures: tuple[Failure, ...]

    @property
    def is_valid(self) -> bool:
        """Whether the row is valid."""
        return self.is_enabled and not self.failures

    def __str__(self) -> str:
        if self.is_valid:
            return f"{self.asset}: valid"
        reasons = [str(f) for f in self.failures] + ([] if self.is_enabled else ["the row is disabled"])
        return f"{self.asset}: " + "; ".join(reasons)


class Explanation:
    """All rows for one context, in order: valid ones, then the nearest. Iterate, index, or ask for one row or asset."""

    def __init__(self, compiled: CompiledData, facts: dict[str, Fact], unknown: Unknown, matches: Matches) -> None:
        self.compiled = compiled
        """The table."""
        self.facts = facts
        """The facts in canonical form."""
        self.matches = matches
        """The answer explained."""
        self._unknown = unknown

    def __len__(self) -> int:
        return self.compiled.n_rows

    def __iter__(self) -> Iterator[RowExplanation]:
        return (self.row(r) for r in self._order.tolist())

    def __getitem__(self, place: int) -> RowExplanation:
        return self.row(int(self._order[require_place(place, len(self), "place")]))

    def row(self, row: int) -> RowExplanation:
        """Why this row is valid or not; raises NoSuchPlace, also an IndexError, for a row that the table does not have."""
        row = require_row(row, len(self))
        at = np.flatnonzero(self._fails[:, row]).tolist()
        failures = [failure for i in at for failure in self._failures(i, row)]
        if self.breaks_rule[row]:
            failures += self._rule_failures(row)
        return RowExplanation(row, self.compiled.assets[row], bool(self._enabled[row]), tuple(failures))

    def asset(self, asset: str) -> list[RowExplanation]:
        """Why the rows of this asset, with or without its path, are valid or not. Raises ContextError, with the nearest asset,
        where no row has it."""
        require_text(asset, "asset")
        names = zip(self.compiled.assets, self.compiled.leaves, strict=True)
        rows = [self.row(r) for r, (path, leaf) in enumerate(names) if asset in (path, leaf)]
        if not rows:
            raise self.compiled.answering.no_asset(asset)
        return rows

    def nearest(self, most: int = 5) -> list[RowExplanation]:
        """The nearest rows that are not valid: those with the fewest failing cells first, then the smallest distance.

        Raises ContextError where `most` is no whole number.
        """
        most = require_whole(most, "most")
        rows = np.flatnonzero(self._n_failures)
        if most <= 0:
            return []
        if most < len(rows):  # how far off a row is need be known only of those that may be among the nearest
            limit = np.partition(self._n_failures[rows], most - 1)[most - 1]
            rows = rows[self._n_failures[rows] <= limit]
        return [self.row(r) for r in self._sorted(rows)[:most].tolist()]

    def roles(self, row: int) -> dict[str, str] | None:
        """Who plays each role in the best casting of a valid row; None without actors. With actors, raises what `casting` of an
        answer raises."""
        return None

    @cached_property
    def undecided(self) -> int:
        """The valid rows that only may be so, as bits: they match for some values of set-valued facts only, or their rule is open
        for want of a fact."""
        always = bitmask.to_int(self.matches.always)
        return self.matches.bits & ~self.decided(always)

    def decided(self, always: int) -> int:
        """Of rows whose cells match for every value, as bits, those whose rule does too, and is not open. Never fails."""
        when = self.compiled.when
        return always if when is None else when.left_with_care(always, always, self.facts, "never")[1]

    @cached_property
    def _n_failures(self) -> NDArray[np.int64]:
        """How many cells of each row fail: int64 [n_rows]; a rule counts as one, and a disabled row one more."""
        totals = self._fails.sum(axis=0, dtype=np.int64) + self.breaks_rule + ~self._enabled
        for at, layers in enumerate(() if self.compiled.ways is None else self.compiled.ways.layers):
            if layers is not None and self._fails[at].any():
                condition = self.compiled.conditions[at]
                totals += np.where(self._fails[at], _n_failing(layers, self.facts[condition.name], condition.domain) - 1, 0)
        if self.compiled.ways is not None and self.compiled.ways.rules is not None:
            rows = np.flatnonzero(self.breaks_rule)
            totals[rows] += np.array([sum(1 for _ in self._rule_failures(row)) - 1 for row in rows.tolist()], np.int64)
        return bitmask.read_only(totals)

    @cached_property
    def _order(self) -> Rows:
        """Row numbers, valid ones first, then by failing cells, how far the facts are off, and place in the file: int64
        [n_rows]."""
        return bitmask.read_only(self._sorted(np.arange(self.compiled.n_rows)))

    def __str__(self) -> str:
        lines = [f"{len(self.matches)} of {plural(self.compiled.n_rows, 'row')} valid"]
        return "\n".join(lines + [str(r) for r, _ in zip(self, range(10), strict=False)])

    def __repr__(self) -> str:
        return one_line("Explanation", self.compiled.name, f"{len(self.matches):,} of {plural(self.compiled.n_rows, 'row')} valid")

    def _repr_html_(self) -> str:
        rows = ((r.asset, "valid" if r.is_valid else str(r).removeprefix(f"{r.asset}: ")) for r in self)
        return as_html(repr(self), ("asset", "why not"), rows, len(self))

    @cached_property
    def _enabled(self) -> NDArray[np.bool_]:
        return bitmask.unpack(self.compiled.enabled, self.compiled.n_rows)

    def failing(self, rows: Rows) -> NDArray[np.bool_]:
        """Which cells of some rows fail: bool [rows, conditions], the conditions in the order of the table. Never fails."""
        words, shifts = self.accepted[:, rows >> 6], (rows & 63).astype(np.uint64)
        fails: NDArray[np.bool_] = ((words >> shifts) & np.uint64(1) == 0).T
        return fails

    @cached_property
    def accepted(self) -> Words:
        """The rows whose cell of a condition accepts some value of its fact: uint64 [conditions, W]."""
        return self.compiled.accepting(self.facts, self._unknown)

    @cached_property
    def _fails(self) -> NDArray[np.bool_]:
        """Whether the cell of a condition fails: bool [conditions, n_rows]."""
        return ~bitmask.unpack(self.accepted, self.compiled.n_rows)

    @cached_property
    def breaks_rule(self) -> NDArray[np.bool_]:
        """Whether each row has a rule that does not hold: bool [n_rows]; an open one only where it is not ignored."""
        when = self.compiled.when
        return self._flags(0 if when is None else self._broken_rules(when))

    def _broken_rules(self, when: WhenRules) -> int:
        left, _ = when.left_with_care(when.rows, when.rows, self.facts, "any" if self._unknown == "any" else "never")
        return when.rows & ~left

    def _flags(self, bits: int) -> NDArray[np.bool_]:
        return bitmask.read_only(bitmask.unpack(bitmask.from_int(bits, self.compiled.n_rows), self.compiled.n_rows))

    @property
    def _lenient(self) -> Unknown:
        return "any" if self._unknown == "any" else "never"

    def _rule_failures(self, row: int) -> Iterator[Failure]:
        from contextdb.compiled.failing_rules import rules_that_fail
        from contextdb.expressions.rules import facts_text

        for is_open, part in rules_that_fail(self.compiled, row, self.facts, self._lenient):
            yield rule_failure(part, f"{'open' if is_open else 'false'} with {facts_text(part.rule, self.facts)}")

    def _sorted(self, rows: Rows) -> Rows:
        return rows[np.lexsort((self._distances(rows), self._n_failures[rows]))]

    def _distances(self, rows: Rows) -> NDArray[np.float64]:
        """How far the failing facts are off, summed: float64 [len(rows)]; a number by its share of the domain, at most 1; others
        1."""
        far = np.zeros(len(rows))
        for at, condition in enumerate(self.compiled.conditions):
            fails, fact = self._fails[at, rows], self.facts[condition.name]
            if fails.any():
                far[fails] += self._column_distances(at, fact, rows[fails]) if isinstance(fact, float) else 1.0
        return far + self.breaks_rule[rows]

    def _column_distances(self, at: int, fact: float, rows: Rows) -> NDArray[np.float64]:
        column, condition = self.compiled.texts[at], self.compiled.conditions[at]
        width = _width(condition, self.compiled.masks[at])
        codes, which = np.unique(column.codes[rows], return_inverse=True)
        is_single = self.compiled.ways is None  # of tables in tables no text need be one cell; all are read together
        cells = [parse_cell(column.texts[c], condition.domain) if is_single else self.compiled.cells(at)[c] for c in codes.tolist()]
        return np.array([_distance(c.accepts, fact, width) for c in cells], np.float64)[which]

    def _failures(self, at: int, row: int) -> Iterator[Failure]:
        condition = self.compiled.conditions[at]
        fact = self.facts[condition.name]
        yield from cell_failures(self.compiled, at, row, fact, _with_unit(told_fact(self.compiled, at, fact), condition))


def explain(compiled: CompiledData, context: Context, unknown: Unknown = "error") -> Explanation:
    """Explain every row of a table for one context; raises ContextError as `query` does."""
    return Explanation(compiled, compiled.read_context(context, unknown), unknown, compiled.query(context, unknown=unknown))


def rule_failure(part: RulePart, fact: str) -> Failure:
    """That a rule does not hold, with what is known of its facts."""
    return Failure(part.column, part.text, fact, "Any", part.step)


def cell_failures(compiled: CompiledData, at: int, row: int, fact: Fact, fact_text: str) -> Iterator[Failure]:
    """The cell of a row that does not accept a fact; where tables are in tables, each cell that does not."""
    condition = compiled.conditions[at]
    layers = None if compiled.ways is None else compiled.ways.layers[at]
    if compiled.ways is None or layers is None:
        text = compiled.texts[at][row]
        yield Failure(condition.name, text, fact_text, mended(text, fact, condition.domain))
        return
    steps = compiled.ways.steps(row)
    pairs = [(steps[depth], text) for depth, text in layers.said(row)]
    failing = [(step, text) for step, text in pairs if not _lets_pass(text, fact, condition.domain)]
    for step, text in failing or pairs[1:]:  # where each holds some value of a set-valued fact, all but one must hold the set
        yield Failure(condition.name, text, fact_text, mended(text, fact, condition.domain), step)


def _n_failing(layers: Layers, fact: Fact, domain: Domain) -> NDArray[np.int64]:
    """How many cells of each row's way do not accept a fact, for rows in which some do not: int64 [n_rows]; see `cell_failures`."""
    fails = np.array([bool(text) and not _lets_pass(text, fact, domain) for text in layers.texts])
    combinations, which = layers.combined
    n_failing, n_said = fails[combinations].sum(axis=0), (combinations > 0).sum(axis=0)
    totals: NDArray[np.int64] = np.where(n_failing > 0, n_failing, n_said - 1).astype(np.int64)[which]
    return totals


def _lets_pass(text: str, fact: Fact, domain: Domain) -> bool:
    """Whether a cell alone lets its row be valid."""
    return bool(bits_of(column_masks([parse_cell(text, domain)], np.zeros(1, np.int32), domain), fact)[0])


def describe_fact(fact: Fact, condition: Condition) -> str:
    """A fact in canonical form as people write it; a set as a cell."""
    if isinstance(fact, Cell):
        return format_cell(fact, condition.domain)
    return describe(fact, condition.domain)


def told_fact(compiled: CompiledData, at: int, fact: Fact) -> str:
    """A fact as `describe_fact` says it; a number of many digits, as a game computes it, in the fewest from four on with which all
    cells of its column say what they say with the fact."""
    condition, masks = compiled.conditions[at], compiled.masks[at]
    if isinstance(masks, (NumberMasks, WideMasks)) and isinstance(fact, float) and compiled.ways is None:
        fact = _in_few_digits(fact, masks, condition.domain)
    return describe_fact(fact, condition)


def _in_few_digits(fact: float, masks: NumberMasks | WideMasks, domain: Domain) -> float:
    """A number in the fewest digits that leave it in its class; itself where people write it so, and a date."""
    if len(repr(fact)) <= FEW_DIGITS or not math.isfinite(fact) or domain.type.is_whole:
        return fact
    ends = (-180.0, 180.0) if domain.type.is_circular else (-math.inf, math.inf)
    rounded = (float(f"{fact:.{digits}g}") for digits in range(ROUNDED_DIGITS, 17))
    same = (each for each in rounded if masks.codes(each) == masks.codes(fact) and ends[0] < each < ends[1])
    return next(same, fact)


def mended(text: str, fact: Fact, domain: Domain) -> str:
    """The cell that holds what `text` says and the fact, or all values of a set-valued one; in few digits where that can be."""
    accepts = parse_cell(text, domain).accepts
    if isinstance(accepts, NumberSet) and isinstance(fact, float):
        fact = _rounded_outwards(fact, accepts, domain)
    wider = widened(accepts, fact)
    mend = format_cell(Cell(wider), domain)
    if not (isinstance(accepts, NumberSet) and isinstance(fact, float)) or _most_digits(mend) <= FEW_DIGITS:
        return mend
    low, high = (end if end == fact else _shortened(end, accepts) for end in _stretch(accepts, fact))
    write = domain.type.spelling.write
    in_old_words = f"{text} | {write(low)}..{write(high)}"
    is_same = reads(in_old_words, domain) and parse_cell(in_old_words, domain).accepts == wider
    return min((mend, in_old_words), key=_most_digits) if is_same else mend


def _rounded_outwards(fact: float, accepts: NumberSet, domain: Domain) -> float:
    """A number of many digits, as a game computes them, in four, away from the set; itself where that would be far, or no fact."""
    if len(repr(fact)) <= FEW_DIGITS or fact == 0.0 or not math.isfinite(fact) or not accepts.spans:
        return fact
    low, high = _stretch(accepts, fact)
    away = decimal.Context(ROUNDED_DIGITS, decimal.ROUND_FLOOR if fact == low else decimal.ROUND_CEILING)
    outer = float(away.create_decimal_from_float(fact))
    is_near = abs(outer - fact) < _gap(high if fact == low else low, fact, accepts.is_circular)
    is_fact = domain.minimum <= outer <= domain.maximum and not (accepts.is_circular and abs(outer) >= 180.0)
    return outer if is_near and is_fact else fact


def widened(accepts: Accepted | None, fact: Fact) -> Accepted | None:
    """The smallest change of a cell's set so that it holds the fact; None (Any) where there is no small one."""
    if isinstance(fact, Cell):
        return _joined(accepts, fact.accepts)
    if isinstance(accepts, NumberSet) and isinstance(fact, float):
        stretch = _stretch(accepts, fact)
        added = intervals.arc(*stretch) if accepts.is_circular else (stretch,)
        return _joined(accepts, NumberSet(added, accepts.is_circular))
    if isinstance(accepts, ValueSet) and isinstance(fact, (bool, str)):
        return _joined(accepts, ValueSet(frozenset((fact,))))
    if isinstance(accepts, TagSet) and isinstance(fact, frozenset) and not accepts.is_complement:
        needs = frozenset(t for t in accepts.needs if covers(t, fact))
        bans = frozenset(t for t in accepts.bans if not covers(t, fact))
        return TagSet(needs, bans) if needs or bans else None
    return None


def _joined(one: Accepted | None, other: Accepted | None) -> Accepted | None:
    """The values of both sets; None (Any) where they are all values, or no set that a cell can say."""
    if one is None or other is None or isinstance(one, TagSet) or isinstance(other, TagSet):
        return None
    both = union(one, other)
    return None if both in EVERY_VALUE else both


def _stretch(accepts: NumberSet, fact: float) -> intervals.Span:
    """From the nearest end of the set to the fact, or back where that is upwards; the fact alone where the set is empty."""
    ends = [end for span in accepts.spans for end in span] or [fact]
    near = min(ends, key=lambda end: (_gap(end, fact, accepts.is_circular), end if fact < 0.0 else -end))
    low, high = min(near, fact), max(near, fact)
    return (high, low) if accepts.is_circular and high - low > 180.0 else (low, high)


def _most_digits(text: str) -> int:
    """How long the longest number in a cell is."""
    return max(map(len, re.findall(NUMBER_TEXT, text)), default=0)


def _shortened(end: float, accepts: NumberSet) -> float:
    """A number of few digits that the set holds, next to its end; the end itself where there is none."""
    short = round(end, FEW_DIGITS - 4)
    return short if accepts.holds(short) else end


def _gap(end: float, fact: float, is_circular: bool) -> float:
    gap = abs(end - fact)
    return min(gap, 360.0 - gap) if is_circular else gap


def _width(condition: Condition, masks: ColumnMasks) -> float:
    """What a number's distance is measured by: its domain, else the spread of the column's bounds."""
    domain = condition.domain
    if domain.type.is_circular:
        return 180.0
    if np.isfinite(domain.maximum - domain.minimum):
        return domain.maximum - domain.minimum or 1.0
    bounds = masks.bound_list if isinstance(masks, (NumberMasks, WideMasks)) else []
    spread = min(bounds[-1] - bounds[0], sys.float_info.max) if bounds else 0.0
    return spread if bounds and spread > abs(bounds[0]) * ONE_BOUND else 1.0


def _distance(accepts: Accepted | None, fact: float, width: float) -> float:
    if not isinstance(accepts, NumberSet) or not accepts.spans:
        return 1.0
    gaps = [_gap(end, fact, accepts.is_circular) for span in accepts.spans for end in span]
    return min(min(gaps) / width, 1.0) if not np.isinf(fact) else 1.0


def _with_unit(text: str, condition: Condition) -> str:
    return f"{text} {condition.unit}" if condition.unit and text != "(missing)" else text
