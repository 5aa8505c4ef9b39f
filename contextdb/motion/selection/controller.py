"""One character: what it plays now, when it searches, and whether it jumps or plays on.

At each update the playing animation moves on. A search follows when one is due or forced, when the clip has ended, and when what
plays is no longer valid, loaded or among the databases of the moment. What would play on takes part in the search as the continuing
pose, with its bias; some frames are not candidates because of what plays and what was played (see
`contextdb.motion.selection.history`). When nothing is found, the character plays on, or holds the last frame of a clip that has
ended. What is no longer valid may play on for a while too: see `contextdb.motion.selection.guards`.

A controller reads no clock and draws no random number of its own: the same calls give the same decisions.

Source: the settings of Unreal's motion matching node (throttle, jump threshold, reselect history, continuing pose, interrupt);
DoNotChoose, NextNaturalOnly and root motion weight of EA's talk.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace

from numpy.typing import ArrayLike

from contextdb.cells.arguments import as_number, require_kind
from contextdb.errors import Fault, MotionError, QueryError
from contextdb.motion import arguments
from contextdb.motion.clips.ground_place import GroundPlace, OfBody, place_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.markup.tag_filter import TagFilter
from contextdb.motion.records import quickly_made
from contextdb.motion.search.candidates import Candidates
from contextdb.motion.search.filtering import Tags
from contextdb.motion.search.filters import Filter
from contextdb.motion.selection import variation
from contextdb.motion.selection.asked import Among, Asked, OfPenalties, OfTags, OfValid
from contextdb.motion.selection.choice import Choice
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.controller_state import ControllerState
from contextdb.motion.selection.decision import Action, Decision, Playing, Recorder, plays
from contextdb.motion.selection.guards import Held
from contextdb.motion.selection.history import played_spans, remembered
from contextdb.motion.selection.inputs import Inputs
from contextdb.motion.selection.ongoing import Ongoing
from contextdb.motion.selection.play_rate import eased, play_rate
from contextdb.motion.selection.playhead import Playhead
from contextdb.motion.selection.root_motion import NO_MOTION
from contextdb.motion.selection.selector import Selector
from contextdb.motion.selection.step import Outcome, Step
from contextdb.motion.selection.trigger import Trigger
from contextdb.motion.selection.variation import Rng
from contextdb.motion.selection.worked_out import WorkedOut

Clock = Callable[[], float]


@quickly_made
@dataclass(frozen=True, slots=True)
class Asking:
    """Half an update: what is to be searched, and why; `wanted` is None where nothing is. `held` is the guard that saw to that."""

    step: Step
    cause: Trigger | None
    wanted: Asked | None
    context: Mapping[str, object] | None
    force: bool = False
    interrupt: bool = False
    body: GroundPlace | None = None
    held: Held = Held.NOTHING

    @property
    def query(self) -> Floats:
        """The query, checked: float64 [F]."""
        return self.step.query


DEFAULT_SETTINGS = ControllerSettings()


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
    rng : random.Random or numpy Generator, optional
        For the variation that the settings ask for.
    clock : function, optional
        Gives seconds, such as `time.perf_counter`: only for `Decision.search_us`.

    Raises
    ------
    MotionError
        The settings ask for variation, and there is no generator.
    ContextError
        `selector` or `settings` are none.
    """

    def __init__(
        self,
        selector: Selector,
        settings: ControllerSettings = DEFAULT_SETTINGS,
        recorder: Recorder | None = None,
        rng: Rng | None = None,
        clock: Clock | None = None,
    ) -> None:
        require_kind(selector, Selector, "selector", "a Selector")
        require_kind(settings, ControllerSettings, "settings", "ControllerSettings")
        if settings.variation is not None and rng is None:
            raise MotionError(Fault("the settings request variation, but there is no generator.", "rng=random.Random(seed)"))
        self.selector, self.settings, self.recorder = selector, settings, recorder
        self._rng, self._clock = rng, clock
        self._state = ControllerState()
        self._moved: tuple[object, object, float, float, Ongoing | None] | None = None
        self._head: Playhead | None = None

    @property
    def playing(self) -> Playing | None:
        """What plays now."""
        return self._state.playing

    def upcoming(self, dt_s: float) -> Playing | None:
        """What plays in some seconds if it plays on: the pose that the query of the next update is to be made of.

        A query with the pose of the last update lags behind, and the frame that it fits best is always one that steps back.
        Raises QueryError for what is no time.
        """
        ongoing = self._ongoing(_seconds(dt_s))
        return None if ongoing is None else ongoing.playing

    def _ongoing(self, dt_s: float) -> Ongoing | None:
        """What plays, moved on; kept until `answer`, for an update mostly follows what was asked of `upcoming`."""
        playing, selector, rate, passed_s = self._state.playing, self.selector, self.settings.rate, dt_s * self._state.play_rate
        kept = self._moved
        if kept is not None and kept[0] is playing and kept[1] is selector and kept[2] == rate and kept[3] == passed_s:
            return kept[4]
        ongoing = Ongoing.of(playing, selector, rate, passed_s, self._head)
        self._moved = playing, selector, rate, passed_s, ongoing
        return ongoing

    def copy(self) -> Controller:
        """Another controller that stands where this one does, with the same selector and settings, and no recorder."""
        copied = Controller(self.selector, self.settings, rng=deepcopy(self._rng), clock=self._clock)
        copied._state = self._state
        return copied

    __copy__ = copy

    def __repr__(self) -> str:
        return f"<Controller: {plays(self.playing)}>"

    @property
    def state(self) -> ControllerState:
        """Where the controller is, to come back to with `restore`."""
        return self._state if self._rng is None else replace(self._state, rng=variation.state_of(self._rng))

    def restore(self, state: ControllerState) -> None:
        """Go on from a state of this controller, or of another one with the same selector and settings.

        Raises ContextError for what is no state.
        """
        require_kind(state, ControllerState, "state", "a ControllerState, what `state` gives")
        variation.restore(self._rng, state.rng)
        self._state = state if state.rng is None else replace(state, rng=None)

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
        body : Steered or (x, z, heading), optional
            Where the game has the body, for the recorder alone: `motion.measure` compares it with where the poses are.

        Raises
        ------
        QueryError
            A time, query, mask, tag or name that does not fit. The controller then stands where it stood.
        ContextError
            `body` is none.
        """
        asked = Asked(valid, tags, None, bias, among, None, penalties)
        asking = self._ask(dt_s, self._checked(query), asked, context, force, interrupt, place_of(body))
        if asking.wanted is None:
            return self._answer(asking)
        began_s = self._now_s()
        choice = self.selector.search(asking.query, **asking.wanted.options())
        return self._answer(asking, choice, (self._now_s() - began_s) * 1e6)

    def _ask(
        self,
        dt_s: float,
        query: Floats,
        asked: Asked,
        context: Mapping[str, object] | None,
        force: bool,
        interrupt: bool,
        body: GroundPlace | None = None,
    ) -> Asking:
        """The first half of an update, of a checked query: move what plays on, say what is to be searched. Changes nothing."""
        dt_s = _seconds(dt_s)
        step = Step.of(self.selector, self.settings, self._state, dt_s, query, asked, self._ongoing(dt_s))
        cause = step.trigger(force, interrupt)
        held = step.held(cause)
        if held:
            cause = None
        step = step if cause is None else step.permuted()
        wanted = None if cause is None else step.wanted(cause)
        return Asking(step, cause, wanted, context, force, interrupt, body, held)

    def _answer(self, asking: Asking, choice: Choice | None = None, search_us: float = 0.0) -> Decision:
        """The second half: decide by what the selector chose, None where nothing was to be searched."""
        decision = self._decided(asking, choice, search_us if self._clock else None)
        if self.recorder is not None:
            self.recorder.record(decision)
        self._state = self._state_after(asking.step, decision)
        self._moved, self._head = None, None if asking.step.ongoing is None else asking.step.ongoing.head
        return decision

    def _now_s(self) -> float:
        """What the clock says; 0 without one."""
        return self._clock() if self._clock else 0.0

    def _decided(self, asking: Asking, choice: Choice | None, search_us: float | None) -> Decision:
        step, cause, wanted = asking.step, asking.cause, asking.wanted
        candidates: Sequence[tuple[str, Candidates]] = ()
        filters: tuple[tuple[str, Filter], ...] = ()
        if cause is None or wanted is None or choice is None:
            assert step.ongoing is not None, "without anything playing there is a cause to search"
            outcome = step.unsearched(step.ongoing, asking.held)
        else:
            outcome = step.searched(cause, wanted, choice, self._rng)
            filters = self._filters(wanted)
            if filters:
                candidates = WorkedOut(self.selector.databases, step.query, filters, choice, self._n_candidates)
        return Decision(
            tick=self._state.tick,
            time_s=step.now_s,
            action=outcome.action,
            why=outcome.why,
            searched=cause is not None,
            playing=outcome.playing,
            before=step.before,
            cost=outcome.cost,
            continuing_cost=outcome.continuing_cost,
            choice=outcome.choice,
            context=asking.context,
            query=step.query,
            candidates=candidates,
            search_us=None if cause is None else search_us,
            root_motion=NO_MOTION if step.ongoing is None else step.ongoing.move.motion,
            root_weight=self._root_weight(outcome.playing),
            body=asking.body,
            held=str(outcome.held),
            play_rate=self._play_rate(step, outcome),
            filters=filters,
            inputs=self._inputs(asking),
        )

    def _state_after(self, step: Step, decision: Decision) -> ControllerState:
        state, playing, for_s = self._state, decision.playing, self.settings.history_s
        history, recent = step.history, state.recent
        if playing is not None and decision.action in (Action.START, Action.JUMP):
            database, frame = self.selector.databases[playing.database], playing.frame
            spans = played_spans(database, playing.range, [(frame, frame + 1)])
            history = remembered(history, playing.database, spans, step.now_s, for_s)
            if self.settings.variation is not None:
                recent = self.settings.variation.remember(recent, playing.asset)
        since_s = 0.0 if decision.searched else state.since_search_s + step.dt_s
        waiting_since_s = state.waiting_since_s if decision.held not in ("", Held.HYSTERESIS) else None
        if decision.held == Held.COST_BAR and waiting_since_s is None:
            waiting_since_s = step.now_s
        return ControllerState(state.tick + 1, step.now_s, playing, since_s, history, recent, decision.play_rate, waiting_since_s)

    @property
    def _n_candidates(self) -> int:
        return 0 if self.recorder is None else self.recorder.n_candidates

    def _filters(self, wanted: Asked) -> tuple[tuple[str, Filter], ...]:
        """For the recorder, what could be chosen from in each database of the moment."""
        if self._n_candidates <= 0:
            return ()
        among = self.selector.among(wanted.among)
        databases = ((name, database) for name, database in self.selector.databases.items() if name in among)
        return tuple((name, database.filter(**wanted.of(name)).copied()) for name, database in databases)

    def _inputs(self, asking: Asking) -> Inputs | None:
        """For the recorder, what else the update was given."""
        if self._n_candidates <= 0:
            return None
        step, asked = asking.step, asking.step.asked
        among = None if asked.among is None else tuple(sorted(self.selector.among(asked.among)))
        tags = asked.tags
        filters = tags if tags is None or isinstance(tags, TagFilter) else _filters_in(tags)
        return Inputs(step.dt_s, asking.force, asking.interrupt, among, filters, self.settings)

    def _root_weight(self, playing: Playing | None) -> float:
        return 1.0 if playing is None else self.selector.databases[playing.database].marks.root_weight(playing.frame)

    def _play_rate(self, step: Step, outcome: Outcome) -> float:
        """How fast what plays goes on."""
        playing = outcome.playing
        if playing is None or outcome.action is Action.HOLD:
            return 1.0
        limits = self.settings.min_play_rate, self.settings.max_play_rate
        wanted = play_rate(self.selector.databases[playing.database], playing.frame, step.query, limits)
        is_new = outcome.action in (Action.START, Action.JUMP)
        return wanted if is_new else eased(self._state.play_rate, wanted, step.dt_s)

    def _checked(self, query: ArrayLike) -> Floats:
        """The query as float64 [F], checked as long as any database is there to say how long it must be."""
        for database in self.selector.databases.values():
            return arguments.query_of(query, database.feature_names)
        return arguments.numbers_of(query, "the query")


def halves_of(controller: Controller) -> tuple[Callable[..., Asking], Callable[..., Decision]]:
    """The two halves of an update, for a search between them that is not the selector's."""
    return controller._ask, controller._answer


def _filters_in(tags: Mapping[str, Tags]) -> dict[str, TagFilter]:
    """The tag filters of databases, without flags of frames."""
    return {name: each for name, each in tags.items() if isinstance(each, TagFilter)}


def _seconds(dt_s: float) -> float:
    found = as_number(dt_s)
    if found is None or found < 0.0:
        raise QueryError(Fault(f"an update of {dt_s!r} seconds.", "a finite number, 0 or more"))
    return found
