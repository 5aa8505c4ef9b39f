"""The list of lines: names are cut where they are alike, and what is said of no line is whole."""

from __future__ import annotations

from terminal import drive, screen_text
from textual.app import App, ComposeResult
from textual.pilot import Pilot

from tui.widgets.line_list import LineList, ListColumn


class ListApp(App[None]):
    """A list alone."""

    def __init__(self, lines: list[LineListLine]) -> None:
        super().__init__()
        self.lines = lines

    def compose(self) -> ComposeResult:
        yield LineList(
            [ListColumn("Asset", 12, is_name=True), ListColumn("Text", 9)], empty="No session is recorded in this folder."
        )

    def on_mount(self) -> None:
        self.query_one(LineList).show(len(self.lines), self.lines.__getitem__)


LineListLine = tuple[str, str]


def drawn(lines: list[LineListLine]) -> list[str]:
    async def play(pilot: Pilot[None]) -> str:
        await pilot.pause()
        return screen_text(pilot.app)

    return [line.rstrip() for line in drive(ListApp(lines), play, (26, 6)).splitlines()]


def test_long_names_are_cut_in_their_middle_and_other_texts_at_their_end():
    assert drawn([("Tackle_Dive_High_v1", "Tackle_Dive_High_v1"), ("Tackle_Dive_High_v2", "short")])[1:3] == [
        "▸ Tackle…gh_v1  Tackle_D…",
        "  Tackle…gh_v2  short",
    ]


def test_what_is_said_where_there_is_no_line_is_wrapped():
    assert drawn([])[1:3] == ["  No session is recorded", "  in this folder."]
