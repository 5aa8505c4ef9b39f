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
from contextdb.cells.kinds import KINDS, Kind, names_where
from contextdb.cells.mirroring import partner_of, sided_pairs, swap_faults, swapped_tag
from contextdb.cells.sets import covers
from contextdb.disk import TABLE_SUFFIXES
from contextdb.errors import Fault, in_quotes, mend_for, nearest, no_such, shown, some
from contextdb.expressions import assumption_faults, derivation_faults
from contextdb.files.file_names import alike
from contextdb.files.toml_shapes import near_key, no_key, said_of
from contextdb.files.toml_text import as_toml, what
from contextdb.schema import shapes
from contextdb.schema.jobs import columns_checked
from contextdb.schema.outputs import outputs_faults
from contextdb.schema.parts import (
    Said,
    condition_of,
    fitting_of,
    header,
    mirror_of,
    number_of,
    parts_of,
    shapes_of,
    table_files,
)
from contextdb.schema.shapes import KEY_SYNONYMS, SECTIONS, wrong_name
from contextdb.schema.toml_lines import Path

Found = tuple[Path, Fault]

_HEADERS = {name: "[project]" if name == "project" else f"[{name}.NAME]" for name in SECTIONS}
_EACH_ONCE = 'each name in one pair, such as { Left = "Right" }'
KINDS_WITH = {
    **dict.fromkeys(("min", "max"), names_where(lambda kind: kind.is_bounded)),
    "values": names_where(lambda kind: kind.has_values),
    "hysteresis": names_where(lambda kind: kind.is_decimal),
}


def document_faults(document: Said) -> Iterator[Found]:
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
    for name, part in parts_of(document, "blueprints").items():
        yield from _blueprint_faults(("blueprints", name), fitting_of("blueprints", part), conditions)


def expression_faults_in(document: Said) -> Iterator[Found]:
    """What is wrong with derived facts and assumptions, for a document whose conditions are sound."""
    conditions = {name: condition_of(name, part) for name, part in parts_of(document, "conditions").items()}
    assumed = {name: fitting_of("tables", part).get("assume", ()) for name, part in parts_of(document, "tables").items()}
    yield from expression_faults_of(conditions, assumed)


def expression_faults_of(conditions: Mapping[str, Condition], assumed: Mapping[str, Sequence[str]]) -> Iterator[Found]:
    """What is wrong with derived facts and assumptions.

    An assumption may name a column that no condition declares; whether the table has it shows when the table is read.
    """
    yield from _derivation_faults(conditions)
    for name, assume in assumed.items():
        if assume:
            path = ("tables", name)
            for fault in assumption_faults(assume, conditions):
                if fault.rule != "unknown-fact":
                    yield (*path, "assume"), replace(fault, found=f"{header(path)} assume {fault.found}")


def _derivation_faults(conditions: Mapping[str, Condition]) -> Iterator[Found]:
    if any(condition.expr for condition in conditions.values()):
        for name, fault in derivation_faults(conditions):
            path = ("conditions", name)
            mend = fault.mend or ("to declare it, in a section [conditions.NAME]" if fault.rule == "unknown-fact" else "")
            yield (*path, "expr"), replace(fault, found=f"{header(path)} expr {fault.found}", mend=mend, rule="unreadable")


def _no_section(name: str, section: object) -> Fault:
    near = nearest(name, SECTIONS)
    inner = next(iter(section), None) if isinstance(section, dict) and near != "project" else None
    mend = header((near, inner) if inner else (near,)) if near else ""
    return Fault(f"{in_quotes(name)} is not a section.", ", ".join(_HEADERS.values()), mend)


def section_faults(name: str, section: object) -> Iterator[Found]:
    """What is wrong in a section, such as all of `[conditions]`."""
    if not isinstance(section, Mapping):
        yield (name,), Fault(f"{shown(f'{name} = {as_toml(section)}')}: this is {what(section)}, not a section.", _HEADERS[name])
    elif name == "project":
        yield from _key_faults((name,), section)
    else:
        for key, part in section.items():
            yield from part_faults((name, key), part)


def part_faults(path: Path, part: object) -> Iterator[Found]:
    """What is wrong in one part of a section, such as `[conditions.speed]`."""
    name, key = path
    if wrong := wrong_name(key):
        mend = header((name, key.strip())) if isinstance(key, str) and key.strip() else ""
        yield path, Fault(f"{header(path)}: the name cannot be used: {wrong}.", "a name without spaces around it", mend)
    if not isinstance(part, Mapping):
        is_kind = name == "conditions" and isinstance(part, str)
        mend = f"{key} = {{ type = {as_toml(part)} }}" if is_kind else ""
        yield path, Fault(f"[{name}] {said_of(key, part)}: this is {what(part)}, not a table.", _HEADERS[name], mend)
    elif SECTIONS[name] is not None:
        yield from _key_faults(path, part)
        if name == "conditions":
            yield from _condition_faults(path, part)
        elif name == "tables":
            for below, fault in outputs_faults(fitting_of("tables", part)):
                yield (*path, *below), replace(fault, found=f"{header(path)} {fault.found}")


