"""What a game publishes, in one queue until the link's thread takes it, and the moments that become lines.

The game's thread puts a tuple into the queue for each question, pick and decision, while somebody listens. A full queue drops what
comes next, and counts it.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from time import monotonic
from typing import NamedTuple, Protocol

from contextdb.cells.conditions import Condition
from contextdb.cells.facts import Context
from contextdb.compiled.casting.facts import Actors
from contextdb.compiled.matches import Matches
from contextdb.telemetry.link.lines import ASK, BONES, DATABASES, DECISION, PICK, POSE, Line, cut_name, dumped, sent_facts

MOST_ENTRIES = 1 << 13
"""Entries that wait for the link's thread at most."""
MOST_BEFORE = 32
"""Questions of the tick before that a pick may be of."""

Who = str | Callable[[], object] | None
"""Who asks: a name, or what gives it, called in each question; None where nobody is named."""


class Decisions(Protocol):
    """What makes plain data of decisions: `contextdb.motion.trace.published`."""

    def is_decision(self, value: object, /) -> bool: ...

    def plain(self, decision: object, /) -> object: ...

    def row(self, decision: object, /) -> str | None: ...

    def is_pose(self, pose: object, rig: object, /) -> bool: ...

    def bones(self, rig: object, /) -> Mapping[str, object]: ...

    def pose(self, pose: object, rig: object, /) -> Mapping[str, object]: ...

    def digests(self, decision: object, /) -> Mapping[str, Mapping[str, str]]: ...


@dataclass(frozen=True, eq=False)
class Source:
    """A table that is watched: what the lines say of it."""

    name: str
    version: str
    n_rows: int
    conditions: Mapping[str, Condition]

    def line(self) -> Line:
        conditions = {name: condition.domain.kind for name, condition in self.conditions.items()}
        return {"version": self.version, "rows": self.n_rows, "conditions": conditions}


class Picked(NamedTuple):
    """The row that was picked of an answer, and its asset; no row where it is the fallback."""

    row: int | None
    asset: str | None


class Posed(NamedTuple):
    """A pose, and the rig that it is of."""

    pose: object
    rig: object


Entry = tuple[float, object, Source | None, object, Matches | None, Actors | None]
"""Seconds, who, the table, what (facts, `Picked`, `Posed` or a decision), the answer, the actors that were offered."""


class Feed:
    """The queue of a link. Any thread of the game puts entries, the link's thread takes them."""

    def __init__(self, most: int = MOST_ENTRIES) -> None:
        self.is_open = False
        """Whether somebody listens."""
        self.wants_filters = False
        """Whether somebody debugs: decisions then say what could be chosen."""
        self.wants_poses = False
        self.entries: deque[Entry] = deque()
        self._most = most
        self._n_dropped = 0
        self._lock = threading.Lock()

    def put(self, label: object, source: Source | None, what: object, answer: Matches | None = None) -> None:
        """Add an entry, unless the queue is full."""
        if self.has_room():
            self.entries.append((monotonic(), label, source, what, answer, None))

    def has_room(self) -> bool:
        """Whether an entry fits; where none does it is counted as dropped."""
        if len(self.entries) < self._most:
            return True
        with self._lock:
            self._n_dropped += 1
        return False

    def take(self, most: int) -> Iterator[Entry]:
        for _ in range(min(most, len(self.entries))):
            yield self.entries.popleft()  # the game only adds

    def dropped(self) -> int:
        """How many entries were dropped since the last call."""
        with self._lock:
            n_dropped, self._n_dropped = self._n_dropped, 0
        return n_dropped


class Watcher:
    """Puts what one table, live context or controller does into the feed; `_watcher` of that. A copy of it is watched by nobody."""

    def __init__(
        self,
        feed: Feed,
        label: Who,
        source: Source | None = None,
        keep: Callable[[Context], dict[str, object]] = dict,
        has_questions: bool = True,
    ) -> None:
        self.feed, self.source = feed, source
        self._who, self._keep = label, keep
        self.has_questions = has_questions
        """Whether the table itself is watched, and not only a live context of it, of whose answers it publishes the picks."""

    def __reduce__(self) -> tuple[object, ...]:
        return type(None), ()

    def rename(self, label: Who) -> None:
        """Publish what comes next under another name, questions too."""
        self._who, self.has_questions = label, True

    def answered(self, context: Context, answer: Matches, actors: Actors | None = None) -> None:
        label, feed = self._who, self.feed
        if self.has_questions and feed.has_room():
            offered = None if actors is None else {role: [dict(actor) for actor in listed] for role, listed in actors.items()}
            name = label() if callable(label) else label
            feed.entries.append((monotonic(), name, self.source, self._keep(context), answer, offered))

    def picked(self, answer: Matches, row: int | None, asset: str | None) -> None:
        self.feed.put(self._name() if self.has_questions else _UNNAMED, self.source, Picked(row, asset), answer)

    @property
    def n_candidates(self) -> int:
        """Some where somebody debugs, so that a decision says what could be chosen."""
        return int(self.feed.wants_filters)

    def decided(self, decision: object) -> None:
        self.feed.put(self._name(), None, decision)

    def _name(self) -> object:
        return self._who() if callable(self._who) else self._who


