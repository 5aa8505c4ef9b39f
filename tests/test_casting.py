"""Actors cast for roles: against every assignment tried by hand, and what is refused."""

from dataclasses import replace
from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import contextdb as cdb
from contextdb.compiled.casting.facts import Ask
from contextdb.compiled.casting.stage import query_with_actors, set_stage
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.errors import ContextError
from contextdb.schema.settings import TableSettings

ROLES = ("Defender", "Receiver", "Thrower", "Judge")
SLOTS = ("Mandatory_Slots", "Optional_Slots")
SCHEMA = {f"{role}.kind": {"type": "enum", "values": ["a", "b", "c"]} for role in ROLES} | {"is_wet": {"type": "bool"}}


def table_of(rows, roles=ROLES):
    """A compiled table from rows of cells by column; columns that a row leaves out are Any."""
    names = ["Asset Name", *SLOTS, "is_wet", *(f"{r}.kind" for r in roles)]
    columns = {name: [row.get(name, f"row {i}" if name == "Asset Name" else "") for i, row in enumerate(rows)] for name in names}
    return cdb.Table.from_columns(columns, SCHEMA, TableSettings(name="table", outputs=SLOTS)).compile()


def every_casting(row, context, actors, roles=ROLES):
    """All castings of a row that fill the most optional roles, tried one by one; None where the row is not valid."""
    if row.get("is_wet", "Any") not in ("Any", "", str(context["is_wet"])):
        return None
    mandatory, optional = (row.get(s, "").split() for s in SLOTS)
    needed = [r for r in roles if r not in optional or r in mandatory]
    needed = [r for r in needed if r in mandatory or row.get(f"{r}.kind", "Any") not in ("Any", "")]
    wanted = [r for r in roles if r in optional and r not in mandatory]
    choices = [actors.get(r, []) for r in needed] + [[*actors.get(r, []), None] for r in wanted]
    found = []
    for chosen in product(*choices):
        cast = {r: a for r, a in zip(needed + wanted, chosen, strict=True) if a is not None}
        ids = [a["id"] for a in cast.values()]
        fits = all(row.get(f"{r}.kind", "Any") in ("Any", "") or a["kind"] in row[f"{r}.kind"].split() for r, a in cast.items())
        if len(set(ids)) == len(ids) and fits:
            found.append(cast)
    most = max(map(len, found), default=0)
    return [c for c in found if len(c) == most] or None


@st.composite
def moments(draw, max_actors=6, max_rows=70):
    people = [
        {"id": i, "kind": draw(st.sampled_from("abc")), "distance": draw(st.integers(0, 9))}
        for i in range(draw(st.integers(0, max_actors)))
    ]
    actors = {r: [p for p in people if draw(st.booleans())] for r in ROLES}
    kinds = st.sampled_from(["Any", "Any", "a", "b", "a c", "b c"])
    slots = st.lists(st.sampled_from([*ROLES, "Embed"]), max_size=2, unique=True).map(" ".join)
    row = st.fixed_dictionaries(
        {f"{r}.kind": kinds for r in ROLES} | dict.fromkeys(SLOTS, slots) | {"is_wet": st.sampled_from(["Any", "True"])}
    )
    return draw(st.lists(row, min_size=1, max_size=max_rows)), {"is_wet": draw(st.booleans())}, actors


def as_ids(cast):
    return {role: actor["id"] for role, actor in cast.items()}


@examples(1.2)
@given(moments(max_actors=5, max_rows=4))
def test_valid_rows_and_castings_are_those_of_trying_every_assignment(moment):
    rows, context, actors = moment
    matches = table_of(rows).query(context, actors=actors, prefer="distance")
    expected = [every_casting(row, context, actors) for row in rows]
    assert matches.indices.tolist() == [i for i, found in enumerate(expected) if found is not None]
    for row in matches.rows.tolist():
        castings = matches.castings(row)
        key = lambda c: sorted(as_ids(c).items())  # noqa: E731
        assert sorted(castings, key=key) == sorted(expected[row], key=key)
        least = min(sum(a["distance"] for a in c.values()) for c in expected[row])
        assert sum(a["distance"] for a in matches.casting(row).values()) == least
        assert castings[0] == matches.casting(row)


