"""The next picks of the test row are those that a game's picker makes, and the dialog shows each with what else might have been."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pick_oracle as oracle
from hypothesis import given
from hypothesis import strategies as st
from terminal import press, screen_text, settled, with_editor

from contextdb.errors import PolicyError
from contextdb.tables.nesting.links import Neighbours
from tui.model.next_picks import Turn, Way, next_picks
from tui.model.query_row import QueryRow

TOML = """[conditions.gait]
type = "enum"
values = ["Walk", "Run"]
[tables.t]
weight = "weight"
once = "once"
cooldown_turns = "rest"
"""
CELLS = "Asset,gait,weight,once,rest\na,Walk,2,,\nb,Walk,1,,\nwave,Walk,1,True,\nstumble,Any,1,,4\nnever,Walk,0,,\nrun,Run,1,,\n"


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


def test_the_dialog_shows_what_rests_what_is_once_and_why_at_each_pick(tmp_path: Path):
    (tmp_path / "contextdb.toml").write_text(TOML)
    (tmp_path / "t.csv").write_text(CELLS)

    async def script(app, pilot):
        await press(pilot, "shift+f9")
        empty = screen_text(app)
        app.main.assets.set_context({"gait": "Walk"}, "")
        await press(pilot, "shift+f9")
        await settled(pilot)
        first = screen_text(app)
        await press(pilot, "n", "m", "t", *["right"] * 2)
        await settled(pilot)
        other = screen_text(app)
        await press(pilot, "end", "up", "enter")
        await settled(pilot)
        return empty, first, other, app.main.session.sheet.cursor

    empty, first, other, cursor = with_editor(tmp_path / "t.csv", script, (80, 24))
    assert "The test row is empty" in empty
    wave = next(line for line in first.splitlines() if " wave " in line)
    assert wave.count("█") == 1
    assert "--------" in wave
    assert "seed 0 · no repeat of the last · every 1 s · 4 of 5 valid rows picked" in first
    assert "seed 1 · no repeat of the last 2 assets · every 2 s" in other
    assert "Pick 3 at 4 s: " in other
    assert cursor == (2, 0)
