"""A live context of a table with derived facts or rules, and which of the two kinds a table needs."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from typing import Any, Self

from contextdb.cells.facts import Unknown, no_condition, read_fact
from contextdb.compiled.data import CompiledData
from contextdb.compiled.live import LiveContext
from contextdb.compiled.matches import Matches, with_mirrored
from contextdb.expressions.rules import WhenRules
from contextdb.expressions.rules.rules import Unusual
from contextdb.expressions.scalar import Value


class AskingLiveContext(LiveContext):
    """The same for a table with derived facts or rules, which asks for facts that are not columns.

    Derived facts are computed again when one that they need was set since the last question, and a rule is asked again when a fact
    that it names has changed.
    """

    __slots__ = ("_are_read", "_computed", "_given", "_is_stale", "_left", "_others", "_truths", "_values")

    def __init__(self, compiled: CompiledData, unknown: Unknown = "error") -> None:
        super().__init__(compiled, unknown)
        inputs, derived = (compiled.derivation.inputs, compiled.derivation.names) if compiled.derivation else ((), ())
        ruled = compiled.when.conditions if compiled.when else ()
        self._others = {c.name: c for c in (*inputs, *ruled) if c.name not in derived}
        """The conditions that derived facts are computed from, and those that rules name."""
        self._computed: dict[str, object] = dict.fromkeys(derived)
        """The derived facts, when they were last computed."""
        self._given: dict[str, object] = dict.fromkeys(compiled.asked)
        self._is_stale = True
        """Whether a fact of `_others` was set since derived facts were computed."""
        self._are_read = False
        """Whether `_values` are the facts as they are now."""
        self._values: dict[str, Value] = {}
        """The facts that rules name, when rules were last asked."""
        self._truths: dict[int, Value] = {}
        """Of the rules that were asked with these facts, by their number, whether they hold."""
        self._left = Matches(0, self._answering)

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

    def _value(self, name: str) -> object:
        """One fact, None where it is missing; a derived one is computed."""
        if name in self._given:
            return self._given[name]
        if name not in self._computed:
            self._refuse(name)
        if self._is_stale:
            self._compute()
        return self._computed[name]

    def __contains__(self, name: object) -> bool:
        return (name in self._given or name in self._computed) and self._value(name) is not None

    def _look_at(self, name: str, facts: Mapping[str, object]) -> None:
        if name not in self._computed:
            super()._look_at(name, facts)
        elif facts[name] is not None:
            self._refuse(name)

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        new = super().__deepcopy__(memo)
        new._given = deepcopy(self._given, memo)
        return new

    @property
    def _told(self) -> dict[str, object]:
        return self._given

    def matches(self) -> Matches:
        """The valid rows for the facts as they are now."""
        when = self._compiled.when
        if when is not None and self._odd:
            return self._carefully()
        if self._is_stale:
            self._compute()
        answer = super().matches()
        if when is None:
            return answer
        try:
            return self._carefully() if self._odd else self._with_rules(answer, when)
        except Unusual:
            return self._carefully()

    def _compute(self) -> None:
        derivation = self._compiled.derivation
        if derivation is not None:
            self._computed.update(derivation.compute(self._given))
            for name, value in self._computed.items():
                if name in self._lookups and value != self._facts[name]:
                    super().__setitem__(name, value)
        self._is_stale = self._are_read = False

    def _refuse(self, name: str) -> None:
        derivation = self._compiled.derivation
        if derivation is not None:
            derivation.refuse([name])
        raise no_condition(name, self._given)

    def _carefully(self) -> Matches:
        """The answer where facts are missing or sets, or actors are offered."""
        return self._compiled.query(self.facts, unknown=self._unknown) if self._cast is None else self._cast.query(self.facts)

    def _with_rules(self, answer: Matches, when: WhenRules) -> Matches:
        """Of the rows that the cells leave, those whose rule holds."""
        if not self._are_read:
            self._read_facts(when)
        left = answer.bits
        for number in when.numbers(left):
            if number not in self._truths:
                self._truths[number] = when.rules[number].run(self._values)
            if not self._truths[number]:
                if self._truths[number] is None:
                    raise Unusual
                left &= ~when.rules[number].rows
        if left == answer.bits:
            return answer
        if self._keep is not None:
            return with_mirrored(Matches(left, self._answering), self._keep(self._told))
        if self._is_bound:
            return self._compiled.bound(Matches(left, self._answering), self._told, self._unknown)
        if left != self._left.bits:
            self._left = Matches(left, self._answering)
        return self._left

    def _read_facts(self, when: WhenRules) -> None:
        values = when.usual_values({**self._given, **self._computed} if self._computed else self._given)
        for name, value in values.items():
            if self._values.get(name) != value:
                for number in when.naming[name]:
                    self._truths.pop(number, None)
        self._values, self._are_read = values, True


def live_context(compiled: CompiledData, unknown: Unknown = "error") -> LiveContext:
    """A context of the kind that a table needs."""
    kind = LiveContext if compiled.when is None and compiled.derivation is None else AskingLiveContext
    return kind(compiled, unknown)
