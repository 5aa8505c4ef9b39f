"""Coverage for people in a terminal: the covered share and how it is known, then what to look at; about 40 lines a table."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterator

from contextdb.console import aligned, printable, styled
from contextdb.covering import Gap, format_percent
from contextdb.covering.gaps import facts_inside
from contextdb.errors import plural, row_name
from contextdb.report.coverage_document import section
from contextdb.report.coverage_results import CoverageResults, Measured
from contextdb.report.coverage_words import nearest_sentence
from contextdb.report.document import gate_lines, section_lines
from contextdb.report.render_text import wrapped
from contextdb.tables.table import EitherTable
from contextdb.tables.variety import VARIETY

MOST_LINES = 42
SIZES = ((6, 4, 4), (5, 3, 3), (4, 3, 3), (3, 2, 2))
"""How many gaps, pairs of conditions and rows of a rule are listed of one table: the first that fits."""
FEW = (2, 0, 0)
"""The same for each of several tables."""


def render(results: CoverageResults, colour: bool = False, width: int = 100, shows_all: bool = False) -> str:
    """The coverage of one table in about 40 lines; of several, a few lines each, unless `shows_all`."""
    is_one = len(results.tables) == 1
    sections = [_fitted(m, colour, width, shows_all, is_one) for m in results.tables]
    tail = [line for _, gate in results.others for line in gate_lines(gate, colour, width)]
    tail += [styled(results.verdict, "green" if results.passed else "red", colour)] if results.verdict else []
    if not is_one and not shows_all:
        tail.append("contextdb coverage TABLE shows more of one table; --all shows everything.")
    return "\n".join([*sections, *("".join(f"{line}\n" for line in [part]) for part in tail)])


def _fitted(measured: Measured, colour: bool, width: int, shows_all: bool, is_one: bool) -> str:
    def text_at(sizes: tuple[int, int, int], is_brief: bool = False) -> str:
        return "".join(f"{line}\n" for line in section_lines(section(measured, *sizes, is_brief=is_brief), colour, width))

    if shows_all:
        return text_at((sys.maxsize, 20, sys.maxsize))
    if not is_one:
        return text_at(FEW, is_brief=True)
    texts = [text_at(sizes) for sizes in SIZES]
    return next((text for text in texts if text.count("\n") <= MOST_LINES), texts[-1])


# ---- one gap or one row in full


def gap_details(measured: Measured, gap: Gap, table: EitherTable, width: int) -> str:
    """Everything about a gap: its cells, a context of it to try, and how each cell of the nearest row stands to it."""
    return "".join(f"{line}\n" for line in _gap_lines(measured, gap, table, width))


def _gap_lines(measured: Measured, gap: Gap, table: EitherTable, width: int) -> Iterator[str]:
    report = measured.report
    size = f"{'' if gap.is_exact else 'about '}{format_percent(gap.share)} of the contexts" if gap.share else "single points"
    yield f"Gap {report.gaps.index(gap) + 1} of {len(report.gaps)} in {printable(report.table)} ({gap.id}): {size}"
    if gap.share and gap.new_share != gap.share:
        yield f"{format_percent(gap.new_share)} of the contexts are in no gap before it"
    if gap.telemetry is not None:
        yield f"{format_percent(gap.telemetry)} of the recorded moments"
    if gap.id in measured.work:
        yield f"Work on it: {printable(measured.work[gap.id].text)}"
    yield ""
    yield from aligned(list(gap.cells.items()) or [("every context", "")], indent="  ")
    if gap.nearest is not None:
        yield ""
        yield from wrapped(printable(nearest_sentence(measured, gap)), width)
        names = [c.condition.name for c in table.conditions if c.condition.name in gap.cells]
        row = gap.nearest.row
        names += [name for name in (table.settings.when,) if name is not None and name in gap.cells]
        rows = [(name, table.text(row, name) or "Any", gap.cells[name]) for name in names]
        yield ""
        yield from aligned([("condition", "its cell", "the gap"), *rows], indent="  ")
    facts = facts_inside(gap.cells, [c.condition for c in table.conditions])
    given = " ".join(shlex.quote(f"{name}={fact}") for name, fact in facts.items())
    yield ""
    yield "To see which rows are nearest in one context of it:"
    yield printable(f"  contextdb query {shlex.quote(measured.file or report.table)} {given} --unknown any --explain")


def row_details(measured: Measured, row: int, width: int) -> str:
    """Everything about a row: how often it is valid, and what is wrong with it, with the rows that cause that."""
    return "".join(f"{line}\n" for line in _row_lines(measured, row, width))


def _row_lines(measured: Measured, row: int, width: int) -> Iterator[str]:
    report = measured.report
    yield printable(f"{measured.named(row)} of {report.table} ({row_name(row)})")
    share = report.hits[row]
    yield f"valid in {format_percent(share)} of the contexts" if share else "valid in no context, or in single points only"
    if measured.telemetry is not None:
        yield f"valid in {measured.telemetry.hits[row]:,} of {measured.telemetry.moments:,} recorded moments"
    findings = [f for f in (*report.findings, *report.needless) if f.rule != VARIETY]
    own = [finding for finding in findings if finding.row == row]
    for finding in own:
        yield ""
        yield from wrapped(printable(f"{finding.level} {finding.rule}: {finding.message}"), width)
        for cause in finding.by:
            share_text = format_percent(report.hits[cause]) if report.hits[cause] else "points"
            yield printable(f"  {measured.named(cause)}, valid in {share_text}")
    if not own:
        yield ""
        sure = "" if report.findings_complete else ", as far as the work limit allowed"
        yield f"Nothing is wrong with it: no other rows are valid wherever it is{sure}."
    needed_by = [f for f in findings if row in f.by]
    if needed_by:
        yield ""
        yield f"It is one of the rows that make {plural(len(needed_by), 'row')} redundant:"
        for finding in needed_by[:10]:
            yield printable(f"  {measured.named(finding.row or 0)}: {finding.rule}")
