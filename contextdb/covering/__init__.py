"""Context coverage of tables: `contextdb.coverage(table)`. The package is not called `coverage`, which is the function's name."""

from __future__ import annotations

from contextdb.covering.engine import coverage
from contextdb.covering.report import CoverageReport, Gap, Nearest, Overlap
from contextdb.covering.shares import format_percent

__all__ = ["CoverageReport", "Gap", "Nearest", "Overlap", "coverage", "format_percent"]
