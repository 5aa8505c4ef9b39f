"""Coverage as one HTML page that needs no network: every text of a table is escaped, and nothing of it can become markup or script.

What is in the page is complete without its script, which only sorts tables and opens the squares of the map.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape

from contextdb.console import __version__, printable
from contextdb.covering import CoverageReport, format_percent
from contextdb.covering.report import share_at_once
from contextdb.report import coverage_words as words
from contextdb.report.coverage_heat import heat_map
from contextdb.report.coverage_results import CoverageResults, Measured, gap_moments, gap_size, has_moments
from contextdb.report.coverage_text import by_rule
from contextdb.report.html_parts import cell, escaped, gates_of, page, paragraph, table_of, verdict_of
from contextdb.report.results import as_path
from contextdb.tables.variety import VARIETY

MOST_ROWS = 5_000
"""Rows that are listed, those with findings before others."""


def render(results: CoverageResults) -> str:
    sections = "".join(_section(measured, number) for number, measured in enumerate(results.tables))
    names = [printable(m.report.table) for m in results.tables]
    title = f"Coverage of {names[0]}" if len(names) == 1 else f"Coverage of {len(names)} tables"
    summary = _summary(results.tables) if len(names) > 1 else ""
    bars = verdict_of(results.passed, results.verdict) + (gates_of(results.gone.values()) if results.gone else "")
    head = f"<h1>{escape(title)}</h1>\n{bars}{summary}\n"
    return page(title, "coverage", f'{head}<main>\n{sections}</main>\n<p class="muted">contextdb {__version__}</p>\n')


def _summary(tables: Sequence[Measured]) -> str:
    columns = [("table", False), ("covered", True), ("gaps", True), ("rows", True), ("bars", False), ("", False)]
    is_held = any(m.gates for m in tables)
    lines = [_summary_line(measured, number, is_held) for number, measured in enumerate(tables)]
    return table_of("Tables", columns if is_held else [*columns[:4], columns[5]], lines)


def _summary_line(measured: Measured, number: int, is_held: bool) -> list[str]:
    report = measured.report
    name = f'<td class="k"><a href="#t{number}">{escaped(report.table)}</a></td>'
    gaps = cell(f"{len(report.gaps):,}{'' if report.gaps_complete else '+'}", len(report.gaps))
    line = [name, cell(format_percent(report.lower), report.lower), gaps, cell(f"{report.n_rows:,}", report.n_rows)]
    return [*line, *([_word(_kept(measured))] if is_held else []), f'<td class="share">{_bar(report)}</td>']


def _kept(measured: Measured) -> str:
    missed = [gate.name for gate in measured.gates if not gate.passed]
    return f"missed: {', '.join(missed)}" if missed else "kept" if measured.gates else ""


def _bar(report: CoverageReport) -> str:
    ends = [(report.upper, "open"), (report.lower, "")] if report.lower < report.upper else [(report.lower, "")]
    inner = "".join(f'<i class="{name}" style="width:{_width(share)}"></i>' for share, name in ends)
    return f'<div class="bar" role="img" aria-label="{escape(report.headline)}">{inner}</div>'


def _section(measured: Measured, number: int) -> str:
    report = measured.report
    parts = [f'<h2 id="t{number}">{escaped(report.table)}</h2>\n', paragraph(_size(measured), "muted"), *_head(measured)]
    parts += [*_change(measured), *_telemetry(measured), *_gaps(measured)]
    if measured.pairs is not None:
        parts.append(heat_map(measured.pairs, number))
    elif measured.left_out:
        parts.append(paragraph(measured.left_out, "muted"))
    parts += [*_overlap(measured), *_findings(measured), *_rows(measured)]
    return f"<article>\n{''.join(parts)}</article>\n"


def _size(measured: Measured) -> str:
    return measured.summary.size + (f", in {as_path(measured.file)}" if measured.file else "")


def _head(measured: Measured) -> Iterator[str]:
    report = measured.report
    yield paragraph(report.headline, "headline")
    yield f"{_bar(report)}\n"
    yield from (paragraph(sentence, "muted") for sentence in words.assumed_sentences(report))
    if measured.gates:
        yield gates_of(measured.gates)


def _change(measured: Measured) -> Iterator[str]:
    change = measured.change
    if change is None:
        return
    yield "<h3>Since the baseline</h3>\n"
    yield paragraph(f"{words.change_sentence(measured, change)}.")
    rows = [("new gap", gap.text, gap.share) for gap in change.opened] + [
        ("closed gap", gap.text, gap.share) for gap in change.closed
    ]
    lines = [[cell(kind), cell(text), cell(format_percent(share), share)] for kind, text, share in rows]
    lines += [[cell("newly dead"), cell(measured.named(f.row or 0)), cell("", 0.0)] for f in change.dead]
    if lines:
        yield table_of("What changed", [("", False), ("contexts, or row", False), ("share", True)], lines)


def _telemetry(measured: Measured) -> Iterator[str]:
    seen = measured.telemetry
    if seen is None:
        return
    yield "<h3>Recorded moments</h3>\n"
    yield paragraph(seen.headline)
    lines = [[cell(format_percent(gap.share), gap.share), cell(gap.text)] for gap in measured.seen_elsewhere]
    if lines:
        yield table_of("Moments without a valid row", [("share of the moments", True), ("contexts", False)], lines)
    yield from (paragraph(f"{sentence}.", "muted") for sentence in words.facts_sentences(seen))


def _gaps(measured: Measured) -> Iterator[str]:
    report = measured.report
    yield "<h3>Gaps</h3>\n"
    yield paragraph(f"{words.gaps_sentence(report)}.")
    if not report.gaps:
        return
    columns = [("", True), ("share", True), ("in no gap above", True), ("contexts without a valid row", False), ("nearest", False)]
    columns[2:2] = [("of the moments", True)] if has_moments(report) else []
    lines = [
        [
            cell(str(i), i),
            cell(gap_size(gap), gap.share),
            *([cell(gap_moments(gap), gap.telemetry or 0.0)] if has_moments(report) else []),
            cell(format_percent(gap.new_share), gap.new_share),
            cell(gap.text),
            cell(words.nearest_sentence(measured, gap).removeprefix("nearest: ")),
        ]
        for i, gap in enumerate(report.gaps, 1)
    ]
    yield table_of("Gaps", columns, lines)


def _overlap(measured: Measured) -> Iterator[str]:
    report = measured.report
    yield "<h3>Rows valid at once</h3>\n"
    yield paragraph(f"{words.overlap_sentence(report)}.")
    most = max(report.overlap.histogram, default=0.0)
    bars = "".join(
        f'<tr><td class="n">{n}</td><td class="n">{escape(share_at_once(report, n))}</td>'
        f'<td><i style="width:{_width(share / most)}"></i></td></tr>'
        for n, share in enumerate(report.overlap.histogram)
        if share > 0.0
    )
    if bars:
        head = '<thead><tr><th class="n">valid rows</th><th class="n">contexts</th><th></th></tr></thead>'
        table = f'<table class="hist">{head}<tbody>{bars}</tbody></table>'
        yield f'<div class="scroll" tabindex="0" role="region" aria-label="Overlap">{table}</div>\n'
    for crowd in report.crowded[:5]:
        yield paragraph(f"{crowd.n_rows} rows where {words.cells_text(crowd.cells, len(crowd.cells))}", "muted")


def _findings(measured: Measured) -> Iterator[str]:
    report = measured.report
    blocks = by_rule(report.findings)
    if not blocks:
        return
    yield "<h3>Findings</h3>\n"
    if not report.findings_complete:
        yield paragraph("The work ended before every row was decided.", "muted")
    lines = [
        [_word(f.level), _word(rule), cell("" if f.row is None else measured.named(f.row)), cell(f.message)]
        for rule, found in blocks.items()
        for f in found[:MOST_ROWS]
    ]
    yield table_of("Findings", [("level", False), ("rule", False), ("row", False), ("finding", False)], lines)


def _rows(measured: Measured) -> Iterator[str]:
    report = measured.report
    if not measured.assets:
        return
    rules: dict[int, list[str]] = {}
    for finding in (*report.findings, *report.needless):
        if finding.row is not None and finding.rule != VARIETY:
            rules.setdefault(finding.row, []).append(finding.rule)
    order = sorted(range(len(measured.assets)), key=lambda row: (row not in rules, row))[:MOST_ROWS]
    seen = measured.telemetry
    columns = [
        ("line" if measured.lines[0] is not None else "row", True),
        ("asset", False),
        ("valid in", True),
        ("findings", False),
    ]
    columns[3:3] = [("recorded moments", True)] if seen else []
    lines = []
    for row in sorted(order):
        line = measured.lines[row]
        place = row + 1 if line is None else line
        hits = [cell(f"{seen.hits[row]:,}", seen.hits[row])] if seen else []
        share = cell(format_percent(report.hits[row]), report.hits[row])
        lines.append([cell(str(place), place), cell(measured.assets[row]), share, *hits, cell(", ".join(rules.get(row, [])))])
    yield "<h3>Rows</h3>\n"
    if len(order) < len(measured.assets):
        yield paragraph(f"{len(order):,} of {len(measured.assets):,} rows are listed, those with findings before others.", "muted")
    yield table_of("Rows", columns, lines)


def _word(text: str) -> str:
    return f'<td class="k">{escaped(text)}</td>'


def _width(share: float) -> str:
    """A width that is full, or nothing, only where the share is."""
    percent = 100.0 * share
    return f"{percent if percent in (0.0, 100.0) else min(max(percent, 0.3), 99.7):.2f}%"
