"""Texts that a spreadsheet takes for formulas when it opens a CSV: named, or written with an apostrophe before them.

Source: OWASP, "CSV Injection": = + - @, tab and carriage return at the start of a field.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from contextdb.columns import TextColumn
from contextdb.errors import in_quotes, plural
from contextdb.exchange.reading import Remark

Formulas = Literal["tell", "keep", "quote"]
"""What becomes of such texts: written as they are and named, as they are without a word, or with an apostrophe."""

_FORMULA = re.compile(r"[=+@\t\r]|-(?!\Z)")
_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?")


def is_formula(text: str) -> bool:
    """Whether a spreadsheet may compute a text; a plain number, and the - that says Any, do no harm."""
    return _FORMULA.match(text) is not None and _NUMBER.fullmatch(text) is None


def quoted_formulas(columns: Sequence[TextColumn]) -> list[TextColumn]:
    """The columns with an apostrophe before each text, and each name, that a spreadsheet may compute."""
    return [replace(column, name=_quoted(column.name), texts=_distinct(column)) for column in columns]


def _quoted(text: str) -> str:
    return f"'{text}" if is_formula(text) else text


def _distinct(column: TextColumn) -> tuple[str, ...]:
    """The texts with their apostrophes, as different from each other as before."""
    known = set(column.texts)
    columns = []
    for text in column.texts:
        new = _quoted(text)
        while new != text and new in known:
            new = f"'{new}"
        known.add(new)
        columns.append(new)
    return tuple(columns)


def formula_remarks(columns: Sequence[TextColumn]) -> tuple[Remark, ...]:
    """How many cells a spreadsheet may compute, and the first of them; nothing where there is none."""
    flagged = [(column, [is_formula(text) for text in column.texts]) for column in columns]
    rows = [(np.flatnonzero(np.array(flags, np.bool_)[column.codes]), column) for column, flags in flagged if any(flags)]
    n_cells = sum(len(where) for where, _ in rows) + sum(is_formula(column.name) for column in columns)
    first = next((f"{in_quotes(column[int(where[0])])} in {in_quotes(column.name)}" for where, column in rows if len(where)), None)
    if not n_cells:
        return ()
    first = first or in_quotes(next(column.name for column in columns if is_formula(column.name)))
    text = f"{plural(n_cells, 'cell')} may run as a formula in a spreadsheet, first {first}; --formulas quote puts ' before each."
    return (Remark(text),)
