"""Assumptions: expressions that hold in every context that can happen.

What they rule out is given as boxes of cells where each comparison is about one condition and constants; an assumption that
computes with facts, or compares them with each other, can only be asked context by context.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import BOOL
from contextdb.cells.sets import NumberSet, ValueSet
from contextdb.errors import Fault, in_quotes
from contextdb.expressions.boxes import Box, NoBoxes, Sets, all_of, false_half_turns
from contextdb.expressions.expression import Expression, read_expression
from contextdb.expressions.parse import parse
from contextdb.expressions.tokens import ExpressionError, Refusal, tokens_of

WANTS = Condition("", BOOL)


@dataclass(frozen=True)
class Assumptions:
    """What is assumed of a table's contexts."""

    expressions: tuple[Expression, ...]
    conditions: tuple[Condition, ...]
    derived: tuple[Expression, ...] = ()
    """That derived bools of the table are what they are computed as, where boxes can tell."""

    @cached_property
    def boxes(self) -> list[Box]:
        """Contexts that cannot happen, as boxes over the conditions of the table: what `coverage(..., impossible=...)` takes.

        A box that also restricts a condition which the table does not have is left out: some context in its shadow can happen.
        """
        ruled_out = [*self._ruled_out, self._half_turns, *(expression.as_boxes(False) for expression in self.derived)]
        return [box for boxes in ruled_out for box in boxes or () if self._is_of_the_table(box)]

    @cached_property
    def unboxed(self) -> tuple[Expression, ...]:
        """The assumptions that no boxes over the conditions of the table can tell exactly; `holds` knows them."""
        pairs = zip(self.expressions, self._ruled_out, strict=True)
        return tuple(e for e, boxes in pairs if boxes is None or not all(map(self._is_of_the_table, boxes)))

    def _is_of_the_table(self, box: Box) -> bool:
        return box.keys() <= {condition.name for condition in self.conditions}

    @cached_property
    def _ruled_out(self) -> list[list[Box] | None]:
        return [expression.as_boxes(False) for expression in self.expressions]

    @property
    def _half_turns(self) -> list[Box]:
        """The contexts with an angle at half a turn that are ruled out, be that -180 or 180 throughout all of the assumptions."""
        boxed = [expression for expression in self.expressions if expression not in self.unboxed]
        boxes: list[Box] = []
        for name in dict.fromkeys(c.name for e in boxed for c in e.conditions if c.domain.type.is_circular):
            about = [e for e in boxed if name in e.names]
            boxes += false_half_turns(name, [e.plan for e in about], {c.name: c for e in about for c in e.conditions})
        return boxes

    def holds(self, columns: Mapping[str, Any], n_contexts: int) -> NDArray[np.bool_]:
        """Whether each of N contexts can happen: bool [N]. One where facts are missing can, unless those it has rule it out.
        `columns` are lists, flat arrays or Series [N] of facts by the name of the condition; a column that is absent is missing."""
        flags = np.ones(n_contexts, np.bool_)
        for expression in self.expressions:
            flags &= expression.flags(columns, n_contexts, missing=True)
        return flags

    @cached_property
    def contradictions(self) -> list[Fault]:
        """Assumptions that no context of the declared domains satisfies, alone or together with those before them.

        Only those that boxes can tell are compared.
        """
        whole = [_domain_box({c.name: c for e in self.expressions for c in e.conditions})]
        held = whole
        faults: list[Fault] = []
        for expression in self.expressions:
            holds = _sets_of(expression)
            if holds is None:
                continue
            try:
                alone, together = all_of([whole, holds]), all_of([held, holds])
            except NoBoxes:
                continue
            if together:
                held = together
            elif not faults:
                faults.append(_contradiction(expression.text, bool(alone)))
        return faults


def conjuncts(text: str) -> tuple[str, ...]:
    """What `and` joins in an expression, which is true where all of these are; the text itself where it joins nothing, or cannot be
    read."""
    try:
        tokens = tokens_of(text)[:-1]
        parse(text)
    except Refusal:
        return (text,)
    depths = list(accumulate((t.text in "([") - (t.text in ")]") if t.kind == "sign" else 0 for t in tokens))
    if tokens[0].text == "(" and 0 not in depths[:-1]:
        return conjuncts(text[tokens[0].stop : tokens[-1].start])
    outer = [t for t, depth in zip(tokens, depths, strict=True) if depth == 0 and t.is_bare]
    if any(t.text in ("or", "if") for t in outer):
        return (text,)
    joints = [t for t in outer if t.text == "and"]
    starts, stops = [0, *(t.stop for t in joints)], [*(t.start for t in joints), len(text)]
    parts = [text[start:stop].strip() for start, stop in zip(starts, stops, strict=True)]
    return tuple(parts) if len(parts) == 1 else tuple(part for one in parts for part in conjuncts(one))


def constant_truth(expression: Expression) -> bool | None:
    """The truth that a bool expression has in every context of the declared values and bounds; None where it has both, or where
    boxes cannot tell."""
    whole = [_domain_box({c.name: c for c in expression.conditions})]
    for truth in (True, False):
        boxes = expression.as_boxes(truth)
        if boxes is None:
            return None
        try:
            if not all_of([whole, _as_sets(boxes)]):
                return not truth
        except NoBoxes:
            return None
    return None


def _contradiction(text: str, holds_alone: bool) -> Fault:
    if holds_alone:
        problem = f"{in_quotes(text)} contradicts the assumptions before it: no context satisfies them all."
        return Fault(problem, "assumptions that hold together in some context")
    problem = f"{in_quotes(text)} holds in no context of the declared values and bounds."
    return Fault(problem, "an assumption that holds in some context")


def _sets_of(expression: Expression) -> list[Sets] | None:
    boxes = expression.as_boxes(True)
    return None if boxes is None else _as_sets(boxes)


def _as_sets(boxes: Sequence[Box]) -> list[Sets]:
    return [{n: c.accepts for n, c in box.items() if c.accepts is not None} for box in boxes]


def _domain_box(conditions: Mapping[str, Condition]) -> Sets:
    """The declared bounds and values as one box."""
    box: Sets = {}
    for name, condition in conditions.items():
        domain = condition.domain
        if domain.type.is_bounded:
            box[name] = NumberSet(((domain.minimum, domain.maximum),))
        elif domain.type.needs_values:
            box[name] = ValueSet(frozenset(domain.known))
    return box


def read_assumptions(
    assume: Sequence[str], conditions: Sequence[Condition], declared: Mapping[str, Condition] | None = None
) -> Assumptions:
    """Read the assumptions of a table: bool expressions, as `[tables.NAME] assume` of contextdb.toml holds them, over the
    conditions of the table, declared or inferred, and others that are `declared`. Raises ExpressionError with every fault of every
    assumption."""
    known = {**(declared or {}), **{condition.name: condition for condition in conditions}}
    if faults := list(assumption_faults(assume, known)):
        raise ExpressionError(*faults)
    return Assumptions(tuple(read_expression(text, known, WANTS) for text in assume), tuple(conditions))


def assumption_faults(assume: Sequence[str], conditions: Mapping[str, Condition]) -> Iterator[Fault]:
    """Why assumptions cannot be read; the rule is "unknown-fact" where one names what is not a condition of these."""
    for text in assume:
        try:
            read_expression(text, conditions, WANTS)
        except ExpressionError as error:
            yield from error.faults
