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
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from unicodedata import normalize

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.outputs import Output
from contextdb.cells.words import format_number
from contextdb.compiled.casting.roles import role_of
from contextdb.compiled.core_table import values_of
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


# ---- the types of a table that is asked, of its answers and of its picks. For a table "jog" with outputs and the role
# Defender: JogTable `JogTable.open(path)`, or `JogTable.of(table.compile())`: contexts are checked, answers and picks are
# typed JogMatches an answer; the output "damage" of its rows is an array of what is declared, its castings are JogCasting
# JogManyMatches the answers to many contexts JogPicker what `picker()` gives; its picks are JogPick JogPick `outputs` is
# JogOutputs, `casting` JogCasting JogRole a Literal of the roles JogCasting for "Defender" a JogDefenderActor The classes but
# JogTable are for type checkers: when the game runs, answers and picks are those of contextdb. They are written only for
# tables with roles or outputs. That they take less than in contextdb, a Literal for a name, is no error: see the module's
# head. For a table "jog" of the facts "speed" and "Defender.height": JogSomeFacts some of the facts, or None for a missing
# one: for unknown="any" and "never", and for `live.update` JogFact a Literal of their names JogLive a live context, of
# `JogTable.live()`; its names and values are checked JogFactsWithActors "speed", and "Defender.height" only where the game
# gives it itself JogDefenderActor "height", of an actor who is offered as Defender JogActors what `actors=` accepts The last
# three are written for tables with roles alone

TypeOf = Callable[[str], str]
"""The name of a type of the table by what it is, "facts" or "Defender actor"; the same for the same."""

_SOME = 'unknown: Literal["any", "never"]'
_PREFER = "prefer: cdb.Prefer = None"


def table_of(name: str, type_of: TypeOf, roles: Iterable[str], outputs: Iterable[Output], needs_facts: bool) -> Iterator[str]:
    """The types of a table; `needs_facts` where a context without any is no context of it."""
    roles, outputs = list(roles), list(outputs)
    if roles:
        yield from _casting(type_of, roles)
    typed = bool(roles or outputs)
    if typed:
        yield _answers(type_of, roles, outputs)
    yield _table(name, type_of, bool(roles), typed, needs_facts)


def matches_of(type_of: TypeOf, is_typed: bool) -> str:
    """The type of an answer."""
    return type_of("matches") if is_typed else "cdb.Matches"


def _casting(type_of: TypeOf, roles: list[str]) -> Iterator[str]:
    role, actors = type_of("role"), " | ".join(type_of(f"{role} actor") for role in roles)
    yield f"{role}: TypeAlias = Literal[{', '.join(map(repr, roles))}]\n"
    lines = [f"class {type_of('casting')}(Mapping[{role}, {actors}]):", "    if TYPE_CHECKING:"]
    several = [*((repr(own), type_of(f"{own} actor")) for own in roles), (None, actors)]
    for own, actor in several if len(roles) > 1 else ():
        lines += [
            "        @overload",
            f"        def __getitem__(self, role: {f'Literal[{own}]' if own else role}, /) -> {actor}: ...",
        ]
    lines += [f"        def __getitem__(self, role: {role}, /) -> {actors}: ..."] if len(roles) == 1 else []
    yield "\n".join(lines) + "\n"


def _answers(type_of: TypeOf, roles: list[str], outputs: list[Output]) -> str:
    """The answer to one context and to many, a pick, and a picker."""
    matches, many, pick, picker = (type_of(what) for what in ("matches", "many matches", "pick", "picker"))
    casting = type_of("casting") if roles else ""
    arrays = _arrays(outputs)
    lines = [f"class {matches}(cdb.Matches):", "    if TYPE_CHECKING:", *arrays]
    if roles:
        lines.append(f"        def casting(self, row: int) -> {casting}: ...")
        lines.append(f"        def castings(self, row: int) -> Sequence[{casting}]: ...")
    lines += ["", f"class {many}(cdb.ManyMatches):", "    if TYPE_CHECKING:", *arrays]
    lines.append(f"        def __iter__(self) -> Iterator[{matches}]: ...")
    lines += ["", f"class {pick}(cdb.Pick):", "    if TYPE_CHECKING:"]
    narrower = [("outputs", type_of("outputs"))] * bool(outputs) + [("casting", casting)] * bool(roles)
    for attribute, kind in narrower:
        lines += ["        @cached_property", f"        def {attribute}(self) -> {kind}: ..."]
    lines += ["", f"class {picker}(cdb.Picker):", "    if TYPE_CHECKING:"]
    lines.append(f"        def pick(self, matches: cdb.Matches, *, time_s: float | None = None, who: int = 0) -> {pick}: ...")
    return "\n".join(lines) + "\n"


