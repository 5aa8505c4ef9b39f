"""Transitions by name: the clip that leads from one state to another, or none, and the game then blends.

A state is whatever the game's clips are named after: a gait, a stance, a weapon. Which pairs have no clip is data, for a report.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import SequenceMatcher
from functools import cached_property
from string import Formatter

from contextdb.cells.arguments import require_many_of, require_text
from contextdb.errors import Fault, MotionError, in_quotes, nearest

USUAL_PATTERN = "{from}_to_{to}"
MISSPELT = 0.85
"""Names this much alike are taken for one, misspelt: another transition of the same state is less so."""
A_PATTERN = 'a text with {from} and {to}, such as "{from}_to_{to}"'


@dataclass(frozen=True)
class Missing:
    """A pair of states without a transition."""

    from_state: str
    to_state: str
    wanted: tuple[str, ...]
    """The names of clips that would be one."""
    near: str = ""
    """A clip of nearly such a name, "" for none: perhaps it is misspelt."""


@dataclass(frozen=True)
class Transitions:
    """Finds transitions among the names of clips.

    Raises
    ------
    MotionError
        No pattern, or one without {from} and {to}.
    ContextError
        What is given are no texts.
    """

    clips: Iterable[str]
    """The names of all clips, or of the assets of a table."""
    patterns: Iterable[str] = (USUAL_PATTERN,)
    """How a transition's clip is named; the first that has a clip counts."""

    def __post_init__(self) -> None:
        for name in ("clips", "patterns"):
            object.__setattr__(self, name, tuple(require_many_of(getattr(self, name), str, name, "a list of texts")))
        wrong = [Fault(f"the pattern is {in_quotes(each)}.", A_PATTERN) for each in self.patterns if not _is_pattern(each)]
        if wrong or not self.patterns:
            raise MotionError(*(wrong or [Fault("there is no pattern.", A_PATTERN)]))

    def find(self, from_state: str, to_state: str) -> str | None:
        """The clip that leads from one state to another; None where there is none, and a blend takes its place.

        Raises ContextError for what are no texts.
        """
        return next((name for name in self._wanted(from_state, to_state) if name in self._known), None)

    def missing(self, states: Iterable[str]) -> list[Missing]:
        """The pairs of different states without a clip, in order, each with the name that it would have.

        Raises ContextError for what are no texts.
        """
        listed = list(dict.fromkeys(require_many_of(states, str, "states", "a list of texts")))
        pairs = [(one, other) for one in listed for other in listed if one != other]
        return [self._missing(one, other) for one, other in pairs if self.find(one, other) is None]

    @cached_property
    def _known(self) -> frozenset[str]:
        return frozenset(self.clips)

    def _wanted(self, from_state: str, to_state: str) -> tuple[str, ...]:
        """The names of clips that lead from one state to another."""
        names = {"from": require_text(from_state, "from_state"), "to": require_text(to_state, "to_state")}
        return tuple(pattern.format_map(names) for pattern in self.patterns)

    def _missing(self, from_state: str, to_state: str) -> Missing:
        wanted = self._wanted(from_state, to_state)
        return Missing(from_state, to_state, wanted, next((near for near in map(self._near, wanted) if near), ""))

    def _near(self, name: str) -> str:
        """A clip that is perhaps meant to have a name; "" for none."""
        near = nearest(name, self.clips) or ""
        return near if SequenceMatcher(None, name.casefold(), near.casefold()).ratio() >= MISSPELT else ""


def _is_pattern(text: str) -> bool:
    """Whether a text has the places of both states, plain, and no other one."""
    try:
        parts = list(Formatter().parse(text))
    except ValueError:
        return False
    fields = [(name, spec, conversion) for _, name, spec, conversion in parts if name is not None]
    return {name for name, _, _ in fields} == {"from", "to"} and not any(spec or conversion for _, spec, conversion in fields)
