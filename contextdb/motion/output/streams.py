"""The pose streams of a crowd: each gives what it gives alone, and all are worked out together, in arrays with a row a character.

What a character costs is then a little of Python for its decision and loops over numbers: no object is made for a pose until it is
requested. The streams go on from where the crowd left them, and the crowd from where they are.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from contextdb.cells.arguments import require_many_of, require_real
from contextdb.cells.sequences import ListSequence
from contextdb.errors import ContextError, Fault, MotionError, Place, plural
from contextdb.motion.clips.ground_place import OfBody
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.output.ground import MANY_GROUND, Ground, Grounds, ManyGround
from contextdb.motion.output.pipeline import Rows
from contextdb.motion.output.pose import CrowdPoses
from contextdb.motion.output.samples import Flags
from contextdb.motion.output.stream import PoseState, PoseStream, checked_place, root_of
from contextdb.motion.selection.chooser import Updates
from contextdb.motion.selection.decision import Decision

UNKNOWN = (math.nan, math.nan, math.nan)
"""The place of a body that is not given."""
OfBodies = Sequence[OfBody | None] | Floats


class PoseStreams(ListSequence[PoseStream]):
    """The streams of a crowd, in order: a sequence, with whose numbers decisions, bodies and poses go.

    Parameters
    ----------
    streams : iterable of PoseStream
        Each once, at least one, all with the same banks and settings; `copy.copy` makes more of one.

    Raises
    ------
    MotionError
        No stream, the same one twice, or streams of different banks or settings.
    """

    def __init__(self, streams: Iterable[PoseStream]) -> None:
        self._items = require_many_of(streams, PoseStream, "streams", "a list of PoseStream")
        if not self._items:
            raise MotionError(Fault("there is no stream.", "at least one"))
        _check_each_once(self._items)
        self._pipeline = self._items[0]._pipeline
        if not all(stream.is_like(self._items[0]) for stream in self._items):
            raise MotionError(Fault("the streams have different banks or settings.", "streams of the same banks and settings"))

    def __repr__(self) -> str:
        return f"<PoseStreams: {plural(len(self), 'character')}>"

    @property
    def states(self) -> list[PoseState]:
        """Where each is, to come back to with `restore`."""
        return [stream.state for stream in self]

    def restore(self, states: Sequence[PoseState]) -> None:
        """Go on from the states of as many streams; raises ContextError for anything else."""
        states = require_many_of(states, PoseState, "states", "a list of PoseState, what `states` gives")
        if len(states) != len(self):
            raise ContextError(Fault(f"{plural(len(states), 'state')} for {plural(len(self), 'character')}.", "one for each"))
        for stream, state in zip(self, states, strict=True):
            stream.restore(state)

    def update(
        self,
        decisions: Sequence[Decision],
        dt: float,
        bodies: OfBodies | None = None,
        ground: Sequence[Ground | None] | ManyGround | None = None,
    ) -> CrowdPoses:
        """The poses of all after a decision for each, as `PoseStream.update` gives them.

        Parameters
        ----------
        decisions : sequence of N Decision
            Such as `ControllerGroup.update` gives them.
        dt : float
            Seconds since the last update, for all.
        bodies : sequence of N bodies, or float array of shape (N, 3), optional
            Where the game has each body.
        ground : function, or sequence of N functions or None, optional
            A function is asked once for all feet: of arrays x [n] and z [n], the heights [n] and normals [n, 3], or None where all
            is flat. Of a sequence each is asked as by `PoseStream.update`, foot by foot, which is slower.

        Raises
        ------
        MotionError
            As `PoseStream.update`. All streams then stand where they stood.
        ContextError
            An argument of another type, or not one for each.
        """
        decided = require_many_of(decisions, Decision, "decisions", "a list of Decision")
        dt = require_real(dt, "dt", 0.0)
        if len(decided) != len(self):
            raise ContextError(Fault(f"{plural(len(decided), 'decision')} for {plural(len(self), 'character')}.", "one for each"))
        places, grounds, rows = self._places(bodies, decided), self._grounds(ground), self._rows()
        rows, poses, _ = self._pipeline.update(rows, decided, self._pipeline.plays_of(rows, decided, grounds), dt, places, grounds)
        self.go_on(rows)
        return poses

    def updated(
        self, updates: Updates, decisions: list[Decision], dt: float, places: Floats, grounds: Grounds | None
    ) -> tuple[Rows, CrowdPoses, Flags]:
        """The poses after the decisions of some updates, unchecked; the streams stand where they stood until `go_on` is given the
        rows. And whether the clip alone moves the body of each."""
        return self._pipeline.decided(self._rows(), updates, decisions, dt, places, grounds)

    def go_on(self, rows: Rows) -> None:
        """Go on from some rows, one for each."""
        for i, stream in enumerate(self._items):
            stream._go_on(rows, i)

    def _rows(self) -> Rows:
        """The rows of all: as the last update left them, unless a stream was elsewhere meanwhile."""
        first = self._items[0]._place[0]
        if len(first) == len(self) and all(stream._rows is first and stream._at == i for i, stream in enumerate(self._items)):
            return first
        each = [stream._place for stream in self._items]
        numbers, displayed = (np.array([getattr(rows, name)[at] for rows, at in each]) for name in ("numbers", "displayed"))
        return Rows(numbers, displayed, [rows.last[at] for rows, at in each])

    def _places(self, bodies: OfBodies | None, decisions: Sequence[Decision]) -> Floats | None:
        """Where all bodies are, [N, 3]; None where none is given."""
        roots = [root_of(decision, self._pipeline.settings) for decision in decisions]
        if bodies is None:
            for root in roots:
                checked_place(None, root)
            return None
        if not isinstance(bodies, (list, tuple, np.ndarray)) or len(bodies) != len(self):
            raise ContextError(Fault(f"the bodies are {bodies!r}.", f"one for each of {plural(len(self), 'character')}"))
        if (
            isinstance(bodies, np.ndarray)
            and bodies.shape == (len(self), 3)
            and bodies.dtype == np.float64
            and np.isfinite(bodies).all()
        ):
            return np.ascontiguousarray(bodies)
        places = []
        for i, body in enumerate(bodies):
            try:
                places.append(checked_place(body, roots[i]))
            except (ContextError, MotionError) as error:
                raise type(error)(*(fault.at(Place(f"character {i}")) for fault in error.faults)) from None
        return np.array([UNKNOWN if place is None else place for place in places], np.float64)

    def _grounds(self, ground: object) -> Grounds | None:
        if ground is None or callable(ground):
            return ground
        if not isinstance(ground, (list, tuple)) or len(ground) != len(self):
            raise ContextError(Fault(f"ground is {ground!r}.", f"{MANY_GROUND}; or a function or None for each character"))
        for i, each in enumerate(ground):
            if each is not None and not callable(each):
                raise ContextError(Fault(f"the ground is {each!r}.", "a function, or None", place=Place(f"character {i}")))
        return tuple(ground) if any(each is not None for each in ground) else None


def streams_alike(streams: list[PoseStream]) -> PoseStreams:
    """Streams that are known to be like each other. Raises MotionError for the same one twice."""
    _check_each_once(streams)
    alike = PoseStreams.__new__(PoseStreams)
    alike._items, alike._pipeline = streams, streams[0]._pipeline
    return alike


def _check_each_once(streams: list[PoseStream]) -> None:
    if len(set(map(id, streams))) < len(streams):
        raise MotionError(Fault("the same stream is there twice.", "one of its own for each, such as copy.copy(stream)"))
