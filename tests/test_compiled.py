"""A compiled table: what a query finds is what reading every cell finds, however the facts are given."""

import math
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from decimal import Decimal
from fractions import Fraction
from threading import Barrier
from unittest import mock

import numpy as np
import oracles
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from strategies import for_each

import contextdb as cdb
from contextdb import bitmask
from contextdb.cells.facts import cell
from contextdb.compiled.classes import FLAT_BYTES, NumberMasks, WideMasks
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.errors import ContextError
from contextdb.schema.settings import TableSettings
from contextdb.tables.table import Table

COLUMNS = pytest.mark.parametrize("flat_bytes", [FLAT_BYTES, 0, 100], ids=["flat", "wide", "mixed"])
"""How number columns are kept: in flat masks, all of them in two digits as very long ones are, or some so and some so."""

UNKNOWN = st.sampled_from(["any", "never"])


@contextmanager
def keeping(flat_bytes: int) -> Iterator[None]:
    with mock.patch("contextdb.compiled.classes.FLAT_BYTES", flat_bytes):
        yield


def compiled(conditions: dict[str, tuple[dict[str, object], list[str]]], **columns: list[str]) -> CompiledTable:
    """A table of conditions given as (what is declared, cells), with assets A0, A1, …"""
    n_rows = max(len(texts) for _, texts in conditions.values())
    texts = {"Asset": [f"A{r}" for r in range(n_rows)], **{name: texts for name, (_, texts) in conditions.items()}, **columns}
    return Table.from_columns(texts, {name: declared for name, (declared, _) in conditions.items()}).compile()


def speed_table(*cells: str) -> CompiledTable:
    return compiled({"speed": ({"type": "number"}, list(cells))})


def found(table: CompiledTable, context: dict[str, object], unknown: str = "error") -> list[int]:
    return table.query(context, unknown=unknown).indices.tolist()


# ---- a query is what reading every cell finds


@COLUMNS
@given(strategies.tables(), st.data())
@strategies.examples(3)
def test_a_query_finds_what_reading_every_cell_finds(flat_bytes, table, data):
    context, plain = data.draw(strategies.contexts(table))
    with keeping(flat_bytes):
        answer = table.compile().query(context)
    assert answer.indices.tolist() == oracles.rows(table, plain)
    assert answer.mask.tolist() == answer.always.tolist()


@COLUMNS
@given(strategies.tables(least_conditions=1), UNKNOWN, st.data())
def test_missing_facts_are_ignored_or_accepted_by_any_alone(flat_bytes, table, unknown, data):
    context, plain = data.draw(strategies.contexts(table, has_missing=True))
    with keeping(flat_bytes):
        assert found(table.compile(), context, unknown) == oracles.rows(table, plain, unknown)


@COLUMNS
@given(strategies.tables(least_conditions=1), UNKNOWN, st.data())
@strategies.examples(3)
def test_sets_of_values_find_the_rows_that_may_and_that_always_match(flat_bytes, table, unknown, data):
    context, plain = data.draw(strategies.contexts(table, has_missing=True, has_sets=True))
    with keeping(flat_bytes):
        answer = table.compile().query(context, unknown=unknown)
    assert answer.indices.tolist() == oracles.rows(table, plain, unknown)
    assert bitmask.rows(answer.always).tolist() == oracles.rows_always(table, plain, unknown)


@COLUMNS
@given(strategies.tables(), UNKNOWN, st.data())
def test_penalties_are_the_sum_of_the_soft_cells_that_do_not_match(flat_bytes, table, unknown, data):
    context, plain = data.draw(strategies.contexts(table, has_missing=True, has_sets=True))
    with keeping(flat_bytes):
        costs = table.compile().penalties(context, unknown=unknown)
    assert costs.dtype == np.float64
    assert costs.tolist() == pytest.approx(oracles.costs(table, plain, unknown))


@given(strategies.tables(least_conditions=1), st.data())
def test_a_missing_fact_is_an_error_that_names_it_unless_told_otherwise(table, data):
    context, plain = data.draw(strategies.contexts(table, has_missing=True))
    missing = [name for name, fact in plain.items() if fact is None]
    if missing:
        with pytest.raises(ContextError) as caught:
            table.compile().query(context)
        assert str(caught.value).startswith(f"the fact {table_quotes(missing[0])} is missing")
    else:
        assert found(table.compile(), context) == oracles.rows(table, plain)


def table_quotes(name: str) -> str:
    return f"'{name}'" if '"' in name else f'"{name}"'


# ---- numbers are compared as doubles, whatever their type


@pytest.mark.parametrize("unknown", ["any", "never"])
def test_nan_is_a_missing_fact_where_the_number_is_the_only_condition(unknown):
    assert found(speed_table("0..5", "Any"), {"speed": math.nan}, unknown) == ([0, 1] if unknown == "any" else [1])


