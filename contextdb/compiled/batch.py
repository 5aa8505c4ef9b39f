"""Many contexts at once: columns of facts in, counts and hits out.

N contexts, P codes a context (see `contextdb.compiled.codes`), W words a mask. The core makes codes of columns that are plainly
typed (lists of Python values, numpy's arrays, polars' series), and rows of codes. A column that holds anything else is read fact by
fact, once for each distinct one.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Rows, Words, read_only
from contextdb.cells.fact_columns import as_series, is_series, listed, read_each
from contextdb.cells.facts import Unknown, check_mode, missing_error, misspelt
from contextdb.cells.mirroring import in_mirror
from contextdb.compiled.batch_columns import (
    Contexts,
    CostsOfPairs,
    common_length,
    costs_of_pairs,
    facts_of,
    holds_sets,
    kept_columns,
    mirrored_columns,
)
from contextdb.compiled.codes import Codes
from contextdb.compiled.data import CompiledData
from contextdb.compiled.many import BLOCK, ManyMatches, one_by_one
from contextdb.compiled.matches import Matches, with_mirrored, with_penalties, with_widened
from contextdb.core import read_column
from contextdb.errors import ContextError
from contextdb.expressions.derived import missing_in_contexts
from contextdb.expressions.rules import ManyRules

RULED_WORDS = 1 << 21
"""Words of masks at once for a table with rules: each distinct rule is computed once for all of them."""
PART = 1 << 16
"""Contexts that are answered between two looks at whether the user stops them."""
THREAD_CONTEXTS = 8192
"""Fewer contexts than this are not worth a second thread."""
MANY_NUMBERS = 1024
"""From so many numbers on their classes are found by cells."""


@dataclass(frozen=True, eq=False)
class KeptFacts:
    """The facts of many contexts as they were given, which the caller cannot change any more."""

    columns: Mapping[str, Any]
    unknown: Unknown

    def of_context(self, context: int) -> dict[str, object]:
        return {name: column[context] for name, column in self.columns.items()}


@dataclass(frozen=True, eq=False)
class KnownCodes:
    """Columns that were encoded before."""

    by_slot: Codes
    """Their codes: int32 [P, N]."""
    missing: Mapping[str, NDArray[np.bool_]]
    """Which facts are missing of those columns where some are."""


@dataclass(frozen=True, eq=False, repr=False)
class BatchMatches(ManyMatches):
    """The valid rows of many contexts that were encoded together."""

    compiled: CompiledData
    n_contexts: int
    by_slot: Codes
    """The codes, one slot after the other: int32 [P, N]."""
    rules: ManyRules | None = None
    """The rows' own rules, with their facts; None for a table without."""
    retained: KeptFacts | None = None
    """The facts that soft cells cost with, and that are asked in a mirror; None for a table that needs them for neither."""

    @property
    def mirrored(self) -> ManyMatches:
        return self._mirrored if self.compiled.mirroring else self

    @cached_property
    def _mirrored(self) -> ManyMatches:
        facts, mirroring = self.retained, self.compiled.mirroring
        assert facts is not None
        try:
            return query_many(self.compiled, mirrored_columns(facts.columns, mirroring), facts.unknown)
        except ContextError as error:
            raise in_mirror(error) from None

    @property
    def codes(self) -> Codes:
        self.compiled.refuse_rules("codes do not keep the facts that they need")
        return read_only(self._codes.view())

    @cached_property
    def _codes(self) -> Codes:
        return np.ascontiguousarray(self.by_slot.T)

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
        matches, facts = self.compiled.matches(bitmask.to_int(mask)), self.retained
        if facts is None:
            return matches
        if self.compiled.mirroring:
            with_mirrored(matches, lambda: self.mirrored[context])
        if self.compiled.widening:
            with_widened(matches, lambda: self.compiled.query_widened(facts.of_context(context), facts.unknown))
        if self.compiled.is_soft:
            with_penalties(matches, lambda: self.compiled.layered_penalties(facts.of_context(context), facts.unknown))
        return matches

    def _costs_of_pairs(self) -> CostsOfPairs:
        facts = self.retained
        assert facts is not None, "a table with soft cells keeps its facts"
        return costs_of_pairs(
            self.compiled, facts.columns, self.n_contexts, lambda table, given: query_many(table, given, facts.unknown).mask
        )

    @cached_property
    def _counts_and_hits(self) -> tuple[Rows, Rows]:
        return super()._counts_and_hits if self.rules is not None else counts_and_hits(self.compiled, self.by_slot)

    @property
    def _block(self) -> int:
        return BLOCK if self.rules is None else max(BLOCK, RULED_WORDS // max(1, len(self.compiled.enabled)))

    def _masks(self, start: int, stop: int) -> Words:
        """The rows of some contexts as bits, by their cells and their rules."""
        own = self.by_slot[:, start:stop]
        masks = np.empty((own.shape[1], len(self.compiled.enabled)), np.uint64)
        answered(self.compiled, np.ascontiguousarray(own), masks=masks)
        if self.rules is not None:
            self.rules.exclude(masks, start)
        return masks


def counts_and_hits(compiled: CompiledData, by_slot: Codes, weights: Rows | None = None) -> tuple[Rows, Rows]:
    """The number of rows that are valid in each context, int64 [N], and of contexts in which each row is valid, each counted by its
    weight, int64 [n_rows]. Contexts are worked out side by side where they are many."""
    n = by_slot.shape[1]
    counts = np.zeros(n, np.int64)
    n_parts = max(1, min(os.cpu_count() or 1, n // THREAD_CONTEXTS))
    hits = np.zeros((n_parts, 64 * len(compiled.enabled)), np.int64)
    cuts = np.linspace(0, n, n_parts + 1).astype(np.int64).tolist()

    def answer_part(part: int) -> None:
        answered(compiled, by_slot, cuts[part], cuts[part + 1], counts, hits[part], weights)

    if n_parts == 1:
        answer_part(0)
    else:
        with ThreadPoolExecutor(n_parts) as pool:
            list(pool.map(answer_part, range(n_parts)))
    return read_only(counts), read_only(hits.sum(axis=0)[: compiled.n_rows])


def answered(
    compiled: CompiledData,
    by_slot: Codes,
    start: int = 0,
    stop: int | None = None,
    counts: Rows | None = None,
    hits: Rows | None = None,
    weights: Rows | None = None,
    masks: Words | None = None,
) -> bool:
    """Answer some contexts, and fill what is given; False where a code is out of range."""
    batch, end = compiled.codes.batch, by_slot.shape[1] if stop is None else stop
    parts = range(start, end, PART)
    return all(batch.answer(by_slot, at, min(at + PART, end), counts, hits, weights, masks) for at in parts)


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
    columns = facts_of(contexts)
    absent = [n for n in compiled.asked if n not in columns]
    extra = [n for n in columns if n not in compiled.asked and n not in compiled.places] if absent else []
    if absent and (error := misspelt(absent, [n for n in extra if n not in compiled.declared])) is not None:
        raise error
    if unknown == "error" and absent:
        raise missing_error(absent, extra)
    return kept_facts(query_known(compiled, columns, common_length(columns), unknown), columns, unknown)


def kept_facts(many: BatchMatches, given: Mapping[str, Any], unknown: Unknown) -> BatchMatches:
    """Answers with the facts that they need later on."""
    compiled = many.compiled
    return many if not compiled.is_bound else replace(many, retained=KeptFacts(kept_columns(given, compiled.asked), unknown))


def query_known(
    compiled: CompiledData, columns: Mapping[str, Any], n_contexts: int, unknown: Unknown, known: KnownCodes | None = None
) -> BatchMatches:
    """The same for columns by name. Given ones that are `known` were encoded before."""
    derived: frozenset[str] = frozenset()
    if compiled.derivation is not None:
        columns = compiled.derivation.complete_frame(columns, n_contexts, needs_all=unknown == "error")
        derived = compiled.derivation.names
    by_slot = np.empty((compiled.codes.n_codes, n_contexts), np.int32) if known is None else known.by_slot.copy()
    for at, condition in enumerate(compiled.conditions):
        if known is not None and condition.name in columns and condition.name not in derived:
            missing = np.flatnonzero(known.missing.get(condition.name, False))
        else:
            missing = encode_column(compiled, at, columns.get(condition.name), by_slot, unknown == "any")
        if len(missing) and unknown == "error":
            raise _missing(compiled, condition.name, missing)
    if compiled.when is None:
        return BatchMatches(compiled, n_contexts, by_slot)
    rules = ManyRules.read(compiled.when, columns, n_contexts, unknown)
    for condition in compiled.ruled if unknown == "error" else ():
        if len(missing := rules.missing(condition.name)):
            raise _missing(compiled, condition.name, missing)
    return BatchMatches(compiled, n_contexts, by_slot, rules)


def encode_column(compiled: CompiledData, at: int, given: Any, by_slot: Codes, is_ignored: bool) -> Rows:
    """Put the codes of one condition's facts into their slots of int32 [P, N]; `is_ignored` is what becomes of missing facts, as
    all are where nothing is given. Gives the contexts whose fact is missing, int64 [n]. Raises ContextError for a fact that is
    wrong, or a set of values."""
    slots, masks, start = compiled.codes.slots[at], compiled.masks[at], compiled.codes.starts[at]
    own = by_slot[slots.start : slots.stop]
    n = own.shape[1]
    absent = np.array([start + code for code in masks.codes(None)], np.int32)[:, None]
    if is_ignored:
        absent[:] = compiled.codes.ignored(at)
    if given is None:
        own[:] = absent
        return np.arange(n)
    cells = compiled.number_cells[at] if n >= MANY_NUMBERS else None
    n_missing = read_column(compiled.core, at, _plain(given), start, is_ignored, cells, own) if len(slots) else None
    if n_missing is None:
        facts, numbers = read_each(given, compiled.conditions[at])
        codes = [absent[:, 0] if fact is None else np.add(start, masks.codes(fact)) for fact in facts]
        own[:] = np.array(codes, np.int32).reshape(len(codes), len(slots)).T[:, numbers]
        return np.flatnonzero(np.array([fact is None for fact in facts], np.bool_)[numbers])
    return np.flatnonzero(own[0] == absent[0]) if n_missing else np.zeros(0, np.int64)


def _plain(given: Any) -> Any:
    """A column as the core takes it: a list or tuple, an array of numbers, truths or texts, or an Arrow stream."""
    if isinstance(given, (list, tuple)):
        is_of_numpy = bool(given) and isinstance(given[0], np.number) and len(set(map(type, given))) == 1
        numbers = np.array(given) if is_of_numpy else None
        return given if numbers is None or numbers.dtype.kind not in "iuf" else numbers
    if isinstance(given, np.ndarray) and given.dtype.kind == "M" and (days := as_series(given, "Date")) is not None:
        given = days
    if is_series(given):
        is_flat = not given.dtype.is_nested() and not given.dtype.is_object()
        return given.__arrow_c_stream__() if is_flat else given.to_list()
    if isinstance(given, np.ndarray) and given.dtype.kind in "biufU" and given.dtype.isnative:
        return np.ascontiguousarray(given)
    return listed(given)


def _missing(compiled: CompiledData, name: str, rows: Rows) -> ContextError:
    derivation = compiled.derivation
    if derivation is not None and name in derivation.names:
        return derivation.no_values(name, rows)
    return missing_in_contexts(name, rows)
