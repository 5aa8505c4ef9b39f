"""Slots through the nesting: who takes part in a row of an inner table.

The words of all rows of a way add up. A role that one of them constrains stays needed when only another has it among its optional
slots: what a row asks for is not loosened by the table around it, nor by the one inside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.words import quoted, slot_words
from contextdb.columns import TextColumn
from contextdb.schema.settings import derivation_of
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.data import TableData
from contextdb.tables.nesting.expansion import Expansion

if TYPE_CHECKING:
    from contextdb.expressions import Expression
    from contextdb.expressions.rules import WhenColumn

MANDATORY, OPTIONAL = "Mandatory_Slots", "Optional_Slots"
Flags = NDArray[np.bool_]


def all_words(texts: list[str]) -> str:
    """The words of several cells of slots, in one."""
    return " ".join(dict.fromkeys(text.strip() for text in texts))


def optional_slots(expansion: Expansion, columns: Sequence[tuple[int, TextColumn]]) -> TextColumn:
    """The optional slots of flat rows, without the roles that a row of the way needs and has not among its own."""
    layers = expansion.layers(columns)
    joined = layers.joined(OPTIONAL, all_words)
    roles = {role for table in expansion.tables for role in _roles(table)}
    texts: list[str] | None = None
    for role in sorted(roles & {word for text in joined.texts for word in slot_words(text)}):
        names = np.array([role in slot_words(text) for text in layers.texts], np.bool_)
        needed = (_constrained(expansion, role) & ~names[layers.codes]).any(axis=0) & names[layers.codes].any(axis=0)
        for row in np.flatnonzero(needed).tolist():
            texts = texts or joined.to_list()
            texts[row] = " ".join(quoted(word) for word in slot_words(texts[row]) if word != role)
    return joined if texts is None else TextColumn.of(OPTIONAL, texts)


def _constrained(expansion: Expansion, role: str) -> Flags:
    """Whether the row at each depth has a cell on the role that excludes somebody, or a rule that names it: bool [D, n]."""
    flags = np.zeros(expansion.rows.shape, np.bool_)
    for number, table in enumerate(expansion.tables):
        here = expansion.numbers == number
        for column in (c for c in table.conditions if c.condition.role == role):
            flags[here] |= _says(column)[expansion.rows[here]]
        if table.when is not None:
            flags[here] |= _rules(table, table.when, role)[expansion.rows[here]]
    return flags


def _roles(table: TableData) -> set[str]:
    """The roles that a table's columns and rules speak of."""
    rules = table.when.rules if table.when is not None else ()
    return {c.condition.role for c in table.conditions if c.condition.role}.union(*(_ruled(table, rule) for rule in rules))


def _rules(table: TableData, when: WhenColumn, role: str) -> Flags:
    says = np.array([role in _ruled(table, rule) for rule in when.rules], np.bool_)
    return says[when.texts.codes]


def _ruled(table: TableData, rule: Expression | None) -> set[str]:
    """The roles of the facts that a rule names, and of those that they are computed from."""
    if rule is None:
        return set()
    derivation = derivation_of(table.schema, rule.names)
    conditions = (*rule.conditions, *(derivation.conditions if derivation is not None else ()))
    return {c.role for c in conditions if c.role}


def _says(column: ConditionColumn) -> Flags:
    says = np.array([not (cell.is_any or cell.is_soft) for cell in column.cells], np.bool_)
    return says[column.texts.codes]