def _arrays(outputs: list[Output]) -> list[str]:
    lines = []
    for output in outputs:
        lines += ["        @overload"] if len(outputs) > 1 else []
        array = f"NDArray[np.{output.type.dtype.__name__}]" if output.type.dtype is not object else "NDArray[np.object_]"
        lines.append(f"        def outputs(self, name: Literal[{output.name!r}]) -> {array}: ...")
    return lines


def _table(name: str, type_of: TypeOf, has_roles: bool, is_typed: bool, needs_facts: bool) -> str:
    own, live = type_of("table"), type_of("live")
    known = [type_of(facts) for facts in ("facts", "some facts", *(["facts with actors"] if has_roles else []))]
    some, any_of_them = " | ".join(known[:2]), " | ".join(known)
    matches = matches_of(type_of, is_typed)
    lines = [f"# table {safe_text(name, 200)}", f"class {own}(cdb.CompiledTable):"]
    lines += ["    @staticmethod", f"    def of(table: cdb.CompiledTable) -> {own}:"]
    lines += [
        '        """The table with these types; nothing is checked when the game runs."""',
        f'        return cast("{own}", table)',
        "",
    ]
    lines.append("    if TYPE_CHECKING:")
    given = f", actors: {type_of('actors')} | None = None, {_PREFER}" if has_roles else ""
    for method, answer in ("query", matches), ("explain", "cdb.Explanation"):
        lines.append("        @overload")
        lines.append(f"        def {method}(self, context: {known[0]}{'' if needs_facts else ' = {}'}) -> {answer}: ...")
        lines += ["        @overload", f"        def {method}(self, context: {some}, *, {_SOME}{given}) -> {answer}: ..."]
        if has_roles:
            cast_to = f'{type_of("facts with actors")}, *, unknown: cdb.Unknown = "error", actors: {type_of("actors")}, {_PREFER}'
            lines += ["        @overload", f"        def {method}(self, context: {cast_to}) -> {answer}: ..."]
    lines.append(
        f'        def live(self, facts: {any_of_them} | None = None, *, unknown: cdb.Unknown = "error"{given}) -> {live}: ...'
    )
    if is_typed:
        many = 'self, contexts: Any, *, unknown: cdb.Unknown = "error", actors: Any = None, prefer: cdb.Prefer = None'
        lines.append(f"        def query_many({many}) -> {type_of('many matches')}: ...")
        lines.append(f"        def picker(self, seed: int = 0, memory: int = 1) -> {type_of('picker')}: ...")
    return "\n".join(lines) + "\n"


# ---- the types of contexts that do not hold every fact: some facts, those next to actors, the actors, and a context that is
# kept


NUMBERS = """
AnyNumber: TypeAlias = float | np.floating[Any] | np.integer[Any] | cdb.FactSet
AnyWhole: TypeAlias = int | np.integer[Any] | cdb.FactSet
"""
WIDER = {"float": "AnyNumber", "int": "AnyWhole", "bool": "bool | np.bool"}
"""What is accepted where the annotation of a type says less. A bool has no set of values besides Any."""
OF_ACTORS = {"id": "NotRequired[object]", "name": "NotRequired[str]"}


def accepted(annotation: str) -> str:
    """The type of a fact that is no set of tags: its values, numpy's too, and but for a bool a set of them."""
    return WIDER.get(annotation) or f"{annotation} | cdb.FactSet"


