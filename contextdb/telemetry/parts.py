"""What one telemetry file says of a table, and the sum of several. The sum is the same in whichever order files come.

The one function that every engine runs is `observe_file`: it depends on its arguments and the file alone, and gives at most a few
megabytes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from contextdb.batch import load_kernels
from contextdb.bitmask import Flags
from contextdb.cells import covers
from contextdb.compiled import CompiledTable
from contextdb.covering.factors import TagFactor
from contextdb.errors import ContextDBError, Fault, Place, TableError, in_quotes, nearest, plural
from contextdb.telemetry.chunks import Chunk, TelemetryFile
from contextdb.telemetry.facts_read import MOST_EXAMPLES, FactColumn, read_facts
from contextdb.telemetry.keys import MOST_HASHES, Counts, Hashes, Keys, add_hits, grouped

MOST_OPEN = 1 << 13
"""Different contexts without a row that a part keeps: these make the gaps."""
MOST_COUNT = 1 << 40
"""The largest number in a count column."""
BLOCK = 1 << 22
"""Bytes of masks at once."""


@dataclass(frozen=True, eq=False)
class Plan:
    """What is asked of each file."""

    compiled: CompiledTable
    count: str | None
    tags: Mapping[str, tuple[TagFactor, ...]]
    """For each condition of tags its factors; their classes stand behind the codes in a key."""


@dataclass(frozen=True, eq=False)
class Part:
    """Sums over some files. The smallest hashes of the distinct contexts, and keys and moments of those without a row."""

    rows: int
    moments: int
    uncovered: int
    hits: Counts
    missing: Counter[str]
    outside: Counter[str]
    examples: dict[str, tuple[str, ...]]
    columns: frozenset[str]
    """Columns that the table does not ask for."""
    hashes: Hashes
    is_full: bool
    """Whether there were more hashes than are kept."""
    open_hashes: Hashes
    open_keys: Keys
    open_moments: Counts
    has_all_open: bool
    faults: tuple[Fault, ...] = ()
    """Why the file could not be read; nothing of it is counted then."""
    files: int = 0
    """Files that were read to their end."""


def nothing(plan: Plan, faults: Sequence[Fault] = ()) -> Part:
    """The part of no file, or of one that cannot be read."""
    width = plan.compiled.stack.n_codes + sum(map(len, plan.tags.values()))
    keys, hits = np.zeros((0, width), np.int32), np.zeros(plan.compiled.n_rows, np.int64)
    return Part(
        rows=0,
        moments=0,
        uncovered=0,
        hits=hits,
        missing=Counter(),
        outside=Counter(),
        examples={},
        columns=frozenset(),
        hashes=np.zeros(0, np.uint64),
        is_full=False,
        open_hashes=np.zeros(0, np.uint64),
        open_keys=keys,
        open_moments=np.zeros(0, np.int64),
        has_all_open=True,
        faults=tuple(faults),
    )


def observe_file(plan: Plan, path: str | Path) -> Part:
    """Hold one file against the table; a file that cannot be read gives a part that says why."""
    total = nothing(plan)
    try:
        for names, chunk in TelemetryFile(Path(path)).chunks({*plan.compiled.asked, *([plan.count] if plan.count else [])}):
            total = added(total, _observe_chunk(plan, names, chunk, str(path)))
    except ContextDBError as error:
        return nothing(plan, error.faults)
    return replace(total, files=1)


def added(a: Part, b: Part) -> Part:
    """The sum of two parts.

    Raises
    ------
    TableError
        There are more moments than can be counted.
    """
    if a.moments + b.moments > 1 << 62:
        raise TableError(Fault("there are more moments than can be counted.", f"{1 << 62:,} at most"))
    hashes, is_full = _hashes_of(a, b)
    names = {*a.examples, *b.examples}
    examples = {n: tuple(sorted({*a.examples.get(n, ()), *b.examples.get(n, ())})[:MOST_EXAMPLES]) for n in names}
    return Part(
        a.rows + b.rows,
        a.moments + b.moments,
        a.uncovered + b.uncovered,
        a.hits + b.hits,
        a.missing + b.missing,
        a.outside + b.outside,
        examples,
        a.columns | b.columns,
        hashes,
        is_full,
        *_open_of(a, b),
        a.faults + b.faults,
        a.files + b.files,
    )


def _hashes_of(a: Part, b: Part) -> tuple[Hashes, bool]:
    """The smallest hashes of both, and whether there were more."""
    ends = [part.hashes[-1] for part in (a, b) if len(part.hashes) == MOST_HASHES]
    own = [part.hashes[: np.searchsorted(part.hashes, min(ends), "right")] if ends else part.hashes for part in (a, b)]
    hashes = np.unique(np.concatenate(own))
    n_known = sum(map(len, own))
    is_full = a.is_full or b.is_full or len(hashes) > MOST_HASHES or n_known < len(a.hashes) + len(b.hashes)
    return hashes[:MOST_HASHES], is_full


def _open_of(a: Part, b: Part) -> tuple[Hashes, Keys, Counts, bool]:
    """The contexts without a row of both, those of the smallest hashes where there are too many: their moments are all there."""
    hashes, first, inverse = np.unique(np.concatenate([a.open_hashes, b.open_hashes]), return_index=True, return_inverse=True)
    moments = np.zeros(len(hashes), np.int64)
    np.add.at(moments, inverse.reshape(-1), np.concatenate([a.open_moments, b.open_moments]))
    keys = np.concatenate([a.open_keys, b.open_keys])[first]
    has_all = a.has_all_open and b.has_all_open and len(hashes) <= MOST_OPEN
    return hashes[:MOST_OPEN], keys[:MOST_OPEN], moments[:MOST_OPEN], has_all


def _observe_chunk(plan: Plan, names: tuple[str, ...], chunk: Chunk, file: str) -> Part:
    moments = _moments(plan, names, chunk, file)
    asked = plan.compiled.asked
    counted = moments > 0
    read = {n: read_facts(chunk.frame[n], c, chunk.is_text) for n, c in asked.items() if n in names and chunk.n_rows}
    keys = _keys(plan, read, chunk.n_rows)
    hashes, first, sums = grouped(keys[counted], moments[counted])
    distinct = keys[counted][first]
    hits, is_open = _evaluated(plan.compiled, np.ascontiguousarray(distinct[:, : plan.compiled.stack.n_codes]), sums)
    order = np.argsort(hashes[is_open], kind="stable")[:MOST_OPEN]
    ordered = np.unique(hashes)
    outside = {n: int(moments[c.outside].sum()) for n, c in read.items()}
    return Part(
        rows=chunk.n_rows,
        moments=int(moments.sum()),
        uncovered=int(sums[is_open].sum()),
        hits=hits,
        missing=_missing(read, asked, moments),
        outside=+Counter(outside),
        examples={n: read[n].examples(counted) for n, found in outside.items() if found},
        columns=frozenset(n for n in names if n not in asked and n != plan.count),
        hashes=ordered[:MOST_HASHES],
        is_full=len(ordered) > MOST_HASHES,
        open_hashes=hashes[is_open][order],
        open_keys=distinct[is_open][order],
        open_moments=sums[is_open][order],
        has_all_open=int(is_open.sum()) <= MOST_OPEN,
    )


def _missing(read: Mapping[str, FactColumn], asked: Mapping[str, object], moments: Counts) -> Counter[str]:
    return +Counter({n: int(moments[read[n].missing].sum() if n in read else moments.sum()) for n in asked})


def _keys(plan: Plan, read: Mapping[str, FactColumn], n_rows: int) -> Keys:
    """What the table can tell of each context: its codes, and the classes of its sets of tags."""
    compiled = plan.compiled
    columns: dict[str, Any] = {
        n: read[n].values if n in read else pl.repeat(None, n_rows, dtype=pl.Null, eager=True) for n in compiled.asked
    }
    if not columns:
        return np.zeros((n_rows, compiled.stack.n_codes), np.int32)
    codes = compiled.query_many(columns, "never").codes
    classes = [_tag_classes(read.get(name), factors, n_rows) for name, factors in plan.tags.items()]
    return np.concatenate([codes, *classes], axis=1)


def _tag_classes(column: FactColumn | None, factors: Sequence[TagFactor], n_rows: int) -> Keys:
    """The class of each set of tags in each factor, -1 where it is missing: int32 [N, factors]."""
    if column is None or not factors:
        return np.full((n_rows, len(factors)), -1, np.int32)
    known: dict[tuple[str, ...] | None, list[int]] = {None: [-1] * len(factors)}
    found = []
    for listed in column.values.to_list():
        key = None if listed is None else tuple(listed)
        if key not in known:
            known[key] = [_class_in(factor, frozenset(key or ())) for factor in factors]
        found.append(known[key])
    return np.array(found, np.int32).reshape(n_rows, len(factors))


def _class_in(factor: TagFactor, tags: frozenset[str]) -> int:
    answer = sum(1 << i for i, tag in enumerate(factor.tags) if covers(tag, tags))
    return factor.answers.index(answer) if answer in factor.answers else -1


def _evaluated(compiled: CompiledTable, codes: NDArray[np.int32], moments: Counts) -> tuple[Counts, Flags]:
    """The moments in which each row is valid, and which contexts have no row."""
    n_words = len(compiled.enabled)
    hits, is_open = np.zeros(64 * n_words, np.int64), np.ones(len(codes), np.bool_)
    step = max(1, BLOCK // (8 * max(1, n_words)))
    for start in range(0, len(codes), step):
        masks = _masks(compiled, codes[start : start + step])
        is_open[start : start + step] = ~masks.any(axis=1)
        add_hits(masks, moments[start : start + step], hits)
    return hits[: compiled.n_rows], is_open


def _masks(compiled: CompiledTable, codes: NDArray[np.int32]) -> NDArray[np.uint64]:
    """The mask of each context's valid rows: uint64 [N, W]."""
    stack = compiled.stack
    if kernels := load_kernels(len(codes) * len(compiled.enabled)):
        out = np.empty((len(codes), len(compiled.enabled)), np.uint64)
        kernels.batch_masks(codes, stack.masks, stack.n_plain, stack.wide, compiled.enabled, out)
        return out
    found = np.broadcast_to(compiled.enabled, (len(codes), len(compiled.enabled))).copy()
    for j in range(stack.n_plain):
        found &= stack.masks[codes[:, j]]
    for i in range(len(stack.wide)):
        found &= stack.wide_masks(i, codes[:, stack.n_plain + i])
    return found


