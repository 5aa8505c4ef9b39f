"""Why an asset was not chosen by a recorded search, and the smallest changes with which it would have been.

The reasons follow the way of a frame: the cells of its table, its markup, the tags that were asked for, what was played, its cost.
Each proposed change is searched with once more, as a change of one thing holds against one rival only.

    a frame X that loses to the winner W by D = cost X - cost W ties with it
        with a bias of -D on its asset;
        with the weight w at which w x (d_X - d_W) of one channel is less by D: w - D / (d_X - d_W), if that is not below 0

d is a channel's sum of squared differences, before it is weighed. Where an asset may not be chosen at all, that is put right first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from contextdb.cells.arguments import require_text
from contextdb.errors import ContextDBError, Fault, MotionError
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.search.filters import Filter
from contextdb.motion.selection.choice import Choice, Reason
from contextdb.motion.trace.cost_views import cost_text
from contextdb.motion.trace.other_filters import UNKNOWN, asked_of_table
from contextdb.motion.trace.reasked_decision import ReaskedDecision
from contextdb.motion.trace.reasked_search import ReaskedSearch
from contextdb.motion.trace.stock import Edited, Row, require_name

OF_MARKUP = {LeftOut.EXCLUDED, LeftOut.DO_NOT_CHOOSE, LeftOut.NEXT_NATURAL, LeftOut.CLIP_END, LeftOut.MATCH_RANGE}
OF_TIME = {LeftOut.JUMP: "jump_threshold_s", LeftOut.HISTORY: "history_s", LeftOut.PHASE: "phase"}
DIGITS = 4
"""So many digits of a number are proposed, rounded so that the asset is before the tie."""
MARGIN = 1e-6
MOST_WEIGHT = 1e6
MOST_STEPS = 30
AND = " + "


@dataclass(frozen=True, slots=True)
class Change:
    """One change, and whether the asset wins with it.

    Attributes
    ----------
    kind : str
        "cell", "mask" (its range is let in, where no table says why it was not), "mark", "tags", "setting", "bias", "weight",
        "threshold"; or several, as "cell + bias".
    what : str
        What is changed: the cell, the mark, the channel.
    to : str or float
        To what.
    wins : bool
        Whether a search with it chooses the asset.
    """

    kind: str
    what: str
    to: str | float
    wins: bool


@dataclass(frozen=True, slots=True)
class WhyNot:
    """Why an asset was not chosen.

    Attributes
    ----------
    asset : str
    database : str
    frame : int
        Its best frame, counted over the database; one that may be chosen before all that may not.
    time_s : float or None
        Seconds since the start of the asset.
    rank : int
        How many frames that may be chosen cost less, and one.
    cost : float
    winner : str or None
        The asset that was chosen.
    winner_cost : float or None
    reasons : tuple of str
        In the order of the way to a choice; empty for the asset that was chosen.
    changes : tuple of Change
        The smallest first of each kind; empty for the asset that was chosen.
    """

    asset: str
    database: str
    frame: int
    time_s: float | None
    rank: int
    cost: float
    winner: str | None
    winner_cost: float | None
    reasons: tuple[str, ...]
    changes: tuple[Change, ...]

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


Step = tuple[str, str, "str | float", ReaskedDecision]
"""A change: its kind, what, to what, and the decision with it."""


def why_not(asked: ReaskedDecision, asset: str) -> WhyNot:
    """Why an asset was not chosen, and what would have to change for it to be.

    Raises
    ------
    MotionError
        No database has the asset, with the nearest; or nothing was searched.
    """
    require_text(asset, "asset")
    if asked.choice is None:
        raise MotionError(Fault(f"nothing was searched at tick {asked.decision.tick:,}: what played, played on."))
    require_name(asset, "asset", dict.fromkeys(each for search in asked.searches.values() for each in search.database.assets))
    at, choice = _place(asked, asset), asked.choice
    winner_cost = choice.hit.cost if choice else None
    rate = None if at.search.database.schema is None else at.search.database.schema.rate
    time_s = None if rate is None else (at.frame - int(at.search.database.starts[at.range])) / rate
    has_won = bool(choice) and choice.hit.asset == asset
    reasons = () if has_won else tuple(_reasons(asked, at, choice))
    changes = () if has_won else tuple(_changes(asked, at))
    rank = 1 + sum(
        int(np.count_nonzero((each.costs < at.cost) & (each.left_out == LeftOut.NO)))
        for each in {**asked.searched, at.name: at.search}.values()
    )
    return WhyNot(asset, at.name, at.frame, time_s, rank, at.cost, choice.hit.asset, winner_cost, reasons, changes)


def _place(asked: ReaskedDecision, asset: str) -> Place:
    """The best frame of an asset, in whichever database and range."""
    found = [
        Place(search, i, frame)
        for search in asked.searches.values()
        for i, each in enumerate(search.database.assets)
        if each == asset and (frame := search.best_of_range(i)) >= 0
    ]
    if not found:
        raise MotionError(Fault(f'the asset "{asset}" has no frames.', "an asset with frames"))
    return min(found, key=lambda at: (at.left_out is not LeftOut.NO, at.cost))


# ---- reasons


def _reasons(asked: ReaskedDecision, at: Place, choice: Choice) -> Iterator[str]:
    if at.left_out is LeftOut.NOT_VALID:
        yield from _invalid(asked, at)
    inner = _reason_within(at)
    if inner in OF_MARKUP:
        yield f"markup: {inner.text}"
    elif inner is LeftOut.TAGS:
        yield "tags: its frames do not have the tags that were asked for"
    elif inner in OF_TIME:
        yield f"history: {inner.text}"
    elif inner is LeftOut.FORBIDDEN:
        yield "bias: an infinite one forbids it"
    if at.name not in asked.searched and choice.reason is Reason.UNDER_THRESHOLD:
        yield f"threshold: {choice.database} won outright, {at.name} was not searched"
    if choice and at.cost >= choice.hit.cost:
        yield f"cost: {cost_text(at.cost)}, {cost_text(at.cost - choice.hit.cost)} more than {choice.hit.asset}"


def _invalid(asked: ReaskedDecision, at: Place) -> Iterator[str]:
    rows = _rows(asked, at)
    if not rows:
        yield "valid: the asset was not among the valid ones"
    for row in rows[:1]:
        for failing in row.failures:
            yield f"table: row {row.row + 1} of {asked.stock.table_of[at.name]}: {failing}"
        if not row.is_enabled:
            yield f"table: row {row.row + 1} of {asked.stock.table_of[at.name]} is disabled"


def _reason_within(at: Place) -> LeftOut:
    """Why its best frame would be left out if the asset were valid."""
    if at.left_out is not LeftOut.NOT_VALID:
        return at.left_out
    free = at.search.with_filter(_let_in(at.search.chosen, at.range))
    return LeftOut(int(free.left_out[free.best_of_range(at.range)]))


def _rows(asked: ReaskedDecision, at: Place) -> list[Row]:
    """The asset's rows in its table that are not valid, the nearest first; none where there is no table, or no facts."""
    table, context = asked.stock.table(at.name), asked.decision.context
    if table is None or context is None:
        return []
    try:
        found = table.compile().explain(_facts(asked), unknown=UNKNOWN).asset(at.asset)
        own = [row for row in found if row.asset == at.asset and not row.is_valid]
        return sorted(own, key=lambda row: len(row.failures))
    except ContextDBError:
        return []


