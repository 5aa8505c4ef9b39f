"""Parquet: values to texts that mean the same, and back to the types they had."""

import io
from datetime import date, datetime
from decimal import Decimal

import numpy as np
import polars as pl
import pytest
from csv_files import CELLS
from hypothesis import given
from hypothesis import strategies as st

from contextdb.columns import TextColumn
from contextdb.errors import TableError
from contextdb.files.parquet import ParquetSource, read_parquet, rewritten_parquet

NAMES = st.text(st.characters(exclude_categories=["Cs"]), max_size=6)


def parquet(columns: dict[str, pl.Series | list], **options) -> bytes:
    out = io.BytesIO()
    pl.DataFrame(columns).write_parquet(out, **options)
    return out.getvalue()


def texts(columns: dict[str, pl.Series | list]) -> list[list[str]]:
    return [c.to_list() for c in read_parquet(parquet(columns), "t.parquet")[1]]


def frame(source: ParquetSource) -> pl.DataFrame:
    return pl.read_parquet(io.BytesIO(source.raw))


def faults_of(raw: bytes) -> list[str]:
    with pytest.raises(TableError) as caught:
        read_parquet(raw, "t.parquet")
    return str(caught.value).split("\n")


def edited(columns: dict[str, pl.Series | list], row: int, text: str) -> pl.DataFrame:
    """The file after one text of its last column was changed."""
    source, (*others, last) = read_parquet(parquet(columns), "t.parquet")
    return frame(rewritten_parquet([*others, last.with_text(row, text)], source, np.arange(last.n_rows)))


# ---- reading


def test_values_become_the_texts_of_cells():
    assert texts(
        {
            "a": ["x", "", None, "20, 9.99"],
            "b": pl.Series(["p", None, "q", "p"], dtype=pl.Categorical),
            "c": pl.Series(["p", None, "q", "p"], dtype=pl.Enum(["p", "q"])),
            "d": [True, False, None, True],
            "e": [1, -2, None, 2**62],
            "f": [0.1, -0.0, None, 5.0],
            "g": pl.Series([0.1, 16777216.0, None, 3.3], dtype=pl.Float32),
            "h": [["CB", "FS"], ["Half Back"], None, ["Any", 'say "hi"', "5"]],
            "i": [None, None, None, None],
            "j": [date(2026, 1, 31), None, date(1, 1, 1), date(9999, 12, 31)],
            "k": pl.Series([datetime(2026, 1, 31), None, datetime(1700, 1, 1), datetime(2200, 12, 31)], dtype=pl.Datetime("ns")),
        }
    ) == [
        ["x", "", "", "20, 9.99"],
        ["p", "", "q", "p"],
        ["p", "", "q", "p"],
        ["True", "False", "", "True"],
        ["1", "-2", "", "4611686018427387904"],
        ["0.1", "-0.0", "", "5.0"],
        ["0.1", "16777216.0", "", "3.3"],
        ["CB FS", '"Half Back"', "", '"Any" "say ""hi""" "5"'],
        ["", "", "", ""],
        ["2026-01-31", "", "0001-01-01", "9999-12-31"],
        ["2026-01-31", "", "1700-01-01", "2200-12-31"],
    ]


@given(st.lists(st.floats(allow_nan=False), min_size=1, max_size=20))
def test_a_float_becomes_the_fewest_digits_that_read_back_as_the_same_float(values: list[float]):
    (found,) = texts({"a": values})
    assert [float(t).hex() for t in found] == [v.hex() for v in values]
    assert [Decimal(t) for t in found] == [Decimal(repr(v)) for v in values]


@given(st.lists(st.floats(width=32, allow_nan=False), min_size=1, max_size=20))
def test_a_single_precision_float_gets_no_digits_that_it_does_not_have(values: list[float]):
    (found,) = texts({"a": pl.Series(values, dtype=pl.Float32)})
    assert [np.float32(t).tobytes() for t in found] == [np.float32(v).tobytes() for v in values]
    assert [Decimal(t) for t in found] == [Decimal(str(np.float32(v))) for v in values]


def test_a_file_without_rows_is_a_table():
    source, columns = read_parquet(parquet({"a": pl.Series([], dtype=pl.String), "b": pl.Series([], dtype=pl.Int64)}), "t.parquet")
    assert [(c.name, c.n_rows) for c in columns] == [("a", 0), ("b", 0)]
    assert source.n_records == 0


def test_a_record_has_no_line():
    assert read_parquet(parquet({"a": ["x"]}), "t.parquet")[0].line(0) is None


def test_columns_whose_names_look_like_patterns_are_read():
    assert texts({"*": ["x"], "^.*$": ["y"], "a": [1]}) == [["x"], ["y"], ["1"]]


def test_a_file_that_is_cut_off_anywhere_is_refused():
    raw = parquet({"a": ["x", "y"], "b": [1, 2]})
    for size in range(0, len(raw), 7):
        assert faults_of(raw[:size])[0].startswith("t.parquet: the file is ")


def test_damaged_data_is_refused_with_the_reason():
    raw = bytearray(parquet({"a": [f"name {i}" for i in range(1000)]}))
    start = raw.index(b"\x28\xb5\x2f\xfd")  # the first compressed page
    raw[start + 20 : start + 60] = bytes(40)
    assert faults_of(bytes(raw))[0].startswith("t.parquet: the file is damaged: ")


# ---- writing


@given(st.lists(CELLS, max_size=8))
def test_a_fresh_file_holds_the_texts(cells: list[str]):
    source = rewritten_parquet([TextColumn.of("a", cells), TextColumn.of("*", cells)], None, np.full(len(cells), -1))
    assert [c.to_list() for c in read_parquet(source.raw, "t.parquet")[1]] == [cells, cells]


