"""Values written as TOML, and keys of inline tables set and dropped: held to what tomllib reads and to a plain dict."""

import datetime
import tomllib
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb.files.toml_shapes import as_toml, dotted
from contextdb.schema.toml_edit import merged

NAMES = st.sampled_from(["a", "b", "Defender.Tags", "", 'a "b"', "é", "x y"])
PLAIN = st.one_of(
    st.text(), st.booleans(), st.integers(-(2**63), 2**63 - 1), st.floats(allow_nan=False), st.dates(), st.datetimes(), st.times()
)
VALUES = st.recursive(PLAIN, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(NAMES, inner, max_size=3))
TABLES = st.dictionaries(NAMES, st.recursive(PLAIN, lambda inner: st.dictionaries(NAMES, inner, max_size=3)), max_size=4)


def read(text: str) -> Any:
    return tomllib.loads(f"x = {text}")["x"]


@given(VALUES)
def test_tomllib_reads_each_value_as_it_was(value):
    assert read(as_toml(value)) == value


def set_in(table: dict[str, Any], keys: tuple[str, ...], value: object) -> dict[str, Any]:
    """The oracle: a copy of a table with one key set or, with None, dropped."""
    first, *rest = keys
    inner = set_in(table.get(first, {}), tuple(rest), value) if rest else value
    return {k: v for k, v in {**table, first: inner}.items() if v is not None}


@given(TABLES, st.lists(NAMES, min_size=1, max_size=1).map(tuple), st.none() | VALUES)
def test_a_key_of_an_inline_table_is_set_and_dropped_as_in_a_dict(table, keys, value):
    if value != {}:
        assert read(merged(as_toml(table), keys, value)) == set_in(table, keys, value)


@given(TABLES, NAMES, NAMES, PLAIN)
def test_a_key_of_an_inner_table_is_set_as_in_a_dict(table, outer, inner, value):
    table = {**table, outer: {"kept": 1}}
    assert read(merged(as_toml(table), (outer, inner), value)) == set_in(table, (outer, inner), value)


@pytest.mark.parametrize(
    ("old", "keys", "value", "new"),
    [
        ("{ a = 1,  b = 'x' }", ("a",), 2, "{ a = 2,  b = 'x' }"),
        ("{a=1,b=[1, 2]}", ("b",), [1, 2, 3], "{a=1,b=[1, 2, 3]}"),
        ("{ a.b = 1, a.c = 2 }", ("a", "c"), 3, "{ a.b = 1, a.c = 3 }"),
        ("{ a.b = 1, a.c = 2, d = 3 }", ("a",), None, "{ d = 3 }"),
        ("{ a.b = 1, a.c = 2, d = 3 }", ("a",), 4, "{ d = 3, a = 4 }"),
        ("{ a = { b = 1 } }", ("a", "b"), None, "{ a = {} }"),
        ("{ a = 1 }", ("a",), None, "{}"),
        ("{}", ("a", "b"), 1, "{ a.b = 1 }"),
        ('{ "a,b" = "}" }', ("c",), True, '{ "a,b" = "}", c = true }'),
        ("{ a = 1 }", ("Defender.Tags",), datetime.date(2026, 1, 2), '{ a = 1, "Defender.Tags" = 2026-01-02 }'),
    ],
)
def test_what_is_not_set_keeps_its_text(old, keys, value, new):
    assert merged(old, keys, value) == new


def test_a_path_is_written_with_quotes_where_they_are_needed():
    assert dotted(("conditions", "Defender.Tags", "a-b")) == 'conditions."Defender.Tags".a-b'
