"""Many contexts at once: counts, hits and masks are those of one query after another, in every form that columns come in."""

import math
from bisect import bisect_right
from collections.abc import Callable
from contextlib import AbstractContextManager
from datetime import date
from fractions import Fraction
from typing import Literal
from unittest import mock

import numpy as np
import oracles
import polars as pl
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from strategies import for_each

from contextdb import bitmask
from contextdb.cells.domains import Domain
from contextdb.cells.fact_columns import column_type
from contextdb.compiled import batch
from contextdb.compiled.classes import FLAT_BYTES, TagMasks
from contextdb.compiled.many import ManyMatches
from contextdb.compiled.table import data_of
from contextdb.core import read_column
from contextdb.errors import ContextError
from contextdb.tables.table import Table

COLUMNS = pytest.mark.parametrize("flat_bytes", [FLAT_BYTES, 0, 100], ids=["flat", "wide", "mixed"])
N_CONTEXTS = [0, 1, 2, 127, 128, 129, 300]


def cut_at(flat_bytes: int) -> AbstractContextManager[object]:
    """Number columns whose masks take more bytes are wide."""
    return mock.patch("contextdb.compiled.classes.FLAT_BYTES", flat_bytes)


def assert_answers(many: ManyMatches, n_rows: int, expected: list[list[int]]) -> None:
    """Every form of the answer tells the expected rows of each context."""
    flags = np.zeros((len(expected), n_rows), np.bool_)
    for context, rows in enumerate(expected):
        flags[context, rows] = True
    assert len(many) == len(expected)
    assert (many.counts.dtype, many.hits.dtype, many.mask.dtype) == (np.int64, np.int64, np.uint64)
    assert many.counts.tolist() == flags.sum(axis=1).tolist()
    assert many.hits.tolist() == flags.sum(axis=0).tolist()
    assert many.mask.shape == (len(expected), bitmask.n_words(n_rows))
    assert many.mask.tolist() == bitmask.pack(flags).tolist()
    assert [rows.tolist() for rows in many.lists()] == expected


# ---- the forms that a column of facts comes in


def as_list(facts: list[strategies.Fact], domain: Domain) -> object:
    return [fact.given for fact in facts]


def as_array(facts: list[strategies.Fact], domain: Domain) -> object:
    plain = [fact.plain for fact in facts]
    if domain.type.is_numeric:
        return np.array([math.nan if value is None else value for value in plain], np.float64)
    if domain.kind == "tags" or None in plain:
        objects = np.empty(len(plain), np.object_)
        objects[:] = plain
        return objects
    return np.array(plain, np.bool_ if domain.kind == "bool" else np.str_)


def as_series(facts: list[strategies.Fact], domain: Domain) -> pl.Series:
    plain = [sorted(fact.plain) if isinstance(fact.plain, frozenset) else fact.plain for fact in facts]
    if domain.kind == "date":
        return pl.Series(plain, dtype=pl.Float64).cast(pl.Int32).cast(pl.Date)
    return pl.Series(plain, dtype=column_type(domain.type))


def as_narrow_series(facts: list[strategies.Fact], domain: Domain) -> pl.Series:
    """Categories for texts, float32 for numbers that keep their value in it, whole numbers for those that are whole."""
    series = as_series(facts, domain)
    if domain.kind in ("enum", "text"):
        return series.cast(pl.Categorical)
    if domain.type.is_decimal and series.null_count() < len(series):
        for dtype in (pl.Int16, pl.Int64, pl.Float32):
            narrow = series.cast(dtype, strict=False)
            if narrow.cast(pl.Float64).equals(series, null_equal=True):
                return narrow
    return series


def as_enum_series(facts: list[strategies.Fact], domain: Domain) -> pl.Series:
    """Polars enums whose values stand in an order of their own, with one that the condition may not know."""
    series = as_series(facts, domain)
    if domain.kind not in ("enum", "text"):
        return series
    return series.cast(pl.Enum(["(unused)", *sorted(set(series.drop_nulls()), reverse=True)]))


FORMS: dict[str, Callable[[list[strategies.Fact], Domain], object]] = {
    "lists": as_list,
    "arrays": as_array,
    "series": as_series,
    "narrow": as_narrow_series,
    "enums": as_enum_series,
}


