"""What a change would have done to recorded moments: both versions of a table are asked in each, and only sums are retained.

A moment changes where other rows are valid, where the policy may pick others of them, or where, with no row, another fallback
plays. A row is the same in both versions by its asset, and by how many rows before it have that asset. A fact that is missing
matches Any alone. Of each chunk the distinct pairs of answers are looked at once, so that the cost hangs on reading and asking.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Words
from contextdb.cells.conditions import Condition
from contextdb.compiled.batch import query_encoded
from contextdb.compiled.choosing import Choosing
from contextdb.compiled.data import CompiledData
from contextdb.disk.engines import Engine, with_dask
from contextdb.errors import ContextDBError, Fault, FileError
from contextdb.telemetry.characters import Characters, Played, characters_json, joined
from contextdb.telemetry.chunks import Chunk, chunks_of
from contextdb.telemetry.contexts import distinct_files
from contextdb.telemetry.facts_read import Counts, FactColumn, grouped, read_facts
from contextdb.telemetry.observe_file import moments_of

EMPTIED, FILLED, GAINS, LOSES = "emptied", "filled", "gains", "loses"
MOST_EXAMPLES = 3
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class ChangedBox:
    """Contexts that change, as cells, and what happens there: an asset of `gains` and `loses`."""

    what: str
    items: tuple[tuple[str, str], ...]
    """The conditions that it restricts, each with its cell."""
    asset: str | None = None

    @property
    def cells(self) -> dict[str, str]:
        return dict(self.items)


@dataclass(frozen=True)
class Example:
    """A recorded moment that changes: where it stands, its facts, and the valid assets before and after."""

    what: str
    file: str
    row: int
    line: int | None
    context: Mapping[str, object]
    before: tuple[str, ...]
    after: tuple[str, ...]

    @property
    def rank(self) -> tuple[object, ...]:
        """Those left without a row come first, else in the order of files."""
        return (self.what != EMPTIED, self.file, self.row)

    def to_json(self) -> dict[str, object]:
        own = {"what": self.what, "file": self.file, "row": self.row, "line": self.line, "context": dict(self.context)}
        return own | {"before": list(self.before), "after": list(self.after)}


@dataclass(frozen=True, eq=False)
class Comparison:
    """Two versions of a table, and boxes in which moments are counted."""

    before: CompiledData
    after: CompiledData
    count: str | None = None
    character: str | None = None
    time: str | None = None
    """The columns that say how often a moment was seen, whose it is, and at which second."""
    boxes: tuple[ChangedBox, ...] = ()
    box_table: CompiledData | None = None
    """A row for each of the boxes."""
    n_examples: int = MOST_EXAMPLES
    """So many moments that change are given."""

    @cached_property
    def sides(self) -> tuple[_Side, _Side]:
        keys: dict[tuple[str, int], int] = {}
        assets: dict[str, int] = {}
        return _Side.of(self.before, keys, assets), _Side.of(self.after, keys, assets)

    @cached_property
    def assets(self) -> tuple[str, ...]:
        """The assets of both, in the order of the rows before, then of those after."""
        return tuple(dict.fromkeys((*self.before.assets, *self.after.assets)))

    @property
    def named(self) -> tuple[str, ...]:
        """The columns that are no facts."""
        return tuple(name for name in (self.count, self.character, self.time) if name is not None)

    @property
    def tables(self) -> tuple[CompiledData, ...]:
        return (self.before, self.after, *([] if self.box_table is None else [self.box_table]))

    @cached_property
    def asked(self) -> frozenset[str]:
        """The facts that any of the tables needs."""
        return frozenset(name for table in self.tables for name in table.asked)


@dataclass(frozen=True, eq=False)
class _Side:
    """How one version's rows are told in both."""

    compiled: CompiledData
    keys: NDArray[np.int64]
    assets: NDArray[np.int64]
    """Numbers that rows of both have: of the row, and of its asset. int64 [n_rows]."""

    @classmethod
    def of(cls, compiled: CompiledData, keys: dict[tuple[str, int], int], assets: dict[str, int]) -> _Side:
        times: Counter[str] = Counter()
        own = []
        for asset in compiled.assets:
            own.append(keys.setdefault((asset, times[asset]), len(keys)))
            times[asset] += 1
        numbers = [assets.setdefault(asset, len(assets)) for asset in compiled.assets]
        return cls(compiled, np.array(own, np.int64), np.array(numbers, np.int64))


