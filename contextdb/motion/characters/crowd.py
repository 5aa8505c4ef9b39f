"""A crowd of characters: each plays what it plays alone, and what can be worked out for all at once is.

Bodies and paths are computed in arrays, each table is asked once with all contexts, and each database is searched once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from operator import eq, is_
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from contextdb.cells.arguments import MOST, require_kind, require_many_of, require_mapping, require_numbers, require_real
from contextdb.cells.sequences import ListSequence
from contextdb.errors import ContextError, Fault, MotionError, in_quotes, plural
from contextdb.motion.characters import tables as asking
from contextdb.motion.characters import walks
from contextdb.motion.characters.character import Character
from contextdb.motion.characters.tables import Facts, Table
from contextdb.motion.characters.updates import Updated
from contextdb.motion.characters.walks import Onward, WishedPaths
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.output.pose import Pose
from contextdb.motion.output.samples import Flags
from contextdb.motion.output.stream import PoseStream
from contextdb.motion.output.streams import streams_alike
from contextdb.motion.records import collector_at_rest
from contextdb.motion.selection.controller import Decided, rows_of
from contextdb.motion.selection.controller_group import ControllerGroup
from contextdb.motion.selection.events import Event
from contextdb.motion.selection.search_options import OfValid

T = TypeVar("T")
FactsOfMany = Mapping[str, Any] | Sequence[Facts]


class Crowd(ListSequence[Character]):
    """Characters in order, updated together: a sequence, with whose numbers sticks and facts go.

    Parameters
    ----------
    characters : iterable of Character
        Each once. `character.copy()` makes more of one.

    Raises
    ------
    MotionError
        The same character twice.
    """

    def __init__(self, characters: Iterable[Character] = ()) -> None:
        self._items = []
        for character in require_many_of(characters, Character, "characters", "a list of Character"):
            self.add(character)

    def add(self, character: Character) -> None:
        """Take one more, as the last. Raises MotionError for one that is there, ContextError for what is none."""
        require_kind(character, Character, "character", "a Character")
        if any(own is character or own.controller is character.controller for own in self):
            raise MotionError(Fault("the crowd has this character already.", "one of its own, such as character.copy()"))
        self._items.append(character)

    def remove(self, character: Character) -> None:
        """Let one go; those after it move up by one."""
        remaining = [own for own in self if own is not character]
        if len(remaining) == len(self):
            raise MotionError(Fault("the crowd does not have this character.", "one that was added"))
        self._items = remaining

    def __copy__(self) -> Crowd:
        return Crowd(character.copy() for character in self)

    def __repr__(self) -> str:
        return f"<Crowd: {plural(len(self), 'character')}>"

    @property
    def states(self) -> list[bytes]:
        """Where each is, to come back to with `restore`."""
        return [character.state for character in self]

    def restore(self, states: Sequence[bytes]) -> None:
        """Go on from the states of as many characters."""
        states = require_many_of(states, bytes, "states", "a list of bytes, what `states` gives")
        if len(states) != len(self):
            raise MotionError(Fault(f"{plural(len(states), 'state')} for {plural(len(self), 'character')}.", "one for each"))
        for character, state in zip(self, states, strict=True):
            character.restore(state)

    @collector_at_rest()
    def update(
        self,
        dt: float,
        sticks: ArrayLike,
        facts: FactsOfMany | None = None,
        facing: ArrayLike | None = None,
        *,
        event: Event | Sequence[Event | None] | None = None,
    ) -> list[Updated]:
        """Update every character as `Character.update` does; what each gave, in order. Python's garbage collector rests meanwhile.

        Parameters
        ----------
        dt : float
            Seconds since the last update, for all.
        sticks : float array, shape (Q, 2)
            The velocities over the ground that are requested, x and z in m/s.
        facts : mapping of str to fact or list of Q facts, or sequence of Q mappings, optional
            What the game knows: what is no list, tuple or array is the same for all.
        facing : float array, shape (Q,), optional
            The headings that are requested, radians. Default: where the bodies go.
        event : (str, float), or sequence of Q of them or None, optional
            What is to happen and in how many seconds, as for `Character.update`: for all, or for each.

        Raises
        ------
        ContextDBError
            As `Character.update`. All then stand where they stood.
        """
        dt = require_real(dt, "dt", 0.0)
        if not len(self):
            return []
        schema = self[0].schema
        if any(character.schema is not schema and character.schema != schema for character in self):
            raise MotionError(Fault("the characters have different features.", "characters of one feature schema"))
        goals, given = _goals(sticks, facing, len(self)), _facts_of_each(facts, len(self))
        on = self._onward(dt, goals)
        each = zip(self, given, goals.tolist(), on.facts, strict=True)
        facts_of = [one._with_own(own, dt, goal, numbers, on.walks, i) for i, (one, own, goal, numbers) in enumerate(each)]
        group = ControllerGroup(character.controller for character in self)
        valid = self._valid(facts_of)
        before = [controller.place for controller in group]
        decided = group.decided(dt, on.queries, valid, event, [own or None for own in facts_of], on.places, on.moved)
        try:
            poses, roots, moves_body = self._posed(dt, decided, on.places)
        except Exception:
            for controller, place in zip(group, before, strict=True):
                controller.put_back(place)
            raise
        rows = walks.settled(schema.ways, on.walks, roots, moves_body)
        paths, updated = WishedPaths(schema, on.walks, goals), []
        for i, (character, own, decision) in enumerate(zip(self, facts_of, decided.decisions, strict=True)):
            character._stand(rows, None, i)
            updated.append(Updated(rows, own, paths, decision, poses, i))
        return updated

    def _onward(self, dt: float, goals: Floats) -> Onward:
        """All some time later: those of each chooser together."""
        schema, rows, poses = self[0].schema, self._rows(), None
        if any(character.pose is not None for character in self):
            plain = np.full(schema.n_features, math.nan)
            poses = np.array([plain if character.pose is None else character._given_pose(dt) for character in self])
        parts = []
        for numbers in _alike({i: character.controller.chooser for i, character in enumerate(self)}, id, is_):
            own, chooser = [self[i].controller for i in numbers], self[numbers[0]].controller.chooser
            if len(numbers) == len(self):
                return walks.onward(schema, chooser, rows_of(own), rows, goals, dt, poses)
            given = None if poses is None else poses[numbers]
            parts.append((numbers, walks.onward(schema, chooser, rows_of(own), rows[numbers], goals[numbers], dt, given)))
        order = np.argsort([i for numbers, _ in parts for i in numbers])
        *arrays, facts = zip(*(part for _, part in parts), strict=True)
        together = [own for each in facts for own in each]
        after, moved, queries, places = (np.concatenate(each)[order] for each in arrays)
        return Onward(after, moved, queries, places, [together[i] for i in order])

    def _rows(self) -> Floats:
        """The walks of all: as the last update left them, unless one was elsewhere meanwhile."""
        first = self[0]._rows
        is_whole = len(first) == len(self) and first.shape[1] == self[0].schema.ways.width
        if is_whole and all(own._rows is first and own._at == i for i, own in enumerate(self._items)):
            return first
        return np.concatenate([character._row for character in self])

    def _posed(self, dt: float, decided: Decided, places: Floats) -> tuple[Sequence[Pose | None], Floats, Flags]:
        """The poses of all, None without a stream; their roots, the body's without one; and whether the clip moves the body. Those
        of equal streams and of the same updates are worked out together."""
        groups, posed, roots, moves_body = [], list[Pose | None]([None] * len(self)), places.copy(), np.zeros(len(self), np.bool_)
        decisions, grounds = decided.decisions, [character.ground for character in self]
        for of_updates, updates in decided.updates:
            for alike in self._equal_streams(of_updates):
                numbers = [of_updates[k] for k in alike]
                part = updates if len(alike) == len(of_updates) else updates._replace(decisions=updates.decisions[alike])
                streams = streams_alike([stream for i in numbers if (stream := self[i].stream) is not None])
                below = tuple(grounds[i] for i in numbers)
                own = decisions if len(numbers) == len(self) else [decisions[i] for i in numbers]
                groups.append((numbers, streams, *streams.updated(part, own, dt, places[numbers], below if any(below) else None)))
        for numbers, streams, rows, poses, moves in groups:
            streams.go_on(rows)
            if len(numbers) == len(self):
                return poses, poses.roots, moves
            roots[numbers], moves_body[numbers] = poses.roots, moves
            for i, pose in zip(numbers, poses, strict=True):
                posed[i] = pose
        return posed if groups else (), roots, moves_body

    def _equal_streams(self, numbers: Sequence[int]) -> list[list[int]]:
        """Of some characters the places of those with a stream, those together that have the same banks and settings."""
        streams = {k: own for k, i in enumerate(numbers) if (own := self[i].stream) is not None}
        return _alike(streams, PoseStream.kind, PoseStream.is_like)

    def _valid(self, facts_of: list[Facts]) -> Any:
        """What may play of each: every table is asked once with the facts of all who have the same tables."""
        asked = {i: (character.tables, character.unknown) for i, character in enumerate(self)}
        valid: list[OfValid | None] = [None] * len(self)
        for numbers in _alike(asked, lambda own: (id(own[0]), own[1]), eq):
            tables, unknown = asked[numbers[0]]
            facts = [facts_of[i] for i in numbers]
            answers: dict[int, Any] = {id(table): _answers(table, facts, unknown) for table in asking.each_of(tables)}
            if len(numbers) == len(self):
                return asking.valid_of(tables, answers)
            for k, i in enumerate(numbers):
                valid[i] = asking.valid_of(tables, {key: each[k] for key, each in answers.items()})
        return valid


def _alike(things: Mapping[int, T], key: Callable[[T], object], is_like: Callable[[T, T], bool]) -> list[list[int]]:
    """The numbers of some things, those of like things together; things of one key are like each other."""
    groups: list[list[int]] = []
    by_key: dict[object, list[int]] = {}
    for i, own in things.items():
        numbers = by_key.get(at := key(own))
        if numbers is None:
            numbers = next((each for each in groups if is_like(own, things[each[0]])), [])
            by_key[at] = numbers
            if not numbers:
                groups.append(numbers)
        numbers.append(i)
    return groups


def _answers(table: Table, facts: Sequence[Facts], unknown: Any) -> Any:
    """A table's answer to each of some contexts."""
    if asking.answers_many(table):
        columns = {name: [each.get(name) for each in facts] for name in table.asked}
        return table.query_many(columns, unknown=unknown)
    return [asking.answer(table, each, unknown) for each in facts]


