"""Texts of several columns in one space of codes, so that equal texts have equal numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.words import says_any
from contextdb.columns import TextColumn
from contextdb.tables.changes import CameFrom

Places = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Shared:
    """Some columns under one set of texts: cell r of column i holds `texts[codes[i][r]]`."""

    texts: tuple[str, ...]
    codes: tuple[NDArray[np.int64], ...]

    @classmethod
    def of(cls, columns: Sequence[TextColumn | None]) -> Shared:
        """Read columns together; one that is missing has no rows."""
        known: dict[str, int] = {}
        codes = [_codes(column, known) for column in columns]
        return cls(tuple(known), tuple(codes))

    @property
    def pair(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """The codes of the first two columns."""
        return self.codes[0], self.codes[1]

    @property
    def is_any(self) -> NDArray[np.bool_]:
        return np.array([says_any(text) for text in self.texts], np.bool_)

    def at(self, column: int, rows: CameFrom) -> NDArray[np.int64]:
        """The codes of a column in some rows; -1 where the row is -1 or the column is missing."""
        codes = self.codes[column]
        return np.append(codes, -1)[rows] if len(codes) else np.full(len(rows), -1)


def _codes(column: TextColumn | None, known: dict[str, int]) -> NDArray[np.int64]:
    if column is None or not column.n_rows:
        return np.empty(0, np.int64)
    new = np.fromiter((known.setdefault(t, len(known)) for t in column.texts), np.int64, len(column.texts))
    return new[column.codes]
