"""Spans of markup: what is said of one asset, or of those whose name fits a pattern, from one time to another."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from contextdb.motion.markup.reserved import reserved_of

TOLERANCE_S = 1e-6
"""A frame this near to an end of a span, in seconds, is within it: a third of a second need not be typed to the last digit."""

WILDCARD = "*"


@dataclass(frozen=True, slots=True)
class Span:
    """One row of markup.

    Attributes
    ----------
    asset : str
        The name of an asset, or a pattern: `*` matches any text, so `jog_*` holds for `jog_left`, and `*` for every asset.
    tag : str
        A reserved tag, in its own spelling, or a plain one.
    from_s, to_s : float
        Seconds since the start of the clip, both within; infinite `to_s`: up to the end.
    value : float or None
        What some reserved tags need.
    line : int or None
        Where it is in a file; spans that differ in this alone are equal.
    """

    asset: str
    tag: str
    from_s: float = 0.0
    to_s: float = math.inf
    value: float | None = None
    line: int | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        reserved = reserved_of(self.tag) if isinstance(self.tag, str) else None
        if reserved:
            object.__setattr__(self, "tag", str(reserved))

    @property
    def is_pattern(self) -> bool:
        """Whether `asset` is a pattern. A span that names its asset is stronger than one with a pattern."""
        return WILDCARD in self.asset


def fits(pattern: str, asset: str) -> bool:
    """Whether an asset has the name, or a name that fits the pattern. `*` alone has a meaning; case counts."""
    if WILDCARD not in pattern:
        return pattern == asset
    first, *middle, last = pattern.split(WILDCARD)
    at, stop = len(first), len(asset) - len(last)
    if stop < at or not asset.startswith(first) or not asset.endswith(last):
        return False
    for part in middle:
        position = asset.find(part, at, stop)
        if position < 0:
            return False
        at = position + len(part)
    return True
