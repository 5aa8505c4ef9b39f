"""How a report for people is kept short: the first findings of each rule, then how many more there are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import accumulate

STEPS = (20, 10, 5, 3, 2, 1)
"""How many findings of one rule are shown; the first that fits."""


def fitted(sections_at: Callable[[int], Sequence[str]], size: Callable[[str], int], room: int) -> list[str]:
    """The sections that fit.

    Parameters
    ----------
    sections_at : function of int
        The sections with at most so many findings of one rule.
    size : function of str
        How much room a section takes.
    room : int
        How much there is. Where not even one finding of each rule fits, the last sections are left out; the first one never is.
    """
    sections: Sequence[str] = ()
    for most in STEPS:
        sections = sections_at(most)
        if sum(map(size, sections)) <= room:
            return list(sections)
    n_fitting = sum(total <= room for total in accumulate(map(size, sections)))
    return list(sections[: max(1, n_fitting)])
