"""What may be after `in`: a list of constants, the tags of a fact, or the text of a cell; and after `like`: a pattern. Each becomes
a cell that is asked.

gait in ["Walk", "Run"]      "InAir" in Defender.Tags      heading in "170..-170"      gait like "Walk*"
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase

from contextdb.cells import intervals
from contextdb.cells.conditions import Condition
from contextdb.cells.domains import TEXT, Domain
from contextdb.cells.grammar import parse_cell
from contextdb.cells.intervals import wrap_angle
from contextdb.cells.kinds import KINDS, Kind
from contextdb.cells.sets import Accepted, Cell, NumberSet, TagSet, ValueSet, covers
from contextdb.errors import CellError, in_quotes, nearest, some
from contextdb.expressions.plan import Const, Given, Held, Part, Type
from contextdb.expressions.tokens import Refusal, written_text
from contextdb.expressions.tree import Likeness, Membership, Node, Text

Choice = tuple[Node, Part, Type]

SPELT = {name: kind for name, kind in KINDS.items() if kind.is_spelt}
"""The types that spell their numbers as texts: each is a function that makes a number of a text."""
_AFTER_IN = 'a list such as ["Walk", "Run"], a fact of type tags, or a cell such as "0..5"'


def require_value(node: Node, other: Type) -> None:
    """Raise Refusal when a text is compared with an enum that has no such value."""
    if not isinstance(node, Text) or not other.kind.needs_values or other.values is None or node.value in other.values:
        return
    raise _undeclared(node, node.value, sorted(other.values), "value")


def holding(node: Membership, item: tuple[Part, Type], choices: Sequence[Choice], conditions: Mapping[str, Condition]) -> Held:
    """The plan of `item in choices`. Raises Refusal where what is after `in` does not fit the item."""
    if isinstance(node.choices, tuple):
        return Held(item[0], Cell(_listed(node, item[1], choices)))
    choice, plan, choice_type = choices[0]
    if choice_type.kind.is_tags:
        return Held(plan, Cell(_tag(node.item, item[0], plan, conditions)))
    if not isinstance(choice, Text):
        raise Refusal(choice.start, choice.stop, f'after "in" is {choice_type.kind.value}', _AFTER_IN)
    if isinstance(item[0], Const):
        raise Refusal(node.start, node.stop, 'there is no fact before or after "in"', 'a fact: speed in "0..5", "InAir" in Tags')
    return Held(item[0], _cell(choice, _domain(*item, conditions)))


def matching(node: Likeness, item: Part, conditions: Mapping[str, Condition]) -> Held:
    """The plan of `item like pattern`: the values that match, as names of files do. Raises Refusal where they are not known."""
    domain = conditions[item.name].domain if isinstance(item, Given) else None
    if domain is None or domain.values is None or domain.type.is_tags:
        why = 'before "like" is nothing whose values are known'
        raise Refusal(node.item.start, node.item.stop, why, 'a fact of type enum, or in a contract asset: asset like "carry*"')
    if not isinstance(node.pattern, Text):
        raise Refusal(node.pattern.start, node.pattern.stop, 'after "like" is no text', 'a pattern in quotes: "carry*"')
    values = frozenset(value for value in domain.values if fnmatchcase(value, node.pattern.value))
    if domain.type.needs_values and not values:
        why = f"no declared value is like {in_quotes(node.pattern.value)}"
        raise Refusal(node.pattern.start, node.pattern.stop, why, some(domain.values))
    return Held(item, Cell(ValueSet(values)))


def spelt(node: Text, kind: Kind) -> tuple[Part, Type]:
    """A text as the number of a type that spells its numbers as texts."""
    cell = _cell(node, Domain(kind.name), kind.result)
    spans = cell.accepts.spans if isinstance(cell.accepts, NumberSet) else ()
    if len(spans) != 1 or spans[0][0] != spans[0][1]:
        raise Refusal(node.start, node.stop, f"{in_quotes(node.value)} is not {kind.value}", kind.result)
    return Const(spans[0][0]), Type(kind)


def spelt_alike(parts: Sequence[Choice]) -> list[tuple[Part, Type]]:
    """Parts that are compared; texts beside numbers that are spelt as texts become numbers."""
    kind = next((part_type.kind for _, _, part_type in parts if part_type.kind.is_spelt), None)
    return [spelt(n, kind) if kind and isinstance(n, Text) else (plan, part_type) for n, plan, part_type in parts]


def _listed(node: Membership, item: Type, choices: Sequence[Choice]) -> Accepted:
    if item.kind.is_spelt:
        choices = [(n, *(spelt(n, item.kind) if isinstance(n, Text) else (plan, choice_type))) for n, plan, choice_type in choices]
    if item.kind.is_tags or not choices:
        what = "a set of tags is in no list" if choices else "the list is empty"
        raise Refusal(node.start, node.stop, what, '"InAir" in Tags' if choices else 'gait in ["Walk", "Run"]')
    values = [_constant(item, *choice) for choice in choices]
    if not item.is_number:
        return ValueSet(frozenset(v for v in values if isinstance(v, (str, bool))))
    numbers = [float(v) for v in values]
    if item.kind.is_circular:
        numbers = [wrap_angle(v) for v in numbers]
    spans = intervals.union((v, v) for v in numbers)
    return NumberSet(item.kind.fitted(spans), item.kind.is_circular)


def _constant(item: Type, choice: Node, plan: Part, choice_type: Type) -> float | str | bool:
    is_alike = (item.is_number and choice_type.is_number) or (item.is_text and choice_type.is_text) or item.kind is choice_type.kind
    if not is_alike:
        raise Refusal(
            choice.start, choice.stop, f"{item.kind.value} is looked for, and this is {choice_type.kind.value}", item.kind.value
        )
    if not isinstance(plan, Const):
        raise Refusal(choice.start, choice.stop, "a list holds constants", "a == b or a == c for facts")
    require_value(choice, item)
    return plan.value


def _tag(node: Node, item: Part, tags: Part, conditions: Mapping[str, Condition]) -> TagSet:
    if not isinstance(node, Text) or not isinstance(item, Const):
        raise Refusal(node.start, node.stop, "a tag is written out", 'a text in quotes: "InAir" in Tags')
    domain = conditions[tags.name].domain if isinstance(tags, Given) else None
    if domain and domain.values is not None and not covers(node.value, domain.known):
        raise _undeclared(node, node.value, domain.values, "tag")
    return TagSet(frozenset((node.value,)))


def _undeclared(node: Node, value: str, known: Sequence[str], what: str) -> Refusal:
    near = nearest(value, known)
    why = f"{in_quotes(value)} is not a declared {what}"
    return Refusal(node.start, node.stop, why, some(known), written_text(near) if near else None)


def _domain(item: Part, item_type: Type, conditions: Mapping[str, Condition]) -> Domain:
    if isinstance(item, Given):
        return conditions[item.name].domain
    return TEXT if item_type.is_text else Domain(item_type.kind.name)


def _cell(node: Text, domain: Domain, accepted: str = "") -> Cell:
    try:
        cell = parse_cell(node.value, domain)
    except CellError as error:
        fault = error.faults[0]
        raise Refusal(node.start, node.stop, fault.found.rstrip("."), accepted or fault.accepted, fault.mend or None) from None
    if cell.is_soft or cell.is_empty:
        why = "a cell here has no penalty" if cell.is_soft else "no value is in this cell"
        raise Refusal(node.start, node.stop, why, domain.type.cells)
    return cell
