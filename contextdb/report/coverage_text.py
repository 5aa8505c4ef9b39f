"""Coverage for people in a terminal: the covered share and how it is known, then what to look at; about 40 lines a table."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterator, Mapping, Sequence

from contextdb.console import aligned, printable, styled, width_of
from contextdb.covering import Gap, format_percent
from contextdb.covering.inside import facts_inside
from contextdb.errors import joined, plural, row_name
from contextdb.findings import LEVELS, Finding
from contextdb.report import coverage_words as words
from contextdb.report.coverage_results import CoverageResults, Measured, gap_moments, gap_size, has_moments
from contextdb.report.coverage_words import nearest_sentence
from contextdb.report.render_text import STYLES, wrapped
from contextdb.report.results import Gate
from contextdb.tables.table import EitherTable
from contextdb.tables.variety import VARIETY

BAR_CELLS = 50
MOST_LINES = 42
SIZES = ((6, 4, 4), (5, 3, 3), (4, 3, 3), (3, 2, 2))
"""So many gaps, pairs of conditions and rows of a rule are listed of one table: the first that fits."""
FEW = (2, 0, 4)
"""The same for each of several tables."""
MOST_ITEMS = 4
INDENT = "   "


def render(results: CoverageResults, colour: bool = False, width: int = 100, shows_all: bool = False) -> str:
    """The coverage of one table in about 40 lines; of several, a few lines each, unless all is asked for."""
    is_one = len(results.tables) == 1
    sections = [_fitted(m, colour, width, shows_all, is_one) for m in results.tables]
    tail = [line for gate in results.gone.values() for line in _gate(gate, colour, width)]
    tail += [styled(results.verdict, "green" if results.passed else "red", colour)] if results.verdict else []
    if not is_one and not shows_all:
        tail.append("contextdb coverage TABLE shows more of one table; --all shows everything.")
    return "\n".join([*sections, *("".join(f"{line}\n" for line in [part]) for part in tail)])


def _fitted(measured: Measured, colour: bool, width: int, shows_all: bool, is_one: bool) -> str:
    if shows_all:
        return _section(measured, colour, width, (sys.maxsize, 20, sys.maxsize))
    if not is_one:
        return _section(measured, colour, width, FEW)
    texts = [_section(measured, colour, width, sizes) for sizes in SIZES]
    return next((text for text in texts if text.count("\n") <= MOST_LINES), texts[-1])


def _section(measured: Measured, colour: bool, width: int, sizes: tuple[int, int, int]) -> str:
    most_gaps, most_pairs, most_rows = sizes
    parts = [_head(measured, colour, width), _gaps(measured, colour, width, most_gaps)]
    if sizes == FEW:
        parts.append(_counts(measured.report.findings, width))
    else:
        parts += [
            _overlap(measured, colour, width),
            _pairs(measured, colour, width, most_pairs),
            _findings(measured.report.findings, measured, colour, width, most_rows),
        ]
    parts += [_telemetry(measured, colour, width), _change(measured, colour, width), _gates(measured, colour, width)]
    blocks = ["".join(f"{line}\n" for line in lines) for lines in map(list, parts) if lines]
    return ("" if sizes == FEW else "\n").join(blocks)


def _head(measured: Measured, colour: bool, width: int) -> Iterator[str]:
    report = measured.report
    for line in wrapped(printable(f"{report.table}: {measured.summary.size}"), width):
        yield styled(line, "bold", colour)
    yield from wrapped(report.headline, width)
    yield bar(report.lower, report.upper, min(BAR_CELLS, width))
    for sentence in words.assumed_sentences(report):
        yield from wrapped(printable(sentence), width)


def bar(lower: float, upper: float, n_cells: int) -> str:
    """A bar: full up to the lower bound, dotted up to the upper one. It is full, or empty, only where the share is."""
    full = min(int(lower * n_cells), n_cells)
    full = 1 if full == 0 and lower > 0.0 else full
    dotted = 0 if lower == upper else max(1, round(upper * n_cells) - full)
    dotted = min(dotted, n_cells - full)
    return "█" * full + "▒" * dotted + "░" * (n_cells - full - dotted)


def _gaps(measured: Measured, colour: bool, width: int, most: int) -> Iterator[str]:
    report = measured.report
    yield from (styled(line, "bold", colour) for line in wrapped(words.gaps_sentence(report), width))
    shown = report.gaps[:most]
    sizes = [[gap_size(gap), *([gap_moments(gap)] if has_moments(report) else [])] for gap in shown]
    if has_moments(report):
        sizes.insert(0, ["contexts", "moments"])
    number, widths = len(str(len(shown))), [max(map(width_of, column)) for column in zip(*sizes, strict=True)]
    columns = ["".join(f"{size:>{width}}  " for size, width in zip(own, widths, strict=True)) for own in sizes]
    if has_moments(report):
        yield f"{INDENT}{'':>{number}}  {columns.pop(0)}".rstrip()
    for i, (gap, column) in enumerate(zip(shown, columns, strict=True), 1):
        head = f"{INDENT}{i:>{number}}  {column}"
        yield from hanging(head, words.cells_text(gap.cells), width)
        if gap.nearest is not None:
            yield from hanging(" " * width_of(head), words.nearest_sentence(measured, gap), width)
    if len(shown) < len(report.gaps):
        yield from hanging(
            INDENT, f"… and {len(report.gaps) - len(shown):,} more; --gap N shows one in full, --all lists them", width
        )


def hanging(head: str, text: str, width: int) -> Iterator[str]:
    """A text next to a head, wrapped in its own column; where that would be narrow, under it."""
    text, indent = printable(text), width_of(head)
    if width - indent < 30:
        yield head.rstrip()
        yield from (f"{INDENT}{INDENT}{line}" for line in wrapped(text, max(20, width - 2 * len(INDENT))))
        return
    for i, line in enumerate(wrapped(text, width - indent)):
        yield (head if i == 0 else " " * indent) + line


def _overlap(measured: Measured, colour: bool, width: int) -> Iterator[str]:
    report = measured.report
    yield styled("Rows valid at once", "bold", colour)
    yield from hanging(INDENT, words.overlap_sentence(report), width)
    for crowd in report.crowded[:1]:
        yield from hanging(INDENT, f"most, {crowd.n_rows}, where {words.cells_text(crowd.cells)}", width)


def _pairs(measured: Measured, colour: bool, width: int, most: int) -> Iterator[str]:
    if measured.left_out:
        yield from wrapped(measured.left_out, width)
    worst = measured.worst_pairs(most)
    if not worst:
        return
    yield styled("Pairs of conditions covered least", "bold", colour)
    for found in worst:
        yield from hanging(INDENT, words.slice_sentence(found), width)


def _findings(findings: Sequence[Finding], measured: Measured, colour: bool, width: int, most: int) -> Iterator[str]:
    blocks = by_rule(findings)
    if not blocks:
        return
    sure = "" if measured.report.findings_complete else " (the work ended before every row was decided)"
    yield from (styled(line, "bold", colour) for line in wrapped(f"Findings{sure}", width))
    widest = max(map(len, blocks)) + 1 + max(len(f"{len(found):,}") for found in blocks.values())
    for rule, found in blocks.items():
        room = f"{rule} {len(found):>{max(1, widest - len(rule) - 1)},}"
        head = f"{INDENT}{styled(room, STYLES[found[0].level], colour)}  "
        named = joined([words.rows_words(measured, f) for f in found], most)
        lines = list(hanging(" " * (len(INDENT) + widest + 2), named, width))
        yield head + lines[0].lstrip() if lines[0].strip() else head.rstrip()
        yield from lines[1:]


def by_rule(findings: Sequence[Finding]) -> Mapping[str, list[Finding]]:
    """The findings of each rule, those of the worst level first."""
    blocks: dict[str, list[Finding]] = {}
    for finding in sorted(findings, key=lambda f: LEVELS.index(f.level)):
        blocks.setdefault(finding.rule, []).append(finding)
    return blocks


def _counts(findings: Sequence[Finding], width: int) -> Iterator[str]:
    said = ", ".join(f"{len(found)} {rule}" for rule, found in by_rule(findings).items())
    if said:
        yield from hanging(INDENT, f"findings: {said}", width)


def _telemetry(measured: Measured, colour: bool, width: int) -> Iterator[str]:
    seen = measured.telemetry
    if seen is None:
        return
    yield styled("Recorded moments", "bold", colour)
    yield from hanging(INDENT, seen.headline, width)
    for gap in measured.seen_elsewhere[:MOST_ITEMS]:
        yield from hanging(
            f"{INDENT}{'' if gap.is_exact else '≈ '}{format_percent(gap.share)}  ", words.cells_text(gap.cells), width
        )
    never = seen.never_used
    if never:
        named = joined([measured.named(row) for row in never], MOST_ITEMS)
        yield from hanging(INDENT, f"{plural(len(never), 'row')} never valid in them: {named}", width)
    for sentence in words.facts_sentences(seen):
        yield from hanging(INDENT, sentence, width)


def _change(measured: Measured, colour: bool, width: int) -> Iterator[str]:
    change = measured.change
    if change is None:
        return
    yield styled("Since the baseline", "bold", colour)
    yield from hanging(INDENT, words.change_sentence(measured, change), width)
    for sign, gaps in (("+", change.opened), ("-", change.closed)):
        for gap in gaps[:MOST_ITEMS]:
            size = gap_size(gap) if isinstance(gap, Gap) else format_percent(gap.share)
            yield from hanging(f"{INDENT}{sign} {size}  ", words.cells_text(gap.cells), width)
        if len(gaps) > MOST_ITEMS:
            yield f"{INDENT}{sign} … and {len(gaps) - MOST_ITEMS:,} more"
    if change.dead:
        dead = ", ".join(measured.named(f.row) for f in change.dead[:MOST_ITEMS] if f.row is not None)
        yield from hanging(f"{INDENT}! newly dead: ", dead, width)


def _gates(measured: Measured, colour: bool, width: int) -> Iterator[str]:
    for gate in measured.gates:
        yield from _gate(gate, colour, width)


def _gate(gate: Gate, colour: bool, width: int) -> Iterator[str]:
    word, style = ("passed", "green") if gate.passed else ("FAILED", "red")
    first, *rest = hanging(f"{word}  {gate.name}  ", gate.message, width)
    yield styled(word, style, colour) + first.removeprefix(word)
    yield from rest


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
    found = [finding for finding in findings if finding.row == row]
    for finding in found:
        yield ""
        yield from wrapped(printable(f"{finding.level} {finding.rule}: {finding.message}"), width)
        for cause in finding.by:
            share_text = format_percent(report.hits[cause]) if report.hits[cause] else "points"
            yield printable(f"  {measured.named(cause)}, valid in {share_text}")
    if not found:
        yield ""
        sure = "" if report.findings_complete else ", as far as the work limit allowed"
        yield f"Nothing is wrong with it: no other rows are valid wherever it is{sure}."
    needed_by = [f for f in findings if row in f.by]
    if needed_by:
        yield ""
        yield f"It is one of the rows that make {plural(len(needed_by), 'row')} redundant:"
        for finding in needed_by[:10]:
            yield printable(f"  {measured.named(finding.row or 0)}: {finding.rule}")
