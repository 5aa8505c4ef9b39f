"""The palette finds a command by what people call it, above all people who come from Excel."""

from pathlib import Path
from typing import Any

import pytest
from terminal import EditorApp, press, screen_text, settled, with_editor
from textual.pilot import Pilot

from tui.commands import BY_ID
from tui.model.finding import Findable
from tui.words import WORDS

WANTED = {
    "replace": "find", "find and replace": "find", "search": "find", "unhide": "show-columns", "unhide columns": "show-columns",
    "type": "column-sheet", "data type": "column-sheet", "unit": "column-sheet", "allowed values": "column-sheet",
    "format cells": "column-sheet", "validation": "column-sheet", "data validation": "choose", "drop-down": "choose",
    "dropdown": "choose", "list": "choose", "comment": "note", "annotation": "note", "error": "problems", "errors": "problems",
    "warnings": "problems", "spell check": "problems", "gap": "coverage", "gaps": "coverage", "missing": "coverage",
    "heat map": "coverage", "weight": "options", "settings": "options", "preferences": "options", "pick": "options",
    "random": "options", "column width": "autofit", "resize columns": "autofit", "csv": "import", "excel": "import",
    "open file": "import", "text to columns": "import", "print": "export", "send": "export", "share": "export",
    "compare": "nearest", "play": "live", "running game": "live", "move row": "row-up", "move column": "column-left",
    "rename table": "rename-table", "rename sheet": "rename-table", "delete table": "delete-table", "delete sheet": "delete-table",
    "copy sheet": "duplicate-table", "new sheet": "new-table", "worksheet": "open", "switch table": "open",
    "remove duplicates": "remove-duplicates", "duplicates": "remove-duplicates", "freeze panes": "freeze", "pin": "freeze",
    "autofilter": "filter", "clear filter": "show-all", "filter by value": "filter-same", "unique values": "values",
    "pivot": "values", "color": "colour-rows", "fill colour": "colour-rows", "highlight": "colour-rows", "add row": "insert-row",
    "insert column": "add-column", "new condition": "add-column", "remove column": "delete-columns", "remove row": "delete-rows",
    "drag down": "fill-down", "sequence": "fill-series", "name box": "go-to", "group": "fold", "formula bar": "edit",
    "versions": "history", "track changes": "history", "save a copy": "save-as", "exit": "quit", "shortcuts": "help",
    "explain": "why", "test cases": "contexts", "disable row": "enable", "template": "blueprints", "dark mode": "theme",
    "ascending": "sort", "reload": "refresh",
}  # fmt: skip
"""What somebody types, and the command that is meant."""


async def shown(app: EditorApp, pilot: Pilot[Any], text: str) -> None:
    """Go on once the screen shows a text: Textual looks commands up in the background."""
    for _ in range(500):
        await pilot.pause(0.02)
        if text in screen_text(app):
            return


def test_the_palette_finds_what_users_of_excel_type(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("Asset,speed\nwalk,1\n")

    async def script(app: EditorApp, pilot) -> dict[str, list[str]]:
        from tui.screens.palette import findable

        commands = list(app.get_system_commands(app.screen))

        def best(text: str) -> list[str]:
            ranked = sorted(commands, key=lambda one: findable(one).rank(text), reverse=True)
            return [one.title for one in ranked[:3] if findable(one).rank(text)]

        return {text: best(text) for text in WANTED}

    titles = with_editor(tmp_path / "t.csv", script)
    label = {name: BY_ID[name].label if name in BY_ID else name.capitalize() for name in WANTED.values()}
    first = [text for text, name in WANTED.items() if titles[text][:1] == [label[name]]]
    missed = {text: titles[text] for text, name in WANTED.items() if label[name] not in titles[text]}
    assert len(WANTED) >= 60
    assert missed == {}
    assert len(first) / len(WANTED) >= 55 / 60, {text: titles[text] for text in WANTED if text not in first}


def test_other_names_are_those_of_commands() -> None:
    assert set(WORDS) - set(BY_ID) == {"theme", "screenshot"}


@pytest.mark.parametrize(
    ("query", "rank"),
    [("", 0), ("zebra", 0), ("sheet zebra", 0)],
)
def test_all_words_must_be_somewhere(query: str, rank: int) -> None:
    assert Findable("Sheet of columns", ["data type"], "Types, units.").rank(query) == rank


def test_a_name_comes_before_another_name_and_that_before_the_sentence() -> None:
    places = [Findable("Width"), Findable("Size", ["width"]), Findable("Size", (), "The width of it.")]
    ranks = [one.rank("width") for one in places]
    assert ranks == sorted(ranks, reverse=True)
    assert len(set(ranks)) == 3


def test_the_palette_shows_first_what_was_used_last_and_runs_what_was_typed(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("Asset,speed\nwalk,1\nrun,2\nwalk,1\n")

    async def script(app: EditorApp, pilot) -> tuple[str, int, dict[str, int]]:
        await press(pilot, "ctrl+p", *"dedupe")
        await shown(app, pilot, "Drop duplicates")
        await press(pilot, "enter")
        await settled(pilot)
        n_rows = app.main.session.sheet.table.n_rows
        await press(pilot, "ctrl+p")
        await shown(app, pilot, "Drop duplicates")
        return screen_text(app), n_rows, {name: at for name, at in app.likely_commands().items() if at == 0}

    text, n_rows, first = with_editor(tmp_path / "t.csv", script)
    assert n_rows == 2
    assert "Drop duplicates" in text  # it is on the first page, of a list in which "Clear" comes before it
    assert first == {"Drop duplicates": 0}
