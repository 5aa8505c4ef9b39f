"""Signs that terminals draw in different widths, as signs that all of them draw in one, so that no column drifts.

A family of emoji held together by joiners is two cells wide in one terminal and eight in another; so it is with skin tones, flags
and signs with a variation selector. On the screen their first sign replaces them, as wide as the layout counts them. The text in
the file stays as it is.
"""

from __future__ import annotations

import re

from rich.cells import cell_len, set_cell_size
from rich.segment import Segment
from textual.color import Color
from textual.filter import LineFilter

_EMOJI = "\u00a9\u00ae\u203c-\u3299\U0001f000-\U0001f1e5\U0001f200-\U0001f3fa\U0001f400-\U0001faff"
_ADDED = "\ufe0e\ufe0f\u20e3\U0001f3fb-\U0001f3ff"
_FLAG = "\U0001f1e6-\U0001f1ff"
_CLUSTER = re.compile(f"([{_EMOJI}])(?:[{_ADDED}]|\u200d[{_EMOJI}])+|([0-9#*])[{_ADDED}]+|([{_FLAG}]{{2}})|[{_ADDED}]+")


class SameWidths(LineFilter):
    """What is written to the terminal, in signs of one width."""

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        """The segments; those without such signs as they are."""
        return [one if _CLUSTER.search(one.text) is None else Segment(drawn(one.text), one.style, one.control) for one in segments]


def drawn(text: str) -> str:
    """The text in as many cells, without signs whose width is a matter of opinion."""
    return _CLUSTER.sub(_first, text)


def _first(cluster: re.Match[str]) -> str:
    if cluster[3]:  # a flag is two letters, of signs that are letters
        letters = "".join(chr(ord("A") + ord(sign) - 0x1F1E6) for sign in cluster[3])
        return set_cell_size(letters, cell_len(cluster[3]))
    first = cluster[1] or cluster[2] or ""
    return set_cell_size(first, cell_len(cluster[0]))
