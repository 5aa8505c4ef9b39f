"""Moments of a game as the test row takes them: what a character queried of a table, and what the game made of it.

A track is what one character queried of one table, in order; moments count on, also where the first of them are forgotten. A live
track keeps the last minute; that of a recording leaves its moments in the file. An edge: recordings are read here.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Lock
from typing import Protocol

from contextdb.cells.conditions import Condition
from contextdb.errors import Fault, FileError, Place, TableError
from contextdb.telemetry.link import lines
from contextdb.telemetry.link.hearing import require_header
from contextdb.telemetry.link.lines import Line, given_facts, read_line
from contextdb.telemetry.recordings import fact_text

KEPT_S = 60.0
"""So much of what a running game queried is stored."""
MOST_KEPT, MOST_BYTES = 4096, 1 << 24
"""At most so many moments of a character are stored, and so many bytes of their lines."""

Actors = Mapping[str, Sequence[Mapping[str, object]]]
Key = tuple[str | None, str]
"""Who asks, and which table."""


@dataclass(frozen=True, slots=True)
class Moment:
    """A question of a game, and its answer."""

    t: float
    """Seconds since the game opened its link."""
    facts: Mapping[str, object]
    """As they were sent."""
    rows: int
    """The rows that were valid in the game, as bits."""
    n_valid: int
    pick: tuple[object, str | None] | None = None
    """The row that the game picked, and its asset; None where it has not picked."""
    actors: Actors | None = None

    @classmethod
    def of(cls, line: Line) -> Moment:
        """The moment that a line tells of."""
        actors = line.get("actors")
        return cls(line["t"], line["facts"], int(line["rows"], 16), line["valid"], pick_of(line), _actors(actors))

    def texts(self, conditions: Mapping[str, Condition]) -> dict[str, str]:
        """The facts as the test row takes them, those of some conditions; a fact that is none is left out."""
        texts = {}
        for name, condition in conditions.items():
            try:
                texts[name] = text_of(self.facts.get(name), condition)
            except ValueError:
                continue
        return {name: text for name, text in texts.items() if text}


def text_of(sent: object, condition: Condition) -> str:
    """A fact that was sent as it is typed; ValueError for what is none."""
    return fact_text(sent, condition) if isinstance(sent, str) else lines.fact_text(sent) or ""


def pick_of(line: Line) -> tuple[object, str | None] | None:
    """What a line says was picked."""
    pick = line.get("pick")
    return (pick.get("row"), pick.get("asset")) if isinstance(pick, dict) else None


def _actors(sent: object) -> Actors | None:
    """The actors that a question was queried with; None without, and for what is none."""
    if not isinstance(sent, dict):
        return None
    try:
        return {str(role): [given_facts(actor) for actor in team] for role, team in sent.items()}
    except (ValueError, TypeError, AttributeError):
        return None


class Track(Protocol):
    """What one character queried of one table: the moments `first` up to `stop`."""

    @property
    def first(self) -> int:
        """The number of the first moment that is stored."""
        ...

    @property
    def stop(self) -> int:
        """The number after that of the last."""
        ...

    def moment(self, at: int) -> Moment | None:
        """A moment; None for one that is not stored."""
        ...

    def time(self, at: int) -> float:
        """When a moment was; that of the nearest one that is stored."""
        ...

    @property
    def moments(self) -> list[Moment]: ...


class LiveTrack:
    """The last minute of a character. One thread adds moments, others read them."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._moments: deque[tuple[Moment, int]] = deque()
        """Moments, each with the bytes of its line."""
        self._n_bytes = 0
        self._stop = 0

    @property
    def first(self) -> int:
        """The number of the first moment that is stored."""
        with self._lock:
            return self._stop - len(self._moments)

    @property
    def stop(self) -> int:
        """The number after that of the last."""
        return self._stop

    def moment(self, at: int) -> Moment | None:
        """A moment; None for one that is not stored."""
        with self._lock:
            place = at - (self._stop - len(self._moments))
            return self._moments[place][0] if 0 <= place < len(self._moments) else None

    def time(self, at: int) -> float:
        """When a moment was; that of the nearest one that is stored."""
        with self._lock:
            if not self._moments:
                return 0.0
            place = at - (self._stop - len(self._moments))
            return self._moments[max(0, min(place, len(self._moments) - 1))][0].t

    @property
    def moments(self) -> list[Moment]:
        with self._lock:
            return [moment for moment, _ in self._moments]

    def add(self, moment: Moment, n_bytes: int) -> None:
        """Add a moment, and forget those that are older than a minute."""
        with self._lock:
            self._moments.append((moment, n_bytes))
            self._n_bytes += n_bytes
            self._stop += 1
            while len(self._moments) > 1 and (
                self._moments[0][0].t < moment.t - KEPT_S or len(self._moments) > MOST_KEPT or self._n_bytes > MOST_BYTES
            ):
                self._n_bytes -= self._moments.popleft()[1]

    def picked(self, pick: tuple[object, str | None] | None) -> None:
        """What the game picked from the last answer."""
        with self._lock:
            if self._moments:
                moment, n_bytes = self._moments[-1]
                self._moments[-1] = replace(moment, pick=pick), n_bytes


