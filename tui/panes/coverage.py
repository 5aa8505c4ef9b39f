"""The Coverage tab: which contexts have no valid row, which conditions together are open, where rows crowd, which are too many."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import ClassVar

from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical, VerticalScroll
from textual.content import Content
from textual.message import Message
from textual.widget import Widget
from textual.widgets import ContentSwitcher, Static

from contextdb.covering import CoverageReport, Gap, Nearest, format_percent
from contextdb.errors import ContextDBError, in_quotes
from contextdb.tables.gap_work import Work
from contextdb.tables.table import Table
from contextdb.telemetry.observed import SeenGap

from ..messages import FillGap, GoToCell, Notice, SetContext
from ..model import coverage_lines as lines
from ..model.coverage_run import CoverageRun, Result, is_quick
from ..model.gap_desk import GapDesk, owner_fault
from ..model.moment import moment_inside
from ..model.moments import Moment
from ..model.played_run import Played, PlayedRun, moment_in
from ..model.rows_near import is_near_at_once, rows_near
from ..model.sheet import Sheet
from ..screens.ask import AskDialog
from ..widgets.choice_line import ChoiceLine
from ..widgets.fitted import bar
from ..widgets.line_list import LineList, ListCell, ListColumn
from .pair_map import PairMap
from .pane import Pane
from .rows_below import IN_TABLE, MOST, RowsBelow

SECTIONS = ("gaps", "pairs", "crowded", "rows", "about", "played", "unused")
NAMES = ("Gaps", "Pairs", "Crowded", "Rows", "About", "Played", "Unused")
OF_PLAY = ("played", "unused")
NO_PLAY = "O reads recorded moments from files, L those of the game that is followed."
NEAREST = "The nearest rows: a change of the marked cells would close it"
EMPTY = {
    "gaps": "No gap is known.",
    "crowded": "Nowhere are two rows valid at once, as far as is known.",
    "rows": "No row is redundant.",
}
EMPTY_OF_PLAY = {"played": "Every recorded moment has a valid row.", "unused": "Every row was valid in some recorded moment."}
"""What a list without lines says once the table is measured."""


TONES = {"open": "warning", "animating": "info", "done": "muted"}


class GapList(LineList):
    """The gaps, largest first."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "choose", "New row for the gap")]


