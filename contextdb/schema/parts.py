"""The parts of contextdb.toml: how each is written, what of it can be used, and the conditions and files it declares."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import fields
from typing import Any, cast

from contextdb.cells.conditions import Condition, Mirror
from contextdb.cells.domains import Domain
from contextdb.cells.kinds import KINDS, Kind
from contextdb.errors import safe_text
from contextdb.files.settings import Settings, settings_of
from contextdb.files.toml_shapes import dotted
from contextdb.schema.contracts import Contract
from contextdb.schema.shapes import BLUEPRINT, CONDITION, PROJECT
from contextdb.schema.table_settings import TableSettings
from contextdb.schema.toml_lines import Path

Part = Mapping[str, Any]


def header(path: Path) -> str:
    """A section as the file writes it: [conditions.speed], [conditions."Defender.Tags"]."""
    return safe_text(f"[{dotted(tuple(map(str, path)))}]")


SECTIONS: dict[str, Settings | None] = {
    "project": PROJECT,
    "conditions": CONDITION,
    "tables": settings_of(TableSettings),
    "blueprints": BLUEPRINT,
    "contracts": settings_of(Contract),
    **dict.fromkeys(("features", "databases", "selectors", "controllers", "output")),
}
"""The sections and their settings; None: kept as they are. All but `project` hold named tables."""


PLAIN = tuple(each.name for each in fields(Condition) if each.name in CONDITION and each.name != "mirror")
"""The settings of a condition that it has as they are given."""


def keys_of(section: str) -> Settings:
    """The keys of a section."""
    return SECTIONS[section] or {}


def parts_of(document: Part, section: str) -> dict[str, Part]:
    """The named tables of a section, as far as they are tables."""
    parts = document.get(section)
    return {name: part for name, part in parts.items() if isinstance(part, Mapping)} if isinstance(parts, Mapping) else {}


def fitting_of(section: str, part: Part) -> dict[str, Any]:
    """What of a section can be used."""
    keys = keys_of(section)
    return {key: value for key, value in part.items() if key in keys and keys[key].shape.wrong(value) is None}


def number_of(kind: Kind, bound: Any) -> float:
    """A bound of contextdb.toml as a number. Raises ValueError where it is not written as the type writes its numbers."""
    if kind.is_decimal:
        return float(bound) + 0.0
    if not re.fullmatch(kind.spelling.number, str(bound)):
        raise ValueError(f"this is not {kind.value}")
    return kind.spelling.read(str(bound))


def condition_of(name: str, part: Part) -> Condition:
    """The condition that a sound `[conditions.NAME]` declares."""
    values = tuple(part["values"]) if "values" in part else None
    kind = KINDS[part["type"]]
    low, high = (number_of(kind, part[key]) if key in part else end for key, end in (("min", -math.inf), ("max", math.inf)))
    domain = Domain(kind.name, values, low, high)
    plain = {key: CONDITION[key].shape.read(part[key]) for key in PLAIN if key in part}
    return Condition(name, domain, mirror=mirror_of(part.get("mirror")), **plain)


def mirror_of(value: str | Mapping[str, str] | None) -> Mirror | None:
    """How the facts of a condition change in a mirror."""
    return tuple(value.items()) if isinstance(value, Mapping) else cast("Mirror | None", value)
