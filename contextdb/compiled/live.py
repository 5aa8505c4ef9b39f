"""A context that the game keeps: set what changed, then ask. The cheap way to query every frame.

Most facts stay as they are from one frame to the next. They are in blocks, whose masks are intersected once and kept: a fact that
changes makes only its block stale. Facts that move again and again are left out of the blocks, and a question
costs one `&` for each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, MutableMapping
from copy import copy, deepcopy
from functools import reduce
from operator import and_
from typing import Any, Never, Self

from contextdb.cells.arguments import by_name
from contextdb.cells.conditions import Condition
from contextdb.cells.facts import NAMES, Unknown, alike, as_context, no_condition, require_names
from contextdb.cells.mirroring import kept_facts
from contextdb.cells.notebook import one_line
from contextdb.compiled.casting.explaining import explain_with_actors
from contextdb.compiled.casting.facts import Actors, Ask, Prefer
from contextdb.compiled.casting.live import LiveActors
from contextdb.compiled.data import CompiledData
from contextdb.compiled.explain import Explanation, explain
from contextdb.compiled.lookup import UNUSUAL
from contextdb.compiled.matches import Matches, with_mirrored
from contextdb.compiled.memory import Rng
from contextdb.compiled.pick import pick
from contextdb.errors import Fault, NoSuchFact, in_quotes, plural, some

BLOCK = 5
LOOKED_AT = 16
"""Of so many times that blocks are intersected, one looks for facts that move."""
MOST_MOVING = 8
"""At most so many facts are left out of the blocks."""

LiveLookup = tuple[Callable[[Any], int | None] | None, Any, int, int]
"""What finds the mask of a number, or None and the masks by value; the block of the fact, and its place there."""

_SHARED = frozenset(("_lookups", "_others"))
"""What a context never changes, and shares with its copies."""

CAST = ""
"""What is among the unusual facts while actors are offered, so that a question without actors has nothing to check."""


class LiveContext(MutableMapping[str, object]):
    """Facts kept between queries. `live["speed"] = 3.2` sets one, `del live["speed"]` makes it missing, `live.matches()` answers.

    A mapping of the facts that are set; a name that is not among them raises NoSuchFact, which is also a KeyError. `copy()` gives a
    context of its own. A live context is equal only to itself.
    """

    __slots__ = (
        "__weakref__",
        "_alike",
        "_answer",
        "_answering",
        "_blocks",
        "_cast",
        "_compiled",
        "_ears",
        "_enabled",
        "_facts",
        "_is_bound",
        "_keep",
        "_known",
        "_lookups",
        "_masks",
        "_moved",
        "_moving",
        "_n_settled",
        "_odd",
        "_passed",
        "_stale",
        "_still",
        "_unknown",
    )

    _ears: Any
    """Who hears of its questions: set only while somebody listens, see `contextdb.compiled.heard`."""

    def __init__(self, compiled: CompiledData, unknown: Unknown = "error") -> None:
        self._compiled = compiled
        self._answering = compiled.answering
        self._unknown = unknown
        self._lookups = compiled.once(_lookups)
        self._enabled = compiled.enabled_bits
        self._facts: dict[str, object] = {}
        n_blocks = -(-len(self._lookups) // BLOCK)
        self._masks = [[compiled.enabled_bits] * BLOCK for _ in range(n_blocks)]
        """The masks of the facts of each block; all rows for one that moves."""
        self._blocks = [compiled.enabled_bits] * n_blocks
        """The masks of each block, intersected."""
        self._still = compiled.enabled_bits
        """All of them, intersected."""
        self._moving: dict[str, int] = {}
        """The masks of facts that move."""
        self._stale: dict[str, int] = {}
        """The facts whose masks have changed since their blocks were intersected, and their blocks."""
        self._moved: set[str] = set()
        """Facts that were stale when facts that move were looked for: where all stale ones are among these, they move."""
        self._n_settled = 0
        """How often stale blocks were intersected again."""
        self._odd: dict[str, tuple[int, bool]] = {}
        """Facts that are missing or sets: the rows that accept all of it, and whether it is missing."""
        self._cast: LiveActors | None = None
        self._known = frozenset(compiled.asked)
        """The names of the facts that can be set."""
        self._passed: set[str] = set()
        """Other names that `update` was given and that are like none of these."""
        self._alike: dict[str, tuple[str, ...]] = {}
        """For each other name the facts that it is like."""
        self._keep = compiled.keeping(unknown) if compiled.mirroring and not (compiled.is_soft or compiled.widening) else None
        """What keeps the facts of an answer, where it must know them for a mirror alone."""
        self._is_bound = compiled.is_bound
        """Whether an answer must know the facts, for the costs of soft cells, for a mirror or for widened cells."""
        self._answer = Matches(0, self._answering)
        """The last answer: while the rows stay the same, so does the object."""
        for condition in compiled.conditions:
            self._set_carefully(condition.name, None)

    def __setitem__(self, name: str, value: Any) -> None:
        """Set one fact. A wrong value raises ContextError, here or when next asked, and names the fact."""
        try:
            find, masks, block, at = self._lookups[name]
            mask = masks[value] if find is None else find(value)
        except UNUSUAL:  # it is read again with care, which answers it or says what is wrong
            mask = None
        if mask is None:
            self._set_carefully(name, value)
            return
        moving = self._moving
        if moving and name in moving:
            moving[name] = mask
        elif (own := self._masks[block])[at] is not mask:
            own[at] = mask
            self._stale[name] = block
        self._facts[name] = value
        if self._odd:
            self._odd.pop(name, None)

    def __getitem__(self, name: str) -> object:
        value = self._value(name)
        if value is None:
            raise NoSuchFact(Fault(f"the fact {in_quotes(name)} is not set.", some(self) or "none: no fact is set"))
        return value

    def __delitem__(self, name: str) -> None:
        self[name] = None

    def __contains__(self, name: object) -> bool:
        return name in self._known and self._value(name) is not None

    def __iter__(self) -> Iterator[str]:
        return (name for name, value in self.facts.items() if value is not None)

    def __len__(self) -> int:
        return sum(value is not None for value in self.facts.values())

    def __bool__(self) -> bool:
        return True

    def __eq__(self, other: object) -> bool:
        return self is other

    def __hash__(self) -> int:
        return id(self)

    def _value(self, name: str) -> object:
        """One fact, None where it is missing."""
        if name not in self._facts:
            raise no_condition(name, self._lookups)
        return self._facts[name]

    def update(self, facts: Mapping[str, object] | Iterable[tuple[str, object]]) -> None:  # type: ignore[override]
        """Set several facts, all or none; facts that the table does not use are ignored, as in `query`. Raises ContextError for a
        wrong value, which names the fact, and for a name that looks like the misspelt name of a condition whose fact is not given;
        names that the project declares belong to other tables and are not misspelt."""
        if type(facts) is not dict:
            facts = as_context(facts)
        if not self._known.issuperset(facts):
            facts = self._own(facts)
        before, put = self._told.copy(), self.__setitem__
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
        """Raise ContextError where a name that the table does not ask for is very likely one that it does, misspelt."""
        if name not in self._alike:
            self._alike[name] = () if name in self._compiled.declared else alike(name, self._known)
        if not self._alike[name]:
            self._passed.add(name)
        for near in self._alike[name]:
            if near not in facts:
                found = f"there is no condition {in_quotes(name)}, and {in_quotes(near)} is not given."
                raise NoSuchFact(Fault(found, NAMES, in_quotes(near), rule="unknown-fact"))

    def copy(self) -> Self:
        """An independent context with the same facts and actors, which shares the compiled table and the actors' mappings."""
        new: Self = object.__new__(type(self))
        for name, value in self._state().items():
            setattr(new, name, copy(value) if type(value) in (dict, list, set) and name not in _SHARED else value)
        new._masks = [list(block) for block in self._masks]
        new._cast = copy(self._cast)
        return new

    __copy__ = copy

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """The same, with facts and actors that are copies too."""
        new = self.copy()
        memo[id(self)] = new
        new._facts = deepcopy(self._facts, memo)
        if new._cast is not None:
            new.actors(deepcopy(new._cast.ask.actors, memo), prefer=deepcopy(new._cast.ask.prefer, memo))
        return new

    def _state(self) -> dict[str, Any]:
        state: dict[str, Any] = object.__getstate__(self)[1]  # type: ignore[index]
        return state

    def __reduce__(self) -> tuple[object, ...]:
        """What is pickled: the table, the facts and the actors. Masks are found again."""
        cast = None if self._cast is None else (self._cast.ask.actors, self._cast.ask.prefer)
        return _live_again, (type(self), self._compiled, self._unknown, self.facts, cast)

    def actors(self, actors: Actors | None, *old: Never, prefer: Prefer = None) -> None:
        """Offer actors for roles from now on, as `query` accepts them; None withdraws them. They are read at the next query.

        The mappings are kept, not copied: what the game changes in them counts in the next query. While they do not change, they
        are not read again. What is wrong with them is raised by `matches()`.
        """
        if old:
            return self.actors(actors, **by_name("actors", old, prefer=prefer))
        self._cast = None
        self._odd.pop(CAST, None)
        if actors is not None:
            self._cast = LiveActors(self._compiled, Ask(actors, prefer, self._unknown))
            self._odd[CAST] = (0, False)

    @property
    def asked(self) -> dict[str, Condition]:
        """The conditions whose facts can be set, by name."""
        return self._compiled.asked

    @property
    def facts(self) -> dict[str, object]:
        """The facts as they were set, without derived ones; None where one is missing."""
        return dict(self._told)

    @property
    def _told(self) -> dict[str, object]:
        """The facts as the caller gave them; not a copy."""
        return self._facts

    def matches(self) -> Matches:
        """The valid rows now; the same object as before while they stay the same, in a table without soft cells and without
        conditions whose facts change in a mirror or that have a hysteresis. Raises ContextError where facts are missing and the
        context was made with unknown="error"."""
        if self._odd:
            if self._cast is not None:
                return self._cast.query(self.facts)
            self._refuse_missing()
        if stale := self._stale:
            self._n_settled += 1
            if self._moving or self._n_settled % LOOKED_AT == 0:
                self._look_for_moving()
            masks, blocks = self._masks, self._blocks
            for block in stale.values():
                a, b, c, d, e = masks[block]
                blocks[block] = a & b & c & d & e
            stale.clear()
            bits = self._enabled
            for mask in blocks:
                bits &= mask
            self._still = bits
        else:
            bits = self._still
        if self._moving:
            for mask in self._moving.values():
                bits &= mask
        if self._odd:
            return self._set_matches(bits)
        if self._is_bound:
            answer = Matches(bits, self._answering)
            if self._keep is not None:
                return with_mirrored(answer, self._keep(self._told))
            return self._compiled.bound(answer, self._told, self._unknown)
        if bits != self._answer.bits:
            self._answer = Matches(bits, self._answering)
        return self._answer

    def pick(self, rng: Rng | int | None = None, last: str | None = None) -> str | None:
        """One asset by the table's policy for the facts as they are now; takes and raises what `CompiledTable.pick` does."""
        return pick(self._compiled, self.matches(), rng, last)

    def explain(self) -> Explanation:
        """Why each row is valid or not with the facts and actors as they are now; see `CompiledTable.explain`."""
        if self._cast is not None:
            return explain_with_actors(self._compiled, self.facts, self._cast.ask)
        return explain(self._compiled, self.facts, self._unknown)

    def __repr__(self) -> str:
        return one_line("LiveContext", self._compiled.name, f"{len(self)} of {plural(len(self._known), 'fact')} set")

    def _look_for_moving(self) -> None:
        """Bring facts that moved back into their blocks, and leave stale ones out if all of them were stale at looks before."""
        for name, mask in self._moving.items():
            _, _, block, at = self._lookups[name]
            self._masks[block][at] = mask
            self._stale[name] = block
        self._moving.clear()
        stale, moved = self._stale, self._moved
        if stale.keys() <= moved:
            for name, block in stale.items():
                own, at = self._masks[block], self._lookups[name][3]
                self._moving[name], own[at] = own[at], self._enabled
        else:
            if len(moved) + len(stale) > MOST_MOVING:
                moved.clear()
            if len(stale) <= MOST_MOVING:
                moved.update(stale)

    def _set_carefully(self, name: str, value: object) -> None:
        if name not in self._lookups:
            raise no_condition(name, self._lookups)
        some, every, is_missing = self._compiled.fact_bits(name, value, self._unknown)
        _, _, block, at = self._lookups[name]
        self._moving.pop(name, None)
        self._masks[block][at] = some
        self._stale[name] = block
        self._facts[name] = value
        self._odd.pop(name, None)
        if is_missing or every != some:
            self._odd[name] = (every, is_missing)

    def _refuse_missing(self) -> None:
        missing = [c.name for c in self._compiled.conditions if self._odd.get(c.name, (0, False))[1]]
        if missing and self._unknown == "error":
            self._compiled.refuse_missing(missing, self.facts, self._unknown)

    def _set_matches(self, bits: int) -> Matches:
        masks = {name: self._moving.get(name, self._masks[block][at]) for name, (_, _, block, at) in self._lookups.items()}
        every = (self._odd[n][0] if n in self._odd else m for n, m in masks.items())
        found = self._compiled.matches(bits, reduce(and_, every, self._compiled.enabled_bits))
        return self._compiled.bound(found, kept_facts(self._told), self._unknown)


def _lookups(compiled: CompiledData) -> dict[str, LiveLookup]:
    """For each condition how a live context finds the mask of a usual fact, and where it keeps it."""
    found: dict[str, LiveLookup] = {}
    for at, (name, (find, masks)) in enumerate(compiled.single_lookups.items()):
        found[name] = find, masks, at // BLOCK, at % BLOCK
    return found


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
