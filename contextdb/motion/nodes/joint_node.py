"""A joint node: a clip of several roles, chosen and cast once when it is entered and played to completion, all roles in step.

Each actor sets out from where he is. What he has to make up for (see `contextdb.motion.joint.alignment`) is blended in along his
own path until the contact; there every two actors are to each other as they were recorded, and from there on they stay so. The
contact is the earliest end of a warp range of any role (`WarpPosition`, `WarpRotation` in the markup), and the blending begins with
the earliest of these ranges; without any, or behind the contact, the blending lasts to the end of the clip.

All roles have one time: a frame is the same frame for each of them.

K roles. Times are seconds. The loops are the core's meeting.h. Source: the match node of Remedy's talk, for several.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Unpack

import numpy as np

from contextdb.cells.arguments import require_kind, require_real, require_text, require_whole
from contextdb.core import begin_roles
from contextdb.errors import Fault, MotionError, QueryError, in_quotes, some
from contextdb.motion.clips.ground_place import GroundPlace
from contextdb.motion.joint.database import JointDatabase
from contextdb.motion.joint.hit import JointHit
from contextdb.motion.joint.searcher import JointOptions, JointSearcher, Places, Queries, places_of
from contextdb.motion.nodes.match_node import MatchCosts, MatchPlay
from contextdb.motion.nodes.warping import Target, Window, warped
from contextdb.motion.search.hit import Hit
from contextdb.motion.selection.chooser import Chooser
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.decision import Action, Decision, Together
from contextdb.motion.selection.playhead import Playhead
from contextdb.motion.selection.root_motion import RootMotion
from contextdb.motion.selection.selector import Entry, Selector


@dataclass(eq=False)
class JointPlay:
    """A joint clip that a node has entered.

    Attributes
    ----------
    hit : JointHit
        What was chosen.
    plays : dict of str to MatchPlay
        By role: the path of its actor.
    starts : dict of str to RootMotion
        Where each actor was in the world when it was entered.
    contact_s : float
        Seconds since the entry at which all actors are to each other as recorded.
    """

    hit: JointHit
    plays: dict[str, MatchPlay]
    starts: dict[str, RootMotion]
    contact_s: float

    @property
    def time_s(self) -> float:
        """Seconds since the entry: the same for all roles."""
        return next(iter(self.plays.values())).time_s

    @property
    def duration_s(self) -> float:
        """Seconds from the entry to the end."""
        return next(iter(self.plays.values())).duration_s

    @property
    def is_done(self) -> bool:
        """Whether it has played to completion."""
        return all(play.is_done for play in self.plays.values())

    @property
    def frames(self) -> dict[str, int]:
        """The frame of the motion database that each role shows now."""
        return {role: play.frame for role, play in self.plays.items()}

    def advance(self, dt_s: float) -> dict[str, GroundPlace]:
        """Play on for some seconds, and say where in the world each role's actor is then; at the end they stay."""
        for play in self.plays.values():
            play.advance(dt_s)
        return self.at(self.time_s)

    def at(self, time_s: float) -> dict[str, GroundPlace]:
        """Where in the world each role's actor is some seconds after the entry, as (x, z, heading)."""
        places = {role: self.starts[role].then(play.at(time_s)) for role, play in self.plays.items()}
        return {role: (place.left_m, place.ahead_m, place.turn_rad) for role, place in places.items()}

    def decision(self, role: str, database: str = "", *, tick: int = 0, time_s: float | None = None) -> Decision:
        """What a role plays now, for `PoseStream.update` and for `Trace.record`; as `MatchPlay.decision`.

        Parameters
        ----------
        role : str
        database : str
            Its name. Default: that of the hit.
        tick : int
            The update of the session that this is.
        time_s : float, optional
            Seconds of the session. Default: those since the entry.

        Raises
        ------
        QueryError
            There is no such role.
        """
        if require_text(role, "role") not in self.plays:
            raise QueryError(Fault(f"there is no role {in_quotes(role)}.", some(self.plays)))
        decision = self.plays[role].decision(require_text(database, "database") or str(self.hit.database))
        decision = replace(decision, tick=require_whole(tick, "tick"))
        if time_s is not None:
            decision = replace(decision, time_s=require_real(time_s, "time_s", 0.0, math.inf))
        return self._entered(decision, role) if decision.action is Action.JUMP else decision

    def _entered(self, decision: Decision, role: str) -> Decision:
        """The first decision, with what was chosen."""
        hit = self.hit
        entry_s = self.plays[role].entry_s
        cast = {each: str(actor) for each, actor in hit.cast.items()}
        together = Together(role, str(hit.asset), entry_s, cast, hit.costs, hit.bias)
        return replace(decision, why=hit.sentence, searched=True, cost=hit.cost, together=together)


