"""Random expressions, each with a function of its own that tells its value: Python's arithmetic, and None for what is missing."""

import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from hypothesis import strategies as st

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import ANGLE, BOOL, INT, NUMBER, TEXT, Domain
from contextdb.cells.intervals import wrap_angle

GAITS = ("Walk", "Run", "Idle")
TAGS = ("InAir", "Move.Run", "Move.Walk")
WORDS = ("ball", "Walk", 'a "b"')
CONDITIONS = {
    c.name: c
    for c in (
        Condition("a", NUMBER),
        Condition("Role.b", Domain("number", None, -5.0, 5.0)),
        Condition("n", INT),
        Condition("h", ANGLE),
        Condition("other heading", ANGLE),
        Condition("p", BOOL),
        Condition("Role.q", BOOL),
        Condition("gait", Domain("enum", GAITS)),
        Condition("word", TEXT),
        Condition("tags", Domain("tags", TAGS)),
    )
}
COMPARE = {"==": operator.eq, "!=": operator.ne, "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}
ARITHMETIC = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "//": operator.floordiv,
    "%": operator.mod,
}
SPECIAL = (0.0, 1.0, -1.0, 0.1, 0.5, 2.5, -3.0, 180.0, -180.0, 90.0, 1e308, -1e308, 5e-324, 2.0**53 + 2, math.inf, -math.inf)

Facts = Mapping[str, Any]


@dataclass(frozen=True)
class Told:
    """An expression and its value in a context."""

    text: str
    value: Callable[[Facts], Any]


def finite(value: float) -> float | None:
    """A result of arithmetic: missing unless it is finite."""
    return value + 0.0 if math.isfinite(value) else None


def strictly(function: Callable[..., Any], *parts: Told) -> Callable[[Facts], Any]:
    """Missing where a part is missing."""

    def value(facts: Facts) -> Any:
        values = [part.value(facts) for part in parts]
        return None if None in values else function(*values)

    return value


def computed(function: Callable[..., float], *parts: Told) -> Callable[[Facts], Any]:
    """A number computed from numbers; missing where Python gives none."""

    def number(*values: float) -> float | None:
        try:
            return finite(function(*values))
        except (ZeroDivisionError, OverflowError, ValueError):
            return None

    return strictly(number, *parts)


def all_hold(answers: list[bool | None]) -> bool | None:
    """Kleene's `and`."""
    return False if False in answers else None if None in answers else True


def any_holds(answers: list[bool | None]) -> bool | None:
    """Kleene's `or`."""
    return True if True in answers else None if None in answers else False


def compared(sign: str, left: Told, right: Told, is_angle: tuple[bool, bool] = (False, False)) -> Callable[[Facts], Any]:
    """A comparison; angles are equal where they point the same way, and -180 is 180 where the angle must be the greater one."""

    def holds(a: Any, b: Any) -> bool:
        if sign in ("==", "!=") and any(is_angle):
            a, b = (wrap_angle(v) if math.isfinite(v) else v for v in (a, b))
        elif is_angle[0] and sign[0] == ">":
            a = 180.0 if a == -180.0 else a
        elif is_angle[1] and sign[0] == "<":
            b = 180.0 if b == -180.0 else b
        return COMPARE[sign](a, b)

    return strictly(holds, left, right)


def named(name: str) -> Told:
    """A fact."""
    return Told(f"`{name}`" if " " in name else name, lambda facts: facts[name])


def literal(value: float | bool | str) -> Told:
    """A constant."""
    doubled = value.replace('"', '""') if isinstance(value, str) else ""
    return Told(f'"{doubled}"' if isinstance(value, str) else repr(value), lambda facts: value)


def chosen(parts: tuple[Told, Told, Told]) -> Told:
    then, condition, otherwise = parts

    def value(facts: Facts) -> Any:
        truth = condition.value(facts)
        return None if truth is None else then.value(facts) if truth else otherwise.value(facts)

    return Told(f"({then.text} if {condition.text} else {otherwise.text})", value)


def arithmetic(parts: tuple[Told, str, Told]) -> Told:
    left, sign, right = parts
    return Told(f"({left.text} {sign} {right.text})", computed(ARITHMETIC[sign], left, right))


def called(name: str, function: Callable[..., float]) -> Callable[[tuple[Told, ...]], Told]:
    return lambda parts: Told(f"{name}({', '.join(p.text for p in parts)})", computed(function, *parts))


LITERALS = st.sampled_from([0.0, 1.0, 2.0, 0.5, 3.25, 100.0]).map(literal)


@cache
def numbers(depth: int) -> st.SearchStrategy[Told]:
    """Expressions that give a number, not an angle."""
    leaf = st.one_of(LITERALS, st.sampled_from(["a", "Role.b", "n"]).map(named))
    if depth == 0:
        return leaf
    inner = numbers(depth - 1)
    any_number = st.one_of(inner, angles(0))
    return st.one_of(
        leaf,
        st.tuples(any_number, st.sampled_from(sorted(ARITHMETIC)), any_number).map(arithmetic),
        any_number.map(lambda x: Told(f"(-{x.text})", computed(operator.neg, x))),
        st.tuples(any_number).map(called("abs", abs)),
        st.tuples(any_number, any_number).map(called("min", min)),
        st.tuples(any_number, inner, inner).map(called("max", max)),
        st.tuples(any_number, inner, inner).map(called("clamp", lambda x, low, high: min(max(x, low), high))),
        st.tuples(inner).map(called("sqrt", math.sqrt)),
        st.tuples(inner).map(called("floor", lambda x: float(math.floor(x)))),
        st.tuples(inner).map(called("round", lambda x: float(round(x)))),
        st.tuples(inner, truths(depth - 1), inner).map(chosen),
    )


