"""The space of contexts of a table, and its rows as boxes in it.

F factors (`contextdb.covering.factors`) make up the space: one for each condition, for tags one for each group of tags that hang
together. A box holds for each factor the set of classes that it accepts, as a Python integer. Soft cells accept everything; rows
that are disabled, or that accept no context at all, are no boxes. The measure of a box is the product of its factors' weights.

Boxes say which contexts are valid exactly; that facts of several conditions, derived ones too, come independently of each other is
assumed, but for the contexts named as impossible.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain, compress
from operator import ne

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.cells.arguments import require_many, require_mapping, require_text
from contextdb.cells.conditions import Condition
from contextdb.cells.grammar import format_cell, parse_cell
from contextdb.cells.plain_ends import plain
from contextdb.cells.sets import Accepted, Cell, NumberSet, TagMeet, TagSet
from contextdb.compiled.data import CompiledData
from contextdb.covering.factors import Factor, NumberFactor, TagFactor, ValueFactor, tag_factors, weighted
from contextdb.covering.numbered import NumberedBoxes
from contextdb.covering.progress import SILENT, Progress
from contextdb.errors import ContextError, Fault, Place, TableError, in_quotes, no_such, plural
from contextdb.schema.policies import decided_by

_WEIGHTS = "a mapping of conditions to mappings of cells to numbers"

MOST_COUNTED = 1 << 48
"""The most steps, samples or gaps."""
MOST_COMPARED = 1 << 37
"""Rows × rows × conditions of a table all of whose rows are compared with each other: seconds."""
MOST_HELD = 1 << 31
"""Rows × the different cells of all columns, of a table that fits into memory: a bit for each."""
MOST_SIDES = 1 << 27
"""The squares of how many different cells each column has, added up, of a table of any number of rows."""
SMALLEST = math.ulp(0.0)

Box = tuple[int, ...]
Sides = Mapping[int, int]
"""A box by the factors that it restricts, ascending: of each the set of classes that it accepts. It accepts every class of the
others, so that it costs what it says and not what the table has columns."""
CellBox = Mapping[str, Cell | str]
WeightsOf = Mapping[str, Mapping[object, float]]


@dataclass(frozen=True, eq=False)
class Space:
    """Factors, and the rows and impossible contexts as boxes."""

    conditions: tuple[Condition, ...]
    factors: tuple[Factor, ...]
    of_condition: tuple[tuple[int, ...], ...]
    """For each condition the numbers of its factors."""
    rows: tuple[int, ...]
    """The row of each box of `boxes`, ascending."""
    boxes: tuple[Box, ...]
    impossible: tuple[Box, ...]
    weighted: tuple[str, ...] = ()
    """The conditions whose weights were given."""
    is_strict: bool = False
    """Whether two valid rows are an error: then cells are written to the last bit, however many digits that takes."""
    n_left: int = 0
    """Enabled rows that are no boxes because the table is too large."""

    @classmethod
    def of(
        cls,
        compiled: CompiledData,
        impossible: Sequence[CellBox] = (),
        weights: WeightsOf | None = None,
        progress: Progress = SILENT,
        most_rows: int | None = None,
    ) -> Space:
        """The space of a compiled table, or of its first rows; see `contextdb.covering.coverage` for the arguments."""
        boxes = require_many(impossible, "impossible", "a list of mappings of conditions to cells")
        excluded = [_read_box(box, compiled.conditions) for box in boxes]
        shares = {} if weights is None else require_mapping(weights, "weights", _WEIGHTS)
        given = {name: _read_weights(name, parts, compiled.conditions) for name, parts in shares.items()}
        factors: list[Factor] = []
        of_condition: list[tuple[int, ...]] = []
        for at, condition in enumerate(compiled.conditions):
            progress.check()
            is_text = condition.domain.type.is_open  # its values are those that cells name, soft ones too
            cells = [compiled.cells(at)[code] for code in _codes_of(compiled, at, most_rows)]
            accepted = [c.accepts for c in cells if c.accepts is not None and (is_text or not c.is_soft)]
            accepted += [cell.accepts for box in excluded for name, cell in box.items() if name == condition.name and cell.accepts]
            accepted += [cell.accepts for cell in given.get(condition.name, {}) if cell.accepts]
            new = factors_of(accepted, condition, given.get(condition.name))
            of_condition.append(tuple(range(len(factors), len(factors) + len(new))))
            factors += new
        space = cls(
            compiled.conditions,
            tuple(factors),
            tuple(of_condition),
            (),
            (),
            (),
            tuple(given),
            is_strict=decided_by("refuse", compiled.policies),
        )
        return space._with_boxes(compiled, excluded, progress, most_rows)

    def _with_boxes(
        self, compiled: CompiledData, excluded: Sequence[Mapping[str, Cell]], progress: Progress, most_rows: int | None
    ) -> Space:
        columns: list[dict[int, tuple[int, ...]]] = []
        for at in range(len(self.conditions)):
            progress.check()
            cells = compiled.cells(at)
            used = _codes_of(compiled, at, most_rows)
            columns.append({code: self.sides(at, None if cells[code].is_soft else cells[code].accepts) for code in used})
        codes = [compiled.texts[at].codes[:most_rows].tolist() for at in range(len(self.conditions))]
        added: list[tuple[int, Box]] = []
        n_factors = len(self.factors)  # a cell of tags that accepts nothing has one side too many
        enabled = np.flatnonzero(bitmask.unpack(compiled.enabled, compiled.n_rows))
        for row in enabled[: None if most_rows is None else int(np.searchsorted(enabled, most_rows))].tolist():
            progress.check()
            own = [columns[at][codes[at][row]] for at in range(len(columns))]
            box = tuple(chain.from_iterable(own))
            if 0 not in box and len(box) == n_factors:
                added.append((row, box))
        impossible = [self.box(cells) for cells in excluded]
        rows, boxes = tuple(r for r, _ in added), tuple(b for _, b in added)
        return Space(
            self.conditions,
            self.factors,
            self.of_condition,
            rows,
            boxes,
            tuple(dict.fromkeys(b for b in impossible if b is not None)),
            self.weighted,
            self.is_strict,
            0 if most_rows is None else int((enabled >= most_rows).sum()),
        )

    def first(self, n_boxes: int) -> Space:
        left = self.n_left + max(0, len(self.boxes) - n_boxes)
        return replace(self, rows=self.rows[:n_boxes], boxes=self.boxes[:n_boxes], n_left=left)

    def _is_void(self, sides: Sequence[int], at: int) -> bool:
        """Whether a cell of tags accepts nothing where the condition has no factor to say so."""
        return len(sides) != len(self.of_condition[at])

    @cached_property
    def full(self) -> Box:
        return tuple((1 << len(f.weights)) - 1 for f in self.factors)

    def sides(self, at: int, accepts: Accepted | None) -> tuple[int, ...]:
        """The sides of a cell of condition number `at`, one for each of its factors; one 0 too many where nothing is accepted."""
        numbers = self.of_condition[at]
        full = self.full[numbers[0] : numbers[-1] + 1] if numbers else ()
        if accepts is None:
            return full
        if accepts.is_empty:
            return tuple(0 for _ in numbers) or (0,)
        if not isinstance(accepts, TagSet):
            return tuple(self._side(f, accepts) for f in numbers)
        sides = list(full)  # a tag restricts its own factor only
        for f in {self._of_tag[at][tag] for tag in tags_of(accepts) if tag in self._of_tag[at]}:
            sides[f - numbers[0]] = self._side(f, accepts)
        return tuple(sides)

    @cached_property
    def _of_tag(self) -> dict[int, dict[str, int]]:
        """For each condition of tags the factor of each tag."""
        return {
            at: {tag: f for f in numbers for tag in self.factors[f].tags}  # type: ignore[union-attr]
            for at, numbers in enumerate(self.of_condition)
            if self.conditions[at].domain.type.is_tags
        }

    def _side(self, f: int, accepts: Accepted) -> int:
        factor = self.factors[f]
        if isinstance(factor, TagFactor) and isinstance(accepts, TagSet) and accepts.is_complement:
            return factor.classes(accepts) if (accepts.needs | accepts.bans) <= frozenset(factor.tags) else self.full[f]
        return factor.classes(accepts)

    def box(self, cells: Mapping[str, Cell]) -> Box | None:
        """The box of some cells; None where it holds nothing."""
        sides: list[int] = []
        for at, condition in enumerate(self.conditions):
            cell = cells.get(condition.name)
            own = self.sides(at, None if cell is None else cell.accepts)
            if self._is_void(own, at) or 0 in own:
                return None
            sides += own
        return tuple(sides)

    def sides_of(self, box: Box) -> Sides:
        """A box by the factors that it restricts."""
        return {f: box[f] for f in compress(range(len(box)), map(ne, box, self.full))}

    @cached_property
    def numbered(self) -> NumberedBoxes:
        """The rows' boxes by the numbers of their sides."""
        return NumberedBoxes.of(self.full, self.boxes)

    @cached_property
    def volumes(self) -> NDArray[np.float64]:
        """The measure of each row's box: float64 [boxes]; see `volume`."""
        volumes, is_something = np.ones(len(self.boxes)), np.ones(len(self.boxes), np.bool_)
        for f, own in enumerate(self.numbered.sides):
            weights = np.array([1.0 if side == self.full[f] else weight_of(self.factors[f], side) for side in own])
            volumes *= weights[self.numbered.numbers[f]]
            is_something &= (weights > 0.0)[self.numbered.numbers[f]]
        return np.where((volumes == 0.0) & is_something, SMALLEST, volumes)

    @cached_property
    def n_fitting(self) -> int:
        """So many boxes fit into memory as bits, one for each class."""
        return max(1, MOST_HELD // max(1, sum(len(f.weights) for f in self.factors)))

    @property
    def is_fitting(self) -> bool:
        """Whether all rows do: else none is searched or counted, and samples are looked up in some of them at a time."""
        return len(self.boxes) <= self.n_fitting

    @cached_property
    def condition_of(self) -> tuple[int, ...]:
        return tuple(at for at, numbers in enumerate(self.of_condition) for _ in numbers)

    def cells(self, sides: Sides, is_label: bool = False) -> dict[str, str]:
        """A box as cells, without the conditions that it does not restrict; see `written`."""
        limited = dict.fromkeys(self.condition_of[f] for f in sides)
        accepted = ((at, self.accepted(at, sides)) for at in limited)
        return {self.conditions[at].name: self.written(at, accepts, is_label) for at, accepts in accepted if accepts is not None}

    def written(self, at: int, accepts: Accepted, is_label: bool = False) -> str:
        """A set of classes of condition number `at` as a cell, its ends as people write them; a row that gets it holds the set.

        A label is read by people only, so that it may leave out what comes of rounding.
        """
        if isinstance(accepts, NumberSet) and (is_label or not self.is_strict):
            factor = self.factors[self.of_condition[at][0]]
            assert isinstance(factor, NumberFactor)
            accepts = plain(accepts, factor.cuts, keeps_all=not is_label)
        return format_cell(Cell(accepts), self.conditions[at].domain)

    def accepted(self, at: int, sides: Sides) -> Accepted | None:
        """What a box accepts of condition number `at`; None for everything."""
        limited = [f for f in self.of_condition[at] if f in sides]
        if not limited:
            return None
        if not self.conditions[at].domain.type.is_tags:
            return self.factors[limited[0]].accepts(sides[limited[0]])
        parts = [self.factors[f].accepts(sides[f]) for f in limited]
        tags = [p for p in parts if isinstance(p, TagSet)]
        return TagSet(frozenset().union(*(p.needs for p in tags)), frozenset().union(*(p.bans for p in tags)))

    def volume(self, sides: Sides) -> float:
        """The measure of a box; the smallest number there is, where it is less than that and not 0."""
        share = 1.0
        for f, side in sides.items():
            if (f, side) not in self._weights:
                self._weights[f, side] = weight_of(self.factors[f], side)
            share *= self._weights[f, side]
        return share or (SMALLEST if all(self._weights[side] for side in sides.items()) else 0.0)

    @cached_property
    def _weights(self) -> dict[tuple[int, int], float]:
        """The shares of sides that were requested."""
        return {}

    @property
    def assumed(self) -> dict[str, str]:
        """What had to be assumed of each condition that is not fully declared."""
        return {
            self.conditions[at].name: text
            for at, numbers in enumerate(self.of_condition)
            if (text := "; ".join(t for f in numbers if (t := self.factors[f].assumed)))
        }


def comparable_rows(compiled: CompiledData) -> int:
    """How many rows of a table, from the first on, may be compared with each other without growing out of time or memory."""
    n_rows = min(compiled.n_rows, math.isqrt(MOST_COMPARED // max(1, len(compiled.conditions))))
    while n_rows > 1 and n_rows * _n_cells(compiled, n_rows) > MOST_HELD:
        n_rows //= 2
    return n_rows


def require_comparable(compiled: CompiledData, is_sampled: bool = False) -> None:
    """Raise TableError where the bits of a table's rows, or for samples those of its cells, would not fit into memory."""
    n_cells = _n_cells(compiled, compiled.n_rows)
    n_sides = sum(len(compiled.cells(at)) ** 2 for at in range(len(compiled.conditions)))
    if compiled.n_rows * n_cells > MOST_HELD and not (is_sampled and n_sides <= MOST_SIDES):
        size = f"{plural(compiled.n_rows, 'row')} x "
        problem = f"the table {in_quotes(compiled.name)} is too large to compare its rows with each other: {size}"
        others = "coverage samples more where columns have few different cells, and check compares the first rows"
        accepted = f"rows times different cells up to {MOST_HELD:,}; {others}"
        raise TableError(Fault(f"{problem}{plural(n_cells, 'different cell')}.", accepted))


def _n_cells(compiled: CompiledData, n_rows: int) -> int:
    return sum(len(_codes_of(compiled, at, n_rows)) for at in range(len(compiled.conditions)))


def _codes_of(compiled: CompiledData, at: int, most_rows: int | None) -> Sequence[int]:
    """The codes of a condition's cells that the first rows use; of all rows those that no row uses, too."""
    texts = compiled.texts[at]
    if most_rows is None or most_rows >= compiled.n_rows:
        return range(len(compiled.cells(at)))
    return [int(code) for code in np.unique(texts.codes[:most_rows])]


def tags_of(accepts: TagSet) -> frozenset[str]:
    """Every tag that a set of sets of tags names."""
    parts = accepts.parts if isinstance(accepts, TagMeet) else (accepts,)
    return frozenset(tag for part in parts for tag in (*part.needs, *part.bans))


def require_counts(**numbers: object) -> None:
    """Raise ContextError unless every argument is a whole number from 0 up, and none that the core cannot count to."""
    for name, number in numbers.items():
        if isinstance(number, bool) or not isinstance(number, (int, np.integer)) or number < 0:
            raise ContextError(Fault(f"{name} is {number!r}.", "a whole number from 0 up"))
        if number > MOST_COUNTED:
            raise ContextError(Fault(f"{name} is {number:.3g}.", f"a whole number up to {MOST_COUNTED:,}"))


def weight_of(factor: Factor, side: int) -> float:
    """The share of a factor that some classes make up."""
    parts = [factor.weights[first:stop] for first, stop in bitmask.runs_of(side)]
    return float(np.cumsum(np.concatenate(parts))[-1]) if parts else 0.0  # one after the other, as every count adds them


def factors_of(accepted: Sequence[Accepted], condition: Condition, parts: Mapping[Cell, float] | None = None) -> list[Factor]:
    """The factors of a condition, cut so that the sets are sets of classes; weighed by parts where they are given."""
    domain = condition.domain
    if domain.type.is_tags:
        return list(tag_factors(accepted, domain))
    factor: Factor = NumberFactor.of(accepted, domain) if domain.type.is_numeric else ValueFactor.of(accepted, domain)
    if parts is None:
        return [factor]
    full = (1 << len(factor.weights)) - 1
    sides: dict[int, float] = {}
    for cell, weight in parts.items():
        side = full if cell.accepts is None else factor.classes(cell.accepts)
        sides[side] = sides.get(side, 0.0) + weight
    if sides.get(0, 0.0) > 0.0 or sum(sides.values()) <= 0.0:
        place = Place(column=condition.name)
        raise ContextError(Fault("the weights are outside the domain, or all 0.", "a weight above 0 inside", place=place))
    return [weighted(factor, {s: w for s, w in sides.items() if w > 0.0})]


def _condition(name: str, conditions: Sequence[Condition]) -> Condition:
    for condition in conditions:
        if condition.name == name:
            return condition
    known = [c.name for c in conditions]
    raise ContextError(no_such("condition", require_text(name, "the name of a condition"), known))


def _read_box(box: CellBox, conditions: Sequence[Condition]) -> dict[str, Cell]:
    given = require_mapping(box, "a box of impossible", "a mapping of conditions to cells")
    read = ((name, cell, _condition(name, conditions)) for name, cell in given.items())
    return {
        n: c if isinstance(c, Cell) else parse_cell(require_text(c, f"the cell of {in_quotes(n)}"), at.domain) for n, c, at in read
    }


def _read_weights(name: str, parts: Mapping[object, float], conditions: Sequence[Condition]) -> dict[Cell, float]:
    condition = _condition(name, conditions)
    place = Place(column=name)
    if condition.domain.type.is_tags:
        raise ContextError(Fault("tags do not accept weights.", "a condition of another type", place=place))
    read: dict[Cell, float] = {}
    for text, weight in require_mapping(parts, f"weights of {in_quotes(name)}", _WEIGHTS).items():
        if not (isinstance(weight, (int, float)) and 0.0 <= weight < float("inf")):
            raise ContextError(Fault(f"the weight {weight!r} is not a share.", "a number from 0 up", place=place))
        cell = parse_cell(str(text), condition.domain)
        read[cell] = read.get(cell, 0.0) + float(weight)
    return read


def used_factors(boxes: Iterable[Box], full: Box) -> list[int]:
    """The factors that some box restricts, ascending."""
    return sorted({f for box in boxes for f, side in enumerate(box) if side != full[f]})
