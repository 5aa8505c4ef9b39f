"""Sentences about coverage, for every format that people read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from contextdb.covering import CoverageReport, Gap, Slice, format_percent
from contextdb.covering.baseline import Change
from contextdb.covering.expected import Todo
from contextdb.covering.report import distinct_percents, share_at_once
from contextdb.errors import in_quotes, joined, nearest, plural, row_name
from contextdb.findings import Finding
from contextdb.report.coverage_results import Measured, has_moments
from contextdb.tables.variety import VARIETY
from contextdb.telemetry.observed import FactNote, Observed

MOST_TOLD = 8
MOST_CLOSED = 5
"""Conditions and assumptions that are reported one by one."""
MOST_CHANGES = 3
"""Cells to change that are named."""
MOST_COUNTS = 6
"""Numbers of rows that the histogram tells one by one."""


def to_do_sentence(measured: Measured) -> str:
    """What to do first about a table."""
    report, change = measured.report, measured.change
    if change is not None and change.opened:
        return f"To do first: close the gap that this change opened, {cells_text(change.opened[0].cells)}."
    if measured.expected is not None:
        todo = measured.expected.todo
        if todo:
            return f"To do first: {todo_sentence(measured, todo[0]).partition(';')[0]}."
        return "Nothing to do: something plays in every situation that is expected."
    played = max(report.gaps, key=lambda gap: gap.telemetry or 0.0, default=None)
    if played is not None and played.telemetry:
        moments = format_percent(played.telemetry)
        return f"To do first: a row for {cells_text(played.cells)}; {moments} of the recorded moments have none."
    if wrong := next((each for each in report.findings if each.level != "info" and each.row is not None), None):
        return f"To do first: {measured.named(wrong.row or 0)}, {wrong.rule}: {wrong.message}"
    if measured.telemetry is not None:
        return "Nothing to do in play: every recorded moment that the list of gaps holds has a valid row."
    if change is not None:
        return "Nothing new to do: this change opened no gap."
    if played is not None:
        cells = cells_text(played.cells)
        return f'To do first: decide whether {cells} can happen. If so, give it a row; if not, exclude it with "assume".'
    return "Nothing to do: every context has a valid row." if report.gaps_complete else "Nothing to do that is known."


def assumed_sentences(report: CoverageReport) -> Iterator[str]:
    """What the share rests on."""
    if report.method == "bounds":
        yield "The count was not finished and nothing was sampled, or samples did not help; --work and --samples allow more."
    if report.weighted:
        yield f"Weighed by the values of {', '.join(report.weighted)}; those of the others count the same."
    if report.assumptions:
        yield f"Only contexts that can happen count: {joined(report.assumptions, MOST_TOLD, '; ')}."
    if report.sampled:
        yield f"Known to samples only: {joined(report.sampled, MOST_TOLD, '; ')}."
    if report.assumed:
        yield f"Without bounds: {joined([f'{name} ({text})' for name, text in report.assumed.items()], MOST_TOLD, '; ')}."


def rows_words(measured: Measured, finding: Finding) -> str:
    """The row of a finding in a list; of a group how many more rows it has."""
    if finding.row is None:
        return finding.message
    more = f" with {plural(len(finding.by), 'other')}" if finding.rule == VARIETY and finding.by else ""
    return measured.named(finding.row) + more


def gaps_sentence(report: CoverageReport) -> str:
    """How many gaps there are, whether these are all, and in which order."""
    if not report.gaps:
        if report.gaps_complete:
            return "No gap: every context has a valid row"
        return "No gap is known, but it is not proved that there is none"
    listed = "all of them" if report.gaps_complete else "there are more"
    moments = [gap.telemetry or 0.0 for gap in report.gaps]
    is_by_moments = has_moments(report) and moments == sorted(moments, reverse=True)  # not where rules are part of the gaps
    order = "those of most recorded moments first" if is_by_moments else "the largest first"
    return f"Contexts without a valid row: {plural(len(report.gaps), 'gap')}, {listed}; {order}"


def nearest_sentence(measured: Measured, gap: Gap) -> str:
    """The row nearest to a gap, and the cells to change."""
    nearest = gap.nearest
    if nearest is None:
        return "there is no row to start from"
    return (
        f"{named_asset(measured, nearest.row)} would, with {joined([f'{n} {c}' for n, c in nearest.cells.items()], MOST_CHANGES)}"
    )


def named_asset(measured: Measured, row: int) -> str:
    """The asset of a row, and where it is."""
    line, file = measured.lines[row], measured.inside.get(row)
    where = row_name(row) if line is None else f"line {line}"
    return f"{measured.assets[row]} ({where}{f' of {file}' if file else ''})"


def gap_sentence(measured: Measured, gap: Gap, most: int = MOST_TOLD) -> str:
    """What to do about a gap."""
    return f"{cells_text(gap.cells, most)}: {_playing(measured)}; {nearest_sentence(measured, gap)}{work_words(measured, gap)}"


def work_words(measured: Measured, gap: Gap) -> str:
    """Who works on a gap, behind a sentence about it; "" where nobody said anything."""
    work = measured.work.get(gap.id)
    return "" if work is None else f" [{work.text}]"


def closed_sentence(measured: Measured) -> str:
    """What of the work on gaps is about none any more."""
    parts = [f"{cells_text(cells)} [{work.text}]" for cells, work in measured.closed]
    return f"In the list of work, and no gap any more: {joined(parts, MOST_CLOSED)}" if parts else ""


def todo_sentence(measured: Measured, todo: Todo) -> str:
    """What to do about a part of an expected situation."""
    own = todo.situation.cells
    more = {name: text for name, text in todo.gap.cells.items() if own.get(name) != text}
    where = f"{todo.situation.text}, where {cells_text(more)}" if more else todo.situation.text
    return f"{where}: {_playing(measured)}; {nearest_sentence(measured, todo.gap)}{work_words(measured, todo.gap)}"


def _playing(measured: Measured) -> str:
    """What the game sees in a gap."""
    return f"only the fallback {measured.fallback} plays" if measured.fallback else "nothing plays"


def overlap_sentence(report: CoverageReport) -> str:
    """How many rows are valid at once."""
    histogram = report.overlap.histogram
    counts = [f"{n or 'none'}: {share_at_once(report, n)}" for n, share in enumerate(histogram[:MOST_COUNTS]) if share > 0.0]
    rest = sum(histogram[MOST_COUNTS:])
    counts += [f"{MOST_COUNTS} or more: {format_percent(rest)}"] if rest > 0.0 else []
    about = "" if report.overlap.method == "exact" else f" (estimated from {report.n_samples:,} samples)"
    return f"on average {report.overlap.mean:.3g}{about}; " + ", ".join(counts) if counts else "nothing was measured"


def histogram_lines(report: CoverageReport) -> Iterator[str]:
    """How much of the contexts has so many valid rows, a line each."""
    for n, share in enumerate(report.overlap.histogram):
        if share > 0.0:
            yield f"  {n:>3}   {share_at_once(report, n):>9}  {'█' * round(40 * share)}".rstrip()


def slice_cells(each: Slice) -> str:
    return ", ".join(f"{name}: {cell}" for name, cell in each.cells.items())


def slice_sentence(each: Slice) -> str:
    """A pair of values with how much of it is covered."""
    named = "" if each.is_named else "; no row names both"
    return f"{covered_text(each)} of {slice_cells(each)} (which is {format_percent(each.share)} of the contexts{named})"


def cells_text(cells: Mapping[str, str], most: int = MOST_TOLD) -> str:
    """Some cells on one line; of many conditions the first few, and how many there are more."""
    texts = [f"{name}: {cell}" for name, cell in list(cells.items())[:most]]
    more = f" and {plural(len(cells) - most, 'more condition')}" if len(cells) > most else ""
    return ", ".join(texts) + more or "every context"


def covered_text(each: Slice) -> str:
    """The covered share of a slice, with its bounds where it is an estimate."""
    if each.covered is None:
        return "unknown"
    if each.is_exact:
        return format_percent(each.covered)
    return " to ".join(distinct_percents(each.lower, each.upper))


def change_sentence(measured: Measured, change: Change) -> str:
    """What became of the covered share and of the gaps since the baseline."""
    at_least = "" if measured.report.method == "exact" else "at least "
    now, before = distinct_percents(measured.report.lower, change.before)
    if change.space:
        changes = "; ".join(change.space)
        return f"covered {at_least}{now}; before {before}, of other contexts: {changes}"
    share = f"covered {at_least}{now}, before {before}" if change.drop else f"covered {at_least}{now}, as before"
    sure = "" if change.is_complete else "; not all gaps could be compared, so some may have been there"
    return f"{share}; {plural(len(change.opened), 'new gap')}, {len(change.closed):,} closed{sure}"


def facts_sentences(seen: Observed) -> Iterator[str]:
    """What is wrong with recorded facts."""
    for word, notes in (("missing", seen.missing), ("outside the domain", seen.outside)):
        texts = [f"{note.condition} in {plural(note.moments, 'moment')}{_examples(note) or _meant(note, seen)}" for note in notes]
        if texts:
            yield f"{word}: {joined(texts, MOST_TOLD)}"
    if seen.unknown_columns:
        yield f"columns that the table does not use: {joined(seen.unknown_columns, MOST_TOLD)}"
    if seen.unread:
        yield f"not read: {joined([file.file for file in seen.unread], MOST_TOLD)}"


def _meant(note: FactNote, seen: Observed) -> str:
    """The column that may have been meant for a fact that is missing everywhere."""
    near = nearest(note.condition, seen.unknown_columns) if note.moments == seen.moments else None
    return f" (is it {in_quotes(near)}?)" if near else ""


def _examples(note: FactNote) -> str:
    return f" ({', '.join(note.examples)})" if note.examples else ""
