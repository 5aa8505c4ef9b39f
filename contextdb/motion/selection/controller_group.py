"""A crowd: many characters that are updated together, each decided as its own controller decides.

Those that share a selector and settings are asked, searched for and decided together, in the core; a controller that is updated
alone is such a crowd of one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contextdb.cells.arguments import require_many_of
from contextdb.cells.sequences import ListSequence
from contextdb.errors import ContextError, Fault, MotionError, Place, QueryError, plural
from contextdb.motion import arguments
from contextdb.motion.answers import are_answers
from contextdb.motion.clips.ground_place import GroundPlace, OfBody, place_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.records import collector_at_rest
from contextdb.motion.selection.chooser import are_mappings
from contextdb.motion.selection.controller import Asked, Controller, Decided, rows_of, seconds_of, update_all
from contextdb.motion.selection.controller_state import ControllerState
from contextdb.motion.selection.decision import Decision, Playing
from contextdb.motion.selection.events import Event
from contextdb.motion.selection.search_options import (
    Among,
    OfPenalties,
    OfTags,
    OfValidForMany,
    each_of,
)

HAS_IT = Fault("the group has this controller already.", "a controller of its own for each character")

Flag = bool | Sequence[bool] | NDArray[np.bool_]
OfBodies = Sequence[OfBody | None] | NDArray[np.float64]


class ControllerGroup(ListSequence[Controller]):
    """The controllers of a crowd, in order: a sequence, with whose numbers queries, masks and decisions go.

    Parameters
    ----------
    controllers : iterable of Controller
        Each once. They may have different selectors and settings; those of one selector are searched for together.

    Raises
    ------
    MotionError
        The same controller twice.
    """

    def __init__(self, controllers: Iterable[Controller] = ()) -> None:
        self._items = require_many_of(controllers, Controller, "controllers", "a list of Controller")
        if len({id(controller) for controller in self._items}) < len(self._items):
            raise MotionError(HAS_IT)

    def add(self, controller: Controller) -> None:
        """Take one more character, as the last."""
        if any(own is controller for own in self._items):
            raise MotionError(HAS_IT)
        self._items.append(controller)

    def remove(self, controller: Controller) -> None:
        """Let a character go; those after it move up by one."""
        remaining = [own for own in self._items if own is not controller]
        if len(remaining) == len(self._items):
            raise MotionError(Fault("the group does not have this controller.", "one that was added"))
        self._items = remaining

    def __repr__(self) -> str:
        return f"<ControllerGroup: {plural(len(self), 'character')}>"

    @property
    def playing(self) -> list[Playing | None]:
        """What each plays now."""
        return [controller.playing for controller in self]

    @property
    def states(self) -> list[ControllerState]:
        """Where each is, to come back to with `restore`."""
        return [controller.state for controller in self]

    def restore(self, states: Sequence[ControllerState]) -> None:
        """Go on from the states of as many characters."""
        for controller, state in zip(self, each_of(states, len(self), "state", is_one=False), strict=True):
            controller.restore(state)

    def upcoming(self, dt_s: float) -> list[Playing | None]:
        """What each plays in some seconds if it plays on; see `Controller.upcoming`."""
        return [controller.upcoming(dt_s) for controller in self]

    def poses(self, dt_s: float) -> Floats:
        """The features of each one's upcoming frame, in the schema's units, for `with_paths` to give them paths: float64 [Q, F].

        Zeros for a character that plays nothing.
        """
        seconds, groups = seconds_of(dt_s), dict[int, list[int]]()
        for i, controller in enumerate(self):
            groups.setdefault(id(controller.chooser), []).append(i)
        widths = {self[numbers[0]].chooser.n_features for numbers in groups.values()} - {0}
        if len(widths) > 1:
            raise MotionError(Fault(f"the databases have {sorted(widths)} features.", "databases of one schema"))
        poses = np.zeros((len(self), max(widths, default=0)))
        for numbers in groups.values():
            own = [self[i] for i in numbers]
            features = own[0].chooser.move(rows_of(own), seconds, poses=True)[1]
            if features is not None and features.size:
                poses[numbers] = features
        return poses

    @collector_at_rest()
    def update(
        self,
        dt_s: float,
        queries: ArrayLike,
        valid: OfValidForMany | None = None,
        tags: OfTags | Sequence[OfTags | None] | None = None,
        contexts: Sequence[Mapping[str, object] | None] | None = None,
        *,
        bias: Mapping[str, ArrayLike] | Sequence[Mapping[str, ArrayLike] | None] | None = None,
        penalties: OfPenalties | Sequence[OfPenalties | None] | None = None,
        among: Among | Sequence[Among | None] | None = None,
        force: Flag = False,
        interrupt: Flag = False,
        event: Event | Sequence[Event | None] | None = None,
        body: OfBodies | None = None,
    ) -> list[Decision]:
        """Update every character as `Controller.update` does; the decision of each, in order. Python's garbage collector rests
        meanwhile.

        Parameters
        ----------
        dt_s : float
            Seconds since the last update, for all.
        queries : float array, shape (Q, F)
        valid : optional
            As for `Selector.search_many`: one for all; one for each, such as what `query_many` answers; or a mapping of database
            name to either.
        tags, bias, penalties, among, force, interrupt, event : optional
            As for `Controller.update`: one for all, or a list of one for each.
        contexts : sequence of Q mappings, optional
            The facts of the moment, for the recorders alone.
        body : sequence of Q bodies, or float array of shape (Q, 3), optional
            Where the game has each body, for the recorders alone.

        Raises
        ------
        QueryError
            What does not fit, with the number of the character. All then stand where they stood.
        """
        n = len(self)
        wanted = arguments.numbers_of(queries, "the queries")
        if wanted.ndim != 2 or len(wanted) != n:
            raise QueryError(Fault(f"the queries have shape {wanted.shape}.", f"one for each of {plural(n, 'character')}"))
        if arguments.is_one_for_each(valid) or are_mappings(valid):
            each_of(valid, n, "mask", is_one=False)
        asked = Asked(
            valid,
            _each(tags, n, "tag filter"),
            _each(bias, n, "bias"),
            _each_among(among, n),
            _each(penalties, n, "penalty"),
            _each_flag(force, n, "flag to force"),
            _each_flag(interrupt, n, "flag to interrupt"),
            _each_event(event, n),
        )
        facts, places = _each(contexts, n, "context"), _each_place(body, n)
        if not self._have_width(wanted.shape[1]) or not arguments.are_finite(wanted):
            for i, controller in enumerate(self):
                with _of_character(i):
                    controller._checked(wanted[i])
        with _of_character(0):
            seconds = seconds_of(dt_s)
        if any(each is not None for each in (tags, bias, among, penalties, event)):
            self._check(asked)
        return update_all(self, seconds, wanted, asked, facts, places).decisions

    def decided(
        self,
        dt_s: float,
        queries: Floats,
        valid: OfValidForMany | None,
        event: Event | Sequence[Event | None] | None,
        contexts: Sequence[Mapping[str, object] | None],
        places: Floats,
        moved: Floats,
    ) -> Decided:
        """The same where all but `event` is known to be right, with the places of bodies [Q, 3] and what has moved [Q, 16]."""
        nothing, no, events = [None] * len(self), [False] * len(self), _each_event(event, len(self))
        asked = Asked(valid, nothing, nothing, nothing, nothing, no, no, events)
        if event is not None:
            self._check(asked)
        return update_all(self, dt_s, queries, asked, contexts, places, moved)

    def _check(self, asked: Asked) -> None:
        """Refuse what a controller cannot be asked with, with its number."""
        for i, controller in enumerate(self):
            with _of_character(i):
                controller.check(asked, i)

    def _have_width(self, n_features: int) -> bool:
        """Whether queries of so many features fit all databases."""
        selectors = {controller.selector for controller in self}
        return all(database.n_features == n_features for selector in selectors for database in selector.databases.values())


@contextmanager
def _of_character(i: int) -> Iterator[None]:
    """Say which character an error is of."""
    try:
        yield
    except QueryError as error:
        raise QueryError(*(fault.at(Place(f"character {i}")) for fault in error.faults)) from None


def _each(given: object, n: int, what: str) -> Sequence[Any]:
    """Lists are of one for each, everything else is for all."""
    return each_of(given, n, what, is_one=not isinstance(given, (list, tuple)))


def _each_among(among: object, n: int) -> Sequence[Any]:
    """Names are for all, lists of names and many answers of a table one for each."""
    is_for_each = are_answers(among) or (isinstance(among, (list, tuple)) and not all(isinstance(name, str) for name in among))
    return each_of(among, n, "choice of databases", is_one=not is_for_each)


def _each_event(event: Event | Sequence[Event | None] | None, n: int) -> Sequence[Event | None]:
    """An event is for all, a list of them is one for each."""
    return each_of(event, n, "event", is_one=event is None or isinstance(event, tuple))


def _each_place(body: OfBodies | None, n: int) -> Sequence[GroundPlace | None]:
    """Where each body is; None for all, or for one of a list, where none is given."""
    places = []
    for i, each in enumerate(each_of(body, n, "body", is_one=body is None)):
        try:
            places.append(place_of(each))
        except ContextError as error:
            raise ContextError(*(fault.at(Place(f"character {i}")) for fault in error.faults)) from None
    return places


def _each_flag(given: Flag, n: int, what: str) -> Sequence[bool]:
    return each_of(given, n, what, is_one=np.ndim(given) == 0)
