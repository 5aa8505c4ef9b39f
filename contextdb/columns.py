"""A column of texts, kept as its distinct texts and one code a row.

A table of assets repeats itself: `Any` is in most cells. So a column keeps each distinct text once and an int32 code for each
row, and whatever is worked out from a text (its cell, its mask) is worked out once.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Codes = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class TextColumn:
    """Texts of one column: row r holds `texts[codes[r]]`. Never changed in place; edits give a new column.

    `texts` are distinct; some may be held by no row. `codes` is int32 [n_rows].
    """

    name: str
    texts: tuple[str, ...] = field(repr=False)
    codes: Codes = field(repr=False)

    @classmethod
    def of(cls, name: str, texts: Iterable[str]) -> TextColumn:
        """A column from one text a row."""
        known: dict[str, int] = {}
        codes = np.fromiter((known.setdefault(t, len(known)) for t in texts), np.int32)
        return cls(name, tuple(known), codes)

    @property
    def n_rows(self) -> int:
        return len(self.codes)

    def __getitem__(self, row: int) -> str:
        return self.texts[int(self.codes[row])]

    def to_list(self) -> list[str]:
        texts = self.texts
        return [texts[c] for c in self.codes.tolist()]

    def with_text(self, row: int, text: str) -> TextColumn:
        texts, code = self._with_code(text)
        codes = self.codes.copy()
        codes[row] = code
        return TextColumn(self.name, texts, codes)

    def with_rows_taken(self, rows: NDArray[np.int64]) -> TextColumn:
        """The column with the given rows, in the given order."""
        return TextColumn(self.name, self.texts, self.codes[rows])

    def with_inserted(self, row: int, texts: Sequence[str]) -> TextColumn:
        column, codes = self, []
        for text in texts:
            known, code = column._with_code(text)
            column = TextColumn(self.name, known, self.codes)
            codes.append(code)
        return TextColumn(self.name, column.texts, np.insert(self.codes, row, codes).astype(np.int32))

    def renamed(self, name: str) -> TextColumn:
        return TextColumn(name, self.texts, self.codes)

    def _with_code(self, text: str) -> tuple[tuple[str, ...], int]:
        if text in self.texts:
            return self.texts, self.texts.index(text)
        return (*self.texts, text), len(self.texts)