ODD = [
    {"id": [1], "kind": "a"},
    {"kind": "x"},
    {"kind": None, "id": 1},
    {"id": 1, "kind": "b", "distance": True},
    {1: 2, "kind": "a"},
    7,
]


@examples(0.4)
@given(
    moments(),
    st.sampled_from([None, "distance", "-distance", {"Judge": "distance"}, "height"]),
    st.lists(st.sampled_from(ODD), max_size=1),
)
def test_plain_actors_are_cast_as_the_careful_way_casts_them(moment, prefer, odd):
    rows, context, actors = moment
    compiled, actors = data_of(table_of(rows)), {**actors, "Judge": [*actors["Judge"], *odd]}

    def described(careful: bool) -> object:
        try:
            if careful:
                stage, plain = set_stage(compiled, context, Ask(actors, prefer))
                matches = stage.matches(plain)
            else:
                matches = query_with_actors(compiled, context, Ask(actors, prefer))
        except ContextError as error:
            return str(error)
        casts = [
            {role: (offer.place, offer.name, offer.cost) for role, offer in matches.cast(row).items()}
            for row in matches.rows.tolist()
        ]
        return matches.bits, matches.always.tolist(), casts, [matches.castings(row) for row in matches.rows.tolist()]

    assert described(careful=False) == described(careful=True)


@examples(0.4)
@given(moments(max_actors=22, max_rows=70))
def test_every_valid_row_has_a_casting_and_every_other_a_reason(moment):
    rows, context, actors = moment
    compiled = table_of(rows)
    matches = compiled.query(context, actors=actors)
    explanation = compiled.explain(context, actors=actors)
    assert explanation.matches == matches
    for r in range(len(rows)):
        told = explanation.row(r)
        assert told.is_valid == (r in matches.rows)
        if r in matches.rows:
            cast = as_ids(matches.casting(r))
            assert len(set(cast.values())) == len(cast)
            assert all(any(a["id"] == i for a in actors[role]) for role, i in cast.items())


def actor(kind, **more):
    return {"kind": kind, **more}


def test_a_role_whose_facts_are_given_as_plain_facts_is_not_cast():
    compiled = table_of([{"Defender.kind": "a", "Receiver.kind": "b"}])
    matches = compiled.query({"is_wet": True, "Receiver.kind": "b"}, actors={"Defender": [actor("a")]}, unknown="any")
    assert set(matches.casting(0)) == {"Defender"}
    with pytest.raises(ContextError, match="is given as a fact, and actors"):
        compiled.query({"is_wet": True, "Defender.kind": "b"}, actors={"Defender": [actor("a")]})


@pytest.mark.parametrize(
    ("actors", "told"),
    [
        ({"Defnder": []}, 'no role "Defnder".*Did you mean "Defender"'),
        ([], "mapping of roles"),
        ({"Defender": {"kind": "a"}}, "of type dict"),
        ({"Defender": None}, "of type NoneType"),
        ({"Defender": [3]}, r"Defender\[0\] is of type int"),
        ({"Defender": [{}]}, r"Defender\[0\].*missing"),
        ({"Defender": [{"knd": "a"}]}, "Defender.knd"),
        ({"Defender": [actor("z")]}, "not a declared value"),
        ({"Defender": [{"kind": "a", "Defender.kind": "b"}]}, "given twice"),
        ({"Defender": [{"kind": "a", 3: 4}]}, "name is of type int"),
        ({"Defender": [actor("a", id=[])]}, "id of .* is of type list"),
        ({"Defender": [actor("a", id=1)], "Receiver": [actor("b", id=1)]}, 'have the id "1", and "kind" differs'),
    ],
)
def test_actors_that_cannot_be_read_are_refused_with_the_reason(actors, told):
    with pytest.raises(ContextError, match=told):
        table_of([{}]).query({"is_wet": True}, actors=actors)


