"""One update of a controller: whether it searches, what it leaves out, and what comes of it. Changes nothing but the generator."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto

import numpy as np

from contextdb.motion.arguments import ValidRanges, widened_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.markup.left_out import LeftOut, Skip
from contextdb.motion.records import quickly_made
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filters import Filter
from contextdb.motion.search.hit import Hit
from contextdb.motion.selection import guards, trigger
from contextdb.motion.selection.asked import Asked, OfValid
from contextdb.motion.selection.choice import Choice, Reason
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.controller_state import ControllerState
from contextdb.motion.selection.decision import Action, Playing
from contextdb.motion.selection.guards import Held
from contextdb.motion.selection.history import (
    Played,
    ended_skip,
    history_skips,
    in_every_permutation,
    played_spans,
    playing_skips,
    remembered,
)
from contextdb.motion.selection.ongoing import Ongoing, playing_at
from contextdb.motion.selection.playhead import TOLERANCE_S, Playhead
from contextdb.motion.selection.selector import Selector
from contextdb.motion.selection.trigger import Trigger
from contextdb.motion.selection.variation import Rng


class Standing(Enum):
    """Whether the playing asset is valid: as it is, by hysteresis alone, or not."""

    VALID = auto()
    WIDENED = auto()
    NOT_VALID = auto()


@quickly_made
@dataclass(frozen=True, slots=True)
class Outcome:
    """What an update comes to; the attributes are those of `Decision`."""

    action: Action
    why: str
    playing: Playing | None
    cost: float | None = None
    continuing_cost: float | None = None
    choice: Choice | None = None
    held: Held = Held.NOTHING


@quickly_made
@dataclass(frozen=True, slots=True)
class Step:
    """An update under way: where the controller is, what it is asked, and what plays and was played, moved on."""

    selector: Selector
    settings: ControllerSettings
    state: ControllerState
    dt_s: float
    query: Floats
    asked: Asked
    ongoing: Ongoing | None
    history: tuple[Played, ...]
    standing: Standing

    @classmethod
    def of(
        cls,
        selector: Selector,
        settings: ControllerSettings,
        state: ControllerState,
        dt_s: float,
        query: Floats,
        asked: Asked,
        ongoing: Ongoing | None,
    ) -> Step:
        """An update that moved what plays on by some time, to `ongoing`."""
        now_s, for_s = state.time_s + dt_s, settings.history_s
        name, spans = (
            ("", ())
            if ongoing is None
            else (ongoing.database, played_spans(ongoing.head.database, ongoing.head.range, ongoing.move.spans))
        )
        history = remembered(state.history, name, spans, now_s, for_s)
        standing = Standing.NOT_VALID if ongoing is None else _standing(ongoing, asked)
        return cls(selector, settings, state, dt_s, query, asked, ongoing, history, standing)

    @property
    def now_s(self) -> float:
        """Seconds of play, this update's in it."""
        return self.state.time_s + self.dt_s

    @property
    def before(self) -> Playing | None:
        """What would play without a search; or, where it cannot, what played."""
        return self.state.playing if self.ongoing is None else self.ongoing.playing

    @property
    def due_s(self) -> float:
        """Seconds until the next search is due."""
        return self.settings.search_every_s - self.state.since_search_s - self.dt_s

    @property
    def waited_s(self) -> float:
        """For how long a forced jump over the cost bar has waited."""
        since_s = self.state.waiting_since_s
        return 0.0 if since_s is None else self.now_s - since_s

    # ---- whether to search

    def trigger(self, force: bool, interrupt: bool) -> Trigger | None:
        """Why to search now; None not to."""
        if self.ongoing is None:
            return Trigger.NOTHING_PLAYS if self.state.playing is None else Trigger.LOST
        if self.ongoing.move.is_ended:
            return Trigger.ENDED
        if self.ongoing.database not in self.selector.among(self.asked.among):
            return Trigger.NOT_AMONG
        if interrupt:
            return Trigger.INTERRUPTED
        if self.standing is Standing.NOT_VALID:
            return Trigger.NOT_VALID
        if force:
            return Trigger.FORCED
        return Trigger.DUE if self.due_s <= TOLERANCE_S else None

    def held(self, cause: Trigger | None) -> Held:
        """Which guard lets play on what is no longer valid, without a search."""
        if cause is None and self.standing is Standing.WIDENED:
            return Held.HYSTERESIS
        if cause is not Trigger.NOT_VALID or self.ongoing is None:
            return Held.NOTHING
        return guards.held_without_search(self.ongoing, self.settings)

    # ---- what to leave out

    def permuted(self) -> Step:
        """The same, with what plays in the permutation of its clip that costs least now: all of them show one and the same."""
        if self.ongoing is None or self.ongoing.head.database.n_permutations == 1:
            return self
        chosen = self.ongoing.head.database.filter(**self.asked.of(self.ongoing.database))
        return replace(self, ongoing=self.ongoing.cheapest(self.query, chosen))

    def wanted(self, cause: Trigger) -> Asked:
        """What the selector is asked: beside what the caller asks, what may play on, and what is left out."""
        known, played = self.selector.databases, history_skips(self.history)
        skip = {name: in_every_permutation(known[name], skips) for name, skips in played.items() if name in known}
        if self.ongoing is None:
            return self.asked.searched(self.asked.valid, None, skip)
        name, frame = self.ongoing.database, self.ongoing.move.frame
        current = (name, frame) if cause.may_continue else None
        skips = [*self._skips(self.ongoing), *skip.get(name, ())]
        if current is None or self.standing is not Standing.WIDENED:
            return self.asked.searched(self.asked.valid, current, {**skip, name: skips})
        head = self.ongoing.head
        alone = Skip(head.start, head.stop, LeftOut.NOT_VALID)
        return self.asked.searched(self._widened_for(self.ongoing), current, {**skip, name: [alone, *skips]})

    def _widened_for(self, ongoing: Ongoing) -> OfValid:
        """What may play, and with it the range that plays, with what its widened row costs."""
        valid = {name: self.asked.of(name)["valid"] for name in self.selector.databases}
        own, at, database = valid[ongoing.database], ongoing.head.range, ongoing.head.database
        exact, wide = database.filter(own), database.filter(widened_of(own))
        flags, biases = exact.ranges.copy(), exact.range_biases.copy()
        flags[at], biases[at] = True, wide.range_biases[at]
        return {**{name: each for name, each in valid.items() if each is not None}, ongoing.database: ValidRanges(flags, biases)}

    def _skips(self, ongoing: Ongoing) -> Sequence[Skip]:
        head, frame = ongoing.head, ongoing.move.frame
        if ongoing.move.is_ended:
            skips = [ended_skip(head, frame, max(self.settings.jump_threshold_s, self.settings.search_every_s))]
        else:
            skips = list(playing_skips(head, frame, self.settings.jump_threshold_s))
        return in_every_permutation(head.database, skips, head.range)

    # ---- what comes of it

    def unsearched(self, ongoing: Ongoing, held: Held) -> Outcome:
        """What plays, plays on."""
        if held is Held.HYSTERESIS:
            why = trigger.by_hysteresis(trigger.not_due(self.due_s), ongoing.playing)
        else:
            why = trigger.held(ongoing.playing, held.told) if held else trigger.not_due(self.due_s)
        return Outcome(_onward(ongoing), why, ongoing.playing, held=held)

    def searched(self, cause: Trigger, asked: Asked, choice: Choice, rng: Rng | None) -> Outcome:
        """What is made of the selector's choice: to play on, to jump, or, when nothing is found, to make do with what there is."""
        if not choice:
            return self._nothing_else(cause, choice)
        continuing = self._continuing_cost(asked, choice)
        hit = self._varied(asked, choice, continuing, rng)
        if hit is None or _is_current(hit, choice, asked):
            assert self.ongoing is not None, "only what plays can play on"
            assert continuing is not None, "a frame that wins has a cost"
            why = trigger.continued(cause, self.ongoing.playing, continuing, choice.hit.cost)
            held = Held.HYSTERESIS if self.standing is Standing.WIDENED else Held.NOTHING
            if held:
                why = trigger.by_hysteresis(why, self.ongoing.playing)
            return Outcome(_onward(self.ongoing), why, self.ongoing.playing, continuing, continuing, choice, held)
        playing = self._playing(choice, hit)
        why = trigger.jumped(cause, self.before, playing, hit.cost, choice, continuing)
        bar = self.settings.bar_of(self.selector.databases[playing.database])
        if cause is Trigger.NOT_VALID and self.ongoing is not None and hit.cost > bar:
            left_s = self.settings.grace_s - self.waited_s
            if left_s > TOLERANCE_S:
                why = trigger.waiting(self.ongoing.playing, playing, hit.cost, bar, left_s)
                return Outcome(_onward(self.ongoing), why, self.ongoing.playing, choice=choice, held=Held.COST_BAR)
            why = trigger.last_resort(why, bar, self.waited_s)
        action = Action.START if self.state.playing is None else Action.JUMP
        return Outcome(action, why, playing, hit.cost, continuing, choice)

    def _nothing_else(self, cause: Trigger, choice: Choice) -> Outcome:
        why = trigger.nothing_else(cause, self.before, cause is Trigger.ENDED)
        if self.ongoing is None:
            return Outcome(Action.NOTHING, why, None, choice=choice)
        action = Action.HOLD if cause is Trigger.ENDED else _onward(self.ongoing)
        return Outcome(action, why, self.ongoing.playing, choice=choice)

    def _continuing_cost(self, asked: Asked, choice: Choice) -> float | None:
        if asked.current is None or self.ongoing is None:
            return None
        if _is_current(choice.hit, choice, asked):
            return choice.hit.cost
        database = self.ongoing.head.database
        return continuing_cost(database, self.query, database.filter(**asked.of(self.ongoing.database)))

    def _varied(self, asked: Asked, choice: Choice, continuing: float | None, rng: Rng | None) -> Hit | None:
        """The hit to play: the choice's, or one about as good. None to play on, which comes before all that is about as good."""
        variation = self.settings.variation
        if variation is None or rng is None:
            return choice.hit
        name, limit = str(choice.database), choice.hit.cost + variation.within
        below = _below(choice)
        is_comparable = below == math.inf or (self.ongoing is not None and self.ongoing.database == name)
        if continuing is not None and is_comparable and continuing <= limit:
            return None
        ties = self.selector.best_of_ranges(name, self.query, variation.within, **asked.options())
        return variation.choose([hit for hit in ties if hit.cost < below], self.state.recent, rng)

    def _playing(self, choice: Choice, hit: Hit) -> Playing:
        name = str(choice.database)
        head = Playhead.of(self.selector.databases[name], hit.range, self.settings.rate)
        return playing_at(name, head, hit.frame, (hit.frame - head.start) / head.rate)