@pytest.mark.parametrize("form", FORMS)
@COLUMNS
@given(strategies.tables(least_conditions=1), st.sampled_from(["any", "never"]), st.data())
@strategies.examples(0.25)
def test_a_batch_finds_what_reading_every_cell_for_each_context_finds(flat_bytes, form, table, unknown, data):
    pools = {}
    for column in table.conditions:
        fact = strategies.plain_facts(column.condition.domain, column.texts.texts)
        pools[column.condition.name] = data.draw(st.lists(fact | fact | strategies.MISSING, min_size=1, max_size=4))
    steps = range(data.draw(st.sampled_from(N_CONTEXTS)))
    chosen = {name: [pool[(i * 7 + i // 5) % len(pool)] for i in steps] for name, pool in pools.items()}
    columns = {c.condition.name: FORMS[form](chosen[c.condition.name], c.condition.domain) for c in table.conditions}
    contexts = pl.DataFrame(columns) if form in ("series", "narrow", "enums") else columns
    known: dict[tuple[object, ...], list[int]] = {}
    expected = []
    for i in steps:
        plain = {name: facts[i].plain for name, facts in chosen.items()}
        key = tuple(plain.values())
        known[key] = known[key] if key in known else oracles.rows(table, plain, unknown)
        expected.append(known[key])
    with cut_at(flat_bytes):
        assert_answers(table.compile().query_many(contexts, unknown=unknown), table.n_rows, expected)


@COLUMNS
@given(strategies.tables(least_conditions=1), st.data())
@strategies.examples(0.25)
def test_the_codes_of_a_batch_are_those_of_each_context(flat_bytes, table, data):
    contexts = [data.draw(strategies.contexts(table, has_missing=True))[0] for _ in range(3)]
    columns = {c.condition.name: [context.get(c.condition.name) for context in contexts] for c in table.conditions}
    with cut_at(flat_bytes):
        compiled = table.compile()
        codes = compiled.query_many(columns, unknown="never").codes
    assert codes.dtype == np.int32
    alone = [{name: [facts[i]] for name, facts in columns.items()} for i in range(3)]
    assert codes.tolist() == [compiled.query_many(one, unknown="never").codes[0].tolist() for one in alone]


def big_table() -> Table:
    n_rows = 200
    return Table.from_columns(
        {
            "Asset": [f"A{r}" for r in range(n_rows)],
            "speed": [f"{r % 17}..{r % 17 + 5}" for r in range(n_rows)],
            "state": [("CB", "FS SS", "Any", "not CB")[r % 4] for r in range(n_rows)],
            "tags": [("+InAir", "-InAir", "Any")[r % 3] for r in range(n_rows)],
        },
        {"speed": {"type": "number"}, "state": {"type": "enum", "values": ["CB", "FS", "SS"]}, "tags": {"type": "tags"}},
    )


def test_more_contexts_than_one_thread_and_one_block_takes_are_all_answered():
    table, n_contexts = big_table(), 2 * batch.THREAD_CONTEXTS + batch.BLOCK + 77
    speeds, states, tags = np.arange(n_contexts) % 23, ["CB", "FS", "SS"], [["InAir"], []]
    columns = {
        "speed": speeds,
        "state": [states[i % 3] for i in range(n_contexts)],
        "tags": [tags[i % 2] for i in range(n_contexts)],
    }
    period = 23 * 3 * 2
    one = [
        oracles.rows(table, {"speed": float(i % 23), "state": states[i % 3], "tags": frozenset(tags[i % 2])}) for i in range(period)
    ]
    with mock.patch("os.cpu_count", return_value=4), mock.patch.object(batch, "PART", 1000):
        many = table.compile().query_many(columns)
        counts, hits = many.counts, many.hits
    expected = [one[i % period] for i in range(n_contexts)]
    assert counts.tolist() == [len(rows) for rows in expected]
    assert hits.tolist() == np.bincount(np.concatenate(expected).astype(np.int64), minlength=table.n_rows).tolist()


def test_a_table_without_conditions_answers_every_row_in_every_context():
    assert_answers(Table.from_columns({"Asset": ["a", "b"]}).compile().query_many({"speed": [1, 2, 3]}), 2, [[0, 1]] * 3)


def test_no_contexts_have_no_answers():
    many = big_table().compile().query_many({"speed": [], "state": [], "tags": []})
    assert_answers(many, 200, [])


def test_many_numbers_have_the_classes_that_bisection_finds():
    rng = np.random.default_rng(3)
    edges = [-1.7e308, -3.0, -1.0, 0.0, 5e-324, 1e-300, 1.0, 1.0 + 1e-9, 2.0, 3.5, 72.0, 1e16, 1.7e308]
    for seed in range(20):
        low = rng.choice(edges, 1 + seed) if seed % 2 else np.round(rng.uniform(-9.0, 9.0, 1 + seed) * 2.0) / 2.0
        cells = [f"{a!r}..{b!r}" for a, b in zip(low.tolist(), np.maximum(low, 4.0).tolist(), strict=True)]
        table = Table.from_columns({"Asset": [f"a{i}" for i in range(len(cells))], "x": cells}, {"x": {"type": "number"}}).compile()
        masks = data_of(table).masks[0]
        near = np.concatenate([np.nextafter(masks.bounds, -np.inf), masks.bounds, np.nextafter(masks.bounds, np.inf)])
        facts = np.concatenate([near, edges, [np.inf, -np.inf, -0.0], rng.normal(0.0, 30.0, batch.MANY_NUMBERS)])
        codes = table.query_many({"x": np.append(facts, np.nan)}, unknown="never").codes[:, 0]
        assert codes.tolist() == [*(1 + bisect_right(masks.bounds.tolist(), x) for x in facts.tolist()), len(masks.bounds) + 2]


def test_codes_and_arrays_that_do_not_go_together_are_refused():
    data = data_of(big_table().compile())
    codes = np.zeros((3, 4), np.int32)
    with pytest.raises(ValueError, match="shape"):
        data.codes.batch.answer(codes, 0, 5, None, None, None, None)
    with pytest.raises(ValueError, match="shape"):
        data.codes.batch.answer(codes, 0, 4, np.zeros(3, np.int64), None, None, None)
    for wrong in (-1, 1, 100_000):
        codes[1, 2] = wrong
        assert data.codes.batch.answer(codes, 0, 4, None, None, None, None) is False
    with pytest.raises(ValueError, match="column"):
        read_column(data.core, 7, [1.0], 1, False, None, codes[:1])
    with pytest.raises(ValueError, match="cells"):
        read_column(data.core, 0, [1.0] * 4, 1, False, (np.zeros(99), 0.0, 1.0, np.zeros(2, np.int32)), codes[:1])


# ---- what is said of contexts that cannot be asked with

TABLE = Table.from_columns(
    {"Asset": ["run", "jump"], "speed": ["3..6", "Any"], "state": ["Ground", "Air"], "steps": ["1..2", "Any"]},
    {
        "speed": {"type": "number"},
        "state": {"type": "enum", "values": ["Ground", "Air"]},
        "steps": {"type": "int"},
    },
).compile()
COLUMNS_GIVEN = {"speed": [1.0, 4.0, 5.0], "state": ["Ground", "Air", "Ground"], "steps": [1, 1, 2]}


def test_the_columns_of_these_tests_can_be_asked_with():
    assert [rows.tolist() for rows in TABLE.query_many(COLUMNS_GIVEN).lists()] == [[], [1], [0]]


def test_columns_that_no_condition_asks_for_are_passed_over():
    many = TABLE.query_many({**COLUMNS_GIVEN, "weather": ["rain", None, object()]})
    assert many.counts.tolist() == [0, 1, 1]


TRUTHS = [
    [0, 1, True],
    [False, True, True],
    np.array([0, 1, 1]),
    pl.Series([0.0, 1.0, 1.0]),
    [np.False_, 1.0, np.int8(1)],
]


@pytest.mark.parametrize("column", TRUTHS, ids=["mixed", "bool", "array", "series", "numpy"])
def test_a_column_of_truth_may_be_of_zeros_and_ones(column):
    table = Table.from_columns({"Asset": ["a", "b"], "x": ["True", "False"]}, {"x": {"type": "bool"}}).compile()
    assert [rows.tolist() for rows in table.query_many({"x": column}).lists()] == [[1], [0], [0]]


@pytest.mark.parametrize(
    "column",
    [
        [2**53 + 1, 5.5, 2**70],
        [np.float32(2**53), Fraction(11, 2), 1e30],
        ["9007199254740992", "5.5", "1e30"],
        pl.Series(["9007199254740992", "5.5", "1e30"]),
    ],
    ids=["big integers", "mixed", "texts", "a series of texts"],
)
def test_a_column_of_numbers_may_be_mixed_and_very_large(column):
    table = Table.from_columns({"Asset": ["a", "b"], "x": ["9007199254740992", "5..6"]}, {"x": {"type": "number"}}).compile()
    assert [rows.tolist() for rows in table.query_many({"x": column}).lists()] == [[0], [1], []]


def test_truth_of_numpy_among_other_things_makes_no_truth_of_them():
    table = Table.from_columns({"Asset": ["a", "b"], "x": ["True", "False"]}, {"x": {"type": "bool"}}).compile()
    many = table.query_many({"x": [np.False_, math.nan, None, 1.0]}, unknown="never")
    assert [rows.tolist() for rows in many.lists()] == [[1], [], [], [0]]
    with pytest.raises(ContextError, match=r'row 2, column "x": float "2\.5" is not a fact of type bool'):
        table.query_many({"x": [np.True_, 2.5]})


def test_a_float32_among_other_numbers_makes_no_float32_of_them():
    table = Table.from_columns({"Asset": ["a", "b"], "x": ["0.1", "1e300"]}, {"x": {"type": "number"}}).compile()
    assert [rows.tolist() for rows in table.query_many({"x": [np.float32(2.5), 0.1, 1e300]}).lists()] == [[], [0], [1]]


def test_a_column_of_angles_is_wrapped_exactly():
    angles = [540.0, -180.0, 180.0, 170.0 + 360.0, 0.0, -0.0, 725.0, 1e17, -190.0]
    table = Table.from_columns({"Asset": ["a", "b"], "x": ["170..-170", "0..5"]}, {"x": {"type": "angle"}}).compile()
    expected = [[i for i, part in enumerate(["170..-170", "0..5"]) if oracles.is_on_arc(part, angle)] for angle in angles]
    for column in (angles, np.array(angles), pl.Series(angles)):
        assert [rows.tolist() for rows in table.query_many({"x": column}).lists()] == expected


def test_a_frame_with_a_column_of_nulls_has_missing_facts():
    frame = pl.DataFrame({"speed": pl.Series([None, None], dtype=pl.Null), "state": ["Ground", "Air"], "steps": [1, 2]})
    assert [rows.tolist() for rows in TABLE.query_many(frame, unknown="any").lists()] == [[0], [1]]
    assert [rows.tolist() for rows in TABLE.query_many(frame, unknown="never").lists()] == [[], [1]]


@pytest.mark.parametrize("kind", [list, set, frozenset, tuple])
def test_each_distinct_set_of_tags_is_looked_up_once(kind: type):
    compiled = Table.from_columns({"Asset": ["a", "b"], "x": ["+InAir", "not +Move"]}, {"x": {"type": "tags"}}).compile()
    given = [kind(tags) for tags in (["InAir"], ["Move"], []) * 100]
    codes = TagMasks.codes
    with mock.patch.object(TagMasks, "codes", autospec=True, side_effect=codes) as asked:
        many = compiled.query_many({"x": [*given, None]}, unknown="never")
        assert asked.call_count <= 5  # three sets, and what a missing fact is
    assert [rows.tolist() for rows in many.lists()] == [*([0, 1], [], [1]) * 100, []]


SERIES: dict[str, tuple[dict[str, object], list[object], list[pl.DataType]]] = {
    "number": ({"type": "number"}, [1.5, None, -3.0, 7.25, float("nan"), 2.0], [pl.Float64(), pl.Float32()]),
    "int": ({"type": "int"}, [1, None, -3, 7, 100, 2], [pl.Int8(), pl.Int16(), pl.Int32(), pl.Int64(), pl.Int128(), pl.Float64()]),
    "unsigned": ({"type": "int"}, [1, None, 3, 7, 100, 2], [pl.UInt8(), pl.UInt16(), pl.UInt32(), pl.UInt64()]),
    "angle": ({"type": "angle"}, [190.0, None, -180.0, 540.0, 1e9, 2.0], [pl.Float64()]),
    "date": ({"type": "date"}, [date(2026, 2, 1), None, date(1, 1, 1), date(9999, 12, 31), date(2026, 2, 2)], [pl.Date()]),
    "bool": ({"type": "bool"}, [True, None, False, True, True], [pl.Boolean()]),
    "enum": (
        {"type": "enum", "values": ["a", "bb", "a text that is longer than twelve"]},
        ["a", None, "a text that is longer than twelve", "bb"],
        [pl.String(), pl.Categorical(), pl.Enum(["bb", "a", "a text that is longer than twelve", "c"])],
    ),
    "text": (
        {"type": "text"},
        ["a", None, "", "\u00e9t\u00e9", "none of them", "a text that is longer than twelve"],
        [pl.String(), pl.Categorical()],
    ),
}


@for_each([(name, at) for name, (_, _, dtypes) in SERIES.items() for at in range(len(dtypes))])
def test_series_in_parts_and_cut_out_of_others_are_read_as_lists_are(name: str, at: int):
    schema, values, dtypes = SERIES[name]
    cells = {
        "enum": ["a", "not bb", "Any"],
        "text": ["a", "\u00e9t\u00e9", "Any"],
        "bool": ["True", "False", "Any"],
        "date": ["2026-02-01", ">=2026-02-02", "Any"],
    }
    texts = cells.get(name, ["0..2", ">=5", "Any"])
    table = Table.from_columns({"Asset": ["x", "y", "z"], "c": texts}, {"c": schema}).compile()
    plain = [values[i * 7 % len(values)] for i in range(200)]
    whole = pl.Series("c", plain, dtype=dtypes[at], strict=False)
    parts = pl.concat([whole[:3], whole[3:80], whole[80:80], whole[80:]], rechunk=False)
    expected = table.query_many({"c": plain}, unknown="never").codes.tolist()
    for start in (0, 1, 7, 77, 199):
        for series in (whole[start:], parts[start:], parts.slice(start, 50)):
            codes = table.query_many({"c": series}, unknown="never").codes
            assert codes.tolist() == expected[start : start + len(series)]
    n_missing = sum(value is None or value != value for value in plain)
    with pytest.raises(ContextError, match=f"missing in {n_missing} contexts"):
        table.query_many({"c": parts})


@pytest.mark.parametrize("dtype", [np.int8, np.uint16, np.int64, np.uint64, np.float32, np.float16, np.longdouble, ">f8", ">i4"])
def test_numbers_of_every_type_and_place_of_an_array_are_read_as_lists_are(dtype):
    table = Table.from_columns({"Asset": ["x", "y"], "c": ["0..2", ">=5"]}, {"c": {"type": "int"}}).compile()
    values = [(i * 7) % 11 for i in range(300)]
    expected = table.query_many({"c": values}).codes.tolist()
    array = np.array(values, dtype)
    for column in (array, np.repeat(array, 3)[::3], array[::-1][::-1], list(array), [*array, 1][:-1], tuple(array)):
        assert table.query_many({"c": column}).codes.tolist() == expected


def test_tags_may_be_lists_sets_or_texts():
    table = Table.from_columns({"Asset": ["a", "b"], "x": ["+InAir", "-Move"]}, {"x": {"type": "tags"}}).compile()
    for column in ([["InAir"], []], [{"InAir"}, set()], ["InAir", ""], pl.Series([["InAir"], []], dtype=pl.List(pl.String))):
        assert [rows.tolist() for rows in table.query_many({"x": column}).lists()] == [[0, 1], [1]]


def test_days_may_be_nanoseconds_of_numpy():
    table = Table.from_columns({"Asset": ["a", "b"], "x": ["2026-02-01", "2026-02-02.."]}, {"x": {"type": "date"}}).compile()
    days = np.array(["2026-02-01", "2026-02-05"], dtype="M8[ns]")
    assert [rows.tolist() for rows in table.query_many({"x": days}).lists()] == [[0], [1]]


def test_a_fact_that_numpy_masks_is_missing():
    table = Table.from_columns({"Asset": ["a", "b"], "x": ["0..2", "2.."]}, {"x": {"type": "number"}}).compile()
    masked = np.ma.array([1.0, 5.0, 3.0], mask=[False, True, False])
    assert [rows.tolist() for rows in table.query_many({"x": masked}, unknown="never").lists()] == [[0], [], [1]]
    with pytest.raises(ContextError, match='row 2, column "x": the fact is missing in 1 context'):
        table.query_many({"x": masked})


@pytest.mark.parametrize("unknown", ["any", "never"])
def test_what_soft_cells_cost_in_many_contexts_is_what_they_cost_in_each(unknown: Literal["any", "never"]):
    cells = {"A": ["a", "b", "c"], "speed": ["0..2 ~1.5", "Any", "2.. ~0.1"], "gait": ["Walk ~0.7", "Run ~0.2", "Walk"]}
    schema = {"speed": {"type": "number"}, "gait": {"type": "enum", "values": ["Walk", "Run"]}}
    contexts = {"speed": [1.0, 3.0, None, 2.0], "gait": ["Walk", "Run", "Run", None]}
    many = Table.from_columns(cells, schema).compile().query_many(contexts, unknown=unknown)
    each = [matches.penalties.tolist() for matches in many]
    assert each[1] == pytest.approx([2.2, 0.0, 0.0])
    assert many.penalties.tolist() == many.only([0]).penalties.tolist() == (many | many).penalties.tolist() == each
