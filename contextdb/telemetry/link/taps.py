"""What is watched: tables, live contexts and controllers, each of which tells of itself while a tap on it is open.

A tap holds what it is on weakly: a table or a context that the game has let go is watched no more.
"""

from __future__ import annotations

import time
import weakref
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol

from contextdb.cells.arguments import require_text
from contextdb.cells.facts import Context
from contextdb.cells.mirroring import InMirror
from contextdb.compiled.casting.facts import Actors
from contextdb.compiled.data import CompiledData
from contextdb.compiled.heard import hear, hear_live, made_ready, unhear, unhear_live
from contextdb.compiled.live import LiveContext
from contextdb.compiled.matches import Matches
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.errors import ContextError, Fault, in_quotes
from contextdb.telemetry.link.ring import UNNAMED, Picked, Ring, Source, WithActors

Who = str | Callable[[], object] | None
"""Who asks: a name, or what gives it, called in each question; None where nobody is named."""


class Tap(Protocol):
    """What makes one thing tell of itself."""

    @property
    def target(self) -> object | None:
        """What it is on; None where that is gone."""
        ...

    def open(self) -> None:
        """Begin to tell."""
        ...

    def close(self) -> None:
        """Make it what it was before."""
        ...


def who_of(who: Who) -> Callable[[], object]:
    """What gives the name of who asks."""
    if who is None or callable(who):
        return who or _nobody
    name = require_text(who, "who")
    return lambda: name


def _nobody() -> None:
    return None


class TableTap:
    """Tells of a compiled table: its questions, and its picks."""

    def __init__(self, compiled: CompiledData, ring: Ring, who: Who, is_watched: bool = True) -> None:
        self._compiled = weakref.ref(compiled)
        self._ring, self._who, self._name = ring, who_of(who), None if callable(who) else who
        self._keep = compiled.keep
        self._is_named, self._is_mirroring = callable(who), bool(compiled.mirroring)
        self.is_watched = is_watched
        """Whether the table itself is watched, and not only a live context of it, whose picks it tells of."""
        self.last_live: LiveTap | None = None
        """The live context of the table that was asked last."""
        made_ready(compiled)
        self.source = Source(compiled.name, compiled.version, compiled.n_rows, compiled.asked)

    @property
    def target(self) -> CompiledData | None:
        return self._compiled()

    def open(self) -> None:
        compiled = self._compiled()
        if compiled is not None and compiled.heard is None:
            hear(compiled, self)

    def close(self) -> None:
        """Make the table what it was before."""
        compiled = self._compiled()
        if compiled is not None and compiled.heard is self:
            unhear(compiled)

    def rename(self, who: Who) -> None:
        """Call who asks otherwise; while it is open, from when it is opened again."""
        self._who, self._name, self._is_named = who_of(who), None if callable(who) else who, callable(who)
        self.is_watched = True

    def around(self, ask: Callable[[Context], Matches]) -> Callable[[Context], Matches]:
        """What answers a query and tells of it: the way of every query, so with as few steps as can be."""
        if not self.is_watched:
            return ask
        ring, now, keep, source, name = self._ring, time.monotonic, self._keep, self.source, self._name
        append, numbers, slots = ring.entries.append, ring.numbers, ring.slots

        def ask_and_tell(context: Context) -> Matches:
            answer = ask(context)
            if ring.keeps_all:
                append((next(numbers), now(), name, source, keep(context), answer))
            else:
                slots[source] = (0, now(), name, source, keep(context), answer)
            return answer

        def ask_and_tell_who(context: Context) -> Matches:
            answer = ask(context)
            self.asked(context, answer)
            return answer

        return ask_and_tell_who if self._is_named or self._is_mirroring else ask_and_tell

    def asked(self, context: Context, answer: Matches, actors: Actors | None = None) -> None:
        """Tell of a question that was answered with care, or with actors."""
        if self.is_watched and type(context) is not InMirror:
            who = self._who()
            facts = _kept(self._keep(context), actors)
            self._ring.put(self._teller(who), time.monotonic(), who, self.source, facts, answer)

    def picked(self, answer: Matches, row: int | None, asset: str | None) -> None:
        who = self._who() if self.is_watched else UNNAMED
        tellers = (self._teller(who), self.last_live)
        self._ring.put_pick(tellers, time.monotonic(), who, self.source, Picked(row, asset), answer)

    def _teller(self, who: object) -> object:
        """Who tells, of whom the newest entry is kept: the table, or each of those that a function names."""
        return (self.source, str(who)) if self._is_named else self.source


