"""What contextdb.toml says, as frozen data.

`contextdb.schema.shapes` describes what each key accepts; here stands how keys and sections go together. All is checked before
anything is used, so that every fault of the file is reported at once. `features`, `databases`, `selectors`, `controllers` and
`output` are kept as plain data, for `contextdb.motion` to read. Nothing here reads a file.
"""

from __future__ import annotations

import datetime
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import PurePosixPath
from typing import Any, cast

from contextdb.cells.arguments import require_text
from contextdb.cells.conditions import Condition, Mirror
from contextdb.cells.domains import NUMBER, Domain
from contextdb.cells.kinds import KINDS, Kind, names_where
from contextdb.cells.mirroring import partner_of, sided_pairs, swap_faults, swapped_tag
from contextdb.cells.notebook import one_line
from contextdb.cells.output_types import OutputValue
from contextdb.cells.outputs import Output
from contextdb.cells.sets import covers
from contextdb.columns import TextColumn
from contextdb.disk import TABLE_SUFFIXES
from contextdb.errors import Fault, Place, SchemaError, in_quotes, nearest, plural, shown, some
from contextdb.expressions import Derivation, assumption_faults, derivation_faults, derive
from contextdb.files.file_names import alike, composed
from contextdb.files.toml_text import as_toml, dotted, what
from contextdb.schema import shapes
from contextdb.schema.jobs import JOBS, columns_checked, columns_with_jobs
from contextdb.schema.outputs import declared_outputs, fallback_of, outputs_faults
from contextdb.schema.shapes import KEY_SYNONYMS, SECTIONS, Policy, Shape, wrong_name
from contextdb.schema.toml_lines import Path, key_lines, line_of, read_toml

Found = tuple[Path, Fault]
Section = Mapping[str, Any]

_HEADERS = {name: "[project]" if name == "project" else f"[{name}.NAME]" for name in SECTIONS}
_EACH_ONCE = 'each name in one pair, such as { Left = "Right" }'
KINDS_WITH = {
    **dict.fromkeys(("min", "max"), names_where(lambda kind: kind.is_bounded)),
    "values": names_where(lambda kind: kind.has_values),
    "hysteresis": names_where(lambda kind: kind.is_decimal),
}


@dataclass(frozen=True)
class TableSettings:
    """What `[tables.NAME]` says: the table's file, and which of its columns are not conditions."""

    name: str
    file: str | None = None
    """Below the folder of contextdb.toml; None: NAME.csv or NAME.parquet."""
    asset: str | None = None
    """The column that names the asset; None: the first one."""
    outputs: tuple[str, ...] = ()
    enabled: str | None = None
    priority: str | None = None
    weight: str | None = None
    once: str | None = None
    """The column of rows that each character plays once at most."""
    cooldown_s: str | None = None
    """The column of the seconds for which a row rests after it was picked."""
    cooldown_turns: str | None = None
    """The column of the picks for which a row rests after it was picked."""
    fallback: str | None = None
    policy: Policy = "collect"
    assume: tuple[str, ...] = ()
    when: str | None = None
    """The column of each row's own rule."""
    typed: tuple[Output, ...] = ()
    """What is declared of outputs; one without a say here is a text."""
    fallback_outputs: tuple[tuple[str, OutputValue], ...] = ()
    """Names and values of the outputs that `fallback` gives."""

    @property
    def declared_outputs(self) -> tuple[Output, ...]:
        """The outputs, in the order of `outputs`."""
        typed = {output.name: output for output in self.typed}
        return tuple(typed.get(name) or Output(name) for name in self.outputs)

    def output(self, name: str) -> Output | None:
        """What is declared of an output; None for a column of another kind, or one of which nothing is. Raises nothing."""
        return next((output for output in self.typed if output.name == name), None)

    @property
    def jobs(self) -> list[tuple[str, str]]:
        """Each job with a column that has it, as far as columns are named."""
        return columns_with_jobs(vars(self))

    @property
    def files(self) -> tuple[str, ...]:
        """The files that may hold the table, the most wanted first."""
        names = [self.name + suffix for suffix in TABLE_SUFFIXES] if self.file is None else [self.file]
        return tuple(str(PurePosixPath(name)) for name in names)


