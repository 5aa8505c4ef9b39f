"""Columns of recorded facts, read so that no fact can stop the evaluation: N rows.

What is outside a condition's domain becomes missing, and is noted; numbers outside their bounds stay, and are noted too. Columns
that are plainly typed are read as a whole; of others each distinct value once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from contextdb.bitmask import Flags
from contextdb.cells.conditions import Condition
from contextdb.cells.fact_columns import column_type
from contextdb.cells.facts import Fact, read_fact, read_fact_text
from contextdb.cells.sets import Cell, covers
from contextdb.cells.words import format_number
from contextdb.compiled.batch import encode_column
from contextdb.compiled.classes import TagMasks
from contextdb.compiled.data import CompiledData
from contextdb.core import group_keys, hash_keys, pack_codes, unpack_codes
from contextdb.covering.factors import TagFactor
from contextdb.errors import ContextError, safe_text

PLAIN_NUMBER = r"^[ \t]*[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?[ \t]*$"
MOST_EXAMPLES = 5


Doubles = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FactColumn:
    """The facts of one condition, which are missing, and which lie outside the domain; None where none does."""

    values: Doubles | pl.Series
    """Numbers: float64 [N], NaN where missing. Others: a series, null where missing; that of an enum is a `pl.Enum`."""
    missing: Flags | None
    outside: Flags | None
    given: pl.Series
    """As the file has them."""

    def examples(self, counted: Flags) -> tuple[str, ...]:
        """A few of the values outside, the first by their letters, of the rows that count."""
        if self.outside is None:
            return ()
        values = self.given.filter(pl.Series(self.outside & counted))
        if isinstance(values.dtype, pl.Float32 | pl.Float64 | pl.String) or values.dtype.is_integer():
            texts = values.unique().to_list()
        else:
            texts = values.to_list()
        return tuple(sorted({_value_text(value) for value in texts})[:MOST_EXAMPLES])


def read_facts(given: pl.Series, condition: Condition, is_text: bool) -> FactColumn:
    """A recorded column as facts of a condition, with what is missing and what is outside its domain."""
    kind = condition.domain.type
    if kind.is_numeric:
        return _numbers(given, condition, is_text)
    if kind.is_truth and given.dtype == pl.Boolean:
        return FactColumn(given, _nulls(given), None, given)
    if kind.needs_values and given.dtype == pl.String and not is_text:
        return _names(given, condition)
    return _each(given, condition, is_text)


def _nulls(series: pl.Series) -> Flags | None:
    return series.is_null().to_numpy() if series.null_count() else None


def _some(flags: Flags) -> Flags | None:
    return flags if flags.any() else None


def _names(given: pl.Series, condition: Condition) -> FactColumn:
    """Values of an enum, all at once."""
    known = given.cast(_dtype(condition), strict=False)
    n_outside = known.null_count() - given.null_count()
    outside = (known.is_null() & given.is_not_null()).to_numpy() if n_outside else None
    return FactColumn(known, _nulls(given), outside, given)


def _numbers(given: pl.Series, condition: Condition, is_text: bool) -> FactColumn:
    if not is_text and condition.domain.type.is_column(given.dtype):
        facts = _doubles(given)
        if _is_inside(facts, condition):
            return FactColumn(facts, None, None, given)
        return _judged(facts.copy(), np.zeros(len(facts), np.bool_), condition, given)
    if is_text and given.dtype == pl.String and condition.domain.type.is_decimal:
        facts, read = _number_texts(given, condition)
    else:
        read = _each(given, condition, is_text)
        facts = _doubles(pl.Series(read.values)).copy()
    wrong = np.zeros(len(facts), np.bool_) if read is None or read.outside is None else read.outside.copy()
    return _judged(facts, wrong, condition, given)


def _doubles(series: pl.Series) -> Doubles:
    """Numbers as float64 [N], NaN where missing; they may be the series' own and are not to be written to."""
    wide = series.to_physical().cast(pl.Float64)
    return (wide.fill_null(np.nan) if wide.null_count() else wide).to_numpy()


def _is_inside(facts: Doubles, condition: Condition) -> bool:
    """Whether no fact is missing or outside the domain, as far as a quick test shows."""
    domain = condition.domain
    if domain.type.is_whole or not len(facts):
        return False
    low, high = facts.min(), facts.max()  # NaN where one of them is
    return bool(
        np.isfinite(low) and np.isfinite(high) if domain.type.is_circular else low >= domain.minimum and high <= domain.maximum
    )


def _judged(facts: Doubles, wrong: Flags, condition: Condition, given: pl.Series) -> FactColumn:
    """Numbers, of which some may be known to be no fact."""
    domain = condition.domain
    if domain.type.is_whole:
        wrong |= ~np.isnan(facts) & (facts != np.trunc(facts))
    if domain.type.is_circular:
        wrong |= np.isinf(facts)
    facts[wrong] = np.nan
    missing = np.isnan(facts) & ~wrong
    if not domain.type.is_circular:
        wrong = wrong | (facts < domain.minimum) | (facts > domain.maximum)
    return FactColumn(facts, _some(missing), _some(wrong), given)


