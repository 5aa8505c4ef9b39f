"""Where an asset stands in a recorded search asked again: its best frame, why that is left out, and the rows that leave it out."""

from __future__ import annotations

from dataclasses import dataclass

from contextdb.cells.mirroring import changed_in_mirror, mirrored_facts
from contextdb.errors import ContextDBError, Fault, MotionError, in_quotes
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.search.filters import Filter
from contextdb.motion.trace.other_filters import UNKNOWN
from contextdb.motion.trace.reasked_decision import ReaskedDecision
from contextdb.motion.trace.reasked_search import ReaskedSearch
from contextdb.motion.trace.stock import Row

OF_MARKUP = {LeftOut.EXCLUDED, LeftOut.DO_NOT_CHOOSE, LeftOut.NEXT_NATURAL, LeftOut.CLIP_END, LeftOut.MATCH_RANGE}
OF_TIME = {LeftOut.JUMP: "jump_threshold_s", LeftOut.HISTORY: "history_s", LeftOut.PHASE: "phase"}


@dataclass(frozen=True, eq=False)
class Place:
    """Where an asset stands: its best frame."""

    search: ReaskedSearch
    range: int
    frame: int

    @property
    def name(self) -> str:
        return self.search.name

    @property
    def asset(self) -> str:
        return self.search.database.assets[self.range]

    @property
    def cost(self) -> float:
        return float(self.search.costs[self.frame])

    @property
    def left_out(self) -> LeftOut:
        return LeftOut(int(self.search.left_out[self.frame]))


def place_of(asked: ReaskedDecision, asset: str) -> Place:
    """The best frame of an asset, in whichever database and range."""
    found = [
        Place(search, i, frame)
        for search in asked.searches.values()
        for i, each in enumerate(search.database.assets)
        if each == asset and (frame := search.best_of_range(i)) >= 0
    ]
    if not found:
        raise MotionError(Fault(f"the asset {in_quotes(asset)} has no frames.", "an asset with frames"))
    return min(found, key=lambda at: (at.left_out is not LeftOut.NO, at.cost))


def rows_of(asked: ReaskedDecision, at: Place) -> list[Row]:
    """The asset's rows in its table that are not valid, the nearest first; none where there is no table, or no facts."""
    table, context = asked.stock.table(at.name), asked.decision.context
    if table is None or context is None:
        return []
    try:
        compiled = table.compile()
        facts = mirrored_facts(context, changed_in_mirror(compiled.asked.values())) if is_mirrored(at) else dict(context)
        explained = compiled.explain(facts, unknown=UNKNOWN)
        return [row for row in explained.asset(at.asset) if not row.is_valid]
    except ContextDBError:
        return []


def is_mirrored(at: Place) -> bool:
    return bool(at.search.database.mirrored[at.range])


def let_in(chosen: Filter, at: int) -> Filter:
    """A filter that lets one more range play."""
    ranges = chosen.ranges.copy()
    ranges[at] = True
    return chosen._replace(ranges=ranges, is_whole=bool(ranges.all()))
