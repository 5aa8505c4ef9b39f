"""One character: what it plays now, when it searches, and whether it jumps or plays on.

At each update the playing animation moves on. A search follows when one is due or forced, when the clip has ended, and when what
plays is no longer valid, loaded or among the databases of the moment. What would play on takes part in the search as the continuing
pose, with its bias; some frames are not candidates because of what plays and what was played (see
`contextdb/core/controller.h`). Without a result the character plays on, or holds the last frame of a clip that has
ended. What is no longer valid may play on for a while too: see `contextdb.motion.selection.guards`.

A controller reads no clock: the same calls, with the same seed, give the same decisions.

Source: the settings of Unreal's motion matching node (throttle, jump threshold, reselect history, continuing pose, interrupt);
DoNotChoose, NextNaturalOnly and root motion weight of EA's talk.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from contextdb.cells.arguments import as_number, require_kind
from contextdb.errors import ContextError, Fault, QueryError
from contextdb.motion import arguments
from contextdb.motion.arguments import Flags
from contextdb.motion.clips.ground_place import GroundPlace, OfBody, place_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.markup.tag_filter import TagFilter
from contextdb.motion.records import quickly_made
from contextdb.motion.selection.chooser import (
    ASK,
    CAUSE,
    CHOOSE,
    DECIDE,
    GONE,
    N_DECISION,
    PLAYING,
    Chooser,
    Given,
    Updates,
    own_valid,
    widens,
)
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.controller_state import ControllerState
from contextdb.motion.selection.decided import Asker, Question, decision_of
from contextdb.motion.selection.decision import Decision, Playing, Recorder, Watcher, plays
from contextdb.motion.selection.events import Event
from contextdb.motion.selection.search_options import Among, OfPenalties, OfTags, OfValid, OfValidForMany, SearchOptions
from contextdb.motion.selection.selector import Selector
from contextdb.motion.selection.variation import Rng, is_place, seed_of

Clock = Callable[[], float]
Place = tuple[Floats, int, Playing | None, bool]
FORCE, INTERRUPT = 1, 2


@quickly_made
@dataclass(frozen=True, slots=True)
class Asked:
    """What n controllers are asked with beside their queries and what is valid: one for each."""

    tags: Sequence[OfTags | None]
    bias: Sequence[Mapping[str, ArrayLike] | None]
    among: Sequence[Among | None]
    penalties: Sequence[OfPenalties | None]
    force: Sequence[bool]
    interrupt: Sequence[bool]
    event: Sequence[Event | None]

    @classmethod
    def of_one(
        cls,
        tags: OfTags | None = None,
        bias: Mapping[str, ArrayLike] | None = None,
        penalties: OfPenalties | None = None,
        among: Among | None = None,
        force: bool = False,
        interrupt: bool = False,
        event: Event | None = None,
    ) -> Asked:
        """What one is asked with."""
        return cls([tags], [bias], [among], [penalties], [force], [interrupt], [event])

    @property
    def is_plain(self) -> bool:
        """Whether nothing is given."""
        if self is nothing_asked(len(self.tags)):
            return True
        given = *self.tags, *self.bias, *self.among, *self.penalties, *self.event
        return not any(self.force) and not any(self.interrupt) and all(one is None for one in given)

    def options(self, i: int) -> SearchOptions:
        """Those of one, checked."""
        return SearchOptions(None, self.tags[i], None, self.bias[i], self.among[i], None, self.penalties[i])


@lru_cache
def nothing_asked(n: int) -> Asked:
    """What n are asked with where nothing is given."""
    nothing, no = (None,) * n, (False,) * n
    return Asked(nothing, nothing, nothing, nothing, no, no, nothing)


class Decided(NamedTuple):
    """The decisions of some controllers; and the updates that they are of, each with the numbers of its controllers."""

    decisions: list[Decision]
    updates: list[tuple[list[int], Updates]]


DEFAULT_SETTINGS, NOTHING_MORE = ControllerSettings(), SearchOptions()


class Controller:
    """Chooses what one character plays.

    Parameters
    ----------
    selector : Selector
        May be exchanged between updates, such as by `selector.with_database`: a database that is no longer there is left at once.
    settings : ControllerSettings
        May be exchanged too.
    recorder : Recorder, optional
        Is handed every decision.
    rng : int, random.Random or numpy Generator, optional
        The seed of the variation that the settings may ask for; one is drawn of a generator. Default: 0.
    clock : function, optional
        Gives seconds, such as `time.perf_counter`: only for `Decision.search_us`.

    Raises
    ------
    ContextError
        `selector`, `settings` or `rng` are none.
    """

    def __init__(
        self,
        selector: Selector,
        settings: ControllerSettings = DEFAULT_SETTINGS,
        recorder: Recorder | None = None,
        rng: Rng | int | None = None,
        clock: Clock | None = None,
    ) -> None:
        require_kind(selector, Selector, "selector", "a Selector")
        require_kind(settings, ControllerSettings, "settings", "ControllerSettings")
        self.selector, self.settings, self.recorder = selector, settings, recorder
        self._clock = clock
        self._watcher: Watcher | None = None
        """The link that watches the controller."""
        self._playing: Playing | None = None
        self._is_decoded = False
        self._stand(Chooser.of(selector, settings), ControllerState(rng=(seed_of(rng), 0)))

    @property
    def playing(self) -> Playing | None:
        """What plays now."""
        if not self._is_decoded:
            numbers = self._rows[self._at, PLAYING].tolist()
            self._playing = self._playing if numbers[0] == GONE else self._chooser.playing(numbers)
            self._is_decoded = True
        return self._playing

    def upcoming(self, dt_s: float) -> Playing | None:
        """What plays in some seconds if it plays on: the pose that the query of the next update is to be made of.

        A query with the pose of the last update lags behind, and the frame that it fits best is always one that steps back.
        Raises QueryError for what is no time.
        """
        seconds, chooser = seconds_of(dt_s), self.chooser
        moved, _ = chooser.move(self._row, seconds)
        return chooser.playing(moved[0, :4].tolist())

    def upcoming_features(self, dt_s: float) -> Floats | None:
        """The features of that frame, in the schema's units: float64 [F]; None where nothing plays. For a time that is checked."""
        moved, poses = self.chooser.move(self._row, dt_s, poses=True)
        return None if poses is None or moved[0, 0] < 0.0 else poses[0]

    @property
    def chooser(self) -> Chooser:
        """What the core knows of the selector and the settings, which may have been exchanged."""
        if self._chooser.selector is not self.selector or self._settings is not self.settings:
            self._stand(Chooser.of(self.selector, self.settings), self._state)
        return self._chooser

    def _stand(self, chooser: Chooser, state: ControllerState) -> None:
        """Stand where a state says."""
        self._chooser, self._settings = chooser, self.settings
        self._rows, self._at = chooser.encode(state), 0
        self._playing, self._is_decoded = state.playing, False

    @property
    def _row(self) -> Floats:
        """The controller's row: [1, W]."""
        return self._rows if len(self._rows) == 1 else self._rows[self._at : self._at + 1]

    @property
    def stand(self) -> tuple[Chooser, Floats]:
        """What the core knows of the selector and the settings, and where the controller is there: [1, W], not to be changed."""
        return self.chooser, self._row

    @property
    def row(self) -> Floats:
        """Where the controller is."""
        return self.stand[1]

    @property
    def _state(self) -> ControllerState:
        return self._chooser.state(self._rows[self._at].tolist(), self.playing)

    def stand_on(self, row: Floats) -> None:
        """Go on from a checked row [1, W] of this controller, or of another one with the same selector and settings."""
        self._rows, self._at, self._playing, self._is_decoded = row, 0, None, False

    @property
    def place(self) -> Place:
        """Where the controller is, to `put_back` this one with the same selector and settings; it costs less than `state`."""
        return self._rows, self._at, self._playing, self._is_decoded

    def put_back(self, place: Place) -> None:
        """Go back to where the controller was."""
        self._rows, self._at, self._playing, self._is_decoded = place

    def copy(self) -> Controller:
        """Another controller that stands where this one does, with the same selector and settings, and no recorder."""
        copied = Controller(self.selector, self.settings, clock=self._clock)
        copied._stand(self.chooser, self._state)
        return copied

    __copy__ = copy

    def __repr__(self) -> str:
        return f"<Controller: {plays(self.playing)}>"

    @property
    def state(self) -> ControllerState:
        """Where the controller is, to come back to with `restore`."""
        return self._state

    def restore(self, state: ControllerState) -> None:
        """Go on from a state of this controller, or of another one with the same selector and settings.

        Raises ContextError for what is no state.
        """
        require_kind(state, ControllerState, "state", "a ControllerState, what `state` gives")
        if not is_place(state.rng):
            raise ContextError(Fault("the rng of the state is no seed and count.", "what `state` gives, or None"))
        self._stand(self.chooser, replace(state, rng=self._state.rng) if state.rng is None else state)

    def update(
        self,
        dt_s: float,
        query: ArrayLike,
        valid: OfValid | None = None,
        tags: OfTags | None = None,
        context: Mapping[str, object] | None = None,
        *,
        bias: Mapping[str, ArrayLike] | None = None,
        penalties: OfPenalties | None = None,
        among: Among | None = None,
        force: bool = False,
        interrupt: bool = False,
        event: Event | None = None,
        body: OfBody | None = None,
    ) -> Decision:
        """Move what plays on by some time, search if it is time to, and say what plays now.

        Parameters
        ----------
        dt_s : float
            Seconds since the last update, 0 or more.
        query : float array, shape (F,)
            The pose at the end of this update, see `upcoming`, and the wished trajectory; in the schema's units.
        valid, tags, bias, penalties, among
            What may play, as for `Selector.search`. That an asset is no longer valid, or its database not among those of the
            moment, forces a search; that its tags do not fit lets it play on. The settings' guards may delay the jump out of an
            asset that is no longer valid.
        context : mapping of str to object, optional
            The facts of the moment, for the recorder alone.
        force : bool
            Search now, though no search is due. What plays may win, and guards hold.
        interrupt : bool
            Search now, and leave what plays if anything else may; no guard holds it.
        event : (str, float), optional
            A tag of the markup, `Contact.Left` and `Contact.Right` too, and in how many seconds it shall begin. Only frames are
            chosen that lead there in that time, at a play rate within the limits of their row or the settings; what plays is left
            at once when it does not; and the rate is that with which it happens on time, to half a frame. Give it in each update
            until then.
        body : Steered or (x, z, heading), optional
            Where the game has the body, for the recorder alone: `motion.measure` compares it with where the poses are.

        Raises
        ------
        QueryError
            A time, query, mask, tag or name that does not fit. The controller then stands where it stood.
        ContextError
            `body` is none.
        """
        wanted = self._checked(query)
        asked = Asked.of_one(tags, bias, penalties, among, force, interrupt, event)
        return update_all([self], seconds_of(dt_s), wanted[None], valid, asked, [context], [place_of(body)]).decisions[0]

    def _checked(self, query: ArrayLike) -> Floats:
        """The query as float64 [F], checked as long as any database is there to say how long it must be."""
        for database in self.selector.databases.values():
            return arguments.query_of(query, database.feature_names)
        return arguments.numbers_of(query, "the query")

    def check(self, asked: Asked, i: int) -> None:
        """Refuse what a controller cannot be asked with."""
        options, chooser = asked.options(i), self.chooser
        chooser.check_names(options, None)
        chooser.shared(options.tags, options.bias)
        chooser.among(options.among)
        if (event := asked.event[i]) is not None:
            chooser.to_event(event)

    @property
    def _n_candidates(self) -> int:
        n_recorded = 0 if self.recorder is None else self.recorder.n_candidates
        return n_recorded if self._watcher is None else max(n_recorded, self._watcher.n_candidates)

    def asker(self, asked: Asked, i: int) -> Asker:
        """Itself as the one of a number who is asked."""
        if self.recorder is None and self._watcher is None and self._clock is None:
            return Asker(i, self._playing)
        n_candidates = self._n_candidates
        return Asker(i, self._playing, n_candidates, asked.options(i) if n_candidates > 0 else None, self._clock is not None)

    def take(self, updates: Updates, at: int, decision: Decision) -> None:
        """Go on from one of some updates, and hand its decision over."""
        self._rows, self._at, self._is_decoded = updates.after, at, False
        if self.recorder is not None:
            self.recorder.record(decision)
        if self._watcher is not None and self._watcher.feed.is_open:
            self._watcher.decided(decision)

    def _now_s(self) -> float:
        """What the clock says; 0 without one."""
        return self._clock() if self._clock else 0.0


