"""How a context is written as a key: for each condition the class of its fact, in a few bits of one of K words.

Two contexts of one key have the same valid rows, and lie in the same gaps. The fields of a key are the codes of
`contextdb.compiled.stack` in their order, each as a class of its column, and behind them the classes of sets of tags that make
gaps. A missing fact is a
class of its own, the last.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from contextdb.cells.angles import wrap_angles
from contextdb.cells.sets import covers
from contextdb.compiled.classes import NumberMasks, TagMasks, ValueMasks, WideMasks
from contextdb.compiled.data import CompiledData
from contextdb.covering.factors import TagFactor
from contextdb.telemetry.facts_read import FactColumn
from contextdb.telemetry.keys import KeyWords, add_classes, add_numbers
from contextdb.telemetry.number_classes import NumberClasses

Column = NDArray[np.float64] | pl.Series | list[Any]
BITS = 64


@dataclass(frozen=True, eq=False)
class Fields:
    """The fields of a table's keys. P of them; the first n_codes are the codes of a context."""

    compiled: CompiledData
    tags: Mapping[str, tuple[TagFactor, ...]]
    """For each condition of tags its factors."""

    @cached_property
    def slots(self) -> tuple[tuple[int, ...], ...]:
        stack, found = self.compiled.stack, []
        plain, wide = 0, stack.n_plain
        for at, masks in enumerate(self.compiled.masks):
            is_wide = isinstance(masks, WideMasks)
            n = 1 if is_wide else stack.n_slots[at]
            first = wide if is_wide else plain
            found.append(tuple(range(first, first + n)))
            plain, wide = (plain, wide + n) if is_wide else (plain + n, wide)
        return tuple(found)

    @cached_property
    def table(self) -> NDArray[np.int64]:
        """For each field its word, shift, bits, first mask, and the class of a missing fact: int64 [P, 5]."""
        found, word, shift = [], 0, 0
        for first, missing in self._sizes():
            n_bits = max(1, missing.bit_length())
            word, shift = (word + 1, 0) if shift + n_bits > BITS else (word, shift)
            found.append((word, shift, (1 << n_bits) - 1, first, missing))
            shift += n_bits
        return np.array(found, np.int64).reshape(-1, 5)

    def _sizes(self) -> list[tuple[int, int]]:
        """For each field its first mask and the class of a missing fact."""
        stack = self.compiled.stack
        sizes = [(0, 0)] * stack.n_codes
        for at, (masks, slots) in enumerate(zip(self.compiled.masks, self.slots, strict=True)):
            step = 3 if isinstance(masks, TagMasks) else 0
            for i, (slot, missing) in enumerate(zip(slots, masks.codes(None), strict=True)):
                first = 0 if isinstance(masks, WideMasks) else stack.starts[at] + step * i
                sizes[slot] = (first, missing - step * i)
        return sizes + [(0, len(f.answers)) for factors in self.tags.values() for f in factors]

    @cached_property
    def n_words(self) -> int:
        """K: how many words a key has."""
        return int(self.table[:, 0].max(initial=0)) + 1

    @cached_property
    def groups(self) -> tuple[NDArray[np.int64], ...]:
        """The groups of the stack; their members are fields."""
        members, *rest = self.compiled.stack.groups.arrays
        kinds = zip(self.compiled.masks, self.slots, strict=True)
        values = [slot for masks, slots in kinds if isinstance(masks, (ValueMasks, TagMasks)) for slot in slots]
        return np.array(values, np.int64)[members], *rest

    @cached_property
    def numbers(self) -> NDArray[np.int64]:
        """The fields of columns of numbers that are not wide."""
        kinds = zip(self.compiled.masks, self.slots, strict=True)
        return np.array([slot for masks, slots in kinds if isinstance(masks, NumberMasks) for slot in slots], np.int64)

    @cached_property
    def number_classes(self) -> dict[int, NumberClasses]:
        """For the field of each column of numbers its bounds."""
        kinds = zip(self.compiled.masks, self.slots, strict=True)
        return {slots[0]: NumberClasses.of(masks.bounds) for masks, slots in kinds if isinstance(masks, (NumberMasks, WideMasks))}

    def words(self, read: Mapping[str, FactColumn], n_rows: int) -> KeyWords:
        """The key of each context; where a column was not read all its facts are missing."""
        columns: dict[str, Column] = {name: column.values for name, column in read.items()}
        compiled = self.compiled
        if compiled.derivation is not None:
            columns = compiled.derivation.complete_frame(columns, n_rows)
        out = np.zeros((self.n_words, n_rows), np.uint64)
        for condition, masks, slots in zip(compiled.conditions, compiled.masks, self.slots, strict=True):
            column = columns.get(condition.name)
            if column is None:
                self._put_missing(slots, out)
            elif isinstance(masks, ValueMasks):
                self._put(slots[0], _value_classes(pl.Series(column), masks), out)
            elif isinstance(masks, TagMasks):
                self._put_tags(slots, column, partial(_answers, masks), out)
            else:
                facts = np.asarray(column, np.float64)
                facts = wrap_angles(facts) if condition.domain.type.is_circular else facts
                word, shift = self.table[slots[0], :2].tolist()
                add_numbers(facts, self.number_classes[slots[0]], shift, out[word])
        at = compiled.stack.n_codes
        for name, factors in self.tags.items():
            own = range(at, at + len(factors))
            if name in columns:
                self._put_tags(own, columns[name], partial(_classes_in, factors), out)
            else:
                self._put_missing(own, out)
            at += len(factors)
        return out

    def _put(self, field: int, classes: NDArray[np.int32] | NDArray[np.uint8], out: KeyWords) -> None:
        word, shift = self.table[field, :2].tolist()
        add_classes(classes, shift, out[word])

    def _put_missing(self, fields: Sequence[int], out: KeyWords) -> None:
        for field in fields:
            word, shift, _, _, missing = self.table[field].tolist()
            out[word] |= np.uint64(missing) << np.uint64(shift)

    def _put_tags(
        self, fields: Sequence[int], facts: Column, classes: Callable[[frozenset[str] | None], list[int]], out: KeyWords
    ) -> None:
        """Put the classes of each set of tags; each distinct set is asked once."""
        known: dict[frozenset[str] | None, list[int]] = {}
        found = []
        for listed in facts.to_list() if isinstance(facts, pl.Series) else facts:
            tags = None if listed is None else frozenset(map(str, listed))
            if tags not in known:
                known[tags] = classes(tags)
            found.append(known[tags])
        for field, own in zip(fields, np.array(found, np.int32).reshape(len(found), len(fields)).T, strict=True):
            self._put(field, np.ascontiguousarray(own), out)

    def codes(self, words: KeyWords) -> NDArray[np.int32]:
        """The codes of some keys, as the stack has them, and behind them the classes of tags, -1 where missing: int32 [N, P]."""
        found = np.empty((words.shape[1], len(self.table)), np.int32)
        for j, (word, shift, bits, first, _) in enumerate(self.table.tolist()):
            found[:, j] = first + ((words[word] >> np.uint64(shift)) & np.uint64(bits)).astype(np.int32)
        tags = found[:, self.compiled.stack.n_codes :]
        tags[tags == self.table[self.compiled.stack.n_codes :, 4]] = -1
        return found


