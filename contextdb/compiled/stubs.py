"""Facts and outputs of compiled tables as Python types, so that an editor completes names and values and a type checker knows them.

For each table a TypedDict of the facts that it asks for, those of `stub_contexts` and `stub_tables`, and where it has outputs one
of those of a row; for each condition and output with declared values a Literal of them. The text is a module that imports typing,
numpy and contextdb.
Nothing here touches the disk.
"""

from __future__ import annotations

import keyword
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from unicodedata import normalize

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.outputs import Output
from contextdb.cells.words import format_number
from contextdb.compiled.core_table import values_of
from contextdb.compiled.stub_tables import NUMBERS, accepted, contexts_of, matches_of, roles_of, table_of
from contextdb.compiled.table import CompiledTable
from contextdb.errors import safe_text

_HEAD = '''"""The facts that each table asks for, as types. Written by `contextdb compile --stubs`: do not edit."""

# mypy: disable-error-code="override, no-overload-impl"
# pyright: reportIncompatibleMethodOverride=false, reportIncompatibleVariableOverride=false, reportNoOverloadImplementation=false

from __future__ import annotations

{imports}from collections.abc import Iterator, KeysView, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NotRequired, Protocol, TypeAlias, TypedDict, cast, overload

import contextdb as cdb
import numpy as np
from numpy.typing import NDArray
{numbers}'''
_TAKEN = (
    "Any AnyNumber AnyWhole Iterator KeysView Literal Mapping NDArray NotRequired Protocol Sequence TYPE_CHECKING TypeAlias"
    " TypedDict annotations cached_property cast cdb datetime np overload"
)


def stubs_of(tables: Mapping[str, CompiledTable]) -> str:
    """The text of a Python module with the types of all tables; the same tables give the same text."""
    names = Names()
    literals: dict[Condition, str] = {}
    parts = []
    for table in tables.values():
        for condition in table.asked.values():
            if condition.domain.values and condition not in literals:
                literals[condition] = names.of(condition.name)
                parts.append(_listed(literals[condition], condition.name, values_of(condition)))
        parts += _of_table(names, table, literals)
    modules = {c.domain.type.annotation.rpartition(".")[0] for table in tables.values() for c in table.asked.values()}
    imports = "".join(f"import {module}\n" for module in sorted(modules - {""}))
    return _HEAD.format(imports=imports, numbers=NUMBERS) + "".join(f"\n{part}" for part in parts)


def _of_table(names: Names, table: CompiledTable, literals: Mapping[Condition, str]) -> Iterator[str]:
    """All types of a table."""
    type_of = cache(lambda what: names.of(f"{table.name} {what}"))
    yield _facts(type_of("facts"), table, literals)
    roles, outputs = roles_of(table.asked), table.outputs.declared
    matches = matches_of(type_of, bool(roles or outputs))
    yield from contexts_of(table.name, {c.name: _type(c, literals.get(c)) for c in table.asked.values()}, type_of, matches)
    if outputs:
        yield _outputs(names, type_of("outputs"), table)
    yield from table_of(table.name, type_of, roles, outputs, bool(table.asked))


@dataclass
class Names:
    """Names of types: each is given once."""

    taken: set[str] = field(default_factory=lambda: set(_TAKEN.split()))

    def of(self, text: str) -> str:
        """A name of Python like the text: "Defender.DepthChart" gives DefenderDepthChart."""
        name = "".join(word[:1].upper() + word[1:] for word in re.split(r"[\W_]+", normalize("NFKC", text)))
        if not name.isidentifier() or keyword.iskeyword(name):
            name = f"T{name}" if f"T{name}".isidentifier() else "T"
        number, unique = 2, name
        while unique in self.taken:
            number, unique = number + 1, f"{name}_{number}"
        self.taken.add(unique)
        return unique


def _listed(name: str, of: str, values: Iterable[str]) -> str:
    listed = "".join(f"    {value!r},\n" for value in values)
    return f"# {safe_text(of, 200)}\n{name}: TypeAlias = Literal[\n{listed}]\n"


def _facts(name: str, table: CompiledTable, literals: Mapping[Condition, str]) -> str:
    lines = [f"        {c.name!r}: {_type(c, literals.get(c))},{_comment(c)}\n" for c in table.asked.values()]
    return _typed_dict(name, table, lines)


def _outputs(names: Names, name: str, table: CompiledTable) -> str:
    """The outputs of a row, as `compiled.outputs.of_row` gives them, with a Literal for the values of each enum."""
    types, literals = dict[str, str](), ""
    for output in table.outputs.declared:
        if output.type.has_values:
            types[output.name] = names.of(f"{table.name} {output.name}")
            values = (*output.values, *(("",) if output.needs_cell else ()))  # "" where no table of a row's way has it
            literals += _listed(types[output.name], output.name, values) + "\n"
        else:
            types[output.name] = output.type.annotation.format(", ".join(["float"] * output.size))
    lines = [f"        {o.name!r}: {types[o.name]},{_output_comment(o)}\n" for o in table.outputs.declared]
    return literals + _typed_dict(name, table, lines)


def _typed_dict(name: str, table: CompiledTable, lines: Sequence[str]) -> str:
    fields = "{\n" + "".join(lines) + "    }" if lines else "{}"
    return f"# table {safe_text(table.name, 200)}\n{name} = TypedDict(\n    {name!r},\n    {fields},\n)\n"


def _output_comment(output: Output) -> str:
    bounds = [format_number(bound) if math.isfinite(bound) else "" for bound in (output.minimum, output.maximum)]
    return _comment_of("..".join(bounds) if any(bounds) else "", output.unit, output.description)


def _type(condition: Condition, literal: str | None) -> str:
    if condition.domain.type.is_tags:
        tag = literal or "str"
        return f"set[{tag}] | frozenset[{tag}] | list[{tag}] | tuple[{tag}, ...]"
    return accepted(literal or condition.domain.type.annotation)


def _comment(condition: Condition) -> str:
    """Bounds, unit and description, as far as they are declared, on one line."""
    low, high = condition.domain.minimum, condition.domain.maximum
    bounds = f"{_end(low, condition.domain)}..{_end(high, condition.domain)}" if math.isfinite(low) or math.isfinite(high) else ""
    unit = condition.unit or condition.domain.type.unit
    return _comment_of(bounds, unit, condition.description)


def _comment_of(bounds: str, unit: str, description: str) -> str:
    parts = [" ".join(part for part in (bounds, unit) if part), description]
    text = safe_text(": ".join(part for part in parts if part), 200)
    return f"  # {text}" if text else ""


def _end(bound: float, domain: Domain) -> str:
    return domain.type.spelling.write(bound) if math.isfinite(bound) else ""
