"""Examples for property tests: conditions, cells as people write them, tables, and facts close to where the answers change."""

import datetime
import inspect
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache, lru_cache
from itertools import product
from typing import Any, TypeVar

import numpy as np
import oracles
import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.facts import cell
from contextdb.cells.kinds import KINDS
from contextdb.schema.settings import EMPTY, TableSettings
from contextdb.tables.table import Table

T = TypeVar("T")
NAMES = ["CB", "FS", "Half Back", "Any", "not", "5", "-", 'say "no"', "A~2", "Move.Run", "a:b/c-d", "Größe", "1..2", "-x", "inf"]
TAGS = ["InAir", "Move", "Move.Run", "Move.Run.Fast", "Moved", "Half Way"]
CONDITIONS = ["speed", "Defender.Tags", "it's", 'a "b" c', "None"]
N_ROWS = [0, 1, 2, 63, 64, 65, 130]

NUMBERS = [0.0, -0.0, 0.1, 0.2, 0.1 + 0.2, 0.3, 1.0, 5.0, 9.99, 10.0, 20.0, 29.99, 16777217.0, 5e-324, 1e308, 2.0**53, math.inf]
WHOLE = [0.0, 1.0, 2.0, 3.0, 5.0, 10.0, 2.0**53 - 1, 2.0**53, 2.0**53 + 2, 1e300, math.inf]
ANGLES = [0.0, -0.0, 0.1, 5.0, 90.0, 179.99999999999997, 180.0, 185.0, 190.0, 350.0, 360.0, 365.0, 540.0, 725.0]

DATES = ["0001-01-01", "0001-01-02", "1969-12-31", "1970-01-01", "2024-02-29", "2026-01-01", "2026-03-31", "9999-12-31"]

ANY_TEXTS = st.sampled_from(["Any", "-", "", " any "])
ANY_SETS = st.sampled_from(["Any", "-", " any "])
INDEX = st.integers(0, 59)
BOOLEANS = st.booleans()
ON_CIRCLE = st.sampled_from([-180.0, -90.0, 0.0, 90.0, 180.0]) | st.floats(-180.0, 180.0)
NOTHING = {"int": "5..3", "date": "2026-02-02..2026-02-01", "number": "5..3", "angle": "(5..5)", "tags": "+Move.Run -Move"}
"""Cells that no fact matches, though each part of them could."""


IS_FULL = not settings.default.derandomize
"""Whether every state is tried, and not only a choice of them: see conftest.py."""


def some(states: Iterable[T], n: int = 2) -> list[T]:
    """Every n-th of the states, and all of them with EXAMPLES=full."""
    return list(states)[:: 1 if IS_FULL else n]


in_full_runs = pytest.mark.skipif(not IS_FULL, reason="with EXAMPLES=full: it takes seconds")
"""For a test that takes long, beside another one every day that would notice most faults of the same place."""


def for_each(*cases: Iterable[Any]) -> Callable[[Callable[..., None]], Callable[[], None]]:
    """One test of all cases, or of each with each of several lists: many that are short cost more as tests than what they check."""

    def over_all(test: Callable[..., None]) -> Callable[[], None]:
        n_arguments = len(inspect.signature(test).parameters)

        def of_all() -> None:
            for case in product(*cases):
                is_spread = len(case) < n_arguments
                arguments = [part for each in case for part in (each if is_spread and isinstance(each, tuple | list) else [each])]
                try:
                    test(*arguments)
                except Exception as error:
                    error.add_note(f"of {', '.join(map(repr, arguments))}")
                    raise

        of_all.__name__, of_all.__doc__ = test.__name__, test.__doc__
        return of_all

    return over_all


def examples(times: float, *unchecked: HealthCheck) -> settings:
    """So many times the examples that the profile asks for (see conftest.py), without some more of hypothesis' own checks."""
    profile = settings.default
    return settings(
        max_examples=math.ceil(times * profile.max_examples), suppress_health_check=[*profile.suppress_health_check, *unchecked]
    )


def one_of(*values: object) -> st.SearchStrategy:
    """One of a few values; the strategy is made once, which is most of the cost of drawing from it."""
    return _one_of(values)


@cache
def _one_of(values: Sequence[object]) -> st.SearchStrategy:
    return st.sampled_from(values)


# ---- conditions


@cache
@st.composite
def domains(draw: st.DrawFn, kinds: tuple[str, ...] = tuple(KINDS)) -> Domain:
    """A domain of any kind, with declared values or bounds where the kind can have them."""
    kind = draw(st.sampled_from(kinds))
    if kind == "enum":
        return Domain(kind, tuple(draw(st.lists(st.sampled_from(NAMES), min_size=1, max_size=5, unique=True))))
    if kind == "tags":
        return Domain(kind, draw(st.none() | st.just(tuple(TAGS))))
    if kind == "date":
        return Domain(kind, None, draw(one_of(-math.inf, 20454.0)), draw(one_of(math.inf, 20543.0)))  # 2026-01-01, 2026-03-31
    if kind in ("int", "number"):
        return Domain(kind, None, draw(one_of(-math.inf, -5.0, 0.0, 0.5)), draw(one_of(math.inf, 10.0, 2.5)))
    return Domain(kind)


