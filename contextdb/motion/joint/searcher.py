"""Choose clip, frame and cast in one update: the joint frame of lowest cost over all casts that may be.

Exact: equal to trying every cast in every frame of every clip that may play. Several joint databases are searched in order, the
prioritized ones first, by the rule of `contextdb.motion.selection.selector`. On a tie the earlier database wins, then the lowest
frame, then the first cast.

Source: "Casting" in EA's talk, extended to the frame; Unreal's Pose Search interactions, which answer one update later.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from contextdb.cells.arguments import as_number, require_kind, require_many_of, require_mapping, require_whole
from contextdb.core import search_joint
from contextdb.errors import ContextError, Fault, MotionError, QueryError, in_quotes, nearest, no_such, some
from contextdb.motion.clips.ground_place import A_BODY, GroundPlace, OfBody, place_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.features.extraction import FARTHEST_M
from contextdb.motion.joint.alignment import aligned, moved
from contextdb.motion.joint.boxes import boxes_of, in_boxes
from contextdb.motion.joint.casts import CastMaker, Casts
from contextdb.motion.joint.database import FACING, PLACE, JointDatabase, seen_by
from contextdb.motion.joint.hit import JointHit, nothing
from contextdb.motion.markup.left_out import LeftOut, Skip
from contextdb.motion.markup.marks import TagFilter
from contextdb.motion.search import cost
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.hit import NOTHING, Hit
from contextdb.motion.selection.choice import Choice
from contextdb.motion.selection.selector import Entry, Selector, choice_of

Queries = Mapping[Any, ArrayLike]
Places = Mapping[Any, OfBody]
Least = tuple[float, int, int]
"""A total, its joint frame and its cast; inf, -1, -1 for none."""
MOST_TAGS = 64
CASTS_AT_ONCE = 512
"""So many casts are compared together, so that memory stays small however many actors there are."""
PLACES = f"a mapping of actors to places: {A_BODY}"


class JointOptions(TypedDict, total=False):
    """What a joint search may be given beside queries and places; see `JointSearcher.search`."""

    valid: object
    casts: Sequence[Mapping[str, Hashable]] | None
    tags: TagFilter | None
    in_match_range: bool
    gives: Mapping[str, float] | None
    bias: Mapping[str, ArrayLike] | ArrayLike | None
    skip: Mapping[str, Sequence[Skip]] | Sequence[Skip]


class JointSearcher:
    """Searches joint databases, priority first.

    Parameters
    ----------
    databases : JointDatabase, or mapping of str to JointDatabase
        In order; of the same roles and channels.
    thresholds : mapping of str to float, optional
        Below this cost the best of a database wins outright, before the databases behind it.

    Raises
    ------
    MotionError
        No database, different roles or channels, or a threshold of no database or that is not a number.
    """

    def __init__(
        self, databases: JointDatabase | Mapping[str, JointDatabase], thresholds: Mapping[str, float] | None = None
    ) -> None:
        given = {"joint": databases} if isinstance(databases, JointDatabase) else databases
        accepted = "a JointDatabase, or a mapping of names to these"
        self.databases: dict[str, JointDatabase] = dict(require_mapping(given, "databases", accepted))
        for joint in self.databases.values():
            require_kind(joint, JointDatabase, "one of databases", "a JointDatabase")
        limits = {} if thresholds is None else require_mapping(thresholds, "thresholds", "a mapping of databases to costs")
        for name in limits:
            if name not in self.databases:
                near = nearest(str(name), self.databases)
                raise MotionError(Fault(f"there is no database {in_quotes(str(name))}.", some(self.databases), near or ""))
        self.selector = Selector([Entry(name, each.database, limits.get(name)) for name, each in self.databases.items()])
        roles = {joint.roles for joint in self.databases.values()}
        if len(roles) > 1:
            roles_text = "; ".join(f"{in_quotes(name)} {', '.join(joint.roles)}" for name, joint in self.databases.items())
            raise MotionError(Fault(f"the databases have different roles: {roles_text}.", "the same roles, in the same order"))
        self.roles = roles.pop()
        self._engines = {name: _Engine(joint, self.selector.databases[name]) for name, joint in self.databases.items()}

    def search(self, queries: Queries, places: Places, **options: Unpack[JointOptions]) -> JointHit:
        """Choose clip, frame and cast.

        Parameters
        ----------
        queries : mapping of actor to float array, shape (F,)
            The pose and path of each actor, as for `MotionDatabase.search`.
        places : mapping of actor to (x, z, heading), or to Steered
            Where each actor is in the world: metres, and radians to the left, such as `Pose.root`.
        valid : Matches, or bool array, shape (J,), or mapping of database name to either, optional
            Matches, the answer to a query with actors: the assets of its rows, each with every cast that its cells accept, by the
            `"id"` of the actors; mirrored clips go by `Matches.mirrored`. A soft cell adds its
            penalty for the cast at hand. An array: which joint ranges may play. Default: all.
        casts : sequence of mappings of role to actor, optional
            Only these. Default: those of the answer; without one every way to give the roles to different actors of `queries`.
        tags : TagFilter, optional
            As for `MotionDatabase.search`; every role's frame must pass.
        in_match_range : bool
            Whether only frames of a match range may be chosen.
        gives : mapping of role to float, optional
            How readily each role gives way when the clip is put down in the world, 0 not at all; 1 unless it is given.
        bias, skip : float array, shape (N,), and Skips, or mappings of database name to these, optional
            As for `MotionDatabase.search`, by the frames of the motion database: a joint frame has the mean of the biases of its
            roles, and none of its frames may be skipped.

        Raises
        ------
        QueryError
            An actor of a cast without a query, place or id; a query or place that is not finite; anything that does not fit.
        """
        results: dict[str, tuple[_Question, Least]] = {}
        hits: dict[str, Hit] = {}
        stopped = None
        for entry in self.selector.entries:
            engine = self._engines[entry.name]
            question = engine.question(queries, places, **self._of_database(entry.name, options))
            total, frame, cast = engine.least(question)
            results[entry.name] = question, (total, frame, cast)
            hits[entry.name] = engine.hit(total, frame)
            if entry.threshold is not None and total < entry.threshold:
                stopped = entry.name
                break
        choice = choice_of(self.selector.entries, hits, frozenset(self.databases), stopped)
        if choice.database is None:
            return nothing(choice)
        question, (total, frame, cast) = results[choice.database]
        return self._engines[choice.database].hit_of(choice.database, question, total, frame, cast, choice)

    def candidates(self, queries: Queries, places: Places, k: int = 10, **options: Unpack[JointOptions]) -> tuple[JointHit, ...]:
        """The best frame of each clip with each cast, the k cheapest of all databases, cheapest first.

        The first costs what `search` finds where no threshold stops it; the parameters are those of `search`. Every frame is
        scored, so it takes longer. Raises QueryError as `search` does, and where `k` is no whole number from 0 up.
        """
        if require_whole(k, "k") < 0:
            raise QueryError(Fault(f"k is {k}.", "a whole number from 0 up"))
        rows: list[tuple[float, int, int, int, str, _Question]] = []
        for i, (name, engine) in enumerate(self._engines.items()):
            question = engine.question(queries, places, **self._of_database(name, options))
            each = [(total, i, frame, cast, name, question) for total, frame, cast in engine.best_of_each(question)]
            rows += sorted(each, key=lambda one: one[:4])[:k]
        best = sorted(rows, key=lambda one: one[:4])[:k]
        return tuple(
            self._engines[name].hit_of(name, question, total, frame, cast) for total, _, frame, cast, name, question in best
        )

    def _of_database(self, name: str, options: JointOptions) -> dict[str, Any]:
        """The options for one database; a mapping of databases leaves those that it does not name unrestricted."""
        own_options: dict[str, Any] = {**options}
        for key, nothing_said in (("valid", None), ("bias", None), ("skip", ())):
            of_each = options.get(key)
            if isinstance(of_each, Mapping):
                self.selector.among(of_each)
                own_options[key] = of_each.get(name, nothing_said)
        return own_options


@dataclass(frozen=True, eq=False)
class JointInputs:
    """What one joint search of one database compares; A actors, C casts, J joint ranges, K roles, M joint frames.

    `queries` float64 [A, F] are of each actor, normalised; `seen` float64 [A, A, 4] is what each sees of each other, in the units
    of costs; `casts` int64 [C, K] the actor of each role; `range_biases` float64 [C, J] what the soft cells of the table cost with
    each cast in each joint range, inf where it may not play; `frame_biases` float64 [M] is inf where a frame may not be chosen.
    """

    queries: Floats
    seen: Floats
    casts: Ints
    range_biases: Floats
    frame_biases: Floats


@dataclass(frozen=True, eq=False)
class _Question:
    """One search of one database: what is compared, and who the actors are."""

    inputs: JointInputs
    casts: Casts
    places: Floats
    """Of each actor of a cast: [A, 3]."""
    gives: Floats
    box_biases: Floats
    """The biases of joint frames, in boxes."""


class _Engine:
    """Searches one joint database; `known` is its motion database, knowing the tags of all."""

    def __init__(self, joint: JointDatabase, known: MotionDatabase) -> None:
        self.joint, self._known = joint, known
        self._casts = CastMaker(joint)
        self._biases: dict[tuple[TagFilter | None, bool], tuple[Floats, Floats]] = {}

    def question(
        self,
        queries: Queries,
        places: Places,
        valid: object = None,
        casts: Sequence[Mapping[str, Hashable]] | None = None,
        tags: TagFilter | None = None,
        in_match_range: bool = False,
        gives: Mapping[str, float] | None = None,
        bias: ArrayLike | None = None,
        skip: Sequence[Skip] = (),
    ) -> _Question:
        """What a search with these arguments compares."""
        require_mapping(queries, "queries", "a mapping of actors to queries")
        require_kind(tags, (TagFilter, type(None)), "tags", "a TagFilter, or None")
        require_kind(in_match_range, bool, "in_match_range", "True or False")
        allowed = self._casts.make(valid, casts, list(queries))
        actors = list(dict.fromkeys(actor for cast in allowed.listed for actor in cast))
        wanted = self._normalised(queries, actors)
        where = places_of(places, actors)
        numbers = {actor: i for i, actor in enumerate(actors)}
        cast_numbers = np.array([[numbers[actor] for actor in cast] for cast in allowed.listed], np.int64)
        frame_biases, box_biases = self._frame_biases(tags, in_match_range, bias, skip)
        inputs = JointInputs(
            wanted,
            seen_by(where[:, None], where[None, :]),
            cast_numbers.reshape(-1, len(self.joint.roles)),
            allowed.biases,
            frame_biases,
        )
        return _Question(inputs, allowed, where, _gives_of(gives, self.joint.roles), box_biases)

    def least(self, question: _Question) -> Least:
        """The lowest total, its joint frame and cast; inf, -1, -1 for none."""
        best, best_frame, best_cast = np.full(1, np.inf), np.full(1, -1), -1
        for first, casts in self._casts_at_once(question):
            own_cast = np.full(1, -1)
            self._search(question, casts, best, best_frame, own_cast)
            best_cast = best_cast if own_cast[0] < 0 else first + int(own_cast[0])
        return float(best[0]), int(best_frame[0]), best_cast

    def best_of_each(self, question: _Question) -> Iterator[Least]:
        """The best frame of each joint range with each cast that may play it."""
        n_ranges = len(self.joint.assets)
        for first, casts in self._casts_at_once(question):
            n = (casts.stop - first) * n_ranges
            bests, frames, own_casts = np.full(n, np.inf), np.full(n, -1), np.full(n, -1)
            self._search(question, casts, bests, frames, own_casts)
            for at in np.flatnonzero(frames >= 0).tolist():
                yield float(bests[at]), int(frames[at]), first + at // n_ranges

    def _casts_at_once(self, question: _Question) -> Iterator[tuple[int, slice]]:
        """Some casts after the others, and the number of the first; none where there are no frames."""
        n = len(question.inputs.casts) if self.joint.n_frames else 0
        for first in range(0, n, CASTS_AT_ONCE):
            yield first, slice(first, min(n, first + CASTS_AT_ONCE))

    def _search(self, question: _Question, casts: slice, bests: Floats, frames: Ints, best_casts: Ints) -> None:
        """Lower the best total of all, or of each cast in each joint range, to those of some casts."""
        inputs = question.inputs
        compared = (inputs.queries, inputs.seen, inputs.casts[casts], inputs.range_biases[casts], question.box_biases)
        search_joint(*self._pack, *map(np.ascontiguousarray, compared), bests, frames, best_casts)

    def hit(self, total: float, frame: int) -> Hit:
        """What a selector compares."""
        if frame < 0:
            return NOTHING
        at = int(self.joint.frame_ranges[frame])
        return Hit(self.joint.assets[at], at, frame, total)

    def hit_of(self, name: str, question: _Question, total: float, frame: int, cast: int, choice: Choice | None = None) -> JointHit:
        """The hit of a search, with its costs and biases."""
        joint, inputs = self.joint, question.inputs
        at = int(joint.frame_ranges[frame])
        actors, numbers = question.casts.listed[cast], inputs.casts[cast]
        own = frame - int(joint.firsts[at])
        frames = joint.frames[:, frame]
        places = question.places[numbers]
        assert joint.database.root is not None, "checked when the joint database was made"
        put = aligned(joint.database.root[frames].astype(np.float64), places, question.gives)
        asset, mirrored = joint.assets[at], bool(joint.mirrored[at])
        return JointHit(
            name,
            asset,
            question.casts.row(cast, asset, mirrored),
            mirrored,
            at,
            own,
            own / joint.rate if joint.rate else None,
            total,
            dict(zip(joint.roles, actors, strict=True)),
            self._costs(inputs, frame, numbers.tolist()),
            float(inputs.range_biases[cast, at] + inputs.frame_biases[frame]),
            dict(zip(joint.roles, frames.tolist(), strict=True)),
            {role: _place(put[k]) for k, role in enumerate(joint.roles)},
            {role: moved(places[k], put[k]) for k, role in enumerate(joint.roles)},
            () if choice is None else choice.searches,
            "" if choice is None else choice.why,
        )

    def _frame_biases(
        self, tags: TagFilter | None, in_match_range: bool, bias: ArrayLike | None, skip: Sequence[Skip]
    ) -> tuple[Floats, Floats]:
        """The bias of each joint frame, inf where it may not be chosen: [M]; the same in boxes."""
        is_of_moment = bias is not None or bool(require_many_of(skip, Skip, "skip", "a list of Skip"))
        known = None if is_of_moment else self._biases.get((tags, in_match_range))
        if known is None:
            database = self._known
            chosen = database.filter(None, tags=tags, in_match_range=in_match_range, bias=bias, skip=skip)
            of_frames = chosen.biases(database.layout.frame_ranges, database.marks.kinds)
            playable = chosen.why(database.layout.frame_ranges, database.marks.kinds) == LeftOut.NO
            biases = np.where(playable, of_frames, np.inf)[self.joint.frames].mean(axis=0)
            known = biases, in_boxes(self._boxes, biases)
            if is_of_moment:
                return known
            if len(self._biases) >= MOST_TAGS:
                self._biases.clear()
            self._biases[tags, in_match_range] = known
        return known

    @cached_property
    def _boxes(self) -> Any:
        return boxes_of(self.joint)

    @cached_property
    def _pack(self) -> tuple[Any, ...]:
        """What the core takes of the database."""
        layout, boxes = self.joint.database.layout, self._boxes
        channels = np.array([0, *(columns.stop for columns in self.joint.database.slices)], np.int64)
        arrays = (
            *(layout.blocks, layout.rank, boxes.boxes, boxes.own_lows, boxes.own_highs, channels, self.joint.own_weights),
            *(boxes.ranges, boxes.firsts, boxes.relative, boxes.lows, boxes.highs),
            *(np.array(self.joint.pairs, np.int64), np.array(self.joint.relative_weights)),
        )
        return tuple(map(np.ascontiguousarray, arrays))

    def _normalised(self, queries: Queries, actors: Sequence[Hashable]) -> Floats:
        normalised = np.empty((len(actors), self.joint.database.n_features))
        for i, actor in enumerate(actors):
            if actor not in queries:
                raise QueryError(Fault(f"there is no query for the actor {actor!r}.", "one for each actor that may be cast"))
            try:
                normalised[i] = self.joint.database.normalised(queries[actor])
            except QueryError as error:
                raise QueryError(*(_of_actor(fault, actor) for fault in error.faults)) from None
        return normalised

    def _costs(self, inputs: JointInputs, frame: int, cast: Sequence[int]) -> dict[str, dict[str, float]]:
        joint, database = self.joint, self.joint.database
        costs: dict[str, dict[str, float]] = {}
        for k, role in enumerate(joint.roles):
            query, at = inputs.queries[cast[k]], joint.frames[k, frame : frame + 1]
            each = cost.channel_costs(database.layout, at, query, database.slices, joint.own_weights)[:, 0]
            costs[role] = dict(zip(database.channel_names, each.tolist(), strict=True))
        for p, (one, other) in enumerate(joint.pairs):
            apart = (joint.relative[p, frame] - inputs.seen[cast[one], cast[other]]) ** 2
            for what, columns, weight in zip(("place", "facing"), (PLACE, FACING), joint.relative_weights, strict=True):
                costs[joint.roles[one]][f"{joint.roles[other]} {what}"] = float(weight * apart[columns].sum())
        return costs


def _place(numbers: Floats) -> GroundPlace:
    x, z, heading = numbers.tolist()
    return x, z, heading


def places_of(places: Places, actors: Sequence[Hashable]) -> Floats:
    """The places of actors: float64 [A, 3]; raises QueryError, which names the actor."""
    require_mapping(places, "places", PLACES)
    ground_places = np.empty((len(actors), 3))
    for i, actor in enumerate(actors):
        if actor not in places:
            raise QueryError(
                Fault(f"there is no place for the actor {actor!r}.", "(x, z, heading) for each actor that may be cast")
            )
        try:
            numbers = place_of(places[actor])
        except ContextError:
            numbers = None
        if numbers is None or max(map(abs, numbers)) > FARTHEST_M:
            accepted = f"{A_BODY}, at most {FARTHEST_M:,.0f}"
            raise QueryError(Fault(f"the place of the actor {actor!r} is {places[actor]!r}.", accepted))
        ground_places[i] = numbers
    return ground_places


def _gives_of(gives: Mapping[str, float] | None, roles: Sequence[str]) -> Floats:
    given = {} if gives is None else require_mapping(gives, "gives", "a mapping of roles to numbers")
    for role, value in given.items():
        if role not in roles:
            raise QueryError(no_such("role", role, roles))
        number = as_number(value)
        if number is None or not 0.0 <= number <= FARTHEST_M:
            raise QueryError(Fault(f"{role} gives way by {value!r}.", "a number from 0, not at all, to a million"))
    return np.array([float(given.get(role, 1.0)) for role in roles])


def _of_actor(fault: Fault, actor: Hashable) -> Fault:
    return Fault(f"actor {actor!r}: {fault.found}", fault.accepted, fault.mend, fault.place, fault.rule)
