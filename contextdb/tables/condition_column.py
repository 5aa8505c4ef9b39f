"""One condition's column of a table: its texts, the cells that they mean, and the masks that they compile to.

Texts that cannot be read stay as they are, with their fault. What was worked out for a column is shared by all tables that hold it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import BOOL, DATE, NUMBER, TAGS, TEXT, Domain
from contextdb.cells.grammar import parse_cell, reads
from contextdb.cells.numbers import ColumnCells, NumberCells, are_plain, doubtful, has_soft
from contextdb.cells.sets import ANY, Cell
from contextdb.cells.words import says_any
from contextdb.columns import TextColumn
from contextdb.compiled.classes import ColumnMasks, column_masks
from contextdb.compiled.layers import SoftMasks
from contextdb.errors import CellError, Fault

MOST_MENDS = 20
"""Texts of one column that get a mend when they cannot be read; looking for one is slow, and a column of the wrong type has
thousands."""


READABLE_SHARE = 0.8
"""A type is inferred when at least this share of the rows that are not Any can be read as it; the rest are faults."""
_DIGITS = frozenset(("0", "1"))


@dataclass(frozen=True, eq=False)
class ConditionColumn:
    """One condition's column: its texts, and the cell that each distinct text means."""

    condition: Condition
    texts: TextColumn
    cells: ColumnCells = field(repr=False)
    """The cell of `texts.texts[i]`; Any for a text that cannot be read."""
    faults: Mapping[int, Fault] = field(repr=False)
    """Why `texts.texts[i]` cannot be read."""

    @classmethod
    def read(cls, texts: TextColumn, condition: Condition) -> ConditionColumn:
        """Read every distinct text once."""
        cells, faults = _read_cells(texts.texts, condition)
        return cls(condition, texts, cells, faults)

    @classmethod
    def like(cls, before: ConditionColumn | None, texts: TextColumn, declared: Condition | None) -> ConditionColumn:
        """A column under what is declared of it, else inferred; what an older one had worked out for the same is not again."""
        is_same = before is not None and texts.texts is before.texts.texts and texts.codes is before.texts.codes
        if before is not None and is_same and declared is None and not before.condition.is_declared:
            condition = replace(before.condition, name=texts.name)
        else:
            condition = declared or infer_condition(texts)
        if before is None or before.condition.domain != condition.domain:
            return cls.read(texts, condition)
        return before if texts is before.texts and condition == before.condition else before.with_texts(texts, condition)

    def with_texts(self, texts: TextColumn, condition: Condition | None = None) -> ConditionColumn:
        """The column with other texts, as a condition of the same domain; texts that it had already are not read again."""
        condition, known = condition or self.condition, len(self.texts.texts)
        if texts.texts is self.texts.texts:
            return ConditionColumn(condition, texts, self.cells, self.faults)
        if texts.texts[:known] == self.texts.texts:
            cells, faults = _read_cells(texts.texts[known:], condition)
            more = {known + i: fault for i, fault in faults.items()}
            return ConditionColumn(condition, texts, _followed(self.cells, texts.texts[known:], cells), {**self.faults, **more})
        if isinstance(self.cells, NumberCells):  # reading many numbers again is faster
            return ConditionColumn.read(texts, condition)
        read = dict(zip(self.texts.texts, zip(self.cells, map(self.faults.get, range(known)), strict=True), strict=True))
        others = tuple(text for text in texts.texts if text not in read)
        cells, faults = _read_cells(others, condition)
        read |= {text: (cells[i], faults.get(i)) for i, text in enumerate(others)}
        column = [read[text] for text in texts.texts]
        wrong = {i: fault for i, (_, fault) in enumerate(column) if fault is not None}
        return ConditionColumn(condition, texts, tuple(cell for cell, _ in column), wrong)

    def cell(self, row: int) -> Cell:
        return self.cells[int(self.texts.codes[row])]

    def faulty_rows(self) -> Iterable[tuple[int, Fault]]:
        """Each row whose cell cannot be read, and why."""
        if not self.faults:
            return
        for row in np.flatnonzero(np.isin(self.texts.codes, list(self.faults))).tolist():
            yield row, self.faults[int(self.texts.codes[row])]

    @cached_property
    def masks(self) -> ColumnMasks:
        """The column compiled; worked out once, and shared by every table that holds the column."""
        return column_masks(self.cells, self.texts.codes, self.condition.domain)

    @cached_property
    def soft(self) -> SoftMasks | None:
        """What soft cells cost; None when none is soft."""
        if not has_soft(self.cells):
            return None
        return SoftMasks.of([c if c.is_soft else ANY for c in self.cells], self.texts.codes, self.condition.domain)


def _followed(cells: ColumnCells, texts: Sequence[str], more: ColumnCells) -> ColumnCells:
    return cells.followed_by(texts, more) if isinstance(cells, NumberCells) else (*cells, *more)


def _read_cells(texts: Sequence[str], condition: Condition) -> tuple[ColumnCells, dict[int, Fault]]:
    unsure = doubtful(texts, condition.domain)
    cells: dict[int, Cell] = {}
    faults: dict[int, Fault] = {}
    for i in range(len(texts)) if unsure is None else unsure.tolist():
        try:
            cells[i] = parse_cell(texts[i], condition.domain, len(faults) < MOST_MENDS)
        except CellError as error:
            cells[i], faults[i] = ANY, error.faults[0]
    return tuple(cells.values()) if unsure is None else NumberCells(tuple(texts), condition.domain, cells), faults


def infer_condition(column: TextColumn) -> Condition:
    """The condition of a column that nobody declared, from its cells: bool, number, date or tags where they read so, else text."""
    counts = np.bincount(column.codes, minlength=len(column.texts))
    flags = are_plain(column.texts)
    if flags is not None and _is_number_column(column.texts, counts, flags):
        return Condition(column.name, NUMBER, is_declared=False)
    counted = _text_counts(column.texts, counts)
    domains = [BOOL, NUMBER, DATE, TAGS] if {t.strip() for t in counted} - _DIGITS else [NUMBER]
    domain = next((d for d in domains if counted and _mostly_reads(counted, d)), TEXT)
    return Condition(column.name, domain, is_declared=False)


def _text_counts(texts: Sequence[str], counts: NDArray[np.int64]) -> dict[str, int]:
    """How many rows say each text that is not Any."""
    return {t: n for t, n in zip(texts, counts.tolist(), strict=True) if not says_any(t)}


def _is_number_column(texts: Sequence[str], counts: NDArray[np.int64], are_numbers: NDArray[np.bool_]) -> bool:
    """Whether so many rows say plain numbers, which no bool does, that the column is one of numbers: tags are asked after those."""
    rest = _text_counts([texts[i] for i in np.flatnonzero(~are_numbers).tolist()], counts[~are_numbers])
    n_others = sum(rest.values())
    n_rows = int(counts[are_numbers].sum()) + n_others
    return n_rows > n_others and n_others <= n_rows - READABLE_SHARE * n_rows


def _mostly_reads(counted: dict[str, int], domain: Domain) -> bool:
    """Whether most rows read as a domain, the commonest texts first; stops at the row that decides it is not so."""
    total = sum(counted.values())
    may_fail = total - READABLE_SHARE * total
    for text, n_rows in sorted(counted.items(), key=lambda item: -item[1]):
        may_fail -= 0 if reads(text, domain) else n_rows
        if may_fail < 0:
            return False
    return True
