"""How a report for people is kept short: the first findings of each rule, then how many more there are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import accumulate

from contextdb.report.results import Group

STEPS = (20, 10, 5, 3, 2, 1)
"""How many findings of one rule are shown; the first that fits."""


def fitted(sections_at: Callable[[int], Sequence[str]], size: Callable[[str], int], room: int) -> tuple[list[str], int]:
    """The sections of the longest form of a report that fits into `room`, and how many findings of one rule they show.

    `sections_at` gives the sections with at most so many findings of one rule, `size` how much room a section takes. Where not even
    one finding of each rule fits, the last sections are left out; the first one never is.
    """
    sections: Sequence[str] = ()
    for most in STEPS:
        sections = sections_at(most)
        if sum(map(size, sections)) <= room:
            return list(sections), most
    n_fitting = sum(total <= room for total in accumulate(map(size, sections)))
    return list(sections[: max(1, n_fitting)]), STEPS[-1]


def n_hidden(groups: Sequence[Group], n_shown: int, most: int) -> int:
    """How many findings are not shown, with the first `n_shown` groups and at most so many findings of each rule."""
    cut = sum(max(0, len(findings) - most) for group in groups[:n_shown] for _, _, findings in group.blocks())
    return cut + sum(len(group.findings) for group in groups[n_shown:])
