"""What the candidates of a search cost, in the views of EA's diagnostics: a summary, each channel of pose or path, biases, events.

Source: "Show Cost Details: All, Cost Summary, PoseFeatures, Trajectory, Bias, Events" in the window "Top Candidates" of EA's talk.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from enum import IntEnum, StrEnum
from typing import TYPE_CHECKING

import numpy as np

from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.search.candidates import Candidate, Candidates
from contextdb.motion.selection.decision import Decision
from contextdb.motion.trace.text_table import WIDTH, Column, table_lines

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

PATH = "trajectory "
"""How the names of the channels begin that compare the path; all others compare the pose."""

ROUNDING = 1e-7
"""Of float32 features: costs below are as good as 0."""

SMALLEST = 5e-7
"""The least cost that six digits behind the point show."""


class View(StrEnum):
    """Which costs of a candidate are displayed next to its total."""

    ALL = "all"
    SUMMARY = "summary"
    POSE = "pose"
    TRAJECTORY = "trajectory"
    BIAS = "bias"
    EVENTS = "events"


@dataclass(frozen=True, slots=True)
class Ranked:
    """A candidate with its rank among all, from 1, its database, and what it is to the decision: chosen, or what plays on."""

    rank: int
    database: str
    row: Candidate
    role: str = ""


def named(rows: Sequence[Ranked], name: str) -> list[Ranked]:
    """The candidates whose asset's name holds a text, in any case; their ranks stay."""
    return [each for each in rows if name.casefold() in each.row.asset.casefold()]


def candidate_lines(
    rows: Sequence[Ranked],
    view: View = View.SUMMARY,
    events: Mapping[tuple[str, int], Sequence[str]] | None = None,
    width: int = WIDTH,
) -> Iterator[str]:
    """Candidates as a table; `events` is what the markup says of frames, by (database, frame), for the view of events."""
    yield from table_lines([*_base_columns(rows), *_cost_columns(rows, view), *_event_columns(rows, view, events or {})], width)


def _base_columns(rows: Sequence[Ranked]) -> Iterator[Column]:
    yield Column("rank", [str(each.rank) for each in rows], is_number=True, is_key=True)
    yield Column("", [each.role for each in rows])
    if len({each.database for each in rows}) > 1:
        yield Column("database", [each.database for each in rows])
    yield Column("asset", [each.row.asset for each in rows], is_key=True)
    yield Column("time s", [seconds(each.row.time_s) for each in rows], is_number=True)
    yield Column("frame", [f"{each.row.frame:,}" for each in rows], is_number=True)
    yield Column("mirrored", ["yes" if each.row.mirrored else "" for each in rows])
    yield Column("permutation s", [seconds(each.row.permutation_s) for each in rows], is_number=True)
    yield Column("left out", [LeftOut(each.row.left_out).text for each in rows])
    yield Column("cost", [cost_text(each.row.cost) for each in rows], is_number=True)


def _cost_columns(rows: Sequence[Ranked], view: View) -> Iterator[Column]:
    if view is View.SUMMARY:
        parts = [summary_of(each.row) for each in rows]
        for name in ("pose", "trajectory", "bias"):
            yield Column(name, [cost_text(part[name]) for part in parts], is_number=True)
    channels, biases = _names(each.row.channels for each in rows), _names(each.row.biases for each in rows)
    if view in (View.ALL, View.POSE):
        yield from _by_channel(rows, [name for name in channels if not name.startswith(PATH)])
    if view in (View.ALL, View.TRAJECTORY):
        yield from _by_channel(rows, [name for name in channels if name.startswith(PATH)])
    if view in (View.ALL, View.BIAS):
        for name in biases:
            yield Column(name, [cost_text(each.row.biases.get(name)) for each in rows], is_number=True)


def _by_channel(rows: Sequence[Ranked], names: Collection[str]) -> Iterator[Column]:
    for name in names:
        yield Column(name, [cost_text(each.row.channels.get(name)) for each in rows], is_number=True)


