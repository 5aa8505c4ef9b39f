"""Coverage of a table as a section of a document: the covered share and how it is known, then what to look at."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import partial

from contextdb.covering import CoverageReport, Gap, format_percent
from contextdb.errors import joined, plural
from contextdb.findings import LEVELS, Finding
from contextdb.report import coverage_words as words
from contextdb.report.coverage_results import CoverageResults, Measured, gap_moments, gap_size, has_moments
from contextdb.report.document import Bar, Block, Document, Picture, Row, Rows, Section, Table, as_markdown
from contextdb.report.render_markdown import MOST_BYTES
from contextdb.report.results import as_path
from contextdb.tables.variety import VARIETY

MANY = sys.maxsize
OVERVIEW = ("table", "of what is asked", "of all contexts", "known as", "gaps", "rows")
MOST_ROWS = 5_000
"""Rows that a page lists, those with findings before others."""


def document(
    results: CoverageResults,
    shows_all: bool = False,
    is_page: bool = False,
    most: int = sys.maxsize,
    most_tables: int = sys.maxsize,
) -> Document:
    """All tables, each with at most so many gaps, pairs of conditions and rows of a rule; as a page with all there is."""
    tables = results.tables[:most_tables] if len(results.tables) > 1 or not is_page else ()
    overview = [Table(OVERVIEW, [_overview(measured) for measured in tables])] if tables else []
    closing = Section("", results.verdict, (), overview, [gate for _, gate in results.others])
    sections = [section(m, most, most, most, page_number=i if is_page else None) for i, m in enumerate(results.tables)]
    return Document("coverage", "table", sections, closing)


def _overview(measured: Measured) -> tuple[str, ...]:
    report = measured.report
    covered = format_percent(report.covered) if report.method == "exact" else f"at least {format_percent(report.lower)}"
    n_gaps = f"{len(report.gaps):,}{'' if report.gaps_complete else ' or more'}"
    of = measured.asked
    share_asked = "" if of.by == "domain" else f"{'' if of.lower == of.upper else 'at least '}{format_percent(of.lower)}"
    return report.table, share_asked, covered, report.method, n_gaps, f"{report.n_rows:,}"


def section(
    measured: Measured, most_gaps: int, most_pairs: int, most_rows: int, *, is_brief: bool = False, page_number: int | None = None
) -> Section:
    """A table with at most some gaps, changes and moments, pairs of conditions, and rows of a rule; `page_number` is its place in a
    page, where there is room for each finding and row."""
    report, is_page = measured.report, page_number is not None
    own = measured.asked
    sentences: list[str | Bar] = [words.to_do_sentence(measured), own.headline, Bar(own.lower, own.upper, own.headline)]
    sentences += [] if own.by == "domain" else [f"Of all contexts alike: {report.headline}"]
    sentences += words.assumed_sentences(report)
    is_listed = measured.expected is None or own.by == "telemetry" or is_page or most_gaps == MANY
    blocks: list[Block] = [*_todo(measured, most_gaps), *([_gaps(measured, most_gaps, is_page)] if is_listed else [])]
    blocks += [closed] if (closed := words.closed_sentence(measured)) else []
    if is_brief:
        counts = ", ".join(f"{len(group)} {rule}" for rule, group in by_rule(report.findings).items())
        blocks += [f"findings: {counts}"] if counts else []
    elif page_number is not None:
        blocks += [*_heat_map(measured, page_number), _overlap(measured), _histogram(report)]
    else:
        blocks += [_overlap(measured), *_pairs(measured, most_pairs), *_findings(measured, most_rows)]
    blocks += [*_telemetry(measured, most_gaps), *_change(measured, most_gaps)]
    blocks += [*_each_finding(measured), *_each_row(measured)] if is_page else []
    size = f"{measured.summary.size}, in {as_path(measured.file)}" if is_page and measured.file else measured.summary.size
    size = f"{size}; owned by {measured.owner}" if measured.owner else size
    return Section(report.table, size, sentences, blocks, measured.gates, is_dense=is_brief)


def _heat_map(measured: Measured, number: int) -> Iterator[Block]:
    from contextdb.report.coverage_heat import heat_map

    if measured.left_out:
        yield measured.left_out
    if measured.pairs is not None:
        yield Picture("", lambda colour: (), partial(heat_map, measured.pairs, number))


def _histogram(report: CoverageReport) -> Picture:
    return Picture("", lambda colour: words.histogram_lines(report))


def _each_finding(measured: Measured) -> Iterator[Block]:
    report = measured.report
    rows = [
        (finding.level, rule, "" if finding.row is None else measured.named(finding.row), finding.message)
        for rule, findings in by_rule(report.findings).items()
        for finding in findings[:MOST_ROWS]
    ]
    if rows:
        yield Table(("level", "rule", "row", "finding"), rows, f"Findings{_sure(report)}")


def _each_row(measured: Measured) -> Iterator[Block]:
    report, seen = measured.report, measured.telemetry
    rules: dict[int, list[str]] = {}
    for finding in (*report.findings, *report.needless):
        if finding.row is not None and finding.rule != VARIETY:
            rules.setdefault(finding.row, []).append(finding.rule)
    order = sorted(range(len(measured.assets)), key=lambda row: (row not in rules, row))[:MOST_ROWS]
    if len(order) < len(measured.assets):
        yield f"{len(order):,} of {len(measured.assets):,} rows are listed, those with findings before others."
    rows = []
    for row in sorted(order):
        hits = [f"{seen.hits[row]:,}"] if seen else []
        number = f"{measured.lines[row] or row + 1:,}"
        rows.append((number, measured.assets[row], format_percent(report.hits[row]), *hits, ", ".join(rules.get(row, []))))
    place = "row" if None in measured.lines else "line"
    if rows:
        yield Table((place, "asset", "valid in", *(["recorded moments"] if seen else []), "findings"), rows, "Rows")


def _sure(report: CoverageReport) -> str:
    return "" if report.findings_complete else " (the work ended before every row was decided)"


def _todo(measured: Measured, most: int) -> Iterator[Block]:
    """What to do for the contexts that are expected, the most expected first."""
    todo = () if measured.expected is None else measured.expected.todo
    if not todo:
        return
    rows = [
        Row((words.todo_sentence(measured, item),), (str(i), format_percent(item.share) if item.share else "point"))
        for i, item in enumerate(todo[:most], 1)
    ]
    more = f"… and {len(todo) - most:,} more; --all lists them" if len(todo) > most else ""
    yield Rows("To do, the most expected first", rows, ("", "share", "what"), more)


def _gaps(measured: Measured, most: int, is_page: bool) -> Rows:
    report = measured.report
    moments = ("moments",) if has_moments(report) else ()
    rows = []
    for i, gap in enumerate(report.gaps[:most], 1):
        new = [format_percent(gap.new_share)] if is_page else []
        sizes = (str(i), gap_size(gap), *([gap_moments(gap)] if moments else []), *new)
        rows.append(Row((words.gap_sentence(measured, gap, sys.maxsize if is_page else words.MOST_TOLD),), sizes))
    n_more = len(report.gaps) - len(rows)
    more = f"… and {n_more:,} more; --gap N shows one in full, --all lists them" if n_more else ""
    head = (
        "",
        "share",
        *moments,
        *(["without those above"] if is_page else []),
        "contexts without a valid row, and what would play",
    )
    return Rows(words.gaps_sentence(report), rows, head, more)


def _overlap(measured: Measured) -> Rows:
    report = measured.report
    most = [f"most, {crowd.n_rows}, where {words.cells_text(crowd.cells)}" for crowd in report.crowded[:1]]
    return Rows("Rows valid at once", [Row((text,)) for text in (words.overlap_sentence(report), *most)])


def _pairs(measured: Measured, most: int) -> Iterator[Block]:
    if measured.left_out:
        yield measured.left_out
    if worst := measured.worst_pairs(most):
        yield Rows("Pairs of conditions covered least", [Row((words.slice_sentence(each),)) for each in worst])


def _findings(measured: Measured, most: int) -> Iterator[Block]:
    rows = []
    for rule, group in by_rule(measured.report.findings).items():
        named = joined([words.rows_words(measured, finding) for finding in group], most)
        rows.append(Row((named,), (group[0].level, rule, f"{len(group):,}")))
    if rows:
        yield Rows(f"Findings{_sure(measured.report)}", rows)


def by_rule(findings: Sequence[Finding]) -> Mapping[str, list[Finding]]:
    """The findings of each rule, those of the worst level first."""
    blocks: dict[str, list[Finding]] = {}
    for finding in sorted(findings, key=lambda f: LEVELS.index(f.level)):
        blocks.setdefault(finding.rule, []).append(finding)
    return blocks


def _telemetry(measured: Measured, most: int) -> Iterator[Block]:
    seen = measured.telemetry
    if seen is None:
        return
    rows = [Row((seen.headline,))]
    for gap in measured.seen_elsewhere[:most]:
        rows.append(Row((words.cells_text(gap.cells),), (f"{'' if gap.is_exact else '≈ '}{format_percent(gap.share)}",)))
    if never := [measured.named(row) for row in seen.never_used]:
        rows.append(Row((f"{plural(len(never), 'row')} never valid in them: {joined(never, most)}",)))
    yield Rows("Recorded moments", [*rows, *(Row((sentence,)) for sentence in words.facts_sentences(seen))])


def _change(measured: Measured, most: int) -> Iterator[Block]:
    change = measured.change
    if change is None:
        return
    rows = [Row((words.change_sentence(measured, change),))]
    for verb, gaps in (("new", change.opened), ("closed", change.closed)):
        for gap in gaps[:most]:
            size = gap_size(gap) if isinstance(gap, Gap) else format_percent(gap.share)
            rows.append(Row((words.cells_text(gap.cells),), (verb, size)))
        rows += [Row((f"… and {len(gaps) - most:,} more",), (verb,))] if len(gaps) > most else []
    if dead := [measured.named(finding.row) for finding in change.dead if finding.row is not None]:
        rows.append(Row((f"newly dead: {joined(dead, most)}",)))
    yield Rows("Since the baseline", rows)


# ---- coverage as Markdown, for a job summary or a comment on a pull request: small enough to be posted

STEPS = (10, 5, 3, 1)
"""How many gaps, pairs and rows of a rule are listed: the first that fits."""
MOST_TABLES = 50


def as_comment(results: CoverageResults, shows_all: bool = False) -> str:
    """As much detail as a comment on a pull request holds; everything with `shows_all`."""
    if shows_all:
        return as_markdown(document(results), sys.maxsize)
    texts = (as_markdown(document(results, most=most), sys.maxsize) for most in STEPS)
    fitting = next((text for text in texts if len(text.encode()) <= MOST_BYTES), None)
    return fitting or as_markdown(document(results, most=0, most_tables=MOST_TABLES))
