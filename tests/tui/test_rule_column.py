"""The column of rows' own rules in the editor: text that is checked, marked where it cannot be read or does not hold."""

from pathlib import Path

import pytest
from terminal import press, screen_text, with_editor

TOML = """
[conditions.speed]
type = "number"
[tables.moves]
when = "Rule"
"""
ROWS = "Asset,speed,Rule\nrun,0..9,speed > 3\nwalk,0..9,\nodd,Any,spead > 3\n"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text(TOML)
    file = tmp_path / "moves.csv"
    file.write_text(ROWS)
    return file


def test_a_rule_that_cannot_be_read_is_marked_and_told(path):
    async def script(app, pilot):
        await press(pilot, "down", "down", "right", "right")
        return screen_text(app)

    screen = with_editor(path, script, (120, 24))
    assert "!spead > 3" in screen
    assert 'there is no condition "spead"' in screen
    assert "rule" in screen.splitlines()[3]


def test_a_row_that_its_rule_excludes_is_not_lit_and_the_rule_is_marked(path):
    async def script(app, pilot):
        await press(pilot, "f6", "2", "enter")
        low = app.main.session.sheet.query.valid.tolist(), screen_text(app)
        await press(pilot, "4", "enter")
        return low, app.main.session.sheet.query.valid.tolist()

    (low, screen), high = with_editor(path, script)
    assert (low, high) == ([False, True, False], [True, True, False])
    assert "×speed > 3" in screen


def test_a_rule_is_edited_as_text_and_one_that_cannot_be_read_stays_in_its_editor(path):
    async def script(app, pilot):
        sheet = app.main.session.sheet
        await press(pilot, "right", "right", *"sped<1", "enter")
        refused = sheet.text(0, 2), screen_text(app)
        await press(pilot, "ctrl+a", *"speed<1", "enter")
        return refused, sheet.text(0, 2)

    (before, screen), after = with_editor(path, script)
    assert before == "speed > 3"
    assert '"sped"' in screen
    assert after == "speed<1"


def test_why_tells_the_rule_that_does_not_hold(path):
    async def script(app, pilot):
        await press(pilot, "f6", "2", "enter", "f6", "ctrl+home", "f12")
        return screen_text(app)

    screen = with_editor(path, script, (100, 24))
    assert "1 cell keeps it from that" in screen
    assert 'The row\'s own rule says "speed > 3"' in screen


def test_a_rule_about_a_fact_that_no_column_asks_for_is_open_until_a_context_gives_it(path):
    path.with_name("contextdb.toml").write_text(TOML + '[conditions.gait]\ntype = "enum"\nvalues = ["Walk", "Run"]\n')
    path.write_text('Asset,speed,Rule\nrun,0..9,"gait == ""Run"""\nwalk,0..9,gait != \'Run\'\n')

    async def script(app, pilot):
        query = app.main.session.sheet.query
        answers = [query.valid.tolist()]
        for texts in ({"gait": "Run"}, {"gait": "Walk", "speed": "3"}, {"gait": "Swim"}, {}):
            query.load(texts)
            answers.append(query.valid.tolist())
        query.load({"gait": "Run", "speed": "3"})
        return answers, [row.asset for row in query.nearest()], screen_text(app)

    answers, nearest, screen = with_editor(path, script)
    assert answers == [[True, True], [True, False], [False, True], [True, True], [True, True]]
    assert nearest == ["walk"]
    assert "gait" in screen


def test_a_rule_about_a_role_with_actors_leaves_the_row_to_them(path):
    path.with_name("contextdb.toml").write_text(TOML + '[conditions."Defender.near"]\ntype = "bool"\n')
    path.write_text("Asset,speed,Rule\nrun,0..9,Defender.near\nwalk,0..9,\n")

    async def script(app, pilot):
        query = app.main.session.sheet.query
        query.offer({"Defender": [{"id": "Ivy", "near": False}]})
        far = query.valid.tolist()
        query.offer({"Defender": [{"id": "Ivy", "near": True}]})
        return far, query.valid.tolist()

    assert with_editor(path, script) == ([False, True], [True, True])
