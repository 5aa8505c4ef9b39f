"""The debugger's help: four questions and the way to their answers, what the signs mean, and the keys."""

from __future__ import annotations

from typing import ClassVar

from rich.table import Column
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.widgets import Static

from tui.debug.keys import KEYS, names_of
from tui.screens.dialog import Dialog
from tui.screens.help import section

QUESTIONS = (
    ("Why this clip?", "Go to a jump with [ and ]: the second line says why. The weights show what each channel adds."),
    (
        "Why not mine?",
        "/ and a part of its name, Enter: the pane Why says the reason, what it would take, and its row of the table.",
    ),
    (
        "Why does it jump so much?",
        "The line over the panes counts jumps, forced ones, and how little most of them spare. ! is a forced jump.",
    ),
    (
        "What if this weight were different?",
        "Tab to Weights, ↑↓ to a channel, + and -: all is searched again. r runs the whole session.",
    ),
)
SIGNS = (
    ("│  !", "a jump; a forced jump: what played could not play on"),
    ("·  +", "a search; the facts of the game changed"),
    ("▶", "what is chosen: the asset, and in its bars the frame"),
    ("○", "what would have played on"),
    ("▁▄█", "bars: each is a stretch of the asset, the taller the cheaper; in strips the taller the more"),
    ("colours", "blue may be chosen, red is not valid in the table, yellow is left out by markup or tags, grey played just now"),
    ("~", "mirrored"),
)


class DebugHelp(Dialog[None]):
    """What the screen shows, and its keys."""

    DEFAULT_CSS = """
    DebugHelp VerticalScroll { height: 1fr; scrollbar-size-vertical: 1; }
    DebugHelp Static { height: auto; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("f1,q,question_mark", "cancel", "Close", show=False)]
    title_text = "Help"
    keys_text = "↑↓ scroll · Esc close"

    def __init__(self) -> None:
        super().__init__(classes="-wide")

    def compose_body(self) -> ComposeResult:
        with VerticalScroll():
            yield Static(section("Four questions", QUESTIONS, Column(min_width=16, max_width=36)))
            yield Static(section("What the signs mean", SIGNS, Column(min_width=16, max_width=36)))
            for group in dict.fromkeys(key.group for key in KEYS):
                lines = [(names_of(key.keys), key.about) for key in KEYS if key.group == group]
                yield Static(section(group, lines, Column(min_width=16, max_width=36)))

    def on_mount(self) -> None:
        self.query_one(VerticalScroll).focus()