def _moments(plan: Plan, names: tuple[str, ...], chunk: Chunk, file: str) -> Counts:
    """How many moments each row stands for."""
    if plan.count is None:
        return np.ones(chunk.n_rows, np.int64)
    if plan.count not in names:
        near = nearest(plan.count, names)
        found = f"there is no count column {in_quotes(plan.count)}."
        accepted = f"one of {plural(len(names), 'column')}"
        raise TableError(Fault(found, accepted, in_quotes(near) if near else "", Place(file)))
    if not chunk.n_rows:
        return np.zeros(0, np.int64)
    given = chunk.frame[plan.count]
    is_number = given.dtype.is_numeric() or given.dtype in (pl.String, pl.Null)
    plain = given if is_number else pl.repeat(None, chunk.n_rows, dtype=pl.Null, eager=True)
    numbers = (plain.str.strip_chars() if plain.dtype == pl.String else plain).cast(pl.Float64, strict=False)
    right = (numbers.is_finite() & (numbers >= 0) & (numbers <= MOST_COUNT) & (numbers.floor() == numbers)).fill_null(False)
    if not is_number or not right.all():
        at = 0 if not is_number else int(np.flatnonzero(~right.to_numpy())[0])
        value = given[at]
        said = "is missing" if value is None else f"{in_quotes(str(value))} is no count"
        place = Place(file, chunk.line(at), plan.count, chunk.first_row + at)
        raise TableError(Fault(f"the count {said}.", f"a whole number from 0 to {MOST_COUNT:,}", place=place))
    return numbers.cast(pl.Int64).to_numpy()
