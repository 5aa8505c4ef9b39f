"""What soft cells cost in many contexts at once, for the rows that are asked for. P pairs of a context and a row, D depths."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Rows
from contextdb.compiled.batch import BatchMatches, query_many
from contextdb.compiled.data import CompiledData, SoftMasks
from contextdb.compiled.many import FewerMatches, ManyMatches
from contextdb.compiled.matches import layered_penalties

CostsOfPairs = Callable[[Rows, Rows], NDArray[np.float64]]
"""Of P contexts and rows what the soft cells of each depth cost: float64 [D, P]."""


def costs_of_pairs(many: ManyMatches) -> CostsOfPairs | None:
    """What tells the costs of rows of many answers; None for a table without soft cells."""
    if not many.compiled.is_soft:
        return None
    if isinstance(many, FewerMatches):
        return costs_of_pairs(many.whole)
    return _of_batch(many) if isinstance(many, BatchMatches) else lambda contexts, rows: _one_by_one(many, contexts, rows)


def _one_by_one(many: ManyMatches, contexts: Rows, rows: Rows) -> NDArray[np.float64]:
    costs = np.empty((many.compiled.n_depths, len(rows)))
    for context in np.unique(contexts).tolist():
        start, stop = np.searchsorted(contexts, [context, context + 1])
        costs[:, start:stop] = layered_penalties(many[context])[:, rows[start:stop]]
    return costs


def _of_batch(many: BatchMatches) -> CostsOfPairs:
    """A batch asks each condition with soft cells as a table of its own: which of them match."""
    compiled, kept = many.compiled, many.kept
    assert kept is not None, "a table with soft cells keeps its facts"
    columns: Any = kept.columns
    if compiled.derivation is not None:
        columns = compiled.derivation.complete_frame(columns, len(many))
    parts = []
    for at, soft in enumerate(compiled.soft):
        if soft is not None:
            name = compiled.conditions[at].name
            given = {name: columns[name]} if name in columns else {name: [None] * len(many)}
            parts.append((query_many(_soft_table(compiled, at, soft), given, kept.unknown).mask, soft[1]))

    def costs(contexts: Rows, rows: Rows) -> NDArray[np.float64]:
        found = np.zeros((compiled.n_depths, len(rows)))
        for masks, penalties in parts:
            for depth in range(len(found)):
                at = depth * compiled.n_rows + rows
                matches = masks[contexts, at >> 6] >> (at & 63).astype(np.uint64) & np.uint64(1)
                found[depth] += np.where(matches, 0.0, penalties[at])
        return found

    return costs


def _soft_table(compiled: CompiledData, at: int, soft: SoftMasks) -> CompiledData:
    """The soft cells of one condition as a table in which each excludes what it does not match."""
    n = len(soft[1])
    return CompiledData(
        name=compiled.name,
        assets=range(n),  # type: ignore[arg-type]
        conditions=(compiled.conditions[at],),
        masks=(soft[0],),
        enabled=bitmask.full(n),
        soft=(None,),
        priorities=np.zeros(n, np.int64),
        row_weights=np.ones(n),
        texts=(),
    )
