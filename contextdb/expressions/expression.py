"""An expression over conditions, read and checked once, computed for one context or for millions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.conditions import Condition
from contextdb.cells.facts import read_fact
from contextdb.cells.kinds import Kind
from contextdb.cells.sets import Cell
from contextdb.errors import ContextError, Fault, Place, in_quotes, nearest, plural, some
from contextdb.expressions.boxes import Box, boxes_of
from contextdb.expressions.check import Checker
from contextdb.expressions.columns import UNKNOWN, YES, Column, read_column, run_frame
from contextdb.expressions.parse import parse
from contextdb.expressions.plan import Part, Type
from contextdb.expressions.scalar import Run, Value, is_missing, runner
from contextdb.expressions.tokens import ExpressionError, Refusal, fault_of, written_text
from contextdb.expressions.tree import Node, Number, Text

NAN = float("nan")


@dataclass(frozen=True)
class Expression:
    """A checked expression. Made by `read_expression`."""

    text: str
    conditions: tuple[Condition, ...]
    """The conditions that it names, in the order of their first mention."""
    type: Type = field(repr=False)
    plan: Part = field(repr=False)

    def __reduce__(self) -> tuple[object, ...]:
        """Other processes read the text again: what computes it is functions."""
        return read_expression, (self.text, self.conditions)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the facts that it needs."""
        return tuple(condition.name for condition in self.conditions)

    @property
    def kind(self) -> str:
        return self.type.kind.name

    def evaluate(self, facts: Mapping[str, object]) -> float | bool | str | frozenset[str] | None:
        """The value in one context; None where it is missing.

        `facts` are as a game gives them to a query. One that is absent, None, NaN or a set of values counts as missing. Raises
        ContextError where a fact is of the wrong type, or outside an enum's or tag's domain.
        """
        value = self.run({c.name: canonical(facts.get(c.name), c) for c in self.conditions})
        return None if is_missing(value) else value

    def flags(self, columns: Mapping[str, Any], n_contexts: int, missing: bool = False) -> NDArray[np.bool_]:
        """Whether a bool expression holds in each context: bool [N]; `missing` where that is not known."""
        truths = self.run_frame(columns, n_contexts)
        assert isinstance(truths, np.ndarray)
        assert self.type.kind.is_truth
        return truths >= UNKNOWN if missing else truths == YES

    def as_boxes(self, truth: bool = False) -> list[Box] | None:
        """The contexts in which a bool expression is `truth`, as boxes: a context lies in one of them, or more, exactly then.

        A box gives a cell for each condition that it restricts; `{}` holds every context. Facts are taken as known, and numbers
        from -inf to inf, whatever the condition's bounds. None where a comparison mixes conditions or computes with one, or where
        more than `boxes.MOST_BOXES` would be needed.
        """
        return boxes_of(self.plan, {c.name: c for c in self.conditions}, truth) if self.type.kind.is_truth else None

    @cached_property
    def run(self) -> Run:
        """Computes the value from facts in canonical form: NaN for a missing number, None for another missing fact."""
        return runner(self.plan, self.conditions)

    def run_frame(self, columns: Mapping[str, Any], n_contexts: int) -> Column:
        """The value in each of many contexts, the same to the last bit as `evaluate` gives.

        `columns` are lists, flat arrays or Series [n_contexts] of facts by the name of the condition. One that is absent is
        missing; others are ignored. Raises ContextError where a fact is of the wrong type or outside the domain, or a column has
        another length.
        """
        read: dict[str, Column] = {}
        for condition in self.conditions:
            given = columns.get(condition.name)
            check_length(given, condition, n_contexts)
            read[condition.name] = read_column(given, condition, n_contexts)
        return run_frame(self.plan, read, n_contexts)


