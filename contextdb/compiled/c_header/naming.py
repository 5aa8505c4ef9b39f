"""What everything of a project is called in C. All names are found at once: none hangs on the order of tables or columns."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace

from contextdb.cells.conditions import Condition
from contextdb.cells.outputs import Output
from contextdb.compiled.c_header.spelling import Wanted, distinct, upper
from contextdb.compiled.core_table import values_of
from contextdb.compiled.data import CompiledData
from contextdb.compiled.programs import named_conditions

TABLE_ENDINGS = (
    *("", "_facts", "_condition", "_conditions", "_schema", "_missing", "_given", "_open", "_open_with", "_close"),
    *("_query", "_pick", "_penalties", "_why_not", "_watch", "_watch_file", "_watch_poll", "_watch_release", "_watch_close"),
)


@dataclass(frozen=True)
class Choices:
    """A condition's declared values in C: the type, the array of their names, and an enumerator for each."""

    type: str
    values: tuple[str, ...]
    enumerators: tuple[str, ...]
    missing: str

    @property
    def n_words(self) -> int:
        """Words of a set of tags; bit 0 says that the set is known."""
        return (len(self.values) + 1 + 63) // 64


@dataclass(frozen=True)
class OutputNames:
    """An output in C: what reads it, and its values where it is an enum."""

    name: str
    none: str
    enumerators: tuple[str, ...]


@dataclass(frozen=True)
class TableFace:
    """A table in C: what its names begin with, and the field of each condition."""

    table: str
    base: str
    fields: tuple[str, ...]
    """"" for a derived condition, which no field gives."""
    enumerators: tuple[str, ...]
    n_conditions: str
    """The enumerator behind the last."""
    outputs: tuple[OutputNames, ...]


@dataclass(frozen=True)
class Names:
    """All names of a header."""

    choices: Mapping[Condition, Choices]
    tables: Mapping[str, TableFace]
    guard: str

    @classmethod
    def of(cls, tables: Mapping[str, CompiledData], guard: str, taken: Collection[str]) -> Names:
        """Names for some tables, of which those that are taken are none."""
        declared = list(dict.fromkeys(c for table in tables.values() for c in conditions_of(table) if c.domain.values))
        types = distinct(
            [
                *(Wanted(name, "cdb_", TABLE_ENDINGS, of="table") for name in tables),
                *(Wanted(c.name, "cdb_", _endings(c), of=f"condition {c.domain.values}") for c in declared),
            ],
            taken,
        )
        table_types, choice_types = types[: len(tables)], types[len(tables) :]
        readers = distinct(
            [
                Wanted(output.name, f"{base}_out_", ("", "_value", "_values"), of=base)
                for base, table in zip(table_types, tables.values(), strict=True)
                for output in table.outputs.declared
            ],
            taken,
        )
        of_choices = [(type_, text) for type_, c in zip(choice_types, declared, strict=True) for text in _choice_texts(c)]
        of_facts = [(base, text) for base, table in zip(table_types, tables.values(), strict=True) for text in _facts(table)]
        outputs = [output for table in tables.values() for output in table.outputs.declared]
        given = [(name, text) for name, output in zip(readers, outputs, strict=True) for text in _given(output)]
        owned = [*of_choices, *of_facts, *given]
        wanted = [Wanted(text.removeprefix(_OWN), _head(of), is_upper=True, of=f"{of} {text}") for of, text in owned]
        unique = iter(distinct([*wanted, Wanted(guard.removeprefix("CDB_"), "CDB_", is_upper=True)], taken))
        choices = {c: _choices_of(c, type_, unique) for c, type_ in zip(declared, choice_types, strict=True)}
        faces = [_face_of(name, base, table, unique) for (name, table), base in zip(tables.items(), table_types, strict=True)]
        of_outputs = iter([_output_names(name, output, unique) for name, output in zip(readers, outputs, strict=True)])
        faces = [
            replace(face, outputs=tuple(next(of_outputs) for _ in table.outputs.declared))
            for face, table in zip(faces, tables.values(), strict=True)
        ]
        return cls(choices, {face.table: face for face in faces}, next(unique))


_OWN = "\0"
"""Before what is no name of the project."""


def _head(base: str) -> str:
    """What the enumerators of a type begin with."""
    return f"CDB_{upper(base.removeprefix('cdb_'))}_"


def _choice_texts(condition: Condition) -> list[str]:
    return [*([] if condition.domain.type.is_tags else [f"{_OWN}missing"]), *values_of(condition)]


def _facts(table: CompiledData) -> list[str]:
    return [*(c.name for c in conditions_of(table)), f"{_OWN}conditions"]


def _choices_of(condition: Condition, type_: str, names: Iterator[str]) -> Choices:
    missing = "" if condition.domain.type.is_tags else next(names)
    values = values_of(condition)
    return Choices(type_, values, tuple(next(names) for _ in values), missing)


def _face_of(name: str, base: str, table: CompiledData, names: Iterator[str]) -> TableFace:
    conditions = conditions_of(table)
    given = [c.name for c in conditions if c.expr is None]
    fields = dict(zip(given, distinct([Wanted(text) for text in given]), strict=True))
    enumerators = tuple(next(names) for _ in conditions)
    return TableFace(name, base, tuple(fields.get(c.name, "") for c in conditions), enumerators, next(names), ())


def _given(output: Output) -> list[str]:
    return [f"{_OWN}none", *output.values] if output.values else []


def _output_names(name: str, output: Output, names: Iterator[str]) -> OutputNames:
    none, *enumerators = [next(names) for _ in _given(output)] or [""]
    return OutputNames(name, none, tuple(enumerators))


def _endings(condition: Condition) -> tuple[str, ...]:
    return ("", "_set", "_values", "_none", "_add") if condition.domain.type.is_tags else ("", "_values")


def conditions_of(table: CompiledData) -> tuple[Condition, ...]:
    """The conditions of a table's schema: those of its columns, then the others that its rules and derived facts need."""
    return (*table.conditions, *(c for c in named_conditions(table.derivation, table.when) if c.name not in table.places))
