"""A flat table as masks."""

from __future__ import annotations

from contextdb import bitmask
from contextdb.cells.outputs import SLOT_COLUMNS
from contextdb.compiled.data import CompiledData
from contextdb.compiled.pick_columns import NOTHING
from contextdb.expressions.rules.rules import WhenRules
from contextdb.schema.settings import derivation_of
from contextdb.tables.data import TableData, picking_of


def compile_table(table: TableData) -> CompiledData:
    """Compile a flat table whose cells can all be read; columns compiled before are taken as they are."""
    when = WhenRules.of(table.when)
    return CompiledData(
        name=table.name,
        assets=table.assets,
        conditions=tuple(c.condition for c in table.conditions),
        masks=tuple(c.masks for c in table.conditions),
        enabled=bitmask.pack(table.enabled),
        soft=tuple(c.soft for c in table.conditions),
        priorities=table.priorities,
        row_weights=table.row_weights,
        texts=tuple(c.texts for c in table.conditions),
        policy=table.settings.policy,
        fallback=table.settings.fallback,
        derivation=derivation_of(table.schema, [*(c.condition.name for c in table.conditions), *(when.names if when else ())]),
        slots=tuple(c for c in table.columns if c.name in SLOT_COLUMNS and c.name in table.settings.outputs),
        when=when,
        ways=table._ways,
        declared=frozenset(table.schema.conditions),
        outputs=table.outputs,
        picking=picking_of(table) if table._ways is None else NOTHING,
    )
