"""A column as a whole: which texts it holds and how often, what cannot be read and how that is mended, what replaces a value."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from contextdb.edits import edits
from contextdb.edits.renaming_values import with_value
from contextdb.errors import Fault, TableError, in_quotes, plural, safe_text
from contextdb.tables.changes import Cells, Edit
from contextdb.tables.table import Table

from .displayed_table import DisplayedTable
from .long_work import with_progress
from .meaning import mend_of


@dataclass(frozen=True, slots=True)
class ColumnValue:
    """One text of a column."""

    text: str
    n_rows: int
    n_valid: int | None = None
    """How many of these rows are valid for the test row; None where that asks for nothing."""
    fault: Fault | None = None
    """Why the text cannot be read."""


def values_of(sheet: DisplayedTable, column: int) -> list[ColumnValue]:
    """The texts of a column, the most frequent first; those that cannot be read come before all others."""
    texts = sheet.table.columns[column]
    counts = np.bincount(texts.codes, minlength=len(texts.texts))
    valid = None if sheet.query.is_empty else np.bincount(texts.codes[sheet.query.valid], minlength=len(texts.texts))
    column_values = [
        ColumnValue(text, int(counts[code]), None if valid is None else int(valid[code]), _fault(sheet, column, code))
        for code, text in enumerate(texts.texts)
        if counts[code]
    ]
    return sorted(column_values, key=lambda value: (value.fault is None, -value.n_rows))


def described(sheet: DisplayedTable, column: int, values: list[ColumnValue]) -> str:
    """A column in a line: its type, its unit, how many texts it holds and how many rows say nothing, and its description."""
    header, condition = sheet.header(column), sheet.condition(column)
    kind = f"{header.kind} in {header.unit}" if header.unit else header.kind
    empty = 0
    if condition is not None:
        cells = dict(zip(condition.texts.texts, condition.cells, strict=True))
        empty = sum(value.n_rows for value in values if value.fault is None and cells[value.text].is_any)
    wrong = sum(value.n_rows for value in values if value.fault is not None)
    parts = [kind, f"{plural(len(values), 'text')} in {plural(sheet.table.n_rows, 'row')}"]
    parts += [f"{empty:,} Any"] * bool(empty) + [f"{plural(wrong, 'cell')} cannot be read"] * bool(wrong)
    about = condition.condition.description if condition is not None else ""
    return " · ".join(parts) + (f"\n{about}" if about else "")


def mends_of(sheet: DisplayedTable, column: int, texts: Iterable[str] | None = None) -> dict[str, str]:
    """For the texts of a column that cannot be read, or for some of them, the nearest that can; those without one are left out."""
    condition, table = sheet.condition(column), sheet.table
    name = table.columns[column].name
    domain = condition.condition.domain if condition is not None else None
    wanted = None if texts is None else set(texts)
    mends: dict[str, str] = {}
    texts_of = table.columns[column].texts
    for code, text in with_progress(enumerate(texts_of), len(texts_of)):
        known = _fault(sheet, column, code) if wanted is None or text in wanted else None
        if known is not None:
            check = partial(edits.check_cell, table, name)
            if mend := mend_of(text, check(text) or known, domain, check):
                mends[text] = mend
    return mends


def replaced(table: Table, column: str, by: Mapping[str, str], name: str) -> Edit:
    """The edit that puts other texts in place of some of a column, in every row."""
    texts = table.text_column(column)
    other = {code: by[text] for code, text in enumerate(texts.texts) if text in by and by[text] != text}
    rows = np.flatnonzero(np.isin(texts.codes, list(other)))
    cells = {int(row): other[code] for row, code in zip(rows, texts.codes[rows].tolist(), strict=True)}
    return Edit(f"{name} in {plural(len(cells), 'cell')}", (Cells({column: cells}),) if cells else ())


def renamed_value(sheet: DisplayedTable, column: int, old: str, new: str, keeps_old: bool = False) -> Edit:
    """The edit that renames a value in every cell of a column. A declared value is renamed where it is declared, too; `keeps_old`
    leaves it there for others, and declares the new one beside it. Raises TableError where a cell could not be read with the new
    name."""
    table, condition, name = sheet.table, sheet.condition(column), sheet.table.columns[column].name
    values = condition.condition.domain.values if condition is not None else None
    what = f"Rename {safe_text(old)} to {safe_text(new)}"
    if condition is None or values is None or old not in values:
        if fault := edits.check_cell(table, name, new):
            raise TableError(fault)
        return replaced(table, name, {old: new}, what)
    if new in values:
        raise TableError(Fault(f"{in_quotes(new)} is a value of {safe_text(name)} already.", "a name that there is not yet"))
    now = [*values, new] if keeps_old else [new if value == old else value for value in values]
    declared = edits.set_condition(table, name, values=now)
    after = declared.apply(table)
    cells = {text: other for text in condition.texts.texts if (other := with_value(text, old, new)) != text}
    wrong = {condition.texts.texts[code] for code in condition.faults}
    for text, other in cells.items():
        if text not in wrong and (fault := edits.check_cell(after, name, other)):
            raise TableError(fault)
    return Edit(what, (*declared.changes, *replaced(table, name, cells, what).changes))


MOST_SUMMED = 100_000
"""So many cells of a selection are summed up."""


def selection_summary(sheet: DisplayedTable) -> str:
    """The selection in figures: of numbers their sum, mean and ends, of other texts how many different ones there are."""
    block = sheet.block
    if not 1 < block.n_cells <= MOST_SUMMED or not len(sheet.view):
        return ""
    rows = sheet.view.rows[block.top : block.bottom]
    texts = [t for c in sheet.table.columns[block.left : block.right] for t in (c.texts[code] for code in c.codes[rows].tolist())]
    filled = [text for text in texts if text.strip()]
    numbers = [number for text in filled if (number := _number_in(text)) is not None]
    if numbers and len(numbers) == len(filled):
        total = sum(numbers)
        return f": sum {total:g}, mean {total / len(numbers):.4g}, {min(numbers):g} to {max(numbers):g}"
    return f": {plural(len(set(filled)), 'different text')}" if filled else ""


def _number_in(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def _fault(sheet: DisplayedTable, column: int, code: int) -> Fault | None:
    condition, texts = sheet.condition(column), sheet.table.columns[column]
    return condition.faults.get(code) if condition is not None else sheet.text_fault(column, texts.texts[code])