def plain_names(settings: TableSettings, columns: Sequence[TextColumn]) -> set[str]:
    """The names of columns that are not conditions."""
    return {*(column.name for column in columns[:1] if not settings.asset), *(name for _, name in settings.jobs)}


def settings_renamed(settings: TableSettings, name_of: Callable[[str], str | None]) -> TableSettings:
    """Settings under other names of the columns; one that is gone, None, has no job."""
    now: dict[str, Any] = {job: name_of(getattr(settings, job) or "") for job in JOBS}
    typed = ((name_of(output.name), output) for output in settings.typed)
    given = ((name_of(name), value) for name, value in settings.fallback_outputs)
    return replace(
        settings,
        **now,
        outputs=tuple(name for name in map(name_of, settings.outputs) if name is not None),
        typed=tuple(replace(output, name=name) for name, output in typed if name is not None),
        fallback_outputs=tuple((name, value) for name, value in given if name is not None),
    )


def with_outputs(settings: TableSettings, names: Iterable[str]) -> TableSettings:
    """Settings with other outputs; what is said of those that stay is kept."""
    outputs = tuple(names)
    typed = tuple(output for output in settings.typed if output.name in outputs)
    given = tuple(output for output in settings.fallback_outputs if output[0] in outputs)
    return replace(settings, outputs=outputs, typed=typed, fallback_outputs=given)


@dataclass(frozen=True, repr=False)
class Schema:
    """All that a contextdb.toml says."""

    name: str = ""
    conditions: Mapping[str, Condition] = field(default_factory=dict)
    tables: Mapping[str, TableSettings] = field(default_factory=dict)
    blueprints: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    features: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    databases: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    selectors: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    controllers: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    output: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    file: str | None = None
    transitions: str = ""
    """How clips that lead from one state to another are named, such as "{from}_to_{to}"; "" where that is not declared."""

    def __repr__(self) -> str:
        told = f"{plural(len(self.conditions), 'condition')}, {plural(len(self.tables), 'table')}"
        return one_line("Schema", self.name, told)

    def __getstate__(self) -> dict[str, object]:
        """What is pickled: not how facts are derived, which is functions."""
        return {key: value for key, value in self.__dict__.items() if key != "_derivation"}

    @cached_property
    def _derivation(self) -> Derivation | None:
        """How the conditions with an `expr` are computed from the others; None where there are none."""
        if not any(condition.expr for condition in self.conditions.values()):
            return None
        return derive(self.conditions)

    @property
    def motion(self) -> dict[str, Mapping[str, object]]:
        """The sections that `MotionConfig.from_dict` reads."""
        return {
            "features": self.features,
            "databases": self.databases,
            "selectors": self.selectors,
            "controllers": self.controllers,
            "output": self.output,
        }

    def settings_for(self, file: str) -> TableSettings:
        """The settings of the table in `file`, a path below the folder; one that is not declared has the file's stem as
        name. Raises ContextError for no text."""
        path = PurePosixPath(composed(require_text(file, "file")))
        declared = (settings for settings in self.tables.values() if str(path) in map(composed, settings.files))
        return next(declared, TableSettings(path.stem))


def derivation_of(schema: Schema, names: Iterable[str]) -> Derivation | None:
    """What is needed to compute those of some conditions that are derived; None where none is.

    Raises
    ------
    SchemaError
        An expression cannot be used. `read_schema` has checked that already; a schema made in Python has not.
    """
    derived = schema._derivation.only(names) if schema._derivation else None
    return derived if derived and derived.steps else None


EMPTY = Schema()
"""A schema that declares nothing."""


