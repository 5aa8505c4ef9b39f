"""Many contexts at once: columns of facts in, counts and hits out.

N contexts, P slots (see `contextdb.compiled.stack`), W words a mask. Columns that are plainly typed are encoded without a Python
step for each fact: values through polars, numbers inside the kernel. Anything else (lists of mixed things, tags) is read fact by
fact, once for each distinct one. With numba the work is compiled; without it numpy does the same, slower.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Rows, Words, read_only
from contextdb.cells.angles import wrap_angles
from contextdb.cells.conditions import Condition
from contextdb.cells.fact_columns import listed, plain_numbers
from contextdb.cells.facts import Fact, Unknown, check_mode, missing_error, misspelt, read_fact
from contextdb.cells.mirroring import in_mirror
from contextdb.cells.sets import Cell
from contextdb.compiled.batch_columns import (
    Codes,
    Contexts,
    common_length,
    facts_of,
    holds_sets,
    kept_columns,
    mirrored_columns,
    plain_values,
)
from contextdb.compiled.batch_costs import CostsOfPairs, costs_of_pairs
from contextdb.compiled.classes import NumberMasks, TagMasks, ValueMasks, WideMasks
from contextdb.compiled.data import CompiledData
from contextdb.compiled.many import BLOCK, ManyMatches, one_by_one
from contextdb.compiled.matches import Matches, with_mirrored, with_penalties, with_widened
from contextdb.console import announce, has_numba
from contextdb.errors import ContextError, Fault, Place, plural
from contextdb.expressions.rules import ManyRules

RULED_WORDS = 1 << 21
"""Words of masks at once for a table with rules: each distinct rule is computed once for all of them."""
MUCH_WORK = 1 << 18
"""Words of answers from which loading the compiled kernels, a third of a second, is worth it."""

FEW_BOUNDS = 100
"""So few bounds are compared with every fact sooner than each fact is bisected among them."""
THREAD_CONTEXTS = 8192
"""Fewer contexts than this are not worth a second thread."""
SEVERAL = (list, set, tuple)
"""What has no hash, or may hold what has none."""


@dataclass(frozen=True, eq=False)
class Numbers:
    """The number columns, to be encoded by bisection: column j is in `facts[j]` and fills slot `slots[j]`.

    facts float64 [columns, N]; column j bisects bounds[edges[j]:edges[j + 1]]; class k has code firsts[j] + k, NaN missing[j].
    """

    facts: NDArray[np.float64]
    slots: NDArray[np.int64]
    bounds: NDArray[np.float64]
    edges: NDArray[np.int64]
    firsts: NDArray[np.int64]
    missing: NDArray[np.int64]

    @property
    def arrays(self) -> tuple[NDArray[Any], ...]:
        """What the kernels take after the facts and slots."""
        return self.bounds, self.edges, self.firsts, self.missing


@dataclass(frozen=True, eq=False)
class KeptFacts:
    """The facts of many contexts as they were given, which the caller cannot change any more."""

    columns: Mapping[str, Any]
    unknown: Unknown

    def of_context(self, context: int) -> dict[str, object]:
        return {name: column[context] for name, column in self.columns.items()}


@dataclass(frozen=True, eq=False)
class Values:
    """The facts that are not numbers, as classes int32 [value slots, N], -1 where missing.

    Slot j of these fills slot `slots[j]` of the codes; its class v is mask starts[j] + v, and a missing fact mask absent[j].
    """

    classes: Codes
    slots: NDArray[np.int64]
    starts: NDArray[np.int64]
    absent: NDArray[np.int64]


@dataclass(frozen=True, eq=False, repr=False)
class BatchMatches(ManyMatches):
    """The valid rows of many contexts that were encoded together."""

    compiled: CompiledData
    n_contexts: int
    values: Values
    numbers: Numbers
    rules: ManyRules | None = None
    """The rows' own rules, with their facts; None for a table without."""
    kept: KeptFacts | None = None
    """The facts that soft cells cost with, and that are asked in a mirror; None for a table that needs them for neither."""

    @property
    def mirrored(self) -> ManyMatches:
        return self._mirrored if self.compiled.mirroring else self

    @cached_property
    def _mirrored(self) -> ManyMatches:
        assert self.kept is not None
        try:
            return query_many(self.compiled, mirrored_columns(self.kept.columns, self.compiled.mirroring), self.kept.unknown)
        except ContextError as error:
            raise in_mirror(error) from None

    @property
    def codes(self) -> Codes:
        self.compiled.refuse_rules("codes do not keep the facts that they need")
        return read_only(self._codes.view())

    @cached_property
    def _codes(self) -> Codes:
        values = self.values
        out = np.empty((len(values.slots) + len(self.numbers.slots), self.n_contexts), np.int32)
        for slot, classes, start, absent in zip(values.slots, values.classes, values.starts, values.absent, strict=True):
            np.add(classes, np.int32(start), out=out[slot])
            out[slot][classes < 0] = absent
        if kernels := load_kernels(self._work):
            kernels.encode(self.numbers.facts, *self.numbers.arrays, self.numbers.slots, out)
            return np.ascontiguousarray(out.T)
        _encode_with_numpy(self.numbers, out)
        return out.T

    def __len__(self) -> int:
        return self.n_contexts

    def __iter__(self) -> Iterator[Matches]:
        for start in range(0, self.n_contexts, BLOCK):
            for context, mask in enumerate(self._masks(start, start + BLOCK), start):
                yield self._matches(context, mask)

    def _answer(self, context: int) -> Matches:
        mask = self.__dict__["mask"][context] if "mask" in self.__dict__ else self._masks(context, context + 1)[0]
        return self._matches(context, mask)

    def _matches(self, context: int, mask: Words) -> Matches:
        matches, kept = self.compiled.matches(bitmask.to_int(mask)), self.kept
        if kept is None:
            return matches
        if self.compiled.mirroring:
            with_mirrored(matches, lambda: self.mirrored[context])
        if self.compiled.widening:
            with_widened(matches, lambda: self.compiled.query_widened(kept.of_context(context), kept.unknown))
        if self.compiled.is_soft:
            with_penalties(matches, lambda: self.compiled.layered_penalties(kept.of_context(context), kept.unknown))
        return matches

    def _costs_of_pairs(self) -> CostsOfPairs:
        kept = self.kept
        assert kept is not None, "a table with soft cells keeps its facts"
        return costs_of_pairs(
            self.compiled, kept.columns, self.n_contexts, lambda table, given: query_many(table, given, kept.unknown).mask
        )

    @property
    def _work(self) -> int:
        return self.n_contexts * len(self.compiled.enabled)

    @cached_property
    def _counts_and_hits(self) -> tuple[Rows, Rows]:
        if self.rules is None and (kernels := load_kernels(self._work)):
            return self._with_kernels(kernels)
        return super()._counts_and_hits

    @property
    def _block(self) -> int:
        return BLOCK if self.rules is None else max(BLOCK, RULED_WORDS // max(1, len(self.compiled.enabled)))

    def _with_kernels(self, kernels: ModuleType) -> tuple[Rows, Rows]:
        stack, numbers = self.compiled.stack, self.numbers
        counts = np.zeros(self.n_contexts, np.int64)
        n_threads = max(1, min(os.cpu_count() or 1, self.n_contexts // THREAD_CONTEXTS))
        cuts = np.linspace(0, self.n_contexts, n_threads + 1).astype(np.int64).tolist()
        hits = np.zeros((n_threads, len(self.compiled.enabled) * 64), np.int64)
        own_slots = np.argsort(np.argsort(numbers.slots))  # wide columns last, as in the codes
        bounds = numbers.arrays
        values = (self.values.classes, self.values.starts, self.values.absent, stack.groups.arrays)
        given = (*values, numbers.facts, own_slots, bounds, stack.masks, stack.wide, self.compiled.enabled)

        def part(i: int) -> None:
            kernels.batch(*given, cuts[i], cuts[i + 1], counts, hits[i])

        if n_threads == 1:
            part(0)
        else:
            with ThreadPoolExecutor(n_threads) as pool:
                list(pool.map(part, range(n_threads)))
        return read_only(counts), read_only(hits.sum(axis=0)[: self.compiled.n_rows])

    def _masks(self, start: int, stop: int) -> Words:
        """The rows of some contexts as bits, by their cells and their rules."""
        masks = self._masks_of(self._codes[start:stop])
        if self.rules is not None:
            self.rules.exclude(masks, start)
        return masks

    def _masks_of(self, codes: Codes) -> Words:
        stack, enabled = self.compiled.stack, self.compiled.enabled
        if kernels := load_kernels(self._work):
            out = np.empty((len(codes), len(enabled)), np.uint64)
            kernels.batch_masks(np.ascontiguousarray(codes), stack.masks, stack.n_plain, stack.wide, enabled, out)
            return out
        return self.compiled.stack.masks_of(codes, self.compiled.enabled)


def load_kernels(work: int = MUCH_WORK) -> ModuleType | None:
    """The compiled kernels; None where numba is not installed, or where they are not loaded yet and the work is too little for
    it."""
    is_loaded = "contextdb.compiled.kernels" in sys.modules
    if not is_loaded and (work < MUCH_WORK or not has_numba()):
        return None
    try:
        from contextdb.compiled import kernels
    except ImportError:
        return None
    if not is_loaded:
        announce(kernels.batch)
    return kernels


def query_codes(compiled: CompiledData, codes: Codes) -> Matches:
    """The rows for the codes of one context."""
    compiled.refuse_rules("codes do not keep the facts that they need")
    stack = compiled.stack
    given = np.asarray(codes)
    if given.shape != (stack.n_codes,) or given.dtype.kind not in "iu":
        told = f"shape {given.shape}" if given.dtype.kind in "iu" else f"type {given.dtype}"
        raise ContextError(Fault(f"the codes have {told}.", f"({stack.n_codes},), as encode gives them"))
    given = np.clip(given, -2, 2**31 - 1).astype(np.int32) if given.dtype != np.int32 else np.ascontiguousarray(given)
    if not given.flags.writeable:
        given = given.copy()  # for arrays that are read-only the kernels would be compiled once more
    mask = np.empty(len(compiled.enabled), np.uint64)
    if kernels := load_kernels():
        is_right = kernels.query(stack.masks, given, stack.n_plain, stack.wide, compiled.enabled, mask)
    elif is_right := stack.holds(given):
        mask = compiled.stack.masks_of(given[None], compiled.enabled)[0]
    if not is_right:
        raise ContextError(Fault("a code is out of range.", "the codes that encode of this same compiled table gives"))
    return compiled.matches(bitmask.to_int(mask))


def query_many(compiled: CompiledData, contexts: Contexts, unknown: Unknown = "error") -> ManyMatches:
    """Answer many contexts; see `CompiledTable.query_many`. Where facts are sets, each context is asked on its own."""
    check_mode(unknown)
    columns = facts_of(contexts)
    try:
        return query_encoded(compiled, columns, unknown)
    except ContextError:
        if not any(holds_sets(column, compiled.asked[name]) for name, column in columns.items() if name in compiled.asked):
            raise
    plain = {name: listed(column) for name, column in columns.items()}
    return one_by_one(compiled, plain, common_length(columns), lambda _, facts: compiled.query(facts, unknown=unknown))


def query_encoded(compiled: CompiledData, contexts: Contexts, unknown: Unknown = "error") -> BatchMatches:
    """The same for contexts all of whose facts are single values; raises ContextError for a set."""
    check_mode(unknown)
    columns = given = facts_of(contexts)
    n_contexts = common_length(columns)
    if compiled.derivation is not None:
        columns = compiled.derivation.complete_frame(columns, n_contexts)
    absent = [n for n in compiled.asked if n not in columns]
    extra = [n for n in columns if n not in compiled.asked and n not in compiled.places] if absent else []
    if absent and (error := misspelt(absent, [n for n in extra if n not in compiled.declared])) is not None:
        raise error
    needed = {*compiled.places, *(c.name for c in compiled.ruled)}
    if unknown == "error" and (plain := [n for n in absent if n in needed]):
        raise missing_error(plain, extra)
    many = _Encoder(compiled, n_contexts, unknown).encode(columns)
    return many if not compiled.is_bound else replace(many, kept=KeptFacts(kept_columns(given, compiled.asked), unknown))


class _Encoder:
    """Turns columns of facts into classes (values) and doubles (numbers)."""

    def __init__(self, compiled: CompiledData, n_contexts: int, unknown: Unknown) -> None:
        self.compiled, self.n_contexts, self.unknown = compiled, n_contexts, unknown
        self.classes: list[Codes] = []
        self.value_slots: list[tuple[int, int, int]] = []
        """Slot, first mask and mask for a missing fact of each entry of `classes`."""
        self.facts: list[NDArray[np.float64]] = []
        self.slots: list[int] = []
        self.bounds: list[NDArray[np.float64]] = []
        self.firsts: list[int] = []
        self.missing: list[int] = []
        self.columns: Mapping[str, Any] = {}

    def encode(self, columns: Mapping[str, Any]) -> BatchMatches:
        """Every condition's column, in the order of slots."""
        self.columns = columns
        stack = self.compiled.stack
        slot, wide_slot = 0, stack.n_plain
        for at, masks in enumerate(self.compiled.masks):
            given = columns.get(self.compiled.conditions[at].name)
            is_wide = isinstance(masks, WideMasks)
            if isinstance(masks, (NumberMasks, WideMasks)):
                self._add_numbers(at, masks, given, wide_slot if is_wide else slot)
            else:
                self._add_values(at, masks, given, slot)
            wide_slot += is_wide
            slot += 0 if is_wide else stack.n_slots[at]
        return BatchMatches(self.compiled, self.n_contexts, self._values(), self._numbers(), self._rules())

    def _rules(self) -> ManyRules | None:
        if self.compiled.when is None:
            return None
        rules = ManyRules.read(self.compiled.when, self.columns, self.n_contexts, self.unknown)
        for condition in self.compiled.ruled if self.unknown == "error" else ():
            self._refuse_missing(condition.name, rules.missing(condition.name))
        return rules

    def _values(self) -> Values:
        classes = np.array(self.classes, np.int32).reshape(len(self.classes), self.n_contexts)
        return Values(classes, *np.array(self.value_slots, np.int64).reshape(-1, 3).T)

    def _numbers(self) -> Numbers:
        edges = np.cumsum([0, *(len(b) for b in self.bounds)])
        facts = np.array(self.facts, np.float64).reshape(len(self.facts), self.n_contexts)
        bounds = np.concatenate(self.bounds) if self.bounds else np.empty(0)
        as_int = [np.array(a, np.int64) for a in (self.slots, edges, self.firsts, self.missing)]
        return Numbers(facts, as_int[0], bounds, *as_int[1:])

    def _add_numbers(self, at: int, masks: NumberMasks | WideMasks, given: Any, slot: int) -> None:
        condition = self.compiled.conditions[at]
        first = 0 if isinstance(masks, WideMasks) else self.compiled.stack.starts[at]
        missing = first + masks.codes(None)[0]
        facts = np.full(self.n_contexts, np.nan) if given is None else plain_numbers(given, condition.domain.type)
        if facts is None:
            distinct, numbers = self._read_each(at, given)
            facts = np.array([np.nan if f is None else f for f in distinct], np.float64)[numbers]
        elif condition.domain.type.is_circular:
            facts = wrap_angles(facts)
        if self.unknown == "error":
            self._refuse_missing(self.compiled.conditions[at].name, np.flatnonzero(np.isnan(facts)))
        self.facts.append(facts)
        self.slots.append(slot)
        self.bounds.append(masks.bounds)
        self.firsts.append(first)
        ignored = -1 if isinstance(masks, WideMasks) else 0
        self.missing.append(ignored if self.unknown == "any" else missing)

    def _add_values(self, at: int, masks: ValueMasks | TagMasks, given: Any, slot: int) -> None:
        start, n_slots = self.compiled.stack.starts[at], self.compiled.stack.n_slots[at]
        local = None if given is None or isinstance(masks, TagMasks) else plain_values(given, masks)
        if local is None:
            local = self._read_values(at, masks, given)
        if n_slots and self.unknown == "error":
            self._refuse_missing(self.compiled.conditions[at].name, np.flatnonzero(local[0] < 0))
        for i in range(n_slots):
            step = 3 * i if isinstance(masks, TagMasks) else 0
            absent = 0 if self.unknown == "any" else start + masks.codes(None)[i]
            self.classes.append(local[i] - np.int32(step) if step else local[i])
            self.value_slots.append((slot + i, start + step, absent))

    def _read_values(self, at: int, masks: ValueMasks | TagMasks, given: Any) -> Codes:
        """Codes int32 [slots, N] read fact by fact, -1 where missing."""
        n_slots = self.compiled.stack.n_slots[at]
        absent = tuple(3 * i - 1 for i in range(n_slots))  # -1 once the slot's start is removed
        facts, numbers = ([None], np.zeros(self.n_contexts, np.int64)) if given is None else self._read_each(at, given)
        if self.unknown == "error":
            self._refuse_missing(self.compiled.conditions[at].name, np.flatnonzero(np.array([f is None for f in facts])[numbers]))
        codes = [absent if f is None else masks.codes(f) for f in facts]
        return np.ascontiguousarray(np.array(codes, np.int32).reshape(len(codes), n_slots).T[:, numbers])

    def _read_each(self, at: int, given: Any) -> tuple[list[Any], NDArray[np.int64]]:
        """The distinct facts in canonical form, each of them read once, and which of them each context has."""
        condition = self.compiled.conditions[at]
        known: dict[object, int] = {}
        facts: list[Any] = []
        numbers: list[int] = []
        for row, value in enumerate(listed(given)):
            try:
                key = (type(value), tuple(value) if isinstance(value, SEVERAL) else value)
                number = known.get(key)
                if number is None:
                    facts.append(self._read_one(row, value, condition))
                    number = known[key] = len(known)
            except (ContextError, TypeError) as error:
                raise _in_context(error, row, condition.name, value) from None
            numbers.append(number)
        return facts, np.array(numbers, np.int64)

    def _read_one(self, row: int, value: object, condition: Condition) -> Fact:
        fact = read_fact(value, condition)
        if isinstance(fact, Cell):
            mend = "to query these contexts one by one: query(facts)"
            raise ContextError(Fault("a set of values is for one query at a time.", "one value in each context", mend))
        return fact

    def _refuse_missing(self, name: str, rows: NDArray[np.int64]) -> None:
        if len(rows):
            derivation = self.compiled.derivation
            if derivation is not None and name in derivation.names:
                raise derivation.no_values(name, self.columns, rows)
            found = f"the fact is missing in {plural(len(rows), 'context')}."
            raise ContextError(
                Fault(
                    found, 'a value, or unknown="any" or "never"', place=Place(row=int(rows[0]), column=name), rule="missing-fact"
                )
            )


def _in_context(error: Exception, row: int, name: str, value: object) -> ContextError:
    place = Place(row=row, column=name)
    if isinstance(error, ContextError):
        return ContextError(*(f.at(place) for f in error.faults))
    return ContextError(Fault(f"{type(value).__name__} is not a fact.", "one value in each context", place=place))


def _encode_with_numpy(numbers: Numbers, out: Codes) -> None:
    for j, facts in enumerate(numbers.facts):
        own = numbers.bounds[numbers.edges[j] : numbers.edges[j + 1]]
        classes = out[numbers.slots[j]]
        np.add(_n_not_above(facts, own), np.int32(numbers.firsts[j]), out=classes, casting="same_kind")
        classes[np.isnan(facts)] = numbers.missing[j]


def _n_not_above(facts: NDArray[np.float64], bounds: NDArray[np.float64]) -> NDArray[np.integer[Any]]:
    """How many of the ascending bounds are not above each fact; of a NaN any number."""
    if len(bounds) > FEW_BOUNDS:
        return np.searchsorted(bounds, facts, "right")
    found = np.zeros(len(facts), np.uint8)
    for bound in bounds:
        found += facts >= bound
    return found