# ---- many: one is many of length one


def update_all(
    controllers: Sequence[Controller],
    dt_s: float,
    queries: Floats,
    valid: OfValidForMany | None,
    asked: Asked,
    contexts: Sequence[Mapping[str, object] | None],
    bodies: Sequence[GroundPlace | None] | Floats,
    moved: Floats | None = None,
) -> Decided:
    """What is decided for each of some controllers, with checked queries [Q, F], and what has `moved` [Q, 16] where that is known.
    If it raises, all stand where they stood."""
    decisions: list[Any] = [None] * len(controllers)
    made = []
    for numbers in _together(controllers, asked):
        own, parts = controllers, (queries, valid, moved)
        if len(numbers) < len(controllers):
            own = [controllers[i] for i in numbers]
            among = valid if valid is None else [own_valid(valid, i) for i in numbers]
            parts = queries[numbers], among, None if moved is None else moved[numbers]
        updates = prepared(own, dt_s, *parts, asked, numbers)
        search_us = _run(updates, own)
        made.append((numbers, updates))
        question = Question(queries, contexts, bodies, asked.force, asked.interrupt, asked.event, search_us)
        for k, i in enumerate(numbers):
            decisions[i] = decision_of(updates, k, question, own[k].asker(asked, i))
    for numbers, updates in made:
        for k, i in enumerate(numbers):
            controllers[i].take(updates, k, decisions[i])
    return Decided(decisions, made)


