"""Coverage as Markdown, for a job summary or a comment on a pull request: small enough to be posted."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from contextdb.covering import Gap, format_percent
from contextdb.covering.baseline import EarlierGap
from contextdb.errors import plural
from contextdb.report import coverage_words as words
from contextdb.report.coverage_results import CoverageResults, Measured, gap_moments, gap_size, has_moments
from contextdb.report.coverage_text import by_rule
from contextdb.report.render_markdown import MOST_BYTES, escaped
from contextdb.report.results import Gate
from contextdb.tables.variety import VARIETY

STEPS = (10, 5, 3, 1, 0)
"""So many gaps, pairs and rows of a rule are listed, the first that fits."""


def render(results: CoverageResults, shows_all: bool = False) -> str:
    if shows_all:
        return _document(results, 1 << 30, len(results.tables))
    texts = (_document(results, most, len(results.tables)) for most in STEPS)
    found = next((text for text in texts if len(text.encode()) <= MOST_BYTES), None)
    n_tables = len(results.tables)
    while found is None:
        n_tables //= 2
        text = _document(results, 0, n_tables)
        found = text if len(text.encode()) <= MOST_BYTES or n_tables == 0 else None
    return found


def _document(results: CoverageResults, most: int, n_tables: int) -> str:
    parts = ["## contextdb coverage\n"]
    if results.verdict:
        parts.append(f"**{results.verdict}**\n")
    rows = "".join(map(_row, results.tables[: n_tables or 50]))
    parts.append(f"| table | covered | known as | gaps | rows |\n| --- | --- | --- | --- | --- |\n{rows}")
    parts += [_section(measured, most) for measured in results.tables[:n_tables]]
    if n_tables < len(results.tables):
        parts.append(f"{len(results.tables) - n_tables:,} more tables are not shown; `contextdb coverage --all` shows every one.\n")
    if results.gone:
        parts.append(_gates(results.gone.values()))
    return "\n".join(parts)


def _row(measured: Measured) -> str:
    report = measured.report
    covered = format_percent(report.covered) if report.method == "exact" else f"at least {format_percent(report.lower)}"
    gaps = f"{len(report.gaps):,}{'' if report.gaps_complete else ' or more'}"
    return f"| {escaped(report.table)} | {escaped(covered)} | {report.method} | {gaps} | {report.n_rows:,} |\n"


def _section(measured: Measured, most: int) -> str:
    parts = [f"### {escaped(measured.report.table)}\n", f"{escaped(measured.report.headline)}\n"]
    parts += [f"{escaped(sentence)}\n" for sentence in words.assumed_sentences(measured.report)]
    if measured.gates:
        parts.append(_gates(measured.gates))
    for lines in (
        _telemetry(measured, most),
        _change(measured, most),
        _gaps(measured, most),
        _pairs(measured, most),
        _findings(measured, most),
    ):
        parts += ["\n".join(found) + "\n" for found in [list(lines)] if found]
    parts.append(f"Rows valid at once: {escaped(words.overlap_sentence(measured.report))}.\n")
    return "\n".join(parts)


def _gates(gates: Iterable[Gate]) -> str:
    return "".join(f"- {'✓' if gate.passed else '✗'} {gate.name}: {escaped(gate.message)}\n" for gate in gates)


def _telemetry(measured: Measured, most: int) -> Iterator[str]:
    seen = measured.telemetry
    if seen is None:
        return
    yield escaped(seen.headline)
    others = measured.seen_elsewhere[:most]
    if others:
        yield "\n| share of the moments | contexts without a valid row |\n| --- | --- |"
        yield from (f"| {escaped(format_percent(gap.share))} | {escaped(words.cells_text(gap.cells))} |" for gap in others)
    if facts := list(words.facts_sentences(seen)):
        yield "\n" + "\n".join(f"- {escaped(sentence)}" for sentence in facts)


def _change(measured: Measured, most: int) -> Iterator[str]:
    change = measured.change
    if change is None:
        return
    yield f"Since the baseline: {escaped(words.change_sentence(measured, change))}."
    yield ""
    gaps: list[tuple[str, Gap | EarlierGap]] = [("new", g) for g in change.opened[:most]]
    gaps += [("closed", g) for g in change.closed[:most]]
    for word, gap in gaps:
        size = gap_size(gap) if isinstance(gap, Gap) else format_percent(gap.share)
        yield f"- {word} gap, {escaped(size)}: {escaped(words.cells_text(gap.cells))}"
    for finding in change.dead[:most]:
        yield f"- newly dead: {escaped(measured.named(finding.row or 0))}, {escaped(finding.message)}"


def _gaps(measured: Measured, most: int) -> Iterator[str]:
    report = measured.report
    yield f"{escaped(words.gaps_sentence(report))}."
    shown = report.gaps[:most]
    if shown:
        head, line, blank = (" moments |", " --- |", " |") if has_moments(report) else ("", "", "")
        yield f"\n| | share |{head} contexts without a valid row | nearest |\n| --- | --- |{line} --- | --- |"
        for i, gap in enumerate(shown, 1):
            near = words.nearest_sentence(measured, gap).removeprefix("nearest: ")
            moments = f" {escaped(gap_moments(gap))} |" if has_moments(report) else ""
            yield f"| {i} | {escaped(gap_size(gap))} |{moments} {escaped(words.cells_text(gap.cells))} | {escaped(near)} |"
        if len(shown) < len(report.gaps):
            yield f"| | |{blank} … and {len(report.gaps) - len(shown):,} more | |"


def _pairs(measured: Measured, most: int) -> Iterator[str]:
    if measured.left_out:
        yield measured.left_out
    worst = measured.worst_pairs(most)
    if worst:
        yield "| pair covered least | covered | of the contexts |\n| --- | --- | --- |"
        for found in worst:
            cells = ", ".join(f"{name}: {cell}" for name, cell in found.cells.items())
            yield f"| {escaped(cells)} | {escaped(words.covered_text(found))} | {escaped(format_percent(found.share))} |"


def _findings(measured: Measured, most: int) -> Iterator[str]:
    blocks = by_rule(measured.report.findings)
    if blocks:
        yield "| level | finding | rows |\n| --- | --- | --- |"
    for rule, found in blocks.items():
        named = [words.rows_words(measured, f) for f in found[:most]]
        noun = "group" if rule == VARIETY else "row"
        more = [f"… and {len(found) - len(named):,} more"] if len(named) < len(found) else []
        yield f"| {found[0].level} | {escaped(rule)}, {plural(len(found), noun)} | {escaped(', '.join(named + more))} |"
