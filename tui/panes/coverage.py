"""The Coverage tab: which contexts have no valid row, which conditions together are open, where rows crowd, which are too many."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
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

from contextdb.covering import Gap, Nearest
from contextdb.errors import ContextDBError, in_quotes
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
from ..model.sheet import READS_ONLY, Sheet
from ..screens.ask import AskDialog
from ..widgets.choice_line import ChoiceLine
from ..widgets.line_list import LineList
from . import coverage_places as places
from .coverage_places import OF_GAPS, OF_PLAY, SECTIONS, Place
from .pair_map import PairMap
from .pane import Pane
from .rows_below import IN_TABLE, MOST, RowsBelow


class GapList(LineList):
    """The gaps, largest first."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "choose", "New row for the gap")]


class RowList(LineList):
    """Rows with something about them."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "choose", "Go to the row")]


class CoveragePane(Pane):
    """What a table leaves open."""

    BINDINGS: ClassVar[list[BindingType]] = [
        *(Binding(str(at + 1), f"section({at})", name, show=False) for at, name in enumerate(places.NAMES)),
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
        yield ChoiceLine(places.labels(None, None), id="coverage-sections")
        with ContentSwitcher(initial="gaps"):
            yield GapList(places.gap_columns("gaps"), empty=places.EMPTY["gaps"], id="gaps")
            yield PairMap(id="pairs")
            yield RowList(places.COLUMNS["crowded"], empty=places.EMPTY["crowded"], id="crowded")
            yield RowList(places.COLUMNS["rows"], empty=places.EMPTY["rows"], id="rows")
            yield GapList(places.gap_columns("played"), empty=places.NO_PLAY, id="played")
            yield RowList(places.COLUMNS["unused"], empty=places.NO_PLAY, id="unused")
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
        of_play = places.play_text(self.played, self.sheet.table) if SECTIONS[self.section] in OF_PLAY else ""
        self.query_one("#coverage-state", Static).update(of_play or lines.state_text(run, self.sheet.table))
        self._show_play()
        self._show_bar()
        if run.result is not self._displayed:
            self._displayed = run.result
            if run.result is not None:
                self._fill(run.result)
        unknown = lines.unknown_text(run)
        for name, text in places.EMPTY.items():
            self.query_one(f"#{name}", LineList).say_empty(unknown or text)
        self.set_class(run.state == "stale", "-stale")
        self._show_section()

    def _show_play(self) -> None:
        result = self.played.result
        if result is None or result is self._shown_play:
            return
        self._shown_play = result
        for name, text in places.EMPTY_OF_PLAY.items():
            self.query_one(f"#{name}", LineList).say_empty(text)
        self._list_gaps("played", 0)
        assets = result.table.assets
        self.query_one("#unused", LineList).show(
            len(result.unused), lambda at: [str(result.unused[at] + 1), assets[result.unused[at]]]
        )

    def _show_bar(self) -> None:
        shown = self.query_one("#coverage-bar", Static)
        shown.update(places.bar_text(self.run, shown.size.width))

    def _fill(self, result: Result) -> None:
        report = result.report
        self._list_gaps("gaps", 0)
        self.query_one(PairMap).show_pairs(result.pairs, result.left_out)
        self.query_one("#crowded", LineList).show(len(report.crowded), lambda at: places.crowd_line(report, at))
        self.query_one("#rows", LineList).show(len(report.findings), lambda at: places.finding_line(report, at))
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
        listed.columns = places.gap_columns(section, works)
        listed.show(len(gaps), lambda at: places.gap_line(gaps[at], works[at], has_work), at)

    def _read_work(self) -> None:
        before = self.desk.problem
        self.desk.read(self.sheet.table)
        if self.desk.problem and self.desk.problem != before:
            self.post_message(Notice(self.desk.problem, "warning"))
        for section in OF_GAPS:
            if self._gaps_of(section):
                self._list_gaps(section, self._at(section))

    @property
    def _every_gap(self) -> list[Mapping[str, str]] | None:
        """The gaps of the table as it is saved; None where not all are known."""
        result = self.run.result
        if result is None or self.run.state != "done" or not result.report.gaps_complete or self.sheet.is_modified:
            return None
        return [gap.cells for gap in result.report.gaps]

    def _work_on(self, change: Callable[[Table, Sequence[Mapping[str, str]], int], str]) -> None:
        """Change the work on the gap of the cursor, as it is in the file now."""
        if not self._is_on_gap():
            return
        self.desk.read(self.sheet.table, self._every_gap)
        try:
            gaps = [gap.cells for gap in self._gaps_of(SECTIONS[self.section])]
            message = change(self.sheet.table, gaps, self._at(SECTIONS[self.section]))
        except ContextDBError as error:
            self.post_message(Notice(str(error.faults[0]), "error"))
            return
        self.post_message(Notice(message))
        for each in OF_GAPS:
            self._list_gaps(each, max(0, self._at(each)))

    def _is_on_gap(self) -> bool:
        """Whether the cursor is on a gap whose work may be changed; says why where it is not."""
        if self.sheet.reads_only:
            self.post_message(Notice(READS_ONLY, "warning"))
            return False
        is_gap = bool(self._gaps_of(SECTIONS[self.section])) and self._at_or_none is not None
        if not is_gap:
            self.post_message(Notice("There is no gap here.", "warning"))
        return is_gap

    def action_next_state(self) -> None:
        """Open, animating, done, and off the list."""
        self._work_on(self.desk.step)

    def action_give(self) -> None:
        """Ask who works on the gap of the cursor."""
        if not self._is_on_gap():
            return

        question = "Who makes the animation for this gap? Empty: nobody yet"
        AskDialog("Owner", question, self.desk.last_owner, owner_fault).ask(
            self.app, lambda text: self._work_on(lambda table, gaps, at: self.desk.give(table, gaps, at, text))
        )

    def _show_section(self) -> None:
        name = SECTIONS[self.section]
        self.query_one(ContentSwitcher).current = name
        self.query_one(ChoiceLine).show(places.labels(self.run.result, self.played.result), self.section)
        detail = self.query_one("#coverage-detail")
        detail.display = name != "about"
        if self._details[name] != self._detail:
            self._detail = self._details[name]
            self.query_one("#coverage-detail-text", Static).update(Content(self._detail))
            detail.scroll_home(animate=False)

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
        section = event.list.id or ""
        if section == SECTIONS[self.section]:
            self._show_rows()
        if section in self._details:
            place = self._place(section, event.index)
            self._details[section] = "" if place is None else place.text
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
        play = self.played.result
        of_play = SECTIONS[self.section] in OF_PLAY and play is not None
        table = play.table if of_play and play is not None else self.run.table or self.sheet.table
        rows = () if (place := self._place_here) is None else place.rows
        return [table.text(row, table.asset_column) for row in rows if row < table.n_rows]

    def _place(self, section: str, at: int | None) -> Place | None:
        """What a line of a section is about; None where there is none."""
        result, play = self.run.result, self.played.result
        if at is None or at < 0 or section not in (*OF_GAPS, "crowded", "rows", "unused"):
            return None
        if section in OF_PLAY:
            return None if play is None else places.place_of_play(section, play, at)
        return None if result is None else places.place_of_report(section, result.report, at, self.run.table or self.sheet.table)

    @property
    def _place_here(self) -> Place | None:
        return self._place(SECTIONS[self.section], self._at_or_none)

    @property
    def _at_or_none(self) -> int | None:
        """The line of the cursor in the list that is seen."""
        current = self._current
        return current.index if isinstance(current, LineList) and current.n_lines else None

    def _show_rows(self) -> None:
        """The rows of the table that the line of the cursor is about, where there is room for them; and the clip of one."""
        self.follow_clip()
        below, section, table = self.query_one(RowsBelow), SECTIONS[self.section], self.sheet.table
        play, place = self.played.result, self._place_here
        below.show_none()
        if not self.has_class("-roomy") or section == "about":
            return
        is_known = play is not None and play.table is table if section in OF_PLAY else self.run.state == "done"
        if not is_known:
            return
        if section == "pairs" and (cells := self._cells_here()) is not None:
            self._show_near(below, cells[1], None)
        elif place is None:
            return
        elif section == "unused":
            below.show_rows(table, IN_TABLE, range(table.n_rows), {}, place.rows[0])
        elif section == "crowded":
            below.show_rows(table, "The rows that are valid there at once", list(dict.fromkeys(place.rows)))
        elif section == "rows":
            below.show_compared(table, [row for row in place.compared if row < table.n_rows], {}, place.column)
        elif place.cells is not None:
            self._show_near(below, place.cells, place.nearest)

    def _show_near(self, below: RowsBelow, cells: Mapping[str, str], nearest: Nearest | None) -> None:
        table = self.sheet.table
        if is_near_at_once(table) and cells.keys() <= {c.condition.name for c in table.conditions}:
            near = rows_near(table, cells, MOST, None if nearest is None else nearest.row)
            tones = {(row, name): "warning" for row, names in near.items() for name in names}
            first = next(iter(near.values()), ())
            below.show_rows(table, places.NEAREST, list(near), tones, 0, first[0] if first else None)

    def _at(self, section: str) -> int:
        return self.query_one(f"#{section}", LineList).index

    # ---- what can be done

    def action_read_files(self) -> None:
        """Ask for recorded moments: a file, or a pattern of files."""

        def named(text: str) -> None:
            if text.strip():
                path = self.folder / Path(text.strip()).expanduser()
                self.played.start(self.sheet.table, str(path), text.strip(), self._tell)
                self.action_section(SECTIONS.index("played"))

        question = "A file of recorded moments, or a pattern: session.jsonl, telemetry/*.parquet"
        AskDialog("Recorded moments", question, "", lambda _: "").ask(self.app, named)

    def action_read_live(self) -> None:
        """Take the moments of the game that the test row follows."""
        recorded = self.live()
        if recorded is None:
            self.post_message(Notice("No game and no recording is followed. Alt+U shows the games that run.", "warning"))
            return
        self.played.start_live(self.sheet.table, recorded[1], recorded[0], self._tell)
        self.action_section(SECTIONS.index("played"))

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
        place = self._place(event.list.id or "", event.index)
        if place is not None and event.list.id in OF_GAPS:
            self._fill_gap(place.cells or {}, place.nearest)
        elif place is not None and place.rows:
            self._go_to(place.rows[0], place.column)

    def _fill_gap(self, cells: Mapping[str, str], nearest: Nearest | None) -> None:
        """Ask for a row of these cells, below the one that comes nearest to them."""
        conditions = {c.condition.name: c.condition for c in self.sheet.table.conditions}
        gone = cells.keys() - conditions.keys()
        if gone:
            inside = "is a condition of a table inside: a row for the gap belongs there."
            why = inside if self.sheet.query.is_nested else "is not a condition any more. R measures the coverage again."
            self.post_message(Notice(f"{in_quotes(min(gone))} {why}", "warning"))
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
            return SECTIONS[self.section] in OF_GAPS
        return action != "try_context" or SECTIONS[self.section] in (*OF_GAPS, "pairs", "crowded")

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
        if SECTIONS[self.section] == "pairs":
            cells = self.query_one(PairMap).cells_here()
            return None if cells is None else ("slice", cells)
        place = self._place_here
        return None if place is None or place.cells is None else (place.name, dict(place.cells))
