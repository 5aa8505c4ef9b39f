"""One character: stick, body, facts, tables, controller and poses in one update.

    stick ─► body ─► facts ─► tables ─► valid ─┐
               └─► path, from the root ─► query ─► controller ─► decision ─► pose stream ─► pose
                              └───────────────────────────── the root of the last pose ────────┘

The path of a search begins where the animation really is, at the root of the last pose, and comes to the path of the game's body.
Where the clip alone moves the body, the body is put where the pose is.

A character reads no clock: the same calls give the same poses.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike

from contextdb.cells.arguments import require_callable, require_kind, require_mapping, require_point, require_real, require_text
from contextdb.errors import ContextError, Fault, in_quotes, some
from contextdb.motion.answers import Answer
from contextdb.motion.characters import tables as asking
from contextdb.motion.characters.facts import FACTS, FactOf, Ground, Moment
from contextdb.motion.characters.paths import ahead_s, apart_of, back_s, path_from_place, place_beside
from contextdb.motion.characters.played import Played
from contextdb.motion.characters.project import HasTables, Parts
from contextdb.motion.characters.tables import Facts, Tables, Unknown
from contextdb.motion.characters.updates import UNKNOWN, CharacterState, Options, Paths, Step, Updated
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.steering import Steered, steered_path
from contextdb.motion.clips.trajectory import Trajectory, to_own_frame
from contextdb.motion.features.extraction import Features, with_path
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.nodes.warping import Target
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.ground import Ground as HeightOf
from contextdb.motion.output.samples import Place3
from contextdb.motion.output.stream import Pose, PoseStream, root_of
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.controller import Clock, Controller
from contextdb.motion.selection.controller import Place as ControllerPlace
from contextdb.motion.selection.decision import Decision, Playing, plays
from contextdb.motion.selection.root_motion import NO_MOTION, RootMotion
from contextdb.motion.selection.search_options import OfValid
from contextdb.motion.selection.variation import Rng
from contextdb.motion.trace.session import MOST, Trace

AT_REST = Steered()
PoseOf = Callable[["Character", float], ArrayLike]
"""Gives the pose features of a query, as all features of the schema: of a character and the seconds since its last update."""


class Character:
    """A character that follows a stick and plays what its tables allow. `Character.of(project, name)` makes one of a project.

    Parameters
    ----------
    controller : Controller
    schema : FeatureSchema
        The features of the controller's databases.
    tables : compiled table, live context, or mapping of databases to them, optional
        Say which assets are valid. Default: all are.
    stream : PoseStream, optional
        Default: decisions alone, and no poses.
    body : Steered
        Where the character begins, and how it follows a stick.
    own_facts : mapping of str to function
        What the character knows of itself: the name of a fact and a function of the `Moment`. Default: `FACTS`. A fact that the
        game gives wins.
    pose : function, optional
        Gives the features of the pose, from the character and the seconds that have passed. Default: those of the frame that
        plays next.
    unknown : {"error", "any", "never"}
        How tables treat missing facts; see `CompiledTable.query`.
    ground : function, optional
        Where the poses stand, as for `PoseStream.update`. Default: it is flat.

    Attributes
    ----------
    controller, schema, tables, stream, own_facts, pose, unknown, ground
        As given, and may be exchanged between updates.

    Raises
    ------
    ContextError
        An argument of another type.
    """

    def __init__(
        self,
        controller: Controller,
        schema: FeatureSchema,
        tables: Tables = None,
        stream: PoseStream | None = None,
        body: Steered = AT_REST,
        *,
        own_facts: Mapping[str, FactOf] = FACTS,
        pose: PoseOf | None = None,
        unknown: Unknown = "error",
        ground: HeightOf | None = None,
    ) -> None:
        require_kind(controller, Controller, "controller", "a Controller")
        require_kind(schema, FeatureSchema, "schema", "a FeatureSchema")
        require_kind(stream, (PoseStream, type(None)), "stream", "a PoseStream")
        require_kind(body, Steered, "body", "a Steered")
        for name, function in require_mapping(own_facts, "own_facts", "a mapping of facts to functions of the moment").items():
            require_text(name, "one of own_facts")
            require_callable(function, f"the function of {in_quotes(name)}")
        if pose is not None:
            require_callable(pose, "pose")
        if not isinstance(unknown, str) or unknown not in UNKNOWN:
            raise ContextError(Fault(f"unknown is {unknown!r}.", some(UNKNOWN)))
        if ground is not None:
            require_callable(ground, "ground")
        self.controller, self.schema, self.stream, self.pose = controller, schema, stream, pose
        self.own_facts, self.unknown, self.ground = dict(own_facts), unknown, ground
        self.tables = tables
        self._own: tuple[object, object, Mapping[str, FactOf]] = (None, None, {})
        self._body, self._apart = body, NO_MOTION
        self._trail: tuple[tuple[float, Place3], ...] = ()

    @classmethod
    def of(
        cls,
        project: HasTables,
        name: str,
        *,
        poses: bool = True,
        body: Steered = AT_REST,
        own_facts: Mapping[str, FactOf] = FACTS,
        rng: Rng | None = None,
        clock: Clock | None = None,
    ) -> Character:
        """The character of a `[controllers.NAME]` of a project: its databases and pose banks opened or built, its tables compiled.

        Parameters
        ----------
        project : Project
        name : str
            Of the controller; `[output.NAME]` says how its poses are made.
        poses : bool
            False for a character without a pose stream.
        body, own_facts
            As above.
        rng : random.Random or numpy Generator, optional
            For the variation that its settings may ask for. Default: `random.Random(0)`.
        clock : function, optional
            Gives seconds: only for `Decision.search_us`.

        Raises
        ------
        SchemaError
            There is no controller of that name (with the nearest), or the configuration is wrong.
        MotionError, FileError
            As `open_or_build`.
        """
        parts = Parts.of(project, name, poses)
        controller = parts.config.controller(name, parts.databases, rng=random.Random(0) if rng is None else rng, clock=clock)
        stream = None if parts.banks is None else PoseStream(parts.banks, parts.config.output_of(name))
        return cls(controller, parts.schema, parts.tables, stream, body, own_facts=own_facts)

    def copy(self) -> Character:
        """Another character that stands where this one does, with the same tables, databases and poses, and no recorder."""
        stream = None if self.stream is None else copy(self.stream)
        options = {"own_facts": self.own_facts, "pose": self.pose, "unknown": self.unknown, "ground": self.ground}
        copied = Character(self.controller.copy(), self.schema, self.tables, stream, self._body, **options)  # type: ignore[arg-type]
        copied.restore(self.state)
        return copied

    __copy__ = copy

    def __repr__(self) -> str:
        return f"<Character: {plays(self.playing)}>"

    def record(self, n_candidates: int = 12, *, most: int = MOST) -> Trace:
        """Keep the decisions from now on, the last `most`, in the trace that is given back, with so many candidates of each search.

        Raises MotionError where one is no whole number: from 0 up, from 1 up.
        """
        trace = Trace(n_candidates, self.controller.selector.databases, most=most)
        self.controller.recorder = trace
        return trace

    @property
    def tables(self) -> Tables:
        """The tables that say what is valid. Set them to exchange them, such as for reloaded ones."""
        return self._tables

    @tables.setter
    def tables(self, tables: Tables) -> None:
        self._tables = asking.checked(tables)

    @property
    def asked_facts(self) -> Mapping[str, FactOf]:
        """The character's own facts that its tables ask for, as functions of the moment."""
        tables, functions, fact_functions = self._own
        if tables is not self._tables or functions is not self.own_facts:
            fact_functions = asking.own_facts_of(self._tables, self.own_facts)
            self._own = self._tables, self.own_facts, fact_functions
        return fact_functions

    @property
    def body(self) -> Steered:
        """Where the game has the body. Set it to put the character elsewhere: the animation comes after it."""
        return self._body

    @body.setter
    def body(self, body: Steered) -> None:
        require_kind(body, Steered, "body", "a Steered")
        self._body = body

    @property
    def root(self) -> RootMotion:
        """Where the animation is: x to the left, z ahead and the heading of the last pose's root, which may lag behind the body."""
        return RootMotion(*place_beside((*self._body.position, self._body.heading), self._apart))

    def sees(self, x_m: float, z_m: float, heading_rad: float | None = None) -> Target:
        """A place in the world as seen from where the animation is: a target of one-offs, its distance and direction for facts.

        Raises QueryError for what is no place.
        """
        return Target.seen_from(self.root, x_m, z_m, heading_rad)

    @property
    def playing(self) -> Playing | None:
        """What plays now."""
        return self.controller.playing

    @property
    def state(self) -> CharacterState:
        """Where the character is, to come back to with `restore`. The facts of live contexts are the game's and not in it."""
        stream = None if self.stream is None else self.stream.state
        return CharacterState(self._body, self._apart, self._trail, self.controller.state, stream)

    def restore(self, state: CharacterState) -> None:
        """Go on from a state of this character, or of another one with the same parts; raises ContextError for anything else."""
        require_kind(state, CharacterState, "state", "a CharacterState, what `state` gives")
        if (state.stream is None) != (self.stream is None):
            raise ContextError(Fault("the state is of a character with other parts.", "a state of this character"))
        if self.stream is not None and state.stream is not None:
            self.stream.restore(state.stream)
        self.controller.restore(state.controller)
        self._body, self._apart, self._trail = state.body, state.apart, state.trail

    def update(
        self,
        dt: float,
        stick: Ground = (0.0, 0.0),
        facts: Facts | None = None,
        facing: float | None = None,
        *,
        body: Steered | None = None,
        path: Trajectory | None = None,
        **options: Unpack[Options],
    ) -> Updated:
        """Move the body, ask the tables, search if it is time to, and give the pose.

        Parameters
        ----------
        dt : float
            Seconds since the last update.
        stick : (x, z)
            The velocity over the ground that the player asks for, m/s.
        facts : mapping of str to fact, optional
            What the game knows, for the tables; the character's own facts are added.
        facing : float, optional
            The heading that is requested, radians. Default: where the body goes.
        body : Steered, optional
            Where a game that moves bodies itself has this one now. Default: the body follows the stick.
        path : Trajectory, optional
            The path that the body is wished to take over the ground, beginning where the body is, for a game that plans paths.
            Default: `steered_path`.
        **options
            `tags`, `bias`, `penalties`, `among`, `force`, `interrupt` as for `Controller.update`; and `valid`, in place of what
            the tables answer.

        Raises
        ------
        ContextDBError
            Facts that a table refuses, or an argument that cannot be used. The character then stands where it stood.
        """
        if path is not None:
            require_kind(path, Trajectory, "path", "a Trajectory over the ground")
        step = self._step(dt, stick, facts, facing, body)
        wished = self._wished(step, self._steered(step, stick, facing) if path is None else path)
        query = with_path(self.schema, self._features(step.dt_s, step.body), wished)
        if "valid" not in options:
            options["valid"] = self._valid(step.facts)
        before = self.controller.place
        decision = self.controller.update(step.dt_s, query, context=step.facts or None, body=step.body, **options)
        return self._answer(step, wished, decision, before)

    # ---- the parts of an update, for a crowd

    def _step(self, dt: float, stick: Ground, facts: Facts | None, facing: float | None, body: Steered | None) -> Step:
        dt = require_real(dt, "dt", 0.0)
        stick = require_point(stick, "stick", "two numbers, x and z in metres a second")
        given = {} if facts is None else require_mapping(facts, "facts", "a mapping of names to facts")
        require_kind(body, (Steered, type(None)), "body", "a Steered")
        if facing is not None:
            require_real(facing, "facing")
        moved = self._body.moved_unchecked(dt, stick, facing) if body is None else body
        return self._step_of(dt, stick, given, facing, moved)

    def _step_of(self, dt: float, stick: Ground, given: Facts, facing: float | None, moved: Steered) -> Step:
        """The same with the body that has moved."""
        place = place_beside((*moved.position, moved.heading), self._apart)
        own, facts = self.asked_facts, given
        if any(name not in given for name in own):
            moment = Moment(dt, stick, facing, moved, self.playing, self._played())
            facts = {**{name: of(moment) for name, of in own.items() if name not in given}, **given}
        return Step(dt, moved, place, self._trail_after(dt, place), facts)

    def _played(self) -> Played | None:
        """What plays, with what it is of."""
        playing = self.playing
        if playing is None:
            return None
        banks = {} if self.stream is None else self.stream.banks
        bank = banks if isinstance(banks, PoseBank) else banks.get(playing.database)
        return Played(playing, self.controller.selector.databases.get(playing.database), bank)

    def _steered(self, step: Step, stick: Ground, facing: float | None) -> Trajectory:
        """The path of the body if the stick stays as it is, as far as a search must know it."""
        reach = ahead_s(self.schema, math.hypot(*stick), step.body.velocity_halflife_s)
        return steered_path([step.body], stick, facing, reach_s=reach, rate=self.schema.rate)

    def _wished(self, step: Step, path: Trajectory) -> Trajectory:
        """The path from where the animation is: what lies behind it is where it was."""
        return _after_trail(path_from_place(step.place, path), step.trail)

    def features(self) -> Features | Floats:
        """The features of the pose as it is now, which a query begins with, such as for `MatchNode.enter`. Never fails."""
        return self._features(0.0, self._body)

    def _features(self, dt_s: float, body: Steered) -> Features | Floats:
        """The features of the pose that a query begins with: of the frame that plays next, or of rest where nothing plays."""
        if self.pose is not None:
            return np.asarray(self.pose(self, dt_s))
        features = self.controller.upcoming_features(dt_s)
        return resting_pose(self.controller.selector.databases, self.schema, body) if features is None else features

    def _valid(self, facts: Facts) -> OfValid | None:
        """What the tables allow with some facts."""
        answers: dict[int, Answer] = {
            id(table): asking.answer(table, facts, self.unknown) for table in asking.each_of(self._tables)
        }
        return asking.valid_of(self._tables, answers)

    def _answer(self, step: Step, wished: Trajectory, decision: Decision, before: ControllerPlace) -> Updated:
        """The pose after a decision; `before` is where the controller stood."""
        if self.stream is None:
            return self._updated(step, (wished,), decision, (), 0, None)
        try:
            pose = self.stream.update(decision, step.dt_s, step.body, self.ground)
        except Exception:
            self.controller.put_back(before)
            raise
        return self._updated(step, (wished,), decision, (pose,), 0, pose.root)

    def _updated(
        self, step: Step, paths: Paths, decision: Decision, poses: Sequence[Pose | None], at: int, root: Place3 | None
    ) -> Updated:
        """What an update gave, once the pose of a number among some is displayed, with its root."""
        body, apart = step.body, NO_MOTION
        if root is not None and self.stream is not None:
            if root_of(decision, self.stream.settings) == "animation":
                body = replace(body, position=root[:2], heading=root[2])
            else:
                apart = apart_of(root, (*body.position, body.heading))
        self._body, self._apart, self._trail = body, apart, step.trail
        return Updated(body, step.facts, paths, decision, poses, at)

    def _trail_after(self, dt_s: float, place: Place3) -> tuple[tuple[float, Place3], ...]:
        """Where the animation was, and how many seconds ago, from the oldest that a search must know to now."""
        if not self.schema.looks_back:
            return ()
        back = back_s(self.schema)
        older = [(ago + dt_s, each) for ago, each in self._trail]
        needed = sum(ago > back for ago, _ in older)  # one behind the farthest
        return (*older[max(0, needed - 1) :], (0.0, place))


