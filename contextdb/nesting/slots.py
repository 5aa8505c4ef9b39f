"""Slots through the nesting: who takes part in a row of an inner table.

The words of all rows of a way add up. A role that one of them constrains stays needed when only another has it among its optional
slots: what a row asks for is not loosened by the table around it, nor by the one inside it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from contextdb.columns import TextColumn
from contextdb.condition_column import ConditionColumn
from contextdb.nesting.expansion import Expansion
from contextdb.nesting.layers import Layers

MANDATORY, OPTIONAL = "Mandatory_Slots", "Optional_Slots"
Flags = NDArray[np.bool_]


def all_words(texts: list[str]) -> str:
    """The words of several cells of slots, in one."""
    return " ".join(dict.fromkeys(text.strip() for text in texts))


def optional_slots(expansion: Expansion, columns: Sequence[tuple[int, TextColumn]]) -> TextColumn:
    """The optional slots of flat rows, without the roles that a row of the way needs and has not among its own."""
    layers = Layers.of(expansion, columns)
    joined = layers.joined(OPTIONAL, all_words)
    roles = {c.condition.role for t in expansion.tables for c in t.conditions if c.condition.role}
    texts: list[str] | None = None
    for role in sorted(roles & {word for text in joined.texts for word in text.split()}):
        names = np.array([role in text.split() for text in layers.texts], np.bool_)
        needed = (_constrained(expansion, role) & ~names[layers.codes]).any(axis=0) & names[layers.codes].any(axis=0)
        for row in np.flatnonzero(needed).tolist():
            texts = texts or joined.to_list()
            texts[row] = " ".join(word for word in texts[row].split() if word != role)
    return joined if texts is None else TextColumn.of(OPTIONAL, texts)


def _constrained(expansion: Expansion, role: str) -> Flags:
    """Whether the row at each depth has a cell on the role that excludes somebody: bool [D, n]."""
    found = np.zeros(expansion.rows.shape, np.bool_)
    for number, table in enumerate(expansion.tables):
        here = expansion.numbers == number
        for column in (c for c in table.conditions if c.condition.role == role):
            found[here] |= _says(column)[expansion.rows[here]]
    return found


def _says(column: ConditionColumn) -> Flags:
    says = np.array([not (cell.is_any or cell.is_soft) for cell in column.cells], np.bool_)
    return says[column.texts.codes]