def _goals(sticks: ArrayLike, facing: ArrayLike | None, n: int) -> Floats:
    """The velocities and headings that n sticks ask for, checked: [n, 3], NaN where no heading is asked for."""
    velocities = require_numbers(sticks, "sticks")
    if velocities.shape != (n, 2):
        raise MotionError(Fault(f"the sticks have shape {velocities.shape}.", f"{(n, 2)}, x and z for each character"))
    if (unfit := np.flatnonzero(~(np.abs(velocities) <= MOST).all(axis=1))).size:
        problem = f"the velocity {velocities[unfit[0]].tolist()} is asked of character {unfit[0]}."
        raise MotionError(Fault(problem, f"numbers from {-MOST:g} to {MOST:g}"))
    headings = np.full(n, walks.UNKNOWN) if facing is None else require_numbers(facing, "facing")
    if headings.shape != (n,):
        raise MotionError(Fault(f"the facing has shape {headings.shape}.", f"{(n,)}, a heading for each character"))
    if facing is not None and (unfit := np.flatnonzero(~np.isfinite(headings))).size:
        raise MotionError(Fault(f"the facing {headings[unfit[0]]} is asked of character {unfit[0]}.", "radians"))
    return np.column_stack((velocities, headings))


def _facts_of_each(facts: object, n: int) -> list[Facts]:
    if facts is None:
        return [{}] * n
    if isinstance(facts, (list, tuple)):
        if len(facts) != n:
            raise ContextError(Fault(f"{plural(len(facts), 'mapping')} of facts for {plural(n, 'character')}.", "one for each"))
        return [require_mapping(each, "one of facts", "a mapping of names to facts") for each in facts]
    columns: dict[str, list[object]] = {}
    for name, given in require_mapping(facts, "facts", "a mapping of names to facts, or a list of them").items():
        values = given.tolist() if isinstance(given, np.ndarray) else given
        columns[name] = list(values) if isinstance(values, (list, tuple)) else [values] * n
        if len(columns[name]) != n:
            problem = f"{in_quotes(str(name))} has {plural(len(columns[name]), 'fact')} for {plural(n, 'character')}."
            raise ContextError(Fault(problem, "one for all, or a list of one for each"))
    return [{name: values[i] for name, values in columns.items()} for i in range(n)]
