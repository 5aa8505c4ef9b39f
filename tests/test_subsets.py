"""Answers combined as sets of rows: against Python's own sets, with what belongs to the rows."""

import copy
import operator
import pickle
from dataclasses import dataclass, replace

import numpy as np
import oracles
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from nested_tables import nests
from strategies import contexts, examples
from test_casting import moments, table_of
from test_mirroring import mirroring_tables, plain_in_mirror

import contextdb as cdb
from contextdb import motion
from contextdb.bitmask import rows as rows_of
from contextdb.compiled.table import data_of
from contextdb.errors import QueryError
from contextdb.tables.table import Table

OPERATORS = {"&": operator.and_, "|": operator.or_, "-": operator.sub, "^": operator.xor}
SCHEMA = {"speed": {"type": "number"}, "is_hurt": {"type": "bool"}}
TABLE = Table.from_columns(
    {"Asset": ["walk", "run", "limp"], "speed": ["0..2", "2..9", "0..3"], "is_hurt": ["Any", "False", "True"]}, SCHEMA, name="moves"
)
MOVES = TABLE.compile()
FACTS = {"speed": 1.0, "is_hurt": True}


@dataclass
class Rows:
    """What an answer says, kept as Python's sets."""

    rows: set[int]
    always: set[int]
    costs: dict[int, float]


def joined(sign: str, one: Rows, other: Rows) -> Rows:
    join = OPERATORS[sign]
    found = join(one.rows, other.rows)
    always = one.always & other.always if sign == "&" else one.always | other.always
    costs = {row: one.costs[row] if row in one.rows else other.costs[row] for row in found}
    return Rows(found, always & found, costs)


def only(one: Rows, rows: set[int]) -> Rows:
    return Rows(one.rows & rows, one.always & rows, one.costs)


def numbers(answer: cdb.Matches) -> set[int]:
    return set(answer.rows.tolist())


def by_oracle(table: Table, plain: dict[str, object], unknown: str) -> Rows:
    found = oracles.rows(table, plain, unknown)
    costs = oracles.costs(table, plain, unknown)
    return Rows(set(found), set(oracles.rows_always(table, plain, unknown)), {row: costs[row] for row in found})


def assert_says(answer: cdb.Matches, rows: Rows) -> None:
    assert answer.indices.tolist() == sorted(rows.rows)
    assert set(rows_of(answer.always).tolist()) == rows.always
    assert [answer.penalties[row] for row in sorted(rows.rows)] == pytest.approx([rows.costs[row] for row in sorted(rows.rows)])


SAYINGS = ["flags", "list of flags", "numbers", "array", "series", "set", "answer", "assets"]


def said(way: str, rows: set[int], answer: cdb.Matches) -> tuple[object, set[int]]:
    """Some rows in one of the ways in which `only` takes them, and which rows that are."""
    n_rows = answer.n_rows
    flags = np.isin(np.arange(n_rows), sorted(rows))
    if way == "assets":
        names = {answer.table_assets[row] for row in rows}
        return names, {row for row in range(n_rows) if answer.table_assets[row] in names}
    others = answer._table.answer(sum(1 << row for row in rows), 0)
    return {
        "flags": flags,
        "list of flags": flags.tolist(),
        "numbers": sorted(rows),
        "array": np.array(sorted(rows), np.int32),
        "series": pl.Series(sorted(rows), dtype=pl.Int64),
        "set": rows,
        "answer": others,
    }[way], rows


