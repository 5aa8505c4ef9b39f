"""A match gate: is there an animation that fits now? It is open while the best cost is under a bar.

A gate asks a database, or a match node, what its best asset costs, and plays nothing itself. Over a match node of entry animations
it opens the way into an action: in the moment in which it opens it gives the entry animation to play.

A second, higher bar to close at keeps a gate from flapping while the cost goes up and down about the first.

Source: "Match Gate Node" in EA's talk: "What's the cost of the best asset?", "Combine it with entry animations".
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Unpack

from numpy.typing import ArrayLike

from contextdb.cells.arguments import as_number
from contextdb.errors import Fault, MotionError, QueryError
from contextdb.motion.arguments import Valid
from contextdb.motion.nodes.match_node import MatchNode, MatchOptions, MatchPlay
from contextdb.motion.nodes.warping import Target
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.hit import Hit


@dataclass(frozen=True, eq=False)
class GateLook:
    """What a gate saw.

    Attributes
    ----------
    hit : Hit
        The best frame; its cost is infinite when nothing may play.
    bar : float
        Below this cost the gate is open now: its threshold, or `close_above` when it was open already.
    was_open, is_open : bool
        Before and after.
    play : MatchPlay or None
        The entry animation, from a gate over a match node that opens now.
    """

    hit: Hit
    bar: float
    was_open: bool
    is_open: bool
    play: MatchPlay | None = None

    @property
    def cost(self) -> float:
        """The best cost."""
        return self.hit.cost

    @property
    def opens(self) -> bool:
        """Whether it was shut and is open now."""
        return self.is_open and not self.was_open

    @property
    def closes(self) -> bool:
        """Whether it was open and is shut now."""
        return self.was_open and not self.is_open

    def __str__(self) -> str:
        state = "opens" if self.opens else "closes" if self.closes else "open" if self.is_open else "shut"
        if not self.hit:
            return f"{state}: nothing may play"
        under = "under" if self.cost < self.bar else "not under"
        return f"{state}: {self.hit.asset} costs {self.cost:.3f}, {under} {self.bar:g}"


class MatchGate:
    """Opens when the best cost is under a threshold. A gate is shut at first.

    Parameters
    ----------
    over : MotionDatabase or MatchNode
        What is queried for its best cost. All frames of a database count, of a match node those of match ranges.
    threshold : float
        Below it the gate opens.
    close_above : float, optional
        An open gate closes when the cost is no longer below this. Default: the threshold.

    Attributes
    ----------
    seen : GateLook or None
        What it saw when it last looked.

    Raises
    ------
    MotionError
        A bar that is not a finite number, or one to close at that is below the one to open at.
    """

    def __init__(self, over: MotionDatabase | MatchNode, threshold: float, close_above: float | None = None) -> None:
        self.over = over
        self.threshold = _bar(threshold, "threshold")
        self.close_above = self.threshold if close_above is None else _bar(close_above, "close_above")
        self.seen: GateLook | None = None
        if self.close_above < self.threshold:
            problem = f"a gate that opens under {self.threshold:g} cannot close above {self.close_above:g}."
            raise MotionError(Fault(problem, f"close_above of {self.threshold:g} or more"))

    @property
    def is_open(self) -> bool:
        """Whether it was open when it last looked."""
        return self.seen is not None and self.seen.is_open

    def update(
        self,
        query: ArrayLike,
        target: Target | None = None,
        valid: Valid | None = None,
        **options: Unpack[MatchOptions],
    ) -> GateLook:
        """Look what the best asset costs now, and open or close. The parameters are those of `MatchNode.enter`; a database has no
        target. Raises QueryError as a search does, and for a gate over a match node without a target, or one over a database with
        one."""
        hit = self._search(query, target, valid, **options)
        was_open = self.is_open
        bar = self.close_above if was_open else self.threshold
        is_open = hit.cost < bar
        play = None
        if is_open and not was_open and isinstance(self.over, MatchNode) and target is not None:
            play = self.over.play(hit, query, target, valid, **options)
        self.seen = GateLook(hit, bar, was_open, is_open, play)
        return self.seen

    def cost(
        self,
        query: ArrayLike,
        target: Target | None = None,
        valid: Valid | None = None,
        **options: Unpack[MatchOptions],
    ) -> float:
        """What the best asset costs now, infinite when nothing may play; the gate stays as it is."""
        return self._search(query, target, valid, **options).cost

    def close(self) -> None:
        """Shut the gate, as when the action it led to is left: the next look may open it again."""
        self.seen = None

    def _search(self, query: ArrayLike, target: Target | None, valid: Valid | None, **options: Unpack[MatchOptions]) -> Hit:
        if isinstance(self.over, MatchNode):
            if target is None:
                raise QueryError(Fault("a gate over a match node has no target.", "a Target"))
            return self.over.search(query, target, valid, **options)
        if target is not None:
            raise QueryError(Fault("a gate over a database was given a target.", "none; or a gate over a MatchNode"))
        return self.over.search(query, valid, **options)


def _bar(value: object, what: str) -> float:
    number = as_number(value)
    if number is None:
        raise MotionError(Fault(f"the gate's {what} is {value!r}.", "a finite cost, such as 0.1"))
    return number
