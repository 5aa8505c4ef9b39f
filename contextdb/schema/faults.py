"""What is wrong in a contextdb.toml: each fault with the path of the key it is about.

`contextdb.schema.shapes` describes what each key accepts; how keys and sections go together is checked here.
"""

from __future__ import annotations

import datetime
import math
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import replace
from typing import cast

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import NUMBER, Domain
from contextdb.cells.kinds import KINDS, Kind
from contextdb.cells.mirroring import partner_of, sided_pairs, swap_faults, swapped_tag
from contextdb.cells.outputs import Output
from contextdb.cells.sets import covers
from contextdb.disk import TABLE_SUFFIXES
from contextdb.errors import Fault, in_quotes, mend_for, nearest, no_such, safe_text, some
from contextdb.files.file_names import alike
from contextdb.files.toml_shapes import as_toml, key_value, near_key, no_key, what, wrong_name
from contextdb.schema import shapes
from contextdb.schema.contracts import (
    SECTIONS,
    VERBS,
    Part,
    condition_of,
    fitting_of,
    header,
    keys_of,
    limit_of,
    mirror_of,
    number_of,
    parts_of,
    row_conditions,
)
from contextdb.schema.outputs import bound_faults, declared_outputs, outputs_faults
from contextdb.schema.shapes import CONDITION, KEY_SYNONYMS
from contextdb.schema.table_settings import JOBS, columns_checked, table_files
from contextdb.schema.toml_lines import Path

PathFault = tuple[Path, Fault]

_HEADERS = {name: "[project]" if name == "project" else f"[{name}.NAME]" for name in SECTIONS}
_EACH_ONCE = 'each name in one pair, such as { Left = "Right" }'


def document_faults(document: Part) -> Iterator[PathFault]:
    """What is wrong in a file, but for its expressions."""
    for name, section in document.items():
        if name in SECTIONS:
            yield from section_faults(name, section)
        else:
            yield (name,), _no_section(name, section)
    yield from _partner_faults(parts_of(document, "conditions"))
    conditions = parts_of(document, "conditions").keys()
    for name, part in parts_of(document, "tables").items():
        yield from column_faults(("tables", name), fitting_of("tables", part), conditions)
    yield from _file_faults(parts_of(document, "tables"))
    yield from variant_faults({name: fitting_of("tables", part) for name, part in parts_of(document, "tables").items()})
    for name, part in parts_of(document, "blueprints").items():
        yield from _blueprint_faults(("blueprints", name), fitting_of("blueprints", part), conditions)


def expression_faults_in(document: Part) -> Iterator[PathFault]:
    """What is wrong with derived facts, assumptions and contracts, for a document whose conditions are sound."""
    conditions = {name: condition_of(name, part) for name, part in parts_of(document, "conditions").items()}
    assumed = {name: fitting_of("tables", part).get("assume", ()) for name, part in parts_of(document, "tables").items()}
    yield from expression_faults_of(conditions, assumed)
    yield from contract_expression_faults(document, conditions, _outputs_of_tables(document))


def _outputs_of_tables(document: Part) -> dict[str, dict[str, Output]]:
    """The outputs of each table by name, those of the tables that it varies too; none where its own have faults."""
    tables = {name: fitting_of("tables", part) for name, part in parts_of(document, "tables").items()}
    sound = {name: () if any(outputs_faults(part)) else part.get("outputs", ()) for name, part in tables.items()}
    own = {name: {output.name: output for output in declared_outputs(section)} for name, section in sound.items()}
    return {name: {n: o for one in reversed(bases_of(name, tables)) for n, o in own[one].items()} for name in tables}


def expression_faults_of(conditions: Mapping[str, Condition], assumed: Mapping[str, Sequence[str]]) -> Iterator[PathFault]:
    """What is wrong with derived facts and assumptions.

    An assumption may name a column that no condition declares; whether the table has it shows when the table is read.
    """
    yield from _derivation_faults(conditions)
    for name, assume in assumed.items():
        if assume:
            from contextdb.expressions import assumption_faults

            path = ("tables", name)
            for fault in assumption_faults(assume, conditions):
                if fault.rule != "unknown-fact":
                    yield (*path, "assume"), replace(fault, found=f"{header(path)} assume {fault.found}")


