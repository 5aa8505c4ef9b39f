"""Actors that a live context keeps: read again only when one of them, or what else counts for them, has changed.

The game's mappings are kept, not copied, and may change between two questions; so each is compared with a copy of what it said when
it was read. That costs a comparison of two dicts, where reading costs every fact of it.
"""

from __future__ import annotations

from collections.abc import Sequence

from contextdb.cells.facts import Context
from contextdb.compiled.casting.facts import Actor, Ask
from contextdb.compiled.casting.stage import CastMatches, Offered, set_stage
from contextdb.compiled.core_table import UNUSUAL
from contextdb.compiled.data import CompiledData

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
