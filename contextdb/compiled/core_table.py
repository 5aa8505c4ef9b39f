"""A compiled table as the core takes it: its conditions, columns and programs, over the arrays that it has already."""

from __future__ import annotations

import operator
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from contextdb.bitmask import Words
from contextdb.cells.conditions import Condition
from contextdb.cells.facts import UNKNOWN_MODES, Unknown, read_fact
from contextdb.cells.kinds import KINDS, Kind
from contextdb.cells.sets import TagMeet, TagSet
from contextdb.compiled.classes import ColumnMasks, NumberMasks, ValueMasks, WideMasks
from contextdb.compiled.layers import SoftMasks
from contextdb.compiled.matches import Answering, Matches
from contextdb.core import FLAT, SLOTS, VALUE, WIDE, Table
from contextdb.errors import ContextError

if TYPE_CHECKING:
    from contextdb.expressions import Derivation
    from contextdb.expressions.programs import Programs
    from contextdb.expressions.rules import WhenRules


class Unusual(Exception):
    """A fact is missing, or is a set of values."""


UNUSUAL = (
    Unusual,  # a fact of tags that is a set of values
    ContextError,  # a wrong fact where facts are read one by one
    KeyError,  # a mapping without a fact
    TypeError,  # a wrong type, one that cannot be hashed
    ValueError,  # Decimal("sNaN"), an int past all doubles, a text that is no UTF-8
    RuntimeError,  # a tensor of several numbers
)
"""What an unusual fact raises while it is read: the careful way then answers it or says what is wrong."""

TYPES = {name: number for number, name in enumerate(KINDS)}
"""The types of conditions by their numbers in the core, whose types.h has the same order."""

UNKNOWN: dict[Unknown, int] = {mode: number for number, mode in enumerate(UNKNOWN_MODES)}  # type: ignore[misc]
"""What a missing fact does, by its number in the core."""

Column = tuple[Condition, ColumnMasks]


def core_table(
    columns: Sequence[Column],
    enabled: Words,
    answering: Answering,
    derivation: Derivation | None,
    when: WhenRules | None,
    soft: Sequence[SoftMasks | None] | None = None,
) -> Table:
    """The table that answers contexts; one that leaves all of them to the careful way where a text is one that C cannot hold.
    Raises ValueError where parts do not go together, as those of a damaged file may."""
    names = {c.name for c, _ in columns}
    programs = _programs_of(derivation, when)
    others = [c for c in programs.facts.values() if c.name not in names] if programs else []
    derived = derivation.names if derivation else frozenset()
    conditions = tuple(
        _condition(c, c.name in derived, m, s) for (c, m), s in zip(columns, soft or [None] * len(columns), strict=True)
    )
    conditions += tuple(_condition(c, c.name in derived) for c in others)
    own = () if programs is None else _programs(programs)
    n_rows = len(answering.assets)
    if not all(map(_is_c_text, _texts((conditions, own)))):
        all_names = tuple(c.name for c in (*(c for c, _ in columns), *others) if c.name not in derived)
        return Table(Matches, answering, UNUSUAL, n_rows, None, all_names, None)
    return Table(Matches, answering, UNUSUAL, n_rows, _array(enabled, np.uint64), conditions, own or None)


def values_of(condition: Condition) -> tuple[str, ...]:
    """The declared values of a condition; of tags also those above them, which a fact may hold too."""
    values = condition.domain.values or ()
    if not condition.domain.type.is_tags:
        return values
    return tuple(dict.fromkeys(tag for value in values for tag in _with_those_above(value)))


def _with_those_above(tag: str) -> Iterator[str]:
    parts = tag.split(".")
    return (".".join(parts[: n + 1]) for n in range(len(parts)))


def _condition(
    condition: Condition, is_derived: bool, masks: ColumnMasks | None = None, soft: SoftMasks | None = None
) -> tuple[object, ...]:
    kind = condition.domain.type
    values = tuple(sys.intern(str(value)) for value in values_of(condition))  # as those of a game's code are
    if values and kind.is_tags:
        values = ("", *values)
    numbers: dict[Any, int] | None = {value: number for number, value in enumerate((False, True) if kind.is_truth else values)}
    expr = (condition.expr or "") if is_derived else None
    read, column = _reader(condition, kind), None if masks is None else _column(masks)
    costing = None if soft is None else (_column(soft.masks), _array(soft.penalties, np.float64), *_growth(soft))
    return sys.intern(str(condition.name)), TYPES[kind.name], expr, values, numbers or None, read, column, costing


def _growth(soft: SoftMasks) -> tuple[object, ...]:
    if soft.growth is None:
        return ()
    types = (np.float64, np.int64, np.float64, np.int32)
    return tuple(_array(array.reshape(-1), dtype) for array, dtype in zip(soft.growth.arrays, types, strict=True))


def _reader(condition: Condition, kind: Kind) -> Callable[[Any], object] | None:
    """What makes a plain fact of another one, or raises one of `UNUSUAL`; None where there is nothing to make one of."""
    if kind.is_tags:
        return partial(_tags, condition=condition)
    if not kind.is_numeric:
        return None
    return operator.index if kind.exact is operator.index else kind.exact or kind.from_python


def _tags(value: object, condition: Condition) -> frozenset[str]:
    tags = read_fact(value, condition)
    if not isinstance(tags, frozenset):
        raise Unusual
    return tags


def _column(masks: ColumnMasks) -> tuple[object, ...]:
    if isinstance(masks, WideMasks):
        layers = [_array(part, np.uint64) for part in (masks.low, masks.high, masks.any_mask)]
        return WIDE, masks.shift, (_array(masks.bounds, np.float64), *layers), (), ()
    own = _array(masks.masks, np.uint64)
    if isinstance(masks, NumberMasks):
        return FLAT, 0, (_array(masks.bounds, np.float64), own), (), ()
    if isinstance(masks, ValueMasks):
        return VALUE, 0, (own,), masks.values if masks.has_others else (), ()
    return SLOTS, 0, (own,), masks.tags, tuple(map(_slot, masks.negated))


def _slot(tags: TagSet) -> tuple[tuple[tuple[str, ...], tuple[str, ...], bool], ...]:
    if isinstance(tags, TagMeet):
        return tuple((tuple(sorted(p.needs)), tuple(sorted(p.bans)), p.is_complement) for p in tags.parts)
    return ((tuple(sorted(tags.needs)), tuple(sorted(tags.bans)), True),)


def _programs_of(derivation: Derivation | None, when: WhenRules | None) -> Programs | None:
    if derivation is None and when is None:  # loads nothing that a plain table does not need
        return None
    from contextdb.compiled.programs import programs_of

    return programs_of(derivation, when)


def _programs(programs: Programs) -> tuple[object, ...]:
    names = tuple(programs.facts)
    types = tuple(c.domain.kind for c in programs.facts.values())
    return tuple(programs.texts), names, types, programs.numbers_array, programs.code_array, *programs.places


def _array(array: Any, dtype: type) -> Any:
    """The array itself, or one that is aligned and without gaps."""
    return np.require(array, dtype, ["C", "A"])


def _texts(parts: object) -> Iterable[str]:
    if isinstance(parts, str):
        yield parts
    elif isinstance(parts, tuple):
        for part in parts:
            yield from _texts(part)


def _is_c_text(text: str) -> bool:
    return (text.isascii() and "\0" not in text) or _is_utf8(text)


def _is_utf8(text: str) -> bool:
    try:
        return b"\0" not in text.encode("utf-8")
    except UnicodeEncodeError:
        return False
