"""Facts: what the game says of a moment, read and checked against the conditions.

A fact is one value of a condition's domain, or a *set* of its values, written as a cell. None and NaN are missing facts. What is
read here is in canonical form: bool, float (whole for int, in [-180, 180) for angle), str, frozenset of tags, or a `Cell` for a
set.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from contextdb.cells.arguments import require_text, text_of
from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.grammar import parse_cell, parse_tags
from contextdb.cells.intervals import EVERYTHING, wrap_angle
from contextdb.cells.sets import SET_OF, Cell, NumberSet, ValueSet, covers
from contextdb.cells.words import quoted, truth_of
from contextdb.errors import (
    CellError,
    ContextError,
    Fault,
    NoSuchFact,
    Place,
    folded,
    in_quotes,
    mend_for,
    nearest,
    no_such,
    plural,
    safe_text,
    some,
)

Unknown = Literal["error", "any", "never"]
Fact = bool | float | str | frozenset[str] | Cell | None
Context = Mapping[str, object]

NAMES = "the names of the table's conditions"
UNKNOWN_MODES = ("error", "any", "never")


@dataclass(frozen=True, slots=True)
class FactSet:
    """A set of values for a fact, written as a cell: `cdb.cell("0 ± 90")`. Read when the condition is known."""

    text: str


def cell(text: str) -> FactSet:
    """A fact that is a set of values, written like a cell: `query({"heading": cell("0 ± 90")})`.

    Raises ContextError for what is no text. The text is read by the query, which raises ContextError where it cannot be.
    """
    return FactSet(require_text(text, "text"))


def check_mode(unknown: str) -> None:
    """Raise ContextError unless `unknown` is a treatment of missing facts."""
    if not isinstance(unknown, str) or unknown not in UNKNOWN_MODES:
        problem = f"there is no treatment {in_quotes(str(unknown))} of missing facts."
        raise ContextError(Fault(problem, some(UNKNOWN_MODES), mend_for(str(unknown), UNKNOWN_MODES)))


def no_condition(name: str, known: Iterable[str]) -> NoSuchFact:
    """The error for a fact that no condition of the table is about."""
    return NoSuchFact(no_such("condition", name, known, rule="unknown-fact"))


def require_context(context: object) -> None:
    """Raise ContextError for what is no mapping."""
    if not isinstance(context, Mapping):
        raise ContextError(Fault(f"a context is a mapping of facts, not {type(context).__name__}.", "a dict"))


def require_names(context: Iterable[object]) -> None:
    """Raise ContextError for keys that are no texts."""
    for name in context:
        if not isinstance(name, str):
            problem = f"a context has the key {in_quotes(text_of(name))}, of type {type(name).__name__}."
            raise ContextError(Fault(problem, "the names of facts, as texts"))


def as_context(facts: object) -> Mapping[str, object]:
    """Facts given as a mapping or as pairs."""
    if not isinstance(facts, Mapping):
        try:
            facts = dict(facts)  # type: ignore[call-overload]
        except (TypeError, ValueError):
            require_context(facts)
    return facts  # type: ignore[return-value]


def read_fact(value: object, condition: Condition) -> Fact:
    """Bring one given fact into canonical form: bool, float, str, frozenset of str; None where it is missing (None or NaN), a Cell
    where it is a set of values. Raises ContextError for a value of the wrong type, or outside an enum's or tag's domain; it names
    the fact, what is accepted and the nearest value."""
    if value is None or (isinstance(value, (float, np.floating)) and math.isnan(value)):
        return None
    if isinstance(value, FactSet):
        return _read_set(value.text, condition)
    if isinstance(value, Cell):
        return _checked_set(value, condition)
    kind = condition.domain.type
    if kind.is_numeric:
        return _read_number(value, condition)
    if kind.is_truth:
        return _read_bool(value, condition)
    return _read_tags(value, condition) if kind.is_tags else _read_value(value, condition)


def read_fact_text(text: str, condition: Condition) -> Fact:
    """Bring a fact written as text (command line, CSV) into canonical form: a plain value, or a set written as a cell."""
    body = text.strip()
    kind = condition.domain.type
    if not body:
        return None
    if kind.is_truth:
        truth = truth_of(body)
        return truth if truth is not None else _read_set(body, condition)
    if kind.is_named:
        is_plain = (
            " " not in body and '"' not in body and body.casefold() != "any" if kind.is_open else body in condition.domain.known
        )
        return body if is_plain else _plain_if_single(_read_set(body, condition))
    if kind.is_tags:
        return _read_tags(body, condition)
    return _plain_if_single(_read_set(body, condition)) if body.casefold() != "nan" else None


def fact_text(value: object) -> str:
    """A fact as JSON has it, written so that `read_fact_text` gives it again."""
    if isinstance(value, list):
        return " ".join(map(quoted, value)) or '""'
    return quoted(value) if isinstance(value, str) else str(value)


def missing_error(missing: list[str], given: Iterable[str]) -> ContextError:
    """The error for facts that a query needs and did not get; a likely misspelling among the given ones is named."""
    extra = list(given)
    faults = []
    for name in missing[:1]:
        near = nearest(name, (n for n in extra if isinstance(n, str)))
        rest = f" ({plural(len(missing), 'fact')} missing: {some(missing)})" if len(missing) > 1 else ""
        problem = f"the fact {in_quotes(name)} is missing{rest}."
        hint = f"{in_quotes(name)} for {in_quotes(near)}" if near else ""
        faults.append(Fault(problem, 'a value for each condition, or unknown="any" or "never"', hint, rule="missing-fact"))
    return ContextError(*faults)


def misspelt(missing: list[str], extra: Iterable[str]) -> ContextError | None:
    """An error when a given name that no condition has is very likely a missing fact misspelt."""
    for name in (n for n in extra if isinstance(n, str)):
        near = nearest(name, missing)
        if near is not None and _is_slip(name, near):
            problem = f"there is no condition {in_quotes(name)}, and {in_quotes(near)} is missing."
            return ContextError(Fault(problem, NAMES, in_quotes(near), rule="unknown-fact"))
    return None


def alike(name: str, known: Iterable[str]) -> tuple[str, ...]:
    """The known names of which a given one is very likely a misspelling, the nearest first."""
    candidates = [n for n in known if _is_slip(name, n)]
    near = nearest(name, candidates)
    return tuple(sorted(candidates, key=lambda n: n != near))


def _is_slip(name: str, near: str) -> bool:
    return difflib.SequenceMatcher(None, folded(name), folded(near)).ratio() >= 0.85


def _fault(value: object, condition: Condition, mend: str = "", accepted: str = "") -> ContextError:
    what = f"{type(value).__name__} {in_quotes(text_of(value))}"
    expected = accepted or condition.domain.type.facts
    place = Place(column=condition.name)
    return ContextError(Fault(f"{what} is not a fact of type {condition.domain.kind}.", expected, mend, place, "wrong-fact"))


def _checked_set(cell: Cell, condition: Condition) -> Cell:
    """A set of values that was read before, if it is one of the condition's own kind."""
    accepts = SET_OF[condition.domain.type.family]
    if cell.accepts is None or (isinstance(cell.accepts, accepts) and not cell.is_soft and not cell.is_empty):
        return _within_limits(cell, condition)
    raise _fault(cell, condition, accepted=f"a set of values of type {condition.domain.kind}")


