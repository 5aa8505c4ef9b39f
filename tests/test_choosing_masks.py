"""One of the rows of many masks: held to a list of their rows."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import contextdb as cdb
from contextdb import bitmask
from contextdb.compiled.choosing_masks import MOST_ROWS, EvenChoosing


@given(st.data())
def test_chance_counts_along_the_rows_of_a_mask(data):
    n_rows = data.draw(st.sampled_from([1, 63, 64, 65, 130, 400]))
    rows = data.draw(st.lists(st.sets(st.integers(0, n_rows - 1), max_size=90).map(sorted), min_size=1, max_size=8))
    chance = [data.draw(st.floats(0.0, 1.0, exclude_max=True)) for _ in rows]
    masks = np.array([bitmask.from_rows(np.array(own, np.int64), n_rows) for own in rows])
    expected = [own[min(int(u * len(own)), len(own) - 1)] if own else -1 for own, u in zip(rows, chance, strict=True)]
    assert EvenChoosing.drawn(masks, np.array(chance)).tolist() == expected


def require_same_picks(assets: list[str], n: int, memory: int) -> None:
    table = cdb.Table.from_columns({"Asset": assets, "x": ["Any"] * len(assets)}, {"x": {"type": "bool"}}).compile()
    many, alone, together = table.query_many({"x": [True] * n}), table.picker(3, memory=memory), table.picker(3, memory=memory)
    for _ in range(3):
        rows = together.pick_many(many).tolist()
        assert rows == [alone.pick(matches, who=i).row for i, matches in enumerate(many)]


def test_large_tables_and_long_memories_go_the_other_way_with_the_same_picks():
    require_same_picks([f"a{i % 5}" for i in range(MOST_ROWS + 10)], 3, 2)
    require_same_picks(["a", "b", "c"], 20, 12)
    require_same_picks([f"a{i % 50}" for i in range(200)], 20, 3)
