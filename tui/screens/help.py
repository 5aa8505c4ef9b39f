"""The help on F1: how cells are written, and every key."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ..commands import COMMANDS, Command, key_names
from .help_page import HelpPage, Lines

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
    ("… ~2.5/10", "of numbers: 2.5 more for each 10 that the fact is away"),
)
MARKS = (
    ("◉", "the row is valid for the test row's context, and the policy may pick it"),
    ("●", "the row is valid, and others outrank it: F12 says which"),
    ("◐", "the row may be valid: its rule lacks a fact, or a fact is a set of values"),
    ("=", "in the test row: this fact is computed from others"),
    ("×", "this cell does not accept its fact"),
    ("▸", "the row refers to another table: Alt+O opens it"),
    ("×2", "the row is not valid: two cells fail"),
    ("«  »", "cells that fail, outside the window"),
    ("7 left", "how many rows the fact of this column leaves"),
    ("33 %", "the chance that the row is picked"),
    ("!", "this cell cannot be read"),
    ("–", "the row is disabled"),
    ("*", "the table has edits that are not saved"),
)
FIRST = ("edit", "choose", "undo", "save", "test-row", "why", "contexts", "coverage", "palette")
"""The commands that a first hour needs, in the order in which they are read."""


class HelpDialog(HelpPage):
    """The first keys, how cells are written, what the marks mean, and every command with its keys."""

    def __init__(self, keys: Mapping[str, str]) -> None:
        """`keys` are those of a keymap file: command to keys."""
        super().__init__()
        self._keys = keys

    def sections(self) -> Iterator[tuple[str, Lines]]:
        """The first keys, cells, marks, and the commands by their groups."""
        first = {command.id: command for command in COMMANDS if command.id in FIRST}
        yield "To begin with", [(self._keys_of(first[name]), first[name].about) for name in FIRST]
        yield "How a cell is written", CELLS
        yield "What the marks mean", MARKS
        for group in dict.fromkeys(command.group for command in COMMANDS):
            yield group, [(self._keys_of(command), command.about) for command in COMMANDS if command.group == group]

    def _keys_of(self, command: Command) -> str:
        return "  ".join(key_names(self._keys.get(command.id, command.keys))) or f"Ctrl+P {command.label}"