@dataclass(eq=False)
class Backtest:
    """Sums over recorded moments."""

    moments: int = 0
    changed: int = 0
    emptied: int = 0
    filled: int = 0
    gains: Counter[str] = field(default_factory=Counter)
    loses: Counter[str] = field(default_factory=Counter)
    """For each asset the moments in which it becomes valid, and in which it no longer is."""
    boxes: Counter[ChangedBox] = field(default_factory=Counter)
    examples: list[Example] = field(default_factory=list)
    characters: Characters = field(default_factory=dict)
    """What each character did, by file: where columns for both are named."""
    unread: list[tuple[str, tuple[Fault, ...]]] = field(default_factory=list)
    """Files that could not be read; nothing of them is counted."""

    def add(self, other: Backtest, n_examples: int = MOST_EXAMPLES) -> None:
        """Add the sums of other files, or of another chunk."""
        self.moments += other.moments
        self.changed += other.changed
        self.emptied += other.emptied
        self.filled += other.filled
        self.gains.update(other.gains)
        self.loses.update(other.loses)
        self.boxes.update(other.boxes)
        self.examples = sorted((*self.examples, *other.examples), key=lambda example: example.rank)[:n_examples]
        self.characters = joined(self.characters, other.characters)
        self.unread += other.unread

    def to_json(self) -> dict[str, object]:
        assets = sorted({*self.gains, *self.loses}, key=lambda asset: (-self.gains[asset] - self.loses[asset], asset))
        return {
            "moments": self.moments,
            "changed": self.changed,
            "emptied": self.emptied,
            "filled": self.filled,
            "by_asset": [{"asset": a, "gains": self.gains[a], "loses": self.loses[a]} for a in assets],
            "boxes": [{"what": box.what, "asset": box.asset, "cells": box.cells, "moments": n} for box, n in self.ordered_boxes],
            "examples": [example.to_json() for example in self.examples],
        } | ({"characters": characters_json(self.characters)} if self.characters else {})

    @property
    def ordered_boxes(self) -> list[tuple[ChangedBox, int]]:
        """The boxes that hold a moment: where none plays any more first, then those with most moments."""
        held = ((box, n) for box, n in self.boxes.items() if n)
        return sorted(held, key=lambda item: (item[0].what != EMPTIED, -item[1]))


def backtest(
    comparison: Comparison,
    patterns: Sequence[str],
    engine: Engine = "local",
    scheduler: str | None = None,
    progress: Callable[[float, int], None] | None = None,
) -> Backtest:
    """Ask both versions in every moment of some files. Raises FileError where none of them can be read, EngineError where Dask did
    not finish one."""
    paths = distinct_files(patterns)
    n_done, total = 0, Backtest()

    def tell(share: float) -> None:
        if progress is not None:
            progress(n_done + share, len(paths))

    here = (backtest_file(comparison, path, tell) for path in paths)
    there = (part for _, part in with_dask(backtest_file, comparison, paths, scheduler))
    for part in there if engine == "dask" else here:
        total.add(part, comparison.n_examples)
        n_done += 1
        tell(0.0)
    if total.unread and len(total.unread) == len(paths):
        raise FileError(*(fault for _, faults in total.unread for fault in faults))
    return total


def backtest_file(comparison: Comparison, path: Path, tell: Callable[[float], None] | None = None) -> Backtest:
    """The sums of one file; one that cannot be read says why."""
    total = Backtest()
    wanted = {*comparison.asked, *comparison.named}
    try:
        for names, chunk in chunks_of(path, wanted, comparison.after.name):
            total.add(_of_chunk(comparison, names, chunk, str(path)), comparison.n_examples)
            if tell is not None and chunk.share_done < 1.0:
                tell(chunk.share_done)
    except ContextDBError as error:
        return Backtest(unread=[(str(path), error.faults)])
    return total


def _of_chunk(comparison: Comparison, names: Sequence[str], chunk: Chunk, file: str) -> Backtest:
    moments = moments_of(comparison.count, names, chunk, file)
    known: dict[tuple[str, Condition], FactColumn] = {}
    masks = [_masks(table, names, chunk, known) for table in comparison.tables]
    played = Played.of(comparison.character, comparison.time, names, chunk, file)
    keys = [*masks, *([] if played is None else [played.codes[:, None].astype(np.uint64)])]
    words = np.ascontiguousarray(np.concatenate(keys, axis=1).T)
    _, first, sums = grouped(words, moments)
    pairs = [bitmask.unpack(mask[first], table.n_rows) for mask, table in zip(masks, comparison.tables, strict=True)]
    part, own, flags = _sums(comparison, pairs, sums)
    if played is not None:
        part.characters = played.sums(file, moments, played.codes[first], sums, flags)
    part.moments = int(moments.sum())
    for what, i in own:
        row = int(first[i])
        valid = (tuple(np.array(table.assets, object)[bits[i]]) for table, bits in zip(comparison.tables, pairs[:2], strict=False))
        facts = chunk.frame.row(row, named=True) if chunk.frame.width else {}
        context = {name: _plain(facts[name]) for name in sorted(comparison.asked) if name in names}
        part.examples.append(Example(what, file, chunk.first_row + row, chunk.line(row), context, *valid))
    return part


