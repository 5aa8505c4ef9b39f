"""A rule that is typed: its parts are what joins it, each with its truth for the test row, and what is offered can be read."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from tui.model.rule_builder import RuleBuilder, RuleChooser

CONDITIONS = {
    "speed": Condition("speed", Domain("number", 0, 10)),
    "gait": Condition("gait", Domain("enum", values=("Walk", "Run"))),
    "is up": Condition("is up", Domain("bool")),
}
ATOMS = {
    "speed > 3": lambda f: None if f["speed"] is None else f["speed"] > 3,
    "abs(speed - 4) <= 2": lambda f: None if f["speed"] is None else abs(f["speed"] - 4) <= 2,
    'gait == "Run"': lambda f: None if f["gait"] is None else f["gait"] == "Run",
    "`is up`": lambda f: f["is up"],
}
FACTS = st.fixed_dictionaries(
    {
        "speed": st.sampled_from([None, 1.0, 3.5, 9.0]),
        "gait": st.sampled_from([None, "Walk", "Run"]),
        "is up": st.sampled_from([None, True, False]),
    }
)


def joined(draw: st.DrawFn, depth: int) -> tuple[str, list[str]]:
    """A rule, and its parts in their order."""
    if depth == 0 or draw(st.booleans()):
        atom = draw(st.sampled_from(sorted(ATOMS)))
        return (f"not {atom}", [atom]) if draw(st.booleans()) else (atom, [atom])
    one, other = joined(draw, depth - 1), joined(draw, depth - 1)
    word = draw(st.sampled_from(["and", "or"]))
    return f"({one[0]}) {word} ({other[0]})", [*one[1], *other[1]]


@given(st.composite(lambda draw: joined(draw, 2))(), FACTS, st.data())
def test_each_part_has_its_truth_and_a_beginning_has_parts_of_the_whole(rule: tuple[str, list[str]], facts: dict, data):
    text, atoms = rule
    builder = RuleBuilder(CONDITIONS, facts)
    assert [part.text for part in builder.parts(text)] == atoms
    assert [part.truth for part in builder.parts(text)] == [ATOMS[atom](facts) for atom in atoms]
    assert builder.words(text).count("now") + builder.words(text).count("not known") >= len(atoms)
    caret = data.draw(st.integers(0, len(text)))
    builder.words(text[:caret])
    offer = RuleChooser(builder).offer(text, caret, data.draw(st.booleans()))
    for row in list(offer.rows)[:3]:
        whole, after = RuleChooser(builder).pick(text, row, offer.word)
        assert whole[:after].endswith(str(row))


def test_what_is_offered_is_facts_values_functions_and_words():
    chooser = RuleChooser(RuleBuilder(CONDITIONS, {}))
    offered = {
        text: list(chooser.offer(text, len(text), False).rows)
        for text in ("", "sp", "gait == ", 'gait in ["Walk", "R', "spe > 1 an", "up", "cl", "speed")
    }
    assert offered[""] == []
    assert offered["sp"] == ["speed"]
    assert offered["gait == "][:2] == ['"Walk"', '"Run"']
    assert offered['gait in ["Walk", "R'] == ['"Run"']
    assert offered["spe > 1 an"][0] == "and"
    assert offered["up"] == ["`is up`"]
    assert offered["cl"] == ["clamp("]
    assert offered["speed"] == []