def read_expression(
    text: str, conditions: Mapping[str, Condition] | Sequence[Condition], wants: Condition | None = None
) -> Expression:
    """Read an expression over some conditions, such as 'not (IsInMidAirAnim and gait in ["Walk", "Run"])'; the language is told in
    `contextdb.expressions`.

    The values must fit the type, the declared values and the unit of `wants`. Raises ExpressionError with the character where the
    fault is, what is accepted and, where one is near, a text that would be read.
    """
    known = conditions if isinstance(conditions, Mapping) else {c.name: c for c in conditions}

    def read(text: str) -> Expression:
        tree = parse(text)
        checker = Checker(known)
        plan, result = checker.check(tree)
        if wants is not None:
            require_result(tree, result, wants)
        return Expression(text, tuple(known[name] for name in checker.names), result, plan)

    try:
        return read(text)
    except Refusal as refusal:
        fault = fault_of(text, refusal, read)
    raise ExpressionError(fault)


def canonical(value: object, condition: Condition) -> Value:
    """A fact as plans take it: NaN for a missing number, None for any other missing fact or a set of values."""
    if type(value) is float and condition.domain.type.python is float:
        return value + 0.0
    fact = read_fact(value, condition)
    if fact is None or isinstance(fact, Cell):
        return NAN if condition.domain.type.is_numeric else None
    return fact


def check_length(given: Any, condition: Condition, n_contexts: int) -> None:
    """Raise ContextError unless a column, where it is given, is so long."""
    if given is not None and len(given) != n_contexts:
        problem = f"the column has {plural(len(given), 'fact')}."
        raise ContextError(Fault(problem, plural(n_contexts, "fact"), place=Place(column=condition.name)))


# ---- whether a result fits its condition


def require_result(tree: Node, tree_type: Type, wants: Condition) -> None:
    """Raise Refusal when the values of a whole expression cannot be those of a condition.

    A number outside the condition's bounds is compared as it is, like a given one, so bounds are not needed. An angle takes any
    number and wraps it. A text whose values are not known is taken for an enum.
    """
    kind = wants.domain.type
    if not _fits(tree_type.kind, kind):
        raise _wrong_kind(tree, tree_type, wants)
    if kind.needs_values and tree_type.values is not None:
        for value in sorted(tree_type.values - wants.domain.known):
            raise _undeclared(tree, value, wants)
    if kind.has_unit and tree_type.unit and wants.unit and tree_type.unit != wants.unit:
        why = f"this is in {in_quotes(tree_type.unit)}, and {in_quotes(wants.name)} in {in_quotes(wants.unit)}"
        raise Refusal(tree.start, tree.stop, why, "one unit; a factor, as in * 3.6, takes a number out of its unit")


def _fits(kind: Kind, wants: Kind) -> bool:
    if wants.is_numeric:
        return kind.is_whole or (kind.is_numeric and not wants.is_whole)
    return kind.family is wants.family and kind.is_truth is wants.is_truth


def _wrong_kind(tree: Node, tree_type: Type, wants: Condition) -> Refusal:
    kind = wants.domain.type
    what = "not whole" if kind.is_whole and tree_type.is_number else tree_type.kind.value
    meant = None
    if kind.is_truth and isinstance(tree, Number):
        meant = {0.0: "False", 1.0: "True"}.get(tree.value)
    why = f"{in_quotes(wants.name) if wants.name else 'this place'} is of type {kind.name}, and this is {what}"
    return Refusal(tree.start, tree.stop, why, kind.result or kind.value, meant)


def _undeclared(tree: Node, value: str, wants: Condition) -> Refusal:
    known = wants.domain.values or ()
    place = next((node for node in _texts(tree) if node.value == value), tree)
    near = nearest(value, known)
    why = f"{in_quotes(value)} is not a declared value of {in_quotes(wants.name)}"
    meant = written_text(near) if near and isinstance(place, Text) else None
    return Refusal(place.start, place.stop, why, some(known), meant)


def _texts(node: Node) -> Iterator[Text]:
    if isinstance(node, Text):
        yield node
    for part in node.parts:
        yield from _texts(part)
