"""A context that the game keeps: set what changed, then ask. The cheap way to query every frame.

The core keeps each fact as it was read when it was set, so a question reads nothing: it joins the masks of all facts, computes the
derived ones, and asks the rules.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, MutableMapping
from copy import copy, deepcopy
from typing import TYPE_CHECKING, Any, Self

from contextdb.cells.conditions import Condition
from contextdb.cells.facts import NAMES, Unknown, alike, as_context, no_condition, read_fact, require_names
from contextdb.cells.notebook import as_html, one_line
from contextdb.compiled.casting.explaining import explain_with_actors
from contextdb.compiled.casting.facts import Actors, Ask, Prefer
from contextdb.compiled.casting.many import LiveActors
from contextdb.compiled.core_table import UNKNOWN
from contextdb.compiled.data import CompiledData
from contextdb.compiled.explain import Explanation, explain
from contextdb.compiled.matches import Matches
from contextdb.compiled.memory import Rng
from contextdb.compiled.pick import pick
from contextdb.compiled.watcher import Watcher
from contextdb.core import Live
from contextdb.errors import Fault, NoSuchFact, in_quotes, plural, some


class LiveContext(Live, MutableMapping[Any, Any]):
    """Facts kept between queries. `live["speed"] = 3.2` sets one, `del live["speed"]` makes it missing, `live.query()` answers.

    A mapping of the facts that are set; a name that is not among them raises NoSuchFact, which is also a KeyError. `copy()` gives a
    context of its own. A live context is equal only to itself.
    """

    __slots__ = ("__weakref__", "_alike", "_cast", "_compiled", "_known", "_passed", "_unknown", "_watcher")

    def __init__(self, compiled: CompiledData, unknown: Unknown = "error") -> None:
        super().__init__(compiled.core, UNKNOWN[unknown], not compiled.is_bound)
        self._compiled = compiled
        self._unknown = unknown
        self._watcher: Watcher | None = None
        """Learns of what it is asked: set by the link that watches it, which then calls `_lead`."""
        self._cast: LiveActors | None = None
        self._known = frozenset(compiled.asked)
        """The names of the facts that can be set."""
        self._passed: set[str] = set()
        """Other names that `update` was given and that are like none of these."""
        self._alike: dict[str, tuple[str, ...]] = {}
        """For each other name the facts that it is like."""
        self._lead()

    def _set_carefully(self, name: str, value: object) -> None:
        """Set a fact that is not plainly of its type: a set of values is kept, a wrong one refused by its name."""
        if name not in self._known:
            raise self._no_fact(name)
        fact = read_fact(value, self._compiled.asked[name])
        self._set_odd(name, value if fact is not None else None)

    def _no_fact(self, name: str) -> NoSuchFact:
        """The error for a name that no fact can be set by; raises another one for a derived fact."""
        if self._compiled.derivation is not None:
            self._compiled.derivation.refuse([name])
        return no_condition(name, self._facts)

    def __getitem__(self, name: str) -> Any:
        value = self._value(name)
        if value is None:
            raise NoSuchFact(Fault(f"the fact {in_quotes(name)} is not set.", some(self) or "none: no fact is set"))
        return value

    def __contains__(self, name: object) -> bool:
        return (name in self._known or name in self._derived) and self._value(name) is not None

    def __iter__(self) -> Iterator[Any]:
        return (name for name, value in self.facts.items() if value is not None)

    def __len__(self) -> int:
        return sum(value is not None for value in self.facts.values())

    def __bool__(self) -> bool:
        return True

    def __eq__(self, other: object) -> bool:
        return self is other

    def __hash__(self) -> int:
        return id(self)

    @property
    def _derived(self) -> frozenset[str]:
        return self._compiled.derivation.names if self._compiled.derivation is not None else frozenset()

    def _value(self, name: str) -> object:
        """One fact, None where it is missing; a derived one is computed."""
        if name in self._known:
            return self._facts[name]
        if name not in self._derived:
            raise no_condition(name, self._facts)
        assert self._compiled.derivation is not None
        return self._compiled.derivation.compute(self._facts)[name]

    def update(self, facts: Mapping[str, object] | Iterable[tuple[str, object]]) -> None:  # type: ignore[override]
        """Set several facts, all or none; facts that the table does not use are ignored, as in `query`. Raises ContextError for a
        wrong value, which names the fact, and for a name that looks like the misspelt name of a condition whose fact is not given;
        names that the project declares belong to other tables and are not misspelt."""
        if type(facts) is not dict:
            facts = as_context(facts)
        if not self._known.issuperset(facts):
            facts = self._own(facts)
        before, put = self.facts, self.__setitem__
        try:
            for name, value in facts.items():
                put(name, value)
        except BaseException:
            for name in facts:
                put(name, before[name])
            raise

    def _own(self, facts: Mapping[str, object]) -> dict[str, object]:
        """Of some facts those that the table asks for; raises ContextError where another is very likely one of them, misspelt."""
        require_names(facts)
        for name in facts:
            if name not in self._known and name not in self._passed:
                self._look_at(name, facts)
        return {name: value for name, value in facts.items() if name in self._known}

    def _look_at(self, name: str, facts: Mapping[str, object]) -> None:
        """Raise ContextError where a name that the table does not ask for is very likely one that it does, misspelt, or is that of
        a derived fact."""
        if name in self._derived:
            if facts[name] is not None:
                raise self._no_fact(name)
            return
        if name not in self._alike:
            self._alike[name] = () if name in self._compiled.declared else alike(name, self._known)
        if not self._alike[name]:
            self._passed.add(name)
        for near in self._alike[name]:
            if near not in facts:
                problem = f"there is no condition {in_quotes(name)}, and {in_quotes(near)} is not given."
                raise NoSuchFact(Fault(problem, NAMES, in_quotes(near), rule="unknown-fact"))

    def copy(self) -> Self:
        """An independent context with the same facts and actors, which shares the compiled table and the actors' mappings."""
        return self._copied(self._facts, copy(self._cast))

    __copy__ = copy

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """The same, with facts and actors that are copies too."""
        new = self._copied(deepcopy(self._facts, memo), None)
        memo[id(self)] = new
        if self._cast is not None:
            new.actors(deepcopy(self._cast.ask.actors, memo), prefer=deepcopy(self._cast.ask.prefer, memo))
        return new

    def _copied(self, facts: Mapping[str, object], cast: LiveActors | None) -> Self:
        new = type(self)(self._compiled, self._unknown)
        for name, value in facts.items():
            new[name] = value
        new._cast = cast
        new._lead()
        return new

    def __reduce__(self) -> tuple[object, ...]:
        """What is pickled: the table, the facts and the actors. Masks are found again."""
        cast = None if self._cast is None else (self._cast.ask.actors, self._cast.ask.prefer)
        return _live_again, (type(self), self._compiled, self._unknown, self.facts, cast)

    def actors(self, actors: Actors | None, *, prefer: Prefer = None) -> None:
        """Offer actors for roles from now on, as `query` accepts them; None withdraws them. They are read at the next query.

        The mappings are kept, not copied: what the game changes in them counts in the next query. While they do not change, they
        are not read again. What is wrong with them is raised by `query()`.
        """
        self._cast = None if actors is None else LiveActors(self._compiled, Ask(actors, prefer, self._unknown))
        self._lead()

    @property
    def asked(self) -> dict[str, Condition]:
        """The conditions whose facts can be set, by name."""
        return self._compiled.asked

    @property
    def facts(self) -> dict[str, object]:
        """The facts as they were set, without derived ones; None where one is missing."""
        return self._facts

    if TYPE_CHECKING:  # the core has it

        def query(self) -> Matches:
            """The valid rows now."""

        def matches(self) -> Matches:
            """The same, by its older name."""

    else:
        query = Live.matches

    def _matches(self) -> Matches:
        """The same where the core alone cannot answer."""
        answer: Matches | None = self._ask() if self._cast is None else self._cast.query(self._facts)
        if answer is None:
            answer = self._compiled.query_with_care(self._facts, self._unknown)
        elif self._compiled.is_bound and self._cast is None:
            answer = self._compiled.bound(answer, self._facts, self._unknown)
        if (watcher := self._watcher) is not None and watcher.feed.is_open:
            watcher.answered(self._facts, answer, None if self._cast is None else self._cast.ask.actors)
        return answer

    def _lead(self) -> None:
        """Tell the core whether more hangs on an answer than the facts."""
        self._is_led = self._compiled.is_bound or self._cast is not None or self._watcher is not None

    def pick(self, rng: Rng | int | None = None, last: str | None = None) -> str | None:
        """One asset by the table's policy for the facts as they are now; takes and raises what `CompiledTable.pick` does."""
        return pick(self._compiled, self.matches(), rng, last)

    def explain(self) -> Explanation:
        """Why each row is valid or not with the facts and actors as they are now; see `CompiledTable.explain`."""
        if self._cast is not None:
            return explain_with_actors(self._compiled, self.facts, self._cast.ask)
        return explain(self._compiled, self.facts, self._unknown)

    def _repr_html_(self) -> str:
        """A notebook's table of the facts."""
        rows = [(name, "" if value is None else value) for name, value in self.facts.items()]
        return as_html(repr(self), ("fact", "value"), rows, len(rows))

    def __repr__(self) -> str:
        return one_line("LiveContext", self._compiled.name, f"{len(self)} of {plural(len(self._known), 'fact')} set")


def _live_again(
    kind: type[LiveContext],
    compiled: CompiledData,
    unknown: Unknown,
    facts: Mapping[str, object],
    cast: tuple[Actors, Prefer] | None,
) -> LiveContext:
    """A live context out of a pickle."""
    live = kind(compiled, unknown)
    live.update(facts)
    if cast is not None:
        live.actors(cast[0], prefer=cast[1])
    return live
