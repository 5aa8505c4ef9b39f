"""How the texts of a column stand in their cells: numbers with their points below each other, and what all texts end in."""

from __future__ import annotations

import re
from functools import lru_cache

from contextdb.columns import TextColumn

from .layout import MOST_TEXTS

MOST_ALIGNED = 200
"""By so many distinct texts of a column it is decided how far its numbers are indented."""
MOST_BEFORE = 8
"""Texts with more before their point, such as words, are not aligned."""
LEAST_SHARED = 4
"""A shorter end that all texts have in common is left as it is."""
_WHOLE = re.compile(r"[^0-9.]{0,3}[0-9]+|[^0-9.]{0,3}(?=\.[0-9])")
"""A sign, and the whole part of the first number."""


def before_point(text: str) -> int | None:
    """How many characters stand before the point of the first number; None where the text begins with no number."""
    match = _WHOLE.match(text)
    return match.end() if match is not None and match.end() <= MOST_BEFORE else None


def indent_of(column: TextColumn) -> int:
    """How far the point of every first number of a column is from the left: as far as the longest whole part needs."""
    return max((before for text in column.texts[:MOST_ALIGNED] if (before := before_point(text)) is not None), default=0)


@lru_cache(maxsize=1 << 14)
def indented(text: str, indent: int) -> str:
    """A text with its point so far from the left; one without a number as it is."""
    before = before_point(text)
    return text if before is None or before >= indent else " " * (indent - before) + text


def shared_end(column: TextColumn) -> int:
    """How long the end is that all texts of a column have in common; 0 where that is short."""
    texts = [text[::-1] for text in column.texts[:MOST_TEXTS] if text.strip()]
    if len(texts) < 2:
        return 0
    first, last = min(texts), max(texts)
    n_shared = next((at for at, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), min(len(first), len(last)))
    return n_shared if n_shared >= LEAST_SHARED else 0
