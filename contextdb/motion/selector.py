"""Choose among several databases, the prioritized ones first.

The rule: take the best frame of the priority database when its cost is under its threshold. If not, search the default database too
and take the lower of the two. A default database may itself be a priority database before another: in a chain the search goes on
until a cost is under its threshold, and the lowest of all that was searched wins; on a tie, the earlier database.

Costs of different databases can be compared when these share schema, weights and normalisation: see `build_databases`.

Source: "Priority Databases" in EA's talk on context databases: prioritized assets need not compete with default ones, need no
tags, and can be loaded and dropped at run time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from numpy.typing import ArrayLike

from contextdb.errors import Fault, MotionError, QueryError, in_quotes, nearest, some
from contextdb.motion.arguments import Valid
from contextdb.motion.database import NOTHING, Hit, MotionDatabase


@dataclass(frozen=True)
class Entry:
    """A database in a selector's order.

    Attributes
    ----------
    name : str
    database : MotionDatabase or None
        None while it is not loaded: it is passed over.
    threshold : float or None
        Below this cost its best frame wins outright. None: never; the default database, as a rule the last.
    """

    name: str
    database: MotionDatabase | None
    threshold: float | None = None


class Status(StrEnum):
    """What became of one database in a choice."""

    WINNER = "winner"
    BEATEN = "beaten"
    NOTHING_VALID = "nothing valid"
    NOT_SEARCHED = "not searched"
    NOT_LOADED = "not loaded"


class Reason(StrEnum):
    """Why the winner won."""

    UNDER_THRESHOLD = "under its threshold"
    LOWEST = "lowest cost"
    NOTHING_VALID = "nothing valid"


@dataclass(frozen=True)
class Search:
    """One database in a choice: its best frame, its threshold, and what became of it. `hit` is None when it was not searched."""

    database: str
    threshold: float | None
    hit: Hit | None
    status: Status

    @property
    def is_under_threshold(self) -> bool:
        """Whether its best cost is under its threshold."""
        return self.hit is not None and self.threshold is not None and self.hit.cost < self.threshold

    def __str__(self) -> str:
        if self.hit is None or not self.hit:
            return f"{self.database}: {self.status}"
        told = f"{self.database}: cost {self.hit.cost:.4g}"
        if self.threshold is None:
            return told
        return f"{told}, {'under' if self.is_under_threshold else 'not under'} its threshold {self.threshold:g}"


@dataclass(frozen=True)
class Choice:
    """What a selector chose, and how. False when nothing may play.

    Attributes
    ----------
    hit : Hit
    database : str or None
        The name of the database that `hit` is in.
    reason : Reason
    searches : tuple of Search
        All databases of the selector in order, those not searched too.
    """

    hit: Hit
    database: str | None
    reason: Reason
    searches: tuple[Search, ...]

    def __bool__(self) -> bool:
        return bool(self.hit)

    @property
    def why(self) -> str:
        """The choice in one sentence for people."""
        told = "; ".join(map(str, self.searches))
        if self.database is None:
            return f"{told}. Nothing may play."
        ends = {Reason.UNDER_THRESHOLD: "wins outright", Reason.LOWEST: "has the lowest cost and wins"}
        return f"{told}. {self.database} {ends[self.reason]}."


class Selector:
    """Databases in order, priority first.

    Parameters
    ----------
    entries : sequence of Entry
        With different names and at least one; loaded databases have the same channels.

    Raises
    ------
    MotionError
        No entry, a name twice, a threshold that is no number, or databases whose costs cannot be compared.
    """

    def __init__(self, entries: Sequence[Entry]) -> None:
        self.entries: tuple[Entry, ...] = tuple(entries)
        _check_entries(self.entries)

    def with_database(self, name: str, database: MotionDatabase | None) -> Selector:
        """The same selector with one database loaded, exchanged or, with None, dropped."""
        self._check_names([name])
        return Selector([Entry(e.name, database, e.threshold) if e.name == name else e for e in self.entries])

    def search(
        self,
        query: ArrayLike,
        valid: Valid | Mapping[str, Valid] | None = None,
        tags: Mapping[str, ArrayLike] | None = None,
        current: Choice | tuple[str, int] | None = None,
        bias: Mapping[str, ArrayLike] | None = None,
    ) -> Choice:
        """Choose the frame to play.

        Parameters
        ----------
        query : float array, shape (F,)
            For all databases.
        valid : Matches, or mapping of database name to Matches or flags, optional
            Which assets may play. Databases that the mapping leaves out are not restricted.
        tags, bias : mapping of database name to array, optional
            As for `MotionDatabase.search`.
        current : Choice or (database name, frame), optional
            What plays now: wins ties in its own database.
        """
        for given in (tags, bias, valid if isinstance(valid, Mapping) else None):
            self._check_names(given or ())
        playing = (current.database, current.hit.frame) if isinstance(current, Choice) else current
        hits: dict[str, Hit] = {}
        stopped = None
        for entry in self.entries:
            if entry.database is None:
                continue
            hits[entry.name] = hit = entry.database.search(query, **_for_database(entry.name, valid, tags, playing, bias))
            if entry.threshold is not None and hit.cost < entry.threshold:
                stopped = entry.name
                break
        return _choice(self.entries, hits, stopped)

    def _check_names(self, names: object) -> None:
        known = [entry.name for entry in self.entries]
        for name in names if isinstance(names, (Mapping, Sequence)) else ():
            if name not in known:
                near = nearest(str(name), known)
                found = f"the selector has no database {in_quotes(str(name))}."
                raise QueryError(Fault(found, some(known), in_quotes(near) if near else ""))


def _for_database(
    name: str,
    valid: Valid | Mapping[str, Valid] | None,
    tags: Mapping[str, ArrayLike] | None,
    playing: tuple[str | None, int] | None,
    bias: Mapping[str, ArrayLike] | None,
) -> dict[str, Any]:
    """What of a search's arguments one database is given."""
    return {
        "valid": valid.get(name) if isinstance(valid, Mapping) else valid,
        "tags": (tags or {}).get(name),
        "current": playing[1] if playing is not None and playing[0] == name else None,
        "bias": (bias or {}).get(name),
    }


