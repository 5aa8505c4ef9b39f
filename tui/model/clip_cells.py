"""Which cells of a table say what their clips say: the mark that Autofill leaves.

Nothing of it is stored in a file: a cell is of its clip as long as its text is the one that the clip gives, and `contextdb motion
describe --into` asks the clips in the same way.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from contextdb.tables.nesting.names import asset_name

OF_CLIP = "◦"
"""Stands before the text of a cell that says what its clip says."""
OTHERWISE = "≠"
"""Stands before the text of a cell that does not accept what its clip shows."""


@dataclass(frozen=True)
class ClipCells:
    """What the clips say, as they were when Autofill read them."""

    cells: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    """Asset to column to cell."""
    refused: frozenset[tuple[str, str, str]] = frozenset()
    """Asset, column and text of each cell that does not accept what its clip shows."""

    def mark(self, asset: str, column: str, text: str) -> str:
        """What stands before a text; empty for one of which the clip says nothing, and for one that says it in another way."""
        name = asset_name(asset)
        if text and self.cells.get(name, {}).get(column) == text:
            return OF_CLIP
        return OTHERWISE if (name, column, text) in self.refused else ""

    def mark_text(self, asset: str, column: str, text: str) -> str:
        """The same in words."""
        mark = self.mark(asset, column, text)
        if mark == OTHERWISE:
            return f"its clip shows {self.cells[asset_name(asset)][column]}"
        return "as its clip says" if mark else ""
