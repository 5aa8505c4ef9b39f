"""The smallest changes with which an asset would have been chosen by a recorded search, each searched with once more.

    a frame X that loses to the winner W by D = cost X - cost W ties with it
        with a bias of -D on its asset;
        with the weight w at which w x (d_X - d_W) of one channel is less by D: w - D / (d_X - d_W), if that is not below 0

d is a channel's sum of squared differences, before it is weighed. That holds against W alone: another may then be before X, which
the search with the change says. Where an asset may not be chosen at all, that is put right first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from contextdb.errors import ContextDBError, Fault, MotionError, in_quotes, row_name
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.search.filters import Filter
from contextdb.motion.selection.choice import Choice
from contextdb.motion.trace.other_filters import ReaskedSearch, filter_by_table
from contextdb.motion.trace.reasked_decision import ReaskedDecision
from contextdb.motion.trace.stock import Edited, Row, failing_rows

DIGITS = 4
"""So many digits of a number are proposed, rounded so that the asset is before the tie."""
MARGIN = 1e-6
MOST_WEIGHT = 1e6
MOST_STEPS = 30
AND = " + "


class ChangePart(NamedTuple):
    """One thing that is changed."""

    kind: str
    """"cell", "cells", "mask" (its range is let in, where no table says why it was not), "mark", "tags", "setting", "event",
    "bias", "weight" or "threshold"."""
    what: str
    """What is changed: the cell, the mark, the channel."""
    to: str | float
    """To what."""


@dataclass(frozen=True, slots=True)
class Change:
    """What is changed together, and whether a search with it chooses the asset."""

    parts: tuple[ChangePart, ...]
    wins: bool

    @property
    def kind(self) -> str:
        """The kinds of its parts, as "cell + bias"."""
        return AND.join(part.kind for part in self.parts)

    @property
    def what(self) -> str:
        """What its parts change."""
        return AND.join(part.what for part in self.parts)

    @property
    def to(self) -> str | float:
        """To what: as it is for one part, else as text."""
        return self.parts[0].to if len(self.parts) == 1 else AND.join(str(part.to) for part in self.parts)


Step = tuple[ChangePart, ReaskedDecision]
"""A change, and the decision with it."""


def winning_changes(decision: ReaskedDecision, at: Place) -> Iterator[Change]:
    """What lets the asset be chosen, and, where that is not enough, what makes it cheaper beside."""
    parts: tuple[ChangePart, ...] = ()
    now = decision
    for part, freed in _free(decision, at):
        parts, now = (*parts, part), freed
        yield Change(parts, _wins(now, at.asset))
    if not _wins(now, at.asset):
        for part, cheaper in _cheaper(now, place_of(now, at.asset)):
            yield Change((*parts, part), _wins(cheaper, at.asset))


def _wins(decision: ReaskedDecision, asset: str) -> bool:
    return bool(decision.choice) and decision.choice is not None and decision.choice.hit.asset == asset


def _free(decision: ReaskedDecision, at: Place) -> Iterator[Step]:
    """What lets the asset be chosen: each step goes on from the one before."""
    for step in (_valid, _unmarked, *[_in_time] * len(OF_TIME), _at_any_time, _in_turn):
        done = step(decision, at)
        if done is not None:
            decision = done[1]
            yield done


def _valid(decision: ReaskedDecision, at: Place) -> Step | None:
    """The cells that would have to accept the facts; or, without a table, the mask."""
    if at.left_out is not LeftOut.NOT_VALID:
        return None
    table, rows = decision.stock.table(at.name), rows_of(decision, at)
    if table is not None and rows:
        edited = _edited(table, rows[0])
        if edited is not None:
            search = decision.searches[at.name]
            chosen = filter_by_table(search.database, search.chosen, edited.compile(), decision.decision.context or {})
            if chosen.ranges[at.range]:
                failures = rows[0].failures
                name, row = decision.stock.table_of[at.name], row_name(rows[0].row)
                what = f"{row} of {name}: {', '.join(failing.condition for failing in failures)}"
                kind = "cell" if len(failures) == 1 else "cells"
                return ChangePart(kind, what, "; ".join(failing.mend for failing in failures)), _with(decision, at, chosen)
    return ChangePart("mask", at.asset, "valid"), _with(decision, at, let_in(at.search.chosen, at.range))


def _edited(table: Edited, row: Row) -> Edited | None:
    """A table in which the failing cells of a row accept their facts; None where no cell does it."""
    if not row.is_enabled:
        return None
    try:
        for failing in row.failures:
            if getattr(failing, "step", None) is not None:
                return None
            table = table.with_cell(row.row, failing.condition, failing.mend)
    except ContextDBError:
        return None
    return table


def _unmarked(decision: ReaskedDecision, at: Place) -> Step | None:
    """The best frame without what markup and tags say against it."""
    at = _place_in(decision, at)
    reason = at.left_out
    if reason not in OF_MARKUP and reason is not LeftOut.TAGS:
        return None
    kind = "tags" if reason is LeftOut.TAGS else "mark"
    what = f"{reason.text} on {at.asset}"
    return ChangePart(kind, what, "without"), _with_search(decision, _unmarked_search(decision.searches[at.name], at.range))


def _unmarked_search(search: ReaskedSearch, at: int) -> ReaskedSearch:
    """A search in which the frames of a range may be chosen whatever their kind: they get kinds of their own."""
    database, chosen = search.database, search.chosen
    marks, n = database.marks, database.marks.n_kinds
    own = slice(int(database.starts[at]), int(database.stops[at]))
    kinds = marks.kinds.astype(np.int32)
    kinds[own] += n
    other_marks = replace(
        marks,
        kinds=kinds,
        kind_tags=np.concatenate([marks.kind_tags, marks.kind_tags]),
        kind_marks=np.append(marks.kind_marks, marks.kind_marks),
        kind_biases=np.append(marks.kind_biases, marks.kind_biases),
        kind_root_weights=np.append(marks.kind_root_weights, marks.kind_root_weights),
    )
    of_kinds = chosen.kinds
    freed = of_kinds._replace(
        allowed=np.append(of_kinds.allowed, np.ones(n, np.bool_)),
        biases=np.append(of_kinds.biases, of_kinds.biases),
        playable=np.append(of_kinds.playable, np.ones(n, np.bool_)),
        left_out=np.append(of_kinds.left_out, np.zeros(n, np.uint8)),
    )
    flags = chosen.frames.copy()
    if len(flags):
        flags[own] = True
    skips = tuple(skip for skip in chosen.skips if skip.why not in OF_MARKUP or skip.stop <= own.start or own.stop <= skip.start)
    other = replace(database, marks=other_marks)
    return ReaskedSearch(search.name, other, search.query, chosen._replace(kinds=freed, frames=flags, skips=skips), search._sums)


def _in_time(decision: ReaskedDecision, at: Place) -> Step | None:
    """The best frame though it was played just now, or plays nearly."""
    at = _place_in(decision, at)
    setting = OF_TIME.get(at.left_out)
    if setting is None:
        return None
    chosen = decision.searches[at.name].chosen
    skips = tuple(skip for skip in chosen.skips if skip.why is not at.left_out)
    return ChangePart("setting", setting, 0.0), _with(decision, at, chosen._replace(skips=skips))


def _at_any_time(decision: ReaskedDecision, at: Place) -> Step | None:
    """The best frame whatever is to happen."""
    at = _place_in(decision, at)
    if at.left_out is not LeftOut.EVENT:
        return None
    chosen, inputs = decision.searches[at.name].chosen, decision.decision.inputs
    skips = tuple(skip for skip in chosen.skips if skip.why is not LeftOut.EVENT)
    name = "event" if inputs is None or inputs.event is None else inputs.event[0]
    return ChangePart("event", name, "without"), _with(decision, at, chosen._replace(skips=skips))


def _in_turn(decision: ReaskedDecision, at: Place) -> Step | None:
    """The database searched though one before it won outright."""
    choice = decision.choice
    if choice is None or at.name in decision.searched or choice.database is None:
        return None
    lower = _rounded(choice.hit.cost, downwards=True)
    return ChangePart("threshold", choice.database, lower), decision.with_threshold(choice.database, lower)


def _cheaper(decision: ReaskedDecision, at: Place) -> Iterator[Step]:
    """A bias, a threshold and a weight that bring an asset that may be chosen before the winner."""
    choice = decision.choice
    if choice is None or choice.database is None or at.left_out is not LeftOut.NO or at.name not in decision.searched:
        return
    behind = at.cost - choice.hit.cost
    added = -_rounded(behind + MARGIN * (abs(at.cost) + abs(choice.hit.cost)), downwards=False)
    chosen = decision.searches[at.name].chosen
    biases = chosen.range_biases.copy()
    biases[at.range] += added
    yield ChangePart("bias", at.asset, added), _with(decision, at, chosen._replace(range_biases=biases))
    if at.name != choice.database and _comes_before(decision, at.name, choice.database):
        to = _rounded(at.cost + MARGIN * abs(at.cost), downwards=False)
        yield ChangePart("threshold", at.name, to), decision.with_threshold(at.name, to)
    yield from _weighed(decision, at, choice)


def _weighed(decision: ReaskedDecision, at: Place, choice: Choice) -> Iterator[Step]:
    """The one weight of least relative change with which the asset wins; without one, the one of least change at all."""
    winner = decision.searches[str(choice.database)]
    steps: list[tuple[float, Step]] = []
    for i, channel in enumerate(at.search.database.channel_names):
        now = float(at.search.database.weights[i])
        weight = _weight_of_tie(channel, now, at, winner, choice.hit.frame)
        if weight is None:
            continue
        to = _rounded(weight, downwards=weight < now)
        size = abs(math.log((to + 1e-12) / (now + 1e-12)))
        steps.append((size, (ChangePart("weight", channel, to), decision.with_weights({channel: to}))))
    steps.sort(key=lambda each: each[0])
    winning = [step for _, step in steps if _wins(step[1], at.asset)]
    yield from (winning or [step for _, step in steps])[:1]


def _weight_of_tie(channel: str, now: float, at: Place, winner: ReaskedSearch, frame: int) -> float | None:
    """The weight of a channel just beyond that at which a frame costs as much as the winner; None where there is none.

    Costs may depend on all weights, as where these are divided by their sum: the tie is computed in steps. Where a cost is a sum
    of weights times differences, the first step is exact.
    """

    def behind(weight: float) -> float:
        changed = at.search.database.with_weights({channel: weight}).cost_weights
        own = float((changed * at.search.sums[:, at.frame]).sum() + at.search.biases[at.frame])
        others = winner.database.with_weights({channel: weight}).cost_weights
        return own - float((others * winner.sums[:, frame]).sum() + winner.biases[frame])

    if not np.delete(at.search.database.weights, at.search.database.channel_names.index(channel)).any():
        return None  # the only channel that weighs
    old, value = now, behind(now)
    slope = (behind(now + 1.0) - value) / 1.0
    for _ in range(MOST_STEPS):
        if slope == 0.0 or not math.isfinite(slope):
            return None
        weight = old - value / slope
        if not 0.0 <= weight <= MOST_WEIGHT:
            return None
        value_here = behind(weight)
        if abs(value_here) <= 1e-12 * (1.0 + abs(at.cost)):
            beyond = weight + math.copysign(MARGIN * max(1.0, weight), weight - now)
            return max(0.0, beyond)
        if weight == old:
            return None
        slope, old, value = (value_here - value) / (weight - old), weight, value_here
    return None


# ---- small things


def _with(decision: ReaskedDecision, at: Place, chosen: Filter) -> ReaskedDecision:
    return _with_search(decision, decision.searches[at.name].with_filter(chosen))


def _with_search(decision: ReaskedDecision, search: ReaskedSearch) -> ReaskedDecision:
    searches: Mapping[str, ReaskedSearch] = {**decision.searches, search.name: search}
    return decision.with_searches(searches)


def _place_in(decision: ReaskedDecision, at: Place) -> Place:
    """The best frame of a range in a changed decision."""
    search = decision.searches[at.name]
    return Place(search, at.range, search.best_of_range(at.range))


def _comes_before(decision: ReaskedDecision, one: str, other: str) -> bool:
    names = [entry.name for entry in decision.entries]
    return names.index(one) < names.index(other)


def _rounded(number: float, *, downwards: bool) -> float:
    """A number of few digits, not above, or not below, another."""
    if number == 0.0 or not math.isfinite(number):
        return number
    unit = 10.0 ** (math.floor(math.log10(abs(number))) - DIGITS + 1)
    units = math.floor(number / unit) if downwards else math.ceil(number / unit)
    rounded = float(f"{units * unit:.{DIGITS}g}")
    if (rounded > number) if downwards else (rounded < number):
        rounded = number
    return rounded


# ---- where an asset stands: its best frame, why that is left out, and the rows that leave it out


OF_MARKUP = {LeftOut.EXCLUDED, LeftOut.DO_NOT_CHOOSE, LeftOut.NEXT_NATURAL, LeftOut.CLIP_END, LeftOut.MATCH_RANGE}
OF_TIME = {
    LeftOut.JUMP: "jump_threshold_s",
    LeftOut.HISTORY: "history_s",
    LeftOut.PHASE: "phase",
    LeftOut.ASSET: "asset_history_s",
}


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


def place_of(decision: ReaskedDecision, asset: str) -> Place:
    """The best frame of an asset, in whichever database and range."""
    places = [
        Place(search, i, frame)
        for search in decision.searches.values()
        for i, each in enumerate(search.database.assets)
        if each == asset and (frame := search.best_of_range(i)) >= 0
    ]
    if not places:
        raise MotionError(Fault(f"the asset {in_quotes(asset)} has no frames.", "an asset with frames"))
    return min(places, key=lambda at: (at.left_out is not LeftOut.NO, at.cost))


def rows_of(decision: ReaskedDecision, at: Place) -> list[Row]:
    """The asset's rows in its table that are not valid, the nearest first; none where there is no table, or no facts."""
    table, context = decision.stock.table(at.name), decision.decision.context
    return [] if table is None or context is None else failing_rows(table.compile(), at.asset, context, is_mirrored(at))


def is_mirrored(at: Place) -> bool:
    return bool(at.search.database.mirrored[at.range])


def let_in(chosen: Filter, at: int) -> Filter:
    """A filter that lets one more range play."""
    ranges = chosen.ranges.copy()
    ranges[at] = True
    return chosen._replace(ranges=ranges, is_whole=bool(ranges.all()))