def _value_classes(facts: pl.Series, masks: ValueMasks) -> NDArray[np.int32] | NDArray[np.uint8]:
    """The class of each value, the last where it is missing."""
    missing = len(masks.masks) - 1
    if facts.dtype == pl.Boolean:
        found = facts.cast(pl.UInt8)
    elif masks.has_others:
        named = facts.cast(pl.String).cast(pl.Enum([str(v) for v in masks.values]), strict=False).to_physical()
        found = pl.select(pl.when(facts.is_not_null()).then(named.fill_null(missing - 1))).to_series()
    else:
        values = pl.Enum([str(v) for v in masks.values])
        found = (facts if facts.dtype == values else facts.cast(pl.String).cast(values, strict=False)).to_physical()
    if found.null_count():
        found = found.cast(pl.Int32).fill_null(missing)
    return (found if found.dtype in (pl.UInt8, pl.Int32) else found.cast(pl.Int32)).to_numpy()


def _answers(masks: TagMasks, tags: frozenset[str] | None) -> list[int]:
    return [code % 3 for code in masks.codes(tags)]


def _classes_in(factors: Sequence[TagFactor], tags: frozenset[str] | None) -> list[int]:
    return [len(f.answers) if tags is None else _class_in(f, tags) for f in factors]


def _class_in(factor: TagFactor, tags: frozenset[str]) -> int:
    answer = sum(1 << i for i, tag in enumerate(factor.tags) if covers(tag, tags))
    return factor.answers.index(answer) if answer in factor.answers else len(factor.answers)
