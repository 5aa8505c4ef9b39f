"""What a joint search chose: who plays what from when, what it costs, and where in the world it is played."""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass

from contextdb.motion.clips.ground_place import GroundPlace
from contextdb.motion.selection.choice import Choice, Search
from contextdb.motion.selection.root_motion import RootMotion


@dataclass(frozen=True, eq=False)
class JointHit:
    """What a joint search chose. False when nothing may play; its cost is then infinite, its asset None, its cast empty.

    Attributes
    ----------
    database : str or None
        The name of the database.
    asset : str or None
        Without the roles.
    row : int or None
        The row of the table whose cells accept the cast; None for a search without a table's answer.
    mirrored : bool
    range, frame : int
        The joint range, and the frame since its start, the same for all roles.
    time_s : float or None
        The same in seconds; None for a database made from features.
    cost : float
        A weighted mean of squared differences; the bias is in it.
    cast : dict of str to actor
        Who plays which role.
    costs : dict of str to dict of str to float
        By role and channel; what a role sees of another is named "Carrier place" and "Carrier facing".
    bias : float
    frames : dict of str to int
        The frame of each role in the motion database.
    places : dict of str to (x, z, heading)
        Where in the world the clip has each actor at this frame, when it is put down best.
    alignment : dict of str to RootMotion
        The movement from where each actor is to there, in his own frame.
    searches : tuple of Search
        All databases in order, with their best costs.
    why : str
        The choice among databases in one sentence.
    """

    database: str | None
    asset: str | None
    row: int | None
    mirrored: bool
    range: int
    frame: int
    time_s: float | None
    cost: float
    cast: dict[str, Hashable]
    costs: dict[str, dict[str, float]]
    bias: float
    frames: dict[str, int]
    places: dict[str, GroundPlace]
    alignment: dict[str, RootMotion]
    searches: tuple[Search, ...] = ()
    why: str = ""

    def __bool__(self) -> bool:
        return self.frame >= 0

    @property
    def sentence(self) -> str:
        """The choice in one sentence."""
        if not self:
            return f"Nothing may play. {self.why}".strip()
        roles = [f"{actor} as {role} ({math.fsum(self.costs[role].values()):.4f})" for role, actor in self.cast.items()]
        when = f"frame {self.frame}" if self.time_s is None else f"{self.time_s:.2f} s"
        side = " mirrored" if self.mirrored else ""
        text = f"{', '.join(roles[:-1])} and {roles[-1]} enter {self.asset}{side} together at {when}, at cost {self.cost:.4f}"
        return f"{text}: {self.why}" if len(self.searches) > 1 else f"{text}."

    def explain(self) -> str:
        """The choice in lines for people: who plays what from when, what each role costs and by what, and what is to be made up."""
        if not self:
            return f"Nothing may play. {self.why}".strip() + "\n"
        side = " mirrored" if self.mirrored else ""
        row = "" if self.row is None else f", row {self.row}"
        when = f"frame {self.frame}" if self.time_s is None else f"{self.time_s:.3f} s"
        lines = [f"{self.asset}{side}{row}, from {when}: cost {self.cost:.4f}"]
        for role, actor in self.cast.items():
            own = self.costs[role]
            dearest = sorted(own, key=lambda name: -own[name])[:3]
            costs = ", ".join(f"{name} {own[name]:.4f}" for name in dearest)
            lines.append(f"  {role} is {actor}: cost {math.fsum(own.values()):.4f} ({costs}{', …' if len(own) > 3 else ''})")
            way = self.alignment[role]
            lines.append(f"    to make up: {_sided(way)}")
        if self.bias:
            lines.append(f"  biases {self.bias:+.4f}")
        if len(self.searches) > 1:
            lines.append(f"  {self.why}")
        return "\n".join(lines) + "\n"


def nothing(choice: Choice) -> JointHit:
    """What a search gives that finds nothing to play."""
    return JointHit(None, None, None, False, -1, -1, None, math.inf, {}, {}, 0.0, {}, {}, {}, choice.searches, choice.why)


def _sided(way: RootMotion) -> str:
    left, ahead, turn = way.left_m, way.ahead_m, math.degrees(way.turn_rad)
    return (
        f"{abs(left):.2f} m {'left' if left >= 0 else 'right'}, {abs(ahead):.2f} m {'ahead' if ahead >= 0 else 'back'}, "
        f"{abs(turn):.0f}° {'left' if turn >= 0 else 'right'}"
    )
