"""Motion coverage as Markdown, for a job summary or a comment on a pull request."""

from __future__ import annotations

from collections.abc import Iterator

from contextdb.errors import joined
from contextdb.motion.measuring.moves import MAPS
from contextdb.report.motion_coverage_results import (
    AHEAD_ALONE,
    MotionCoverageResults,
    MotionMeasured,
    capture_sentence,
    is_ahead_alone,
)
from contextdb.report.motion_coverage_text import LEGEND, map_lines
from contextdb.report.render_markdown import MOST_BYTES, escaped

MOST_CAPTURES, MOST_ITEMS = 10, 20


def render(results: MotionCoverageResults) -> str:
    """All tables, as many as a comment holds."""
    text = "## contextdb motion coverage\n"
    text += f"\n**{results.verdict}**\n" if results.verdict else ""
    text += "".join(f"- **gone**: {escaped(gate.message)}\n" for gate in results.gone.values())
    for i, measured in enumerate(results.tables):
        section = "\n".join(_lines(measured)) + "\n"
        if len((text + section).encode()) > MOST_BYTES:
            return f"{text}\n{len(results.tables) - i:,} more tables are not shown.\n"
        text += section
    return text


def _lines(measured: MotionMeasured) -> Iterator[str]:
    found = measured.motion.coverage
    yield f"\n### {escaped(measured.motion.name)}\n"
    yield f"{escaped(measured.headline)}: {escaped(measured.size)}\n"
    yield from (f"- **{escaped(gate.name)}**: {escaped(gate.message)}" for gate in measured.gates)
    yield from (f"\n{escaped(sentence)}" for sentence in measured.notes())
    for name, of in MAPS.items():
        yield f"\n{of.told.capitalize()}\n"
        if is_ahead_alone(of, found.frames[name], found.hole_shares[name]):
            yield AHEAD_ALONE
        else:
            yield "\n".join(["```text", *map_lines(of, found.frames[name], found.hole_shares[name]), "```"])
    yield f"\n{escaped(LEGEND)}"
    if found.to_capture:
        yield "\n**Capture next**\n"
    yield from (f"{i}. {escaped(capture_sentence(each))}" for i, each in enumerate(found.to_capture[:MOST_CAPTURES], 1))
    for title, told, items in measured.asides():
        if items:
            yield f"\n**{title.capitalize()}** ({escaped(told)}): {escaped(joined(items, MOST_ITEMS))}"