def read_schema(text: str, file: str) -> Schema:
    """What the text of a contextdb.toml says; `file` is its name in messages.

    Raises
    ------
    SchemaError
        With every fault: its line, what was found, what is accepted and the nearest mend.
    """
    text = text.removeprefix("\ufeff")
    document = read_toml(text, file)
    found = list(_document_faults(document))
    if not any(path[0] == "conditions" for path, _ in found):
        found += _expressions_of(document)
    if found:
        lines = key_lines(text)
        placed = (fault.at(Place(file, line_of(path, lines))) for path, fault in found)
        raise SchemaError(*sorted(placed, key=lambda fault: fault.place.line or 0))
    return _schema(document, file)


def conditions_from_dict(mapping: Mapping[str, Mapping[str, object]]) -> dict[str, Condition]:
    """Conditions from what `[conditions.NAME]` of contextdb.toml would hold: `{"speed": {"type": "number"}}`.

    What an `expr` says is not looked at: it may name conditions that are elsewhere.

    Raises
    ------
    SchemaError
        With every fault, as from a file but without a line.
    """
    if found := list(_section_faults("conditions", mapping)):
        raise SchemaError(*(fault for _, fault in found))
    return {name: _condition(name, section) for name, section in mapping.items()}


def settings_from_dict(name: str, mapping: Mapping[str, object], conditions: Set[str]) -> TableSettings:
    """Settings of a table from what `[tables.NAME]` of contextdb.toml would hold: `{"priority": "Prio"}`.

    Raises
    ------
    SchemaError
        With every fault, as from a file but without a line; also for a column that is among the declared `conditions`.
    """
    path, part = ("tables", name), {key: list(value) if isinstance(value, tuple) else value for key, value in mapping.items()}
    if found := [*_part_faults(path, part), *_column_faults(path, _fitting("tables", part), conditions)]:
        raise SchemaError(*(fault for _, fault in found))
    return _settings(name, part)


def expression_faults(schema: Schema) -> Iterator[Fault]:
    """What is wrong with the derived facts and assumptions of a schema, as `read_schema` tells it, without lines."""
    assumed = {name: settings.assume for name, settings in schema.tables.items()}
    yield from (fault for _, fault in _expression_faults(schema.conditions, assumed))


# ---- faults, each with the path of the key it is about


def _document_faults(document: Section) -> Iterator[Found]:
    for name, section in document.items():
        if name in SECTIONS:
            yield from _section_faults(name, section)
        else:
            yield (name,), _no_section(name, section)
    yield from _partner_faults(_parts(document, "conditions"))
    conditions = _parts(document, "conditions").keys()
    for name, part in _parts(document, "tables").items():
        yield from _column_faults(("tables", name), _fitting("tables", part), conditions)
    yield from _file_faults(_parts(document, "tables"))
    for name, part in _parts(document, "blueprints").items():
        yield from _blueprint_faults(("blueprints", name), _fitting("blueprints", part), conditions)


def _expressions_of(document: Section) -> Iterator[Found]:
    """What is wrong with derived facts and assumptions, for a document whose conditions are sound."""
    conditions = {name: _condition(name, part) for name, part in _parts(document, "conditions").items()}
    assumed = {name: _fitting("tables", part).get("assume", ()) for name, part in _parts(document, "tables").items()}
    yield from _expression_faults(conditions, assumed)


def _expression_faults(conditions: Mapping[str, Condition], assumed: Mapping[str, Sequence[str]]) -> Iterator[Found]:
    """An assumption may name a column that no condition declares; whether the table has it shows when the table is read."""
    yield from _derivation_faults(conditions)
    for name, assume in assumed.items():
        if assume:
            path = ("tables", name)
            for fault in assumption_faults(assume, conditions):
                if fault.rule != "unknown-fact":
                    yield (*path, "assume"), replace(fault, found=f"{_header(path)} assume {fault.found}")


def _derivation_faults(conditions: Mapping[str, Condition]) -> Iterator[Found]:
    if any(condition.expr for condition in conditions.values()):
        for name, fault in derivation_faults(conditions):
            path = ("conditions", name)
            mend = fault.mend or ("to declare it, in a section [conditions.NAME]" if fault.rule == "unknown-fact" else "")
            yield (*path, "expr"), replace(fault, found=f"{_header(path)} expr {fault.found}", mend=mend, rule="unreadable")