def _kept(facts: Mapping[str, object], actors: Actors | None) -> Mapping[str, object] | WithActors:
    if actors is None:
        return facts
    return WithActors(facts, {role: [dict(actor) for actor in listed] for role, listed in actors.items()})


class LiveTap:
    """Tells of a live context."""

    def __init__(self, live: LiveContext, table: TableTap, ring: Ring, who: Who) -> None:
        self._live = weakref.ref(live)
        self._table, self._ring, self._who, self._keep = table, ring, who_of(who), live._compiled.keep

    @property
    def target(self) -> LiveContext | None:
        return self._live()

    def open(self) -> None:
        if (live := self._live()) is not None and getattr(live, "_ears", None) is None:
            hear_live(live, self)

    def close(self) -> None:
        """Make the context what it was before."""
        if (live := self._live()) is not None and getattr(live, "_ears", None) is self:
            unhear_live(live)

    def rename(self, who: Who) -> None:
        self._who = who_of(who)

    def asked(self, context: Context, answer: Matches, actors: Actors | None = None) -> None:
        facts = _kept(self._keep(context), actors)
        self._table.last_live = self
        self._ring.put(self, time.monotonic(), self._who(), self._table.source, facts, answer)


class ControllerTap:
    """Tells of the decisions of a controller: a recorder that hands them on to the one that was there."""

    def __init__(self, controller: Any, ring: Ring, who: Who) -> None:
        self._controller = weakref.ref(controller)
        self._ring, self._who = ring, who_of(who)
        self._other: Any = None
        self._is_open = False

    @property
    def target(self) -> object | None:
        return self._controller()

    def open(self) -> None:
        controller = self._controller()
        if controller is not None and not self._is_open:
            self._other, controller.recorder, self._is_open = controller.recorder, self, True

    def close(self) -> None:
        """Give the controller back its own recorder, unless the game gave it another."""
        controller = self._controller()
        self._is_open = False
        if controller is not None and controller.recorder is self:
            controller.recorder, self._other = self._other, None

    def rename(self, who: Who) -> None:
        self._who = who_of(who)

    @property
    def n_candidates(self) -> int:
        """As many as the other recorder wants; some where somebody debugs, so that a decision says what could be chosen."""
        wanted = 0 if self._other is None else int(self._other.n_candidates)
        return max(wanted, 1) if self._ring.keeps_filters else wanted

    def record(self, decision: object) -> None:
        self._ring.put(self, time.monotonic(), self._who(), None, decision, None)
        if self._other is not None:
            self._other.record(decision)


class _Folder:
    """A mapping of tables that may hold others later."""

    def __init__(self, tables: Mapping[str, CompiledTable], who: Who) -> None:
        self.who = who
        self._tables = tables
        self._seen: Mapping[str, CompiledTable] | None = None

    def new_tables(self) -> list[CompiledTable]:
        """The tables that were not there when this was last asked."""
        snapshot = getattr(self._tables, "snapshot", None)
        now: Mapping[str, CompiledTable] = self._tables if snapshot is None else snapshot()
        if now is self._seen and snapshot is not None:
            return []
        known = () if self._seen is None else list(self._seen.values())
        self._seen = now if snapshot is not None else dict(now)
        return [table for table in now.values() if not any(table is one for one in known)]


