"""Hold one telemetry file against a table: the one function that every engine runs.

A chunk at a time is read, its contexts are written as keys, and of each distinct key the valid rows are looked up once. Chunks are
worked out side by side, as many as there are cores; their sums are the same in any order.

Once more were seen, only what is not above the largest retained can still be among the smallest; so what is retained has all
its moments, however the contexts come.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from contextdb.bitmask import Flags
from contextdb.compiled.batch import answered
from contextdb.errors import ContextDBError, Fault, Place, TableError, in_quotes, no_such, plural
from contextdb.telemetry import parts
from contextdb.telemetry.chunks import Chunk, chunks_of
from contextdb.telemetry.facts_read import Counts, FactColumn, Fields, Hashes, KeyWords, begins, grouped, read_facts
from contextdb.telemetry.parts import Part, Plan, most_examples, nothing, require_countable

Chunks = Iterable[tuple[Sequence[str], Chunk]]
TellRows = Callable[[float], None]
"""Receives which share of a file is done."""


def observe_file(plan: Plan, path: str | Path, n_threads: int = 1, tell: TellRows | None = None) -> Part:
    """Hold one file against the table; a file that cannot be read gives a part that says why."""
    sums = _Sums(plan)
    try:
        chunks = chunks_of(Path(path), {*plan.compiled.asked, *([plan.count] if plan.count else [])}, plan.compiled.name)
        for chunk in _worked_out(plan, chunks, str(path), n_threads):
            sums.add(chunk)
            if tell is not None:
                tell(chunk.share_done)
    except ContextDBError as error:
        return nothing(plan, error.faults)
    return sums.part()


def _worked_out(plan: Plan, chunks: Chunks, file: str, n_threads: int) -> Iterator[_Evaluated]:
    if n_threads == 1:
        yield from (_observe_chunk(plan, names, chunk, file) for names, chunk in chunks)
        return
    waiting: deque[Future[_Evaluated]] = deque()
    with ThreadPoolExecutor(n_threads) as pool:
        for names, chunk in chunks:
            waiting.append(pool.submit(_observe_chunk, plan, names, chunk, file))
            if len(waiting) > n_threads:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


@dataclass(frozen=True, eq=False)
class _Evaluated:
    """What a chunk holds: its distinct contexts (M of them), and what is wrong with its facts."""

    rows: int
    moments: int
    hits: Counts
    hashes: Hashes
    words: KeyWords
    first: NDArray[np.int32]
    """For each distinct context its column in `words`."""
    sums: Counts
    is_open: Flags
    missing: Mapping[str, int]
    outside: Mapping[str, int]
    examples: Mapping[str, tuple[str, ...]]
    columns: frozenset[str]
    share_done: float


def _observe_chunk(plan: Plan, names: Sequence[str], chunk: Chunk, file: str) -> _Evaluated:
    moments = moments_of(plan.count, names, chunk, file)
    conditions = plan.compiled.asked
    total = int(moments.sum())
    read = {n: read_facts(chunk.frame[n], c, chunk.is_text) for n, c in conditions.items() if n in names and chunk.n_rows}
    fields = plan.fields
    words = fields.words(read, chunk.n_rows)
    hashes, first, sums = grouped(words, moments)
    hits, is_open = _evaluated(fields, words, first, sums)
    outside = {n: int(moments[c.outside].sum()) for n, c in read.items() if c.outside is not None}
    return _Evaluated(
        rows=chunk.n_rows,
        moments=total,
        hits=hits,
        hashes=hashes,
        words=words,
        first=first,
        sums=sums,
        is_open=is_open,
        missing={n: _missing(read.get(n), moments, total) for n in conditions},
        outside=outside,
        examples={n: read[n].examples(moments > 0) for n, values in outside.items() if values},
        columns=frozenset(n for n in names if n not in conditions and n != plan.count),
        share_done=chunk.share_done,
    )


def _missing(column: FactColumn | None, moments: Counts, total: int) -> int:
    if column is None:
        return total
    return 0 if column.missing is None else int(moments[column.missing].sum())


def _evaluated(fields: Fields, words: KeyWords, rows: NDArray[np.int32], sums: Counts) -> tuple[Counts, Flags]:
    """The moments in which each row is valid, and which contexts have no row: int64 [n_rows], bool [M]."""
    compiled = fields.compiled
    counts, hits = np.empty(len(rows), np.int64), np.zeros(64 * len(compiled.enabled), np.int64)
    answered(compiled, fields.codes(words, rows, compiled.codes.n_codes), counts=counts, hits=hits, weights=sums)
    return hits[: compiled.n_rows], counts == 0


class _Sums:
    """Sums over the chunks of a file."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.rows = self.moments = self.uncovered = 0
        self.hits = np.zeros(plan.compiled.n_rows, np.int64)
        self.missing: Counter[str] = Counter()
        self.outside: Counter[str] = Counter()
        self.examples: dict[str, tuple[str, ...]] = {}
        self.columns: frozenset[str] = frozenset()
        self.distinct = SmallestHashes(parts.MOST_HASHES)
        self.open = SmallestKeys(parts.MOST_OPEN, plan.fields.n_words)

    def add(self, chunk: _Evaluated) -> None:
        require_countable(self.moments + chunk.moments)
        self.rows += chunk.rows
        self.moments += chunk.moments
        self.uncovered += int(chunk.sums[chunk.is_open].sum())
        self.hits += chunk.hits
        self.missing.update(chunk.missing)
        self.outside.update(chunk.outside)
        self.examples = most_examples(self.examples, chunk.examples)
        self.columns |= chunk.columns
        self.distinct.add(chunk.hashes)
        at = np.flatnonzero(chunk.is_open)
        self.open.add(chunk.hashes[at], chunk.words, chunk.first[at], chunk.sums[at])

    def part(self) -> Part:
        hashes, is_full = self.distinct.settled()
        open_hashes, words, moments, has_all = self.open.settled()
        return Part(
            rows=self.rows,
            moments=self.moments,
            uncovered=self.uncovered,
            hits=self.hits,
            missing=+self.missing,
            outside=+self.outside,
            examples=self.examples,
            columns=self.columns,
            hashes=hashes,
            is_full=is_full,
            open_hashes=open_hashes,
            open_keys=self.plan.fields.keys(words),
            open_moments=moments,
            has_all_open=has_all,
            files=1,
        )