class RecordedTrack:
    """What a recording has of one character and one table."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.first = 0
        self._places: list[tuple[int, int]] = []
        """Where the line of each moment begins, and how long it is."""
        self._times: list[float] = []
        self._picks: dict[int, tuple[object, str | None] | None] = {}

    @property
    def stop(self) -> int:
        """How many moments there are."""
        return len(self._places)

    def add(self, line: Line, place: tuple[int, int]) -> None:
        """Add the moment of a line, or what was picked in the last one."""
        if line["line"] == lines.PICK:
            self._picks[self.stop - 1] = pick_of(line)
        else:
            self._places.append(place)
            self._times.append(line["t"])

    def moment(self, at: int) -> Moment | None:
        """A moment; None where the file has been changed or taken away."""
        if not 0 <= at < self.stop:
            return None
        start, n_bytes = self._places[at]
        try:
            with self.path.open("rb") as file:
                file.seek(start)
                line = read_line(file.read(n_bytes))
            moment = Moment.of(line)
        except (OSError, ValueError, KeyError):
            return None
        return replace(moment, pick=self._picks[at]) if at in self._picks else moment

    @property
    def moments(self) -> list[Moment]:
        """All moments, as long as the file is there."""
        return [moment for at in range(self.stop) if (moment := self.moment(at)) is not None]

    def time(self, at: int) -> float:
        return self._times[max(0, min(at, self.stop - 1))] if self._times else 0.0


@dataclass(frozen=True)
class Session:
    """A recording that was opened."""

    path: Path
    tables: Mapping[str, Mapping[str, object]]
    """What it says of each table."""
    tracks: Mapping[Key, RecordedTrack]


def open_session(path: Path) -> Session:
    """Find the moments of a recording. A last line that is not whole yet is left out. Raises TableError or FileError where it
    cannot be read, or a line of it cannot."""
    tables: dict[str, Mapping[str, object]] = {}
    tracks: dict[Key, RecordedTrack] = {}
    start = 0
    try:
        with path.open("rb") as file:
            for number, raw in enumerate(file, 1):
                place = Place(str(path), number)
                try:
                    line = read_line(raw)
                except ValueError as error:
                    if not raw.endswith(b"\n") and number > 1:
                        break
                    problem = f"the line cannot be read: {error}"
                    raise TableError(Fault(problem, "lines that `contextdb live --record` wrote", place=place)) from None
                if number == 1:
                    require_header(line, place)
                if line["line"] in (lines.HEADER, lines.TABLES):
                    tables |= line["tables"]
                elif line["line"] in (lines.ASK, lines.PICK):
                    key = line["who"], line["table"]
                    if key in tracks or line["line"] == lines.ASK:
                        tracks.setdefault(key, RecordedTrack(path)).add(line, (start, len(raw)))
                start += len(raw)
    except OSError as error:
        raise FileError(Fault(f"the file cannot be read: {error.strerror}.", place=Place(str(path)))) from None
    return Session(path, tables, tracks)