def _event_columns(rows: Sequence[Ranked], view: View, events: Mapping[tuple[str, int], Sequence[str]]) -> Iterator[Column]:
    if view in (View.ALL, View.EVENTS):
        yield Column("events", [", ".join(events.get((each.database, each.row.frame), ())) for each in rows])


def summary_of(row: Candidate) -> dict[str, float]:
    """What the channels of the pose, those of the path, and the biases add to a cost."""
    path = math.fsum(cost for name, cost in row.channels.items() if name.startswith(PATH))
    pose = math.fsum(cost for name, cost in row.channels.items() if not name.startswith(PATH))
    return {"pose": pose, "trajectory": path, "bias": math.fsum(row.biases.values())}


def _names(parts: Iterator[Mapping[str, float]] | Collection[Mapping[str, float]]) -> list[str]:
    """Every name, once, in the order in which they are met."""
    return list(dict.fromkeys(name for part in parts for name in part))


def cost_text(cost: float | None) -> str:
    """A cost for people: four digits, at most six behind the point; one digit where these would say 0."""
    if cost is None:
        return ""
    if cost == 0.0 or not abs(cost) < 1e9:
        return f"{cost:.4g}"
    if abs(cost) < SMALLEST:
        return f"{cost:.1g}" if abs(cost) > ROUNDING else "0.000"
    exponent = int(f"{cost:.3e}".partition("e")[2])  # of the cost in four digits: 0.99996 is 1.000
    return f"{cost:,.{min(max(3 - exponent, 0), 6)}f}"


def seconds(time_s: float | None) -> str:
    """A time with two decimals; empty for None."""
    return "" if time_s is None else f"{time_s:.2f}"


# ---- decisions and candidates as JSON has them: dicts, lists, texts and finite numbers. What is infinite or missing is null


LEFT = ("candidates", "filters", "inputs")
Json = dict[str, object]
Events = Mapping[tuple[str, int], Sequence[str]]


def decision_json(decision: Decision, events: Events | None = None) -> Json:
    """A decision; its candidates are a list of databases, each with its `rows` and how many frames were `left_out`."""
    document = {field.name: as_plain(getattr(decision, field.name)) for field in fields(decision) if field.name not in LEFT}
    for name in ("together", "play"):
        if document[name] is None:
            del document[name]
    document["candidates"] = [candidates_json(name, candidates, events) for name, candidates in decision.candidates]
    return document


def candidates_json(database: str, candidates: Candidates, events: Events | None = None) -> Json:
    rows = [_candidate_json(rank, row, (events or {}).get((database, row.frame), ())) for rank, row in enumerate(candidates, 1)]
    return {"database": database, "left_out": {reason.text: count for reason, count in candidates.counts.items()}, "rows": rows}


def ranked_json(rows: Sequence[Ranked], events: Events | None = None) -> list[Json]:
    """Frames with their ranks and databases."""
    known_events = events or {}
    return [
        {"database": each.database, **_candidate_json(each.rank, each.row, known_events.get((each.database, each.row.frame), ()))}
        for each in rows
    ]


def _candidate_json(rank: int, row: Candidate, events: Sequence[str]) -> Json:
    return {"rank": rank, **_by_field(row), "events": list(events)}


def as_plain(value: object) -> object:
    """A value as JSON has it; a dataclass by its fields, a reason by its words."""
    if isinstance(value, (np.generic, np.ndarray)):
        value = value.tolist()
    if isinstance(value, LeftOut):
        return value.text
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, (bool, int)):
        return int(value) if isinstance(value, IntEnum) else value
    if isinstance(value, Mapping):
        return {str(key): as_plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [as_plain(each) for each in value]
    if isinstance(value, (set, frozenset)):
        return sorted(map(str, value))
    if is_dataclass(value) and not isinstance(value, type):
        return _by_field(value)
    return str(value)


def _by_field(value: DataclassInstance) -> Json:
    """The fields of a dataclass; `permutation_s` only where there are permutations."""
    document = {field.name: as_plain(getattr(value, field.name)) for field in fields(value)}
    return {name: plain for name, plain in document.items() if plain is not None or name != "permutation_s"}