def _derivation_faults(conditions: Mapping[str, Condition]) -> Iterator[PathFault]:
    if any(condition.expr for condition in conditions.values()):
        from contextdb.expressions import derivation_faults

        for name, fault in derivation_faults(conditions):
            path = ("conditions", name)
            mend = fault.mend or ("to declare it, in a section [conditions.NAME]" if fault.rule == "unknown-fact" else "")
            yield (*path, "expr"), replace(fault, found=f"{header(path)} expr {fault.found}", mend=mend, rule="unreadable")


_ELSEWHERE = {
    **dict.fromkeys(("outputs", "output_columns"), 'outputs = { NAME = { type = "text" } } in [tables.NAME]'),
    **dict.fromkeys(("roles", "role", "actors"), '[conditions."Defender.speed"]'),
    **dict.fromkeys(("enums", "facts", "columns", "schema"), "[conditions.NAME]"),
}
"""What is no section of its own, and how it is declared."""
_RANGES = ("bounds", "range", "limits", "domain", "interval")


def _no_section(name: str, section: object) -> Fault:
    if elsewhere := _ELSEWHERE.get(name.casefold()):
        return Fault(f"{in_quotes(name)} is not a section.", ", ".join(_HEADERS.values()), elsewhere)
    near = nearest(name, SECTIONS)
    inner = next(iter(section), None) if isinstance(section, dict) and near != "project" else None
    mend = header((near, inner) if inner else (near,)) if near else ""
    return Fault(f"{in_quotes(name)} is not a section.", ", ".join(_HEADERS.values()), mend)


def section_faults(name: str, section: object) -> Iterator[PathFault]:
    """What is wrong in a section, such as all of `[conditions]`."""
    if not isinstance(section, Mapping):
        wrong = f"{safe_text(f'{name} = {as_toml(section)}')}: this is {what(section)}, not a section."
        yield (name,), Fault(wrong, _HEADERS[name])
    elif name == "project":
        yield from _key_faults((name,), section)
    else:
        for key, part in section.items():
            yield from part_faults((name, key), part)


def part_faults(path: Path, part: object) -> Iterator[PathFault]:
    """What is wrong in one part of a section, such as `[conditions.speed]`."""
    name, key = path
    if wrong := wrong_name(key):
        mend = header((name, key.strip())) if isinstance(key, str) and key.strip() else ""
        yield path, Fault(f"{header(path)}: the name cannot be used: {wrong}.", "a name without spaces around it", mend)
    if not isinstance(part, Mapping):
        is_kind = name == "conditions" and isinstance(part, str)
        mend = f"{key} = {{ type = {as_toml(part)} }}" if is_kind else ""
        yield path, Fault(f"[{name}] {key_value(key, part)}: this is {what(part)}, not a table.", _HEADERS[name], mend)
    elif SECTIONS[name] is not None:
        wrong_keys = list(_key_faults(path, part))
        yield from wrong_keys
        if name == "conditions":
            yield from _condition_faults(path, part)
        elif name == "contracts" and not wrong_keys:
            yield from contract_faults(path, part)
        elif name == "tables":
            for below, fault in outputs_faults(fitting_of("tables", part)):
                yield (*path, *below), replace(fault, found=f"{header(path)} {fault.found}")


def _key_faults(path: Path, part: Part) -> Iterator[PathFault]:
    keys = keys_of(path[0])
    for key, value in part.items():
        if key not in keys:
            yield (*path, key), _no_key(path, key, value)
        elif fault := keys[key].shape.fault(header(path), key, value):
            yield (*path, key), fault


