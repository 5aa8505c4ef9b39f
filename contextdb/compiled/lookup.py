"""From a context to the bits of its rows, as fast as Python goes: one generated function a table.

Reading thirty facts from a dict costs more than intersecting thirty masks, so the work is in the reading. Columns with few values
are joined (`contextdb.compiled.groups`), a nested dict for each group, whose leaves are the masks already intersected:
`g0[c['a']][c['b']]`. Numbers are bisected.

A number that is no float of Python's own is made one by the function that the careful way calls: a float32 would else be
compared in its own precision.

The function knows only the straight way. A missing fact, NaN, a wrong type, a set of values, a number past 2**53: everything
unusual ends in one of the exceptions of `UNUSUAL`, and the caller then takes the careful way, which says what is wrong or answers
it. Any other exception is a fault of ours and comes out as it is.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Mapping, Sequence
from itertools import product
from operator import itemgetter
from typing import Any

from contextdb.cells.conditions import Condition
from contextdb.cells.facts import read_fact
from contextdb.cells.kinds import Kind
from contextdb.compiled.classes import ColumnMasks, NumberMasks, TagMasks, ValueMasks, WideMasks
from contextdb.compiled.groups import groups_of
from contextdb.compiled.matches import Answering, Matches
from contextdb.compiled.ruler import ruler_of
from contextdb.errors import ContextError
from contextdb.expressions.rules import WhenRules
from contextdb.expressions.rules.rules import Unusual

EXACT = 2.0**53
"""Below this every whole number is a double, so an int and a double compare as two doubles do."""

MOST_TAG_SETS = 4096

UNUSUAL = (
    Unusual,  # a number far out, an open rule
    ContextError,  # a wrong fact where facts are read one by one: tags, rules, derived facts
    KeyError,  # a missing fact, a value that no class has
    TypeError,  # a wrong type, one that cannot be hashed, and the mask None
    ValueError,  # Decimal("sNaN"), an int past all doubles
    RuntimeError,  # a tensor of several numbers
)
"""What an unusual fact raises on the straight way."""

_ASK = """
def ask(c, {names}):
    answer = new(Matches)
    answer.bits = {terms}
    answer._table = answering
    answer._rows = None{kept}
    return answer
"""

Column = tuple[Condition, ColumnMasks]
StraightAsk = Callable[[Mapping[str, object]], Matches]
Keep = Callable[[Mapping[str, object]], dict[str, object]]
Find = Callable[[Any], int | None]
SingleLookup = tuple[Find | None, Any]


def build_ask(columns: Sequence[Column], enabled: int, answering: Answering, keep: Keep | None = None) -> StraightAsk:
    """A function from a context to its answer; raises one of `UNUSUAL` when a fact is unusual.

    With `keep`, which copies a context, the answer knows the facts it was asked with, for the answer in a mirror.
    """
    n_rows = len(answering.assets)
    names: dict[str, Any] = {"bisect_right": bisect_right}
    names |= {"new": object.__new__, "Matches": Matches, "answering": answering}
    values = _value_terms([(c, m) for c, m in columns if isinstance(m, ValueMasks)], n_rows, names)
    numbers = [_term(i, c, m, names) for i, (c, m) in enumerate(columns) if not isinstance(m, ValueMasks)]
    if enabled != (1 << n_rows) - 1 or not values:
        names["enabled"] = enabled
        values.append("enabled")
    # Every fact is looked up, also when no row is left: a missing one is an error whatever the others say.
    names |= {"keep": keep} if keep is not None else {}
    kept = "\n    answer._mirrored = keep(c)" if keep is not None else ""
    source = _ASK.format(names=", ".join(f"{n}={n}" for n in names), terms=" & ".join(values + numbers), kept=kept)
    exec(compile(source, "<contextdb lookup>", "exec"), names)
    ask: StraightAsk = names["ask"]
    return ask


def ruled_ask(ask: StraightAsk, when: WhenRules, answering: Answering) -> StraightAsk:
    """Ask, then take out the rows whose rule does not hold. The facts of rules are read also where no row is left: a missing one is
    an error whatever the others say."""

    def asked(context: Mapping[str, object]) -> Matches:
        answer, values = ask(context), when.usual_values(context)
        left = when.left(answer.bits, values) if answer.bits & when.rows else answer.bits
        return answer if left == answer.bits else Matches(left, answering)

    return asked


def _value_terms(columns: Sequence[tuple[Condition, ValueMasks]], n_rows: int, names: dict[str, Any]) -> list[str]:
    """One term for each group of columns: a pair as a dict of dicts, more as a dict by tuples."""
    terms = []
    for i, places in enumerate(groups_of([len(m.masks) - 1 for _, m in columns], n_rows)):
        group = [columns[p] for p in places]
        members = [m for _, m in group]
        keys = [c.name for c, _ in group]
        terms.append(_group_term(i, keys, members, names, _joint_masks(members)))
    return terms


def _group_term(i: int, keys: Sequence[str], members: Sequence[ValueMasks], names: dict[str, Any], leaves: Sequence[Any]) -> str:
    """The term that looks up a group's leaf by its facts; leaves are in the order of the joint classes, the last column fastest."""
    if len(members) > 2 and not any(m.has_others for m in members):
        names[f"g{i}"] = dict(zip(product(*(m.values for m in members)), leaves, strict=True))
        names[f"k{i}"] = itemgetter(*keys)
        return f"g{i}[k{i}(c)]"
    names[f"g{i}"] = _nested(members, leaves)
    return f"g{i}" + "".join(f"[c[{key!r}]]" for key in keys)


