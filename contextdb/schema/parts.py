"""The parts of contextdb.toml: how each is written, what of it can be used, and the conditions and files it declares."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import PurePosixPath
from typing import Any, cast

from contextdb.cells.conditions import Condition, Mirror
from contextdb.cells.domains import Domain
from contextdb.cells.kinds import KINDS, Kind
from contextdb.disk import TABLE_SUFFIXES
from contextdb.errors import shown
from contextdb.files.toml_shapes import Shape
from contextdb.files.toml_text import dotted
from contextdb.schema.shapes import SECTIONS
from contextdb.schema.toml_lines import Path

Said = Mapping[str, Any]


def header(path: Path) -> str:
    """A section as the file writes it: [conditions.speed], [conditions."Defender.Tags"]."""
    return shown(f"[{dotted(tuple(map(str, path)))}]")


def shapes_of(section: str) -> Mapping[str, Shape]:
    """What each key of a section accepts."""
    return SECTIONS[section] or {}


def parts_of(document: Said, section: str) -> dict[str, Said]:
    """The named tables of a section, as far as they are tables."""
    parts = document.get(section)
    return {name: part for name, part in parts.items() if isinstance(part, Mapping)} if isinstance(parts, Mapping) else {}


def fitting_of(section: str, part: Said) -> dict[str, Any]:
    """What of a section can be used."""
    shapes = shapes_of(section)
    return {key: value for key, value in part.items() if key in shapes and shapes[key].wrong(value) is None}


def number_of(kind: Kind, bound: Any) -> float:
    """A bound of contextdb.toml as a number. Raises ValueError where it is not written as the type writes its numbers."""
    if kind.is_decimal:
        return float(bound) + 0.0
    if not re.fullmatch(kind.spelling.number, str(bound)):
        raise ValueError(f"this is not {kind.value}")
    return kind.spelling.read(str(bound))


def condition_of(name: str, part: Said) -> Condition:
    """The condition that a sound `[conditions.NAME]` declares."""
    values = tuple(part["values"]) if "values" in part else None
    kind = KINDS[part["type"]]
    low, high = (number_of(kind, part[key]) if key in part else end for key, end in (("min", -math.inf), ("max", math.inf)))
    domain = Domain(kind.name, values, low, high)
    return Condition(
        name,
        domain,
        part.get("unit", ""),
        part.get("description", ""),
        part.get("expr"),
        mirror=mirror_of(part.get("mirror")),
        weight=float(part.get("weight", 1.0)),
        hysteresis=float(part.get("hysteresis", 0.0)),
    )


def mirror_of(said: str | Mapping[str, str] | None) -> Mirror | None:
    """How the facts of a condition change in a mirror."""
    return tuple(said.items()) if isinstance(said, Mapping) else cast("Mirror | None", said)


def table_files(name: str, file: str | None) -> tuple[str, ...]:
    """The files that may hold a table, the most wanted first; `file` is the one that its section names."""
    names = [name + suffix for suffix in TABLE_SUFFIXES] if file is None else [file]
    return tuple(str(PurePosixPath(each)) for each in names)
