"""Measures as text: a table a session, raw clips and the baseline beside, and what is broken."""

from __future__ import annotations

from collections.abc import Iterator

from contextdb.console import aligned, printable, styled
from contextdb.errors import some
from contextdb.report.measure_results import MeasureResults, SessionMeasures
from contextdb.report.render_text import wrapped


def render(results: MeasureResults, colour: bool = False, width: int = 100, shows_all: bool = False) -> str:
    blocks = ["\n".join(_lines(session, colour, width, shows_all)) for session in results.sessions]
    return "\n\n".join(blocks) + "\n"


def _lines(session: SessionMeasures, colour: bool, width: int, shows_all: bool) -> Iterator[str]:
    yield printable(f"{session.file}: {session.headline}")
    yield ""
    rows = list(session.rows())
    used = [i for i, header in enumerate(HEADERS) if i < 2 or any(row[i] for row in rows)]
    table = [tuple(row[i] for i in used) for row in (HEADERS, *rows)]
    yield from aligned(table, right=range(1, len(used)))
    never = session.measures.assets_never_used
    said = list(session.not_measured())
    if never:
        said.append(f"never played: {', '.join(never) if shows_all else some(never)}")
    for sentence in said:
        yield ""
        yield from wrapped(printable(sentence), width)
    if session.gates:
        yield ""
    for gate in session.gates:
        if not gate.passed or shows_all or not gate.name.startswith("baseline"):
            verdict = styled("kept", "green", colour) if gate.passed else styled("BROKEN", "red", colour)
            yield f"{verdict}  {printable(gate.name)}: {printable(gate.message)}"
    worse = [gate for gate in session.gates if gate.name.startswith("baseline")]
    if worse and all(gate.passed for gate in worse):
        yield f"{styled('kept', 'green', colour)}  baseline: nothing is worse"


HEADERS = ("measure", "session", "raw clips", "before")
