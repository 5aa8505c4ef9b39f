"""What the screen of the debugger shows of a moment of a session: time above, below it bars, reasons, poses and weights.

A small screen shows one of the four panes below the timeline, a large one all of them. What keys do is in `tui.debug.screen`.
"""

from __future__ import annotations

from collections.abc import Iterator

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.content import Content
from textual.events import Resize
from textual.screen import Screen
from textual.widget import Widget
from textual.widgets import Input, Static

from contextdb.cells.words import three_digits
from contextdb.console import printable
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.selection.decision import Action
from contextdb.motion.trace.status import Status

from . import reasons
from .bars import Bars
from .channels import Channels, Dial
from .choosing import NO_FILE, Choosing
from .figures import figure_of
from .game import Live
from .key_line import DebugKeyLine
from .landscape import ORDERS
from .recording import Moment, Recording, Turned
from .stage import Stage
from .timeline import Timeline
from .words import channel_costs, detail, instead, named

LARGE = (100, 34)
"""From so many columns and lines on all panes are seen."""
LEAST = (40, 12)
HIGH = 44
PANES = ("bars", "why", "stage", "channels")
TITLES = {"bars": "Bars", "why": "Why", "stage": "Poses", "channels": "Weights"}
STYLES = {"head": "bold", "plain": "", "bad": "$error", "good": "$success", "dim": "$foreground 55%"}