# ---- how often each moment was seen


MOST_COUNT = 1 << 40
"""The largest number in a count column."""


def moments_of(count: str | None, names: Sequence[str], chunk: Chunk, file: str) -> Counts:
    """The number of moments of each row: int64 [N]; 1 without a count column. Raises TableError where there is no such column, or a
    count is missing or no whole number from 0 up; file and line, else row, are named."""
    if count is None:
        return np.ones(chunk.n_rows, np.int64)
    if count not in names:
        raise TableError(no_such("count column", count, names, f"one of {plural(len(names), 'column')}", Place(file)))
    if not chunk.n_rows:
        return np.zeros(0, np.int64)
    given = chunk.frame[count]
    is_number = given.dtype.is_numeric() or given.dtype in (pl.String, pl.Null)
    plain = given if is_number else pl.repeat(None, chunk.n_rows, dtype=pl.Null, eager=True)
    numbers = (plain.str.strip_chars() if plain.dtype == pl.String else plain).cast(pl.Float64, strict=False)
    right = (numbers.is_finite() & (numbers >= 0) & (numbers <= MOST_COUNT) & (numbers.floor() == numbers)).fill_null(False)
    if not is_number or not right.all():
        at = 0 if not is_number else int(np.flatnonzero(~right.to_numpy())[0])
        value = given[at]
        problem = "is missing" if value is None else f"{in_quotes(str(value))} is not a count"
        place = Place(file, chunk.line(at), count, chunk.first_row + at)
        raise TableError(Fault(f"the count {problem}.", f"a whole number from 0 to {MOST_COUNT:,}", place=place))
    return numbers.cast(pl.Int64).to_numpy()


# ---- the contexts of the smallest hashes, as many as are retained, with their moments: gathered chunk by chunk


class Smallest:
    """At most `most` hashes, the smallest of all that were added."""

    def __init__(self, most: int) -> None:
        self.most = most
        self.is_full = False
        """Whether there were more than are retained."""
        self._limit: np.uint64 | None = None
        self._parts: list[Hashes] = []
        self._n_waiting = 0

    def add(self, hashes: Hashes) -> NDArray[np.int64] | None:
        """Add some hashes; gives the places of those that may be among the smallest, None for all."""
        near = None if self._limit is None else np.flatnonzero(hashes <= self._limit)
        self._parts.append(hashes if near is None else hashes[near])
        self._n_waiting += len(self._parts[-1])
        return near

    @property
    def wants_sorting(self) -> bool:
        """Whether so many wait that the largest should go."""
        return self._n_waiting > 2 * self.most

    def settle(self) -> tuple[Hashes, NDArray[np.int64], NDArray[np.bool_]]:
        """Keep the smallest alone: they, ascending; the order of all that waited; and which of that order begin a new hash."""
        waiting = np.concatenate([np.zeros(0, np.uint64), *self._parts])
        order = np.argsort(waiting, kind="stable")
        ordered = waiting[order]
        is_new = begins(ordered)
        retained = ordered[is_new]
        self.is_full = self.is_full or len(retained) > self.most
        retained = retained[: self.most]
        self._limit = retained[-1] if self.is_full else None
        self._parts, self._n_waiting = [retained], len(retained)
        return retained, order, is_new


class SmallestHashes:
    """The smallest hashes alone."""

    def __init__(self, most: int) -> None:
        self._smallest = Smallest(most)

    def add(self, hashes: Hashes) -> None:
        self._smallest.add(hashes)
        if self._smallest.wants_sorting:
            self._smallest.settle()

    def settled(self) -> tuple[Hashes, bool]:
        """The smallest, ascending, and whether there were more."""
        hashes, _, _ = self._smallest.settle()
        return hashes, self._smallest.is_full


class SmallestKeys:
    """The contexts of the smallest hashes with their keys and moments."""

    def __init__(self, most: int, n_words: int) -> None:
        self._smallest = Smallest(most)
        self._words: list[KeyWords] = [np.zeros((n_words, 0), np.uint64)]
        self._moments: list[Counts] = [np.zeros(0, np.int64)]

    def add(self, hashes: Hashes, words: KeyWords, at: NDArray[np.int32], moments: Counts) -> None:
        """Add contexts: key i is column at[i] of `words`."""
        near = self._smallest.add(hashes)
        self._words.append(words[:, at if near is None else at[near]])
        self._moments.append(moments if near is None else moments[near])
        if self._smallest.wants_sorting:
            self.settled()

    def settled(self) -> tuple[Hashes, KeyWords, Counts, bool]:
        """Hashes ascending, keys and moments, and whether these are all."""
        hashes, order, is_new = self._smallest.settle()
        words, moments = np.concatenate(self._words, axis=1)[:, order], np.concatenate(self._moments)[order]
        sums = np.add.reduceat(moments, np.flatnonzero(is_new)) if len(moments) else moments
        self._words, self._moments = [words[:, is_new][:, : len(hashes)]], [sums[: len(hashes)]]
        return hashes, self._words[0], self._moments[0], not self._smallest.is_full
