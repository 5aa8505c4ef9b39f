"""The animation of a row beside the table: the figure of the debugger, playing the clip of the asset that is looked at.

Clips are read in a thread, one at a time, once the cursor rests; until then the pane says what it is about to show.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from rich.segment import Segment
from textual import events, work
from textual.app import ComposeResult
from textual.content import Content
from textual.strip import Strip
from textual.timer import Timer
from textual.widgets import Static
from textual.worker import get_current_worker

from contextdb.errors import Fault
from contextdb.tables.table import Table

from ..debug.figures import NO_BONES, NO_PATH, Figure, bones_between, in_body
from ..debug.stage import Stage
from ..model.asset_poses import AssetPoses, PosesOfAssets
from ..widgets.fitted import fitted
from .pane import Shower

RESTS_S = 0.12
"""A cursor that rests so long is followed; one that runs is not."""
FRAMES_A_S = 15
AT_END_S = 0.6
"""A clip stays at its end so long before it begins again, or the next one does."""
NOTHING = "No asset here."
WIDE = 140
"""On a screen of fewer columns the pane is narrow."""


class Clips:
    """The clips of the table of a screen; another version of it in which its project says the same has the same."""

    def __init__(self, table: Callable[[], Table]) -> None:
        self._table = table
        self._poses: tuple[Table, PosesOfAssets] | None = None
        self.is_open = False
        """Whether the panes show them."""

    def of(self) -> PosesOfAssets:
        """Those of the table as it is now."""
        table = self._table()
        if self._poses is None or self._poses[0].schema is not table.schema:
            self.forget()
            self._poses = table, PosesOfAssets(table)
        return self._poses[1]

    def forget(self) -> None:
        """Look for clips again."""
        self._poses = None


class ClipStage(Stage, can_focus=False):
    """The stage without keys of its own; its last line is the time."""

    def __init__(self) -> None:
        super().__init__()
        self.time_line = ""

    def _legend(self, width: int) -> Strip:
        return Strip([Segment(fitted(self.time_line, width), self.rich_style)])


class ClipPane(Shower):
    """The clip of an asset, or those of several in turn."""

    DEFAULT_CSS = """
    ClipPane {
        width: 46; height: 1fr; display: none; background: $background; border-left: solid $panel;
        &.-open { display: block; }
        &.-narrow { width: 30; }
        & > #clip-title { height: auto; max-height: 2; padding: 0 1; text-style: bold; }
        & > #clip-note { height: auto; padding: 0 1; color: $text-muted; }
        & > Stage { height: 1fr; max-height: 24; padding: 0 1; }
    }
    """

    def __init__(self, clips: Clips, assets_here: Callable[[], Sequence[str]]) -> None:
        """`assets_here` gives what its tab shows when the pane opens."""
        super().__init__()
        self._clips, self._assets_here = clips, assets_here
        self._assets: tuple[str, ...] = ()
        """What is shown, one after another."""
        self._at = 0
        self._displayed: AssetPoses | None = None
        self._time_s = 0.0
        self._is_held = False
        self._clock: Timer | None = None
        self._rest: Timer | None = None

    def compose(self) -> ComposeResult:
        yield Static(id="clip-title")
        yield Static(id="clip-note")
        yield ClipStage()

    def on_mount(self) -> None:
        self._clock = self.set_interval(1.0 / FRAMES_A_S, self._tick, pause=True)
        self.turn()

    @property
    def is_open(self) -> bool:
        return self.has_class("-open")

    def turn(self) -> None:
        """Show the pane, or hide it, as the screen says and has room for."""
        self.set_class(self._clips.is_open, "-open")
        self.set_class(self.app.size.width < WIDE, "-narrow")
        self._assets = ()
        self._take(None)
        self.follow(self._assets_here())

    def follow(self, assets: Sequence[str]) -> None:
        """Show the clips of these assets, once the cursor rests."""
        if not self.is_open or (wanted := tuple(dict.fromkeys(assets))) == self._assets:
            return
        self._assets, self._at = wanted, 0
        if self._rest is not None:
            self._rest.stop()
        known = self._clips.of().known(wanted[0]) if wanted else None
        if known is not None or not wanted:
            self._take(known)
        else:
            self._rest = self.set_timer(RESTS_S, self._read_soon)

    def _read_soon(self) -> None:
        if self._assets:
            self.read(self._assets[self._at], self._clips.of())

    @work(thread=True, exclusive=True, group="clip")
    def read(self, asset: str, poses: PosesOfAssets) -> None:
        """Read a clip, and show it if it is still the one that is looked at."""
        known, worker = poses.poses(asset), get_current_worker()
        if not worker.is_cancelled:
            self.app.call_from_thread(self._read, asset, known)

    def _read(self, asset: str, known: AssetPoses | Fault) -> None:
        if self._assets and self._assets[self._at] == asset:
            self._take(known)

    # ---- what is seen

    def _take(self, known: AssetPoses | Fault | None) -> None:
        asset = self._assets[self._at] if self._assets else ""
        count = f" ({self._at + 1} of {len(self._assets)} that may play)" if len(self._assets) > 1 else ""
        self.query_one("#clip-title", Static).update(Content(f"{asset}{count}"))
        if isinstance(known, AssetPoses):
            self.query_one("#clip-note", Static).update(Content(known.source))
            self._show(known)
            return
        text = NOTHING if known is None else known.message
        self.query_one("#clip-note", Static).update(Content(text))
        self._show(None)

    def _show(self, poses: AssetPoses | None) -> None:
        self._displayed, self._time_s = poses, 0.0
        if self._clock is not None:
            is_still = self.app.animation_level == "none"
            if poses is None or is_still or self._is_held:
                self._clock.pause()
            else:
                self._clock.resume()
        self._draw()

    def _tick(self) -> None:
        """A frame later, if the pane is seen."""
        poses = self._displayed
        if poses is None or not self.screen.is_current or not self.region:
            return
        self._time_s += 1.0 / FRAMES_A_S
        if self._time_s > poses.last_s + AT_END_S:
            self._next()
        else:
            self._draw()

    def _next(self) -> None:
        """Begin again, or with the next of several."""
        self._time_s = 0.0
        if len(self._assets) > 1:
            self._at = (self._at + 1) % len(self._assets)
            known = self._clips.of().known(self._assets[self._at])
            if known is None:
                self._read_soon()
            else:
                self._take(known)
        else:
            self._draw()

    def _draw(self) -> None:
        stage, poses = self.query_one(ClipStage), self._displayed
        if poses is None:
            stage.time_line = ""
            stage.show(None)
            return
        time_s = min(self._time_s, poses.last_s)
        stage.time_line = f"{'⏸' if self._is_held else '▶'} {time_s:.1f} of {poses.last_s:.1f} s"
        stage.show(figure_at(poses, time_s))

    def on_click(self, event: events.Click) -> None:
        """Hold the pose, or go on; a drag turns the stage."""
        event.stop()
        self._is_held = not self._is_held
        if self._clock is not None and self._displayed is not None:
            self._clock.pause() if self._is_held else self._clock.resume()
        self._draw()


def figure_at(poses: AssetPoses, time_s: float) -> Figure:
    """What is drawn of a clip at a moment: the body, and the way that it takes over the ground."""
    root = poses.root_at(time_s)
    way, bones = poses.way, bones_between(poses.bones_at(time_s), poses.bank.skeleton.parents)
    path = in_body(way[:, 0], way[:, 1], np.array(root)) if len(way) > 1 else NO_PATH
    return Figure(bones, NO_BONES, NO_BONES, NO_PATH, path, (), root)
