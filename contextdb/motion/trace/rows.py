"""Decisions as rows of a table with nested columns, and back.

One row a decision. What a decision may lack is null. Times of searching are in a column of their own, `search_us`, which a file
may leave out: all other columns are the same whenever the same session is recorded.

A context becomes JSON: tags a sorted list, a NaN fact null, and what JSON has no word for its text. What else an update was given
is JSON too.

Candidates are worked out again from the query, the filters and the databases. The column `candidates` holds those of code of your
own, which cannot; of their frames `Candidates.why` comes back empty, its sums are in `counts`. `body_x`, `body_z` and
`body_heading` are where the game had the body, or null.

The file's metadata: `contextdb.trace`, the number of the format; `about`, JSON with the rate, features, channels and ranges of each
database and digests of what its costs come from; `candidates`, how many a decision shows; `digest`, of the columns.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from contextdb.cells.row_play import RowPlay
from contextdb.motion.clips.ground_place import GroundPlace
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.markup.tag_filter import TagFilter
from contextdb.motion.search.candidates import Candidate, Candidates
from contextdb.motion.search.hit import NOTHING, Hit
from contextdb.motion.selection.choice import Choice, Reason, Search, Status
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.decision import Action, Decision, Playing, Together
from contextdb.motion.selection.events import checked
from contextdb.motion.selection.inputs import Inputs
from contextdb.motion.selection.root_motion import RootMotion
from contextdb.motion.selection.variation import Variation
from contextdb.motion.selection.worked_out import WorkedOut
from contextdb.motion.trace.filter_rows import filter_of, filter_row, filter_type

if TYPE_CHECKING:
    from polars import DataType as PolarsType

Row = dict[str, Any]
EventsOf = Callable[[str, int], tuple[str, ...]]
"""What the markup says of a frame of a database."""
Events = dict[tuple[str, int], tuple[str, ...]]

TIMINGS, FILTERS, INPUTS, HELD, PLAY_RATE = "search_us", "filters", "inputs", "held", "play_rate"
TOGETHER, PLAY = "together", "play"
LATER = (TIMINGS, PLAY)
"""Columns that a session may lack."""
PERMUTATION_S = "permutation_s"
"""Of a database with permutations: how far ahead each looks."""
PLAYING = ("database", "asset", "range", "frame", "time_s", "mirrored")
BODY = ("body_x", "body_z", "body_heading")


def columns() -> dict[str, PolarsType]:
    """The polars type of each column of a session."""
    import polars as pl

    text, whole, number, flag = pl.String(), pl.Int64(), pl.Float64(), pl.Boolean()
    where: dict[str, PolarsType] = {
        "database": text,
        "asset": text,
        "range": whole,
        "frame": whole,
        "time_s": number,
        "mirrored": flag,
    }
    playing = pl.Struct({**where, "events": pl.List(text)})
    hit = pl.Struct({"asset": text, "range": whole, "frame": whole, "cost": number})
    search = pl.Struct({"database": text, "threshold": number, "hit": hit, "status": text})
    costs = pl.List(pl.Struct({"name": text, "cost": number}))
    candidate: dict[str, PolarsType] = {
        "asset": text,
        "range": whole,
        "frame": whole,
        "time_s": number,
        "mirrored": flag,
        "cost": number,
        "channels": pl.List(number),
        "biases": costs,
        "left_out": text,
        "events": pl.List(text),
    }
    counts = pl.List(pl.Struct({"left_out": text, "frames": whole}))
    fields = {"database": text, "channels": pl.List(text), "counts": counts, "rows": pl.List(pl.Struct(candidate))}
    return {
        "tick": whole,
        "time_s": number,
        "action": text,
        "why": text,
        "searched": flag,
        "playing": playing,
        "before": playing,
        "cost": number,
        "continuing_cost": number,
        "choice": pl.Struct({"hit": hit, "database": text, "reason": text, "searches": pl.List(search)}),
        "context": text,
        "query": pl.List(number),
        "candidates": pl.List(pl.Struct(fields)),
        "root_motion": pl.Struct({"left_m": number, "ahead_m": number, "turn_rad": number}),
        "root_weight": number,
        **dict.fromkeys(BODY, number),
        HELD: text,
        PLAY_RATE: number,
        FILTERS: filter_type(),
        INPUTS: text,
        TOGETHER: text,
        PLAY: text,
        TIMINGS: number,
    }


# ---- a decision as a row


def row_of(decision: Decision, events_of: EventsOf) -> Row:
    """A decision as a row; `events_of` says what the markup says of a frame."""
    move = decision.root_motion
    return {
        "tick": int(decision.tick),
        "time_s": float(decision.time_s),
        "action": str(decision.action),
        "why": _text(decision.why),
        "searched": bool(decision.searched),
        "playing": _playing_row(decision.playing, events_of),
        "before": _playing_row(decision.before, events_of),
        "cost": _number(decision.cost),
        "continuing_cost": _number(decision.continuing_cost),
        "choice": None if decision.choice is None else _choice_row(decision.choice),
        "context": None if decision.context is None else context_json(decision.context),
        "query": None if decision.query is None else np.asarray(decision.query, np.float64).tolist(),
        "candidates": _candidates_rows(decision, events_of),
        "root_motion": {"left_m": float(move.left_m), "ahead_m": float(move.ahead_m), "turn_rad": float(move.turn_rad)},
        "root_weight": float(decision.root_weight),
        **dict(zip(BODY, (None, None, None) if decision.body is None else map(float, decision.body), strict=True)),
        HELD: str(decision.held),
        PLAY_RATE: float(decision.play_rate),
        FILTERS: [filter_row(_text(name), chosen) for name, chosen in decision.filters],
        INPUTS: None if decision.inputs is None else inputs_json(decision.inputs),
        TOGETHER: None if decision.together is None else json.dumps(asdict(decision.together)),
        PLAY: None if decision.play is None else json.dumps(asdict(decision.play)),
        TIMINGS: _number(decision.search_us),
    }


def _candidates_rows(decision: Decision, events_of: EventsOf) -> list[Row]:
    """Candidates that cannot be worked out again, as code of your own has them."""
    if isinstance(decision.candidates, WorkedOut):
        return []
    return [_candidates_row(name, candidates, events_of) for name, candidates in decision.candidates]


def context_json(context: Mapping[str, object]) -> str:
    """A context as JSON; the same facts give the same text, whatever their order."""
    return json.dumps({str(name): _plain(value) for name, value in context.items()}, sort_keys=True)


def _plain(value: object) -> object:
    """A fact as JSON has it."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None if math.isnan(value) else str(value)
    if isinstance(value, (set, frozenset)):
        return sorted(map(str, value))
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_plain(each) for each in value]
    return {str(k): _plain(v) for k, v in value.items()} if isinstance(value, Mapping) else str(value)