def resting_pose(databases: Mapping[str, MotionDatabase], schema: FeatureSchema, body: Steered) -> Floats:
    """The pose of a character that plays nothing: the mean of all frames, moving as the body does; zeros without databases."""
    pose = np.zeros(schema.n_features)
    for database in databases.values():
        pose = database.normalisation.undo(pose)
        break
    left, ahead = to_own_frame(np.array(body.velocity), np.array(body.heading))
    for channel in schema.channels:
        if channel.type == "velocity" and channel.relative_to is None:
            own = pose[schema.slices[channel.name]].reshape(-1, 3)
            own[:] = left, 0.0, ahead
    return pose


def _after_trail(path: Trajectory, trail: tuple[tuple[float, Place3], ...]) -> Trajectory:
    """A path whose past is a trail, at the path's own rate."""
    if len(trail) < 2:
        return path
    ago = np.array([seconds for seconds, _ in trail])
    places = np.array([place for _, place in trail])
    places[:, 2] = np.unwrap(places[:, 2])
    n_past = math.ceil(float(ago[0]) * path.rate - 1e-9)
    times = -np.arange(n_past, 0, -1) / path.rate
    past = np.stack([np.interp(times, -ago, places[:, axis]) for axis in range(3)], axis=1)
    headings = np.unwrap(np.concatenate((past[:, 2], path.headings[path.now :])))
    return Trajectory(path.rate, np.concatenate((past[:, :2], path.positions[path.now :])), headings, n_past)
