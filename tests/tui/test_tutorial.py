"""Section 8 of docs/tutorial.md, pressed and pasted as it is written there, in an empty folder."""

import re
from collections.abc import Iterator
from pathlib import Path

from terminal import press, screen_text, settled, with_editor
from textual.events import Paste

import contextdb as cdb
from contextdb.checks.cases import check_cases, read_cases
from contextdb.checks.run import check

PAGE = Path(__file__).parents[2] / "docs" / "tutorial.md"
BLOCK = re.compile(r"^```(keys|tsv)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
WORD = re.compile(r'"([^"]*)"|(\S+)')
NAMES = {"esc": "escape"}
WAIT_S = 60.0


def keys_of(text: str) -> Iterator[list[str]]:
    """The keys of a block, a text or one key with how often it is pressed at a time."""
    for typed, key in WORD.findall(text):
        name, _, times = key.partition("*")
        name = name.lower()
        yield list(typed) if not key else [NAMES.get(name, name)] * int(times or 1)


def section(number: int) -> str:
    """The text of a section."""
    return PAGE.read_text("utf-8").split(f"\n## {number}. ")[1].split("\n## ")[0]


def test_a_day_in_the_editor_ends_with_a_table_that_is_saved_covered_and_tested(tmp_path):
    folder = tmp_path / "parry"
    folder.mkdir()

    async def script(app, pilot):
        for kind, text in BLOCK.findall(section(8)):
            if kind == "tsv":
                app.post_message(Paste(text))
                await settled(pilot)
            for keys in keys_of(text) if kind == "keys" else ():
                if keys == ["(wait)"]:
                    await pilot.pause()
                    app.main.coverage.join(WAIT_S)
                    await settled(pilot)
                else:
                    await press(pilot, *keys)
        return screen_text(app)

    with_editor(folder, script, (80, 24))
    table = cdb.load(folder / "parry.csv")
    assert (table.n_rows, len(table.columns)) == (61, 12)
    assert [f for f in check(table) if f.level == "error"] == []
    [case] = read_cases(folder / "parry.cases.csv")
    assert case.name == "parry on the left"
    assert check_cases(table, [case]) == []
    compiled = table.compile()
    facts = {"stance": "Standing", "speed": 3.0, "target": 1.0, "threat": 90.0, "holding": {"Sword"}}
    assert compiled.pick(compiled.query(facts), 1) == "Parry"
    assert not cdb.coverage(table).gaps