def _term(i: int, condition: Condition, masks: NumberMasks | WideMasks | TagMasks, names: dict[str, Any]) -> str:
    fact = f"c[{condition.name!r}]"
    if isinstance(masks, NumberMasks):
        return _number_term(i, condition, masks, fact, names)
    names[f"f{i}"] = _careful_lookup(condition, masks)
    return f"f{i}({fact})"


def _number_term(i: int, condition: Condition, masks: NumberMasks, fact: str, names: dict[str, Any]) -> str:
    bounds, found = _straight(condition, masks)
    kind = condition.domain.type
    ruler = None
    if kind.exact is None:
        if kind.is_circular not in masks.rulers:
            masks.rulers[kind.is_circular] = ruler_of(bounds, found)
        ruler = masks.rulers[kind.is_circular]
    if ruler is not None:
        names[f"l{i}"], names[f"m{i}"], names[f"f{i}"] = ruler.lasts, ruler.masks, _bisecting(bounds, found, kind.from_python)
        is_on = f"0.0 <= (y := x * {ruler.per_unit!r} - {ruler.start!r}) < {len(ruler.lasts)}.0 and x >= l{i}[k := int(y)]"
        return f"(m{i}[k] if type(x := {fact}) is float and {is_on} else f{i}(x))"
    names[f"b{i}"], names[f"m{i}"] = bounds, found
    return f"m{i}[bisect_right(b{i}, {_exact(i, kind, fact, names)})]"


def _bisecting(bounds: list[float], masks: list[int | None], double: Callable[[Any], Any]) -> Find:
    return lambda fact: masks[bisect_right(bounds, double(fact))]


def single_lookup(condition: Condition, masks: ColumnMasks) -> SingleLookup:
    """What finds the mask of one fact: a function, or None and the masks by value.

    An unusual fact finds None or raises one of `UNUSUAL`.
    """
    if isinstance(masks, ValueMasks):
        return None, _leaves(masks, masks.ints)
    if not isinstance(masks, NumberMasks):
        return _careful_lookup(condition, masks), None
    names: dict[str, Any] = {"bisect_right": bisect_right}
    term = _number_term(0, condition, masks, "fact", names)
    found: dict[str, Any] = {}
    exec(
        compile(f"def find(fact, {', '.join(f'{n}={n}' for n in names)}): return {term}", "<contextdb lookup>", "exec"),
        names,
        found,
    )
    return found["find"], None


def _exact(i: int, kind: Kind, fact: str, names: dict[str, Any]) -> str:
    """The term that makes a double of a fact, or raises."""
    names[f"e{i}"] = kind.exact or kind.from_python
    return f"e{i}({fact})" if kind.exact is not None else f"(x if type(x := {fact}) is float else e{i}(x))"


