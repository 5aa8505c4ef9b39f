"""What the sections of the Coverage tab list: the columns, the lines, and what each line is about."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from contextdb.covering import CoverageReport, Gap, Nearest, format_percent
from contextdb.tables.gap_work import Work
from contextdb.tables.table import Table
from contextdb.telemetry.observed import SeenGap

from ..model import coverage_lines as lines
from ..model.coverage_run import CoverageRun, Result
from ..model.played_run import Played, PlayedRun
from ..widgets.fitted import bar
from ..widgets.line_list import ListCell, ListColumn

SECTIONS = ("gaps", "pairs", "crowded", "rows", "about", "played", "unused")
NAMES = ("Gaps", "Pairs", "Crowded", "Rows", "About", "Played", "Unused")
OF_PLAY = ("played", "unused")
OF_GAPS = ("gaps", "played")
TONES = {"open": "warning", "animating": "info", "done": "muted"}
MOST_BAR = 40
MOST_WORK = 20
"""The widest column of work."""
COLUMNS = {
    "crowded": (ListColumn("Rows", 5, 0, True), ListColumn("Share", 8, 0, True), ListColumn("Contexts", 30, 1)),
    "rows": (ListColumn("Row", 6, 0, True), ListColumn("Asset", 16, 2, is_name=True), ListColumn("Details", 22, 2)),
    "unused": (ListColumn("Row", 6, 0, True), ListColumn("Asset", 16, 2, is_name=True)),
}

NO_PLAY = "O reads recorded moments from files, L those of the game that is followed."
NEAREST = "The nearest rows: a change of the marked cells would close it"
EMPTY = {
    "gaps": "No gap is known.",
    "crowded": "Nowhere are two rows valid at once, as far as is known.",
    "rows": "No row is redundant.",
}
EMPTY_OF_PLAY = {"played": "Every recorded moment has a valid row.", "unused": "Every row was valid in some recorded moment."}
"""What a list without lines says once the table is measured."""


@dataclass(frozen=True)
class Place:
    """What a line of a list is about: contexts, rows, or both."""

    text: str
    """Everything about it."""
    rows: tuple[int, ...] = ()
    """Its own rows; that nearest to a gap."""
    compared: tuple[int, ...] = ()
    """Its own row and those that it is compared with."""
    cells: Mapping[str, str] | None = None
    """The contexts; None where it is about rows alone."""
    name: str = ""
    """What these contexts are called in the test row."""
    nearest: Nearest | None = None
    column: str | None = None


def labels(result: Result | None, play: Played | None) -> list[str]:
    """The names of the sections, with how many each lists."""
    counts = [""] * len(NAMES)
    if result is not None:
        report = result.report
        more = "" if report.gaps_complete else "+"
        counts[:4] = [f" {len(report.gaps)}{more}", "", f" {len(report.crowded)}", f" {len(report.findings)}"]
    if play is not None:
        counts[5:] = [f" {len(play.gaps)}", f" {len(play.unused)}"]
    return [f"{at + 1} {name}{count}" for at, (name, count) in enumerate(zip(NAMES, counts, strict=True))]


def play_text(played: PlayedRun, table: Table) -> str:
    """What is known of recorded moments, in a line."""
    result = played.result
    if played.reading:
        return f"Reading {played.reading} …"
    if played.problem:
        return f"✗ {played.problem}"
    if result is None:
        return "Which moments of real play have no valid row?"
    is_stale = result.table is not table
    return f"The table has changed since. O or L reads again. Before: {result.headline}" if is_stale else result.headline


def bar_text(run: CoverageRun, width: int) -> str:
    """How far the run is, or how much is covered, as a bar and in words, in a line so wide."""
    report = None if run.result is None else run.result.report
    if run.state != "running" and report is None:
        return ""
    share = run.progress[1]
    low, high, text = (
        (share, share, "Esc stops")
        if run.state == "running" or report is None
        else (report.lower, report.upper, lines.summary_text(report))
    )
    return f"{bar(low, high, max(8, min(MOST_BAR, width - max(46, len(text) + 2))))}  {text}"


def place_of_play(section: str, play: Played, at: int) -> Place:
    """What a line of a list of recorded moments is about."""
    if section == "unused":
        row = play.unused[at]
        return Place(f"{lines.row_text(row, play.table.assets[row])} was valid in no recorded moment. Enter goes there.", (row,))
    gap = play.gaps[at]
    size = f"{format_percent(gap.share)} of the recorded moments, {gap.moments:,.0f}"
    text = f"Gap {at + 1} of {len(play.gaps)}: {size}\n{gap.text}\nT puts a moment of it into the test row, Enter makes a row."
    return Place(text, _row_of(gap.nearest), cells=gap.cells, nearest=gap.nearest)


def place_of_report(section: str, report: CoverageReport, at: int, table: Table) -> Place:
    """What a line of a list of the measured table is about."""
    if section == "gaps":
        gap = report.gaps[at]
        text = lines.gap_text(gap, at, report, table)
        return Place(text, _row_of(gap.nearest), cells=gap.cells, name=f"gap {at + 1}", nearest=gap.nearest)
    if section == "crowded":
        crowd = report.crowded[at]
        return Place(lines.crowd_text(crowd, table), tuple(crowd.rows), cells=crowd.cells, name=f"crowd {at + 1}")
    finding = report.findings[at]
    own = () if finding.row is None else (finding.row,)
    compared = tuple(dict.fromkeys((*own, *finding.by)))
    return Place(lines.finding_text(finding, table), own, compared, column=finding.column)


def gap_columns(section: str, works: Sequence[Work | None] = ()) -> tuple[ListColumn, ...]:
    """Those of a list of gaps; that of the work on them where there is any."""
    what, widest = "Moments" if section == "played" else "Contexts", max((len(one.text) for one in works if one), default=0)
    work = [ListColumn("Work", min(max(widest, 9), MOST_WORK))] if widest else []
    cells = ListColumn(f"{what} without a valid row", 24 if widest else 27, 3)
    return ListColumn("Share", 8, 0, True), ListColumn("Adds", 8, 0, True), cells, *work, ListColumn("Nearest row", 13, 1)


def gap_line(gap: Gap | SeenGap, work: Work | None, has_work: bool) -> Sequence[ListCell]:
    share = (f"{'' if gap.is_exact else '~'}{format_percent(gap.share)}", "strong") if gap.share else ("points", "muted")
    new: ListCell = ("all", "muted") if gap.new_share == gap.share else format_percent(gap.new_share)
    state: ListCell = "" if work is None else (work.text, TONES[work.state])
    works = [state] if has_work else []
    return [share, new, partial(lines.cells_within, gap.cells), *works, lines.nearest_text(gap.nearest)]


def crowd_line(report: CoverageReport, at: int) -> Sequence[ListCell]:
    crowd = report.crowded[at]
    return [(str(crowd.n_rows), "strong"), format_percent(crowd.share), partial(lines.cells_within, crowd.cells)]


def finding_line(report: CoverageReport, at: int) -> Sequence[ListCell]:
    finding = report.findings[at]
    row = "" if finding.row is None else str(finding.row + 1)
    return [row, finding.asset or "", (lines.TITLES.get(finding.rule, finding.rule), finding.level)]


def _row_of(nearest: Nearest | None) -> tuple[int, ...]:
    return () if nearest is None else (nearest.row,)
