"""The next picks of the test row are those that a game's picker makes, and the dialog shows each with what else might have been."""

from __future__ import annotations

from dataclasses import replace

import pick_oracle as oracle
from hypothesis import given
from hypothesis import strategies as st

from contextdb.errors import PolicyError
from contextdb.tables.nesting.links import Neighbours
from tui.model.next_picks import Turn, Way, next_picks
from tui.model.query_row import QueryRow


@given(oracle.tables(), oracle.FACTS, st.integers(0, 9), st.integers(0, 3), st.sampled_from([0.5, 1.0, 2.0]))
def test_the_next_picks_are_those_of_a_games_picker(
    tables: oracle.Tables, facts: oracle.Facts, seed: int, memory: int, gap_s: float
):
    outer = tables.outer.table()
    query = QueryRow(replace(outer, around=Neighbours({"inner": tables.inner.table()})))
    query.load({name: str(fact) for name, fact in facts.items()})
    answer = query.answer
    assert answer is not None
    compiled = tables.compile()
    picker, asked = compiled.picker(seed, memory), compiled.query(facts)
    try:
        expected = [picker.pick(asked, time_s=gap_s * turn).asset for turn in range(20)]
    except PolicyError:
        expected = None
    try:
        picks = next_picks(answer.compiled, answer.matches, Way(seed, memory, gap_s), 20)
    except PolicyError:
        assert expected is None
        return
    assert [pick.asset for pick in picks.picks] == expected
    for turn, pick in enumerate(picks.picks):
        picked = [row.row for row in picks.rows if row.turns[turn] is Turn.PICKED]
        assert picked == ([] if pick.row is None else [pick.row])
    assert sum(row.n_picked for row in picks.rows) + picks.fallbacks.count(Turn.PICKED) == 20
