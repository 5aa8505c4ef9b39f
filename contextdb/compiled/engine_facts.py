"""The facts of tables as types of a game engine: classes for C# and GDScript, structs for Unreal, with names of declared values.

Each sets facts by name in a table that was opened by its own schema (docs/engines.md), so what is written stays right when
conditions are added to the tables; it is to be written again when a condition or a value is renamed. Nothing here
touches the disk. What a language keeps for itself is no name: all begin with a capital letter, or in GDScript with `fact_`.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from contextdb.cells.conditions import Condition
from contextdb.cells.kinds import Kind
from contextdb.compiled.c_header.naming import literal as c_literal
from contextdb.compiled.core_table import values_of
from contextdb.compiled.stubs import Names
from contextdb.compiled.table import CompiledTable
from contextdb.errors import safe_text

WRITTEN = "Written by `contextdb compile`: do not edit."
RESERVED = (
    "Facts",
    "Table",
    "Value",
    "Live",
    "Object",
    "String",
    "Equals",
    "GetType",
    "GetHashCode",
    "ToString",
    "Finalize",
    "SetIn",
)


@dataclass(frozen=True)
class Fact:
    """One condition whose fact a game gives."""

    condition: Condition
    name: str
    """Its name in the engine, with a capital letter."""
    choices: str
    """The name of the type of its values; "" where none are declared, or it is a condition of tags."""

    @property
    def type(self) -> Kind:
        return self.condition.domain.type

    @property
    def text(self) -> str:
        """Its name in the table, as C# and GDScript have it."""
        return literal(self.condition.name)

    @property
    def about(self) -> str:
        condition = self.condition
        texts = (f"{condition.name}, {condition.domain.kind}", condition.unit or "", condition.description or "")
        return safe_text(": ".join(part for part in (" ".join(filter(None, texts[:2])), texts[2]) if part), 110)


@dataclass(frozen=True)
class Face:
    """A table as an engine sees it."""

    table: str
    name: str
    facts: tuple[Fact, ...]


def _ascii(text: str) -> str:
    """A text whose other letters are gaps: not every engine has names with them."""
    return re.sub(r"[^\x00-\x7f]", "_", text)


def literal(text: str) -> str:
    """A text between quotes, as C# and GDScript have it."""
    return json.dumps(text, ensure_ascii=False)


def faces_of(tables: Mapping[str, CompiledTable]) -> tuple[list[Face], dict[str, tuple[tuple[str, str], ...]]]:
    """The tables, and for each type of values their names with what the tables call them."""
    types, named = Names(set(RESERVED)), dict[Condition, str]()
    values: dict[str, tuple[tuple[str, str], ...]] = {}
    faces = []
    for name, table in tables.items():
        own, facts = Names(set(RESERVED)), []
        for condition in table.asked.values():
            if condition.domain.type.needs_values and condition not in named:
                named[condition] = types.of(_ascii(condition.name))
                of_values = Names(set(RESERVED))
                values[named[condition]] = tuple((of_values.of(_ascii(value)), value) for value in values_of(condition))
            facts.append(Fact(condition, own.of(_ascii(condition.name)), named.get(condition, "")))
        faces.append(Face(name, types.of(_ascii(f"{name} facts")), tuple(facts)))
    return faces, values


def _text(lines: Iterable[str]) -> str:
    return "\n".join(lines) + "\n"


# ---- C#


def csharp_of(tables: Mapping[str, CompiledTable]) -> str:
    """A C# file with a class for each table, on `examples/unity/ContextTable.cs`."""
    faces, values = faces_of(tables)
    lines = [f"// {WRITTEN}", "using System;", "using System.Collections.Generic;", "", "namespace ContextDB", "{"]
    for name, named in values.items():
        lines += [
            f"    public enum {name}",
            "    {",
            *(f"        {own}, // {safe_text(value, 80)}" for own, value in named),
            "    }",
            "",
        ]
    for face in faces:
        lines += _csharp_class(face, values)
    return _text([*lines[:-1], "}"])


def _csharp_class(face: Face, values: Mapping[str, tuple[tuple[str, str], ...]]) -> Iterator[str]:
    yield f"    /// <summary>The facts of the table {_xml(face.table)}: set them, then query the table.</summary>"
    yield f"    public sealed class {face.name}"
    yield "    {"
    yield "        readonly ContextFacts table;"
    for fact in face.facts:
        yield f"        readonly int at{fact.name};"
    yield ""
    yield f"        public {face.name}(ContextFacts table)"
    yield "        {"
    yield "            this.table = table;"
    yield from (f"            at{fact.name} = table[{fact.text}];" for fact in face.facts)
    yield "        }"
    for fact in face.facts:
        kind = fact.choices or fact.type.csharp
        value = f"names{fact.name}[(int)value]" if fact.choices else "value"
        value = (
            'value.ToString("yyyy-MM-dd", System.Globalization.CultureInfo.InvariantCulture)'
            if fact.type.csharp == "DateTime"
            else value
        )
        yield ""
        if fact.choices:
            listed = ", ".join(literal(text) for _, text in values[fact.choices])
            yield f"        static readonly string[] names{fact.name} = {{ {listed} }};"
        yield f"        /// <summary>{_xml(fact.about)}</summary>"
        yield f"        public {kind} {fact.name} {{ set {{ table.Set(at{fact.name}, {value}); }} }}"
    yield "    }"
    yield ""


