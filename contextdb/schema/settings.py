"""What contextdb.toml says, as frozen data.

`contextdb.schema.shapes` and `contextdb.schema.table_settings` declare the keys, `contextdb.schema.faults` says what is wrong in a
file. All is checked before anything is used, so that every fault of the file is reported at once. `features`, `databases`,
`selectors`, `controllers` and `output` are kept as plain data, for `contextdb.motion` to read. Nothing here reads a file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any, NamedTuple

from contextdb.cells.arguments import require_text
from contextdb.cells.conditions import Condition
from contextdb.cells.notebook import one_line
from contextdb.columns import TextColumn
from contextdb.errors import Fault, Place, SchemaError, plural
from contextdb.files.file_names import composed
from contextdb.files.settings import settings_of
from contextdb.schema.contracts import Contract, Part, condition_of, fitting_of, parts_of
from contextdb.schema.faults import (
    column_faults,
    document_faults,
    expression_faults_in,
    expression_faults_of,
    part_faults,
    section_faults,
)
from contextdb.schema.outputs import declared_outputs, fallback_of
from contextdb.schema.table_settings import JOBS, TableSettings
from contextdb.schema.toml_lines import key_lines, line_of, read_toml

if TYPE_CHECKING:
    from contextdb.expressions import Derivation

__all__ = ["EMPTY", "Schema", "TableSettings", "read_schema"]


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
    """Settings with other outputs; the types of those that stay are retained."""
    outputs = tuple(names)
    typed = tuple(output for output in settings.typed if output.name in outputs)
    given = tuple(output for output in settings.fallback_outputs if output[0] in outputs)
    return replace(settings, outputs=outputs, typed=typed, fallback_outputs=given)


SHARED_SECTIONS = ("conditions", "blueprints")
"""The sections that a project has of the one that it extends."""


class Studio(NamedTuple):
    """A contextdb.toml that a project extends, as it was read."""

    text: str
    file: str
    studio: Studio | None = None
    """What that one extends."""

    @property
    def files(self) -> tuple[str, ...]:
        """Its file, and those of what it extends."""
        return (self.file, *(self.studio.files if self.studio else ()))


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
    contracts: Mapping[str, Contract] = field(default_factory=dict)
    """What must hold of the tables."""
    studio: Studio | None = None
    """What the project extends."""
    shared: frozenset[tuple[str, str]] = frozenset()
    """The conditions and blueprints that it has from there: ("conditions", "speed")."""

    def __repr__(self) -> str:
        return one_line("Schema", self.name, f"{plural(len(self.conditions), 'condition')}, {plural(len(self.tables), 'table')}")

    def __getstate__(self) -> dict[str, object]:
        """What is pickled: not how facts are derived, which is functions."""
        return {key: value for key, value in self.__dict__.items() if key != "_derivation"}

    @cached_property
    def _derivation(self) -> Derivation | None:
        """How the conditions with an `expr` are computed from the others; None where there are none."""
        if not any(condition.expr for condition in self.conditions.values()):
            return None
        from contextdb.expressions import derive

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
        """The settings of the table in `file`, a path below the folder, with what it inherits; one that is not declared has the
        file's stem as name. Raises ContextError for no text."""
        path = PurePosixPath(composed(require_text(file, "file")))
        declared = (settings for settings in self.tables.values() if str(path) in map(composed, settings.files))
        return resolved(next(declared, TableSettings(path.stem)), self.tables)


def derivation_of(schema: Schema, names: Iterable[str]) -> Derivation | None:
    """What is needed to compute those of some conditions that are derived; None where none is. Raises SchemaError where an
    expression cannot be used. `read_schema` has checked that already; a schema made in Python has not."""
    derived = schema._derivation.only(names) if schema._derivation else None
    return derived if derived and derived.steps else None


EMPTY = Schema()
"""A schema that declares nothing."""


@lru_cache(maxsize=8)
def read_schema(text: str, file: str, studio: Studio | None = None) -> Schema:
    """What the text of a contextdb.toml says, with the conditions and blueprints of the one that it extends; `file` is its name in
    messages. The last few are cached. Raises SchemaError with every fault: its line, what was found, what is accepted and the
    nearest mend."""
    text = text.removeprefix("\ufeff")
    document = read_toml(text, file)
    shared: frozenset[tuple[str, str]] = frozenset()
    if studio is not None:
        read_schema(*studio)  # raises what is wrong there
        document, shared = _extended(document, studio)
    faults = list(document_faults(document))
    if not any(path[0] == "conditions" for path, _ in faults):
        faults += expression_faults_in(document)
    if faults:
        lines = key_lines(text)
        placed = (fault.at(Place(file, line_of(path, lines))) for path, fault in faults)
        raise SchemaError(*sorted(placed, key=lambda fault: fault.place.line or 0))
    return replace(_schema(document, file), studio=studio, shared=shared)


def _extended(document: Part, studio: Studio) -> tuple[dict[str, Any], frozenset[tuple[str, str]]]:
    """A document with the conditions and blueprints of a sound one that it lacks, and which these are."""
    known: Part = read_toml(studio.text.removeprefix("\ufeff"), studio.file)
    if studio.studio is not None:
        known, _ = _extended(known, studio.studio)
    whole, shared = dict(document), set()
    for section in SHARED_SECTIONS:
        own = document.get(section, {})
        if isinstance(own, Mapping):
            more = {name: part for name, part in known.get(section, {}).items() if name not in own}
            whole |= {section: {**more, **own}} if more else {}
            shared |= {(section, name) for name in more}
    return whole, frozenset(shared)