def _key_faults(path: Path, part: Said) -> Iterator[Found]:
    shapes = shapes_of(path[0])
    for key, value in part.items():
        if key not in shapes:
            yield (*path, key), _no_key(path, key, value)
        elif fault := shapes[key].fault(header(path), key, value):
            yield (*path, key), fault


def _no_key(path: Path, key: str, value: object) -> Fault:
    shapes = shapes_of(path[0])
    if isinstance(value, Mapping) and len(path) == 2:
        mend = header((path[0], f"{path[1]}.{key}"))
        return Fault(f"{header(path)} {said_of(key, value)}: this is a table, not a key.", "a name with a dot in quotes", mend)
    return no_key(header(path), key, shapes, near_key(key, shapes, KEY_SYNONYMS))


def _condition_faults(path: Path, part: Said) -> Iterator[Found]:
    fitting = fitting_of("conditions", part)
    kind = fitting.get("type")
    meant = {near_key(key, shapes_of("conditions"), KEY_SYNONYMS) for key in part}
    if "type" not in meant and not any(isinstance(v, Mapping) for k, v in part.items() if k != "mirror"):
        guess = 'type = "enum"' if "values" in part else 'type = "number"' if {"min", "max"} & part.keys() else ""
        yield path, Fault(f"{header(path)} has no type.", shapes_of("conditions")["type"].accepted, guess)
    if kind in KINDS and KINDS[kind].needs_values and "values" not in meant:
        mend = 'type = "text", whose values are not declared'
        yield path, Fault(f"{header(path)} is {KINDS[kind].noun} without values.", 'values = ["A", "B"]', mend)
    for key, kinds in KINDS_WITH.items():
        if key in fitting and kind and kind not in kinds:
            yield (*path, key), _no_place(path, key, fitting)
    of = KINDS.get(cast("str", kind), NUMBER.type)
    if of.is_bounded:
        bounds: Said = {key: fitting[key] for key in ("min", "max") if key in fitting}
        unread = {found[-1]: fault for found, fault in _unread_bounds(path, of, bounds)}
        yield from (((*path, key), fault) for key, fault in unread.items())
        if kind in KINDS:
            yield from _bound_faults(path, of, {key: bound for key, bound in bounds.items() if key not in unread})
    if kind in KINDS and KINDS[kind].is_whole and fitting.get("hysteresis", 0) % 1:
        found = f"{header(path)} {said_of('hysteresis', fitting['hysteresis'])}: {KINDS[kind].noun} has only whole neighbours."
        yield (*path, "hysteresis"), Fault(found, "a whole number", said_of("hysteresis", math.ceil(fitting["hysteresis"])))
    if kind in KINDS and "mirror" in fitting:
        yield from _mirror_faults(path, fitting)


def _no_place(path: Path, key: str, fitting: Said) -> Fault:
    found = f"{header(path)} {said_of(key, fitting[key])} has no place here: {KINDS[fitting['type']].unbounded}."
    accepted = f"{key} in a condition of type {' or '.join(KINDS_WITH[key])}"
    return Fault(found, accepted, 'type = "enum"' if key == "values" else "to leave it out")


def _unread_bounds(path: Path, kind: Kind, bounds: Said) -> Iterator[Found]:
    """Bounds that are no numbers as the type writes them."""
    for key, bound in bounds.items():
        said = f"{header(path)} {said_of(key, bound)}"
        if kind.is_spelt != isinstance(bound, (str, datetime.date)):
            meant = shapes.NUMBER.mend(bound) if kind.is_decimal else None
            mend = "" if meant is None else said_of(key, meant)
            yield (*path, key), Fault(f"{said}: this is {what(bound)}, not {kind.value}.", kind.bound, mend)
        elif kind.is_spelt:
            try:
                number_of(kind, bound)
            except ValueError as error:
                yield (*path, key), Fault(f"{said}: {error}.", kind.bound)


