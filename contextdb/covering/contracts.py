"""Whether contracts hold of a table, proved by boxes: a contract is broken where some box of contexts leaves it open.

Whether a box of what breaks it holds a context is decided exactly, single points too, by search, and where that is long by the
core. The share of the contexts in which a contract holds is counted by the core, within a budget of steps; where it is not
finished, and where only draws tell what can happen, it has two bounds.

Every counterexample is put to the compiled table before it is reported.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.cells.words import InCells
from contextdb.columns import TextColumn
from contextdb.compiled.table import data_of
from contextdb.covering.assumed import Opened, assumptions_of, not_boxed, opened
from contextdb.covering.contract_shares import Demand, Drawn, Part, Shares
from contextdb.covering.draw import Drawer
from contextdb.covering.gaps import widened
from contextdb.covering.moments import Moment, Moments, Preferred
from contextdb.covering.numbered import NumberedBoxes
from contextdb.covering.points import PointFinder, slabs
from contextdb.covering.progress import Progress, Stops, Tell
from contextdb.covering.report import distinct_percents
from contextdb.covering.ruled import without_rules
from contextdb.covering.space import Box, Space
from contextdb.covering.witness import OutOfSteps, Point
from contextdb.errors import ContextDBError
from contextdb.expressions import read_expression
from contextdb.expressions.assume import WANTS, conjuncts
from contextdb.schema.contracts import Contract, output_is_list, row_conditions
from contextdb.schema.settings import derivation_of
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.data import known_conditions
from contextdb.tables.table import EitherTable, Table

WORK = 1_500_000
"""Steps of the core for one contract."""
SAMPLES = 20_000
MOST_WITNESSES = 12
"""Of so many counterexamples the one in the shortest box is reported."""


@dataclass(frozen=True, slots=True)
class Witness(InCells):
    """A counterexample."""

    cells: Mapping[str, str]
    """A box of contexts that all break the contract; what is left away is not restricted."""
    context: Mapping[str, object]
    """One of them, as facts for a query."""
    rows: tuple[int, ...]
    """The rows that are valid there."""
    assets: tuple[str, ...]

    def to_json(self) -> dict[str, object]:
        valid = [{"row": row, "asset": asset} for row, asset in zip(self.rows, self.assets, strict=True)]
        return {"cells": dict(self.cells), "context": dict(self.context), "matches": valid}


@dataclass(frozen=True, slots=True)
class Proof:
    """What came out for one contract."""

    contract: Contract
    holds: bool | None
    """None where that could not be decided."""
    lower: float
    upper: float
    """The share of the contexts in which it holds lies between the two. It may be 1 though a single context breaks it."""
    witness: Witness | None = None
    is_vacuous: bool = False
    """Whether no context is as the contract says, so that it holds of nothing."""
    problem: str = ""
    """Why it could not be decided, where that is not for want of time."""

    @property
    def sentence(self) -> str:
        """What came out, in a sentence."""
        demand = self.contract.demand
        if self.holds:
            return f"{demand}: it holds in every context{'; there is none' if self.is_vacuous else ''}."
        low, high = distinct_percents(self.lower, self.upper)
        share = low if self.lower == self.upper else f"{low} to {high}"
        if self.witness is None:
            return f"{demand}: {self.problem or f'it holds in {share} of its contexts, and no counterexample was met.'}"
        return f"{demand} does not hold at {self.witness.text}; it holds in {share} of its contexts."

    def to_json(self) -> dict[str, object]:
        witness = None if self.witness is None else self.witness.to_json()
        own = {"name": self.contract.name, "table": self.contract.table, "holds": self.holds}
        return {**own, "share": [self.lower, self.upper], "witness": witness, "why": self.contract.why}


def prove(
    contract: Contract,
    table: Table,
    *,
    work: int = WORK,
    samples: int = SAMPLES,
    seed: int = 0,
    progress: Tell | None = None,
    should_stop: Stops | None = None,
) -> Proof:
    """Decide whether a contract holds of a table.

    `work` limits the steps of the core, and in proportion those of the searches; `samples` are contexts that are drawn where only
    draws tell what can happen. The same input gives the same proof. A table or a contract that cannot be read is an open contract
    that says why. Raises Cancelled when `should_stop` says so.
    """
    watcher = Progress(progress, should_stop)
    try:
        return _Prover.of(contract, table, work, seed, watcher).proof(samples)
    except ContextDBError as error:
        if not error.faults:
            raise  # stopped
        return Proof(contract, None, 0.0, 1.0, problem=error.faults[0].message)


def rows_of_kind(table: EitherTable, kind: str | None) -> NDArray[np.bool_]:
    """The rows of a kind: bool [n_rows]; all where there is none. Raises ExpressionError where it cannot be read."""
    if kind is None:
        return np.ones(table.n_rows, np.bool_)
    declared = {output.name: output for output in table.outputs.declared if not output_is_list(output)}
    columns: dict[str, Any] = {name: table.outputs.column(name) for name in declared}
    columns |= {"asset": list(table.assets), "weight": table.row_weights, "priority": table.priorities}
    texts = {name: tuple(dict.fromkeys(map(str, column))) for name, column in columns.items() if name not in ("weight", "priority")}
    expression = read_expression(kind, row_conditions(declared, texts), WANTS)
    plain = {name: column.tolist() if isinstance(column, np.ndarray) else column for name, column in columns.items()}
    return expression.flags(plain, table.n_rows)


@dataclass(eq=False)
class _Prover:
    """One contract of one table."""

    table: EitherTable
    demand: Demand
    moments: Moments
    rng: np.random.Generator

    @classmethod
    def of(cls, contract: Contract, table: Table, work: int, seed: int, progress: Progress) -> _Prover:
        flat = table.flat()
        flags = rows_of_kind(flat, contract.kind)
        plain = without_rules(flat).table
        premises = conjuncts(contract.when) if contract.when else ()
        assume = tuple(dict.fromkeys((*plain.settings.assume, *premises)))
        premised = _with_named(replace(plain, settings=replace(plain.settings, assume=assume)))
        ready = opened(premised, progress=progress)
        space = ready.space
        kind = bitmask.int_of([i for i, row in enumerate(space.rows) if flags[row]])
        picks = Preferred(data_of(flat.compile()), space.rows)
        moments = Moments(space, ready.table or premised, _drawer(premised, ready, premises), premises)
        demand = Demand(contract, PointFinder(space, work, progress), picks, kind)
        return cls(flat, demand, moments, np.random.default_rng(seed))

    @property
    def finder(self) -> PointFinder:
        return self.demand.finder

    @property
    def space(self) -> Space:
        return self.demand.space

    def proof(self, samples: int) -> Proof:
        contract, shares = self.demand.contract, Shares(self.demand, self.moments)
        if self.finder.point(self.space.full, self.finder.impossible) is None and not self.finder.is_cut:
            return Proof(contract, True, 1.0, 1.0, is_vacuous=True)
        drawn = None if self.moments.drawer is None else shares.drawn(samples, self.rng, MOST_WITNESSES)
        witness = self._witness(() if drawn is None else drawn[1])
        if witness is None and not self.finder.is_cut:
            return Proof(contract, True, 1.0, 1.0)
        lower, upper = shares.share(samples, self.rng) if drawn is None else drawn[0]
        return Proof(contract, None if witness is None else False, lower, upper, witness)

    def _witness(self, drawn: Sequence[Drawn]) -> Witness | None:
        """The counterexample in the shortest box of a few."""
        witnesses = [w for point, moment in drawn if (w := self._confirmed(self._around(point), [moment])) is not None]
        try:
            for part in self.demand.parts() if not witnesses else ():
                self.finder.progress.check()
                witnesses += self._witnesses(part, MOST_WITNESSES - len(witnesses))
                if len(witnesses) >= MOST_WITNESSES:
                    break
        except OutOfSteps:
            self.finder.is_cut = True
        return min(witnesses, key=lambda witness: (len(witness.cells), len(witness.text)), default=None)

    def _witnesses(self, part: Part, most: int) -> Iterator[Witness]:
        """Counterexamples of one part, of which each lies in no box of those before."""
        within, avoided = part
        widener = None
        while most > 0 and (point := self.finder.point(within, avoided)) is not None:
            widener = widener or self._widener(part)
            box = widened(self.space, widener, point)
            witness = self._confirmed(box, self.moments.of_box(box, point, self.rng))
            if witness is not None:
                yield witness
            self.finder.is_cut |= witness is None
            most -= 1
            avoided |= self.finder.add(box)

    def _widener(self, part: Part) -> NumberedBoxes:
        """What a counterexample of a part must not meet while it is widened."""
        within, avoided = part
        outside = [*self.finder.chosen(avoided), *slabs(within, self.space.full)]
        return NumberedBoxes.of(self.space.full, outside)

    def _around(self, point: Point) -> Box:
        for part in self.demand.parts():
            within, avoided = part
            is_within = all(side >> k & 1 for side, k in zip(within, point, strict=True))
            if is_within and not self.finder.box_set.behind(point)[0] & avoided:
                return widened(self.space, self._widener(part), point)
        return tuple(1 << k for k in point)

    def _confirmed(self, box: Box, moments: Iterable[Moment]) -> Witness | None:
        """A counterexample of a box that the compiled table confirms, at one of some moments."""
        for moment in moments:
            rows = self._rows_at(moment) if self.moments.can_happen(moment) else None
            if rows is not None and self.demand.breaks(rows):
                return Witness(self._cells(box), moment, tuple(rows.tolist()), tuple(self.table.assets[r] for r in rows))
        return None

    def _rows_at(self, moment: Moment) -> NDArray[np.int64] | None:
        """The valid rows; None where a rule or a derived fact has no value there."""
        try:
            rows: NDArray[np.int64] = self.demand.picks.compiled.query(dict(moment)).indices
            return rows
        except ContextDBError:
            return None

    def _cells(self, box: Box) -> dict[str, str]:
        cells = self.space.cells(self.space.sides_of(box))
        ruled = without_rules(self.table)
        return cells if ruled.column is None else ruled.cells(cells)


def _with_named(table: EitherTable) -> EitherTable:
    """The table with columns that say Any for the conditions that it lacks, and that its contexts are told by."""
    known = known_conditions(table)
    present = {column.condition.name for column in table.conditions}
    wanted = [c.name for text in table.settings.assume for c in read_expression(text, known, WANTS).conditions]
    derivation = derivation_of(table.schema, [*wanted, *present])
    wanted += [name for step in (derivation.steps if derivation else ()) for name in step.expression.names]
    new = [known[name] for name in dict.fromkeys(wanted) if name not in present]
    columns = [ConditionColumn.read(TextColumn.of(c.name, ["Any"] * table.n_rows), c) for c in new]
    taken = {c.condition.name for c in columns}
    plain = tuple(c for c in table.columns if c.name not in taken)
    return replace(table, columns=(*plain, *(c.texts for c in columns)), conditions=(*table.conditions, *columns))


def _drawer(table: EitherTable, ready: Opened, texts: Sequence[str]) -> Drawer | None:
    """What draws contexts, where boxes do not tell all that is assumed."""
    assumed = assumptions_of(table)
    unboxed = assumed.unboxed
    if not unboxed and not any(not_boxed(table, assumed)):
        return None
    names = [*(c.name for c in ready.space.conditions), *(name for expression in unboxed for name in expression.names)]
    premises = tuple(expression for expression in unboxed if expression.text in texts)
    others = tuple(expression for expression in unboxed if expression.text not in texts)
    return Drawer(ready.space, derivation_of(table.schema, names), others, premises)
