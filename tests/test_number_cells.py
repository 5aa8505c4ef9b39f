"""Number cells read all at once: the same doubles, cells, types and masks as one by one."""

import csv
from pathlib import Path
from unittest import mock

import numpy as np
import polars as pl
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import ANGLE, INT, NUMBER, TEXT, Domain
from contextdb.cells.grammar import parse_cell, reads
from contextdb.cells.numbers import FEW, NumberCells, are_plain, doubtful, has_soft, holding
from contextdb.cells.sets import ANY, Cell, NumberSet
from contextdb.columns import TextColumn
from contextdb.compiled.classes import column_masks
from contextdb.tables import condition_column
from contextdb.tables.condition_column import ConditionColumn, infer_condition

PADDING = tuple(f"{i}..{i + 1}" for i in range(1000, 1001 + FEW))
"""Texts enough to be read all at once."""
KINDS = {"int": INT, "number": NUMBER, "angle": ANGLE}

DIGITS = st.integers(0, 10**15 - 1).map(str)
DECIMALS = st.builds("{}{}.{}".format, st.sampled_from(["", "+", "-"]), DIGITS, DIGITS)
WRITTEN_NUMBERS = DECIMALS | st.sampled_from(
    ["0", "-0", "-0.0", "+5", "007", "180", "-180", "179.999999999999", "360", "359.999999999999", "-540", "720.5", "0.1", "1.5"]
)
FORMS = ["{}", "={}", "= {}", "<{}", "<= {}", ">{}", ">={}", "{}..", "..{}", "<{}..", " {} ", "..{}..", "{}~2", "not {}"]
PAIR_FORMS = [
    "{}..{}",
    "{} .. {}",
    "[{}..{})",
    "({}..{}]",
    "({}..{})",
    "[{}..{}]",
    "{}, {}",
    "{} ± {}",
    "{} +- {}",
    "({}, {}]",
    "{}+-{}",
]
LIKELY_TEXTS = st.one_of(
    st.builds(str.format, st.sampled_from(FORMS), WRITTEN_NUMBERS),
    st.builds(str.format, st.sampled_from(PAIR_FORMS), WRITTEN_NUMBERS, WRITTEN_NUMBERS),
    st.text("0123456789.,+-<=>[]() ±|~ infeot\u0663\u00a0\x1c", max_size=12),
)


def column_of(texts: list[str], domain: Domain) -> ConditionColumn:
    return ConditionColumn.read(TextColumn.of("x", [*texts, *PADDING]), Condition("x", domain))


@pytest.mark.parametrize("kind", KINDS)
@given(st.data())
def test_many_texts_are_read_as_each_of_them_is(kind, data):
    texts = data.draw(st.lists(LIKELY_TEXTS | strategies.cells(KINDS[kind]), min_size=1, max_size=20))
    column = column_of(texts, KINDS[kind])
    assert isinstance(column.cells, NumberCells)
    for i, text in enumerate(dict.fromkeys(texts)):
        assert (i not in column.faults) == reads(text, KINDS[kind]), text
        expected = ANY if i in column.faults else parse_cell(text, KINDS[kind])
        assert column.cells[i] == expected, text
        assert repr(column.cells[i]) == repr(expected), text  # -0.0 is no 0.0 here
    assert list(column.cells) == [column.cells[i] for i in range(len(column.cells))]


@pytest.mark.parametrize("kind", KINDS)
@given(st.data())
def test_a_number_is_asked_of_all_cells_at_once_as_of_each(kind, data):
    texts = data.draw(st.lists(LIKELY_TEXTS | strategies.cells(KINDS[kind]), min_size=1, max_size=20))
    cells, number = column_of(texts, KINDS[kind]).cells, float(data.draw(st.sampled_from([0, 1, -180, 179.5, 540]) | st.integers()))
    assert isinstance(cells, NumberCells)
    assert holding(cells, number).tolist() == [cell.is_soft or cell.holds(number) for cell in cells]


def test_every_number_cell_of_the_grammar_is_read_as_by_itself():
    with Path(__file__).with_name("cells.csv").open(encoding="utf-8", newline="") as file:
        lines = [line for line in csv.DictReader(file) if line["type"] in KINDS]
    assert len(lines) > 50
    for kind, domain in KINDS.items():
        column = column_of([line["cell"] for line in lines if line["type"] == kind], domain)
        for i, text in enumerate(column.texts.texts):
            assert (i in column.faults) is not reads(text, domain)
            assert i in column.faults or column.cells[i] == parse_cell(text, domain)


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1), st.integers(0, 20))
def test_polars_reads_a_number_as_python_does_to_the_last_bit(values, digits):
    texts = [f"{value:.{digits}f}" for value in values]
    assert pl.Series(texts).cast(pl.Float64).to_list() == [float(t) for t in texts]


