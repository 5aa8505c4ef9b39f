"""What changed between two tables, cell by cell.

Rows are compared by asset and not by line; a change of meaning is kept apart from a mere change of text. `diff` gives
what changed, and the edit that does it. Nothing here touches the disk.
"""

from __future__ import annotations

from contextdb.edits.diffing.differences import CellChange, Diff, Renamed, RowMove, diff

__all__ = ["CellChange", "Diff", "Renamed", "RowMove", "diff"]