@pytest.mark.parametrize("fact", [math.inf, 2**60, -(2**60)])
def test_a_number_beyond_2_to_the_53_is_found_where_it_is_the_only_condition(fact):
    assert found(speed_table("Any", "0..5"), {"speed": fact}) == [0]


@for_each(
    [
        ("0", np.float32(0.0), True),
        (">=16777217", np.float32(16777216.0), False),
        ("<=0.1", np.float32(0.1), False),
        (">=2049", np.float16(2048.0), False),
        (">=70000", np.float16(60000.0), False),
        (">=0.1", Fraction(1, 10), True),
        ("<0.1", Fraction(1, 10), False),
        (">=9007199254740993", 9007199254740993, True),
        ("9007199254740992", 9007199254740993, True),
        (">=0.1", np.longdouble("0.1"), True),
        ("5e-324", -0.0, False),
        ("0", -0.0, True),
        ("..5", "4.5..5", True),
    ],
    [{}, {"still": True}],
)
def test_a_number_of_any_type_is_compared_as_the_double_it_is(text, fact, is_held, other):
    declared = {"speed": ({"type": "number"}, [text])}
    if other:
        declared["still"] = ({"type": "bool"}, ["Any"])
    table = compiled(declared)
    assert bool(table.query({"speed": fact, **other})) is is_held
    assert bool(table.live({"speed": fact, **other}).matches()) is is_held


@pytest.mark.parametrize("fact", [Decimal("0.1"), Decimal("0.05"), Decimal("NaN"), b"1", "nan"], ids=str)
def test_every_way_to_ask_takes_or_refuses_an_odd_number_alike(fact):
    table = speed_table(">=0.1", "<0.1", "Any")
    ways = [
        lambda: found(table, {"speed": fact}, "never"),
        lambda: table.live({"speed": fact}, unknown="never").matches().indices.tolist(),
        lambda: table.query_many({"speed": [fact, fact]}, unknown="never").lists()[1].tolist(),
    ]
    answers = [answer_of(way) for way in ways]
    assert answers == answers[:1] * 3


def answer_of(way: Callable[[], list[int]]) -> list[int] | str:
    try:
        return way()
    except ContextError:
        return "refused"


@given(st.sampled_from(strategies.ANGLES), st.sampled_from(strategies.ANGLES), st.integers(-3, 3), st.data())
def test_an_angle_is_the_same_after_any_number_of_turns(low, high, n_turns, data):
    table = compiled({"heading": ({"type": "angle"}, [f"{low!r}..{high!r}", f"({low!r}..{high!r})"])})
    edge = data.draw(st.sampled_from([low, high, 180.0, 0.0]))
    angle = math.nextafter(edge + 360.0 * n_turns, data.draw(st.sampled_from([-math.inf, edge + 360.0 * n_turns, math.inf])))
    expected = [i for i, part in enumerate(data_of(table).texts[0].to_list()) if oracles.is_on_arc(part, angle)]
    assert found(table, {"heading": angle}) == expected
    assert found(table, {"heading": cell(repr(angle))}) == expected


# ---- sizes


@pytest.mark.parametrize("kind", ["number", "int", "angle"])
def test_ten_thousand_bounds_at_ten_thousand_rows_take_at_most_10_mb_and_answer_right(kind):
    random = np.random.default_rng(0)
    lows = random.permutation(10_000) / 2 if kind == "number" else random.permutation(10_000) * 3.0
    lows = lows / 200 - 90.0 if kind == "angle" else lows
    highs = lows + (random.integers(0, 40, 10_000) / 7 if kind != "int" else random.integers(0, 40, 10_000))
    table = compiled({"x": ({"type": kind}, [f"{a!r}..{b!r}" for a, b in zip(lows.tolist(), highs.tolist(), strict=True)])})
    assert isinstance(data_of(table).masks[0], WideMasks)
    assert table.nbytes <= 10 << 20
    for fact in [lows.min(), lows.max(), highs.max(), *random.choice(lows, 20), *random.choice(highs, 20)]:
        expected = np.flatnonzero((lows <= float(fact)) & (float(fact) <= highs)).tolist()
        if kind == "int":
            fact = int(fact)
        assert found(table, {"x": fact}) == expected


def test_a_table_without_conditions_answers_every_enabled_row():
    columns = {"Asset": ["a", "b", "c"], "Enabled": ["True", "False", ""]}
    table = Table.from_columns(columns, settings=TableSettings("t", enabled="Enabled")).compile()
    assert table.query({}).assets == ["a", "c"]
    assert table.live().matches().assets == ["a", "c"]


def test_a_table_without_rows_answers_no_row():
    table = compiled({"speed": ({"type": "number"}, [])})
    assert (found(table, {"speed": 1.0}), table.query({"speed": 1.0}).mask.shape, table.nbytes) == ([], (0,), 0)


def test_a_table_without_any_column_answers_no_row():
    assert found(Table.from_columns({}).compile(), {}) == []


