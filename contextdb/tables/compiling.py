"""A flat table as masks."""

from __future__ import annotations

from collections.abc import Container
from typing import TYPE_CHECKING

from contextdb import bitmask
from contextdb.cells.outputs import SLOT_COLUMNS
from contextdb.compiled.data import CompiledData
from contextdb.compiled.pick_columns import NOTHING
from contextdb.schema.settings import derivation_of
from contextdb.tables.data import TableData, picking_of

if TYPE_CHECKING:
    from contextdb.expressions.rules import WhenColumn, WhenRules


def compile_table(table: TableData, names: Container[str] | None = None) -> CompiledData:
    """Compile a flat table whose cells can all be read; columns compiled before are taken as they are. `names`: of the conditions
    these alone, for questions that give no other fact; not for a table with tables inside."""
    when, columns = _rules(table.when), [c for c in table.conditions if names is None or c.condition.name in names]
    return CompiledData(
        name=table.name,
        assets=table.assets,
        conditions=tuple(c.condition for c in columns),
        masks=tuple(c.masks for c in columns),
        enabled=bitmask.pack(table.enabled),
        soft=tuple(c.soft for c in columns),
        priorities=table.priorities,
        row_weights=table.row_weights,
        texts=tuple(c.texts for c in columns),
        policy=table.settings.policy,
        fallback=table.settings.fallback,
        derivation=derivation_of(table.schema, [*(c.condition.name for c in columns), *(when.names if when else ())]),
        slots=tuple(c for c in table.columns if c.name in SLOT_COLUMNS and c.name in table.settings.outputs),
        when=when,
        ways=table._ways,
        declared=frozenset(table.schema.conditions),
        outputs=table.outputs,
        picking=picking_of(table) if table._ways is None else NOTHING,
    )


def _rules(column: WhenColumn | None) -> WhenRules | None:
    if column is None:  # loads nothing that a plain table does not need
        return None
    from contextdb.expressions.rules import WhenRules

    return WhenRules.of(column)