def _text(text: str) -> str:
    """Text that UTF-8 can hold: half a surrogate pair, as a file's name may have it, becomes its escape."""
    return str(text) if text.isascii() else text.encode("utf-8", "backslashreplace").decode()


def _number(value: float | None) -> float | None:
    return None if value is None else float(value)


def _playing_row(playing: Playing | None, events_of: EventsOf) -> Row | None:
    if playing is None:
        return None
    return {
        "database": _text(playing.database),
        "asset": _text(playing.asset),
        "range": int(playing.range),
        "frame": int(playing.frame),
        "time_s": float(playing.time_s),
        "mirrored": bool(playing.mirrored),
        "events": list(events_of(playing.database, playing.frame)),
    }


def _choice_row(choice: Choice) -> Row:
    searches = [
        {
            "database": _text(search.database),
            "threshold": _number(search.threshold),
            "hit": None if search.hit is None else _hit_row(search.hit),
            "status": str(search.status),
        }
        for search in choice.searches
    ]
    database = None if choice.database is None else _text(choice.database)
    return {"hit": _hit_row(choice.hit), "database": database, "reason": str(choice.reason), "searches": searches}


def _hit_row(hit: Hit) -> Row:
    asset = None if hit.asset is None else _text(hit.asset)
    return {"asset": asset, "range": int(hit.range), "frame": int(hit.frame), "cost": float(hit.cost)}


