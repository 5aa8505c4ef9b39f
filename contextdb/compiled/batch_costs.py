"""What soft cells cost in many contexts at once, for the rows that are asked for. P pairs of a context and a row, D depths."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Rows, Words
from contextdb.cells.conditions import Condition
from contextdb.cells.facts import read_fact
from contextdb.compiled.data import CompiledData
from contextdb.compiled.soft import SoftMasks

CostsOfPairs = Callable[[Rows, Rows], NDArray[np.float64]]
"""Of P contexts and rows what the soft cells of each depth cost: float64 [D, P]."""


def costs_of_pairs(
    compiled: CompiledData, columns: Any, n_contexts: int, mask_of: Callable[[CompiledData, Mapping[str, Any]], Words]
) -> CostsOfPairs:
    """What tells the costs of rows in contexts of plain facts. Each condition with soft cells is asked as a table of its own, by
    `mask_of`: which of them match."""
    if compiled.derivation is not None:
        columns = compiled.derivation.complete_frame(columns, n_contexts)
    parts = []
    for at, soft in enumerate(compiled.soft):
        if soft is not None:
            name = compiled.conditions[at].name
            given = {name: columns[name]} if name in columns else {name: [None] * n_contexts}
            parts.append((mask_of(_soft_table(compiled, at, soft), given), soft, compiled.conditions[at], given[name]))

    def costs(contexts: Rows, rows: Rows) -> NDArray[np.float64]:
        totals = np.zeros((compiled.n_depths, len(rows)))
        for masks, soft, condition, values in parts:
            for depth in range(len(totals)):
                at = depth * compiled.n_rows + rows
                matches = masks[contexts, at >> 6] >> (at & 63).astype(np.uint64) & np.uint64(1)
                grown = soft.penalties[at] if soft.growth is None else _grown(soft, condition, values, contexts, at)
                totals[depth] += np.where(matches, 0.0, grown)
        return totals

    return costs


def _grown(soft: SoftMasks, condition: Condition, values: Any, contexts: Rows, rows: Rows) -> NDArray[np.float64]:
    """What rows that do not match cost in contexts whose facts are some values: float64 [P]."""
    costs = np.empty(len(rows))
    for context in np.unique(contexts).tolist():
        own = contexts == context
        costs[own] = soft.grown(read_fact(values[context], condition))[rows[own]]
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
