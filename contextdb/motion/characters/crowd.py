"""A crowd of characters: each plays what it plays alone, and what can be worked out for all at once is.

Bodies and paths are computed in arrays, each table is asked once with all contexts, and each database is searched once.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from contextdb.cells.arguments import require_kind, require_many_of, require_mapping, require_real
from contextdb.cells.sequences import ListSequence
from contextdb.errors import ContextError, Fault, MotionError, in_quotes, plural
from contextdb.motion.answers import Answer
from contextdb.motion.characters import tables as asking
from contextdb.motion.characters.character import Character
from contextdb.motion.characters.paths import MOST_TURN_RAD, ahead_s, back_s, shares_left
from contextdb.motion.characters.tables import Facts, Table
from contextdb.motion.characters.updates import CharacterState, Paths, Step, Updated
from contextdb.motion.clips.many_paths import ManyTrajectories
from contextdb.motion.clips.many_steered import ManySteered, steered_paths
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.features.extraction import with_path
from contextdb.motion.features.path_features import with_paths
from contextdb.motion.output.pose import Pose
from contextdb.motion.output.samples import Place3
from contextdb.motion.output.stream import PoseStream
from contextdb.motion.output.streams import PoseStreams
from contextdb.motion.records import collector_at_rest
from contextdb.motion.selection.controller_group import ControllerGroup
from contextdb.motion.selection.decision import Decision
from contextdb.motion.selection.search_options import OfValid

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
    def states(self) -> list[CharacterState]:
        """Where each is, to come back to with `restore`."""
        return [character.state for character in self]

    def restore(self, states: Sequence[CharacterState]) -> None:
        """Go on from the states of as many characters."""
        states = require_many_of(states, CharacterState, "states", "a list of CharacterState, what `states` gives")
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
        bodies = ManySteered.of([character.body for character in self]).moved(dt, sticks, facing)
        wanted = np.asarray(sticks, np.float64)
        headings = None if facing is None else np.asarray(facing, np.float64)
        given = _facts_of_each(facts, len(self))
        steps = []
        for i, (character, (x, z), body) in enumerate(zip(self, wanted.tolist(), bodies, strict=True)):
            heading = None if headings is None else float(headings[i])
            steps.append(character._step_of(dt, (x, z), given[i], heading, body))
        group = ControllerGroup(character.controller for character in self)
        queries, paths = self._queries(dt, group, steps, bodies, wanted, headings)
        valid = self._valid(steps)
        before = [controller.place for controller in group]
        decisions = group.update(dt, queries, valid, contexts=[step.facts or None for step in steps], body=bodies)
        try:
            poses, roots = self._poses_and_roots(dt, decisions, np.column_stack((bodies.positions, bodies.headings)))
        except Exception:
            for controller, place in zip(group, before, strict=True):
                controller.put_back(place)
            raise
        together = enumerate(zip(self, steps, decisions, roots, strict=True))
        return [each._updated(step, paths, decision, poses, i, root) for i, (each, step, decision, root) in together]

    def _poses_and_roots(
        self, dt: float, decisions: list[Decision], places: Floats
    ) -> tuple[Sequence[Pose | None], list[Place3] | list[Place3 | None]]:
        """The poses of all and their roots, None without a stream; those of equal streams are worked out together."""
        groups = []
        for numbers in self._equal_streams():
            streams = PoseStreams(stream for i in numbers if (stream := self[i].stream) is not None)
            grounds = [self[i].ground for i in numbers]
            below = grounds if any(grounds) else None
            groups.append((numbers, streams, *streams.updated([decisions[i] for i in numbers], dt, places[numbers], below)))
        for _, streams, _, rows in groups:
            streams.go_on(rows)
        if groups and len(groups[0][0]) == len(self):
            return groups[0][2], [(x, z, heading) for x, z, heading in groups[0][2].roots.tolist()]
        displayed: list[Pose | None] = [None] * len(self)
        for numbers, _, poses, _ in groups:
            for i, pose in zip(numbers, poses, strict=True):
                displayed[i] = pose
        return displayed, [None if pose is None else pose.root for pose in displayed]

    def _equal_streams(self) -> list[list[int]]:
        """The numbers of the characters with a stream, those together that have the same banks and settings."""
        groups: list[tuple[PoseStream, list[int]]] = []
        for i, character in enumerate(self):
            stream = character.stream
            if stream is None:
                continue
            for other, numbers in groups:
                if stream.is_like(other):
                    numbers.append(i)
                    break
            else:
                groups.append((stream, [i]))
        return [numbers for _, numbers in groups]

    def _queries(
        self, dt: float, group: ControllerGroup, steps: list[Step], bodies: ManySteered, sticks: Floats, facing: Floats | None
    ) -> tuple[Floats, Paths]:
        """The query of each, and its wished path."""
        schema = self[0].schema
        if any(character.schema is not schema and character.schema != schema for character in self):
            raise MotionError(Fault("the characters have different features.", "characters of one feature schema"))
        features = np.asarray(group.poses(dt))
        for i, character in enumerate(self):
            if character.pose is not None or character.playing is None:
                features[i] = character._features(dt, steps[i].body)
        halflife_s = float(bodies.velocity_halflives_s.max())
        reach = ahead_s(schema, min(map(math.hypot, *sticks.T.tolist())), halflife_s)
        steered = steered_paths([bodies], sticks, facing, reach_s=reach, rate=schema.rate)
        if back_s(schema):
            paths = [each._wished(step, steered[i]) for i, (each, step) in enumerate(zip(self, steps, strict=True))]
            return np.array([with_path(schema, own, path) for own, path in zip(features, paths, strict=True)]), paths
        wished = _paths_from(np.array([step.place for step in steps]), steered)
        return with_paths(schema, features, wished).astype(np.float64), wished

    def _valid(self, steps: list[Step]) -> Any:
        """What may play of each, every table asked once with the facts of all who have it."""
        users: dict[tuple[int, str], list[int]] = {}
        table_of: dict[int, Table] = {}
        for i, character in enumerate(self):
            for table in asking.each_of(character.tables):
                table_of[id(table)] = table
                users.setdefault((id(table), character.unknown), []).append(i)
        if not users:
            return None
        answers: list[dict[int, Answer]] = [{} for _ in self]
        for (key, unknown), numbers in users.items():
            for i, answer in zip(numbers, _answers(table_of[key], [steps[i].facts for i in numbers], unknown), strict=True):
                answers[i][key] = answer
        first = self[0].tables
        if isinstance(first, dict) and all(character.tables == first for character in self):
            return {database: [each[id(table)] for each in answers] for database, table in first.items()}
        valid: list[OfValid | None] = [asking.valid_of(each.tables, answer) for each, answer in zip(self, answers, strict=True)]
        return valid


def _answers(table: Table, facts: Sequence[Facts], unknown: Any) -> Iterable[Answer]:
    """A table's answer to each of some contexts."""
    if asking.answers_many(table):
        columns = {name: [each.get(name) for each in facts] for name in table.asked}
        return table.query_many(columns, unknown=unknown)
    return [asking.answer(table, each, unknown) for each in facts]


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


def _paths_from(places: Floats, paths: ManyTrajectories) -> ManyTrajectories:
    """Each path from where its character is; see `path_from`."""
    apart = places[:, :2] - paths.positions[:, paths.now]
    turned = places[:, 2] - paths.headings[:, paths.now]
    turned = np.clip(turned - math.tau * np.rint(turned / math.tau), -MOST_TURN_RAD, MOST_TURN_RAD)
    left = shares_left(paths.headings.shape[1], paths.now, paths.rate)
    positions = paths.positions + left[None, :, None] * apart[:, None]
    return ManyTrajectories(paths.rate, positions, paths.headings + left * turned[:, None], paths.now)
