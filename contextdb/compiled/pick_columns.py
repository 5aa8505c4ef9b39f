"""What a table says of how its rows are picked, apart from its policy, priorities and weights. R rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.bitmask import read_only
from contextdb.cells.conditions import Condition
from contextdb.cells.sets import Cell

Numbers = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PickColumns:
    """How specific the rows are, and how long they rest after they were picked. None for what the table does not say."""

    specificities: Numbers | None = None
    """What the cells of each row count float64 [R]; None under a policy that does not look at it."""
    once: NDArray[np.bool_] | None = None
    """The rows that each character plays once at most: bool [R]."""
    cooldown_s: Numbers | None = None
    """The seconds for which a row rests: float64 [R], 0 for none."""
    cooldown_turns: NDArray[np.int64] | None = None
    """The picks for which a row rests: int64 [R], 0 for none."""

    def __post_init__(self) -> None:
        for array in self.arrays.values():
            read_only(array)

    @property
    def arrays(self) -> dict[str, NDArray[Any]]:
        """Those that there are, by name."""
        totals = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: array for name, array in totals.items() if array is not None}

    @classmethod
    def of(cls, array_of: Callable[[str], NDArray[Any] | None]) -> PickColumns:
        """Those that a function has, by name."""
        return cls(**{field.name: array_of(field.name) for field in fields(cls)})

    @property
    def limited(self) -> NDArray[np.int64]:
        """The rows that rest after they were picked, ascending."""
        rests = [array > 0 for name, array in self.arrays.items() if name != "specificities"]
        return np.flatnonzero(np.logical_or.reduce(rests)) if rests else np.empty(0, np.int64)


NOTHING = PickColumns()


def specificities(
    columns: Sequence[tuple[Condition, Sequence[Cell], NDArray[np.int32]]], has_rule: NDArray[np.bool_] | None, n_rows: int
) -> Numbers:
    """How specific rows are: float64 [R], the sum of the weights of the conditions whose cell is neither Any nor soft; a rule
    counts 1.

    `columns` are conditions, the cells of their distinct texts, and which of these each row has. Sums that are equal as decimals
    are equal.
    """
    counts: dict[float, NDArray[np.int64]] = {1.0: np.zeros(n_rows, np.int64)}
    for condition, cells, codes in columns:
        says = np.array([not (cell.is_any or cell.is_soft) for cell in cells], np.int64)
        if len(says):
            counts[condition.weight] = counts.get(condition.weight, 0) + says[codes]
    if has_rule is not None:
        counts[1.0] = counts[1.0] + has_rule
    weights = [Fraction(repr(weight)) for weight in counts]
    combinations, which = np.unique(np.array(list(counts.values())), axis=1, return_inverse=True)
    sums = [float(sum(w * n for w, n in zip(weights, counted, strict=True))) for counted in combinations.T.tolist()]
    return np.array(sums, np.float64)[which.reshape(-1)]
