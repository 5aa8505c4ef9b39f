"""Weights that are turned by steps: round numbers, about a quarter from one to the next."""

from __future__ import annotations

from bisect import bisect_left, bisect_right

STEPS = (
    *(0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.5),
    *(10.0, 12.5, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 75.0, 100.0),
)


def turned(value: float, up: bool) -> float:
    """The next step above a value, or below it; beyond the last step the value doubles, or halves."""
    if up:
        at = bisect_right(STEPS, value)
        return STEPS[at] if at < len(STEPS) else value * 2.0
    at = bisect_left(STEPS, value)
    if at == len(STEPS) and value / 2.0 > STEPS[-1]:
        return value / 2.0
    return STEPS[max(0, at - 1)]
