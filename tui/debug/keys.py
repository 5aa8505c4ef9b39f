"""The debugger's keys, once: bindings, help and docs/keys.md are made of this list."""

from __future__ import annotations

from dataclasses import dataclass

from textual.binding import Binding


@dataclass(frozen=True, slots=True)
class Key:
    """A key, the action of the screen that it runs, what the foot of the screen calls it, and what it does."""

    keys: str
    action: str
    label: str
    about: str
    group: str
    in_foot: bool = False

    def binding(self) -> Binding:
        return Binding(self.keys, self.action, self.label, show=self.in_foot)


TIME, LOOK, CHOOSE, WEIGHTS, MORE = "Time", "Poses", "Assets", "Weights", "More"
KEYS = (
    Key("right", "step(1)", "Step", "One update later.", TIME),
    Key("left", "step(-1)", "Step back", "One update earlier.", TIME),
    Key("shift+right", "step(10)", "Ten", "Ten updates later.", TIME),
    Key("shift+left", "step(-10)", "Ten back", "Ten updates earlier.", TIME),
    Key("right_square_bracket", "jump(1)", "Jump", "To the next jump.", TIME, True),
    Key("left_square_bracket", "jump(-1)", "Last jump", "To the jump before.", TIME),
    Key("n", "peak(1)", "Peak", "To the next peak of the chosen measure.", TIME, True),
    Key("N", "peak(-1)", "Peak before", "To the peak before.", TIME),
    Key("m", "measure", "Measure", "Choose the next measure: its strip is marked with ▸.", TIME),
    Key("home", "end(-1)", "Start", "To the start of the session.", TIME),
    Key("end", "end(1)", "End", "To its end; of a running game back to now.", TIME),
    Key("space", "play", "Play", "Play from here, or stop; of a running game hold the moment, or go on.", TIME, True),
    Key("comma", "zoom(1)", "Shorter", "Show a shorter stretch of time; also the wheel of the mouse.", TIME),
    Key("full_stop", "zoom(-1)", "Longer", "Show a longer one.", TIME),
    Key(
        "tab",
        "pane(1)",
        "Pane",
        "To the next pane: bars, why, poses, weights. A small screen shows one of them.",
        CHOOSE,
        True,
    ),
    Key("shift+tab", "pane(-1)", "Pane before", "To the pane before.", CHOOSE),
    Key("slash", "filter", "Find", "Only assets whose name holds a text; Esc shows all.", CHOOSE, True),
    Key("s", "order", "Order", "Order assets by best cost, by name, or by how long they play in the session.", CHOOSE),
    Key("c", "chosen", "Chosen", "Move the cursor to the asset that is chosen.", CHOOSE),
    Key(
        "o",
        "sheet",
        "Row",
        "Open the asset's row in the sheet, at the first cell that fails; quit the editor to come back.",
        CHOOSE,
    ),
    Key(
        "plus,equals_sign",
        "turn(1)",
        "Weight",
        "In the bars, mark the asset: it should have been chosen. In the weights, turn up the one under the cursor.",
        WEIGHTS,
        True,
    ),
    Key("minus", "turn(-1)", "Weight down", "It should not have been chosen; or turn the weight down.", WEIGHTS),
    Key("0", "reset", "Reset", "All weights and thresholds as they were recorded.", WEIGHTS),
    Key("r", "run", "Run", "Run the whole session again with these weights; Esc ends it.", WEIGHTS, True),
    Key("w", "write", "Write", "Write turned weights and thresholds into contextdb.toml.", WEIGHTS),
    Key("u", "undo", "Undo", "Take back what was written last.", WEIGHTS),
    Key("h", "orbit(-1, 0)", "Turn left", "Look from farther left; also by dragging.", LOOK),
    Key("l", "orbit(1, 0)", "Turn right", "From farther right.", LOOK),
    Key("k", "orbit(0, 1)", "From above", "From higher up.", LOOK),
    Key("j", "orbit(0, -1)", "From below", "From lower down.", LOOK),
    Key("z", "near(1)", "Nearer", "From nearer; also the wheel of the mouse.", LOOK),
    Key("x", "near(-1)", "Farther", "From farther away.", LOOK),
    Key("escape", "stop", "Stop", "End what is at work, or show all assets again; in the editor, go back to it.", MORE),
    Key("f1,question_mark", "help", "Help", "What the screen shows, and these keys.", MORE, True),
    Key("q,ctrl+q", "quit", "Quit", "Leave.", MORE, True),
)
"""The arrows up and down move the cursor of the pane that has the focus, Page up and Page down by as much as is seen."""

NAMES = {
    "right_square_bracket": "]",
    "left_square_bracket": "[",
    "comma": ",",
    "full_stop": ".",
    "slash": "/",
    "plus": "+",
    "equals_sign": "=",
    "minus": "-",
    "question_mark": "?",
    "right": "→",
    "left": "←",
    "shift+right": "Shift+→",
    "shift+left": "Shift+←",
    "shift+tab": "Shift+Tab",
    "escape": "Esc",
    "f1": "F1",
    "ctrl+q": "Ctrl+Q",
}


TOGETHER = {"right_square_bracket": "[ ]", "plus": "+ -"}
"""Keys that the foot of the screen shows with their opposite."""


def name_of(key: str) -> str:
    """A key as it is typed: letters as they are, N with Shift."""
    return NAMES.get(key) or (key if len(key) == 1 else key.capitalize())


def names_of(keys: str) -> str:
    """The keys of an action."""
    return "  ".join(name_of(key) for key in keys.split(","))
