"""Columns as masks: as few classes as the cells tell apart, and the same rows in either form of a number column."""

from unittest import mock

import numpy as np
import oracles
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from strategies import for_each

from contextdb import bitmask
from contextdb.cells.conditions import Condition
from contextdb.cells.domains import ANGLE, BOOL, INT, NUMBER, TAGS, TEXT, Domain
from contextdb.cells.facts import cell, read_fact
from contextdb.cells.grammar import parse_cell
from contextdb.cells.sets import Cell
from contextdb.compiled.classes import NumberMasks, TagMasks, ValueMasks, WideMasks, column_masks
from contextdb.core import turn_rows

DEPTH = Domain("enum", ("CB", "FS", "SS"))
Masks = ValueMasks | NumberMasks | WideMasks | TagMasks


def column(domain: Domain, *texts: str) -> Masks:
    return column_masks([parse_cell(t, domain) for t in texts], np.arange(len(texts), dtype=np.int32), domain)


def bits_of(masks: Masks, fact: object) -> int:
    if isinstance(masks, WideMasks):
        return masks.bits(masks.codes(fact)[0])
    bits = (1 << masks.n_rows) - 1
    for code in masks.codes(fact):
        bits &= masks.ints[code]
    return bits


def rows(masks: Masks, fact: object) -> list[int]:
    bits = bits_of(masks, fact)
    return [r for r in range(masks.n_rows) if bits >> r & 1]


# ---- how many classes


@pytest.mark.parametrize(
    ("texts", "bounds"),
    [
        (["Any"], []),
        (["0..5"], [0.0, 5.000000000000001]),
        (["0..5", "0..5", "not 0..5"], [0.0, 5.000000000000001]),
        (["[0..5)", "5..9"], [0.0, 5.0, 9.000000000000002]),
        (["..5"], [5.000000000000001]),
        (["5.."], [5.0]),
        (["-inf..inf"], []),
        (["5..3"], []),
        (["inf"], [np.inf]),
    ],
)
def test_a_number_column_has_a_bound_wherever_a_cell_changes_its_mind_and_nowhere_else(texts, bounds):
    masks = column(NUMBER, *texts)
    assert masks.bounds.tolist() == bounds
    assert masks.masks.shape == (len(bounds) + 2, 1)


def test_whole_numbers_that_follow_each_other_share_a_bound():
    assert column(INT, "1..2", "3..4").bounds.tolist() == [1.0, 3.0, 5.0]


def test_an_angle_column_has_no_bound_where_the_circle_is_cut():
    assert column(ANGLE, "170..-170", "0..360").bounds.tolist() == [-169.99999999999997, 170.0]


def test_a_bool_column_has_two_classes_and_an_enum_column_one_for_each_value():
    assert column(BOOL, "Any", "True").values == (False, True)
    assert column(DEPTH, "CB").values == ("CB", "FS", "SS")


def test_a_text_column_has_one_class_for_all_texts_that_no_cell_names():
    masks = column(TEXT, "left", "not left", "right", "Any")
    assert (masks.values, masks.has_others) == (("left", "right"), True)
    assert rows(masks, "left") == [0, 3]
    assert rows(masks, "up") == rows(masks, "down") == [1, 3]
    assert masks.codes("up") == masks.codes("down")


def test_a_tag_column_asks_once_for_each_tag_and_once_for_each_cell_with_not():
    masks = column(TAGS, "+InAir -Stunned", "+InAir", "not +Move -InAir")
    assert masks.tags == ("InAir", "Stunned")
    assert len(masks.negated) == 1
    assert rows(masks, frozenset(("InAir",))) == [0, 1, 2]
    assert rows(masks, frozenset(("Move.Run",))) == []


@pytest.mark.parametrize("domain", [BOOL, INT, NUMBER, ANGLE, DEPTH, TEXT, TAGS], ids=lambda domain: domain.kind)
def test_only_a_cell_that_is_any_or_soft_accepts_a_missing_fact(domain):
    some = {"bool": "True", "enum": "CB", "text": "left", "tags": "+InAir"}.get(domain.kind, "5")
    assert rows(column(domain, some, "Any", f"{some} ~2", f"not {some}", "not Any"), None) == [1, 2]


@pytest.mark.parametrize("domain", [BOOL, INT, NUMBER, ANGLE, DEPTH, TEXT, TAGS], ids=lambda domain: domain.kind)
def test_a_cell_that_holds_everything_in_other_words_is_not_any_for_a_missing_fact(domain):
    assert rows(column(domain, "not not Any"), None) == []
    assert rows(column(domain, "not not Any", "Any"), None) == [1]


# ---- the two forms of a number column


@given(strategies.domains(("int", "number", "angle")), st.data())
@strategies.examples(2)
def test_a_wide_column_answers_what_a_flat_one_does(domain, data):
    texts = data.draw(st.lists(strategies.cells(domain), min_size=1, max_size=12))
    flat = column(domain, *texts)
    with mock.patch("contextdb.compiled.classes.FLAT_BYTES", 0):
        wide = column(domain, *texts)
    assert isinstance(flat, NumberMasks)
    assert isinstance(wide, WideMasks)
    assert flat.bounds.tolist() == wide.bounds.tolist()
    assert rows(flat, None) == rows(wide, None)
    for fact in oracles.representatives(texts, domain):
        assert rows(flat, fact) == rows(wide, fact)
    accepts = parse_cell(data.draw(strategies.sets(domain)), domain).accepts
    if not accepts.is_empty:
        assert flat.set_bits(accepts) == wide.set_bits(accepts)