def _no_section(name: str, section: object) -> Fault:
    near = nearest(name, SECTIONS)
    inner = next(iter(section), None) if isinstance(section, dict) and near != "project" else None
    mend = _header((near, inner) if inner else (near,)) if near else ""
    return Fault(f"{in_quotes(name)} is not a section.", ", ".join(_HEADERS.values()), mend)


def _section_faults(name: str, section: object) -> Iterator[Found]:
    if not isinstance(section, Mapping):
        yield (name,), Fault(f"{shown(f'{name} = {as_toml(section)}')}: this is {what(section)}, not a section.", _HEADERS[name])
    elif name == "project":
        yield from _key_faults((name,), section)
    else:
        for key, part in section.items():
            yield from _part_faults((name, key), part)


def _part_faults(path: Path, part: object) -> Iterator[Found]:
    name, key = path
    if wrong := wrong_name(key):
        mend = _header((name, key.strip())) if isinstance(key, str) and key.strip() else ""
        yield path, Fault(f"{_header(path)}: the name cannot be used: {wrong}.", "a name without spaces around it", mend)
    if not isinstance(part, Mapping):
        is_kind = name == "conditions" and isinstance(part, str)
        mend = f"{key} = {{ type = {as_toml(part)} }}" if is_kind else ""
        yield path, Fault(f"[{name}] {_said(key, part)}: this is {what(part)}, not a table.", _HEADERS[name], mend)
    elif SECTIONS[name] is not None:
        yield from _key_faults(path, part)
        if name == "conditions":
            yield from _condition_faults(path, part)
        elif name == "tables":
            for below, fault in outputs_faults(_fitting("tables", part)):
                yield (*path, *below), replace(fault, found=f"{_header(path)} {fault.found}")


def _key_faults(path: Path, part: Section) -> Iterator[Found]:
    shapes = _shapes(path[0])
    for key, value in part.items():
        if key not in shapes:
            yield (*path, key), _no_key(path, key, value)
        elif wrong := shapes[key].wrong(value):
            meant = shapes[key].mend(value)
            mend = "" if meant is None else _said(key, meant)
            yield (*path, key), Fault(f"{_header(path)} {_said(key, value)}: {wrong}.", shapes[key].accepted, mend)


def _no_key(path: Path, key: str, value: object) -> Fault:
    shapes = _shapes(path[0])
    near = _near_key(key, shapes)
    if isinstance(value, Mapping) and len(path) == 2:
        mend = _header((path[0], f"{path[1]}.{key}"))
        return Fault(f"{_header(path)} {_said(key, value)}: this is a table, not a key.", "a name with a dot in quotes", mend)
    return Fault(f"{_header(path)} has no key {in_quotes(str(key))}.", some(shapes, len(shapes)), in_quotes(near) if near else "")


def _condition_faults(path: Path, part: Section) -> Iterator[Found]:
    fitting = _fitting("conditions", part)
    kind = fitting.get("type")
    meant = {_near_key(key, _shapes("conditions")) for key in part}
    if "type" not in meant and not any(isinstance(v, Mapping) for k, v in part.items() if k != "mirror"):
        guess = 'type = "enum"' if "values" in part else 'type = "number"' if {"min", "max"} & part.keys() else ""
        yield path, Fault(f"{_header(path)} has no type.", _shapes("conditions")["type"].accepted, guess)
    if kind in KINDS and KINDS[kind].needs_values and "values" not in meant:
        mend = 'type = "text", whose values are not declared'
        yield path, Fault(f"{_header(path)} is {KINDS[kind].noun} without values.", 'values = ["A", "B"]', mend)
    for key, kinds in KINDS_WITH.items():
        if key in fitting and kind and kind not in kinds:
            yield (*path, key), _no_place(path, key, fitting)
    of = KINDS.get(cast("str", kind), NUMBER.type)
    if of.is_bounded:
        bounds: Section = {key: fitting[key] for key in ("min", "max") if key in fitting}
        unread = {found[-1]: fault for found, fault in _unread_bounds(path, of, bounds)}
        yield from (((*path, key), fault) for key, fault in unread.items())
        if kind in KINDS:
            yield from _bound_faults(path, of, {key: bound for key, bound in bounds.items() if key not in unread})
    if kind in KINDS and KINDS[kind].is_whole and fitting.get("hysteresis", 0) % 1:
        found = f"{_header(path)} {_said('hysteresis', fitting['hysteresis'])}: {KINDS[kind].noun} has only whole neighbours."
        yield (*path, "hysteresis"), Fault(found, "a whole number", _said("hysteresis", math.ceil(fitting["hysteresis"])))
    if kind in KINDS and "mirror" in fitting:
        yield from _mirror_faults(path, fitting)