def _together(controllers: Sequence[Controller], asked: Asked) -> list[list[int]]:
    """The numbers of those that share selector, settings, tags and biases of frames; who is asked for an event is alone."""
    if len(controllers) == 1:
        return [[0]]
    groups: dict[object, list[int]] = {}
    if asked.is_plain:
        for i, one in enumerate(controllers):
            groups.setdefault(id(one.chooser), []).append(i)
        return list(groups.values())
    each = zip(controllers, asked.tags, asked.bias, asked.event, strict=True)
    for i, (one, tags, bias, event) in enumerate(each):
        key = id(one.chooser), tags if isinstance(tags, TagFilter) else id(tags), id(bias), -1 if event is None else i
        groups.setdefault(key, []).append(i)
    return list(groups.values())


def prepared(
    own: Sequence[Controller],
    dt_s: float,
    queries: Floats,
    valid: Any,
    moved: Floats | None,
    asked: Asked,
    numbers: Sequence[int],
) -> Updates:
    """The updates of controllers that go together, whose numbers among all are these, before their first step; with what is valid
    for them, and what has `moved` where that is known."""
    chooser, n, rows = own[0].chooser, len(own), rows_of(own)
    if moved is None:
        moved = chooser.move(rows, dt_s)[0]
    is_plain, is_answered = asked.is_plain, hasattr(valid, "table_assets")
    if not (is_plain and is_answered):
        chooser.check_names(NOTHING_MORE if is_plain else asked.options(numbers[0]), valid)
    flags, biases, plays = chooser.ranges(valid, n)
    is_widening = valid.is_widening if is_answered else widens(valid)
    wide = _wide(chooser, moved, flags, valid, asked, numbers) if is_widening else None
    if queries.shape[1] != chooser.n_features or not queries.flags.c_contiguous:
        queries = np.ascontiguousarray(queries[:, : chooser.n_features])
    given = Given(queries, dt_s, flags, biases, *chooser.nothing_more, np.zeros(n, np.uint8), wide, plays)
    if not is_plain:
        given = _with_more(given, chooser, moved, asked, numbers)
    found = np.empty((n, len(chooser.names), 3))
    return Updates(chooser, rows, moved, given, np.empty_like(rows), np.empty((n, N_DECISION)), found)


