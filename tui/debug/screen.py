"""The screen of the debugger: a session, moment by moment. Time above, below it bars, reasons, poses and weights.

A small screen shows one of the four panes below the timeline, a large one all of them. What takes long runs beside the screen.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from rich.text import Text
from textual import work
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.content import Content
from textual.events import Resize
from textual.message import Message
from textual.screen import Screen
from textual.timer import Timer
from textual.widget import Widget
from textual.widgets import Input, Static
from textual.worker import Worker, WorkerState, get_current_worker

from contextdb.console import printable
from contextdb.edits.schema_file import SchemaChange
from contextdb.errors import ContextDBError, MotionError
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.selection.decision import Action
from tui.debug import ladder, reasons
from tui.debug.bars import Bars
from tui.debug.channels import Channels, Dial
from tui.debug.figures import figure_of
from tui.debug.game import Live
from tui.debug.help import DebugHelp
from tui.debug.key_line import DebugKeyLine
from tui.debug.keys import KEYS
from tui.debug.landscape import ORDERS, Row
from tui.debug.recording import MEASURES, Moment, Recording, Turned
from tui.debug.stage import NEARER, TURN, Stage
from tui.debug.timeline import Timeline
from tui.debug.whole import Cancelled, Outcome, outcome_of
from tui.debug.words import channel_costs, detail, instead, named
from tui.debug.writing import write_turned

LARGE = (100, 34)
"""From so many columns and lines on all panes are seen."""
LEAST = (40, 12)
HIGH = 44
PANES = ("bars", "why", "stage", "channels")
TITLES = {"bars": "Bars", "why": "Why", "stage": "Poses", "channels": "Weights"}
FRAME_S = 1.0 / 30.0
LIVE_S = 0.2
"""So often a running game is looked at."""
SAME_S = 1e-6
STYLES = {"head": "bold", "plain": "", "bad": "$error", "good": "$success", "dim": "$foreground 55%"}


@dataclass(frozen=True)
class Start:
    """Where the screen begins: an update, and what is turned."""

    tick: int
    turned: Turned


@dataclass
class RowWanted(Message):
    """Show a row of a table in the sheet."""

    table: str
    """Its file."""
    row: int
    """From 0."""
    column: str | None
    """The first whose cell does not accept its fact."""
    start: Start
    """Where to come back to."""


class DebugScreen(Screen[None]):
    """A session."""

    BINDINGS: ClassVar[list[BindingType]] = [key.binding() for key in KEYS]
    AUTO_FOCUS = "#bars"
    CSS = """
    DebugScreen {
        background: $background;
        #head, #told, #figures, #said, #detail { text-wrap: nowrap; text-overflow: ellipsis; }
        #head { height: 1; background: $panel; text-style: bold; padding: 0 1; }
        #told { height: 2; padding: 0 1; background: $surface; }
        #status { height: 2; padding: 0 1; background: $surface; color: $text-muted; }
        #figures { height: 1; padding: 0 1; color: $text-muted; background: $surface; }
        #said { height: 1; padding: 0 1; }
        #detail { height: 2; padding: 0 1; color: $text-muted; }
        #left, #right { width: 1fr; height: 1fr; }
        #right { width: 1.2fr; }
        #panes { height: 1fr; }
        Bars, Stage, Channels, #why {
            height: 1fr; border-top: solid $foreground 25%; border-title-color: $text-muted;
            &:focus { border-top: solid $primary; border-title-color: $primary; border-title-style: bold; }
        }
        #channels { height: auto; max-height: 50%; min-height: 6; }
        #why { scrollbar-size-vertical: 1; padding: 0 1; background: $surface; }
        #reasons { height: auto; }
        #find { height: 1; border: none; padding: 0 1; background: $boost; display: none; }
        #find.-shown { display: block; }
        #tiny { display: none; }
        &.-small #status { display: none; }
        &.-small #left, &.-small #right { width: 1fr; }
        &.-small #channels { height: 1fr; max-height: 100%; }
        &.-tiny { #tiny { display: block; } #body { display: none; } }
    }
    """

    def __init__(
        self,
        recording: Recording,
        *,
        measures: bool = True,
        live: Live | None = None,
        start: Start | None = None,
        is_inside: bool = False,
    ) -> None:
        super().__init__()
        self._start = start
        self._is_inside = is_inside
        """Whether the screen is one of the editor's: Esc goes back there."""
        self.recording = recording
        self.live = live
        """The game that is followed; None for a recorded session."""
        self.is_now = live is not None
        """Whether the newest moment of the game is shown, and goes on."""
        self.index = 0
        self.turned = Turned()
        self.order = ORDERS[0]
        self.text = ""
        self.banks: dict[str, PoseBank] = recording.saved_banks()
        self.moment: Moment | None = None
        self.outcome: Outcome | None = None
        self._measures = measures
        self._pane = "bars"
        self._is_small = True
        self._follows = True
        """Whether the cursor among the assets goes with what is chosen."""
        self._written: list[SchemaChange] = []
        self._playing: tuple[Timer, float, float] | None = None
        """The timer, when it began, and at which second of the session."""
        self._status: list[tuple[str, str]] = []
        self._recorded = recording.weights()
        self._thresholds = recording.thresholds()

    # ---- what there is

    def compose(self) -> ComposeResult:
        yield Static(id="tiny")
        with Vertical(id="body"):
            yield Static(id="head")
            yield Static(id="told")
            yield Static(id="status")
            yield Timeline(self.recording)
            yield Static(id="figures")
            with Horizontal(id="panes"):
                with Vertical(id="left"):
                    yield Stage()
                    yield Channels()
                with Vertical(id="right"):
                    yield Bars()
                    yield Input(id="find", placeholder="a part of a name, then Enter", compact=True)
                    yield Static(id="detail")
                    with VerticalScroll(id="why"):
                        yield Static(id="reasons")
            yield Static(id="said")
            yield DebugKeyLine()

    def on_mount(self) -> None:
        for name, title in TITLES.items():
            self.query_one(f"#{name}").border_title = title
        self.query_one("#figures", Static).update(Text(self.recording.figures.text))
        first = self.recording.jumps[self.recording.jumps > 0]
        if self.live is not None:
            self.timeline.window_s = None
            self.timeline.grow()
            self._show_at(len(self.recording) - 1)
            self.set_interval(LIVE_S, self.follow)
        else:
            self.go(int(first[0]) if len(first) else 0)
        if self._start is not None:
            self._turn(self._start.turned)
            self.go(int(np.searchsorted(self.recording.line.ticks, self._start.tick)))
        if self.recording.displayed is not None:
            self.timeline.add_strips(self.recording.measured)
        elif self._measures and self.recording.folder:
            self.measure()

    @property
    def timeline(self) -> Timeline:
        """Time."""
        return self.query_one(Timeline)

    @property
    def bars(self) -> Bars:
        """The costs of all frames."""
        return self.query_one(Bars)

    @property
    def stage(self) -> Stage:
        """The poses."""
        return self.query_one(Stage)

    @property
    def channels(self) -> Channels:
        """The weights."""
        return self.query_one(Channels)

    # ---- the layout

    def on_resize(self, event: Resize) -> None:
        """As many panes as there is room for."""
        width, height = event.size
        self._is_small = width < LARGE[0] or height < LARGE[1]
        is_tiny = width < LEAST[0] or height < LEAST[1]
        self.set_class(self._is_small, "-small")
        self.set_class(is_tiny, "-tiny")
        said = f"The screen is too small: {width} x {height}; {LEAST[0]} x {LEAST[1]} is the least."
        self.query_one("#tiny", Static).update(said)
        self.timeline.n_strips = 1 if height < 20 else 2 if self._is_small else 3 if height < HIGH else 5
        self.timeline.refresh(layout=True)
        self._arrange()

    def _arrange(self) -> None:
        """Show the panes that are to be seen."""
        seen = {self._pane} if self._is_small else set(PANES)
        for name in PANES:
            self.query_one(f"#{name}").display = name in seen
        self.query_one("#left").display = bool(seen & {"stage", "channels"})
        self.query_one("#right").display = bool(seen & {"bars", "why"})
        self.query_one("#detail").display = "bars" in seen
        if self.moment is not None:
            self._show_head(self.moment)
        self._show_stage()
        self._show_reasons()

    def action_pane(self, by: int) -> None:
        """Give another pane the focus."""
        self._pane = PANES[(PANES.index(self._pane) + by) % len(PANES)]
        self._arrange()
        self.query_one(f"#{self._pane}").focus()

    # ---- time

    def go(self, index: int) -> None:
        """Show another moment, and stay there."""
        self.is_now = False
        self._show_at(index)

    def follow(self) -> None:
        """Take what the game decided, and show its newest moment, unless another is held."""
        live, line = self.live, self.recording.line
        if live is None:
            return
        tick = int(line.ticks[self.index])
        if live.take():
            self.timeline.grow()
            self.query_one("#figures", Static).update(Text(self.recording.figures.text))
            at = int(np.searchsorted(self.recording.line.ticks, tick))
            if self.is_now:
                self._show_at(len(self.recording) - 1)
            elif at < len(self.recording) and int(self.recording.line.ticks[at]) == tick and self.moment is not None:
                self.index = at
                self.moment = replace(self.moment, index=at, search_index=self.recording.search_at(at))
                self.timeline.go(at)
            else:
                self._show_at(0)
        if self.moment is not None:
            self._show_head(self.moment)

    def _show_at(self, index: int) -> None:
        self.index = min(max(0, index), len(self.recording) - 1)
        self.moment = Moment.of(self.recording, self.index, self.turned)
        self.timeline.go(self.index)
        self._show()

    def on_timeline_scrubbed(self, message: Timeline.Scrubbed) -> None:
        """Go where the mouse is."""
        self.go(message.index)

    def action_step(self, by: int) -> None:
        """Some updates on, or back."""
        self.go(self.index + by)

    def action_jump(self, by: int) -> None:
        """To the next jump, or the one before."""
        jumps = self.recording.jumps
        found = jumps[jumps > self.index] if by > 0 else jumps[jumps < self.index][::-1]
        if len(found):
            self.go(int(found[0]))
        else:
            self.say(f"There is no jump {'behind' if by > 0 else 'before'} this moment.")

    def action_peak(self, by: int) -> None:
        """To the next peak of the chosen measure."""
        found = self.timeline.peak_from(self.index, by > 0)
        if found is None:
            self.say(f"There is no peak of {self.timeline.measure} {'behind' if by > 0 else 'before'} this moment.")
        else:
            self.go(found)
            self.say(f"{self.timeline.measure}: {self._measured(self.timeline.measure)}")

    def action_measure(self) -> None:
        """Choose the next measure."""
        name = self.timeline.next_measure()
        self.say(f"n goes to the next peak of {MEASURES.get(name, name)}; here it is {self._measured(name)}.")

    def _measured(self, name: str) -> str:
        value = float(self.timeline.strips[name][self.index])
        return "not known" if np.isnan(value) else f"{value:.3g}"

    def action_end(self, by: int) -> None:
        """To the start, or the end."""
        if by > 0 and self.live is not None:
            self.is_now = True
            self._show_at(len(self.recording) - 1)
        else:
            self.go(len(self.recording) - 1 if by > 0 else 0)

    def action_zoom(self, by: int) -> None:
        """A shorter stretch of time, or a longer one."""
        self.timeline.zoom(by > 0)

    def action_play(self) -> None:
        """Play from here, or stop; of a running game hold this moment, or go back to now."""
        if self.live is not None:
            if self.is_now:
                self.go(self.index)
            else:
                self.action_end(1)
            return
        if self._playing is not None:
            self._stop_playing()
            return
        if self.index >= len(self.recording) - 1:
            self.go(0)
        timer = self.set_interval(FRAME_S, self._play_on)
        self._playing = (timer, time.monotonic(), float(self.recording.line.times_s[self.index]))

    def _play_on(self) -> None:
        if self._playing is not None:
            _, began, from_s = self._playing
            self.play_to(from_s + time.monotonic() - began)

    def play_to(self, time_s: float) -> None:
        """Show the moment of a second of the session; stop at its end."""
        times = self.recording.line.times_s
        index = int(np.searchsorted(times, time_s + SAME_S, side="right")) - 1
        if index != self.index:
            self.go(index)
        if time_s >= times[-1]:
            self._stop_playing()

    def _stop_playing(self) -> None:
        if self._playing is not None:
            self._playing[0].stop()
            self._playing = None

    # ---- what is shown of a moment

    def _show(self) -> None:
        """Show the moment in all panes."""
        moment = self.moment
        if moment is None:
            return
        self._show_status()
        self._show_head(moment)
        self._show_bars()
        self._show_rest()

    def _show_rest(self) -> None:
        """Show what depends on the cursor among the assets."""
        self._show_detail()
        self._show_channels()
        self._show_stage()
        self._show_reasons()

    def _show_head(self, moment: Moment) -> None:
        decision, line = moment.decision, self.recording.line
        action = "jumps, forced" if line.forced[self.index] else str(decision.action)
        plays = "" if decision.playing is None else f" {named(decision.playing)} at {decision.playing.time_s:.2f} s"
        head = f"{decision.time_s:.2f} s of {line.times_s[-1]:.2f} · tick {decision.tick:,} · {action}{plays}"
        text = Text(printable(f"{self.recording.name}  {head}"))
        if self.live is not None:
            back_s = float(line.times_s[-1]) - decision.time_s
            when = "● now" if self.is_now else f"❚❚ {back_s:.1f} s ago, End: now"
            notes = self.live.notes
            text = Text(f"{when}  ", style="bold") + Text(printable(f"{self.live.name} · tick {decision.tick:,} · {action}{plays}"))
            if notes:
                text = Text(f"! {printable(notes)}  ", style="bold") + text
        self.query_one("#head", Static).update(text)
        told = Text("\n".join(self._told(moment)))
        self.query_one("#told", Static).update(told)

    def _told(self, moment: Moment) -> Iterator[str]:
        """Why, in a line, and what turned weights would make of it."""
        decision = moment.decision
        if decision.searched or decision.action in (Action.START, Action.JUMP):
            yield printable(decision.why)
        elif moment.searched is not None:
            yield printable(f"Nothing was searched. The last search, at {moment.searched.time_s:.2f} s: {moment.searched.why}")
        else:
            yield "Nothing was searched up to here."
        if self.turned and moment.turned is not None and moment.asked is not None:
            yield instead(moment)
        else:
            yield self._facts(moment)

    def _facts(self, moment: Moment) -> str:
        """What the game said of the moment, behind the speeds where these have no line of their own."""
        facts = ", ".join(f"{name} {reasons.fact_text(value)}" for name, value in sorted((moment.decision.context or {}).items()))
        speed = self._status[0][1] if self._is_small and self._status and self._status[0][0] == "m/s" else ""
        return printable(" · ".join(filter(None, (f"m/s {speed}" if speed else "", facts))))

    def _show_status(self) -> None:
        """Speeds and angles, on a line of their own where there is room."""
        self._status = list(self.recording.status_at(self.index).lines())
        text = Text(" · ".join(f"{name} {told}" for name, told in self._status))
        self.query_one("#status", Static).update(text)

    def _show_bars(self) -> None:
        moment, bars = self.moment, self.bars
        assert moment is not None, "a moment is shown"
        rows = moment.landscape.ordered(self.order, self.text, self.recording.uses)
        choice = None if moment.turned is None else moment.turned.choice
        bars.chosen = None if choice is None or choice.database is None else (choice.database, choice.hit.frame)
        before = None if moment.searched is None else moment.searched.before
        bars.playing = None if before is None else (before.database, before.frame)
        note = moment.not_asked
        if not note and not rows:
            note = f"no asset's name holds {self.text!r}" if self.text else "nothing was searched"
        n, n_may = len(rows), sum(row.may_play for row in rows)
        held = f" · name holds {self.text}" if self.text else ""
        bars.border_title = Content(printable(f"{TITLES['bars']} · {n_may} of {n} may play · by {self.order}{held}"))
        bars.show(moment.landscape, rows, note)
        if self._follows:
            bars.to_chosen()

    def _show_detail(self) -> None:
        row, moment = self.bars.row, self.moment
        text = ""
        if row is not None and moment is not None:
            text = "\n".join(detail(moment, row))
        self.query_one("#detail", Static).update(Text(text))

    def _show_channels(self) -> None:
        self.channels.show(list(self._dials()))

    def _dials(self) -> Iterator[Dial]:
        moment, row = self.moment, self.bars.row
        frames = [self.bars.chosen, self.bars.playing, None if row is None else (row.database, row.frame)]
        costs = [{} if frame is None or moment is None else channel_costs(moment, *frame) for frame in frames]
        for name, weight in self._recorded.items():
            own = costs[0].get(name), costs[1].get(name), costs[2].get(name)
            yield Dial(name, True, weight, self.turned.weights.get(name, weight), own)
        for name, threshold in self._thresholds.items():
            yield Dial(name, False, threshold, self.turned.thresholds.get(name, threshold))

    def _show_stage(self) -> None:
        moment = self.moment
        if moment is None or (not self.stage.display and self._is_small):
            return
        row = self.bars.row
        asset = None
        if row is not None and not self.bars.is_in(row, self.bars.chosen):
            database = moment.landscape.searches[row.database].database
            rate = 30.0 if database.schema is None else database.schema.rate
            asset = (row.database, row.asset, row.mirrored, (row.frame - int(database.starts[row.range])) / rate)
        note = "" if self.banks else "no poses: " + (self.recording.missing or "they are being made of the clips")
        how = (
            ""
            if not self.banks
            else " · as shown, blended"
            if self.recording.displayed is not None
            else " · of the clips, not blended"
        )
        self.stage.border_title = f"{TITLES['stage']}{how}"
        self.stage.show(figure_of(self.recording, self.banks, moment, asset), note)

    def _show_reasons(self) -> None:
        moment, row = self.moment, self.bars.row
        if not self.query_one("#why").display or moment is None:
            return
        if row is None or moment.turned is None:
            lines = [reasons.Line(moment.not_asked or "no asset is under the cursor")]
        else:
            lines = reasons.reason_lines(self.recording, moment, row)
        if self._is_small:
            lines += [reasons.Line("how it stands", "head"), *(reasons.Line(f"    {name}  {told}") for name, told in self._status)]
        text = Content.assemble(*((f"{printable(line.text)}\n", STYLES[line.kind]) for line in lines))
        self.query_one("#reasons", Static).update(text)

    # ---- assets

    def on_bars_moved(self, message: Bars.Moved) -> None:
        """Another asset is under the cursor, and stays there at other moments."""
        self._follows = False
        self._show_rest()

    def action_order(self) -> None:
        """Order assets otherwise."""
        self.order = ORDERS[(ORDERS.index(self.order) + 1) % len(ORDERS)]
        self._show_bars()
        self._show_rest()

    def action_chosen(self) -> None:
        """To the chosen asset, and go with it from moment to moment."""
        self._follows = True
        self.bars.to_chosen()
        self._show_rest()

    def action_filter(self) -> None:
        """Ask for a part of a name."""
        if self._is_small and self._pane != "bars":
            self._pane = "bars"
            self._arrange()
        field = self.query_one("#find", Input)
        field.add_class("-shown")
        field.value = self.text
        field.focus()

    def on_input_changed(self, event: Input.Changed) -> None:
        """Show those whose name holds it."""
        self.text = event.value.strip()
        self._show_bars()
        self._show_rest()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Back to the bars; the cursor is at the first of them."""
        self.query_one("#find", Input).remove_class("-shown")
        self.bars.focus()
        if self.text:
            self.bars.go(0)

    def action_sheet(self) -> None:
        """Open the row of the asset in the sheet, or say how."""
        row = self.bars.row
        found = None if row is None else reasons.table_row(self.recording, row)
        if row is None or found is None:
            self.say("No table has a row of this asset.")
            return
        where = Start(int(self.recording.line.ticks[self.index]), self.turned)
        self.post_message(RowWanted(*found, self._failing(row), where))

    def _failing(self, row: Row) -> str | None:
        """The first column whose cell does not accept its fact."""
        moment = self.moment
        return None if moment is None else reasons.failing_column(self.recording, moment, row)

    # ---- weights

    def on_channels_clicked(self, message: Channels.Clicked) -> None:
        """Turn by the mouse."""
        self.action_turn(1 if message.up else -1)

    def action_turn(self, by: int) -> None:
        """Turn the weight, or threshold, under the cursor."""
        dial = self.channels.dial
        if dial is None:
            self.say("There is no weight to turn: " + (self.recording.missing or "the session has no database."))
            return
        now = ladder.turned(dial.now, by > 0)
        weights, thresholds = dict(self.turned.weights), dict(self.turned.thresholds)
        numbers = weights if dial.is_weight else thresholds
        numbers[dial.name] = now
        if now == dial.recorded:
            del numbers[dial.name]
        if dial.is_weight and not any({**self._recorded, **weights}.values()):
            self.say("The weight of every channel would be 0: at least one is to be above it.")
            return
        self._turn(Turned(weights, thresholds))
        keys = "r runs the whole session with it, w writes it, 0 takes it back." if self.turned else "All is as it was recorded."
        self.say(f"{dial.label} {dial.now:g} → {now:g} · {keys}")

    def action_reset(self) -> None:
        """As it was recorded."""
        self._turn(Turned())
        self.say("All is as it was recorded.")

    def _turn(self, turned: Turned) -> None:
        self.turned = turned
        if self.moment is not None:
            self.moment = self.moment.with_turned(turned)
            self._show()

    def action_write(self) -> None:
        """Write what is turned into contextdb.toml."""
        if not self.turned:
            self.say("Nothing is turned: + and - turn the weight under the cursor of the weights.")
            return
        config = self.recording.config
        if config is None:
            self.say(f"There is no project to write into: {self.recording.missing}")
            return
        try:
            done = [change for change in write_turned(self.recording, self.turned) if change is not None]
        except ContextDBError as error:
            self.say(str(error), is_error=True)
            return
        self._written += done
        path = self.recording.schema_file
        self.say(f"{path} says these weights now; u takes it back." if done else f"{path} says so already.")

    def action_undo(self) -> None:
        """Take back what was written last."""
        if not self._written:
            self.say("Nothing was written that could be taken back.")
            return
        while self._written:
            last = self._written[-1]
            assert last.was is not None, "the file was there"
            try:
                SchemaChange(last.path, last.was, last.raw).write()
            except ContextDBError as error:
                self.say(str(error), is_error=True)
                return
            self._written.pop()
        self.say(f"{self.recording.schema_file} is as it was.")

    # ---- what takes long

    def action_run(self) -> None:
        """Run the whole session again with what is turned."""
        if not self.turned:
            self.say("Nothing is turned: + and - turn the weight under the cursor of the weights.")
        elif self.live is not None:
            self.say("A running game cannot be run again: record a session of it with motion.Trace.")
        elif self.recording.missing or not self.recording.databases:
            self.say(f"The session cannot be run again: {self.recording.missing}")
        else:
            self.run_again(self.turned)

    @work(thread=True, exclusive=True, group="run", exit_on_error=False)
    def run_again(self, turned: Turned) -> None:
        """Run the session again, with a bar."""
        try:
            outcome = outcome_of(self.recording, turned, self._progress("the session with these weights"))
        except Cancelled:
            return
        except MotionError as error:
            self.app.call_from_thread(self.say, str(error), True)
            return
        self.app.call_from_thread(self._take_outcome, outcome)

    def _take_outcome(self, outcome: Outcome) -> None:
        self.outcome = outcome
        self.say(outcome.text)

    @work(thread=True, exclusive=True, group="measure", exit_on_error=False)
    def measure(self) -> None:
        """Make the poses of the session, and measure them."""
        progress = self._progress("poses and measures")
        steps = _counted(progress, 3 * len(self.recording))  # the last third is measuring
        try:
            banks = self.recording.open_banks()
            self.app.call_from_thread(self._take_banks, banks)
            strips = self.recording.strips(banks, steps) if banks and self.live is None else {}
        except Cancelled:
            return
        except ContextDBError as error:
            self.app.call_from_thread(self.say, f"No poses: {error.faults[0].message}", True)
            return
        self.app.call_from_thread(self._take_strips, strips)

    def _take_banks(self, banks: dict[str, PoseBank]) -> None:
        self.banks = banks
        self._show_stage()

    def _take_strips(self, strips: Mapping[str, Floats]) -> None:
        self.timeline.add_strips(strips)
        self._show()
        self.say("")

    def _progress(self, what: str) -> Callable[[float], None]:
        """Shows a bar; raises Cancelled once the work is no longer wanted."""
        worker = get_current_worker()

        def progress(share: float) -> None:
            if worker.is_cancelled:
                raise Cancelled
            full = round(20 * share)
            self.app.call_from_thread(self.say, f"{'█' * full}{'░' * (20 - full)} {share:.0%} {what} · Esc ends it")

        return progress

    def on_worker_state_changed(self, event: Worker.StateChanged) -> None:
        """Say why work beside the screen has ended."""
        if event.state is WorkerState.ERROR:
            self.say(str(event.worker.error), is_error=True)

    def action_stop(self) -> None:
        """End what is at work, or show all assets again."""
        field = self.query_one("#find", Input)
        is_at_work = any(worker.is_running for worker in self.workers if worker.node is self)
        if self._playing is not None:
            self._stop_playing()
        elif field.has_class("-shown") or self.text:
            if field.has_focus:
                self.bars.focus()
            field.remove_class("-shown")
            field.value = ""
        elif is_at_work:
            self.workers.cancel_node(self)
            self.say("Ended.")
        elif self._is_inside:
            self.action_quit()

    # ---- the rest

    def say(self, text: str, is_error: bool = False) -> None:
        """Say something over the foot."""
        line = self.query_one("#said", Static)
        line.update(Text(printable(text), style="bold" if is_error else ""))

    def action_orbit(self, yaw: int, pitch: int) -> None:
        """Look from another side."""
        self.stage.look(self.stage.camera.turned(yaw * TURN, pitch * TURN))

    def action_near(self, by: int) -> None:
        """From nearer, or farther away."""
        self.stage.look(self.stage.camera.zoomed(NEARER if by > 0 else 1.0 / NEARER))

    def action_help(self) -> None:
        """The help."""
        self.app.push_screen(DebugHelp())

    def action_quit(self) -> None:
        """Leave."""
        self.workers.cancel_node(self)
        if self._is_inside:
            self.dismiss()
        else:
            self.app.exit()

    def on_descendant_focus(self) -> None:
        """A click gives a pane the focus too."""
        focused = self.focused
        names = [] if focused is None else [part.id for part in focused.ancestors_with_self if isinstance(part, Widget)]
        pane = next((name for name in names if name in PANES), None)
        if pane is not None and pane != self._pane:
            self._pane = pane
            self._arrange()


def _counted(progress: Callable[[float], None], n: int) -> Callable[[], None]:
    """Counts steps for a bar."""
    done = 0

    def step() -> None:
        nonlocal done
        done += 1
        if done % 50 == 0:
            progress(min(1.0, done / max(1, n)))

    return step
