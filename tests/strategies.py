"""Examples for property tests: conditions, cells as people write them, tables, and facts close to where the answers change."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
import oracles
from hypothesis import strategies as st

from contextdb.conditions import Condition
from contextdb.domains import KINDS, Domain
from contextdb.facts import cell
from contextdb.schema import EMPTY, TableSettings
from contextdb.table import Table

NAMES = ["CB", "FS", "Half Back", "Any", "not", "5", "-", 'say "no"', "A~2", "Move.Run", "a:b/c-d", "Größe", "1..2", "-x", "inf"]
TAGS = ["InAir", "Move", "Move.Run", "Move.Run.Fast", "Moved", "Half Way"]
CONDITIONS = ["speed", "Defender.Tags", "it's", 'a "b" c', "None"]
N_ROWS = [0, 1, 2, 63, 64, 65, 130]

NUMBERS = [0.0, -0.0, 0.1, 0.2, 0.1 + 0.2, 0.3, 1.0, 5.0, 9.99, 10.0, 20.0, 29.99, 16777217.0, 5e-324, 1e308, 2.0**53, math.inf]
WHOLE = [0.0, 1.0, 2.0, 3.0, 5.0, 10.0, 2.0**53 - 1, 2.0**53, 2.0**53 + 2, 1e300, math.inf]
ANGLES = [0.0, -0.0, 0.1, 5.0, 90.0, 179.99999999999997, 180.0, 185.0, 190.0, 350.0, 360.0, 365.0, 540.0, 725.0]

ANY_TEXTS = st.sampled_from(["Any", "-", "", " any "])
NOTHING = {"int": "5..3", "number": "5..3", "angle": "(5..5)", "tags": "+Move.Run -Move"}
"""Cells that no fact matches, though each part of them could."""


# ---- conditions


@st.composite
def domains(draw: st.DrawFn, kinds: tuple[str, ...] = KINDS) -> Domain:
    """A domain of any kind, with declared values or bounds where the kind can have them."""
    kind = draw(st.sampled_from(kinds))
    if kind == "enum":
        return Domain(kind, tuple(draw(st.lists(st.sampled_from(NAMES), min_size=1, max_size=5, unique=True))))
    if kind == "tags":
        return Domain(kind, draw(st.none() | st.just(tuple(TAGS))))
    if kind in ("int", "number"):
        return Domain(kind, None, draw(st.sampled_from([-math.inf, -5.0, 0.0, 0.5])), draw(st.sampled_from([math.inf, 10.0, 2.5])))
    return Domain(kind)


# ---- cells as texts


def numbers(kind: str) -> st.SearchStrategy[float]:
    """Numbers for the cells of a kind, those where doubles misbehave more often than others."""
    special = {"int": WHOLE, "number": NUMBERS, "angle": ANGLES}[kind]
    signed = st.sampled_from([*special, *(-n for n in special)])
    if kind == "int":
        return signed | st.integers(-20, 20).map(float) | st.sampled_from([0.5, 2.5])
    return signed | st.integers(-400, 400).map(lambda n: n / 2) | st.floats(-1000.0, 1000.0)


@st.composite
def number_texts(draw: st.DrawFn, kind: str, is_finite: bool = False) -> str:
    """A number in one of the ways to write it."""
    value = draw(numbers(kind))
    if is_finite and math.isinf(value):
        value = 7.0
    forms = [repr(value), f"{value:.17g}", repr(value).removesuffix(".0")]
    return draw(st.sampled_from(forms if value < 0 or forms[0][0] == "-" else [*forms, "+" + forms[0]]))


@st.composite
def intervals(draw: st.DrawFn, kind: str) -> str:
    """One part of a union of numbers."""
    form = draw(st.integers(0, 4))
    if form == 0:
        mark = draw(st.sampled_from([", ", ",", " ± ", "±", " +- "]))
        tolerance = abs(float(draw(number_texts(kind, is_finite=True))))
        return draw(number_texts(kind, is_finite=True)) + mark + repr(tolerance)
    if form == 1:
        return draw(st.sampled_from(["", "=", "= "])) + draw(number_texts(kind))
    if kind == "angle" and form < 4:
        one = repr(draw(st.floats(-180.0, 180.0) | st.sampled_from([-180.0, -90.0, 0.0, 90.0, 180.0])))
    else:
        one = draw(number_texts(kind))
    if form == 2:
        return draw(st.sampled_from(["<", "<=", "> ", ">="])) + one
    if form == 3:
        return draw(st.sampled_from([f"{one}..", f"({one}..", f"[{one} ..", f"..{one}", f".. {one})", f"..{one}]"]))
    left, right = draw(st.sampled_from(["", "(", "[ "])), draw(st.sampled_from(["", ")", " ]"]))
    return left + one + draw(st.sampled_from(["..", " .. "])) + draw(number_texts(kind)) + right


def quoted(name: str, always: bool = False) -> str:
    """A name as a cell has it."""
    bare = name.replace(".", "").replace("_", "").isalpha() and name not in ("Any", "not", "inf")
    return name if bare and not always else '"' + name.replace('"', '""') + '"'


@st.composite
def name_lists(draw: st.DrawFn, domain: Domain) -> str:
    known = domain.values or NAMES
    chosen = draw(st.lists(st.sampled_from(known), min_size=1, max_size=3))
    return draw(st.sampled_from([" ", "  "])).join(quoted(n, draw(st.booleans())) for n in chosen)


def known_tags(domain: Domain) -> list[str]:
    return [tag for tag in TAGS if domain.values is None or oracles.has(tag, frozenset(domain.values))]


@st.composite
def tag_lists(draw: st.DrawFn, domain: Domain) -> str:
    chosen = draw(st.lists(st.sampled_from(known_tags(domain)), min_size=1, max_size=3))
    return " ".join(draw(st.sampled_from("+-")) + quoted(t) for t in chosen)


@st.composite
def sets(draw: st.DrawFn, domain: Domain) -> str:
    """A cell without a penalty: what may stand in a table and in a set-valued fact."""
    kind = domain.kind
    if kind == "bool":
        body = draw(st.sampled_from(["True", "False", "yes", "no", "T", "f", "1", "0"]))
    elif kind in ("enum", "text"):
        body = draw(name_lists(domain))
    elif kind == "tags":
        body = draw(tag_lists(domain))
    else:
        body = " | ".join(draw(st.lists(intervals(kind), min_size=1, max_size=3)))
    return draw(st.sampled_from(["", "", "", "not ", "NOT not "])) + body


@st.composite
def cells(draw: st.DrawFn, domain: Domain) -> str:
    """A cell of any form, soft ones and those without any value included."""
    form = draw(st.integers(0, 11))
    if form == 0:
        body = draw(ANY_TEXTS)
    elif form == 1:
        body = draw(st.sampled_from(["not Any", NOTHING.get(domain.kind, "not -")]))
    else:
        body = draw(sets(domain))
    return body + (draw(st.sampled_from([" ~2.5", "~0", " ~ 1e-3"])) if form in (2, 3) else "")


# ---- tables


@st.composite
def tables(draw: st.DrawFn, kinds: tuple[str, ...] = KINDS, most_conditions: int = 4, least_conditions: int = 0) -> Table:
    """A table of any size round the edges of words, from 0 conditions on; some have rows that are not enabled."""
    n_rows = draw(st.sampled_from(N_ROWS))
    names = CONDITIONS[: draw(st.integers(least_conditions, most_conditions))]
    conditions = {name: Condition(name, draw(domains(kinds))) for name in names}
    columns = {"Asset": [f"A{row % 50}" for row in range(n_rows)]}
    for name, condition in conditions.items():
        texts = draw(st.lists(cells(condition.domain), min_size=1, max_size=6))
        columns[name] = [texts[i % len(texts)] for i in draw(st.binary(min_size=n_rows, max_size=n_rows))]
    settings = TableSettings("table")
    if draw(st.integers(0, 3)) == 0:
        settings = replace(settings, enabled="Enabled")
        columns["Enabled"] = [("True", "false", "")[i % 3] for i in draw(st.binary(min_size=n_rows, max_size=n_rows))]
    return Table.from_columns(columns, replace(EMPTY, conditions=conditions), settings)


# ---- facts


@dataclass(frozen=True)
class Fact:
    """A fact as a game gives it, and as the oracle takes it: a plain value, None, or a list of values."""

    given: object
    plain: oracles.Plain | list[oracles.Plain]


@st.composite
def plain_facts(draw: st.DrawFn, domain: Domain, texts: tuple[str, ...] = ()) -> Fact:
    """One value, most often near one that a cell of these texts names, in one of the types that Python has for it."""
    if domain.kind in ("int", "number", "angle"):
        return draw(number_facts(domain, texts))
    more = ["+" + known_tags(domain)[0]] if domain.kind == "tags" else []
    value = draw(st.sampled_from(oracles.representatives([*texts, *more], domain)))
    if domain.kind == "bool":
        return Fact(draw(st.sampled_from([value, int(value), np.bool_(value), float(value)])), value)
    if domain.kind == "tags":
        return Fact(draw(st.sampled_from([value, set(value), sorted(value), tuple(sorted(value))])), value)
    return Fact(draw(st.sampled_from([value, np.str_(value)])), value)


@st.composite
def number_facts(draw: st.DrawFn, domain: Domain, texts: tuple[str, ...]) -> Fact:
    value = draw(st.sampled_from(oracles.representatives(texts, domain)))
    if domain.kind == "angle":
        value += draw(st.sampled_from([0.0, 0.0, 360.0, -360.0, 720.0]))
    forms = [value, np.float64(value), np.float32(value) if abs(value) < 1e38 else value]
    forms += [-0.0] if value == 0.0 else []
    if math.isfinite(value):
        forms += [Fraction(value), Fraction(repr(value))]
        if value.is_integer():
            forms.append(int(value))
    given = draw(st.sampled_from(forms))
    return Fact(given, float(given) if domain.kind != "angle" else oracles.wrapped(float(given)))


@st.composite
def set_facts(draw: st.DrawFn, domain: Domain, texts: tuple[str, ...] = ()) -> Fact:
    """A set of values, not empty, with enough of its values that every class of them is there."""
    text = draw(ANY_TEXTS.filter(str.strip) | sets(domain))
    held = [v for v in oracles.representatives([*texts, text], domain) if oracles.accepts(text, domain, v)]
    if not held:
        text, held = "Any", oracles.representatives(texts, domain)
    is_plain_text_read = domain.kind in ("int", "number", "angle")
    return Fact(draw(st.sampled_from([cell(text), text])) if is_plain_text_read else cell(text), held)


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
        if fact.given is not None or draw(st.booleans()):
            given[name] = fact.given
    return given, plain


def _facts(domain: Domain, texts: tuple[str, ...], has_missing: bool, has_sets: bool) -> st.SearchStrategy[Fact]:
    choices = [plain_facts(domain, texts)]
    choices += [MISSING] if has_missing else []
    choices += [set_facts(domain, texts)] if has_sets else []
    return st.one_of(choices)