def _number_texts(given: pl.Series, condition: Condition) -> tuple[Doubles, FactColumn | None]:
    """Numbers written as texts: plain ones at once, all others one by one."""
    is_plain = given.str.contains(PLAIN_NUMBER).fill_null(False).to_numpy()
    facts = _doubles(given.str.strip_chars(" \t").cast(pl.Float64, strict=False)).copy()
    others = np.flatnonzero(~is_plain)
    if not len(others):
        return facts, None
    read = _each(given.gather(others), condition, True)
    facts[others] = _doubles(pl.Series(read.values))
    outside = np.zeros(len(given), np.bool_)
    if read.outside is not None:
        outside[others] = read.outside
    return facts, FactColumn(facts, None, outside, given)


def _each(given: pl.Series, condition: Condition, is_text: bool) -> FactColumn:
    """Read every distinct value once."""
    codes, values = _coded(given)
    read: Callable[[object], Fact] = (
        (lambda v: None if v is None else read_fact_text(str(v), condition)) if is_text else (lambda v: read_fact(v, condition))
    )
    facts: list[object] = []
    wrong: list[bool] = []
    for value in values:
        try:
            fact = read(value)
        except (ContextError, TypeError):
            fact = Cell(None)
        wrong.append(isinstance(fact, Cell))
        facts.append(None if isinstance(fact, Cell) else sorted(fact) if isinstance(fact, frozenset) else fact)
    distinct = pl.Series(facts, dtype=_dtype(condition), strict=False)
    taken = distinct.gather(codes) if len(codes) else distinct.clear()
    is_wrong = np.array(wrong, np.bool_)[codes] if len(codes) else np.zeros(0, np.bool_)
    return FactColumn(taken, _some(taken.is_null().to_numpy() & ~is_wrong), _some(is_wrong), given)


def _coded(given: pl.Series) -> tuple[NDArray[np.int64], list[object]]:
    """A number for each value, and the value of each number."""
    if isinstance(given.dtype, (pl.Categorical, pl.Enum)):
        given = given.cast(pl.String)
    if given.dtype == pl.String:
        distinct = given.drop_nulls().unique(maintain_order=True)
        codes = given.cast(pl.Enum(distinct)).to_physical().cast(pl.Int64).fill_null(len(distinct))
        return codes.to_numpy(), [*distinct.to_list(), None]
    known: dict[object, int] = {}
    values: list[object] = []
    seen = []
    for value in given.to_list():
        key = (type(value), str(value))
        if key not in known:
            known[key] = len(values)
            values.append(value)
        seen.append(known[key])
    return np.array(seen, np.int64), values


def _dtype(condition: Condition) -> pl.DataType:
    kind = condition.domain.type
    if kind.is_numeric:
        return pl.Float64()
    dtype: pl.DataType = pl.Enum(list(condition.domain.values or ())) if kind.needs_values else column_type(kind)
    return dtype


def _value_text(value: object) -> str:
    if isinstance(value, (float, int)) and not isinstance(value, bool):
        return format_number(value)
    return " ".join(sorted(map(str, value))) if isinstance(value, list) else safe_text(str(value))


# ---- how a context is written as a key: for each condition the class of its fact, in a few bits of one of K words. Two
# contexts of one key have the same valid rows, and lie in the same gaps. The fields of a key are the codes of
# `contextdb.compiled.codes` in their order, each as a class of its column, and behind them the classes of sets of tags that
# make gaps. A missing fact is a class of its own, the last

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


# ---- contexts as keys: which are the same, how many there are, and a sample of them that can be summed over files. N
# contexts, K words a key. The smallest hashes seen are a uniform sample of the distinct contexts that is the same in
# whichever order files come; as long as it is not full it is all of them. Source: Bar-Yossef et al., "Counting distinct
# elements in a data stream", RANDOM 2002 (the k-th smallest hash as an estimator)

Field = tuple[int, int, int, int]
"""Where a code is in a key: its word, its first bit, how many bits it has, and the code that is 0 there."""
KeyWords = NDArray[np.uint64]
"""uint64 [K, N]"""
Hashes = NDArray[np.uint64]
Counts = NDArray[np.int64]


def hashes_of(words: KeyWords) -> Hashes:
    """A 64-bit number for each key, the same on every machine."""
    hashes = np.empty(words.shape[1], np.uint64)
    hash_keys(words, hashes)
    return hashes


def grouped(words: KeyWords, moments: Counts) -> tuple[Hashes, NDArray[np.int32], Counts]:
    """The distinct keys that have moments: their hashes, the first context of each, and the sum of their moments."""
    hashes = hashes_of(words)
    first, sums = np.empty(len(hashes), np.int32), np.empty(len(hashes), np.int64)
    n = group_keys(words, hashes, moments, first, sums)
    return hashes[first[:n]], first[:n], sums[:n]


def begins(ordered: Hashes) -> NDArray[np.bool_]:
    """Which of some ascending hashes differ from the one before."""
    flags = np.ones(len(ordered), np.bool_)
    flags[1:] = ordered[1:] != ordered[:-1]
    return flags


def estimated(hashes: Hashes, is_full: bool) -> int:
    """How many distinct contexts there are, by the smallest of their hashes."""
    if not is_full:
        return len(hashes)
    return round((len(hashes) - 1) / ((float(hashes[-1]) + 1.0) / 2.0**64))