def _xml(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;")


# ---- GDScript


def godot_of(tables: Mapping[str, CompiledTable]) -> str:
    """A file of GDScript with an inner class for each table, on `examples/godot`."""
    faces, values = faces_of(tables)
    lines = [f"# {WRITTEN}", "extends Reference", ""]
    for name, named in values.items():
        lines += [f"const {name} = {{{', '.join(f'{literal(own)}: {literal(value)}' for own, value in named)}}}"]
    for face in faces:
        lines += ["", f"class {face.name}:", f"\t# the table {safe_text(face.table, 100)}; null is not known"]
        lines += [f"\tvar fact_{fact.name} = null # {fact.about}" for fact in face.facts]
        listed = ", ".join(f"{fact.text}: fact_{fact.name}" for fact in face.facts)
        lines += ["", "\tfunc facts():", f"\t\treturn {{{listed}}}"]
    return _text(lines)


# ---- Unreal

_UNREAL_TEXTS = """
#ifndef CDB_UNREAL_TEXTS
#define CDB_UNREAL_TEXTS
/** The texts that the facts of a character point to. */
typedef TArray<TArray<ANSICHAR>> FCdbTexts;

inline const char* CdbKept(FCdbTexts& Texts, const FString& Text)
{
\tconst FTCHARToUTF8 Octets(*Text);
\tTArray<ANSICHAR>& Own = Texts.AddDefaulted_GetRef();
\tOwn.Append(Octets.Get(), Octets.Length());
\tOwn.Add(0);
\treturn Own.GetData();
}

inline const char** CdbKeptList(FCdbTexts& Texts, const TArray<FString>& Names)
{
\tTArray<const char*> Listed;
\tfor (const FString& Name : Names) Listed.Add(CdbKept(Texts, Name));
\tTArray<ANSICHAR>& Own = Texts.AddDefaulted_GetRef();
\tOwn.AddZeroed((Listed.Num() + 1) * static_cast<int32>(sizeof(const char*)));
\tFMemory::Memcpy(Own.GetData(), Listed.GetData(), static_cast<size_t>(Listed.Num()) * sizeof(const char*));
\treturn reinterpret_cast<const char**>(Own.GetData());
}
#endif
"""


def unreal_of(tables: Mapping[str, CompiledTable], stem: str) -> str:
    """A header with a UENUM for each condition of declared values and a USTRUCT for each table, on the header in C."""
    faces, values = faces_of(tables)
    lines = [
        f"// {WRITTEN}",
        "#pragma once",
        "",
        '#include "CoreMinimal.h"',
        '#include "tables.h"',
        f'#include "{stem}.generated.h"',
    ]
    lines += _UNREAL_TEXTS.splitlines()
    for name, named in values.items():
        lines += ["", "UENUM(BlueprintType)", f"enum class E{name} : uint8", "{"]
        lines += [*(f"\t{own} UMETA(DisplayName = {c_literal(value)})," for own, value in named), "};"]
    for face in faces:
        lines += _unreal_struct(face, values)
    return _text(lines)


def _unreal_struct(face: Face, values: Mapping[str, tuple[tuple[str, str], ...]]) -> Iterator[str]:
    yield ""
    yield f"/** The facts of the table {safe_text(face.table, 100)}. */"
    yield "USTRUCT(BlueprintType)"
    yield f"struct F{face.name}"
    yield "{"
    yield "\tGENERATED_BODY()"
    for fact in face.facts:
        kind, value = fact.type.unreal
        if fact.choices:
            kind, value = f"E{fact.choices}", f"E{fact.choices}::{values[fact.choices][0][0]}"
        yield ""
        yield f"\t/** {fact.about.replace('*/', '* /')} */"
        yield "\tUPROPERTY(EditAnywhere, BlueprintReadWrite)"
        yield f"\t{kind} {fact.name}{f' = {value}' if value else ''};"
    yield ""
    yield "\t/** Set them in the facts of a character, whose texts are kept in Texts. False where one is refused. */"
    yield "\tbool SetIn(cdb_live* Live, FCdbTexts& Texts) const"
    yield "\t{"
    yield "\t\tTexts.Reset();"
    yield "\t\tbool bIsSet = true;"
    for fact in face.facts:
        at = f"cdb_condition_number(Live->schema, {c_literal(fact.condition.name)})"
        yield from (f"\t\t{line}" for line in _unreal_setter(fact, at, values))
    yield "\t\treturn bIsSet;"
    yield "\t}"
    yield "};"


def _unreal_setter(fact: Fact, at: str, values: Mapping[str, tuple[tuple[str, str], ...]]) -> Iterator[str]:
    if fact.choices:
        listed = ", ".join(c_literal(value) for _, value in values[fact.choices])
        yield f"static const char* const Names{fact.name}[] = {{{listed}}};"
        yield f"bIsSet &= cdb_set_text(Live, {at}, Names{fact.name}[static_cast<uint8>({fact.name})]) == CDB_OK;"
    elif fact.type.unreal[0] == "FString":
        yield f"bIsSet &= cdb_set_text(Live, {at}, CdbKept(Texts, {fact.name})) == CDB_OK;"
    elif fact.type.is_tags:
        yield f"const char** List{fact.name} = CdbKeptList(Texts, {fact.name});"
        yield f"bIsSet &= cdb_set_tags(Live, {at}, List{fact.name}, static_cast<size_t>({fact.name}.Num())) == CDB_OK;"
    else:
        setter = "cdb_set_number" if fact.type.unreal[0] == "double" else "cdb_set_whole"
        yield f"bIsSet &= {setter}(Live, {at}, {fact.name}) == CDB_OK;"
