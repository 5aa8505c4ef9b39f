"""Columns of texts as numpy arrays and as polars Enums are read as lists of the same texts are."""

from unittest import mock

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

import contextdb as cdb
from contextdb.compiled.text_arrays import classes_of_texts, is_text_array

LETTERS = st.text(alphabet="ab\u00e9\u4e2d\U0001f600\0 ", max_size=10)
FORMS = {
    "U": np.array,
    "wide": lambda texts: np.array(texts, "U40"),
    "swapped": lambda texts: np.array(texts).astype(np.array(texts).dtype.newbyteorder()),
    "strided": lambda texts: np.repeat(np.array(texts), 2)[::2],
    "T": lambda texts: np.array(texts, np.dtypes.StringDType()),
    "T with missing": lambda texts: np.array(texts, np.dtypes.StringDType(na_object=None)),
    "object": lambda texts: np.array(texts, object),
    "String": pl.Series,
    "Categorical": lambda texts: pl.Series(texts, dtype=pl.Categorical),
    "Enum": lambda texts: pl.Series(texts, dtype=pl.Enum(sorted({*texts, "unused"}))),
}
VALUES = ("left", "right", "upper left", "droit\u00e9")


def table_of(kind: str) -> cdb.CompiledTable:
    declared = {"type": kind, "values": list(VALUES)} if kind == "enum" else {"type": kind}
    cells = ["left", "right", '"upper left"', "droit\u00e9", "not left", "Any"]
    columns = {"Asset": [f"asset_{i}" for i in range(len(cells))], "side": cells}
    return cdb.Table.from_columns(columns, schema={"side": declared}).compile()


@given(st.lists(LETTERS, min_size=1), st.lists(LETTERS, min_size=1, unique=True), st.sampled_from(["U", "T"]))
def test_a_text_has_the_number_of_the_value_that_is_equal_to_it(texts, values, form):
    array = FORMS[form]([*texts, *values])
    found = classes_of_texts(array, values)
    if found is not None:
        kept = array.tolist()  # without the NULs at the end, which a fixed width does not keep
        assert found.tolist() == [values.index(text) if text in values else -1 for text in kept]


@pytest.mark.parametrize("form", ["U", "wide", "strided", "T"])
def test_plain_texts_are_read_without_a_python_text_for_each(form):
    array = FORMS[form](["right", "left", "leftmost of all", "le", ""])
    assert is_text_array(array)
    found = classes_of_texts(array, ("left", "right"))
    assert found is not None
    assert found.tolist() == [1, 0, -1, -1, -1]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("kind", ["enum", "text"])
def test_every_form_of_a_column_is_read_as_a_list_of_its_texts(kind, form):
    compiled = table_of(kind)
    texts = [*VALUES, *VALUES[::-1]] + (["", "lef", "leftmost", "x" * 100] if kind == "text" else [])
    expected = compiled.query_many({"side": texts})
    found = compiled.query_many({"side": FORMS[form](texts)})
    assert found.codes.tolist() == expected.codes.tolist()
    assert found.hits.tolist() == expected.hits.tolist()


@pytest.mark.parametrize("form", FORMS)
def test_a_text_that_is_no_value_is_refused_in_every_form_as_in_a_list(form):
    compiled = table_of("enum")
    texts = ["left", "leftmost", "right"]
    with pytest.raises(cdb.ContextError) as listed:
        compiled.query_many({"side": texts})
    with pytest.raises(cdb.ContextError) as refused:
        compiled.query_many({"side": FORMS[form](texts)})
    assert str(refused.value) == str(listed.value)


@pytest.mark.parametrize("kind", ["enum", "text"])
@pytest.mark.parametrize("form", ["object", "String", "Categorical", "Enum"])
def test_missing_texts_are_missing_in_every_form(kind, form):
    compiled = table_of(kind)
    texts = ["left", None, "right"]
    column = FORMS[form](texts) if form != "Enum" else pl.Series(texts, dtype=pl.Enum(["right", "left"]))
    assert (
        compiled.query_many({"side": column}, unknown="never").codes.tolist()
        == compiled.query_many({"side": texts}, unknown="never").codes.tolist()
    )


def test_numbers_are_no_texts_of_an_enum():
    with pytest.raises(cdb.ContextError, match="not a fact of type enum"):
        table_of("enum").query_many({"side": np.array([0, 1])})


def test_two_values_in_one_slot_are_left_to_another_way():
    with mock.patch("contextdb.compiled.text_arrays.MIX", np.uint64(0)):
        assert classes_of_texts(np.array(["left", "right"]), ("left", "right")) is None
