"""A table out of recorded pairs: the facts of a moment, and the asset that an old state machine played in it.

The pairs become few boxes (`contextdb.exchange.learned_boxes`), and a box becomes a row. Ends of ranges lie between the last number
inside and the next one outside, where the shortest decimal is: 2.5 between 2.4993 and 2.5004. Facts that decide nothing have no
column. Before, the same is done with four of five pairs, and the fifth tells how often the rows would say what was recorded.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from contextdb.bitmask import Flags
from contextdb.cells import intervals
from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.facts import read_fact_text
from contextdb.cells.grammar import format_cell
from contextdb.cells.intervals import wrap_angle
from contextdb.cells.sets import Accepted, Cell, NumberSet, TagSet, ValueSet
from contextdb.columns import TextColumn
from contextdb.covering.report import wilson
from contextdb.errors import ContextError, Fault, Place, TableError
from contextdb.exchange.learned_boxes import Feature, Ints, LearnedBox, learned_boxes
from contextdb.exchange.mapping import Mapped
from contextdb.exchange.reading import Reading
from contextdb.schema.settings import Schema, conditions_from_dict

MOST_PAIRS = 200_000
"""Of more pairs so many, evenly out of all of them, are learned from."""
HELD_OUT = 5
"""Each so many-th pair is held out."""
MOST_EXCEPTIONS = 1_000
MOST_DIGITS = 15

_PLAIN = re.compile(r"[+-]?[0-9]{1,15}(\.[0-9]{1,15})?")
"""A number that nothing but a number can be."""
_Row = tuple[int, list[Accepted | None]]
"""The number of an asset, and what each condition accepts."""


@dataclass(frozen=True, eq=False)
class Learned:
    """What was learned from a recording."""

    reading: Reading
    """The rows as a reading with a column for the asset and one for each condition that decides something."""
    columns: tuple[Mapped, ...]
    """What becomes of these columns."""
    idle: tuple[str, ...]
    """The conditions that decide nothing."""
    n_pairs: int
    n_missing: int
    """Pairs without an asset, or with a fact that is missing; they are left out."""
    exceptions: tuple[int, ...]
    """The rows of the recording of which the table says otherwise, at most so many."""
    n_exceptions: int
    held_out: float
    """Of the pairs that were held out the share whose asset is the only valid one."""
    baseline: float
    """The share that always the commonest asset would have."""
    is_worth_it: bool
    """Whether the rows say more than always the commonest asset, beyond chance."""


def learned(reading: Reading, mapped: Sequence[Mapped], schema: Schema) -> Learned:
    """What recorded pairs say. Raises TableError where a fact cannot be read, or there are no pairs."""
    facts = _Facts.of(reading, mapped, schema)
    numbers = facts.whole
    if len(numbers) > MOST_PAIRS:
        numbers = numbers[np.linspace(0, len(numbers) - 1, MOST_PAIRS).astype(np.int64)]
    if not len(numbers):
        raise TableError(Fault("there is no pair of facts and an asset.", "a row for each moment, and its asset"))
    tested = numbers[HELD_OUT - 1 :: HELD_OUT]
    trained = np.setdiff1d(numbers, tested) if len(tested) else numbers
    right = facts.said_right(facts.rows(trained), tested)
    commonest = np.bincount(facts.labels[trained]).argmax()
    baseline = float((facts.labels[tested] == commonest).mean()) if len(tested) else 1.0
    rows = facts.rows(numbers)
    wrong = facts.whole[~facts.said_right(rows, facts.whole)]
    table = facts.reading_of(rows)
    low, _ = wilson(int(right.sum()), len(right))
    return Learned(
        table,
        tuple(replace(c, source=c.name, cells=None, names=None) for c in facts.columns if c.name in table.names),
        tuple(c.name for c in facts.columns if c.name not in table.names),
        len(facts.whole),
        reading.n_rows - len(facts.whole),
        tuple(wrong[:MOST_EXCEPTIONS].tolist()),
        len(wrong),
        float(right.mean()) if len(right) else 0.0,
        baseline,
        bool(len(right)) and low > baseline,
    )


@dataclass(frozen=True, eq=False)
class _Fact:
    """The facts of one condition: a class for each row, and what the classes are."""

    condition: Condition
    features: tuple[Feature, ...]
    values: Sequence[object]
    """The value of each class, of what is no set of tags."""
    is_missing: Flags

    @classmethod
    def of(cls, column: TextColumn, condition: Condition) -> _Fact:
        read = [_fact(text, condition) for text in column.texts]
        is_missing = np.array([fact is None for fact in read], np.bool_)[column.codes]
        kind = condition.domain.type
        if kind.is_tags:
            sets = [fact if isinstance(fact, frozenset) else frozenset[str]() for fact in read]
            tags = sorted(frozenset[str]().union(*sets))
            flags = {tag: np.array([tag in own for own in sets], np.int64)[column.codes] for tag in tags}
            features = tuple(Feature(condition.name, flags[tag], 2, False, tag=tag) for tag in tags)
            return cls(condition, features, (), is_missing)
        values = sorted({fact for fact in read if fact is not None})  # type: ignore[type-var]
        number = {value: k for k, value in enumerate(values)}
        codes = np.array([number.get(fact, 0) for fact in read], np.int64)[column.codes]
        feature = Feature(condition.name, codes, max(1, len(values)), kind.is_numeric, kind.is_circular)
        return cls(condition, (feature,), values, is_missing)

    def accepts(self, sides: Sequence[Flags], cores: Sequence[Flags]) -> Accepted | None:
        """What a cell with these sides accepts; None for everything."""
        if all(side.all() for side in sides):
            return None
        if self.condition.domain.type.is_tags:
            words = [(f.tag or "", side) for f, side in zip(self.features, sides, strict=True) if not side.all()]
            return TagSet(frozenset(t for t, side in words if side[1]), frozenset(t for t, side in words if side[0]))
        [side], [core] = sides, cores
        if self.condition.domain.type.is_numeric:
            return _spans(side, core, np.array(self.values, np.float64), self.condition.domain)
        held = frozenset(v for v, is_in in zip(self.values, side.tolist(), strict=True) if is_in)
        return ValueSet(held)  # type: ignore[arg-type]

    def holds(self, accepts: Accepted | None, numbers: Ints) -> Flags:
        """Which of some rows have a fact that a set holds."""
        if isinstance(accepts, TagSet):
            flags = np.ones(len(numbers), np.bool_)
            for feature in self.features:
                has = feature.codes[numbers] == 1
                flags &= has if feature.tag in accepts.needs else ~has if feature.tag in accepts.bans else True
            return flags
        if isinstance(accepts, NumberSet):
            values = np.array(self.values, np.float64)
            held = np.logical_or.reduce([(values >= low) & (values <= high) for low, high in accepts.spans])
            return np.asarray(held[self.features[0].codes[numbers]])
        held = np.array([accepts is None or accepts.holds(value) for value in self.values], np.bool_)  # type: ignore[arg-type]
        return np.asarray(held[self.features[0].codes[numbers]])


@dataclass(frozen=True, eq=False)
class _Facts:
    """A recording as pairs of facts and an asset."""

    columns: tuple[Mapped, ...]
    facts: tuple[_Fact, ...]
    labels: Ints
    assets: Sequence[str]
    whole: Ints
    """The rows with an asset and every fact."""
    asset_column: str
    reading: Reading

    @classmethod
    def of(cls, reading: Reading, mapped: Sequence[Mapped], schema: Schema) -> _Facts:
        declared = {c.name: c.declared for c in mapped if c.is_new and c.job == "condition" and c.declared is not None}
        conditions = {**conditions_from_dict(declared), **schema.conditions}
        used = [c for c in mapped if c.job == "condition" and not conditions[c.name].expr]
        facts = tuple(_Fact.of(c.cells or reading.column(c.source), conditions[c.name]) for c in used)
        asset = next(column for column in mapped if column.job == "asset")
        texts = reading.column(asset.source)
        names = [text.strip() for text in texts.texts]
        assets = sorted({name for name in names if name})
        number = {name: i for i, name in enumerate(assets)}
        labels = np.array([number.get(name, -1) for name in names], np.int64)[texts.codes]
        is_whole = labels >= 0
        for fact in facts:
            is_whole &= ~fact.is_missing
        return cls((asset, *used), facts, labels, assets, np.flatnonzero(is_whole), asset.name, reading)

    @property
    def features(self) -> list[Feature]:
        return [feature for fact in self.facts for feature in fact.features]

    def _of(self, numbers: Ints) -> list[Feature]:
        return [replace(feature, codes=feature.codes[numbers]) for feature in self.features]

    def rows(self, numbers: Ints) -> list[_Row]:
        return [self._row(box) for box in learned_boxes(self._of(numbers), self.labels[numbers])]

    def _row(self, box: LearnedBox) -> _Row:
        cells, at = [], 0
        for fact in self.facts:
            stop = at + len(fact.features)
            cells.append(fact.accepts(box.sides[at:stop], box.cores[at:stop]))
            at = stop
        return box.label, cells

    def said_right(self, rows: Sequence[_Row], numbers: Ints) -> Flags:
        """Of which pairs the rows say the asset that was recorded, and no other: bool [len(numbers)]."""
        labels = self.labels[numbers]
        is_right, is_wrong = np.zeros(len(numbers), np.bool_), np.zeros(len(numbers), np.bool_)
        for label, cells in rows:
            inside = np.ones(len(numbers), np.bool_)
            for fact, accepts in zip(self.facts, cells, strict=True):
                inside &= fact.holds(accepts, numbers) if accepts is not None else True
            is_right |= inside & (labels == label)
            is_wrong |= inside & (labels != label)
        return is_right & ~is_wrong

    def reading_of(self, rows: Sequence[_Row]) -> Reading:
        """The rows as a table has them."""
        columns = [TextColumn.of(self.asset_column, [self.assets[label] for label, _ in rows])]
        for at, fact in enumerate(self.facts):
            if any(cells[at] is not None for _, cells in rows):
                texts = [format_cell(Cell(cells[at]), fact.condition.domain) for _, cells in rows]
                columns.append(TextColumn.of(fact.condition.name, texts))
        return Reading(tuple(columns), self.reading.format, schema=self.reading.schema)


def _fact(text: str, condition: Condition) -> object:
    """One value, as a query has it; None where it is missing."""
    kind = condition.domain.type
    if kind.is_numeric and not kind.is_spelt and _PLAIN.fullmatch(text) and not (kind.is_whole and "." in text):
        return wrap_angle(float(text)) if kind.is_circular else float(text) + 0.0
    try:
        fact = read_fact_text(text, condition)
    except ContextError as error:
        raise TableError(*(fault.at(Place(column=condition.name)) for fault in error.faults)) from None
    if isinstance(fact, Cell):
        problem = f"{text!r:.60} is a set of values."
        raise TableError(Fault(problem, "one value in each moment", place=Place(column=condition.name)))
    return fact


def _spans(side: Flags, core: Flags, values: NDArray[np.float64], domain: Domain) -> NumberSet:
    """Runs of numbers, with the shortest ends between what is in the core and what is outside; on the circle perhaps two."""
    numbers = np.flatnonzero(side)
    breaks = np.flatnonzero(np.diff(numbers) > 1)
    runs = zip(numbers[[0, *(breaks + 1)]].tolist(), numbers[[*breaks, -1]].tolist(), strict=True)
    lowest, highest = domain.ends if domain.type.is_circular else (-np.inf, np.inf)
    spans = []
    for first, last in runs:
        held = first + np.flatnonzero(core[first : last + 1])
        if len(held):
            low = lowest if first == 0 else _cut(values[first - 1], values[held[0]], domain)
            high = highest if last == len(values) - 1 else _end(values[held[-1]], values[last + 1], domain)
            spans.append((low, high))
    return NumberSet(domain.type.fitted(intervals.union(spans)), domain.type.is_circular)


def _cut(outside: float, inside: float, domain: Domain) -> float:
    """The shortest decimal above the one number, and not above the other."""
    if domain.type.is_whole:
        return inside
    for digits in range(MOST_DIGITS):
        scale = 10.0**digits
        cut = round(np.ceil(inside * scale - 1e-9) / scale, digits)
        for near in (cut, round(cut - 1.0 / scale, digits)):
            if outside < near <= inside:
                return float(near)
    return inside


def _end(inside: float, outside: float, domain: Domain) -> float:
    """Where a range ends: at its last number where that is as short as the next cut, else just below the cut."""
    if domain.type.is_whole:
        return inside
    cut = _cut(inside, outside, domain)
    return inside if _n_digits(inside) <= _n_digits(cut) else intervals.below(cut)


def _n_digits(number: float) -> int:
    return len(repr(number).rstrip("0").partition(".")[2])
