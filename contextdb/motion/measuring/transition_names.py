"""Transitions between states that have no clip, by the names of clips: a pattern such as `{from}_to_{to}` says which they are.

A state is what some clip's name has in the place of `{from}` or `{to}`. Names say nothing more: a state that no transition names is
none, and one way of going from a state to another is enough. Source of the pattern: the transitions of Forsyth's talk, seed 003.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from contextdb.errors import Fault, MotionError, in_quotes

PATTERN = "{from}_to_{to}"
ACCEPTED = '{from} and {to}, each once, with text between them, such as "{from}_to_{to}"'


@dataclass(frozen=True)
class TransitionCoverage:
    """The states that transitions join, and the pairs of them, from and to, that have a clip and that have none."""

    pattern: str
    states: tuple[str, ...] = ()
    present: tuple[tuple[str, str], ...] = ()
    missing: tuple[tuple[str, str], ...] = ()

    def name_of(self, pair: tuple[str, str]) -> str:
        """The name that the clip of a pair would have."""
        return self.pattern.replace("{from}", pair[0]).replace("{to}", pair[1])

    def to_json(self) -> dict[str, object]:
        return {
            "pattern": self.pattern,
            "states": list(self.states),
            "present": [list(pair) for pair in self.present],
            "missing": [{"from": pair[0], "to": pair[1], "clip": self.name_of(pair)} for pair in self.missing],
        }


def transitions_of(names: Iterable[str], pattern: str = PATTERN) -> TransitionCoverage:
    """The transitions among some clips. What is before `{from}`, between and behind `{to}` is compared to the letter; a name that
    fits in several ways is divided where the pattern fits first. Raises MotionError where the pattern has not both places, each
    once, with text between."""
    fits = re.compile(_expression(pattern), re.DOTALL)
    pairs = {(match["a"], match["b"]): None for name in names if (match := fits.fullmatch(name))}
    present = [pair for pair in pairs if pair[0] != pair[1]]
    states = tuple(sorted({state for pair in present for state in pair}))
    missing = ((a, b) for a in states for b in states if a != b and (a, b) not in pairs)
    return TransitionCoverage(pattern, states, tuple(sorted(present)), tuple(missing))


def _expression(pattern: str) -> str:
    before, separator, rest = pattern.partition("{from}")
    between, found_too, behind = rest.partition("{to}")
    if not (separator and found_too and between) or any("{from}" in part or "{to}" in part for part in (before, between, behind)):
        raise MotionError(Fault(f"{in_quotes(pattern)} is not a pattern of transitions.", ACCEPTED, in_quotes(PATTERN)))
    return f"{re.escape(before)}(?P<a>.+?){re.escape(between)}(?P<b>.+){re.escape(behind)}"