def _no_key(path: Path, key: str, value: object) -> Fault:
    keys = keys_of(path[0])
    if isinstance(value, Mapping) and len(path) == 2:
        mend = header((path[0], f"{path[1]}.{key}"))
        return Fault(f"{header(path)} {key_value(key, value)}: this is a table, not a key.", "a name with a dot in quotes", mend)
    fault = no_key(header(path), key, keys, near_key(key, keys, KEY_SYNONYMS))
    if "min" in keys and str(key).casefold() in _RANGES and isinstance(value, list) and len(value) == 2:
        return replace(fault, mend=f"{key_value('min', value[0])} and {key_value('max', value[1])}")
    return fault


def _condition_faults(path: Path, part: Part) -> Iterator[PathFault]:
    fitting = fitting_of("conditions", part)
    kind = fitting.get("type")
    meant = {near_key(key, CONDITION, KEY_SYNONYMS) for key in part}
    if "type" not in meant and not any(isinstance(v, Mapping) for k, v in part.items() if k != "mirror"):
        guess = 'type = "enum"' if "values" in part else 'type = "number"' if {"min", "max"} & part.keys() else ""
        yield path, Fault(f"{header(path)} has no type.", CONDITION["type"].shape.accepted, guess)
    if kind in KINDS and KINDS[kind].needs_values and "values" not in meant:
        mend = 'type = "text", whose values are not declared'
        yield path, Fault(f"{header(path)} is {KINDS[kind].noun} without values.", 'values = ["A", "B"]', mend)
    for key in fitting:
        if kind and not CONDITION[key].has_place(kind):
            yield (*path, key), _no_place(path, key, fitting)
    of = KINDS.get(cast("str", kind), NUMBER.type)
    if of.is_bounded:
        bounds: Part = {key: fitting[key] for key in ("min", "max") if key in fitting}
        unread = {problem[-1]: fault for problem, fault in _unread_bounds(path, of, bounds)}
        yield from (((*path, key), fault) for key, fault in unread.items())
        if kind in KINDS:
            ends = {key: (bound, number_of(of, bound)) for key, bound in bounds.items() if key not in unread}
            yield from (((*path, key), fault) for key, fault in bound_faults(header(path), ends, of.noun, of.is_whole))
    if kind in KINDS and KINDS[kind].is_whole and fitting.get("hysteresis", 0) % 1:
        problem = f"{header(path)} {key_value('hysteresis', fitting['hysteresis'])}: {KINDS[kind].noun} has only whole neighbours."
        yield (*path, "hysteresis"), Fault(problem, "a whole number", key_value("hysteresis", math.ceil(fitting["hysteresis"])))
    if kind in KINDS and "mirror" in fitting:
        yield from _mirror_faults(path, fitting)


def _no_place(path: Path, key: str, fitting: Part) -> Fault:
    problem = f"{header(path)} {key_value(key, fitting[key])} has no place here: {KINDS[fitting['type']].unbounded}."
    accepted = f"{key} in a condition of type {' or '.join(CONDITION[key].types)}"
    return Fault(problem, accepted, 'type = "enum"' if key == "values" else "to leave it out")


def _unread_bounds(path: Path, kind: Kind, bounds: Part) -> Iterator[PathFault]:
    """Bounds that are no numbers as the type writes them."""
    for key, bound in bounds.items():
        prefix = f"{header(path)} {key_value(key, bound)}"
        if kind.is_spelt != isinstance(bound, (str, datetime.date)):
            meant = shapes.NUMBER.mend(bound) if kind.is_decimal else None
            mend = "" if meant is None else key_value(key, meant)
            yield (*path, key), Fault(f"{prefix}: this is {what(bound)}, not {kind.value}.", kind.bound, mend)
        elif kind.is_spelt:
            try:
                number_of(kind, bound)
            except ValueError as error:
                yield (*path, key), Fault(f"{prefix}: {error}.", kind.bound)


