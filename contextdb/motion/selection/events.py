"""An event that is to happen at a moment, such as the left foot's touch-down in 0.4 s: which frames lead to it, and how far it is.

An event is where the markup has a tag begin, a plain one or `Contact.Left` and `Contact.Right`, after the first frame of a clip. A
frame leads to it when playing on comes there without a frame that is excluded; a looping range goes on at its start. It leads there
in time when a play rate within its limits does, to half a frame.

N frames. Source: the event searches of Unreal's PoseSearch (a tag, the time to it, and a range of play rates).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np

from contextdb.cells.arguments import as_number
from contextdb.errors import Fault, QueryError, no_such, some
from contextdb.motion.arguments import Flags
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.markup.left_out import LeftOut, Skip
from contextdb.motion.markup.marks import Marks
from contextdb.motion.markup.reserved import CONTACTS, reserved_of
from contextdb.motion.search.database import MotionDatabase

Event: TypeAlias = tuple[str, float]
"""The tag that begins, and in how many seconds of the game it shall."""


def checked(event: object) -> Event:
    """What is given as an event. Raises QueryError for what is none."""
    name, seconds = event if isinstance(event, tuple) and len(event) == 2 else (None, None)
    number = as_number(seconds)
    if not isinstance(name, str) or number is None or not number >= 0.0:
        raise QueryError(
            Fault(f"the event is {event!r}.", 'a tag and the seconds until it begins, 0 or more, such as ("Hit", 0.4)')
        )
    return name, number


def seconds_to(database: MotionDatabase, name: str, rate: float) -> Floats:
    """How far it is from each frame to the next event of a name, in seconds of its clip: float64 [N], NaN where playing on does not
    come there. Raises QueryError for a tag that the markup does not have, with the nearest."""
    marks, n = database.marks, database.n_frames
    begins, numbers = _begins(database, marks, name), np.arange(n)
    following = _next(np.where(begins, numbers, n))
    excluded = _next(np.where(marks.playable()[marks.kinds], n, numbers))
    seconds = np.full(n, np.nan)
    for start, stop, loops in zip(database.starts.tolist(), database.stops.tolist(), marks.looping.tolist(), strict=True):
        frames = numbers[start:stop]
        own, free = following[start:stop], excluded[start:stop]
        away = np.where((own < stop) & (own < free), own - frames, np.nan)
        if loops and stop - start > 1 and own[0] < min(stop, free[0]):
            away = np.where((own >= stop) & (free >= stop), stop - 1 - frames + own[0] - start, away)
        seconds[start:stop] = away / rate
    return seconds


def leads(seconds: Floats, in_s: float, rates: tuple[Floats, Floats], rate: float) -> Flags:
    """Which frames lead to their event in so many seconds: bool [N]; `rates` are the least and most play rate of each frame."""
    half = 0.5 / rate
    with np.errstate(invalid="ignore"):
        return np.asarray((seconds >= rates[0] * in_s - half) & (seconds <= rates[1] * in_s + half))


def astray(leading: Flags) -> Iterator[Skip]:
    """The spans of frames that do not lead there, [N] of the frames of a database."""
    edges = np.flatnonzero(np.diff(np.concatenate(([True], leading, [True]))))
    for start, stop in edges.reshape(-1, 2).tolist():
        yield Skip(start, stop, LeftOut.EVENT)


def events_of(database: MotionDatabase) -> dict[str, Ints]:
    """The frames at which each event of a database begins, by its name: plain tags, those above them, and contacts."""
    above = [".".join(tag.split(".")[:n]) for tag in database.marks.tags for n in range(1, tag.count(".") + 2)]
    names = dict.fromkeys((*above, *CONTACTS))
    return {name: np.flatnonzero(_begins(database, database.marks, name)).astype(np.int64) for name in names}


def _begins(database: MotionDatabase, marks: Marks, name: str) -> Flags:
    reserved = reserved_of(name)
    if reserved is None:
        begins = marks.begin(name)
        begins[database.starts[database.starts < len(begins)]] = False
        return begins
    if reserved not in CONTACTS:
        raise QueryError(no_such("event", name, (*marks.tags, *CONTACTS), some((*marks.tags, *CONTACTS))))
    foot, of_frame = CONTACTS.index(reserved), database.layout.frame_ranges
    mirrored = np.append(database.mirrored, False)[of_frame]
    return np.asarray(marks.touches >> np.where(mirrored, 1 - foot, foot) & 1 != 0)


def _next(numbers: Floats) -> Floats:
    """The least of each number and those behind it."""
    return np.asarray(np.minimum.accumulate(numbers[::-1])[::-1])