@examples(1.5)
@given(st.data())
def test_answers_are_combined_as_sets_of_rows_and_keep_what_belongs_to_a_row(data):
    table = data.draw(mirroring_tables())
    compiled, pool = table.compile(), []
    for _ in range(3):
        facts, plain = data.draw(contexts(table, has_missing=True, has_sets=True))
        unknown = data.draw(st.sampled_from(["any", "never"]))
        seen = by_oracle(table, plain_in_mirror(table, plain, facts), unknown)
        pool.append((compiled.query(facts, unknown=unknown), by_oracle(table, plain, unknown), seen))
    for _ in range(4):
        one, rows, seen = data.draw(st.sampled_from(pool))
        sign = data.draw(st.sampled_from([*OPERATORS, "only"]))
        if sign == "only":
            drawn = data.draw(st.sets(st.integers(0, table.n_rows - 1)) if table.n_rows else st.just(set()))
            given_rows, kept = said(data.draw(st.sampled_from(SAYINGS)), drawn, one)
            pool.append((one.only(given_rows), only(rows, kept), only(seen, kept)))
        else:
            other, other_rows, other_seen = data.draw(st.sampled_from(pool))
            pool.append((OPERATORS[sign](one, other), joined(sign, rows, other_rows), joined(sign, seen, other_seen)))
    for answer, rows, seen in pool:
        for same in (answer, copy.copy(answer), pickle.loads(pickle.dumps(answer))):
            assert_says(same, rows)
            assert_says(same.mirrored, seen if data_of(compiled).mirroring else rows)
            assert_says(same.mirrored.mirrored, rows)


@examples(0.5)
@given(st.data())
def test_answers_of_tables_inside_tables_are_combined_by_flat_rows_and_by_assets_with_and_without_paths(data):
    nest = data.draw(nests())
    compiled = nest.outer.compile(nest.tables)
    one, other = (compiled.query(data.draw(contexts(nest.all_cells()))[0], unknown="never") for _ in range(2))
    for sign, join in OPERATORS.items():
        assert numbers(join(one, other)) == OPERATORS[sign](numbers(one), numbers(other))
    for names in (compiled.assets, compiled.leaves):
        for name in names:
            assert one.only(name).rows.tolist() == [
                row for row in one.rows.tolist() if names[row] == name or compiled.leaves[row] == name
            ]


@examples(0.7)
@given(moments(), moments(), st.data())
def test_a_row_is_cast_as_in_the_first_answer_that_holds_it(first, second, data):
    rows, context, actors = first
    compiled = table_of(rows)
    one = compiled.query(context, actors=actors)
    other = compiled.query(context, actors=second[2])
    kept = {row for row in range(len(rows)) if data.draw(st.booleans())}
    answers = {sign: join(one, other) for sign, join in OPERATORS.items()}
    answers |= {"only": one.only(kept), "without": one - kept, "nested": (one - kept) | (other & kept)}
    expected = {sign: join(numbers(one), numbers(other)) for sign, join in OPERATORS.items()}
    expected |= {
        "only": numbers(one) & kept,
        "without": numbers(one) - kept,
        "nested": (numbers(one) - kept) | (numbers(other) & kept),
    }
    for sign, answer in answers.items():
        assert numbers(answer) == expected[sign]
        for same in (answer, pickle.loads(pickle.dumps(answer))):
            for row in same.rows.tolist():
                teller = other if row not in one.rows or (sign == "nested" and row in kept) else one
                assert (same.casting(row), same.castings(row)) == (teller.casting(row), teller.castings(row))


def test_a_row_of_an_answer_without_actors_has_no_casting():
    compiled = table_of([{"Defender.kind": "a"}, {}])
    cast = compiled.query({"is_wet": True}, actors={"Defender": [{"id": 1, "kind": "a"}]})
    plain = compiled.query(
        {"is_wet": True, **dict.fromkeys([f"{r}.kind" for r in ("Receiver", "Thrower", "Judge", "Defender")], "b")}
    )
    both = plain | cast.only([0])
    assert both.casting(0)["Defender"]["id"] == 1
    with pytest.raises(cdb.ContextError, match="row 1 is of an answer without actors"):
        both.casting(1)
    with pytest.raises(cdb.ContextError, match="no actors"):
        plain.casting(1)
    with pytest.raises(cdb.ContextError, match="row 0 is not valid"):
        (both - [0]).casting(0)


# ---- places, and what is refused


