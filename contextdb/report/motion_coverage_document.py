"""Motion coverage as a document: the covered share, the maps, what to capture next, and clips of no use.

A square of a map is 8 cells wide: a shade for how many frames there are, their number, and "!" where some contexts want the
movement and have no valid clip for it. So a map fits 80 cells, and is read without colours.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np

from contextdb.console import styled
from contextdb.covering import format_percent
from contextdb.errors import joined, plural
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.measuring.coverage import ContextCoverage
from contextdb.motion.measuring.moves import LEAST_FRAMES, MAPS, Counts, Map
from contextdb.report.document import Bar, Block, Document, Folded, Listing, Numbered, Picture, Section, Table
from contextdb.report.motion_coverage_map import header_of, html_map
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
