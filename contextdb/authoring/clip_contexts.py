"""The contexts of a table that differ in which clips they let play, found from its cells: never by trying facts.

Of each row there are two boxes of contexts: those in which it is valid, and those in which it is valid with mirrored facts: the
row's box in a mirror. Condition by condition the contexts so far are divided by what its classes leave of these boxes; contexts
that leave the same are the same from there on. So the work grows with the different answers, not with the contexts.

Where the answers are too many, or what can happen is known by samples only (derived facts, assumptions that compute), contexts are
drawn instead, by a fixed seed. Contexts of no measure, such as the one speed at which two closed intervals touch, are left out.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate, compress

import numpy as np

from contextdb import bitmask
from contextdb.bitmask import Words
from contextdb.cells.arguments import require_kind
from contextdb.cells.conditions import Condition
from contextdb.cells.mirroring import changed_in_mirror, mirrored_fact, partner_of
from contextdb.cells.sets import Cell, NumberSet, TagMeet, TagSet
from contextdb.compiled.data import CompiledData
from contextdb.covering.assumed import Opened, opened
from contextdb.covering.progress import SILENT, Progress
from contextdb.covering.sample import Sampler
from contextdb.covering.space import Box, Sides, Space
from contextdb.covering.witness import BoxSet, Steps
from contextdb.errors import some
from contextdb.motion.measuring.moves import DIRECTION, SPEED, TURN, ClipContexts
from contextdb.schema.settings import derivation_of
from contextdb.tables.data import TableData
from contextdb.tables.nesting.flat import FlatTable
from contextdb.tables.table import EitherTable

MOST_ANSWERS = 3_000
"""From more different answers on contexts are drawn."""
SAMPLES = 5_000
STEPS = 20_000
AXES = (SPEED, TURN, DIRECTION)
Answers = dict[int, tuple[float, int]]
"""For what is left of the boxes, as bits: the share of the contexts, and the classes of all factors that they have, as bits."""


@dataclass(frozen=True, eq=False)
class TableContexts:
    """The contexts of a table by which clips they let play: those in which some clip is valid, the largest share first.

    `without` is the share of the contexts in which none is; `never_valid` are clips whose rows are valid in no context. `n_samples`
    contexts were drawn, for the reason `why`; 0 and empty where the shares are exact. Mirrored clips are not held to the conditions
    `not_mirrored`: they are computed from facts that change in a mirror.
    """

    contexts: tuple[ClipContexts, ...]
    without: float
    never_valid: tuple[str, ...]
    n_samples: int
    why: str
    not_mirrored: tuple[str, ...]

    @property
    def method(self) -> str:
        """How the contexts were found: "exact", or "drawn"."""
        return "drawn" if self.n_samples else "exact"


def clip_contexts(
    table: EitherTable,
    clips: Collection[str] | None = None,
    mirrored: Collection[str] = (),
    *,
    axes: Mapping[str, str] | None = None,
    seed: int = 0,
    progress: Progress = SILENT,
) -> TableContexts:
    """The contexts of a table that differ in which clips they let play.

    `clips` are the assets that there are clips of (None: all of the table), `mirrored` those that are played mirrored too. `axes`
    gives for "speed", "turn" and "direction" the condition that says what is requested; see `queried_axes`. `seed` is that of the
    contexts that are drawn. Raises ContextDBError as coverage of a table does.
    """
    require_kind(table, TableData, "table", "a Table")
    ready, flat = opened(table, progress=progress), table.flat()
    assets = list(flat.leaves) if isinstance(flat, FlatTable) else flat.assets
    boxes = _Boxes.of(ready, assets, set(assets if clips is None else clips), set(mirrored))
    drawer = None if ready.drawer is None else replace(ready.drawer, space=boxes.space)
    why = f"only samples know {some(ready.sampled)}" if drawer is not None else ""
    answers = boxes.divided(progress) if drawer is None else None
    if answers is None:
        why = why or f"there are more than {MOST_ANSWERS:,} different answers"
        answers = boxes.drawn(Sampler(boxes.space, progress, drawer), np.random.default_rng(seed))
    contexts = boxes.contexts(answers, dict(axes or {}))
    held = math.fsum(each.share for each in contexts)
    return TableContexts(
        tuple(sorted(contexts, key=lambda each: (-each.share, each.id))),
        max(0.0, 1.0 - held),
        tuple(boxes.never_valid(progress)),
        SAMPLES if why else 0,
        why,
        tuple(sorted(_not_mirrored(ready))) if mirrored else (),
    )


def queried_axes(table: EitherTable) -> dict[str, str]:
    """The conditions of a table that say at which speed a clip is wanted, and how fast it turns: numbers with min and max, "speed"
    in m/s and "turn" in degrees a second. The unit may be missing. What a "direction" is against, a name does not say."""
    axes = {}
    units = {SPEED: ("", "m/s"), TURN: ("", "deg/s", "°/s", "degrees/s", "degrees a second", "degrees per second")}
    for column in table.flat().conditions:
        condition = column.condition
        name = condition.name.casefold()
        if name in units and is_axis(condition) and (condition.unit or "") in units[name]:
            axes[name] = condition.name
    return axes


def is_axis(condition: Condition) -> bool:
    """Whether a condition can say which movement is requested: numbers with both ends, or angles."""
    return condition.domain.type.is_numeric and all(map(math.isfinite, condition.domain.ends))


@dataclass(frozen=True, eq=False)
class _Boxes:
    """The boxes of contexts in which rows with a clip are valid, and those in which they are with mirrored facts."""

    space: Space
    listed: tuple[str, ...]
    """The clips that the table names, in its order."""
    rows: tuple[tuple[str, Box], ...]
    mirrored: tuple[tuple[str, Box], ...]
    impossible: tuple[Box, ...]

    @classmethod
    def of(cls, ready: Opened, assets: Sequence[str], clips: set[str], mirrored: set[str]) -> _Boxes:
        """Of a table with these assets: the rows of clips, and of those that are mirrored too."""
        compiled, free = ready.compiled, _not_mirrored(ready)
        on = bitmask.unpack(compiled.enabled, compiled.n_rows)
        plain = {row: _cells(compiled, row) for row in range(compiled.n_rows) if on[row] and assets[row] in clips}
        in_mirror = {row: _in_mirror(cells, compiled, free) for row, cells in plain.items() if assets[row] in mirrored}
        impossible = [_as_cells(ready.space, box) for box in ready.space.impossible]
        space = Space.of(compiled, [*impossible, *in_mirror.values()])
        return cls(
            space,
            tuple(dict.fromkeys(asset for asset in assets if asset in clips)),
            tuple((assets[row], box) for row, cells in plain.items() if (box := space.box(cells)) is not None),
            tuple((assets[row], box) for row, cells in in_mirror.items() if (box := space.box(cells)) is not None),
            tuple(box for cells in impossible if (box := space.box(cells)) is not None),
        )

    @cached_property
    def all(self) -> BoxSet:
        """All boxes as bits: those of rows, then of mirrored rows, then of what cannot happen."""
        return BoxSet.of(self.space.full, [*(box for _, box in self.rows), *(box for _, box in self.mirrored), *self.impossible])

    @cached_property
    def offsets(self) -> list[int]:
        """Where the classes of each factor begin, among those of all."""
        return [0, *accumulate(side.bit_length() for side in self.space.full)]

    def divided(self, progress: Progress) -> Answers | None:
        """What is left of the boxes, exactly; None where there are more answers than can be distinguished."""
        answers: Answers = {self.all.all: (1.0, 0)}
        for f, factor in enumerate(self.space.factors):
            progress.check()
            parts = self._parts(f, factor.weights.tolist())
            divided: dict[int, tuple[float, int]] = {}
            for bits, (share, classes) in answers.items():
                for rejected, (weight, side) in parts.items():
                    before = divided.get(bits & ~rejected, (0.0, 0))
                    divided[bits & ~rejected] = before[0] + share * weight, before[1] | classes | side
                if len(divided) > MOST_ANSWERS:
                    return None
            answers = divided
        return answers

    def _parts(self, f: int, weights: Sequence[float]) -> dict[int, tuple[float, int]]:
        """The classes of a factor, by the boxes that they reject: their share, and they as bits among those of all factors."""
        shares: dict[int, tuple[float, int]] = {}
        for k, weight in enumerate(weights):
            if weight > 0.0:
                rejected = self.all.rejects[f][k]
                before = shares.get(rejected, (0.0, 0))
                shares[rejected] = before[0] + weight, before[1] | 1 << (self.offsets[f] + k)
        return shares

    def drawn(self, sampler: Sampler, rng: np.random.Generator) -> Answers:
        """What is left of the boxes in contexts that are drawn."""
        n_boxes = self.all.n_boxes
        accepted = [np.array([bitmask.from_int(self.all.all & ~r, n_boxes) for r in own], np.uint64) for own in self.all.rejects]
        shares: dict[int, tuple[float, int]] = {}
        for codes, _ in sampler.random_contexts(SAMPLES, rng):
            left: Words = np.tile(bitmask.full(n_boxes), (len(codes), 1))
            for f, own in enumerate(accepted):
                left &= own[codes[:, f]]
            different, number = np.unique(left, axis=0, return_inverse=True)
            classes = [0] * len(different)
            for f, offset in enumerate(self.offsets[:-1]):
                for i, k in set(zip(number.ravel().tolist(), codes[:, f].tolist(), strict=True)):
                    classes[i] |= 1 << (offset + k)
            for words, n, own_classes in zip(different, np.bincount(number.ravel()).tolist(), classes, strict=True):
                before = shares.get(bits := bitmask.to_int(words), (0.0, 0))
                shares[bits] = before[0] + n / SAMPLES, before[1] | own_classes
        return shares

    def contexts(self, answers: Answers, axes: Mapping[str, str]) -> list[ClipContexts]:
        """The contexts that can happen and have a valid clip, by their clips."""
        n_rows, n_kept = len(self.rows), len(self.rows) + len(self.mirrored)
        total, by_facts = 0.0, dict[tuple[frozenset[str], frozenset[str]], tuple[float, int]]()
        for bits, (share, classes) in answers.items():
            if bits >> n_kept:
                continue  # it cannot happen
            total += share
            flags = bitmask.flags_of(bits, n_kept).tolist()
            assets = frozenset(compress((asset for asset, _ in self.rows), flags[:n_rows]))
            mirrored = frozenset(compress((asset for asset, _ in self.mirrored), flags[n_rows:]))
            if assets or mirrored:
                before = by_facts.get((assets, mirrored), (0.0, 0))
                by_facts[assets, mirrored] = before[0] + share, before[1] | classes
        return [self._contexts_of(*clips, share / total, classes, axes) for clips, (share, classes) in by_facts.items()]

    def _contexts_of(
        self, assets: frozenset[str], mirrored: frozenset[str], share: float, classes: int, axes: Mapping[str, str]
    ) -> ClipContexts:
        box = tuple(
            self._closed(f, (classes >> offset) & full)
            for f, (offset, full) in enumerate(zip(self.offsets, self.space.full, strict=False))
        )
        sides = self.space.sides_of(box)
        names = [condition.name for condition in self.space.conditions]
        axes_asked = {axis: self._spans(names.index(name), sides) for axis, name in axes.items() if name in names}
        return ClipContexts(assets, mirrored, share, self.space.cells(sides, is_label=True), axes_asked, self._is_symmetric(sides))

    def _is_symmetric(self, sides: Sides) -> bool:
        """Whether a box is the same in a mirror."""
        places = {condition.name: at for at, condition in enumerate(self.space.conditions)}
        for condition in changed_in_mirror(self.space.conditions).values():
            own, other = (
                self.space.accepted(places[name], sides) for name in (condition.name, partner_of(condition) or condition.name)
            )
            seen = None if other is None else _mirrored_cell(Cell(other), condition).accepts
            if own != seen:
                return False
        return True

    def _closed(self, f: int, side: int) -> int:
        """A side with the classes of no measure beside its own: a number at which two intervals touch is in both."""
        empty = bitmask.int_of(np.flatnonzero(self.space.factors[f].weights <= 0.0).tolist())
        return side | (empty & (side << 1 | side >> 1))

    def _spans(self, at: int, sides: Sides) -> list[tuple[float, float]]:
        """The numbers of a bounded condition that a box holds."""
        accepts, (least, most) = self.space.accepted(at, sides), self.space.conditions[at].domain.ends
        spans = accepts.spans if isinstance(accepts, NumberSet) else [(least, most)]
        return [(max(low, least), min(high, most)) for low, high in spans]

    def never_valid(self, progress: Progress) -> Iterator[str]:
        """The clips whose rows are valid in no context that can happen."""
        outside = BoxSet.of(self.space.full, self.impossible, progress)
        live = {asset for asset, box in self.rows if not outside.hold(box, Steps(STEPS, progress), False)}
        yield from (asset for asset in self.listed if asset not in live)


def _cells(compiled: CompiledData, row: int) -> dict[str, Cell]:
    """What a row accepts; a soft cell excludes nothing."""
    cells = {}
    for at, condition in enumerate(compiled.conditions):
        cell = compiled.cells(at)[int(compiled.texts[at].codes[row])]
        if cell.accepts is not None and not cell.is_soft:
            cells[condition.name] = Cell(cell.accepts)
    return cells


def _in_mirror(cells: Mapping[str, Cell], compiled: CompiledData, free: Collection[str]) -> dict[str, Cell]:
    """The contexts whose mirrored facts some cells accept, without conditions that nobody can mirror."""
    known = {condition.name: condition for condition in compiled.conditions}
    changed = changed_in_mirror(known.values())
    mirrored = {}
    for name, cell in cells.items():
        if name not in free:
            partner = partner_of(known[name]) if name in changed else None
            mirrored[partner or name] = _mirrored_cell(cell, known[name])
    return mirrored


def _mirrored_cell(cell: Cell, condition: Condition) -> Cell:
    if isinstance(cell.accepts, TagMeet):
        parts = [_mirrored_cell(Cell(part), condition).accepts for part in cell.accepts.parts]
        return Cell(TagMeet.of([part for part in parts if isinstance(part, TagSet)]))
    fact = mirrored_fact(cell, condition)
    assert isinstance(fact, Cell)
    return fact


def _as_cells(space: Space, box: Box) -> dict[str, Cell]:
    sides = space.sides_of(box)
    numbers = dict.fromkeys(space.condition_of[f] for f in sides)
    return {space.conditions[at].name: Cell(space.accepted(at, sides)) for at in numbers}


def _not_mirrored(ready: Opened) -> set[str]:
    """The conditions that are computed from facts which change in a mirror: what they are there, cells do not tell."""
    names = set()
    for condition in ready.compiled.conditions:
        derivation = derivation_of(ready.table.schema, [condition.name]) if ready.table is not None else None
        if derivation is not None and changed_in_mirror(derivation.inputs):
            names.add(condition.name)
    return names