def _with_more(given: Given, chooser: Chooser, moved: Floats, asked: Asked, numbers: Sequence[int]) -> Given:
    """The same with all that is asked beside `valid`."""
    first, biases = asked.options(numbers[0]), given.range_biases
    if any(asked.penalties[i] is not None for i in numbers):
        biases = chooser.penalised(biases, [asked.options(i).penalties for i in numbers])
    among, among_each = chooser.among(None), [asked.among[i] for i in numbers]
    if any(each is not None for each in among_each):
        among = np.concatenate([chooser.among(each) for each in among_each])
    urgent = np.array([FORCE * bool(asked.force[i]) + INTERRUPT * bool(asked.interrupt[i]) for i in numbers], np.uint8)
    shared, event = chooser.shared(first.tags, first.bias), asked.event[numbers[0]]
    given = given._replace(range_biases=biases, shared=shared, among=among, urgent=urgent)
    if event is None:
        return given
    leading = chooser.leading(event, given.plays)
    d, _, frame = moved[0, :3].astype(np.int64).tolist()
    urgent[0] |= FORCE * (d >= 0 and not leading[chooser.frames_at[d].start + frame])
    shared = shared._replace(flags=leading if shared.flags is None else shared.flags & leading)
    return given._replace(shared=shared, to_event=chooser.to_event(event), event_s=event[1], leading=leading)


