"""What a game asked and picked, kept for the moment until the link's thread makes lines of it.

An entry is a tuple: to put it into a dict or a deque is all that the game's thread does.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from operator import itemgetter
from typing import Any, NamedTuple

from contextdb.cells.conditions import Condition
from contextdb.compiled.casting.facts import Actors
from contextdb.compiled.matches import Matches
from contextdb.telemetry.link.lines import ASK, DATABASES, DECISION, PICK, Line, dumped, sent_facts

MOST_ENTRIES = 1 << 13
AT_ONCE = 128
"""Entries that are taken, and let go, without a rest."""
MOST_BEFORE = 32
"""Questions that a pick may be of that comes later."""
UNNAMED = object()
"""Who picks in a table of which only live contexts are watched: a pick of another answer is nobody's."""


@dataclass(frozen=True, eq=False)
class Source:
    """A table that is watched: what the lines say of it."""

    name: str
    version: str
    n_rows: int
    asked: Mapping[str, Condition]

    def told(self) -> Line:
        """What the header says of it."""
        conditions = {name: condition.domain.kind for name, condition in self.asked.items()}
        return {"version": self.version, "rows": self.n_rows, "conditions": conditions}


class Picked(NamedTuple):
    """The row that was picked of an answer, and its asset; no row where it is the fallback."""

    row: int | None
    asset: str | None


class WithActors(NamedTuple):
    """The facts of a question with actors, and who was offered."""

    facts: Mapping[str, object]
    actors: Actors


Entry = tuple[int, float, object, Source | None, Any, Matches | None]
"""Number, seconds, who, the table, what: facts, `WithActors`, `Picked` or a decision as JSON has it; and the answer."""


class Ring:
    """What was told since the link's thread last looked.

    As a rule that is the newest entry of each teller in `slots`, and the newest of its questions that was picked from in `picks`:
    what it replaces is let go at once, in the game's thread, while it is still in the processor's cache. Where somebody wants
    every question, `keeps_all`, it is all of them, in `entries`. All are changed by single steps that no thread can interrupt.
    """

    def __init__(self, most: int = MOST_ENTRIES) -> None:
        self.keeps_all = False
        self.keeps_filters = False
        """Whether somebody debugs: decisions then say what could be chosen."""
        self.slots: dict[object, Entry] = {}
        self.picks: dict[object, tuple[Entry, Entry]] = {}
        self.entries: deque[Entry] = deque(maxlen=most)
        self.numbers = count()
        """Of what goes into `entries`; all else has the number 0."""
        self._first = self._behind = self._taken = self._told = 0

    def put(self, teller: object, time_s: float, who: object, source: Source | None, what: object, answer: Matches | None) -> None:
        """Add an entry; what is called in every question does the same without a call."""
        if self.keeps_all:
            self.entries.append((next(self.numbers), time_s, who, source, what, answer))
        else:
            self.slots[teller] = (0, time_s, who, source, what, answer)

    def put_pick(
        self, tellers: tuple[object, ...], time_s: float, who: object, source: Source, pick: Picked, answer: Matches
    ) -> None:
        """Add a pick, to the newest question of one of these where it is a pick of its answer."""
        if not self.keeps_all:
            for teller in tellers:
                asked = self.slots.get(teller)
                if asked is not None and asked[5] is answer:
                    self.picks[teller] = asked, (0, time_s, who, source, pick, answer)
                    return
        self.entries.append((next(self.numbers), time_s, who, source, pick, answer))

    def pieces(self) -> Iterator[list[Entry]]:
        """The entries that are there now, some at a time: to let go of many at once would take long."""
        n_pieces = max(len(self.slots), len(self.entries)) // AT_ONCE + 1
        for _ in range(n_pieces):
            if piece := self.take():
                yield piece

    def take(self) -> list[Entry]:
        """Some of the entries, oldest first."""
        taken = [self.slots.popitem()[1] for _ in range(min(len(self.slots), AT_ONCE))]
        picks = [self.picks.popitem()[1] for _ in range(min(len(self.picks), AT_ONCE))]
        taken += [asked for asked, _ in picks]
        taken += [pick for _, pick in picks]
        kept = [self.entries.popleft() for _ in range(min(len(self.entries), AT_ONCE))]  # the game only adds: there are no fewer
        if kept:
            self._taken += len(kept)
            self._behind = max(self._behind, kept[-1][0] + 1)
        if not taken:
            return kept
        return sorted({id(entry): entry for entry in (*taken, *kept)}.values(), key=itemgetter(1))

    def lost(self) -> int:
        """How many entries had to go since this was last asked, though somebody wanted all of them."""
        lost = self._behind - self._first - self._taken
        new, self._told = max(lost - self._told, 0), max(lost, self._told)
        return new

    def forget(self, pace: Callable[[], None]) -> None:
        """Let go what is there; it was for nobody."""
        for _ in self.pieces():
            pace()
        self._first, self._taken, self._told = self._behind, 0, 0


