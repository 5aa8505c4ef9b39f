"""Measures as a document: one table a session with columns for raw clips and the baseline."""

from __future__ import annotations

from contextdb.errors import in_quotes
from contextdb.report.document import Block, Document, Listing, Section, Table
from contextdb.report.measure_results import MeasureResults, SessionMeasures
from contextdb.report.results import Gate

HEADERS = ("measure", "session", "raw clips", "before")


def document(results: MeasureResults, shows_all: bool = False, is_page: bool = False) -> Document:
    return Document("motion measure", "session", [_section(session, shows_all) for session in results.sessions])


def _section(session: SessionMeasures, shows_all: bool) -> Section:
    rows = list(session.rows())
    used = [i for i in range(len(HEADERS)) if i < 2 or any(row[i] for row in rows)]
    head, *body = [[row[i] for i in used] for row in (HEADERS, *rows)]
    never = [in_quotes(name) for name in session.measures.assets_never_used or ()]
    forced = [each.sentence(session.measures.forced_jumps) for each in session.forced_by]
    blocks: list[Block] = [
        Table(head, body),
        *forced,
        *session.not_measured(),
        *([Listing("never played", never)] if never else []),
    ]
    return Section(session.file, session.headline, [session.to_do], blocks, _gates(session, shows_all))


def _gates(session: SessionMeasures, shows_all: bool) -> list[Gate]:
    """The thresholds; of the comparisons with the baseline those that fail, or one that says that none does."""
    compared = [gate for gate in session.gates if gate.name.startswith("baseline")]
    gates = [gate for gate in session.gates if shows_all or gate not in compared or not gate.passed]
    is_no_worse = bool(compared) and all(gate.passed for gate in compared)
    return [*gates, Gate("baseline", 0.0, 0.0, True, "nothing is worse")] if is_no_worse else gates
