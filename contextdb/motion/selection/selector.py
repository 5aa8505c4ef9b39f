"""Choose among several databases, the prioritized ones first.

The rule: take the best frame of the priority database when its cost is under its threshold. If not, search the default database too
and take the lower of the two. A default database may itself be a priority database before another: in a chain the search continues
until a cost is under its threshold, and the lowest of all that was searched wins; on a tie, the earlier database.

Buckets: a game may keep starts, stops and cycles in databases of their own, and name those of the moment with every search; the
others are passed over, and the rule holds among those named.

Costs of different databases can be compared when these share schema, weights and normalisation: see `build_databases`.

Source: "Priority Databases" and "Bucketing" in EA's talk on context databases: prioritized assets need not compete with default
ones, need no tags, and can be loaded and dropped at run time.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike

from contextdb.cells.arguments import require_kind, require_many_of, require_text
from contextdb.errors import Fault, MotionError, QueryError, in_quotes, mend_for, some
from contextdb.motion import arguments
from contextdb.motion.answers import is_answer
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.markup.left_out import Skip
from contextdb.motion.search.candidates import Candidates
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.hit import NOTHING, Hit
from contextdb.motion.selection.choice import Choice, Reason, Search, Status
from contextdb.motion.selection.search_options import (
    Among,
    Current,
    OfPenalties,
    OfTags,
    OfValid,
    OfValidForMany,
    Options,
    SearchOptions,
    each_of,
    valid_of_each,
)

__all__ = ["Choice", "Entry", "Reason", "Search", "Selector", "Status"]


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


class Selector:
    """Databases in order, priority first.

    Parameters
    ----------
    entries : sequence of Entry
        With different names and at least one; loaded databases have the same channels.
    tags : sequence of str, optional
        Tags that a filter may name though the markup of no loaded database knows them, such as those of one that is loaded later.

    Raises
    ------
    MotionError
        No entry, a name twice, a threshold that is not a number, or databases whose costs cannot be compared.
    """

    def __init__(self, entries: Sequence[Entry], tags: Sequence[str] = ()) -> None:
        self.entries: tuple[Entry, ...] = tuple(require_many_of(entries, Entry, "entries", "a list of Entry"))
        _check_entries(self.entries)
        self.names: tuple[str, ...] = tuple(entry.name for entry in self.entries)
        """The names of all databases in order, those not loaded too."""
        self._all = frozenset(self.names)
        loaded = {entry.name: entry.database for entry in self.entries if entry.database is not None}
        known = (tag for database in loaded.values() for tag in database.marks.tags)
        self.tags: tuple[str, ...] = tuple(dict.fromkeys((*known, *tags)))
        self._databases = {name: with_tags(database, self.tags) for name, database in loaded.items()}
        self.choosers: dict[object, object] = {}
        """What the core was told of it, with the settings of controllers."""

    def __reduce__(self) -> tuple[type[Selector], tuple[object, ...]]:
        return Selector, (self.entries, self.tags)

    def __repr__(self) -> str:
        return f"<Selector: {some(self.names)}>"

    @property
    def databases(self) -> Mapping[str, MotionDatabase]:
        """The loaded databases in order, as they are searched: each knows the tags of all."""
        return self._databases

    def with_database(self, name: str, database: MotionDatabase | None) -> Selector:
        """The same selector with one database loaded, exchanged or, with None, dropped; tags once known stay known."""
        self.check_names([name])
        return Selector([Entry(e.name, database, e.threshold) if e.name == name else e for e in self.entries], self.tags)

    def search(
        self,
        query: ArrayLike,
        valid: OfValid | None = None,
        tags: OfTags | None = None,
        current: Current | None = None,
        bias: Mapping[str, ArrayLike] | None = None,
        *,
        among: Among | None = None,
        skip: Mapping[str, Sequence[Skip]] | None = None,
        penalties: OfPenalties | None = None,
    ) -> Choice:
        """Choose the frame to play.

        Parameters
        ----------
        query : float array, shape (F,)
            For all databases.
        valid : Matches, or mapping of database name to Matches or flags, optional
            Which assets may play. Databases that the mapping leaves out are not restricted.
        tags : TagFilter, or mapping of database name to TagFilter or flags, optional
            One filter for all databases, whether or not the markup of each knows its tags; or each its own.
        current : Choice or (database name, frame), optional
            What plays now. In its own database it may play on, has its continuing bias, and wins ties.
        bias, skip : mapping of database name to array, or to Skips, optional
            As for `MotionDatabase.search`.
        among : collection of names, or Matches, optional
            The databases of the moment; the others are not searched. Matches: of a table whose rows are databases; those that this
            selector lacks are passed over. Default: all.
        penalties : mapping of asset to float, or of database name to such a mapping or an array, optional
            As for `MotionDatabase.search`.

        Raises
        ------
        QueryError
            A database that the selector lacks, with the nearest that it has; or what a database cannot be searched with.
        """
        inputs = SearchOptions(valid, tags, current, bias, among, skip, penalties)
        among = self.among(among)
        hits: dict[str, Hit] = {}
        for entry, database, given in self._searched(inputs):
            hits[entry.name] = hit = database.search(query, **given)
            if entry.threshold is not None and hit.cost < entry.threshold:
                return choice_of(self.entries, hits, among, entry.name)
        return choice_of(self.entries, hits, among, None)

    def search_many(
        self,
        queries: ArrayLike,
        valid: OfValidForMany | None = None,
        tags: OfTags | None = None,
        current: Sequence[Current | None] | None = None,
        *,
        among: Among | None = None,
        penalties: OfPenalties | None = None,
    ) -> list[Choice]:
        """Choose for many characters at once: one `Choice` for each query, in order, the same as `search` makes for each alone.

        Each database is searched once, for all characters that no database before it has satisfied.

        Parameters
        ----------
        queries : float array, shape (Q, F)
        valid : optional
            As for `MotionDatabase.search_many`: one for all, or one for each query, such as what `query_many` answers; or a mapping
            of database name to either.
        current : sequence of Q Choices or (database name, frame), optional
            None for a character that plays nothing.
        tags, among, penalties
            As for `search`, one for all.

        Raises
        ------
        QueryError
            As `search`; not one of each for each query.
        """
        wanted = arguments.numbers_of(queries, "the queries")
        if wanted.ndim != 2:
            raise QueryError(Fault(f"the queries have shape {wanted.shape}.", "queries x features"))
        playing = each_of(current, len(wanted), "current frame", is_one=current is None)
        masks = valid_of_each(self.databases, valid, len(wanted))
        inputs = [SearchOptions(mask, tags, now, None, among, None, penalties) for mask, now in zip(masks, playing, strict=True)]
        return self.search_each(wanted, inputs)

    def search_each(self, queries: Floats, inputs: Sequence[SearchOptions]) -> list[Choice]:
        """Choose for many characters at once, each with parameters of `search` of its own; queries [Q, F]."""
        for each in inputs:
            self.check_names(each.databases())
        among = [self.among(each.among) for each in inputs]
        hits: list[dict[str, Hit]] = [{} for _ in inputs]
        stopped: list[str | None] = [None for _ in inputs]
        for entry in self.entries:
            database = self.databases.get(entry.name)
            numbers = [i for i, names in enumerate(among) if entry.name in names and stopped[i] is None]
            if database is None or not numbers:
                continue
            own_hits = database.search_each(queries[numbers], [inputs[i].of(entry.name) for i in numbers])
            for i, hit in zip(numbers, own_hits, strict=True):
                hits[i][entry.name] = hit
                if entry.threshold is not None and hit.cost < entry.threshold:
                    stopped[i] = entry.name
        return [choice_of(self.entries, *each) for each in zip(hits, among, stopped, strict=True)]

    def candidates(
        self, query: ArrayLike, k: int = 10, *, left_out: bool = False, **options: Unpack[Options]
    ) -> tuple[tuple[str, Candidates], ...]:
        """The k cheapest frames of each database that a search with these options looks into, with its name, in order.

        `options` are the parameters of `search`, by name; `left_out` is that of `MotionDatabase.candidates`.
        """
        candidates: list[tuple[str, Candidates]] = []
        for entry, database, given in self._searched(SearchOptions(**options)):
            candidates.append((entry.name, database.candidates(query, k, **given, left_out=left_out)))
            if entry.threshold is not None and database.search(query, **given).cost < entry.threshold:
                break
        return tuple(candidates)

    def best_of_ranges(self, name: str, query: ArrayLike, within: float, **options: Unpack[Options]) -> list[Hit]:
        """The best frame of each range of one database that costs at most `within` more than the best of it, cheapest first.

        `options` are the parameters of `search`, by name. Empty for a database that a search with these passes over.
        """
        self.check_names([name])
        for entry, database, given in self._searched(SearchOptions(**options)):
            if entry.name == name:
                return database.best_of_ranges(query, within, **given)
        return []

    def among(self, among: Among | None) -> frozenset[str]:
        """The names of the databases that some names, or the assets of some Matches, stand for: of all for None."""
        if among is None:
            return self._all
        if is_answer(among):
            return frozenset(among.assets).intersection(self.names)
        if not isinstance(among, Collection):
            raise QueryError(Fault(f"the databases of the moment are {among!r}.", some(self.names)))
        names = [among] if isinstance(among, str) else list(among)
        self.check_names(names)
        return frozenset(names)

    def _searched(self, inputs: SearchOptions) -> Iterator[tuple[Entry, MotionDatabase, dict[str, Any]]]:
        """The databases that may be searched, in order, each with what it is given."""
        self.check_names(inputs.databases())
        among = self.among(inputs.among)
        for entry in self.entries:
            database = self.databases.get(entry.name)
            if database is not None and entry.name in among:
                yield entry, database, inputs.of(entry.name)

    def check_names(self, names: Iterable[str]) -> None:
        """Raise QueryError for a database that the selector lacks, with the nearest that it has."""
        for name in names:
            if not isinstance(name, str) or name not in self.names:
                problem = f"the selector has no database {in_quotes(str(name))}."
                raise QueryError(Fault(problem, some(self.names), mend_for(str(name), self.names)))


def choice_of(entries: Sequence[Entry], hits: Mapping[str, Hit], among: frozenset[str], stopped: str | None) -> Choice:
    """The lowest cost of what was searched wins, on a tie the earlier database; `stopped` is the one under its threshold."""
    winner = min((name for name, hit in hits.items() if hit), key=lambda name: hits[name].cost, default=None)
    searches = tuple(Search(e.name, e.threshold, hits.get(e.name), _status(e, hits, among, winner)) for e in entries)
    if winner is None:
        return Choice(NOTHING, None, Reason.NOTHING_VALID, searches)
    reason = Reason.UNDER_THRESHOLD if winner == stopped else Reason.LOWEST
    return Choice(hits[winner], winner, reason, searches)


def _status(entry: Entry, hits: Mapping[str, Hit], among: frozenset[str], winner: str | None) -> Status:
    if entry.name not in among:
        return Status.NOT_AMONG
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
        require_text(entry.name, "the name of an Entry")
        require_kind(entry.database, (MotionDatabase, type(None)), "the database of an Entry", "a MotionDatabase, or None")
        require_kind(entry.threshold, (Real, type(None)), "the threshold of an Entry", "a number, or None")
        if names.count(entry.name) > 1:
            raise MotionError(Fault(f"the database {in_quotes(entry.name)} appears twice in the selector.", "each once"))
        if entry.threshold is not None and math.isnan(entry.threshold):
            raise MotionError(Fault(f"the threshold of {in_quotes(entry.name)} is not a number.", "a cost, such as 0.1, or None"))
    loaded = [(entry.name, entry.database) for entry in entries if entry.database is not None]
    for name, database in loaded[1:]:
        first, other = loaded[0]
        if (database.channel_names, database.n_features) != (other.channel_names, other.n_features):
            problem = (
                f"the databases {in_quotes(first)} and {in_quotes(name)} have different channels: their costs cannot be compared."
            )
            raise MotionError(Fault(problem, "databases of one schema"))


# ---- databases that know each other's tags, so that one tag filter can be asked of all


def with_tags(database: MotionDatabase, tags: Iterable[str]) -> MotionDatabase:
    """The same database, its markup knowing some tags more; the same object if it knows them already. The features are shared."""
    marks = database.marks
    new = tuple(tag for tag in tags if tag not in marks.tags)
    if not new:
        return database
    wider = np.pad(marks.kind_tags, ((0, 0), (0, len(new))))
    return replace(database, marks=replace(marks, tags=marks.tags + new, kind_tags=wider))
