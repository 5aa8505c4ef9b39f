"""From the numbers of an update to a `Decision`: its sentences and its records, made for those who want them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from contextdb.cells.row_play import RowPlay
from contextdb.motion.clips.ground_place import GroundPlace
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.markup.tag_filter import TagFilter
from contextdb.motion.search.candidates import Candidates
from contextdb.motion.search.filters import Filter
from contextdb.motion.selection import trigger
from contextdb.motion.selection.choice import Choice
from contextdb.motion.selection.chooser import ENTERED, GONE, Updates
from contextdb.motion.selection.decision import Action, Decision, Playing
from contextdb.motion.selection.events import Event
from contextdb.motion.selection.guards import Held
from contextdb.motion.selection.inputs import Inputs
from contextdb.motion.selection.root_motion import RootMotion
from contextdb.motion.selection.search_options import SearchOptions
from contextdb.motion.selection.trigger import Trigger
from contextdb.motion.selection.worked_out import WorkedOut

CAUSES, HELD, ACTIONS = (None, *Trigger), tuple(Held), tuple(Action)
"""What the numbers of the core mean."""
VALID, WIDENED = 0, 1


class Question(NamedTuple):
    """What some controllers are asked with beside the numbers of their updates; of each the same number."""

    queries: Floats
    contexts: Sequence[Mapping[str, object] | None]
    bodies: Sequence[GroundPlace | None] | Floats
    force: Sequence[bool]
    interrupt: Sequence[bool]
    event: Sequence[Event | None]
    search_us: float | None = None


class Asker(NamedTuple):
    """Who asks: its number among all, what it plays where the core does not know that any more, and how many candidates it records,
    with what else it is asked with."""

    number: int
    gone: Playing | None = None
    n_candidates: int = 0
    options: SearchOptions | None = None
    has_clock: bool = False


class Numbers(NamedTuple):
    """What the words of a decision are made of, in the core's order."""

    tick: float
    time_s: float
    action: float
    cause: float
    held: float
    cost: float | None
    continuing_cost: float | None
    chosen: Sequence[float]
    due_s: float
    waited_s: float

    @classmethod
    def of(cls, row: list[float]) -> Numbers:
        """A row of decisions."""
        cost, continuing = (None if each != each else each for each in row[14:16])
        return cls._make((*row[:5], cost, continuing, row[18:22], *row[27:29]))


def decision_of(updates: Updates, i: int, question: Question, by: Asker) -> Decision:
    """The decision of one of some updates. Its fields are worked out when one of them is first read: what poses are made of first,
    then the others."""
    return Decision.begun(partial(_fields, updates, i, question, by))


def _fields(updates: Updates, i: int, question: Question, by: Asker) -> dict[str, object]:
    """What poses are made of, and how to work out the other fields."""
    row, chooser = updates.decisions[i].tolist(), updates.chooser
    before = by.gone if row[10] == GONE else chooser.playing(row[10:14])
    return {
        "action": ACTIONS[int(row[2])],
        "playing": before if row[6:10] == row[10:14] else chooser.playing(row[6:10]),
        "before": before,
        "continuing_cost": None if row[15] != row[15] else row[15],
        "root_motion": RootMotion(*row[22:25]),
        "root_weight": row[25],
        "play_rate": row[26],
        "play": RowPlay.of(row[31:39]),
        "_rest": partial(_rest, updates, i, row, before, question, by),
    }


