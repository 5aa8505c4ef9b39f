"""The settings of a table and of a condition that the tab Options has, and what may be picked for them."""

from __future__ import annotations

from collections.abc import Sequence

from contextdb.files.settings import Settings, settings_of
from contextdb.schema.shapes import CONDITION
from contextdb.schema.table_settings import TableSettings
from contextdb.tables.table import Table


def _options(settings: Settings, *first: str) -> Settings:
    """The settings that have a name in the editor; those that are used most come first."""
    return {key: settings[key] for key in dict.fromkeys((*first, *settings)) if settings[key].label}


OPTIONS = _options(settings_of(TableSettings), "policy", "asset", "outputs", "enabled", "priority", "weight", "fallback", "assume")
CONDITION_OPTIONS = _options(CONDITION, "type", "min", "max", "unit", "values", "mirror", "weight")


def columns_for(table: Table, key: str) -> list[str]:
    """The columns that may have a job: those with no other job and not declared as a condition; the one that has it comes too."""
    taken = {name for job, name in table.settings.jobs if job != key} | (set() if key == "asset" else {table.asset_column})
    return [c.name for c in table.columns if c.name not in taken and c.name not in table.schema.conditions]


def with_expression(expressions: Sequence[str], at: int, text: str) -> list[str]:
    """The expressions with one changed, added behind the last, or, when the text is empty, taken away."""
    changed = [*expressions[:at], text.strip(), *expressions[at + 1 :]]
    return [one for one in changed if one]
