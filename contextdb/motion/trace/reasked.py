"""Recorded searches repeated: what every frame cost by channel and bias, where any asset stood, and what other settings choose.

A session keeps of each search the query and what could be chosen from. With the databases that it was recorded with, these give
every cost again, bit for bit. Databases with other clips, markup or settings are asked with the same ranges, skips and biases,
found by the names of assets.

Source: Remedy's debugger shows the cost of every frame of every animation with live weights; what would have been chosen otherwise
is exact because the search is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import Any, TypedDict

from contextdb.cells.arguments import require_kind, require_mapping, require_place
from contextdb.cells.sequences import Made
from contextdb.errors import Fault, MotionError, Place, in_quotes, mend_for, plural, some
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filters import Biases, Filter
from contextdb.motion.selection.decision import Decision
from contextdb.motion.selection.selector import Entry
from contextdb.motion.trace.filter_rows import is_recorded
from contextdb.motion.trace.other_filters import ReaskedSearch, filter_by_table, moved_to, with_biases
from contextdb.motion.trace.reasked_decision import ReaskedDecision, chosen_of
from contextdb.motion.trace.stock import Edited, Stock, require_name
from contextdb.motion.trace.why_not import WhyNot, why_not

About = Mapping[str, Mapping[str, Any]]


class Changes(TypedDict, total=False):
    """What is changed; see `Trace.reasked`."""

    weights: Mapping[str, float] | None
    biases: Mapping[str, Biases] | None
    thresholds: Mapping[str, float | None] | None
    tables: Mapping[str, Edited] | None


class Reasked(Made[ReaskedDecision]):
    """A session repeated: one `ReaskedDecision` for each decision, worked out when it is requested.

    Parameters
    ----------
    decisions : sequence of Decision
    about : mapping
        What a `Trace` says of its databases.
    stock : Stock
        What is asked.
    changes : Changes
        What is changed.
    """

    def __init__(self, decisions: Sequence[Decision], about: About, stock: Stock, changes: Changes) -> None:
        self.decisions, self.about, self.stock = decisions, about, stock
        for name in changes:
            require_name(name, "change", set(Changes.__annotations__))
        self.thresholds = _mapping(changes.get("thresholds"), "thresholds")
        tables: Mapping[str, Edited] = _mapping(changes.get("tables"), "tables")
        weights, biases = _mapping(changes.get("weights"), "weights"), _mapping(changes.get("biases"), "biases")
        known = set(about) or set(stock.databases)
        for name in (*self.thresholds, *biases):
            require_name(name, "database", known)
        for name, table in tables.items():
            require_name(name, "table", set(stock.table_of.values()))
            require_kind(table, Edited, "one of tables", "a Table")
        self.tables = {name: table.compile() for name, table in tables.items()}
        self.changed = frozenset(
            name for name in stock.databases if name in about and not is_recorded(about[name], stock.databases[name])
        )
        self._of_biases: dict[str, Biases] = {}
        for name, each in biases.items():
            require_kind(each, Biases, "one of biases", "Biases")
            self._of_biases[name] = each
        self.databases = {name: _changed(each, weights, self._of_biases.get(name)) for name, each in stock.databases.items()}

    def over(self, decisions: Sequence[Decision]) -> Reasked:
        """The same of other decisions, such as those of the session read once."""
        other = copy(self)
        other.decisions = decisions
        return other

    def _at(self, index: int) -> ReaskedDecision:
        return self.of(self.decisions[require_place(index, len(self), "decision")])

    def __iter__(self) -> Iterator[ReaskedDecision]:
        return (self.of(decision) for decision in self.decisions)

    def __len__(self) -> int:
        return len(self.decisions)

    def __repr__(self) -> str:
        return f"<Reasked: {plural(len(self), 'decision')}>"

    def why_not(self, index: int, asset: str) -> WhyNot:
        """Why an asset was not chosen by one decision, and what would have to change for it to be; see `WhyNot`. Raises MotionError
        where no database has the asset, with the nearest; or nothing was searched."""
        decision = self[index]
        if decision.choice is None:
            raise MotionError(self._unsearched(decision.decision.tick))
        return why_not(decision, asset)

    def _unsearched(self, tick: int) -> Fault:
        """An update without a search is asked about; the nearest with one is told."""
        ticks = [each.tick for each in self.decisions if each.choice is not None]
        near = min(ticks, key=lambda each: abs(each - tick), default=None)
        mend = "" if near is None else f"tick {near:,}"
        return Fault(f"nothing was searched at tick {tick:,}: what played, played on.", "an update with a search", mend)

    def of(self, decision: Decision) -> ReaskedDecision:
        """A decision of the session, repeated."""
        why = self._obstacle(decision)
        if why:
            raise MotionError(Fault(f"the search at tick {decision.tick:,} cannot be repeated: {why}"))
        if decision.choice is None:
            return ReaskedDecision(decision, (), {}, self.stock)
        entries = tuple(
            Entry(each.database, self.databases.get(each.database), self.thresholds.get(each.database, each.threshold))
            for each in decision.choice.searches
        )
        searches = {name: self._search(name, decision, chosen) for name, chosen in decision.filters}
        was = chosen_of(decision.choice, self._starts)
        return ReaskedDecision(decision, entries, searches, self.stock, was)

    @cached_property
    def _starts(self) -> dict[str, Sequence[int]]:
        """Where the ranges of the recorded databases started."""
        same = {name: each.starts.tolist() for name, each in self.databases.items() if name not in self.changed}
        return {**{name: about["starts"] for name, about in self.about.items() if "starts" in about}, **same}

    def _obstacle(self, decision: Decision) -> str:
        return "" if decision.choice is None else why_not_asked(decision, self.about, self.databases, self.changed)

    def _search(self, name: str, decision: Decision, chosen: Filter) -> ReaskedSearch:
        assert decision.query is not None, "a search has a query"
        database = self.databases[name]
        if name in self.changed:
            tags = None if decision.inputs is None else decision.inputs.tags_of(name)
            database, chosen = moved_to(database, chosen, self.about[name], tags)
        table = self.tables.get(self.stock.table_of.get(name, ""))
        if table is not None and decision.context is not None:
            chosen = filter_by_table(database, chosen, table, decision.context)
        if name in self._of_biases:
            chosen = with_biases(database, chosen, self.stock.databases[name].biases)
        return ReaskedSearch(name, database, decision.query, chosen)


def why_not_asked(
    decision: Decision, about: About, databases: Mapping[str, MotionDatabase], changed: frozenset[str] | None = None
) -> str:
    """Why a decision cannot be repeated, in a sentence; "" when it can.

    `changed` are the databases that may differ from those of the session; None: none may.
    """
    if not decision.searched:
        return "nothing was searched at this update: what played, played on."
    if decision.together is not None:
        return "clip and cast were chosen for several characters at once: JointSearcher.candidates compares them."
    if decision.query is None or not decision.filters:
        return "the session holds no filters: an older version or code of your own recorded it, or it was to keep no candidates."
    for name, _ in decision.filters:
        if name not in databases:
            return f"there is no database {in_quotes(name)} in the project."
        if changed is None and not is_recorded(about.get(name, {}), databases[name]):
            return f"the database {in_quotes(name)} is another than the one that the session was recorded with."
        if changed is not None and name in changed and "assets" not in about.get(name, {}):
            return f"the database {in_quotes(name)} changed, and a session of an older version does not say what its ranges were."
    return ""


def require_known(name: str, databases: Mapping[str, MotionDatabase], file: str) -> None:
    """Raise MotionError when no asset's name contains a text, with the nearest."""
    known = list(dict.fromkeys(asset for database in databases.values() for asset in database.assets))
    if not any(name.casefold() in asset.casefold() for asset in known):
        raise MotionError(Fault(f"no asset's name contains {in_quotes(name)}.", some(known), mend_for(name, known), Place(file)))


def _mapping(given: object, what: str) -> Mapping[str, Any]:
    return {} if given is None else require_mapping(given, what, "a mapping")


def _changed(database: MotionDatabase, weights: Mapping[str, float], biases: Biases | None) -> MotionDatabase:
    weighed = database.with_weights(weights) if weights else database
    return weighed if biases is None else replace(weighed, biases=biases)
