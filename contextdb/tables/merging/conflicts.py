"""What two sides of a merge disagree about, as data that a person can decide one by one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.words import says_any
from contextdb.columns import TextColumn
from contextdb.errors import safe_text
from contextdb.tables.changes import CameFrom

Side = Literal["ours", "theirs"]
Key = tuple[object, ...]
"""What a conflict is about, whatever else is decided."""

Decided = Mapping[Key, Side]


@dataclass(frozen=True, slots=True)
class Conflict:
    """A disagreement. Until it is decided, ours holds."""

    kind: Literal["cell", "row", "column", "name"]
    """A cell changed on both sides; a row or a column taken away on one side and changed on the other; a column of two names."""
    asset: str
    """The row's asset; empty for a column."""
    column: str
    """Empty for a row."""
    row: int | None
    """The row of the merged table; None where it has none."""
    base: str | None
    """The text, or for a row or column what it says; None where it was not there."""
    ours: str | None
    """None: ours took it away."""
    theirs: str | None
    """None: theirs took it away."""
    key: Key

    @property
    def place(self) -> str:
        return {"cell": f"{self.asset}, {self.column}", "row": self.asset}.get(self.kind, self.column)


@dataclass(frozen=True, slots=True)
class LostCell:
    """A cell of a new column of one side, left out of the merge with its row, which the other side deleted."""

    asset: str
    column: str
    text: str
    side: Side
    """Who wrote it."""

    def __str__(self) -> str:
        other = "theirs" if self.side == "ours" else "ours"
        asset, column, text = (safe_text(text) for text in (self.asset, self.column, self.text))
        cell = f'{asset}, {column}: {self.side} has "{text}"'
        return f"{cell} in this new column; it is left out with the row, which {other} deleted."


# ---- texts of several columns in one space of codes, so that equal texts have equal numbers


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
