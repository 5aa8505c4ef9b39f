"""What the Coverage tab says: sentences about a report, its gaps, pairs, crowds and rows. Rows count from 1, as in the grid."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from contextdb.cells.words import NUMBER_TEXT
from contextdb.checks.rules import RULES
from contextdb.covering import CoverageReport, Gap, Nearest, PairTable, Slice, format_percent
from contextdb.covering.report import Crowd, distinct_percents
from contextdb.errors import plural
from contextdb.findings import Finding
from contextdb.report.coverage_words import histogram_lines
from contextdb.tables.table import Table

from .coverage_run import CoverageRun, Result

MOST_ROWS_NAMED = 12
SHORT_NAME = 18
"""A condition's name takes so many characters of a line at most."""
_BELOW = re.compile(rf"^\.\.({NUMBER_TEXT})\)$")
_ABOVE = re.compile(rf"^\(({NUMBER_TEXT})\.\.$")

TITLES = {
    "equal-row": "same contexts as another row",
    "identical-rows": "written like another row",
    "subsumed-row": "inside another row",
    "redundant-row": "inside others together",
    "variety": "shares contexts: variety",
    "dead-row": "only impossible contexts",
    "never-chosen": "never chosen",
    "policy-overlap": "valid with another row",
    "no-context": "no context is possible",
}
"""The rules of a coverage report in a few words."""


def state_text(run: CoverageRun, table: Table) -> str:
    """The first line of the tab: the covered share, or how it will be known."""
    state = run.state
    size = f"{plural(table.n_rows, 'row')}, {plural(len(table.conditions), 'condition')}"
    if state == "failed":
        return f"Coverage cannot be worked out. {run.problem}"
    if state == "running":
        part, share = run.progress
        return f"{part or 'Starting'} … {int(100 * share)} %"
    if run.result is None:
        return f"Which contexts have no valid row? R works it out ({size})."
    headline = run.result.headline
    return headline if state == "done" else f"The table has changed since. R measures it again. Before: {headline}"


def unknown_text(run: CoverageRun) -> str:
    """The text instead of an empty list while nothing is known of the table as it is; empty once it is measured."""
    parts = {
        "none": "Not counted yet: R counts.",
        "running": "Counting …",
        "stale": "The table has changed since it was counted.",
        "failed": "Not known.",
        "done": "",
    }
    return parts[run.state]


def summary_text(report: CoverageReport) -> str:
    """What else there is, in a few numbers."""
    many = f"{len(report.gaps)}+ gaps (2 by pairs, 6 as played)"
    n_gaps = plural(len(report.gaps), "gap") if report.gaps_complete else many
    return f"{n_gaps}, on average {report.overlap.mean:.3g} rows valid"


def as_typed(cell: str) -> str:
    """A cell of numbers as people write it, where one end is open: `<0.5 | (3..4]` for `..0.5) | (3..4]`."""
    return " | ".join(_BELOW.sub(r"<\1", _ABOVE.sub(r">\1", part)) for part in cell.split(" | "))


def cells_text(cells: Mapping[str, str]) -> str:
    """Cells on one line."""
    return ", ".join(f"{name}: {as_typed(cell)}" for name, cell in cells.items()) or "every context"


def row_text(row: int, asset: str) -> str:
    """A row as people find it in the grid."""
    return f"row {row + 1} {asset}".rstrip()


def rows_text(rows: Sequence[int]) -> str:
    """Some rows by their numbers in the grid."""
    numbers = ", ".join(f"{row + 1:,}" for row in rows[:MOST_ROWS_NAMED])
    more = f" and {len(rows) - MOST_ROWS_NAMED:,} more" if len(rows) > MOST_ROWS_NAMED else ""
    return f"{'row' if len(rows) == 1 else 'rows'} {numbers}{more}"


def short_name(name: str) -> str:
    """A long name of a condition without its middle: the ends tell conditions of one kind apart."""
    return name if len(name) <= SHORT_NAME else f"{name[: SHORT_NAME // 2]}…{name[1 - SHORT_NAME // 2 :]}"


def cells_within(cells: Mapping[str, str], width: int) -> str:
    """Cells on one line of a list; long names are shortened where the line is too long."""
    whole = cells_text(cells)
    if len(whole) <= width:
        return whole
    return ", ".join(f"{short_name(name)}: {as_typed(cell)}" for name, cell in cells.items()) or whole


def nearest_text(nearest: Nearest | None) -> str:
    """The one cell to change, in few words."""
    if nearest is None:
        return "no row yet"
    change = f"{short_name(nearest.condition)} → {as_typed(nearest.cell)}"
    return f"row {nearest.row + 1}: {change}" if nearest.n_changes == 1 else f"row {nearest.row + 1}: {nearest.n_changes} cells"


def gap_text(gap: Gap, number: int, report: CoverageReport, table: Table) -> str:
    """Everything about a gap."""
    about = "" if gap.is_exact else "about "
    size = f"{about}{format_percent(gap.share)} of the contexts" if gap.share else "single points, of no volume"
    new = f", {format_percent(gap.new_share)} without the gaps above" if gap.new_share != gap.share else ""
    of = f"{len(report.gaps)}{'' if report.gaps_complete else '+'}"
    lines = [f"Gap {number + 1} of {of}: {size}{new}", cells_text(gap.cells)]
    if gap.nearest is not None:
        lines.append(_nearest_sentence(gap.nearest, table))
    return "\n".join(lines)


