"""Rules over the facts of roles: against every casting tried one by one, each with the rule computed anew."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import contextdb as cdb
from contextdb.errors import ContextError
from contextdb.schema.settings import TableSettings

ROLES = ("Defender", "Receiver", "Judge")
SLOTS = ("Mandatory_Slots", "Optional_Slots")
X = {"type": "number", "min": -10, "max": 10}
SCHEMA = {
    **{f"{role}.kind": {"type": "enum", "values": ["a", "b", "c"]} for role in ROLES},
    **{f"{role}.x": X for role in ROLES},
    "is_wet": {"type": "bool"},
    "limit": X,
    "gap": {"type": "number", "expr": "Receiver.x - Defender.x"},
    "Judge.far": {"type": "number", "expr": "abs(Judge.x) + limit"},
}


def less(a, b):
    return None if a is None or b is None else a < b


def either(a, b):
    return True if a or b else None if a is None or b is None else False


RULES = {
    "": ((), lambda x, wet, limit: True),
    "is_wet": ((), lambda x, wet, limit: wet),
    "Defender.x < Receiver.x": (("Defender", "Receiver"), lambda x, wet, limit: less(x["Defender"], x["Receiver"])),
    "gap > limit": (
        ("Defender", "Receiver"),
        lambda x, wet, limit: None if None in (x["Defender"], x["Receiver"]) else x["Receiver"] - x["Defender"] > limit,
    ),
    "is_wet or Judge.x > 2": (("Judge",), lambda x, wet, limit: either(wet, less(2, x["Judge"]))),
    "Judge.far > 6": (("Judge",), lambda x, wet, limit: None if x["Judge"] is None else abs(x["Judge"]) + limit > 6),
    "Defender.x < Receiver.x or Judge.x > limit": (
        ROLES,
        lambda x, wet, limit: either(less(x["Defender"], x["Receiver"]), less(limit, x["Judge"])),
    ),
}


def table_of(rows, schema=SCHEMA):
    names = ["Asset Name", *SLOTS, *(f"{role}.kind" for role in ROLES), "When"]
    columns = {name: [row.get(name, f"row {i}" if name == "Asset Name" else "") for i, row in enumerate(rows)] for name in names}
    return cdb.Table.from_columns(columns, schema, TableSettings(name="table", outputs=SLOTS, when="When")).compile()


def every_casting(row, context, actors):
    """All castings of a row with the most optional roles of those with which its rule holds; None where there is none."""
    mandatory, optional = (row.get(s, "").split() for s in SLOTS)
    named, holds = RULES[row.get("When", "")]
    asked = [r for r in ROLES if row.get(f"{r}.kind", "Any") not in ("Any", "") or r in named]
    needed = [r for r in ROLES if r in mandatory or (r in asked and r not in optional)]
    wanted = [r for r in ROLES if r in optional and r not in mandatory]
    found = []
    for chosen in product(*([*actors[r]] for r in needed), *([*actors[r], None] for r in wanted)):
        cast = {r: a for r, a in zip(needed + wanted, chosen, strict=True) if a is not None}
        fits = all(row.get(f"{r}.kind", "Any") in ("Any", "") or a["kind"] in row[f"{r}.kind"].split() for r, a in cast.items())
        if not fits or len({a["id"] for a in cast.values()}) < len(cast):
            continue
        x = {r: cast[r]["x"] if r in cast else None for r in ROLES}
        truth = holds(x, context["is_wet"], context["limit"])
        if truth or (truth is None and any(r not in cast for r in named)):
            found.append(cast)
    most = max(map(len, found), default=0)
    return [c for c in found if len(c) == most] or None


@st.composite
def moments(draw, max_actors=5, max_rows=5):
    people = [
        {"id": i, "kind": draw(st.sampled_from("abc")), "x": float(draw(st.integers(-5, 5)))}
        for i in range(draw(st.integers(0, max_actors)))
    ]
    actors = {r: [p for p in people if draw(st.booleans())] for r in ROLES}
    kinds = st.sampled_from(["Any", "Any", "a", "b c"])
    slots = st.lists(st.sampled_from(ROLES), max_size=2, unique=True).map(" ".join)
    row = st.fixed_dictionaries(
        {f"{r}.kind": kinds for r in ROLES} | dict.fromkeys(SLOTS, slots) | {"When": st.sampled_from(sorted(RULES))}
    )
    context = {"is_wet": draw(st.booleans()), "limit": float(draw(st.integers(-3, 3)))}
    return draw(st.lists(row, min_size=1, max_size=max_rows)), context, actors


@examples(1.5)
@given(moments())
def test_a_row_is_valid_when_some_casting_makes_its_rule_true(moment):
    rows, context, actors = moment
    compiled = table_of(rows)
    matches = compiled.query(context, actors=actors, prefer="x")
    expected = [every_casting(row, context, actors) for row in rows]
    assert matches.indices.tolist() == [i for i, found in enumerate(expected) if found is not None]
    explanation = compiled.explain(context, actors=actors)
    for row, found in enumerate(expected):
        assert explanation.row(row).is_valid == (found is not None)
        assert bool(explanation._n_failures[row]) == (found is None)
        if found is not None:
            castings = matches.castings(row)
            by_name = lambda c: sorted((r, a["id"]) for r, a in c.items())  # noqa: E731
            assert sorted(castings, key=by_name) == sorted(found, key=by_name)
            assert sum(a["x"] for a in matches.casting(row).values()) == min(sum(a["x"] for a in c.values()) for c in found)
            assert castings[0] == matches.casting(row)


@examples(0.3)
@given(moments(max_actors=8, max_rows=70))
def test_many_and_live_contexts_cast_as_one_query_does(moment):
    rows, context, actors = moment
    compiled = table_of(rows)
    expected = compiled.query(context, actors=actors).indices.tolist()
    many = compiled.query_many({name: [value] for name, value in context.items()}, actors=actors)
    assert [m.indices.tolist() for m in many] == [expected]
    live = compiled.live(context)
    live.actors(actors)
    assert live.matches().indices.tolist() == expected


def cast_of(ask):
    """Who plays what in each valid row; None for a question that is refused: two facts of one actor."""
    try:
        matches = ask()
    except ContextError:
        return None
    return {row: matches.casting(row) for row in matches.rows.tolist()}


CHANGES = st.sampled_from(["x", "kind", "other", "more", "fewer", "list", "number", "is_wet", "limit", "nothing"])


@examples(0.6)
@given(moments(max_actors=5), st.lists(st.tuples(CHANGES, st.integers(0, 99)), max_size=10), st.booleans())
def test_actors_that_a_live_context_keeps_count_as_they_are_when_it_is_asked(moment, changes, is_plain):
    rows, context, actors = moment
    if is_plain:  # nothing is derived, so that actors need not be read anew for other facts
        rows = [{**row, "When": row["When"] if "gap" not in row["When"] and "far" not in row["When"] else ""} for row in rows]
    schema = {name: about for name, about in SCHEMA.items() if not (is_plain and "expr" in about)}
    compiled = table_of(rows, schema)
    live = compiled.live(context)
    live.actors(actors, prefer="x")
    for change, n in changes:
        role = ROLES[n % 3]
        if change in ("is_wet", "limit"):
            context[change] = n % 2 == 0 if change == "is_wet" else float(n % 5)
            if change in live.facts:
                live[change] = context[change]
        elif change == "more":
            actors[role].append({"id": 100 + n, "kind": "b", "x": 2.0})
        elif actors[role]:
            actor = actors[role][n % len(actors[role])]
            if change in ("x", "kind"):
                actor[change] = float(n % 7) if change == "x" else "abc"[n % 3]
            elif change == "other":
                actors[role] = [dict(actor)]
            elif change == "fewer":
                actors[role].remove(actor)
            elif change in ("list", "number"):
                actor["more"] = [n] if change == "list" else np.float64(n)
        found = cast_of(live.matches)
        assert found == cast_of(lambda: compiled.query(context, actors=actors, prefer="x"))


def test_without_actors_a_rule_over_roles_is_a_rule_over_plain_facts():
    compiled = table_of([{"When": "Defender.x < Receiver.x"}])
    kinds = {f"{r}.kind": "a" for r in ROLES}
    assert compiled.query({**kinds, "Defender.x": 1, "Receiver.x": 2})
    assert not compiled.query({**kinds, "Defender.x": 2, "Receiver.x": 2})


def test_an_actor_without_a_fact_that_a_rule_needs_is_named():
    compiled = table_of([{"When": "Defender.x < Receiver.x"}])
    actors = {"Defender": [{"id": 1, "kind": "a", "x": 1.0}], "Receiver": [{"id": 2, "kind": "a"}]}
    with pytest.raises(ContextError, match=r'Receiver\[0\]": the fact "Receiver.x" is missing'):
        compiled.query({}, actors=actors)
    assert compiled.query({}, actors=actors, unknown="any").casting(0)["Receiver"]["id"] == 2
    assert not compiled.query({}, actors=actors, unknown="never")


def test_a_set_of_values_of_an_actor_may_match_and_always_matches():
    compiled = table_of([{"When": "Defender.x < Receiver.x"}, {"When": "Defender.x < 5"}, {"When": "Receiver.x > 7"}])
    actors = {"Defender": [{"id": 1, "kind": "a", "x": cdb.cell("0..4")}], "Receiver": [{"id": 2, "kind": "a", "x": 3.0}]}
    matches = compiled.query({}, actors=actors)
    assert matches.indices.tolist() == [0, 1]
    assert int(matches.always[0]) == 0b10


def test_an_explanation_tells_the_facts_of_one_casting_that_breaks_the_rule():
    compiled = table_of([{"When": "gap > limit"}])
    actors = {"Defender": [{"id": 1, "kind": "a", "x": 3.0}], "Receiver": [{"id": 2, "kind": "a", "x": 1.0}]}
    told = compiled.explain({"limit": 0}, actors=actors).row(0)
    assert str(told) == "row 0: When is false for every casting, such as gap = -2, limit = 0, the cell says gap > limit"


@examples(0.6)
@given(moments())
def test_casts_of_two_roles_are_those_of_trying_every_pair(moment):
    rows, context, actors = moment
    pair = ("Receiver", "Defender")
    matches = table_of(rows).query(context, actors=actors)
    expected = {}
    for at in matches.rows.tolist():
        row = rows[at]
        mandatory, optional = (row.get(s, "").split() for s in SLOTS)
        named, holds = RULES[row["When"]]
        needs_judge = "Judge" in mandatory or ((row["Judge.kind"] != "Any" or "Judge" in named) and "Judge" not in optional)
        for receiver, defender, judge in product(
            actors["Receiver"], actors["Defender"], actors["Judge"] if needs_judge else [None]
        ):
            cast = {"Receiver": receiver, "Defender": defender} | ({"Judge": judge} if judge else {})
            x = {r: cast[r]["x"] if r in cast else None for r in ROLES}
            truth = holds(x, context["is_wet"], context["limit"])
            fits = all(row[f"{r}.kind"] == "Any" or a["kind"] in row[f"{r}.kind"].split() for r, a in cast.items())
            is_open = truth is None and any(r not in cast for r in named)
            if fits and len({a["id"] for a in cast.values()}) == len(cast) and (truth or is_open):
                expected.setdefault((receiver["id"], defender["id"]), set()).add(at)
    found = {tuple(a["id"] for a in cast): {i for i in range(len(rows)) if bits >> i & 1} for cast, bits, _ in matches.casts(pair)}
    assert found == expected