def _choice(entries: Sequence[Entry], hits: Mapping[str, Hit], stopped: str | None) -> Choice:
    """The lowest cost of what was searched wins, on a tie the earlier database."""
    winner = min((name for name, hit in hits.items() if hit), key=lambda name: hits[name].cost, default=None)
    searches = tuple(Search(e.name, e.threshold, hits.get(e.name), _status(e, hits, winner)) for e in entries)
    if winner is None:
        return Choice(NOTHING, None, Reason.NOTHING_VALID, searches)
    reason = Reason.UNDER_THRESHOLD if winner == stopped else Reason.LOWEST
    return Choice(hits[winner], winner, reason, searches)


def _status(entry: Entry, hits: Mapping[str, Hit], winner: str | None) -> Status:
    if entry.database is None:
        return Status.NOT_LOADED
    if entry.name not in hits:
        return Status.NOT_SEARCHED
    if not hits[entry.name]:
        return Status.NOTHING_VALID
    return Status.WINNER if entry.name == winner else Status.BEATEN


def _check_entries(entries: Sequence[Entry]) -> None:
    names = [entry.name for entry in entries]
    if not names:
        raise MotionError(Fault("the selector has no database.", "at least one Entry"))
    for entry in entries:
        if names.count(entry.name) > 1:
            raise MotionError(Fault(f"the database {in_quotes(entry.name)} stands twice in the selector.", "each once"))
        if entry.threshold is not None and math.isnan(entry.threshold):
            raise MotionError(Fault(f"the threshold of {in_quotes(entry.name)} is not a number.", "a cost, such as 2.75, or None"))
    loaded = [(entry.name, entry.database) for entry in entries if entry.database is not None]
    for name, database in loaded[1:]:
        first, other = loaded[0]
        if (database.channel_names, database.n_features) != (other.channel_names, other.n_features):
            found = (
                f"the databases {in_quotes(first)} and {in_quotes(name)} have different channels: their costs cannot be compared."
            )
            raise MotionError(Fault(found, "databases of one schema"))
