"""A context that the game keeps: set what changed, then ask. The cheap way to query every frame.

Most facts stay as they are from one frame to the next. The masks of those are intersected once, and a question costs one `&` for
each fact that has been moving; a fact that starts to move joins those, and the rest is intersected anew.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from copy import copy
from functools import reduce
from math import ldexp
from operator import and_
from typing import TYPE_CHECKING, Any

from contextdb.facts import Unknown, no_condition, read_fact
from contextdb.lookup import SingleLookup
from contextdb.matches import Matches
from contextdb.when.rules import Unusual

if TYPE_CHECKING:
    from contextdb.casting.facts import Actors, Prefer
    from contextdb.casting.live import LiveActors
    from contextdb.compiled import CompiledTable
    from contextdb.expressions.scalar import Value
    from contextdb.when import WhenRules

MOST_MOVING = 8

CAST = ""
"""What stands among the unusual facts while actors are offered, so that a question without actors has nothing to check."""


class LiveContext:
    """Facts kept between questions. `live["speed"] = 3.2` sets one, `del live["speed"]` makes it missing, `live.matches()` asks."""

    __slots__ = (
        "_answer",
        "_answering",
        "_cast",
        "_compiled",
        "_facts",
        "_lookups",
        "_masks",
        "_moving",
        "_n_moving",
        "_odd",
        "_still",
        "_unknown",
    )

    def __init__(self, compiled: CompiledTable, unknown: Unknown = "error") -> None:
        self._compiled = compiled
        self._answering = compiled.answering
        self._unknown = unknown
        self._lookups: dict[str, SingleLookup] = compiled.single_lookups
        self._facts: dict[str, object] = {}
        self._masks: dict[str, Any] = {}
        """The mask of every fact when `_still` was intersected."""
        self._moving: dict[str, Any] = {}
        """The masks of the facts that have been moving; None where the value must be read with care."""
        self._n_moving = -1
        """How many facts moved when `_still` was intersected."""
        self._still = 0
        self._odd: dict[str, tuple[int, bool]] = {}
        """Facts that are missing or sets: the rows that accept all of it, and whether it is missing."""
        self._cast: LiveActors | None = None
        self._answer = Matches(0, self._answering)
        """The last answer: while the rows stay the same, so does the object."""
        for condition in compiled.conditions:
            self._set_carefully(condition.name, None)

    def __setitem__(self, name: str, value: Any) -> None:
        """Set one fact. A wrong value raises ContextError, here or when next asked, and names the fact."""
        try:
            bounds, masks = self._lookups[name]
            self._moving[name] = masks[value] if bounds is None else masks[bisect_right(bounds, ldexp(value, 0))]
        except Exception:  # everything unusual is read again with care, which answers it or says what is wrong
            self._set_carefully(name, value)
        else:
            self._facts[name] = value
            if self._odd:
                self._odd.pop(name, None)

    def __getitem__(self, name: str) -> object:
        return self._facts[name]

    def __delitem__(self, name: str) -> None:
        self[name] = None

    def __contains__(self, name: str) -> bool:
        return self._facts.get(name) is not None

    def update(self, facts: Mapping[str, object]) -> None:
        """Set several facts; those that no condition of the table asks for are passed over, as in `query`."""
        for name, value in facts.items():
            if name in self._lookups:
                self[name] = value

    def actors(self, actors: Actors | None, prefer: Prefer = None) -> None:
        """Offer actors for roles from now on, as `query` takes them; None takes them back. They are read when next asked.

        The mappings are kept, not copied: what the game changes in them counts in the next question. While they say the same, they
        are not read again.
        """
        self._cast = None
        self._odd.pop(CAST, None)
        if actors is not None:
            from contextdb.casting.live import LiveActors

            self._cast = LiveActors(self._compiled, actors, prefer, self._unknown)
            self._odd[CAST] = (0, False)

    @property
    def facts(self) -> dict[str, object]:
        """The facts as they were set; None where one is missing."""
        return dict(self._facts)

    def matches(self) -> Matches:
        """The valid rows now; the same object as before while they stay the same.

        Raises
        ------
        ContextError
            Facts are missing and the context was made with unknown="error".
        """
        if self._odd:
            if self._cast is not None:
                return self._cast.query(self.facts)
            self._read_unusual()
            self._refuse_missing()
        moving = self._moving
        if len(moving) != self._n_moving:
            self._settle()
        bits = self._still
        try:
            for mask in moving.values():
                bits &= mask
        except TypeError:
            self._read_unusual()
            return self.matches()
        if self._odd:
            return self._set_matches(bits)
        if bits != self._answer.bits:
            self._answer = Matches(bits, self._answering)
        return self._answer

    def _settle(self) -> None:
        """Intersect what stands still; when too many facts have moved, let all of them stand still again."""
        moving, masks = self._moving, self._masks
        masks.update(moving)
        if len(moving) > MOST_MOVING and None not in moving.values():
            moving.clear()
        self._n_moving = len(moving)
        still = {**masks, **dict.fromkeys(moving, -1)}
        self._still = reduce(and_, still.values(), self._compiled.enabled_bits)

    def _set_carefully(self, name: str, value: object) -> None:
        if name not in self._lookups:
            raise no_condition(name, self._lookups)
        some, every, is_missing = self._compiled.fact_bits(name, value, self._unknown)
        self._moving[name] = some
        self._facts[name] = value
        self._odd.pop(name, None)
        if is_missing or every != some:
            self._odd[name] = (every, is_missing)

    def _read_unusual(self) -> None:
        """Read with care the values whose masks were not found in the usual way: NaN, numbers far out."""
        for name in [n for n, mask in self._moving.items() if mask is None]:
            self._set_carefully(name, self._facts[name])

    def _refuse_missing(self) -> None:
        missing = [c.name for c in self._compiled.conditions if self._odd.get(c.name, (0, False))[1]]
        if missing and self._unknown == "error":
            self._compiled.refuse_missing(missing, self.facts, self._unknown)

    def _set_matches(self, bits: int) -> Matches:
        masks = {**self._masks, **self._moving}
        every = (self._odd[n][0] if n in self._odd else m for n, m in masks.items())
        return self._compiled.matches(bits, reduce(and_, every, self._compiled.enabled_bits))


class SoftLiveContext(LiveContext):
    """The same for a table with soft cells: every answer knows what they cost in the context of its moment."""

    __slots__ = ()

    def matches(self) -> Matches:
        """The valid rows for the facts as they are now."""
        answer = super().matches()
        return answer if self._cast is not None else self._compiled.with_penalties(copy(answer), self.facts, self._unknown)


class AskingLiveContext(LiveContext):
    """The same for a table with derived facts or rules, which asks for facts that are no columns.

    Derived facts are computed anew when one that they need was set since the last question.
    """

    __slots__ = ("_computed", "_given", "_is_stale", "_others")

    def __init__(self, compiled: CompiledTable, unknown: Unknown = "error") -> None:
        super().__init__(compiled, unknown)
        self._others = {c.name: c for c in (*(compiled.derivation.inputs if compiled.derivation else ()), *compiled.ruled)}
        """The conditions that derived facts are computed from, and those that only rules name."""
        self._computed: dict[str, object] = dict.fromkeys(compiled.derivation.names if compiled.derivation else ())
        """The derived facts, when they were last computed."""
        self._given: dict[str, object] = dict.fromkeys(compiled.asked)
        self._is_stale = True

    def __setitem__(self, name: str, value: Any) -> None:
        """Set one fact; a derived one is refused."""
        condition = self._others.get(name)
        if condition is not None:
            if name not in self._lookups:
                read_fact(value, condition)
            self._is_stale = True
        elif name not in self._given:
            self._refuse(name)
        if name in self._lookups:
            super().__setitem__(name, value)
        self._given[name] = value

    def __getitem__(self, name: str) -> object:
        """One fact; a derived one is computed."""
        if name in self._given:
            return self._given[name]
        if name not in self._computed:
            self._refuse(name)
        self._compute()
        return self._computed[name]

    def __contains__(self, name: str) -> bool:
        return (name in self._given or name in self._computed) and self[name] is not None

    def update(self, facts: Mapping[str, object]) -> None:
        """Set several facts; those that the table does not ask for are passed over, derived ones refused."""
        for name, value in facts.items():
            if name in self._given or (name in self._computed and value is not None):
                self[name] = value

    @property
    def facts(self) -> dict[str, object]:
        """The facts as they were set, without derived ones; None where one is missing."""
        return dict(self._given)

    def matches(self) -> Matches:
        """The valid rows for the facts as they are now."""
        self._compute()
        return super().matches()

    def _compute(self) -> None:
        if self._is_stale and self._compiled.derivation is not None:
            self._computed.update(self._compiled.derivation.compute(self._given))
            for name, value in self._computed.items():
                if name in self._lookups and value != self._facts[name]:
                    super().__setitem__(name, value)
        self._is_stale = False

    def _refuse(self, name: str) -> None:
        derivation = self._compiled.derivation
        if derivation is not None:
            derivation.refuse([name])
        raise no_condition(name, self._given)


class RuledLiveContext(AskingLiveContext):
    """The same for a table with rules: one is asked anew when a fact that it names has changed."""

    __slots__ = ("_is_set", "_left", "_named", "_truths", "_values", "_when")

    def __init__(self, compiled: CompiledTable, unknown: Unknown = "error") -> None:
        assert compiled.when is not None
        self._is_set = True
        """Whether a fact that rules need was set since they were asked."""
        super().__init__(compiled, unknown)
        self._when: WhenRules = compiled.when
        inputs = compiled.derivation.inputs if compiled.derivation is not None else ()
        self._named = compiled.when.names.union(c.name for c in inputs)
        self._values: dict[str, Value] = {}
        """The facts that rules name, when rules were last asked."""
        self._truths: dict[int, Value] = {}
        """Of the rules that were asked with these facts, by their number, whether they hold."""
        self._left = Matches(0, self._answering)

    def __setitem__(self, name: str, value: Any) -> None:
        """Set one fact; a derived one is refused."""
        super().__setitem__(name, value)
        if name in self._named:
            self._is_set = True

    def matches(self) -> Matches:
        """The valid rows for the facts as they are now."""
        if self._odd:
            return self._carefully()
        answer = super().matches()
        try:
            return self._carefully() if self._odd else self._with_rules(answer)
        except Unusual:
            return self._carefully()

    def _carefully(self) -> Matches:
        """The answer where facts are missing or sets, or actors are offered."""
        return self._compiled.query(self.facts, self._unknown) if self._cast is None else self._cast.query(self.facts)

    def _with_rules(self, answer: Matches) -> Matches:
        """Of the rows that the cells leave, those whose rule holds."""
        if self._is_set:
            self._read_facts()
        left = answer.bits
        for number in self._when.numbers(left):
            if number not in self._truths:
                self._truths[number] = self._when.rules[number].run(self._values)
            if not self._truths[number]:
                if self._truths[number] is None:
                    raise Unusual
                left &= ~self._when.rules[number].rows
        if left == answer.bits:
            return answer
        if left != self._left.bits:
            self._left = Matches(left, self._answering)
        return self._left

    def _read_facts(self) -> None:
        values = self._when.usual_values({**self._given, **self._computed} if self._computed else self._given)
        for name, value in values.items():
            if self._values.get(name) != value:
                for number in self._when.naming[name]:
                    self._truths.pop(number, None)
        self._values, self._is_set = values, False


class SoftAskingLiveContext(SoftLiveContext, AskingLiveContext):
    """For a table with both."""

    __slots__ = ()


class SoftRuledLiveContext(SoftLiveContext, RuledLiveContext):
    """For a table with soft cells and rules."""

    __slots__ = ()


def live_context(compiled: CompiledTable, unknown: Unknown = "error") -> LiveContext:
    """A context of the kind that a table needs."""
    is_soft = any(compiled.soft)
    if compiled.when is not None:
        return SoftRuledLiveContext(compiled, unknown) if is_soft else RuledLiveContext(compiled, unknown)
    if compiled.derivation is not None:
        return SoftAskingLiveContext(compiled, unknown) if is_soft else AskingLiveContext(compiled, unknown)
    return SoftLiveContext(compiled, unknown) if is_soft else LiveContext(compiled, unknown)