# ---- cells as texts


@cache
def numbers(kind: str) -> st.SearchStrategy[float]:
    """Numbers for the cells of a kind, those where doubles misbehave more often than others."""
    special = {"int": WHOLE, "number": NUMBERS, "angle": ANGLES}[kind]
    signed = st.sampled_from([*special, *(-n for n in special)])
    if kind == "int":
        return signed | st.integers(-20, 20).map(float) | st.sampled_from([0.5, 2.5])
    return signed | st.integers(-400, 400).map(lambda n: n / 2) | st.floats(-1000.0, 1000.0)


@cache
@st.composite
def number_texts(draw: st.DrawFn, kind: str, is_finite: bool = False) -> str:
    """A number in one of the ways to write it."""
    if kind == "date":
        return draw(st.sampled_from(DATES) | st.dates(datetime.date(2025, 12, 28), datetime.date(2026, 4, 5)).map(str))
    value = draw(numbers(kind))
    if is_finite and math.isinf(value):
        value = 7.0
    forms = [repr(value), f"{value:.17g}", repr(value).removesuffix(".0")]
    forms += [] if forms[0][0] == "-" else ["+" + forms[0]]
    return forms[draw(INDEX) % len(forms)]


@cache
@st.composite
def intervals(draw: st.DrawFn, kind: str) -> str:
    """One part of a union of numbers."""
    form = draw(INDEX) % 5
    if form == 0:
        mark = draw(one_of(", ", ",", " ± ", "±", " +- "))
        tolerance = abs(float(draw(number_texts("number" if kind == "date" else kind, is_finite=True))))
        return draw(number_texts(kind, is_finite=True)) + mark + repr(tolerance)
    if form == 1:
        return draw(one_of("", "=", "= ")) + draw(number_texts(kind))
    one = repr(draw(ON_CIRCLE)) if kind == "angle" and form < 4 else draw(number_texts(kind))
    if form == 2:
        return draw(one_of("<", "<=", "> ", ">=")) + one
    if form == 3:
        return draw(one_of("{}..", "({}..", "[{} ..", "..{}", ".. {})", "..{}]")).format(one)
    left, dots, right = draw(one_of("", "(", "[ ")), draw(one_of("..", " .. ")), draw(one_of("", ")", " ]"))
    return left + one + dots + draw(number_texts(kind)) + right


@cache
def interval_lists(kind: str) -> st.SearchStrategy[list[str]]:
    return st.lists(intervals(kind), min_size=1, max_size=3)


def quoted(name: str, always: bool = False) -> str:
    """A name as a cell has it."""
    bare = name.replace(".", "").replace("_", "").isalpha() and name not in ("Any", "not", "inf")
    return name if bare and not always else '"' + name.replace('"', '""') + '"'


@cache
@st.composite
def name_lists(draw: st.DrawFn, domain: Domain) -> str:
    known = domain.values or NAMES
    chosen = draw(st.lists(st.sampled_from(known), min_size=1, max_size=3))
    return draw(one_of(" ", "  ")).join(quoted(n, draw(BOOLEANS)) for n in chosen)


def known_tags(domain: Domain) -> list[str]:
    return [tag for tag in TAGS if domain.values is None or oracles.has(tag, frozenset(domain.values))]


@cache
@st.composite
def tag_lists(draw: st.DrawFn, domain: Domain) -> str:
    chosen = draw(st.lists(st.sampled_from(known_tags(domain)), min_size=1, max_size=3))
    return " ".join(draw(one_of("+", "-")) + quoted(t) for t in chosen)


@cache
@st.composite
def sets(draw: st.DrawFn, domain: Domain) -> str:
    """A cell without a penalty: what may stand in a table and in a set-valued fact."""
    kind = domain.kind
    if kind == "bool":
        body = draw(one_of("True", "False", "yes", "no", "T", "f", "1", "0"))
    elif kind in ("enum", "text"):
        body = draw(name_lists(domain))
    elif kind == "tags":
        body = draw(tag_lists(domain))
    else:
        body = " | ".join(draw(interval_lists(kind)))
    return draw(one_of("", "", "", "not ", "NOT not ")) + body


@cache
@st.composite
def cells(draw: st.DrawFn, domain: Domain) -> str:
    """A cell of any form, soft ones and those without any value included."""
    form = draw(INDEX) % 12
    if form == 0:
        body = draw(ANY_TEXTS)
    elif form == 1:
        body = draw(one_of("not Any", NOTHING.get(domain.kind, "not -")))
    else:
        body = draw(sets(domain))
    if form not in (2, 3):
        return body
    grows = draw(one_of("", "/10", " / 0.5")) if domain.type.is_numeric else ""
    return body + draw(one_of(" ~2.5", "~0", " ~ 1e-3")) + grows


# ---- tables


@cache
def cell_lists(domain: Domain) -> st.SearchStrategy[list[str]]:
    return st.lists(cells(domain), min_size=1, max_size=6)


