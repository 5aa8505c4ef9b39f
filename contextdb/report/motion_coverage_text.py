"""Motion coverage for people in a terminal: the covered share, the maps, what to capture next, and clips of no use.

A square of a map is 8 cells wide: a shade for how many frames there are, their number, and "!" where some contexts want the
movement and have no valid clip for it. So a map fits 80 cells, and is read without colours.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from contextdb.console import printable, styled
from contextdb.covering import format_percent
from contextdb.errors import joined, plural
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.measuring.coverage import ContextCoverage
from contextdb.motion.measuring.moves import LEAST_FRAMES, MAPS, Counts, Map
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
from contextdb.report.render_text import wrapped

SQUARE = 8
LABEL = 7
SHADES = "░▒▓█"
"""For fewer than ten times what fills a bin, a hundred times, a thousand times, and more."""
FEW_CAPTURES, FEW_CONTEXTS, FEW_ITEMS = 6, 3, 6
INDENT = "   "
LEGEND = f"Numbers are frames; a bin is filled from {LEAST_FRAMES} on. ! wanted in some contexts that have no valid clip for it."


def render(results: MotionCoverageResults, colour: bool = False, width: int = 100, shows_all: bool = False) -> str:
    blocks = ["\n".join(_section(measured, colour, width, shows_all)) for measured in results.tables]
    tail = [f"clips without a row in their table: {_listed(results.unlisted, shows_all)}"] if results.unlisted else []
    lines = [line for sentence in tail for line in wrapped(printable(sentence), width)]
    lines += [line for gate in results.gone.values() for line in wrapped(printable(f"MISSED  {gate.message}"), width)]
    lines += [styled(results.verdict, "green" if results.passed else "red", colour)] if results.verdict else []
    return "\n\n".join([*blocks, *(["\n".join(lines)] if lines else [])]) + "\n"


def render_context(measured: MotionMeasured, each: ContextCoverage, colour: bool = False, width: int = 100) -> str:
    """The maps and holes of some contexts alone."""
    contexts = each.contexts
    lines = wrapped(printable(f"{measured.motion.name}, {context_words(each)}"), width)
    n_holes = f"{plural(each.n_holes, 'hole')} among {plural(each.n_wanted, 'wanted movement')}"
    lines += [f"{format_percent(contexts.share, 1)} of the contexts, id {contexts.id}: {n_holes}", ""]
    lines += wrapped(printable(f"valid: {', '.join(sorted(contexts.assets)) or 'none'}"), width)
    if contexts.mirrored:
        lines += wrapped(printable(f"valid mirrored: {', '.join(sorted(contexts.mirrored))}"), width)
    holes = {name: flags.astype(np.float64) for name, flags in each.holes.items()}
    lines += list(_maps(each.frames, holes, colour, width))
    missing = hole_words(each)
    lines += ["", "Missing", *(f"{INDENT}{words}" for words in missing)] if missing else []
    return "\n".join(lines) + "\n"


def _section(measured: MotionMeasured, colour: bool, width: int, shows_all: bool) -> Iterator[str]:
    found = measured.motion.coverage
    yield styled(printable(f"{measured.motion.name}: {measured.headline}"), "bold", colour)
    for sentence in (measured.size, *measured.notes()):
        yield from wrapped(printable(sentence), width)
    yield from _maps(found.frames, found.hole_shares, colour, width)
    yield from _captures(measured, width, shows_all)
    yield from _contexts(measured, width, shows_all)
    for title, told, items in measured.asides():
        if items:
            yield ""
            listed = _listed(items, shows_all)
            yield from wrapped(printable(f"{title.capitalize()} ({told}): {listed}"), width)
    if measured.gates:
        yield ""
    for gate in measured.gates:
        verdict = styled("kept", "green", colour) if gate.passed else styled("MISSED", "red", colour)
        yield from wrapped(f"{verdict}  {printable(f'{gate.name}: {gate.message}')}", width)


def _maps(frames: Mapping[str, Counts], holes: Mapping[str, Floats], colour: bool, width: int) -> Iterator[str]:
    for name, of in MAPS.items():
        yield ""
        yield of.told.capitalize()
        if is_ahead_alone(of, frames[name], holes[name]):
            yield AHEAD_ALONE
        else:
            yield from map_lines(of, frames[name], holes[name], colour)
    yield ""
    yield from wrapped(LEGEND, width)


def map_lines(of: Map, frames: Counts, holes: Floats, colour: bool = False) -> Iterator[str]:
    """One map, from the slowest speed that is filled or wanted to the fastest."""
    for line in range(2):
        corner = "m/s" if line else ""
        yield (f"{corner:<{LABEL}}" + "".join(_header(column.name, line) for column in of.columns)).rstrip()
    used = np.flatnonzero(((frames > 0) | (holes > 0.0)).any(axis=1))
    for row in range(int(used[0]), int(used[-1]) + 1) if len(used) else ():
        squares = [_square(int(n), float(hole), colour) for n, hole in zip(frames[row], holes[row], strict=True)]
        yield (f"{of.rows[row].name:<{LABEL}}" + "".join(squares)).rstrip()


def header_of(name: str) -> tuple[str, str]:
    """The name of a column in two lines; the second is empty where it is one word."""
    first, _, second = name.partition(" " if " " in name else "-")
    return first, second


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


def _captures(measured: MotionMeasured, width: int, shows_all: bool) -> Iterator[str]:
    captures = measured.motion.coverage.to_capture
    if not captures:
        return
    yield ""
    yield "Capture next"
    shown = captures if shows_all else captures[:FEW_CAPTURES]
    for i, each in enumerate(shown, 1):
        first, *more = wrapped(printable(capture_sentence(each)), width - 4)
        yield f"{i:>2}. {first}"
        yield from (f"    {line}" for line in more)
    if len(captures) > len(shown):
        yield f"    and {len(captures) - len(shown):,} more (--all)"


def _contexts(measured: MotionMeasured, width: int, shows_all: bool) -> Iterator[str]:
    worst = worst_contexts(measured)
    if not worst or len(measured.motion.coverage.contexts) < 2:
        return
    yield ""
    yield "Contexts that miss most"
    shown = worst if shows_all else worst[:FEW_CONTEXTS]
    for each in shown:
        share, missing = format_percent(each.contexts.share, 1), _listed(hole_words(each), shows_all, 2, "; ")
        head = f"{each.contexts.id}  {share} of the contexts, {each.n_holes} of {each.n_wanted} missing: {missing}"
        yield from wrapped(printable(head), width)
        yield from (f"{INDENT}{line}" for line in wrapped(printable(context_words(each)), width - len(INDENT)))
    if len(worst) > len(shown):
        yield f"{INDENT}and {len(worst) - len(shown):,} more (--all; --context ID shows the maps of one)"


def _listed(items: Sequence[str], shows_all: bool, few: int = FEW_ITEMS, between: str = ", ") -> str:
    return joined(items, len(items) if shows_all else few, between)