def _facts(asked: ReaskedDecision) -> dict[str, object]:
    return dict(asked.decision.context or {})


# ---- changes


def _changes(asked: ReaskedDecision, at: Place) -> Iterator[Change]:
    """The changes of each kind that make the asset win, or come nearest to it."""
    ways = list(_free(asked, at))
    for kind, what, to, free in ways:
        yield Change(kind, what, to, _wins(free, at.asset))
    if at.left_out is LeftOut.NO and at.name in asked.searched:
        ways = [("", "", "", asked)]
    for kind, what, to, free in ways[:1]:
        if _wins(free, at.asset):
            continue
        for more in _cheaper(free, _place(free, at.asset)):
            wins = _wins(more[3], at.asset)
            if kind:
                yield Change(kind + AND + more[0], what + AND + more[1], f"{to}{AND}{more[2]}", wins)
            else:
                yield Change(more[0], more[1], more[2], wins)


def _wins(asked: ReaskedDecision, asset: str) -> bool:
    return bool(asked.choice) and asked.choice is not None and asked.choice.hit.asset == asset


def _free(asked: ReaskedDecision, at: Place) -> Iterator[Step]:
    """What lets the asset be chosen: each step goes on from the one before, and the last, which does it all, is first."""
    kinds: list[str] = []
    whats: list[str] = []
    tos: list[str] = []
    now, found = asked, []
    for step in (_valid, _unmarked, *[_in_time] * len(OF_TIME), _in_turn):
        done = step(now, at)
        if done is None:
            continue
        kind, what, to, now = done
        kinds, whats, tos = [*kinds, kind], [*whats, what], [*tos, str(to)]
        found.append((AND.join(kinds), AND.join(whats), to if len(tos) == 1 else AND.join(tos), now))
    yield from reversed(found)


def _valid(asked: ReaskedDecision, at: Place) -> Step | None:
    """The cells that would have to accept the facts; or, without a table, the mask."""
    if at.left_out is not LeftOut.NOT_VALID:
        return None
    table, rows = asked.stock.table(at.name), _rows(asked, at)
    if table is not None and rows:
        edited = _edited(table, rows[0])
        if edited is not None:
            search = asked.searches[at.name]
            chosen = asked_of_table(search.database, search.chosen, edited.compile(), _facts(asked))
            if chosen.ranges[at.range]:
                failures = rows[0].failures
                name, row = asked.stock.table_of[at.name], rows[0].row + 1
                what = f"row {row} of {name}: {', '.join(failing.condition for failing in failures)}"
                kind = "cell" if len(failures) == 1 else "cells"
                return kind, what, ", ".join(failing.mend for failing in failures), _with(asked, at, chosen)
    return "mask", at.asset, "valid", _with(asked, at, _let_in(at.search.chosen, at.range))


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