@cache
def angles(depth: int) -> st.SearchStrategy[Told]:
    """Expressions that give an angle."""
    leaf = st.sampled_from(["h", "other heading"]).map(named)
    if depth == 0:
        return leaf
    inner = angles(depth - 1)
    wrapped = st.tuples(numbers(depth - 1)).map(called("wrap_angle", wrap_angle))
    return st.one_of(leaf, wrapped, st.tuples(inner, truths(depth - 1), inner).map(chosen))


@cache
def texts(depth: int) -> st.SearchStrategy[Told]:
    """Expressions that give a text."""
    leaf = st.one_of(st.just(named("gait")), st.just(named("word")), st.sampled_from(GAITS).map(literal))
    if depth == 0:
        return leaf
    inner = texts(depth - 1)
    return st.one_of(leaf, st.tuples(inner, truths(depth - 1), inner).map(chosen))


@cache
def truths(depth: int) -> st.SearchStrategy[Told]:
    """Expressions that give True or False."""
    leaf = st.one_of(st.booleans().map(literal), st.sampled_from(["p", "Role.q"]).map(named))
    if depth == 0:
        return leaf
    inner, several = truths(depth - 1), st.lists(truths(depth - 1), min_size=2, max_size=3)
    return st.one_of(
        leaf,
        inner.map(lambda x: Told(f"(not {x.text})", strictly(operator.not_, x))),
        several.map(lambda xs: Told(f"({' and '.join(x.text for x in xs)})", lambda facts: all_hold([x.value(facts) for x in xs]))),
        several.map(lambda xs: Told(f"({' or '.join(x.text for x in xs)})", lambda facts: any_holds([x.value(facts) for x in xs]))),
        st.tuples(inner, inner, inner).map(chosen),
        *comparisons(depth),
    )


def comparisons(depth: int) -> list[st.SearchStrategy[Told]]:
    """Comparisons and memberships."""
    inner, signs, equality = numbers(depth - 1), st.sampled_from(sorted(COMPARE)), st.sampled_from(["==", "!="])
    return [
        st.tuples(inner, signs, inner, signs, inner).map(chain),
        st.tuples(angles(depth - 1), signs, inner.filter(lambda x: not is_number_text(x.text))).map(
            lambda p: Told(f"({p[0].text} {p[1]} {p[2].text})", compared(p[1], p[0], p[2], (True, False)))
        ),
        st.tuples(st.sampled_from([0.0, 180.0, -180.0, 45.0]).map(literal), signs, angles(depth - 1)).map(
            lambda p: Told(f"({p[0].text} {p[1]} {p[2].text})", compared(p[1], p[0], p[2], (False, True)))
        ),
        st.tuples(angles(depth - 1), equality, angles(depth - 1)).map(
            lambda p: Told(f"({p[0].text} {p[1]} {p[2].text})", compared(p[1], p[0], p[2], (True, True)))
        ),
        st.tuples(texts(depth - 1), equality, texts(depth - 1)).map(
            lambda p: Told(f"({p[0].text} {p[1]} {p[2].text})", compared(p[1], p[0], p[2]))
        ),
        st.tuples(inner, st.lists(st.sampled_from([0.0, 1.0, 2.5, -3.0]), min_size=1)).map(in_list),
        st.tuples(texts(depth - 1), st.lists(st.sampled_from(GAITS), min_size=1)).map(in_list),
        st.sampled_from(["InAir", "Move", "Move.Run"]).map(in_tags),
    ]


def is_number_text(text: str) -> bool:
    return text.replace(".", "").isdigit()


def chain(parts: tuple[Told, str, Told, str, Told]) -> Told:
    a, first, b, second, c = parts
    links = [compared(first, a, b), compared(second, b, c)]
    text = f"({a.text} {first} {b.text} {second} {c.text})"
    return Told(text, lambda facts: all_hold([link(facts) for link in links]))


def in_list(parts: tuple[Told, list[float] | list[str]]) -> Told:
    item, listed = parts
    written = ", ".join(literal(v).text for v in listed)
    return Told(f"({item.text} not in [{written}])", strictly(lambda value: value not in listed, item))


def in_tags(tag: str) -> Told:
    def has(tags: frozenset[str]) -> bool:
        return any(t == tag or t.startswith(tag + ".") for t in tags)

    return Told(f'("{tag}" in tags)', strictly(has, named("tags")))


def expressions(depth: int = 3) -> st.SearchStrategy[Told]:
    """Expressions of any type."""
    return st.one_of(truths(depth), numbers(depth), angles(depth), texts(depth))


NUMBERS = st.one_of(st.none(), st.sampled_from(SPECIAL), st.floats(-10, 10), st.floats(allow_nan=False)).map(
    lambda x: None if x is None else x + 0.0
)
HEADINGS = st.one_of(st.none(), st.sampled_from([0.0, -180.0, 90.0, -90.0, 45.0]), st.floats(-180, 180).map(wrap_angle))
WHOLE = st.one_of(st.none(), st.integers(-3, 3).map(float), st.sampled_from([2.0**53, -(2.0**53), 2.0**60, math.inf]))


def contexts() -> st.SearchStrategy[dict[str, Any]]:
    """Facts in canonical form, None where one is missing."""
    truth = st.sampled_from([None, False, True])
    return st.fixed_dictionaries(
        {
            "a": NUMBERS,
            "Role.b": NUMBERS,
            "n": WHOLE,
            "h": HEADINGS,
            "other heading": HEADINGS,
            "p": truth,
            "Role.q": truth,
            "gait": st.sampled_from([None, *GAITS]),
            "word": st.sampled_from([None, *WORDS]),
            "tags": st.one_of(st.none(), st.frozensets(st.sampled_from(TAGS))),
        }
    )
