"""Decisions and candidates as JSON has them: dicts, lists, texts and finite numbers. What is infinite or missing is null."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np

from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.search.candidates import Candidate, Candidates
from contextdb.motion.selection.decision import Decision
from contextdb.motion.trace.cost_views import Ranked

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

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
