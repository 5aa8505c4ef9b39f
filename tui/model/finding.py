"""Find a command by what somebody calls it: its name, other names, or what it does. No Textual here.

Each word of the query counts by the best place that has it: the name, then other names, then the sentence about it; whole words
before beginnings before parts. A phrase that is the name, or another name, comes first of all. All words must be somewhere.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

PASSED_OVER = frozenset(
    ["a", "an", "and", "by", "for", "from", "how", "i", "in", "is", "it", "my", "of", "on", "or", "the", "this", "to", "with"]
)
_WHOLE, _BEGINNING, _PART = 4, 3, 1
_LABEL, _OTHER, _ABOUT = 4, 3, 1
_PHRASE = 40


@dataclass(frozen=True)
class Findable:
    """One thing to find."""

    label: str
    others: Sequence[str] = ()
    """Other names, each of one word or more."""
    about: str = ""

    def rank(self, query: str) -> int:
        """How well a query fits; 0: not at all."""
        words = [word for word in _words(query) if word not in PASSED_OVER] or _words(query)
        if not words:
            return 0
        places = (
            (_words(self.label), _LABEL),
            ([w for one in self.others for w in _words(one)], _OTHER),
            (_words(self.about), _ABOUT),
        )
        ranks = [max(weight * _fit(word, place) for place, weight in places) for word in words]
        if not all(ranks):
            return 0
        phrases = {self.label.casefold(): 2, **{one.casefold(): 1 for one in self.others}}
        return sum(ranks) + _PHRASE * phrases.get(query.strip().casefold(), 0)


def _words(text: str) -> list[str]:
    return re.findall(r"[^\W_]+", text.casefold())


def _fit(word: str, place: Iterable[str]) -> int:
    """How well one word is in a place; a word in the plural is also that in the singular."""
    forms = {word, word.removesuffix("s")} if len(word) > 3 else {word}
    best = 0
    for one in place:
        if one in forms or one.removesuffix("s") in forms:
            return _WHOLE
        if any(one.startswith(form) for form in forms):
            best = max(best, _BEGINNING)
        elif len(word) > 2 and word in one:
            best = max(best, _PART)
    return best