_UNNAMED = object()
"""Who picks in a table of which only live contexts are watched: a pick of another answer is nobody's."""


@dataclass(eq=False)
class Moment:
    """What becomes one line: a question, with the pick of its answer; a pick alone; a decision, or a pose."""

    time_s: float
    who: str | None
    source: Source | None
    facts: Context | None = None
    answer: Matches | None = None
    actors: Actors | None = None
    pick: Picked | None = None
    decision: object = None
    _line: bytes | None = None

    @property
    def table(self) -> str | None:
        return None if self.source is None else self.source.name

    @property
    def is_pose(self) -> bool:
        return isinstance(self.decision, Posed)

    @property
    def is_sent(self) -> bool:
        """Whether its line was made, so that a pick comes too late for it."""
        return self._line is not None

    def line(self, decisions: Decisions | None) -> bytes:
        if self._line is None:
            self._line = dumped(self._content(decisions))
        return self._line

    def in_full(self, decisions: Decisions) -> Iterator[tuple[object, bytes]]:
        """The lines of a decision for who debugs it: its databases, which need be sent only once, and its row; those of a pose: its
        bones, only once too, and itself. Each with a mark of its content, None for what is always sent."""
        if isinstance(self.decision, Posed):
            bones = dumped({"line": BONES, "who": self.who, **decisions.bones(self.decision.rig)})
            yield bones, bones
            yield None, self.line(decisions)
            return
        if digests := decisions.digests(self.decision):
            mark = self.who, tuple((name, *each.values()) for name, each in digests.items())
            yield mark, dumped({"line": DATABASES, "who": self.who, "databases": digests})
        if (row := decisions.row(self.decision)) is not None:
            yield None, dumped({"line": DECISION, "t": round(self.time_s, 6), "who": self.who, "decision": {}, "row": row})

    def _content(self, decisions: Decisions | None) -> Line:
        head: Line = {"t": round(self.time_s, 6), "who": self.who}
        if isinstance(self.decision, Posed):
            return {"line": POSE, **head, **(decisions.pose(*self.decision) if decisions else {})}
        if self.source is None:
            return {"line": DECISION, **head, "decision": decisions.plain(self.decision) if decisions else {}}
        line: Line = {"line": PICK if self.facts is None else ASK, **head, "table": self.source.name}
        if self.facts is not None and self.answer is not None:
            line["facts"] = sent_facts(self.facts, self.source.conditions)
            if self.actors is not None:
                line["actors"] = _sent_actors(self.actors, self.source.conditions)
            line |= {"rows": f"{self.answer.bits:x}", "valid": self.answer.bits.bit_count()}
        if self.pick is not None:
            line["pick"] = {"row": self.pick.row, "asset": self.pick.asset}
        return line


def _sent_actors(actors: Actors, conditions: Mapping[str, Condition]) -> Line:
    return {role: [sent_facts(actor, _of_role(role, conditions)) for actor in listed] for role, listed in actors.items()}


def _of_role(role: str, conditions: Mapping[str, Condition]) -> dict[str, Condition]:
    """The conditions of a role by the names that an actor's facts have."""
    head = f"{role}."
    return {name.removeprefix(head): condition for name, condition in conditions.items() if name.startswith(head)}


class Moments:
    """Makes moments of entries: a pick joins the question whose answer it was made of. Times count from `began_s`."""

    def __init__(self, began_s: float = 0.0) -> None:
        self._began_s = began_s
        self._questions: dict[int, Moment] = {}
        """The latest questions by the identity of their answers, which they hold."""
        self._newest: dict[tuple[str | None, str | None, bool, bool], Moment] = {}
        """By who, table, whether it has a pick, and whether it is a pose."""

    def of(self, entries: Iterable[Entry]) -> list[Moment]:
        """The moments of some entries, in their order."""
        moments: list[Moment] = []
        for time_s, label, source, what, answer, actors in entries:
            name = None if label is None or label is _UNNAMED else cut_name(str(label))
            moment = Moment(time_s - self._began_s, name, source)
            if source is None:
                moment.decision = what
            elif isinstance(what, Picked):
                newest = self._newest.get((name, source.name, False, False))
                question = newest if answer is None else self._questions.get(id(answer))
                if question is None and label is _UNNAMED:
                    continue
                if question is not None and not (question.is_sent or question.pick):
                    question.pick = what
                    self._newest[question.who, question.table, True, False] = question
                    continue
                moment.pick, moment.answer, moment.who = what, answer, name if question is None else question.who
            else:
                moment.facts, moment.answer, moment.actors = what, answer, actors  # type: ignore[assignment]
                self._questions[id(answer)] = moment
            self._newest[moment.who, moment.table, moment.pick is not None, moment.is_pose] = moment
            moments.append(moment)
        return moments

    def newest(self) -> list[Moment]:
        """Of each character and table the newest question, and the newest that was picked from; of each character the newest
        decision and pose; since the last call."""
        newest = {id(moment): moment for moment in self._newest.values()}
        self._newest.clear()
        self._questions = dict(list(self._questions.items())[-MOST_BEFORE:])
        return sorted(newest.values(), key=lambda moment: moment.time_s)