def _mirror_faults(path: Path, fitting: Part) -> Iterator[PathFault]:
    """Why the facts of a condition cannot change in a mirror as it says."""
    kind, mirror, values = KINDS[fitting["type"]], fitting["mirror"], fitting.get("values")
    prefix, key = f"{header(path)} {key_value('mirror', mirror)}", (*path, "mirror")
    if mirror == "none":
        return
    if "expr" in fitting:
        problem = f"{prefix} has no place here: a derived fact is computed from mirrored facts."
        yield key, Fault(problem, "mirror in the conditions that it is computed from", "to leave it out")
    elif mirror == "negate" and not kind.is_negated:
        mend = key_value("mirror", sided_pairs(values or ()) or {"Left": "Right"})
        yield key, Fault(f"{prefix}: a condition of type {kind.name} has no sign.", 'names that change places, or "none"', mend)
    elif mirror != "negate":
        yield from (
            (key, Fault(f"{prefix}: {in_quotes(name)}: {why}.", _EACH_ONCE)) for name, why in swap_faults(mirror, kind.is_tags)
        )
        yield from (
            (key, replace(fault, found=f"{prefix}: {fault.found}")) for fault in _unknown_partners(mirror, kind.is_tags, values)
        )


def _partner_faults(conditions: Mapping[str, Part]) -> Iterator[PathFault]:
    """Of conditions without names that change places by their own names: those whose partner is not one of the same kind."""
    fitting = {name: fitting_of("conditions", part) for name, part in conditions.items()}
    partners: dict[str, str | None] = {}
    for name, part in fitting.items():
        is_pair = part.get("type") in KINDS and not KINDS[part["type"]].is_swapped and isinstance(part.get("mirror"), Mapping)
        if is_pair and "expr" not in part:
            partners[name] = partner_of(Condition(name, Domain(part["type"]), mirror=mirror_of(part["mirror"])))
    for name, partner in partners.items():
        path = ("conditions", name)
        prefix = f"{header(path)} {key_value('mirror', fitting[name]['mirror'])}"
        if partner is None:
            accepted = 'a name in that of the condition, as Left is in "LeftFoot.Down"; "negate" or "none"'
            yield (*path, "mirror"), Fault(f"{prefix}: none of these is in the name {in_quotes(name)}.", accepted)
        elif partners.get(partner) != name or fitting[partner].get("type") != fitting[name].get("type"):
            problem = f"{prefix}: {in_quotes(partner)}, with which it changes places, does not change places with it."
            accepted = f"a condition of type {fitting[name]['type']} with the same mirror"
            mend = f"{header(('conditions', partner))} with {key_value('mirror', fitting[name]['mirror'])}"
            yield (*path, "mirror"), Fault(problem, accepted, mend)


def _unknown_partners(mirror: Mapping[str, str], is_tags: bool, values: Sequence[str] | None) -> Iterator[Fault]:
    """Faults of names of pairs that are no declared values, and of tags that would change places with one that is none."""
    if values is None:
        return
    known = frozenset(values)
    names = dict.fromkeys(name for pair in mirror.items() for name in pair)
    unknown = [name for name in names if not (covers(name, known) if is_tags else name in known)]
    for name in unknown:
        yield no_such("value", name, values)
    for value in values if is_tags and not unknown else ():
        image = swapped_tag(value, tuple(mirror.items()))
        if not covers(image, known):
            problem = f"{in_quotes(value)} is exchanged with {in_quotes(image)}, which is not a declared value."
            yield Fault(problem, "values that hold both", f"to add {in_quotes(image)} to the values")


def column_faults(path: Path, table: Part, conditions: Set[str]) -> Iterator[PathFault]:
    """Columns of a table that have two jobs, or that are declared as conditions."""
    for key, column, twice in columns_checked(table):
        if twice:
            yield (*path, key), replace(twice, found=f"{header(path)} {twice.found}")
        if column in conditions:
            problem = f"{header(path)} {key} names {in_quotes(column)}, which is declared as a condition."
            yield (*path, key), Fault(problem, "a column that is not a condition", f"to leave out {header(('conditions', column))}")


