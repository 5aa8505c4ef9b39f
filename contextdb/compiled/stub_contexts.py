"""The types of contexts that do not hold every fact: some facts, those next to actors, the actors, and a context that is kept.

For a table "jog" of the facts "speed" and "Defender.height":

    JogSomeFacts          some of the facts, or None for a missing one: for unknown="any" and "never", and for `live.update`
    JogFact               a Literal of their names
    JogLive               a live context, of `JogTable.live()`; its names and values are checked
    JogFactsWithActors    "speed", and "Defender.height" only where the game gives it itself
    JogDefenderActor      "height", of an actor who is offered as Defender
    JogActors             what `actors=` accepts

The last three are written for tables with roles alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from contextdb.compiled.casting.roles import role_of
from contextdb.compiled.stub_tables import TypeOf
from contextdb.errors import safe_text

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
        yield f"# table {safe_text(table, 200)}, the names of its facts\n{fact}: TypeAlias = Literal[{_listed(facts)}]\n"
        kinds = list(dict.fromkeys(facts.values()))
        for kind in kinds:
            lines += ["    @overload"] if len(kinds) > 1 else []
            named = _listed(own for own in facts if facts[own] == kind)
            lines.append(f"    def __setitem__(self, name: Literal[{named}], value: {kind} | None, /) -> None: ...")
        for kind in kinds if len(kinds) > 1 else ():
            named = _listed(own for own in facts if facts[own] == kind)
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


def _listed(names: Mapping[str, str] | Iterator[str]) -> str:
    return ", ".join(map(repr, names))