def _standing(ongoing: Ongoing, asked: Asked) -> Standing:
    """Whether the playing asset is still valid. A mask that does not fit is refused here, also where nothing hangs on it."""
    database, at, valid = ongoing.head.database, ongoing.head.range, asked.valid_of(ongoing.database)
    if (database.ranges_of(valid) if asked.is_plain else database.filter(**asked.of(ongoing.database)).ranges)[at]:
        return Standing.VALID
    wide = widened_of(valid)
    is_widened = wide is not None and database.ranges_of(wide)[at]
    return Standing.WIDENED if is_widened else Standing.NOT_VALID


def _onward(ongoing: Ongoing) -> Action:
    return Action.LOOP if ongoing.move.n_loops else Action.CONTINUE


def _is_current(hit: Hit, choice: Choice, asked: Asked) -> bool:
    return asked.current == (choice.database, hit.frame)


def _below(choice: Choice) -> float:
    """The threshold that the winner is under, if that is why it won; else infinite."""
    found = next((search.threshold for search in choice.searches if search.database == choice.database), None)
    return found if found is not None and choice.reason is Reason.UNDER_THRESHOLD else math.inf


# ---- what it would cost to play on


def continuing_cost(database: MotionDatabase, query: Floats, chosen: Filter) -> float | None:
    """The cost of the current frame of a filter that `database.filter` made with it, the continuing bias in it; None when there is
    none or it may not play on. `query` float64 [F] is checked, and in the schema's units."""
    frame = chosen.current
    at = database.range_of(frame) if frame >= 0 else -1
    if at < 0 or not chosen.ranges[at] or (len(chosen.frames) and not chosen.frames[frame]):
        return None
    kind = int(database.marks.kinds[frame])
    if not chosen.kinds.playable[kind]:
        return None
    bias = float(chosen.range_biases[at] + chosen.kinds.biases[kind])
    if len(chosen.frame_biases):
        bias += float(chosen.frame_biases[frame])
    wanted = database.normalisation.apply(query)
    total = _cost(database, frame, wanted) + (bias + chosen.continuing)
    return total if total < math.inf else None


def _cost(database: MotionDatabase, frame: int, query: Floats) -> float:
    """The cost of one frame for a normalised query: the sums of `search.cost`, in their order, without their arrays."""
    values, wanted = database.layout.take(np.array([frame]))[0].tolist(), query.tolist()
    squares = [(value - want) * (value - want) for value, want in zip(values, wanted, strict=True)]
    return _sum(
        weight * _sum(squares[columns]) for columns, weight in zip(database.slices, database.cost_weights.tolist(), strict=True)
    )


def _sum(values: Iterable[float]) -> float:
    """A sum added one by one, each step rounded: Python's own keeps what is rounded away, from 3.12 on."""
    total = 0.0
    for value in values:
        total += value
    return total
