"""What a search chose."""

from __future__ import annotations

import math
from dataclasses import dataclass

from contextdb.motion.records import quickly_made


@quickly_made
@dataclass(frozen=True, slots=True)
class Hit:
    """The frame that a search chose. False when nothing may play; its cost is then infinite, its asset None, range and frame -1.

    Attributes
    ----------
    asset : str or None
    range : int
        The range that holds the frame, 0…R-1.
    frame : int
        Counted over the whole database, 0…N-1.
    cost : float
        A weighted mean of squared differences, without a unit; the biases are in it.
    """

    asset: str | None
    range: int
    frame: int
    cost: float

    def __bool__(self) -> bool:
        return self.frame >= 0


NOTHING = Hit(None, -1, -1, math.inf)
