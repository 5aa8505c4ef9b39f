"""What a link watches: tables, live contexts and controllers, held weakly. What the game lets go is watched no more."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import count
from typing import Any
from weakref import WeakValueDictionary

from contextdb.compiled.data import CompiledData
from contextdb.compiled.live import LiveContext
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.errors import ContextError, Fault, in_quotes
from contextdb.telemetry.link.feed import Feed, Source, Watcher, Who


class _Folder:
    """A mapping of tables that may hold others later."""

    def __init__(self, tables: Mapping[str, CompiledTable], who: Who) -> None:
        self.who = who
        self._tables = tables
        self._seen: Mapping[str, CompiledTable] = {}

    def new_tables(self) -> list[CompiledTable]:
        """The tables that were not there at the last call."""
        before = self._seen
        self._seen = self._tables.snapshot() if hasattr(self._tables, "snapshot") else dict(self._tables)
        if self._seen is before:
            return []
        return [table for table in self._seen.values() if not any(table is one for one in before.values())]


class Watched:
    """All that a link watches. Whoever changes it holds the link's lock."""

    def __init__(self, feed: Feed) -> None:
        self.feed = feed
        self._numbers = count()
        self._things: WeakValueDictionary[int, Any] = WeakValueDictionary()
        """In the order in which they were watched first."""
        self._folders: list[_Folder] = []

    def __len__(self) -> int:
        return len(self._things)

    def watch(self, what: object, who: Who) -> None:
        """Watch a table, a live context, a controller or a character, or a mapping of tables. Raises ContextError where it is none
        of these, or another link watches it."""
        if isinstance(what, CompiledTable):
            self._watch_table(data_of(what), who)
        elif isinstance(what, LiveContext):
            source = self._watch_table(what._compiled, None, has_questions=False)
            self._put(what, Watcher(self.feed, who, source, what._compiled.keep))
        elif isinstance(what, Mapping) and all(isinstance(table, CompiledTable) for table in what.values()):
            self._folders.append(_Folder(what, who))
            self.follow()
        elif has_decisions(what):
            self._put(getattr(what, "controller", what), Watcher(self.feed, who))
        else:
            problem = f"a link cannot watch what is of type {type(what).__name__}."
            accepted = "a compiled table, a live context, a controller, a character, a crowd of them, or cdb.watch(folder)"
            mend = "to compile it first" if hasattr(what, "compile") else ""
            raise ContextError(Fault(problem, accepted, mend))

    def source_of(self, table: CompiledTable) -> Source:
        """What the lines say of a table, whose picks are published from now on."""
        return self._watch_table(data_of(table), None, has_questions=False)

    def follow(self) -> None:
        """Watch the tables that folders have now."""
        for folder in self._folders:
            for table in folder.new_tables():
                self._watch_table(data_of(table), folder.who)

    def sources(self) -> dict[str, Source]:
        """The tables that are watched, the newest of a name."""
        watchers = [thing._watcher for thing in list(self._things.values())]
        sources = [watcher.source for watcher in watchers if watcher.source is not None]
        return {source.name: source for source in sources}

    def forget(self) -> None:
        """Let go of everything; other links may watch it then."""
        for thing in list(self._things.values()):
            _set_watcher(thing, None)
        self._things.clear()
        self._folders.clear()

    def _watch_table(self, compiled: CompiledData, who: Who, has_questions: bool = True) -> Source:
        watcher = compiled._watcher
        if isinstance(watcher, Watcher) and watcher.feed is self.feed and watcher.source is not None:
            if has_questions:
                watcher.rename(who)
            return watcher.source
        source = Source(compiled.name, compiled.version, compiled.n_rows, compiled.asked)
        self._put(compiled, Watcher(self.feed, who, source, compiled.keep, has_questions))
        return source

    def _put(self, thing: Any, watcher: Watcher) -> None:
        known = thing._watcher
        if known is None:
            self._things[next(self._numbers)] = thing
        elif known.feed is not self.feed:
            named = f"the table {in_quotes(thing.name)}" if isinstance(thing, CompiledData) else f"the {type(thing).__name__}"
            raise ContextError(Fault(f"{named} is watched by another link.", "what no link watches", "to close that link first"))
        _set_watcher(thing, watcher)


def _set_watcher(thing: Any, watcher: Watcher | None) -> None:
    if isinstance(thing, CompiledData):
        thing.watch(watcher)
        return
    thing._watcher = watcher
    if isinstance(thing, LiveContext):
        thing._lead()


def has_decisions(what: object) -> bool:
    """Whether it is a controller, or a character with one."""
    return hasattr(getattr(what, "controller", what), "_watcher") and not isinstance(what, LiveContext)