def _careful_lookup(condition: Condition, masks: WideMasks | TagMasks) -> Callable[[Any], int]:
    return _tag_lookup(condition, masks) if isinstance(masks, TagMasks) else _wide_lookup(condition, masks)


class _TextLeaves(dict[Any, Any]):
    """The leaves of a text column: a text that no cell names finds the class of all others."""

    others: Any

    def __missing__(self, key: object) -> Any:
        if isinstance(key, str):
            return self.others
        raise KeyError(key)


def _leaves(masks: ValueMasks, leaves: Sequence[Any]) -> dict[Any, Any]:
    if not masks.has_others:
        return dict(zip(masks.values, leaves, strict=False))
    found = _TextLeaves(zip(masks.values, leaves, strict=False))
    found.others = leaves[len(masks.values)]
    return found


def _nested(members: Sequence[ValueMasks], leaves: Sequence[Any]) -> Any:
    """A group's leaves by the values of its columns: dicts in dicts."""
    head, rest = members[0], members[1:]
    n_classes = len(head.masks) - 1
    size = len(leaves) // n_classes
    parts = [leaves[k * size : (k + 1) * size] for k in range(n_classes)]
    return _leaves(head, [_nested(rest, part) for part in parts] if rest else leaves)


def _joint_masks(members: Sequence[ValueMasks]) -> list[int]:
    """The mask of every joint class, the last column's class fastest."""
    bits = [-1]
    for masks in members:
        bits = [b & mask for b in bits for mask in masks.ints[:-1]]
    return bits


def _straight(condition: Condition, masks: NumberMasks) -> tuple[list[float], list[int | None]]:
    """Bounds to bisect in and the mask of each interval between; None, which no `&` takes, where the careful way must decide.

    Angles are laid out three times round the circle, so that -540 up to 540 need no wrapping: the shifts by 360 are exact there.
    """
    inner = masks.ints[:-1]
    if condition.domain.type.is_circular:
        turns = [b for base in (-360.0, 0.0, 360.0) for b in (base - 180.0, *(_shifted(b, base) for b in masks.bound_list))]
        return [*turns, 540.0], [None, *inner, *inner, *inner, None]
    bounds = masks.bound_list
    first, last = bisect_right(bounds, -EXACT), bisect_left(bounds, EXACT)
    return [-EXACT, *bounds[first:last], EXACT], [None, *inner[first : last + 1], None]


def _shifted(bound: float, turn: float) -> float:
    """The first double x with x - turn >= bound, the difference taken exactly."""
    near = bound + turn
    while near - turn < bound:
        near = math.nextafter(near, math.inf)
    while math.nextafter(near, -math.inf) - turn >= bound:
        near = math.nextafter(near, -math.inf)
    return near


def _wide_lookup(condition: Condition, masks: WideMasks) -> Callable[[Any], int]:
    bounds, exact = masks.bound_list, condition.domain.type.exact or condition.domain.type.from_python
    low, high = (-180.0, 180.0) if condition.domain.type.is_circular else (-EXACT, EXACT)

    def lookup(fact: Any) -> int:
        value = exact(fact)
        if value is None or not low <= value < high:
            raise Unusual
        return masks.bits(bisect_right(bounds, value))

    return lookup


def _tag_lookup(condition: Condition, masks: TagMasks) -> Callable[[Any], int]:
    """Tag sets recur, so the mask of each that was found right is kept."""
    known: dict[frozenset[str], int] = {}
    everything = (1 << masks.n_rows) - 1

    def lookup(fact: Any) -> int:
        bits = known.get(frozenset(fact)) if isinstance(fact, (frozenset, set)) else None
        if bits is None:
            tags = read_fact(fact, condition)
            if not isinstance(tags, frozenset):
                raise Unusual
            bits = everything
            for code in masks.codes(tags):
                bits &= masks.ints[code]
            if len(known) >= MOST_TAG_SETS:
                known.clear()
            known[tags] = bits
        return bits

    return lookup