def test_without_an_edit_the_same_bytes_are_written():
    raw = parquet({"a": ["x", None], "b": [1.5, None]}, compression="snappy")
    source, columns = read_parquet(raw, "t.parquet")
    assert rewritten_parquet(columns, source, np.arange(2)).raw == raw


@pytest.mark.parametrize(
    ("values", "text", "value"),
    [
        (["x", "y"], "z", "z"),
        (pl.Series(["x", "y"], dtype=pl.Categorical), "z", "z"),
        (pl.Series(["x", "y"], dtype=pl.Enum(["x", "y"])), "y", "y"),
        ([True, True], "False", False),
        ([True, True], "no", False),
        ([True, True], "Any", None),
        (pl.Series([1, 2], dtype=pl.Int8), "-128", -128),
        ([1.5, 2.5], "3", 3.0),
        ([1.5, 2.5], "0.10", 0.1),
        ([1.5, 2.5], "", None),
        (pl.Series([1.5, 2.5], dtype=pl.Float32), "0.1", pytest.approx(0.1)),
        ([["x"], ["y"]], 'CB "Half Back"', ["CB", "Half Back"]),
        ([["x"], ["y"]], "Any", None),
        ([datetime(2026, 1, 31)] * 2, "2026-02-01", datetime(2026, 2, 1)),
        (pl.Series([datetime(2026, 1, 31)] * 2, dtype=pl.Datetime("ns")), "Any", None),
    ],
)
def test_a_column_keeps_its_type_where_the_new_text_fits(values, text: str, value: object):
    before = pl.Series(values)
    after = edited({"a": ["p", "q"], "b": values}, 0, text)["b"]
    assert after.dtype == before.dtype
    assert after.to_list() == [value, before.to_list()[1]]


@pytest.mark.parametrize(
    ("values", "text", "others"),
    [
        (pl.Series(["x", "y"], dtype=pl.Enum(["x", "y"])), "z", "y"),
        ([True, True], "not True", "True"),
        (pl.Series([1, 2], dtype=pl.Int8), "128", "2"),
        ([1, 2], "1..5", "2"),
        ([1.5, 2.5], "0.12345678901234567890", "2.5"),
        (pl.Series([1.5, 2.5], dtype=pl.Float32), "0.123456789", "2.5"),
        ([1.5, 2.5], "20, 9.99", "2.5"),
        ([["x"], ["y"]], "not CB", "y"),
        ([datetime(2026, 1, 31)] * 2, "2026-02-01..", "2026-01-31"),
        ([["x"], ["y"]], "CB  FS", "y"),
    ],
)
def test_a_column_becomes_strings_where_the_new_text_does_not_fit(values, text: str, others: str):
    after = edited({"a": ["p", "q"], "b": values}, 0, text)["b"]
    assert after.dtype == pl.String
    assert after.to_list() == [text, others]


def test_values_that_nobody_changed_keep_their_very_value():
    after = edited({"a": ["p"] * 4, "b": ["x", "", None, "y"]}, 0, "z")["b"]
    assert after.to_list() == ["z", "", None, "y"]
    numbers = edited({"a": ["p"] * 3, "b": [1.5, float("nan"), -0.0]}, 0, "2.5")["b"]
    assert str(numbers.to_list()) == "[2.5, nan, -0.0]"


def test_rows_are_moved_added_and_taken_away_with_their_types():
    source, columns = read_parquet(parquet({"a": ["x", "y", "z"], "b": [1, None, 3], "c": [["p"], None, ["q"]]}), "t.parquet")
    taken = [c.with_rows_taken(np.array([2, 0])).with_inserted(1, [t]) for c, t in zip(columns, ["new", "7", "p q"], strict=True)]
    after = frame(rewritten_parquet(taken, source, np.array([2, -1, 0])))
    assert after.rows() == [("z", 3, ["q"]), ("new", 7, ["p", "q"]), ("x", 1, ["p"])]
    assert after.dtypes == [pl.String, pl.Int64, pl.List(pl.String)]


def test_rows_can_be_added_to_a_file_without_rows():
    source, columns = read_parquet(parquet({"a": pl.Series([], dtype=pl.String), "b": pl.Series([], dtype=pl.Int64)}), "t.parquet")
    added = [c.with_inserted(0, [t]) for c, t in zip(columns, ["x", "5"], strict=True)]
    assert frame(rewritten_parquet(added, source, np.array([-1]))).rows() == [("x", 5)]


def test_columns_are_moved_renamed_added_and_taken_away_with_their_types():
    source, (a, _, c) = read_parquet(parquet({"a": [1, 2], "b": [True, None], "c": [0.5, 1.5]}), "t.parquet")
    new = rewritten_parquet([c, a.renamed("A"), TextColumn.of("d", ["x", ""])], source, np.arange(2), [2, 0, -1])
    assert frame(new).schema == {"c": pl.Float64, "A": pl.Int64, "d": pl.String}
    assert frame(new).rows() == [(0.5, 1, "x"), (1.5, 2, "")]


@given(st.lists(st.lists(NAMES, min_size=1, max_size=3), min_size=2, max_size=5), st.data())
def test_any_list_of_names_comes_back_from_its_text(lists: list[list[str]], data: st.DataObject):
    source, (column,) = read_parquet(parquet({"a": lists}), "t.parquet")
    at = data.draw(st.integers(0, len(lists) - 1))
    after = rewritten_parquet([column.with_text(0, column[at])], source, np.arange(len(lists)))
    assert frame(after)["a"].to_list() == [lists[at], *lists[1:]]
