"""Where a body is over the ground, as the game says it: a `Steered`, or three numbers."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from contextdb.cells.arguments import require_real
from contextdb.errors import ContextError, Fault
from contextdb.motion.clips.steering import Steered

GroundPlace: TypeAlias = tuple[float, float, float]
"""x and z in metres, and a heading in radians."""
OfBody: TypeAlias = Steered | GroundPlace
A_BODY = "a Steered, or x and z in metres and a heading in radians"


def place_of(body: OfBody | None) -> GroundPlace | None:
    """The place of a body; None where none is given. Raises ContextError for what is none."""
    if body is None:
        return None
    if isinstance(body, Steered):
        return float(body.position[0]), float(body.position[1]), float(body.heading)
    if not isinstance(body, (tuple, list, np.ndarray)) or len(body) != 3:
        raise ContextError(Fault(f"body is {body!r}.", A_BODY))
    return require_real(body[0], "x"), require_real(body[1], "z"), require_real(body[2], "heading")