def _candidates_row(name: str, candidates: Candidates, events_of: EventsOf) -> Row:
    channels = list(candidates.rows[0].channels) if candidates.rows else []
    return {
        "database": _text(name),
        "channels": list(map(_text, channels)),
        "counts": [{"left_out": reason.name, "frames": int(count)} for reason, count in candidates.counts.items()],
        "rows": [_candidate_row(row, list(events_of(name, row.frame))) for row in candidates.rows],
    }


def _candidate_row(row: Candidate, events: list[str]) -> Row:
    return {
        "asset": _text(row.asset),
        "range": int(row.range),
        "frame": int(row.frame),
        "time_s": _number(row.time_s),
        "mirrored": bool(row.mirrored),
        "cost": float(row.cost),
        "channels": list(map(float, row.channels.values())),
        "biases": [{"name": _text(bias), "cost": float(added)} for bias, added in row.biases.items()],
        "left_out": row.left_out.name,
        "events": events,
    }


# ---- a row as a decision


def decision_of(row: Row) -> Decision:
    """The decision that a row was made of. Raises ValueError, TypeError or KeyError where the row was made of none."""
    return Decision(
        tick=int(row["tick"]),
        time_s=float(row["time_s"]),
        action=Action(row["action"]),
        why=_known(row["why"]),
        searched=_known(row["searched"]),
        playing=_playing(row["playing"]),
        before=_playing(row["before"]),
        cost=row["cost"],
        continuing_cost=row["continuing_cost"],
        choice=None if row["choice"] is None else _choice(row["choice"]),
        context=None if row["context"] is None else dict(json.loads(row["context"])),
        query=None if row["query"] is None else np.array(row["query"], np.float64),
        candidates=tuple((_known(each["database"]), _candidates(each)) for each in row["candidates"]),
        search_us=row.get(TIMINGS),
        root_motion=RootMotion(*(float(row["root_motion"][key]) for key in ("left_m", "ahead_m", "turn_rad"))),
        root_weight=float(row["root_weight"]),
        body=_body(row),
        held=row[HELD],
        play_rate=float(row[PLAY_RATE]),
        filters=tuple((_known(each["database"]), filter_of(each)) for each in row[FILTERS]),
        inputs=None if row[INPUTS] is None else inputs_of(row[INPUTS]),
        play=None if row.get(PLAY) is None else RowPlay(**json.loads(row[PLAY])),
        together=None if row[TOGETHER] is None else Together(**json.loads(row[TOGETHER])),
    )


def events_in(row: Row) -> Events:
    """What the markup says of each frame that a row mentions, as far as it says anything."""
    return {(database, frame): tuple(events) for database, frame, events in _events_of_frames(row) if events}


def _events_of_frames(row: Row) -> Iterator[tuple[str, int, list[str]]]:
    for each in (row["playing"], row["before"]):
        if each is not None:
            yield each["database"], each["frame"], each["events"]
    for candidates in row["candidates"]:
        yield from ((candidates["database"], each["frame"], each["events"]) for each in candidates["rows"])


def _body(row: Row) -> GroundPlace | None:
    x, z, heading = (row[name] for name in BODY)
    return None if x is None or z is None or heading is None else (float(x), float(z), float(heading))


def _known(value: Any) -> Any:
    if value is None:
        raise ValueError("a null where a value is needed")
    return value


def _playing(row: Row | None) -> Playing | None:
    return None if row is None else Playing(**{key: _known(row[key]) for key in PLAYING})