def test_a_place_gives_an_asset_and_a_slice_gives_assets():
    found = MOVES.query({"speed": 2.0, "is_hurt": cdb.cell("Any")})
    assert found.rows.tolist() == [0, 1, 2]
    assert (found[0], found[-1], found[1:], found[::-1]) == ("walk", "limp", ["run", "limp"], ["limp", "run", "walk"])
    assert list(reversed(found)) == ["limp", "run", "walk"]


@pytest.mark.parametrize("place", [2, -3, 10**30])
def test_a_place_that_an_answer_does_not_have_is_refused(place):
    with pytest.raises(IndexError, match=r"there is no valid row .* among 2 valid rows. Accepted: 0 to 1.") as caught:
        MOVES.query(FACTS)[place]
    assert isinstance(caught.value, cdb.NoSuchPlace)


@pytest.mark.parametrize(
    ("rows", "error", "message"),
    [
        ("wlk", cdb.ContextError, r'^the table "moves" has no asset "wlk"\. Accepted: .* Did you mean "walk"\?$'),
        (["walk", "rum"], cdb.ContextError, 'has no asset "rum".* Did you mean "run"'),
        ([3], cdb.NoSuchPlace, r"there is no row 3\. Accepted: rows 0 to 2\."),
        (np.array([-1]), IndexError, r"there is no row -1\."),
        ([True], cdb.ContextError, r"flags of shape \(1,\), and 3 rows"),
        (np.ones((3, 3), np.bool_), cdb.ContextError, r"flags of shape \(3, 3\)"),
        (np.ones((2, 2)), cdb.ContextError, r"rows has shape \(2, 2\)"),
        ([True, 2, 1], TypeError, "rows holds flags beside row numbers"),
        ([0.5], TypeError, r'row is float "0\.5"\. Accepted: a whole number'),
        (np.array([0.5]), TypeError, r'row is float "0\.5"'),
        (0, TypeError, 'rows is int "0". Accepted: one bool for each row, row numbers, assets, or an answer of this table'),
        (None, TypeError, "rows is of type NoneType"),
        ({"walk": True}, TypeError, "rows is of type dict"),
        (b"walk", TypeError, "rows is of type bytes"),
        ([None], TypeError, "row is of type NoneType"),
    ],
)
def test_rows_that_cannot_be_meant_are_refused(rows, error, message):
    for ask in (MOVES.query(FACTS).only, MOVES.query(FACTS).__and__, MOVES.query(FACTS).__sub__):
        with pytest.raises(error, match=message) as caught:
            ask(rows)
        assert isinstance(caught.value, cdb.ContextError)
    if np.ndim(rows) < 2:
        with pytest.raises(error, match=message):
            MOVES.query_many({name: [fact] for name, fact in FACTS.items()}).only(rows)


@pytest.mark.parametrize("join", OPERATORS.values(), ids=OPERATORS)
def test_an_answer_of_another_table_or_version_is_refused_by_name(join):
    newer = TABLE.with_cell(0, "speed", "0..3").compile()
    stranger = Table.from_columns({"Asset": ["tackle"], "speed": ["Any"]}, SCHEMA, name="tackles").compile()
    answer = MOVES.query(FACTS)
    with pytest.raises(cdb.ContextError, match=r'another version of "moves" \(3 rows, version .*query this table again'):
        join(answer, newer.query(FACTS))
    with pytest.raises(cdb.ContextError, match=r'the answer is of the table "tackles" \(1 row\), not of "moves" \(3 rows\)'):
        join(answer, stranger.query(FACTS))
    with pytest.raises(cdb.ContextError, match='of the table "tackles"'):
        answer.only(stranger.query(FACTS))
    many = MOVES.query_many({name: [fact] for name, fact in FACTS.items()})
    for other in (stranger.query(FACTS), stranger.query_many({"speed": [1.0]})):
        for ask in (many.only, many.__and__):
            with pytest.raises(cdb.ContextError, match='of the table "tackles"'):
                ask(other)


