"""What a check finds: one fault of a table, with its rule, its level and its place. Data only."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Literal, get_args

from contextdb.errors import Fault

Level = Literal["error", "warning", "info"]
LEVELS: tuple[Level, ...] = get_args(Level)


@dataclass(frozen=True, slots=True)
class Finding:
    """One result of a check. `row` counts from 0, `line` from 1; `by` are the rows that cause it."""

    rule: str
    level: Level
    message: str
    table: str | None = None
    file: str | None = None
    row: int | None = None
    asset: str | None = None
    line: int | None = None
    column: str | None = None
    by: tuple[int, ...] = ()

    @classmethod
    def of(cls, fault: Fault, level: Level = "error", table: str | None = None, asset: str | None = None) -> Finding:
        place = fault.place
        return cls(fault.rule, level, fault.message, table, place.file, place.row, asset, place.line, place.column)

    def to_json(self) -> dict[str, object]:
        """The finding as plain data, every field in it."""
        return asdict(self) | {"by": list(self.by)}


def worst(findings: Iterable[Finding]) -> Level | None:
    """The highest level among the findings, or None."""
    levels = {f.level for f in findings}
    return next((level for level in LEVELS if level in levels), None)
