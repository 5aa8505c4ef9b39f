"""A column of texts, kept as its distinct texts and one code a row.

A table of assets repeats itself: `Any` is in most cells. So a column keeps each distinct text once and an int32 code for each
row, and whatever is worked out from a text (its cell, its mask) is worked out once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Codes = NDArray[np.int32]
Made = TypeVar("Made")


class _Late(ModuleType):
    """A module that is loaded when somebody first asks for a name of it."""

    def __getattr__(self, name: str) -> Any:
        return getattr(import_module(self.__name__), name)


if TYPE_CHECKING:
    import polars as polars
else:
    polars = _Late("polars")
"""A quarter of a second of CPU, which those who ask one question of a small CSV table need not pay."""


class Framed:
    """What is also a DataFrame, and an Arrow stream: polars, pandas, DuckDB and others take it as it is."""

    __slots__ = ()

    def to_polars(self) -> polars.DataFrame:
        """The same as a DataFrame of polars."""
        raise NotImplementedError

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        return self.to_polars().__arrow_c_stream__(requested_schema)


def frame_of(columns: Mapping[str, object], texts: Iterable[str]) -> polars.DataFrame:
    """A DataFrame of columns; those named in `texts` are texts also where they are empty."""
    frame: polars.DataFrame = polars.DataFrame(columns, schema_overrides=dict.fromkeys(texts, polars.String))
    return frame


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
        known: dict[str, int] = {}
        codes = np.fromiter((known.setdefault(t, len(known)) for t in texts), np.int32)
        return cls(name, tuple(known), codes)

    def __reduce__(self) -> tuple[object, ...]:
        """What is pickled: not what can be worked out again."""
        return TextColumn, (self.name, self.texts, self.codes)

    @property
    def n_rows(self) -> int:
        return len(self.codes)

    def __getitem__(self, row: int) -> str:
        return self.texts[int(self.codes[row])]

    def to_list(self) -> list[str]:
        texts = self.texts
        return [texts[c] for c in self.codes.tolist()]

    def once(self, make: Callable[[TextColumn], Made]) -> Made:
        """What a function makes of this column, made when it is first asked for; nobody changes it."""
        made: dict[object, Any] = self.__dict__.setdefault("made", {})
        if make not in made:
            made[make] = make(self)
        result: Made = made[make]
        return result

    def with_text(self, row: int, text: str) -> TextColumn:
        texts, code = self._with_code(text)
        codes = self.codes.copy()
        codes[row] = code
        return TextColumn(self.name, texts, codes)

    def with_rows_taken(self, rows: NDArray[np.int64]) -> TextColumn:
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


def distinct(numbers: NDArray[Any]) -> NDArray[Any]:
    """The numbers ascending, each once: `np.unique`, which loads the whole of numpy.ma, in 10 ms."""
    ascending = np.sort(numbers)
    return np.append(ascending[:1], ascending[1:][ascending[1:] != ascending[:-1]])
