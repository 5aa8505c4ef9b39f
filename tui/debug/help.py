"""The debugger's help: questions and the way to their answers, what the signs mean, and the keys."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

from textual.binding import Binding, BindingType

from ..screens.help_page import HelpPage, Lines
from .keys import KEYS, names_of

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
        "Which weights would choose mine?",
        "+ on an asset in Bars: it should have been chosen; -: it should not. contextdb motion learn learns weights from it.",
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


class DebugHelp(HelpPage):
    """What the screen shows, and its keys."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("question_mark", "cancel", "Close", show=False)]
    widest = 36

    def sections(self) -> Iterator[tuple[str, Lines]]:
        """The questions, the signs, and the keys by their groups."""
        yield "Questions", QUESTIONS
        yield "What the signs mean", SIGNS
        for group in dict.fromkeys(key.group for key in KEYS):
            yield group, [(names_of(key.keys), key.about) for key in KEYS if key.group == group]