@given(st.lists(DECIMALS, min_size=1))
@strategies.examples(10)
def test_a_plain_number_is_the_double_nearest_to_its_decimals(texts):
    assert pl.Series(texts).cast(pl.Float64).to_list() == [float(t) for t in texts]


@pytest.mark.parametrize("kind", KINDS)
@given(st.data())
def test_masks_from_the_ends_are_masks_from_the_cells(kind, data):
    texts = data.draw(st.lists(LIKELY_TEXTS | strategies.cells(KINDS[kind]), max_size=20))
    column = column_of(texts, KINDS[kind])
    for flat_bytes in (2 << 20, 0):
        with mock.patch("contextdb.compiled.classes.FLAT_BYTES", flat_bytes):
            fast = column_masks(column.cells, column.texts.codes, KINDS[kind])
            slow = column_masks(list(column.cells), column.texts.codes, KINDS[kind])
        assert type(fast) is type(slow)
        arrays = [name for name in ("bounds", "masks", "low", "high", "any_mask") if hasattr(fast, name)]
        assert arrays
        for name in arrays:
            np.testing.assert_array_equal(getattr(fast, name), getattr(slow, name))


@given(
    st.lists(LIKELY_TEXTS | st.sampled_from(["True", "no", "0", " 1", "Any", "", "+A -B", "CB"]), min_size=1), st.integers(0, FEW)
)
def test_the_type_of_a_column_is_the_same_with_many_texts_and_with_few(texts, n_numbers):
    column = TextColumn.of("x", [*texts, *map(str, range(n_numbers)), *texts, *PADDING[:n_numbers]])
    with mock.patch.object(condition_column, "are_plain", return_value=None):
        expected = infer_condition(column)
    with mock.patch("contextdb.cells.numbers.FEW", 0):
        assert infer_condition(column) == expected


def test_plain_numbers_are_told_from_truths_and_from_all_else():
    texts = ["5", "<=5", "1..2", "20, 9.99", "0", " 1", "Any", "True", "not 5", "1..2 | 3..4", *PADDING]
    assert are_plain(texts).tolist()[:10] == [True] * 4 + [False] * 6


def test_a_new_text_stands_behind_those_that_were_read_before():
    before = column_of([], NUMBER)
    now = before.with_texts(before.texts.with_text(0, "5 ~2"))
    assert now.cell(0) == parse_cell("5 ~2", NUMBER)
    assert now.cell(1) == before.cell(1)
    assert isinstance(now.cells, NumberCells)
    assert (has_soft(before.cells), has_soft(now.cells)) == (False, True)
    assert now.soft is not None
    assert now.soft[1].tolist() == [2.0] + [0.0] * (len(PADDING) - 1)


@pytest.mark.parametrize("n_before", [1, FEW + 1])
@pytest.mark.parametrize("n_more", [1, FEW + 1])
def test_new_texts_in_any_number_stand_behind_old_ones_in_any_number(n_before: int, n_more: int):
    old, new = [f"{i}" for i in range(n_before)], [f"<{i}" for i in range(n_more - 1)] + ["nothing"]
    before = ConditionColumn.read(TextColumn.of("x", old), Condition("x", NUMBER))
    _ = before.cells[0]  # what was read of the old ones is taken as it is
    after = before.with_texts(before.texts.with_inserted(0, new))
    assert list(after.cells) == [*(parse_cell(t, NUMBER) for t in (*old, *new[:-1])), ANY]
    assert list(after.faults) == [n_before + n_more - 1]
    anew = ConditionColumn.read(after.texts, after.condition)
    assert (after.masks.bounds == anew.masks.bounds).all()
    assert [after.masks.codes(x) for x in range(9)] == [anew.masks.codes(x) for x in range(9)]


def test_what_can_be_read_is_not_read_before_it_is_asked_for():
    with mock.patch("contextdb.cells.numbers._plain_ends", side_effect=AssertionError):
        column = column_of(["5..3", "Any", "1 | 2", "oops"], NUMBER)
        assert (len(column.cells), list(column.faults)) == (len(PADDING) + 4, [3])
    assert column.cells[0].is_empty


def test_cells_are_asked_for_from_either_end_and_in_parts():
    cells = column_of(["Any"], ANGLE).cells
    assert cells[-1] == cells[len(PADDING)] == list(cells)[-1]
    assert cells[:2] == (ANY, cells[1])
    assert cells[1] == Cell(NumberSet(parse_cell(PADDING[0], ANGLE).accepts.spans, True))
    with pytest.raises(IndexError):
        cells[len(cells)]


def test_texts_that_no_file_can_hold_are_read_one_by_one():
    texts = ["\ud800", *PADDING]
    assert doubtful(texts, NUMBER) is None
    assert are_plain(texts) is None
    assert 0 in column_of(["\ud800"], NUMBER).faults


def test_texts_of_other_kinds_are_not_read_as_numbers():
    assert doubtful(PADDING, TEXT) is None
    assert doubtful(PADDING[:2], NUMBER) is None