@pytest.mark.parametrize("other", [[0], {1}, np.ones(3, np.bool_), "walk", None, 3])
@pytest.mark.parametrize("join", [operator.or_, operator.xor])
def test_only_an_answer_can_be_joined_with_an_answer(join, other):
    with pytest.raises(TypeError) as caught:
        join(MOVES.query(FACTS), other)
    assert f"an answer cannot be joined with {type(other).__name__}. Accepted: an answer of the same table." in str(caught.value)
    with pytest.raises(TypeError):
        join(other, MOVES.query(FACTS))


def test_flags_rows_and_assets_may_stand_before_an_and():
    answer = MOVES.query(FACTS)
    for some in (np.array([True, False, False]), [True, False, False], ["walk"], {0}, "walk", np.array([0])):
        assert list(some & answer) == list(answer & some) == ["walk"]
        assert list(answer - some) == ["limp"]
    answer &= ["limp"]
    assert answer.rows.tolist() == [2]


def test_the_same_answer_out_of_a_pickle_is_of_the_same_table():
    answer = MOVES.query(FACTS)
    assert (
        list(answer & pickle.loads(pickle.dumps(answer))) == list(pickle.loads(pickle.dumps(answer)) | answer) == ["walk", "limp"]
    )
    assert MOVES.pick(answer.only(["limp"])) == "limp"
    assert MOVES.pick(answer - answer) is None


# ---- many contexts


def of_contexts(given_facts: list[dict[str, object]], table: Table) -> dict[str, list[object]]:
    return {c.condition.name: [facts.get(c.condition.name) for facts in given_facts] for c in table.conditions}


@examples(1)
@given(st.data())
def test_many_answers_with_sets_of_values_and_fewer_rows_are_those_of_single_queries(data):
    table = data.draw(mirroring_tables())
    compiled, n, n_rows = table.compile(), data.draw(st.integers(1, 4)), table.n_rows
    has_sets = data.draw(st.booleans())
    facts = [data.draw(contexts(table, has_missing=True, has_sets=has_sets))[0] for _ in range(n)]
    if not table.conditions:
        return
    many = compiled.query_many(of_contexts(facts, table), unknown="never")
    alone = [compiled.query(one, unknown="never") for one in facts]
    flags = np.array([[data.draw(st.booleans()) for _ in range(n_rows)] for _ in range(n)], np.bool_).reshape(n, n_rows)
    other = compiled.query_many(of_contexts(facts[::-1], table), unknown="never")
    for found, expected in (
        (many, alone),
        (many.only(flags), [m.only(f) for m, f in zip(alone, flags, strict=True)]),
        (many & flags, [m.only(f) for m, f in zip(alone, flags, strict=True)]),
        (flags[0] & many, [m & flags[0] for m in alone]),
        (many.only(alone[0]), [m.only(alone[0]) for m in alone]),
        (many.only(other), [m.only(o) for m, o in zip(alone, alone[::-1], strict=True)]),
        (many & other, [m & o for m, o in zip(alone, alone[::-1], strict=True)]),
        (many | other, [m | o for m, o in zip(alone, alone[::-1], strict=True)]),
        (many - other, [m - o for m, o in zip(alone, alone[::-1], strict=True)]),
        (many ^ other, [m ^ o for m, o in zip(alone, alone[::-1], strict=True)]),
        (many - flags, [m - f for m, f in zip(alone, flags, strict=True)]),
        (many - alone[0].only([]), alone),
        ((many & other).only(flags), [(m & o).only(f) for m, o, f in zip(alone, alone[::-1], flags, strict=True)]),
    ):
        for same in (found, pickle.loads(pickle.dumps(found))):
            assert len(same) == n
            for i, (one, want) in enumerate(zip(same, expected, strict=True)):
                for answer in (one, same[i], same[i - n]):
                    assert (list(answer), answer.always.tolist()) == (list(want), want.always.tolist())
                    assert list(answer.mirrored) == list(want.mirrored)
                assert list(same.mirrored[i]) == list(want.mirrored)
            assert same.counts.tolist() == [len(m) for m in expected]
            assert same.hits.tolist() == [sum(row in m.rows for m in expected) for row in range(n_rows)]
            assert same.mask.tolist() == [m.mask.tolist() for m in expected]
            assert same.always.tolist() == [m.always.tolist() for m in expected]
            assert same.penalties.tolist() == [m.penalties.tolist() for m in expected]
            assert [rows.tolist() for rows in same.lists()] == [m.rows.tolist() for m in expected]
            assert isinstance(same, cdb.ManyMatches)


