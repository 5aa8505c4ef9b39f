"""Whether what an expression computes fits the condition that it is computed for."""

from __future__ import annotations

from collections.abc import Iterator

from contextdb.cells.conditions import Condition
from contextdb.cells.kinds import Kind
from contextdb.errors import in_quotes, nearest, some
from contextdb.expressions.faults import Refusal
from contextdb.expressions.plan import Type
from contextdb.expressions.tokens import written_text
from contextdb.expressions.tree import Node, Number, Text


def require_result(tree: Node, found: Type, wants: Condition) -> None:
    """Raise Refusal when the values of a whole expression cannot be those of a condition.

    A number outside the condition's bounds is compared as it is, like a given one, so bounds are not asked for. An angle takes any
    number and wraps it. A text whose values are not known is taken for an enum.
    """
    kind = wants.domain.type
    if not _fits(found.kind, kind):
        raise _wrong_kind(tree, found, wants)
    if kind.needs_values and found.values is not None:
        for value in sorted(found.values - wants.domain.known):
            raise _undeclared(tree, value, wants)
    if kind.has_unit and found.unit and wants.unit and found.unit != wants.unit:
        why = f"this is in {in_quotes(found.unit)}, and {in_quotes(wants.name)} in {in_quotes(wants.unit)}"
        raise Refusal(tree.start, tree.stop, why, "one unit; a factor, as in * 3.6, takes a number out of its unit")


def _fits(found: Kind, wants: Kind) -> bool:
    if wants.is_numeric:
        return found.is_whole or (found.is_numeric and not wants.is_whole)
    return found.family is wants.family and found.is_truth is wants.is_truth


def _wrong_kind(tree: Node, found: Type, wants: Condition) -> Refusal:
    kind = wants.domain.type
    what = "not whole" if kind.is_whole and found.is_number else found.kind.value
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
