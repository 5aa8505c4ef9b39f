"""The conditions of a flat table: each row accepts what all cells of its way accept. D = depth, n = flat rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from contextdb.cells.conditions import Condition
from contextdb.cells.grammar import format_cell
from contextdb.cells.sets import ANY, Cell, TagMeet, meet
from contextdb.columns import TextColumn
from contextdb.compiled.layers import Layers
from contextdb.compiled.soft import SoftMasks
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.nesting.expansion import Expansion

BOTH = " & "
"""Between the cells of two tables where no single cell says the same."""


@dataclass(frozen=True, eq=False)
class FlatColumn(ConditionColumn):
    """A condition of a flat table: each row accepts what all cells of its way accept."""

    sources: tuple[tuple[int, ConditionColumn], ...]
    """The columns that it was made of, with the numbers of their tables."""
    layers: Layers

    @classmethod
    def made(cls, expansion: Expansion, condition: Condition, sources: Sequence[tuple[int, ConditionColumn]]) -> FlatColumn:
        """Bring the columns of some tables together."""
        layers = expansion.layers([(number, column.texts) for number, column in sources])
        combined, which = layers.combined
        ways = combined.T.tolist()
        cells = _Cells(sources)
        met = [_met([layers.texts[c] for c in codes if c], [cells[c] for c in codes if c], condition) for codes in ways]
        texts = TextColumn(condition.name, tuple(text for text, _ in met), which)
        return cls(condition, texts, tuple(cell for _, cell in met), {}, tuple(sources), layers)

    @cached_property
    def soft(self) -> SoftMasks | None:
        """What soft cells cost, one row for each row of each depth: D n rows."""
        cells, used = _Cells(self.sources), np.unique(self.layers.codes)
        soft = [cells[c] if cells[c].is_soft else ANY for c in used.tolist()]
        if all(cell.is_any for cell in soft):
            return None
        codes = np.searchsorted(used, self.layers.codes).astype(np.int32).reshape(-1)
        return SoftMasks.of(soft, codes, self.condition.domain)


class _Cells:
    """The cells of some columns under the codes of `Layers`."""

    def __init__(self, sources: Sequence[tuple[int, ConditionColumn]]) -> None:
        self._columns = [column for _, column in sources]
        self._starts = np.cumsum([1, *(len(column.texts.texts) for column in self._columns)])

    def __getitem__(self, code: int) -> Cell:
        if code == 0:
            return ANY
        at = int(np.searchsorted(self._starts, code, "right")) - 1
        return self._columns[at].cells[code - int(self._starts[at])]


def _met(texts: list[str], cells: list[Cell], condition: Condition) -> tuple[str, Cell]:
    """A cell and its text: the text of one table where that says it all."""
    met = meet(cells)
    specified = [(text, cell) for text, cell in zip(texts, cells, strict=True) if not cell.is_any]
    if not specified:
        return (texts[-1] if texts else ""), met
    n_soft = sum(cell.is_soft for _, cell in specified)
    if not n_soft or len(specified) == 1:
        same = next((text for text, cell in specified if cell == met), None)
        if same is not None:
            return same, met
    if n_soft or isinstance(met.accepts, TagMeet):
        return BOTH.join(text.strip() for text, _ in specified), met
    return format_cell(met, condition.domain), met