def _choice(row: Row) -> Choice:
    return Choice(_hit(row["hit"]), row["database"], Reason(row["reason"]), tuple(map(_search, row["searches"])))


def _search(row: Row) -> Search:
    hit = None if row["hit"] is None else _hit(row["hit"])
    return Search(_known(row["database"]), row["threshold"], hit, Status(row["status"]))


def _hit(row: Row) -> Hit:
    hit = Hit(row["asset"], int(row["range"]), int(row["frame"]), float(row["cost"]))
    return hit if hit else NOTHING


def _candidates(row: Row) -> Candidates:
    counts = {LeftOut[each["left_out"]]: int(each["frames"]) for each in row["counts"]}
    return Candidates(tuple(_candidate(each, row["channels"]) for each in row["rows"]), counts, np.empty(0, np.uint8))


def _candidate(row: Row, channels: list[str]) -> Candidate:
    return Candidate(
        asset=_known(row["asset"]),
        range=int(row["range"]),
        frame=int(row["frame"]),
        time_s=row["time_s"],
        mirrored=_known(row["mirrored"]),
        cost=float(row["cost"]),
        channels=dict(zip(channels, row["channels"], strict=True)),
        biases={_known(each["name"]): float(each["cost"]) for each in row["biases"]},
        left_out=LeftOut[row["left_out"]],
    )


# ---- what an update was given next to query, context and valid assets, as JSON; settings by their names, so that versions differ


Json = dict[str, Any]
TAGS = ("include", "every", "exclude", "prefer", "avoid")


def inputs_json(inputs: Inputs) -> str:
    """Inputs as JSON; the same inputs give the same text."""
    tags = inputs.tags
    of_each = {name: _tags_row(each) for name, each in tags.items()} if isinstance(tags, Mapping) else None
    document = {
        "dt_s": float(inputs.dt_s),
        "force": bool(inputs.force),
        "interrupt": bool(inputs.interrupt),
        "among": None if inputs.among is None else list(inputs.among),
        "tags": _tags_row(tags) if isinstance(tags, TagFilter) else None,
        "tags_of": of_each,
        **({} if inputs.event is None else {"event": list(inputs.event)}),
    }
    return f'{json.dumps(document)[:-1]}, "settings": {_settings_json(inputs.settings)}}}'


@lru_cache(64)
def inputs_of(text: str) -> Inputs:
    """The inputs that a text was made of; those of one text are one. Raises ValueError, TypeError, KeyError or AttributeError where
    the text was made of none."""
    row = json.loads(text)
    tags = None if row["tags"] is None else _tags(row["tags"])
    of_each = None if row["tags_of"] is None else {name: _tags(each) for name, each in row["tags_of"].items()}
    among = None if row["among"] is None else tuple(row["among"])
    settings = _settings(json.dumps(row["settings"]))
    event = None if row.get("event") is None else checked(tuple(row["event"]))
    return Inputs(float(row["dt_s"]), bool(row["force"]), bool(row["interrupt"]), among, tags or of_each, settings, event)


def _tags_row(tags: TagFilter) -> Json:
    return {name: list(map(list, given) if name in TAGS[3:] else given) for name in TAGS if (given := getattr(tags, name))}


def _tags(row: Json) -> TagFilter:
    return TagFilter(*(row.get(name, ()) for name in TAGS[:3]), *(dict(row.get(name, ())) for name in TAGS[3:]))


@lru_cache(16)
def _settings_json(settings: ControllerSettings) -> str:
    return json.dumps(asdict(settings))


@lru_cache(16)
def _settings(text: str) -> ControllerSettings:
    row = json.loads(text)
    varied = row.pop("variation", None)
    known = {each.name for each in fields(ControllerSettings)}
    given = {name: value for name, value in row.items() if name in known}
    return ControllerSettings(variation=None if varied is None else Variation(**varied), **given)