@cache
def bytes_of(length: int) -> st.SearchStrategy[bytes]:
    return st.binary(min_size=length, max_size=length)


@st.composite
def tables(draw: st.DrawFn, kinds: tuple[str, ...] = tuple(KINDS), most_conditions: int = 4, least_conditions: int = 0) -> Table:
    """A table of any size round the edges of words, from 0 conditions on; some have rows that are not enabled."""
    n_rows = draw(one_of(*N_ROWS))
    names = CONDITIONS[: draw(st.integers(least_conditions, most_conditions))]
    conditions = {name: Condition(name, draw(domains(kinds))) for name in names}
    columns = {"Asset": [f"A{row % 50}" for row in range(n_rows)]}
    for name, condition in conditions.items():
        texts = draw(cell_lists(condition.domain))
        columns[name] = [texts[i % len(texts)] for i in draw(bytes_of(n_rows))]
    settings = TableSettings("table")
    if draw(INDEX) % 4 == 1:
        settings = replace(settings, enabled="Enabled")
        columns["Enabled"] = [("True", "false", "")[i % 3] for i in draw(bytes_of(n_rows))]
    return Table.from_columns(columns, replace(EMPTY, conditions=conditions), settings)


# ---- facts


@dataclass(frozen=True)
class Fact:
    """A fact as a game gives it, and as the oracle takes it: a plain value, None, or a list of values."""

    given: object
    plain: oracles.Plain | list[oracles.Plain]


@lru_cache(500)
def near(texts: tuple[str, ...], domain: Domain) -> st.SearchStrategy[oracles.Plain]:
    """Values of which one lies in every part of the domain that the texts tell apart."""
    return st.sampled_from(oracles.representatives(texts, domain))


@lru_cache(500)
@st.composite
def plain_facts(draw: st.DrawFn, domain: Domain, texts: tuple[str, ...] = ()) -> Fact:
    """One value, most often near one that a cell of these texts names, in one of the types that Python has for it."""
    if domain.kind == "date":
        day = draw(near(texts, domain))
        date = oracles.EPOCH + datetime.timedelta(days=day)
        return Fact(draw(one_of(date, date.isoformat(), np.datetime64(date), day)), day)
    if domain.kind in ("int", "number", "angle"):
        return draw(number_facts(domain, texts))
    more = ("+" + known_tags(domain)[0],) if domain.kind == "tags" else ()
    value = draw(near(texts + more, domain))
    if domain.kind == "bool":
        return Fact(draw(one_of(bool, int, np.bool_, float))(value), value)
    if domain.kind == "tags":
        return Fact(draw(one_of(frozenset, set, sorted, tuple))(value), value)
    return Fact(draw(one_of(str, np.str_))(value), value)


@st.composite
def number_facts(draw: st.DrawFn, domain: Domain, texts: tuple[str, ...]) -> Fact:
    value = draw(near(texts, domain))
    if domain.kind == "angle":
        value += draw(one_of(0.0, 0.0, 360.0, -360.0, 720.0))
    forms = [value, np.float64(value), np.float32(value) if abs(value) < 1e38 else value]
    forms += [-0.0] if value == 0.0 else []
    if math.isfinite(value):
        forms += [Fraction(value), Fraction(repr(value))]
        if value.is_integer():
            forms.append(int(value))
    given = forms[draw(INDEX) % len(forms)]
    return Fact(given, float(given) if domain.kind != "angle" else oracles.wrapped(float(given)))


@lru_cache(500)
@st.composite
def set_facts(draw: st.DrawFn, domain: Domain, texts: tuple[str, ...] = ()) -> Fact:
    """A set of values, not empty, with enough of its values that every class of them is there."""
    text = draw(ANY_SETS | sets(domain))
    held = [v for v in oracles.representatives([*texts, text], domain) if oracles.accepts(text, domain, v)]
    if not held:
        text, held = "Any", oracles.representatives(texts, domain)
    is_plain_text_read = domain.type.is_numeric
    return Fact(text if is_plain_text_read and draw(BOOLEANS) else cell(text), held)


MISSING = st.sampled_from([Fact(None, None), Fact(math.nan, None), Fact(np.float64(math.nan), None)])


@st.composite
def contexts(
    draw: st.DrawFn, table: Table, has_missing: bool = False, has_sets: bool = False
) -> tuple[dict[str, object], dict[str, object]]:
    """A context for a table, as a game gives it and as the oracle takes it."""
    given: dict[str, object] = {}
    plain: dict[str, object] = {}
    for column in table.conditions:
        name, domain, texts = column.condition.name, column.condition.domain, column.texts.texts
        fact = draw(_facts(domain, texts, has_missing, has_sets))
        plain[name] = fact.plain
        if fact.given is not None or draw(BOOLEANS):
            given[name] = fact.given
    return given, plain


@lru_cache(500)
def _facts(domain: Domain, texts: tuple[str, ...], has_missing: bool, has_sets: bool) -> st.SearchStrategy[Fact]:
    choices = [plain_facts(domain, texts)]
    choices += [MISSING] if has_missing else []
    choices += [set_facts(domain, texts)] if has_sets else []
    return st.one_of(choices)