def _rest(updates: Updates, i: int, row: list[float], before: Playing | None, question: Question, by: Asker) -> dict[str, object]:
    """The other fields of a decision."""
    numbers, chooser, query = Numbers.of(row), updates.chooser, question.queries[by.number]
    cause, body = CAUSES[int(numbers.cause)], question.bodies[by.number]
    choice = None if cause is None else updates.choice(i)
    filters: tuple[tuple[str, Filter], ...] = ()
    candidates: Sequence[tuple[str, Candidates]] = ()
    if choice is not None and by.n_candidates > 0:
        among = updates.given.among[i if len(updates.given.among) > 1 else 0].tolist()
        each = zip(chooser.names, chooser.databases, among, strict=True)
        filters = tuple((name, updates.filter_of(i, d)) for d, (name, own, is_in) in enumerate(each) if own is not None and is_in)
        if filters:
            candidates = WorkedOut(chooser.selector.databases, query, filters, choice, by.n_candidates)
    why, event = _why(updates, i, numbers, cause, before, choice), question.event[by.number]
    if event is not None and cause is Trigger.FORCED and before is not None and not question.force[by.number]:
        why = trigger.astray(why, before, event)
    return {
        "tick": int(numbers.tick),
        "time_s": numbers.time_s,
        "why": why,
        "searched": cause is not None,
        "cost": numbers.cost,
        "choice": choice,
        "context": question.contexts[by.number],
        "query": query,
        "candidates": candidates,
        "search_us": question.search_us if by.has_clock and cause is not None else None,
        "body": tuple(body.tolist()) if isinstance(body, np.ndarray) else body,
        "held": str(HELD[int(numbers.held)]),
        "filters": filters,
        "inputs": _inputs(updates, question, by) if by.n_candidates > 0 else None,
        "together": None,
    }


def _inputs(updates: Updates, question: Question, by: Asker) -> Inputs:
    """For a recorder, what else an update was given."""
    chooser, options, given = updates.chooser, by.options, updates.given
    assert options is not None, "they are handed over where somebody records"
    among = None if options.among is None else tuple(sorted(chooser.selector.among(options.among)))
    tags = options.tags
    if tags is None or isinstance(tags, TagFilter):
        named: TagFilter | Mapping[str, TagFilter] | None = tags
    else:  # flags of frames are in the filters
        named = {name: each for name, each in tags.items() if isinstance(each, TagFilter)}
    force, interrupt = bool(question.force[by.number]), bool(question.interrupt[by.number])
    return Inputs(given.dt_s, force, interrupt, among, named, chooser.settings, question.event[by.number])


def _why(updates: Updates, i: int, numbers: Numbers, cause: Trigger | None, before: Playing | None, choice: Choice | None) -> str:
    """The decision in one sentence."""
    held, chooser = HELD[int(numbers.held)], updates.chooser
    if cause is None or choice is None:
        assert before is not None, "without anything playing there is a cause to search"
        if held is Held.HYSTERESIS:
            return trigger.by_hysteresis(trigger.not_due(numbers.due_s), before)
        return trigger.held(before, held.sentence) if held else trigger.not_due(numbers.due_s)
    if not choice:
        return trigger.nothing_else(cause, before, cause is Trigger.ENDED)
    action = ACTIONS[int(numbers.action)]
    if action in (Action.START, Action.JUMP) or held is Held.COST_BAR:
        d, at, frame, cost = numbers.chosen
        database = chooser.databases[int(d)]
        assert database is not None, "what is chosen is of a database that is there"
        entry_s = (frame - float(database.starts[int(at)])) / chooser.rates[int(d)]
        playing = chooser.playing((d, at, frame, entry_s))
        assert playing is not None, "something was chosen"
        bar = chooser.settings.bar_of(database)
        if held is Held.COST_BAR and before is not None:
            return trigger.waiting(before, playing, cost, bar, chooser.settings.grace_s - numbers.waited_s)
        why = trigger.jumped(cause, before, playing, cost, choice, numbers.continuing_cost)
        is_over = cause is Trigger.NOT_VALID and cost > bar
        return trigger.last_resort(why, bar, numbers.waited_s) if is_over else why
    assert before is not None, "only what plays can play on"
    assert numbers.continuing_cost is not None, "a frame that wins has a cost"
    varies, best = chooser.settings.variation, choice.hit.cost
    if numbers.continuing_cost > best + (0.0 if varies is None else varies.within):
        stayed_s = numbers.time_s - float(updates.before[i, ENTERED])
        why = trigger.settling(cause, before, numbers.continuing_cost, best, stayed_s)
    else:
        why = trigger.continued(cause, before, numbers.continuing_cost, best)
    return trigger.by_hysteresis(why, before) if held is Held.HYSTERESIS else why
