"""A crowd of characters: each plays what it plays alone, and what can be worked out for all at once is.

Bodies and paths are computed in arrays, each table is asked once with all contexts, and each database is searched once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from operator import eq
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
from contextdb.motion.characters.updates import Step, Updated
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.output.pose import Pose
from contextdb.motion.output.stream import PoseStream, root_of
from contextdb.motion.output.streams import PoseStreams
from contextdb.motion.records import collector_at_rest
from contextdb.motion.selection.controller_group import ControllerGroup
from contextdb.motion.selection.decision import Decision
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
        self, dt: float, sticks: ArrayLike, facts: FactsOfMany | None = None, facing: ArrayLike | None = None
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
        rows = walks.moved(schema.ways, np.concatenate([character._row for character in self]), goals, dt)
        steps, each = [], zip(self, given, walks.bodies_of(rows), goals.tolist(), strict=True)
        for i, (character, own, body, (x, z, heading)) in enumerate(each):
            wanted = None if math.isnan(heading) else heading
            steps.append(character._step_of(dt, (x, z), own, wanted, rows[i : i + 1], goals[i : i + 1], body))
        group = ControllerGroup(character.controller for character in self)
        paths, queries = walks.wished(schema, rows, goals, self._features(dt, group, steps))
        places = np.array([(*step.body.position, step.body.heading) for step in steps])
        valid = self._valid(steps)
        before = [controller.place for controller in group]
        decisions = group.update(
            dt, queries, valid, contexts=[step.facts or None for step in steps], body=[step.body for step in steps]
        )
        try:
            poses, roots = self._poses_and_roots(dt, decisions, places)
        except Exception:
            for controller, place in zip(group, before, strict=True):
                controller.put_back(place)
            raise
        moves = [_moves_body(character, decision) for character, decision in zip(self, decisions, strict=True)]
        for moves_body in set(moves):
            numbers = [i for i, own in enumerate(moves) if own is moves_body]
            rows[numbers] = walks.settled(schema.ways, rows[numbers], roots[numbers], moves_body)
        updated = []
        for i, (character, step, decision) in enumerate(zip(self, steps, decisions, strict=True)):
            character._stand(rows, None if moves[i] else step.body, i)
            updated.append(Updated(character.body, step.facts, paths, decision, poses, i))
        return updated

    def _features(self, dt: float, group: ControllerGroup, steps: list[Step]) -> Floats:
        """The features of the pose that each query begins with."""
        features = np.asarray(group.poses(dt))
        for i, character in enumerate(self):
            if character.pose is not None or character.playing is None:
                features[i] = character._features(steps[i])
        return features

    def _poses_and_roots(self, dt: float, decisions: list[Decision], places: Floats) -> tuple[Sequence[Pose | None], Floats]:
        """The poses of all, None without a stream, and their roots, the body's without one; those of equal streams are worked out
        together."""
        groups = []
        for numbers in self._equal_streams():
            streams = PoseStreams(stream for i in numbers if (stream := self[i].stream) is not None)
            grounds = [self[i].ground for i in numbers]
            below = grounds if any(grounds) else None
            groups.append((numbers, streams, *streams.updated([decisions[i] for i in numbers], dt, places[numbers], below)))
        for _, streams, _, rows in groups:
            streams.go_on(rows)
        if groups and len(groups[0][0]) == len(self):
            return groups[0][2], groups[0][2].roots
        displayed: list[Pose | None] = [None] * len(self)
        roots = places.copy()
        for numbers, _, poses, _ in groups:
            roots[numbers] = poses.roots
            for i, pose in zip(numbers, poses, strict=True):
                displayed[i] = pose
        return displayed if groups else (), roots

    def _equal_streams(self) -> list[list[int]]:
        """The numbers of the characters with a stream, those together that have the same banks and settings."""
        streams = {i: own for i, character in enumerate(self) if (own := character.stream) is not None}
        return _alike(streams, PoseStream.is_like)

    def _valid(self, steps: list[Step]) -> Any:
        """What may play of each: every table is asked once with the facts of all who have the same tables."""
        asked = {i: (character.tables, character.unknown) for i, character in enumerate(self)}
        valid: list[OfValid | None] = [None] * len(self)
        for numbers in _alike(asked, eq):
            tables, unknown = asked[numbers[0]]
            facts = [steps[i].facts for i in numbers]
            answers: dict[int, Any] = {id(table): _answers(table, facts, unknown) for table in asking.each_of(tables)}
            if len(numbers) == len(self):
                return asking.valid_of(tables, answers)
            for k, i in enumerate(numbers):
                valid[i] = asking.valid_of(tables, {key: each[k] for key, each in answers.items()})
        return valid


def _alike(things: Mapping[int, T], is_like: Callable[[T, T], bool]) -> list[list[int]]:
    """The numbers of some things, those of like things together."""
    groups: list[list[int]] = []
    for i, own in things.items():
        known = next((numbers for numbers in groups if is_like(own, things[numbers[0]])), None)
        if known is None:
            groups.append([i])
        else:
            known.append(i)
    return groups


def _answers(table: Table, facts: Sequence[Facts], unknown: Any) -> Any:
    """A table's answer to each of some contexts."""
    if asking.answers_many(table):
        columns = {name: [each.get(name) for each in facts] for name in table.asked}
        return table.query_many(columns, unknown=unknown)
    return [asking.answer(table, each, unknown) for each in facts]


def _moves_body(character: Character, decision: Decision) -> bool:
    """Whether the animation moves the body of a character."""
    return character.stream is not None and root_of(decision, character.stream.settings) == "animation"


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