def test_many_answers_with_actors_keep_their_castings_in_fewer_rows():
    compiled = table_of([{"Defender.kind": "a"}, {"Defender.kind": "b"}])
    actors = [{"Defender": [{"id": 1, "kind": "a"}]}, {"Defender": [{"id": 2, "kind": "b"}, {"id": 3, "kind": "a"}]}]
    many = compiled.query_many({"is_wet": [True, True]}, actors=actors)
    fewer = many.only([0])
    assert isinstance(fewer, cdb.ManyMatches)
    assert [[m.casting(row)["Defender"]["id"] for row in m.rows] for m in fewer] == [[1], [3]]
    assert fewer.mask.tolist() == [[1], [1]]


def test_flags_or_answers_for_another_number_of_contexts_are_refused():
    many = MOVES.query_many({"speed": [1.0, 2.0], "is_hurt": [True, False]})
    with pytest.raises(cdb.ContextError, match=r"flags of shape \(3, 3\), for 2 contexts of 3 rows. Accepted: .*\(2, 3\)"):
        many.only(np.ones((3, 3), np.bool_))
    with pytest.raises(cdb.ContextError, match="answers for 1 context, and for 2"):
        many.only(MOVES.query_many({"speed": [1.0], "is_hurt": [True]}))


def test_answers_for_many_contexts_are_joined_with_such_answers_only():
    many = MOVES.query_many({"speed": [1.0, 2.0], "is_hurt": [True, False]})
    for join in (operator.or_, operator.xor):
        with pytest.raises(
            TypeError, match=r"many contexts cannot be joined with Matches\. Accepted: as many answers of the same table"
        ):
            join(many, many[0])
    with pytest.raises(TypeError, match=r"pick is given the answers for many contexts.*Did you mean many\[i\]"):
        MOVES.pick(many)


def test_sets_of_values_for_many_contexts_hold_derived_facts_and_rules_too():
    table = Table.from_columns(
        {"Asset": ["near", "far"], "gap": ["<=2", ">2"], "When": ["speed > 1", ""]},
        {"gap": {"type": "number", "expr": "abs(speed) - 1"}, "speed": {"type": "number"}},
        {"when": "When"},
    ).compile()
    ok = [1.5, 4.0]
    assert [list(m) for m in table.query_many({"speed": ok})] == [list(table.query({"speed": s})) for s in ok]
    columns = {"speed": [1.5, cdb.cell("1..4")]}
    many, alone = table.query_many(columns), [table.query({"speed": fact}) for fact in columns["speed"]]
    assert [m.rows.tolist() for m in many] == [m.rows.tolist() for m in alone] == [[0], [0, 1]]
    assert many.always.tolist() == [m.always.tolist() for m in alone]


def test_a_motion_search_takes_fewer_rows_and_many_answers_where_there_are_many_characters():
    features = np.arange(3, dtype=np.float32)[:, None]
    database = motion.MotionDatabase.from_features(features, [0, 1, 2], [1, 2, 3], ["walk", "run", "limp"])
    many = MOVES.query_many({"speed": [1.0, 2.0], "is_hurt": [True, True]})
    assert [hit.asset for hit in database.search_many(np.zeros((2, 1)), many)] == ["walk", "walk"]
    assert [hit.asset for hit in database.search_many(np.zeros((2, 1)), many.only(["limp"]))] == ["limp", "limp"]
    assert database.search([0.0], many[0] - ["walk"]).asset == "limp"
    selector = motion.Selector([motion.Entry("moves", database)])
    for search in (database.search, selector.search):
        with pytest.raises(QueryError, match=r"valid holds the answers for many contexts.*Try to give that of one: many\[i\]"):
            search([0.0], many)


