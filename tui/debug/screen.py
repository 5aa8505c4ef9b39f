"""The screen of the debugger: a session, moment by moment, and what its keys do.

What it shows of a moment is in `tui.debug.moment_screen`. What takes long runs beside the screen.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from rich.text import Text
from textual import work
from textual.binding import BindingType
from textual.message import Message
from textual.timer import Timer
from textual.widgets import Input, Static
from textual.worker import Worker, WorkerState, get_current_worker

from contextdb.edits.schema_file import SchemaChange
from contextdb.errors import ContextDBError, MotionError
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.output.bank import PoseBank

from . import ladder, reasons
from .channels import Channels
from .game import Live
from .help import DebugHelp
from .keys import KEYS
from .landscape import Row
from .moment_screen import TITLES, MomentScreen
from .recording import MEASURES, Recording, Turned
from .stage import NEARER, TURN
from .timeline import Timeline
from .whole import Cancelled, Outcome, outcome_of
from .writing import write_turned

FRAME_S = 1.0 / 30.0
LIVE_S = 0.2
"""So often a running game is looked at."""
SAME_S = 1e-6


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


ESC_ENDS = "Esc ends it"
"""How a message ends while something is at work."""


class DebugScreen(MomentScreen):
    """A session."""

    BINDINGS: ClassVar[list[BindingType]] = [key.binding() for key in KEYS]

    def __init__(
        self,
        recording: Recording,
        *,
        measures: bool = True,
        live: Live | None = None,
        start: Start | None = None,
        is_inside: bool = False,
    ) -> None:
        super().__init__(recording, live)
        self._start = start
        self._is_inside = is_inside
        """Whether the screen is one of the editor's: Esc goes back there."""
        self.outcome: Outcome | None = None
        self._measures = measures
        self._written: list[SchemaChange] = []
        self._playing: tuple[Timer, float, float] | None = None
        """The timer, when it began, and at which second of the session."""

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

    def on_timeline_scrubbed(self, message: Timeline.Scrubbed) -> None:
        """Go where the mouse is."""
        self.go(message.index)

    def action_step(self, by: int) -> None:
        """Some updates on, or back."""
        self.go(self.index + by)

    def action_jump(self, by: int) -> None:
        """To the next jump, or the one before."""
        jumps = self.recording.jumps
        frames = jumps[jumps > self.index] if by > 0 else jumps[jumps < self.index][::-1]
        if len(frames):
            self.go(int(frames[0]))
        else:
            self.say(f"There is no jump {'behind' if by > 0 else 'before'} this moment.")

    def action_peak(self, by: int) -> None:
        """To the next peak of the chosen measure."""
        peak = self.timeline.peak_from(self.index, by > 0)
        if peak is None:
            self.say(f"There is no peak of {self.timeline.measure} {'behind' if by > 0 else 'before'} this moment.")
        else:
            self.go(peak)
            self.say(f"{self.timeline.measure}: {self._measured(self.timeline.measure)}")

    def action_measure(self) -> None:
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

    # ---- the sheet

    def action_sheet(self) -> None:
        """Open the row of the asset in the sheet, or say how."""
        row = self.bars.row
        table_row = None if row is None else reasons.table_row(self.recording, row)
        if row is None or table_row is None:
            self.say("No table has a row of this asset.")
            return
        where = Start(int(self.recording.line.ticks[self.index]), self.turned)
        self.post_message(RowWanted(*table_row, self._failing(row), where))

    def _failing(self, row: Row) -> str | None:
        """The first column whose cell does not accept its fact."""
        moment = self.moment
        return None if moment is None else reasons.failing_column(self.recording, moment, row)

    # ---- weights

    def on_channels_clicked(self, message: Channels.Clicked) -> None:
        """Turn by the mouse."""
        self._turn_dial(1 if message.up else -1)

    def action_turn(self, by: int) -> None:
        """Mark the asset under the cursor of the bars; elsewhere turn the weight, or threshold, under the cursor."""
        if self._pane == "bars":
            self.say(self.choosing.mark(self.moment, self.bars.row, by > 0))
            self._show_bars()
        else:
            self._turn_dial(by)

    def _turn_dial(self, by: int) -> None:
        dial = self.channels.dial
        if dial is None:
            self.say("There is no weight to change: " + (self.recording.missing or "the session has no database."))
            return
        now = ladder.turned(dial.now, by > 0)
        weights, thresholds = dict(self.turned.weights), dict(self.turned.thresholds)
        numbers = weights if dial.is_weight else thresholds
        numbers[dial.name] = now
        if now == dial.recorded:
            del numbers[dial.name]
        if dial.is_weight and not any({**self._recorded, **weights}.values()):
            self.say("The weight of every channel would be 0: at least one must be above 0.")
            return
        self._turn(Turned(weights, thresholds))
        keys = "r runs the whole session with it, w writes it, 0 takes it back." if self.turned else "All weights are as recorded."
        self.say(f"{dial.label} {dial.now:g} → {now:g} · {keys}")

    def action_reset(self) -> None:
        """As it was recorded."""
        self._turn(Turned())
        self.say("All weights are as recorded.")

    def _turn(self, turned: Turned) -> None:
        self.turned = turned
        if self.moment is not None:
            self.moment = self.moment.with_turned(turned)
            self._show()

    def action_write(self) -> None:
        """Write what is turned into contextdb.toml."""
        if not self.turned:
            self.say("No weight is changed: in Weights, + and - change the one under the cursor.")
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
        self.say(f"{path} has these weights now; u undoes it." if done else f"{path} has these weights already.")

    def action_undo(self) -> None:
        """Take back what was written last."""
        if not self._written:
            self.say("There is nothing written to undo.")
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
            self.say("No weight is changed: in Weights, + and - change the one under the cursor.")
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
        if self.message.endswith(ESC_ENDS):
            self.say("")
        self._show()

    def _progress(self, what: str) -> Callable[[float], None]:
        """Shows a bar; raises Cancelled once the work is no longer wanted."""
        worker = get_current_worker()

        def progress(share: float) -> None:
            if worker.is_cancelled:
                raise Cancelled
            full = round(20 * share)
            self.app.call_from_thread(self.say, f"{'█' * full}{'░' * (20 - full)} {share:.0%} {what} · {ESC_ENDS}")

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
        elif field.has_class("-open") or self.text:
            if field.has_focus:
                self.bars.focus()
            field.remove_class("-open")
            field.value = ""
        elif is_at_work:
            self.workers.cancel_node(self)
            self.say("Ended.")
        elif self._is_inside:
            self.action_quit()

    # ---- the rest

    def action_orbit(self, yaw: int, pitch: int) -> None:
        """Look from another side."""
        self.stage.look(self.stage.camera.turned(yaw * TURN, pitch * TURN))

    def action_near(self, by: int) -> None:
        """From nearer, or farther away."""
        self.stage.look(self.stage.camera.zoomed(NEARER if by > 0 else 1.0 / NEARER))

    def action_help(self) -> None:
        self.app.push_screen(DebugHelp())

    def action_quit(self) -> None:
        self.workers.cancel_node(self)
        if self._is_inside:
            self.dismiss()
        else:
            self.app.exit()


def _counted(progress: Callable[[float], None], n: int) -> Callable[[], None]:
    """Counts steps for a bar."""
    done = 0

    def step() -> None:
        nonlocal done
        done += 1
        if done % 50 == 0:
            progress(min(1.0, done / max(1, n)))

    return step