def _run(updates: Updates, own: Sequence[Controller]) -> float:
    """Ask, choose and decide; the microseconds of the search of each who searched, as the first one's clock says."""
    if not own[0]._clock:
        updates.run(ASK | CHOOSE | DECIDE)
        return 0.0
    updates.run(ASK)
    n_searched = int((updates.decisions[:, CAUSE] > 0.0).sum())
    began_s = own[0]._now_s() if n_searched else 0.0
    updates.run(CHOOSE)
    search_us = (own[0]._now_s() - began_s) * 1e6 / n_searched if n_searched else 0.0
    updates.run(DECIDE)
    return search_us


def rows_of(controllers: Sequence[Controller]) -> Floats:
    """The rows of controllers of one selector and settings: [Q, W]."""
    if len(controllers) == 1:
        return controllers[0]._row
    first = controllers[0]._rows
    if len(first) == len(controllers) and all(each._rows is first and each._at == i for i, each in enumerate(controllers)):
        return first
    return np.concatenate([each._row for each in controllers])


def _wide(chooser: Chooser, moved: Floats, ranges: Flags, valid: Any, asked: Asked, numbers: Sequence[int]) -> Floats:
    """The bias of what plays by hysteresis alone, NaN where that does not hold: float64 [Q]."""
    wide = np.full(len(moved), np.nan)
    for i, (d, at) in enumerate(moved[:, :2].astype(np.int64).tolist()):
        database = chooser.databases[d] if d >= 0 else None
        if database is None or ranges[i if len(ranges) > 1 else 0, chooser.ranges_at[d].start + at]:
            continue
        own = own_valid(valid, i)
        widened = arguments.widened_of(own.get(chooser.names[d]) if isinstance(own, Mapping) else own)
        if widened is not None and database.ranges_of(widened)[at]:
            penalty = asked.options(numbers[i]).of(chooser.names[d])["penalties"]
            wide[i] = database.filter(widened, penalties=penalty).range_biases[at]
    return wide


def seconds_of(dt_s: float) -> float:
    seconds = as_number(dt_s)
    if seconds is None or seconds < 0.0:
        raise QueryError(Fault(f"an update of {dt_s!r} seconds.", "a finite number, 0 or more"))
    return seconds