def _no_place(path: Path, key: str, fitting: Section) -> Fault:
    found = f"{_header(path)} {_said(key, fitting[key])} has no place here: {KINDS[fitting['type']].unbounded}."
    accepted = f"{key} in a condition of type {' or '.join(KINDS_WITH[key])}"
    return Fault(found, accepted, 'type = "enum"' if key == "values" else "to leave it out")


def _unread_bounds(path: Path, kind: Kind, bounds: Section) -> Iterator[Found]:
    """Bounds that are no numbers as the type writes them."""
    for key, bound in bounds.items():
        said = f"{_header(path)} {_said(key, bound)}"
        if kind.is_spelt != isinstance(bound, (str, datetime.date)):
            meant = shapes.NUMBER.mend(bound) if kind.is_decimal else None
            mend = "" if meant is None else _said(key, meant)
            yield (*path, key), Fault(f"{said}: this is {what(bound)}, not {kind.value}.", kind.bound, mend)
        elif kind.is_spelt:
            try:
                number_of(kind, bound)
            except ValueError as error:
                yield (*path, key), Fault(f"{said}: {error}.", kind.bound)


def number_of(kind: Kind, bound: Any) -> float:
    """A bound of contextdb.toml as a number.

    Raises
    ------
    ValueError
        It is not written as the type writes its numbers.
    """
    if kind.is_decimal:
        return float(bound) + 0.0
    if not re.fullmatch(kind.spelling.number, str(bound)):
        raise ValueError(f"this is not {kind.value}")
    return kind.spelling.read(str(bound))


def _bound_faults(path: Path, kind: Kind, bounds: Section) -> Iterator[Found]:
    ends = {key: number_of(kind, bound) for key, bound in bounds.items()}
    low, high = ends.get("min", -math.inf), ends.get("max", math.inf)
    if low > high:
        found = f"{_header(path)} {_said('min', bounds['min'])} is above {_said('max', bounds['max'])}."
        mend = f"{_said('min', bounds['max'])} and {_said('max', bounds['min'])}"
        yield (*path, "min"), Fault(found, "a min that is not above max", mend)
    for key, bound, is_no_end, nearer in (("min", low, low == math.inf, math.ceil), ("max", high, high == -math.inf, math.floor)):
        said = f"{_header(path)} {_said(key, bounds.get(key, bound))}"
        if is_no_end:
            yield (*path, key), Fault(f"{said} leaves no number.", "a finite number", "to leave it out")
        elif kind.is_whole and math.isfinite(bound) and bound != math.floor(bound):
            yield (*path, key), Fault(f"{said}: {kind.noun} has whole bounds.", "a whole number", _said(key, nearer(bound)))


