"""Why a row is valid with some actors or is not: which role cannot be filled, and whose fact fails."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.cells.arguments import require_row
from contextdb.cells.facts import Context, Unknown
from contextdb.compiled.casting.assigning import Part
from contextdb.compiled.casting.facts import Ask, Offer
from contextdb.compiled.casting.rules import CastRules
from contextdb.compiled.casting.stage import CastMatches, Stage, set_stage
from contextdb.compiled.data import CompiledData
from contextdb.compiled.explain import Explanation, Failure, RowExplanation, cell_failures, rule_failure, told_fact
from contextdb.compiled.failing_rules import rules_that_fail
from contextdb.expressions.rules import WhenRules, facts_text


class CastExplanation(Explanation):
    """All rows for one context and its actors.

    A needed role that is not filled counts as one failing cell for each fact of the nearest actor, or as one where the role has
    nobody at all or all who fit play other parts.
    """

    matches: CastMatches

    def __init__(self, compiled: CompiledData, stage: Stage, plain: Mapping[int, tuple[int, int]], matches: CastMatches) -> None:
        facts = {compiled.conditions[at].name: fact for at, fact in stage.plain_facts.items()}
        super().__init__(compiled, facts, "error", matches)
        self._stage = stage
        self._plain = plain

    def roles(self, row: int) -> dict[str, str]:
        return {role: offer.label for role, offer in self.matches.cast(row).items()}

    def row(self, row: int) -> RowExplanation:
        row = require_row(row, len(self))
        own = super().row(row)
        return RowExplanation(own.row, own.asset, own.is_enabled, (*own.failures, *self._role_failures(row)))

    def _broken_rules(self, when: WhenRules) -> int:
        """The rows whose rule does not hold: with plain facts, or for no casting though the needed roles can be filled."""
        stage = replace(self._stage, unknown=self._lenient, rules=self._cast_rules)
        left, _ = stage.left_by_rules(when.rows, when.rows)
        cast = self._cast_rules.rows & ~stage.offered.bits if self._cast_rules is not None else 0
        return when.rows & ~left & ~cast

    def decided(self, always: int) -> int:
        """The same with the rules of castings."""
        rules = self._stage.rules
        strict = None if rules is None else replace(rules, unknown="never", _known={})
        return replace(self._stage, unknown="never", rules=strict).left_by_rules(always, always)[1]

    @property
    def _lenient(self) -> Unknown:
        return "any" if self._stage.unknown == "any" else "never"

    @cached_property
    def _cast_rules(self) -> CastRules | None:
        rules = self._stage.rules
        return None if rules is None else replace(rules, unknown=self._lenient)

    def _rule_failures(self, row: int) -> Iterator[Failure]:
        rules = self._cast_rules
        if rules is None or not rules.rows >> row & 1:
            for is_open, part in rules_that_fail(self.compiled, row, self._stage.rule_facts, self._lenient):
                yield rule_failure(part, f"{'open' if is_open else 'false'} with {facts_text(part.rule, self._stage.rule_facts)}")
            return
        facts = rules.facts(row, _most_filled(self._stage.parts(row)[0]))
        for _, part in rules_that_fail(self.compiled, row, facts, self._lenient):
            yield rule_failure(part, f"false for every casting, such as {facts_text(part.rule, facts)}")

    @cached_property
    def _n_failures(self) -> NDArray[np.int64]:
        """How many cells of each row fail: int64 [n_rows]; a disabled row counts one more."""
        counts = np.asarray(self._fails.sum(axis=0, dtype=np.int64)) + self.breaks_rule + ~self._enabled
        for row in bitmask.rows(bitmask.from_int(((1 << len(counts)) - 1) & ~self._stage.offered.bits, len(counts))).tolist():
            counts[row] += len(list(self._role_failures(row)))
        return bitmask.read_only(counts)

    @cached_property
    def _fails(self) -> NDArray[np.bool_]:
        compiled = self.compiled
        fails = np.zeros((len(compiled.conditions), compiled.n_rows), np.bool_)
        for at, (bits, _) in self._plain.items():
            fails[at] = ~bitmask.unpack(bitmask.from_int(bits, compiled.n_rows), compiled.n_rows)
        return fails

    def _distances(self, rows: NDArray[np.int64]) -> NDArray[np.float64]:
        far = np.zeros(len(rows))
        for at, fact in self._stage.plain_facts.items():
            fails = self._fails[at, rows]
            if fails.any():
                far[fails] += self._column_distances(at, fact, rows[fails]) if isinstance(fact, float) else 1.0
        return far + self.breaks_rule[rows]

    def _role_failures(self, row: int) -> Iterator[Failure]:
        needed, _ = self._stage.parts(row)
        cast = _most_filled(needed)
        for role, fitting in needed:
            if role in cast:
                continue
            if fitting:
                others = [f"{offer.name} plays {name}" for name, offer in cast.items() if offer.key in {o.key for o in fitting}]
                yield Failure(role, "(needed)", f"not filled: {', '.join(others)}", "(one more actor who fits)")
            elif self._stage.offers[role]:
                yield from min((list(self._misfits(o, row)) for o in self._stage.offers[role]), key=len)
            else:
                yield Failure(role, "(needed)", "not filled: nobody is offered", "(an actor who fits)")

    def _misfits(self, offer: Offer, row: int) -> Iterator[Failure]:
        """The cells of a row that do not accept an actor."""
        for at, fact in offer.facts.items():
            bits, _ = self.compiled.condition_bits(at, fact, self._stage.unknown)
            if not bits >> row & 1:
                yield from cell_failures(self.compiled, at, row, fact, f"{told_fact(self.compiled, at, fact)} of {offer.name}")


def _most_filled(parts: list[Part]) -> dict[str, Offer]:
    """A greatest matching of roles and the actors who fit them, by augmenting paths; earlier roles are filled first."""
    playing: dict[object, tuple[str, Offer]] = {}
    fitting = dict(parts)

    def fill(role: str, seen: set[object]) -> bool:
        for offer in fitting[role]:
            if offer.key in seen:
                continue
            seen.add(offer.key)
            if offer.key not in playing or fill(playing[offer.key][0], seen):
                playing[offer.key] = (role, offer)
                return True
        return False

    for role in fitting:
        fill(role, set())
    cast = dict(playing.values())
    return {role: cast[role] for role in fitting if role in cast}


def explain_with_actors(compiled: CompiledData, context: Context, ask: Ask) -> CastExplanation:
    """Explain every row of a table for one context and its actors; raises ContextError as `query` does."""
    stage, plain = set_stage(compiled, context, ask)
    return CastExplanation(compiled, stage, plain, stage.matches(plain))
