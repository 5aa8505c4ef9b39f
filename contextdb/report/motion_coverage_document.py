"""Motion coverage as a document: the covered share, the maps, what to capture next, and clips of no use.

A square of a map is 8 cells wide: a shade for how many frames there are, their number, and "!" where some contexts want the
movement and have no valid clip for it. So a map fits 80 cells, and is read without colours.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from html import escape
from math import cos, radians, sin

import numpy as np

from contextdb.console import styled
from contextdb.covering import format_percent
from contextdb.errors import joined, plural
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.measuring.coverage import ContextCoverage
from contextdb.motion.measuring.moves import LEAST_FRAMES, MAPS, Bin, Counts, Map
from contextdb.report.coverage_heat import EDGES
from contextdb.report.document import Bar, Block, Document, Folded, Listing, Numbered, Picture, Section, Table
from contextdb.report.document_html import REGION
from contextdb.report.motion_coverage_results import (
    AHEAD_ALONE,
    MotionCoverageResults,
    MotionMeasured,
    capture_sentence,
    context_words,
    hole_words,
    is_ahead_alone,
    worst_contexts,
)

SQUARE = 8
LABEL = 7
SHADES = "░▒▓█"
"""For fewer than ten times what fills a bin, a hundred times, a thousand times, and more."""
FEW_CONTEXTS, FEW_HOLES = 3, 2
MOST_CONTEXTS = 50
"""Contexts that a page lists."""
LEGEND = f"Numbers are frames; a bin is filled from {LEAST_FRAMES} on. ! wanted in some contexts that have no valid clip for it."


def document(results: MotionCoverageResults, shows_all: bool = False, is_page: bool = False) -> Document:
    unlisted = [Listing("Clips without a row in their table", results.unlisted)] if results.unlisted else []
    closing = Section("", results.verdict, (), unlisted, list(results.gone.values()))
    return Document("motion coverage", "table", [_section(measured, shows_all, is_page) for measured in results.tables], closing)


def context_document(measured: MotionMeasured, each: ContextCoverage) -> Document:
    """The maps and holes of some contexts alone."""
    n_holes = f"{plural(each.n_holes, 'hole')} among {plural(each.n_wanted, 'wanted movement')}"
    share = f"{format_percent(each.contexts.share, 1)} of the contexts, id {each.contexts.id}: {n_holes}"
    sentences, missing = [share, *_valid(each)], hole_words(each)
    blocks: list[Block] = [*_context_maps(each), *([Numbered("Missing", missing)] if missing else [])]
    section = Section(f"{measured.motion.name}, {context_words(each)}", "", sentences, blocks)
    return Document("motion coverage", "table", [section])


def _section(measured: MotionMeasured, shows_all: bool, is_page: bool) -> Section:
    coverage = measured.motion.coverage
    lost = [(each.words, format_percent(each.before, 1), format_percent(each.now, 1)) for each in measured.lost or ()]
    blocks: list[Block] = [Table(("movement", "before", "now"), lost, "Lost since the baseline")] if lost else []
    blocks += _maps(coverage.frames, coverage.wanted_shares, coverage.hole_shares)
    if coverage.to_capture:
        blocks.append(Numbered("Capture next", [capture_sentence(each) for each in coverage.to_capture]))
    worst = worst_contexts(measured)
    if worst and is_page:
        note = f"The {MOST_CONTEXTS} of {len(worst):,} that miss most." if len(worst) > MOST_CONTEXTS else ""
        blocks.append(Folded("Contexts that miss movements", [_folded(each) for each in worst[:MOST_CONTEXTS]], note))
    elif worst and len(coverage.contexts) > 1:
        items = [_context_sentence(each, shows_all) for each in worst]
        blocks.append(Numbered("Contexts that miss most", items, FEW_CONTEXTS, "--all; --context ID shows the maps of one"))
    blocks += [Listing(title.capitalize(), items, meaning) for title, meaning, items in measured.asides() if items]
    bar = [Bar(coverage.covered, coverage.covered, measured.headline)] if is_page else []
    sentences: list[str | Bar] = [_to_do(measured), *bar, measured.size, *measured.notes()]
    return Section(measured.motion.name, measured.headline, sentences, blocks, measured.gates)


def _to_do(measured: MotionMeasured) -> str:
    """What to do first about the clips."""
    if measured.lost:
        return f"To do first: bring back {measured.lost[0].words}, which this change lost."
    if first := next(iter(measured.motion.coverage.to_capture), None):
        return f"To do first: capture {first.words}, which fills {format_percent(first.fills, 1)} of what is wanted."
    return "Nothing to capture: every wanted movement has a valid clip."


def _folded(each: ContextCoverage) -> tuple[str, str, list[Block]]:
    share, missing = format_percent(each.contexts.share, 1), f"{each.n_holes} of {plural(each.n_wanted, 'movement')}"
    summary = f"{share} of the contexts, {missing} missing: {context_words(each)}"
    return each.contexts.id, summary, [*_valid(each), f"Missing: {'; '.join(hole_words(each))}", *_context_maps(each)]


def _valid(each: ContextCoverage) -> Iterator[str]:
    yield f"valid: {', '.join(sorted(each.contexts.assets)) or 'none'}"
    if each.contexts.mirrored:
        yield f"valid mirrored: {', '.join(sorted(each.contexts.mirrored))}"


def _context_maps(each: ContextCoverage) -> Iterator[Block]:
    wanted, holes = ({name: flags.astype(np.float64) for name, flags in bins.items()} for bins in (each.wanted, each.holes))
    return _maps(each.frames, wanted, holes)


def _context_sentence(each: ContextCoverage, shows_all: bool) -> str:
    missing = hole_words(each)
    listed = joined(missing, len(missing) if shows_all else FEW_HOLES, "; ")
    share = format_percent(each.contexts.share, 1)
    return (
        f"{each.contexts.id}, {share} of the contexts ({context_words(each)}): {each.n_holes} of {each.n_wanted} missing: {listed}"
    )


def _maps(frames: Mapping[str, Counts], wanted: Mapping[str, Floats], holes: Mapping[str, Floats]) -> Iterator[Block]:
    for name, of in MAPS.items():
        if is_ahead_alone(of, frames[name], holes[name]):
            yield Listing(of.caption.capitalize(), [AHEAD_ALONE])
        else:
            lines = partial(map_lines, of, frames[name], holes[name])
            yield Picture(of.caption.capitalize(), lines, partial(html_map, of, frames[name], wanted[name], holes[name]))
    yield LEGEND


def map_lines(of: Map, frames: Counts, holes: Floats, colour: bool = False) -> Iterator[str]:
    """One map, from the slowest speed that is filled or wanted to the fastest."""
    for line in range(2):
        corner = "m/s" if line else ""
        yield (f"{corner:<{LABEL}}" + "".join(_header(column.name, line) for column in of.columns)).rstrip()
    used = np.flatnonzero(((frames > 0) | (holes > 0.0)).any(axis=1))
    for row in range(int(used[0]), int(used[-1]) + 1) if len(used) else ():
        squares = [_square(int(n), float(hole), colour) for n, hole in zip(frames[row], holes[row], strict=True)]
        yield (f"{of.rows[row].name:<{LABEL}}" + "".join(squares)).rstrip()


def _header(name: str, line: int) -> str:
    first, second = header_of(name)
    return (
        f"{(first if second else '', second or first)[line]:>{SQUARE - 1}} "
        if len(name) < SQUARE or second
        else f"{(name if line else ''):>{SQUARE}}"
    )


def _square(n_frames: int, hole: float, colour: bool) -> str:
    mark = "!" if hole > 0.0 else " "
    shade = SHADES[min(3, int(np.log10(max(1.0, n_frames / LEAST_FRAMES))))] if n_frames else ""
    number = _short(n_frames) if n_frames or mark == "!" else "·"
    text = f"{shade + number:>{SQUARE - 1}}{mark}"
    return styled(text, "red" if mark == "!" else "dim", colour) if mark == "!" or not n_frames else text


def _short(n: int) -> str:
    """A number in at most four characters."""
    return f"{n}" if n < 10_000 else f"{n / 1000:.0f}k" if n < 1_000_000 else f"{n / 1e6:.0f}M"


# ---- a map of movements in an HTML page: squares coloured by the share of the contexts that want a bin in which it is filled


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
