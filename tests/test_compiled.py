"""A compiled table: what a query finds is what reading every cell finds, however the facts are given."""

from __future__ import annotations

import oracles
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st


@given(strategies.tables(), st.data())
def test_a_query_finds_what_reading_every_cell_finds(table, data):
    context, plain = data.draw(strategies.contexts(table))
    assert table.compile().query(context).indices.tolist() == oracles.rows(table, plain)
