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
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from typing import Unpack, cast

import numpy as np
from numpy.typing import ArrayLike

from contextdb.cells.arguments import require_callable, require_kind, require_mapping, require_point, require_real, require_text
from contextdb.errors import ContextError, Fault, in_quotes, some
from contextdb.motion.answers import Answer
from contextdb.motion.arguments import query_of
from contextdb.motion.characters import tables as asking
from contextdb.motion.characters import walks
from contextdb.motion.characters.facts import FACTS, FactOf, Ground, Moment
from contextdb.motion.characters.played import Played
from contextdb.motion.characters.project import HasTables, Parts
from contextdb.motion.characters.tables import Facts, OwnFacts, Table, Tables, Unknown
from contextdb.motion.characters.updates import UNKNOWN, More, Options, Paths, Step, Updated
from contextdb.motion.characters.walks import WishedPaths
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.steering import Steered
from contextdb.motion.clips.trajectory import Trajectory
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.nodes.warping import Target
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.ground import Ground as HeightOf
from contextdb.motion.output.stream import PoseStream
from contextdb.motion.selection.controller import Asked, Clock, Controller, Decided, nothing_asked, update_all
from contextdb.motion.selection.controller import Place as ControllerPlace
from contextdb.motion.selection.decision import Playing, plays
from contextdb.motion.selection.events import Event
from contextdb.motion.selection.followed import follow
from contextdb.motion.selection.root_motion import RootMotion
from contextdb.motion.selection.search_options import OfValid
from contextdb.motion.selection.variation import Rng
from contextdb.motion.trace.session import MOST, Trace