def extends_of(text: str, file: str) -> str | None:
    """The path that a text of contextdb.toml extends; None where it says none that can be used."""
    if "extends" not in text:
        return None
    try:
        document = read_toml(text.removeprefix("\ufeff"), file)
    except SchemaError:  # reported when it is read
        return None
    project = document.get("project")
    extends = fitting_of("project", project).get("extends") if isinstance(project, Mapping) else None
    return None if extends is None else str(extends)


def conditions_from_dict(mapping: Mapping[str, Mapping[str, object]]) -> dict[str, Condition]:
    """Conditions from what `[conditions.NAME]` of contextdb.toml would hold: `{"speed": {"type": "number"}}`.

    What an `expr` says is not looked at: it may name conditions that are elsewhere. Raises SchemaError with every fault, as from a
    file but without a line.
    """
    if faults := list(section_faults("conditions", mapping)):
        raise SchemaError(*(fault for _, fault in faults))
    return {name: condition_of(name, section) for name, section in mapping.items()}


def settings_from_dict(name: str, mapping: Mapping[str, object], conditions: Set[str]) -> TableSettings:
    """Settings of a table from what `[tables.NAME]` of contextdb.toml would hold: `{"priority": "Prio"}`. Raises SchemaError with
    every fault, as from a file but without a line; also for a column that is among the declared `conditions`."""
    path, part = ("tables", name), {key: list(value) if isinstance(value, tuple) else value for key, value in mapping.items()}
    if faults := [*part_faults(path, part), *column_faults(path, fitting_of("tables", part), conditions)]:
        raise SchemaError(*(fault for _, fault in faults))
    return _settings(name, part)


def expression_faults(schema: Schema) -> Iterator[Fault]:
    """What is wrong with the derived facts and assumptions of a schema, as `read_schema` tells it, without lines."""
    assumed = {name: settings.assume for name, settings in schema.tables.items()}
    yield from (fault for _, fault in expression_faults_of(schema.conditions, assumed))


# ---- from checked data


def _schema(document: Part, file: str) -> Schema:
    return Schema(
        document.get("project", {}).get("name", ""),
        {name: condition_of(name, part) for name, part in parts_of(document, "conditions").items()},
        {name: _settings(name, part) for name, part in parts_of(document, "tables").items()},
        {name: tuple(part.get("conditions", ())) for name, part in parts_of(document, "blueprints").items()},
        parts_of(document, "features"),
        parts_of(document, "databases"),
        parts_of(document, "selectors"),
        parts_of(document, "controllers"),
        parts_of(document, "output"),
        file,
        document.get("project", {}).get("transitions", ""),
        {name: Contract(name, **part) for name, part in parts_of(document, "contracts").items()},
    )


def _settings(name: str, part: Part) -> TableSettings:
    return replace(TableSettings(name), **settings_fields(part))


def settings_fields(part: Part) -> dict[str, Any]:
    """What the keys of a sound `[tables.NAME]` are in a `TableSettings`."""
    fields: dict[str, Any] = {key: tuple(value) if isinstance(value, (list, tuple)) else value for key, value in part.items()}
    declared = declared_outputs(part.get("outputs", ()))
    if "outputs" in part:
        fields["outputs"], fields["typed"] = tuple(o.name for o in declared), tuple(o for o in declared if not o.is_plain)
    if "fallback" in part:
        fields["fallback"], fields["fallback_outputs"] = fallback_of(part["fallback"], declared)
    return fields


# ---- the settings of a variant: those of its base where it says nothing itself, and back


OWN = ("file", "base", "remove", "expected", "owner")
"""The settings that a variant does not inherit."""
INHERITED = tuple(key for key in settings_of(TableSettings) if key not in (*OWN, "outputs", "fallback"))
_PLAIN = TableSettings("")


def with_inherited(own: TableSettings, base: TableSettings) -> TableSettings:
    """The settings of a variant of a table with other settings; it has the outputs of both."""
    given: dict[str, Any] = {key: _first(getattr(own, key), getattr(base, key), getattr(_PLAIN, key)) for key in INHERITED}
    typed = {output.name: output for output in (*base.typed, *own.typed)}
    fallback = own if own.fallback is not None else base
    return replace(
        own,
        **given,
        outputs=tuple(dict.fromkeys((*base.outputs, *own.outputs))),
        typed=tuple(typed.values()),
        fallback=fallback.fallback,
        fallback_outputs=fallback.fallback_outputs,
    )


def without_inherited(settings: TableSettings, base: TableSettings) -> TableSettings:
    """What a variant itself says, of its settings and those of its base."""
    own: dict[str, Any] = {key: getattr(_PLAIN, key) for key in INHERITED if getattr(settings, key) == getattr(base, key)}
    outputs = tuple(name for name in settings.outputs if name not in base.outputs)
    typed = tuple(output for output in settings.typed if output not in base.typed)
    if (settings.fallback, settings.fallback_outputs) == (base.fallback, base.fallback_outputs):
        own |= {"fallback": None, "fallback_outputs": ()}
    return replace(settings, **own, outputs=outputs, typed=typed)


def resolved(settings: TableSettings, tables: Mapping[str, TableSettings]) -> TableSettings:
    """The settings of a table with what it inherits; `tables` are those that are declared. A cycle of bases is cut."""
    chain = [settings]
    while (base := chain[-1].base) is not None and base in tables and all(base != one.name for one in chain):
        chain.append(tables[base])
    whole = chain.pop()
    while chain:
        whole = with_inherited(chain.pop(), whole)
    return whole


def _first(own: object, base: object, nothing: object) -> object:
    return base if own == nothing else own