class JointNode:
    """Plays what a joint searcher finds.

    Parameters
    ----------
    searcher : JointSearcher
        Of databases that know their rate: built from clips.

    Raises
    ------
    MotionError
        A database without a rate.
    """

    def __init__(self, searcher: JointSearcher) -> None:
        require_kind(searcher, JointSearcher, "searcher", "a JointSearcher")
        for name, joint in searcher.databases.items():
            if joint.rate is None:
                problem = f"the database {in_quotes(name)} has no schema that gives its rate."
                raise MotionError(Fault(problem, "a database that was built from clips"))
        self.searcher = searcher
        databases = ((name, joint.database) for name, joint in searcher.databases.items())
        self._choosers = {name: Chooser(Selector([Entry(name, each)]), ControllerSettings()) for name, each in databases}

    def enter(self, queries: Queries, places: Places, **options: Unpack[JointOptions]) -> JointPlay | None:
        """Choose clip, frame and cast, and play them from this update on; None when nothing may play.

        The parameters, and what it raises, are those of `JointSearcher.search`.
        """
        hit = self.searcher.search(queries, places, **options)
        return self.play(hit, places) if hit else None

    def play(self, hit: JointHit, places: Places) -> JointPlay:
        """Start what a search found, with the actors where they are; raises QueryError for another's hit or a missing place."""
        require_kind(hit, JointHit, "hit", "a JointHit")
        joint = self.searcher.databases.get(str(hit.database)) if hit else None
        if joint is None:
            raise QueryError(Fault("there is nothing to play.", "a hit of this node's searcher"))
        here = places_of(places, [hit.cast[role] for role in joint.roles])
        put, targets = np.array([hit.places[role] for role in joint.roles]), np.empty((len(joint.roles), 3))
        ranges, warps = np.ascontiguousarray(joint.ranges[hit.range]), joint.database.marks.warps
        last, *window = begin_roles(self._choosers[str(hit.database)].core, ranges, hit.frame, warps, put, here, targets)
        n_frames = last + 1 - hit.frames[joint.roles[0]]
        each = zip(joint.roles, (Target(*numbers) for numbers in targets.tolist()), strict=True)
        plays = {role: _play(joint, hit, k, n_frames, target, Window(*window)) for k, (role, target) in enumerate(each)}
        starts = {role: RootMotion(*place) for role, place in zip(joint.roles, here.tolist(), strict=True)}
        return JointPlay(hit, plays, starts, window[1])


def _play(joint: JointDatabase, hit: JointHit, k: int, n_frames: int, target: Target, window: Window) -> MatchPlay:
    """The path of one role's actor, from where he is to where the clip, put down in the world, has him at the contact."""
    database, role, rate = joint.database, joint.roles[k], _rate(joint)
    assert database.root is not None, "checked when the joint database was made"
    at, frame = int(joint.ranges[hit.range, k]), hit.frames[role]
    path = database.root[frame : frame + n_frames].astype(np.float64)
    own = Hit(database.assets[at], at, frame, math.fsum(hit.costs[role].values()))
    costs = MatchCosts(hit.costs[role], 0.0, 0.0, 0.0)
    there = warped(np.arange(n_frames) / rate, path, window, window, target)
    return MatchPlay(own, target, costs, there, Playhead(database, at, rate))


def _rate(joint: JointDatabase) -> float:
    assert joint.rate is not None, "checked when the node was made"
    return joint.rate