AT_REST = Steered()
STAYS = np.zeros(1, np.bool_)
"""The clip does not move the body of a character without poses."""
NOTHING_DISPLAYED = np.array((-1.0, 0.0, 0.0))
N_DISPLAYED = len(NOTHING_DISPLAYED)
NO_STATE = Fault("this is no state of such a character.", "what its `state` gives")
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
        self._is_posed = True
        """Whether updates make poses; a one-off makes its own."""
        self._own = OwnFacts.of(None, {})
        self._body: Steered | None = None
        self._stand(walks.begun(schema.ways, body), body)

    @classmethod
    def of(
        cls,
        project: HasTables,
        name: str,
        *,
        poses: bool = True,
        body: Steered = AT_REST,
        own_facts: Mapping[str, FactOf] = FACTS,
        rng: Rng | int | None = None,
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
        rng : int, random.Random or numpy Generator, optional
            The seed of the variation that its settings may ask for; one is drawn of a generator. Default: 0.
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
        controller = parts.config.controller(name, parts.databases, rng=rng, clock=clock)
        stream = None if parts.banks is None else PoseStream(parts.banks, parts.config.output_of(name))
        return cls(controller, parts.schema, parts.tables, stream, body, own_facts=own_facts)

    def copy(self) -> Character:
        """Another character that stands where this one does, with the same tables, databases and poses, and no recorder."""
        stream = None if self.stream is None else copy(self.stream)
        options = {"own_facts": self.own_facts, "pose": self.pose, "unknown": self.unknown, "ground": self.ground}
        copied = Character(self.controller.copy(), self.schema, self.tables, stream, self.body, **options)  # type: ignore[arg-type]
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
        return self._own_facts.functions

    @property
    def _own_facts(self) -> OwnFacts:
        if self._own.tables is not self._tables or self._own.own is not self.own_facts:
            self._own = OwnFacts.of(self._tables, self.own_facts)
        return self._own

    @property
    def body(self) -> Steered:
        """Where the game has the body. Set it to put the character elsewhere: the animation comes after it."""
        if self._body is None:
            self._body = walks.body_of(self._row)
        return self._body

    @body.setter
    def body(self, body: Steered) -> None:
        require_kind(body, Steered, "body", "a Steered")
        self._stand(walks.with_body(self._row, body), body)

    def _stand(self, rows: Floats, body: Steered | None, at: int = 0) -> None:
        """Stand where one of some rows says; `body` is its body where that is known."""
        self._rows, self._at, self._body = rows, at, body

    @property
    def _row(self) -> Floats:
        """The character's walk: [1, W]."""
        return walks.fitted(self.schema.ways, self._rows if len(self._rows) == 1 else self._rows[self._at : self._at + 1])

    @property
    def root(self) -> RootMotion:
        """Where the animation is: x to the left, z ahead and the heading of the last pose's root, which may lag behind the body."""
        return RootMotion(*walks.place_of(self._row))

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
    def state(self) -> bytes:
        """Where the character is, to come back to with `restore`: all that its next pose depends on beside what it is then given.

        One flat block, which a game in C goes on from (the core's character.h). Equal states have equal futures. The facts of live
        contexts are the game's and not in it.
        """
        displayed = NOTHING_DISPLAYED if self.stream is None else self.stream.displayed
        pose = b"" if self.stream is None else self.stream.state.row.tobytes()
        return b"".join((self._row.tobytes(), self.controller.row.tobytes(), displayed.tobytes(), pose))

    def restore(self, state: bytes) -> None:
        """Go on from a state of this character, or of another one with the same parts; raises ContextError for anything else."""
        ways, chooser, stream = self.schema.ways, self.controller.chooser, self.stream
        widths = ways.width, chooser.width, N_DISPLAYED, 0 if stream is None else stream.width
        if not isinstance(state, bytes) or len(state) != 8 * sum(widths):
            raise ContextError(NO_STATE)
        walk, row, displayed, pose = np.split(np.frombuffer(state).copy(), np.cumsum(widths[:3]).tolist())
        is_right = walks.are_walks(ways, walk[None]) and chooser.are_rows(row[None]) and bool(np.isfinite(pose).all())
        if not is_right or (stream is not None and not stream.stand_on(displayed, pose)):
            raise ContextError(NO_STATE)
        self.controller.stand_on(row[None])
        self._stand(walk[None], None)

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
            `tags`, `bias`, `penalties`, `among`, `force`, `interrupt`, `event` as for `Controller.update`; and `valid`,
            in place of what the tables answer.

        Raises
        ------
        ContextDBError
            Facts that a table refuses, or an argument that cannot be used. The character then stands where it stood.
        """
        step = self._step(dt, stick, facts, facing, body, path)
        valid = options.pop("valid") if "valid" in options else self._valid(step.facts)
        on, own, before = step.on, [self.controller], self.controller.place
        asked = Asked.of_one(**cast("More", options)) if options else nothing_asked(1)
        decided = update_all(own, step.dt_s, on.queries, valid, asked, [step.facts or None], on.places, on.moved)
        return self._answer(step, decided, before)

    # ---- over a network

    def pack(self) -> bytes:
        """What plays now, for a copy of this character on another machine: a few bytes, to be sent after each update or, where
        a late change does no harm, after some. Empty where nothing plays."""
        return self.controller.chooser.core.pack(self.controller.row)

    def unpack(
        self,
        data: bytes,
        dt: float,
        stick: Ground = (0.0, 0.0),
        facing: float | None = None,
        *,
        body: Steered | None = None,
        path: Trajectory | None = None,
        event: Event | None = None,
    ) -> Updated:
        """An update of a copy: in place of asking tables and searching it plays what its owner packed after this update.

        With the same databases, and the same `dt`, stick, body and event as the owner had, poses are the owner's to the bit; so
        they are without a body where the clip alone moves it (`root = "animation"`). Where nothing arrived, give b"": it plays on.
        The next packet puts it right; where that tells of an entry that is past, the copy is at most a frame off until the next
        one.

        Parameters
        ----------
        data : bytes
            What `pack` gave. One that comes late must be left out.
        dt, stick, facing, body, path, event
            As for `update`.

        Raises
        ------
        ContextError
            The bytes are none of such a character. It then stands where it stood; so it does after any other error of `update`.
        """
        step = self._step(dt, stick, None, facing, body, path)
        before, (x, z, heading) = self.controller.place, step.on.places[0].tolist()
        return self._answer(step, follow(self.controller, step.dt_s, step.on.queries[0], data, (x, z, heading), event), before)

    # ---- the parts of an update, for a crowd

    def _step(
        self, dt: float, stick: Ground, facts: Facts | None, facing: float | None, body: Steered | None, path: Trajectory | None
    ) -> Step:
        dt = require_real(dt, "dt", 0.0)
        stick = require_point(stick, "stick", "two numbers, x and z in metres a second")
        given = {} if facts is None else facts
        if type(given) is not dict:
            require_mapping(given, "facts", "a mapping of names to facts")
        if body is not None:
            require_kind(body, Steered, "body", "a Steered")
        if path is not None:
            require_kind(path, Trajectory, "path", "a Trajectory over the ground")
        if facing is not None:
            require_real(facing, "facing")
        goal = *stick, walks.UNKNOWN if facing is None else facing
        pose = None if self.pose is None else self._given_pose(dt)[None]
        on = walks.onward(self.schema, *self.controller.stand, self._row, goal, dt, pose, body)
        paths: Paths = WishedPaths(self.schema, on.walks, goal)
        if path is not None:
            paths, queries = walks.wished_along(self.schema, on.walks, path, on.queries)
            on = on._replace(queries=queries)
        return Step(dt, on, self._with_own(given, dt, goal, on.facts[0], on.walks, 0), paths)

    def _with_own(
        self, given: Facts, dt: float, goal: tuple[float, float, float], numbers: Sequence[float], rows: Floats, i: int
    ) -> Facts:
        """The facts of the game and the character's own, whose walk is one of some rows."""
        asked = self._own_facts
        own: dict[str, object] = {}
        for name, at in asked.of_body.items():
            own[name] = numbers[at]
        if asked.others and any(name not in given for name in asked.others):
            x, z, heading = goal
            facing, body = None if math.isnan(heading) else heading, walks.body_of(rows, i)
            moment = Moment(dt, (x, z), facing, body, self.playing, self._played())
            own |= {name: of(moment) for name, of in asked.others.items() if name not in given}
        if not own:
            return given
        own.update(given)
        return own

    def _played(self) -> Played | None:
        """What plays, with what it is of."""
        playing = self.playing
        if playing is None:
            return None
        banks = {} if self.stream is None else self.stream.banks
        bank = banks if isinstance(banks, PoseBank) else banks.get(playing.database)
        return Played(playing, self.controller.selector.databases.get(playing.database), bank)

    def features(self) -> Floats:
        """The features of the pose as it is now, which a query begins with, such as for `MatchNode.enter`. Never fails."""
        if self.pose is not None:
            return self._given_pose(0.0)
        features = self.controller.upcoming_features(0.0)
        return walks.resting(self.schema, self._row, self.controller.selector.databases)[0] if features is None else features

    def _given_pose(self, dt_s: float) -> Floats:
        """The features of the pose that the game's own function gives."""
        assert self.pose is not None, "asked where there is one"
        return query_of(self.pose(self, dt_s), self.schema.feature_names)

    def _valid(self, facts: Facts) -> OfValid | None:
        """What the tables allow with some facts."""
        tables = self._tables
        if not isinstance(tables, dict):
            return None if tables is None else asking.answer(cast("Table", tables), facts, self.unknown)
        answers: dict[int, Answer] = {id(table): asking.answer(table, facts, self.unknown) for table in asking.each_of(tables)}
        return asking.valid_of(tables, answers)

    def _answer(self, step: Step, decided: Decided, before: ControllerPlace) -> Updated:
        """The pose after a decision; `before` is where the controller stood."""
        on, ways, poses, roots, moves_body = step.on, self.schema.ways, None, step.on.places, STAYS
        if self.stream is not None and self._is_posed:
            try:
                poses, moves_body = self.stream.posed(decided, step.dt_s, on.places, self.ground)
            except Exception:
                self.controller.put_back(before)
                raise
            roots = poses.roots
        self._stand(walks.settled(ways, on.walks, roots, moves_body), None)
        return Updated(self._rows, step.facts, step.paths, decided.decisions[0], poses or ())
