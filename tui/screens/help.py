"""The help on F1: how cells are written, and every key."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from rich.table import Column, Table
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.widgets import Static

from tui.commands import COMMANDS, Command, key_names
from tui.screens.dialog import Dialog

CELLS = (
    ("Any, or nothing", "every value"),
    ("True  False", "that value; also t, f, yes, no, 1, 0"),
    ("20, 9.99", "centre and tolerance: 10.01 to 29.99, both included; also 20 ± 9.99"),
    ("10..30", "from 10 to 30, both included; (10..30] excludes 10; 10.. has no upper end"),
    ("5  <5  >=5", "as in mathematics"),
    ("0..5 | 10..15", "either"),
    ("170..-170", "an angle: upwards through 180, on the circle"),
    ("CB FS SS", "one of these names; write a name with blanks in double quotes"),
    ("+InAir -Stunned", "tags: all of the first, none of the second"),
    ("not …", "everything except what follows"),
    ("… ~2.5", "soft: a row that does not match costs 2.5 more in a search"),
)
MARKS = (
    ("◉", "the row is valid for the test row's context, and the policy may pick it"),
    ("●", "the row is valid, and others outrank it: F12 says which"),
    ("◐", "the row may be valid: its rule lacks a fact, or a fact is a set of values"),
    ("=", "in the test row: this fact is computed from others"),
    ("×", "this cell does not accept its fact"),
    ("▸", "the row refers to another table: Alt+O opens it"),
    ("!", "this cell cannot be read"),
    ("–", "the row is disabled"),
)


class HelpDialog(Dialog[None]):
    """How cells are written, what the marks mean, and every command with its keys."""

    DEFAULT_CSS = """
    HelpDialog VerticalScroll { height: 1fr; scrollbar-size-vertical: 1; }
    HelpDialog Static { height: auto; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("f1,q", "cancel", "Close", show=False)]
    title_text = "Help"
    keys_text = "↑↓ scroll · Esc close"

    def __init__(self, keys: Mapping[str, str]) -> None:
        """`keys` are those of a keymap file: command to keys."""
        super().__init__(classes="-wide")
        self._keys = keys

    def compose_body(self) -> ComposeResult:
        with VerticalScroll():
            yield Static(section("How a cell is written", CELLS))
            yield Static(section("What the marks mean", MARKS))
            for group in dict.fromkeys(command.group for command in COMMANDS):
                commands = [c for c in COMMANDS if c.group == group]
                yield Static(section(group, [(self._keys_of(c), c.about) for c in commands]))

    def on_mount(self) -> None:
        self.query_one(VerticalScroll).focus()

    def _keys_of(self, command: Command) -> str:
        return "  ".join(key_names(self._keys.get(command.id, command.keys)))


def section(title: str, lines: Sequence[tuple[str, str]], first: Column | None = None) -> Table:
    """Lines of two columns under a title; `first` says how wide the first column may be."""
    columns = first or Column(no_wrap=True, min_width=22), Column()
    heading = Text(title, style="bold")
    table = Table(*columns, title=heading, title_justify="left", box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    for left, right in lines:
        table.add_row(Text(left, style="bold"), Text(right))
    return table
