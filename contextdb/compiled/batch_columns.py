"""Columns of facts as they are given: by name, and equally long."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.conditions import Condition
from contextdb.cells.fact_columns import is_frame, is_series, listed, plain_numbers
from contextdb.cells.facts import read_fact
from contextdb.cells.mirroring import frozen_fact, mirrored_fact, partner_of
from contextdb.cells.sets import Cell
from contextdb.columns import polars as pl
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
