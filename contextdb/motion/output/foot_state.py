"""What a foot is between two updates, and the bounds within which it is held: numbers alone, for loops and for their callers."""

from __future__ import annotations

import math

from contextdb.motion.output.stages import damping

STRAIGHT = math.radians(170.0)
"""A knee that is straighter is damped."""
FAR_M = 1.0
"""A foot that is farther from its clip's place belongs to a character that was put elsewhere: it goes there at once."""
BACK_SHARE, SLOW_MPS = 1.0 / 3.0, 0.5
"""A foot that had to be let go is locked again when it has come back to its clip as far as to this share of the radius, and
moves no faster than this."""
HIPS_HALFLIFE_S = 0.1
"""How fast hips and feet come to the height of the ground."""
HIPS_DAMPING = damping(HIPS_HALFLIFE_S)
LEAST_MPS = 1e-6
MOST_LOWER = 0.25
"""The hips go down by no more metres than this for a foot out of reach."""


SEEN, DOWN, LOCKED, POINT, OFFSET, SPEED, FREE, SHOWN, WIDTH = 0, 1, 2, 3, 5, 8, 11, 14, 17
"""A foot's state is a row of so many numbers: whether it was seen, is down in the clip and is locked; where it is locked over the
ground (x and z); the offset to that, or to where the foot is without a lock, and its change a second; where the foot is without a
lock; and where it is shown. Each constant is the first column."""