def _mirror_faults(path: Path, fitting: Section) -> Iterator[Found]:
    """Why the facts of a condition cannot change in a mirror as it says."""
    kind, mirror, values = KINDS[fitting["type"]], fitting["mirror"], fitting.get("values")
    said, key = f"{_header(path)} {_said('mirror', mirror)}", (*path, "mirror")
    if mirror == "none":
        return
    if "expr" in fitting:
        found = f"{said} has no place here: a derived fact is computed from mirrored facts."
        yield key, Fault(found, "mirror in the conditions that it is computed from", "to leave it out")
    elif mirror == "negate" and not kind.is_negated:
        mend = _said("mirror", sided_pairs(values or ()) or {"Left": "Right"})
        yield key, Fault(f"{said}: a condition of type {kind.name} has no sign.", 'names that change places, or "none"', mend)
    elif mirror != "negate":
        yield from (
            (key, Fault(f"{said}: {in_quotes(name)}: {why}.", _EACH_ONCE)) for name, why in swap_faults(mirror, kind.is_tags)
        )
        yield from (
            (key, replace(fault, found=f"{said}: {fault.found}")) for fault in _unknown_partners(mirror, kind.is_tags, values)
        )


def _partner_faults(conditions: Mapping[str, Section]) -> Iterator[Found]:
    """Of conditions without names that change places by their own names: those whose partner is not one of the same kind."""
    fitting = {name: _fitting("conditions", part) for name, part in conditions.items()}
    partners: dict[str, str | None] = {}
    for name, part in fitting.items():
        is_pair = part.get("type") in KINDS and not KINDS[part["type"]].is_swapped and isinstance(part.get("mirror"), Mapping)
        if is_pair and "expr" not in part:
            partners[name] = partner_of(Condition(name, Domain(part["type"]), mirror=_mirror(part["mirror"])))
    for name, partner in partners.items():
        path = ("conditions", name)
        said = f"{_header(path)} {_said('mirror', fitting[name]['mirror'])}"
        if partner is None:
            accepted = 'a name in that of the condition, as Left is in "LeftFoot.Down"; "negate" or "none"'
            yield (*path, "mirror"), Fault(f"{said}: none of these is in the name {in_quotes(name)}.", accepted)
        elif partners.get(partner) != name or fitting[partner].get("type") != fitting[name].get("type"):
            found = f"{said}: {in_quotes(partner)}, with which it changes places, does not change places with it."
            accepted = f"a condition of type {fitting[name]['type']} with the same mirror"
            mend = f"{_header(('conditions', partner))} with {_said('mirror', fitting[name]['mirror'])}"
            yield (*path, "mirror"), Fault(found, accepted, mend)


def _unknown_partners(mirror: Mapping[str, str], is_tags: bool, values: Sequence[str] | None) -> Iterator[Fault]:
    """Faults of names of pairs that are no declared values, and of tags that would change places with one that is none."""
    if values is None:
        return
    known = frozenset(values)
    names = dict.fromkeys(name for pair in mirror.items() for name in pair)
    unknown = [name for name in names if not (covers(name, known) if is_tags else name in known)]
    for name in unknown:
        near = nearest(name, values)
        yield Fault(f"there is no value {in_quotes(name)}.", some(values), in_quotes(near) if near else "")
    for value in values if is_tags and not unknown else ():
        image = swapped_tag(value, tuple(mirror.items()))
        if not covers(image, known):
            found = f"{in_quotes(value)} is exchanged with {in_quotes(image)}, which is not a declared value."
            yield Fault(found, "values that hold both", f"to add {in_quotes(image)} to the values")


def _column_faults(path: Path, table: Section, conditions: Set[str]) -> Iterator[Found]:
    for key, column, twice in columns_checked(table):
        if twice:
            yield (*path, key), replace(twice, found=f"{_header(path)} {twice.found}")
        if column in conditions:
            found = f"{_header(path)} {key} names {in_quotes(column)}, which is declared as a condition."
            mend = f"to leave out {_header(('conditions', column))}"
            yield (*path, key), Fault(found, "a column that is not a condition", mend)


