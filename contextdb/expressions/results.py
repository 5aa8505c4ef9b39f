"""Whether what an expression computes fits the condition that it is computed for."""

from __future__ import annotations

from collections.abc import Iterator

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Kind
from contextdb.errors import in_quotes, nearest, some
from contextdb.expressions.faults import Refusal
from contextdb.expressions.membership import said
from contextdb.expressions.plan import Type
from contextdb.expressions.tokens import written_text
from contextdb.expressions.tree import Node, Number, Text

_FITS: dict[Kind, tuple[Kind, ...]] = {
    "bool": ("bool",),
    "int": ("int",),
    "number": ("int", "number", "angle"),
    "angle": ("int", "number", "angle"),
    "enum": ("enum", "text"),
    "text": ("enum", "text"),
    "tags": ("tags",),
}
_ACCEPTED = {
    "bool": "True or False: a comparison such as speed > 0",
    "int": "a whole number: round(x), floor(x) or ceil(x)",
    "enum": "one of its declared values in quotes",
}


def require_result(tree: Node, found: Type, wants: Condition) -> None:
    """Raise Refusal when the values of a whole expression cannot be those of a condition.

    A number outside the condition's bounds is compared as it is, like a given one, so bounds are not asked for. An angle takes any
    number and wraps it. A text whose values are not known is taken for an enum.
    """
    kind = wants.domain.kind
    if found.kind not in _FITS[kind]:
        raise _wrong_kind(tree, found, wants)
    if kind == "enum" and found.values is not None:
        for value in sorted(found.values - wants.domain.known):
            raise _undeclared(tree, value, wants)
    if kind in ("int", "number") and found.unit and wants.unit and found.unit != wants.unit:
        why = f"this is in {in_quotes(found.unit)}, and {in_quotes(wants.name)} in {in_quotes(wants.unit)}"
        raise Refusal(tree.start, tree.stop, why, "one unit; a factor, as in * 3.6, takes a number out of its unit")


def _wrong_kind(tree: Node, found: Type, wants: Condition) -> Refusal:
    kind = wants.domain.kind
    what = "not whole" if kind == "int" and found.is_number else said(found)
    meant = None
    if kind == "bool" and isinstance(tree, Number):
        meant = {0.0: "False", 1.0: "True"}.get(tree.value)
    why = f"{in_quotes(wants.name) if wants.name else 'this place'} is of type {kind}, and this is {what}"
    return Refusal(tree.start, tree.stop, why, _ACCEPTED.get(kind, said(Type(kind))), meant)


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