def _nearest_sentence(nearest: Nearest, table: Table) -> str:
    where = row_text(nearest.row, nearest.asset)
    names = {c.condition.name for c in table.conditions}
    is_there = nearest.row < table.n_rows and nearest.condition in names
    now = table.text(nearest.row, nearest.condition) or "Any" if is_there else "?"
    change = f"{nearest.condition} from {now} to {as_typed(nearest.cell)}"
    if nearest.n_changes == 1:
        return f"Nearest: {where}. It would do to change {change}."
    return f"Nearest: {where}, with {nearest.n_changes} cells to change: first {change}."


def pair_text(pairs: PairTable, one: int, other: int) -> str:
    """What a square of the overview says."""
    names = pairs.conditions[one] if one == other else f"{pairs.conditions[one]} with {pairs.conditions[other]}"
    worst = pairs.worst(one, other)
    if worst is None or worst.covered is None:
        return f"{names}: nothing could be measured."
    slices = pairs.slices(one, other)
    n_named = sum(s.is_named for s in slices)
    least = f"Least covered: {cells_text(worst.cells)}: {covered_text(worst)}."
    kind = "parts" if one == other else "combinations"
    return f"{names}\n{least}\n{n_named} of {len(slices)} {kind} are named by a row. Enter shows them one by one."


def covered_text(slice_: Slice) -> str:
    """The covered share of a slice, and how it is known."""
    if slice_.covered is None:
        return "no context of it is possible, or none was tried"
    if slice_.n_rows == 0:
        return "no row accepts this"
    if slice_.is_exact:
        return f"{format_percent(slice_.covered)} have a valid row"
    ends = " to ".join(distinct_percents(slice_.lower, slice_.upper))
    return f"{ends} have a valid row ({plural(slice_.n_samples, 'sample')})"


def slice_text(slice_: Slice) -> str:
    """What a square of one pair says."""
    size = f" It is {format_percent(slice_.share)} of all contexts." if slice_.share else ""
    if slice_.n_rows == 0:
        return f"{cells_text(slice_.cells)}\nNo row accepts this.{size}"
    names = "some row names it explicitly" if slice_.is_named else "no row names it explicitly"
    rows = f"{plural(slice_.n_rows, 'row')} can be valid here; {names}."
    return f"{cells_text(slice_.cells)}\nOf its contexts {covered_text(slice_)}.{size}\n{rows}"


def crowd_text(crowd: Crowd, table: Table) -> str:
    """Everything about a crowded place."""
    named = [row_text(row, table.assets[row]) for row in list(dict.fromkeys(crowd.rows))[:MOST_ROWS_NAMED] if row < table.n_rows]
    more = f" and {len(crowd.rows) - MOST_ROWS_NAMED} more" if len(crowd.rows) > MOST_ROWS_NAMED else ""
    share = f"{format_percent(crowd.share)} of the contexts" if crowd.share else "a very small part of the contexts"
    return f"{crowd.n_rows} rows at once in {share}: {', '.join(named)}{more}.\n{cells_text(crowd.cells)}"


def in_rows(finding: Finding, table: Table) -> str:
    """The message of a finding with the rows that it names by their numbers in the grid, and not by lines of the file."""
    numbers = {table.place(row).line: row + 1 for row in finding.by if row < table.n_rows}

    def numbered(match: re.Match[str]) -> str:
        row = numbers.get(int(match[1]))
        return match[0] if row is None else f"row {row:,}"

    return re.sub(r"\bline (\d+)\b(?! of )", numbered, finding.message)


def finding_text(finding: Finding, table: Table) -> str:
    """A finding in whole, with its cure."""
    rule, message = RULES.get(finding.rule), in_rows(finding, table)
    by = f" ({rows_text(finding.by)})" if finding.by and message == finding.message else ""
    where = "" if finding.row is None else f"{row_text(finding.row, finding.asset or '')}: "
    cure = f"\n{rule.summary} {rule.cure}" if rule else ""
    return f"{where}{message}{by}{cure}"


def about_text(result: Result) -> str:
    """How the numbers are known, and what was assumed."""
    report, pairs = result.report, result.pairs
    how = {
        "exact": "The covered share is exact.",
        "bounds": "The covered share is between certain bounds; the exact count needs more work than the limit.",
        "estimate": f"The covered share is estimated from {report.n_samples:,} random contexts (seed {report.seed}), "
        "with a confidence of 99 %.",
    }
    lines = [how[report.method]]
    if report.method == "estimate":
        lower, upper = report.certain
        lines.append(f"It is certainly between {format_percent(lower)} and {format_percent(upper)}.")
    given = f"Weights were given for {', '.join(report.weighted)}."
    lines.append(given if report.weighted else "Every value of a condition counts the same, numbers by length.")
    lines += [f"{name} is not fully declared: {what}." for name, what in report.assumed.items()]
    lines += [f"Assumed of every context: {text}" for text in report.assumptions]
    lines += [f"Known to samples only, so that the share is an estimate: {text}" for text in report.sampled]
    lines.append("")
    lines.append(f"Rows valid at once: {report.overlap.mean:.3g} on average ({report.overlap.method}).")
    lines += histogram_lines(report)
    lines.append("")
    if pairs is None:
        lines.append(result.left_out)
    else:
        tried = "all contexts" if pairs.method == "exact" else f"{pairs.n_samples:,} random contexts (seed {pairs.seed})"
        lines.append(f"Pairs of conditions: from {tried}.")
    if not report.findings_complete:
        lines.append("Not every row could be compared within the work allowed: some findings may be missing.")
    return "\n".join(lines)
