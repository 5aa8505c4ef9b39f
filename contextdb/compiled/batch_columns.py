"""Columns of facts as they are given: by name, equally long, and as arrays where they are plainly typed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from contextdb.cells.conditions import Condition
from contextdb.cells.fact_columns import as_series, listed, plain_numbers
from contextdb.cells.facts import read_fact
from contextdb.cells.mirroring import kept_fact, mirrored_fact, partner_of
from contextdb.cells.sets import Cell
from contextdb.compiled.classes import ValueMasks
from contextdb.compiled.text_arrays import classes_of_texts, is_text_array
from contextdb.errors import ContextError, Fault, Place

Contexts = Mapping[str, Sequence[object] | NDArray[Any]] | pl.DataFrame
Codes = NDArray[np.int32]


def facts_of(contexts: object) -> dict[str, Any]:
    if isinstance(contexts, pl.DataFrame):
        return {name: contexts[name] for name in contexts.columns}
    if not isinstance(contexts, Mapping):
        accepted = "a polars DataFrame, or a mapping of names to equally long columns"
        raise ContextError(Fault(f"{type(contexts).__name__} is not columns of facts.", accepted))
    for name, column in contexts.items():
        is_flat = column.ndim == 1 if isinstance(column, np.ndarray) else isinstance(column, (list, tuple, range, pl.Series))
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
    return {name: _kept(given, conditions[name].domain.type.is_tags) for name, given in columns.items() if name in conditions}


def _kept(given: Any, is_tags: bool) -> Any:
    if isinstance(given, np.ndarray):
        return given.copy()
    if isinstance(given, (list, tuple)) and is_tags:  # of which each fact is a set
        return [kept_fact(fact) for fact in given]
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


def plain_values(given: Any, masks: ValueMasks) -> Codes | None:
    """Class numbers int32 [1, N] of a column of plain values, -1 where missing; None when it must be read fact by fact."""
    is_truth = masks.values == (False, True)
    if not is_truth and is_text_array(given) and (classes := classes_of_texts(given, masks.values)) is not None:  # type: ignore[arg-type]
        return _of_known(classes, masks)
    series = as_series(given, pl.Boolean() if is_truth else pl.String())
    if series is None:
        return None
    if is_truth:
        if series.dtype != pl.Boolean:
            return None
        return _codes_of(series.cast(pl.Int32))
    if isinstance(series.dtype, pl.Enum):
        return _of_enum(series, masks)
    if isinstance(series.dtype, pl.Categorical):
        series = series.cast(pl.String)
    if series.dtype != pl.String:
        return None
    found = series.cast(pl.Enum([str(v) for v in masks.values]), strict=False)
    if masks.has_others:
        codes = found.to_physical().cast(pl.Int32).fill_null(len(masks.values)).to_numpy()
        return (np.where(series.is_null().to_numpy(), np.int32(-1), codes) if series.null_count() else codes)[None]
    if found.null_count() > series.null_count():
        return None
    return _codes_of(found.to_physical().cast(pl.Int32))


def _of_enum(series: pl.Series, masks: ValueMasks) -> Codes | None:
    """Classes of a polars Enum: each of its categories is looked up once."""
    categories = series.dtype.categories.to_list()  # type: ignore[attr-defined]
    missing = len(categories)
    classes = np.array([masks.class_of.get(text, -1) for text in categories] + [0], np.int32)
    numbers = series.to_physical().cast(pl.Int32).fill_null(missing).to_numpy()
    found = _of_known(classes.take(numbers), masks)
    if found is not None and series.null_count():
        found[0, numbers == missing] = -1
    return found


def _of_known(classes: NDArray[np.int32], masks: ValueMasks) -> Codes | None:
    """Classes where -1 is a text that is no value: the class of all others, or None where there is none."""
    is_other = classes < 0
    if is_other.any():
        if not masks.has_others:
            return None
        classes[is_other] = len(masks.values)
    return classes[None]


def _codes_of(classes: pl.Series) -> Codes:
    return (classes.fill_null(-1) if classes.null_count() else classes).to_numpy()[None]
