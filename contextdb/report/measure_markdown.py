"""Measures as Markdown, for a job summary or a comment on a pull request."""

from __future__ import annotations

from contextdb.report.measure_results import MeasureResults, SessionMeasures
from contextdb.report.render_markdown import MOST_BYTES, escaped


def render(results: MeasureResults) -> str:
    """The measures of all sessions, as many as a comment holds."""
    text = "## contextdb motion measure\n"
    for i, session in enumerate(results.sessions):
        section = _section(session)
        if len((text + section).encode()) > MOST_BYTES:
            return f"{text}\n{len(results.sessions) - i:,} more sessions are not shown.\n"
        text += section
    return text


def _section(session: SessionMeasures) -> str:
    broken = [gate for gate in session.gates if not gate.passed]
    lines = [f"\n### {escaped(session.file)}\n", f"{session.headline}\n"]
    if broken:
        lines.append("".join(f"- **{escaped(gate.name)}**: {escaped(gate.message)}\n" for gate in broken))
    rows = list(session.rows())
    has_before = any(row[3] for row in rows)
    head = "| measure | session | raw clips |" + (" before |" if has_before else "")
    lines.append(f"{head}\n| --- | ---: | ---: |{' ---: |' if has_before else ''}")
    lines += ["| " + " | ".join(map(escaped, row if has_before else row[:3])) + " |" for row in rows]
    lines += [f"\n{escaped(sentence)}" for sentence in session.not_measured()]
    return "\n".join(lines) + "\n"
