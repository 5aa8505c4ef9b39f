"""The Contracts tab: sentences, proved as one types; Enter takes the counterexample to the test row."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from terminal import drive, screen_text, with_editor
from textual.pilot import Pilot
from textual.widgets import Input

from contextdb import load
from contextdb.schema.contracts import Contract
from contextdb.schema.sections import contract_to_dict
from tui.app import EditorApp
from tui.model.contract_sentences import EXAMPLE, name_for, read_sentence, sentence_of
from tui.model.workspace import Workspace
from tui.panes.contracts import ContractsPane

TOML = """\
[conditions.speed]
type = "number"
min = 0
max = 10

[conditions.Air]
type = "bool"

[contracts.fast]
table = "moves"
when = "speed > 6"
some = "asset like 'run*'"
"""
kinds = st.sampled_from(
    ["asset like 'carry*'", "asset == 'a, b'", "weight > 0 and asset like 'x*'", "'Carry' in Tags", "asset like '*'"]
)
contracts = st.builds(
    lambda when, verb, kind, n, why: Contract(
        "c", "moves", when=when, why=why, **{verb: (n, kind) if verb == "at_most" and n else n if verb == "at_most" else kind}
    ),
    st.sampled_from([None, "HasBall and not Down", "max(speed, 2) > 3", "gait == 'Idle'"]),
    st.sampled_from(["some", "every", "none", "at_most", "winner"]),
    kinds,
    st.integers(0, 40),
    st.sampled_from(["", "nobody stands still"]),
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text(TOML)
    (tmp_path / "moves.csv").write_text("Asset,speed,Air\nwalk,0..3,False\nrun,3..8,False\nfall,Any,True\n")
    return tmp_path


@given(contracts)
def test_a_sentence_says_what_its_contract_says(contract: Contract):
    sentence = read_sentence(sentence_of(contract), "moves")
    assert sentence.fault is None, sentence_of(contract)
    assert Contract("c", **sentence.part) == contract
    assert contract_to_dict(contract) == contract_to_dict(Contract("c", **sentence.part))


@pytest.mark.parametrize(
    ("text", "part"),
    [
        (EXAMPLE, {"table": "t", "when": "HasBall and not Down", "some": "asset like 'carry*'"}),
        ("Always some row can play.", {"table": "t", "some": "asset like '*'"}),
        ("some row can play", {"table": "t", "some": "asset like '*'"}),
        (
            "whenever max(a, b) > 1,no row like walk* can play",
            {"table": "t", "when": "max(a, b) > 1", "none": "asset like 'walk*'"},
        ),
        ("At most 3 rows can play", {"table": "t", "at_most": 3}),
        ("Always at most one row can play", {"table": "t", "at_most": 1}),
        ("whenever speed > 1 no rows walk* can play", {"table": "t", "when": "speed > 1", "none": "asset like 'walk*'"}),
        ("every row is run*", {"table": "t", "every": "asset like 'run*'"}),
        ("At most 1 row run* can play", {"table": "t", "at_most": {"n": 1, "of": "asset like 'run*'"}}),
        ("The row that is picked is weight > 2", {"table": "t", "winner": "weight > 2"}),
    ],
)
def test_sentences_as_people_write_them(text: str, part: dict[str, object]):
    assert read_sentence(text, "t").part == part


@pytest.mark.parametrize("text", ["", "Whenever", "Whenever x some row", "some rows may", "at most many rows can play"])
def test_what_is_no_contract_is_answered_with_an_example(text: str):
    fault = read_sentence(text, "t").fault
    assert fault is not None
    assert EXAMPLE in fault.message


def test_names_are_of_the_words_and_free():
    part = read_sentence(EXAMPLE, "t").part
    name = name_for(part, ())
    assert name_for(part, [name]) == f"{name}_2"


async def until(pilot: Pilot[Any], holds: Callable[[], bool]) -> None:
    for _ in range(300):
        await pilot.pause(0.02)
        if holds():
            return
    raise AssertionError("it never came")


def test_a_contract_is_proved_written_taken_to_the_test_row_undone_and_saved(folder: Path):
    async def play(pilot: Pilot[Any]) -> None:
        screen = pilot.app.screen
        await screen.run_command("contracts")
        await pilot.pause()
        pane = screen.query_one(ContractsPane)
        await until(pilot, lambda: pane.proofs.get("fast") is not None)
        assert pane.proofs["fast"].holds is False
        await pilot.press("n")
        line = pane.query_one(Input)
        line.value = "Whenever Air, some row fall can play"
        await until(pilot, lambda: pane.typed is not None)
        assert pane.typed.holds is True
        line.value = "Whenever speed < 3, no row fall can play"
        await until(pilot, lambda: pane.typed is not None and pane.typed.holds is False)
        await pilot.press("enter")
        await until(pilot, lambda: len(pane.proofs) == 2)
        assert [c.none for c in pane.contracts] == [None, "asset like 'fall'"]
        await until(pilot, lambda: "does not hold at speed: [0..3)" in screen_text(pilot.app))
        assert "A sentence" not in screen_text(pilot.app)
        session = screen.session
        session.save()
        assert "none = \"asset like 'fall'\"" in (folder / "contextdb.toml").read_text()
        assert len(load(folder / "moves.csv").schema.contracts) == 2
        await pilot.press("home", "enter")
        await pilot.pause()
        assert screen.tab == "assets"
        query = session.sheet.query
        assert float(query.texts["speed"]) > 6
        assert "run" not in [session.sheet.table.assets[row] for row in range(3) if query.bits >> row & 1]
        session.sheet.undo()
        assert list(session.sheet.table.schema.contracts) == ["fast"]

    drive(EditorApp(Workspace(folder)), play, (100, 30))


def test_what_is_no_contract_is_said_while_it_is_typed(folder: Path):
    async def play(pilot: Pilot[Any]) -> None:
        await pilot.app.screen.run_command("contracts")
        await pilot.pause()
        pane = pilot.app.screen.query_one(ContractsPane)
        await pilot.press("n")
        await until(pilot, lambda: "A sentence, such as" in screen_text(pilot.app))
        await pilot.press(*"rows")
        await until(pilot, lambda: "no contract" in screen_text(pilot.app))
        assert "Whenever rows" in screen_text(pilot.app)
        await pilot.press("enter")
        assert len(pane.contracts) == 1
        pane.query_one(Input).value = "Whenever nobody > 3, some row can play"
        await until(pilot, lambda: pane.typed is not None)
        await pilot.press("enter")
        assert len(pane.contracts) == 1
        await pilot.press("escape", "delete")
        await until(pilot, lambda: not pane.contracts)

    drive(EditorApp(Workspace(folder)), play, (100, 30))


@pytest.mark.parametrize(
    ("is_declared", "keys", "last"), [(False, (), "^P Commands"), (False, ("ctrl+pageup",), "Contracts"), (True, (), "Contracts")]
)
def test_on_a_narrow_screen_the_tab_gives_way_to_the_commands_unless_it_is_used(
    folder: Path, is_declared: bool, keys: tuple[str, ...], last: str
):
    toml = folder / "contextdb.toml"
    toml.write_text(TOML if is_declared else TOML.partition("[contracts")[0])
    (folder / "moves.csv").rename(folder / "locomotion.csv")

    async def play(app: EditorApp, pilot: Pilot[Any]) -> str:
        await pilot.press(*keys)
        await pilot.pause()
        return screen_text(app).splitlines()[0]

    assert with_editor(folder / "locomotion.csv", play).endswith(last)
    assert with_editor(folder / "locomotion.csv", play, (100, 24)).endswith("Contracts  ^P Commands")
