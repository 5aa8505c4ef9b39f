"""What a game asked and picked, kept for the moment until the link's thread makes lines of it.

An entry is a tuple in a deque: to append it is all that the game's thread does. When the deque is full, the oldest entries go; they
are counted, since every entry has a number.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any, NamedTuple

from contextdb.cells.conditions import Condition
from contextdb.compiled.casting.facts import Actors
from contextdb.compiled.matches import Matches
from contextdb.telemetry.link.lines import ASK, DECISION, PICK, Line, dumped, sent_facts

MOST_ENTRIES = 1 << 11
"""Between two looks of the link's thread. More would have left the processor's cache when they go, and cost the game twice as
much."""
MOST_RECORDED = 1 << 15
"""The same where a file takes every question."""
AT_ONCE = 128
"""Entries that are looked through without a rest."""
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
    """The newest entries."""

    def __init__(self, most: int = MOST_ENTRIES) -> None:
        self.entries: deque[Entry] = deque(maxlen=most)
        self.numbers = count()
        self._first = self._behind = self._taken = self._told = 0

    def put(self, time_s: float, who: object, source: Source | None, what: object, answer: Matches | None) -> None:
        """Add an entry; what is called in every question does the same without a call."""
        self.entries.append((next(self.numbers), time_s, who, source, what, answer))

    def take(self) -> list[Entry]:
        """The entries that are there now, oldest first."""
        entries = self.entries
        taken = []
        for _ in range(len(entries)):
            try:
                taken.append(entries.popleft())
            except IndexError:  # nobody else takes any, but it is no fault either
                break
        if taken:
            self._taken += len(taken)
            self._behind = max(self._behind, taken[-1][0] + 1)
        return taken

    def lost(self) -> int:
        """How many entries had to go since this was last asked."""
        lost = self._behind - self._first - self._taken
        new, self._told = max(lost - self._told, 0), max(lost, self._told)
        return new

    def forget(self) -> None:
        """Let go what is there; it was for nobody."""
        self.take()
        self._first, self._taken, self._told = self._behind, 0, 0


@dataclass(eq=False)
class Moment:
    """What becomes one line: a question, with the pick of its answer; a pick alone; or a decision."""

    number: int
    """That of its entry."""
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
    """Makes moments of entries: a pick joins the question whose answer it was made of. `pace` is called now and then."""

    def __init__(self, pace: Callable[[], None]) -> None:
        self._pace = pace
        self._before: dict[int, Moment] = {}
        """The questions of the last entries by the identity of their answers, which they keep."""

    def of(self, entries: Sequence[Entry]) -> list[Moment]:
        """The moments, in their order."""
        asked: dict[int, Moment] = {}
        moments: list[Moment] = []
        for at, (number, time_s, who, source, what, answer) in enumerate(entries):
            if at % AT_ONCE == 0:
                self._pace()
            if type(what) is Picked:
                moments += self._picked(number, time_s, who, source, what, answer, asked)
                continue
            name = None if who is None else str(who)
            if source is None:
                moments.append(Moment(number, time_s, name, None, decision=what))
                continue
            facts, actors = what if type(what) is WithActors else (what, None)
            moments.append(Moment(number, time_s, name, source, facts, actors, answer))
            asked[id(answer)] = moments[-1]
        self._before = asked
        return moments

    def _picked(
        self,
        number: int,
        time_s: float,
        who: object,
        source: Source | None,
        pick: Picked,
        answer: Matches | None,
        asked: dict[int, Moment],
    ) -> Iterator[Moment]:
        """A moment for a pick, unless it joins one that is there."""
        own = asked.get(id(answer))
        if own is not None and own.pick is None:
            own.pick = pick
            return
        before = own or self._before.get(id(answer))
        if before is None and who is UNNAMED:
            return
        name = before.who if before is not None else None if who is None else str(who)
        yield Moment(number, time_s, name, source, answer=answer, pick=pick)


def newest(entries: Sequence[Entry], pace: Callable[[], None]) -> list[Entry]:
    """Of each character and table the newest question, and the newest that was picked from; of each character the newest decision.
    With them the newest pick of each answer, unless its question is an older one."""
    picks: dict[int, Entry] = {}
    answers: set[int] = set()
    asked: dict[tuple[object, Source | None], Entry] = {}
    picked: dict[tuple[object, Source | None], Entry] = {}
    for at, entry in enumerate(reversed(entries)):
        if at % AT_ONCE == 0:
            pace()
        answer = id(entry[5])
        if type(entry[4]) is Picked:
            picks.setdefault(answer, entry)
            continue
        answers.add(answer)
        key = (entry[2], entry[3])
        asked.setdefault(key, entry)
        if answer in picks:
            picked.setdefault(key, entry)
    kept = {entry[0]: entry for entry in (*asked.values(), *picked.values())}
    own = {id(entry[5]) for entry in kept.values()}
    kept |= {entry[0]: entry for answer, entry in picks.items() if answer in own or answer not in answers}
    return [kept[number] for number in sorted(kept)]