def _file_faults(tables: Mapping[str, Section]) -> Iterator[Found]:
    wrong_file = _shapes("tables")["file"].wrong
    owners: dict[str, str] = {}
    for name, part in tables.items():
        path, file = ("tables", name), part.get("file")
        wrong = wrong_name(name) or wrong_file(name + TABLE_SUFFIXES[0] if file is None else file)
        if wrong and file is None:
            yield path, Fault(f"{_header(path)} has no file, and its name cannot be that of one: {wrong}.", 'file = "NAME.csv"')
        if wrong:
            continue
        standing = {alike(one) for one in TableSettings(name, file).files}
        if shared := next((one for one in sorted(standing) if one in owners), None):
            found = f"{_header(path)} uses the file {in_quotes(shared)}, as {_header(('tables', owners[shared]))} does."
            yield (*path, "file"), Fault(found, "one file for each table")
        owners |= dict.fromkeys(standing - owners.keys(), name)


def _blueprint_faults(path: Path, blueprint: Section, conditions: Set[str]) -> Iterator[Found]:
    for name in blueprint.get("conditions", ()):
        if name not in conditions:
            near = nearest(name, conditions)
            found = f"{_header(path)} names the condition {in_quotes(name)}, which is not declared."
            yield (*path, "conditions"), Fault(found, some(conditions), in_quotes(near) if near else "")


# ---- words and parts


def _header(path: Path) -> str:
    """A section as the file writes it: [conditions.speed], [conditions."Defender.Tags"]."""
    return shown(f"[{dotted(tuple(map(str, path)))}]")


def _said(key: str, value: object) -> str:
    """A key with its value."""
    return shown(f"{key} = {as_toml(value)}")


def _shapes(section: str) -> Mapping[str, Shape]:
    return SECTIONS[section] or {}


def _near_key(key: str, shapes: Mapping[str, Shape]) -> str | None:
    if key in shapes:
        return key
    synonym = KEY_SYNONYMS.get(str(key).casefold())
    return synonym if synonym in shapes else nearest(str(key), shapes)


def _parts(document: Section, section: str) -> dict[str, Section]:
    """The named tables of a section, as far as they are tables."""
    parts = document.get(section)
    return {name: part for name, part in parts.items() if isinstance(part, Mapping)} if isinstance(parts, Mapping) else {}


def _fitting(section: str, part: Section) -> dict[str, Any]:
    """What of a section can be used."""
    shapes = _shapes(section)
    return {key: value for key, value in part.items() if key in shapes and shapes[key].wrong(value) is None}


# ---- from checked data


def _schema(document: Section, file: str) -> Schema:
    return Schema(
        document.get("project", {}).get("name", ""),
        {name: _condition(name, part) for name, part in _parts(document, "conditions").items()},
        {name: _settings(name, part) for name, part in _parts(document, "tables").items()},
        {name: tuple(part.get("conditions", ())) for name, part in _parts(document, "blueprints").items()},
        _parts(document, "features"),
        _parts(document, "databases"),
        _parts(document, "selectors"),
        _parts(document, "controllers"),
        _parts(document, "output"),
        file,
        document.get("project", {}).get("transitions", ""),
    )


def _condition(name: str, part: Section) -> Condition:
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
        mirror=_mirror(part.get("mirror")),
        weight=float(part.get("weight", 1.0)),
        hysteresis=float(part.get("hysteresis", 0.0)),
    )


def _mirror(said: str | Mapping[str, str] | None) -> Mirror | None:
    return tuple(said.items()) if isinstance(said, Mapping) else cast("Mirror | None", said)


def _settings(name: str, part: Section) -> TableSettings:
    return replace(TableSettings(name), **settings_fields(part))


def settings_fields(part: Section) -> dict[str, Any]:
    """What the keys of a sound `[tables.NAME]` are in a `TableSettings`."""
    found: dict[str, Any] = {key: tuple(value) if isinstance(value, (list, tuple)) else value for key, value in part.items()}
    declared = declared_outputs(part.get("outputs", ()))
    if "outputs" in part:
        found["outputs"], found["typed"] = tuple(o.name for o in declared), tuple(o for o in declared if not o.is_plain)
    if "fallback" in part:
        found["fallback"], found["fallback_outputs"] = fallback_of(part["fallback"], declared)
    return found
