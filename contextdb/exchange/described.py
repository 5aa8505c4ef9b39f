"""What contextdb.toml says of one table, as the lines of one: so that a workbook can carry it along on a sheet of its own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from contextdb.files.toml_shapes import as_toml, dotted
from contextdb.schema.sections import condition_to_dict, settings_to_dict
from contextdb.tables.table import Table

TYPES_SHEET = "contextdb"
FIRST_LINE = "# contextdb 1: what contextdb.toml says of this table; contextdb import reads it"
LONG_LINE = 1_000
"""A list of more characters has a line for each value: Excel holds so many in a cell, and no more."""


def described(table: Table) -> list[str]:
    """The sections of contextdb.toml that a table needs: its own, and those of the conditions that it has and are declared."""
    declared = [c.condition for c in table.conditions if c.condition.is_declared]
    lines = [line for condition in declared for line in _section("conditions", condition.name, condition_to_dict(condition))]
    own = {key: value for key, value in settings_to_dict(table.settings).items() if key != "file"}
    return [FIRST_LINE, *lines, *_section("tables", table.name, {"asset": table.asset_column} | own)]


def _section(section: str, name: str, values: Mapping[str, object]) -> Iterator[str]:
    yield f"[{dotted((section, name))}]"
    for key, value in values.items():
        line = f"{key} = {as_toml(value)}"
        if isinstance(value, list) and len(line) > LONG_LINE:
            yield from (f"{key} = [", *(f"  {as_toml(item)}," for item in value), "]")
        elif isinstance(value, Mapping) and len(line) > LONG_LINE:
            yield from (f"{dotted((key, inner))} = {as_toml(item)}" for inner, item in value.items())
        else:
            yield line
    yield ""