class MomentScreen(Screen[None]):
    """A moment of a session, in panes."""

    AUTO_FOCUS = "#bars"
    SCOPED_CSS = False  # its rules name this class, not the one that is made of it
    CSS = """
    MomentScreen {
        background: $background;
        #head, #reason, #figures, #message, #detail { text-wrap: nowrap; text-overflow: ellipsis; }
        #head { height: 1; background: $panel; text-style: bold; padding: 0 1; }
        #reason { height: 2; padding: 0 1; background: $surface; }
        #status { height: 3; padding: 0 1; background: $surface; color: $text-muted; }
        #figures { height: 1; padding: 0 1; color: $text-muted; background: $surface; }
        #message { height: 1; padding: 0 1; }
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
        #find.-open { display: block; }
        #tiny { display: none; }
        &.-small #status { display: none; }
        &.-small #left, &.-small #right { width: 1fr; }
        &.-small #channels { height: 1fr; max-height: 100%; }
        &.-tiny { #tiny { display: block; } #body { display: none; } }
    }
    """

    def __init__(self, recording: Recording, live: Live | None = None) -> None:
        super().__init__()
        self.recording = recording
        self.live = live
        """The game that is followed; None for a recorded session."""
        self.is_now = live is not None
        """Whether the newest moment of the game is displayed, and goes on."""
        self.index = 0
        self.turned = Turned()
        self.choosing = Choosing.of(recording.file) if live is None else Choosing("", problem=NO_FILE)
        self.order = ORDERS[0]
        self.text = ""
        self.message = ""
        """What is said over the foot."""
        self.banks: dict[str, PoseBank] = recording.saved_banks()
        self.moment: Moment | None = None
        self._pane = "bars"
        self._is_small = True
        self._follows = True
        """Whether the cursor among the assets goes with what is chosen."""
        self._status: list[tuple[str, str]] = []
        self._recorded = recording.weights()
        self._thresholds = recording.thresholds()

    # ---- what there is

    def compose(self) -> ComposeResult:
        yield Static(id="tiny")
        with Vertical(id="body"):
            yield Static(id="head")
            yield Static(id="reason")
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
            yield Static(id="message")
            yield DebugKeyLine()

    @property
    def timeline(self) -> Timeline:
        return self.query_one(Timeline)

    @property
    def bars(self) -> Bars:
        """The costs of all frames."""
        return self.query_one(Bars)

    @property
    def stage(self) -> Stage:
        return self.query_one(Stage)

    @property
    def channels(self) -> Channels:
        return self.query_one(Channels)

    # ---- the layout

    def on_resize(self, event: Resize) -> None:
        """As many panes as there is room for."""
        width, height = event.size
        self._is_small = width < LARGE[0] or height < LARGE[1]
        is_tiny = width < LEAST[0] or height < LEAST[1]
        self.set_class(self._is_small, "-small")
        self.set_class(is_tiny, "-tiny")
        message = f"The screen is too small: {width} x {height}; {LEAST[0]} x {LEAST[1]} is the least."
        self.query_one("#tiny", Static).update(message)
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
        self._pane = PANES[(PANES.index(self._pane) + by) % len(PANES)]
        self._arrange()
        self.query_one(f"#{self._pane}").focus()

    def on_descendant_focus(self) -> None:
        """A click gives a pane the focus too."""
        focused = self.focused
        names = [] if focused is None else [part.id for part in focused.ancestors_with_self if isinstance(part, Widget)]
        pane = next((name for name in names if name in PANES), None)
        if pane is not None and pane != self._pane:
            self._pane = pane
            self._arrange()

    # ---- display of a moment

    def _show(self) -> None:
        moment = self.moment
        if moment is None:
            return
        self._show_status()
        self._show_head(moment)
        self._show_bars()
        self._show_rest()

    def _show_at(self, index: int) -> None:
        self.index = min(max(0, index), len(self.recording) - 1)
        self.moment = Moment.of(self.recording, self.index, self.turned)
        self.timeline.go(self.index)
        self._show()

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
        reason = Text("\n".join(self._reason_lines(moment)))
        self.query_one("#reason", Static).update(reason)

    def _reason_lines(self, moment: Moment) -> Iterator[str]:
        """Why, in a line, and what turned weights would make of it."""
        decision = moment.decision
        if decision.searched or decision.action in (Action.START, Action.JUMP):
            yield printable(decision.why)
        elif moment.searched is not None:
            yield printable(f"Nothing was searched. The last search, at {moment.searched.time_s:.2f} s: {moment.searched.why}")
        else:
            yield "Nothing was searched up to here."
        if self.turned and moment.turned is not None and moment.repeated is not None:
            yield instead(moment)
        else:
            yield self._facts(moment)

    def _facts(self, moment: Moment) -> str:
        """The facts of the game at the moment, behind the speeds where these have no line of their own."""
        facts = ", ".join(
            f"{name} {three_digits(reasons.fact_text(value))}" for name, value in sorted((moment.decision.context or {}).items())
        )
        speed = self._status[0][1] if self._is_small and self._status and self._status[0][0] == "m/s" else ""
        return printable(" · ".join(filter(None, (f"m/s {speed}" if speed else "", facts))))

    def _show_status(self) -> None:
        """Speeds and angles, in lines of their own where there is room."""
        status = self.recording.status_at(self.index)
        self._status = list(status.lines())
        self.query_one("#status", Static).update(Text("\n".join(_in_lines(status))))

    def _show_bars(self) -> None:
        moment, bars = self.moment, self.bars
        assert moment is not None, "a moment is shown"
        rows = moment.landscape.ordered(self.order, self.text, self.recording.uses)
        choice = None if moment.turned is None else moment.turned.choice
        bars.chosen = None if choice is None or choice.database is None else (choice.database, choice.hit.frame)
        before = None if moment.searched is None else moment.searched.before
        bars.playing = None if before is None else (before.database, before.frame)
        bars.choices = {} if moment.searched is None else self.choosing.at(moment.searched.tick)
        note = moment.not_repeated
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
            lines = [reasons.Line(moment.not_repeated or "no asset is under the cursor")]
        else:
            lines = reasons.reason_lines(self.recording, moment, row)
        if self._is_small:
            widest = max(len(name) for name, _ in self._status)
            lines += [
                reasons.Line("how it stands", "head"),
                *(reasons.Line(f"    {name:<{widest}}  {state}") for name, state in self._status),
            ]
        text = Content.assemble(*((f"{printable(line.text)}\n", STYLES[line.kind]) for line in lines))
        self.query_one("#reasons", Static).update(text)

    # ---- assets

    def on_bars_moved(self, message: Bars.Moved) -> None:
        """Another asset is under the cursor, and stays there at other moments."""
        self._follows = False
        self._show_rest()

    def action_order(self) -> None:
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
        field.add_class("-open")
        field.value = self.text
        field.focus()

    def on_input_changed(self, event: Input.Changed) -> None:
        """Show those whose name holds it."""
        self.text = event.value.strip()
        self._show_bars()
        self._show_rest()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Back to the bars; the cursor is at the first of them."""
        self.query_one("#find", Input).remove_class("-open")
        self.bars.focus()
        if self.text:
            self.bars.go(0)

    # ---- messages

    def say(self, text: str, is_error: bool = False) -> None:
        self.message = text
        line = self.query_one("#message", Static)
        line.update(Text(printable(text), style="bold" if is_error else ""))


def _in_lines(status: Status) -> Iterator[str]:
    """Three lines: what is compared in columns, and the other numbers to its right."""
    numbers = [f"{name} {state}" for name, state in status.numbers()]
    right = [*numbers[:2], " · ".join(numbers[2:])]
    for (name, compared), more in zip(status.compared, right, strict=False):
        cells = [part.ljust(width) for part, width in zip(compared.parts, (14, 20, 20), strict=True)]
        yield f"{name:<7}{''.join(cells)}{more}".rstrip()