def _plain(value: object) -> object:
    """A recorded fact as JSON has it."""
    return value if value is None or isinstance(value, (bool, int, float, str, list)) else str(value)


def _masks(compiled: CompiledData, names: Sequence[str], chunk: Chunk, known: dict[tuple[str, Condition], FactColumn]) -> Words:
    """The valid rows of every moment: uint64 [N, W]."""
    columns: dict[str, Any] = {}
    for name, condition in compiled.asked.items():
        if name in names and chunk.n_rows:
            key = name, condition
            known[key] = known[key] if key in known else read_facts(chunk.frame[name], condition, chunk.is_text)
            columns[name] = known[key].values
        else:
            columns[name] = [None] * chunk.n_rows
    if not columns:
        return np.repeat(compiled.enabled[None], chunk.n_rows, axis=0)
    return query_encoded(compiled, columns, "never").mask


def _sums(comparison: Comparison, pairs: Sequence[Flags], sums: Counts) -> tuple[Backtest, list[tuple[str, int]], list[Flags]]:
    """What M distinct pairs of answers say, with their moments; a few of those that change, by number; and which change, are
    emptied and are filled."""
    old, new = comparison.sides
    was, now = (np.asarray(valid.any(axis=1)) for valid in pairs[:2])
    is_other = _differs(pairs[0], old.keys, pairs[1], new.keys)
    candidates = tuple(s.compiled.once(Choosing.of).pickable_of(p) for s, p in zip((old, new), pairs, strict=False))
    is_other |= _differs(candidates[0], old.keys, candidates[1], new.keys)
    if old.compiled.fallback != new.compiled.fallback:
        is_other |= ~was & ~now
    emptied, filled = was & ~now, now & ~was
    before, after = _spread(pairs[0], old.assets, len(comparison.assets)), _spread(pairs[1], new.assets, len(comparison.assets))
    gains, loses = after & ~before, before & ~after
    part = Backtest(
        changed=int(sums[is_other].sum()),
        emptied=int(sums[emptied].sum()),
        filled=int(sums[filled].sum()),
        gains=_counted(comparison.assets, gains, sums),
        loses=_counted(comparison.assets, loses, sums),
    )
    number = {asset: i for i, asset in enumerate(comparison.assets)}
    for i, box in enumerate(comparison.boxes):
        flags = {EMPTIED: emptied, FILLED: filled}.get(box.what)
        if flags is None:
            flags = (gains if box.what == GAINS else loses)[:, number[box.asset or ""]]
        part.boxes[box] = int(sums[flags & pairs[2][:, i]].sum())
    return part, list(_chosen(emptied, filled, is_other, comparison.n_examples)), [is_other, emptied, filled]


def _chosen(emptied: Flags, filled: Flags, is_other: Flags, n_examples: int) -> Iterator[tuple[str, int]]:
    for what, flags in ((EMPTIED, emptied), (FILLED, filled), ("changed", is_other & ~emptied & ~filled)):
        for i in np.flatnonzero(flags)[:n_examples].tolist():
            yield what, i


def _differs(a: Flags, a_numbers: NDArray[np.int64], b: Flags, b_numbers: NDArray[np.int64]) -> Flags:
    """Whether the rows of two versions differ, by numbers that both have: bool [M]."""
    n = int(max(a_numbers.max(initial=-1), b_numbers.max(initial=-1))) + 1
    return np.asarray((_spread(a, a_numbers, n) != _spread(b, b_numbers, n)).any(axis=1))


def _spread(flags: Flags, numbers: NDArray[np.int64], n: int) -> Flags:
    """Which of n numbers some row with a flag has: bool [M, n]."""
    rows, columns = np.nonzero(flags)
    spread = np.zeros((len(flags), n), np.bool_)
    spread[rows, numbers[columns]] = True
    return spread


def _counted(assets: Sequence[str], flags: Flags, sums: Counts) -> Counter[str]:
    totals: dict[str, int] = defaultdict(int)
    for i in np.flatnonzero(flags.any(axis=0)).tolist():
        totals[assets[i]] = int(sums[flags[:, i]].sum())
    return Counter(totals)
