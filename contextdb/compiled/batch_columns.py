"""Columns of facts as they are given: by name, and equally long."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Rows, Words
from contextdb.cells.conditions import Condition
from contextdb.cells.fact_columns import is_frame, is_series, listed, plain_numbers
from contextdb.cells.facts import read_fact
from contextdb.cells.mirroring import frozen_fact, mirrored_fact, partner_of
from contextdb.cells.sets import Cell
from contextdb.columns import polars as pl
from contextdb.compiled.data import CompiledData
from contextdb.compiled.layers import SoftMasks
from contextdb.errors import ContextError, Fault, Place

Contexts: TypeAlias = "Mapping[str, Sequence[object] | NDArray[Any]] | pl.DataFrame"


def facts_of(contexts: object) -> dict[str, Any]:
    """The columns by name. Raises ContextError for what is no frame and no mapping of columns."""
    if is_frame(contexts):
        return {name: contexts[name] for name in contexts.columns}
    if not isinstance(contexts, Mapping):
        accepted = "a polars DataFrame, or a mapping of names to equally long columns"
        raise ContextError(Fault(f"{type(contexts).__name__} is not columns of facts.", accepted))
    for name, column in contexts.items():
        is_array = isinstance(column, np.ndarray)
        is_flat = column.ndim == 1 if is_array else isinstance(column, (list, tuple, range)) or is_series(column)
        if not is_flat:
            place = Place(column=str(name))
            raise ContextError(
                Fault(f"{type(column).__name__} is not a column of facts.", "a list, a flat array or a polars series", place=place)
            )
    return {name: column.tolist() if isinstance(column, np.ma.MaskedArray) else column for name, column in contexts.items()}


def common_length(columns: Mapping[str, Any]) -> int:
    """How many contexts equally long columns hold; 0 without a column."""
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) > 1:
        raise ContextError(Fault(f"the columns are not equally long: {lengths}.", "one fact for each context in every column"))
    return next(iter(lengths.values()), 0)


def holds_sets(given: Any, condition: Condition) -> bool:
    """Whether some fact of a column is a set of values."""
    if isinstance(given, np.ndarray) and given.dtype.kind in "biufM":
        return False
    known: set[object] = set()
    for value in listed(given):
        key = (type(value), tuple(value)) if isinstance(value, (list, set, tuple)) else (type(value), value)
        with suppress(ContextError, TypeError):  # a fact that cannot be read is no set
            if key not in known:
                known.add(key)
                if isinstance(read_fact(value, condition), Cell):
                    return True
    return False


def kept_columns(columns: Mapping[str, Any], conditions: Mapping[str, Condition]) -> dict[str, Any]:
    """The columns of some conditions as they are now, whatever the caller writes into them later."""
    return {name: _retained(given, conditions[name].domain.type.is_tags) for name, given in columns.items() if name in conditions}


def _retained(given: Any, is_tags: bool) -> Any:
    if isinstance(given, np.ndarray):
        return given.copy()
    if isinstance(given, (list, tuple)) and is_tags:  # of which each fact is a set
        return [frozen_fact(fact) for fact in given]
    return list(given) if isinstance(given, list) else given


def mirrored_columns(columns: Mapping[str, Any], conditions: Mapping[str, Condition]) -> dict[str, Any]:
    """Columns of facts that can be read, those of `conditions` as a mirror shows them."""
    partners = {name: partner for name, condition in conditions.items() if (partner := partner_of(condition)) is not None}
    swapped = {name: columns[partner] for name, partner in partners.items() if partner in columns}
    own = {name: given for name, given in columns.items() if name not in partners}
    return swapped | {
        name: mirrored_column(given, conditions[name]) if name in conditions else given for name, given in own.items()
    }


def mirrored_column(given: Any, condition: Condition) -> Any:
    """One column of facts as a mirror shows them."""
    kind = condition.domain.type
    numbers = plain_numbers(given, kind) if kind.is_numeric else None
    if numbers is not None:
        return 0.0 - numbers
    return [mirrored_fact(read_fact(value, condition), condition) for value in listed(given)]


# ---- what soft cells cost in many contexts at once, for the rows that are asked for. P pairs of a context and a row, D
# depths


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