class Taps:
    """All taps of a link. Whoever changes them holds the link's lock."""

    def __init__(self, ring: Ring) -> None:
        self.ring = ring
        self.are_open = False
        self._of: dict[int, Any] = {}
        """By the identity of what they are on."""
        self._tables: dict[int, TableTap] = {}
        """Those on tables."""
        self._gone: deque[int] = deque()
        """What the game has let go since the last `sweep`."""
        self._folders: list[_Folder] = []

    def __iter__(self) -> Iterator[Any]:
        return iter(self._of.values())

    def __len__(self) -> int:
        return len(self._of)

    def watch(self, what: object, who: Who) -> None:
        """Put a tap on a table, a live context, a controller, or a mapping of tables. Raises ContextError where it is none of
        these, or another link watches it."""
        if isinstance(what, CompiledTable):
            self._watch_table(data_of(what), who, True)
        elif isinstance(what, LiveContext):
            table = self._watch_table(what._compiled, None, False)
            self._put(what, who, lambda: LiveTap(what, table, self.ring, who))
        elif isinstance(what, Mapping) and all(isinstance(table, CompiledTable) for table in what.values()):
            self._folders.append(_Folder(what, who))
            self.follow()
        elif hasattr(getattr(what, "controller", None), "recorder"):  # a character
            self.watch(what.controller, who)  # type: ignore[attr-defined]
        elif hasattr(what, "recorder") and callable(getattr(what, "update", None)):
            self._put(what, who, lambda: ControllerTap(what, self.ring, who))
        else:
            found = f"a link cannot watch what is of type {type(what).__name__}."
            accepted = "a compiled table, a live context, a controller, a character, a crowd of them, or cdb.watch(folder)"
            mend = "to compile it first" if hasattr(what, "compile") else ""
            raise ContextError(Fault(found, accepted, mend))

    def follow(self) -> None:
        """Watch the tables that folders have now."""
        for folder in self._folders:
            for table in folder.new_tables():
                self._watch_table(data_of(table), folder.who, True)

    def sources(self) -> dict[str, Source]:
        """The tables that are watched, the newest of a name."""
        return {tap.source.name: tap.source for tap in self._tables.values()}

    def sweep(self) -> None:
        """Forget what the game has let go."""
        while self._gone:
            key = self._gone.popleft()
            if key in self._of and self._of[key].target is None:
                del self._of[key]
                self._tables.pop(key, None)

    def forget(self) -> None:
        """Let go of everything; other links may watch it then."""
        self._of.clear()
        self._tables.clear()
        self._folders.clear()

    def _watch_table(self, compiled: CompiledData, who: Who, is_watched: bool) -> TableTap:
        known = self._own(compiled)
        if isinstance(known, TableTap):
            if is_watched:
                known.close()
                known.rename(who)
            if self.are_open:
                known.open()
            return known
        other = vars(compiled).get("_tap", _nobody)()
        if isinstance(other, TableTap):
            found = f"the table {in_quotes(compiled.name)} is watched by another link."
            raise ContextError(Fault(found, "a table that no link watches", "to close that link first"))
        tap = TableTap(compiled, self.ring, who, is_watched)
        vars(compiled)["_tap"] = weakref.ref(tap)  # which is gone with its link
        self._keep(compiled, tap)
        self._tables[id(compiled)] = tap
        if self.are_open:
            tap.open()
        return tap

    def _put(self, what: object, who: Who, make: Callable[[], Any]) -> None:
        tap = self._own(what)
        if tap is None:
            tap = make()
            self._keep(what, tap)
        else:
            tap.rename(who)
        if self.are_open:
            tap.open()

    def _keep(self, what: object, tap: Any) -> None:
        key, gone = id(what), self._gone
        tap.on_gone = weakref.ref(what, lambda _: gone.append(key))
        self._of[key] = tap

    def _own(self, what: object) -> Any:
        """The tap on something, if there is one."""
        tap = self._of.get(id(what))
        return tap if tap is not None and tap.target is what else None