def contexts_of(table: str, facts: Mapping[str, str], type_of: TypeOf, matches: str) -> Iterator[str]:
    """The types of a table's contexts; `facts` are the types of its facts by name, `matches` that of an answer."""
    some = type_of("some facts")
    yield typed_dict(some, f"table {table}, some facts", {name: f"{kind} | None" for name, kind in facts.items()}, is_total=False)
    roles = roles_of(facts)
    actors = type_of("actors") if roles else ""
    if roles:
        besides = {name: f"NotRequired[{kind}]" if role_of(name) else kind for name, kind in facts.items()}
        yield typed_dict(type_of("facts with actors"), f"table {table}, where actors are given", besides)
        of_role = {role: type_of(f"{role} actor") for role in roles}
        for role, name in of_role.items():
            own = {fact.partition(".")[2]: kind for fact, kind in facts.items() if role_of(fact) == role}
            yield typed_dict(name, f"table {table}, an actor who is offered as {role}", {**OF_ACTORS, **own})
        yield f"{actors}: TypeAlias = Mapping[str, Sequence[{' | '.join(of_role.values())}]]\n"
    yield from _live(table, facts, type_of, actors, matches)


def typed_dict(name: str, comment: str, fields: Mapping[str, str], is_total: bool = True) -> str:
    """A TypedDict with keys that need not be names of Python."""
    lines = "".join(f"        {key!r}: {kind},\n" for key, kind in fields.items())
    total = "" if is_total else "    total=False,\n"
    return f"# {safe_text(comment, 200)}\n{name} = TypedDict(\n    {name!r},\n    {{\n{lines}    }},\n{total})\n"


def roles_of(facts: Mapping[str, object]) -> list[str]:
    """The roles that facts are of."""
    return list(dict.fromkeys(role_of(name) for name in facts if role_of(name)))


def _live(table: str, facts: Mapping[str, str], type_of: TypeOf, actors: str, matches: str) -> Iterator[str]:
    name = type_of("live")
    lines = [f"class {name}(Protocol):"]
    if facts:
        fact = type_of("fact")
        yield f"# table {safe_text(table, 200)}, the names of its facts\n{fact}: TypeAlias = Literal[{_listed_names(facts)}]\n"
        kinds = list(dict.fromkeys(facts.values()))
        for kind in kinds:
            lines += ["    @overload"] if len(kinds) > 1 else []
            named = _listed_names(own for own in facts if facts[own] == kind)
            lines.append(f"    def __setitem__(self, name: Literal[{named}], value: {kind} | None, /) -> None: ...")
        for kind in kinds if len(kinds) > 1 else ():
            named = _listed_names(own for own in facts if facts[own] == kind)
            lines += ["    @overload", f"    def __getitem__(self, name: Literal[{named}], /) -> {kind}: ..."]
        lines += ["    @overload"] if len(kinds) > 1 else []
        lines.append(f"    def __getitem__(self, name: {fact}, /) -> {' | '.join(kinds)}: ...")
        lines.append(f"    def __delitem__(self, name: {fact}, /) -> None: ...")
        lines.append(f"    def __iter__(self) -> Iterator[{fact}]: ...")
        lines.append(f"    def keys(self) -> KeysView[{fact}]: ...")
        lines += ["    def __len__(self) -> int: ...", "    def __contains__(self, name: object, /) -> bool: ..."]
    lines.append(f"    def update(self, facts: {type_of('some facts')}, /) -> None: ...")
    if actors:
        lines.append(f"    def actors(self, actors: {actors} | None, *, prefer: cdb.Prefer = None) -> None: ...")
    lines += [f"    def {name_of_query}(self) -> {matches}: ..." for name_of_query in ("query", "matches")]
    lines.append("    def explain(self) -> cdb.Explanation: ...")
    lines.append("    def pick(self, rng: cdb.Rng | int | None = None, last: str | None = None) -> str | None: ...")
    lines.append(f"    def copy(self) -> {name}: ...")
    lines += ["    @property", "    def facts(self) -> dict[str, object]: ..."]
    yield f"# table {safe_text(table, 200)}, a live context\n" + "\n".join(lines) + "\n"


def _listed_names(names: Mapping[str, str] | Iterator[str]) -> str:
    return ", ".join(map(repr, names))