def _read_set(text: str, condition: Condition) -> Cell:
    try:
        cell = parse_cell(text, condition.domain)
    except CellError as error:
        raise ContextError(*(f.at(Place(column=condition.name)) for f in error.faults)) from None
    if cell.is_soft:
        raise _fault(text, condition, accepted='a set without a penalty ("~")')
    if cell.is_empty:
        raise _fault(text, condition, accepted="a set that holds at least one value")
    return _within_limits(cell, condition)


def _within_limits(cell: Cell, condition: Condition) -> Cell:
    """A set of facts without numbers that no fact of the type can be, such as days after the last of the calendar."""
    low, high = condition.domain.type.limits
    if (low, high) == EVERYTHING[0]:
        return cell
    spans = EVERYTHING if cell.accepts is None else cell.accepts.spans  # type: ignore[union-attr]
    return Cell(NumberSet(tuple((max(first, low), min(last, high)) for first, last in spans if first <= high and last >= low)))


def _plain_if_single(cell: Cell) -> Fact:
    """A set of one value as that value."""
    accepts = cell.accepts
    if isinstance(accepts, ValueSet) and len(accepts.values) == 1 and not accepts.is_complement:
        return next(iter(accepts.values))
    if isinstance(accepts, NumberSet) and len(accepts.spans) == 1 and accepts.spans[0][0] == accepts.spans[0][1]:
        return accepts.spans[0][0]
    return cell