def test_a_column_is_wide_only_when_its_masks_would_be_large():
    texts = [f"{i}..{i + 1}" for i in range(3000)]
    assert isinstance(column(NUMBER, *texts[:100]), NumberMasks)
    assert isinstance(column(NUMBER, *texts), WideMasks)


def test_a_wide_column_takes_memory_that_grows_more_slowly_than_its_square():
    sizes = []
    for n in (3000, 12_000):
        masks = column(NUMBER, *(f"{i * 2}..{i * 2 + 1}" for i in range(n)))
        sizes.append(masks.low.nbytes + masks.high.nbytes)
    assert sizes[1] <= 9 * sizes[0]  # 4 times the rows, twice the digits; a flat column takes 16 times as much


# ---- sets of values


@given(strategies.domains(), st.data())
@strategies.examples(2)
def test_a_set_finds_the_rows_that_accept_some_and_that_accept_all_of_it(domain, data):
    texts = data.draw(st.lists(strategies.cells(domain), min_size=1, max_size=8))
    fact = data.draw(strategies.set_facts(domain, tuple(texts)))
    accepts = read_fact(cell(fact.given) if isinstance(fact.given, str) else fact.given, Condition("x", domain)).accepts
    if accepts is not None:
        some, every = column(domain, *texts).set_bits(accepts)
        passes = [[oracles.passes(text, domain, value) for value in fact.plain] for text in texts]
        assert [bool(some >> r & 1) for r in range(len(texts))] == [any(p) for p in passes]
        assert [bool(every >> r & 1) for r in range(len(texts))] == [all(p) for p in passes]


def test_a_set_of_tag_sets_reckons_with_tags_that_stand_under_others():
    masks = column(TAGS, "+Move", "+Move.Run", "-Move", "-Move.Run", "not +Move")
    some, every = masks.set_bits(parse_cell("+Move.Run", TAGS).accepts)
    assert [some >> r & 1 for r in range(5)] == [every >> r & 1 for r in range(5)] == [1, 1, 0, 0, 0]
    some, every = masks.set_bits(parse_cell("-Move", TAGS).accepts)
    assert [some >> r & 1 for r in range(5)] == [every >> r & 1 for r in range(5)] == [0, 0, 1, 1, 1]
    some, every = masks.set_bits(parse_cell("+Move -Move.Run", TAGS).accepts)
    assert [some >> r & 1 for r in range(5)] == [every >> r & 1 for r in range(5)] == [1, 0, 0, 1, 0]


# ---- rows


@for_each([BOOL, NUMBER, ANGLE, DEPTH, TEXT, TAGS], [0, 1, 63, 64, 65, 130])
def test_rows_that_share_a_cell_share_its_bits_at_every_size(domain, n_rows):
    some = {"bool": ("True", True), "enum": ("CB", "CB"), "text": ("left", "left"), "tags": ("+InAir", frozenset(("InAir",)))}
    text, fact = some.get(domain.kind, ("5", 5.0))
    codes = (np.arange(n_rows, dtype=np.int32) * 7) % 3
    masks = column_masks([parse_cell(text, domain), parse_cell(f"not {text}", domain), Cell()], codes, domain)
    assert rows(masks, fact) == [r for r in range(n_rows) if codes[r] != 1]
    assert bits_of(masks, None) == bitmask.to_int(bitmask.pack(codes == 2))


@given(st.data())
def test_each_row_is_turned_over_in_the_masks_of_its_cell(data):
    n_cells, n_masks = data.draw(st.integers(1, 6)), data.draw(st.integers(1, 5))
    codes = data.draw(st.lists(st.integers(0, n_cells), max_size=140))
    pairs = data.draw(st.lists(st.tuples(st.integers(0, n_cells - 1), st.integers(0, n_masks - 1)), max_size=12))
    masks = np.zeros((n_masks, bitmask.n_words(len(codes))), np.uint64)
    cells, numbers = np.array(pairs, np.int64).reshape(-1, 2).T.copy()
    turn_rows(np.array(codes, np.int32), cells, numbers, masks)
    for mask in range(n_masks):
        expected = [row for row, code in enumerate(codes) if pairs.count((code, mask)) % 2]
        assert bitmask.rows(masks[mask]).tolist() == expected


@pytest.mark.parametrize(("cell", "number"), [(-1, 0), (2**40, 0), (0, -1), (0, 2)])
def test_a_mask_or_a_cell_that_is_none_is_refused(cell, number):
    masks = np.zeros((2, 1), np.uint64)
    with pytest.raises(ValueError, match="out of range"):
        turn_rows(np.zeros(3, np.int32), np.array([cell]), np.array([number]), masks)
    assert not masks.any()