def test_a_missing_fact_of_an_actor_is_refused_ignored_or_accepted_by_any_alone():
    compiled = table_of([{"Defender.kind": "a"}, {"Mandatory_Slots": "Defender"}])
    actors = {"Defender": [{"Defender.kind": None}]}
    assert compiled.query({"is_wet": True}, unknown="any", actors=actors).indices.tolist() == [0, 1]
    assert compiled.query({"is_wet": True}, unknown="never", actors=actors).indices.tolist() == [1]
    with pytest.raises(ContextError, match="missing"):
        compiled.query({"is_wet": True}, unknown="error", actors=actors)


def test_without_actors_a_role_s_fact_is_a_plain_fact_and_nobody_is_cast():
    compiled = table_of([{"Defender.kind": "a"}])
    facts = {"is_wet": True, **{f"{r}.kind": "a" for r in ROLES}}
    matches = compiled.query(facts)
    assert len(matches) == 1
    with pytest.raises(ContextError, match="had no actors"):
        matches.casting(0)


def test_nobody_is_cast_for_a_row_that_is_not_valid():
    matches = table_of([{"Defender.kind": "a"}]).query({"is_wet": True}, actors={})
    with pytest.raises(ContextError, match="row 0 is not valid"):
        matches.casting(0)


@pytest.mark.parametrize(
    ("prefer", "told"),
    [("distnce", 'no actor has "distnce".*"distance"'), (3, "is of type int"), ("kind", "cannot be preferred by")],
)
def test_a_preference_that_cannot_be_meant_is_refused(prefer, told):
    with pytest.raises(ContextError, match=told):
        table_of([{}]).query({"is_wet": True}, actors={"Defender": [actor("a", distance=1)]}, prefer=prefer)


def test_a_compiled_file_that_does_not_know_its_slots_is_not_asked_with_actors():
    with pytest.raises(ContextError, match="which slots are mandatory"):
        CompiledTable(replace(data_of(table_of([{}])), slots=None)).query({"is_wet": True}, actors={})


def test_a_table_without_rows_casts_nobody():
    assert len(table_of([]).query({"is_wet": True}, actors={"Judge": [actor("a")]})) == 0


def castings_of_many(row, actors):
    """All castings of a row by the actors who fit each role, tried one by one: as `every_casting`, which tries the others too."""
    mandatory, optional = (row.get(s, "").split() for s in SLOTS)
    fits = {
        r: [a for a in actors.get(r, []) if row[f"{r}.kind"] in ("Any", "") or a["kind"] in row[f"{r}.kind"].split()] for r in ROLES
    }
    needed = [r for r in ROLES if r in mandatory or (r not in optional and row[f"{r}.kind"] not in ("Any", ""))]
    wanted = [r for r in ROLES if r in optional and r not in mandatory]
    most, best = -1, []
    for chosen in product(*(fits[r] for r in needed), *([*fits[r], None] for r in wanted)):
        cast = [(r, a) for r, a in zip(needed + wanted, chosen, strict=True) if a is not None]
        if len({a["id"] for _, a in cast}) == len(cast) and len(cast) >= most:
            best = [*best, cast] if len(cast) == most else [cast]
            most = len(cast)
    return best


@examples(0.6)
@given(moments(max_actors=22, max_rows=2))
def test_with_two_teams_the_best_casting_is_that_of_trying_every_assignment(moment):
    rows, context, actors = moment
    matches = table_of(rows).query(context, actors=actors, prefer="distance")
    for r, row in enumerate(rows):
        found = castings_of_many(row, actors) if row["is_wet"] == "Any" or context["is_wet"] else []
        assert (r in matches.rows) == bool(found)
        if found:
            cast = matches.casting(r)
            assert len(cast) == len(found[0])
            assert sum(a["distance"] for a in cast.values()) == min(sum(a["distance"] for _, a in c) for c in found)
