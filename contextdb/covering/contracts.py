"""Whether contracts hold of a table, proved by boxes: a contract is broken where some box of contexts leaves it open.

A part of what breaks a contract is a box and others that must not hold a context of it:

    some      all contexts, in no row of the kind
    every     a row of another kind
    none      a row of the kind
    at_most   what n + 1 rows share
    winner    all contexts, in no row; and a row of another kind, in no row that the policy prefers to it

and of all these contexts those that `when` or `assume` excludes are taken out. Whether a part holds a context is decided exactly,
single points too, by search, and where that is long by the core. The share of the contexts in which a contract holds is counted by
the core, within a budget of steps; where it is not finished, and where only draws tell what can happen, it has two bounds.

Every counterexample is put to the compiled table before it is reported.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from operator import and_
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.columns import TextColumn
from contextdb.compiled.choosing import Choosing
from contextdb.compiled.table import data_of
from contextdb.covering.assumed import Opened, assumptions_of, not_boxed, opened
from contextdb.covering.count import Bounds, uncovered_share
from contextdb.covering.draw import Drawer
from contextdb.covering.facts import fact_of, written_fact
from contextdb.covering.gaps import widened
from contextdb.covering.progress import Progress, Stops, Tell
from contextdb.covering.questions import Questions
from contextdb.covering.ruled import without_rules
from contextdb.covering.sample import CHUNK, Sampler
from contextdb.covering.shares import distinct_percents, wilson
from contextdb.covering.space import Box, Space
from contextdb.covering.witness import BoxSet, OutOfSteps, Point, Steps
from contextdb.errors import ContextDBError
from contextdb.expressions import Expression, read_expression
from contextdb.expressions.assume import WANTS, conjuncts
from contextdb.schema.contracts import Contract, output_is_list, row_conditions
from contextdb.schema.settings import derivation_of
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.data import known_conditions
from contextdb.tables.table import EitherTable, Table

WORK = 1_500_000
"""Steps of the core for one contract."""
SAMPLES = 20_000
QUICK = 300
"""So many steps of a search are tried before the core decides."""
MOST_STEPS = 20_000
"""So many steps the searches of one contract take together."""
MOST_WITNESSES = 12
"""Of so many counterexamples the one in the shortest box is reported."""
MOST_SHARED = 2_000
"""So many boxes that too many rows share are counted."""
TRIES = 4_096
"""So many draws look for a moment in a box."""

Part = tuple[Box, int]
"""A box, and the boxes of a table, as bits, that must not hold a context of it."""
Drawn = tuple[Point, dict[str, object]]
"""A context that was drawn: its classes, and its facts."""


@dataclass(frozen=True, slots=True)
class Witness:
    """A counterexample."""

    cells: Mapping[str, str]
    """A box of contexts that all break the contract; what is left away is not restricted."""
    context: Mapping[str, object]
    """One of them, as facts for a query."""
    rows: tuple[int, ...]
    """The rows that are valid there."""
    assets: tuple[str, ...]

    @property
    def text(self) -> str:
        """The box on one line."""
        return ", ".join(f"{name}: {cell}" for name, cell in self.cells.items()) or "every context"

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
        return _Prover.of(contract, table, work, watcher).proof(samples, np.random.default_rng(seed))
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
    columns |= {"asset": list(table.assets), "weight": _weights(table), "priority": table.priorities}
    texts = {name: tuple(dict.fromkeys(map(str, column))) for name, column in columns.items() if name not in ("weight", "priority")}
    expression = read_expression(kind, row_conditions(declared, texts), WANTS)
    plain = {name: column.tolist() if isinstance(column, np.ndarray) else column for name, column in columns.items()}
    return expression.flags(plain, table.n_rows)


def _weights(table: EitherTable) -> NDArray[np.float64]:
    return table.row_weights


@dataclass(eq=False)
class _Prover:
    """One contract of one table."""

    contract: Contract
    table: EitherTable
    ready: Opened
    """The table without rules, under what is assumed and the premise of the contract."""
    drawer: Drawer | None
    kind: int
    """Which boxes are rows of the kind, as bits."""
    work: int
    progress: Progress
    steps: Steps = field(init=False)
    is_cut: bool = False
    """Whether something was left undecided."""
    _asked: Questions | None = None

    @classmethod
    def of(cls, contract: Contract, table: Table, work: int, progress: Progress) -> _Prover:
        flat = table.flat()
        flags = rows_of_kind(flat, contract.kind)
        plain = without_rules(flat).table
        premises = _premises(contract)
        premised = _with_named(
            replace(plain, settings=replace(plain.settings, assume=tuple(dict.fromkeys((*plain.settings.assume, *premises)))))
        )
        ready = opened(premised, progress=progress)
        kind = bitmask.int_of([i for i, row in enumerate(ready.space.rows) if flags[row]])
        return cls(contract, flat, ready, _drawer(premised, ready, premises), kind, work, progress)

    def __post_init__(self) -> None:
        self.steps = Steps(min(MOST_STEPS, self.work // 200), self.progress)

    @property
    def space(self) -> Space:
        return self.ready.space

    @cached_property
    def boxes(self) -> BoxSet:
        """The rows, then the impossible contexts."""
        return BoxSet.of(self.space.full, self.all_boxes, self.progress)

    @cached_property
    def all_boxes(self) -> list[Box]:
        """The same as a list; boxes of counterexamples come behind them."""
        return [*self.space.boxes, *self.space.impossible]

    @property
    def rows(self) -> int:
        return (1 << len(self.space.boxes)) - 1

    @cached_property
    def impossible(self) -> int:
        return (1 << len(self.space.boxes) + len(self.space.impossible)) - 1 & ~self.rows

    def proof(self, samples: int, rng: np.random.Generator) -> Proof:
        if self._point(self.space.full, self.impossible) is None and not self.is_cut:
            return Proof(self.contract, True, 1.0, 1.0, is_vacuous=True)
        drawn = None if self.drawer is None else self._drawn(samples, rng)
        witness = self._witness(rng, () if drawn is None else drawn[1])
        if witness is None and not self.is_cut:
            return Proof(self.contract, True, 1.0, 1.0)
        lower, upper = self._share(samples, rng) if drawn is None else drawn[0]
        return Proof(self.contract, None if witness is None else False, lower, upper, witness)

    # ---- the parts of what breaks it

    def parts(self) -> Iterator[Part]:
        """What breaks the contract, part by part."""
        verb, full = self.contract.verb, self.space.full
        if verb in ("some", "winner"):
            yield full, self.impossible | (self.kind if verb == "some" else self.rows)
        if verb in ("every", "none"):
            for i in bitmask.rows_of(self.kind if verb == "none" else self.rows & ~self.kind):
                yield self.space.boxes[i], self.impossible
        if verb == "winner":
            for i in bitmask.rows_of(self.rows & ~self.kind & self._pickable):
                yield self.space.boxes[i], self.impossible | self._preferred(i)
        if verb == "at_most":
            for box in self._shared(full, 0, self.kind):
                yield box, self.impossible

    def _shared(self, box: Box, n: int, others: int) -> Iterator[Box]:
        """What n of some rows more than are allowed share with a box."""
        if n > self.contract.most:
            yield box
            return
        while n + others.bit_count() > self.contract.most:
            self.steps.take()
            i = (others & -others).bit_length() - 1
            others &= others - 1
            own = self.space.boxes[i]
            joint = tuple(map(and_, box, own))
            meeting = others
            for f in (f for f, (a, b) in enumerate(zip(joint, box, strict=True)) if a != b):
                meeting &= self.boxes.meeting(f, joint[f])
            yield from self._shared(joint, n + 1, meeting) if 0 not in joint else ()

    @cached_property
    def _choosing(self) -> Choosing:
        return data_of(self.table.compile()).once(Choosing.of)

    @cached_property
    def _pickable(self) -> int:
        return self._bits(self._choosing.pickable)

    def _bits(self, flags: NDArray[np.bool_]) -> int:
        return bitmask.int_of([i for i, row in enumerate(self.space.rows) if flags[row]])

    @cached_property
    def _always(self) -> NDArray[np.bool_]:
        """The rows that are picked from whenever they are valid: those that never rest and have some weight."""
        limits = self._choosing.limits
        rests = np.zeros(self.table.n_rows, np.bool_) if limits is None else (limits.of_row >= 0).any(axis=0)
        return self._choosing.pickable & ~rests

    def _preferred(self, i: int) -> int:
        """The rows that keep a row from being picked where they are valid: of a higher rank at some depth of the same way."""
        choosing, row = self._choosing, self.space.rows[i]
        ranks, groups = choosing.ranks, choosing.groups
        key = tuple((int(g), float(r)) for g, r in zip(groups[:, row], ranks[:, row], strict=True))
        if key not in self._known_preferred:
            above = np.zeros(self.table.n_rows, np.bool_)
            for depth in range(len(ranks)):
                above |= (groups[depth] == groups[depth, row]) & (ranks[depth] > ranks[depth, row])
            self._known_preferred[key] = self._bits(above & self._always)
        return self._known_preferred[key]

    @cached_property
    def _known_preferred(self) -> dict[tuple[tuple[int, float], ...], int]:
        return {}

    # ---- whether a part holds a context

    def _point(self, within: Box, avoided: int) -> Point | None:
        """A context of a box in none of some others; None where there is none, or, and then `is_cut`, none was met."""
        few = Steps(min(QUICK, max(1, self.steps.left)), self.progress)
        try:
            return self.boxes.outside(avoided, within, few)
        except OutOfSteps:
            pass
        finally:
            self.steps.left -= QUICK - few.left
        try:
            return self._point_by_core(within, avoided)
        except OutOfSteps:
            self.is_cut = True
            return None

    def _point_by_core(self, within: Box, avoided: int) -> Point | None:
        """The same by the core. Raises OutOfSteps where its work ended before."""
        box = within
        while True:
            held, is_certain, work = self._questions.are_held(box, avoided, self.work)
            self.work -= min(work, self.work)
            if not is_certain:
                raise OutOfSteps
            if held:
                return None
            for f, side in enumerate(box):  # halve one side after the other: one of the halves holds a context
                if side & (side - 1):
                    half = _lower_half(side)
                    first = (*box[:f], half, *box[f + 1 :])
                    is_held, is_certain, work = self._questions.are_held(first, avoided, self.work)
                    self.work -= min(work, self.work)
                    if not is_certain:
                        raise OutOfSteps
                    box = (*box[:f], side & ~half, *box[f + 1 :]) if is_held else first
                    break
            else:
                return tuple(side.bit_length() - 1 for side in box)

    @property
    def _questions(self) -> Questions:
        """The boxes for the core, read again where there are more."""
        if self._asked is None or len(self._asked.boxes) < len(self.all_boxes):
            self._asked = Questions(tuple(self.all_boxes), self.space.full, self.progress)
        return self._asked

    # ---- counterexamples

    def _witness(self, rng: np.random.Generator, drawn: Sequence[Drawn]) -> Witness | None:
        """The counterexample in the shortest box of a few."""
        witnesses = [w for point, context in drawn if (w := self._confirmed(self._around(point), [context])) is not None]
        try:
            for part in self.parts() if not witnesses else ():
                self.progress.check()
                witnesses += self._witnesses(part, MOST_WITNESSES - len(witnesses), rng)
                if len(witnesses) >= MOST_WITNESSES:
                    break
        except OutOfSteps:
            self.is_cut = True
        return min(witnesses, key=lambda witness: (len(witness.cells), len(witness.text)), default=None)

    def _witnesses(self, part: Part, most: int, rng: np.random.Generator) -> Iterator[Witness]:
        """Counterexamples of one part, of which each lies in no box of those before."""
        within, avoided = part
        widener = None
        while most > 0 and (point := self._point(within, avoided)) is not None:
            widener = widener or self._widener(part)
            box = widened(self.space, widener[0], point, widener[1])
            witness = self._confirmed(box, self._moments(box, point, rng))
            if witness is not None:
                yield witness
            self.is_cut |= witness is None
            most -= 1
            avoided |= 1 << self.boxes.n_boxes
            self.boxes.add(box)
            self.all_boxes.append(box)

    def _widener(self, part: Part) -> tuple[BoxSet, list[int]]:
        """What a counterexample of a part must not meet while it is widened, and the order of the factors."""
        within, avoided = part
        rows = BoxSet.of(self.space.full, [*self._chosen(avoided), *_slabs(within, self.space.full)], self.progress)
        return rows, sorted(range(len(rows.full)), key=lambda f: (rows.restricts[f].bit_count(), -f))

    def _around(self, point: Point) -> Box:
        """A box of counterexamples round one."""
        for part in self.parts():
            within, avoided = part
            is_within = all(side >> k & 1 for side, k in zip(within, point, strict=True))
            if is_within and not self.boxes.behind(point)[0] & avoided:
                rows, order = self._widener(part)
                return widened(self.space, rows, point, order)
        return tuple(1 << k for k in point)

    def _chosen(self, bits: int) -> list[Box]:
        return [self.all_boxes[i] for i in bitmask.rows_of(bits)]

    def _confirmed(self, box: Box, contexts: Iterable[dict[str, object]]) -> Witness | None:
        """A counterexample of a box that the compiled table confirms, at one of some contexts."""
        for context in contexts:
            rows = self._rows_at(context) if self._is_premised(context) else None
            if rows is not None and self._breaks(rows):
                return Witness(self._cells(box), context, tuple(rows.tolist()), tuple(self.table.assets[r] for r in rows))
        return None

    def _moments(self, box: Box, point: Point, rng: np.random.Generator) -> Iterator[dict[str, object]]:
        """The given point of a box, or where only draws tell what can happen, some that are drawn."""
        if self.drawer is None:
            yield self._facts(point)
            return
        codes, columns = self.drawer.moments(TRIES, rng, box)
        for i in range(min(len(codes), MOST_WITNESSES)):
            yield self._moment(codes[i], columns, i)

    def _moment(self, codes: NDArray[np.int32], columns: Mapping[str, list[Any]], i: int) -> dict[str, object]:
        assert self.drawer is not None
        domains = {name: condition.domain for name, condition in self.drawer.given.items()}
        given = {name: written_fact(_plain_value(column[i]), domains[name]) for name, column in columns.items()}
        return self._facts(tuple(codes.tolist())) | given

    def _facts(self, point: Point) -> dict[str, object]:
        """The facts that are given in a context."""
        given = ((at, c) for at, c in enumerate(self.space.conditions) if not c.expr)
        return {c.name: fact_of(self.space, at, point) for at, c in given}

    def _is_premised(self, context: Mapping[str, object]) -> bool:
        """Whether what is assumed holds, and the premises."""
        facts = {**context, **self._derived(context)}
        is_possible = all(expression.evaluate(facts) is not False for expression in self._assumptions)
        return is_possible and all(premise.evaluate(facts) is True for premise in self._premises)

    def _derived(self, context: Mapping[str, object]) -> Mapping[str, object]:
        if self._derivation is None:
            return {}
        needed = {c.name for c in self._derivation.inputs}
        columns = self._derivation.complete_frame({name: [value] for name, value in context.items() if name in needed}, 1)
        return {name: _plain_value(column[0]) for name, column in columns.items()}

    @cached_property
    def _derivation(self) -> Any:
        names = [*(c.name for c in self.space.conditions), *(n for e in self._assumptions for n in e.names)]
        return derivation_of(self.ready_table.schema, names)

    @property
    def ready_table(self) -> EitherTable:
        assert self.ready.table is not None
        return self.ready.table

    @cached_property
    def _premises(self) -> list[Expression]:
        known = known_conditions(self.ready_table)
        return [read_expression(text, known, WANTS) for text in _premises(self.contract)]

    @cached_property
    def _assumptions(self) -> tuple[Expression, ...]:
        return assumptions_of(self.ready_table).expressions

    def _rows_at(self, context: Mapping[str, object]) -> NDArray[np.int64] | None:
        """The valid rows; None where a rule or a derived fact has no value there."""
        try:
            rows: NDArray[np.int64] = self._compiled.query(dict(context)).indices
            return rows
        except ContextDBError:
            return None

    @cached_property
    def _compiled(self) -> Any:
        return self.table.compile()

    def _breaks(self, rows: NDArray[np.int64]) -> bool:
        """Whether a contract is broken where these rows are valid."""
        valid = np.zeros((1, self.table.n_rows), np.bool_)
        valid[0, rows] = True
        return bool(self._broken(valid[:, list(self.space.rows)])[0])

    def _broken(self, valid: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Whether the contract is broken in contexts, bool [N], by the boxes that hold each, bool [N, boxes]."""
        is_kind = bitmask.flags_of(self.kind, len(self.space.boxes))
        of_kind = valid & is_kind
        verb = self.contract.verb
        if verb == "some":
            return np.asarray(~of_kind.any(axis=1))
        if verb == "none":
            return np.asarray(of_kind.any(axis=1))
        if verb == "every":
            return np.asarray((valid & ~is_kind).any(axis=1))
        if verb == "at_most":
            return np.asarray(of_kind.sum(axis=1) > self.contract.most)
        broken = np.asarray(~valid.any(axis=1))
        for i in bitmask.rows_of(self.rows & ~self.kind & self._pickable):
            preferred = bitmask.flags_of(self._preferred(i), len(self.space.boxes))
            here = np.flatnonzero(valid[:, i] & ~broken)
            broken[here] = ~(valid[here] & preferred).any(axis=1)
        return broken

    def _cells(self, box: Box) -> dict[str, str]:
        cells = self.space.cells(self.space.sides_of(box))
        ruled = without_rules(self.table)
        return cells if ruled.column is None else ruled.cells(cells)

    # ---- the share

    def _share(self, samples: int, rng: np.random.Generator) -> tuple[float, float]:
        """Bounds of the share of contexts in which the contract holds."""
        bounds = None if self.drawer is not None else self._counted()
        if bounds is not None and bounds.is_exact:
            return bounds.lower, bounds.upper
        lower, upper = self._sampled(samples, rng)
        return (lower, upper) if bounds is None else (max(lower, bounds.lower), max(lower, min(upper, bounds.upper)))

    def _counted(self) -> Bounds | None:
        """The share by counting boxes; None where it is of another form."""
        possible = self._open(self.impossible)
        if possible.upper == 0.0:
            return Bounds(0.0, 0.0)
        verb = self.contract.verb
        if verb == "some":
            return _less(_over(self._open(self.impossible | self.kind), possible))
        if verb in ("every", "none"):
            return _over(self._open(self.impossible | (self.kind if verb == "none" else self.rows & ~self.kind)), possible)
        if verb == "at_most":
            return self._not_shared(possible)
        return self._won(possible)

    def _open(self, avoided: int, parts: int = 1) -> Bounds:
        """The share that some boxes leave open, by one of so many equal parts of the work."""
        return uncovered_share(self.space, self._chosen(avoided), self.work // parts, self.progress)

    def _not_shared(self, possible: Bounds) -> Bounds | None:
        shared: dict[Box, None] = {}
        try:
            for box in self._shared(self.space.full, 0, self.kind):
                shared[box] = None
                if len(shared) > MOST_SHARED:
                    return None
        except OutOfSteps:
            return None
        left = uncovered_share(self.space, [*shared, *self.space.impossible], self.work, self.progress)
        return _over(left, possible)

    def _won(self, possible: Bounds) -> Bounds | None:
        """The share in which the first of the valid rows, those of the kind behind others of their rank, is of the kind."""
        if len(self._choosing.ranks) > 1:
            return None
        pickable = bitmask.flags_of(self._pickable, len(self.space.boxes))
        rows = np.array(self.space.rows, np.int64)
        is_kind, ranks = bitmask.flags_of(self.kind, len(rows)), self._choosing.ranks[0][rows]
        counted = pickable & (~is_kind | self._always[rows])
        order = sorted(np.flatnonzero(counted).tolist(), key=lambda i: (-ranks[i], is_kind[i]))
        n_runs = 2 + 2 * sum(not is_kind[i] for i, j in zip(order, [*order[1:], None], strict=True) if j is None or is_kind[j])
        left = self._open(self.impossible | self.rows, n_runs)  # no row is valid
        low, high, before, own = left.lower, left.upper, self.impossible, 0
        for i in [*order, None]:
            if i is not None and not is_kind[i]:
                own |= 1 << i
                continue
            if own:
                here, there = self._open(before, n_runs), self._open(before | own, n_runs)
                low, high = low + max(0.0, here.lower - there.upper), high + here.upper - there.lower
                before, own = before | own, 0
            if i is not None:
                before |= 1 << i
        broken = Bounds(low, high)
        return _less(_over(broken, possible))

    def _sampled(self, samples: int, rng: np.random.Generator) -> tuple[float, float]:
        """The share by random contexts, with a chance of 99 %."""
        n_contexts = n_broken = 0
        for codes, _ in self._sampler.random_contexts(samples, rng):
            broken = self._broken_at(codes[self._sampler.is_possible(codes)])
            n_contexts += len(broken)
            n_broken += int(broken.sum())
        return wilson(n_contexts - n_broken, n_contexts)

    def _drawn(self, samples: int, rng: np.random.Generator) -> tuple[tuple[float, float], list[Drawn]]:
        """The same by draws of what can happen, and some of those that break the contract."""
        assert self.drawer is not None
        n_contexts, drawn, n_broken = 0, list[Drawn](), 0
        for at in range(0, samples, CHUNK):
            codes, columns = self.drawer.moments(min(CHUNK, samples - at), rng)
            broken = self._broken_at(codes) & self._sampler.is_possible(codes)
            n_contexts += int(self._sampler.is_possible(codes).sum())
            n_broken += int(broken.sum())
            for i in np.flatnonzero(broken)[: max(0, MOST_WITNESSES - len(drawn))].tolist():
                drawn.append((tuple(codes[i].tolist()), self._moment(codes[i], columns, i)))
        return wilson(n_contexts - n_broken, n_contexts), drawn

    @cached_property
    def _sampler(self) -> Sampler:
        return Sampler(self.space, self.progress, self.drawer)

    def _broken_at(self, codes: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Whether contexts, as classes of the factors, break the contract."""
        self.progress.check()
        words, starts = self._sampler.masks
        held = np.full((len(codes), words.shape[1]), ~np.uint64(0))
        for f in range(codes.shape[1]):
            held &= words[starts[f] + codes[:, f]]
        bits = np.unpackbits(held.view(np.uint8), axis=1, bitorder="little", count=len(self.space.boxes))
        return self._broken(bits.astype(np.bool_))


def _premises(contract: Contract) -> tuple[str, ...]:
    """What must hold for a contract to say anything, the parts of `and` one by one."""
    return conjuncts(contract.when) if contract.when else ()


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


def _slabs(within: Box, full: Box) -> list[Box]:
    """What is outside of a box: one for each side that it restricts."""
    return [(*full[:f], full[f] & ~side, *full[f + 1 :]) for f, side in enumerate(within) if side != full[f]]


def _lower_half(side: int) -> int:
    """Of the classes of a side the lower ones, half of them."""
    numbers = bitmask.rows_of(side)
    return bitmask.int_of(numbers[: len(numbers) // 2])


def _over(part: Bounds, whole: Bounds) -> Bounds:
    if part.is_exact and whole.is_exact:
        share = min(1.0, part.lower / whole.lower)
        return Bounds(share, share)
    return Bounds(min(1.0, part.lower / whole.upper), min(1.0, part.upper / whole.lower) if whole.lower > 0.0 else 1.0)


def _less(share: Bounds) -> Bounds:
    return Bounds(1.0 - share.upper, 1.0 - share.lower)


def _plain_value(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
