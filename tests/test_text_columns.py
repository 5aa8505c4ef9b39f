"""Columns of texts as numpy arrays and as polars Enums are read as lists of the same texts are."""

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import for_each

import contextdb as cdb
from contextdb.compiled.batch import _plain
from contextdb.compiled.table import data_of
from contextdb.core import read_column

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


NEAR = st.sampled_from(VALUES).flatmap(lambda value: st.sampled_from([value, value[:-1], value + "\0", value + "s", value.title()]))


@given(st.lists(LETTERS | NEAR, min_size=1), st.sampled_from(["U", "T", "wide", "object", "String", "Categorical"]))
def test_a_text_has_the_rows_of_the_value_that_is_equal_to_it(texts, form):
    compiled, column = table_of("text"), FORMS[form](texts)
    facts = column.to_list() if isinstance(column, pl.Series) else column.tolist()  # a fixed width keeps no NUL at the end
    expected = [compiled.query({"side": text}).indices.tolist() for text in facts]
    assert [rows.tolist() for rows in compiled.query_many({"side": column}).lists()] == expected


@pytest.mark.parametrize("form", ["U", "wide", "strided", "String", "Categorical", "Enum"])
def test_plain_texts_are_read_without_a_python_text_for_each(form):
    data = data_of(table_of("text"))
    codes = np.empty((1, 5), np.int32)
    column = FORMS[form](["right", "left", "leftmost of all", "le", ""])
    assert read_column(data.core, 0, _plain(column), 1, False, None, codes) == 0
    assert not isinstance(_plain(column), list)
    assert codes[0].tolist() == [2, 1, 5, 5, 5]


@for_each(["enum", "text"], FORMS)
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
