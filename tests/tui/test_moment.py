"""A moment of a gap that the test row can take: derived facts come out as the gap says, though they cannot be typed."""

import pytest

from contextdb.errors import ContextError
from contextdb.tables.table import Table
from tui.model.moment import moment_inside
from tui.model.query_row import QueryRow
from tui.model.wanted import Wanted

SCHEMA = {
    "speed": {"type": "number", "min": 0, "max": 10},
    "target": {"type": "number", "min": 0, "max": 10},
    "gait": {"type": "enum", "values": ["Walk", "Run"]},
    "closing": {"type": "number", "expr": "speed - target"},
    "rushes": {"type": "bool", "expr": "closing > 2 and gait == 'Run'"},
}
COLUMNS = {"Asset": ["a"], "speed": ["Any"], "closing": ["Any"], "rushes": ["Any"]}


@pytest.mark.parametrize(
    "cells",
    [
        {"closing": "5..6"},
        {"closing": "..-4", "speed": "3..4"},
        {"rushes": "True", "speed": "..3"},
        {"speed": "7.."},
        {"closing": "Any"},
    ],
)
def test_a_moment_inside_a_box_makes_every_cell_of_it_hold(cells):
    table = Table.from_columns({**COLUMNS, **{name: [text] for name, text in cells.items()}}, SCHEMA)
    texts = moment_inside(cells, Wanted.of(table))
    assert not {"closing", "rushes"} & texts.keys()
    query = QueryRow(table)
    query.load(texts)
    assert query.n_valid == 1
    assert all(query.facts[name] is not None for name in cells if cells[name] != "Any")


def test_a_box_that_nothing_computes_is_refused():
    table = Table.from_columns(COLUMNS, SCHEMA)
    with pytest.raises(ContextError, match="closing"):
        moment_inside({"closing": "50.."}, Wanted.of(table))