def _bound_faults(path: Path, kind: Kind, bounds: Said) -> Iterator[Found]:
    ends = {key: number_of(kind, bound) for key, bound in bounds.items()}
    low, high = ends.get("min", -math.inf), ends.get("max", math.inf)
    if low > high:
        found = f"{header(path)} {said_of('min', bounds['min'])} is above {said_of('max', bounds['max'])}."
        mend = f"{said_of('min', bounds['max'])} and {said_of('max', bounds['min'])}"
        yield (*path, "min"), Fault(found, "a min that is not above max", mend)
    for key, bound, is_no_end, nearer in (("min", low, low == math.inf, math.ceil), ("max", high, high == -math.inf, math.floor)):
        said = f"{header(path)} {said_of(key, bounds.get(key, bound))}"
        if is_no_end:
            yield (*path, key), Fault(f"{said} leaves no number.", "a finite number", "to leave it out")
        elif kind.is_whole and math.isfinite(bound) and bound != math.floor(bound):
            yield (*path, key), Fault(f"{said}: {kind.noun} has whole bounds.", "a whole number", said_of(key, nearer(bound)))


def _mirror_faults(path: Path, fitting: Said) -> Iterator[Found]:
    """Why the facts of a condition cannot change in a mirror as it says."""
    kind, mirror, values = KINDS[fitting["type"]], fitting["mirror"], fitting.get("values")
    said, key = f"{header(path)} {said_of('mirror', mirror)}", (*path, "mirror")
    if mirror == "none":
        return
    if "expr" in fitting:
        found = f"{said} has no place here: a derived fact is computed from mirrored facts."
        yield key, Fault(found, "mirror in the conditions that it is computed from", "to leave it out")
    elif mirror == "negate" and not kind.is_negated:
        mend = said_of("mirror", sided_pairs(values or ()) or {"Left": "Right"})
        yield key, Fault(f"{said}: a condition of type {kind.name} has no sign.", 'names that change places, or "none"', mend)
    elif mirror != "negate":
        yield from (
            (key, Fault(f"{said}: {in_quotes(name)}: {why}.", _EACH_ONCE)) for name, why in swap_faults(mirror, kind.is_tags)
        )
        yield from (
            (key, replace(fault, found=f"{said}: {fault.found}")) for fault in _unknown_partners(mirror, kind.is_tags, values)
        )


def _partner_faults(conditions: Mapping[str, Said]) -> Iterator[Found]:
    """Of conditions without names that change places by their own names: those whose partner is not one of the same kind."""
    fitting = {name: fitting_of("conditions", part) for name, part in conditions.items()}
    partners: dict[str, str | None] = {}
    for name, part in fitting.items():
        is_pair = part.get("type") in KINDS and not KINDS[part["type"]].is_swapped and isinstance(part.get("mirror"), Mapping)
        if is_pair and "expr" not in part:
            partners[name] = partner_of(Condition(name, Domain(part["type"]), mirror=mirror_of(part["mirror"])))
    for name, partner in partners.items():
        path = ("conditions", name)
        said = f"{header(path)} {said_of('mirror', fitting[name]['mirror'])}"
        if partner is None:
            accepted = 'a name in that of the condition, as Left is in "LeftFoot.Down"; "negate" or "none"'
            yield (*path, "mirror"), Fault(f"{said}: none of these is in the name {in_quotes(name)}.", accepted)
        elif partners.get(partner) != name or fitting[partner].get("type") != fitting[name].get("type"):
            found = f"{said}: {in_quotes(partner)}, with which it changes places, does not change places with it."
            accepted = f"a condition of type {fitting[name]['type']} with the same mirror"
            mend = f"{header(('conditions', partner))} with {said_of('mirror', fitting[name]['mirror'])}"
            yield (*path, "mirror"), Fault(found, accepted, mend)


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
            found = f"{in_quotes(value)} is exchanged with {in_quotes(image)}, which is not a declared value."
            yield Fault(found, "values that hold both", f"to add {in_quotes(image)} to the values")


def column_faults(path: Path, table: Said, conditions: Set[str]) -> Iterator[Found]:
    """Columns of a table that have two jobs, or that are declared as conditions."""
    for key, column, twice in columns_checked(table):
        if twice:
            yield (*path, key), replace(twice, found=f"{header(path)} {twice.found}")
        if column in conditions:
            found = f"{header(path)} {key} names {in_quotes(column)}, which is declared as a condition."
            yield (*path, key), Fault(found, "a column that is not a condition", f"to leave out {header(('conditions', column))}")


def _file_faults(tables: Mapping[str, Said]) -> Iterator[Found]:
    wrong_file = shapes_of("tables")["file"].wrong
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
            found = f"{header(path)} uses the file {in_quotes(shared)}, as {header(('tables', owners[shared]))} does."
            yield (*path, "file"), Fault(found, "one file for each table")
        owners |= dict.fromkeys(standing - owners.keys(), name)


def _blueprint_faults(path: Path, blueprint: Said, conditions: Set[str]) -> Iterator[Found]:
    for name in blueprint.get("conditions", ()):
        if name not in conditions:
            found = f"{header(path)} names the condition {in_quotes(name)}, which is not declared."
            yield (*path, "conditions"), Fault(found, some(conditions), mend_for(name, conditions))