# ---- one way of asking


def test_actors_and_preference_are_taken_by_every_way_of_asking():
    compiled = table_of([{"Defender.kind": "a", "Asset Name": "one"}, {"Defender.kind": "b", "Asset Name": "two"}])
    facts, actors = {"is_wet": True}, {"Defender": [{"id": 1, "kind": "b", "far": 1}, {"id": 2, "kind": "b", "far": 0}]}
    assert compiled.pick(facts, actors=actors, prefer="far") == "two"
    assert compiled.penalties(facts, actors=actors).tolist() == [0.0, 0.0]
    live = compiled.live(facts, actors=actors, prefer="far")
    assert (live.pick(), live.explain()[0].asset) == ("two", "two")
    assert live.matches().casting(1)["Defender"]["id"] == 2
    assert str(live.explain()) == str(compiled.explain(facts, actors=actors, prefer="far"))


def test_a_live_context_picks_and_explains_for_its_facts_as_they_are_now():
    live = MOVES.live(FACTS)
    assert live.pick(rng=1, last="walk") == MOVES.pick(FACTS, rng=1, last="walk") == "limp"
    assert str(live.explain()) == str(MOVES.explain(FACTS))
    live["speed"] = 5.0
    assert (live.pick(), live.explain().row(0).is_valid) == (None, False)
    lacking = MOVES.live({"speed": 1.0}, unknown="any")
    assert str(lacking.explain()) == str(MOVES.explain({"speed": 1.0}, unknown="any"))


# ---- tables made in Python


ROWS = [{"Asset": "walk", "speed": "0..2", "Prio": 1}, {"Asset": "run", "speed": 3.5, "ok": True}]
COLUMNS = {"Asset": ["walk", "run"], "speed": ["0..2", 3.5], "Prio": [1, None], "ok": [None, True]}


@pytest.mark.parametrize("given_columns", [ROWS, tuple(ROWS), COLUMNS], ids=["rows", "tuple", "columns"])
def test_a_table_is_made_of_rows_or_columns_with_settings_as_the_toml_names_them(given_columns):
    table = Table.from_columns(given_columns, SCHEMA, {"priority": "Prio", "policy": "priority"}, name="passes")
    assert (table.name, table.assets, table.priorities.tolist()) == ("passes", ["walk", "run"], [1, 0])
    assert [column.to_list() for column in table.columns[1:]] == [["0..2", "3.5"], ["1", ""], ["", "True"]]
    assert table.compile().query({"speed": 3.5, "ok": True}).assets == ["run"]


def test_a_table_is_made_of_a_frame_as_of_a_parquet_file(tmp_path):
    frame = pl.DataFrame({"Asset": ["walk", "run"], "speed": [1.0, None], "ok": [True, False]})
    frame.write_parquet(tmp_path / "t.parquet")
    table, read = Table.from_columns(frame), cdb.load(tmp_path / "t.parquet")
    assert (
        [c.to_list() for c in table.columns]
        == [c.to_list() for c in read.columns]
        == [["walk", "run"], ["1.0", ""], ["True", "False"]]
    )
    with pytest.raises(cdb.TableError, match=r'column "t": the column is of type Time'):
        Table.from_columns(pl.DataFrame({"Asset": ["a"], "t": pl.Series([0], dtype=pl.Time)}))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"prio": "Prio"}, r'\[tables\.table\] has no key "prio"\. .* Did you mean "priority"\?'),
        ({"priority": 3}, r"priority = 3: this is a number, not text"),
        ({"priority": "speed"}, r'priority names "speed", which is declared as a condition'),
        ({"priority": "Pri"}, r'there is no column "Pri", which \[tables\.table\] names as priority.* Did you mean "Prio"'),
        ({"policy": "frist"}, r'Did you mean policy = "first"'),
        (7, r'settings is int "7". Accepted: a mapping'),
    ],
)
def test_settings_that_cannot_be_used_are_refused_as_those_of_a_file(settings, message):
    with pytest.raises(cdb.ContextDBError, match=message):
        Table.from_columns(COLUMNS, SCHEMA, settings)