class RowList(LineList):
    """Rows with something about them."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "choose", "Go to the row")]


class CoveragePane(Pane):
    """What a table leaves open."""

    BINDINGS: ClassVar[list[BindingType]] = [
        *(Binding(str(at + 1), f"section({at})", name, show=False) for at, name in enumerate(NAMES)),
        Binding("left_square_bracket", "turn(-1)", "Section before", show=False),
        Binding("right_square_bracket", "turn(1)", "Next section", show=False),
        Binding("t", "try_context", "To the test row"),
        Binding("s", "next_state", "Next state"),
        Binding("w", "give", "Owner"),
        Binding("r", "measure", "Measure again"),
        Binding("o", "read_files", "Recorded moments"),
        Binding("l", "read_live", "Of the game"),
        Binding("escape", "back", "Stop, or back", show=False),
    ]
    DEFAULT_CSS = """
    CoveragePane {
        layout: vertical; height: 1fr; background: $surface;
        & > #coverage-state { height: auto; max-height: 3; padding: 0 2; text-style: bold; }
        &.-stale > #coverage-state { color: $text-warning; }
        & > #coverage-bar { height: 1; padding: 0 2; color: $text-muted; }
        & > #coverage-sections { margin: 1 0 0 0; }
        & > ContentSwitcher { height: 1fr; }
        & LineList, & HeatMap { height: 1fr; }
        & > #side { dock: right; width: auto; height: 1fr; }
        & HeatMap { padding: 0 2; }
        & #about { padding: 1 2; }
        & > #coverage-detail {
            height: auto; max-height: 45%; border-top: solid $panel; scrollbar-gutter: stable; scrollbar-size-vertical: 1;
        }
        & #coverage-detail-text { padding: 0 2; min-height: 3; height: auto; }
    }
    """

    class Changed(Message):
        """The run has got somewhere; sent from its thread."""

    def __init__(
        self,
        sheet: Sheet,
        run: CoverageRun,
        live: Callable[[], tuple[str, Callable[[], list[Moment]]] | None] = lambda: None,
        folder: Path = Path(),
        *,
        id: str | None = None,  # noqa: A002
    ) -> None:
        """`live` gives the moments of the game that is followed; recordings are looked for from `folder` on."""
        super().__init__(id=id)
        self.sheet, self.run, self.live, self.folder = sheet, run, live, folder
        self.played = PlayedRun()
        self.desk = GapDesk()
        self._shown_play: Played | None = None
        self.section = 0
        self._displayed: Result | None = None
        self._details = dict.fromkeys(SECTIONS, "")
        self._detail = ""

    def compose(self) -> ComposeResult:
        yield Vertical(id="side")
        yield Static(id="coverage-state", markup=False)
        yield Static(id="coverage-bar", markup=False)
        yield ChoiceLine(self._labels(), id="coverage-sections")
        with ContentSwitcher(initial="gaps"):
            yield GapList(_gap_columns("gaps"), empty=EMPTY["gaps"], id="gaps")
            yield PairMap(id="pairs")
            yield RowList(
                [ListColumn("Rows", 5, 0, True), ListColumn("Share", 8, 0, True), ListColumn("Contexts", 30, 1)],
                empty=EMPTY["crowded"],
                id="crowded",
            )
            yield RowList(
                [ListColumn("Row", 6, 0, True), ListColumn("Asset", 16, 2, is_name=True), ListColumn("Details", 22, 2)],
                empty=EMPTY["rows"],
                id="rows",
            )
            yield GapList(_gap_columns("played"), empty=NO_PLAY, id="played")
            yield RowList([ListColumn("Row", 6, 0, True), ListColumn("Asset", 16, 2, is_name=True)], empty=NO_PLAY, id="unused")
            with VerticalScroll(id="about"):
                yield Static(id="about-text", markup=False)
        with VerticalScroll(id="coverage-detail"):
            yield Static(id="coverage-detail-text", markup=False)
        yield RowsBelow(id="coverage-rows")

    def on_mount(self) -> None:
        self.run.listen(self._tell)
        self.show()

    def on_unmount(self) -> None:
        """Listen no more; nobody waits for what runs."""
        self.run.unlisten(self._tell)
        self.run.cancel()
        self.played.close()

    def _tell(self) -> None:
        self.post_message(self.Changed())

    # ---- display

    def show(self) -> None:
        """Bring everything up to date; a small table is measured at once."""
        self.run.follow(self.sheet.table)
        self._read_work()
        if self.run.state in ("none", "stale") and self.is_on_screen_now and is_quick(self.sheet.table):
            self.run.start(self.sheet.table)
        self._show_state()

    @property
    def is_on_screen_now(self) -> bool:
        """Whether the tab is the one that is seen."""
        return self.is_attached and all(node.display for node in self.ancestors_with_self if isinstance(node, Widget))

    @on(Changed)
    def _show_state(self) -> None:
        run = self.run
        of_play = self._play_text() if SECTIONS[self.section] in OF_PLAY else ""
        self.query_one("#coverage-state", Static).update(of_play or lines.state_text(run, self.sheet.table))
        self._show_play()
        self._show_bar()
        if run.result is not self._displayed:
            self._displayed = run.result
            if run.result is not None:
                self._fill(run.result)
        unknown = lines.unknown_text(run)
        for name, text in EMPTY.items():
            self.query_one(f"#{name}", LineList).say_empty(unknown or text)
        self.set_class(run.state == "stale", "-stale")
        self._show_section()

    def _play_text(self) -> str:
        played, result = self.played, self.played.result
        if played.reading:
            return f"Reading {played.reading} …"
        if played.problem:
            return f"✗ {played.problem}"
        if result is None:
            return "Which moments of real play have no valid row?"
        is_stale = result.table is not self.sheet.table
        return f"The table has changed since. O or L reads again. Before: {result.headline}" if is_stale else result.headline

    def _show_play(self) -> None:
        result = self.played.result
        if result is None or result is self._shown_play:
            return
        self._shown_play = result
        for name, text in EMPTY_OF_PLAY.items():
            self.query_one(f"#{name}", LineList).say_empty(text)
        self._list_gaps("played", 0)
        assets = result.table.assets
        self.query_one("#unused", LineList).show(
            len(result.unused), lambda at: [str(result.unused[at] + 1), assets[result.unused[at]]]
        )

    def _show_bar(self) -> None:
        result, width = self.run.result, max(10, min(40, self.size.width - 50))
        if self.run.state == "running":
            share = self.run.progress[1]
            text = f"{bar(share, share, width)}  Esc stops"
        elif result is None:
            text = ""
        else:
            text = f"{bar(result.report.lower, result.report.upper, width)}  {lines.summary_text(result.report)}"
        self.query_one("#coverage-bar", Static).update(text)

    def _fill(self, result: Result) -> None:
        report = result.report
        self._list_gaps("gaps", 0)
        self.query_one(PairMap).show_pairs(result.pairs, result.left_out)
        self.query_one("#crowded", LineList).show(len(report.crowded), lambda at: _crowd_line(report, at))
        self.query_one("#rows", LineList).show(len(report.findings), lambda at: _finding_line(report, at))
        self.query_one("#about-text", Static).update(lines.about_text(result))

    # ---- the list of work

    def _gaps_of(self, section: str) -> Sequence[Gap | SeenGap]:
        if section == "played":
            return () if self.played.result is None else self.played.result.gaps
        return self.run.result.report.gaps if section == "gaps" and self.run.result is not None else ()

    def _list_gaps(self, section: str, at: int) -> None:
        """List gaps, with who works on each."""
        gaps = self._gaps_of(section)
        works = self.desk.of(self.sheet.table, [gap.cells for gap in gaps])
        listed, has_work = self.query_one(f"#{section}", LineList), any(works)
        listed.columns = _gap_columns(section, has_work)
        listed.show(len(gaps), lambda at: _gap_line(gaps[at], works[at], has_work), at)

    def _read_work(self) -> None:
        before = self.desk.problem
        self.desk.read(self.sheet.table)
        if self.desk.problem and self.desk.problem != before:
            self.post_message(Notice(self.desk.problem, "warning"))
        for section in ("gaps", "played"):
            if self._gaps_of(section):
                self._list_gaps(section, self._at(section))

    def _work_on(self, change: Callable[[Table, Sequence[Mapping[str, str]], int], str]) -> None:
        """Change the work on the gap of the cursor, as it is in the file now."""
        section = SECTIONS[self.section]
        gaps, at = self._gaps_of(section), self._at_or_none
        if not gaps or at is None:
            self.post_message(Notice("There is no gap here.", "warning"))
            return
        self.desk.read(self.sheet.table)
        try:
            message = change(self.sheet.table, [gap.cells for gap in gaps], at)
        except ContextDBError as error:
            self.post_message(Notice(str(error.faults[0]), "error"))
            return
        self.post_message(Notice(message))
        for each in ("gaps", "played"):
            self._list_gaps(each, max(0, self._at(each)))

    def action_next_state(self) -> None:
        """Open, animating, done, and off the list."""
        self._work_on(self.desk.step)

    def action_give(self) -> None:
        """Ask who works on the gap of the cursor."""
        if not self._gaps_of(SECTIONS[self.section]) or self._at_or_none is None:
            self.post_message(Notice("There is no gap here.", "warning"))
            return

        def named(text: str | None) -> None:
            if text is not None:
                self._work_on(lambda table, gaps, at: self.desk.give(table, gaps, at, text))

        question = "Who makes the animation for this gap? Empty: nobody yet"
        self.app.push_screen(AskDialog("Owner", question, self.desk.last_owner, owner_fault), named)

    def _show_section(self) -> None:
        name = SECTIONS[self.section]
        self.query_one(ContentSwitcher).current = name
        self.query_one(ChoiceLine).show(self._labels(), self.section)
        detail = self.query_one("#coverage-detail")
        detail.display = name != "about"
        if self._details[name] != self._detail:
            self._detail = self._details[name]
            self.query_one("#coverage-detail-text", Static).update(Content(self._detail))
            detail.scroll_home(animate=False)

    def _labels(self) -> Sequence[str]:
        result = self.run.result
        play = self.played.result
        counts = [""] * 5 if result is None else []
        if result is not None:
            report = result.report
            more = "" if report.gaps_complete else "+"
            counts = [f" {len(report.gaps)}{more}", "", f" {len(report.crowded)}", f" {len(report.findings)}", ""]
        counts += ["", ""] if play is None else [f" {len(play.gaps)}", f" {len(play.unused)}"]
        return [f"{at + 1} {name}{counts[at]}" for at, name in enumerate(NAMES)]

    def on_resize(self) -> None:
        """Draw the bar again, and what there is room for."""
        self._show_bar()
        self.call_after_refresh(self._show_rows)

    def take_focus(self) -> None:
        """Give the keys to the section that is seen."""
        self._current.focus()

    @property
    def _current(self) -> Widget:
        return self.query_one(f"#{SECTIONS[self.section]}", Widget)

    # ---- details

    @on(LineList.Moved)
    def _moved(self, event: LineList.Moved) -> None:
        event.stop()
        result, table = self.run.result, self.sheet.table
        if event.list.id == SECTIONS[self.section]:
            self._show_rows()
        if event.list.id in OF_PLAY:
            self._details[event.list.id] = self._play_detail(event.list.id, event.index)
            self._show_section()
            return
        if result is None or event.list.id not in self._details:
            return
        text, report = "", result.report
        if event.index >= 0 and event.list.id == "gaps":
            text = lines.gap_text(report.gaps[event.index], event.index, report, self.run.table or table)
        elif event.index >= 0 and event.list.id == "crowded":
            text = lines.crowd_text(report.crowded[event.index], self.run.table or table)
        elif event.index >= 0:
            text = lines.finding_text(report.findings[event.index], self.run.table or table)
        self._details[event.list.id] = text
        self._show_section()

    @on(PairMap.Described)
    def _described(self, event: PairMap.Described) -> None:
        event.stop()
        if SECTIONS[self.section] == "pairs":
            self._show_rows()
        self._details["pairs"] = event.text
        self._show_section()

    @property
    def assets_here(self) -> Sequence[str]:
        """The asset of the row nearest to a gap; of rows that crowd, or that something is about, their own."""
        at, section, play, result = self._at_or_none, SECTIONS[self.section], self.played.result, self.run.result
        table, rows = self.run.table or self.sheet.table, []
        if at is None:
            return ()
        if section in OF_PLAY and play is not None:
            table = play.table
            rows = [play.unused[at]] if section == "unused" else _row_of(play.gaps[at].nearest)
        elif section == "gaps" and result is not None:
            rows = _row_of(result.report.gaps[at].nearest)
        elif section == "crowded" and result is not None:
            rows = list(result.report.crowded[at].rows)
        elif section == "rows" and result is not None:
            rows = [row for row in (result.report.findings[at].row,) if row is not None]
        return [table.text(row, table.asset_column) for row in rows if row < table.n_rows]

    @property
    def _at_or_none(self) -> int | None:
        """The line of the cursor in the list that is seen."""
        current = self._current
        return current.index if isinstance(current, LineList) and current.n_lines else None

    def _show_rows(self) -> None:
        """The rows of the table that the line of the cursor is about, where there is room for them; and the clip of one."""
        self.follow_clip()
        below, section, table = self.query_one(RowsBelow), SECTIONS[self.section], self.sheet.table
        result, play = self.run.result, self.played.result
        below.show_none()
        if not self.has_class("-roomy") or section == "about":
            return
        if section == "unused":
            if play is not None and play.table is table and play.unused:
                below.show_rows(table, IN_TABLE, range(table.n_rows), {}, play.unused[self._at(section)])
        elif section == "played":
            if play is not None and play.table is table and play.gaps:
                gap = play.gaps[self._at(section)]
                self._show_near(below, gap.cells, gap.nearest)
        elif result is None or self.run.state != "done":
            return
        elif section == "crowded" and result.report.crowded:
            rows = list(dict.fromkeys(result.report.crowded[self._at(section)].rows))
            below.show_rows(table, "The rows that are valid there at once", rows)
        elif section == "rows" and result.report.findings:
            finding = result.report.findings[self._at(section)]
            rows = [row for row in (finding.row, *finding.by) if row is not None]
            below.show_compared(table, [row for row in dict.fromkeys(rows) if row < table.n_rows], {}, finding.column)
        elif (cells := self._cells_here()) is not None:
            nearest = result.report.gaps[self._at(section)].nearest if section == "gaps" else None
            self._show_near(below, cells[1], nearest)

    def _show_near(self, below: RowsBelow, cells: Mapping[str, str], nearest: Nearest | None) -> None:
        table = self.sheet.table
        if is_near_at_once(table) and cells.keys() <= {c.condition.name for c in table.conditions}:
            near = rows_near(table, cells, MOST, None if nearest is None else nearest.row)
            tones = {(row, name): "warning" for row, names in near.items() for name in names}
            first = next(iter(near.values()), ())
            below.show_rows(table, NEAREST, list(near), tones, 0, first[0] if first else None)

    def _at(self, section: str) -> int:
        return self.query_one(f"#{section}", LineList).index

    def _play_detail(self, section: str, at: int) -> str:
        play = self.played.result
        if play is None or at < 0:
            return ""
        if section == "unused":
            row = play.unused[at]
            return f"{lines.row_text(row, play.table.assets[row])} was valid in no recorded moment. Enter goes there."
        gap = play.gaps[at]
        size = f"{format_percent(gap.share)} of the recorded moments, {gap.moments:,.0f}"
        return f"Gap {at + 1} of {len(play.gaps)}: {size}\n{gap.text}\nT puts a moment of it into the test row, Enter makes a row."

    # ---- what can be done

    def action_read_files(self) -> None:
        """Ask for recorded moments: a file, or a pattern of files."""

        def named(text: str | None) -> None:
            if text is not None and text.strip():
                path = self.folder / Path(text.strip()).expanduser()
                self.played.start(self.sheet.table, str(path), text.strip(), self._tell)
                self.action_section(SECTIONS.index("played"))
                self._show_state()

        question = "A file of recorded moments, or a pattern: session.jsonl, telemetry/*.parquet"
        self.app.push_screen(AskDialog("Recorded moments", question, "", lambda _: ""), named)

    def action_read_live(self) -> None:
        """Take the moments of the game that the test row follows."""
        recorded = self.live()
        if recorded is None:
            self.post_message(Notice("No game and no recording is followed. Alt+U shows the games that run.", "warning"))
            return
        self.played.start_live(self.sheet.table, recorded[1], recorded[0], self._tell)
        self.action_section(SECTIONS.index("played"))
        self._show_state()

    @work(thread=True, exclusive=True)
    def _try_moment(self, play: Played, at: int) -> None:
        """Put the first recorded moment of a gap into the test row; looking for it may take a while."""
        moment = moment_in(play, play.gaps[at])
        message = SetContext(*moment) if moment is not None else Notice("No recorded moment lies in this gap.", "warning")
        self.post_message(message)

    def action_section(self, at: int) -> None:
        had_focus = self.has_focus_within
        self.section = at
        self._show_state()
        self._show_rows()
        self.refresh_bindings()
        if had_focus:
            self.take_focus()

    def action_turn(self, step: int) -> None:
        self.action_section((self.section + step) % len(SECTIONS))

    @on(ChoiceLine.Picked)
    def _picked(self, event: ChoiceLine.Picked) -> None:
        event.stop()
        self.action_section(event.index)
        self.take_focus()

    def action_measure(self) -> None:
        self.run.start(self.sheet.table)

    def action_back(self) -> None:
        """Stop what runs; else leave the pair that is displayed."""
        if self.run.state == "running":
            self.run.cancel()
            self._show_state()
        elif SECTIONS[self.section] == "pairs":
            self.query_one(PairMap).back()

    @on(LineList.Chosen)
    def _chosen(self, event: LineList.Chosen) -> None:
        event.stop()
        result, play = self.run.result, self.played.result
        if event.list.id in OF_PLAY and play is not None:
            if event.list.id == "unused":
                self._go_to(play.unused[event.index])
            else:
                self._fill_gap(play.gaps[event.index].cells, play.gaps[event.index].nearest)
            return
        if result is None:
            return
        report = result.report
        if event.list.id == "gaps":
            self._fill_gap(report.gaps[event.index].cells, report.gaps[event.index].nearest)
        elif event.list.id == "crowded":
            self._go_to(report.crowded[event.index].rows[0])
        elif event.list.id == "rows":
            row = report.findings[event.index].row
            if row is not None:
                self._go_to(row, report.findings[event.index].column)

    def _fill_gap(self, cells: Mapping[str, str], nearest: Nearest | None) -> None:
        """Ask for a row of these cells, below the one that comes nearest to them."""
        conditions = {c.condition.name: c.condition for c in self.sheet.table.conditions}
        gone = cells.keys() - conditions.keys()
        if gone and self.sheet.query.is_nested:
            self.post_message(
                Notice(f"{in_quotes(min(gone))} is a condition of a table inside: a row for the gap belongs there.", "warning")
            )
        elif gone:
            self.post_message(
                Notice(f"{in_quotes(min(gone))} is not a condition any more. R measures the coverage again.", "warning")
            )
        else:
            is_number = {name: conditions[name].domain.type.is_numeric for name in cells}
            typed = {name: lines.as_typed(cell) if is_number[name] else cell for name, cell in cells.items()}
            self.post_message(FillGap(typed, None if nearest is None else nearest.row))

    def _go_to(self, row: int, column: str | None = None) -> None:
        if self.run.state == "stale" and row >= self.sheet.table.n_rows:
            self.post_message(Notice("That row is gone. R measures the coverage again.", "warning"))
        else:
            self.post_message(GoToCell(row, column))

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Only where there are contexts, one can be tried; only on gaps, somebody works."""
        if action in ("next_state", "give"):
            return SECTIONS[self.section] in ("gaps", "played")
        return action != "try_context" or SECTIONS[self.section] in ("gaps", "pairs", "crowded", "played")

    def action_try_context(self) -> None:
        """Put a context of what the cursor is on into the test row."""
        play = self.played.result
        if SECTIONS[self.section] == "played" and play is not None and play.gaps:
            self._try_moment(play, self.query_one("#played", LineList).index)
            return
        gap_cells = self._cells_here()
        if gap_cells is None:
            self.post_message(Notice("There is nothing here to try.", "warning"))
            return
        name, cells = gap_cells
        try:
            facts = moment_inside(cells, self.sheet.query.wanted)
        except ContextDBError as error:
            self.post_message(Notice(str(error.faults[0]), "error"))
            return
        self.post_message(SetContext(facts, name))

    def _cells_here(self) -> tuple[str, dict[str, str]] | None:
        result, section = self.run.result, SECTIONS[self.section]
        if result is None:
            return None
        if section == "pairs":
            cells = self.query_one(PairMap).cells_here()
            return None if cells is None else ("slice", cells)
        if section not in ("gaps", "crowded"):
            return None
        places = result.report.gaps if section == "gaps" else result.report.crowded
        at = self.query_one(f"#{section}", LineList).index
        return (f"gap {at + 1}" if section == "gaps" else f"crowd {at + 1}", dict(places[at].cells)) if places else None