# ---- compiling


def test_one_edit_compiles_one_column():
    table = Table.from_columns(
        {"Asset": ["a", "b"], "speed": ["0..5", "Any"], "still": ["True", "False"], "tags": ["+InAir ~2", "Any"]},
        {"speed": {"type": "number"}, "still": {"type": "bool"}, "tags": {"type": "tags"}},
    )
    before, after = table.compile(), table.with_cell(1, "speed", "3..4").compile()
    assert [new is old for new, old in zip(data_of(after).masks, data_of(before).masks, strict=True)] == [False, True, True]
    assert [new is old for new, old in zip(data_of(after).soft, data_of(before).soft, strict=True)] == [True, True, True]
    assert found(before, {"speed": 5, "still": False, "tags": []}) == [1]
    assert found(after, {"speed": 5, "still": False, "tags": []}) == []


def test_compiling_the_same_table_again_compiles_nothing():
    table = strategies_table()
    assert all(new is old for new, old in zip(data_of(table.compile()).masks, data_of(table.compile()).masks, strict=True))


def strategies_table() -> Table:
    return Table.from_columns({"Asset": ["a"], "speed": ["0..5"]}, {"speed": {"type": "number"}})


@COLUMNS
@given(strategies.tables())
def test_no_mask_has_a_bit_past_the_last_row(flat_bytes, table):
    with keeping(flat_bytes):
        ready = table.compile()
    for masks in data_of(ready).masks:
        parts = [masks.low, masks.high, masks.any_mask] if isinstance(masks, WideMasks) else [masks.masks]
        for part in parts:
            assert all(bitmask.to_int(part[place]) < 1 << table.n_rows for place in np.ndindex(part.shape[:-1]))


def test_a_short_number_column_is_kept_flat():
    assert isinstance(data_of(speed_table("0..5")).masks[0], NumberMasks)


# ---- several threads


def test_four_threads_that_ask_at_once_get_the_answers_of_one():
    n_rows = 500
    cells = {
        "speed": ({"type": "number"}, [f"{r % 40}..{r % 40 + 9}" for r in range(n_rows)]),
        "state": ({"type": "enum", "values": ["CB", "FS", "SS"]}, [("CB FS", "Any", "not SS")[r % 3] for r in range(n_rows)]),
        "tags": ({"type": "tags"}, [("+InAir", "-Stunned", "Any", "+Move")[r % 4] for r in range(n_rows)]),
        "heading": ({"type": "angle"}, [f"{r % 360}, 40" for r in range(n_rows)]),
    }
    states, tags = ["CB", "FS", "SS"], [["InAir"], ["Stunned"], ["Move.Run"]]
    contexts = [{"speed": i % 50, "state": states[i % 3], "tags": tags[i % 3], "heading": 7 * i} for i in range(200)]
    alone = compiled(cells)
    expected = [found(alone, context) for context in contexts]
    together, start = compiled(cells), Barrier(4)

    def ask(_: int) -> list[list[int]]:
        start.wait()
        answers = [found(together, context) for context in contexts]
        return answers

    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(ask, range(4))) == [expected] * 4


# ---- what is said of a context that cannot be asked with

DECLARED = {
    "speed": ({"type": "number"}, ["0..5"]),
    "state": ({"type": "enum", "values": ["Going_Up", "Top", "Going_Down"]}, ["Top"]),
    "tags": ({"type": "tags", "values": ["InAir", "Stunned"]}, ["+InAir"]),
}
COMPLETE = {"speed": 3.0, "state": "Top", "tags": ["InAir"]}


def test_facts_that_no_condition_asks_for_are_passed_over():
    assert found(compiled(DECLARED), {**COMPLETE, "weather": "rain", "speed2": object()}) == [0]


@pytest.mark.parametrize("unknown", ["any", "never"])
def test_a_declared_fact_of_another_table_is_no_slip_for_a_missing_one(unknown, tmp_path):
    schema = {name: {"type": "bool"} for name in ("Defender.Catching", "Defender.CatchingAnim")}
    table = cdb.Table.from_columns({"Asset": ["a"], "Defender.Catching": ["True"]}, schema).compile()
    table.save(tmp_path / "table.safetensors")
    facts = {"Defender.CatchingAnim": True}
    for asked in (table, cdb.CompiledTable.open(tmp_path / "table.safetensors")):
        rows = [0] if unknown == "any" else []
        assert asked.query(facts, unknown=unknown).rows.tolist() == rows
        assert asked.query_many({name: [value] for name, value in facts.items()}, unknown=unknown).counts.tolist() == [len(rows)]
        actors = {"Defender": [{"CatchingAnim": True}]}
        assert asked.query({}, unknown=unknown, actors=actors).rows.tolist() == rows
        with pytest.raises(ContextError, match=r'Did you mean "Defender\.Catching"'):
            asked.query({"Defender.Catchin": True}, unknown=unknown)