# ---- how things show themselves


HOSTILE = '<b>"x"\n\x1b[0m</b>'


def hostile() -> list[object]:
    table = Table.from_columns({HOSTILE: [HOSTILE] * 30, "speed": ["0..2"] * 30}, SCHEMA, name=HOSTILE)
    compiled = table.compile()
    facts = {"speed": 1.0}
    return [table, compiled, compiled.query(facts), compiled.explain(facts), cdb.coverage(table), compiled.live(facts),
            compiled.query_many({"speed": [1.0]}), *table.columns, *table.conditions, table.schema]  # fmt: skip


@pytest.mark.parametrize("thing", hostile(), ids=lambda thing: type(thing).__name__)
def test_everything_shows_itself_in_one_short_line_whatever_it_is_called(thing):
    line = repr(thing)
    assert line.isprintable()
    assert len(line) < 400
    if html := getattr(thing, "_repr_html_", lambda: "")():
        assert "<b>" not in html
        assert "\x1b" not in html
        assert html.count("<tr>") <= 21


def test_a_notebook_shows_the_first_rows_and_how_many_more_there_are():
    html = Table.from_columns({"Asset": [f"a{i}" for i in range(25)]})._repr_html_()
    assert "<td>a19</td>" in html
    assert "a20" not in html
    assert "and 5 more" in html


def test_public_things_tell_their_type_name_and_size():
    table = Table.from_columns({"Asset": ["a"] * 10_000, **{f"c{i}": ["True"] * 10_000 for i in range(40)}}, name="wide")
    compiled = table.compile()
    assert repr(table) == '<Table "wide": 10,000 rows x 40 conditions>'
    assert repr(compiled) == f'<CompiledTable "wide": 10,000 rows x 40 conditions, {compiled.nbytes:,} bytes>'
    assert repr(MOVES.query(FACTS)) == '<Matches "moves": 2 of 3 rows>'
    assert repr(MOVES.query({"speed": cdb.cell("0..5"), "is_hurt": True})) == '<Matches "moves": 2 of 3 rows>'
    many = MOVES.query_many({"speed": [1.0, cdb.cell("0..5")], "is_hurt": [True, True]})
    assert repr(many) == repr(many.only([0])) == '<ManyMatches "moves": 2 contexts x 3 rows>'
    assert repr(MOVES.live({"speed": 1.0}, unknown="any")) == '<LiveContext "moves": 1 of 2 facts set>'
    assert repr(MOVES.explain(FACTS)) == '<Explanation "moves": 2 of 3 rows valid>'
    assert repr(cdb.coverage(TABLE)).startswith('<CoverageReport "moves": ')
    assert repr(replace(TABLE.schema, name="game")) == '<Schema "game": 2 conditions, 0 tables>'


def test_a_project_a_watch_and_a_snapshot_tell_their_tables(tmp_path):
    (tmp_path / "jog.csv").write_text("Asset,speed\njog,0..2\n", encoding="utf-8")
    assert repr(cdb.Project.load(tmp_path)) == f'<Project "{tmp_path.name}": 1 table>'
    with cdb.watch(tmp_path, poll_s=None) as watch:
        assert repr(watch) == f'<Watch "{tmp_path.name}": version 1 of 1 table>'
        assert repr(watch.snapshot()) == f'<Snapshot "{tmp_path.name}": version 1 of 1 table>'
    assert repr(watch).endswith(", closed>")


def test_an_answer_is_not_mistaken_for_numbers_by_numpy():
    answer = MOVES.query(FACTS)
    assert np.asarray(answer).tolist() == ["walk", "limp"]
