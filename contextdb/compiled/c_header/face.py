"""The part of the header that is about single tables: for each a struct of facts, and functions that open and ask it.

A condition that several tables share has one enum. The schema of a table has the conditions of its columns, then those that its
rules and derived facts need. The game gives all but the derived ones, which are computed by the programs of the artefact.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from textwrap import wrap

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.kinds import Kind
from contextdb.compiled.c_header.naming import Choices, Names, TableFace, comment, conditions_of, literal
from contextdb.compiled.c_header.watching import WATCH
from contextdb.compiled.data import CompiledData
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.core import header_text

READER = 6
"""Raised when the core changes: headers with different readers do not go into one file."""

_HEAD = """/* Written by `contextdb compile --c-header`: do not edit. */

#ifdef CDB_READER
#if CDB_READER != {version}
#error "two headers of different versions of contextdb in one file: compile the older one again"
#endif
#else
#define CDB_READER {version}

{reader}
#endif /* CDB_READER */

#ifndef {guard}
#define {guard}

#ifdef __cplusplus
extern "C" {{
#endif
"""
_FOOT = """
#ifdef __cplusplus
}}
#endif

#endif /* {guard} */
"""


@dataclass(frozen=True)
class Plain:
    """How a fact that is no choice of declared values is kept in C: its type, the value of a missing one, and its member."""

    type: str
    missing: str
    member: str


_TRUTH = Plain("int", "CDB_MISSING", "whole")
_WHOLE = Plain("int64_t", "CDB_MISSING_INT", "whole")
_NUMBER = Plain("double", "cdb_missing_number()", "number")
_TEXT = Plain("const char *", "NULL", "text")


def plain_of(kind: Kind) -> Plain:
    """How facts of a type are kept in C, where they are no tags and have no declared values."""
    if kind.is_numeric:
        return _WHOLE if kind.is_whole else _NUMBER
    return _TRUTH if kind.is_truth else _TEXT


def c_header_of(tables: Mapping[str, CompiledTable], guard: str = "CDB_TABLES_H") -> str:
    """The text of the header, ASCII with line feeds; the same tables give the same text. Raises ContextDBError where a name cannot
    be a text of C."""
    inside = {name: data_of(table) for name, table in tables.items()}
    names = Names.of(inside, guard, reader_names())
    written: set[Condition] = set()
    parts = []
    for name, table in inside.items():
        for condition in conditions_of(table):
            if condition in names.choices and condition not in written:
                written.add(condition)
                parts.append("\n" + "".join(f"{line}\n" for line in _choices(condition, names.choices[condition])))
        parts.append("\n" + "".join(f"{line}\n" for line in _table(table, names.tables[name], names.choices)))
    head = _HEAD.format(version=READER, reader=header_text(), guard=names.guard)
    return "".join([head, *parts, _FOOT.format(guard=names.guard)])


def reader_names() -> frozenset[str]:
    """The names that the reader has, which no project can have."""
    return frozenset(re.findall(r"\b(?:cdb|CDB)\w*", header_text()))


# ---- what is written


def _choices(condition: Condition, choices: Choices) -> Iterator[str]:
    is_tags = condition.domain.type.is_tags
    first = 1 if is_tags else 0
    yield comment(f"---- {condition.domain.kind} {condition.name}")
    yield f"typedef enum {choices.type} {{"
    lines = [] if is_tags else [f"    {choices.missing} = CDB_MISSING"]
    lines += [f"    {name} = {number}" for number, name in enumerate(choices.enumerators, first)]
    labels = ([] if is_tags else ["not known"]) + list(choices.values)
    width = max(map(len, lines)) + 2
    for number, (line, value) in enumerate(zip(lines, labels, strict=True), 1):
        yield f"{line + (',' if number < len(lines) else ''):<{width}}{comment(value)}"
    yield f"}} {choices.type};"
    yield ""
    yield f"static const char *const {choices.type}_values[] = {{"
    listed = ([""] if is_tags else []) + list(choices.values)
    yield ",\n".join(f"    {literal(value)}" for value in listed)
    yield "};"
    if is_tags:
        yield from _tag_set(choices)


def _tag_set(choices: Choices) -> Iterator[str]:
    name = choices.type
    yield ""
    yield f"typedef struct {name}_set {{ uint64_t words[{choices.n_words}]; }} {name}_set; /* all 0: not known */"
    yield ""
    yield "/* The set without tags, to put some into. */"
    yield f"static inline {name}_set {name}_none(void)"
    yield "{"
    yield f"    {name}_set tags;"
    yield "    memset(&tags, 0, sizeof tags);"
    yield "    tags.words[0] = 1;"
    yield "    return tags;"
    yield "}"
    yield ""
    yield f"static inline void {name}_add({name}_set *tags, {name} tag)"
    yield "{"
    yield "    cdb_add_tag(tags->words, (size_t)tag);"
    yield "}"


def _table(table: CompiledData, face: TableFace, choices: Mapping[Condition, Choices]) -> Iterator[str]:
    yield comment(f"---- table {face.table}")
    yield ""
    yield from _facts_struct(table, face, choices)
    yield from _conditions_enum(table, face)
    yield from output_enums(table, face)
    yield from _schema(table, face, choices)
    yield from _missing_facts(table, face, choices)
    yield from _functions(table, face, choices)


def _facts_struct(table: CompiledData, face: TableFace, choices: Mapping[Condition, Choices]) -> Iterator[str]:
    yield f"typedef struct {face.base}_facts {{"
    lines = []
    for condition, name in given_conditions(table, face):
        kind = _type(condition, choices.get(condition))
        lines.append((f"    {kind}{'' if kind.endswith('*') else ' '}{name};", condition))
    width = max((len(line) for line, _ in lines), default=0) + 2
    yield from (f"{line:<{min(width, 60)}}{_comment_of(condition)}" for line, condition in lines)
    if not lines:
        yield "    char nothing; /* the table needs no facts */"
    yield f"}} {face.base}_facts;"
    yield ""


def given_conditions(table: CompiledData, face: TableFace) -> list[tuple[Condition, str]]:
    """The conditions whose facts the game gives, and their fields."""
    return [(c, name) for c, name in zip(conditions_of(table), face.fields, strict=True) if name]


def _type(condition: Condition, choices: Choices | None) -> str:
    if condition.domain.type.is_tags:
        return f"{choices.type}_set" if choices else "cdb_texts"
    return choices.type if choices else plain_of(condition.domain.type).type


def _comment_of(condition: Condition) -> str:
    domain = condition.domain
    low, high = domain.minimum, domain.maximum
    bounds = f"{_end(low, domain)}..{_end(high, domain)}" if math.isfinite(low) or math.isfinite(high) else ""
    unit = condition.unit or domain.type.unit
    head = " ".join(part for part in (domain.kind, condition.name, bounds, unit) if part)
    return comment("; ".join(part for part in (head, condition.description) if part))


def _end(bound: float, domain: Domain) -> str:
    return domain.type.spelling.write(bound) if math.isfinite(bound) else ""


def _conditions_enum(table: CompiledData, face: TableFace) -> Iterator[str]:
    """The conditions by number, as a fault names them."""
    yield f"typedef enum {face.base}_condition {{"
    yield from (f"    {name} = {number}," for number, name in enumerate(face.enumerators))
    yield f"    {face.n_conditions} = {len(face.enumerators)}"
    yield f"}} {face.base}_condition;"
    yield ""


def _schema(table: CompiledData, face: TableFace, choices: Mapping[Condition, Choices]) -> Iterator[str]:
    yield f"static inline const cdb_schema *{face.base}_schema(void)"
    yield "{"
    if conditions_of(table):
        yield "    static const cdb_condition conditions[] = {"
        for number, condition in enumerate(conditions_of(table), 1):
            values = choices.get(condition)
            n_values = 0 if values is None else len(values.values) + (condition.domain.type.is_tags)
            expr = literal(condition.expr) if condition.expr else "NULL"
            listed = f"{values.type}_values" if values else "NULL"
            ending = "," if number < len(conditions_of(table)) else ""
            kind = f"CDB_{condition.domain.kind.upper()}"
            yield f"        {{{literal(condition.name)}, {kind}, {expr}, {listed}, {n_values}}}{ending}"
        yield "    };"
    if face.outputs:
        yield from outputs_wanted(table, face)
    conditions = conditions_of(table)
    first = f"{'conditions' if conditions else 'NULL'}, {len(conditions)}"
    second = f"{'outputs' if face.outputs else 'NULL'}, {len(face.outputs)}"
    yield f"    static const cdb_schema schema = {{{first}, {second}}};"
    yield "    return &schema;"
    yield "}"
    yield ""


def _missing_facts(table: CompiledData, face: TableFace, choices: Mapping[Condition, Choices]) -> Iterator[str]:
    yield "/* Facts of which none is known yet. */"
    yield f"static inline {face.base}_facts {face.base}_missing(void)"
    yield "{"
    yield f"    {face.base}_facts facts;"
    yield "    memset(&facts, 0, sizeof facts);"
    for condition, name in given_conditions(table, face):
        kind, declared = condition.domain.type, choices.get(condition)
        if not kind.is_tags:
            yield f"    facts.{name} = {declared.missing if declared else plain_of(kind).missing};"
        elif not declared:
            yield f"    facts.{name}.count = CDB_MISSING;"
    yield "    return facts;"
    yield "}"
    yield ""


def _functions(table: CompiledData, face: TableFace, choices: Mapping[Condition, Choices]) -> Iterator[str]:
    base, n = face.base, max(len(conditions_of(table)), 1)
    yield f"typedef struct {base} {{"
    yield "    cdb_table table;"
    yield f"    cdb_column columns[{n}];"
    yield f"}} {base};"
    yield ""
    yield from _facts_in_order(table, face, choices)
    for name, arguments, comment_text, body in _FUNCTIONS:
        yield f"/* {comment_text} */"
        head = f"static inline {'void' if name == 'close' else 'cdb_status'} {base}_{name}({arguments.format(base=base)})"
        yield from (line.rstrip() for line in wrap(head, 126, subsequent_indent="    ", break_long_words=False))
        yield "{"
        yield from (f"    {line}".format(base=base, n=n) for line in body)
        yield "}"
        yield ""
    yield from output_functions(table, face)
    yield from WATCH.replace("BASE", face.base).splitlines()


_ASKED = "const {base} *opened, const {base}_facts *facts, cdb_unknown unknown"
_GIVEN = ("cdb_fact given[{n}];", "{base}_given(facts, given);")
_TABLE = "&opened->table, opened->columns, {base}_schema()"
_FUNCTIONS: tuple[tuple[str, str, str, tuple[str, ...]], ...] = (
    (
        "open",
        "{base} *opened, const void *bytes, size_t size, cdb_fault *fault",
        "Open an artefact from memory that stays where it is until it is closed: see cdb_open.",
        (f"return cdb_open({_TABLE}, bytes, size, CDB_STRANGE_REFUSED, fault);",),
    ),
    (
        "open_with",
        "{base} *opened, const void *bytes, size_t size, cdb_strange strange, cdb_fault *fault",
        "The same; `strange` says what a condition does that this header does not know.",
        (f"return cdb_open({_TABLE}, bytes, size, strange, fault);",),
    ),
    ("close", "{base} *opened", "Give back what opening took.", ("cdb_close(&opened->table);",)),
    (
        "query",
        f"{_ASKED}, uint64_t *rows, size_t room, cdb_fault *fault",
        "The valid rows, one bit a row, in `rows` of `room` words: see cdb_query.",
        (*_GIVEN, f"return cdb_query({_TABLE}, given, unknown, rows, room, fault);"),
    ),
    (
        "query_widened",
        f"{_ASKED}, uint64_t *rows, size_t room, cdb_fault *fault",
        "Those that stay valid where they play already: see cdb_query_widened.",
        (*_GIVEN, f"return cdb_query_widened({_TABLE}, given, unknown, rows, room, fault);"),
    ),
    (
        "pick",
        f"{_ASKED}, const uint64_t *rows, size_t room, double time_s, cdb_picker *picker, int64_t *row, cdb_fault *fault",
        "One of the valid rows, by the table's policy: see cdb_pick.",
        (*_GIVEN, f"return cdb_pick({_TABLE}, given, unknown, rows, room, time_s, picker, row, fault);"),
    ),
    (
        "penalties",
        f"{_ASKED}, double *penalties, size_t room, cdb_fault *fault",
        "What each row's soft cells cost: see cdb_penalties.",
        (*_GIVEN, f"return cdb_penalties({_TABLE}, given, unknown, penalties, room, fault);"),
    ),
    (
        "why_not",
        f"{_ASKED}, int64_t row, int *reasons, size_t room, size_t *n, cdb_fault *fault",
        "Why a row is not valid: see cdb_why_not.",
        (*_GIVEN, f"return cdb_why_not({_TABLE}, given, unknown, row, reasons, room, n, fault);"),
    ),
)
"""The functions of a table: name, arguments, comment and lines."""


def _facts_in_order(table: CompiledData, face: TableFace, choices: Mapping[Condition, Choices]) -> Iterator[str]:
    """The function that brings the fields of the struct into the order of the schema."""
    yield f"static inline void {face.base}_given(const {face.base}_facts *facts, cdb_fact *given)"
    yield "{"
    if not all(face.fields) or not face.fields:
        yield f"    memset(given, 0, {max(len(face.fields), 1)} * sizeof *given);"
    if not any(face.fields):
        yield "    (void)facts;"
    for number, (condition, name) in enumerate(zip(conditions_of(table), face.fields, strict=True)):
        if name:
            yield f"    {_given(number, name, condition, choices.get(condition))}"
    yield "}"
    yield ""


def _given(number: int, name: str, condition: Condition, declared: Choices | None) -> str:
    if condition.domain.type.is_tags:
        member, of = ("tags", f"{name}.words") if declared else ("texts", name)
        return f"given[{number}].{member} = facts->{of};"
    member = "whole" if declared else plain_of(condition.domain.type).member
    return f"given[{number}].{member} = facts->{name};"


# ---- outputs: enums of their values, and functions that read them by row


def output_enums(table: CompiledData, face: TableFace) -> Iterator[str]:
    """An enum, and the texts of its values, for each output of that type."""
    for output, names in zip(table.outputs.declared, face.outputs, strict=True):
        if not names.enumerators:
            continue
        yield f"typedef enum {names.name}_value {{"
        lines = [f"    {names.none} = CDB_MISSING", *(f"    {name} = {n}" for n, name in enumerate(names.enumerators))]
        yield ",\n".join(lines)
        yield f"}} {names.name}_value;"
        yield ""
        yield f"static const char *const {names.name}_values[] = {{"
        yield ",\n".join(f"    {literal(value)}" for value in output.values)
        yield "};"
        yield ""


def outputs_wanted(table: CompiledData, face: TableFace) -> Iterator[str]:
    """The list of outputs that the header reads, for the schema."""
    yield "    static const cdb_output_wanted outputs[] = {"
    for number, (output, names) in enumerate(zip(table.outputs.declared, face.outputs, strict=True), 1):
        listed, n_values = (f"{names.name}_values", len(output.values)) if names.enumerators else ("NULL", 0)
        kind, ending = f"CDB_OUT_{output.kind.upper()}", "," if number < len(face.outputs) else ""
        yield f"        {{{literal(output.name)}, {kind}, {max(output.size, 1)}, {listed}, {n_values}}}{ending}"
    yield "    };"


def output_functions(table: CompiledData, face: TableFace) -> Iterator[str]:
    """A function for each output that reads its value in a row."""
    for number, (output, names) in enumerate(zip(table.outputs.declared, face.outputs, strict=True)):
        kind = output.type.c_type.format(name=names.name)
        size = f"{output.size} numbers" if output.type.has_size else output.kind
        about = "; ".join(part for part in (f"{size} {output.name} {output.unit or ''}".strip(), output.description) if part)
        yield comment(f"{about}; of a row, or of none: -1")
        yield f"static inline {kind}{names.name}(const {face.base} *opened, int64_t row)"
        yield "{"
        cast = f"({names.name}_value)" if names.enumerators else ""
        yield f"    return {cast}cdb_output_{output.kind}(&opened->table, {number}, row);"
        yield "}"
        yield ""
