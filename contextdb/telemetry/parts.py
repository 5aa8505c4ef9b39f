"""What telemetry files say of a table, and the sum of several. The sum is the same in whichever order files come."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.compiled.data import CompiledData
from contextdb.covering.factors import TagFactor
from contextdb.errors import Fault, TableError
from contextdb.telemetry.facts_read import MOST_EXAMPLES, Counts, Fields, Hashes, begins

MOST_OPEN = 1 << 13
"""Different contexts without a row that a part keeps: these make the gaps."""
MOST_HASHES = 1 << 16
MOST_MOMENTS = 1 << 62
Keys = NDArray[np.int32]
"""Codes of contexts as `contextdb.compiled.codes` has them, and the classes of their sets of tags: int32 [N, P]."""


@dataclass(frozen=True, eq=False)
class Plan:
    """What is worked out for each file."""

    compiled: CompiledData
    count: str | None
    tags: Mapping[str, tuple[TagFactor, ...]]
    """For each condition of tags its factors; their classes are behind the codes in a key."""

    @cached_property
    def fields(self) -> Fields:
        """How contexts are written as keys."""
        return Fields(self.compiled, self.tags)


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
    width = plan.compiled.codes.n_codes + sum(map(len, plan.tags.values()))
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


def added(a: Part, b: Part) -> Part:
    """The sum of two parts. Raises TableError where there are more moments than can be counted."""
    require_countable(a.moments + b.moments)
    hashes = _distinct(a.hashes, b.hashes)
    return Part(
        a.rows + b.rows,
        a.moments + b.moments,
        a.uncovered + b.uncovered,
        a.hits + b.hits,
        a.missing + b.missing,
        a.outside + b.outside,
        most_examples(a.examples, b.examples),
        a.columns | b.columns,
        hashes[:MOST_HASHES],
        a.is_full or b.is_full or len(hashes) > MOST_HASHES,
        *_open_of(a, b),
        a.faults + b.faults,
        a.files + b.files,
    )


def require_countable(moments: int) -> None:
    """Refuse more moments than can be counted."""
    if moments > MOST_MOMENTS:
        raise TableError(Fault("there are more moments than can be counted.", f"{MOST_MOMENTS:,} at most"))


def most_examples(a: Mapping[str, tuple[str, ...]], b: Mapping[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
    """The examples of both, those that are retained."""
    return {n: tuple(sorted({*a.get(n, ()), *b.get(n, ())})[:MOST_EXAMPLES]) for n in sorted({*a, *b})}


def _distinct(a: Hashes, b: Hashes) -> Hashes:
    """The hashes of both, ascending, each once."""
    both = np.sort(np.concatenate([a, b]))
    return both[begins(both)]


def _open_of(a: Part, b: Part) -> tuple[Hashes, Keys, Counts, bool]:
    """The contexts without a row of both, those of the smallest hashes where there are too many: their moments are all there."""
    hashes, first, inverse = np.unique(np.concatenate([a.open_hashes, b.open_hashes]), return_index=True, return_inverse=True)
    moments = np.zeros(len(hashes), np.int64)
    np.add.at(moments, inverse.reshape(-1), np.concatenate([a.open_moments, b.open_moments]))
    keys = np.concatenate([a.open_keys, b.open_keys])[first]
    has_all = a.has_all_open and b.has_all_open and len(hashes) <= MOST_OPEN
    return hashes[:MOST_OPEN], keys[:MOST_OPEN], moments[:MOST_OPEN], has_all
