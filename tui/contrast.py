"""Text that can be read on its ground, whatever the theme: by the contrast that WCAG 2 asks of text."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache

from rich.color import Color
from rich.color_triplet import ColorTriplet
from rich.segment import Segment
from rich.style import Style
from textual.color import Color as Ground
from textual.filter import LineFilter

LEAST = 4.5
"""WCAG 2.1, success criterion 1.4.3, level AA."""
_STEPS = 20
_READ = re.compile(r"[^\s\u2500-\u259f\u2800-\u28ff]")
"""What is read, letters, figures and signs: all but lines, blocks and dots that draw something."""


class Readable(LineFilter):
    """Makes all that is read readable, whichever widget paints it; frames, bars and dots stay as they are."""

    def apply(self, segments: list[Segment], background: Ground) -> list[Segment]:
        """The segments, the style of those that are read readable."""
        return list(map(_read_well, segments))


READABLE = Readable()


def _read_well(segment: Segment) -> Segment:
    text, style, control = segment
    if style is None or not _READ.search(text):
        return segment
    return Segment(text, readable(style), control)


def without(filters: Iterable[LineFilter]) -> list[LineFilter]:
    """The filters without this one: for what lies dimmed behind a dialog."""
    return [one for one in filters if not isinstance(one, Readable)]


@lru_cache(maxsize=4096)
def readable(style: Style) -> Style:
    """The style, its text as much lighter or darker as it must be; colours that the terminal chooses stay."""
    over, under = style.color, style.bgcolor
    if over is None or under is None or over.is_default or under.is_default or over.number is not None or under.number is not None:
        return style
    text, ground = over.get_truecolor(), under.get_truecolor()
    poles = (ColorTriplet(0, 0, 0), ColorTriplet(255, 255, 255))
    pole = max(poles, key=lambda pole: contrast(pole, ground))
    steps = (_between(text, pole, step / _STEPS) for step in range(_STEPS + 1))
    chosen = next((one for one in steps if contrast(one, ground) >= LEAST), pole)
    return style if chosen == text else style + Style(color=Color.from_triplet(chosen))


def contrast(one: ColorTriplet, other: ColorTriplet) -> float:
    """The ratio of two luminances, from 1 to 21."""
    low, high = sorted((_luminance(one), _luminance(other)))
    return (high + 0.05) / (low + 0.05)


def _luminance(colour: ColorTriplet) -> float:
    parts = (part / 255 for part in colour)
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def _between(one: ColorTriplet, other: ColorTriplet, share: float) -> ColorTriplet:
    return ColorTriplet(*(round(a + (b - a) * share) for a, b in zip(one, other, strict=True)))
