"""The types of a table that is asked, of its answers and of its picks.

For a table "jog" with outputs and the role Defender:

    JogTable          `JogTable.open(path)`, or `JogTable.of(table.compile())`: contexts are checked, answers and picks are typed
    JogMatches        an answer; the output "damage" of its rows is an array of what is declared, its castings are JogCasting
    JogManyMatches    the answers to many contexts
    JogPicker         what `picker()` gives; its picks are JogPick
    JogPick           `outputs` is JogOutputs, `casting` JogCasting
    JogRole           a Literal of the roles
    JogCasting        for "Defender" a JogDefenderActor

The classes but JogTable are for type checkers: when the game runs, answers and picks are those of contextdb. They are written only
for tables with roles or outputs. That they take less than in contextdb, a Literal for a name, is no error: see the module's head.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from contextdb.cells.outputs import Output
from contextdb.errors import safe_text

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
