"""What a game's telemetry says of a table: `observe(table, "telemetry/*.parquet")`."""

from __future__ import annotations

from contextdb.telemetry.observe import observe
from contextdb.telemetry.observed import BadFile, FactNote, Observed, SeenGap

__all__ = ["BadFile", "FactNote", "Observed", "SeenGap", "observe"]
