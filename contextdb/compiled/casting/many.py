"""Many contexts with actors: one answer for each.

The game's mappings are kept, not copied, and may change between two questions; so each is compared with a copy of what it said when
it was read. That costs a comparison of two dicts, where reading costs every fact of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from contextdb.cells.facts import Context, check_mode
from contextdb.compiled.batch_columns import Contexts, common_length, facts_of
from contextdb.compiled.casting.facts import Actor, Ask
from contextdb.compiled.casting.stage import CastMatches, Offered, query_with_actors, set_stage
from contextdb.compiled.core_table import UNUSUAL
from contextdb.compiled.data import CompiledData
from contextdb.compiled.many import ListedMatches, one_by_one
from contextdb.errors import ContextError, Fault, plural


def query_many_with_actors(compiled: CompiledData, contexts: Contexts, ask: Ask) -> ListedMatches:
    """Answer every context with its actors: one mapping for all, or a sequence of one for each. Raises ContextError as `query`,
    with the number of the context."""
    check_mode(ask.unknown)
    columns = facts_of(contexts)
    actors: Any = ask.actors
    each: Sequence[Any] | None = None if isinstance(actors, Mapping) else actors
    if each is not None and (not isinstance(each, Sequence) or isinstance(each, (str, bytes))):
        accepted = "a mapping of roles for all contexts, or a list of one for each"
        raise ContextError(Fault(f"actors are of type {type(actors).__name__}.", accepted))
    n_contexts = common_length(columns) if columns else 1 if each is None else len(each)
    if each is not None and len(each) != n_contexts:
        problem = f"there are actors for {plural(len(each), 'context')}, and facts for {n_contexts:,}."
        raise ContextError(Fault(problem, "a mapping of roles for all contexts, or one for each"))

    def answer(context: int, facts: Mapping[str, object]) -> Any:
        return query_with_actors(compiled, facts, Ask(actors if each is None else each[context], ask.prefer, ask.unknown))

    return one_by_one(compiled, columns, n_contexts, answer)


# ---- actors that a live context keeps: read again only when one of them, or what else counts for them, has changed


_PLAIN = (float, int, str, bool, type(None), frozenset)
"""Types whose values do not change: an actor with others is read for every question."""


class LiveActors:
    """Actors offered for roles until others are, and who is preferred."""

    def __init__(self, compiled: CompiledData, ask: Ask) -> None:
        self.compiled, self.ask = compiled, ask
        self._role_facts = tuple(n for n in compiled.asked if n.partition(".")[1])
        """Facts that, where the context gives them, make a role one that is not cast."""
        self._may_keep = compiled.derivation is None and not callable(ask.prefer)
        """Derived facts of actors may hang on the context; what a function prefers, on anything."""
        self._offered: Offered | None = None
        self._copies: dict[str, list[tuple[Actor, dict[str, object]]]] = {}
        self._given: list[object] = []

    def query(self, context: Context) -> CastMatches:
        """The rows valid now; raises ContextError as `CompiledTable.query` does."""
        given = [context.get(name) for name in self._role_facts]
        offered = self._offered if self._offered is not None and self._is_as_read(given) else None
        stage, plain = set_stage(self.compiled, context, self.ask, offered)
        if offered is None:
            self._keep(stage.offered, given)
        return stage.matches(plain)

    def _is_as_read(self, given: list[object]) -> bool:
        actors = self.ask.actors
        if actors.keys() != self._copies.keys():
            return False
        try:
            return given == self._given and all(_is_same(actors[role], copies) for role, copies in self._copies.items())
        except UNUSUAL:  # what cannot be compared, such as an array, or is not a list of actors any more
            return False

    def _keep(self, offered: Offered, given: list[object]) -> None:
        copies = {role: [(actor, dict(actor)) for actor in listed] for role, listed in self.ask.actors.items()}
        values = (*given, *(value for own in copies.values() for _, facts in own for value in facts.values()))
        is_plain = self._may_keep and all(type(value) in _PLAIN for value in values)
        self._offered, self._copies, self._given = (offered, copies, given) if is_plain else (None, {}, [])


def _is_same(actors: Sequence[Actor], copies: Sequence[tuple[Actor, dict[str, object]]]) -> bool:
    return len(actors) == len(copies) and all(a is b and a == was for a, (b, was) in zip(actors, copies, strict=True))
