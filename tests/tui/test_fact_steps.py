"""Undo in the test row: it takes back facts, and never an edit of the table."""

from hypothesis import given
from hypothesis import strategies as st

import contextdb as cdb
from tui.model.sheet import Sheet

steps = st.lists(
    st.one_of(
        st.tuples(st.just("set"), st.sampled_from(["speed", "hit"]), st.sampled_from(["", "1", "True", "not a fact"])),
        st.tuples(st.just("load"), st.sampled_from([{}, {"speed": "4"}, {"hit": "False", "speed": "1"}])),
        st.tuples(st.just("undo")),
        st.tuples(st.just("redo")),
    ),
    max_size=12,
)


@given(steps)
def test_undo_and_redo_of_facts_are_those_of_a_list_of_states(moves):
    sheet = Sheet(
        cdb.Table.from_columns(
            {"Asset": ["a"], "speed": ["1"], "hit": ["True"]}, {"speed": {"type": "number"}, "hit": {"type": "bool"}}
        )
    )
    states: list[dict[str, str]] = [{}]
    at = 0
    for move in moves:
        if move[0] in ("undo", "redo"):
            sheet.undo_fact(move[0] == "redo")
            at = max(0, at - 1) if move[0] == "undo" else min(len(states) - 1, at + 1)
        else:
            new = move[1] if move[0] == "load" else {name: text for name, text in {**states[at], move[1]: move[2]}.items() if text}
            sheet.ask("facts", move[1]) if move[0] == "load" else sheet.set_fact(move[1], move[2])
            if new != states[at]:
                states, at = [*states[: at + 1], new], at + 1
        assert {name: text for name, text in sheet.query.texts.items() if text} == states[at]
        assert (sheet.query.facts["speed"] is None) == (states[at].get("speed", "") in ("", "True", "not a fact"))
