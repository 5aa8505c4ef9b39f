"""The tags of markup that mean something to the search, what value each takes, and the names that are mistaken for them.

A reserved tag is known in any case. A name that is only like one is refused: as a plain tag it would do nothing, and nobody would
see why. Below another tag every name is free: `Gait.Loping` is no misspelt `Looping`.
"""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache

from contextdb.errors import Fault, in_quotes

MOST_COST = 1e30
"""No cost modifier or penalty is farther from 0, so that sums of them stay finite."""
MOST_SECONDS = 1e9
"""No time is larger."""

TAG_NAME = re.compile(r"[\w:\-]+(\.[\w:\-]+)*")
ACCEPTED_NAME = "letters, digits, and _ : - in parts between dots, such as Move.Run"
NEAR = 0.9
"""How alike two words are, from 0 to 1, before one is taken for a misspelling of the other."""


class ReservedTag(StrEnum):
    """What the search, the controller and the match node act on; every other tag is a plain one, and theirs who use it."""

    DO_NOT_CHOOSE = "DoNotChoose"
    EXCLUDED = "Excluded"
    NEXT_NATURAL_ONLY = "NextNaturalOnly"
    MATCH_RANGE = "MatchRange"
    WARP_POSITION = "WarpPosition"
    WARP_ROTATION = "WarpRotation"
    COST_MODIFIER = "CostModifier"
    ROOT_MOTION_WEIGHT = "RootMotionWeight"
    LOOPING = "Looping"
    CONTACT_LEFT = "Contact.Left"
    CONTACT_RIGHT = "Contact.Right"


CONTACTS = (ReservedTag.CONTACT_LEFT, ReservedTag.CONTACT_RIGHT)
"""When the left and the right foot are down."""


@dataclass(frozen=True, slots=True)
class ValueRule:
    """Which values a tag takes: numbers from `least` to `most`, and whether it must have one."""

    accepted: str
    least: float
    most: float
    is_required: bool = True


VALUE_RULES = {
    ReservedTag.NEXT_NATURAL_ONLY: ValueRule("the length of the entry zone in seconds, such as 0.2", 0.0, MOST_SECONDS, False),
    ReservedTag.COST_MODIFIER: ValueRule("what is added to the cost, such as 0.5 or -0.5", -MOST_COST, MOST_COST),
    ReservedTag.ROOT_MOTION_WEIGHT: ValueRule("how much of the movement comes from the animation, from 0 to 1", 0.0, 1.0),
    **dict.fromkeys(
        CONTACTS, ValueRule("1 where the foot is down, which no value means too, or 0 where it is up", 0.0, 1.0, False)
    ),
}
"""The tags that take a value; all others take none."""


def letters_of(name: str) -> str:
    """A name without case and without all that is no letter or digit."""
    return "".join(c for c in name.casefold() if c.isalnum())


_RESERVED = {tag.casefold(): tag for tag in ReservedTag}
_OTHER_NAMES = {
    "blocktransition": ReservedTag.DO_NOT_CHOOSE,
    "ignore": ReservedTag.DO_NOT_CHOOSE,
    "ignored": ReservedTag.DO_NOT_CHOOSE,
    "excludefromdatabase": ReservedTag.EXCLUDED,
    "nextnatural": ReservedTag.NEXT_NATURAL_ONLY,
    "modifycost": ReservedTag.COST_MODIFIER,
    "costbias": ReservedTag.COST_MODIFIER,
    "rootmotion": ReservedTag.ROOT_MOTION_WEIGHT,
    "rootweight": ReservedTag.ROOT_MOTION_WEIGHT,
    "loop": ReservedTag.LOOPING,
}
"""What other engines and hasty people call them."""


def reserved_of(name: str) -> ReservedTag | None:
    """The reserved tag of a name in any case, or None for a plain tag."""
    return _RESERVED.get(name.casefold())


@lru_cache(maxsize=4096)
def name_fault(name: str) -> Fault | None:
    """What is wrong with the name of a tag, or None."""
    if reserved_of(name):
        return None
    if not name:
        return Fault("there is no tag.", ACCEPTED_NAME)
    near = mistaken_for(name)
    if near:
        problem = f"the tag {in_quotes(name)} is too like the reserved tag {in_quotes(near)}: it would be mistaken for it."
        return Fault(
            problem, f"{in_quotes(near)}, or a name of your own, such as {in_quotes(f'My.{_plain(name)}')}", in_quotes(near)
        )
    if not TAG_NAME.fullmatch(name):
        return Fault(
            f"{in_quotes(name)} cannot be the name of a tag.", ACCEPTED_NAME, in_quotes(_plain(name)) if _plain(name) else ""
        )
    return None


def mistaken_for(name: str) -> ReservedTag | None:
    """The reserved tag that a name, or its part before the first dot, is too like; None when it is like none."""
    return _like(letters_of(name)) or _like(letters_of(name.partition(".")[0]))


def _like(word: str) -> ReservedTag | None:
    return _OTHER_NAMES.get(word) or next((tag for known, tag in _RESERVED.items() if _is_misspelt(word, known)), None)


def _is_misspelt(word: str, known: str) -> bool:
    """Whether a word is a known one with its letters swapped, or with one too few or too many; a long one may have more wrong."""
    if abs(len(word) - len(known)) > len(known) // 4:
        return False
    return sorted(word) == sorted(known) or difflib.SequenceMatcher(None, word, known, autojunk=False).ratio() >= NEAR


def _plain(name: str) -> str:
    """The nearest name that is in the grammar of tags, or "" when nothing is left of it."""
    parts = (re.sub(r"[^\w:\-]+", "_", part.strip()).strip("_") for part in name.split("."))
    return ".".join(part for part in parts if part)
