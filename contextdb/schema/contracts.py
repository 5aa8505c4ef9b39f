"""Contracts: what must hold of a table in every context, as `[contracts.NAME]` of contextdb.toml declares it.

    some      at least one valid row is of the kind
    every     all valid rows are, also where there is none
    none      no valid row is
    at_most   no more valid rows, or no more of a kind
    winner    some row is valid, and each row that the policy may pick is of the kind

A kind of rows is an expression over `asset`, `weight`, `priority` and the outputs of the table. Nothing here knows its rows.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal, cast

from contextdb.cells.conditions import Condition, Mirror
from contextdb.cells.domains import INT, NUMBER, Domain
from contextdb.cells.kinds import KINDS, Kind
from contextdb.cells.outputs import Output
from contextdb.errors import SchemaError, safe_text
from contextdb.files.settings import Declared, Settings, setting, settings_of
from contextdb.files.toml_shapes import Shape, dotted, meant_text, what, wrong_name
from contextdb.schema.shapes import BLUEPRINT, COLUMN, CONDITION, EXPRESSION, PROJECT, TEXT
from contextdb.schema.table_settings import TableSettings
from contextdb.schema.toml_lines import Path

Verb = Literal["some", "every", "none", "at_most", "winner"]
VERBS: tuple[Verb, ...] = ("some", "every", "none", "at_most", "winner")
MOST = 1000
"""The greatest number of `at_most`."""


def _wrong_limit(value: object) -> str | None:
    n, of = value, "asset"
    if isinstance(value, Mapping):
        if set(value) - {"n", "of"} or "n" not in value:
            return "this has other keys than n and of, or no n"
        n, of = value["n"], value.get("of", of)
    elif isinstance(value, tuple) and len(value) == 2:
        n, of = value[0], value[1] or of
    if isinstance(n, bool) or not isinstance(n, int):
        return f"this is {what(n)}, not a number of rows"
    if not 0 <= n <= MOST:
        return f"this is not from 0 to {MOST}"
    return wrong_name(of)


def limit_of(value: Any) -> tuple[int, str | None]:
    """The number of rows, and their kind; None: all rows."""
    if isinstance(value, Mapping):
        return value["n"], value.get("of")
    return value if isinstance(value, tuple) else (value, None)


KIND = Shape("a kind of rows as text, such as \"asset like 'carry*'\"", wrong_name, meant_text)
LIMIT = Shape("a number of rows from 0 up, or { n = 3, of = \"asset like 'carry*'\" }", _wrong_limit, read=limit_of)


@dataclass(frozen=True)
class Contract(Declared, error=SchemaError):
    """What `[contracts.NAME]` says must hold of a table; one of `some`, `every`, `none`, `at_most` and `winner` is given."""

    name: str
    table: str = setting(COLUMN, "The table that it is about.")
    when: str | None = setting(
        EXPRESSION, "The contexts in which it must hold.", None,
        more="An [expression](#expressions) over facts; those that `assume` excludes are left out, too.", without="all contexts",
    )  # fmt: skip
    some: str | None = setting(KIND, "At least one valid row is of this kind.", None, without="not demanded")
    every: str | None = setting(
        KIND, "All valid rows are of this kind.", None, more="It holds where no row is valid.", without="not demanded"
    )
    none: str | None = setting(KIND, "No valid row is of this kind.", None, without="not demanded")
    at_most: tuple[int, str | None] | None = setting(
        LIMIT, "No more rows are valid at once, or no more of a kind.", None, without="not demanded"
    )
    winner: str | None = setting(
        KIND, "A row is valid, and every row that the policy may pick is of this kind.", None,
        more="Whatever was picked before, rests, or costs more in a search. A fallback is no row.", without="not demanded",
    )  # fmt: skip
    why: str = setting(TEXT, "Why it must hold: reports say it.", "", without="nothing")

    @property
    def verb(self) -> Verb:
        """What is demanded."""
        return next(verb for verb in VERBS if getattr(self, verb) is not None)

    @property
    def kind(self) -> str | None:
        """The kind of rows that it is about; None for all rows."""
        return self.at_most[1] if self.at_most is not None else cast("str", getattr(self, self.verb))

    @property
    def most(self) -> int:
        """The number of `at_most`."""
        return self.at_most[0] if self.at_most is not None else 0

    @property
    def demand(self) -> str:
        """What is demanded, as reports write it."""
        kind = "" if self.kind is None else f" {self.kind}"
        return f"at_most {self.most}{' of' if kind else ''}{kind}" if self.at_most is not None else f"{self.verb}{kind}"


def row_conditions(outputs: Mapping[str, Output], values: Mapping[str, tuple[str, ...]] | None = None) -> dict[str, Condition]:
    """What kinds of rows may name, as conditions; `values` are the texts of those of type text that a table has."""
    known = values or {}
    conditions = {name: Condition(name, _domain(output, known.get(name, ()))) for name, output in outputs.items()}
    conditions = {name: condition for name, condition in conditions.items() if not output_is_list(outputs[name])}
    own = {"asset": Domain("text", known.get("asset", ())), "weight": NUMBER, "priority": INT}
    return conditions | {name: Condition(name, domain) for name, domain in own.items()}


def output_is_list(output: Output) -> bool:
    """Whether a cell has several numbers, of which no kind can be made."""
    return output.type.has_size


def _domain(output: Output, values: tuple[str, ...]) -> Domain:
    if output.type.has_values:
        return Domain("enum", output.values)
    kind = KINDS.get(output.kind)
    return Domain("text", values) if kind is None or kind.has_values else Domain(kind.name)


# ---- the parts of contextdb.toml: how each is written, what of it can be used, and the conditions and files it declares


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