def _let_in(chosen: Filter, at: int) -> Filter:
    ranges = chosen.ranges.copy()
    ranges[at] = True
    return chosen._replace(ranges=ranges, is_whole=bool(ranges.all()))


def _unmarked(asked: ReaskedDecision, at: Place) -> Step | None:
    """The best frame without what markup and tags say against it."""
    at = _place_in(asked, at)
    reason = at.left_out
    if reason not in OF_MARKUP and reason is not LeftOut.TAGS:
        return None
    kind = "tags" if reason is LeftOut.TAGS else "mark"
    what = f"{reason.text} on {at.asset}"
    return kind, what, "without", _with_search(asked, _unmarked_search(asked.searches[at.name], at.range))


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


def _in_time(asked: ReaskedDecision, at: Place) -> Step | None:
    """The best frame though it was played just now, or plays nearly."""
    at = _place_in(asked, at)
    setting = OF_TIME.get(at.left_out)
    if setting is None:
        return None
    chosen = asked.searches[at.name].chosen
    skips = tuple(skip for skip in chosen.skips if skip.why is not at.left_out)
    return "setting", setting, "0", _with(asked, at, chosen._replace(skips=skips))


def _in_turn(asked: ReaskedDecision, at: Place) -> Step | None:
    """The database searched though one before it won outright."""
    choice = asked.choice
    if choice is None or at.name in asked.searched or choice.database is None:
        return None
    lower = _rounded(choice.hit.cost, downwards=True)
    return "threshold", choice.database, lower, asked.with_threshold(choice.database, lower)


def _cheaper(asked: ReaskedDecision, at: Place) -> Iterator[Step]:
    """A bias, a threshold and a weight that bring an asset that may be chosen before the winner."""
    choice = asked.choice
    if choice is None or choice.database is None or at.left_out is not LeftOut.NO or at.name not in asked.searched:
        return
    behind = at.cost - choice.hit.cost
    added = -_rounded(behind + MARGIN * (abs(at.cost) + abs(choice.hit.cost)), downwards=False)
    chosen = asked.searches[at.name].chosen
    biases = chosen.range_biases.copy()
    biases[at.range] += added
    least = float(biases.min(initial=np.inf))
    yield "bias", at.asset, added, _with(asked, at, chosen._replace(range_biases=biases, least_of_ranges=least))
    if at.name != choice.database and _comes_before(asked, at.name, choice.database):
        to = _rounded(at.cost + MARGIN * abs(at.cost), downwards=False)
        yield "threshold", at.name, to, asked.with_threshold(at.name, to)
    yield from _weighed(asked, at, choice)


def _weighed(asked: ReaskedDecision, at: Place, choice: Choice) -> Iterator[Step]:
    """The one weight of least relative change with which the asset wins; without one, the one of least change at all."""
    winner = asked.searches[str(choice.database)]
    found: list[tuple[float, Step]] = []
    for i, channel in enumerate(at.search.database.channel_names):
        now = float(at.search.database.weights[i])
        weight = _weight_of_tie(channel, now, at, winner, choice.hit.frame)
        if weight is None:
            continue
        to = _rounded(weight, downwards=weight < now)
        size = abs(math.log((to + 1e-12) / (now + 1e-12)))
        found.append((size, ("weight", channel, to, asked.with_weights({channel: to}))))
    found.sort(key=lambda each: each[0])
    winning = [step for _, step in found if _wins(step[3], at.asset)]
    yield from (winning or [step for _, step in found])[:1]


def _weight_of_tie(channel: str, now: float, at: Place, winner: ReaskedSearch, frame: int) -> float | None:
    """The weight of a channel just beyond that at which a frame costs as much as the winner; None where there is none.

    Costs may depend on all weights, as where these are divided by their sum: the tie is found step by step. Where a cost is a sum
    of weights times differences, the first step is exact.
    """

    def behind(weight: float) -> float:
        changed = at.search.database.with_weights({channel: weight}).cost_weights
        own = float((changed * at.search.sums[:, at.frame]).sum() + at.search.biases[at.frame])
        others = winner.database.with_weights({channel: weight}).cost_weights
        return own - float((others * winner.sums[:, frame]).sum() + winner.biases[frame])

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


def _with(asked: ReaskedDecision, at: Place, chosen: Filter) -> ReaskedDecision:
    return _with_search(asked, asked.searches[at.name].with_filter(chosen))


def _with_search(asked: ReaskedDecision, search: ReaskedSearch) -> ReaskedDecision:
    searches: Mapping[str, ReaskedSearch] = {**asked.searches, search.name: search}
    return asked.with_searches(searches)


def _place_in(asked: ReaskedDecision, at: Place) -> Place:
    """The best frame of a range in a changed decision."""
    search = asked.searches[at.name]
    return Place(search, at.range, search.best_of_range(at.range))


def _comes_before(asked: ReaskedDecision, one: str, other: str) -> bool:
    names = [entry.name for entry in asked.entries]
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
