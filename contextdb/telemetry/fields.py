"""How a context is written as a key: for each condition the class of its fact, in a few bits of one of K words.

Two contexts of one key have the same valid rows, and lie in the same gaps. The fields of a key are the codes of
`contextdb.compiled.codes` in their order, each as a class of its column, and behind them the classes of sets of tags that
make gaps. A missing fact is a class of its own, the last.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from contextdb.cells.sets import covers
from contextdb.compiled.batch import encode_column
from contextdb.compiled.classes import TagMasks
from contextdb.compiled.data import CompiledData
from contextdb.core import pack_codes, unpack_codes
from contextdb.covering.factors import TagFactor
from contextdb.telemetry.facts_read import FactColumn
from contextdb.telemetry.keys import Field, KeyWords

Column = NDArray[np.float64] | pl.Series | list[Any]
BITS = 64


@dataclass(frozen=True, eq=False)
class Fields:
    """The fields of a table's keys. P of them; the first n_codes are the codes of a context."""

    compiled: CompiledData
    tags: Mapping[str, tuple[TagFactor, ...]]
    """For each condition of tags its factors."""

    @cached_property
    def fields(self) -> tuple[Field, ...]:
        """The field of each of the P codes."""
        fields, word, shift = [], 0, 0
        for first, missing in self._sizes():
            n_bits = max(1, missing.bit_length())
            word, shift = (word + 1, 0) if shift + n_bits > BITS else (word, shift)
            fields.append((word, shift, n_bits, first))
            shift += n_bits
        return tuple(fields)

    @cached_property
    def missing(self) -> list[int]:
        """The code of a missing fact in each field."""
        return [first + missing for first, missing in self._sizes()]

    def _sizes(self) -> list[tuple[int, int]]:
        """For each field its first code and the class of a missing fact."""
        codes = self.compiled.codes
        sizes = [(0, 0)] * codes.n_codes
        for masks, slots, start in zip(self.compiled.masks, codes.slots, codes.starts, strict=True):
            step = 3 if isinstance(masks, TagMasks) else 0
            for i, (slot, missing) in enumerate(zip(slots, masks.codes(None), strict=True)):
                sizes[slot] = (start + step * i, missing - step * i)
        return sizes + [(0, len(f.answers)) for factors in self.tags.values() for f in factors]

    @cached_property
    def n_words(self) -> int:
        """K: how many words a key has."""
        return max((word for word, *_ in self.fields), default=0) + 1

    def words(self, read: Mapping[str, FactColumn], n_rows: int) -> KeyWords:
        """The key of each context; where a column was not read all its facts are missing."""
        columns: dict[str, Column] = {name: column.values for name, column in read.items()}
        compiled = self.compiled
        if compiled.derivation is not None:
            columns = compiled.derivation.complete_frame(columns, n_rows)
        out = np.zeros((self.n_words, n_rows), np.uint64)
        by_slot = np.empty((compiled.codes.n_codes, n_rows), np.int32)
        for at, condition in enumerate(compiled.conditions):
            encode_column(compiled, at, columns.get(condition.name), by_slot, False)
        for field, codes in zip(self.fields, by_slot, strict=False):  # those of tags are behind
            pack_codes(codes, field, out)
        at = compiled.codes.n_codes
        for name, factors in self.tags.items():
            own = range(at, at + len(factors))
            if name in columns:
                self._put_tags(own, columns[name], partial(_classes_in, factors), out)
            else:
                for number in own:
                    pack_codes(np.full(n_rows, self.missing[number], np.int32), self.fields[number], out)
            at += len(factors)
        return out

    def _put_tags(
        self, fields: Sequence[int], facts: Column, classes: Callable[[frozenset[str] | None], list[int]], out: KeyWords
    ) -> None:
        """Put the classes of each set of tags; each distinct set is asked once."""
        known: dict[frozenset[str] | None, list[int]] = {}
        slots = []
        for listed in facts.to_list() if isinstance(facts, pl.Series) else facts:
            tags = None if listed is None else frozenset(map(str, listed))
            if tags not in known:
                known[tags] = classes(tags)
            slots.append(known[tags])
        for field, own in zip(fields, np.array(slots, np.int32).reshape(len(slots), len(fields)).T, strict=True):
            pack_codes(np.ascontiguousarray(own), self.fields[field], out)

    def codes(self, words: KeyWords, rows: NDArray[np.int32], n_fields: int) -> NDArray[np.int32]:
        """The first codes of some keys, one field after the other: int32 [n_fields, M]."""
        codes = np.empty((n_fields, len(rows)), np.int32)
        unpack_codes(words, rows, self.fields[:n_fields], codes)
        return codes

    def keys(self, words: KeyWords) -> NDArray[np.int32]:
        """All codes of keys, and behind them the classes of tags, -1 where missing: int32 [N, P]."""
        codes = self.codes(np.ascontiguousarray(words), np.arange(words.shape[1], dtype=np.int32), len(self.fields))
        n_codes = self.compiled.codes.n_codes
        tags = codes[n_codes:]
        tags[tags == np.array(self.missing[n_codes:], np.int32)[:, None]] = -1
        return np.ascontiguousarray(codes.T)


def _classes_in(factors: Sequence[TagFactor], tags: frozenset[str] | None) -> list[int]:
    return [len(f.answers) if tags is None else _class_in(f, tags) for f in factors]


def _class_in(factor: TagFactor, tags: frozenset[str]) -> int:
    answer = sum(1 << i for i, tag in enumerate(factor.tags) if covers(tag, tags))
    return factor.answers.index(answer) if answer in factor.answers else len(factor.answers)
