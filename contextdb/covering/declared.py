"""What the shares of a table are shares of: its conditions with their types, bounds and values, and what contextdb.toml assumes.

A baseline keeps this as plain data, so that shares of two different spaces are never compared without a word, and the difference
can be named. Data only.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from contextdb.cells.conditions import Condition
from contextdb.cells.kinds import KINDS
from contextdb.covering.assumed import assumptions_of
from contextdb.covering.ruled import without_rules
from contextdb.errors import in_quotes, joined
from contextdb.expressions.expression import read_expression
from contextdb.tables.table import EitherTable

Declared = Mapping[str, Any]
MOST_VALUES = 8
NOTHING: Declared = {"conditions": {}, "facts": {}, "assume": [], "assumed": {}, "when": None, "policy": None}
"""Where no table says which contexts there are."""


def declared(table: EitherTable, assumed: Mapping[str, str]) -> dict[str, Any]:
    """What the shares of a table rest on, as JSON has it; `assumed` is what its report had to assume of what is not declared."""
    flat = table.flat()
    own = {column.condition.name: column.condition for column in flat.conditions}
    ruled = without_rules(flat)
    named = {c.name: c for expression in assumptions_of(ruled.table).expressions for c in expression.conditions}
    behind = _inputs({**named, **ruled.others, **own}, flat.schema.conditions)
    return {
        "conditions": {name: _about(condition) for name, condition in own.items()},
        "facts": {name: _about(condition) for name, condition in behind.items() if name not in own},
        "assume": list(flat.settings.assume),
        "assumed": dict(assumed),
        "when": flat.settings.when,
        "policy": flat.settings.policy,
    }


def _inputs(conditions: Mapping[str, Condition], known: Mapping[str, Condition]) -> dict[str, Condition]:
    """Some conditions, and all that they are computed from."""
    conditions_by_name, remaining = dict[str, Condition](), list(conditions.values())
    while remaining:
        condition = remaining.pop()
        if condition.name in conditions_by_name:
            continue
        conditions_by_name[condition.name] = condition
        if condition.expr:
            remaining += read_expression(condition.expr, known).conditions
    return dict(sorted(conditions_by_name.items()))


def _about(condition: Condition) -> dict[str, Any]:
    domain = condition.domain
    about = {
        "type": domain.kind,
        "values": None if domain.values is None else list(domain.values),
        "min": domain.minimum if math.isfinite(domain.minimum) else None,
        "max": domain.maximum if math.isfinite(domain.maximum) else None,
        "expr": condition.expr,
    }
    return {key: value for key, value in about.items() if value is not None}


def require_declared(value: object) -> Declared:
    """What a document says, checked. Raises TypeError for what `declared` does not give."""
    mappings, texts = ("conditions", "facts", "assumed"), ("when", "policy")
    is_sound = (
        isinstance(value, dict)
        and all(isinstance(value.get(name), dict) for name in mappings)
        and isinstance(value.get("assume"), list)
        and all(isinstance(value.get(name), (str, type(None))) for name in texts)
    )
    if not isinstance(value, dict) or not is_sound:
        raise TypeError('"space" of a table is not what was written')
    parts = [*value["conditions"].values(), *value["facts"].values()]
    if not all(isinstance(part, dict) and isinstance(part.get("values", []), list) for part in parts):
        raise TypeError('"space" of a table is not what was written')
    return value


def differences(before: Declared, now: Declared) -> tuple[str, ...]:
    """What is declared otherwise than before, a phrase for each difference; nothing where the spaces are the same."""
    return tuple(_differences(before, now))


def _differences(before: Declared, now: Declared) -> Iterator[str]:
    for name, about in before["conditions"].items():
        if name not in now["conditions"]:
            yield f"{in_quotes(name)} is no condition any more (it was {_words(about)})"
    for name, about in now["conditions"].items():
        if name not in before["conditions"]:
            yield f"{in_quotes(name)} is a new condition ({_words(about)})"
    old, new = ({**part["facts"], **part["conditions"]} for part in (before, now))
    both = [name for name in new if name in old]
    for name in both:
        yield from (f"{in_quotes(name)}: {words}" for words in _changes(old[name], new[name]))
    for text in before["assume"]:
        if text not in now["assume"]:
            yield f"assume no longer has {in_quotes(text)}"
    for text in now["assume"]:
        if text not in before["assume"]:
            yield f"assume now has {in_quotes(text)}"
    for name in both:
        was, is_now = (part["assumed"].get(name, "as declared") for part in (before, now))
        if was != is_now:
            yield f"{in_quotes(name)} is not fully declared, and counts otherwise: before {was}, now {is_now}"
    for key, what in (("when", "the column of rules"), ("policy", "the policy")):
        if before[key] != now[key]:
            yield f"{what} was {before[key] or 'none'}, now {now[key] or 'none'}"


def _changes(before: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    if before.get("type") != now.get("type"):
        yield f"type {before.get('type')}, now {now.get('type')}"
    for key in ("min", "max"):
        if before.get(key) != now.get(key):
            yield f"{key} {_written(before, key)}, now {_written(now, key)}"
    old, new = before.get("values", []), now.get("values", [])
    if lost := [value for value in old if value not in new]:
        yield f"the values are without {_listed(lost)}"
    if added := [value for value in new if value not in old]:
        yield f"the values are with {_listed(added)} too"
    if before.get("expr") != now.get("expr"):
        yield f"computed as {before.get('expr') or 'nothing (it was given)'}, now {now.get('expr') or 'nothing (it is given)'}"


def _words(about: Mapping[str, Any]) -> str:
    """A condition in a few words: its type and its bounds or values."""
    bounds = f"{_written(about, 'min')} to {_written(about, 'max')}" if about.keys() & {"min", "max"} else ""
    values = _listed(about["values"]) if "values" in about else ""
    expr = f"= {about['expr']}" if "expr" in about else ""
    return " ".join(part for part in (str(about.get("type")), bounds, values, expr) if part)


def _written(about: Mapping[str, Any], key: str) -> str:
    """A bound as contextdb.toml has it."""
    kind = KINDS.get(about.get("type", ""))
    return "none" if key not in about else kind.spelling.write(about[key]) if kind else str(about[key])


def _listed(values: Sequence[object]) -> str:
    return joined([str(value) for value in values], MOST_VALUES)
