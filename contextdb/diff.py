"""What changed between two tables, cell by cell, and two sets of changes made one.

Rows are compared by asset and not by line; a change of meaning is told from one that only writes the same otherwise. `diff` gives
what changed, and the edit that does it; `merge` joins what two sides made of one table and gives what they disagree about as data.
The parts are in `contextdb.diffing`. Nothing here touches the disk.
"""

from __future__ import annotations

from contextdb.diffing.conflicts import Conflict, Side
from contextdb.diffing.differences import CellChange, Diff, Renamed, RowMove, diff
from contextdb.diffing.merging import Merge, merge

__all__ = ["CellChange", "Conflict", "Diff", "Merge", "Renamed", "RowMove", "Side", "diff", "merge"]
