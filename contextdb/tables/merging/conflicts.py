"""What two sides of a merge disagree about, as data that a person can decide one by one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from contextdb.errors import safe_text

Side = Literal["ours", "theirs"]
Key = tuple[object, ...]
"""What a conflict is about, whatever else is decided."""

Decided = Mapping[Key, Side]


@dataclass(frozen=True, slots=True)
class Conflict:
    """A disagreement. Until it is decided, ours holds."""

    kind: Literal["cell", "row", "column", "name"]
    """A cell changed on both sides; a row or a column taken away on one side and changed on the other; a column of two names."""
    asset: str
    """The row's asset; empty for a column."""
    column: str
    """Empty for a row."""
    row: int | None
    """The row of the merged table; None where it has none."""
    base: str | None
    """The text, or for a row or column what it says; None where it was not there."""
    ours: str | None
    """None: ours took it away."""
    theirs: str | None
    """None: theirs took it away."""
    key: Key

    @property
    def place(self) -> str:
        return {"cell": f"{self.asset}, {self.column}", "row": self.asset}.get(self.kind, self.column)


@dataclass(frozen=True, slots=True)
class LostCell:
    """A cell of a new column of one side, left out of the merge with its row, which the other side deleted."""

    asset: str
    column: str
    text: str
    side: Side
    """Who wrote it."""

    def __str__(self) -> str:
        other = "theirs" if self.side == "ours" else "ours"
        asset, column, text = (safe_text(text) for text in (self.asset, self.column, self.text))
        cell = f'{asset}, {column}: {self.side} has "{text}"'
        return f"{cell} in this new column; it is left out with the row, which {other} deleted."
