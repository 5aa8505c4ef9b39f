"""A session as a Chrome trace, which Perfetto and other viewers of traces open: slices of what plays, counters, instants of jumps.

Source: the Trace Event Format; `ph` X is a slice, C a counter, i an instant, M a name. Times are whole microseconds of play.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby

from contextdb.motion.selection.decision import Action, Decision
from contextdb.motion.trace.cost_views import as_plain

PLAYS, SEARCHES = 1, 2
"""The tracks: what plays, and the searches."""

Event = dict[str, object]


def chrome_trace(decisions: Iterable[Decision]) -> dict[str, object]:
    """The session as a document of the Trace Event Format, which trace viewers read."""
    recorded = list(decisions)
    events = [*_names(), *_slices(recorded), *(event for each in recorded for event in _events(each))]
    return {"format": 1, "displayTimeUnit": "ms", "traceEvents": events}


def _names() -> Iterator[Event]:
    yield {"ph": "M", "name": "process_name", "pid": 1, "tid": PLAYS, "args": {"name": "character"}}
    for track, name in ((PLAYS, "plays"), (SEARCHES, "searches")):
        yield {"ph": "M", "name": "thread_name", "pid": 1, "tid": track, "args": {"name": name}}


def _slices(decisions: Sequence[Decision]) -> Iterator[Event]:
    """One slice from each start, jump or loop until what plays changes."""
    numbers: list[int] = []
    for each in decisions:
        last = numbers[-1] if numbers else 0
        numbers.append(last + (each.action in (Action.START, Action.JUMP, Action.LOOP) or each.playing is None))
    groups = [[each for _, each in group] for _, group in groupby(zip(numbers, decisions, strict=True), lambda pair: pair[0])]
    ends_s = [group[0].time_s for group in groups[1:]] + ([decisions[-1].time_s] if decisions else [])
    for group, end_s in zip(groups, ends_s, strict=True):
        first = group[0]
        if first.playing is not None:
            start, stop = _us(first.time_s), _us(end_s)
            args = {"tick": first.tick, "why": first.why, **_plain(as_plain(first.playing))}
            yield {
                "ph": "X",
                "name": first.playing.asset,
                "cat": "plays",
                "ts": start,
                "dur": stop - start,
                **_on(PLAYS),
                "args": args,
            }


def _events(decision: Decision) -> Iterator[Event]:
    at = {"ts": _us(decision.time_s)}
    costs = {"cost": decision.cost, "playing on": decision.continuing_cost}
    finite = {name: cost for name, cost in costs.items() if cost is not None and math.isfinite(cost)}
    if finite:
        yield {"ph": "C", "name": "cost", **at, "pid": 1, "args": finite}
    if decision.searched and decision.search_us is not None:
        dur = max(1, round(decision.search_us))
        yield {"ph": "X", "name": "search", "cat": "search", **at, "dur": dur, **_on(SEARCHES), "args": {"why": decision.why}}
    if decision.action in (Action.START, Action.JUMP):
        name = "forced jump" if decision.is_forced else "jump" if decision.action is Action.JUMP else "start"
        yield {
            "ph": "i",
            "name": name,
            "cat": "jump",
            **at,
            "s": "t",
            **_on(PLAYS),
            "args": {"tick": decision.tick, "why": decision.why},
        }


def _on(track: int) -> Event:
    return {"pid": 1, "tid": track}


def _plain(value: object) -> Event:
    return dict(value) if isinstance(value, dict) else {}


def _us(time_s: float) -> int:
    return round(time_s * 1e6)
