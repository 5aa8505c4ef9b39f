"""Texts cut to a width in terminal cells: what is cut ends in "…", and nothing moves the cursor."""

from __future__ import annotations

from rich.cells import cell_len, set_cell_size

from contextdb.console import printable

from ..model.layout import JOINER


def fitted(text: str, width: int, to_right: bool = False) -> str:
    """The text in just so many terminal cells; wide characters take two."""
    if width <= 0:
        return ""
    clean = JOINER.join(map(printable, text[: 4 * width + 8].split(JOINER)))
    n = cell_len(clean)
    if n > width:
        return set_cell_size(clean, width - 1) + "…"
    return " " * (width - n) + clean if to_right else clean + " " * (width - n)


def bar(lower: float, upper: float, width: int) -> str:
    """A share as a bar: full up to its lower bound, dotted up to its upper; never empty or full unless the share is."""
    full = _filled(lower, width)
    maybe = max(full, _filled(upper, width))
    return "█" * full + "▒" * (maybe - full) + "░" * (width - maybe)


def _filled(share: float, width: int) -> int:
    if share <= 0.0 or share >= 1.0:
        return 0 if share <= 0.0 else width
    return min(max(round(share * width), 1), max(width - 1, 1))
