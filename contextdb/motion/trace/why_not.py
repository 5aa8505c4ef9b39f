"""Why an asset was not chosen by a recorded search, and the smallest changes with which it would have been.

The reasons follow the way of a frame: the cells of its table, its markup, the tags that were requested, what was played, its cost.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from contextdb.cells.arguments import require_text
from contextdb.errors import Fault, MotionError, row_name
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.selection.choice import Choice, Reason
from contextdb.motion.selection.inputs import Inputs
from contextdb.motion.trace.cost_views import cost_text
from contextdb.motion.trace.reasked_decision import ReaskedDecision
from contextdb.motion.trace.stock import require_name
from contextdb.motion.trace.winning_changes import (
    OF_MARKUP,
    OF_TIME,
    Change,
    Place,
    is_mirrored,
    let_in,
    place_of,
    rows_of,
    winning_changes,
)


@dataclass(frozen=True, slots=True)
class WhyNot:
    """Why an asset was not chosen."""

    asset: str
    database: str
    frame: int
    """Its best frame, counted over the database; one that may be chosen before all that may not."""
    time_s: float | None
    """Seconds since the start of the asset."""
    rank: int
    """How many frames that may be chosen cost less, and one."""
    cost: float
    winner: str | None
    """The asset that was chosen."""
    winner_cost: float | None
    reasons: tuple[str, ...]
    """In the order of the way to a choice; empty for the asset that was chosen."""
    changes: tuple[Change, ...]
    """The smallest first of each kind; empty for the asset that was chosen."""

    def to_json(self) -> dict[str, object]:
        """The keys that scripts rely on."""
        costs = {"cost": self.cost, "winner_cost": self.winner_cost}
        finite = {name: value if value is not None and math.isfinite(value) else None for name, value in costs.items()}
        changes = [{"kind": each.kind, "what": each.what, "to": each.to, "wins": each.wins} for each in self.changes]
        return {
            "asset": self.asset,
            "frame": self.frame,
            "rank": self.rank,
            **finite,
            "reasons": list(self.reasons),
            "changes": changes,
        }


def why_not(decision: ReaskedDecision, asset: str) -> WhyNot:
    """Why an asset was not chosen, and what would have to change for it to be. Raises MotionError where no database has the asset,
    with the nearest; or nothing was searched."""
    require_text(asset, "asset")
    if decision.choice is None:
        raise MotionError(Fault(f"nothing was searched at tick {decision.decision.tick:,}: what played, played on."))
    require_name(asset, "asset", dict.fromkeys(each for search in decision.searches.values() for each in search.database.assets))
    at, choice = place_of(decision, asset), decision.choice
    winner_cost = choice.hit.cost if choice else None
    rate = None if at.search.database.schema is None else at.search.database.schema.rate
    time_s = None if rate is None else (at.frame - int(at.search.database.starts[at.range])) / rate
    has_won = bool(choice) and choice.hit.asset == asset
    reasons = () if has_won else tuple(_reasons(decision, at, choice))
    changes = () if has_won else tuple(winning_changes(decision, at))
    rank = 1 + sum(
        int(np.count_nonzero((each.costs < at.cost) & (each.left_out == LeftOut.NO)))
        for each in {**decision.searched, at.name: at.search}.values()
    )
    return WhyNot(asset, at.name, at.frame, time_s, rank, at.cost, choice.hit.asset, winner_cost, reasons, changes)


# ---- reasons


def _reasons(decision: ReaskedDecision, at: Place, choice: Choice) -> Iterator[str]:
    if at.left_out is LeftOut.NOT_VALID:
        yield from _invalid(decision, at)
    inner = _reason_within(at)
    if inner in OF_MARKUP:
        yield f"markup: {inner.text}"
    elif inner is LeftOut.TAGS:
        yield "tags: its frames do not have the tags that were requested"
    elif inner in OF_TIME:
        yield f"history: {inner.text}"
    elif inner is LeftOut.EVENT:
        yield f"event: {_astray(decision.decision.inputs)}"
    elif inner is LeftOut.FORBIDDEN:
        yield "bias: an infinite one forbids it"
    if at.name not in decision.searched and choice.reason is Reason.UNDER_THRESHOLD:
        yield f"threshold: {choice.database} won outright, {at.name} was not searched"
    if choice and at.cost >= choice.hit.cost:
        yield f"cost: {cost_text(at.cost)}, {cost_text(at.cost - choice.hit.cost)} more than {choice.hit.asset}"


def _astray(inputs: Inputs | None) -> str:
    """That a frame does not lead to the event of the moment."""
    if inputs is None or inputs.event is None:
        return LeftOut.EVENT.text
    name, in_s = inputs.event
    return f"does not lead to {name} in {in_s:.3g} s"


def _invalid(decision: ReaskedDecision, at: Place) -> Iterator[str]:
    rows = rows_of(decision, at)
    if not rows:
        yield "valid: the asset was not among the valid ones"
    for row in rows[:1]:
        for failing in row.failures:
            mirrored = ", with mirrored facts" if is_mirrored(at) else ""
            yield f"table: {row_name(row.row)} of {decision.stock.table_of[at.name]}{mirrored}: {failing}"
        if not row.is_enabled:
            yield f"table: {row_name(row.row)} of {decision.stock.table_of[at.name]} is disabled"


def _reason_within(at: Place) -> LeftOut:
    """Why its best frame would be left out if the asset were valid."""
    if at.left_out is not LeftOut.NOT_VALID:
        return at.left_out
    free = at.search.with_filter(let_in(at.search.chosen, at.range))
    return LeftOut(int(free.left_out[free.best_of_range(at.range)]))
