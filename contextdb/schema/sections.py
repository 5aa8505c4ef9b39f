"""The sections of contextdb.toml as plain data, from what they mean: the way back from `contextdb.schema.settings`.

A key that says what holds without it is left out, so that two settings are equal when their data are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.errors import Fault, SchemaError, in_quotes, mend_for, nearest, some
from contextdb.files.toml_shapes import no_key, wrong_name
from contextdb.schema.contracts import PLAIN, Contract, keys_of
from contextdb.schema.faults import section_faults
from contextdb.schema.outputs import fallback_to_toml, outputs_faults, outputs_to_toml
from contextdb.schema.settings import Schema, TableSettings, conditions_from_dict, settings_fields
from contextdb.schema.shapes import CONDITION, NAMES
from contextdb.schema.table_settings import columns_checked

Part = dict[str, object]
"""The keys of one named section, such as `[conditions.speed]`, and their values as TOML has them."""

EDITED_SECTIONS = ("conditions", "blueprints", "contracts", "selectors")
"""The sections that edits may change, next to the settings of a table."""


def condition_to_dict(condition: Condition) -> Part:
    """What `[conditions.NAME]` says of a condition."""
    domain = condition.domain
    bounds = {"min": domain.minimum, "max": domain.maximum}
    part: Part = {"type": domain.kind}
    part |= {key: _bound(bound, domain) for key, bound in bounds.items() if math.isfinite(bound)}
    if domain.values is not None:
        part["values"] = list(domain.values)
    if condition.mirror is not None:
        part["mirror"] = dict(condition.mirror) if isinstance(condition.mirror, tuple) else condition.mirror
    part |= {key: value for key in PLAIN if (value := getattr(condition, key)) not in ("", CONDITION[key].default)}
    return {key: part[key] for key in CONDITION if key in part}


def _bound(bound: float, domain: Domain) -> object:
    return domain.type.spelling.write(bound) if domain.type.is_spelt else domain.type.given(bound)


def has_place(key: str, kind: object) -> bool:
    """Whether a key of a condition has a place under a type."""
    return key not in CONDITION or CONDITION[key].has_place(kind)


def settings_to_dict(settings: TableSettings) -> Part:
    """What `[tables.NAME]` says of a table."""
    plain = TableSettings(settings.name)
    part = {key: getattr(settings, key) for key in keys_of("tables")}
    part = {key: value for key, value in part.items() if value != getattr(plain, key)}
    part = {key: list(value) if isinstance(value, tuple) else value for key, value in part.items()}
    if "outputs" in part:
        part["outputs"] = outputs_to_toml(settings.outputs, settings.typed)
    if "fallback" in part:
        part["fallback"] = fallback_to_toml(settings.fallback, settings.fallback_outputs)
    return part


def contract_to_dict(contract: Contract) -> Part:
    """What `[contracts.NAME]` says of a contract."""
    part: Part = {key: value for key in keys_of("contracts") if (value := getattr(contract, key)) not in (None, "")}
    if contract.at_most is not None:
        n, of = contract.at_most
        part["at_most"] = n if of is None else {"n": n, "of": of}
    return part


def schema_to_dict(schema: Schema) -> dict[str, dict[str, Part]]:
    """The sections that edits may change: section to name to keys."""
    return {
        "conditions": {name: condition_to_dict(condition) for name, condition in schema.conditions.items()},
        "blueprints": {name: {"conditions": list(names)} for name, names in schema.blueprints.items()},
        "contracts": {name: contract_to_dict(contract) for name, contract in schema.contracts.items()},
        "selectors": {name: dict(part) for name, part in schema.selectors.items()},
    }


def differences(before: Mapping[str, object], after: Mapping[str, object]) -> dict[str, object]:
    """The new value of each key; None where it is removed."""
    changed = {key: value for key, value in after.items() if key not in before or before[key] != value}
    return changed | {key: None for key in before if key not in after}


# ---- what changes


def schema_with(schema: Schema, parts: Mapping[str, Mapping[str, Mapping[str, object] | None]]) -> Schema:
    """The schema with some parts changed; None removes one. Raises SchemaError for a part that contextdb.toml could not hold, with
    what is accepted."""
    document: dict[str, Any] = {
        section: _with(getattr(schema, section), parts[section]) for section in EDITED_SECTIONS if section in parts
    }
    if "conditions" in parts:
        new = conditions_from_dict({name: part for name, part in parts["conditions"].items() if part is not None})
        document["conditions"] = {name: new.get(name, condition) for name, condition in document["conditions"].items()}
    if "blueprints" in parts:
        document["blueprints"] = {name: _names(name, part) for name, part in document["blueprints"].items()}
    if "contracts" in parts:
        document["contracts"] = {name: _contract(name, part) for name, part in document["contracts"].items()}
    return replace(schema, **document)


def settings_with(settings: TableSettings, changes: Mapping[str, Any]) -> TableSettings:
    """The settings with some keys changed; None removes one. Raises SchemaError for a key or a value that `[tables.NAME]` could not
    hold, with what is accepted."""
    keys, plain = keys_of("tables"), TableSettings(settings.name)
    faults = []
    for key, value in changes.items():
        if key not in keys:
            faults.append(no_key("a table", key, keys, nearest(str(key), keys), "setting"))
        elif value is not None and (fault := keys[key].shape.fault("", key, value)):
            faults.append(fault)
    if not faults:
        together = {key: value for key, value in {**settings_to_dict(settings), **changes}.items() if value is not None}
        faults = [fault for _, fault in outputs_faults(together)]
    if faults:
        raise SchemaError(*faults)
    return replace(plain, **settings_fields(together))


def job_faults(settings: TableSettings, columns: Sequence[str], schema: Schema) -> Iterator[Fault]:
    """Why a table of these columns cannot have these settings: a column that is missing, has two jobs, or is a condition."""
    known = frozenset(columns)
    for key, column, twice in columns_checked(vars(settings)):
        if column not in known:
            yield Fault(f"there is no column {in_quotes(column)} for {key}.", some(columns), mend_for(column, columns))
        elif twice:
            yield twice
        elif column in schema.conditions:
            problem = f"{key} names {in_quotes(column)}, which contextdb.toml declares as a condition."
            yield Fault(problem, "a column that is not a condition")


def blueprint_faults(schema: Schema) -> Iterator[Fault]:
    """Conditions that a blueprint names and nobody declares."""
    for name, conditions in schema.blueprints.items():
        for condition in conditions:
            if condition not in schema.conditions:
                problem = f"the blueprint {in_quotes(name)} names the condition {in_quotes(condition)}, which is not declared."
                yield Fault(problem, some(schema.conditions), mend_for(condition, schema.conditions))


def _with(parts: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    now = {**parts, **changes}
    return {name: part for name, part in now.items() if part is not None}


def _contract(name: str, part: Any) -> Contract:
    """A contract: as it was, or checked where it changes."""
    if isinstance(part, Contract):
        return part
    if faults := list(section_faults("contracts", {name: part})):
        raise SchemaError(*(fault for _, fault in faults))
    return Contract(name, **part)


def _names(blueprint: str, part: Any) -> tuple[str, ...]:
    """The conditions of a blueprint: as they were, or checked where they change."""
    if isinstance(part, tuple):
        return part
    wrong = wrong_name(blueprint) or NAMES.wrong(part.get("conditions"))
    if wrong:
        raise SchemaError(Fault(f"the blueprint {in_quotes(str(blueprint))}: {wrong}.", NAMES.accepted))
    return tuple(part["conditions"])
