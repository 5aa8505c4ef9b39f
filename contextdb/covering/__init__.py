"""Context coverage of tables: `contextdb.coverage(table)`. The package is not called `coverage`, which is the function's name."""

from __future__ import annotations

from contextdb.covering.engine import coverage
from contextdb.covering.pairs import PairTable, Slice, pairs
from contextdb.covering.progress import Cancelled
from contextdb.covering.report import CoverageReport, Crowd, Gap, Nearest, Overlap, format_percent

__all__ = ["Cancelled", "CoverageReport", "Crowd", "Gap", "Nearest", "Overlap", "PairTable", "Slice", "coverage"]
__all__ += ["format_percent", "pairs"]
