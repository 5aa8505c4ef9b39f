"""What panes and widgets tell the screen they are on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from textual.message import Message

from .model.sheet import Done


@dataclass
class GoToCell(Message):
    """Show a cell in the grid."""

    row: int
    """The row of the file, from 0."""
    column: str | None = None
    """The column's name; None: whichever the cursor is in."""


@dataclass
class FillGap(Message):
    """Make a new row of these cells, and show it in the grid."""

    cells: Mapping[str, str]
    """Condition to cell; a condition that is not named accepts everything."""
    below: int | None = None
    """The row that the new one belongs below, from 0; None: that of the cursor."""


@dataclass
class SetContext(Message):
    """Make these the facts of the test row."""

    facts: Mapping[str, str]
    """Condition to fact, as written in `contextdb query`; a condition that is not named is left out of the question."""
    name: str = ""
    """Where the context comes from: displayed next to the test row."""


@dataclass
class Edited(Message):
    """The sheet was edited: show it again and say what was done."""

    done: Done


@dataclass
class Notice(Message):
    """Say something in the line over the footer."""

    text: str
    level: Literal["information", "warning", "error"] = "information"


@dataclass
class ValueRenameWanted(Message):
    """Give a value of a column another name."""

    column: str
    old: str
    new: str


@dataclass
class RenameWanted(Message):
    """Give a column another name, and ask where others speak of its condition."""

    old: str
    new: str
