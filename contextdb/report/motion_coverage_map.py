"""A map of movements in an HTML page: squares coloured by the share of the contexts that want a bin in which it is filled."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from math import cos, radians, sin

from contextdb.covering import format_percent
from contextdb.errors import plural
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.measuring.moves import Bin, Counts, Map
from contextdb.report.coverage_heat import EDGES
from contextdb.report.document_html import REGION

RING, HOLE = 26.0, 1
"""How wide a ring of a disc is, in pixels, and how many rings are left free in its middle."""


def header_of(name: str) -> tuple[str, str]:
    """The name of a column in two lines; the second is empty where it is one word."""
    first, _, second = name.partition(" " if " " in name else "-")
    return first, second


def html_map(of: Map, frames: Counts, wanted: Floats, holes: Floats) -> str:
    """One map as a table, a square for each bin, coloured as those of table coverage are; a round one as a disc too."""
    last = max((row for row in range(of.shape[0]) if frames[row].any() or wanted[row].any()), default=-1)
    squares = [
        [
            Square.of(of.words(row, column), int(frames[row, column]), float(wanted[row, column]), float(holes[row, column]))
            for column in range(of.shape[1])
        ]
        for row in range(last + 1)
    ]
    head = "".join(f'<th scope="col">{"<br>".join(filter(None, header_of(column.name)))}</th>' for column in of.columns)
    body = "".join(
        f'<tr><th class="name" scope="row">{escape(of.rows[row].name)}</th>{"".join(square.html for square in line)}</tr>\n'
        for row, line in enumerate(squares)
    )
    label = escape(f"{of.caption}, in m/s")
    return (_disc(of, squares, label) if of.is_round else "") + (
        f'<div class="scroll" tabindex="0" {REGION}{label}"><table class="heat motion">'
        f'<thead><tr><th scope="col">m/s</th>{head}</tr></thead>\n<tbody>\n{body}</tbody></table></div>\n'
    )


def _disc(of: Map, squares: list[list[Square]], label: str) -> str:
    """The map as an animator sees it from above: straight ahead is up, left is left, and the faster, the farther out."""
    parts = []
    for row, line in enumerate(squares):
        for column, square in zip(of.columns, line, strict=True):
            parts.append(f'<path class="{square.colour}" d="{_sector(column, row)}"><title>{escape(square.words)}</title></path>\n')
        x, y = _at(of.columns[of.centre].middle, row + HOLE + 0.5)
        parts.append(f'<text x="{x:.1f}" y="{y + 4.0:.1f}">{escape(of.rows[row].name)}</text>\n')
    for column in (column for column in of.columns if "-" not in column.name):
        x, y = _at(column.middle, len(squares) + HOLE + 0.6)
        parts.append(f'<text x="{x:.1f}" y="{y + 4.0:.1f}">{escape(column.name)}</text>\n')
    end = RING * (len(squares) + HOLE + 1.2)
    about = f"{label}: seen from above, straight ahead is up, faster is farther out"
    box = f'viewBox="{-end:.0f} {-end:.0f} {2 * end:.0f} {2 * end:.0f}" width="{2 * end:.0f}"'
    return f'<svg class="disc" role="img" aria-label="{about}" {box}>\n{"".join(parts)}</svg>\n'


def _sector(column: Bin, row: int) -> str:
    """The path of a bin: along its inner arc from one end to the other, and back along its outer one."""
    (ax, ay), (bx, by) = _at(column.low, row + HOLE), _at(column.high, row + HOLE)
    (cx, cy), (dx, dy) = _at(column.high, row + HOLE + 1), _at(column.low, row + HOLE + 1)
    inner, outer = RING * (row + HOLE), RING * (row + HOLE + 1)
    return (
        f"M{ax:.1f} {ay:.1f}A{inner:.0f} {inner:.0f} 0 0 0 {bx:.1f} {by:.1f}"
        f"L{cx:.1f} {cy:.1f}A{outer:.0f} {outer:.0f} 0 0 1 {dx:.1f} {dy:.1f}Z"
    )


def _at(degrees: float, ring: float) -> tuple[float, float]:
    """Where a direction, positive to the left, is on a ring."""
    return -RING * ring * sin(radians(degrees)), -RING * ring * cos(radians(degrees))


@dataclass(frozen=True)
class Square:
    """One bin: its colour by the share of the contexts that want it in which it is filled, its number, and a sentence."""

    colour: str
    number: str
    words: str

    @classmethod
    def of(cls, words: str, frames: int, wanted: float, hole: float) -> Square:
        """That of a bin of so many frames, wanted and missing in these shares of the contexts."""
        words += f": {plural(frames, 'frame')}"
        if wanted > 0.0:
            words += f"; wanted in {format_percent(wanted, 1)} of the contexts, missing in {format_percent(hole, 1)}"
        unwanted = "none some" if frames else "none"
        colour = f"c{sum(1.0 - hole / wanted >= edge for edge in EDGES)}" if wanted > 0.0 else unwanted
        return cls(colour, f"{frames:,}{'!' if hole > 0.0 else ''}" if frames or wanted > 0.0 else "·", words)

    @property
    def html(self) -> str:
        return f'<td><span class="square {self.colour}" title="{escape(self.words)}">{self.number}</span></td>'