def _file_faults(tables: Mapping[str, Part]) -> Iterator[PathFault]:
    wrong_file = shapes.FILE.wrong
    owners: dict[str, str] = {}
    for name, part in tables.items():
        path, file = ("tables", name), part.get("file")
        wrong = wrong_name(name) or wrong_file(name + TABLE_SUFFIXES[0] if file is None else file)
        if wrong and file is None:
            yield path, Fault(f"{header(path)} has no file, and its name cannot be that of one: {wrong}.", 'file = "NAME.csv"')
        if wrong:
            continue
        standing = {alike(one) for one in table_files(name, file)}
        if shared := next((one for one in sorted(standing) if one in owners), None):
            problem = f"{header(path)} uses the file {in_quotes(shared)}, as {header(('tables', owners[shared]))} does."
            yield (*path, "file"), Fault(problem, "one file for each table")
        owners |= dict.fromkeys(standing - owners.keys(), name)


def _blueprint_faults(path: Path, blueprint: Part, conditions: Set[str]) -> Iterator[PathFault]:
    for name in blueprint.get("conditions", ()):
        if name not in conditions:
            problem = f"{header(path)} names the condition {in_quotes(name)}, which is not declared."
            yield (*path, "conditions"), Fault(problem, some(conditions), mend_for(name, conditions))


# ---- contracts


def contract_faults(path: Path, part: Part) -> Iterator[tuple[Path, Fault]]:
    """What is wrong with how the keys of a contract go together."""
    if "table" not in part:
        yield path, Fault(f"{header(path)} has no table.", 'table = "NAME"')
    given = [verb for verb in VERBS if verb in part]
    if len(given) != 1:
        problem = f"has {' and '.join(given)}" if given else "demands nothing"
        accepted = "exactly one of some, every, none, at_most and winner"
        yield (*path, given[1]) if given else path, Fault(f"{header(path)} {problem}.", accepted)


def contract_expression_faults(
    document: Part, conditions: Mapping[str, Condition], outputs: Mapping[str, Mapping[str, Output]]
) -> Iterator[tuple[Path, Fault]]:
    """What is wrong with the expressions of contracts; `outputs` are those of each declared table. Names that only the table can
    know are left for when it is read."""
    for name in parts_of(document, "contracts"):
        path, fitting = ("contracts", name), fitting_of("contracts", parts_of(document, "contracts")[name])
        if "when" in fitting:
            yield from _faults(path, "when", fitting["when"], conditions, False)
        rows = row_conditions(outputs.get(fitting.get("table", ""), {}))
        for verb in VERBS:
            kind = limit_of(fitting[verb])[1] if verb == "at_most" and verb in fitting else fitting.get(verb)
            if isinstance(kind, str):
                yield from _faults(path, verb, kind, rows, fitting.get("table") in outputs)


def _faults(path: Path, key: str, text: str, conditions: Mapping[str, Condition], knows_all: bool) -> Iterator[tuple[Path, Fault]]:
    from contextdb.expressions import assumption_faults

    for fault in assumption_faults([text], conditions):
        if knows_all or fault.rule != "unknown-fact":
            yield (*path, key), replace(fault, found=f"{header(path)} {key} {fault.found}", rule="unreadable")


# ---- variants


def variant_faults(tables: Mapping[str, Part]) -> Iterator[tuple[Path, Fault]]:
    """Columns that have another job than in the base, and what only a variant can have. Whether there is a table of the base's name
    shows when tables are read."""
    for name, part in tables.items():
        path = ("tables", name)
        if "remove" in part and "base" not in part:
            problem = f"{header(path)} {key_value('remove', part['remove'])} has no place here: the table is no variant."
            yield (*path, "remove"), Fault(problem, 'base = "TABLE"', "to leave it out")
        inherited = bases_of(name, tables)[1:]
        for job in JOBS:
            of = next((base for base in inherited if job in tables[base] and job != "remove"), None)
            if job in part and of is not None and part[job] != tables[of][job]:
                problem = f"{header(path)} {key_value(job, part[job])}: its base has another."
                mend = key_value(job, tables[of][job])
                yield (*path, job), Fault(problem, f"the column of {header(('tables', of))}, or none", mend)


def bases_of(name: str, tables: Mapping[str, Part]) -> list[str]:
    """A table and those that it is a variant of, as far as they are declared."""
    chain = [name]
    while (base := tables[chain[-1]].get("base")) in tables and base not in chain:
        chain.append(str(base))
    return chain