def _read_number(value: object, condition: Condition) -> Fact:
    if isinstance(value, str):
        return _plain_if_single(_read_set(value, condition)) if value.strip() else None
    kind = condition.domain.type
    try:
        number = kind.from_python(value)
    except TypeError:
        raise _fault(value, condition) from None
    except ValueError as error:
        raise _fault(value, condition, accepted=str(error)) from None
    if number is None:
        return None
    if kind.is_circular:
        if math.isinf(number):
            raise _fault(value, condition)
        return wrap_angle(number)
    if kind.is_whole and not (number.is_integer() or math.isinf(number)):
        raise _fault(value, condition, mend=f"{round(number)}")
    return number


def _read_bool(value: object, condition: Condition) -> bool:
    is_number = isinstance(value, (int, float, np.number)) and not isinstance(value, np.timedelta64)
    if isinstance(value, (bool, np.bool_)) or (is_number and value in (0, 1)):
        return bool(value)
    truth = truth_of(value) if isinstance(value, str) else None
    raise _fault(value, condition, mend="" if truth is None else str(truth))


def _read_value(value: object, condition: Condition) -> Fact:
    if isinstance(value, (set, frozenset, list, tuple)) and value:
        values = [_read_one_value(v, condition) for v in value]
        return Cell(ValueSet(frozenset(values)))
    return _read_one_value(value, condition)


def _read_one_value(value: object, condition: Condition) -> str:
    if not isinstance(value, str):
        raise _fault(value, condition)
    if not condition.domain.type.is_open and value not in condition.domain.known:
        raise _unknown(value, condition)
    return str.__str__(value)  # what an enum member of type str says of itself is not its value


def _unknown(value: str, condition: Condition) -> ContextError:
    known = condition.domain.values or ()
    place = Place(column=condition.name)
    problem = f"{in_quotes(value)} is not a declared value."
    return ContextError(Fault(problem, some(known), mend_for(value, known), place, "wrong-fact"))


def _read_tags(value: object, condition: Condition) -> Fact:
    if isinstance(value, str):
        if value.strip().casefold() == "any" or value.lstrip()[:1] in ("+", "-") or value.strip().casefold().startswith("not "):
            return _read_set(value, condition)
        try:
            tags = parse_tags(value)
        except CellError as error:
            raise ContextError(*(f.at(Place(column=condition.name)) for f in error.faults)) from None
    elif isinstance(value, (set, frozenset, list, tuple)):
        tags = frozenset(str.__str__(t) if isinstance(t, str) else _not_a_tag(t, condition) for t in value)
    else:
        raise _fault(value, condition)
    for tag in sorted(tags):
        if condition.domain.values is not None and not covers(tag, condition.domain.known):
            raise _unknown(tag, condition)
    return tags


def _not_a_tag(value: object, condition: Condition) -> str:
    raise _fault(value, condition, accepted="a set of texts")


def describe(fact: Fact, domain: Domain) -> str:
    """A canonical fact of a domain as people write it."""
    if fact is None:
        return "(missing)"
    if isinstance(fact, frozenset):
        return " ".join(sorted(fact)) or "(no tags)"
    if isinstance(fact, bool) or not isinstance(fact, (int, float)):
        return safe_text(str(fact))
    return domain.type.spelling.write(180.0 if fact == -180.0 and domain.type.is_circular else fact)