@dataclass(eq=False)
class Moment:
    """What becomes one line: a question, with the pick of its answer; a pick alone; or a decision."""

    entry: Entry
    time_s: float
    who: str | None
    source: Source | None
    facts: Mapping[str, object] | None = None
    actors: Actors | None = None
    answer: Matches | None = None
    pick: Picked | None = None
    decision: object = None
    _line: bytes | None = None

    @property
    def table(self) -> str | None:
        """The name of its table."""
        return None if self.source is None else self.source.name

    def line(self) -> bytes:
        """The line, made once."""
        if self._line is None:
            self._line = dumped(self._said())
        return self._line

    def in_full(self) -> Iterator[tuple[object, bytes]]:
        """The lines of a decision for who debugs it: its databases, which need be sent only once, and its row; each with a mark of
        what it says, None for what is always sent."""
        from contextdb.telemetry.link import decisions

        databases = decisions.databases_of(self.decision)
        if databases is not None:
            told = decisions.sent_databases(databases)
            mark = self.who, tuple((name, *each.values()) for name, each in told.items())
            yield mark, dumped({"line": DATABASES, "who": self.who, "databases": told})
        row = decisions.sent_row(self.decision)
        if row is not None:
            yield None, dumped({"line": DECISION, "t": round(self.time_s, 6), "who": self.who, "decision": {}, "row": row})

    def _said(self) -> Line:
        head: Line = {"t": round(self.time_s, 6), "who": self.who}
        if self.source is None:
            from contextdb.telemetry.link.decisions import sent_decision  # with the motion search: loaded by who tells of decisions

            return {"line": DECISION, **head, "decision": sent_decision(self.decision)}
        line: Line = {"line": PICK if self.facts is None else ASK, **head, "table": self.source.name}
        if self.facts is not None and self.answer is not None:
            line["facts"] = sent_facts(self.facts, self.source.asked)
            if self.actors is not None:
                line["actors"] = _sent_actors(self.actors, self.source.asked)
            line |= {"rows": f"{self.answer.bits:x}", "valid": self.answer.bits.bit_count()}
        if self.pick is not None:
            line["pick"] = {"row": self.pick.row, "asset": self.pick.asset}
        return line


def _sent_actors(actors: Actors, asked: Mapping[str, Condition]) -> Line:
    return {role: [sent_facts(actor, _of_role(role, asked)) for actor in listed] for role, listed in actors.items()}


def _of_role(role: str, asked: Mapping[str, Condition]) -> dict[str, Condition]:
    """The conditions of a role by the names that an actor's facts have."""
    head = f"{role}."
    return {name.removeprefix(head): condition for name, condition in asked.items() if name.startswith(head)}


class Moments:
    """Makes moments of entries: a pick joins the question whose answer it was made of."""

    def __init__(self) -> None:
        self._before: dict[int, Moment] = {}
        """The questions of the last entries by the identity of their answers, which they keep."""

    def of(self, entries: Sequence[Entry]) -> list[Moment]:
        """The moments, in their order."""
        asked: dict[int, Moment] = {}
        moments: list[Moment] = []
        for entry in entries:
            _, time_s, who, source, what, answer = entry
            if type(what) is Picked:
                moments += self._picked(entry, what, asked)
                continue
            name = None if who is None else str(who)
            if source is None:
                moments.append(Moment(entry, time_s, name, None, decision=what))
                continue
            facts, actors = what if type(what) is WithActors else (what, None)
            moments.append(Moment(entry, time_s, name, source, facts, actors, answer))
            asked[id(answer)] = moments[-1]
        self._before = dict(list(asked.items())[-MOST_BEFORE:])
        return moments

    def _picked(self, entry: Entry, pick: Picked, asked: Mapping[int, Moment]) -> Iterator[Moment]:
        """A moment for a pick, unless it joins one that is there."""
        _, time_s, who, source, _, answer = entry
        own = asked.get(id(answer))
        if own is not None and own.pick is None:
            own.pick = pick
            return
        before = own or self._before.get(id(answer))
        if before is None and who is UNNAMED:
            return
        name = before.who if before is not None else None if who is None else str(who)
        yield Moment(entry, time_s, name, source, answer=answer, pick=pick)


def newest(entries: Sequence[Entry]) -> list[Entry]:
    """Of each character and table the newest question, and the newest that was picked from; of each character the newest decision.
    With them the newest pick of each answer, unless its question is an older one."""
    picks: dict[int, Entry] = {}
    answers: set[int] = set()
    asked: dict[tuple[object, Source | None], Entry] = {}
    picked: dict[tuple[object, Source | None], Entry] = {}
    for entry in reversed(entries):
        answer = id(entry[5])
        if type(entry[4]) is Picked:
            picks.setdefault(answer, entry)
            continue
        answers.add(answer)
        key = (entry[2], entry[3])
        asked.setdefault(key, entry)
        if answer in picks:
            picked.setdefault(key, entry)
    kept = {id(entry): entry for entry in (*asked.values(), *picked.values())}
    own = {id(entry[5]) for entry in kept.values()}
    kept |= {id(entry): entry for answer, entry in picks.items() if answer in own or answer not in answers}
    return [entry for entry in entries if id(entry) in kept]
