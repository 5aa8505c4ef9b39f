"""What a game asked and picked, kept for the moment until the link's thread makes lines of it.

An entry is a tuple in a deque: to append it is all that the game's thread does. When the deque is full, the oldest entries go; they
are counted, since every entry has a number.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import count
from typing import Any, NamedTuple

from contextdb.cells.conditions import Condition
from contextdb.compiled.casting.facts import Actors
from contextdb.compiled.matches import Matches
from contextdb.telemetry.link.lines import ASK, DECISION, PICK, Line, dumped, sent_facts

MOST_ENTRIES = 1 << 13
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
        self._taken += len(taken)
        self._behind = max([self._behind, *(entry[0] + 1 for entry in taken)])
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
    """Makes moments of entries: a pick joins the question whose answer it was made of."""

    def __init__(self) -> None:
        self._before: dict[int, Moment] = {}
        """The questions of the last entries by the identity of their answers, which they keep."""

    def of(self, entries: Iterable[Entry]) -> list[Moment]:
        """The moments, in their order."""
        asked: dict[int, Moment] = {}
        moments: list[Moment] = []
        for _, time_s, who, source, what, answer in entries:
            if isinstance(what, Picked):
                moments += self._picked(time_s, who, source, what, answer, asked)
                continue
            name = None if who is None else str(who)
            if source is None:
                moments.append(Moment(time_s, name, None, decision=what))
                continue
            facts, actors = what if isinstance(what, WithActors) else (what, None)
            moments.append(Moment(time_s, name, source, facts, actors, answer))
            asked[id(answer)] = moments[-1]
        self._before = asked
        return moments

    def _picked(
        self, time_s: float, who: object, source: Source | None, pick: Picked, answer: Matches | None, asked: dict[int, Moment]
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
        yield Moment(time_s, name, source, answer=answer, pick=pick)


def newest(moments: Iterable[Moment]) -> list[Moment]:
    """Of each character and table the newest question and the newest pick, of each character the newest decision."""
    kept: list[Moment] = []
    seen: set[tuple[str | None, str | None]] = set()
    picked: set[tuple[str | None, str | None]] = set()
    for moment in reversed(list(moments)):
        key = (moment.who, moment.table)
        is_new = key not in (seen if moment.pick is None else picked)
        if is_new:
            kept.append(moment)
        if moment.pick is not None:
            picked.add(key)
        if moment.pick is None or moment.facts is not None:
            seen.add(key)
    kept.reverse()
    return kept