def _gap_columns(section: str, has_work: bool = False) -> tuple[ListColumn, ...]:
    """Those of a list of gaps; that of the work on them where there is any."""
    what = "Moments" if section == "played" else "Contexts"
    work = [ListColumn("Work", 9, 1)] if has_work else []
    cells = ListColumn(f"{what} without a valid row", 24 if has_work else 27, 3)
    return ListColumn("Share", 8, 0, True), ListColumn("Adds", 8, 0, True), cells, *work, ListColumn("Nearest row", 13, 2)


def _gap_line(gap: Gap | SeenGap, work: Work | None, has_work: bool) -> Sequence[ListCell]:
    share = (f"{'' if gap.is_exact else '~'}{format_percent(gap.share)}", "strong") if gap.share else ("points", "muted")
    new: ListCell = ("all", "muted") if gap.new_share == gap.share else format_percent(gap.new_share)
    state: ListCell = "" if work is None else (work.text, TONES[work.state])
    works = [state] if has_work else []
    return [share, new, partial(lines.cells_within, gap.cells), *works, lines.nearest_text(gap.nearest)]


def _crowd_line(report: CoverageReport, at: int) -> Sequence[ListCell]:
    crowd = report.crowded[at]
    return [(str(crowd.n_rows), "strong"), format_percent(crowd.share), partial(lines.cells_within, crowd.cells)]


def _finding_line(report: CoverageReport, at: int) -> Sequence[ListCell]:
    finding = report.findings[at]
    row = "" if finding.row is None else str(finding.row + 1)
    return [row, finding.asset or "", (lines.TITLES.get(finding.rule, finding.rule), finding.level)]


def _row_of(nearest: Nearest | None) -> list[int]:
    return [] if nearest is None else [nearest.row]
