"""Motion coverage as one HTML page that needs no network: every text of a project is escaped, and nothing of it can become markup.

What is in the page is complete without its script, which only sorts tables.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape

from contextdb.console import __version__, printable
from contextdb.covering import format_percent
from contextdb.errors import plural, some
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.measuring.coverage import ContextCoverage
from contextdb.motion.measuring.moves import LEAST_FRAMES, MAPS, Counts, Map
from contextdb.report.html_parts import cell, escaped, gates_of, page, paragraph, table_of, verdict_of
from contextdb.report.motion_coverage_results import (
    AHEAD_ALONE,
    MotionCoverageResults,
    MotionMeasured,
    context_words,
    hole_words,
    is_ahead_alone,
    worst_contexts,
)
from contextdb.report.motion_coverage_text import header_of

MOST_CONTEXTS = 50
EDGES = (0.1, 0.25, 0.5, 0.75, 0.9, 1.0)
"""Colours change at these shares, as those of table coverage do."""
BOTH = " (and to the other side, mirrored)"
OWN_STYLE = """
.motion td, .motion th { text-align: center; }
.motion .square { width: 4.2rem; height: 1.9rem; line-height: 1.8rem; }
.motion thead th { vertical-align: bottom; font-weight: 600; font-size: .75rem; max-width: 4.2rem; overflow-wrap: normal; }
@media (max-width: 44rem) { .motion .square { width: 2.3rem; font-size: .7rem; } .motion thead th { font-size: .65rem; } }
.motion .name { white-space: nowrap; vertical-align: middle; }
.legend .square { display: inline-block; width: 2.6rem; }
details { margin: .5rem 0; } summary { cursor: pointer; overflow-wrap: anywhere; }
"""
LEGEND = (("c0", "0", "wanted, never filled"), ("c3", "12", "filled in part of the contexts that want it"), ("c6", "120", "filled"))


def render(results: MotionCoverageResults) -> str:
    names = [printable(measured.motion.name) for measured in results.tables]
    title = f"Motion coverage of {names[0]}" if len(names) == 1 else f"Motion coverage of {len(names)} tables"
    verdict = f"{verdict_of(results.passed, results.verdict)}\n" if results.verdict else ""
    gone = gates_of(results.gone.values()) if results.gone else ""
    sections = "".join(f"<article>\n{''.join(_section(measured))}</article>\n" for measured in results.tables)
    unlisted = _list("Clips without a row in their table", results.unlisted) if results.unlisted else ""
    body = f"<h1>{escape(title)}</h1>\n{verdict}{gone}<main>\n{sections}{unlisted}</main>\n"
    return page(title, "coverage", f'{body}<p class="muted">contextdb {__version__}</p>\n', style=OWN_STYLE)


def _section(measured: MotionMeasured) -> Iterator[str]:
    found = measured.motion.coverage
    yield f"<h2>{escaped(measured.motion.name)}</h2>\n"
    yield paragraph(measured.size, "muted")
    yield paragraph(measured.headline, "headline")
    width = f"{100 * found.covered:.2f}%"
    yield f'<div class="bar" role="img" aria-label="{escape(measured.headline)}"><i style="width:{width}"></i></div>\n'
    yield from (paragraph(sentence, "muted") for sentence in measured.notes())
    if measured.gates:
        yield gates_of(measured.gates)
    if measured.lost:
        lines = [[cell(each.words), _share(each.before), _share(each.now)] for each in measured.lost]
        yield "<h3>Lost since the baseline</h3>\n" + table_of("Lost", (("movement", False), ("before", True), ("now", True)), lines)
    for name, of in MAPS.items():
        yield f"<h3>{escape(of.told.capitalize())}</h3>\n"
        yield _map(of, found.frames[name], found.wanted_shares[name], found.hole_shares[name])
    yield _legend()
    if found.to_capture:
        yield "<h3>Capture next</h3>\n"
        columns = (("movement", False), ("fills", True), ("missing in", True), ("moves so, not valid there", False))
        both = {False: "", True: BOTH}
        lines = [
            [cell(f"{c.words}{both[c.is_both_sides]}"), _share(c.fills), _share(c.contexts), cell(_named(c.elsewhere))]
            for c in found.to_capture
        ]
        yield table_of("Capture next", columns, lines)
    yield from _contexts(measured)
    for heading, told, items in measured.asides():
        if items:
            yield _list(f"{heading.capitalize()}: {told}", items)


def _contexts(measured: MotionMeasured) -> Iterator[str]:
    worst = worst_contexts(measured)
    if not worst:
        return
    yield "<h3>Contexts that miss movements</h3>\n"
    if len(worst) > MOST_CONTEXTS:
        yield paragraph(f"The {MOST_CONTEXTS} of {len(worst):,} that miss most.", "muted")
    for each in worst[:MOST_CONTEXTS]:
        yield _context(each)


def _context(each: ContextCoverage) -> str:
    contexts = each.contexts
    share = format_percent(contexts.share, 1)
    told = f"{share} of the contexts, {each.n_holes} of {plural(each.n_wanted, 'movement')} missing: {context_words(each)}"
    maps = "".join(
        f'<p class="muted">{escape(of.told.capitalize())}</p>\n'
        + _map(of, each.frames[name], each.wanted[name].astype(float), each.holes[name].astype(float))
        for name, of in MAPS.items()
        if each.wanted[name].any()
    )
    valid = paragraph(f"Valid: {', '.join(sorted(contexts.assets)) or 'none'}")
    valid += paragraph(f"Valid mirrored: {', '.join(sorted(contexts.mirrored))}") if contexts.mirrored else ""
    missing = paragraph(f"Missing: {'; '.join(hole_words(each))}")
    return f'<details id="c{contexts.id}"><summary>{escaped(told)}</summary>\n{valid}{missing}{maps}</details>\n'


def _map(of: Map, frames: Counts, wanted: Floats, holes: Floats) -> str:
    if is_ahead_alone(of, frames, holes):
        return paragraph(AHEAD_ALONE, "muted")
    head = "".join(f'<th scope="col">{"<br>".join(filter(None, header_of(column.name)))}</th>' for column in of.columns)
    last = max((row for row in range(of.shape[0]) if frames[row].any() or wanted[row].any()), default=-1)
    body = "".join(
        f'<tr><th class="name" scope="row">{escape(of.rows[row].name)}</th>'
        + "".join(
            _square(of.words(row, column), int(frames[row, column]), float(wanted[row, column]), float(holes[row, column]))
            for column in range(of.shape[1])
        )
        + "</tr>\n"
        for row in range(last + 1)
    )
    label = escape(f"{of.told}, in m/s")
    return (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{label}"><table class="heat motion">'
        f'<thead><tr><th scope="col">m/s</th>{head}</tr></thead>\n<tbody>\n{body}</tbody></table></div>\n'
    )


def _square(words: str, frames: int, wanted: float, hole: float) -> str:
    """One bin: coloured by the share of the contexts that want it in which it is filled."""
    told = f"{words}: {plural(frames, 'frame')}"
    if wanted > 0.0:
        told += f"; wanted in {format_percent(wanted, 1)} of the contexts, missing in {format_percent(hole, 1)}"
    filled = 1.0 - hole / wanted if wanted > 0.0 else 0.0
    colour = f"c{sum(filled >= edge for edge in EDGES)}" if wanted > 0.0 else "none"
    label = f"{frames:,}{'!' if hole > 0.0 else ''}" if frames or wanted > 0.0 else "·"
    return f'<td><span class="square {colour}" title="{escape(told)}">{label}</span></td>'


def _legend() -> str:
    squares = " ".join(f'<span class="square {colour}">{text}</span> {escape(told)}' for colour, text, told in LEGEND)
    told = f"Numbers are frames of clips; a bin is filled in a context from {LEAST_FRAMES} on. ! is missing in some contexts."
    squares += ' <span class="square none">·</span> nothing, and not wanted'
    return f'<p class="heat legend">{squares}</p>\n{paragraph(told, "muted")}'


def _list(heading: str, items: Sequence[str]) -> str:
    listed = "".join(f"<li>{escaped(item)}</li>\n" for item in items)
    return f"<h3>{escaped(heading)}</h3>\n<ul>\n{listed}</ul>\n"


def _named(assets: Sequence[str]) -> str:
    return some(assets) if assets else ""


def _share(share: float) -> str:
    return cell(format_percent(share, 1), share)
