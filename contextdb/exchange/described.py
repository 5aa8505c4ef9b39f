"""What contextdb.toml says of one table, as the text of one: so that a file of another format can carry it along."""

from __future__ import annotations

import json
from collections.abc import Mapping

from contextdb.schema.sections import condition_to_dict, settings_to_dict
from contextdb.tables.table import Table


def described(table: Table) -> str:
    """The sections of contextdb.toml that a table needs: its own, and those of the conditions that it has and are declared."""
    declared = [c.condition for c in table.conditions if c.condition.is_declared]
    lines = [line for condition in declared for line in _section("conditions", condition.name, condition_to_dict(condition))]
    said = {"asset": table.asset_column} | {key: value for key, value in settings_to_dict(table.settings).items() if key != "file"}
    return "\n".join([*lines, *_section("tables", table.name, said)])


def _section(section: str, name: str, said: Mapping[str, object]) -> list[str]:
    is_bare = name and all(c.isascii() and (c.isalnum() or c in "_-") for c in name)
    return [f"[{section}.{name if is_bare else _string(name)}]", *(f"{key} = {_value(value)}" for key, value in said.items()), ""]


def _value(value: object) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return _string(value) if isinstance(value, str) else repr(value).replace("True", "true").replace("False", "false")


def _string(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
