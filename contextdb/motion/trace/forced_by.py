"""Which columns of the tables force jumps: what played was not valid any more, and which of its cells do not accept the facts.

Of the asset's rows the one with the fewest failing cells counts. A jump because an animation ended is forced by no column.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from contextdb.motion.selection.decision import Decision
from contextdb.motion.trace.stock import Queryable, failing_rows


@dataclass(frozen=True, slots=True)
class ForcedBy:
    """Columns that together forced jumps: how many, and what the most expensive of these cost."""

    columns: tuple[str, ...]
    jumps: int
    cost: float | None

    def sentence(self, n_forced: int) -> str:
        """It as people read it; of so many forced jumps."""
        cost = "" if self.cost is None else f", at a cost of up to {self.cost:.3g}"
        return f"forced by {' and '.join(self.columns)}: {self.jumps:,} of {n_forced:,} forced jumps{cost}"

    def to_json(self) -> dict[str, object]:
        return {"columns": list(self.columns), "jumps": self.jumps, "cost": self.cost}


def forced_by(decisions: Iterable[Decision], tables: Mapping[str, Queryable]) -> list[ForcedBy]:
    """The columns that forced jumps, those of most jumps first. `tables` is the compiled table of each database."""
    forced = []
    for decision in decisions:
        before = decision.before
        if before is None or not decision.is_forced or before.database not in tables or decision.context is None:
            continue
        rows = failing_rows(tables[before.database], before.asset, decision.context, before.mirrored)
        columns = min((tuple(each.condition for each in row.failures) for row in rows), key=len, default=())
        if columns:
            forced.append(ForcedBy(columns, 1, decision.cost))
    return together(forced)


def together(parts: Iterable[ForcedBy]) -> list[ForcedBy]:
    """Those of the same columns in one, those of most jumps first."""
    of_columns: dict[tuple[str, ...], list[ForcedBy]] = {}
    for each in parts:
        of_columns.setdefault(each.columns, []).append(each)
    forced = [
        ForcedBy(columns, sum(each.jumps for each in own), max((each.cost for each in own if each.cost is not None), default=None))
        for columns, own in of_columns.items()
    ]
    return sorted(forced, key=lambda each: -each.jumps)
